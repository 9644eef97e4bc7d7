//! Better eigenvalues and vectors than the solver leaves, where the matrices hold more digits.

pub(crate) mod columns;
pub(crate) mod inverse_iteration;
pub(crate) mod slow_modes;
pub(crate) mod vectors;
