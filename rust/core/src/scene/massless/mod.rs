//! Coordinates without mass: which they are, and the scene without them.

pub(crate) mod condensation;
pub(crate) mod coordinates;
