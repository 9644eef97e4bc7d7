//! Steady sliding: whether it exists, and its equilibrium.

pub(crate) mod elements;
pub(crate) mod equilibrium;
pub(crate) mod margins;
