//! Computed motions.

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{
    integers, kinds, matrix, method_named, read_record, stops_at_grazing, vector,
};
use crate::errors::raise;
use crate::interrupt::{detached, listening, raised};
use crate::scene::model::{Scene, StatusInput};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Trajectory {
    inner: core::Trajectory,
}

type Matrix<'py> = Bound<'py, PyArray2<f64>>;
type Sample<'py> = (Matrix<'py>, Matrix<'py>, Matrix<'py>, Matrix<'py>, Bound<'py, PyArray2<u8>>);
type StateParts<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, String, Vec<f64>);
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
        let propagators = &scene.propagators;
        let run = detached(py, || core::simulate(propagators, &start, duration, method, controls))?
            .map_err(|error| raise(py, &error))?;
        raised(py)?;
        Ok(Self::new(run))
    }

    /// The motion that a record was made of.
    #[staticmethod]
    fn from_record(py: Python<'_>, scene: &Scene, record: &Bound<'_, PyAny>) -> PyResult<Self> {
        let record = read_record::<Record<'_>>(record)?.into_core(py)?;
        let inner = detached(py, || core::Trajectory::from_record(&scene.propagators, record))?
            .map_err(|error| raise(py, &error))?;
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
    fn grazings(&self) -> Vec<GrazingTuple> {
        grazing_tuples(&self.inner.grazings)
    }

    /// (event index, bounces left out, error bound of the time) of every limit of bounces.
    #[getter]
    fn accumulations(&self) -> Vec<(usize, usize, f64)> {
        accumulation_tuples(&self.inner.accumulations)
    }

    /// Everything but the scene, as numbers and names; `Trajectory.from_record` takes it.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        record_dict(py, self.inner.record())
    }

    fn state<'py>(&self, py: Python<'py>, time: f64) -> PyResult<StateParts<'py>> {
        let state = detached(py, || self.inner.state(time))?.map_err(|error| raise(py, &error))?;
        Ok((
            state.position.into_pyarray(py),
            state.velocity.into_pyarray(py),
            state.combination.to_string(),
            state.friction_force,
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
        let sample =
            detached(py, || self.inner.sample(&times))?.map_err(|error| raise(py, &error))?;
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
        let runs = detached(py, || self.inner.modal_coordinates(&times))?
            .map_err(|error| raise(py, &error))?;
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

/// Time, contact, alternative, value, uncertainty.
type GrazingTuple = (f64, usize, &'static str, f64, f64);

fn grazing_tuples(grazings: &[core::transient::Grazing]) -> Vec<GrazingTuple> {
    let tuple = |touch: &core::transient::Grazing| {
        (touch.time, touch.contact, touch.alternative.name(), touch.value, touch.uncertainty)
    };
    grazings.iter().map(tuple).collect()
}

fn accumulation_tuples(limits: &[core::transient::Accumulation]) -> Vec<(usize, usize, f64)> {
    limits.iter().map(|limit| (limit.event, limit.bounces, limit.error)).collect()
}

fn record_dict(
    py: Python<'_>,
    record: core::transient::TrajectoryRecord,
) -> PyResult<Bound<'_, PyDict>> {
    let counters = record.counters;
    let contact = match record.stop_reason {
        core::StopReason::Chattering { contact } => Some(contact),
        _ => None,
    };
    let dict = PyDict::new(py);
    let names = |methods: Vec<core::Method>| -> Vec<&str> {
        methods.into_iter().map(core::Method::name).collect()
    };
    let bases: Vec<(String, Vec<&str>)> =
        record.bases.into_iter().map(|(name, methods)| (name, names(methods))).collect();
    dict.set_item("bases", bases)?;
    dict.set_item("phase_basis", integers(py, &record.phase_basis))?;
    dict.set_item("phase_start", record.phase_start.into_pyarray(py))?;
    dict.set_item("phase_rest", record.phase_rest.into_pyarray(py))?;
    dict.set_item("states", record.states.into_pyarray(py))?;
    dict.set_item("event_time", record.event_time.into_pyarray(py))?;
    dict.set_item("event_contact", integers(py, &record.event_contact))?;
    dict.set_item(
        "event_kind",
        record.event_kind.iter().map(|kind| kind.name()).collect::<Vec<_>>(),
    )?;
    dict.set_item("event_phase", integers(py, &record.event_phase))?;
    dict.set_item("grazings", grazing_tuples(&record.grazings))?;
    dict.set_item("accumulations", accumulation_tuples(&record.accumulations))?;
    dict.set_item(
        "counters",
        [
            counters.phases,
            counters.panels,
            counters.leaps,
            counters.refinements,
            counters.combinations,
            counters.taylor_phases,
            counters.expansions,
        ],
    )?;
    let parts = record.parts.into_iter().map(|part| record_dict(py, part));
    dict.set_item("parts", parts.collect::<PyResult<Vec<_>>>()?)?;
    let reason = &record.stop_reason;
    dict.set_item("stop", (reason.name(), reason.to_string(), contact))?;
    dict.set_item("end", record.end)?;
    dict.set_item("local", record.local.map(|local| local_dict(py, local)).transpose()?)?;
    Ok(dict)
}

fn local_dict(py: Python<'_>, local: core::transient::LocalRecord) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("load_time", local.load_time)?;
    dict.set_item("stride", local.stride)?;
    dict.set_item("panel_start", local.panel_start.into_pyarray(py))?;
    dict.set_item("panel_rest", local.panel_rest.into_pyarray(py))?;
    dict.set_item("panel_length", local.panel_length.into_pyarray(py))?;
    dict.set_item("step_panel", integers(py, &local.step_panel))?;
    dict.set_item("step_at", local.step_at.into_pyarray(py))?;
    dict.set_item("step_begins", local.step_begins)?;
    dict.set_item("status_step", integers(py, &local.status_step))?;
    dict.set_item("status_contact", integers(py, &local.status_contact))?;
    dict.set_item("status", local.status)?;
    dict.set_item("reset_step", integers(py, &local.reset_step))?;
    dict.set_item("reset_coordinate", integers(py, &local.reset_coordinate))?;
    dict.set_item("reset_state", local.reset_state.into_pyarray(py))?;
    Ok(dict)
}

/// What a local march keeps, from its record.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Local<'py> {
    load_time: f64,
    stride: usize,
    panel_start: PyReadonlyArray1<'py, f64>,
    panel_rest: PyReadonlyArray1<'py, f64>,
    panel_length: PyReadonlyArray1<'py, f64>,
    step_panel: Vec<usize>,
    step_at: PyReadonlyArray1<'py, f64>,
    step_begins: Vec<bool>,
    status_step: Vec<usize>,
    status_contact: Vec<usize>,
    status: String,
    reset_step: Vec<usize>,
    reset_coordinate: Vec<usize>,
    reset_state: PyReadonlyArray1<'py, f64>,
}

impl From<Local<'_>> for core::transient::LocalRecord {
    fn from(local: Local<'_>) -> Self {
        Self {
            load_time: local.load_time,
            stride: local.stride,
            panel_start: vector(&local.panel_start),
            panel_rest: vector(&local.panel_rest),
            panel_length: vector(&local.panel_length),
            step_panel: local.step_panel,
            step_at: vector(&local.step_at),
            step_begins: local.step_begins,
            status_step: local.status_step,
            status_contact: local.status_contact,
            status: local.status,
            reset_step: local.reset_step,
            reset_coordinate: local.reset_coordinate,
            reset_state: vector(&local.reset_state),
        }
    }
}

/// A motion from its record.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Record<'py> {
    bases: Vec<(String, Vec<String>)>,
    phase_basis: Vec<usize>,
    phase_start: PyReadonlyArray1<'py, f64>,
    phase_rest: PyReadonlyArray1<'py, f64>,
    states: PyReadonlyArray1<'py, f64>,
    event_time: PyReadonlyArray1<'py, f64>,
    event_contact: Vec<i64>,
    event_kind: Vec<String>,
    event_phase: Vec<usize>,
    grazings: Vec<(f64, usize, String, f64, f64)>,
    accumulations: Vec<(usize, usize, f64)>,
    counters: [usize; 7],
    stop: (String, String, Option<usize>),
    end: f64,
    local: Option<Local<'py>>,
    parts: Vec<Record<'py>>,
}

impl Record<'_> {
    fn into_core(self, py: Python<'_>) -> PyResult<core::transient::TrajectoryRecord> {
        let (reason, message, contact) = &self.stop;
        let stop_reason = core::StopReason::named(reason, message, *contact)
            .map_err(|error| raise(py, &error))?;
        let grazings = self
            .grazings
            .into_iter()
            .map(|(time, contact, kind, value, uncertainty)| {
                let alternative =
                    core::contact::EventKind::named(&kind).map_err(|error| raise(py, &error))?;
                Ok(core::transient::Grazing { time, contact, alternative, value, uncertainty })
            })
            .collect::<PyResult<Vec<_>>>()?;
        let accumulations = self
            .accumulations
            .into_iter()
            .map(|(event, bounces, error)| core::transient::Accumulation { event, bounces, error })
            .collect();
        let [phases, panels, leaps, refinements, combinations, taylor_phases, expansions] =
            self.counters;
        let bases = self
            .bases
            .into_iter()
            .map(|(name, methods)| {
                let methods = methods.iter().map(|method| method_named(py, method));
                Ok((name, methods.collect::<PyResult<Vec<_>>>()?))
            })
            .collect::<PyResult<Vec<_>>>()?;
        Ok(core::transient::TrajectoryRecord {
            bases,
            phase_basis: self.phase_basis,
            phase_start: vector(&self.phase_start),
            phase_rest: vector(&self.phase_rest),
            states: vector(&self.states),
            event_time: vector(&self.event_time),
            // -1 is no contact.
            event_contact: self.event_contact.iter().map(|&contact| contact as usize).collect(),
            event_kind: kinds(py, &self.event_kind)?,
            event_phase: self.event_phase,
            grazings,
            accumulations,
            counters: core::transient::Counters {
                phases,
                panels,
                leaps,
                refinements,
                combinations,
                taylor_phases,
                expansions,
            },
            stop_reason,
            end: self.end,
            local: self.local.map(Into::into),
            parts: self
                .parts
                .into_iter()
                .map(|part| part.into_core(py))
                .collect::<PyResult<_>>()?,
        })
    }
}
