//! Masses that couple coordinates: accelerations, and how fast the scene can move.

pub(crate) mod border;
pub(crate) mod coupled_mass;
pub(crate) mod rates;
