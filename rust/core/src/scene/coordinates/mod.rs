//! Contact coordinates: every gap and every slip is a coordinate.

pub(crate) mod contact_coordinates;
mod group;
