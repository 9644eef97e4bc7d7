//! Energies, powers and works along a motion.

pub(crate) mod power;
pub(crate) mod work;

pub use power::{EnergySample, damper_groups, energy_at};
pub use work::{ImpactWork, PhaseWork, Works, works};
