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

use crate::contact::coupled::elimination::Elimination;
use crate::numerics::lemke::lemke;
use crate::scene::status::Status;

/// Contacts up to which all 4^c combinations are tried.
const ENUMERATED: usize = 5;
/// Contacts up to which they are tried where no other method has found an answer.
const EXHAUSTED: usize = 8;
/// Sweeps of Gauss-Seidel iteration.
const SWEEPS: usize = 500;
/// Violation of an inequality, relative to its terms, that counts as rounding.
const ROUNDING: f64 = 1e-11;
/// Force, relative to the largest, below which Lemke's method proposes none.
const PIVOTED: f64 = 1e-11;

/// One closed contact of the problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Closed {
    pub friction: f64,
    pub static_friction: f64,
    /// T / (mu N) where the contact already slips; `None` where slip is zero.
    pub sliding: Option<f64>,
}

/// Statuses and forces (T, N) of each closed contact.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub statuses: Vec<Status>,
    pub forces: Vec<f64>,
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unsolved {
    None,
    Several,
}

/// Solves for the closed contacts; `w` is row-major over (tangential, normal) of each, `a0` likewise.
///
/// More contacts than are enumerated have their statuses proposed by Lemke's method in two units of force, since an
/// approach may be 1e-14 of the slip, and by Gauss-Seidel iteration; a proposal counts once its linear equations,
/// solved to rounding, satisfy every inequality. Only where no method has one is there no solution.
pub(crate) fn solve(contacts: &[Closed], w: &[f64], a0: &[f64]) -> Result<Solution, Unsolved> {
    if contacts.len() <= ENUMERATED {
        return enumerate(contacts, w, a0);
    }
    let largest =
        |from: usize| a0.iter().skip(from).step_by(2).fold(0.0, |s: f64, a| s.max(a.abs()));
    let (tangential, normal) = (largest(0), largest(1));
    let lemke = [normal, tangential.max(normal)]
        .into_iter()
        .filter(|&unit| unit > 0.0)
        .find_map(|unit| verified(contacts, w, a0, &lemke_statuses(contacts, w, a0, unit)?));
    match lemke.or_else(|| gauss_seidel(contacts, w, a0)) {
        Some(solution) => Ok(solution),
        None if contacts.len() <= EXHAUSTED => enumerate(contacts, w, a0),
        None => Err(Unsolved::None),
    }
}

fn verified(contacts: &[Closed], w: &[f64], a0: &[f64], statuses: &[Status]) -> Option<Solution> {
    try_statuses(contacts, w, a0, statuses, &mut Elimination::new(2 * contacts.len()))
}

/// The statuses to which projected Gauss-Seidel iteration settles: contact by contact, the forces that meet the
/// contact's own conditions while the others' are held (Jean 1999).
fn gauss_seidel(contacts: &[Closed], w: &[f64], a0: &[f64]) -> Option<Solution> {
    let size = 2 * contacts.len();
    let mut forces = vec![0.0; size];
    let mut statuses = vec![Status::Detached; contacts.len()];
    let mut tried = Vec::new();
    for _ in 0..SWEEPS {
        for (i, contact) in contacts.iter().enumerate() {
            let (t, n) = (2 * i, 2 * i + 1);
            let others = |row: usize| {
                let terms = (0..size).filter(|k| k / 2 != i).map(|k| w[row * size + k] * forces[k]);
                a0[row] + terms.sum::<f64>()
            };
            let part = |row: usize, column: usize| w[row * size + column];
            let own = [part(t, t), part(t, n), part(n, t), part(n, n)];
            let found = verified_alone(contact, &own, &[others(t), others(n)]);
            // Where one contact alone has no answer, the iteration goes on with what it had.
            if let Some((status, force)) = found {
                statuses[i] = status;
                forces[t..=n].copy_from_slice(&force);
            }
        }
        if !tried.contains(&statuses) {
            if let Some(solution) = verified(contacts, w, a0, &statuses) {
                return Some(solution);
            }
            tried.push(statuses.clone());
        }
    }
    None
}

fn verified_alone(contact: &Closed, w: &[f64; 4], a0: &[f64; 2]) -> Option<(Status, [f64; 2])> {
    let mut elimination = Elimination::new(2);
    choices(contact).iter().find_map(|&status| {
        let one = std::slice::from_ref(contact);
        let solution = try_statuses(one, w, a0, &[status], &mut elimination)?;
        Some((status, [solution.forces[0], solution.forces[1]]))
    })
}

/// Forces of contacts with given statuses, consistent or not; `None` where they have none.
pub(crate) fn forces(
    contacts: &[Closed],
    w: &[f64],
    a0: &[f64],
    statuses: &[Status],
) -> Option<Vec<f64>> {
    let mut elimination = Elimination::new(2 * contacts.len());
    set_equations(&mut elimination, contacts, w, a0, statuses);
    elimination.solve()
}

/// The statuses that a closed contact may take.
fn choices(contact: &Closed) -> &'static [Status] {
    match contact.sliding {
        Some(sign) if sign > 0.0 => &[Status::Positive, Status::Detached],
        Some(_) => &[Status::Negative, Status::Detached],
        None if contact.static_friction == 0.0 => &[Status::Positive, Status::Detached],
        None => &[Status::Sticking, Status::Positive, Status::Negative, Status::Detached],
    }
}

fn enumerate(contacts: &[Closed], w: &[f64], a0: &[f64]) -> Result<Solution, Unsolved> {
    let choices: Vec<&[Status]> = contacts.iter().map(choices).collect();
    let mut elimination = Elimination::new(2 * contacts.len());
    let mut found: Vec<Solution> = Vec::new();
    let mut counter = vec![0; contacts.len()];
    loop {
        let statuses: Vec<Status> = counter.iter().zip(&choices).map(|(&k, c)| c[k]).collect();
        if let Some(solution) = try_statuses(contacts, w, a0, &statuses, &mut elimination)
            && !found.iter().any(|other| same_motion(other, &solution))
        {
            found.push(solution);
        }
        let Some(position) = (0..counter.len()).find(|&k| counter[k] + 1 < choices[k].len()) else {
            return only(contacts, found);
        };
        counter[..position].fill(0);
        counter[position] += 1;
    }
}

/// The one solution. With static above kinetic friction a contact at rest that could stick could also slip under the
/// smaller force: it slips only where static friction can't hold it, so a solution gives way to one in which the same
/// of these contacts stick, and more.
fn only(contacts: &[Closed], mut found: Vec<Solution>) -> Result<Solution, Unsolved> {
    let excess: Vec<bool> = contacts.iter().map(|c| c.static_friction > c.friction).collect();
    let sticks =
        |solution: &Solution, i: usize| excess[i] && solution.statuses[i] == Status::Sticking;
    let closed = |solution: &Solution, i: usize| solution.statuses[i].is_closed();
    let gives_way = |one: &Solution, other: &Solution| {
        let mut contacts = 0..one.statuses.len();
        contacts.clone().any(|i| sticks(other, i) && !sticks(one, i))
            && contacts.all(|i| {
                closed(one, i) == closed(other, i) && (sticks(other, i) || !sticks(one, i))
            })
    };
    let remains: Vec<usize> = (0..found.len())
        .filter(|&k| !found.iter().any(|other| gives_way(&found[k], other)))
        .collect();
    match remains[..] {
        [] => Err(Unsolved::None),
        [k] => Ok(found.swap_remove(k)),
        _ => Err(Unsolved::Several),
    }
}

/// Whether two solutions mean the same forces: statuses at a boundary have two names.
fn same_motion(one: &Solution, other: &Solution) -> bool {
    let scale = one.forces.iter().chain(&other.forces).fold(0.0, |size: f64, x| size.max(x.abs()));
    one.forces.iter().zip(&other.forces).all(|(a, b)| (a - b).abs() <= 100.0 * ROUNDING * scale)
}

/// Forces and accelerations if the contacts had these statuses, when those are consistent. Each inequality is held to
/// the rounding of its own terms: those of a normal force are 1e-14 of a slip where contacts close slowly.
fn try_statuses(
    contacts: &[Closed],
    w: &[f64],
    a0: &[f64],
    statuses: &[Status],
    elimination: &mut Elimination,
) -> Option<Solution> {
    let size = 2 * contacts.len();
    set_equations(elimination, contacts, w, a0, statuses);
    let forces = elimination.solve()?;
    let terms = |k: usize| {
        let row = &w[k * size..(k + 1) * size];
        row.iter()
            .zip(&forces)
            .fold((a0[k], a0[k].abs()), |(sum, size), (w, f)| (sum + w * f, size + (w * f).abs()))
    };
    // A force is rounded as the terms that its row balances.
    let rounding = |k: usize| ROUNDING * terms(k).1 / w[k * size + k];
    let consistent = contacts.iter().zip(statuses).enumerate().all(|(i, (contact, &status))| {
        let (t, n) = (2 * i, 2 * i + 1);
        match status {
            Status::Detached => {
                let (acceleration, terms) = terms(n);
                acceleration >= -ROUNDING * terms
            }
            _ if forces[n] < -rounding(n) => false,
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
    });
    consistent.then(|| Solution { statuses: statuses.to_vec(), forces })
}

/// The equations of contacts with given statuses.
fn set_equations(
    elimination: &mut Elimination,
    contacts: &[Closed],
    w: &[f64],
    a0: &[f64],
    statuses: &[Status],
) {
    // Rows: an acceleration that must vanish, or a force that is given by another.
    let Elimination { size, matrix, rhs, .. } = elimination;
    let size = *size;
    matrix.fill(0.0);
    rhs.fill(0.0);
    for (i, (contact, &status)) in contacts.iter().zip(statuses).enumerate() {
        let (t, n) = (2 * i, 2 * i + 1);
        let mut hold = |row: usize| {
            matrix[row * size..(row + 1) * size].copy_from_slice(&w[row * size..(row + 1) * size]);
            rhs[row] = -a0[row];
        };
        match status {
            Status::Sticking => {
                hold(t);
                hold(n);
            }
            Status::Positive | Status::Negative => {
                hold(n);
                matrix[t * size + t] = 1.0;
                matrix[t * size + n] = -status.friction_sign() * contact.friction;
            }
            Status::Detached => {
                matrix[t * size + t] = 1.0;
                matrix[n * size + n] = 1.0;
            }
        }
    }
}

/// Statuses from the complementarity problem in the unknowns (N, T^+, T^-, |a_t|), `T = T^+ - T^-`, whose
/// matrix is copositive for every friction coefficient when no contact slips yet.
fn lemke_statuses(contacts: &[Closed], w: &[f64], a0: &[f64], unit_a: f64) -> Option<Vec<Status>> {
    let count = contacts.len();
    let width = 2 * count;
    let candidates: Vec<usize> = (0..count)
        .filter(|&i| contacts[i].sliding.is_none() && contacts[i].static_friction > 0.0)
        .collect();
    let blocks = [count, count + candidates.len(), count + 2 * candidates.len()];
    let size = count + 3 * candidates.len();
    let mut matrix = vec![0.0; size * size];
    let mut q = vec![0.0; size];
    // Forces in units of `unit_a` / |W| and a larger a0 in its own unit: the pivoting tolerances are absolute.
    let unit_w = w.iter().fold(f64::MIN_POSITIVE, |size, x| size.max(x.abs()));
    let mut fill = |target: usize, row: usize, sign: f64| {
        let unit = a0[row].abs().max(unit_a);
        let force = sign * unit_a / unit;
        for (j, contact) in contacts.iter().enumerate() {
            let (t, n) = (w[row * width + 2 * j], w[row * width + 2 * j + 1]);
            let given = contact.sliding.map_or(0.0, |sigma| sigma * contact.friction);
            matrix[target * size + j] = force * (n + given * t) / unit_w;
        }
        for (k, &j) in candidates.iter().enumerate() {
            let t = force * w[row * width + 2 * j] / unit_w;
            matrix[target * size + blocks[0] + k] = t;
            matrix[target * size + blocks[1] + k] = -t;
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
        matrix[plus * size + slip] = 1.0;
        matrix[minus * size + slip] = 1.0;
        matrix[slip * size + i] = contacts[i].static_friction;
        matrix[slip * size + plus] = -1.0;
        matrix[slip * size + minus] = -1.0;
    }
    let z = lemke(size, &matrix, &q)?;
    let scale = z[..blocks[2]].iter().fold(0.0, |size: f64, z| size.max(z.abs()));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn random_problem(count: usize, seed: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let size = 2 * count;
        let b = |i: usize, j: usize| seed[(i * size + j) % seed.len()];
        let mut w = vec![0.0; size * size];
        for i in 0..size {
            for j in 0..size {
                w[i * size + j] = (0..size).map(|k| b(i, k) * b(j, k)).sum::<f64>()
                    + if i == j { 1.0 } else { 0.0 };
            }
        }
        (w, (0..size).map(|i| seed[(7 * i + 3) % seed.len()] - 0.3).collect())
    }

    proptest::proptest! {
        /// For small friction W alone decides and the solution is unique: pivoting and enumeration agree.
        #[test]
        fn pivoting_finds_the_unique_solution(
            count in 1usize..5,
            seed in proptest::collection::vec(-1.0f64..1.0, 64..80),
        ) {
            let (w, a0) = random_problem(count, &seed);
            let contacts =
                vec![Closed { friction: 0.02, static_friction: 0.02, sliding: None }; count];
            let all = enumerate(&contacts, &w, &a0);
            let unit = a0.iter().fold(0.0, |size: f64, a| size.max(a.abs()));
            let statuses =
                lemke_statuses(&contacts, &w, &a0, unit).expect("no ray for small friction");
            let pivoted = verified(&contacts, &w, &a0, &statuses).expect("consistent");
            proptest::prop_assert!(same_motion(&all.expect("unique"), &pivoted));
        }
    }

    /// Knuth's MMIX generator, as in `tests/impulse_problems.py`.
    fn below(state: &mut u64, bound: u64) -> f64 {
        *state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) % bound) as f64
    }

    fn impulse_problem(count: usize, seed: u64) -> (Vec<Closed>, Vec<f64>, Vec<f64>) {
        let mut state = seed;
        let size = 2 * count;
        let factor: Vec<f64> =
            (0..size * size).map(|_| (below(&mut state, 2047) - 1023.0) / 1024.0).collect();
        let product = |i: usize, j: usize| -> f64 {
            (0..size).map(|k| factor[i * size + k] * factor[j * size + k]).sum()
        };
        let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let w = (0..size * size)
            .map(|k| product(k / size, k % size) + unit(k / size, k % size))
            .collect();
        let (mut contacts, mut velocity) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let slip = (512.0 + below(&mut state, 1024)) / 1024.0;
            velocity.push(slip * (1.0 - 2.0 * below(&mut state, 2)));
            let approach = (1024.0 + below(&mut state, 1024)) / 1024.0;
            velocity.push(-approach * (-27.0 - below(&mut state, 27)).exp2());
            let friction = below(&mut state, 512) / 1024.0;
            contacts.push(Closed { friction, static_friction: friction, sliding: None });
        }
        (contacts, w, velocity)
    }

    /// Approaches of 1e-8 to 1e-16 beside slips of 1, against all combinations in 50 digits.
    #[test]
    fn slow_approaches_beside_fast_slips() {
        let mut lines = include_str!("../../../../../tests/reference/impulse_problems.txt").lines();
        for (count, problems) in [(2, 4000), (3, 3000), (4, 3000), (6, 100)] {
            for seed in 0..problems {
                let expected = lines.next().expect("a line for each problem");
                let (contacts, w, velocity) = impulse_problem(count, seed);
                let found = solve(&contacts, &w, &velocity);
                let place = format!("{count} contacts, seed {seed}: {expected}, {found:?}");
                if expected == "several" {
                    // Beyond those enumerated any one of them will do.
                    assert!(count > ENUMERATED || found.is_err(), "{place}");
                    continue;
                }
                let statuses =
                    crate::scene::status::Combination::parse(expected, count).expect("statuses");
                let exact = forces(&contacts, &w, &velocity, statuses.statuses()).expect("regular");
                let found = found.expect(&place).forces;
                let scale = exact.iter().fold(0.0, |size: f64, f| size.max(f.abs()));
                let near = found.iter().zip(&exact).all(|(f, e)| (f - e).abs() <= 1e-14 * scale);
                assert!(near, "{place}");
            }
        }
        assert!(lines.next().is_none());
    }

    /// T = 1.2 is more than kinetic and less than static friction: the contacts stick, though slip under T = 1 would go
    /// the right way. Where static friction can't hold the first, only the second sticks.
    #[test]
    fn static_friction_holds_what_it_can() {
        let contact = Closed { friction: 1.0, static_friction: 1.5, sliding: None };
        let w = [
            [1.0, 0.0, 0.1, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.1, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
        .concat();
        for (pulls, expected) in [
            ([1.2, 1.2], [Status::Sticking, Status::Sticking]),
            ([1.8, 1.2], [Status::Positive, Status::Sticking]),
        ] {
            let a0 = [-pulls[0] - 0.1 * pulls[1], -1.0, -pulls[1] - 0.1 * pulls[0], -1.0];
            let solution = solve(&[contact; 2], &w, &a0).expect("one motion");
            assert_eq!(solution.statuses, expected);
        }
    }

    /// Painleve's rod: the sliding contact needs a negative W_nn + sigma mu W_nt. Pressed (a0_n < 0)
    /// there is no solution, drawn apart (a0_n > 0) there are two.
    #[test]
    fn paradox_is_reported() {
        let w = [1.0, -1.0, -1.0, 1.5];
        let contact = Closed { friction: 2.0, static_friction: 2.0, sliding: Some(1.0) };
        assert_eq!(enumerate(&[contact], &w, &[0.0, -1.0]).unwrap_err(), Unsolved::None);
        assert_eq!(enumerate(&[contact], &w, &[0.0, 1.0]).unwrap_err(), Unsolved::Several);
    }
}
