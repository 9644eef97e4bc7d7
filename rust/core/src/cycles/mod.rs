//! Periodic orbits, their stability and branches, and what motions settle to.

pub mod attractors;
pub mod orbits;
