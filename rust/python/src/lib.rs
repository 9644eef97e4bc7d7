//! `stickslip._core`: the core for Python. Conversion only; what each thing means stands in the core.

mod attractors;
mod batch;
mod convert;
mod cycle;
mod energy;
mod errors;
mod interrupt;
mod modes;
mod parameters;
mod scene;
mod trajectory;

use mimalloc::MiMalloc;
use pyo3::prelude::*;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// The compiled core of stickslip.
#[pymodule(gil_used = false)]
mod _core {
    #[pymodule_export]
    use crate::attractors::{Watch, attractor, closed, settle_all};
    #[pymodule_export]
    use crate::batch::Batch;
    #[pymodule_export]
    use crate::cycle::{Cycle, Orbit};
    #[pymodule_export]
    use crate::energy::{Works, energy, works};
    #[pymodule_export]
    use crate::modes::Reduced;
    #[pymodule_export]
    use crate::parameters::path::Path;
    #[pymodule_export]
    use crate::parameters::study::{Family, answers, arithmetic, verdicts};
    #[pymodule_export]
    use crate::scene::chain::chain;
    #[pymodule_export]
    use crate::scene::model::Scene;
    #[pymodule_export]
    use crate::trajectory::Trajectory;
}
