//! Phases in which friction depends on slip speed, as Taylor series of the nonlinear equation of motion.

pub(crate) mod law_series;
pub(crate) mod motion;
pub(crate) mod operator;
#[cfg(test)]
mod true_errors;
