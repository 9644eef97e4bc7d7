//! The derivative of the flow over a period, with the saltation of every event in it, against differences of runs.
//!
//! The section lies just after an event, where a disturbance to one side would have come before the event. Runs are
//! therefore disturbed a quarter of the first phase later. There the derivative over a period is `Phi M Phi^-1` with
//! the derivative M at the section and Phi that of the quarter, which any quarter of the phase has.

use std::sync::Arc;

use stickslip_core::contact::EventKind;
use stickslip_core::linalg::{DMatrix, SparseMatrix};
use stickslip_core::scene::{Damping, Mass};
use stickslip_core::{Cycle, Method, Propagators, SceneInput, State, Trajectory};

use crate::models::{belt, block, cycle, propagators, run, state, two_subsystems};

/// Motions of a scene from disturbed states, in the units of an orbit.
struct Differences<'a> {
    propagators: &'a Arc<Propagators>,
    orbit: &'a Trajectory,
    units: Vec<f64>,
}

impl Differences<'_> {
    /// What a disturbance at time `at` of the orbit has become after `duration`, by central differences of fourth order.
    fn carried(&self, at: f64, duration: f64, disturbance: &[f64]) -> Vec<f64> {
        const STEP: f64 = 2e-6;
        let from = self.orbit.state(at).expect("within the period");
        let n = from.position.len();
        let end = |steps: f64| {
            let mut start = from.clone();
            let shift = |k: usize| steps * STEP * self.units[k] * disturbance[k];
            (0..n).for_each(|k| start.position[k] += shift(k));
            (0..n).for_each(|k| start.velocity[k] += shift(n + k));
            let end = run(self.propagators, &start, duration, Method::Auto)
                .state(duration)
                .expect("the end");
            [end.position, end.velocity].concat()
        };
        let [far_below, below, above, far_above] = [-2.0, -1.0, 1.0, 2.0].map(end);
        (0..2 * n)
            .map(|k| 8.0 * (above[k] - below[k]) - (far_above[k] - far_below[k]))
            .zip(&self.units)
            .map(|(sum, unit)| sum / (12.0 * STEP * unit))
            .collect()
    }
}

/// Rounding of runs over the step, with what the motion makes of it; the fourth power of the step is less.
const TOLERANCE: f64 = 1e-8;

fn check(propagators: &Arc<Propagators>, cycle: &Cycle, kinds: &[EventKind]) {
    let orbit = &cycle.orbit;
    for kind in kinds {
        assert!(orbit.steps.iter().any(|step| step.kind == *kind), "no {kind:?}");
    }
    let one = orbit.trajectory().expect("one period");
    let n = one.dofs();
    let range = |k: usize| {
        let times: Vec<f64> = (0..200).map(|i| orbit.period * f64::from(i) / 200.0).collect();
        let sample = one.sample(&times).expect("within the period");
        let values = if k < n { &sample.position } else { &sample.velocity };
        let of = values.iter().skip(k % n).step_by(n);
        of.clone().fold(0.0, |high: f64, x| high.max(*x))
            - of.fold(f64::INFINITY, |low: f64, x| low.min(*x))
    };
    let length = (0..n).map(range).fold(0.0, f64::max);
    let speed = (n..2 * n).map(range).fold(0.0, f64::max);
    let units: Vec<f64> = (0..2 * n).map(|k| if k < n { length } else { speed }).collect();
    let monodromy = orbit.monodromy().expect("a derivative");
    let entry = |row: usize, column: usize| monodromy[(row, column)] * units[column] / units[row];
    let columns: Vec<usize> =
        (0..2 * n).filter(|&j| (0..2 * n).any(|row| entry(row, j) != 0.0)).collect();
    assert!(!columns.is_empty());
    let differences = Differences { propagators, orbit: &one, units: units.clone() };
    let quarter = 0.25 * orbit.steps[0].duration;
    for column in columns {
        let mut unit = vec![0.0; 2 * n];
        unit[column] = 1.0;
        let image: Vec<f64> = (0..2 * n).map(|row| entry(row, column)).collect();
        let by_derivative = differences.carried(quarter, quarter, &image);
        let at_quarter = differences.carried(quarter, quarter, &unit);
        let by_runs = differences.carried(quarter, orbit.period, &at_quarter);
        for (row, (a, b)) in by_runs.iter().zip(&by_derivative).enumerate() {
            assert!(
                (a - b).abs() <= TOLERANCE,
                "entry {row} of column {column}: {a} by runs, {b} by the derivative"
            );
        }
    }
}

/// Steady sliding with a push on the first mass.
fn pushed(scene: &Arc<Propagators>) -> State {
    let mut start = scene.bare().sliding_equilibrium().expect("steady sliding");
    start.velocity[0] += 1e-3;
    start
}

#[test]
fn slip_and_stick_of_a_block_that_is_tied_to_another() {
    let stiffness = [1.0, 0.1, -0.3, 0.1, 1.0, 0.2, -0.3, 0.2, 2.0];
    let scene = propagators(SceneInput {
        mass: Mass::Lumped(vec![1.0, 1.0, 1.0]),
        stiffness: SparseMatrix::from_dense(&DMatrix::from_row_slice(3, 3, &stiffness)),
        damping: Damping::Proportional { mass: 0.02, stiffness: 0.01 },
        gyroscopic: None,
        circulatory: None,
        force: vec![0.0, -1.0, 0.0],
        ..block(belt())
    });
    let found = cycle(&scene, &state(&[0.2, 0.0, 0.0], &[0.1, 0.0, 0.0], "s"), 60.0, Method::Auto);
    check(&scene, &found, &[EventKind::SlipPositive, EventKind::Velocity]);
}

#[test]
fn the_published_model() {
    let scene = propagators(two_subsystems(1.5, 0.025));
    let found = cycle(&scene, &pushed(&scene), 0.6, Method::Auto);
    check(&scene, &found, &[EventKind::SlipPositive, EventKind::Velocity]);
}

#[test]
fn release_and_impact() {
    let scene = propagators(two_subsystems(2.2, 0.05));
    let found = cycle(&scene, &pushed(&scene), 0.6, Method::Auto);
    check(&scene, &found, &[EventKind::Release, EventKind::Impact]);
}

#[test]
fn bounces_and_friction_of_impacts() {
    use EventKind::{Accumulation, Impact, Release, Velocity};
    for (friction, restitution, impact_friction, kinds) in [
        (2.2, 0.4, false, &[Release, Impact, Accumulation][..]),
        (1.5, 0.4, true, &[Release, Impact, Accumulation, Velocity]),
        (1.8, 0.0, true, &[Release, Impact, Velocity]),
    ] {
        let mut input = two_subsystems(friction, 0.05);
        input.impact_friction = impact_friction;
        input.contacts.iter_mut().for_each(|law| law.restitution = restitution);
        let scene = propagators(input);
        let found = cycle(&scene, &pushed(&scene), 0.6, Method::Auto);
        check(&scene, &found, kinds);
    }
}
