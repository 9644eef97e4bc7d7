//! Singular values of small matrices, and what follows from them for matrices that may be singular.

use faer::MatRef;
use nalgebra::{DMatrix, DVector};

/// Singular values, the largest first, with the left and the right vectors in the columns of two matrices.
pub(crate) struct SingularValues {
    pub left: DMatrix<f64>,
    pub values: DVector<f64>,
    pub right: DMatrix<f64>,
}

impl SingularValues {
    /// By faer: where a value is zero, the vectors of nalgebra 0.34 can be wrong by 1e-8. NaN where the iteration does not
    /// converge, as with entries that are not finite.
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        let size = rows.min(columns);
        let viewed = MatRef::from_column_major_slice(matrix.as_slice(), rows, columns);
        let Ok(found) = viewed.thin_svd() else {
            let nan = |rows| DMatrix::from_element(rows, size, f64::NAN);
            let values = DVector::from_element(size, f64::NAN);
            return Self { left: nan(rows), values, right: nan(columns) };
        };
        Self {
            left: DMatrix::from_fn(rows, size, |i, k| found.U()[(i, k)]),
            values: DVector::from_fn(size, |k, _| found.S()[k]),
            right: DMatrix::from_fn(columns, size, |j, k| found.V()[(j, k)]),
        }
    }

    /// The least-squares inverse: values below `least` count as zero.
    pub fn inverse(&self, least: f64) -> DMatrix<f64> {
        let mut scaled = self.right.clone();
        for (mut column, &value) in scaled.column_iter_mut().zip(&self.values) {
            column *= if value <= least { 0.0 } else { 1.0 / value };
        }
        scaled * self.left.transpose()
    }
}

/// The least-squares inverse: singular values below 1e-10 of the largest count as zero.
pub(crate) fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let found = SingularValues::new(matrix);
    found.inverse(1e-10 * found.values.amax())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that nine contacts hold, two of which stick on one direction.
    #[test]
    fn a_singular_matrix_has_an_inverse_to_rounding() {
        #[rustfmt::skip]
        let matrix = DMatrix::from_row_slice(11, 11, &[
            1.0000000000000002, 0.0, 0.3212066885651059, 0.0, 0.0, 0.3537796484550008, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.3212066885651059, 0.0, 1.0, 0.0, 0.0, 0.24331250743433355, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, -1.0119072709747685, 0.0, 0.0, 1.0, 0.0, -0.3139802177496291, 0.0, 1.0, -1.0156891661026501, -0.5657709227593667,
            0.3537796484550009, 0.0, 0.24331250743433352, 0.0, 0.0, 0.9999999999999999, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0,
            0.0, -1.0119072709747685, 0.0, 0.0, 1.0, 0.0, -0.3139802177496291, 0.0, 1.0, -1.0156891661026501, -0.5657709227593667,
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0,
            0.0, 1.3192290586147428, 0.0, 0.0, -0.5657709227593667, 0.0, 0.5549599760593757, 0.0, -0.5657709227593667, 0.17239485198266297, 1.0,
        ]);
        let inverse = pseudo_inverse(&matrix);
        assert!((&matrix * &inverse * &matrix - &matrix).amax() <= 1e-14);
        assert!((&inverse * &matrix * &inverse - &inverse).amax() <= 1e-14);
    }
}
