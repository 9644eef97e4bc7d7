//! Linear complementarity problems `w = M z + q, w >= 0, z >= 0, w z = 0`: a solution, and whether there is another.
//!
//! A solution is known by its *support*, the indices at which z may be positive and w = 0. Exchanges, in which indices of the
//! wrong sign change sides, find the support as a rule in two or three steps. If they cycle, the last one alone changes sides at
//! a time, which ends for every matrix whose principal minors are positive (Murty 1974); and every support of a small problem is
//! tried. For every q the solution is the only one if the symmetric part
//! of M is positive definite (Cottle, Pang and Stone 1992, theorem 3.1.6); for the given q it is the only one if no other
//! support of a small problem has a solution.

use nalgebra::{DMatrix, DVector};

use crate::numerics::singular_values::SingularValues;

/// Number of exchanges of all indices of the wrong sign, and of one at a time, after which the search is given up.
const EXCHANGES: usize = 40;
const SINGLE_EXCHANGES: usize = 2000;
/// Unknowns up to which every support is tried.
pub(crate) const ENUMERATED: usize = 8;
/// A sign below this part of the terms of a sum is lost in their rounding.
const LOST: f64 = 64.0 * f64::EPSILON;
/// Two solutions are different if they differ by more than this part of the larger one; a singular system may miss its
/// right-hand side by the same part.
const DIFFERENT: f64 = 1e-8;
/// A symmetric part with unit diagonal counts as positive definite if its smallest eigenvalue is above this, which is far
/// above the rounding of M.
const DEFINITE: f64 = 1e-9;

/// A problem, scaled so that its diagonal has unit entries.
pub(crate) struct Complementarity {
    matrix: DMatrix<f64>,
    offsets: DVector<f64>,
}

/// Whether a solution is the only one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Uniqueness {
    Proved,
    /// The support of another one.
    Another(Vec<bool>),
    Unknown,
}

impl Complementarity {
    pub fn new(matrix: &DMatrix<f64>, offsets: &DVector<f64>) -> Self {
        let largest = matrix.amax();
        let root = |k: usize| match matrix[(k, k)].abs() {
            entry if entry > f64::EPSILON * largest => entry.sqrt(),
            _ if largest > 0.0 => largest.sqrt(),
            _ => 1.0,
        };
        let roots = DVector::from_fn(offsets.len(), |k, _| root(k));
        let offsets = offsets.component_div(&roots);
        let size = Some(offsets.amax()).filter(|&size| size > 0.0).unwrap_or(1.0);
        Self {
            matrix: matrix.map_with_location(|i, j, entry| entry / (roots[i] * roots[j])),
            offsets: offsets / size,
        }
    }

    /// The support of a solution; `first` if it has one.
    pub fn support(&self, first: Vec<bool>) -> Option<Vec<bool>> {
        let one_by_one = || self.exchanged(vec![false; self.offsets.len()], true);
        self.exchanged(first, false).or_else(one_by_one).or_else(|| self.supports().next())
    }

    /// Whether the solution with a support is the only one.
    pub fn uniqueness(&self, support: &[bool]) -> Uniqueness {
        if support.is_empty() {
            return Uniqueness::Proved;
        }
        let symmetric = 0.5 * (&self.matrix + self.matrix.transpose());
        if symmetric.symmetric_eigenvalues().iter().all(|&value| value > DEFINITE) {
            return Uniqueness::Proved;
        }
        let Some(known) = self.solved(support) else { return Uniqueness::Unknown };
        let other = |support: &Vec<bool>| {
            let z = self.solved(support);
            z.is_some_and(|z| (&z - &known).amax() > DIFFERENT * z.amax().max(known.amax()))
        };
        let every = self.offsets.len() <= ENUMERATED;
        let found = match every {
            true => self.supports().find(other),
            false => self.exchanged(vec![true; support.len()], false).filter(other),
        };
        match found {
            Some(support) => Uniqueness::Another(support),
            None if every && !self.doubtful() => Uniqueness::Proved,
            None => Uniqueness::Unknown,
        }
    }

    /// The support to which exchanges from a first one lead.
    fn exchanged(&self, mut support: Vec<bool>, one_by_one: bool) -> Option<Vec<bool>> {
        for _ in 0..if one_by_one { SINGLE_EXCHANGES } else { EXCHANGES } {
            let (z, w) = self.candidate(&support)?;
            let wrong = (0..support.len()).filter(|&k| z[k] < 0.0 || w[k] < 0.0);
            let wrong: Vec<usize> = wrong.collect();
            if wrong.is_empty() {
                return Some(support);
            }
            let first = if one_by_one { wrong.len() - 1 } else { 0 };
            wrong[first..].iter().for_each(|&k| support[k] = !support[k]);
        }
        None
    }

    /// Every support that has a solution, of a small problem.
    fn supports(&self) -> impl Iterator<Item = Vec<bool>> + '_ {
        let count = self.offsets.len();
        let choices = if count <= ENUMERATED { 1_usize << count } else { 0 };
        let support = move |choice: usize| -> Vec<bool> {
            (0..count).map(|k| choice >> k & 1 == 1).collect()
        };
        (0..choices).map(support).filter(|support| self.solved(support).is_some())
    }

    /// z with a support, if it solves the problem.
    fn solved(&self, support: &[bool]) -> Option<DVector<f64>> {
        let (z, w) = self.candidate(support)?;
        (z.iter().chain(&w).all(|&value| value >= 0.0)).then_some(z)
    }

    /// (z, w) with w = 0 in a support and z = 0 elsewhere, whatever their signs; what is lost in rounding is 0.
    fn candidate(&self, support: &[bool]) -> Option<(DVector<f64>, DVector<f64>)> {
        let inside: Vec<usize> = (0..support.len()).filter(|&k| support[k]).collect();
        let system = self.matrix.select_rows(&inside).select_columns(&inside);
        let load = -self.offsets.select_rows(&inside);
        let inner = match inside.is_empty() {
            true => load,
            false => {
                system.full_piv_lu().solve(&load).filter(|z| z.iter().all(|z| z.is_finite()))?
            }
        };
        let mut z = DVector::zeros(support.len());
        let size = inner.amax();
        for (&k, &value) in inside.iter().zip(&inner) {
            z[k] = if value.abs() <= LOST * size { 0.0 } else { value };
        }
        let w = DVector::from_fn(support.len(), |i, _| {
            if support[i] {
                return 0.0;
            }
            let terms = self.matrix.row(i).iter().zip(&z).map(|(a, z)| a * z).collect::<Vec<_>>();
            let sum = self.offsets[i] + terms.iter().sum::<f64>();
            let size = self.offsets[i].abs() + terms.iter().map(|term| term.abs()).sum::<f64>();
            if sum.abs() <= LOST * size { 0.0 } else { sum }
        });
        Some((z, w))
    }

    /// Whether the system of some support is singular and may still have solutions, which are then infinitely many.
    fn doubtful(&self) -> bool {
        let count = self.offsets.len();
        (1..1_usize << count).any(|choice| {
            let inside: Vec<usize> = (0..count).filter(|k| choice >> k & 1 == 1).collect();
            let system = self.matrix.select_rows(&inside).select_columns(&inside);
            let load = -self.offsets.select_rows(&inside);
            let found = SingularValues::new(&system);
            let (least, largest) = (found.values.min(), found.values.max());
            if least > DIFFERENT * largest {
                return false;
            }
            let nearest = found.inverse(DIFFERENT * largest) * &load;
            (&system * nearest - &load).amax() <= DIFFERENT * load.amax()
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn problem(rows: usize, entries: &[f64], offsets: &[f64]) -> Complementarity {
        let matrix = DMatrix::from_row_slice(rows, rows, entries);
        Complementarity::new(&matrix, &DVector::from_column_slice(offsets))
    }

    #[test]
    fn none_one_and_two_solutions() {
        // w = -z - 1 has none, w = z - 1 one, w = 1 - z the two z = 0 and z = 1.
        assert_eq!(problem(1, &[-1.0], &[-1.0]).support(vec![false]), None);
        let one = problem(1, &[1.0], &[-1.0]);
        assert_eq!(one.support(vec![false]), Some(vec![true]));
        assert_eq!(one.uniqueness(&[true]), Uniqueness::Proved);
        let two = problem(1, &[-1.0], &[1.0]);
        assert_eq!(two.support(vec![false]), Some(vec![false]));
        assert_eq!(two.uniqueness(&[false]), Uniqueness::Another(vec![true]));
        // A body without springs rests on the floor, in one way.
        assert_eq!(problem(1, &[0.0], &[1.0]).uniqueness(&[false]), Uniqueness::Proved);
        assert_eq!(problem(0, &[], &[]).uniqueness(&[]), Uniqueness::Proved);
        // w = 0 z: every z is a solution.
        assert_eq!(problem(1, &[0.0], &[0.0]).uniqueness(&[false]), Uniqueness::Unknown);
    }

    proptest! {
        /// Positive definite problems, which have exactly one solution, however large and badly scaled they are.
        #[test]
        fn definite_problems_are_solved(
            size in 1usize..20,
            numbers in proptest::collection::vec(-1.0..1.0f64, 900),
            powers in proptest::collection::vec(-4.0..4.0f64, 20),
        ) {
            let square = |first: usize| DMatrix::from_fn(size, size, |i, j| numbers[first + i * size + j]);
            let root = square(0);
            let skew = square(400);
            let scale = DMatrix::from_diagonal(&DVector::from_fn(size, |k, _| 10.0_f64.powf(powers[k])));
            let definite = &root * root.transpose() + DMatrix::identity(size, size) * 0.1;
            let matrix = &scale * (definite + &skew - skew.transpose()) * &scale;
            let offsets = &scale * DVector::from_fn(size, |k, _| numbers[800 + k]);
            let problem = Complementarity::new(&matrix, &offsets);
            let support = problem.support(vec![false; size]).expect("a solution");
            prop_assert!(problem.solved(&support).is_some());
        }
    }
}
