//! How far a change of one contact reaches within a panel, proved.
//!
//! Let D be the difference of the motions with and without the change, in mass-weighted coordinates and in the unit h of
//! the panel, and `D_k` its Taylor coefficients. In every row but those of the contact itself both motions obey the same
//! equation, so that
//!
//! ```text
//! (k + 1)(k + 2) |D_{k+2,i}| <= sum_j A_ij |D_{k,j}| + (k + 1) sum_j B_ij |D_{k+1,j}|,   A >= h^2 |M^-1 K|,  B >= h |M^-1 C|
//! ```
//!
//! with `D_0 = D_1 = 0` there. In the rows of the contact each of the two motions is bounded by the norm of the system,
//! `omega |D_k| <= J omega h (sigma h)^(k-2) / k!` with `J = 1 + e^(sigma h)` for the later start of one of them. The same
//! recursion with equality dominates. It knows no status: the reach of a contact is that of all its changes.

use std::collections::HashMap;
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;

use crate::motion::local::locality::{Kind, Locality, WIDTH};
use crate::scene::model::Scene;

/// Error that a change of one contact may leave elsewhere, relative to the motion: a million of them stay below rounding.
pub(crate) const NEGLECTED: f64 = 1e-6 * f64::EPSILON;
/// Number of orders of the recursion; further ones add less than 1e-28.
const ORDERS: usize = 60;
/// Coefficients below this are not passed on to neighbours; what is dropped enters the bound.
const FLOOR: f64 = 1e-34;
/// Number of parts of a panel with a reach of their own.
const LEVELS: usize = 16;

/// Coordinates that the reaches kept may hold in all: 256 MB.
const KEPT: usize = 1 << 26;

/// A scene of local marches with the reaches of its contacts, found when one first changes.
#[derive(Debug)]
pub(crate) struct Reaches {
    locality: Locality,
    kept: Mutex<Kept>,
}

#[derive(Debug)]
struct Kept {
    known: LruCache<usize, Arc<Reach>>,
    /// Sum of their sizes.
    coordinates: usize,
}

impl Deref for Reaches {
    type Target = Locality;

    fn deref(&self) -> &Locality {
        &self.locality
    }
}

impl Reaches {
    /// None of them found yet.
    pub fn new(locality: Locality) -> Self {
        let kept = Mutex::new(Kept { known: LruCache::unbounded(), coordinates: 0 });
        Self { locality, kept }
    }

    /// The coordinates that a change of a contact reaches.
    pub fn of(&self, scene: &Scene, contact: usize) -> Arc<Reach> {
        if let Some(known) = self.kept().known.get(&contact) {
            return Arc::clone(known);
        }
        let found = Arc::new(Reach::new(scene, self, contact, NEGLECTED));
        let mut kept = self.kept();
        kept.coordinates += found.len();
        kept.known.put(contact, Arc::clone(&found));
        while kept.coordinates > KEPT && kept.known.len() > 1 {
            if let Some((_, oldest)) = kept.known.pop_lru() {
                kept.coordinates -= oldest.len();
            }
        }
        found
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The coordinates that a change of one contact moves by more than [`NEGLECTED`] within the rest of a panel.
#[derive(Debug)]
pub(crate) struct Reach {
    /// Nearest first.
    coordinates: Vec<u32>,
    /// How many of them lie within reach when the rest is at most k + 1 of so many stretches.
    counts: [u32; LEVELS],
}

impl Reach {
    /// Of changes that leave out at most a part `neglected` of the motion.
    pub(super) fn new(scene: &Scene, locality: &Locality, contact: usize, neglected: f64) -> Self {
        let law = &scene.contacts[contact];
        let seeds = [law.tangential, law.normal];
        let Bounds { coordinates, bounds, left_out } = Bounds::new(locality, seeds);
        let scale = (locality.omega * locality.width()).min(1.0).powi(2);
        // Of the acceleration, which bounds place and speed, too.
        let factors: [f64; ORDERS + 2] = std::array::from_fn(|k| (k * k.saturating_sub(1)) as f64);
        let all: [usize; LEVELS] = std::array::from_fn(|level| level);
        let first_level = |bound: &[f64; ORDERS + 2]| {
            let terms: [f64; ORDERS + 2] = std::array::from_fn(|k| factors[k] * bound[k]);
            let exceeds = |level: usize| {
                let rest = (level + 1) as f64 / LEVELS as f64;
                let sum = terms[2..].iter().rev().fold(0.0, |sum, term| sum * rest + term);
                (sum + left_out) / scale > neglected
            };
            // No term is negative: what exceeds does so at every further level.
            all.partition_point(|&level| !exceeds(level))
        };
        let levels = bounds.iter().map(first_level);
        let mut order: Vec<(usize, usize)> = Vec::with_capacity(coordinates.len());
        for (level, &k) in levels.zip(&coordinates).filter(|entry| entry.0 < LEVELS) {
            match locality.kinds[k] {
                // A contact is reached as a whole.
                Kind::Tangential(other) | Kind::Normal(other) => {
                    let law = &scene.contacts[other];
                    order.extend([law.tangential, law.normal].map(|k| (level, k)));
                }
                _ => order.push((level, k)),
            }
        }
        order.extend(seeds.map(|seed| (0, seed)));
        // Of each the first.
        order.sort_unstable_by_key(|&(level, k)| (k, level));
        order.dedup_by_key(|entry| entry.1);
        order.sort_unstable();
        let count = |level: usize| order.partition_point(|entry| entry.0 <= level) as u32;
        Self {
            counts: std::array::from_fn(count),
            coordinates: order.iter().map(|entry| entry.1 as u32).collect(),
        }
    }

    pub fn len(&self) -> usize {
        self.coordinates.len()
    }

    /// What is reached within a part of a panel.
    pub fn within(&self, part: f64) -> impl Iterator<Item = usize> + '_ {
        let level = ((part * LEVELS as f64).ceil() as usize).clamp(1, LEVELS) - 1;
        self.coordinates[..self.counts[level] as usize].iter().map(|&k| k as usize)
    }
}

/// The dominating recursion.
struct Bounds {
    coordinates: Vec<usize>,
    /// Of the coefficients of each.
    bounds: Vec<[f64; ORDERS + 2]>,
    /// What entries below the floor may add anywhere, to the acceleration.
    left_out: f64,
}

/// The coordinates met so far and the rows that they act in.
#[derive(Default)]
struct Met {
    coordinates: Vec<usize>,
    place: HashMap<usize, usize>,
    /// (place, entry of A, entry of B) by columns; empty before a coordinate is reached.
    columns: Vec<Vec<(usize, f64, f64)>>,
}

impl Met {
    fn place(&mut self, k: usize) -> usize {
        *self.place.entry(k).or_insert_with(|| {
            self.coordinates.push(k);
            self.columns.push(Vec::new());
            self.coordinates.len() - 1
        })
    }

    fn reach(&mut self, at: usize, locality: &Locality) {
        let k = self.coordinates[at];
        let mut column: Vec<(usize, f64, f64)> = Vec::new();
        for (row, entry) in locality.springs.row(k) {
            column.push((self.place(row), entry, 0.0));
        }
        for (row, entry) in locality.dampers.row(k) {
            let place = self.place(row);
            match column.iter_mut().find(|known| known.0 == place) {
                Some(known) => known.2 = entry,
                None => column.push((place, 0.0, entry)),
            }
        }
        self.columns[at] = column;
    }
}

/// Of the coefficients in the rows of the contact itself.
fn own_bounds(locality: &Locality) -> [f64; ORDERS + 2] {
    let mut own = [0.0; ORDERS + 2];
    let mut factorial = 1.0;
    for (k, own) in own.iter_mut().enumerate().skip(1) {
        factorial *= k as f64;
        let power = WIDTH.powi(k as i32 - 2).max(1.0);
        *own = (1.0 + WIDTH.exp()) * locality.omega * locality.width() * power / factorial;
    }
    own
}

impl Bounds {
    fn new(locality: &Locality, seeds: [usize; 2]) -> Self {
        let growth = WIDTH.exp();
        let own = own_bounds(locality);
        let mut met = Met::default();
        let mut bounds: Vec<[f64; ORDERS + 2]> = Vec::new();
        for seed in seeds.into_iter().filter(|&k| locality.weight[k] > 0.0) {
            let at = met.place(seed);
            bounds.resize(at + 1, own);
        }
        let fixed = bounds.len();
        (0..fixed).for_each(|at| met.reach(at, locality));
        let mut dropped = 0.0;
        for k in 0..ORDERS {
            let factor = 1.0 / ((k + 1) * (k + 2)) as f64;
            let count = met.coordinates.len();
            bounds.resize(count, [0.0; ORDERS + 2]);
            for j in 0..count {
                let of_place = factor * bounds[j][k];
                let of_speed = factor * (k + 1) as f64 * bounds[j][k + 1];
                if of_place == 0.0 && of_speed == 0.0 {
                    continue;
                }
                if met.columns[j].is_empty() {
                    if bounds[j][k].max(bounds[j][k + 1]) < FLOOR {
                        dropped += (k + 2) as f64 * (bounds[j][k] + bounds[j][k + 1]);
                        continue;
                    }
                    met.reach(j, locality);
                    bounds.resize(met.coordinates.len(), [0.0; ORDERS + 2]);
                }
                for &(at, spring, damper) in &met.columns[j] {
                    if at >= fixed {
                        bounds[at][k + 2] += spring * of_place + damper * of_speed;
                    }
                }
            }
        }
        // What was dropped would have acted on its neighbours with at most (sigma h)^2 of it, and have grown like any motion.
        let left_out = 1e-28
            + dropped * growth * WIDTH.powi(4) * (1.0 + 1.0 / (locality.omega * locality.width()));
        Self { coordinates: met.coordinates, bounds, left_out }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::motion::local::field::tests::cells;
    use crate::motion::local::locality::Course;
    use crate::scene::status::Status;

    /// Coefficients of the difference that a contact makes, every one of its own as large as its bound and of a sign of its
    /// own: what the others follow is known to its last digit, however small.
    fn influence(
        scene: &Scene,
        locality: &Locality,
        seeds: [usize; 2],
        statuses: &[Status],
        signs: &[bool],
    ) -> Vec<[f64; ORDERS + 2]> {
        let h = locality.width();
        let own = own_bounds(locality);
        let mut found = vec![[0.0; ORDERS + 2]; scene.size];
        for (place, &seed) in seeds.iter().enumerate() {
            for k in 0..ORDERS + 2 {
                let sign = if signs[(2 * k + place) % signs.len()] { 1.0 } else { -1.0 };
                found[seed][k] = sign * own[k];
            }
        }
        for k in 0..ORDERS {
            for i in (0..scene.size).filter(|i| !seeds.contains(i)) {
                let Course::Free(rubbed) = locality.course(scene, statuses, i) else { continue };
                let rows = rubbed.into_iter().chain([(i, 1.0)]);
                let force: f64 = rows
                    .map(|(row, factor)| {
                        let of = |matrix: &crate::linalg::SparseMatrix, order: usize| -> f64 {
                            let moved =
                                matrix.row(row).filter(|entry| locality.weight[entry.0] > 0.0);
                            moved.map(|(j, a)| a * found[j][order] / locality.weight[j]).sum()
                        };
                        let springs = h * h * of(&scene.stiffness, k);
                        factor * (springs + h * (k + 1) as f64 * of(&scene.damping, k + 1))
                    })
                    .sum();
                found[i][k + 2] = -force / locality.weight[i] / ((k + 1) * (k + 2)) as f64;
            }
        }
        found
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Down to a millionth of an ulp: no coordinate out of reach is moved by more than a reach leaves out, and no bound
        /// of a coefficient lies below it.
        #[test]
        fn no_influence_exceeds_its_bound(
            kind in 0usize..3,
            count in 9usize..60,
            numbers in proptest::collection::vec(0.0..1.0f64, 240),
            beta in prop_oneof![Just(None), (0.0..3e-4f64).prop_map(Some)],
            statuses in proptest::collection::vec(0usize..4, 60),
            signs in proptest::collection::vec(any::<bool>(), 30),
        ) {
            let scene = cells(kind, count, &numbers, beta);
            let locality = Locality::new(&scene).expect("lumped");
            let all = [Status::Positive, Status::Negative, Status::Sticking, Status::Detached];
            let statuses: Vec<Status> = statuses[..count].iter().map(|&s| all[s]).collect();
            let contact = count / 2;
            let law = &scene.contacts[contact];
            let seeds = [law.tangential, law.normal];
            let found = influence(&scene, &locality, seeds, &statuses, &signs);
            let Bounds { coordinates, bounds, left_out } = Bounds::new(&locality, seeds);
            for (i, found) in found.iter().enumerate() {
                let bound = coordinates.iter().position(|&k| k == i).map(|at| &bounds[at]);
                for (k, value) in found.iter().enumerate() {
                    let bound = bound.map_or(0.0, |bound| bound[k]);
                    prop_assert!(value.abs() <= bound * (1.0 + 1e-12) + left_out, "{i}, {k}");
                }
            }
            let scale = (locality.omega * locality.width()).min(1.0).powi(2);
            for neglected in [1e-3, 1e-9, NEGLECTED] {
                let reach = Reach::new(&scene, &locality, contact, neglected);
                for level in 1..=LEVELS {
                    let part = level as f64 / LEVELS as f64;
                    let within: Vec<usize> = reach.within(part).collect();
                    for i in (0..scene.size).filter(|i| !within.contains(i)) {
                        // The acceleration at the end, in which place and speed are bounded.
                        let sum = (2..ORDERS + 2)
                            .rev()
                            .fold(0.0, |sum, k| sum * part + (k * (k - 1)) as f64 * found[i][k]);
                        prop_assert!(sum.abs() / scale <= neglected, "{i}: {sum:e}");
                    }
                }
            }
        }
    }
}
