//! Computed motions.

use std::sync::atomic::{AtomicBool, Ordering};

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{matrix, vector};
use crate::cycle::{Settled, settled};
use crate::errors::raise;
use crate::scene::method_named;

pub fn stop_message(reason: &core::StopReason) -> String {
    match reason {
        core::StopReason::Failed(failure) => failure.to_string(),
        core::StopReason::Chattering { contact } => {
            format!("contact {contact} changes status without end at one instant")
        }
        reason => reason.name().to_owned(),
    }
}

#[pyclass(frozen, module = "stickslip._core")]
pub struct Trajectory {
    inner: core::Trajectory,
}

type Matrix<'py> = Bound<'py, PyArray2<f64>>;
type Sample<'py> = (Matrix<'py>, Matrix<'py>, Matrix<'py>, Matrix<'py>, Bound<'py, PyArray2<u8>>);
type StateParts<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, String);
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
        stop_message(&self.inner.stop_reason)
    }

    /// What the run has settled to, and the motion of `limit` seconds more if it takes that to say.
    fn attractor(&self, py: Python<'_>, limit: f64, method: &str) -> PyResult<Settled> {
        let method = method_named(py, method)?;
        // A signal is reported once, and asked for at many places.
        let stopped = AtomicBool::new(false);
        let interrupted = || {
            if Python::attach(|py| py.check_signals()).is_err() {
                stopped.store(true, Ordering::Relaxed);
            }
            stopped.load(Ordering::Relaxed)
        };
        let found = py.detach(|| {
            let search = core::Search {
                stretch: self.inner.end,
                limit,
                method,
                interrupted: Some(&interrupted),
            };
            self.inner.settled(search)
        });
        let (attractor, run) = found.map_err(|error| raise(py, &error))?;
        py.check_signals()?;
        Ok(settled(attractor, run))
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
        Ok(dict)
    }

    /// (time, contact, alternative, value, uncertainty) of every touch that rounding could not decide.
    #[getter]
    fn grazings(&self) -> Vec<(f64, usize, &'static str, f64, f64)> {
        self.inner
            .grazings
            .iter()
            .map(|touch| {
                (
                    touch.time,
                    touch.contact,
                    touch.alternative.name(),
                    touch.value,
                    touch.uncertainty,
                )
            })
            .collect()
    }

    /// (event index, bounces left out, error bound of the time) of every limit of bounces.
    #[getter]
    fn accumulations(&self) -> Vec<(usize, usize, f64)> {
        self.inner
            .accumulations
            .iter()
            .map(|limit| (limit.event, limit.bounces, limit.error))
            .collect()
    }

    fn state<'py>(&self, py: Python<'py>, time: f64) -> PyResult<StateParts<'py>> {
        let state = self.inner.state(time).map_err(|error| raise(py, &error))?;
        Ok((
            state.position.into_pyarray(py),
            state.velocity.into_pyarray(py),
            state.combination.to_string(),
        ))
    }

    fn event_states<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Matrix<'py>)> {
        let (mut positions, mut velocities) = (Vec::new(), Vec::new());
        for event in &self.inner.events {
            let (position, velocity) = self.inner.event_state(event);
            positions.extend(position);
            velocities.extend(velocity);
        }
        let (rows, columns) = (self.inner.events.len(), self.inner.size());
        Ok((matrix(py, rows, columns, positions)?, matrix(py, rows, columns, velocities)?))
    }

    fn sample<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Sample<'py>> {
        let times = vector(&times);
        let sample = py.detach(|| self.inner.sample(&times)).map_err(|error| raise(py, &error))?;
        let (rows, dofs, contacts) = (times.len(), self.inner.size(), self.inner.contact_count());
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
        let runs =
            self.inner.modal_coordinates(&vector(&times)).map_err(|error| raise(py, &error))?;
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
