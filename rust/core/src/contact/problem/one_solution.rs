//! The one solution of a contact problem, or why there is none.
//!
//! Every combination of statuses is tried while they are few, so that a second solution is seen. Otherwise statuses are proposed.

use nalgebra::DVector;

use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::{CONSISTENT, ContactProblem, Solution, Unsolved};
use crate::error::run::Level;
use crate::linalg::components::components;
use crate::scene::status::Status;

/// Contacts up to which all combinations of statuses are tried.
pub(super) const ENUMERATED: usize = 5;
/// Combinations up to which all are tried where contacts have no mass.
const ENUMERATED_WITHOUT_MASS: usize = 4096;
/// Contacts up to which all combinations are tried if no other method has found an answer.
const EXHAUSTED: usize = 8;

impl ContactProblem {
    /// The solution of each group of contacts that act on each other, side by side. If static friction exceeds kinetic friction, a
    /// contact keeps its status if it can.
    pub fn solve(&self) -> Result<Solution, Unsolved> {
        let count = self.contacts.len();
        let groups = self.groups();
        if groups.len() == 1 {
            return self.solve_group();
        }
        let mut whole = Solution {
            statuses: vec![Status::Detached; count],
            forces: DVector::zeros(2 * count),
            margins: vec![0.0; count],
        };
        for group in groups {
            let solution = self.part(&group, None).solve_group()?;
            for (place, &i) in group.iter().enumerate() {
                whole.statuses[i] = solution.statuses[place];
                whole.margins[i] = solution.margins[place];
                whole.forces.rows_mut(2 * i, 2).copy_from(&solution.forces.rows(2 * place, 2));
            }
        }
        Ok(whole)
    }

    /// The contacts in groups: W has no entries between contacts of two of them.
    fn groups(&self) -> Vec<Vec<usize>> {
        let count = self.contacts.len();
        let act = |i: usize, j: usize| self.w.view((2 * i, 2 * j), (2, 2)).amax() > 0.0;
        components(count, |i, found| found.extend((0..count).filter(|&j| act(i, j) || act(j, i))))
    }

    /// If there are more combinations than are enumerated, changes of single statuses propose the statuses, and Gauss-Seidel
    /// iteration where these come to no end. A proposal counts if its linear equations, solved to rounding, satisfy every
    /// inequality. There is no solution only if no method finds one.
    fn solve_group(&self) -> Result<Solution, Unsolved> {
        let count = self.contacts.len();
        let combinations = self.contacts.iter().map(|own| own.choices().len());
        let all = combinations.fold(1, |all: usize, own| all.saturating_mul(own));
        let is_massless = matches!(self.level, Level::Forces | Level::Rates);
        if if is_massless { all <= ENUMERATED_WITHOUT_MASS } else { count <= ENUMERATED } {
            return self.enumerate();
        }
        match self.by_changes().or_else(|| self.gauss_seidel()) {
            Some(solution) => Ok(self.holding(solution)),
            None if count <= EXHAUSTED => self.enumerate(),
            None => Err(Unsolved::NotFound),
        }
    }

    /// The solution in which contacts stick that another solution lets slip though static friction can hold them. Contacts
    /// that others hold stick, too: friction elements on one direction share its force in any way within their limits, and one
    /// of them alone at its limit is no slip.
    pub(super) fn holding(&self, mut solution: Solution) -> Solution {
        let held = |solution: &Solution, i: usize| {
            let contact = &self.contacts[i];
            let begins = contact.case == Case::Resting && contact.static_friction > 0.0;
            if !(begins && solution.statuses[i].is_sliding()) {
                return None;
            }
            let mut statuses = solution.statuses.clone();
            statuses[i] = Status::Sticking;
            let other = self.verified(&statuses).ok();
            other.filter(|other| contact.has_excess() || self.same_motion(other, solution))
        };
        let contacts = 0..self.contacts.len();
        while let Some(other) = contacts.clone().find_map(|i| held(&solution, i)) {
            solution = other;
        }
        solution
    }

    /// The one solution. A contact without mass keeps its status if static friction lets it. With static above kinetic friction a
    /// contact at rest that could stick could also slip under the smaller force. It slips only if static friction cannot hold
    /// it, so a solution is dropped if in another one the same contacts stick, and more of them.
    fn only(&self, mut found: Vec<Solution>) -> Result<Solution, Unsolved> {
        // Number of contacts that keep their status, and of closing contacts that static friction holds.
        let rank = |solution: &Solution| {
            let keeps = |(own, status): &(&Conditions, &Status)| match own.case {
                Case::Slipping { towards, at_bound: false, .. } => **status == towards,
                Case::Beside { before } => own.has_excess() && **status == before,
                _ => false,
            };
            let holds = |(own, status): &(&Conditions, &Status)| {
                own.case == Case::Touching && own.has_excess() && **status == Status::Sticking
            };
            let contacts = || self.contacts.iter().zip(&solution.statuses);
            (contacts().filter(keeps).count(), contacts().filter(holds).count())
        };
        let best = found.iter().map(rank).max();
        found.retain(|solution| Some(rank(solution)) == best);
        let sticks = |solution: &Solution, i: usize| {
            self.contacts[i].has_excess() && solution.statuses[i] == Status::Sticking
        };
        let closed = |solution: &Solution, i: usize| solution.statuses[i].is_closed();
        let gives_way = |one: &Solution, other: &Solution| {
            let mut contacts = 0..one.statuses.len();
            let rests = |i: usize| self.contacts[i].case == Case::Resting;
            contacts.clone().any(|i| rests(i) && sticks(other, i) && !sticks(one, i))
                && contacts.all(|i| {
                    // What static friction carries along may leave a stop.
                    let smooth = self.contacts[i].static_friction == 0.0;
                    (closed(one, i) == closed(other, i) || smooth)
                        && (sticks(other, i) || !sticks(one, i))
                })
        };
        let remains: Vec<usize> = (0..found.len())
            .filter(|&k| !found.iter().any(|other| gives_way(&found[k], other)))
            .collect();
        let (first, others) = match remains[..] {
            [] => return Err(Unsolved::None),
            [k] => return Ok(found.swap_remove(k)),
            [k, ref others @ ..] => (&found[k], others),
        };
        let held =
            |&k: &usize| (0..self.contacts.len()).any(|i| sticks(first, i) != sticks(&found[k], i));
        Err(if others.iter().all(|&k| self.differ_by_balance(first, &found[k])) {
            Unsolved::Split
        } else if others.iter().all(held) {
            Unsolved::Held
        } else {
            Unsolved::Several
        })
    }

    /// Whether the normal forces of two solutions differ, and by such as accelerate no gap.
    fn differ_by_balance(&self, one: &Solution, other: &Solution) -> bool {
        let normal = |i: usize| (one.forces[2 * i + 1], other.forces[2 * i + 1]);
        let count = self.contacts.len();
        let balanced = |i: usize| {
            let terms = (0..count).map(|j| (self.w[(2 * i + 1, 2 * j + 1)], normal(j)));
            let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), (w, (a, b))| {
                (sum + w * (a - b), size + w.abs() * (a.abs() + b.abs()))
            });
            sum.abs() <= CONSISTENT * size
        };
        let largest = one.forces.amax().max(other.forces.amax());
        let differs = |i: usize| (normal(i).0 - normal(i).1).abs() > CONSISTENT * largest;
        (0..count).any(differs) && (0..count).all(balanced)
    }

    pub(super) fn enumerate(&self) -> Result<Solution, Unsolved> {
        let choices: Vec<&[Status]> = self.contacts.iter().map(Conditions::choices).collect();
        let mut found: Vec<Solution> = Vec::new();
        let mut counter = vec![0; choices.len()];
        loop {
            let statuses: Vec<Status> = counter.iter().zip(&choices).map(|(&k, c)| c[k]).collect();
            if let Ok(solution) = self.verified(&statuses)
                && !found.iter().any(|other| self.same_motion(other, &solution))
            {
                found.push(solution);
            }
            let Some(position) = (0..counter.len()).find(|&k| counter[k] + 1 < choices[k].len())
            else {
                return self.only(found);
            };
            counter[..position].fill(0);
            counter[position] += 1;
        }
    }
}
