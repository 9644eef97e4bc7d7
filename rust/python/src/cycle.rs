//! Periodic orbits and what motions settle to.

use std::sync::Arc;

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{matrix, vector};
use crate::errors::{named, raise};
use crate::scene::{Scene, method_named};
use crate::trajectory::{Trajectory, integers, kinds};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Cycle {
    inner: core::Cycle,
}

/// (kind, cycle, exponent and the time it was measured over, last stretch of the motion)
pub type Settled = (&'static str, Option<Cycle>, (f64, f64), Option<Trajectory>);

pub fn settled(attractor: core::Attractor, run: Option<core::Trajectory>) -> Settled {
    let run = run.map(Trajectory::new);
    let none = (f64::NAN, f64::NAN);
    match attractor {
        core::Attractor::Equilibrium => ("equilibrium", None, none, run),
        core::Attractor::Cycle(found) => ("cycle", Some(Cycle { inner: found.cycle }), none, run),
        core::Attractor::Aperiodic { exponent, time } => ("aperiodic", None, (exponent, time), run),
        core::Attractor::Unbounded => ("unbounded", None, none, run),
        core::Attractor::Stopped => ("stopped", None, none, run),
    }
}

type Margin = (usize, usize, &'static str, f64, f64, bool);

fn failed(py: Python<'_>, failure: &core::OrbitFailure) -> PyErr {
    match failure {
        core::OrbitFailure::Failed(core::RunFailure::Input(error)) => raise(py, error),
        _ => named(py, "OrbitError", &failure.to_string()),
    }
}

type Real<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

#[pymethods]
impl Cycle {
    #[getter]
    fn period(&self) -> f64 {
        self.inner.orbit.period
    }

    #[getter]
    fn residual(&self) -> f64 {
        self.inner.orbit.residual
    }

    #[getter]
    fn combinations(&self) -> Vec<String> {
        self.inner.orbit.steps.iter().map(|step| step.combination.to_string()).collect()
    }

    #[getter]
    fn durations<'py>(&self, py: Python<'py>) -> Real<'py> {
        let steps = &self.inner.orbit.steps;
        steps.iter().map(|step| step.duration).collect::<Vec<_>>().into_pyarray(py)
    }

    #[getter]
    fn multipliers<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        self.inner.multipliers.values.clone().into_pyarray(py)
    }

    #[getter]
    fn structural_zeros(&self) -> usize {
        self.inner.multipliers.structural_zeros
    }

    #[getter]
    fn is_stable(&self) -> bool {
        self.inner.multipliers.is_stable()
    }

    #[getter]
    fn minimum<'py>(&self, py: Python<'py>) -> Real<'py> {
        self.inner.extremes.minimum.clone().into_pyarray(py)
    }

    #[getter]
    fn maximum<'py>(&self, py: Python<'py>) -> Real<'py> {
        self.inner.extremes.maximum.clone().into_pyarray(py)
    }

    fn trajectory(&self, py: Python<'_>) -> PyResult<Trajectory> {
        let run = self.inner.orbit.trajectory().map_err(|error| raise(py, &error))?;
        Ok(Trajectory::new(run))
    }

    /// Everything but the scene, as numbers and names; `Scene.cycle` takes it.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let record = self.inner.record();
        let kinds: Vec<&str> = record.kinds.iter().map(|kind| kind.name()).collect();
        let dict = PyDict::new(py);
        dict.set_item("method", record.method.name())?;
        dict.set_item("combinations", record.combinations)?;
        dict.set_item("states", record.states.into_pyarray(py))?;
        dict.set_item("durations", record.durations.into_pyarray(py))?;
        dict.set_item("contacts", integers(py, &record.contacts))?;
        dict.set_item("kinds", kinds)?;
        dict.set_item("period", record.period)?;
        dict.set_item("residual", record.residual)?;
        Ok(dict)
    }

    /// Derivative of the flow over a period, in contact coordinates.
    fn monodromy<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        let monodromy = self.inner.orbit.monodromy().map_err(|failure| failed(py, &failure))?;
        let size = monodromy.len().isqrt();
        matrix(py, size, size, monodromy)
    }

    /// Coefficients of the displacement, one row per harmonic from 0 to `count`.
    fn harmonics<'py>(
        &self,
        py: Python<'py>,
        count: usize,
    ) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        use numpy::PyArrayMethods;
        let orbit = &self.inner.orbit;
        let harmonics = py.detach(|| orbit.harmonics(count)).map_err(|error| raise(py, &error))?;
        let columns = harmonics.displacement.len() / (count + 1);
        harmonics.displacement.into_pyarray(py).reshape([count + 1, columns])
    }

    /// (phase, contact, kind, lowest value, time, whether it is a local minimum) of event functions that
    /// end no phase.
    fn margins(&self, py: Python<'_>) -> PyResult<Vec<Margin>> {
        let orbit = &self.inner.orbit;
        let margins = py.detach(|| orbit.margins()).map_err(|error| raise(py, &error))?;
        Ok(margins
            .iter()
            .map(|m| (m.step, m.contact, m.kind.name(), m.value, m.time, m.interior))
            .collect())
    }

    /// Whether a run from the orbit keeps to its event sequence.
    fn is_followed(&self, py: Python<'_>) -> bool {
        py.detach(|| self.inner.orbit.is_followed())
    }

    /// The orbit with the same event sequence in another scene.
    fn continued(&self, py: Python<'_>, scene: &Scene) -> PyResult<Self> {
        let cycle =
            py.detach(|| self.inner.orbit.continued(&scene.inner).and_then(core::Cycle::new));
        Ok(Self { inner: cycle.map_err(|failure| failed(py, &failure))? })
    }
}

/// An orbit from its record.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Record<'py> {
    method: String,
    combinations: Vec<String>,
    states: PyReadonlyArray1<'py, f64>,
    durations: PyReadonlyArray1<'py, f64>,
    contacts: Vec<usize>,
    kinds: Vec<String>,
    period: f64,
    residual: f64,
}

impl Record<'_> {
    pub fn cycle(self, py: Python<'_>, scene: &Arc<core::Scene>) -> PyResult<Cycle> {
        let record = core::CycleRecord {
            method: method_named(py, &self.method)?,
            combinations: self.combinations,
            states: vector(&self.states),
            durations: vector(&self.durations),
            contacts: self.contacts,
            kinds: kinds(py, &self.kinds)?,
            period: self.period,
            residual: self.residual,
        };
        let cycle = py.detach(|| core::Cycle::from_record(scene, &record));
        Ok(Cycle { inner: cycle.map_err(|failure| failed(py, &failure))? })
    }
}

/// What the motions of many scenes settle to.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "a list of the parts of states")]
pub fn settle_all(
    py: Python<'_>,
    scenes: Vec<PyRef<'_, Scene>>,
    starts: Vec<(numpy::PyReadonlyArray1<'_, f64>, numpy::PyReadonlyArray1<'_, f64>, String)>,
    stretch: f64,
    limit: f64,
) -> PyResult<Vec<(Settled, String)>> {
    let mut cases = Vec::with_capacity(scenes.len());
    for (scene, (position, velocity, combination)) in scenes.iter().zip(&starts) {
        let state = scene.start(py, position, velocity, combination)?;
        scene.inner.start_coordinates(&state).map_err(|error| raise(py, &error))?;
        cases.push((scene.inner.clone(), state));
    }
    let interrupted = || Python::attach(|py| py.check_signals().is_err());
    let search = core::Search {
        stretch,
        limit,
        method: core::Method::Auto,
        interrupted: Some(&interrupted),
    };
    let found = py.detach(|| core::settle_all(&cases, search));
    py.check_signals()?;
    found
        .into_iter()
        .map(|result| {
            let (attractor, run) = result.map_err(|error| raise(py, &error))?;
            let message = crate::trajectory::stop_message(&run.stop_reason);
            Ok((settled(attractor, Some(run)), message))
        })
        .collect()
}
