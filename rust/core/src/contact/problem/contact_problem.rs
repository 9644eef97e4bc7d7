//! Contact problems: which statuses contacts take that act on each other, and what forces.
//!
//! For the contacts of a problem, `a = a0 + W f` relates the forces (T, N) to what they change:
//!
//! | level | f | a | W |
//! | --- | --- | --- | --- |
//! | accelerations | forces | accelerations of slip and gap | `D' M^-1 D` |
//! | impulses | impulses | slip velocity and speed of the gap | `D' M^-1 D` |
//! | forces | forces | tangential displacement and gap | flexibility `B' Y B` of coordinates without mass |
//! | rates | rates of the forces | slip velocity and speed of the gap | `B' Y B` |
//!
//! Sought are statuses whose linear equations have a solution that meets every condition of
//! [`crate::contact::problem::conditions`]. There may be none, or several (Painleve).

use nalgebra::{DMatrix, DVector};

use crate::contact::problem::conditions::{AT_REST, Case, Conditions};
use crate::contact::problem::dependent::Forces;
use crate::contact::problem::held_rows::held_rows;
use crate::error::run::Level;
use crate::linalg::dense::refined_solution;
use crate::numerics::double_double::Doubled;
use crate::scene::status::Status;

/// Violation of an inequality, relative to its terms, that counts as rounding.
pub(super) const ROUNDING: f64 = 1e-11;
/// Held directions that depend on each other contradict each other if an acceleration, relative to its terms, exceeds this.
pub(super) const CONSISTENT: f64 = 1e-9;

/// Statuses and forces (T, N) of each contact.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub statuses: Vec<Status>,
    pub forces: DVector<f64>,
    /// How close each contact that sticks is to the bound in whose direction it slid, relative to its terms; 0 at it.
    pub margins: Vec<f64>,
}

impl Solution {
    /// Whether the friction force of a sticking contact is at its limit to rounding, so that it leaves it at second order.
    pub fn is_at_bound(&self, contact: usize) -> bool {
        self.margins[contact] <= AT_REST
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unsolved {
    /// No choice of statuses is one.
    None,
    /// None of those tried is one, and not all were tried.
    NotFound,
    Several,
    /// Several are, which differ in contacts that static friction holds.
    Held,
    /// Several are, which differ by normal forces in balance with each other, and so in the friction that these bring.
    Split,
}

impl Unsolved {
    /// What the problem has, and the remedy, as the end of a sentence about it.
    pub const fn told(self, level: Level) -> &'static str {
        let is_massless = matches!(level, Level::Forces | Level::Rates);
        match self {
            Self::None | Self::NotFound if !is_massless => "no solution (Painleve)",
            Self::Several if !is_massless => "several solutions (Painleve)",
            Self::Held if !is_massless => {
                "several solutions (static friction above the kinetic one can hold some of them or others)"
            }
            Self::None => {
                "has no solution: friction is too large for the stiffness that ties them; give them a normal_stiffness and a tangential_stiffness, or less friction"
            }
            Self::NotFound => {
                "has too many combinations of statuses to try all, and those tried are no solution; tie fewer contacts without mass to each other, or give them a normal_stiffness and a tangential_stiffness"
            }
            Self::Several => {
                "has several solutions: friction is too large for the stiffness that ties them; give them a normal_stiffness and a tangential_stiffness, or less friction"
            }
            Self::Held => {
                "has several solutions: static friction above the kinetic one can hold some of them or others; give them static_friction = friction, or a load that tells them apart"
            }
            Self::Split => {
                "several solutions (their directions depend on each other, and the motion depends on how their forces are split; give these contacts a stiffness, or a small mass of their own tied to the body by stiff springs)"
            }
        }
    }
}

/// `a = a0 + W f` over (tangential, normal) of each contact.
#[derive(Debug)]
pub(crate) struct ContactProblem {
    pub contacts: Vec<Conditions>,
    pub level: Level,
    pub w: DMatrix<f64>,
    pub a0: DVector<f64>,
    /// The sum of the absolute values of the terms of each entry of a0, where these cancel; else 0.
    pub sizes: DVector<f64>,
    /// The part of `a0` by which sliders carry each row, and the sum of the absolute values of its terms.
    pub carried: Vec<[f64; 2]>,
    /// Whether directions depend on each other, so that W may be singular.
    pub dependent: bool,
}

impl ContactProblem {
    /// A problem whose rows no slider carries, and whose a0 is exact.
    pub fn new(
        contacts: Vec<Conditions>,
        level: Level,
        w: DMatrix<f64>,
        a0: impl Into<DVector<f64>>,
    ) -> Self {
        let a0 = a0.into();
        let (carried, sizes) = (vec![[0.0; 2]; a0.len()], DVector::zeros(a0.len()));
        Self { contacts, level, w, a0, sizes, carried, dependent: false }
    }

    /// The problem of some of its contacts while the others have forces (T, N).
    pub(super) fn part(&self, contacts: &[usize], forces: Option<&DVector<f64>>) -> Self {
        let rows: Vec<usize> = contacts.iter().flat_map(|&i| [2 * i, 2 * i + 1]).collect();
        let a0 = self.a0.select_rows(&rows);
        Self {
            contacts: contacts.iter().map(|&i| self.contacts[i]).collect(),
            level: self.level,
            w: self.w.select_rows(&rows).select_columns(&rows),
            a0: forces.map_or_else(|| a0.clone(), |f| &a0 + self.w.select_rows(&rows) * f),
            sizes: self.sizes.select_rows(&rows),
            carried: rows.iter().map(|&row| self.carried[row]).collect(),
            dependent: self.dependent,
        }
    }

    /// Takes slip velocities that come to their end to zero, which they are under the statuses `before`: where a slip slows
    /// down fast, an ulp of time leaves it more than the rounding of its terms.
    pub fn end_slips(&mut self, before: &[Status]) {
        let ends = |own: &Conditions| matches!(own.case, Case::Slipping { ends: true, .. });
        if !self.contacts.iter().any(ends) {
            return;
        }
        // Without forces the slips keep their rounding, and what is found with it is verified all the same.
        let Some(forces) = self.forces(before) else { return };
        let rates = &self.w * forces;
        for k in (0..self.contacts.len()).filter(|&k| ends(&self.contacts[k])) {
            self.a0[2 * k] = -rates[2 * k];
        }
    }

    /// The forces of contacts with these statuses, consistent or not; `None` if their equations have no solution.
    pub fn forces(&self, statuses: &[Status]) -> Option<DVector<f64>> {
        if self.dependent {
            return self.dependent_forces(statuses).map(|found| found.0);
        }
        // Equations are left of what is held alone: other forces are zero, or the friction that a normal force brings.
        let held = held_rows(statuses, |i| self.contacts[i].friction);
        let sizes = held.iter().map(|held| self.w.row(held.row).amax());
        let sizes = DVector::from_iterator(held.len(), sizes);
        let of_all = |x: &DVector<f64>| {
            let mut forces = DVector::zeros(self.a0.len());
            for (held, x) in held.iter().zip(x) {
                held.forces().for_each(|(row, factor)| forces[row] = factor * x);
            }
            forces
        };
        let left = |x: &DVector<f64>| {
            let mut left: Vec<Doubled> =
                held.iter().map(|held| Doubled::from(-self.a0[held.row])).collect();
            let forces = of_all(x);
            for (column, &force) in forces.iter().enumerate().filter(|(_, force)| **force != 0.0) {
                for (left, held) in left.iter_mut().zip(&held) {
                    *left = left.add(Doubled::product(-self.w[(held.row, column)], force));
                }
            }
            DVector::from_iterator(held.len(), left.into_iter().map(Doubled::value))
        };
        let entry = |i: usize, j: usize| {
            held[j].forces().map(|(column, factor)| factor * self.w[(held[i].row, column)]).sum()
        };
        let matrix = DMatrix::from_fn(held.len(), held.len(), entry);
        refined_solution(matrix, &sizes, left).map(|x| of_all(&x))
    }

    /// The shortest forces where directions depend on each other, and the forces that nothing determines; `None` where the
    /// held accelerations contradict each other.
    pub(super) fn dependent_forces(
        &self,
        statuses: &[Status],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (held, found) = Forces::of_statuses(&self.w, statuses, |i| self.contacts[i].friction);
        let rhs = DVector::from_iterator(held.len(), held.iter().map(|&row| -self.a0[row]));
        let mut forces = &found.of_rows * rhs;
        // An acceleration of 1e-15 of the others is then still met to its own rounding.
        let rows = DVector::from_fn(held.len(), |k, _| -self.terms(held[k], forces.as_slice()).0);
        forces += &found.of_rows * rows;
        let consistent = held.iter().all(|&row| {
            let (sum, size) = self.terms(row, forces.as_slice());
            sum.abs() <= CONSISTENT * size
        });
        (consistent && self.carried_alike(statuses)).then_some((forces, found.free))
    }

    /// Whether sliders carry alike the held directions that depend on each other. In the combination of their accelerations
    /// that no force changes, forces cancel: large forces do not hide that two sliders part.
    fn carried_alike(&self, statuses: &[Status]) -> bool {
        if self.carried.iter().all(|carried| carried[1] == 0.0) {
            return true;
        }
        // Of the held rows alone, without the friction that their forces bring.
        Forces::of_statuses(&self.w, statuses, |_| 0.0).1.free.column_iter().all(|combination| {
            let terms = combination.iter().zip(&self.carried);
            let [sum, size] = terms.fold([0.0, 0.0], |[sum, size], (f, carried)| {
                [sum + f * carried[0], size + f.abs() * carried[1]]
            });
            sum.abs() <= ROUNDING * size
        })
    }

    /// An entry of a, and the sum of the absolute values of its terms.
    pub(super) fn terms(&self, row: usize, forces: &[f64]) -> (f64, f64) {
        let start = (self.a0[row], self.a0[row].abs().max(self.sizes[row]));
        let entries = self.w.row(row);
        entries
            .iter()
            .zip(forces)
            .fold(start, |(sum, size), (w, f)| (sum + w * f, size + (w * f).abs()))
    }

    /// The scale of the rounding of a force, which is that of the terms that its row balances.
    pub(super) fn rounding(&self, row: usize, forces: &[f64]) -> f64 {
        match self.w[(row, row)] {
            0.0 => 0.0,
            own => self.terms(row, forces).1 / own,
        }
    }

    /// Whether two solutions mean the same motion: statuses at a boundary have two names. Their forces are the same, too,
    /// unless directions depend on each other.
    pub(super) fn same_motion(&self, one: &Solution, other: &Solution) -> bool {
        let (a, b) = match self.dependent {
            true => (&self.w * &one.forces, &self.w * &other.forces),
            false => (one.forces.clone(), other.forces.clone()),
        };
        let mut scale = a.amax().max(b.amax());
        if self.dependent {
            scale = scale.max(self.a0.amax());
        } else {
            for (k, size) in self.sizes.iter().enumerate().filter(|&(k, _)| self.w[(k, k)] != 0.0) {
                scale = scale.max(size / self.w[(k, k)]);
            }
        }
        (a - b).amax() <= 100.0 * ROUNDING * scale
    }
}
