//! Phases in which friction depends on slip speed, as Taylor series of the nonlinear equation of motion.

mod balances;
mod bound;
#[cfg(test)]
mod fuzz;
pub(crate) mod motion;
mod neighbours;
pub(crate) mod operator;
mod panel_end;
pub(crate) mod plane;
mod recurrences;
pub(crate) mod series;
mod state_norm;
