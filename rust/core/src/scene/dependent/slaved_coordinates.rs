//! Coordinates that follow others: an affine change of basis `q = R z + r0` whose R is the identity but for their rows.

use std::ops::Deref;

use crate::linalg::sparse::{SparseMatrix, summed};

/// `q_coordinate = constant + sum_k weight_k q_k`
#[derive(Debug, Clone)]
pub(crate) struct Slaved {
    pub coordinate: usize,
    pub constant: f64,
    /// (coordinate, weight) of each master.
    pub terms: Vec<(usize, f64)>,
}

/// All coordinates of a scene that follow others, ascending; none of these is followed.
#[derive(Debug, Clone, Default)]
pub(crate) struct SlavedCoordinates(Vec<Slaved>);

impl SlavedCoordinates {
    /// In any order.
    pub fn new(mut slaved: Vec<Slaved>) -> Self {
        slaved.sort_by_key(|one| one.coordinate);
        Self(slaved)
    }

    /// What a coordinate follows, if it does.
    pub fn find(&self, coordinate: usize) -> Option<&Slaved> {
        let place = self.0.binary_search_by_key(&coordinate, |one| one.coordinate);
        place.ok().map(|place| &self.0[place])
    }

    /// Brings positions up to date with those of the masters.
    pub fn follow(&self, q: &mut [f64]) {
        for Slaved { coordinate, constant, terms } in &self.0 {
            q[*coordinate] = terms.iter().fold(*constant, |sum, &(k, weight)| sum + weight * q[k]);
        }
    }

    /// The same of velocities, and of any other difference of positions.
    pub fn follow_rates(&self, u: &mut [f64]) {
        for Slaved { coordinate, terms, .. } in &self.0 {
            u[*coordinate] = terms.iter().map(|&(k, weight)| weight * u[k]).sum();
        }
    }

    /// A sum over coordinates as one over masters, and the constant that this adds.
    pub fn pulled_back(&self, terms: &[(usize, f64)]) -> (Vec<(usize, f64)>, f64) {
        let (mut sums, mut constant) = (Vec::new(), 0.0);
        for &(k, weight) in terms {
            match self.find(k) {
                None => sums.push((k, weight)),
                Some(one) => {
                    constant += weight * one.constant;
                    sums.extend(one.terms.iter().map(|&(j, factor)| (j, weight * factor)));
                }
            }
        }
        summed(&mut sums);
        (sums, constant)
    }

    /// R, with the terms of masters below `structure` alone.
    pub fn basis(&self, size: usize, structure: usize) -> SparseMatrix {
        SparseMatrix::from_rows(size, |k, entries| match self.find(k) {
            None => entries.push((k, 1.0)),
            Some(one) => {
                entries.extend(one.terms.iter().copied().filter(|term| term.0 < structure));
                entries.sort_unstable_by_key(|entry| entry.0);
            }
        })
    }

    /// The same relations with `coordinate` a master in place of `given`, which it contains with the weight `pivot`; constants
    /// are zero.
    pub fn exchanged(mut self, coordinate: usize, given: usize, pivot: f64) -> Self {
        let Ok(index) = self.0.binary_search_by_key(&coordinate, |one| one.coordinate) else {
            return self;
        };
        let others = self.0[index].terms.iter().filter(|term| term.0 != given);
        let terms = std::iter::once((coordinate, 1.0 / pivot))
            .chain(others.map(|&(k, factor)| (k, -factor / pivot)))
            .collect();
        let solved = Slaved { coordinate: given, constant: 0.0, terms };
        for other in &mut self.0 {
            let Some(position) = other.terms.iter().position(|term| term.0 == given) else {
                continue;
            };
            let (_, factor) = other.terms.swap_remove(position);
            let size = factor.abs();
            for &(k, inner) in &solved.terms {
                match other.terms.iter_mut().find(|term| term.0 == k) {
                    Some(term) => term.1 += factor * inner,
                    None => other.terms.push((k, factor * inner)),
                }
            }
            other.terms.retain(|term| term.1.abs() > f64::EPSILON * size);
        }
        self.0[index] = solved;
        Self::new(self.0)
    }
}

impl Deref for SlavedCoordinates {
    type Target = [Slaved];

    fn deref(&self) -> &[Slaved] {
        &self.0
    }
}
