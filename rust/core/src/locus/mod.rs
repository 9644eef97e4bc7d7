//! Eigenvalues along a parameter.

pub(crate) mod branches;
pub(crate) mod critical;
pub(crate) mod critical_point;
pub(crate) mod exceptional_point;
pub(crate) mod hopf;
pub(crate) mod leading;
pub(crate) mod parameter_path;
pub(crate) mod separation;
pub(crate) mod series;
pub(crate) mod sweep;

pub use critical::critical_points;
pub use critical_point::{CriticalKind, CriticalPoint};
pub use hopf::{HopfSearch, first_hopf_point, hopf_points};
pub use parameter_path::{Path, PathDamping, Piece};
pub use series::{Series, StaticSeries};
pub use sweep::{Sweep, verdicts_along};
