//! A stiffness that couples coordinates through contacts alone, as fixed-interface modes leave it.
//!
//! With the coordinates of the contacts as its border, `K = [K_bb K_bi; K_ib D]` with a diagonal D: a product costs
//! O(n b) and not O(n^2). Damping is `C = beta K + E`: E has a block of its own on the border and is diagonal elsewhere, as
//! alpha M is, or the damping of single modes. Coordinates that carry loads act on others as those of the border do, and
//! nothing acts on them.
//!
//! Coordinates without mass e follow the others i at once (see [`crate::scene::massless`]), `q_e = Y (F_e - K_ei q_i + p_e)` under
//! contact forces p. Their rows of K belong to the border as well, and D, or the border with it, is what is left of K
//! - where they are held at zero: `K_ii`, as of fixed-interface modes whose boundary has lost its mass; or
//! - where no contact acts on them: `K_ii - K_ie Y K_ei`, as of the modes of a free structure with its residual flexibility, and
//!   of bodies with compliant contacts.

use nalgebra::DMatrix;
use pulp::bytemuck::cast_slice;

use crate::linalg::sparse::SparseMatrix;
use crate::numerics::simd::{GROUP, Group, ZEROS, in_groups};
use crate::scene::massless::coordinates::Massless;

/// Coordinates from which a border is worth its bookkeeping.
const SMALLEST: usize = 24;
/// Coordinates for each one of the border from which it is.
const PER_ROW: f64 = 2.5;
/// Entries of dense rows multiplied in the time of one entry of a sparse row.
const PER_ENTRY: usize = 8;
/// Rows of massless coordinates with at most this many entries stay sparse.
const SHORT: usize = 8;

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
    pub followers: Option<Followers>,
}

/// The coordinates without mass, group after group.
#[derive(Debug)]
pub(crate) struct Followers {
    pub coordinates: Vec<usize>,
    /// The place of the first one of each group, and their number.
    pub first: Vec<usize>,
    /// Whether the others move as where no contact acts on these, and not as where these are held at zero.
    pub is_free: bool,
    /// Rows of K over the coordinates with mass.
    pub rows: FollowerRows,
    /// R of `M^-1/2 K_ie = Q R` with orthonormal columns of Q.
    pub root: DMatrix<f64>,
}

#[derive(Debug)]
pub(crate) enum FollowerRows {
    /// Of few entries.
    Short(Vec<Vec<(usize, f64)>>),
    /// One after the other, and one of zeros.
    Long(Vec<Group>),
}

/// A candidate for a border: the stiffness matrix would be diagonal but for the rows and columns of these coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate<'a> {
    /// Ascending.
    pub contact: &'a [usize],
    pub stiffness: &'a SparseMatrix,
    /// See [`Followers`].
    pub is_free: bool,
}

impl Followers {
    /// Of the whole K.
    fn new(stiffness: &SparseMatrix, massless: &Massless, is_free: bool) -> Option<Self> {
        let groups = &massless.groups;
        let coordinates: Vec<usize> =
            groups.iter().flat_map(|group| group.coordinates.iter().copied()).collect();
        let first = groups.iter().scan(0, |sum, group| {
            *sum += group.coordinates.len();
            Some(*sum)
        });
        let first = std::iter::once(0).chain(first).collect();
        let row = |k: usize| stiffness.row(k).filter(|entry| !massless.contains(entry.0));
        let is_short = coordinates.iter().all(|&k| row(k).count() <= SHORT);
        let rows = match is_short {
            true => FollowerRows::Short(coordinates.iter().map(|&k| row(k).collect()).collect()),
            false => {
                let mut groups = Vec::new();
                for &k in &coordinates {
                    let mut whole = vec![0.0; stiffness.size()];
                    row(k).for_each(|(j, value)| whole[j] = value);
                    groups.extend(in_groups(&whole));
                }
                groups.extend(in_groups(&vec![0.0; stiffness.size()]));
                FollowerRows::Long(groups)
            }
        };
        (!groups.is_empty()).then(|| Self {
            coordinates,
            first,
            is_free,
            rows,
            root: DMatrix::default(),
        })
    }

    /// The row of the coordinate at a place where rows are long, and a row of zeros behind the last one.
    #[inline(always)]
    pub fn row(&self, place: usize, groups: usize) -> &[Group] {
        match &self.rows {
            FollowerRows::Short(_) => &[],
            FollowerRows::Long(rows) => &rows[place * groups..(place + 1) * groups],
        }
    }

    /// Rows from a place on, zeros from `end` on.
    #[inline(always)]
    pub fn block<const N: usize>(&self, start: usize, end: usize, groups: usize) -> [&[Group]; N] {
        let place = |r: usize| if start + r < end { start + r } else { self.coordinates.len() };
        std::array::from_fn(|r| self.row(place(r), groups))
    }

    /// The entries of the row at a place.
    pub fn terms(&self, place: usize, groups: usize) -> Vec<(usize, f64)> {
        match &self.rows {
            FollowerRows::Short(rows) => rows[place].clone(),
            FollowerRows::Long(_) => {
                let row: &[f64] = cast_slice(self.row(place, groups));
                row.iter().copied().enumerate().filter(|entry| entry.1 != 0.0).collect()
            }
        }
    }
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

    /// Of M, C and K; None where coordinates are coupled that the border does not contain, or where other products are
    /// quicker.
    pub fn new(
        [mass, damping, whole]: [&SparseMatrix; 3],
        Terms { proportional, structure, massless }: Terms<'_>,
        Candidate { contact, stiffness, is_free }: Candidate<'_>,
    ) -> Option<Self> {
        let n = mass.size();
        let coordinates: Vec<usize> = contact.iter().copied().chain(structure..n).collect();
        let count = massless.coordinates.len();
        if count * count > PER_ENTRY * whole.entries() {
            return None;
        }
        let followers = Followers::new(whole, massless, is_free);
        let long = followers.as_ref().filter(|of| matches!(of.rows, FollowerRows::Long(_)));
        if !Self::pays(whole, coordinates.len() + long.map_or(0, |_| count)) {
            return None;
        }
        let mut is_border = vec![false; n];
        coordinates.iter().for_each(|&k| is_border[k] = true);
        let carries = |k: usize| k >= structure;
        // Loads by velocities, as of vibrating sliders, and coordinates that damping alone couples have no place here.
        let is_served = |row: usize| match proportional {
            _ if carries(row) => damping.row(row).all(|entry| entry.1 == 0.0),
            Some(_) => damping.row(row).all(|(k, value)| !carries(k) || value == 0.0),
            None => damping.row(row).all(|(k, value)| {
                k == row || value == 0.0 || !carries(k) && is_border[k] && is_border[row]
            }),
        };
        if !(0..n).all(is_served) {
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
            let counts = |k: usize| k != i && !massless.contains(k);
            matrix.row(i).all(|(k, value)| !counts(k) || value == 0.0 || on_border && is_border[k])
        };
        let [mut diagonal, mut inverse_mass, mut decay] = [(); 3].map(|()| vec![0.0; n]);
        for i in (0..n).filter(|&i| !is_border[i] && !massless.contains(i)) {
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
                let others = stiffness.row(k).filter(|entry| !massless.contains(entry.0));
                others.for_each(|(j, value)| row[j] = value);
            }
            let is_row = |j: usize| {
                carries(j) || carries(k) || massless.contains(j) || stiffness.get(j, k) == row[j]
            };
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
            followers,
        })
    }

    /// Coordinates without mass that all others feel.
    pub fn long_followers(&self) -> usize {
        let long = self.followers.iter().filter(|of| matches!(of.rows, FollowerRows::Long(_)));
        long.map(|of| of.coordinates.len()).sum()
    }

    /// Finds the root of what follows, of the masses by which the norm weighs coordinates.
    pub fn weigh_followers(&mut self, mass: &[f64]) {
        let Some(followers) = &mut self.followers else { return };
        let places = 0..followers.coordinates.len();
        let rows: Vec<Vec<(usize, f64)>> =
            places.map(|place| followers.terms(place, self.groups)).collect();
        let mut tied: Vec<usize> = rows.iter().flatten().map(|entry| entry.0).collect();
        tied.sort_unstable();
        tied.dedup();
        let mut scaled = DMatrix::zeros(tied.len(), rows.len());
        for (place, row) in rows.iter().enumerate() {
            for &(k, value) in row {
                scaled[(tied.partition_point(|&j| j < k), place)] = value / mass[k].sqrt();
            }
        }
        followers.root = scaled.qr().r();
    }

    /// The row of a coordinate of the border; zeros without one.
    pub fn row(&self, place: Option<usize>) -> &[Group] {
        let first = place.unwrap_or(self.coordinates.len()) * self.groups;
        &self.rows[first..first + self.groups]
    }
}
