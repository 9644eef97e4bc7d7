//! Affine functionals of the state.

use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;

/// Relative difference of two functionals that is rounding.
const MULTIPLE: f64 = 1e-9;

/// `constant + position . q + velocity . q'` in contact coordinates.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Functional {
    pub position: Vec<(usize, f64)>,
    pub velocity: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Functional {
    pub fn value(&self, q: &[f64], u: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| weight * x[k]).sum()
        };
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
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| weight * x[k]).sum()
        };
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

    /// The same functional over the coordinates of x, in a scene in which some coordinates are sums of others.
    pub fn substituted(&self, scene: &Scene) -> Self {
        let over = |terms: &[(usize, f64)]| {
            let mut sums: Vec<(usize, f64)> = Vec::new();
            for &(k, weight) in terms {
                match scene.dependents.iter().find(|one| one.coordinate == k) {
                    None => sums.push((k, weight)),
                    Some(one) => {
                        sums.extend(one.terms.iter().map(|&(j, factor)| (j, weight * factor)));
                    }
                }
            }
            sums.sort_by_key(|term| term.0);
            sums.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            sums
        };
        Self {
            position: over(&self.position),
            velocity: over(&self.velocity),
            constant: self.constant,
        }
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

    /// The same functional where some coordinates without mass follow the others.
    pub fn condensed(&self, condensed: &Condensed) -> Self {
        let (position, constant) = condensed.replaced(&self.position);
        let (velocity, _) = condensed.replaced(&self.velocity);
        Self { position, velocity, constant: self.constant + constant }
    }

    /// `sum_j factor_j part_j`
    pub fn sum<'a>(parts: impl Iterator<Item = (f64, &'a Self)> + Clone) -> Self {
        // A dense row of sums if the parts hold many coordinates of the scene; otherwise a sorted list.
        let merged = |of: fn(&Self) -> &[(usize, f64)]| -> Vec<(usize, f64)> {
            let largest = parts.clone().filter_map(|(_, part)| of(part).last());
            let count = largest.map(|term| term.0 + 1).max().unwrap_or(0);
            if 8 * parts.clone().map(|(_, part)| of(part).len()).sum::<usize>() < count {
                let factors = parts.clone().filter(|part| part.0 != 0.0);
                let terms = factors
                    .flat_map(|(factor, part)| of(part).iter().map(move |&(k, w)| (k, factor * w)));
                let mut terms: Vec<(usize, f64)> = terms.collect();
                terms.sort_by_key(|term| term.0);
                terms.dedup_by(|next, kept| {
                    let same = next.0 == kept.0;
                    kept.1 += if same { next.1 } else { 0.0 };
                    same
                });
                return terms;
            }
            let mut sums: Vec<Option<f64>> = vec![None; count];
            for (factor, part) in parts.clone().filter(|part| part.0 != 0.0) {
                for &(k, weight) in of(part) {
                    *sums[k].get_or_insert(0.0) += factor * weight;
                }
            }
            sums.into_iter().enumerate().filter_map(|(k, sum)| Some((k, sum?))).collect()
        };
        Self {
            position: merged(|part| &part.position),
            velocity: merged(|part| &part.velocity),
            constant: parts.clone().map(|(factor, part)| factor * part.constant).sum(),
        }
    }
}
