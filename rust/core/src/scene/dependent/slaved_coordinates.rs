//! Coordinates that follow others: an affine change of basis `q = R z + r0` whose R is the identity but for their rows.

use std::ops::Deref;
use std::slice;

use nalgebra::{DMatrix, DVectorView};

use crate::linalg::sparse::{SparseMatrix, sum_of, summed};

/// Multiplications from which sums over followers are a product of dense matrices, if that multiplies at most so many
/// times as often: dense products are that much faster than sums in places.
const DENSE: usize = 1 << 15;
const FASTER: usize = 8;

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

    /// About how many numbers they hold: an index stands beside each factor.
    pub fn numbers(&self) -> usize {
        2 * self.0.iter().map(|one| one.terms.len()).sum::<usize>()
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
        let parts: Vec<(f64, &[(usize, f64)])> = terms
            .iter()
            .map(|term| match self.find(term.0) {
                None => (1.0, slice::from_ref(term)),
                Some(one) => (term.1, &one.terms[..]),
            })
            .collect();
        let all = parts.iter().flat_map(|&(factor, terms)| {
            terms.iter().map(move |&(k, weight)| (k, factor * weight))
        });
        (sum_of(all), constant_of(terms, |k| self.find(k)))
    }

    /// The same of many sums: where all have many terms, `W_r + W_e S` with the weights W_e of the coordinates e that follow
    /// by `q_e = S q_r + c` and W_r of the others.
    pub fn all_pulled_back(&self, sums: &[&[(usize, f64)]]) -> Vec<(Vec<(usize, f64)>, f64)> {
        let one_by_one = || sums.iter().map(|terms| self.pulled_back(terms)).collect();
        let terms = || sums.iter().copied().flatten();
        let longest = self.0.iter().map(|one| one.terms.len()).max().unwrap_or(0);
        if longest * terms().count() < DENSE {
            return one_by_one();
        }
        let followed = || self.0.iter().flat_map(|one| &one.terms);
        let own = self.0.iter().map(|one| one.coordinate);
        let all = terms().chain(followed()).map(|term| term.0).chain(own);
        let mut follower = vec![None; all.max().map_or(0, |k| k + 1)];
        for (place, one) in self.0.iter().enumerate() {
            follower[one.coordinate] = Some(place);
        }
        let each = terms().filter_map(|&(k, _)| follower[k]);
        let multiplied = each.map(|place| self.0[place].terms.len()).sum::<usize>();
        let mut master = vec![0; follower.len()];
        followed().for_each(|term| master[term.0] = 1);
        let masters: Vec<usize> = (0..master.len()).filter(|&k| master[k] > 0).collect();
        let dense = sums.len() * self.0.len() * masters.len();
        if multiplied < DENSE || dense > FASTER * multiplied {
            return one_by_one();
        }
        masters.iter().enumerate().for_each(|(place, &k)| master[k] = place);
        let of = |rows: usize| DMatrix::<f64>::zeros(rows, self.0.len());
        let (mut shapes, mut weights) = (of(masters.len()), of(sums.len()));
        for (column, one) in self.0.iter().enumerate() {
            for &(k, value) in &one.terms {
                shapes[(master[k], column)] += value;
            }
        }
        for (row, terms) in sums.iter().enumerate() {
            for &(k, weight) in terms.iter() {
                if let Some(column) = follower[k] {
                    weights[(row, column)] += weight;
                }
            }
        }
        let pulled = shapes * weights.transpose();
        let of = |(terms, pulled): (&&[(usize, f64)], DVectorView<f64>)| {
            let own = terms.iter().copied().filter(|term| follower[term.0].is_none());
            let added = masters.iter().copied().zip(pulled.iter().copied());
            let added = added.filter(|term| term.1 != 0.0);
            let mut sum = Vec::with_capacity(terms.len() + masters.len());
            sum.extend(own.chain(added));
            summed(&mut sum);
            (sum, constant_of(terms, |k| Some(&self.0[follower[k]?])))
        };
        sums.iter().zip(pulled.column_iter()).map(of).collect()
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

/// What constants add to a sum over coordinates of which some follow.
fn constant_of<'a>(terms: &[(usize, f64)], find: impl Fn(usize) -> Option<&'a Slaved>) -> f64 {
    let constants = terms.iter().filter_map(|&(k, weight)| Some(weight * find(k)?.constant));
    constants.fold(0.0, |sum, part| sum + part)
}

impl Deref for SlavedCoordinates {
    type Target = [Slaved];

    fn deref(&self) -> &[Slaved] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;
    use crate::scene::massless::condensation::Condensed;
    use crate::scene::model::Scene;
    use crate::scene::reduction::bases::Reduction;
    use crate::scene::status::Combination;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    #[test]
    fn sums_of_many_followers_take_the_room_of_their_masters() {
        let follower = |i: usize| Slaved {
            coordinate: 2 * i,
            constant: 0.1 * i as f64,
            terms: (0..30).map(|j| (81 + j, (i as f64 - 3.7 * j as f64).sin())).collect(),
        };
        let slaved = SlavedCoordinates::new((0..40).map(follower).collect());
        let terms: Vec<_> = (0..115).map(|k| (k, (1.3 * k as f64).cos())).collect();
        let (sums, constant) = slaved.pulled_back(&terms);
        let mut expected = [0.0; 115];
        for &(k, weight) in &terms {
            match slaved.find(k) {
                None => expected[k] += weight,
                Some(one) => one.terms.iter().for_each(|&(j, of)| expected[j] += weight * of),
            }
        }
        // 30 masters, 41 coordinates between followers, and 4 that none follows.
        assert_eq!(sums.len(), 75);
        assert!(sums.iter().all(|&(k, sum)| sum == expected[k]));
        assert!(sums.capacity() <= 2 * sums.len());
        let constants = (0..40).map(|i| terms[2 * i].1 * 0.1 * i as f64);
        assert!((constant - constants.sum::<f64>()).abs() < 1e-13);
    }

    /// As products of dense matrices and one by one, of followers that all have 60 masters, and of such that have 1 each.
    #[test]
    fn many_sums_are_pulled_back_as_each_of_them() {
        for masters in [60, 1] {
            let follower = |i: usize| Slaved {
                coordinate: 3 * i,
                constant: 0.1 * i as f64,
                terms: (0..masters)
                    .map(|j| (120 + i + j, (i as f64 - 3.7 * j as f64).sin()))
                    .collect(),
            };
            let slaved = SlavedCoordinates::new((0..40).map(follower).collect());
            let sum = |row: usize| -> Vec<(usize, f64)> {
                (row % 5..180).map(|k| (k, (1.3 * (k + 7 * row) as f64).cos())).collect()
            };
            // The last one has no followers.
            let sums: Vec<_> = (0..50).map(sum).chain([vec![(1, 2.0), (125, -1.0)]]).collect();
            let all = slaved.all_pulled_back(&sums.iter().map(|sum| &sum[..]).collect::<Vec<_>>());
            assert_eq!(all.len(), sums.len());
            for (sum, (terms, constant)) in sums.iter().zip(all) {
                let (expected, of_constants) = slaved.pulled_back(sum);
                assert_eq!(constant, of_constants);
                assert!(terms.iter().map(|term| term.0).eq(expected.iter().map(|term| term.0)));
                assert!(terms.iter().zip(expected).all(|(a, b)| (a.1 - b.1).abs() <= 1e-13));
            }
        }
    }

    fn contact(tangential: Vec<(usize, f64)>, normal: Vec<(usize, f64)>) -> ContactInput {
        ContactInput {
            tangential: Some(Direction::Entries(tangential)),
            normal: Some(Direction::Entries(normal)),
            friction: 0.3,
            static_friction: 0.3,
            slider_speed: 1.0,
            ..Default::default()
        }
    }

    fn scene(mass: &[f64], stiffness: &DMatrix<f64>, contacts: Vec<ContactInput>) -> Scene {
        let input = SceneInput {
            mass: Mass::Lumped(mass.to_vec()),
            stiffness: SparseMatrix::from_dense(stiffness),
            damping: Damping::Proportional { mass: 0.1, stiffness: 0.0 },
            force: vec![1.0; mass.len()],
            contacts,
            ..Default::default()
        };
        Scene::new(input).expect("a well-posed scene")
    }

    /// `A A' + 1`, from numbers in [-1, 1].
    fn definite(size: usize, numbers: &[f64]) -> DMatrix<f64> {
        let a = DMatrix::from_fn(size, size, |i, j| numbers[(i * size + j) % numbers.len()]);
        &a * a.transpose() + DMatrix::identity(size, size)
    }

    fn near(a: &DMatrix<f64>, b: &DMatrix<f64>) -> bool {
        (a - b).amax() <= 1e-12 * a.amax().max(b.amax())
    }

    proptest! {
        /// Positions, velocities and functionals against R and r0 as dense matrices.
        #[test]
        fn slaved_coordinates_are_an_affine_change_of_basis(
            numbers in proptest::collection::vec(-1.0..1.0f64, 40),
        ) {
            // Of seven coordinates 2 and 5 follow.
            let masters = [0, 1, 3, 4, 6];
            let slaved = [5, 2].map(|coordinate| {
                let terms = masters.iter().enumerate().skip(coordinate % 2);
                let terms = terms.map(|(i, &k)| (k, numbers[coordinate + i])).collect();
                Slaved { coordinate, constant: numbers[30 + coordinate], terms }
            });
            let slaved = SlavedCoordinates::new(slaved.to_vec());
            let right = slaved.basis(7, 7).to_dense();
            let q: Vec<f64> = numbers[12..19].to_vec();
            let (mut place, mut speed) = (q.clone(), q.clone());
            slaved.follow(&mut place);
            slaved.follow_rates(&mut speed);
            let dense = &right * DVector::from_vec(q);
            for k in 0..7 {
                let constant = slaved.find(k).map_or(0.0, |one| one.constant);
                prop_assert!((place[k] - dense[k] - constant).abs() <= 1e-14);
                prop_assert!((speed[k] - dense[k]).abs() <= 1e-14);
            }
            let terms: Vec<(usize, f64)> = (0..7).map(|k| (k, numbers[20 + k])).collect();
            let (pulled, constant) = slaved.pulled_back(&terms);
            let over = |terms: &[(usize, f64)], q: &[f64]| {
                terms.iter().map(|&(k, weight)| weight * q[k]).sum::<f64>()
            };
            prop_assert!(pulled.iter().all(|&(k, _)| slaved.find(k).is_none()));
            prop_assert!((over(&terms, &place) - over(&pulled, &place) - constant).abs() <= 1e-13);
        }

        /// A mass between a floor and a ceiling that both touch by inclined directions: the matrices of a combination that holds
        /// the dependent ones are congruent to those of the dofs.
        #[test]
        fn fitted_scenes_are_congruent(
            numbers in proptest::collection::vec(-1.0..1.0f64, 9),
            held in "[+s-]d|d[+s-]",
        ) {
            let stiffness = definite(3, &numbers);
            let floor = contact(vec![(0, 1.0), (1, 0.2)], vec![(2, 1.0)]);
            let ceiling = contact(vec![(0, -0.3), (1, 1.0)], vec![(0, 0.2), (2, -2.0)]);
            let whole = scene(&[1.0, 2.0, 3.0], &stiffness, vec![floor, ceiling]);
            let combination = Combination::parse(&held, 2).expect("statuses");
            prop_assert!(whole.has_dependent_directions());
            let fitted = whole.fitted(&combination);
            // The dofs per coordinate of x that is no sum of others.
            let free = (0..fitted.size).filter(|&k| fitted.dependents.find(k).is_none());
            let columns: Vec<DVector<f64>> = free
                .clone()
                .map(|k| {
                    let mut q = vec![0.0; fitted.size];
                    q[k] = 1.0;
                    fitted.dependents.follow_rates(&mut q);
                    DVector::from_vec(whole.velocities(&q))
                })
                .collect();
            let free: Vec<usize> = free.collect();
            prop_assert_eq!(free.len(), 3);
            let right = DMatrix::from_columns(&columns);
            let mass = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0, 3.0]));
            for (matrix, dofs) in [(&fitted.stiffness, &stiffness), (&fitted.mass, &mass)] {
                let own = matrix.to_dense().select_rows(&free).select_columns(&free);
                prop_assert!(near(&own, &(right.transpose() * dofs * &right)));
            }
            let force = right.transpose() * DVector::from_element(3, 1.0);
            for (place, &k) in free.iter().enumerate() {
                prop_assert!((fitted.force[k] - force[place]).abs() <= 1e-12);
            }
        }

        /// What is left of a scene with two dofs without mass: the Schur complement of K, with the row that sliding merges.
        #[test]
        fn condensed_scenes_are_schur_complements(
            numbers in proptest::collection::vec(-1.0..1.0f64, 16),
            status in "[+ds-]",
        ) {
            let stiffness = definite(4, &numbers);
            let node = contact(vec![(2, 1.0)], vec![(3, 1.0)]);
            let whole = scene(&[1.0, 2.0, 0.0, 0.0], &stiffness, vec![node]);
            let combination = Combination::parse(&status, 1).expect("a status");
            let condensed = Condensed::new(&whole, &combination).expect("regular").expect("massless");
            let left = condensed.scene(&whole);
            let (follow, merge): (&[usize], f64) = match &status[..] {
                "d" => (&[2, 3], 0.0),
                "s" => (&[], 0.0),
                sign => (&[2], if sign == "+" { -0.3 } else { 0.3 }),
            };
            let mut rows = stiffness.clone();
            rows.set_row(2, &(stiffness.row(2) + merge * stiffness.row(3)));
            let own = [0, 1];
            let block = |i: &[usize], j: &[usize]| rows.select_rows(i).select_columns(j);
            let expected = match follow {
                [] => block(&own, &own),
                _ => {
                    let inverse = block(follow, follow).try_inverse().expect("regular");
                    block(&own, &own) - block(&own, follow) * inverse * block(follow, &own)
                }
            };
            let found = left.stiffness.to_dense().select_rows(&own).select_columns(&own);
            prop_assert!(near(&found, &expected));
            prop_assert_eq!(Reduction::new(&left, &combination).kept, own.to_vec());
        }
    }
}
