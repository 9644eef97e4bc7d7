//! Energies, powers and works of a trajectory.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core::energy::{self as core, damper_groups};

use crate::convert::{matrix, vector};
use crate::interrupt::computed;
use crate::trajectory::Trajectory;

type Column<'py> = Bound<'py, PyArray1<f64>>;
type Table<'py> = Bound<'py, PyArray2<f64>>;

/// Energies and powers at a series of instants, by name.
#[pyfunction]
pub fn energy<'py>(
    py: Python<'py>,
    trajectory: &Trajectory,
    times: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let times = vector(&times);
    let run = trajectory.core();
    let sample = computed(py, || core::energy_at(run, &times))?;
    let (rows, contacts) = (times.len(), run.contact_count());
    let groups = damper_groups(run.scene());
    let result = PyDict::new(py);
    for (name, values) in [
        ("kinetic", sample.kinetic),
        ("elastic", sample.elastic),
        ("rate", sample.rate),
        ("external", sample.external),
        ("circulatory", sample.circulatory),
    ] {
        result.set_item(name, values.into_pyarray(py))?;
    }
    result.set_item("damping", matrix(py, rows, groups.len(), sample.damping)?)?;
    result.set_item("contact", matrix(py, rows, contacts, sample.contact)?)?;
    result.set_item("slider", matrix(py, rows, contacts, sample.slider)?)?;
    result.set_item("wear", matrix(py, rows, contacts, sample.wear)?)?;
    let combinations: Vec<String> = sample.combination.iter().map(ToString::to_string).collect();
    result.set_item("combination", combinations)?;
    result.set_item("groups", groups)?;
    Ok(result)
}

/// Works over (t0, t1]: one row per phase, one per impact.
#[pyclass(frozen, get_all, module = "stickslip._core")]
pub struct Works {
    kinetic: f64,
    elastic: f64,
    states: usize,
    groups: Vec<&'static str>,
    start: Py<PyArray1<f64>>,
    duration: Py<PyArray1<f64>>,
    combination: Vec<String>,
    contact: Py<PyArray2<f64>>,
    slider: Py<PyArray2<f64>>,
    wear: Py<PyArray2<f64>>,
    external: Py<PyArray1<f64>>,
    circulatory: Py<PyArray1<f64>>,
    damping: Py<PyArray2<f64>>,
    impact_time: Py<PyArray1<f64>>,
    impact_contact: Py<PyArray1<i64>>,
    impact_normal: Py<PyArray1<f64>>,
    impact_slider: Py<PyArray1<f64>>,
    impact_friction: Py<PyArray1<f64>>,
}

#[pyfunction]
pub fn works(py: Python<'_>, trajectory: &Trajectory, t0: f64, t1: f64) -> PyResult<Works> {
    let run = trajectory.core();
    let works = computed(py, || core::works(run, t0, t1))?;
    let groups = damper_groups(run.scene()).to_vec();
    let (rows, contacts) = (works.phases.len(), run.contact_count());
    let column = |values: Vec<f64>| -> Column<'_> { values.into_pyarray(py) };
    let table =
        |width: usize, values: Vec<f64>| -> PyResult<Table<'_>> { matrix(py, rows, width, values) };
    let phases = &works.phases;
    let impacts = &works.impacts;
    let contact_indices: Vec<i64> = impacts.iter().map(|impact| impact.contact as i64).collect();
    Ok(Works {
        kinetic: works.kinetic,
        elastic: works.elastic,
        states: works.states,
        start: column(phases.iter().map(|phase| phase.start).collect()).unbind(),
        duration: column(phases.iter().map(|phase| phase.duration).collect()).unbind(),
        combination: phases.iter().map(|phase| phase.combination.to_string()).collect(),
        contact: table(contacts, phases.iter().flat_map(|phase| phase.contact.clone()).collect())?
            .unbind(),
        slider: table(contacts, phases.iter().flat_map(|phase| phase.slider.clone()).collect())?
            .unbind(),
        wear: table(contacts, phases.iter().flat_map(|phase| phase.wear.clone()).collect())?
            .unbind(),
        external: column(phases.iter().map(|phase| phase.external).collect()).unbind(),
        circulatory: column(phases.iter().map(|phase| phase.circulatory).collect()).unbind(),
        damping: table(
            groups.len(),
            phases.iter().flat_map(|phase| phase.damping.clone()).collect(),
        )?
        .unbind(),
        impact_time: column(impacts.iter().map(|impact| impact.time).collect()).unbind(),
        impact_contact: contact_indices.into_pyarray(py).unbind(),
        impact_normal: column(impacts.iter().map(|impact| impact.normal).collect()).unbind(),
        impact_slider: column(impacts.iter().map(|impact| impact.slider).collect()).unbind(),
        impact_friction: column(impacts.iter().map(|impact| impact.friction).collect()).unbind(),
        groups,
    })
}
