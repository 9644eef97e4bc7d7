//! A scene as one status combination leaves it, without the coordinates that have no mass.
//!
//! Of these, a closed contact holds its gap at zero and a sticking one its tangential coordinate at its place; the
//! others follow from their rows, in which sliding merges the normal row as in [`crate::scene::reduction`]:
//!
//! ```text
//! q_e = S q_r + c,   S = -A^-1 (L' K)_er,   c = A^-1 (L' F)_e,   A = (L' K)_ee
//! (q_r rows of K) = K_rr + K_re S,          F_r - K_re c
//! ```
//!
//! with r all other coordinates. Rows of what is held stay: they are contact forces.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::linalg::dense::{Factors, SINGULAR, smallest_relative_pivot};
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::scene::dependent::slaved_coordinates::{Slaved, SlavedCoordinates};
use crate::scene::massless::coordinates::Group;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// A combination of a scene with coordinates that have no mass.
#[derive(Debug)]
pub(crate) struct Condensed {
    /// The coordinates that follow the others.
    pub slaved: SlavedCoordinates,
    pub parts: Vec<Elimination>,
    /// Closed gaps: coordinates and where they are held.
    closed: Vec<(usize, f64)>,
    /// Coordinate and speed of sticking contacts.
    sticking: Vec<(usize, f64)>,
    /// Contacts that slide by laws, whose coordinates are states of first order; with their statuses.
    creeping: Vec<(usize, Status)>,
    /// The scene that is left, where contacts creep.
    scene: Option<Arc<Scene>>,
}

/// What follows within one group.
#[derive(Debug)]
pub(crate) struct Elimination {
    /// The place of the group among those of the scene.
    pub group: usize,
    pub coordinates: Vec<usize>,
    /// Their rows of L': (row, factor).
    pub sources: Vec<Vec<(usize, f64)>>,
    /// A^-1
    pub inverse: DMatrix<f64>,
}

impl Scene {
    /// The scene whose coordinates move by themselves in a combination: without coordinates that follow from their rows, or in
    /// the coordinates of the combination if directions depend on each other. If friction depends on slip speed, it is
    /// the scene of small motions about steady sliding.
    pub(crate) fn moving(&self, combination: &Combination) -> Result<Cow<'_, Self>, Error> {
        for (contact, law) in self.creeping(combination) {
            let speed = self.contacts[contact].slider_speed.abs();
            if !law.rises_until().is_some_and(|end| speed < end) {
                return Err(Error::LevelSteadySliding { contact, speed });
            }
        }
        self.resting(combination)
    }

    /// The same for states of rest, which need no mass.
    pub(crate) fn resting(&self, combination: &Combination) -> Result<Cow<'_, Self>, Error> {
        if self.is_nonlinear() {
            let linear = self.linearised(combination)?.into_owned();
            return Ok(Cow::Owned(linear.resting(combination)?.into_owned()));
        }
        Ok(match Condensed::new(self, combination)? {
            Some(condensed) => Cow::Owned(condensed.left_of(self)),
            None => self.fitted(combination),
        })
    }
}

impl Condensed {
    /// None where every coordinate has mass, or `scene` is condensed already.
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Option<Self>, Error> {
        if scene.massless.is_empty() || scene.condensed {
            return Ok(None);
        }
        let (mut closed, mut sticking) = (Vec::new(), Vec::new());
        let mut merged = vec![None; scene.size];
        let creeping: Vec<(usize, Status)> =
            scene.creeping(combination).map(|(i, _)| (i, combination.statuses()[i])).collect();
        let creeps = |k: usize| creeping.iter().any(|&(i, _)| scene.contacts[i].tangential == k);
        for (law, &status) in scene.contacts.iter().zip(combination.statuses()) {
            if law.normal_has_mass() || !status.is_closed() {
                continue;
            }
            closed.push((law.normal, law.closed()));
            if law.tangential_has_mass() {
                continue;
            }
            if status == Status::Sticking {
                sticking.push((law.tangential, law.slider_speed));
            } else if !creeps(law.tangential) {
                merged[law.tangential] = Some((law.normal, -status.friction_sign() * law.friction));
            }
        }
        let held = |k: usize| {
            closed.iter().any(|one| one.0 == k)
                || creeps(k)
                || sticking.iter().any(|stick| stick.0 == k)
        };
        let mut parts = Vec::new();
        let mut followers = Vec::new();
        for (index, group) in scene.massless.groups.iter().enumerate() {
            let coordinates: Vec<usize> =
                group.coordinates.iter().copied().filter(|&k| !held(k)).collect();
            if coordinates.is_empty() {
                continue;
            }
            let source = |&k: &usize| {
                let merge = merged[k].filter(|merge: &(usize, f64)| merge.1 != 0.0);
                std::iter::once((k, 1.0)).chain(merge).collect()
            };
            let sources: Vec<Vec<(usize, f64)>> = coordinates.iter().map(source).collect();
            parts.push(eliminated(
                scene,
                combination,
                (index, group),
                coordinates,
                sources,
                &mut followers,
            )?);
        }
        let slaved = SlavedCoordinates::new(followers);
        let found = Self { slaved, parts, closed, sticking, creeping, scene: None };
        let creeps = !found.creeping.is_empty();
        let left = creeps.then(|| Arc::new(found.left_of(scene)));
        Ok(Some(Self { scene: left, ..found }))
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let inverses = self.parts.iter().map(|part| part.inverse.len());
        self.slaved.numbers() + inverses.sum::<usize>()
    }

    /// What is left of `scene`, to share.
    pub fn scene(&self, scene: &Scene) -> Arc<Scene> {
        self.scene.clone().unwrap_or_else(|| Arc::new(self.left_of(scene)))
    }

    /// What is left of `scene`, over all coordinates, of which those without mass follow; their rows and columns are zero.
    fn left_of(&self, scene: &Scene) -> Scene {
        let mut force = scene.force.clone();
        let follows = |k: usize| self.slaved.find(k).is_some();
        let is_tied = |row: usize| scene.stiffness.row(row).any(|entry| follows(entry.0));
        let tied: Vec<usize> = (0..scene.size).filter(|&k| !follows(k) && is_tied(k)).collect();
        let rows: Vec<Vec<(usize, f64)>> =
            tied.iter().map(|&row| scene.stiffness.row(row).collect()).collect();
        let pulled =
            self.slaved.all_pulled_back(&rows.iter().map(|row| &row[..]).collect::<Vec<_>>());
        let mut pulled = tied.into_iter().zip(pulled).peekable();
        let stiffness = SparseMatrix::from_rows(scene.size, |row, entries| {
            if let Some((_, (sums, constant))) = pulled.next_if(|one| one.0 == row) {
                *entries = sums;
                force[row] -= constant;
            } else if follows(row) {
                force[row] = 0.0;
            } else {
                entries.extend(scene.stiffness.row(row));
            }
        });
        // Beside a border series need no scene that is left.
        let coupled_mass = None;
        let dependents = self.slaved.clone();
        Scene { condensed: true, dependents, coupled_mass, stiffness, force, ..scene.clone() }
    }

    /// Sets the places and velocities of the coordinates without mass, of those that follow and of those that contacts hold.
    pub fn complete(&self, q: &mut [f64], u: &mut [f64]) {
        for &(k, at) in &self.closed {
            (q[k], u[k]) = (at, 0.0);
        }
        self.sticking.iter().for_each(|&(k, speed)| u[k] = speed);
        self.slaved.follow(q);
        if let Some(scene) = &self.scene {
            for &(contact, status) in &self.creeping {
                u[scene.contacts[contact].tangential] = scene.creep_rate(contact, status, q);
            }
        }
        self.slaved.follow_rates(u);
    }

    /// Completes a row of L', given on the coordinates that stay, on those that follow.
    pub fn complete_left(&self, whole: &SparseMatrix, left: &mut [f64]) {
        for part in &self.parts {
            let loads: Vec<f64> = part
                .coordinates
                .iter()
                .map(|&e| {
                    let terms = left.iter().enumerate().filter(|entry| *entry.1 != 0.0);
                    terms.map(|(i, weight)| weight * whole.get(i, e)).sum()
                })
                .collect();
            for (row, source) in part.sources.iter().enumerate() {
                let weight: f64 =
                    loads.iter().zip(part.inverse.column(row).iter()).map(|(a, b)| a * b).sum();
                source.iter().for_each(|&(k, factor)| left[k] -= factor * weight);
            }
        }
    }
}

/// Solves the rows of what follows in a group for its coordinates.
fn eliminated(
    scene: &Scene,
    combination: &Combination,
    (index, group): (usize, &Group),
    coordinates: Vec<usize>,
    sources: Vec<Vec<(usize, f64)>>,
    followers: &mut Vec<Slaved>,
) -> Result<Elimination, Error> {
    let count = coordinates.len();
    let place = |k: usize| coordinates.binary_search(&k).ok();
    let rows: Vec<Vec<(usize, f64)>> = sources
        .iter()
        .map(|source| {
            let scaled = |&(row, factor): &(usize, f64)| {
                scene.stiffness.row(row).map(move |(k, value)| (k, factor * value))
            };
            let mut entries: Vec<(usize, f64)> = source.iter().flat_map(scaled).collect();
            summed(&mut entries);
            entries
        })
        .collect();
    // What is held at zero adds nothing.
    let counts = |k: usize| {
        let within = group.place(k).is_some() && place(k).is_none();
        !within
            || scene.contacts.iter().zip(combination.statuses()).any(|(law, &status)| {
                law.tangential == k && status == Status::Sticking && !law.tangential_has_mass()
                    || law.normal == k && status.is_closed() && law.gap != 0.0
            })
            || scene
                .creeping(combination)
                .any(|(contact, _)| scene.contacts[contact].tangential == k)
    };
    let mut others: Vec<usize> = rows.iter().flatten().map(|entry| entry.0).collect();
    others.sort_unstable();
    others.dedup();
    others.retain(|&k| place(k).is_none() && counts(k));
    let mut matrix = DMatrix::zeros(count, count);
    let mut known = DMatrix::zeros(count, others.len() + 1);
    for (i, (row, source)) in rows.iter().zip(&sources).enumerate() {
        for &(k, value) in row {
            if let Some(j) = place(k) {
                matrix[(i, j)] = value;
            } else if let Ok(j) = others.binary_search(&k) {
                known[(i, j)] = -value;
            }
        }
        known[(i, others.len())] =
            source.iter().map(|&(k, factor)| factor * scene.force[k]).sum::<f64>();
    }
    let pivot = smallest_relative_pivot(&matrix);
    if pivot < SINGULAR {
        return Err(Error::SingularBoundary { combination: combination.to_string(), pivot });
    }
    let factors = Factors::new(matrix);
    let shapes = factors.solve(known);
    for (i, &coordinate) in coordinates.iter().enumerate() {
        let terms = others.iter().enumerate().map(|(j, &k)| (k, shapes[(i, j)]));
        followers.push(Slaved {
            coordinate,
            constant: shapes[(i, others.len())],
            terms: terms.filter(|term| term.1 != 0.0).collect(),
        });
    }
    let inverse = factors.solve(DMatrix::identity(count, count));
    Ok(Elimination { group: index, coordinates, sources, inverse })
}
