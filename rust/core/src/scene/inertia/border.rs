//! A stiffness that couples coordinates through contacts alone, as fixed-interface modes leave it.
//!
//! With the coordinates of the contacts as its border, `K = [K_bb K_bi; K_ib D]` with a diagonal D: a product costs
//! O(n b) and not O(n^2). Damping is `C = beta K + E`: E has a block of its own on the border and is diagonal elsewhere, as
//! alpha M is, or the damping of single modes. Coordinates that carry loads act on others as those of the border do, and
//! nothing acts on them.

use crate::linalg::sparse::SparseMatrix;
use crate::numerics::simd::{GROUP, Group, ZEROS, in_groups};
use crate::scene::massless::coordinates::Massless;

/// Coordinates from which a border is worth its bookkeeping.
const SMALLEST: usize = 24;
/// Coordinates for each one of the border from which it is.
const PER_ROW: f64 = 2.5;
/// Entries of dense rows multiplied in the time of one entry of a sparse row.
const PER_ENTRY: usize = 8;

/// What a border may be made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terms<'a> {
    /// (alpha, beta) of the damping of the structure, if it is `alpha M + beta K`, where K is what coordinates feel while no
    /// contact acts on those without mass.
    pub proportional: Option<(f64, f64)>,
    /// Number of coordinates before those that carry loads.
    pub structure: usize,
    /// The coordinates without mass, which change K by statuses at those that they touch.
    pub massless: &'a Massless,
}

/// The parts of such a stiffness, for the vector unit.
#[derive(Debug)]
pub(crate) struct Border {
    /// Those of contacts, ascending, and those that carry loads.
    pub coordinates: Vec<usize>,
    /// Number of those of contacts.
    pub contacts: usize,
    /// Rows of E of those of contacts.
    pub drags: Vec<Vec<(usize, f64)>>,
    /// `E / m` of the coordinates beside the border.
    pub decay: Vec<Group>,
    pub beta: f64,
    pub proportional: Option<(f64, f64)>,
    /// Coordinates that carry loads, and their `K / m`.
    pub loads: Vec<(usize, f64)>,
    /// Groups of a row.
    pub groups: usize,
    /// The rows of K of contacts and the columns of loads one after the other, and one of zeros.
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

    /// The same of a matrix, with few enough products.
    pub fn pays(stiffness: &SparseMatrix, rows: usize) -> bool {
        let n = stiffness.size();
        Self::is_worth(n, rows) && 2 * rows * n <= PER_ENTRY * stiffness.entries()
    }

    /// Of M, C and K and the coordinates of contacts that have mass; None where other coordinates are coupled, or where
    /// other products are quicker.
    pub fn new(
        [mass, damping, stiffness]: [&SparseMatrix; 3],
        Terms { proportional, structure, .. }: Terms<'_>,
        contact: &[usize],
    ) -> Option<Self> {
        let n = mass.size();
        let coordinates: Vec<usize> = contact.iter().copied().chain(structure..n).collect();
        if !Self::pays(stiffness, coordinates.len()) {
            return None;
        }
        let mut is_border = vec![false; n];
        coordinates.iter().for_each(|&k| is_border[k] = true);
        let carries = |k: usize| k >= structure;
        // Loads by velocities, as of vibrating sliders, and coordinates that damping alone couples have no place here.
        let is_free = |row: usize| match proportional {
            _ if carries(row) => damping.row(row).all(|entry| entry.1 == 0.0),
            Some(_) => damping.row(row).all(|(k, value)| !carries(k) || value == 0.0),
            None => damping.row(row).all(|(k, value)| {
                k == row || value == 0.0 || !carries(k) && is_border[k] && is_border[row]
            }),
        };
        if !(0..n).all(is_free) {
            return None;
        }
        let drags_of = |row: usize| -> Vec<(usize, f64)> {
            let scaled = |alpha: f64| mass.row(row).map(move |(k, mass)| (k, alpha * mass));
            match proportional {
                Some((0.0, _)) => Vec::new(),
                Some((alpha, _)) => scaled(alpha).collect(),
                None => damping.row(row).filter(|entry| entry.1 != 0.0).collect(),
            }
        };
        let alone = |matrix: &SparseMatrix, i: usize, on_border: bool| {
            matrix.row(i).all(|(k, _)| k == i || on_border && is_border[k])
        };
        let [mut diagonal, mut inverse_mass, mut decay] = [(); 3].map(|()| vec![0.0; n]);
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
            decay[i] = match proportional {
                Some((alpha, _)) => alpha,
                None => damping.get(i, i) * inverse_mass[i],
            };
        }
        let groups = n.div_ceil(GROUP);
        let mut rows = Vec::with_capacity((coordinates.len() + 1) * groups);
        for &k in &coordinates {
            let mut row = vec![0.0; n];
            if carries(k) {
                let column = row.iter_mut().enumerate();
                column.for_each(|(j, entry)| *entry = stiffness.get(j, k));
            } else {
                stiffness.row(k).for_each(|(j, value)| row[j] = value);
            }
            let is_row = |j: usize| carries(j) || carries(k) || stiffness.get(j, k) == row[j];
            let acts_alone = !carries(k) || stiffness.row(k).all(|entry| entry.0 == k);
            if !acts_alone || !(0..n).all(is_row) {
                return None;
            }
            rows.extend(in_groups(&row));
        }
        rows.resize(rows.len() + groups, ZEROS);
        Some(Self {
            contacts: contact.len(),
            drags: contact.iter().map(|&k| drags_of(k)).collect(),
            decay: in_groups(&decay),
            beta: proportional.map_or(0.0, |(_, beta)| beta),
            proportional,
            loads: (structure..n).map(|k| (k, stiffness.get(k, k) / mass.get(k, k))).collect(),
            coordinates,
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
