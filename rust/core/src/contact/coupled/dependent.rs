//! Contact forces whose directions depend on each other: which part of the forces is determined, and which of their
//! inequalities can hold at once.

use nalgebra::{DMatrix, DVector};

use crate::numerics::singular_values::SingularValues;

/// Relative size below which a singular value, or a factor of a force that nothing determines, is rounding.
const RANK: f64 = 1e-10;
/// Entry of a pseudo-inverse, relative to the largest, that is rounding.
const UNTIED: f64 = 1e-14;
/// Largest number of inequalities that an elimination keeps; it is given up if there are more.
const MOST: usize = 20_000;

/// Forces of contacts as a map of their reactions, and the forces that nothing determines.
///
/// With `f = map y`, one entry of y for each held row, the accelerations of the held rows are
/// `(W map) y = rhs`, singular where directions depend on each other. Then y is the shortest solution in mass-weighted
/// terms, and every combination of the columns of `free` can be added to f.
#[derive(Debug)]
pub(crate) struct Forces {
    /// From the right-hand sides of the held rows to the forces (tangential, normal) of all contacts.
    pub of_rows: DMatrix<f64>,
    pub free: DMatrix<f64>,
}

impl Forces {
    /// Of the `held` rows of W, with the force columns `map`, one for each of them.
    pub fn new(w: &DMatrix<f64>, held: &[usize], map: &DMatrix<f64>) -> Self {
        let count = held.len();
        if count == 0 {
            return Self {
                of_rows: DMatrix::zeros(w.nrows(), 0),
                free: DMatrix::zeros(w.nrows(), 0),
            };
        }
        let scale: Vec<f64> = held.iter().map(|&row| 1.0 / w[(row, row)].sqrt()).collect();
        let rows = w.select_rows(held) * map;
        let scaled = DMatrix::from_fn(count, count, |i, j| scale[i] * rows[(i, j)] * scale[j]);
        let found = SingularValues::new(&scaled);
        let lost = RANK * found.values.amax();
        // Rounding of the inverse ties no rows that W does not tie.
        let inverse = found.inverse(lost);
        let least = UNTIED * inverse.amax();
        let inverse = inverse.map(|entry| if entry.abs() <= least { 0.0 } else { entry });
        let unscaled = DMatrix::from_fn(count, count, |i, j| scale[i] * inverse[(i, j)] * scale[j]);
        let null: Vec<DVector<f64>> = (0..count)
            .filter(|&k| found.values[k] <= lost)
            .map(|k| DVector::from_fn(count, |j, _| scale[j] * found.right[(j, k)]))
            .collect();
        let mut free = DMatrix::zeros(w.nrows(), null.len());
        for (k, vector) in null.iter().enumerate() {
            let mut column: DVector<f64> = map * vector;
            let size = column.amax();
            column
                .iter_mut()
                .for_each(|f| *f = if f.abs() <= RANK * size { 0.0 } else { *f / size });
            free.set_column(k, &column);
        }
        Self { of_rows: map * unscaled, free }
    }
}

/// The inequalities `sum_j factor_j m_j >= 0` that hold if and only if some s satisfies `m_j + b_j s >= 0` for all rows b_j:
/// elimination of one unknown after the other (Fourier and Motzkin), without inequalities that follow from others
/// (Chernikov). None if there are too many.
pub(crate) fn eliminated(b: &DMatrix<f64>) -> Option<Vec<Vec<(usize, f64)>>> {
    struct Row {
        factors: Vec<(usize, f64)>,
        left: Vec<f64>,
    }
    let mut rows: Vec<Row> = (0..b.nrows())
        .map(|j| Row { factors: vec![(j, 1.0)], left: b.row(j).iter().copied().collect() })
        .collect();
    for k in 0..b.ncols() {
        let size = rows.iter().fold(0.0, |size: f64, row| size.max(row.left[k].abs()));
        let sign = |row: &Row| match row.left[k] {
            left if left > RANK * size => 1,
            left if left < -RANK * size => -1,
            _ => 0,
        };
        let mut next: Vec<Row> = Vec::new();
        for up in rows.iter().filter(|row| sign(row) == 1) {
            for down in rows.iter().filter(|row| sign(row) == -1) {
                let (a, c) = (-down.left[k], up.left[k]);
                let mut factors: Vec<(usize, f64)> =
                    up.factors.iter().map(|f| (f.0, a * f.1)).collect();
                for &(j, factor) in &down.factors {
                    match factors.iter_mut().find(|entry| entry.0 == j) {
                        Some(entry) => entry.1 += c * factor,
                        None => factors.push((j, c * factor)),
                    }
                }
                // An inequality of more of the given ones than that follows from others.
                if factors.len() > k + 2 {
                    continue;
                }
                let unit = factors.iter().fold(0.0, |size: f64, f| size.max(f.1));
                factors.iter_mut().for_each(|f| f.1 /= unit);
                let left =
                    up.left.iter().zip(&down.left).map(|(u, d)| (a * u + c * d) / unit).collect();
                next.push(Row { factors, left });
                if next.len() > MOST {
                    return None;
                }
            }
        }
        next.extend(rows.into_iter().filter(|row| {
            let left = row.left[k];
            left.abs() <= RANK * size
        }));
        next.sort_by_key(|row| row.factors.len());
        let mut kept: Vec<Row> = Vec::new();
        for row in next {
            let within = |other: &Row| {
                other.factors.iter().all(|f| row.factors.iter().any(|own| own.0 == f.0))
            };
            if !kept.iter().any(within) {
                kept.push(row);
            }
        }
        rows = kept;
    }
    Some(rows.into_iter().map(|row| row.factors).collect())
}
