//! Random motions under laws of friction.

mod state_errors;
mod true_errors;
