//! Coordinates in which every gap and every slip is one.

pub(crate) mod contact_coordinates;
mod group;
