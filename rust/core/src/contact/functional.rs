//! Affine functionals of the state.

use crate::linalg::sparse::sum_of;
use crate::scene::dependent::slaved_coordinates::SlavedCoordinates;

/// Relative difference of two functionals that is rounding.
const MULTIPLE: f64 = 1e-9;

fn dot(terms: &[(usize, f64)], x: &[f64]) -> f64 {
    terms.iter().map(|&(k, weight)| weight * x[k]).sum()
}

/// `constant + position . q + velocity . q'` in contact coordinates.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Functional {
    pub position: Vec<(usize, f64)>,
    pub velocity: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Functional {
    pub fn value(&self, q: &[f64], u: &[f64]) -> f64 {
        self.constant + dot(&self.position, q) + dot(&self.velocity, u)
    }

    /// Its only term, without the constant: (0 of a displacement or 1 of a velocity, coordinate, weight).
    pub fn single(&self) -> Option<(usize, usize, f64)> {
        match (&self.position[..], &self.velocity[..]) {
            (&[(k, weight)], []) => Some((0, k, weight)),
            ([], &[(k, weight)]) => Some((1, k, weight)),
            _ => None,
        }
    }

    /// The change along a direction (dq, dq').
    pub fn rate(&self, dq: &[f64], du: &[f64]) -> f64 {
        dot(&self.position, dq) + dot(&self.velocity, du)
    }

    /// Sum of the absolute values of the terms: the scale against which `value` is rounded.
    pub fn magnitude(&self, q: &[f64], u: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| (weight * x[k]).abs()).sum()
        };
        self.constant.abs() + dot(&self.position, q) + dot(&self.velocity, u)
    }

    /// Whether the two are positive multiples of each other, up to rounding; terms in the order of their coordinates.
    pub fn is_multiple_of(&self, other: &Self) -> bool {
        let terms = |of: &Self| -> Vec<(usize, usize, f64)> {
            let position = of.position.iter().map(|&(k, weight)| (0, k, weight));
            let velocity = of.velocity.iter().map(|&(k, weight)| (1, k, weight));
            let constant = std::iter::once((2, 0, of.constant));
            position.chain(velocity).chain(constant).filter(|term| term.2 != 0.0).collect()
        };
        let (own, others) = (terms(self), terms(other));
        let largest = |terms: &[(usize, usize, f64)]| {
            terms.iter().map(|term| term.2).max_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let (Some(a), Some(b)) = (largest(&own), largest(&others)) else { return false };
        let near = |(x, y): (&(usize, usize, f64), &(usize, usize, f64))| {
            (x.0, x.1) == (y.0, y.1) && (x.2 / a.abs() - y.2 / b.abs()).abs() <= MULTIPLE
        };
        own.len() == others.len() && own.iter().zip(&others).all(near)
    }

    /// Whether the two are equal up to rounding.
    pub fn is_equal_to(&self, other: &Self) -> bool {
        let size = |of: &Self| {
            let terms = of.position.iter().chain(&of.velocity).map(|term| term.1.abs());
            terms.fold(of.constant.abs(), f64::max)
        };
        size(&Self::sum([(1.0, self), (-1.0, other)].into_iter())) <= MULTIPLE * size(self)
    }

    pub fn scaled(&self, factor: f64) -> Self {
        let terms = |terms: &[(usize, f64)]| terms.iter().map(|&(k, w)| (k, factor * w)).collect();
        Self {
            position: terms(&self.position),
            velocity: terms(&self.velocity),
            constant: factor * self.constant,
        }
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::sum([(1.0, self), (1.0, other)].into_iter())
    }

    /// The same functional where some coordinates follow the others.
    pub fn pulled_back(&self, slaved: &SlavedCoordinates) -> Self {
        let (position, constant) = slaved.pulled_back(&self.position);
        let (velocity, _) = slaved.pulled_back(&self.velocity);
        Self { position, velocity, constant: self.constant + constant }
    }

    /// The same of many functionals.
    pub fn pull_back_all<'a>(all: impl Iterator<Item = &'a mut Self>, slaved: &SlavedCoordinates) {
        let all: Vec<&mut Self> = all.collect();
        let pulled = |of: fn(&Self) -> &[(usize, f64)]| {
            slaved.all_pulled_back(&all.iter().map(|one| of(one)).collect::<Vec<_>>())
        };
        let (positions, velocities) = (pulled(|one| &one.position), pulled(|one| &one.velocity));
        for (one, (position, velocity)) in
            all.into_iter().zip(positions.into_iter().zip(velocities))
        {
            one.constant += position.1;
            (one.position, one.velocity) = (position.0, velocity.0);
        }
    }

    /// `sum_j factor_j part_j`
    pub fn sum<'a>(parts: impl Iterator<Item = (f64, &'a Self)> + Clone) -> Self {
        let merged = |of: fn(&Self) -> &[(usize, f64)]| {
            let factors = parts.clone().filter(|part| part.0 != 0.0);
            sum_of(
                factors
                    .flat_map(|(factor, part)| of(part).iter().map(move |&(k, w)| (k, factor * w))),
            )
        };
        Self {
            position: merged(|part| &part.position),
            velocity: merged(|part| &part.velocity),
            constant: parts.clone().map(|(factor, part)| factor * part.constant).sum(),
        }
    }
}
