//! Random motions under laws of friction.

mod true_errors;
