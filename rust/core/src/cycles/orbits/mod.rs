//! Periodic orbits, their multipliers, and branches of orbits.

pub(crate) mod arclength;
pub(crate) mod cycle;
pub(crate) mod floquet;
pub(crate) mod harmonics;
pub(crate) mod orbit;
pub(crate) mod record;
pub(crate) mod shooting;

pub use arclength::{Correction, Sides, Tangent};
pub use cycle::{Cycle, Extremes, Margin, Stability};
pub use floquet::Multipliers;
pub use harmonics::Harmonics;
pub use orbit::{Orbit, OrbitFailure, OrbitPhase};
pub use record::CycleRecord;
