//! How fast a scene can move at most: proved bounds of its stiffness and damping by its mass.
//!
//! In the norm `|x|^2 = x' M x` a symmetric matrix S has the norm of `M^-1/2 S M^-1/2`: it is at most s exactly if
//! neither `s M - S` nor `s M + S` has a negative eigenvalue. Sparse Cholesky factors of both prove it. Power iteration
//! on `M^-1 S` says which s to try; whatever it says, the proof decides.

use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::SparseCholesky;

/// Steps of power iteration. After this many its estimate is some percent below the largest eigenvalue.
const STEPS: usize = 20;
/// How much larger than the estimate the bound is, and than a bound that was not proved the next one.
const MARGIN: f64 = 1.1;
/// Bounds tried before a matrix is taken for unbounded.
const TRIALS: usize = 1000;

/// Bound of `M^-1/2 A M^-1/2` in the Euclidean norm; infinite where none is found. `factor` is that of M.
pub(super) fn rate(mass: &SparseMatrix, factor: &SparseCholesky, matrix: &SparseMatrix) -> f64 {
    let [symmetric, skew] = matrix.parts();
    let mut bound = 0.0;
    if symmetric.entries() > 0 {
        bound += symmetric_rate(mass, factor, &symmetric);
    }
    if skew.entries() > 0 {
        // |x' N y| <= |x|_R |y|_R with the row sums R of |N| (Schur's test), since |N| is symmetric.
        let row_sum = |row: usize| skew.row(row).map(|entry| entry.1.abs()).sum::<f64>();
        let sums: Vec<f64> = (0..skew.size()).map(row_sum).collect();
        bound += symmetric_rate(mass, factor, &SparseMatrix::diagonal(&sums));
    }
    bound
}

fn symmetric_rate(mass: &SparseMatrix, factor: &SparseCholesky, matrix: &SparseMatrix) -> f64 {
    // No eigenvector is orthogonal to this start by a symmetry of a mesh.
    let mut x: Vec<f64> = (0..mass.size()).map(|k| (1.0 + 7.3 * k as f64).sin()).collect();
    let mut estimate = 0.0;
    for _ in 0..STEPS {
        let mut next = matrix.apply(&x);
        let form = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let size = form(&x, &mass.apply(&x));
        let image = next.clone();
        factor.solve_in_place(&mut next);
        // |S x| in the dual norm over |x|: at most the largest eigenvalue, for any x.
        let found = (form(&image, &next) / size).sqrt();
        if !(found > 0.0 && found.is_finite()) {
            break;
        }
        estimate = found;
        next.iter_mut().for_each(|entry| *entry /= found * size.sqrt());
        x = next;
    }
    if estimate == 0.0 {
        let sizes = (0..mass.size()).flat_map(|row| {
            matrix.row(row).map(move |(column, value)| {
                value.abs() / (mass.get(row, row) * mass.get(column, column)).sqrt()
            })
        });
        estimate = sizes.fold(0.0, f64::max);
    }
    let mut bound = estimate;
    let mut pattern: Option<SparseCholesky> = None;
    for _ in 0..TRIALS {
        bound *= MARGIN;
        let proved = [-1.0, 1.0].iter().all(|&sign| {
            let shifted = mass.combined(bound, matrix, sign);
            let found = match &pattern {
                Some(known) => known.again(&shifted),
                None => SparseCholesky::new(&shifted),
            };
            found.map(|factor| pattern = Some(factor)).is_ok()
        });
        if proved {
            return bound;
        }
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against the singular values of `G^-1 A G^-T`, with `M = G G'`: never below, and near for symmetric matrices.
        #[test]
        fn rates_bound_the_matrix(
            size in 1usize..9,
            numbers in proptest::collection::vec(-1.0..1.0f64, 200),
            symmetric in any::<bool>(),
        ) {
            let square = |first: usize| DMatrix::from_fn(size, size, |i, j| numbers[first + i * size + j]);
            let mass = square(0);
            let mass = &mass * mass.transpose() + DMatrix::identity(size, size) * 0.05;
            let given = square(100);
            let given = if symmetric { &given + given.transpose() } else { given };
            let sparse = SparseMatrix::from_dense(&mass);
            let factor = SparseCholesky::new(&sparse).unwrap();
            let bound = rate(&sparse, &factor, &SparseMatrix::from_dense(&given));
            let lower = mass.cholesky().unwrap().l();
            let half = lower.solve_lower_triangular(&given).unwrap();
            let normal = lower.solve_lower_triangular(&half.transpose()).unwrap();
            let exact = normal.singular_values().max();
            prop_assert!(bound >= exact, "{bound} of {exact}");
            if symmetric {
                prop_assert!(bound <= MARGIN * MARGIN * exact * (1.0 + 1e-9), "{bound} of {exact}");
            }
        }
    }
}
