//! Computed motions.

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use stickslip_core as core;

use crate::convert::{matrix, method_named, read_record, stops_at_grazing, vector};
use crate::interrupt::{computed, detached, listening, raised};
use crate::scene::model::{Scene, StatusInput};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Trajectory {
    inner: core::Trajectory,
}

type Matrix<'py> = Bound<'py, PyArray2<f64>>;
type Sample<'py> = (Matrix<'py>, Matrix<'py>, Matrix<'py>, Matrix<'py>, Bound<'py, PyArray2<u8>>);
/// Position, velocity, combination, friction forces and states of contacts.
type StateParts<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, String, Vec<f64>, Vec<f64>);
type ModalRun<'py> = (String, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<Complex64>>);

impl Trajectory {
    pub fn new(inner: core::Trajectory) -> Self {
        Self { inner }
    }

    pub fn core(&self) -> &core::Trajectory {
        &self.inner
    }
}

#[pymethods]
impl Trajectory {
    #[allow(clippy::too_many_arguments, reason = "one argument per keyword of the Python function")]
    #[staticmethod]
    fn simulate(
        py: Python<'_>,
        scene: &Scene,
        position: PyReadonlyArray1<'_, f64>,
        velocity: PyReadonlyArray1<'_, f64>,
        combination: StatusInput,
        duration: f64,
        method: &str,
        max_events: Option<usize>,
        time_limit: Option<f64>,
        accumulation_tolerance: f64,
        on_grazing: &str,
    ) -> PyResult<Self> {
        let start = scene.start(py, &position, &velocity, &combination)?;
        let method = method_named(py, method)?;
        let cancel = listening();
        let stop_at_grazing = stops_at_grazing(py, on_grazing)?;
        let controls = core::Controls {
            max_events,
            time_limit,
            accumulation_tolerance,
            stop_at_grazing,
            cancel: Some(&cancel),
            ..core::Controls::default()
        };
        let propagators = scene.propagators(py)?;
        let run = computed(py, || core::simulate(propagators, &start, duration, method, controls))?;
        raised(py)?;
        Ok(Self::new(run))
    }

    /// The motion that a record was made of.
    #[staticmethod]
    fn from_record(py: Python<'_>, scene: &Scene, record: &Bound<'_, PyAny>) -> PyResult<Self> {
        let record = read_record(record, core::transient::TrajectoryRecord::from_bytes)?;
        let propagators = scene.propagators(py)?;
        let inner = computed(py, || core::Trajectory::from_record(propagators, record))?;
        Ok(Self::new(inner))
    }

    #[getter]
    fn event_count(&self) -> usize {
        self.inner.events.len()
    }

    #[getter]
    fn event_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.events.iter().map(|event| event.time).collect::<Vec<_>>().into_pyarray(py)
    }

    #[getter]
    fn event_contact<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let contacts: Vec<i64> =
            self.inner.events.iter().map(|event| event.contact as i64).collect();
        contacts.into_pyarray(py)
    }

    #[getter]
    fn event_kind(&self) -> Vec<&'static str> {
        self.inner.events.iter().map(|event| event.kind.name()).collect()
    }

    #[getter]
    fn event_combination(&self) -> Vec<String> {
        self.inner.events.iter().map(|event| self.inner.combination(event).to_string()).collect()
    }

    #[getter]
    fn duration(&self) -> f64 {
        self.inner.end
    }

    #[getter]
    fn stop_reason(&self) -> &'static str {
        self.inner.stop_reason.name()
    }

    /// What stopped the run, in words, when it is not the duration.
    #[getter]
    fn stop_message(&self) -> String {
        self.inner.stop_reason.to_string()
    }

    #[getter]
    fn counters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counters = &self.inner.counters;
        let dict = PyDict::new(py);
        dict.set_item("phases", counters.phases)?;
        dict.set_item("panels", counters.panels)?;
        dict.set_item("leaps", counters.leaps)?;
        dict.set_item("refinements", counters.refinements)?;
        dict.set_item("combinations", counters.combinations)?;
        dict.set_item("taylor_phases", counters.taylor_phases)?;
        dict.set_item("expansions", counters.expansions)?;
        Ok(dict)
    }

    /// (time, contact, alternative, value, uncertainty) of every touch that rounding could not decide.
    #[getter]
    fn grazings(&self) -> Vec<(f64, usize, &'static str, f64, f64)> {
        let touches = self.inner.grazings.iter();
        touches.map(|t| (t.time, t.contact, t.alternative.name(), t.value, t.uncertainty)).collect()
    }

    /// (event index, bounces left out, error bound of the time) of every limit of bounces.
    #[getter]
    fn accumulations(&self) -> Vec<(usize, usize, f64)> {
        let limits = self.inner.accumulations.iter();
        limits.map(|limit| (limit.event, limit.bounces, limit.error)).collect()
    }

    /// Everything but the scene, as bytes; `Trajectory.from_record` takes them.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &detached(py, || self.inner.record().to_bytes())?))
    }

    fn state<'py>(&self, py: Python<'py>, time: f64) -> PyResult<StateParts<'py>> {
        let state = computed(py, || self.inner.state(time))?;
        Ok((
            state.position.into_pyarray(py),
            state.velocity.into_pyarray(py),
            state.combination.to_string(),
            state.friction_force,
            state.internal,
        ))
    }

    fn event_states<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Matrix<'py>)> {
        let (positions, velocities) = detached(py, || {
            let (mut positions, mut velocities) = (Vec::new(), Vec::new());
            for event in &self.inner.events {
                let (position, velocity) = self.inner.event_state(event);
                positions.extend(position);
                velocities.extend(velocity);
            }
            (positions, velocities)
        })?;
        let (rows, columns) = (self.inner.events.len(), self.inner.dofs());
        Ok((matrix(py, rows, columns, positions)?, matrix(py, rows, columns, velocities)?))
    }

    fn sample<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Sample<'py>> {
        let times = vector(&times);
        let sample = computed(py, || self.inner.sample(&times))?;
        let (rows, dofs, contacts) = (times.len(), self.inner.dofs(), self.inner.contact_count());
        let codes: Vec<u8> = sample.status.iter().map(|status| status.letter() as u8).collect();
        Ok((
            matrix(py, rows, dofs, sample.position)?,
            matrix(py, rows, dofs, sample.velocity)?,
            matrix(py, rows, contacts, sample.normal_force)?,
            matrix(py, rows, contacts, sample.friction_force)?,
            codes.into_pyarray(py).reshape([rows, contacts])?,
        ))
    }

    fn modal_coordinates<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Vec<ModalRun<'py>>> {
        let times = vector(&times);
        let runs = computed(py, || self.inner.modal_coordinates(&times))?;
        runs.into_iter()
            .map(|run| {
                let rows = run.indices.len();
                let columns = run.coordinates.len() / rows.max(1);
                let indices: Vec<i64> = run.indices.into_iter().map(|index| index as i64).collect();
                Ok((
                    run.combination.to_string(),
                    indices.into_pyarray(py),
                    run.coordinates.into_pyarray(py).reshape([rows, columns])?,
                ))
            })
            .collect()
    }
}
