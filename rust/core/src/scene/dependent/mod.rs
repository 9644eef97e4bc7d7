//! Contact directions that depend on each other.

pub(crate) mod fitted;
pub(crate) mod slaved_coordinates;
