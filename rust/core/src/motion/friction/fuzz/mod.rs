//! Random motions under laws of friction.

mod plane_errors;
mod spring_errors;
mod state_errors;
mod true_errors;
