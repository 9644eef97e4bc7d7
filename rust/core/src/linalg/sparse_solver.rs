//! Solutions with a large sparse matrix that is symmetric but for a few rows, as the stiffness of sliding is.
//!
//! With S the stiffness of the coordinates that a combination leaves free, friction adds to the row of each sliding
//! contact mu times the row of its normal coordinate:
//!
//! ```text
//! A = S + E V',   A^-1 b = y - Z (I + V' Z)^-1 V' y,   y = S^-1 b,   Z = S^-1 E
//! A^-T b = S^-1 (b - V (I + V' Z)^-T Z' b)
//! ```
//!
//! (Woodbury), E the unit vectors of these rows and V what is added. A Cholesky factor of S takes a small part of the
//! memory of an LU of A, which knows no symmetry. Where S is positive semidefinite and singular, `S x = 0` says that x is a
//! motion without forces, in the added rows, too: then A is singular as well, so nothing is lost by factorizing S.

use nalgebra::DMatrix;

use crate::linalg::dense::Factors;
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::linalg::sparse_factors::{NoCholesky, NoFactors, SparseCholesky, SparseLu};

/// Steps of the estimate of a condition; as a rule it does not change after the second.
const CONDITION_STEPS: usize = 5;
/// Difference of two mirrored entries, relative to them or to the diagonal entries, that is rounding.
const ASYMMETRY: f64 = 8.0 * f64::EPSILON;

/// A row of the matrix and the entries, columns ascending, that are added to it.
pub(crate) type AddedRow = (usize, Vec<(usize, f64)>);

/// What solves with a sparse matrix.
#[derive(Debug)]
pub(crate) struct SparseSolver {
    /// `R A C` has entries of one size in every row, `C A C` a diagonal of ones where that of A is positive.
    rows: Vec<f64>,
    columns: Vec<f64>,
    factors: ScaledFactors,
}

#[derive(Debug)]
enum ScaledFactors {
    /// Of `C A C`
    Symmetric { cholesky: SparseCholesky, added: Added },
    /// Of `R A C`
    General(SparseLu),
}

/// The added rows, and what they do to solutions.
#[derive(Debug)]
struct Added {
    rows: Vec<AddedRow>,
    /// Z
    responses: DMatrix<f64>,
    /// `I + V' Z`
    coupling: Factors<f64>,
}

impl SparseSolver {
    /// Of a matrix with rows added to it, if its scaled reciprocal condition is at least `least`.
    pub fn new(matrix: &SparseMatrix, added: &[AddedRow], least: f64) -> Result<Self, NoFactors> {
        let whole = with_added(matrix, added);
        let size = whole.size();
        let largest =
            |row: usize| whole.row(row).fold(0.0, |size: f64, entry| size.max(entry.1.abs()));
        let column = |k: usize| match whole.get(k, k).abs() {
            0.0 => largest(k).sqrt(),
            entry => entry.sqrt(),
        };
        let columns: Vec<f64> = (0..size).map(|k| column(k).recip()).collect();
        let of_row = |row: usize| {
            whole.row(row).map(|(k, value)| (value * columns[k]).abs()).fold(0.0, f64::max).recip()
        };
        let rows: Vec<f64> = (0..size).map(of_row).collect();
        if rows.iter().chain(&columns).any(|factor| !factor.is_finite()) {
            return Err(NoFactors::Singular(0.0));
        }
        let scaled = scaled(&whole, &rows, &columns);
        let factors = match symmetric_factors(matrix, added, &columns)? {
            Some(factors) => factors,
            None => ScaledFactors::General(SparseLu::new(&scaled)?),
        };
        let found = Self { factors, rows, columns };
        let norm = (0..size).map(|row| scaled.row(row).map(|entry| entry.1.abs()).sum::<f64>());
        let condition = norm.fold(0.0, f64::max) * found.inverse_norm();
        match 1.0 / condition {
            reciprocal if reciprocal >= least => Ok(found),
            reciprocal if reciprocal > 0.0 => Err(NoFactors::Singular(reciprocal)),
            _ => Err(NoFactors::Singular(0.0)),
        }
    }

    /// `A^-1 rhs`
    pub fn solve(&self, mut rhs: DMatrix<f64>) -> DMatrix<f64> {
        for mut column in rhs.column_iter_mut() {
            column.iter_mut().zip(&self.rows).for_each(|(x, factor)| *x *= factor);
        }
        let mut found = self.solve_scaled(rhs, false);
        for mut column in found.column_iter_mut() {
            column.iter_mut().zip(&self.columns).for_each(|(x, factor)| *x *= factor);
        }
        found
    }

    /// `A^-1 rhs` of one column.
    pub fn solve_one(&self, rhs: &[f64]) -> Vec<f64> {
        self.solve(DMatrix::from_column_slice(rhs.len(), 1, rhs)).data.into()
    }

    /// `(R A C)^-1 rhs`, or `(R A C)^-T rhs`
    fn solve_scaled(&self, mut rhs: DMatrix<f64>, transposed: bool) -> DMatrix<f64> {
        let (cholesky, added) = match &self.factors {
            ScaledFactors::General(lu) => {
                lu.solve_in_place(&mut rhs, transposed);
                return rhs;
            }
            ScaledFactors::Symmetric { cholesky, added } => (cholesky, added),
        };
        let balance = |mut x: DMatrix<f64>| {
            for mut column in x.column_iter_mut() {
                let factors = self.columns.iter().zip(&self.rows);
                column.iter_mut().zip(factors).for_each(|(x, (c, r))| *x *= c / r);
            }
            x
        };
        if transposed {
            let forces = added.coupling.transposed_solve(added.responses.tr_mul(&rhs));
            added.spread(-forces, &mut rhs);
            return balance(cholesky.solve(rhs));
        }
        let mut found = cholesky.solve(balance(rhs));
        let forces = added.coupling.solve(gathered(&added.rows, &found));
        found.gemm(-1.0, &added.responses, &forces, 1.0);
        found
    }

    /// A lower bound of the row-sum norm of the inverse of the scaled matrix, as a rule the norm itself (Hager 1984);
    /// infinite if the matrix has no inverse.
    fn inverse_norm(&self) -> f64 {
        let size = self.rows.len();
        let mut estimate: f64 = 0.0;
        let mut x = DMatrix::from_element(size, 1, 1.0 / size as f64);
        for _ in 0..CONDITION_STEPS {
            x = self.solve_scaled(x, true);
            let norm: f64 = x.iter().map(|x| x.abs()).sum();
            if !norm.is_finite() {
                return f64::INFINITY;
            }
            if norm <= estimate {
                break;
            }
            estimate = norm;
            x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
            x = self.solve_scaled(x, false);
            let steepest = (0..size).max_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs()));
            x.fill(0.0);
            steepest.into_iter().for_each(|k| x[k] = 1.0);
        }
        estimate
    }
}

impl Added {
    /// Adds `V forces` to x.
    fn spread(&self, forces: DMatrix<f64>, x: &mut DMatrix<f64>) {
        for (row, forces) in self.rows.iter().zip(forces.row_iter()) {
            for &(k, value) in &row.1 {
                forces.iter().enumerate().for_each(|(j, force)| x[(k, j)] += value * force);
            }
        }
    }
}

/// `V' x`
fn gathered(rows: &[AddedRow], x: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), x.ncols(), |i, j| {
        rows[i].1.iter().map(|&(k, value)| value * x[(k, j)]).sum()
    })
}

/// Factors of `C A C` if the matrix without the added rows is symmetric and positive definite.
fn symmetric_factors(
    matrix: &SparseMatrix,
    added: &[AddedRow],
    columns: &[f64],
) -> Result<Option<ScaledFactors>, NoFactors> {
    let scaled = scaled(matrix, columns, columns);
    let symmetric = |row: usize| {
        let mut entries = scaled.row(row);
        let rounding = |value: f64| ASYMMETRY * value.abs().max(1.0);
        entries.all(|(k, value)| (value - scaled.get(k, row)).abs() <= rounding(value))
    };
    if !(0..scaled.size()).all(symmetric) {
        return Ok(None);
    }
    let cholesky = match SparseCholesky::within_memory(&scaled) {
        Ok(cholesky) => cholesky,
        Err(NoCholesky::Pivot(_)) => return Ok(None),
        Err(NoCholesky::Memory) => return Err(NoFactors::Memory),
    };
    let scale = |&(row, ref entries): &AddedRow| {
        let entries = entries.iter().map(|&(k, value)| (k, columns[row] * value * columns[k]));
        (row, entries.collect())
    };
    let rows: Vec<AddedRow> = added.iter().map(scale).collect();
    let mut units = DMatrix::zeros(scaled.size(), rows.len());
    rows.iter().enumerate().for_each(|(i, row)| units[(row.0, i)] = 1.0);
    let responses = cholesky.solve(units);
    let identity = DMatrix::identity(rows.len(), rows.len());
    let coupling = Factors::new(gathered(&rows, &responses) + identity);
    Ok(Some(ScaledFactors::Symmetric { cholesky, added: Added { rows, responses, coupling } }))
}

fn scaled(matrix: &SparseMatrix, rows: &[f64], columns: &[f64]) -> SparseMatrix {
    SparseMatrix::from_rows(matrix.size(), |row, entries| {
        entries.extend(matrix.row(row).map(|(k, value)| (k, value * rows[row] * columns[k])));
    })
}

fn with_added(matrix: &SparseMatrix, added: &[AddedRow]) -> SparseMatrix {
    let mut more = vec![Vec::new(); matrix.size()];
    added.iter().for_each(|(row, entries)| more[*row].extend_from_slice(entries));
    let more = SparseMatrix::from_rows(matrix.size(), |row, entries| {
        let added = &mut more[row];
        summed(added);
        entries.append(added);
    });
    matrix.combined(1.0, &more, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second difference of 400 points, `shift` added to its diagonal.
    fn chain(shift: f64) -> SparseMatrix {
        SparseMatrix::from_rows(400, |row, entries| {
            let columns = row.saturating_sub(1)..(row + 2).min(400);
            entries.extend(columns.map(|k| (k, if k == row { 2.0 + shift } else { -1.0 })));
        })
    }

    /// In units that differ by 16 powers of ten: the chain, and rows added to it.
    fn stated(plain: &SparseMatrix) -> (SparseMatrix, Vec<AddedRow>, impl Fn(usize) -> f64) {
        let scale = |k: usize| 10.0_f64.powi((k % 5) as i32 * 4 - 8);
        let matrix = SparseMatrix::from_rows(plain.size(), |row, entries| {
            entries.extend(plain.row(row).map(|(k, value)| (k, scale(row) * value * scale(k))));
        });
        let row = |row: usize, terms: [(usize, f64); 2]| {
            (row, terms.map(|(k, value)| (k, scale(row) * value * scale(k))).to_vec())
        };
        let added = vec![
            row(3, [(4, 0.7), (150, -0.4)]),
            row(3, [(4, 0.2), (8, 0.5)]),
            row(210, [(0, 0.3), (210, 0.6)]),
        ];
        (matrix, added, scale)
    }

    /// By a symmetric factor with rows beside it, and by an LU: the same, in both directions.
    #[test]
    fn solutions_of_an_unsymmetric_matrix() {
        let plain = chain(0.05);
        let (matrix, added, scale) = stated(&plain);
        let whole = with_added(&matrix, &added);
        let beside = SparseSolver::new(&matrix, &added, 1e-13).unwrap();
        let mixed = SparseSolver::new(&whole, &[], 1e-13).unwrap();
        assert!(matches!(beside.factors, ScaledFactors::Symmetric { .. }));
        assert!(matches!(mixed.factors, ScaledFactors::General(_)));
        let expected =
            DMatrix::from_fn(400, 2, |k, j| (1.0 + (k * (j + 1)) as f64).sin() / scale(k));
        for solver in [&beside, &mixed] {
            let found = solver.solve(whole.times(&expected));
            for (k, (found, expected)) in found.row_iter().zip(expected.row_iter()).enumerate() {
                assert!(((found - expected) * scale(k)).amax() <= 1e4 * f64::EPSILON);
            }
        }
        let rhs = DMatrix::from_fn(400, 1, |k, _| (2.0 + k as f64).cos());
        let [one, other] = [&beside, &mixed].map(|solver| solver.solve_scaled(rhs.clone(), true));
        assert!((&one - &other).amax() <= 1e4 * f64::EPSILON * one.amax());
        let [one, other] = [beside, mixed].map(|solver| solver.inverse_norm());
        assert!((one - other).abs() <= 1e-10 * one);
    }

    /// A saddle has no Cholesky factor, and is solved with nevertheless.
    #[test]
    fn an_indefinite_matrix_is_solved_with() {
        let matrix = chain(-1.0);
        let solver = SparseSolver::new(&matrix, &[(7, vec![(9, 0.5)])], 1e-13).unwrap();
        assert!(matches!(solver.factors, ScaledFactors::General(_)));
        let expected: Vec<f64> = (0..400).map(|k| (1.0 + k as f64).sin()).collect();
        let mut rhs = matrix.apply(&expected);
        rhs[7] += 0.5 * expected[9];
        let found = solver.solve_one(&rhs);
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e5 * f64::EPSILON));
    }

    /// Without its held edges a chain moves as a whole, with added rows or without; and rows can cancel what is there.
    #[test]
    fn singular_matrices_are_refused() {
        let loose = SparseMatrix::from_rows(3, |row, entries| match row {
            1 => entries.extend([(0, -1.0), (1, 2.0), (2, -1.0)]),
            0 => entries.extend([(0, 1.0), (1, -1.0)]),
            _ => entries.extend([(1, -1.0), (2, 1.0)]),
        });
        let pulling = vec![(0, vec![(1, 0.5), (2, -0.5)])];
        let held = SparseMatrix::diagonal(&[1.0, 2.0, 4.0]);
        let cancelled = vec![(1, vec![(1, -2.0), (2, 1.0)]), (2, vec![(1, 4.0), (2, -4.0)])];
        let lost = vec![(1, vec![(0, 1.0), (1, -2.0), (2, 1.0)]), (2, vec![(0, 3.0), (2, -1.0)])];
        for (matrix, added) in [(&loose, vec![]), (&loose, pulling)] {
            let Err(NoFactors::Singular(condition)) = SparseSolver::new(matrix, &added, 1e-13)
            else {
                panic!("a singular matrix")
            };
            assert!(condition < 1e-13);
        }
        // [1 0 0; 1 0 1; 3 0 3]
        assert!(SparseSolver::new(&held, &lost, 1e-13).is_err());
        // [1 0 0; 0 0 1; 0 4 0]
        let turned = SparseSolver::new(&held, &cancelled, 1e-13).unwrap();
        assert!(matches!(turned.factors, ScaledFactors::Symmetric { .. }));
        let found = turned.solve_one(&[1.0, 2.0, 3.0]);
        assert!(found.iter().zip([1.0, 0.75, 2.0]).all(|(a, b)| (a - b).abs() <= 1e-14));
        let none = SparseSolver::new(&SparseMatrix::diagonal(&[1.0, 0.0]), &[], 1e-13);
        assert_eq!(none.unwrap_err(), NoFactors::Singular(0.0));
    }
}
