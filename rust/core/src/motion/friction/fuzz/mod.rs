//! Random motions under laws of friction.

mod bristle_errors;
mod true_errors;
