//! Steady sliding: where it exists, and where everything then is.

pub(crate) mod equilibrium;
pub(crate) mod margins;
