//! A stiffness that couples coordinates through contacts alone, as fixed-interface modes leave it.
//!
//! With the coordinates of the contacts as its border, `K = [K_bb K_bi; K_ib D]` with a diagonal D: a product costs
//! O(n b) and not O(n^2).

use crate::linalg::sparse::SparseMatrix;
use crate::numerics::simd::{GROUP, Group, ZEROS, in_groups};

/// Coordinates from which a border is worth its bookkeeping.
const SMALLEST: usize = 24;
/// Coordinates for each one of the border from which it is.
const PER_ROW: f64 = 2.5;
/// Entries of dense rows multiplied in the time of one entry of a sparse row.
const PER_ENTRY: usize = 8;

/// The parts of such a stiffness, for the vector unit.
#[derive(Debug)]
pub(crate) struct Border {
    /// Ascending.
    pub coordinates: Vec<usize>,
    /// Groups of a row.
    pub groups: usize,
    /// The rows of K of these coordinates one after the other, and one of zeros.
    pub rows: Vec<Group>,
    /// K and 1 / m of the other coordinates, 0 on the border.
    pub diagonal: Vec<Group>,
    pub inverse_mass: Vec<Group>,
    /// Coordinates that nothing moves.
    pub massless: Vec<usize>,
}

impl Border {
    /// Whether so many rows are few enough beside all coordinates.
    pub fn is_worth(size: usize, rows: usize) -> bool {
        size >= SMALLEST && size as f64 >= PER_ROW * rows as f64
    }

    /// Of M and K and the coordinates of contacts that have mass; None where other coordinates are coupled, or where
    /// other products are quicker.
    pub fn new(mass: &SparseMatrix, stiffness: &SparseMatrix, contact: &[usize]) -> Option<Self> {
        let n = mass.size();
        if !Self::is_worth(n, contact.len())
            || 2 * contact.len() * n > PER_ENTRY * stiffness.entries()
        {
            return None;
        }
        let mut is_border = vec![false; n];
        contact.iter().for_each(|&k| is_border[k] = true);
        let alone = |matrix: &SparseMatrix, i: usize, on_border: bool| {
            matrix.row(i).all(|(k, _)| k == i || on_border && is_border[k])
        };
        let (mut diagonal, mut inverse_mass) = (vec![0.0; n], vec![0.0; n]);
        for i in (0..n).filter(|&i| !is_border[i]) {
            let moves = mass.get(i, i) > 0.0;
            if !alone(stiffness, i, true)
                || !alone(mass, i, false)
                || !moves && stiffness.row(i).next().is_some()
            {
                return None;
            }
            diagonal[i] = stiffness.get(i, i);
            inverse_mass[i] = if moves { 1.0 / mass.get(i, i) } else { 0.0 };
        }
        let groups = n.div_ceil(GROUP);
        let mut rows = Vec::with_capacity((contact.len() + 1) * groups);
        for &k in contact {
            let mut row = vec![0.0; n];
            stiffness.row(k).for_each(|(j, value)| row[j] = value);
            if (0..n).any(|j| stiffness.get(j, k) != row[j]) {
                return None;
            }
            rows.extend(in_groups(&row));
        }
        rows.resize(rows.len() + groups, ZEROS);
        Some(Self {
            coordinates: contact.to_vec(),
            groups,
            rows,
            diagonal: in_groups(&diagonal),
            inverse_mass: in_groups(&inverse_mass),
            massless: (0..n).filter(|&i| !is_border[i] && inverse_mass[i] == 0.0).collect(),
        })
    }

    /// The row of a coordinate of the border; zeros without one.
    pub fn row(&self, place: Option<usize>) -> &[Group] {
        let first = place.unwrap_or(self.coordinates.len()) * self.groups;
        &self.rows[first..first + self.groups]
    }
}
