//! Whether statuses solve a contact problem: their equations, and every condition.

use nalgebra::{DMatrix, DVector};

use crate::contact::problem::conditions::{AT_REST, Case};
use crate::contact::problem::contact_problem::{ContactProblem, ROUNDING, Solution};
use crate::contact::problem::dependent::eliminated;
use crate::scene::status::Status;

/// Numbers that must not be negative, each with the scale of its rounding; and how close a contact that sticks is to the
/// bound in whose direction it slid, relative to its terms, 0 at it.
#[derive(Debug, Default)]
struct Checked {
    pub conditions: Vec<(f64, f64)>,
    pub margin: f64,
}

impl ContactProblem {
    /// The conditions of contact i in a status under the forces (T, N) of all contacts. Where some split of forces that nothing
    /// determines is to be found, those of the forces are left out.
    fn checked(&self, i: usize, status: Status, forces: &[f64], is_split: bool) -> Checked {
        let own = &self.contacts[i];
        let (t, n) = (2 * i, 2 * i + 1);
        let sign = status.friction_sign();
        let slip = || {
            let (slip, size) = self.terms(t, forces);
            (-sign * slip, size)
        };
        let rounding = |row: usize| self.rounding(row, forces);
        let held = |sign: f64, limit: f64| {
            let value = limit * forces[n] - sign * forces[t];
            (value, limit * rounding(n) + rounding(t))
        };
        let mut checked = Checked::default();
        let conditions = &mut checked.conditions;
        match (own.case, status) {
            (Case::Settled(_), _) => {}
            (_, Status::Detached) => conditions.push(self.terms(n, forces)),
            (Case::Slipping { towards, at_bound, ends }, Status::Sticking) => {
                let bound = held(towards.friction_sign(), own.friction);
                let rest = if ends { AT_REST * bound.1 } else { 0.0 };
                conditions.extend(at_bound.then_some((bound.0 + rest, bound.1)));
                checked.margin = if bound.1 > 0.0 { (bound.0 / bound.1).max(0.0) } else { 0.0 };
            }
            // A contact that has come to rest slips again only if a force moves it.
            (Case::Slipping { ends: true, .. }, _) => {
                let (value, size) = slip();
                conditions.push((value - AT_REST * size, size));
            }
            (Case::Slipping { .. }, _) => conditions.push(slip()),
            (_, Status::Sticking) => {
                let limit = own.static_friction;
                let pressed = || (forces[n], rounding(n));
                let bounds = (!is_split).then(|| [pressed(), held(1.0, limit), held(-1.0, limit)]);
                conditions.extend(bounds.into_iter().flatten());
            }
            (case, _) => {
                conditions.extend((!is_split).then(|| (forces[n], rounding(n))));
                // Slip that begins must go against the friction force.
                let begins = own.static_friction > 0.0 && !matches!(case, Case::Sliding(_));
                conditions.extend(begins.then(slip));
            }
        }
        checked
    }

    /// The solution with these statuses, or the contact whose conditions are violated most; None where their equations have no
    /// solution. Each inequality may fail by the rounding of its own terms, because those of a normal force are 1e-14 of a slip
    /// where contacts close slowly.
    pub(super) fn verified(&self, statuses: &[Status]) -> Result<Solution, Option<usize>> {
        let (forces, free) = match self.dependent {
            true => self.dependent_forces(statuses).ok_or(None)?,
            false => (self.forces(statuses).ok_or(None)?, DMatrix::zeros(self.a0.len(), 0)),
        };
        // If nothing determines some forces, one split that satisfies the inequalities is enough.
        let is_split = free.ncols() > 0;
        let mut margins = Vec::with_capacity(statuses.len());
        let mut wrong: Option<(f64, usize)> = None;
        for (i, &status) in statuses.iter().enumerate() {
            let checked = self.checked(i, status, forces.as_slice(), is_split);
            for (value, scale) in checked.conditions {
                let violation = -value / scale;
                let is_worst = wrong.is_none_or(|(worst, _)| violation > worst);
                if !(value >= -ROUNDING * scale) && is_worst {
                    wrong = Some((violation, i));
                }
            }
            margins.push(checked.margin);
        }
        if let Some((_, contact)) = wrong {
            return Err(Some(contact));
        }
        match is_split && !self.some_split_holds(statuses, &forces, &free) {
            true => Err(None),
            false => Ok(Solution { statuses: statuses.to_vec(), forces, margins }),
        }
    }

    /// Whether some forces beside the shortest ones press every closed contact and stay within its friction.
    fn some_split_holds(
        &self,
        statuses: &[Status],
        forces: &DVector<f64>,
        free: &DMatrix<f64>,
    ) -> bool {
        let rounding = |row: usize| ROUNDING * self.rounding(row, forces.as_slice());
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
