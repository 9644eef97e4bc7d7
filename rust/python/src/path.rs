//! Paths along one parameter, what is swept along them, and stability verdicts.

use num_complex::Complex64;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{matrix, vector};
use crate::errors::{named, raise};
use crate::scene::Scene;

/// Chebyshev coefficients (k, m, m).
type Coefficients<'py> = PyReadonlyArray3<'py, f64>;

#[derive(FromPyObject)]
enum DampingSeries<'py> {
    /// Coefficients (k,) of alpha and beta.
    Proportional(PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>),
    General(Coefficients<'py>),
}

/// lower, upper, mass, damping, stiffness
type PieceData<'py> = (f64, f64, Coefficients<'py>, DampingSeries<'py>, Coefficients<'py>);

#[pyclass(frozen, module = "stickslip._core")]
pub struct Path {
    inner: core::Path,
}

fn series(coefficients: &Coefficients<'_>) -> core::Series {
    let outer = coefficients.as_array();
    core::Series(outer.outer_iter().map(|matrix| matrix.iter().copied().collect()).collect())
}

fn scalar_series(coefficients: &PyReadonlyArray1<'_, f64>) -> core::Series {
    core::Series(vector(coefficients).into_iter().map(|value| vec![value]).collect())
}

#[pymethods]
impl Path {
    /// From Chebyshev series on adjacent intervals.
    #[new]
    fn new(
        py: Python<'_>,
        combination: &str,
        size: usize,
        pieces: Vec<PieceData<'_>>,
    ) -> PyResult<Self> {
        let combination = core::Combination::parse(combination, combination.len())
            .map_err(|error| raise(py, &error))?;
        let pieces: Vec<core::Piece> = pieces
            .iter()
            .map(|(lower, upper, mass, damping, stiffness)| core::Piece {
                lower: *lower,
                upper: *upper,
                centre: 0.5 * (lower + upper),
                half_width: 0.5 * (upper - lower),
                mass: series(mass),
                stiffness: series(stiffness),
                damping: match damping {
                    DampingSeries::Proportional(alpha, beta) => core::PathDamping::Proportional {
                        alpha: scalar_series(alpha),
                        beta: scalar_series(beta),
                    },
                    DampingSeries::General(damping) => core::PathDamping::General(series(damping)),
                },
            })
            .collect();
        let inner =
            core::Path::new(combination, size, pieces).map_err(|error| raise(py, &error))?;
        Ok(Self { inner })
    }

    /// The friction of some contacts of a scene.
    #[staticmethod]
    fn friction(
        py: Python<'_>,
        scene: &Scene,
        combination: &str,
        contacts: Vec<usize>,
        lower: f64,
        upper: f64,
    ) -> PyResult<Self> {
        let combination = scene.combination(py, combination)?;
        let inner = core::Path::friction(&scene.inner, &combination, &contacts, lower, upper)
            .map_err(|error| raise(py, &error))?;
        Ok(Self { inner })
    }

    #[getter]
    fn size(&self) -> usize {
        self.inner.size
    }

    /// (M, C, K) and their derivatives to the parameter.
    fn matrices<'py>(
        &self,
        py: Python<'py>,
        value: f64,
    ) -> PyResult<[Bound<'py, PyArray2<f64>>; 6]> {
        let m = self.inner.size;
        let parts = self.inner.matrices(value);
        let [a, b, c, d, e, f] = parts.map(|entries| matrix(py, m, m, entries));
        Ok([a?, b?, c?, d?, e?, f?])
    }

    /// Tracked branches at ascending values.
    fn sweep<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray1<'py, f64>,
        vectors: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let values = vector(&values);
        let sweep = py
            .detach(|| core::Sweep::new(&self.inner, &values, vectors))
            .map_err(|error| raise(py, &error))?;
        let (rows, branches, m) = (values.len(), sweep.branches, self.inner.size);
        let dict = PyDict::new(py);
        let table = |entries: Vec<Complex64>| entries.into_pyarray(py).reshape([rows, branches]);
        dict.set_item("eigenvalue", table(sweep.eigenvalues)?)?;
        dict.set_item("slope", table(sweep.slopes)?)?;
        dict.set_item("a", table(sweep.a)?)?;
        dict.set_item("condition", matrix(py, rows, branches, sweep.condition)?)?;
        dict.set_item("defective", sweep.defective.into_pyarray(py).reshape([rows, branches])?)?;
        dict.set_item("meetings", sweep.meetings.into_pyarray(py))?;
        if vectors {
            let stack = |entries: Vec<Complex64>| -> PyResult<Bound<'py, PyArray3<Complex64>>> {
                entries.into_pyarray(py).reshape([rows, m, branches])
            };
            dict.set_item("right", stack(sweep.right)?)?;
            dict.set_item("left", stack(sweep.left)?)?;
        }
        Ok(dict)
    }

    /// Kind, parameter, eigenvalue, other eigenvalue and slope of every critical point.
    fn critical_points<'py>(
        &self,
        py: Python<'py>,
        imaginary: f64,
    ) -> PyResult<CriticalArrays<'py>> {
        let points = py
            .detach(|| core::critical_points(&self.inner, imaginary))
            .map_err(|error| raise(py, &error))?;
        Ok(critical_arrays(py, &points))
    }

    /// The Hopf points alone, how many eigenproblems lay the mesh, and how many modes were followed from one to the next.
    fn hopf_points<'py>(&self, py: Python<'py>) -> PyResult<(CriticalArrays<'py>, usize, usize)> {
        let core::HopfSearch { points, nodes, followed } =
            py.detach(|| core::hopf_points(&self.inner)).map_err(|error| raise(py, &error))?;
        Ok((critical_arrays(py, &points), nodes, followed))
    }

    /// Least stable eigenvalue and number of unstable ones at each value.
    fn growth<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<GrowthArrays<'py>> {
        let values = vector(&values);
        let growth = py
            .detach(|| core::Growth::along(&self.inner, &values))
            .map_err(|error| raise(py, &error))?;
        Ok(growth_arrays(py, &growth))
    }
}

type ComplexArray<'py> = Bound<'py, PyArray1<Complex64>>;
type CriticalArrays<'py> = (
    Vec<&'static str>,
    ComplexArray<'py>,
    ComplexArray<'py>,
    ComplexArray<'py>,
    Bound<'py, PyArray1<f64>>,
);

fn critical_arrays<'py>(py: Python<'py>, points: &[core::CriticalPoint]) -> CriticalArrays<'py> {
    let each = |f: fn(&core::CriticalPoint) -> Complex64| {
        points.iter().map(f).collect::<Vec<_>>().into_pyarray(py)
    };
    (
        points.iter().map(|point| point.kind.name()).collect(),
        each(|point| point.complex_value),
        each(|point| point.eigenvalue),
        each(|point| point.other),
        points.iter().map(|point| point.slope).collect::<Vec<_>>().into_pyarray(py),
    )
}

type GrowthArrays<'py> = (ComplexArray<'py>, Bound<'py, PyArray1<i64>>);

fn growth_arrays<'py>(py: Python<'py>, growth: &[core::Growth]) -> GrowthArrays<'py> {
    let eigenvalues: Vec<Complex64> = growth.iter().map(|sample| sample.eigenvalue).collect();
    let unstable: Vec<i64> = growth.iter().map(|sample| sample.unstable as i64).collect();
    (eigenvalues.into_pyarray(py), unstable.into_pyarray(py))
}

/// The verdict on one combination of each scene.
#[pyfunction]
pub fn scene_growth<'py>(
    py: Python<'py>,
    scenes: Vec<Bound<'py, Scene>>,
    combination: &str,
) -> PyResult<GrowthArrays<'py>> {
    let Some(first) = scenes.first() else { return Ok(growth_arrays(py, &[])) };
    let combination = first.get().combination(py, combination)?;
    let inner: Vec<&core::Scene> = scenes.iter().map(|scene| &*scene.get().inner).collect();
    let growth = py
        .detach(|| core::Growth::of_scenes(&inner, &combination))
        .map_err(|error| raise(py, &error))?;
    Ok(growth_arrays(py, &growth))
}

/// The verdict on steady positive sliding of sampled chains of subsystems, `C = damping K`.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "one argument per parameter of the model")]
pub fn chain_growth<'py>(
    py: Python<'py>,
    upper_mass: PyReadonlyArray2<'py, f64>,
    contact_mass: PyReadonlyArray2<'py, f64>,
    inclination: PyReadonlyArray2<'py, f64>,
    vertical_stiffness: PyReadonlyArray2<'py, f64>,
    horizontal_stiffness: PyReadonlyArray2<'py, f64>,
    ceiling_stiffness: PyReadonlyArray2<'py, f64>,
    friction: PyReadonlyArray2<'py, f64>,
    link_horizontal: PyReadonlyArray2<'py, f64>,
    link_vertical: PyReadonlyArray2<'py, f64>,
    wall_stiffness: PyReadonlyArray1<'py, f64>,
    damping: PyReadonlyArray1<'py, f64>,
) -> PyResult<GrowthArrays<'py>> {
    let subsystems = upper_mass.as_array().ncols();
    let wall_stiffness = vector(&wall_stiffness);
    let samples = wall_stiffness.len();
    let table = |name: &str, array: &PyReadonlyArray2<'py, f64>, columns: usize| {
        let array = array.as_array();
        if array.dim() == (samples, columns) {
            return Ok(array.iter().copied().collect::<Vec<f64>>());
        }
        let message =
            format!("{name}: expected shape ({samples}, {columns}), got {:?}", array.dim());
        Err(named(py, "InputError", &message))
    };
    let damping = vector(&damping);
    if damping.len() != samples {
        let message = format!("damping: expected shape ({samples},), got ({},)", damping.len());
        return Err(named(py, "InputError", &message));
    }
    let links = subsystems.saturating_sub(1);
    let upper_mass = table("upper_mass", &upper_mass, subsystems)?;
    let contact_mass = table("contact_mass", &contact_mass, subsystems)?;
    let inclination = table("inclination", &inclination, subsystems)?;
    let vertical_stiffness = table("vertical_stiffness", &vertical_stiffness, subsystems)?;
    let horizontal_stiffness = table("horizontal_stiffness", &horizontal_stiffness, subsystems)?;
    let ceiling_stiffness = table("ceiling_stiffness", &ceiling_stiffness, subsystems)?;
    let friction = table("friction", &friction, subsystems)?;
    let link_horizontal = table("link_horizontal", &link_horizontal, links)?;
    let link_vertical = table("link_vertical", &link_vertical, links)?;
    let samples = core::ChainSamples {
        subsystems,
        upper_mass: &upper_mass,
        contact_mass: &contact_mass,
        inclination: &inclination,
        vertical_stiffness: &vertical_stiffness,
        horizontal_stiffness: &horizontal_stiffness,
        ceiling_stiffness: &ceiling_stiffness,
        friction: &friction,
        link_horizontal: &link_horizontal,
        link_vertical: &link_vertical,
        wall_stiffness: &wall_stiffness,
        damping: &damping,
    };
    let growth = py.detach(|| samples.growth());
    Ok(growth_arrays(py, &growth))
}
