//! Many runs at once.

use std::sync::{Arc, Mutex, MutexGuard};

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use stickslip_core as core;

use crate::convert::{method_named, stops_at_grazing, vector};
use crate::errors::{named, raise_failure};
use crate::interrupt::{PATIENCE, detached};
use crate::scene::model::{Scene, StatusInput};
use crate::trajectory::Trajectory;

#[pyclass(frozen, module = "stickslip._core")]
pub struct Batch {
    inner: Mutex<core::transient::Batch>,
}

impl Batch {
    /// A poisoned lock only means that a run panicked after it was taken out.
    fn lock(&self) -> MutexGuard<'_, core::transient::Batch> {
        self.inner.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "one argument per keyword of the Python function")]
    fn new(
        py: Python<'_>,
        duration: f64,
        method: &str,
        max_events: Option<usize>,
        time_limit: Option<f64>,
        accumulation_tolerance: f64,
        on_grazing: &str,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let settings = core::transient::RunSettings {
            duration,
            method: method_named(py, method)?,
            controls: core::Controls {
                max_events,
                time_limit,
                accumulation_tolerance,
                stop_at_grazing: stops_at_grazing(py, on_grazing)?,
                ..core::Controls::default()
            },
        };
        let batch = core::transient::Batch::new(settings, threads)
            .map_err(|error| named(py, "InputError", &format!("threads: {error}")))?;
        Ok(Self { inner: Mutex::new(batch) })
    }

    #[getter]
    fn threads(&self) -> usize {
        self.lock().threads()
    }

    /// Runs from the sliding equilibrium where `start` is None; `added_*` is added to the start.
    #[pyo3(signature = (scene, start, added_position, added_velocity))]
    fn submit(
        &self,
        py: Python<'_>,
        scene: &Scene,
        start: Option<(PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>, StatusInput)>,
        added_position: Option<PyReadonlyArray1<'_, f64>>,
        added_velocity: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<()> {
        let start = match start {
            Some((position, velocity, combination)) => {
                Some(scene.start(py, &position, &velocity, &combination)?)
            }
            None => None,
        };
        let added = |values: Option<PyReadonlyArray1<'_, f64>>| {
            values.map_or(Vec::new(), |values| vector(&values))
        };
        self.lock().submit(core::transient::Job {
            scene: Arc::clone(scene.core(py)?),
            start,
            added_position: added(added_position),
            added_velocity: added(added_velocity),
        });
        Ok(())
    }

    /// (position, velocity, combination, friction forces, states of contacts, trajectory) of the oldest run, or the error that kept it from starting.
    fn collect<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if self.lock().pending() == 0 {
            return Err(named(py, "InputError", "collect: no run was submitted"));
        }
        loop {
            let outcome = detached(py, || self.lock().collect(PATIENCE))?;
            match outcome {
                Some(Ok((start, run))) => {
                    let parts = (
                        start.position.into_pyarray(py),
                        start.velocity.into_pyarray(py),
                        start.combination.to_string(),
                        start.friction_force,
                        start.internal,
                        Trajectory::new(run),
                    );
                    return Ok(parts.into_pyobject(py)?.into_any());
                }
                Some(Err(failure)) => {
                    return Ok(raise_failure(py, &failure)
                        .into_value(py)
                        .into_bound(py)
                        .into_any());
                }
                None => py.check_signals()?,
            }
        }
    }

    /// Stops every run; each is still collected, as far as it came.
    fn stop(&self) {
        self.lock().stop();
    }
}
