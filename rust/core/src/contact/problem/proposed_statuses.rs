//! Statuses that are tried first where a contact problem has too many to try all of them.

use nalgebra::{DMatrix, DVector};

use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::{ContactProblem, Solution};
use crate::numerics::lemke::lemke;
use crate::scene::status::Status;

/// Sweeps of Gauss-Seidel iteration.
const SWEEPS: usize = 500;
/// Force, relative to the largest, below which Lemke's method proposes none.
const PIVOTED: f64 = 1e-11;

/// Changes of single statuses until no status is wrong.
const CHANGES: usize = 1000;

impl ContactProblem {
    /// The statuses that are left once no contact violates a condition of its own, the worst one changed at a time.
    pub(super) fn by_changes(&self) -> Option<Solution> {
        let choices: Vec<&[Status]> = self.contacts.iter().map(Conditions::choices).collect();
        let mut at = vec![0; choices.len()];
        for _ in 0..CHANGES {
            let statuses: Vec<Status> = at.iter().zip(&choices).map(|(&k, own)| own[k]).collect();
            match self.verified(&statuses) {
                Ok(solution) => return Some(solution),
                Err(wrong) => {
                    let wrong = wrong?;
                    at[wrong] = (at[wrong] + 1) % choices[wrong].len();
                }
            }
        }
        None
    }

    /// The statuses to which projected Gauss-Seidel iteration settles: contact by contact, the forces that meet the
    /// contact's own conditions while the others' are held (Jean 1999).
    pub(super) fn gauss_seidel(&self) -> Option<Solution> {
        let count = self.contacts.len();
        let mut forces = DVector::zeros(2 * count);
        let mut statuses = vec![Status::Detached; count];
        let mut tried = Vec::new();
        for _ in 0..SWEEPS {
            for (i, contact) in self.contacts.iter().enumerate() {
                let before = forces.rows(2 * i, 2).into_owned();
                forces.rows_mut(2 * i, 2).fill(0.0);
                let alone = self.part(&[i], Some(&forces));
                let mut choices = contact.choices().iter();
                let found = choices.find_map(|&status| alone.verified(&[status]).ok());
                // If one contact alone has no answer, the iteration goes on with its present forces.
                let force = found.map_or(before, |solution| {
                    statuses[i] = solution.statuses[0];
                    solution.forces
                });
                forces.rows_mut(2 * i, 2).copy_from(&force);
            }
            if !tried.contains(&statuses) {
                if let Ok(solution) = self.verified(&statuses) {
                    return Some(solution);
                }
                tried.push(statuses.clone());
            }
        }
        None
    }

    /// Statuses from the linear complementarity problem in the unknowns (N, T^+, T^-, |a_t|), `T = T^+ - T^-`
    /// (Stewart and Trinkle 1996), solved by Lemke's pivoting. Its matrix is copositive for every friction coefficient when
    /// no contact slips yet.
    pub(super) fn lemke_statuses(&self, unit_a: f64) -> Option<Vec<Status>> {
        let Self { contacts, w, a0, .. } = self;
        let count = contacts.len();
        let candidates: Vec<usize> = (0..count)
            .filter(|&i| contacts[i].case == Case::Resting && contacts[i].static_friction > 0.0)
            .collect();
        let given = |i: usize| match contacts[i].case {
            Case::Sliding(status) => Some(status),
            _ => None,
        };
        let blocks = [count, count + candidates.len(), count + 2 * candidates.len()];
        let size = count + 3 * candidates.len();
        let mut matrix = DMatrix::zeros(size, size);
        let mut q = DVector::zeros(size);
        // Forces in units of `unit_a` / |W| and a larger a0 in its own unit: the pivoting tolerances are absolute.
        let unit_w = w.amax().max(f64::MIN_POSITIVE);
        let mut fill = |target: usize, row: usize, sign: f64| {
            let unit = a0[row].abs().max(unit_a);
            let force = sign * unit_a / unit;
            for (j, contact) in contacts.iter().enumerate() {
                let (t, n) = (w[(row, 2 * j)], w[(row, 2 * j + 1)]);
                let slope = given(j).map_or(0.0, |s| s.friction_sign() * contact.friction);
                matrix[(target, j)] = force * (n + slope * t) / unit_w;
            }
            for (k, &j) in candidates.iter().enumerate() {
                let t = force * w[(row, 2 * j)] / unit_w;
                matrix[(target, blocks[0] + k)] = t;
                matrix[(target, blocks[1] + k)] = -t;
            }
            q[target] = sign * a0[row] / unit;
        };
        for i in 0..count {
            fill(i, 2 * i + 1, 1.0);
        }
        for (k, &i) in candidates.iter().enumerate() {
            fill(blocks[0] + k, 2 * i, 1.0);
            fill(blocks[1] + k, 2 * i, -1.0);
        }
        for (k, &i) in candidates.iter().enumerate() {
            let [plus, minus, slip] = blocks.map(|block| block + k);
            matrix[(plus, slip)] = 1.0;
            matrix[(minus, slip)] = 1.0;
            matrix[(slip, i)] = contacts[i].static_friction;
            matrix[(slip, plus)] = -1.0;
            matrix[(slip, minus)] = -1.0;
        }
        let z = lemke(&matrix, &q)?;
        let scale = z.rows(0, blocks[2]).amax();
        let positive = |value: f64| value > PIVOTED * scale;
        let status = |i: usize| {
            if !positive(z[i]) {
                return Status::Detached;
            }
            let candidate = candidates.iter().position(|&c| c == i);
            match (given(i), candidate) {
                (Some(status), _) => status,
                (None, None) => Status::Positive,
                (None, Some(k)) => {
                    let friction = z[blocks[0] + k] - z[blocks[1] + k];
                    if positive(contacts[i].static_friction * z[i] - friction.abs()) {
                        Status::Sticking
                    } else if friction > 0.0 {
                        Status::Positive
                    } else {
                        Status::Negative
                    }
                }
            }
        };
        Some((0..count).map(status).collect())
    }
}
