//! Contact forces whose directions depend on each other: which part of the forces is determined, and which of their
//! inequalities can hold at once.

use nalgebra::{DMatrix, DVector, RowDVector};

use crate::contact::problem::held_rows::held_rows;
use crate::numerics::singular_values::SingularValues;
use crate::scene::status::Status;

/// Relative size below which a singular value, or a factor of a force that nothing determines, is rounding.
const RANK: f64 = 1e-10;
/// Entry of a pseudo-inverse, relative to the largest, that is rounding.
const UNTIED: f64 = 1e-14;
/// Largest number of inequalities that an elimination keeps: some seconds of work; it is given up if there are more.
pub(crate) const MOST: usize = 1_000;

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
    /// Of the rows (tangential, normal) that statuses hold at zero acceleration, which come first: the forces of all contacts
    /// per force of each of them, of which a sliding contact has a share of its normal force along its slider.
    pub fn of_statuses(
        w: &DMatrix<f64>,
        statuses: &[Status],
        friction: impl Fn(usize) -> f64,
    ) -> (Vec<usize>, Self) {
        let rows = held_rows(statuses, friction);
        let mut map = DMatrix::zeros(2 * statuses.len(), rows.len());
        for (mut column, held) in map.column_iter_mut().zip(&rows) {
            held.forces().for_each(|(row, factor)| column[row] = factor);
        }
        let held: Vec<usize> = rows.iter().map(|held| held.row).collect();
        let forces = Self::new(w, &held, &map);
        (held, forces)
    }

    /// Of the `held` rows of W, with the force columns `map`, one for each of them.
    fn new(w: &DMatrix<f64>, held: &[usize], map: &DMatrix<f64>) -> Self {
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

/// The inequalities `sum_j y_j m_j >= 0` that hold if and only if some s satisfies `m_j + b_j s >= 0` for all rows b_j:
/// the extreme rays of the cone `y >= 0, B' y = 0` (Farkas), by the double description method (Motzkin et al. 1953). The cone
/// has as few dimensions as forces are determined, however many share them. None if there are too many.
pub(crate) fn eliminated(b: &DMatrix<f64>) -> Option<Vec<Vec<(usize, f64)>>> {
    let count = b.nrows();
    let found = SingularValues::new(&b.clone().resize_horizontally(count.max(b.ncols()), 0.0));
    let lost = RANK * found.values.amax();
    let kept: Vec<usize> = (0..count).filter(|&k| found.values[k] <= lost).collect();
    let (space, dimension) = (found.left.select_columns(&kept), kept.len());
    let mut taken = independent_rows(&space);
    let scaled = |mut y: DVector<f64>| {
        y /= y.amax();
        y.apply(|entry| *entry = if entry.abs() <= RANK { 0.0 } else { *entry });
        y
    };
    let edges = &space * space.select_rows(&taken).try_inverse()?;
    let mut rays: Vec<DVector<f64>> =
        edges.column_iter().map(|edge| scaled(edge.into_owned())).collect();
    for j in (0..count).filter(|j| !taken.contains(j)).collect::<Vec<_>>() {
        let mut next: Vec<DVector<f64>> = rays.iter().filter(|y| y[j] >= 0.0).cloned().collect();
        for (i, up) in rays.iter().enumerate().filter(|(_, y)| y[j] > 0.0) {
            for (k, down) in rays.iter().enumerate().filter(|(_, y)| y[j] < 0.0) {
                let shared: Vec<usize> =
                    taken.iter().copied().filter(|&t| up[t] == 0.0 && down[t] == 0.0).collect();
                let meets = |y: &DVector<f64>| shared.iter().all(|&t| y[t] == 0.0);
                let others = rays.iter().enumerate().filter(|&(other, _)| other != i && other != k);
                // Two rays span a face if no third one lies on all faces that they share.
                if shared.len() + 2 < dimension || { others }.any(|(_, y)| meets(y)) {
                    continue;
                }
                let mut ray = scaled(up * -down[j] + down * up[j]);
                shared.iter().chain([&j]).for_each(|&t| ray[t] = 0.0);
                next.push(ray);
                if next.len() > MOST {
                    return None;
                }
            }
        }
        rays = next;
        taken.push(j);
    }
    let factors = |y: &DVector<f64>| y.iter().copied().enumerate().filter(|f| f.1 > 0.0).collect();
    Some(rays.iter().map(factors).collect())
}

/// As many rows as there are columns that are independent, the largest remainder first.
fn independent_rows(space: &DMatrix<f64>) -> Vec<usize> {
    let pivots = space.transpose().col_piv_qr();
    let mut rows = RowDVector::from_fn(space.nrows(), |_, row| row);
    pivots.p().permute_columns(&mut rows);
    rows.iter().copied().take(space.ncols()).collect()
}
