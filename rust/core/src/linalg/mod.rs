//! Matrices, eigenproblems and factorizations.

pub(crate) mod components;
pub(crate) mod dense;
pub(crate) mod eigen;
pub(crate) mod eigenpair;
pub(crate) mod parallel;
pub(crate) mod schur;
pub(crate) mod sparse;
pub(crate) mod sparse_factors;
pub(crate) mod sparse_solver;

pub use nalgebra::DMatrix;
pub use sparse::SparseMatrix;
