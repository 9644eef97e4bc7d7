//! Reduced matrices and complex modes.

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use stickslip_core as core;

use crate::convert::{columns, matrix};

#[pyclass(frozen, module = "stickslip._core")]
pub struct Reduced {
    inner: core::Reduced,
    right_basis: Vec<f64>,
    left_basis: Vec<f64>,
    dofs: usize,
}

impl Reduced {
    pub fn new(scene: &core::Scene, inner: core::Reduced) -> Self {
        let (right_basis, left_basis) = inner.bases(scene);
        Self { inner, right_basis, left_basis, dofs: scene.size() }
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

#[pyclass(frozen, module = "stickslip._core")]
pub struct Modes {
    inner: core::Modes,
    dofs: usize,
}

impl Modes {
    pub fn new(scene: &core::Scene, inner: core::Modes) -> Self {
        Self { inner, dofs: scene.size() }
    }

    fn count(&self) -> usize {
        self.inner.eigenvalues.len()
    }
}

#[pymethods]
impl Modes {
    #[getter]
    fn eigenvalues<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        self.inner.eigenvalues.clone().into_pyarray(py)
    }

    #[getter]
    fn right<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        columns(py, self.count(), self.count(), &self.inner.right)
    }

    #[getter]
    fn left<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        columns(py, self.count(), self.count(), &self.inner.left)
    }

    #[getter]
    fn a<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        self.inner.a.clone().into_pyarray(py)
    }

    #[getter]
    fn b<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        self.inner.b.clone().into_pyarray(py)
    }

    #[getter]
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        columns(py, self.dofs, self.count(), &self.inner.shapes)
    }

    #[getter]
    fn condition<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.condition.clone().into_pyarray(py)
    }

    #[getter]
    fn defective<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.inner.defective.clone().into_pyarray(py)
    }

    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.residual.clone().into_pyarray(py)
    }

    #[getter]
    fn state_a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.count(), self.count(), self.inner.state_matrices().0)
    }

    #[getter]
    fn state_b<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.count(), self.count(), self.inner.state_matrices().1)
    }
}
