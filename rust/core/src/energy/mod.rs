//! Energies, powers and works along a motion.

pub(crate) mod impacts;
pub(crate) mod power;
pub(crate) mod work;

pub use impacts::ImpactWork;
pub use power::{EnergySample, damper_groups, energy_at};
pub use work::{PhaseWork, Works, works};
