//! A block on a belt whose stick-slip cycle is known in closed form.
//!
//! With `m = k = N = 1`, static friction Fs, kinetic friction Fd and belt speed V the block sticks until its spring
//! pulls with Fs, and slides on the circle of radius `hypot(Fs - Fd, V)` about x = Fd until it is as fast as the belt
//! again, at `x = 2 Fd - Fs`. That takes
//!
//! ```text
//! 2 (Fs - Fd) / V + 2 pi - 2 atan((Fs - Fd) / V)
//! ```
//!
//! Sticking forgets everything but the time: all multipliers across the flow are zero.

use std::f64::consts::TAU;

use stickslip_core::contact::EventKind;
use stickslip_core::cycles::orbits::Stability;
use stickslip_core::linalg::SparseMatrix;
use stickslip_core::scene::{Damping, Mass};
use stickslip_core::{Method, SceneInput, StopReason};

use crate::models::{belt, block, cycle, propagators, run, state};

#[path = "../../examples/block_on_belt.rs"]
mod block_on_belt;

#[test]
fn the_example_of_the_documentation_runs() {
    block_on_belt::main().unwrap();
}

/// `10 + 2 pi - 2 atan(5)`
const PERIOD: f64 = 13.5363837732896;

#[test]
fn period_amplitude_and_multipliers() {
    let closed_form = 10.0 + TAU - 2.0 * 5.0f64.atan();
    assert!((closed_form - PERIOD).abs() < 1e-13);
    let scene = propagators(block(belt()));
    for method in [Method::Modal, Method::Taylor] {
        let cycle = cycle(&scene, &state(&[0.2, 0.0], &[0.1, 0.0], "s"), 60.0, method);
        let orbit = &cycle.orbit;
        // Some roundings of the period.
        assert!((orbit.period - closed_form).abs() <= 16.0 * f64::EPSILON * closed_form);
        let radius = 0.5f64.hypot(0.1);
        assert!((cycle.extremes.maximum[0] - (0.5 + radius)).abs() <= 4.0 * f64::EPSILON);
        assert!((cycle.extremes.minimum[0] - (0.5 - radius)).abs() <= 4.0 * f64::EPSILON);
        let kinds: Vec<EventKind> = orbit.steps.iter().map(|step| step.kind).collect();
        assert!(kinds.contains(&EventKind::SlipPositive) && kinds.contains(&EventKind::Velocity));
        assert_eq!(kinds.len(), 2);
        for step in &orbit.steps {
            let expected = match step.kind {
                EventKind::SlipPositive => 10.0,
                _ => closed_form - 10.0,
            };
            assert!((step.duration - expected).abs() <= 16.0 * f64::EPSILON * closed_form);
        }
        assert_eq!(cycle.stability, Stability::Stable);
        assert_eq!(cycle.multipliers.largest(), 0.0);
        // The state of a sticking phase has one dimension, along the flow: its multiplier is 1.
        let values = &cycle.multipliers.values;
        assert!((values[0] - 1.0).norm() <= 1e-13, "{values:?}");
        assert!(values[1..].iter().all(|value| value.norm() == 0.0), "{values:?}");
    }
}

/// Every slip begins at x = Fs and ends at x = 2 Fd - Fs, a hundred times.
#[test]
fn events_of_a_long_run() {
    let scene = propagators(block(belt()));
    let trajectory = run(&scene, &state(&[0.0, 0.0], &[0.1, 0.0], "s"), 1400.0, Method::Auto);
    assert_eq!(trajectory.stop_reason, StopReason::Duration);
    let period = 10.0 + TAU - 2.0 * 5.0f64.atan();
    // The last slip that begins within the run also ends within it.
    let slips = ((1400.0 - 10.0) / period).ceil() as usize;
    assert_eq!(trajectory.events.len(), 2 * slips);
    for (k, event) in trajectory.events.iter().enumerate() {
        let (kind, phase, position) = match k % 2 {
            0 => (EventKind::SlipPositive, 10.0, 1.0),
            _ => (EventKind::Velocity, period, 0.0),
        };
        let time = phase + (k / 2) as f64 * period;
        assert_eq!(event.kind, kind);
        // Every event adds some roundings of its own phase.
        assert!((event.time - time).abs() <= (k + 1) as f64 * 1e-14, "event {k}");
        let (x, v) = trajectory.event_state(event);
        assert!((x[0] - position).abs() <= 1e-14 && v[0] == 0.1, "event {k}: {x:?}, {v:?}");
    }
}

/// A damped oscillator that nothing couples to the block rests in the cycle: a disturbance of it decays by
/// `e^{lambda T}` over a period, with `lambda^2 + 2 d lambda + k = 0`.
#[test]
fn multipliers_of_a_part_that_rests() {
    let (damping, stiffness) = (0.03, 2.0);
    let input = SceneInput {
        mass: Mass::Lumped(vec![1.0, 1.0, 1.0]),
        stiffness: SparseMatrix::diagonal(&[1.0, 1.0, stiffness]),
        damping: Damping::General(SparseMatrix::diagonal(&[0.0, 0.0, 2.0 * damping])),
        gyroscopic: None,
        circulatory: None,
        force: vec![0.0, -1.0, 0.0],
        ..block(belt())
    };
    let scene = propagators(input);
    let start = state(&[0.2, 0.0, 0.0], &[0.1, 0.0, 0.0], "s");
    let cycle = cycle(&scene, &start, 60.0, Method::Auto);
    let expected = (-damping * PERIOD).exp();
    let angle = (stiffness - damping * damping).sqrt() * PERIOD;
    let transverse = &cycle.multipliers.transverse;
    for multiplier in &transverse[..2] {
        // Roundings of a matrix exponential of modulus one.
        assert!((multiplier.norm() - expected).abs() <= 1e-13, "{transverse:?}");
        assert!((multiplier.re - expected * angle.cos()).abs() <= 1e-13, "{transverse:?}");
    }
    assert!(transverse[2..].iter().all(|multiplier| multiplier.norm() == 0.0), "{transverse:?}");
}
