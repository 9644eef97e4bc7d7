//! Lemke's pivoting method for linear complementarity problems (Cottle, Pang and Stone 1992, section 4.4).

use nalgebra::{DMatrix, DVector};

/// An entry below this is no pivot: it is the rounding of a zero.
const PIVOT: f64 = 1e-12;
/// Two ratios are tied if they differ by less than this part of their size, or of `SMALL` if they are smaller than that.
const TIED: f64 = 1e-11;
const SMALL: f64 = 1e-3;
/// Pivots per row after which the search is given up. Lemke visits each almost complementary basis once, far fewer in
/// practice.
const PIVOTS: usize = 50;

/// Lemke's method for `w = M z + q, w >= 0, z >= 0, w z = 0`; `None` on a secondary ray.
pub(crate) fn lemke(matrix: &DMatrix<f64>, q: &DVector<f64>) -> Option<DVector<f64>> {
    let size = q.len();
    if q.iter().all(|&q| q >= 0.0) {
        return Some(DVector::zeros(size));
    }
    // Tableau columns: w (size), z (size), z0, right-hand side.
    let (z0, rhs) = (2 * size, 2 * size + 1);
    let mut tableau = DMatrix::zeros(size, 2 * size + 2);
    tableau.fill_diagonal(1.0);
    tableau.columns_mut(size, size).copy_from(&-matrix);
    tableau.column_mut(z0).fill(-1.0);
    tableau.set_column(rhs, q);
    let mut basis: Vec<usize> = (0..size).collect();
    let mut row = (0..size).min_by(|&i, &j| q[i].total_cmp(&q[j]))?;
    let mut entering = z0;
    for _ in 0..PIVOTS * (size + 1) {
        let pivot_row = tableau.row(row) / tableau[(row, entering)];
        let factors = tableau.column(entering).into_owned();
        tableau.set_row(row, &pivot_row);
        for i in (0..size).filter(|&i| i != row && factors[i] != 0.0) {
            let reduced = tableau.row(i) - &pivot_row * factors[i];
            tableau.set_row(i, &reduced);
        }
        let leaving = std::mem::replace(&mut basis[row], entering);
        if leaving == z0 {
            let mut z = DVector::zeros(size);
            for (i, &variable) in basis.iter().enumerate() {
                if (size..2 * size).contains(&variable) {
                    z[variable - size] = f64::max(tableau[(i, rhs)], 0.0);
                }
            }
            return Some(z);
        }
        entering = if leaving < size { leaving + size } else { leaving - size };
        // The smallest ratio; ties by the rest of the row (lexicographic rule), which rules out cycling.
        let entry = |i: usize, k: usize| tableau[(i, k)] / tableau[(i, entering)];
        let smaller = |i: usize, j: usize| {
            std::iter::once(rhs)
                .chain(0..size)
                .map(|k| (entry(i, k), entry(j, k)))
                .find(|(a, b)| (a - b).abs() > TIED * (a.abs() + b.abs()).max(SMALL))
                .map_or(std::cmp::Ordering::Equal, |(a, b)| a.total_cmp(&b))
        };
        row =
            (0..size).filter(|&i| tableau[(i, entering)] > PIVOT).min_by(|&i, &j| smaller(i, j))?;
    }
    None
}
