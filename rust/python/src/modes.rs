//! Reduced matrices and complex modes.

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;
use stickslip_core::linalg::DMatrix;

use crate::convert::{columns, dense, matrix};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Reduced {
    inner: core::Reduced,
    right_basis: DMatrix<f64>,
    left_basis: DMatrix<f64>,
    statics: core::scene::Statics,
}

impl Reduced {
    pub fn new(scene: &core::Scene, inner: core::Reduced) -> Result<Self, core::Error> {
        let (right_basis, left_basis) = inner.bases(scene)?;
        let statics = core::scene::Statics::new(scene, &inner)?;
        Ok(Self { inner, right_basis, left_basis, statics })
    }
}

#[pymethods]
impl Reduced {
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        dense(py, &self.inner.mass)
    }

    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        dense(py, &self.inner.damping)
    }

    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        dense(py, &self.inner.stiffness)
    }

    #[getter]
    fn force_constant<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.force_constant.clone().into_pyarray(py)
    }

    /// Load (1, m), rows (c, m), offsets (1, c) and slider speeds (1, c): margins are `rows . K^-1 load - offsets`.
    #[getter]
    fn statics<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyArray2<f64>>; 4]> {
        statics(py, self.statics.clone())
    }

    #[getter]
    fn force_linear<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.force_linear.clone().into_pyarray(py)
    }

    #[getter]
    fn right_basis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        dense(py, &self.right_basis)
    }

    #[getter]
    fn left_basis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        dense(py, &self.left_basis)
    }
}

/// Load (1, m), rows (c, m), offsets (1, c) and slider speeds (1, c).
pub fn statics(
    py: Python<'_>,
    statics: core::scene::Statics,
) -> PyResult<[Bound<'_, PyArray2<f64>>; 4]> {
    let core::scene::Statics { load, rows, offsets, speeds } = statics;
    let (m, contacts) = (load.len(), offsets.len());
    Ok([
        matrix(py, 1, m, load)?,
        dense(py, &rows)?,
        matrix(py, 1, contacts, offsets)?,
        matrix(py, 1, contacts, speeds)?,
    ])
}

/// Of modes: everything by its name, and the reduced matrices that they belong to.
pub fn modes<'py>(
    py: Python<'py>,
    dofs: usize,
    modes: core::Modes,
) -> PyResult<Bound<'py, PyDict>> {
    let (free, count) = (modes.reduced.size(), modes.eigenvalues.len());
    let dict = PyDict::new(py);
    dict.set_item("eigenvalues", modes.eigenvalues.into_pyarray(py))?;
    dict.set_item("right_displacement", columns(py, free, count, modes.right)?)?;
    dict.set_item("left_displacement", columns(py, free, count, modes.left)?)?;
    dict.set_item("a", modes.a.into_pyarray(py))?;
    dict.set_item("b", modes.b.into_pyarray(py))?;
    dict.set_item("shapes", columns(py, dofs, count, modes.shapes)?)?;
    dict.set_item("condition", modes.condition.into_pyarray(py))?;
    dict.set_item("defective", modes.defective.into_pyarray(py))?;
    dict.set_item("rounding", modes.rounding.into_pyarray(py))?;
    dict.set_item("residual", modes.residual.into_pyarray(py))?;
    dict.set_item("mass", dense(py, &modes.reduced.mass)?)?;
    dict.set_item("damping", dense(py, &modes.reduced.damping)?)?;
    dict.set_item("stiffness", dense(py, &modes.reduced.stiffness)?)?;
    Ok(dict)
}

/// Judged pairs: everything by its name.
pub fn pairs<'py>(
    py: Python<'py>,
    dofs: usize,
    pairs: &[core::modes::JudgedPair],
) -> PyResult<Bound<'py, PyDict>> {
    type Pair = core::modes::JudgedPair;
    let free = pairs.first().map_or(0, |pair| pair.mode.right.len());
    let numbers = |value: fn(&Pair) -> f64| -> Vec<f64> { pairs.iter().map(value).collect() };
    let vectors = |rows: usize, vector: fn(&Pair) -> &Vec<Complex64>| {
        columns(py, rows, pairs.len(), pairs.iter().flat_map(vector).copied().collect())
    };
    let eigenvalues: Vec<Complex64> = pairs.iter().map(|pair| pair.mode.eigenvalue).collect();
    let products: Vec<Complex64> = pairs.iter().map(|pair| pair.mode.a).collect();
    let defective: Vec<bool> = pairs.iter().map(|pair| pair.mode.is_defective()).collect();
    let dict = PyDict::new(py);
    dict.set_item("eigenvalues", eigenvalues.into_pyarray(py))?;
    dict.set_item("right_displacement", vectors(free, |pair| &pair.mode.right)?)?;
    dict.set_item("left_displacement", vectors(free, |pair| &pair.mode.left)?)?;
    dict.set_item("a", products.into_pyarray(py))?;
    dict.set_item("shapes", vectors(dofs, |pair| &pair.shape)?)?;
    dict.set_item("condition", numbers(|pair| pair.mode.condition).into_pyarray(py))?;
    dict.set_item("defective", defective.into_pyarray(py))?;
    dict.set_item("rounding", numbers(|pair| pair.rounding).into_pyarray(py))?;
    dict.set_item("residual", numbers(|pair| pair.mode.residual).into_pyarray(py))?;
    Ok(dict)
}
