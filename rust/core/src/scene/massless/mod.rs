//! Coordinates without mass: where they are, and the scene that is left without them.

pub(crate) mod condensation;
pub(crate) mod coordinates;
