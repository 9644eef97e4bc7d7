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
//! With `N`, the two parts of `T` and `|a_t|` as unknowns this is a linear complementarity problem
//! (Stewart and Trinkle 1996), solved by Lemke's pivoting. It may have no solution or several
//! (Painleve): up to [`ENUMERATED`] contacts every combination of statuses is tried as well, so that a
//! second solution is seen.

use nalgebra::{DMatrix, DVector};

use crate::contact::coupled::dependent::{Forces, eliminated};
use crate::linalg::dense::refined_solution;
use crate::numerics::lemke::lemke;
use crate::scene::status::Status;

/// Contacts up to which all 4^c combinations are tried.
const ENUMERATED: usize = 5;
/// Contacts up to which all combinations are tried if no other method has found an answer.
const EXHAUSTED: usize = 8;
/// Sweeps of Gauss-Seidel iteration.
const SWEEPS: usize = 500;
/// Violation of an inequality, relative to its terms, that counts as rounding.
const ROUNDING: f64 = 1e-11;
/// Held directions that depend on each other contradict each other if an acceleration, relative to its terms, exceeds this.
const CONSISTENT: f64 = 1e-9;
/// Force, relative to the largest, below which Lemke's method proposes none.
const PIVOTED: f64 = 1e-11;

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
    /// Whether directions depend on each other, so that W may be singular.
    pub dependent: bool,
}

impl ContactProblem {
    /// If there are more contacts than are enumerated, Lemke's method in two units of force (an approach may be 1e-14 of the
    /// slip) and Gauss-Seidel iteration propose the statuses. A proposal counts if its linear equations, solved to rounding,
    /// satisfy every inequality. There is no solution only if no method finds one.
    pub fn solve(&self) -> Result<Solution, Unsolved> {
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
            Some(solution) => Ok(self.at_rest(solution)),
            None if count <= EXHAUSTED => self.enumerate(),
            None => Err(Unsolved::None),
        }
    }

    /// The same motion with the name that enumeration tries first: contacts that others hold stick. Friction elements on one
    /// direction share its force in any way within their limits, and one of them alone at its limit is no slip.
    fn at_rest(&self, solution: Solution) -> Solution {
        if !self.dependent {
            return solution;
        }
        let rests = |i: usize| {
            let (acceleration, size) = self.terms(2 * i, &solution.forces);
            acceleration.abs() <= ROUNDING * size
        };
        let named = self.contacts.iter().zip(&solution.statuses).enumerate();
        let named = named.map(|(i, (contact, &status))| {
            let free = contact.sliding.is_none() && contact.static_friction > 0.0;
            if free && status.is_sliding() && rests(i) { Status::Sticking } else { status }
        });
        let other = self.verified(&named.collect::<Vec<_>>());
        other.filter(|other| self.same_motion(other, &solution)).unwrap_or(solution)
    }

    /// The statuses to which projected Gauss-Seidel iteration settles: contact by contact, the forces that meet the
    /// contact's own conditions while the others' are held (Jean 1999).
    fn gauss_seidel(&self) -> Option<Solution> {
        let count = self.contacts.len();
        let mut forces = DVector::zeros(2 * count);
        let mut statuses = vec![Status::Detached; count];
        let mut tried = Vec::new();
        for _ in 0..SWEEPS {
            for (i, contact) in self.contacts.iter().enumerate() {
                let before = forces.rows(2 * i, 2).into_owned();
                forces.rows_mut(2 * i, 2).fill(0.0);
                let alone = Self {
                    dependent: self.dependent,
                    contacts: vec![*contact],
                    w: self.w.view((2 * i, 2 * i), (2, 2)).into_owned(),
                    a0: self.a0.rows(2 * i, 2) + self.w.rows(2 * i, 2) * &forces,
                };
                let found = choices(contact).iter().find_map(|&status| alone.verified(&[status]));
                // If one contact alone has no answer, the iteration goes on with its present forces.
                let force = found.map_or(before, |solution| {
                    statuses[i] = solution.statuses[0];
                    solution.forces
                });
                forces.rows_mut(2 * i, 2).copy_from(&force);
            }
            if !tried.contains(&statuses) {
                if let Some(solution) = self.verified(&statuses) {
                    return Some(solution);
                }
                tried.push(statuses.clone());
            }
        }
        None
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
        consistent.then_some((forces, found.free))
    }

    /// An acceleration, and the sum of the absolute values of its terms.
    fn terms(&self, row: usize, forces: &DVector<f64>) -> (f64, f64) {
        let start = (self.a0[row], self.a0[row].abs());
        let entries = self.w.row(row);
        entries
            .iter()
            .zip(forces)
            .fold(start, |(sum, size), (w, f)| (sum + w * f, size + (w * f).abs()))
    }

    /// Whether two solutions mean the same motion: statuses at a boundary have two names. Their forces are the same, too,
    /// unless directions depend on each other.
    fn same_motion(&self, one: &Solution, other: &Solution) -> bool {
        let (a, b) = match self.dependent {
            true => (&self.w * &one.forces, &self.w * &other.forces),
            false => (one.forces.clone(), other.forces.clone()),
        };
        let scale = a.amax().max(b.amax()).max(if self.dependent { self.a0.amax() } else { 0.0 });
        (a - b).amax() <= 100.0 * ROUNDING * scale
    }

    /// The solution with these statuses, if they are consistent. Each inequality may fail by the rounding of its own terms,
    /// because those of a normal force are 1e-14 of a slip where contacts close slowly.
    fn verified(&self, statuses: &[Status]) -> Option<Solution> {
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

    /// Statuses from the complementarity problem in the unknowns (N, T^+, T^-, |a_t|), `T = T^+ - T^-`, whose
    /// matrix is copositive for every friction coefficient when no contact slips yet.
    fn lemke_statuses(&self, unit_a: f64) -> Option<Vec<Status>> {
        let Self { contacts, w, a0, .. } = self;
        let count = contacts.len();
        let candidates: Vec<usize> = (0..count)
            .filter(|&i| contacts[i].sliding.is_none() && contacts[i].static_friction > 0.0)
            .collect();
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
                let given = contact.sliding.map_or(0.0, |sigma| sigma * contact.friction);
                matrix[(target, j)] = force * (n + given * t) / unit_w;
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
            match (contacts[i].sliding, candidate) {
                (Some(sign), _) if sign < 0.0 => Status::Negative,
                (Some(_), _) | (None, None) => Status::Positive,
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

/// The statuses that a closed contact may take.
fn choices(contact: &Closed) -> &'static [Status] {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn random_problem(contacts: Vec<Closed>, seed: &[f64]) -> ContactProblem {
        let size = 2 * contacts.len();
        let b = DMatrix::from_fn(size, size, |i, j| seed[(i * size + j) % seed.len()]);
        ContactProblem {
            dependent: false,
            contacts,
            w: &b * b.transpose() + DMatrix::identity(size, size),
            a0: DVector::from_fn(size, |i, _| seed[(7 * i + 3) % seed.len()] - 0.3),
        }
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
        ContactProblem { contacts, w, a0: velocity.into(), dependent: false }
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
            let a0 =
                vec![-pulls[0] - 0.1 * pulls[1], -1.0, -pulls[1] - 0.1 * pulls[0], -1.0].into();
            let problem =
                ContactProblem { contacts: vec![contact; 2], w: w.clone(), a0, dependent: false };
            let solution = problem.solve().expect("one motion");
            assert_eq!(solution.statuses, expected);
        }
    }

    /// Painleve's rod: the sliding contact needs a negative W_nn + sigma mu W_nt. Pressed (a0_n < 0)
    /// there is no solution, drawn apart (a0_n > 0) there are two.
    #[test]
    fn paradox_is_reported() {
        let contact =
            Closed { friction: 2.0, static_friction: 2.0, sliding: Some(1.0), opens: true };
        for (load, expected) in [(-1.0, Unsolved::None), (1.0, Unsolved::Several)] {
            let rod = ContactProblem {
                dependent: false,
                contacts: vec![contact],
                w: DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.5]),
                a0: vec![0.0, load].into(),
            };
            assert_eq!(rod.enumerate().unwrap_err(), expected);
        }
    }

    /// A contact that closes at 1e-15 m/s beside one at 1 m/s, whose impulse moves the first by the rounding of W.
    #[test]
    fn a_rate_below_the_rounding_of_others_is_met() {
        let smooth = Closed { friction: 0.0, static_friction: 0.0, sliding: None, opens: true };
        let mut w = DMatrix::identity(4, 4);
        (w[(1, 3)], w[(3, 1)]) = (-1e-16, -1e-16);
        let a0 = vec![0.0, -6e-15, 0.0, -1.8].into();
        let contacts = vec![smooth; 2];
        let solution = ContactProblem { contacts, w, a0, dependent: true }.solve();
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
            let problem = ContactProblem {
                contacts: vec![smooth, rubbing, smooth, smooth],
                w,
                a0: vec![0.0, -1.0, 0.0, -1.0, 0.0, -1.5, 0.0, -1.5].into(),
                dependent: true,
            };
            match friction {
                0.0 => assert!(problem.solve().is_ok()),
                _ => assert_eq!(problem.solve().unwrap_err(), Unsolved::Split),
            }
        }
    }
}
