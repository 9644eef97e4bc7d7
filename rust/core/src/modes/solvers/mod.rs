//! All modes of a quadratic problem at once, with damping in proportion and with any.

pub(crate) mod general;
pub(crate) mod problem;
pub(crate) mod proportional;
