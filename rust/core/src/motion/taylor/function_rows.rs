//! Event functions of many coordinates as dense rows, for the vector unit.
//!
//! Where C = beta K, normal forces are functionals of `q + beta q'`, so that one row serves places and velocities. Without mass
//! at a contact, its normal force is one of q, and its slip velocity one of q'.

use pulp::bytemuck::cast_slice;

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, group, in_groups};

/// Terms of an event function from which it is worth a row.
pub(super) const LONG: usize = 16;
/// Sums that a product keeps, to hide the latency of additions.
const SUMS: usize = 4;

/// The event functions of a combination that are worth a row.
#[derive(Debug, Default)]
pub(super) struct FunctionRows {
    unit: VectorUnit,
    rows: Vec<Option<FunctionRow>>,
}

/// An event function `weights . (a q + b q') + rest`.
#[derive(Debug)]
pub(super) struct FunctionRow {
    weights: Vec<Group>,
    /// (a, b): (1, beta), (1, 0) or (0, 1).
    pub factors: (f64, f64),
    pub rest: Functional,
}

impl FunctionRow {
    /// None of a function of few coordinates, or whose velocities are not those of proportional damping.
    fn new(size: usize, beta: f64, functional: &Functional) -> Option<Self> {
        let Functional { position, velocity, .. } = functional;
        let is_damped = velocity.iter().any(|entry| entry.1 != 0.0);
        let (factors, of) = if position.len() >= LONG {
            ((1.0, if is_damped { beta } else { 0.0 }), position)
        } else if velocity.len() >= LONG {
            ((0.0, 1.0), velocity)
        } else {
            return None;
        };
        let mut weights = vec![0.0; size];
        of.iter().for_each(|&(k, weight)| weights[k] = weight);
        // What is not rounding of the factor times the weights.
        let others = |terms: &[(usize, f64)], factor: f64| -> Vec<(usize, f64)> {
            let mut left: Vec<f64> = weights.iter().map(|weight| -factor * weight).collect();
            terms.iter().for_each(|&(k, weight)| left[k] += weight);
            let beyond = |(k, rest): &(usize, f64)| {
                rest.abs() > 4.0 * f64::EPSILON * (factor * weights[*k]).abs()
            };
            left.into_iter().enumerate().filter(beyond).collect()
        };
        let position = others(position, factors.0);
        let velocity = others(velocity, factors.1);
        let few = 2 * (position.len() + velocity.len()) < size;
        let rest = Functional { position, velocity, constant: 0.0 };
        few.then(|| Self { weights: in_groups(&weights), factors, rest })
    }
}

impl FunctionRows {
    pub fn new(size: usize, beta: f64, functions: &[EventFunction]) -> Self {
        let row = |of: &EventFunction| FunctionRow::new(size, beta, &of.functional);
        let rows: Vec<_> = functions.iter().map(row).collect();
        let any = rows.iter().any(Option::is_some);
        Self { unit: VectorUnit::default(), rows: if any { rows } else { Vec::new() } }
    }

    /// beta of the rows of places and velocities, if there are any.
    pub fn beta(&self) -> Option<f64> {
        let both = |row: &FunctionRow| row.factors.0 != 0.0 && row.factors.1 != 0.0;
        self.rows.iter().flatten().find(|row| both(row)).map(|row| row.factors.1)
    }

    /// The row of an event function that has one.
    pub fn get(&self, index: usize) -> Option<&FunctionRow> {
        self.rows.get(index)?.as_ref()
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        self.rows.iter().flatten().map(|row| GROUP * row.weights.len()).sum()
    }

    /// `|weights|` of a function times the sizes of `q + beta q'`.
    pub fn size(&self, row: &FunctionRow, sizes: &[f64]) -> f64 {
        self.unit.run(Dot { weights: &row.weights, x: sizes, absolute: true })
    }

    /// The row of a function times the coefficient of order k of the displacements.
    pub fn dot(&self, row: &FunctionRow, terms: &[f64]) -> f64 {
        self.unit.run(Dot { weights: &row.weights, x: terms, absolute: false })
    }
}

/// `sum weights x`, or with the absolute values of the weights.
struct Dot<'a> {
    weights: &'a [Group],
    x: &'a [f64],
    absolute: bool,
}

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> f64 {
        let Self { weights, x, absolute } = self;
        let (x, rest) = x.as_chunks::<GROUP>();
        let weights = &weights[..x.len() + usize::from(!rest.is_empty())];
        let mut sums = [ZEROS; SUMS];
        for g in 0..x.len() {
            let weight = if absolute { simd.abs_f64s(weights[g]) } else { weights[g] };
            sums[g % SUMS] = simd.mul_add_f64s(weight, group(x[g]), sums[g % SUMS]);
        }
        let sum = simd.add_f64s(simd.add_f64s(sums[0], sums[1]), simd.add_f64s(sums[2], sums[3]));
        let weights: &[f64] = cast_slice(&weights[x.len()..]);
        let mut last = simd.reduce_sum_f64s(sum);
        for i in 0..rest.len() {
            last += rest[i] * if absolute { weights[i].abs() } else { weights[i] };
        }
        last
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Products with rows of any length are the sums that they stand for.
        #[test]
        fn dots_are_scalar_sums(
            pairs in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 1..40),
            absolute in any::<bool>(),
        ) {
            let (weights, x): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let groups = in_groups(&weights);
            let found = VectorUnit::default().run(Dot { weights: &groups, x: &x, absolute });
            let terms = weights.iter().zip(&x).map(|(w, x)| if absolute { w.abs() * x } else { w * x });
            let sum: f64 = terms.clone().sum();
            let size: f64 = terms.map(f64::abs).sum();
            prop_assert!((found - sum).abs() <= 20.0 * f64::EPSILON * size);
        }
    }
}
