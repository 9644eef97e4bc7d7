//! Damping that is proportional to mass or stiffness, recognised.

use crate::linalg::sparse::SparseMatrix;

/// (alpha, beta) of a matrix that is `alpha M`, `beta K` or zero to the last bit. A matrix with both parts was rounded
/// when it was summed, and is taken as it is.
pub(crate) fn proportions(
    damping: &SparseMatrix,
    mass: &SparseMatrix,
    stiffness: &SparseMatrix,
) -> Option<(f64, f64)> {
    let size = damping.size();
    let entries = |matrix: &SparseMatrix, factor: f64| {
        let nonzero =
            |row| matrix.row(row).map(move |(column, value)| (row, column, factor * value));
        (0..size).flat_map(nonzero).filter(|entry| entry.2 != 0.0).collect::<Vec<_>>()
    };
    let given = entries(damping, 1.0);
    let Some(&(row, column, value)) = given.first() else { return Some((0.0, 0.0)) };
    let factor = |matrix: &SparseMatrix| {
        let factor = value / matrix.get(row, column);
        (factor > 0.0 && factor.is_finite() && entries(matrix, factor) == given).then_some(factor)
    };
    let by_mass = factor(mass).map(|alpha| (alpha, 0.0));
    by_mass.or_else(|| factor(stiffness).map(|beta| (0.0, beta)))
}
