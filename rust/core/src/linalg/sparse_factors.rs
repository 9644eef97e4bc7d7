//! Factors of sparse matrices: the one file that knows the calls of faer for them.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::cholesky::{
    LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use nalgebra::DMatrix;

use crate::linalg::sparse::SparseMatrix;

/// `A = G G'` of a sparse matrix that is symmetric and positive definite.
#[derive(Debug)]
pub(crate) struct SparseCholesky {
    pattern: Arc<SymbolicCholesky<usize>>,
    values: Vec<f64>,
}

/// The columns of a symmetric matrix, which are its rows.
fn columns(matrix: &SparseMatrix) -> SparseColMatRef<'_, usize, f64> {
    let (values, columns, starts) = matrix.compressed_rows();
    let size = matrix.size();
    let pattern = SymbolicSparseColMatRef::new_checked(size, size, starts, None, columns);
    SparseColMatRef::new(pattern, values)
}

impl SparseCholesky {
    /// The factor of a symmetric matrix, or the row of the first pivot that is not positive.
    pub fn new(matrix: &SparseMatrix) -> Result<Self, usize> {
        let (ordering, options) = (SymmetricOrdering::Amd, Default::default());
        let pattern =
            factorize_symbolic_cholesky(columns(matrix).symbolic(), Side::Lower, ordering, options)
                .expect("memory for the pattern of a factor");
        Self::with_pattern(Arc::new(pattern), matrix)
    }

    /// The factor of another matrix whose entries have the same places.
    pub fn again(&self, matrix: &SparseMatrix) -> Result<Self, usize> {
        Self::with_pattern(Arc::clone(&self.pattern), matrix)
    }

    fn with_pattern(
        pattern: Arc<SymbolicCholesky<usize>>,
        matrix: &SparseMatrix,
    ) -> Result<Self, usize> {
        let mut values = vec![0.0; pattern.len_val()];
        let scratch = pattern.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let found = pattern.factorize_numeric_llt(
            &mut values,
            columns(matrix),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        );
        match found.map(|_| ()) {
            Ok(()) => Ok(Self { pattern, values }),
            Err(LltError::NonPositivePivot { index }) => {
                // Entry by entry they are counted from 1, block by block from 0.
                let step = match pattern.raw() {
                    SymbolicCholeskyRaw::Simplicial(_) => index - 1,
                    SymbolicCholeskyRaw::Supernodal(_) => index,
                };
                Err(pattern.perm().map_or(step, |order| order.arrays().0[step]))
            }
        }
    }

    /// Numbers in the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Writes `A^-1 x` over x.
    pub fn solve_in_place(&self, x: &mut [f64]) {
        let rows = x.len();
        self.solve_columns(MatMut::from_column_major_slice_mut(x, rows, 1));
    }

    /// `A^-1 rhs`
    pub fn solve(&self, mut rhs: DMatrix<f64>) -> DMatrix<f64> {
        let (rows, columns) = rhs.shape();
        self.solve_columns(MatMut::from_column_major_slice_mut(rhs.as_mut_slice(), rows, columns));
        rhs
    }

    fn solve_columns(&self, rhs: MatMut<'_, f64>) {
        let scratch = self.pattern.solve_in_place_scratch::<f64>(rhs.ncols(), Par::Seq);
        let factor = LltRef::new(&self.pattern, &self.values);
        let mut memory = MemBuffer::new(scratch);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut memory));
    }
}

/// Factors of any sparse matrix, its rows and columns scaled to entries of one size.
#[derive(Debug)]
pub(crate) struct SparseLu {
    factors: Lu<usize, f64>,
    rows: Vec<f64>,
    columns: Vec<f64>,
}

/// Steps of the estimate of a condition; as a rule it does not change after the second.
const CONDITION_STEPS: usize = 5;

/// Why a matrix has no factors.
#[derive(Debug, PartialEq)]
pub(crate) enum NoFactors {
    /// Its scaled reciprocal condition is too small; 0 if it is exactly singular.
    Singular(f64),
    /// They do not fit into the memory of the machine.
    Memory,
}

impl From<LuError> for NoFactors {
    fn from(error: LuError) -> Self {
        match error {
            LuError::SymbolicSingular { .. } => Self::Singular(0.0),
            LuError::Generic(error) => Self::from(error),
        }
    }
}

impl From<FaerError> for NoFactors {
    fn from(_: FaerError) -> Self {
        Self::Memory
    }
}

impl SparseLu {
    /// The factors of a matrix if its scaled reciprocal condition is at least `least`.
    pub fn new(matrix: &SparseMatrix, least: f64) -> Result<Self, NoFactors> {
        let size = matrix.size();
        let largest =
            |row: usize| matrix.row(row).fold(0.0, |size: f64, entry| size.max(entry.1.abs()));
        let column = |k: usize| match matrix.get(k, k).abs() {
            0.0 => largest(k).sqrt(),
            entry => entry.sqrt(),
        };
        let columns: Vec<f64> = (0..size).map(|k| column(k).recip()).collect();
        let of_row = |row: usize| {
            matrix.row(row).map(|(k, value)| (value * columns[k]).abs()).fold(0.0, f64::max).recip()
        };
        let rows: Vec<f64> = (0..size).map(of_row).collect();
        if rows.iter().chain(&columns).any(|factor| !factor.is_finite()) {
            return Err(NoFactors::Singular(0.0));
        }
        let scaled = SparseMatrix::from_rows(size, |row, entries| {
            entries.extend(matrix.row(row).map(|(k, value)| (k, value * rows[row] * columns[k])));
        });
        // Compressed rows are the columns of the transpose.
        let transposed = self::columns(&scaled);
        let pattern = SymbolicLu::try_new(transposed.symbolic())?;
        let factors = Lu::try_new_with_symbolic(pattern, transposed)?;
        let found = Self { factors, rows, columns };
        let norm = (0..size).map(|row| scaled.row(row).map(|entry| entry.1.abs()).sum::<f64>());
        let condition = norm.fold(0.0, f64::max) * found.inverse_norm();
        match 1.0 / condition {
            reciprocal if reciprocal >= least => Ok(found),
            reciprocal if reciprocal > 0.0 => Err(NoFactors::Singular(reciprocal)),
            _ => Err(NoFactors::Singular(0.0)),
        }
    }

    /// `A^-1 x`
    pub fn solve(&self, x: &[f64]) -> Vec<f64> {
        let mut scaled: Vec<f64> = x.iter().zip(&self.rows).map(|(x, factor)| x * factor).collect();
        self.solve_scaled(&mut scaled, false);
        scaled.iter_mut().zip(&self.columns).for_each(|(x, factor)| *x *= factor);
        scaled
    }

    fn solve_scaled(&self, x: &mut [f64], transposed: bool) {
        let rows = x.len();
        let x = MatMut::from_column_major_slice_mut(x, rows, 1);
        match transposed {
            true => self.factors.solve_in_place_with_conj(Conj::No, x),
            false => self.factors.solve_transpose_in_place_with_conj(Conj::No, x),
        }
    }

    /// A lower bound of the row-sum norm of the inverse of the scaled matrix, as a rule the norm itself (Hager 1984);
    /// infinite if the matrix has no inverse.
    fn inverse_norm(&self) -> f64 {
        let size = self.rows.len();
        let mut estimate: f64 = 0.0;
        let mut x = vec![1.0 / size as f64; size];
        for _ in 0..CONDITION_STEPS {
            self.solve_scaled(&mut x, true);
            let norm: f64 = x.iter().map(|x| x.abs()).sum();
            if !norm.is_finite() {
                return f64::INFINITY;
            }
            if norm <= estimate {
                break;
            }
            estimate = norm;
            x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
            self.solve_scaled(&mut x, false);
            let steepest = (0..size).max_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs()));
            x.fill(0.0);
            steepest.into_iter().for_each(|k| x[k] = 1.0);
        }
        estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second difference of a grid, `shift` added to its diagonal.
    fn grid(side: usize, shift: f64) -> SparseMatrix {
        SparseMatrix::from_rows(side * side, |row, entries| {
            let (i, j) = (row / side, row % side);
            let neighbours = [
                (i > 0).then(|| row - side),
                (j > 0).then(|| row - 1),
                Some(row),
                (j + 1 < side).then_some(row + 1),
                (i + 1 < side).then_some(row + side),
            ];
            let entry = |k: usize| (k, if k == row { 4.0 + shift } else { -1.0 });
            entries.extend(neighbours.into_iter().flatten().map(entry));
        })
    }

    /// Small ones, which faer factorizes entry by entry, and large ones, which it does block by block.
    #[test]
    fn solutions_of_a_grid() {
        for side in [1, 2, 9, 40] {
            let matrix = grid(side, 0.0);
            let factor = SparseCholesky::new(&matrix).unwrap();
            let expected =
                DMatrix::from_fn(side * side, 3, |i, j| (1.0 + (i * (j + 2)) as f64).sin());
            let found = factor.solve(matrix.times(&expected));
            // The condition of the grid is below its number of points.
            let rounding = 10.0 * f64::EPSILON * (side * side) as f64;
            assert!((&found - &expected).amax() <= rounding);
            let mut one = matrix.apply(expected.column(1).as_slice());
            factor.solve_in_place(&mut one);
            assert!(one.iter().zip(found.column(1).iter()).all(|(a, b)| (a - b).abs() <= rounding));
        }
    }

    /// The smallest eigenvalue of the grid is `8 sin^2(pi / 2 (side + 1))`.
    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let side = 30;
        let smallest = 8.0 * (0.5 * std::f64::consts::PI / (side + 1) as f64).sin().powi(2);
        let factor = SparseCholesky::new(&grid(side, -smallest * (1.0 - 1e-9))).unwrap();
        assert!(factor.again(&grid(side, -smallest * (1.0 + 1e-9))).is_err());
        let matrix = SparseMatrix::diagonal(&[1.0, 2.0, -3.0, 4.0]);
        assert_eq!(SparseCholesky::new(&matrix).unwrap_err(), 2);
    }

    /// Rows and columns in units that differ by 16 powers of ten, and a matrix that is singular.
    #[test]
    fn solutions_of_an_unsymmetric_matrix() {
        let side = 20;
        let size = side * side;
        let scale = |k: usize| 10.0_f64.powi((k % 5) as i32 * 4 - 8);
        let plain = grid(side, 0.0);
        let matrix = SparseMatrix::from_rows(size, |row, entries| {
            let turned = |k: usize| if k == row + 1 { 0.7 } else { 0.0 };
            entries.extend(
                plain.row(row).map(|(k, value)| (k, scale(row) * (value + turned(k)) * scale(k))),
            );
        });
        let factors = SparseLu::new(&matrix, 1e-13).unwrap();
        let expected: Vec<f64> = (0..size).map(|k| (1.0 + k as f64).sin() / scale(k)).collect();
        let found = factors.solve(&matrix.apply(&expected));
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!(((found - expected) * scale(k)).abs() <= 1e4 * f64::EPSILON);
        }
        // Without its held edges the grid moves as a whole.
        let loose = SparseMatrix::from_rows(3, |row, entries| match row {
            1 => entries.extend([(0, -1.0), (1, 2.0), (2, -1.0)]),
            0 => entries.extend([(0, 1.0), (1, -1.0)]),
            _ => entries.extend([(1, -1.0), (2, 1.0)]),
        });
        let Err(NoFactors::Singular(condition)) = SparseLu::new(&loose, 1e-13) else {
            panic!("a singular matrix")
        };
        assert!(condition < 1e-13);
        let none = SparseLu::new(&SparseMatrix::diagonal(&[1.0, 0.0]), 1e-13);
        assert_eq!(none.unwrap_err(), NoFactors::Singular(0.0));
        assert_eq!(NoFactors::from(LuError::Generic(FaerError::OutOfMemory)), NoFactors::Memory);
    }
}
