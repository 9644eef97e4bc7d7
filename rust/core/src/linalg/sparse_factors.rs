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

/// Why a symmetric matrix has no Cholesky factor.
#[derive(Debug)]
pub(crate) enum NoCholesky {
    /// The pivot of this row is not positive.
    Pivot(usize),
    /// It does not fit into the memory of the machine.
    Memory,
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
        Self::within_memory(matrix).map_err(|why| match why {
            NoCholesky::Pivot(row) => row,
            NoCholesky::Memory => panic!("memory for a factor"),
        })
    }

    /// The same, also where the factor may be too large for the machine.
    pub fn within_memory(matrix: &SparseMatrix) -> Result<Self, NoCholesky> {
        let (ordering, options) = (SymmetricOrdering::Amd, Default::default());
        let pattern =
            factorize_symbolic_cholesky(columns(matrix).symbolic(), Side::Lower, ordering, options)
                .map_err(|_| NoCholesky::Memory)?;
        // An allocation that fails would end the process.
        let entries = pattern.len_val();
        Vec::<f64>::new().try_reserve_exact(entries).map_err(|_| NoCholesky::Memory)?;
        Self::with_pattern(Arc::new(pattern), matrix).map_err(NoCholesky::Pivot)
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

/// Factors of any sparse matrix.
#[derive(Debug)]
pub(crate) struct SparseLu {
    factors: Lu<usize, f64>,
}

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
    /// The factors of a matrix whose entries are of one size.
    pub fn new(matrix: &SparseMatrix) -> Result<Self, NoFactors> {
        // Compressed rows are the columns of the transpose.
        let transposed = columns(matrix);
        let pattern = SymbolicLu::try_new(transposed.symbolic())?;
        Ok(Self { factors: Lu::try_new_with_symbolic(pattern, transposed)? })
    }

    /// Writes `A^-1 rhs`, or `A^-T rhs`, over rhs.
    pub fn solve_in_place(&self, rhs: &mut DMatrix<f64>, transposed: bool) {
        let (rows, columns) = rhs.shape();
        let rhs = MatMut::from_column_major_slice_mut(rhs.as_mut_slice(), rows, columns);
        match transposed {
            true => self.factors.solve_in_place_with_conj(Conj::No, rhs),
            false => self.factors.solve_transpose_in_place_with_conj(Conj::No, rhs),
        }
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
        assert_eq!(NoFactors::from(LuError::Generic(FaerError::OutOfMemory)), NoFactors::Memory);
    }
}
