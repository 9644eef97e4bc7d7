//! Whether steady sliding exists: the equilibrium of a combination, and the normal force or gap of every contact there.
//!
//! In steady sliding the structure is at rest, `K_s q = F_s`, and the friction forces are in `K_s` and `F_s`. The
//! *margin* of a closed contact is its normal force `N = (K q)_n - F_n`, that of an open one its gap `q_n`. Steady
//! sliding of a combination exists where no margin is negative and every sliding contact slips as its slider drives it.
//! Which contacts are open, if some have to be, is a complementarity problem.

use nalgebra::{DMatrix, DVector};

use crate::error::input::Error;
use crate::linalg::dense::regular_solution;
use crate::scene::contact_law::Contact;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::{Reduction, normal_forces_at_rest};
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::status::{Combination, Status};

/// A normal force below this part of its terms is lost in their rounding.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// `K_s q = load`, and `margin_i = rows_i . q - offsets_i` of every contact.
#[derive(Debug, Clone)]
pub struct Statics {
    /// m entries, N.
    pub load: Vec<f64>,
    /// One row of m entries for each contact.
    pub rows: DMatrix<f64>,
    /// One entry per contact: the normal entry of F, N, of closed contacts, 0 of open ones.
    pub offsets: Vec<f64>,
    /// Speeds of the sliders, m/s; 1 for stops, which have none.
    pub speeds: Vec<f64>,
}

/// Whether steady sliding of a combination exists, and its margins: N of closed contacts in N, gaps of open ones in m;
/// NaN where a contact sticks (its place is free) or the stiffness is singular.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Whether no margin is negative and every sliding contact slips as its slider drives it.
    pub exists: bool,
    /// One margin per contact, N or m.
    pub margins: Vec<f64>,
}

impl Steady {
    pub(crate) fn new(combination: &Combination, speeds: &[f64], margins: Vec<f64>) -> Self {
        let driven = combination.statuses().iter().zip(speeds).all(|(&status, &speed)| {
            matches!(status, Status::Detached | Status::Slipping)
                || Status::driven_by(speed) == Some(status)
        });
        Self { exists: driven && margins.iter().all(|&margin| margin >= 0.0), margins }
    }
}

impl Statics {
    /// Of a scene and one of its combinations.
    pub fn new(scene: &Scene, reduced: &Reduced) -> Self {
        Self::in_bases(reduced.scene(scene), &reduced.combination, &reduced.reduction)
    }

    /// The same without the dense matrices of the combination.
    pub fn of(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        let moving = scene.resting(combination)?;
        let reduction = Reduction::new(&moving, combination).checked(combination)?;
        Ok(Self::in_bases(&moving, combination, &reduction))
    }

    /// Of the scene that moves in a combination.
    pub(super) fn in_bases(
        scene: &Scene,
        combination: &Combination,
        reduction: &Reduction,
    ) -> Self {
        let (m, statuses) = (reduction.size(), combination.statuses());
        let mut rows = DMatrix::zeros(statuses.len(), m);
        let mut offsets = vec![0.0; statuses.len()];
        let mut places = vec![0.0; scene.size];
        reduction.place_closed(&mut places);
        let forces = normal_forces_at_rest(scene, combination);
        for (i, (law, status)) in scene.contacts.iter().zip(statuses).enumerate() {
            let position = |k: usize| reduction.place(k);
            if status.is_closed() {
                for &(row, factor) in &forces[i] {
                    offsets[i] += factor * scene.force[row];
                    for (k, value) in scene.stiffness.row(row) {
                        match position(k) {
                            Some(j) => rows[(i, j)] += factor * value,
                            None => offsets[i] -= factor * value * places[k],
                        }
                    }
                }
                continue;
            }
            let (terms, constant) = scene.dependents.pulled_back(&[(law.normal, 1.0)]);
            offsets[i] = 0.0 - constant - law.gap;
            for (k, factor) in terms {
                match position(k) {
                    Some(j) => rows[(i, j)] = factor,
                    None => offsets[i] -= factor * places[k],
                }
            }
        }
        Self {
            load: reduction.force_constant(scene),
            rows,
            offsets,
            speeds: scene.contacts.iter().map(Contact::drive).collect(),
        }
    }

    pub(crate) fn steady(&self, combination: &Combination, stiffness: &DMatrix<f64>) -> Steady {
        self.steady_at(combination, || regular_solution(stiffness, &self.load))
    }

    /// The same where `K_s^-1 load` is known; None: the stiffness is singular.
    pub(super) fn steady_at(
        &self,
        combination: &Combination,
        rest: impl FnOnce() -> Option<DVector<f64>>,
    ) -> Steady {
        let stuck = combination.statuses().contains(&Status::Sticking);
        let margins = match if stuck { None } else { rest() } {
            Some(q) => self.margins(q.as_slice()),
            None => vec![f64::NAN; self.offsets.len()],
        };
        Steady::new(combination, &self.speeds, margins)
    }

    /// `rows . q - offsets`, or zero if it is within the rounding of its terms, so that no verdict depends on rounding.
    pub(super) fn margins(&self, q: &[f64]) -> Vec<f64> {
        let margin = |(i, &offset): (usize, &f64)| {
            let (mut sum, mut size) = (-offset, offset.abs());
            for (a, x) in self.rows.row(i).iter().zip(q) {
                sum += a * x;
                size += (a * x).abs();
            }
            if sum.abs() <= ROUNDING * size { 0.0 } else { sum }
        };
        self.offsets.iter().enumerate().map(margin).collect()
    }
}
