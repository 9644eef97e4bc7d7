//! What motions settle to.

use std::time::{Duration, Instant};

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use stickslip_core as core;

use crate::convert::method_named;
use crate::cycle::{Cycle, failed};
use crate::errors::raise;
use crate::interrupt::{computed, detached, heard, listening, raised, until_interrupted};
use crate::scene::model::{Scene, StatusInput};
use crate::trajectory::Trajectory;

/// (Lyapunov exponent, its standard error, the time it was measured over)
type Growth = (f64, f64, f64);

/// (kind, cycle, growth, last stretch of the motion)
type Settled = (&'static str, Option<Cycle>, Growth, Option<Trajectory>);

fn settled(attractor: core::Attractor, run: Option<core::Trajectory>) -> Settled {
    let run = run.map(Trajectory::new);
    let none = (f64::NAN, f64::NAN, f64::NAN);
    match attractor {
        core::Attractor::Equilibrium => ("equilibrium", None, none, run),
        core::Attractor::Cycle(found) => ("cycle", Some(Cycle { inner: found.cycle }), none, run),
        core::Attractor::Aperiodic(core::cycles::attractors::Lyapunov {
            exponent,
            error,
            time,
        }) => ("aperiodic", None, (exponent, error, time), run),
        core::Attractor::Unbounded => ("unbounded", None, none, run),
        core::Attractor::Stopped => ("stopped", None, none, run),
    }
}

type Start<'py> = (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>, StatusInput);
/// What a motion settles to and why its last stretch ended.
type Found = (Settled, String);

/// A search that is under way, as another thread sees it.
#[pyclass(frozen)]
pub struct Watch {
    cancel: core::Cancel,
}

#[pymethods]
impl Watch {
    #[new]
    fn new() -> Self {
        Self { cancel: listening() }
    }

    /// The motion that the search has followed so far, s.
    #[getter]
    fn followed(&self) -> f64 {
        self.cancel.followed()
    }
}

/// What a run has settled to, and the motion of `limit` seconds more if it takes that to say; the search computes for
/// at most `time_limit` seconds.
#[pyfunction]
pub fn attractor(
    py: Python<'_>,
    trajectory: &Trajectory,
    limit: f64,
    method: &str,
    time_limit: Option<f64>,
    watch: &Watch,
) -> PyResult<Settled> {
    let (run, method) = (trajectory.core(), method_named(py, method)?);
    let patience = time_limit.and_then(|limit| Duration::try_from_secs_f64(limit).ok());
    let search = core::cycles::attractors::SearchLimits {
        stretch: run.end,
        limit,
        method,
        cancel: Some(&watch.cancel),
        // So long that no clock holds its end is without end.
        deadline: patience.and_then(|patience| Instant::now().checked_add(patience)),
    };
    let found = detached(py, || core::cycles::attractors::settled_from(run, search))?;
    let (attractor, last) = found.map_err(|error| raise(py, &error))?;
    raised(py)?;
    py.check_signals()?;
    Ok(settled(attractor, last))
}

/// The cycle that Newton's method finds from the end of a run, stable or not; None where nothing of it comes back.
#[pyfunction]
pub fn closed(py: Python<'_>, trajectory: &Trajectory, method: &str) -> PyResult<Option<Cycle>> {
    let (run, method, cancel) = (trajectory.core(), method_named(py, method)?, listening());
    let search = core::cycles::attractors::SearchLimits {
        stretch: 0.0,
        limit: 0.0,
        method,
        cancel: Some(&cancel),
        deadline: None,
    };
    let found = detached(py, || core::cycles::attractors::closed(run, search))?;
    heard()?;
    let cycle = found.map_err(|failure| failed(py, &failure))?;
    Ok(cycle.map(|inner| Cycle { inner }))
}

/// What the motions of many scenes settle to, and the exception that interrupted the search, if one did: what
/// was not done by then is None. The last stretches come with them if `runs`.
#[pyfunction]
pub fn settle_all(
    py: Python<'_>,
    scenes: Vec<PyRef<'_, Scene>>,
    starts: Vec<Start<'_>>,
    stretch: f64,
    limit: f64,
    runs: bool,
) -> PyResult<(Vec<Option<Found>>, Option<PyErr>)> {
    let mut cases = Vec::with_capacity(scenes.len());
    for (scene, (position, velocity, combination)) in scenes.iter().zip(&starts) {
        let scene: &Scene = scene;
        let state = scene.start(py, position, velocity, combination)?;
        let propagators = scene.propagators(py)?;
        computed(py, || core::contact::start_coordinates(propagators.moving(), &state))?;
        cases.push((propagators.clone(), state));
    }
    let (found, exception) = py.detach(|| {
        until_interrupted(|cancel| {
            let search = core::cycles::attractors::SearchLimits {
                stretch,
                limit,
                method: core::Method::Auto,
                cancel: Some(cancel),
                deadline: None,
            };
            core::cycles::attractors::settle_all(&cases, search)
        })
    })?;
    let found = found.into_iter().map(|result| {
        let Some(result) = result else { return Ok(None) };
        match result {
            Ok((attractor, run)) => {
                let message = run.stop_reason.to_string();
                Ok(Some((settled(attractor, runs.then_some(run)), message)))
            }
            Err(core::RunFailure::Input(error)) => Err(raise(py, &error)),
            Err(failure) => {
                Ok(Some((settled(core::Attractor::Stopped, None), failure.to_string())))
            }
        }
    });
    Ok((found.collect::<PyResult<_>>()?, exception))
}
