//! Paths along one parameter, what is swept along them, and stability verdicts.

use std::sync::atomic::{AtomicUsize, Ordering};

use num_complex::Complex64;
use numpy::ndarray::ArrayView2;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{dense, entries, from_rows, matrix, vector};
use crate::errors::raise;
use crate::interrupt::{computed, detached, until_interrupted};
use crate::scene::model::Scene;

/// Chebyshev coefficients (k, m, m).
type Coefficients<'py> = PyReadonlyArray3<'py, f64>;

#[derive(FromPyObject)]
enum DampingSeries<'py> {
    /// Coefficients (k,) of alpha and beta.
    Proportional(PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>),
    General(Coefficients<'py>),
}

/// load, rows, offsets, speeds
type StaticsData<'py> = [Coefficients<'py>; 4];

/// lower, upper, mass, damping, stiffness, statics
type PieceData<'py> =
    (f64, f64, Coefficients<'py>, DampingSeries<'py>, Coefficients<'py>, StaticsData<'py>);

#[pyclass(frozen, module = "stickslip._core")]
pub struct Path {
    inner: core::locus::Path,
    eigenproblems: AtomicUsize,
}

impl Path {
    const fn of(inner: core::locus::Path) -> Self {
        Self { inner, eigenproblems: AtomicUsize::new(0) }
    }

    /// What `work` finds along the path, unless Ctrl-C stops it.
    fn watched<T: Send>(
        &self,
        py: Python<'_>,
        work: impl Fn(core::locus::WatchedPath<'_>) -> Result<T, core::Error> + Sync,
    ) -> PyResult<T> {
        let (path, eigenproblems) = (&self.inner, &self.eigenproblems);
        let (found, exception) = py.detach(|| {
            until_interrupted(|cancel| {
                work(core::locus::WatchedPath { path, cancel: Some(cancel), eigenproblems })
            })
        })?;
        match exception {
            Some(exception) => Err(exception),
            None => found.map_err(|error| raise(py, &error)),
        }
    }
}

fn series(coefficients: &Coefficients<'_>) -> core::locus::ChebyshevSeries {
    let outer = coefficients.as_array();
    let matrix = |matrix: ArrayView2<'_, f64>| {
        let (rows, columns) = matrix.dim();
        from_rows(rows, columns, entries(matrix))
    };
    core::locus::ChebyshevSeries(outer.outer_iter().map(matrix).collect())
}

/// Of vectors, which come as matrices of one row.
fn vectors(coefficients: &Coefficients<'_>) -> core::locus::ChebyshevSeries {
    let rows = series(coefficients).0;
    core::locus::ChebyshevSeries(rows.into_iter().map(|row| row.transpose()).collect())
}

fn scalar_series(coefficients: &PyReadonlyArray1<'_, f64>) -> core::locus::ChebyshevSeries {
    core::locus::ChebyshevSeries(
        vector(coefficients).into_iter().map(|value| from_rows(1, 1, [value])).collect(),
    )
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
        let pieces: Vec<core::locus::Piece> = pieces
            .iter()
            .map(|(lower, upper, mass, damping, stiffness, [load, rows, offsets, speeds])| {
                core::locus::Piece {
                    lower: *lower,
                    upper: *upper,
                    centre: 0.5 * (lower + upper),
                    half_width: 0.5 * (upper - lower),
                    mass: series(mass),
                    stiffness: series(stiffness),
                    statics: core::locus::StaticSeries {
                        load: vectors(load),
                        rows: series(rows),
                        offsets: vectors(offsets),
                        speeds: vectors(speeds),
                    },
                    damping: match damping {
                        DampingSeries::Proportional(alpha, beta) => {
                            core::locus::PathDamping::Proportional {
                                alpha: scalar_series(alpha),
                                beta: scalar_series(beta),
                            }
                        }
                        DampingSeries::General(damping) => {
                            core::locus::PathDamping::General(series(damping))
                        }
                    },
                }
            })
            .collect();
        let inner = computed(py, || core::locus::Path::new(combination, size, pieces))?;
        Ok(Self::of(inner))
    }

    /// The contact law of a scene: the friction of some contacts, or what else differs between the scenes at both ends.
    #[staticmethod]
    fn contact_law(
        py: Python<'_>,
        scene: &Scene,
        other: &Scene,
        combination: &str,
        contacts: Vec<usize>,
        lower: f64,
        upper: f64,
    ) -> PyResult<Self> {
        let combination = scene.combination(py, combination)?;
        let ends: [&core::Scene; 2] = [scene.core(py)?, other.core(py)?];
        let inner = computed(py, || {
            core::locus::Path::contact_law(ends, &combination, &contacts, lower, upper)
        })?;
        Ok(Self::of(inner))
    }

    #[getter]
    fn size(&self) -> usize {
        self.inner.size
    }

    /// Number of eigenproblems begun along the path.
    #[getter]
    fn eigenproblems(&self) -> usize {
        self.eigenproblems.load(Ordering::Relaxed)
    }

    /// (M, C, K) and their derivatives to the parameter.
    fn matrices<'py>(
        &self,
        py: Python<'py>,
        value: f64,
    ) -> PyResult<[Bound<'py, PyArray2<f64>>; 6]> {
        let parts = detached(py, || self.inner.matrices(value))?;
        let [a, b, c, d, e, f] = parts.map(|matrix| dense(py, &matrix));
        Ok([a?, b?, c?, d?, e?, f?])
    }

    /// Tracked branches at ascending values, all or those of some modes.
    #[pyo3(signature = (values, vectors, modes=None))]
    fn sweep<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray1<'py, f64>,
        vectors: bool,
        modes: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let values = vector(&values);
        let sweep =
            self.watched(py, |path| core::locus::Sweep::new(path, &values, vectors, modes))?;
        let (rows, branches, m) = (values.len(), sweep.branches, self.inner.size);
        let dict = PyDict::new(py);
        let table = |entries: Vec<Complex64>| entries.into_pyarray(py).reshape([rows, branches]);
        dict.set_item("eigenvalue", table(sweep.eigenvalues)?)?;
        dict.set_item("slope", table(sweep.slopes)?)?;
        dict.set_item("a", table(sweep.a)?)?;
        dict.set_item("condition", matrix(py, rows, branches, sweep.condition)?)?;
        dict.set_item("defective", sweep.defective.into_pyarray(py).reshape([rows, branches])?)?;
        dict.set_item("unstable", sweep.unstable.into_pyarray(py).reshape([rows, branches])?)?;
        dict.set_item("stable", sweep.stable.into_pyarray(py))?;
        dict.set_item("meetings", sweep.meetings.into_pyarray(py))?;
        set_steady(py, &dict, &self.inner.combination, self.inner.steady(&values))?;
        if vectors {
            let stack = |entries: Vec<Complex64>| -> PyResult<Bound<'py, PyArray3<Complex64>>> {
                entries.into_pyarray(py).reshape([rows, m, branches])
            };
            dict.set_item("right", stack(sweep.right)?)?;
            dict.set_item("left", stack(sweep.left)?)?;
        }
        Ok(dict)
    }

    /// Kind, contact, parameter, eigenvalue, other eigenvalue, slope and whether steady sliding exists there, of every
    /// critical point; how many eigenproblems lay the mesh, and how often Newton's method was started for a lock-in.
    fn critical_points<'py>(
        &self,
        py: Python<'py>,
        imaginary: f64,
    ) -> PyResult<(CriticalArrays<'py>, usize, usize)> {
        let (found, steady) = self.watched(py, |path| {
            let found = core::locus::critical_points(path, imaginary)?;
            let values: Vec<f64> = found.points.iter().map(|point| point.value).collect();
            Ok((found, path.steady(&values)))
        })?;
        Ok((critical_arrays(py, &found.points, &steady), found.nodes, found.starts))
    }

    /// The Hopf points alone, how many eigenproblems lay the mesh, and how many modes were followed from one to the
    /// next.
    fn hopf_points<'py>(&self, py: Python<'py>) -> PyResult<(CriticalArrays<'py>, usize, usize)> {
        let (found, steady) = self.watched(py, |path| {
            let found = core::locus::hopf_points(path)?;
            let values: Vec<f64> = found.points.iter().map(|point| point.value).collect();
            Ok((found, path.steady(&values)))
        })?;
        Ok((critical_arrays(py, &found.points, &steady), found.nodes, found.followed))
    }

    /// The points alone at which stability, or steady sliding, begins or ends.
    fn stability_limits<'py>(&self, py: Python<'py>) -> PyResult<CriticalArrays<'py>> {
        let (points, steady) = self.watched(py, |path| {
            let points = core::locus::stability_limits(path)?;
            let values: Vec<f64> = points.iter().map(|point| point.value).collect();
            Ok((points, path.steady(&values)))
        })?;
        Ok(critical_arrays(py, &points, &steady))
    }

    /// The verdict at each value.
    fn growth<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let values = vector(&values);
        let verdicts = computed(py, || core::locus::verdicts_along(&self.inner, &values))?;
        verdict_arrays(py, verdicts, Some(&self.inner.combination))
    }
}

type ComplexArray<'py> = Bound<'py, PyArray1<Complex64>>;
type CriticalArrays<'py> = (
    Vec<&'static str>,
    Vec<Option<usize>>,
    ComplexArray<'py>,
    ComplexArray<'py>,
    ComplexArray<'py>,
    Bound<'py, PyArray1<f64>>,
    Vec<bool>,
);

fn critical_arrays<'py>(
    py: Python<'py>,
    points: &[core::locus::CriticalPoint],
    steady: &[core::scene::Steady],
) -> CriticalArrays<'py> {
    let contact = |point: &core::locus::CriticalPoint| match point.kind {
        core::locus::CriticalKind::Separation { contact } => Some(contact),
        _ => None,
    };
    let each = |f: fn(&core::locus::CriticalPoint) -> Complex64| {
        points.iter().map(f).collect::<Vec<_>>().into_pyarray(py)
    };
    (
        points.iter().map(|point| point.kind.name()).collect(),
        points.iter().map(contact).collect(),
        each(|point| point.complex_value),
        each(|point| point.eigenvalue),
        each(|point| point.other),
        points.iter().map(|point| point.slope).collect::<Vec<_>>().into_pyarray(py),
        points
            .iter()
            .zip(steady)
            // At a separation steady sliding ends: rounding does not say on which side the point lies.
            .map(|(point, steady)| contact(point).is_some() || steady.exists)
            .collect(),
    )
}

/// `steady_sliding` (k,) and `normal_force` (k, c), NaN for contacts that are not closed by the combination.
fn set_steady<'py>(
    py: Python<'py>,
    dict: &Bound<'py, PyDict>,
    combination: &core::Combination,
    steady: Vec<core::scene::Steady>,
) -> PyResult<()> {
    let closed: Vec<bool> =
        combination.statuses().iter().map(|status| status.is_closed()).collect();
    let exists: Vec<bool> = steady.iter().map(|sample| sample.exists).collect();
    let mut forces = Vec::with_capacity(steady.len() * closed.len());
    for sample in &steady {
        let pressed = sample.margins.iter().zip(&closed);
        forces.extend(pressed.map(|(&margin, &closed)| if closed { margin } else { f64::NAN }));
    }
    dict.set_item("steady_sliding", exists.into_pyarray(py))?;
    dict.set_item("normal_force", matrix(py, steady.len(), closed.len(), forces)?)
}

/// Eigenvalue, numbers of unstable modes and eigenvalues, and whether that is steady sliding; without a combination all contacts slide.
pub fn verdict_arrays<'py>(
    py: Python<'py>,
    verdicts: Vec<core::modes::Verdict>,
    combination: Option<&core::Combination>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let eigenvalues: Vec<Complex64> = verdicts.iter().map(|v| v.growth.eigenvalue).collect();
    let modes: Vec<i64> = verdicts.iter().map(|v| v.growth.unstable_modes as i64).collect();
    let unstable = verdicts.iter().map(|v| v.growth.unstable_eigenvalues as i64);
    let unstable: Vec<i64> = unstable.collect();
    dict.set_item("eigenvalue", eigenvalues.into_pyarray(py))?;
    dict.set_item("unstable_modes", modes.into_pyarray(py))?;
    dict.set_item("unstable_eigenvalues", unstable.into_pyarray(py))?;
    let contacts = verdicts.first().map_or(0, |verdict| verdict.steady.margins.len());
    let sliding = core::Combination::new(vec![core::Status::Positive; contacts]);
    let steady = verdicts.into_iter().map(|verdict| verdict.steady).collect();
    set_steady(py, &dict, combination.unwrap_or(&sliding), steady)?;
    Ok(dict)
}
