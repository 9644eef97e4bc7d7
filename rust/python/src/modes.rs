//! Reduced matrices and complex modes.

use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{columns, matrix};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Reduced {
    inner: core::Reduced,
    right_basis: Vec<f64>,
    left_basis: Vec<f64>,
    dofs: usize,
    statics: core::scene::Statics,
}

impl Reduced {
    pub fn new(scene: &core::Scene, inner: core::Reduced) -> Self {
        let (right_basis, left_basis) = inner.bases(scene);
        let statics = core::scene::Statics::new(scene, &inner);
        Self { inner, right_basis, left_basis, dofs: scene.size(), statics }
    }

    fn square<'py>(&self, py: Python<'py>, entries: &[f64]) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.inner.size(), self.inner.size(), entries.to_vec())
    }
}

#[pymethods]
impl Reduced {
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.square(py, &self.inner.mass)
    }

    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.square(py, &self.inner.damping)
    }

    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.square(py, &self.inner.stiffness)
    }

    #[getter]
    fn force_constant<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.force_constant.clone().into_pyarray(py)
    }

    /// Load (1, m), rows (c, m), offsets (1, c) and slider speeds (1, c): margins are `rows . K^-1 load - offsets`.
    #[getter]
    fn statics<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyArray2<f64>>; 4]> {
        let core::scene::Statics { load, rows, offsets, speeds } = self.statics.clone();
        let (m, contacts) = (load.len(), offsets.len());
        Ok([
            matrix(py, 1, m, load)?,
            matrix(py, contacts, m, rows)?,
            matrix(py, 1, contacts, offsets)?,
            matrix(py, 1, contacts, speeds)?,
        ])
    }

    #[getter]
    fn force_linear<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.force_linear.clone().into_pyarray(py)
    }

    #[getter]
    fn right_basis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.dofs, self.inner.size(), self.right_basis.clone())
    }

    #[getter]
    fn left_basis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.dofs, self.inner.size(), self.left_basis.clone())
    }
}

/// Of modes: everything by its name, and the reduced matrices that they belong to.
pub fn modes<'py>(
    py: Python<'py>,
    dofs: usize,
    modes: core::Modes,
) -> PyResult<Bound<'py, PyDict>> {
    let (free, count) = (modes.reduced.size(), modes.eigenvalues.len());
    let square = |entries: Vec<f64>| matrix(py, free, free, entries);
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
    dict.set_item("mass", square(modes.reduced.mass)?)?;
    dict.set_item("damping", square(modes.reduced.damping)?)?;
    dict.set_item("stiffness", square(modes.reduced.stiffness)?)?;
    Ok(dict)
}
