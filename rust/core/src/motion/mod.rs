//! The motion of one phase as polynomials with error bounds, by modes or by Taylor series.

pub(crate) mod combination_basis;
pub(crate) mod friction;
pub(crate) mod local;
pub(crate) mod method;
pub(crate) mod method_cost;
pub(crate) mod modal;
pub(crate) mod panel;
pub(crate) mod phase_motion;
pub(crate) mod propagators;
mod row_rounding;
pub(crate) mod series;
pub(crate) mod taylor;
#[cfg(test)]
mod true_errors;

pub use friction::series::law_series::{elements_at_rest, law_derivatives};
pub use friction::series::state_derivatives::state_derivatives;
pub use method::Method;
pub use propagators::Propagators;
