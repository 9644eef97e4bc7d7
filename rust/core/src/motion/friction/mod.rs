//! Phases in which friction depends on slip speed, as Taylor series of the nonlinear equation of motion.

mod bound;
mod convolutions;
pub(crate) mod law_series;
pub(crate) mod motion;
mod neighbours;
pub(crate) mod operator;
mod panel_end;
mod recurrences;
mod rows;
#[cfg(test)]
mod true_errors;
