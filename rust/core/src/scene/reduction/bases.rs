//! Any status combination as a smaller linear system, by a pair of bases.
//!
//! `R` says which motions are allowed and `L` how the equations combine: a detached contact keeps both
//! coordinates in both; a sliding one drops its normal coordinate from R and merges its normal row into
//! its tangential row with factor -mu (`+`) or +mu (`-`); a sticking one drops both, and its tangential
//! coordinate becomes the prescribed motion `q_t0 + v t`. Then
//!
//! ```text
//! M_s = L' M R,  C_s = L' C R,  K_s = L' K R,  F_s(t) = L' (F - C q'_presc - K q_presc(t)) = F0 + F1 t
//! ```

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::{DMatrix, Scalar};

use crate::error::input::Error;
use crate::linalg::dense::{Factors, smallest_relative_pivot};
use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::NoFactors;
use crate::linalg::sparse_solver::{AddedRow, SparseSolver};
use crate::numerics::singular_values::pseudo_inverse;
use crate::scene::contact_law::{Contact, Directions, INDEPENDENCE};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

impl Scene {
    /// The scene that moves in a combination, and its bases.
    pub(crate) fn in_motion(
        &self,
        combination: &Combination,
    ) -> Result<(Cow<'_, Self>, Reduction), Error> {
        self.check_combination(combination)?;
        let moving = self.moving(combination)?;
        let reduction = Reduction::new(&moving, combination).checked(combination)?;
        Ok((moving, reduction))
    }

    /// Number of coordinates that a combination leaves free.
    pub(crate) fn free(&self, combination: &Combination) -> usize {
        Reduction::new(&self.fitted(combination), combination).size()
    }
}

/// A force that moves something is more than rounding if it exceeds this part of its terms.
const SPLIT: f64 = 1e-9;

/// A scene that had to be fitted.
pub(crate) fn owned(fitted: Cow<'_, Scene>) -> Option<Arc<Scene>> {
    match fitted {
        Cow::Borrowed(_) => None,
        Cow::Owned(scene) => Some(Arc::new(scene)),
    }
}

/// R and L of one status combination.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// Contact coordinates left free, ascending; the columns of R.
    pub kept: Vec<usize>,
    /// The rest of L, by position.
    pub merges: Vec<RowMerge>,
    /// Coordinate and speed, m/s, of every contact that sticks, and of every switched load.
    pub sticking: Vec<(usize, f64)>,
    /// The normal coordinate of every closed contact with a clearance, and where it is held.
    closed: Vec<(usize, f64)>,
    /// The coordinates left free, and after them those without mass that slide by laws, which are states of first order.
    pub states: Vec<usize>,
    /// The place of each coordinate among those kept.
    places: Vec<Option<usize>>,
    /// Whether the motion depends on how the forces of closed contacts are split, which nothing determines.
    is_split: bool,
}

/// Row `normal`, times `factor`, is added to the row of the kept coordinate at `position`.
#[derive(Debug, Clone, Copy)]
pub struct RowMerge {
    pub position: usize,
    pub normal: usize,
    pub factor: f64,
}

impl Reduction {
    /// Bases R and L with the kinetic friction of every contact.
    pub fn new(scene: &Scene, combination: &Combination) -> Self {
        Self::with_friction(scene, combination, |_, law| law.friction)
    }

    /// The bases with another friction coefficient of each contact, from its number and its law.
    pub(crate) fn with_friction(
        scene: &Scene,
        combination: &Combination,
        friction: impl Fn(usize, &Contact) -> f64,
    ) -> Self {
        let mut dropped = vec![false; scene.size];
        scene.massless.coordinates.iter().for_each(|&k| dropped[k] = true);
        Self::without(scene, combination, dropped, friction)
    }

    /// The bases with the coordinates that have no mass, for statics.
    pub(crate) fn with_massless(scene: &Scene, combination: &Combination) -> Self {
        Self::without(scene, combination, vec![false; scene.size], |_, law| law.friction)
    }

    fn without(
        scene: &Scene,
        combination: &Combination,
        mut dropped: Vec<bool>,
        friction: impl Fn(usize, &Contact) -> f64,
    ) -> Self {
        let (mut sticking, mut closed) = (Vec::new(), Vec::new());
        let statuses = combination.statuses();
        for (contact, (law, &status)) in scene.contacts.iter().zip(statuses).enumerate() {
            scene.keeps_deflection(contact).into_iter().for_each(|k| dropped[k] = true);
            dropped[law.normal] |= status.is_closed();
            let placed = status.is_closed() && law.gap != 0.0 && !law.shares_normal();
            if placed && !scene.is_dependent(law.normal) {
                closed.push((law.normal, law.closed()));
            }
            // A contact that is open has no state.
            if let Some(hidden) = law.hidden.filter(|_| status == Status::Detached) {
                dropped[hidden] = true;
            }
            // A stop has no tangential motion.
            dropped[law.tangential] |= law.directions == Directions::Normal;
            if status == Status::Sticking {
                dropped[law.tangential] = true;
                if !scene.is_dependent(law.tangential) {
                    sticking.push((law.tangential, law.slider_speed));
                }
            }
        }
        scene.dependents.iter().for_each(|one| dropped[one.coordinate] = true);
        // Switched loads are held as a contact that sticks to a slider at rest.
        for switch in scene.drive.iter().flat_map(|drive| &drive.switches) {
            dropped[switch.coordinate] = true;
            sticking.push((switch.coordinate, 0.0));
        }
        let kept: Vec<usize> = (0..scene.size).filter(|&k| !dropped[k]).collect();
        let mut places = vec![None; scene.size];
        kept.iter().enumerate().for_each(|(place, &k)| places[k] = Some(place));
        if scene.has_dependent_directions() {
            let (merges, is_split) = dependent_merges(scene, statuses, &places, friction);
            let states = kept.clone();
            return Self { kept, merges, sticking, closed, states, places, is_split };
        }
        let mut merges: Vec<RowMerge> = scene
            .contacts
            .iter()
            .zip(statuses)
            .enumerate()
            .filter(|(_, (_, status))| status.is_closed())
            .filter_map(|(contact, (law, &status))| {
                let factor = -law.friction_along(status) * friction(contact, law);
                let position = places[law.tangential].filter(|_| factor != 0.0)?;
                Some(RowMerge { position, normal: law.normal, factor })
            })
            .collect();
        merges.sort_unstable_by_key(|merge| merge.position);
        let creeping =
            scene.creeping(combination).map(|(contact, _)| scene.contacts[contact].tangential);
        let states =
            kept.iter().copied().chain(creeping.filter(|&k| places[k].is_none())).collect();
        Self { kept, merges, sticking, closed, states, places, is_split: false }
    }

    /// m, the number of coordinates left free.
    pub fn size(&self) -> usize {
        self.kept.len()
    }

    /// The place of a coordinate among those kept.
    pub fn place(&self, coordinate: usize) -> Option<usize> {
        self.places[coordinate]
    }

    /// Row i of L': coordinates with their factors.
    pub(crate) fn sources(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = self.merges.partition_point(|merge| merge.position < i);
        let merged = self.merges[first..].iter().take_while(move |merge| merge.position == i);
        let merged = merged.map(|merge| (merge.normal, merge.factor));
        std::iter::once((self.kept[i], 1.0)).chain(merged)
    }

    /// Refuses a combination whose motion depends on a split of forces.
    pub(crate) fn checked(self, combination: &Combination) -> Result<Self, Error> {
        match self.is_split {
            true => Err(Error::DependentForces { combination: combination.to_string() }),
            false => Ok(self),
        }
    }

    /// Terms (column, factor, entry) of row i of `L' matrix R`.
    pub(crate) fn row<'a>(
        &'a self,
        matrix: &'a SparseMatrix,
        i: usize,
    ) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
        self.sources(i).flat_map(move |(source, factor)| {
            let entries = matrix.row(source);
            entries.filter_map(move |(k, entry)| Some((self.places[k]?, factor, entry)))
        })
    }

    /// `L' matrix R`
    pub fn matrix(&self, matrix: &SparseMatrix) -> DMatrix<f64> {
        self.sparse_matrix(matrix).to_dense()
    }

    /// The same, sparse.
    pub(crate) fn sparse_matrix(&self, matrix: &SparseMatrix) -> SparseMatrix {
        self.summed(matrix, |sum, factor, entry| sum + factor * entry)
    }

    /// The same in numbers to which `add` adds a factor times an entry.
    pub(crate) fn summed<T: Scalar + Copy + Default>(
        &self,
        matrix: &SparseMatrix,
        add: impl Fn(T, f64, f64) -> T,
    ) -> SparseMatrix<T> {
        let mut sums = vec![T::default(); self.size()];
        let mut touched: Vec<usize> = Vec::new();
        SparseMatrix::from_rows(self.size(), |i, entries| {
            for (j, factor, entry) in self.row(matrix, i) {
                sums[j] = add(sums[j], factor, entry);
                touched.push(j);
            }
            touched.sort_unstable();
            touched.dedup();
            entries.extend(touched.drain(..).map(|j| (j, std::mem::take(&mut sums[j]))));
        })
    }

    /// The rows that merges add to that of kept coordinates: their positions and entries.
    pub(crate) fn added_rows(&self, matrix: &SparseMatrix) -> Vec<AddedRow> {
        let row = |merge: &RowMerge| {
            let entries = matrix.row(merge.normal);
            let kept =
                entries.filter_map(|(k, entry)| Some((self.places[k]?, merge.factor * entry)));
            (merge.position, kept.collect())
        };
        self.merges.iter().map(row).collect()
    }

    /// The part of `L' matrix R` that merges add.
    pub(crate) fn merged_matrix(&self, matrix: &SparseMatrix) -> DMatrix<f64> {
        let mut merged = DMatrix::zeros(self.size(), self.size());
        for (position, entries) in self.added_rows(matrix) {
            entries.into_iter().for_each(|(j, entry)| merged[(position, j)] += entry);
        }
        merged
    }

    /// What solves with `L' K R`, which is symmetric but for the rows that friction adds.
    pub(crate) fn solver(
        &self,
        stiffness: &SparseMatrix,
        least: f64,
    ) -> Result<SparseSolver, NoFactors> {
        let kept = stiffness.restricted(&self.kept);
        SparseSolver::new(&kept, &self.added_rows(stiffness), least)
    }

    /// `L' force`
    pub fn force(&self, force: &[f64]) -> Vec<f64> {
        let mut reduced: Vec<f64> = self.kept.iter().map(|&k| force[k]).collect();
        self.add_merged(force, &mut reduced);
        reduced
    }

    /// Velocities of the sliders that carry sticking contacts, over all coordinates.
    pub(super) fn prescribed_velocity(&self, scene: &Scene) -> Vec<f64> {
        let mut prescribed = vec![0.0; scene.size];
        self.sticking.iter().for_each(|&(k, speed)| prescribed[k] = speed);
        prescribed
    }

    /// The coordinates that are held at a place of their own.
    pub(crate) fn held(&self) -> impl Iterator<Item = usize> + '_ {
        self.sticking.iter().chain(&self.closed).map(|held| held.0)
    }

    /// Sets the normal coordinates of closed contacts among positions in which they are zero.
    pub(crate) fn place_closed(&self, q: &mut [f64]) {
        self.closed.iter().for_each(|&(k, place)| q[k] = place);
    }

    /// F0 with every sticking contact at q_t0 = 0.
    pub(crate) fn force_constant(&self, scene: &Scene) -> Vec<f64> {
        let mut constant = scene.force.clone();
        if !self.closed.is_empty() {
            let mut places = vec![0.0; scene.size];
            self.place_closed(&mut places);
            scene.stiffness.add_product(-1.0, &places, &mut constant);
        }
        if !self.sticking.is_empty() {
            scene.damping.add_product(-1.0, &self.prescribed_velocity(scene), &mut constant);
        }
        self.force(&constant)
    }

    /// Adds to `L' force` the part of merges.
    pub(crate) fn add_merged(&self, force: &[f64], reduced: &mut [f64]) {
        for merge in &self.merges {
            reduced[merge.position] += merge.factor * force[merge.normal];
        }
    }
}

/// The rows that are merged where directions depend on each other, and whether the motion depends on a split of forces.
///
/// The forces act on the coordinates of x as `B f`, one column for each: that of a sliding contact is `n + sigma mu t`, and a
/// sticking one has two. `L' B = 0` with rows `e_k + sum_h X_kh e_h` over the held coordinates h is
/// `X B_h = -B_k`, which has a solution unless forces that nothing determines move something.
fn dependent_merges(
    scene: &Scene,
    statuses: &[Status],
    places: &[Option<usize>],
    friction: impl Fn(usize, &Contact) -> f64,
) -> (Vec<RowMerge>, bool) {
    let held: Vec<usize> = scene.held(statuses).filter(|&k| !scene.is_dependent(k)).collect();
    let columns = force_columns(scene, statuses, friction);
    let moved = columns.iter().flatten().filter_map(|term| places[term.0].map(|_| term.0));
    let mut moved: Vec<usize> = moved.collect();
    moved.sort_unstable();
    moved.dedup();
    let rows = |of: &[usize]| over_rows(&columns, of);
    let (b_held, b_moved) = (rows(&held), rows(&moved));
    if held.is_empty() || moved.is_empty() {
        return (Vec::new(), false);
    }
    let square = held.len() == columns.len() && smallest_relative_pivot(&b_held) > INDEPENDENCE;
    let factors = match square {
        true => Factors::new(b_held.transpose()).solve(-b_moved.transpose()).transpose(),
        false => -&b_moved * pseudo_inverse(&b_held),
    };
    let left = &factors * &b_held + &b_moved;
    let mut merges = Vec::new();
    for (i, &k) in moved.iter().enumerate() {
        let Some(position) = places[k] else { continue };
        let size = factors.row(i).amax();
        for (j, &normal) in held.iter().enumerate() {
            let factor = factors[(i, j)];
            if factor.abs() > 8.0 * f64::EPSILON * size {
                merges.push(RowMerge { position, normal, factor });
            }
        }
    }
    merges.sort_unstable_by_key(|merge| merge.position);
    (merges, left.amax() > SPLIT * b_moved.amax())
}

/// The columns of B, those of the normal forces of the closed contacts first.
fn force_columns(
    scene: &Scene,
    statuses: &[Status],
    friction: impl Fn(usize, &Contact) -> f64,
) -> Vec<Vec<(usize, f64)>> {
    let (mut columns, mut stuck) = (Vec::new(), Vec::new());
    for (contact, (law, &status)) in scene.contacts.iter().zip(statuses).enumerate() {
        let mut column = scene.terms_of(law.normal);
        if status == Status::Sticking {
            stuck.push(scene.terms_of(law.tangential));
        } else if law.directions != Directions::Normal {
            let slope = status.friction_sign() * friction(contact, law);
            column.extend(scene.terms_of(law.tangential).iter().map(|&(k, w)| (k, slope * w)));
        }
        columns.extend(status.is_closed().then_some(column));
    }
    columns.extend(stuck);
    columns
}

fn over_rows(columns: &[Vec<(usize, f64)>], of: &[usize]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(of.len(), columns.len());
    for (j, column) in columns.iter().enumerate() {
        for &(k, factor) in column {
            if let Some(i) = of.iter().position(|&row| row == k) {
                matrix[(i, j)] += factor;
            }
        }
    }
    matrix
}

/// The rows of `K q - F`, with their factors, that are the normal force of each closed contact at rest: the shortest ones
/// where directions depend on each other. The scene is in the coordinates of the combination.
pub(crate) fn normal_forces_at_rest(
    scene: &Scene,
    combination: &Combination,
) -> Vec<Vec<(usize, f64)>> {
    let statuses = combination.statuses();
    if !scene.has_dependent_directions() {
        return scene.contacts.iter().map(|law| vec![(law.normal, 1.0)]).collect();
    }
    let columns = force_columns(scene, statuses, |_, law| law.friction);
    let mut of: Vec<usize> = columns.iter().flatten().map(|term| term.0).collect();
    of.sort_unstable();
    of.dedup();
    if columns.is_empty() {
        return vec![Vec::new(); statuses.len()];
    }
    let inverse = pseudo_inverse(&over_rows(&columns, &of));
    let mut place = 0..columns.len();
    let rows = |status: &Status| match status.is_closed() {
        false => Vec::new(),
        true => place.next().map_or_else(Vec::new, |i| {
            of.iter().enumerate().map(|(j, &row)| (row, inverse[(i, j)])).collect()
        }),
    };
    statuses.iter().map(rows).collect()
}
