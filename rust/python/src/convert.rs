//! Arrays, names and records in and out.

use num_complex::Complex64;
use numpy::ndarray::{ArrayView, Dimension};
use numpy::npyffi::NPY_ORDER;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use stickslip_core::linalg::{DMatrix, SparseMatrix};
use stickslip_core::{Error, Method};

use crate::errors::{named, raise};

/// Entries of an array of any layout, row by row.
pub fn entries<D: Dimension>(array: ArrayView<'_, f64, D>) -> impl Iterator<Item = f64> {
    array.into_iter().copied()
}

/// A matrix from its entries row by row, as numpy holds them.
pub fn from_rows(
    rows: usize,
    columns: usize,
    entries: impl IntoIterator<Item = f64>,
) -> DMatrix<f64> {
    DMatrix::from_row_iterator(rows, columns, entries)
}

pub fn vector(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}

/// A square matrix given densely or as (data, indices, indptr).
#[derive(FromPyObject)]
pub enum MatrixInput<'py> {
    Dense(PyReadonlyArray2<'py, f64>),
    Sparse(PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, i64>, PyReadonlyArray1<'py, i64>),
}

impl MatrixInput<'_> {
    pub fn to_matrix(&self, py: Python<'_>, argument: &str) -> PyResult<SparseMatrix> {
        match self {
            MatrixInput::Dense(dense) => {
                let (rows, columns) = dense.as_array().dim();
                if rows != columns {
                    let error = Error::Shape {
                        argument: argument.to_owned(),
                        expected: "a square matrix".to_owned(),
                        got: format!("shape ({rows}, {columns})"),
                    };
                    return Err(raise(py, &error));
                }
                Ok(SparseMatrix::from_dense(&from_rows(rows, columns, entries(dense.as_array()))))
            }
            MatrixInput::Sparse(data, indices, indptr) => {
                let integers = |array: &PyReadonlyArray1<'_, i64>| -> Vec<i64> {
                    array.as_array().iter().copied().collect()
                };
                let starts = integers(indptr);
                let size = starts.len().saturating_sub(1);
                SparseMatrix::from_compressed_rows(
                    argument,
                    size,
                    &starts,
                    &integers(indices),
                    &vector(data),
                )
                .map_err(|error| raise(py, &error))
            }
        }
    }
}

pub type SparseParts<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>);

pub fn sparse_parts<'py>(py: Python<'py>, matrix: &SparseMatrix) -> SparseParts<'py> {
    let (data, columns, starts) = matrix.compressed_rows();
    (data.to_vec().into_pyarray(py), integers(py, columns), integers(py, starts))
}

/// A matrix in the order of numpy.
pub fn dense<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let by_rows = matrix.transpose();
    self::matrix(py, matrix.nrows(), matrix.ncols(), by_rows.as_slice().to_vec())
}

/// Row-major entries as a matrix.
pub fn matrix<'py>(
    py: Python<'py>,
    rows: usize,
    columns: usize,
    entries: Vec<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    entries.into_pyarray(py).reshape([rows, columns])
}

/// Column-major entries as a matrix, which stays in this order.
pub fn columns<'py>(
    py: Python<'py>,
    rows: usize,
    columns: usize,
    entries: Vec<Complex64>,
) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
    entries.into_pyarray(py).reshape_with_order([rows, columns], NPY_ORDER::NPY_FORTRANORDER)
}

/// A record from its bytes; anything else is ill-posed input.
pub fn read_record<T>(
    record: &Bound<'_, PyAny>,
    read: impl FnOnce(&[u8]) -> Result<T, Error>,
) -> PyResult<T> {
    let py = record.py();
    match record.cast::<PyBytes>() {
        Ok(bytes) => read(bytes.as_bytes()).map_err(|error| raise(py, &error)),
        Err(error) => Err(named(py, "InputError", &format!("record: {error}"))),
    }
}

pub fn method_named(py: Python<'_>, name: &str) -> PyResult<Method> {
    match name {
        "auto" => Ok(Method::Auto),
        "modal" => Ok(Method::Modal),
        "taylor" => Ok(Method::Taylor),
        "local" => Ok(Method::Local),
        other => {
            let message = format!(
                "method: must be \"auto\", \"modal\", \"taylor\" or \"local\", got {other:?}"
            );
            Err(named(py, "InputError", &message))
        }
    }
}

pub fn stops_at_grazing(py: Python<'_>, name: &str) -> PyResult<bool> {
    match name {
        "keep" => Ok(false),
        "stop" => Ok(true),
        other => {
            let message = format!("on_grazing: must be \"keep\" or \"stop\", got {other:?}");
            Err(named(py, "InputError", &message))
        }
    }
}

pub fn integers<'py>(py: Python<'py>, values: &[usize]) -> Bound<'py, PyArray1<i64>> {
    values.iter().map(|&value| value as i64).collect::<Vec<_>>().into_pyarray(py)
}
