//! What each event does to status and velocity, as a table of cases.
//!
//! The block of `models` has tangential and normal mass 1 kg; what differs from it is written in each case.

use stickslip_core::contact::EventKind::{
    self, Accumulation, Impact, Release, SlipNegative, SlipPositive, Velocity,
};
use stickslip_core::linalg::{DMatrix, SparseMatrix};
use stickslip_core::{ContactInput, Method, SceneInput};

use crate::models::{belt, block, contact, propagators, run, state};

struct Case {
    name: &'static str,
    law: ContactInput,
    /// Stiffness over (tangential, normal), N/m.
    stiffness: [f64; 4],
    /// On (tangential, normal), N.
    force: [f64; 2],
    impact_friction: bool,
    /// Position, velocity and status at the start.
    start: ([f64; 2], [f64; 2], &'static str),
    /// The first event of this kind is looked at; before it there are only impacts.
    event: EventKind,
    status: &'static str,
    /// (tangential, normal) just after it, from the velocity before it.
    velocity: fn(&ContactInput, [f64; 2]) -> [f64; 2],
}

const UNCHANGED: fn(&ContactInput, [f64; 2]) -> [f64; 2] = |_, before| before;
/// The slip velocity is zero exactly.
const CAUGHT: fn(&ContactInput, [f64; 2]) -> [f64; 2] = |law, before| [law.slider_speed, before[1]];
/// `g'+ = -e g'-`
const BOUNCED: fn(&ContactInput, [f64; 2]) -> [f64; 2] =
    |law, before| [before[0], -law.restitution * before[1]];
const STOPPED: fn(&ContactInput, [f64; 2]) -> [f64; 2] = |_, before| [before[0], 0.0];

fn case(name: &'static str, event: EventKind, status: &'static str) -> Case {
    Case {
        name,
        law: belt(),
        stiffness: [1.0, 0.0, 0.0, 1.0],
        force: [0.0, -1.0],
        impact_friction: false,
        start: ([0.0, 0.0], [0.0, 0.0], "d"),
        event,
        status,
        velocity: UNCHANGED,
    }
}

fn table() -> Vec<Case> {
    // With N = 1 - x a contact opens where x reaches 1.
    let pulled_open = [4.0, -1.0, -1.0, 4.0];
    let rough = |restitution| ContactInput { restitution, ..belt() };
    vec![
        // Slip ends: held by static friction, or reversed where that is too weak.
        Case {
            start: ([0.0, 0.0], [0.3, 0.0], "-"),
            velocity: CAUGHT,
            ..case("a block faster than the belt is caught", Velocity, "s")
        },
        Case {
            start: ([0.1, 0.0], [-0.1, 0.0], "+"),
            velocity: CAUGHT,
            ..case("a block slower than the belt is caught", Velocity, "s")
        },
        Case {
            start: ([3.0, 0.0], [0.3, 0.0], "-"),
            velocity: CAUGHT,
            ..case("a spring of more than static friction pulls it back", Velocity, "+")
        },
        Case {
            start: ([-3.0, 0.0], [-0.3, 0.0], "+"),
            velocity: CAUGHT,
            ..case("and forward", Velocity, "-")
        },
        // Sticking ends at either side of the cone.
        Case {
            start: ([0.9, 0.0], [0.1, 0.0], "s"),
            ..case("the spring reaches static friction", SlipPositive, "+")
        },
        Case {
            law: ContactInput { slider_speed: -0.1, ..belt() },
            start: ([-0.9, 0.0], [-0.1, 0.0], "s"),
            ..case("on a belt that runs the other way", SlipNegative, "-")
        },
        Case {
            law: ContactInput { static_friction: 0.5, ..belt() },
            start: ([0.4, 0.0], [0.1, 0.0], "s"),
            ..case("without a drop of friction", SlipPositive, "+")
        },
        // Contact ends where N vanishes.
        Case {
            law: ContactInput { friction: 0.1, static_friction: 0.1, ..belt() },
            stiffness: pulled_open,
            start: ([0.8, 0.0], [2.0, 0.0], "-"),
            ..case("a sliding contact is pulled open", Release, "d")
        },
        Case {
            law: ContactInput { friction: 5.0, static_friction: 5.0, ..belt() },
            stiffness: pulled_open,
            force: [4.0, -1.0],
            start: ([0.9, 0.0], [0.1, 0.0], "s"),
            ..case("a sticking contact is pulled open: its cone closes with N", Release, "d")
        },
        // Contact begins.
        Case {
            law: rough(0.5),
            start: ([0.0, 0.5], [0.0, -0.3], "d"),
            velocity: BOUNCED,
            ..case("a bounce", Impact, "d")
        },
        Case {
            start: ([0.0, 0.5], [0.0, -0.3], "d"),
            velocity: STOPPED,
            ..case("a plastic impact of a block that is slower than the belt", Impact, "+")
        },
        Case {
            start: ([0.0, 0.5], [1.0, -0.3], "d"),
            velocity: STOPPED,
            ..case("a plastic impact of a block that is faster than the belt", Impact, "-")
        },
        Case {
            force: [0.0, 1.0],
            start: ([0.0, 0.1], [0.0, -2.0], "d"),
            velocity: STOPPED,
            ..case("a plastic impact of a block that its load pulls away", Impact, "d")
        },
        Case {
            law: ContactInput { gap: 0.25, ..belt() },
            start: ([0.0, 0.5], [0.0, -0.3], "d"),
            velocity: STOPPED,
            ..case("a gap of its own", Impact, "+")
        },
        Case {
            law: rough(0.5),
            impact_friction: true,
            start: ([0.0, 0.5], [0.0, -0.3], "d"),
            velocity: |law, before| [law.slider_speed, -law.restitution * before[1]],
            ..case("a bounce whose friction stops the slip", Impact, "d")
        },
        Case {
            law: rough(0.5),
            impact_friction: true,
            start: ([0.0, 0.5], [5.0, -0.3], "d"),
            velocity: |law, before| {
                let impulse = (1.0 + law.restitution) * before[1].abs();
                [before[0] - law.friction * impulse, -law.restitution * before[1]]
            },
            ..case("a bounce whose friction slows the slip", Impact, "d")
        },
        Case {
            impact_friction: true,
            start: ([0.0, 0.5], [0.0, -0.3], "d"),
            velocity: |law, _| [law.slider_speed, 0.0],
            ..case("a plastic impact whose friction stops the slip", Impact, "s")
        },
        // Infinitely many bounces.
        Case {
            law: rough(0.5),
            start: ([0.0, 0.1], [0.0, 0.0], "d"),
            velocity: STOPPED,
            ..case(
                "bounces come to rest while the block is slower than the belt",
                Accumulation,
                "+",
            )
        },
        Case {
            law: ContactInput { slider_speed: 0.0, ..rough(0.5) },
            start: ([0.0, 0.1], [0.0, 0.0], "d"),
            velocity: |_, _| [0.0, 0.0],
            ..case("bounces come to rest on a slider that rests", Accumulation, "s")
        },
    ]
}

#[test]
fn every_event_sets_status_and_velocity() {
    for method in [Method::Modal, Method::Taylor] {
        for case in table() {
            check(&case, method);
        }
    }
}

fn check(case: &Case, method: Method) {
    let Case { name, law, .. } = case;
    let (position, velocity, status) = case.start;
    let scene = propagators(SceneInput {
        stiffness: SparseMatrix::from_dense(&DMatrix::from_row_slice(2, 2, &case.stiffness)),
        gyroscopic: None,
        circulatory: None,
        force: case.force.to_vec(),
        impact_friction: case.impact_friction,
        ..block(law.clone())
    });
    let trajectory = run(&scene, &state(&position, &velocity, status), 8.0, method);
    let found = trajectory.events.iter().find(|event| event.kind == case.event);
    let event = found.unwrap_or_else(|| panic!("{name}: only {:?}", trajectory.events));
    let earlier = trajectory.events.iter().take_while(|earlier| *earlier != event);
    for earlier in earlier {
        assert_eq!(earlier.kind, Impact, "{name}: {:?}", trajectory.events);
    }
    assert_eq!(trajectory.combination(event).to_string(), case.status, "{name}");
    let just_before = trajectory.state(event.time.next_down()).expect("within the run").velocity;
    let (_, after) = trajectory.event_state(event);
    let expected = (case.velocity)(law, [just_before[0], just_before[1]]);
    for (after, expected) in after.iter().zip(expected) {
        // Velocities of order one with accelerations of order one, an ulp of time apart; the limit of bounces leaves
        // out what the last of them would still change.
        assert!((after - expected).abs() <= 1e-13, "{name}: {after} instead of {expected}");
    }
    // What follows is admissible: for a tenth of a second, or up to the next event.
    let next = trajectory.events.iter().map(|next| next.time).find(|&time| time > event.time);
    let until = next.unwrap_or(f64::INFINITY).min(event.time + 0.1).min(trajectory.end);
    let times: Vec<f64> =
        (0..20).map(|k| event.time + (until - event.time) * f64::from(k) / 20.0).collect();
    let sample = trajectory.sample(&times).expect("within the run");
    for k in 0..times.len() {
        let gap = sample.position[2 * k + 1] + law.gap;
        let slip = sample.velocity[2 * k] - law.slider_speed;
        let (normal, friction) = (sample.normal_force[k], sample.friction_force[k]);
        let rounding = 1e-14;
        let admissible = match case.status {
            "d" => gap >= -rounding && normal == 0.0 && friction == 0.0,
            "s" => {
                let limit = law.static_friction * normal;
                gap == 0.0
                    && slip == 0.0
                    && normal >= -rounding
                    && friction.abs() <= limit + rounding
            }
            sliding => {
                let sign = if sliding == "+" { 1.0 } else { -1.0 };
                gap == 0.0
                    && sign * slip <= rounding
                    && normal >= -rounding
                    && (friction - sign * law.friction * normal).abs() <= rounding
            }
        };
        assert!(admissible, "{name}: gap {gap}, slip {slip}, N {normal}, T {friction} at {k}");
    }
}

/// A contact that knows no friction slides on whatever its slip does.
#[test]
fn without_friction_nothing_sticks() {
    let scene = propagators(block(ContactInput { slider_speed: 0.1, ..contact(0, 1) }));
    let trajectory = run(&scene, &state(&[0.0, 0.0], &[0.5, 0.0], "-"), 20.0, Method::Auto);
    assert!(trajectory.events.iter().all(|event| event.kind == Velocity));
    // x = 0.5 sin t
    let end = trajectory.state(20.0).expect("the end");
    assert!((end.position[0] - 0.5 * 20.0f64.sin()).abs() <= 1e-13);
}
