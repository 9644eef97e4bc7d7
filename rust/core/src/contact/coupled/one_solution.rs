//! The one solution of a contact problem, or why there is none.
//!
//! Up to [`ENUMERATED`] contacts every combination of statuses is tried, so that a second solution is seen.

use nalgebra::DVector;

use crate::contact::coupled::contact_problem::{
    CONSISTENT, ContactProblem, Solution, Unsolved, choices,
};
use crate::linalg::components::components;
use crate::scene::status::Status;

/// Contacts up to which all 4^c combinations are tried.
const ENUMERATED: usize = 5;
/// Contacts up to which all combinations are tried if no other method has found an answer.
const EXHAUSTED: usize = 8;

impl ContactProblem {
    /// The solution of each group of contacts that act on each other, side by side.
    pub fn solve(&self) -> Result<Solution, Unsolved> {
        let count = self.contacts.len();
        let groups = self.groups();
        if groups.len() == 1 {
            return self.solve_group();
        }
        let mut whole =
            Solution { statuses: vec![Status::Detached; count], forces: DVector::zeros(2 * count) };
        for group in groups {
            let rows: Vec<usize> = group.iter().flat_map(|&i| [2 * i, 2 * i + 1]).collect();
            let part = Self {
                contacts: group.iter().map(|&i| self.contacts[i]).collect(),
                w: self.w.select_rows(&rows).select_columns(&rows),
                a0: self.a0.select_rows(&rows),
                carried: rows.iter().map(|&row| self.carried[row]).collect(),
                dependent: self.dependent,
            };
            let solution = part.solve_group()?;
            for (&i, status) in group.iter().zip(solution.statuses) {
                whole.statuses[i] = status;
            }
            for (&row, &force) in rows.iter().zip(&solution.forces) {
                whole.forces[row] = force;
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

    /// If there are more contacts than are enumerated, Lemke's method in two units of force (an approach may be 1e-14 of the
    /// slip) and Gauss-Seidel iteration propose the statuses. A proposal counts if its linear equations, solved to rounding,
    /// satisfy every inequality. There is no solution only if no method finds one.
    fn solve_group(&self) -> Result<Solution, Unsolved> {
        let count = self.contacts.len();
        if count <= ENUMERATED {
            return self.enumerate();
        }
        let largest = |from: usize| self.a0.rows_with_step(from, count, 1).amax();
        let (tangential, normal) = (largest(0), largest(1));
        let lemke = [normal, tangential.max(normal)]
            .into_iter()
            .filter(|&unit| unit > 0.0)
            .find_map(|unit| self.verified(&self.lemke_statuses(unit)?));
        match lemke.or_else(|| self.gauss_seidel()) {
            Some(solution) => Ok(self.holding(solution)),
            None if count <= EXHAUSTED => self.enumerate(),
            None => Err(Unsolved::None),
        }
    }

    /// The solution in which contacts stick that another solution lets slip though static friction can hold them. Contacts
    /// that others hold stick, too: friction elements on one direction share its force in any way within their limits, and one
    /// of them alone at its limit is no slip.
    fn holding(&self, mut solution: Solution) -> Solution {
        let held = |solution: &Solution, i: usize| {
            let contact = &self.contacts[i];
            let begins = contact.sliding.is_none() && contact.static_friction > 0.0;
            if !(begins && solution.statuses[i].is_sliding()) {
                return None;
            }
            let mut statuses = solution.statuses.clone();
            statuses[i] = Status::Sticking;
            let holds = contact.static_friction > contact.friction;
            self.verified(&statuses).filter(|other| holds || self.same_motion(other, solution))
        };
        let contacts = 0..self.contacts.len();
        while let Some(other) = contacts.clone().find_map(|i| held(&solution, i)) {
            solution = other;
        }
        solution
    }

    /// The one solution. With static above kinetic friction a contact at rest that could stick could also slip under the
    /// smaller force. It slips only if static friction cannot hold it, so a solution is dropped if in another one the same
    /// contacts stick, and more of them.
    fn only(&self, mut found: Vec<Solution>) -> Result<Solution, Unsolved> {
        let laws = &self.contacts;
        let sticks = |solution: &Solution, i: usize| {
            laws[i].static_friction > laws[i].friction && solution.statuses[i] == Status::Sticking
        };
        let closed = |solution: &Solution, i: usize| solution.statuses[i].is_closed();
        let gives_way = |one: &Solution, other: &Solution| {
            let mut contacts = 0..one.statuses.len();
            contacts.clone().any(|i| sticks(other, i) && !sticks(one, i))
                && contacts.all(|i| {
                    // What static friction carries along may leave a stop.
                    (closed(one, i) == closed(other, i) || laws[i].static_friction == 0.0)
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
        let held = |&k: &usize| (0..laws.len()).any(|i| sticks(first, i) != sticks(&found[k], i));
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

    fn enumerate(&self) -> Result<Solution, Unsolved> {
        let choices: Vec<&[Status]> = self.contacts.iter().map(choices).collect();
        let mut found: Vec<Solution> = Vec::new();
        let mut counter = vec![0; choices.len()];
        loop {
            let statuses: Vec<Status> = counter.iter().zip(&choices).map(|(&k, c)| c[k]).collect();
            if let Some(solution) = self.verified(&statuses)
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

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::contact::coupled::contact_problem::Closed;
    use crate::contact::settlement::sliding_status;

    fn random_problem(contacts: Vec<Closed>, seed: &[f64]) -> ContactProblem {
        let size = 2 * contacts.len();
        let b = DMatrix::from_fn(size, size, |i, j| seed[(i * size + j) % seed.len()]);
        let w = &b * b.transpose() + DMatrix::identity(size, size);
        let a0 = DVector::from_fn(size, |i, _| seed[(7 * i + 3) % seed.len()] - 0.3);
        ContactProblem::new(contacts, w, a0, false)
    }

    proptest::proptest! {
        /// For small friction W alone decides and the solution is unique: pivoting and enumeration agree.
        #[test]
        fn pivoting_finds_the_unique_solution(
            count in 1usize..5,
            seed in proptest::collection::vec(-1.0f64..1.0, 64..80),
        ) {
            let contact = Closed { friction: 0.02, static_friction: 0.02, sliding: None, opens: true };
            let problem = random_problem(vec![contact; count], &seed);
            let all = problem.enumerate();
            let statuses = problem.lemke_statuses(problem.a0.amax()).expect("no ray for small friction");
            let pivoted = problem.verified(&statuses).expect("consistent");
            proptest::prop_assert!(problem.same_motion(&all.expect("unique"), &pivoted));
        }
    }

    /// Knuth's MMIX generator, as in `tests/impulse_problems.py`.
    fn below(state: &mut u64, bound: u64) -> f64 {
        *state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) % bound) as f64
    }

    fn impulse_problem(count: usize, seed: u64) -> ContactProblem {
        let mut state = seed;
        let size = 2 * count;
        let factor = DMatrix::from_row_iterator(
            size,
            size,
            (0..size * size).map(|_| (below(&mut state, 2047) - 1023.0) / 1024.0),
        );
        let (mut contacts, mut velocity) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let slip = (512.0 + below(&mut state, 1024)) / 1024.0;
            velocity.push(slip * (1.0 - 2.0 * below(&mut state, 2)));
            let approach = (1024.0 + below(&mut state, 1024)) / 1024.0;
            velocity.push(-approach * (-27.0 - below(&mut state, 27)).exp2());
            let friction = below(&mut state, 512) / 1024.0;
            contacts.push(Closed {
                friction,
                static_friction: friction,
                sliding: None,
                opens: true,
            });
        }
        // Products of whole numbers over 1024: exact in any order.
        let w = &factor * factor.transpose() + DMatrix::identity(size, size);
        ContactProblem::new(contacts, w, velocity, false)
    }

    /// Approaches of 1e-8 to 1e-16 beside slips of 1, against all combinations in 50 digits.
    #[test]
    fn slow_approaches_beside_fast_slips() {
        let mut lines = include_str!("../../../../../tests/reference/impulse_problems.txt").lines();
        for (count, problems) in [(2, 4000), (3, 3000), (4, 3000), (6, 100)] {
            for seed in 0..problems {
                let expected = lines.next().expect("a line for each problem");
                let problem = impulse_problem(count, seed);
                let found = problem.solve();
                let place = format!("{count} contacts, seed {seed}: {expected}, {found:?}");
                if expected == "several" {
                    // Beyond those enumerated any one of them will do.
                    assert!(count > ENUMERATED || found.is_err(), "{place}");
                    continue;
                }
                let statuses =
                    crate::scene::status::Combination::parse(expected, count).expect("statuses");
                let exact = problem.forces(statuses.statuses()).expect("regular");
                let error = (found.expect(&place).forces - &exact).amax();
                assert!(error <= 1e-14 * exact.amax(), "{place}");
            }
        }
        assert!(lines.next().is_none());
    }

    /// T = 1.2 is more than kinetic and less than static friction: the contacts stick, though slip under T = 1 would go
    /// the right way. Where static friction can't hold the first, only the second sticks.
    #[test]
    fn static_friction_holds_what_it_can() {
        let contact = Closed { friction: 1.0, static_friction: 1.5, sliding: None, opens: true };
        let mut w = DMatrix::identity(4, 4);
        (w[(0, 2)], w[(2, 0)]) = (0.1, 0.1);
        for (pulls, expected) in [
            ([1.2, 1.2], [Status::Sticking, Status::Sticking]),
            ([1.8, 1.2], [Status::Positive, Status::Sticking]),
        ] {
            let a0 = vec![-pulls[0] - 0.1 * pulls[1], -1.0, -pulls[1] - 0.1 * pulls[0], -1.0];
            let problem = ContactProblem::new(vec![contact; 2], w.clone(), a0, false);
            let solution = problem.solve().expect("one motion");
            assert_eq!(solution.statuses, expected);
        }
    }

    /// Bodies that nothing ties: the second needs the static friction of both of its contacts, and three others slip.
    #[test]
    fn static_friction_holds_what_it_can_among_many_contacts() {
        let law = |friction, static_friction, sliding| Closed {
            friction,
            static_friction,
            sliding,
            opens: true,
        };
        let sliding = law(0.5, 0.5, Some(1.0));
        let contacts =
            vec![sliding, law(0.2, 0.3, None), sliding, law(0.8, 0.8, None), sliding, sliding];
        let w = DMatrix::from_fn(12, 12, |i, j| {
            let body = |row: usize| if row == 2 || row == 6 { 1 } else { 2 + row };
            f64::from(u8::from(body(i) == body(j)))
        });
        let a0 = DVector::from_fn(12, |row, _| if row == 2 || row == 6 { -1.05 } else { -1.0 });
        let problem = ContactProblem::new(contacts, w, a0, true);
        assert_eq!(
            problem.enumerate().expect("one motion").statuses,
            problem.solve().expect("one motion").statuses
        );
        // Also by the methods for many contacts.
        let iterated = problem.holding(problem.gauss_seidel().expect("one motion"));
        assert!(problem.same_motion(&iterated, &problem.enumerate().expect("one motion")));
    }

    /// Six contacts that all act on each other, with static friction of up to 1.6 times the kinetic one.
    #[test]
    fn static_friction_holds_what_it_can_beyond_enumeration() {
        let mut state = 5;
        for draw in 0..100 {
            let seed: Vec<f64> = (0..160).map(|_| below(&mut state, 2047) / 1024.0 - 1.0).collect();
            let contacts = (0..6).map(|_| {
                let friction = 0.1 + below(&mut state, 1024) / 2048.0;
                let static_friction = friction * (1.0 + 0.6 * below(&mut state, 1024) / 1024.0);
                Closed { friction, static_friction, sliding: None, opens: true }
            });
            let problem = random_problem(contacts.collect(), &seed);
            let found = problem.solve().expect("a motion");
            let one = problem.enumerate();
            assert!(one.is_err() || problem.same_motion(&one.expect("a motion"), &found), "{draw}");
        }
    }

    /// Painleve's rod: the sliding contact needs a negative W_nn + sigma mu W_nt. Pressed (a0_n < 0)
    /// there is no solution, drawn apart (a0_n > 0) there are two.
    #[test]
    fn paradox_is_reported() {
        let contact =
            Closed { friction: 2.0, static_friction: 2.0, sliding: Some(1.0), opens: true };
        for (load, expected) in [(-1.0, Unsolved::None), (1.0, Unsolved::Several)] {
            let w = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.5]);
            let rod = ContactProblem::new(vec![contact], w, vec![0.0, load], false);
            assert_eq!(rod.enumerate().unwrap_err(), expected);
        }
    }

    /// Two sliders on one dof, of which the second vibrates: a contact cannot hold the dof beside the first, however small the
    /// acceleration of its slider is beside the forces.
    #[test]
    fn sliders_that_part_do_not_both_hold() {
        let pressed = Closed { friction: 4.0, static_friction: 4.0, sliding: None, opens: false };
        let w = DMatrix::from_fn(4, 4, |i, j| f64::from(u8::from(i == j || i % 2 + j % 2 == 0)));
        for carried in [1.0, -1.0] {
            let a0 = vec![-3e9, -1e9, -3e9 + carried, -20.0];
            let mut problem = ContactProblem::new(vec![pressed; 2], w.clone(), a0, true);
            assert_eq!(problem.solve().expect("one motion").statuses, [Status::Sticking; 2]);
            problem.carried[2] = [carried, carried.abs()];
            let slips = sliding_status(carried).expect("a slip");
            assert_eq!(problem.solve().expect("one motion").statuses, [Status::Sticking, slips]);
        }
    }

    /// A contact that closes at 1e-15 m/s beside one at 1 m/s, whose impulse moves the first by the rounding of W.
    #[test]
    fn a_rate_below_the_rounding_of_others_is_met() {
        let smooth = Closed { friction: 0.0, static_friction: 0.0, sliding: None, opens: true };
        let mut w = DMatrix::identity(4, 4);
        (w[(1, 3)], w[(3, 1)]) = (-1e-16, -1e-16);
        let a0 = vec![0.0, -6e-15, 0.0, -1.8];
        let contacts = vec![smooth; 2];
        let solution = ContactProblem::new(contacts, w, a0, true).solve();
        assert_eq!(solution.expect("one motion").statuses, [Status::Positive; 2]);
    }

    /// A mass between two others, which lie on floors: it lifts them by any split of the force that drives it. Friction under
    /// one of them feels the split.
    #[test]
    fn a_split_that_moves_something_is_reported() {
        let smooth = Closed { friction: 0.0, static_friction: 0.0, sliding: None, opens: true };
        for friction in [0.0, 0.5] {
            let rubbing =
                Closed { friction, static_friction: friction, sliding: Some(1.0), opens: true };
            let normal = [
                [1.0, 0.0, 1.0, 0.0],
                [0.0, 1.0, 0.0, 1.0],
                [1.0, 0.0, 2.0, 1.0],
                [0.0, 1.0, 1.0, 2.0],
            ];
            let w = DMatrix::from_fn(8, 8, |i, j| match (i % 2, j % 2) {
                (1, 1) => normal[i / 2][j / 2],
                _ => f64::from(u8::from(i == j)),
            });
            let a0 = vec![0.0, -1.0, 0.0, -1.0, 0.0, -1.5, 0.0, -1.5];
            let contacts = vec![smooth, rubbing, smooth, smooth];
            let problem = ContactProblem::new(contacts, w, a0, true);
            match friction {
                0.0 => assert!(problem.solve().is_ok()),
                _ => assert_eq!(problem.solve().unwrap_err(), Unsolved::Split),
            }
        }
    }
}
