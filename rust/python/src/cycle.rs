//! Periodic orbits.

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use stickslip_core as core;

use crate::convert::{dense, read_record, vector};
use crate::errors::{named, raise};
use crate::interrupt::{computed, detached, heard, listening};
use crate::scene::model::Scene;
use crate::trajectory::Trajectory;

#[pyclass(frozen, module = "stickslip._core")]
pub struct Cycle {
    pub inner: core::Cycle,
}

type Margin = (usize, usize, &'static str, f64, f64, bool);

pub fn failed(py: Python<'_>, failure: &core::cycles::orbits::OrbitFailure) -> PyErr {
    match failure {
        core::cycles::orbits::OrbitFailure::Failed(core::RunFailure::Input(error)) => {
            raise(py, error)
        }
        _ => named(py, "OrbitError", &failure.to_string()),
    }
}

/// What `work` returns, which asks whether Ctrl-C or another signal has ended it; then what its handler raised.
fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&dyn Fn() -> bool) -> Result<T, core::cycles::orbits::OrbitFailure> + Send,
) -> PyResult<T> {
    let cancel = listening();
    let found = detached(py, || work(&|| cancel.is_requested()))?;
    heard()?;
    found.map_err(|failure| failed(py, &failure))
}

type Real<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

#[pymethods]
impl Cycle {
    /// The orbit that a record was made of.
    #[staticmethod]
    fn from_record(py: Python<'_>, scene: &Scene, record: &Bound<'_, PyAny>) -> PyResult<Self> {
        let record = read_record(record, core::cycles::orbits::CycleRecord::from_bytes)?;
        let propagators = scene.propagators(py)?;
        let cycle = detached(py, || core::Cycle::from_record(propagators, record))?;
        Ok(Self { inner: cycle.map_err(|failure| failed(py, &failure))? })
    }

    #[getter]
    fn period(&self) -> f64 {
        self.inner.orbit.period
    }

    /// How many periods of the loads in time it lasts; 0 without such loads.
    #[getter]
    fn load_periods(&self) -> usize {
        self.inner.orbit.load_periods
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
    fn transverse<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        self.inner.multipliers.transverse.clone().into_pyarray(py)
    }

    #[getter]
    fn structural_zeros(&self) -> usize {
        self.inner.multipliers.structural_zeros
    }

    /// Dimension of the admissible space of every phase.
    #[getter]
    fn dimensions(&self) -> Vec<usize> {
        self.inner.multipliers.dimensions.clone()
    }

    /// Directions that the event at the end of every phase forgets.
    #[getter]
    fn losses(&self) -> Vec<usize> {
        self.inner.multipliers.losses.clone()
    }

    /// (contact, kind) of the event at the end of every phase; the contact -1 where the period of the loads ends.
    #[getter]
    fn events(&self) -> Vec<(i64, &'static str)> {
        let steps = self.inner.orbit.steps.iter();
        steps.map(|step| (step.contact() as i64, step.kind.name())).collect()
    }

    /// The contacts that close with the event at the end of every phase, where it ends a series over several contacts.
    #[getter]
    fn series(&self) -> Vec<Vec<usize>> {
        self.inner.orbit.steps.iter().map(|step| step.series().to_vec()).collect()
    }

    #[getter]
    fn is_corner(&self) -> bool {
        self.inner.orbit.corner().is_some()
    }

    #[getter]
    fn is_stable(&self) -> Option<bool> {
        self.inner.stability.is_stable()
    }

    /// Stable, unstable, or why that is not known.
    #[getter]
    fn stability(&self) -> String {
        self.inner.stability.to_string()
    }

    /// Largest modulus across the flow.
    #[getter]
    fn largest_multiplier(&self) -> f64 {
        self.inner.multipliers.largest()
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
        let run = computed(py, || self.inner.orbit.trajectory())?;
        Ok(Trajectory::new(run))
    }

    /// Everything but the scene, as bytes; `Cycle.from_record` takes them.
    fn record<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.inner.record().to_bytes())
    }

    /// Derivative of the flow over a period, in contact coordinates.
    fn monodromy<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        let monodromy = detached(py, || self.inner.orbit.monodromy())?
            .map_err(|failure| failed(py, &failure))?;
        dense(py, &monodromy)
    }

    /// Coefficients of the displacement, one row per harmonic from 0 to `count`.
    fn harmonics<'py>(
        &self,
        py: Python<'py>,
        count: usize,
    ) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        use numpy::PyArrayMethods;
        let orbit = &self.inner.orbit;
        let harmonics = interruptible(py, |is_over| orbit.harmonics(count, is_over))?;
        let columns = harmonics.displacement.len() / (count + 1);
        harmonics.displacement.into_pyarray(py).reshape([count + 1, columns])
    }

    /// (phase, contact, kind, lowest value, time, whether it is a local minimum) of event functions that
    /// end no phase.
    fn margins(&self, py: Python<'_>) -> PyResult<Vec<Margin>> {
        let orbit = &self.inner.orbit;
        let margins = interruptible(py, |is_over| orbit.margins(is_over))?;
        Ok(margins
            .iter()
            .map(|m| (m.step, m.contact, m.kind.name(), m.value, m.time, m.interior))
            .collect())
    }

    /// (K,) change of the event function that ends each phase as it crosses zero, its unit per second.
    fn crossing_speeds(&self, py: Python<'_>) -> PyResult<Vec<f64>> {
        detached(py, || self.inner.orbit.crossing_speeds())?.map_err(|failure| failed(py, &failure))
    }

    /// Whether a run from the orbit keeps to its event sequence.
    fn is_followed(&self, py: Python<'_>) -> PyResult<bool> {
        detached(py, || core::cycles::attractors::is_followed(&self.inner.orbit))
    }

    fn orbit(&self) -> Orbit {
        Orbit { inner: self.inner.orbit.clone() }
    }

    /// The orbit with the same event sequence in another scene.
    fn continued(&self, py: Python<'_>, scene: &Scene) -> PyResult<Self> {
        let propagators = scene.propagators(py)?;
        let inner = interruptible(py, |is_over| {
            let orbit = self.inner.orbit.continued(propagators, is_over)?;
            core::Cycle::new(orbit, is_over)
        })?;
        Ok(Self { inner })
    }
}

/// An orbit, or a guess of one, on its way along a branch.
#[pyclass(frozen, module = "stickslip._core")]
pub struct Orbit {
    inner: core::cycles::orbits::Orbit,
}

/// State at the section and parameter, in their units.
type Direction<'py> = (Real<'py>, f64);

#[pymethods]
impl Orbit {
    /// The direction of the branch, on the side that `before` points to; None: towards larger parameters.
    /// `below` and `above` are scenes on either side, `width` units of the parameter apart.
    #[pyo3(signature = (below, above, width, before))]
    fn tangent<'py>(
        &self,
        py: Python<'py>,
        below: &Scene,
        above: &Scene,
        width: f64,
        before: Option<(PyReadonlyArray1<'py, f64>, f64)>,
    ) -> PyResult<Direction<'py>> {
        let before = before.map(direction);
        let sides = sides(py, below, above, width)?;
        let found = detached(py, || self.inner.tangent(sides, before.as_ref()))?;
        let found = found.map_err(|failure| failed(py, &failure))?;
        Ok((found.state.into_pyarray(py), found.parameter))
    }

    /// The guess a length away.
    fn predicted(
        &self,
        py: Python<'_>,
        below: &Scene,
        above: &Scene,
        width: f64,
        tangent: (PyReadonlyArray1<'_, f64>, f64),
        length: f64,
    ) -> PyResult<Self> {
        let tangent = direction(tangent);
        let sides = sides(py, below, above, width)?;
        let guess = detached(py, || self.inner.predicted(sides, &tangent, length))?;
        Ok(Self { inner: guess.map_err(|failure| failed(py, &failure))? })
    }

    /// One step of Newton's method across the tangent in `scene`: orbit, change of the parameter, and the largest
    /// relative change.
    fn corrected(
        &self,
        py: Python<'_>,
        scene: &Scene,
        below: &Scene,
        above: &Scene,
        width: f64,
        tangent: (PyReadonlyArray1<'_, f64>, f64),
    ) -> PyResult<(Self, f64, f64)> {
        let tangent = direction(tangent);
        let sides = sides(py, below, above, width)?;
        let propagators = scene.propagators(py)?;
        let step = detached(py, || self.inner.corrected(propagators, sides, &tangent))?;
        let step = step.map_err(|failure| failed(py, &failure))?;
        Ok((Self { inner: step.orbit }, step.parameter, step.size))
    }

    /// Duration of the shortest phase, s.
    #[getter]
    fn shortest(&self) -> f64 {
        self.inner.steps.iter().map(|step| step.duration).fold(f64::INFINITY, f64::min)
    }

    fn cycle(&self, py: Python<'_>) -> PyResult<Cycle> {
        let orbit = self.inner.clone();
        let inner = interruptible(py, |is_over| core::Cycle::new(orbit, is_over))?;
        Ok(Cycle { inner })
    }
}

fn direction(
    (state, parameter): (PyReadonlyArray1<'_, f64>, f64),
) -> core::cycles::orbits::Tangent {
    core::cycles::orbits::Tangent { state: vector(&state), parameter }
}

fn sides<'a>(
    py: Python<'_>,
    below: &'a Scene,
    above: &'a Scene,
    width: f64,
) -> PyResult<core::cycles::orbits::Sides<'a>> {
    let (below, above) = (below.propagators(py)?, above.propagators(py)?);
    Ok(core::cycles::orbits::Sides { below, above, width })
}
