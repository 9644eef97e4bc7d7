//! Statuses that are tried first where a contact problem has too many to try all of them.

use nalgebra::DVector;

use crate::contact::problem::conditions::Conditions;
use crate::contact::problem::contact_problem::{ContactProblem, Solution};
use crate::scene::status::Status;

/// Sweeps of Gauss-Seidel iteration.
const SWEEPS: usize = 500;
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
}
