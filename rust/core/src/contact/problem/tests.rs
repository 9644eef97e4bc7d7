//! Contact problems against enumerations that do not use their code, against each other, and against answers in closed form.

use nalgebra::{DMatrix, DVector};

use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::{ContactProblem, Unsolved};
use crate::contact::problem::one_solution::ENUMERATED;
use crate::contact::settlement::sliding_status;
use crate::error::run::Level;
use crate::scene::status::Status;

fn closed(friction: f64, static_friction: f64, sliding: Option<Status>) -> Conditions {
    let case = sliding.map_or(Case::Resting, Case::Sliding);
    Conditions { case, friction, static_friction, opens: true }
}

fn problem_of(
    contacts: Vec<Conditions>,
    w: DMatrix<f64>,
    a0: impl Into<DVector<f64>>,
    dependent: bool,
) -> ContactProblem {
    ContactProblem { dependent, ..ContactProblem::new(contacts, Level::Accelerations, w, a0) }
}

fn random_problem(contacts: Vec<Conditions>, seed: &[f64]) -> ContactProblem {
    let size = 2 * contacts.len();
    let b = DMatrix::from_fn(size, size, |i, j| seed[(i * size + j) % seed.len()]);
    let w = &b * b.transpose() + DMatrix::identity(size, size);
    let a0 = DVector::from_fn(size, |i, _| seed[(7 * i + 3) % seed.len()] - 0.3);
    problem_of(contacts, w, a0, false)
}

proptest::proptest! {
    /// For small friction W alone decides and the solution is unique: both proposers agree with the enumeration.
    #[test]
    fn proposers_find_the_unique_solution(
        count in 1usize..5,
        seed in proptest::collection::vec(-1.0f64..1.0, 64..80),
    ) {
        let contact = closed(0.02, 0.02, None);
        let problem = random_problem(vec![contact; count], &seed);
        let all = problem.enumerate().expect("unique");
        let iterated = problem.gauss_seidel().expect("a motion");
        // Changes may come to no end.
        let changed = problem.by_changes().unwrap_or_else(|| iterated.clone());
        for proposed in [iterated, changed] {
            proptest::prop_assert!(problem.same_motion(&all, &proposed));
        }
    }
}

/// Knuth's MMIX generator, as in `tests/impulse_problems.py`.
fn below(state: &mut u64, bound: u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
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
        contacts.push(closed(friction, friction, None));
    }
    // Products of whole numbers over 1024: exact in any order.
    let w = &factor * factor.transpose() + DMatrix::identity(size, size);
    problem_of(contacts, w, velocity, false)
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
    let contact = closed(1.0, 1.5, None);
    let mut w = DMatrix::identity(4, 4);
    (w[(0, 2)], w[(2, 0)]) = (0.1, 0.1);
    for (pulls, expected) in [
        ([1.2, 1.2], [Status::Sticking, Status::Sticking]),
        ([1.8, 1.2], [Status::Positive, Status::Sticking]),
    ] {
        let a0 = vec![-pulls[0] - 0.1 * pulls[1], -1.0, -pulls[1] - 0.1 * pulls[0], -1.0];
        let problem = problem_of(vec![contact; 2], w.clone(), a0, false);
        let solution = problem.solve().expect("one motion");
        assert_eq!(solution.statuses, expected);
    }
}

/// Bodies that nothing ties: the second needs the static friction of both of its contacts, and three others slip.
#[test]
fn static_friction_holds_what_it_can_among_many_contacts() {
    let sliding = closed(0.5, 0.5, Some(Status::Positive));
    let contacts =
        vec![sliding, closed(0.2, 0.3, None), sliding, closed(0.8, 0.8, None), sliding, sliding];
    let w = DMatrix::from_fn(12, 12, |i, j| {
        let body = |row: usize| if row == 2 || row == 6 { 1 } else { 2 + row };
        f64::from(u8::from(body(i) == body(j)))
    });
    let a0 = DVector::from_fn(12, |row, _| if row == 2 || row == 6 { -1.05 } else { -1.0 });
    let problem = problem_of(contacts, w, a0, true);
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
            closed(friction, static_friction, None)
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
    let contact = closed(2.0, 2.0, Some(Status::Positive));
    for (load, expected) in [(-1.0, Unsolved::None), (1.0, Unsolved::Several)] {
        let w = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.5]);
        let rod = problem_of(vec![contact], w, vec![0.0, load], false);
        assert_eq!(rod.enumerate().unwrap_err(), expected);
    }
}

/// Two sliders on one dof, of which the second vibrates: a contact cannot hold the dof beside the first, however small the
/// acceleration of its slider is beside the forces.
#[test]
fn sliders_that_part_do_not_both_hold() {
    let pressed = Conditions { opens: false, ..closed(4.0, 4.0, None) };
    let w = DMatrix::from_fn(4, 4, |i, j| f64::from(u8::from(i == j || i % 2 + j % 2 == 0)));
    for carried in [1.0, -1.0] {
        let a0 = vec![-3e9, -1e9, -3e9 + carried, -20.0];
        let mut problem = problem_of(vec![pressed; 2], w.clone(), a0, true);
        assert_eq!(problem.solve().expect("one motion").statuses, [Status::Sticking; 2]);
        problem.carried[2] = [carried, carried.abs()];
        let slips = sliding_status(carried).expect("a slip");
        assert_eq!(problem.solve().expect("one motion").statuses, [Status::Sticking, slips]);
    }
}

/// A contact that closes at 1e-15 m/s beside one at 1 m/s, whose impulse moves the first by the rounding of W.
#[test]
fn a_rate_below_the_rounding_of_others_is_met() {
    let smooth = closed(0.0, 0.0, None);
    let mut w = DMatrix::identity(4, 4);
    (w[(1, 3)], w[(3, 1)]) = (-1e-16, -1e-16);
    let a0 = vec![0.0, -6e-15, 0.0, -1.8];
    let contacts = vec![smooth; 2];
    let solution = problem_of(contacts, w, a0, true).solve();
    assert_eq!(solution.expect("one motion").statuses, [Status::Positive; 2]);
}

/// A mass between two others, which lie on floors: it lifts them by any split of the force that drives it. Friction under
/// one of them feels the split.
#[test]
fn a_split_that_moves_something_is_reported() {
    let smooth = closed(0.0, 0.0, None);
    for friction in [0.0, 0.5] {
        let rubbing = closed(friction, friction, Some(Status::Positive));
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
        let problem = problem_of(contacts, w, a0, true);
        match friction {
            0.0 => assert!(problem.solve().is_ok()),
            _ => assert_eq!(problem.solve().unwrap_err(), Unsolved::Split),
        }
    }
}

/// The forces of touching contacts without mass, of all statuses whose equations, solved in a dense matrix, meet the inequalities by
/// some margin; None if some are too near to a bound to tell.
fn enumerated(problem: &ContactProblem) -> Option<Vec<DVector<f64>>> {
    let count = problem.contacts.len();
    let mut found = Vec::new();
    for choice in 0..4_usize.pow(u32::try_from(count).ok()?) {
        let letter = |i: usize| choice / 4_usize.pow(i as u32) % 4;
        let mut matrix = DMatrix::identity(2 * count, 2 * count);
        let mut rhs = DVector::zeros(2 * count);
        for i in 0..count {
            let held: &[usize] = match letter(i) {
                0 => &[],
                1 => &[0, 1],
                _ => &[1],
            };
            for row in held.iter().map(|k| 2 * i + k) {
                matrix.set_row(row, &problem.w.row(row));
                rhs[row] = -problem.a0[row];
            }
            if letter(i) > 1 {
                let sign = if letter(i) == 2 { 1.0 } else { -1.0 };
                matrix[(2 * i, 2 * i + 1)] = -sign * problem.contacts[i].friction;
            }
        }
        let forces = matrix.lu().solve(&rhs)?;
        let moved = &problem.w * &forces + &problem.a0;
        let least = (0..count).map(|i| {
            let (friction, normal) = (forces[2 * i], forces[2 * i + 1]);
            let limit = problem.contacts[i].static_friction * normal;
            match letter(i) {
                0 => moved[2 * i + 1],
                1 => normal.min(limit - friction.abs()),
                2 => normal.min(-moved[2 * i]),
                _ => normal.min(moved[2 * i]),
            }
        });
        let least = least.fold(f64::INFINITY, f64::min);
        if least.abs() < 1e-6 {
            return None;
        }
        found.extend((least > 0.0).then_some(forces));
    }
    Some(found)
}

proptest::proptest! {
    /// Gaps of contacts without mass that close or open at once: rates of the forces against all statuses.
    #[test]
    fn rates_of_contacts_without_mass_are_those_of_an_enumeration(
        count in 1usize..5,
        friction in 0.05f64..0.9,
        seed in proptest::collection::vec(-1.0f64..1.0, 64..80),
    ) {
        let touching =
            Conditions { case: Case::Touching, ..closed(friction, friction, None) };
        let problem = ContactProblem { level: Level::Rates, ..random_problem(vec![touching; count], &seed) };
        if let Some(expected) = enumerated(&problem) {
            match (problem.solve(), &expected[..]) {
                (Ok(found), [forces]) => {
                    proptest::prop_assert!((found.forces - forces).amax() <= 1e-9 * forces.amax().max(1.0));
                    let changed = problem.by_changes().expect("few contacts");
                    proptest::prop_assert!((changed.forces - forces).amax() <= 1e-9 * forces.amax().max(1.0));
                }
                (found, []) => proptest::prop_assert_eq!(found.unwrap_err(), Unsolved::None),
                (found, _) => proptest::prop_assert_eq!(found.unwrap_err(), Unsolved::Several),
            }
        }
    }
}

/// One contact whose slip and gap nothing couples, `a = a0 + f`: the status of each kind of event, by rates or places.
#[test]
fn one_contact_takes_the_status_of_its_event() {
    use Status::{Detached, Negative, Positive, Sticking};
    let slipping = |at_bound| Case::Slipping { towards: Positive, at_bound, ends: false };
    let ending = Case::Slipping { towards: Positive, at_bound: true, ends: true };
    let beside = |before| Case::Beside { before };
    let jumping = Case::Jumping { towards: Negative };
    let table = [
        // A gap closes, and slip is faster or slower than friction of 0.5 N bears; or it stays open.
        (Case::Touching, [-0.4, -1.0], Sticking),
        (Case::Touching, [-0.7, -1.0], Positive),
        (Case::Touching, [0.7, -1.0], Negative),
        (Case::Touching, [0.7, 1.0], Detached),
        // The same of contacts with mass that come to rest.
        (Case::Resting, [-0.4, -1.0], Sticking),
        (Case::Resting, [0.7, -1.0], Negative),
        (Case::Resting, [0.7, 1.0], Detached),
        // A slip goes on in its direction whatever its acceleration, until its force pulls.
        (Case::Sliding(Negative), [-0.7, -1.0], Negative),
        (Case::Sliding(Negative), [-0.7, 1.0], Detached),
        // A slip against its friction ends where the force that sticking takes grows no further.
        (slipping(true), [-0.7, -1.0], Positive),
        (slipping(true), [-0.4, -1.0], Sticking),
        (slipping(false), [-0.7, -1.0], Positive),
        (ending, [-0.4, -1.0], Sticking),
        // At the end of a jump the place decides.
        (jumping, [0.7, -1.0], Negative),
        (jumping, [0.7, 1.0], Detached),
        (beside(Sticking), [-0.4, -1.0], Sticking),
        (beside(Positive), [0.7, -1.0], Negative),
        (beside(Detached), [0.7, 1.0], Detached),
        (Case::Settled(Sticking), [5.0, 1.0], Sticking),
    ];
    for (case, a0, expected) in table {
        let level = if case == Case::Resting { Level::Accelerations } else { Level::Rates };
        let contact = Conditions { case, ..closed(0.5, 0.5, None) };
        let problem =
            ContactProblem::new(vec![contact], level, DMatrix::identity(2, 2), a0.to_vec());
        let found = problem.solve().map(|solution| solution.statuses);
        assert_eq!(found, Ok(vec![expected]), "{case:?} {a0:?}");
    }
}

/// Seven touching contacts have more statuses than are enumerated: changes of single ones find the same as the enumeration.
#[test]
fn many_contacts_without_mass_are_solved_by_changes() {
    let mut state = 3;
    for _ in 0..3 {
        let seed: Vec<f64> = (0..230).map(|_| below(&mut state, 2047) / 1024.0 - 1.0).collect();
        let touching = Conditions { case: Case::Touching, ..closed(0.2, 0.2, None) };
        let problem =
            ContactProblem { level: Level::Rates, ..random_problem(vec![touching; 7], &seed) };
        let found = problem.solve().expect("a motion");
        let all = problem.enumerate().expect("one motion");
        assert!(problem.same_motion(&found, &all));
    }
}
