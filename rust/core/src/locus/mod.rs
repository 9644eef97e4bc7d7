//! Eigenvalues along a parameter.

pub(crate) mod branches;
pub(crate) mod critical;
pub(crate) mod leading;
pub(crate) mod node;
pub(crate) mod parameter_path;
pub(crate) mod series;
pub(crate) mod sweep;
pub(crate) mod watched_path;

pub use critical::hopf::{HopfSearch, first_hopf_point, hopf_points};
pub use critical::point::{CriticalKind, CriticalPoint};
pub use critical::search::{CriticalSearch, critical_points, stability_limits};
pub use parameter_path::{Path, PathDamping, Piece};
pub use series::{ChebyshevSeries, StaticSeries};
pub use sweep::{Sweep, verdicts_along};
pub use watched_path::WatchedPath;
