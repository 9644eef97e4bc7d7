//! Contact problems in which mass couples several contacts.
//!
//! For the closed contacts, `a = a0 + W lambda` relates the contact forces (N, T) to the accelerations of
//! gap and slip, W being `D' M^-1 D`; the same form relates impulses to velocities. Sought are
//!
//! ```text
//! a_n >= 0,  N >= 0,  a_n N = 0;   T = sigma mu N at a contact already slipping;
//! |T| <= mu_static N where slip is zero, and T = -mu N sign(a_t) where a_t != 0.
//! ```
//!
//! There may be no solution, or several (Painleve).

use nalgebra::{DMatrix, DVector};

use crate::contact::coupled::dependent::{Forces, eliminated};
use crate::linalg::dense::refined_solution;
use crate::scene::status::Status;

/// Violation of an inequality, relative to its terms, that counts as rounding.
pub(super) const ROUNDING: f64 = 1e-11;
/// Held directions that depend on each other contradict each other if an acceleration, relative to its terms, exceeds this.
pub(super) const CONSISTENT: f64 = 1e-9;

/// One closed contact of the problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Closed {
    pub friction: f64,
    pub static_friction: f64,
    /// T / (mu N) where the contact already slips; `None` where slip is zero.
    pub sliding: Option<f64>,
    /// Whether it can open: its normal force is not given.
    pub opens: bool,
}

/// Statuses and forces (T, N) of each closed contact.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub statuses: Vec<Status>,
    pub forces: DVector<f64>,
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unsolved {
    None,
    Several,
    /// Several are, which differ in contacts that static friction holds.
    Held,
    /// Several are, which differ by normal forces in balance with each other, and so in the friction that these bring.
    Split,
}

impl Unsolved {
    /// What the problem has, as the end of a sentence about it.
    pub const fn told(self) -> &'static str {
        match self {
            Self::None => "no solution (Painleve)",
            Self::Several => "several solutions (Painleve)",
            Self::Held => {
                "several solutions (static friction above the kinetic one can hold some of them or others)"
            }
            Self::Split => {
                "several solutions (their directions depend on each other, and the motion depends on how their forces are split; give these contacts a stiffness, or a small mass of their own tied to the body by stiff springs)"
            }
        }
    }
}

/// `a = a0 + W lambda` over (tangential, normal) of each closed contact.
#[derive(Debug)]
pub(crate) struct ContactProblem {
    pub contacts: Vec<Closed>,
    pub w: DMatrix<f64>,
    pub a0: DVector<f64>,
    /// The part of `a0` by which sliders carry each row, and the sum of the absolute values of its terms.
    pub carried: Vec<[f64; 2]>,
    /// Whether directions depend on each other, so that W may be singular.
    pub dependent: bool,
}

impl ContactProblem {
    /// A problem whose rows no slider carries.
    pub fn new(
        contacts: Vec<Closed>,
        w: DMatrix<f64>,
        a0: impl Into<DVector<f64>>,
        dependent: bool,
    ) -> Self {
        let a0 = a0.into();
        Self { contacts, w, carried: vec![[0.0; 2]; a0.len()], a0, dependent }
    }

    /// The forces of contacts with these statuses, consistent or not; `None` if their equations have no solution.
    pub fn forces(&self, statuses: &[Status]) -> Option<DVector<f64>> {
        if self.dependent {
            return self.dependent_forces(statuses).map(|found| found.0);
        }
        // Rows: an acceleration that must vanish, or a force that is given by another.
        let mut matrix = DMatrix::identity(self.a0.len(), self.a0.len());
        let mut rhs = DVector::zeros(self.a0.len());
        let mut hold = |matrix: &mut DMatrix<f64>, row: usize| {
            matrix.set_row(row, &self.w.row(row));
            rhs[row] = -self.a0[row];
        };
        for (i, (contact, &status)) in self.contacts.iter().zip(statuses).enumerate() {
            let (t, n) = (2 * i, 2 * i + 1);
            if status.is_closed() {
                hold(&mut matrix, n);
            }
            if status == Status::Sticking {
                hold(&mut matrix, t);
            }
            if status.is_sliding() {
                matrix[(t, n)] = -status.friction_sign() * contact.friction;
            }
        }
        refined_solution(matrix, &rhs)
    }

    /// The shortest forces where directions depend on each other, and the forces that nothing determines; `None` where the
    /// held accelerations contradict each other.
    fn dependent_forces(&self, statuses: &[Status]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let slope = |i: usize| statuses[i].friction_sign() * self.contacts[i].friction;
        let (held, map) = held_rows(statuses, slope);
        let found = Forces::new(&self.w, &held, &map);
        let rhs = DVector::from_iterator(held.len(), held.iter().map(|&row| -self.a0[row]));
        let mut forces = &found.of_rows * rhs;
        // An acceleration of 1e-15 of the others is then still met to its own rounding.
        let rows = DVector::from_fn(held.len(), |k, _| -self.terms(held[k], &forces).0);
        forces += &found.of_rows * rows;
        let consistent = held.iter().all(|&row| {
            let (sum, size) = self.terms(row, &forces);
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
        let (held, own) = held_rows(statuses, |_| 0.0);
        Forces::new(&self.w, &held, &own).free.column_iter().all(|combination| {
            let terms = combination.iter().zip(&self.carried);
            let [sum, size] = terms.fold([0.0, 0.0], |[sum, size], (f, carried)| {
                [sum + f * carried[0], size + f.abs() * carried[1]]
            });
            sum.abs() <= ROUNDING * size
        })
    }

    /// An acceleration, and the sum of the absolute values of its terms.
    pub(super) fn terms(&self, row: usize, forces: &DVector<f64>) -> (f64, f64) {
        let start = (self.a0[row], self.a0[row].abs());
        let entries = self.w.row(row);
        entries
            .iter()
            .zip(forces)
            .fold(start, |(sum, size), (w, f)| (sum + w * f, size + (w * f).abs()))
    }

    /// Whether two solutions mean the same motion: statuses at a boundary have two names. Their forces are the same, too,
    /// unless directions depend on each other.
    pub(super) fn same_motion(&self, one: &Solution, other: &Solution) -> bool {
        let (a, b) = match self.dependent {
            true => (&self.w * &one.forces, &self.w * &other.forces),
            false => (one.forces.clone(), other.forces.clone()),
        };
        let scale = a.amax().max(b.amax()).max(if self.dependent { self.a0.amax() } else { 0.0 });
        (a - b).amax() <= 100.0 * ROUNDING * scale
    }

    /// The solution with these statuses, if they are consistent. Each inequality may fail by the rounding of its own terms,
    /// because those of a normal force are 1e-14 of a slip where contacts close slowly.
    pub(super) fn verified(&self, statuses: &[Status]) -> Option<Solution> {
        let (forces, free) = match self.dependent {
            true => self.dependent_forces(statuses)?,
            false => (self.forces(statuses)?, DMatrix::zeros(self.a0.len(), 0)),
        };
        let terms = |k: usize| self.terms(k, &forces);
        // A force is rounded as the terms that its row balances.
        let rounding = |k: usize| ROUNDING * terms(k).1 / self.w[(k, k)];
        let is_consistent = |(i, (contact, &status)): (usize, (&Closed, &Status))| {
            let (t, n) = (2 * i, 2 * i + 1);
            match status {
                Status::Detached => {
                    let (acceleration, terms) = terms(n);
                    acceleration >= -ROUNDING * terms
                }
                // If nothing determines some forces, one split that satisfies the inequalities is enough.
                _ if free.ncols() == 0 && forces[n] < -rounding(n) => false,
                Status::Sticking if free.ncols() > 0 => true,
                Status::Sticking => {
                    let limit = contact.static_friction;
                    forces[t].abs() <= limit * forces[n] + limit * rounding(n) + rounding(t)
                }
                // Slip that begins must go against the friction force.
                _ if contact.sliding.is_none() && contact.static_friction > 0.0 => {
                    let (acceleration, terms) = terms(t);
                    -status.friction_sign() * acceleration >= -ROUNDING * terms
                }
                _ => true,
            }
        };
        let consistent = self.contacts.iter().zip(statuses).enumerate().all(is_consistent)
            && (free.ncols() == 0 || self.some_split_holds(statuses, &forces, &free, rounding));
        consistent.then(|| Solution { statuses: statuses.to_vec(), forces })
    }

    /// Whether some forces beside the shortest ones press every closed contact and stay within its friction.
    fn some_split_holds(
        &self,
        statuses: &[Status],
        forces: &DVector<f64>,
        free: &DMatrix<f64>,
        rounding: impl Fn(usize) -> f64,
    ) -> bool {
        // (value, rounding, part of the free forces)
        let mut rows: Vec<(f64, f64, Vec<f64>)> = Vec::new();
        for (i, &status) in statuses.iter().enumerate().filter(|(_, status)| status.is_closed()) {
            let (t, n) = (2 * i, 2 * i + 1);
            let mut push = |normal: f64, tangential: f64| {
                rows.push((
                    normal * forces[n] + tangential * forces[t],
                    normal * rounding(n) + tangential.abs() * rounding(t),
                    (0..free.ncols())
                        .map(|k| normal * free[(n, k)] + tangential * free[(t, k)])
                        .collect(),
                ));
            };
            if status == Status::Sticking {
                push(self.contacts[i].static_friction, 1.0);
                push(self.contacts[i].static_friction, -1.0);
            } else {
                push(1.0, 0.0);
            }
        }
        let b = DMatrix::from_fn(rows.len(), free.ncols(), |j, k| rows[j].2[k]);
        eliminated(&b).is_some_and(|inequalities| {
            inequalities.iter().all(|factors| {
                let sum = factors.iter().map(|&(j, factor)| factor * rows[j].0).sum::<f64>();
                let rounding = factors.iter().map(|&(j, factor)| factor * rows[j].1).sum::<f64>();
                sum >= -rounding
            })
        })
    }
}

/// The statuses that a closed contact may take.
pub(super) fn choices(contact: &Closed) -> &'static [Status] {
    let all: &[Status] = match contact.sliding {
        Some(sign) if sign > 0.0 => &[Status::Positive, Status::Detached],
        Some(_) => &[Status::Negative, Status::Detached],
        None if contact.static_friction == 0.0 => &[Status::Positive, Status::Detached],
        None => &[Status::Sticking, Status::Positive, Status::Negative, Status::Detached],
    };
    if contact.opens { all } else { &all[..all.len() - 1] }
}

/// The rows that statuses hold at zero acceleration, and the forces (tangential, normal) of all contacts per force of
/// each of them: a sliding contact has `slope` times its normal force along its slider.
pub(crate) fn held_rows(
    statuses: &[Status],
    slope: impl Fn(usize) -> f64,
) -> (Vec<usize>, DMatrix<f64>) {
    let mut held = Vec::new();
    for (i, &status) in statuses.iter().enumerate().filter(|(_, status)| status.is_closed()) {
        held.push(2 * i + 1);
        held.extend((status == Status::Sticking).then_some(2 * i));
    }
    let mut map = DMatrix::zeros(2 * statuses.len(), held.len());
    for (k, &row) in held.iter().enumerate() {
        map[(row, k)] = 1.0;
        if row % 2 == 1 && statuses[row / 2].is_sliding() {
            map[(row - 1, k)] = slope(row / 2);
        }
    }
    (held, map)
}
