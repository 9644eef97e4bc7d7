//! Periodic orbits, their stability and branches, and what motions settle to.

pub mod attractors;
pub(crate) mod linearization;
pub mod orbits;
