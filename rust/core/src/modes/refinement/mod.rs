//! Refinement: eigenvalues and vectors with digits that the matrices hold and the solver loses.

pub(crate) mod columns;
pub(crate) mod inverse_iteration;
pub(crate) mod slow_modes;
pub(crate) mod vectors;
