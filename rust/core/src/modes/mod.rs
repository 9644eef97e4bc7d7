//! Complex modes and growth of one status combination.

pub(crate) mod complex_modes;
pub(crate) mod first_order;
pub(crate) mod growth;
pub(crate) mod mass_factor;
pub(crate) mod mode;
pub(crate) mod pairs;
pub(crate) mod quadratic_pencil;
pub(crate) mod refinement;
pub(crate) mod solvers;
pub(crate) mod spectrum;

pub use complex_modes::Modes;
pub use growth::{Growth, Verdict};
pub use mode::Mode;
pub use pairs::{JudgedPair, judged_pairs, sparse_pencil};
