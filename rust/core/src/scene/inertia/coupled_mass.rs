//! A mass that is not diagonal in contact coordinates, or beside a stiffness that couples through contacts alone.
//!
//! In these coordinates it has two blocks: that of the contact coordinates, which statuses reduce, and that of the free
//! ones, the same in every status (see [`crate::scene::coordinates::contact_coordinates`]). The first is small. Of the
//! second only factors are kept, so that a sparse mass stays sparse.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::error::input::Error;
use crate::linalg::dense::{cholesky, is_diagonal};
use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::SparseCholesky;
use crate::scene::coordinates::contact_coordinates::Coordinates;
use crate::scene::inertia::border::{Border, Candidate, Terms};
use crate::scene::inertia::rates::rate;

/// Entries of a dense inverse of M that cost as much as one entry of its sparse factor, which is applied forwards and backwards.
const DENSE_ENTRIES: usize = 8;

/// What loads may add to the bound of the stiffness, relative to it.
const BESIDE: f64 = 0.02;

#[derive(Debug)]
pub(crate) struct CoupledMass {
    /// Number of all coordinates.
    size: usize,
    /// Contact coordinates that have mass, and the others; each ascending.
    contact: Vec<usize>,
    free: Vec<usize>,
    /// `G G'`, the block of the contact coordinates.
    contact_factor: Cholesky<f64, Dyn>,
    inverse: FreeInverse,
    /// Bounds of stiffness and damping in the norm of M, with the masses that it adds to coordinates which carry loads, 1/s^2
    /// and 1/s.
    pub stiffness_rate: f64,
    pub damping_rate: f64,
    pub added: Vec<(usize, f64)>,
    /// Where stiffness couples coordinates through contacts alone.
    pub border: Option<Border>,
}

/// The inverse of the block of the free coordinates.
#[derive(Debug)]
enum FreeInverse {
    Dense(DMatrix<f64>),
    Sparse(SparseCholesky),
}

impl CoupledMass {
    /// Of M, C + G and K + H in contact coordinates, M without couplings between contact coordinates and others; or the
    /// coordinate where M is not positive definite.
    fn new(
        [mass, damping, stiffness]: [&SparseMatrix; 3],
        structure: usize,
        contact: Vec<usize>,
        mut border: Option<Border>,
    ) -> Result<Self, usize> {
        let size = mass.size();
        // A direction that a contact lacks has no mass.
        let massive: Vec<usize> = (0..size).filter(|&k| mass.get(k, k) != 0.0).collect();
        let is_free = |k: &usize| contact.binary_search(k).is_err();
        let free: Vec<usize> = massive.iter().copied().filter(is_free).collect();
        let contact_mass = mass.restricted(&contact).to_dense();
        let contact_factor = cholesky(&contact_mass).map_err(|(k, _)| contact[k])?;
        let factor = SparseCholesky::new(&mass.restricted(&free)).map_err(|k| free[k])?;
        let inverse = match free.len() * free.len() <= DENSE_ENTRIES * factor.entries() {
            true => FreeInverse::Dense(factor.solve(DMatrix::identity(free.len(), free.len()))),
            false => FreeInverse::Sparse(factor),
        };
        let moved = &massive[..massive.partition_point(|&k| k < structure)];
        let loads = (structure..size).map(|load| {
            let column = moved.iter().map(|&row| stiffness.get(row, load)).collect();
            (load, [mass, stiffness].map(|matrix| matrix.get(load, load)), column)
        });
        let loads: Vec<(usize, [f64; 2], Vec<f64>)> = loads.collect();
        let diagonal: Vec<f64> = (0..size).map(|k| mass.get(k, k)).collect();
        let [mass, damping, stiffness] =
            [mass, damping, stiffness].map(|matrix| matrix.restricted(moved));
        let whole = SparseCholesky::new(&mass).map_err(|k| moved[k])?;
        let (stiffness_rate, added) = with_loads(rate(&mass, &whole, &stiffness), &whole, &loads);
        if let Some(border) = &mut border {
            let mut mass = diagonal;
            added.iter().for_each(|&(load, further)| mass[load] += further);
            border.weigh_followers(&mass);
        }
        Ok(Self {
            size,
            contact,
            free,
            contact_factor,
            inverse,
            stiffness_rate,
            damping_rate: rate(&mass, &whole, &damping),
            added,
            border,
        })
    }

    /// Work on one acceleration, in entries of a sparse product.
    pub fn work(&self) -> f64 {
        match &self.inverse {
            FreeInverse::Dense(inverse) => 0.5 * inverse.len() as f64,
            FreeInverse::Sparse(factor) => 2.0 * factor.entries() as f64,
        }
    }

    /// Writes the accelerations of the free coordinates that forces give them.
    pub fn accelerate_free(&self, forces: &[f64], acceleration: &mut [f64]) {
        match &self.inverse {
            FreeInverse::Dense(inverse) => {
                self.free.iter().for_each(|&k| acceleration[k] = 0.0);
                for (&j, column) in self.free.iter().zip(inverse.column_iter()) {
                    let force = forces[j];
                    for (&k, entry) in self.free.iter().zip(&column) {
                        acceleration[k] += entry * force;
                    }
                }
            }
            FreeInverse::Sparse(factor) => {
                let mut part: Vec<f64> = self.free.iter().map(|&k| forces[k]).collect();
                factor.solve_in_place(&mut part);
                self.free.iter().zip(part).for_each(|(&k, value)| acceleration[k] = value);
            }
        }
    }

    /// Number of contact coordinates.
    pub fn contacts(&self) -> usize {
        self.contact.len()
    }

    /// The place of a coordinate among those of contacts.
    pub fn contact_place(&self, coordinate: usize) -> Option<usize> {
        self.contact.binary_search(&coordinate).ok()
    }

    /// Largest ratio of `|map f|` and `|f|` in the norm of M and its dual, of a map of forces to accelerations of the
    /// contact coordinates; beyond them every force acts as if no contact were held, with the ratio 1.
    pub fn map_norm(&self, map: &DMatrix<f64>) -> f64 {
        if map.is_empty() {
            return 1.0;
        }
        let lower = self.contact_factor.l_dirty().lower_triangle();
        if is_diagonal(&lower) {
            // |A|^2 <= |A|_1 |A|_inf: the rows and columns of each contact have a few entries.
            let scaled = map.map_with_location(|i, j, entry| entry * lower[(i, i)] * lower[(j, j)]);
            let largest = |of: &DMatrix<f64>| {
                of.column_iter().map(|column| column.lp_norm(1)).fold(1.0, f64::max)
            };
            return (largest(&scaled) * largest(&scaled.transpose())).sqrt();
        }
        (lower.tr_mul(map) * &lower).singular_values().iter().fold(1.0, |a: f64, b| a.max(*b))
    }

    /// `sqrt(f' M^-1 f)`: the largest value of a functional of coordinates in the unit ball of the norm of M.
    pub fn dual_norm(&self, functional: &[(usize, f64)]) -> f64 {
        let mut forces = vec![0.0; self.size];
        functional.iter().for_each(|&(k, weight)| forces[k] = weight);
        let contact =
            DVector::from_iterator(self.contact.len(), self.contact.iter().map(|&k| forces[k]));
        let mut sum = contact.dot(&self.contact_factor.solve(&contact));
        if self.free.iter().any(|&k| forces[k] != 0.0) {
            let mut acceleration = vec![0.0; forces.len()];
            self.accelerate_free(&forces, &mut acceleration);
            sum += self.free.iter().map(|&k| forces[k] * acceleration[k]).sum::<f64>();
        }
        sum.sqrt()
    }
}

/// A bound of the stiffness `[K b; 0 w]` of a structure and the coordinates that load it, from that of K, and the masses
/// that the norm adds to these: nothing acts back on them, so that they may count as heavy, and b then little.
fn with_loads(
    rate: f64,
    factor: &SparseCholesky,
    loads: &[(usize, [f64; 2], Vec<f64>)],
) -> (f64, Vec<(usize, f64)>) {
    let (mut square, mut fastest) = (0.0, rate);
    for (_, [mass, spring], column) in loads {
        let mut moved = column.clone();
        factor.solve_in_place(&mut moved);
        square += column.iter().zip(&moved).map(|(a, b)| a * b).sum::<f64>() / mass;
        fastest = f64::max(fastest, spring / mass);
    }
    let beside = square.max(0.0).sqrt();
    let heavier = if rate > 0.0 { (beside / (BESIDE * rate)).max(1.0) } else { 1.0 };
    let added = loads.iter().map(|&(load, [mass, _], _)| (load, (heavier * heavier - 1.0) * mass));
    (fastest + beside / heavier, added.collect())
}

/// What is known of a mass in contact coordinates that is not diagonal, or beside a stiffness with a border, where one is
/// looked for.
pub(crate) fn coupled_mass(
    mass: &SparseMatrix,
    damping: &SparseMatrix,
    stiffness: &SparseMatrix,
    border: Option<Terms<'_>>,
    slots: &[(usize, usize)],
) -> Result<Option<Arc<CoupledMass>>, Error> {
    let mut is_contact = vec![false; mass.size()];
    slots.iter().for_each(|&(t, n)| (is_contact[t], is_contact[n]) = (true, true));
    let massive = (0..mass.size()).filter(|&k| mass.get(k, k) != 0.0);
    let contact: Vec<usize> = massive.filter(|&k| is_contact[k]).collect();
    let structure = border.map_or(mass.size(), |terms| terms.structure);
    let found = border.and_then(|terms| bordered([mass, damping, stiffness], terms, &contact));
    let known = match found {
        Some(Bordered { border, contact, stiffness }) => {
            let matrices = [mass, damping, stiffness.as_ref()];
            CoupledMass::new(matrices, structure, contact, Some(border))
        }
        None if mass.is_diagonal() => return Ok(None),
        None => CoupledMass::new([mass, damping, stiffness], structure, contact, None),
    };
    known.map(|known| Some(Arc::new(known))).map_err(|dof| Error::IndefiniteSparseMass { dof })
}

/// A border with the coordinates of contacts, and the stiffness of those with mass while no contact acts on others.
struct Bordered<'a> {
    border: Border,
    contact: Vec<usize>,
    stiffness: Cow<'a, SparseMatrix>,
}

fn bordered<'a>(
    [mass, damping, stiffness]: [&'a SparseMatrix; 3],
    terms: Terms<'_>,
    contact: &[usize],
) -> Option<Bordered<'a>> {
    let of = |contact: &[usize], stiffness: &SparseMatrix, is_free: bool, whole: &SparseMatrix| {
        Border::new([mass, damping, whole], terms, Candidate { contact, stiffness, is_free })
    };
    if terms.massless.is_empty() {
        let border = of(contact, stiffness, false, stiffness)?;
        let stiffness = Cow::Borrowed(stiffness);
        return Some(Bordered { border, contact: contact.to_vec(), stiffness });
    }
    let mut touched = terms.massless.neighbours(stiffness);
    touched.retain(|&k| k < terms.structure);
    touched.extend(contact);
    touched.sort_unstable();
    touched.dedup();
    // No border contains what is tied to neither.
    let alone = |i: usize| {
        let is_tied = |k: usize| touched.binary_search(&k).is_ok() || terms.massless.contains(k);
        let others = stiffness.row(i).filter(|&(k, value)| k != i && value != 0.0);
        is_tied(i) || others.map(|entry| entry.0).all(|k| k >= terms.structure || is_tied(k))
    };
    if !(0..terms.structure).all(alone) {
        return None;
    }
    let left = terms.massless.condensed(stiffness, terms.structure);
    let found = [(contact, &left, true), (contact, stiffness, false), (&touched, &left, true)]
        .into_iter()
        .find_map(|(contact, of_others, is_free)| {
            Some((of(contact, of_others, is_free, stiffness)?, contact.to_vec()))
        });
    let (border, contact) = found?;
    Some(Bordered { border, contact, stiffness: Cow::Owned(left) })
}

/// The mass without the couplings that the coordinates make zero, and that are nonzero by rounding only.
pub(crate) fn uncoupled_mass(mass: SparseMatrix, coordinates: &Coordinates) -> SparseMatrix {
    if mass.is_diagonal() || !coordinates.decoupled {
        return mass;
    }
    let mut is_contact = vec![false; mass.size()];
    for &(tangential, normal) in &coordinates.slots {
        (is_contact[tangential], is_contact[normal]) = (true, true);
    }
    mass.filtered(|i, j| match (is_contact[i], is_contact[j]) {
        (true, true) => i == j || coordinates.delassus.is_some(),
        (one, other) => one == other,
    })
}
