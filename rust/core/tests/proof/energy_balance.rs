//! The energy of a motion changes by the works of forces and by what impacts take, whatever events happen in it.

use stickslip_core::contact::EventKind::{
    self, Accumulation, Closing, Impact, Jump, Load, Release, SlipPositive, Velocity,
};
use stickslip_core::energy::works;
use stickslip_core::linalg::DMatrix;
use stickslip_core::scene::{Damping, Loads, Mass, Springs, Steps};
use stickslip_core::{ContactInput, Method, SceneInput, State};

use crate::models::{belt, block, propagators, run, state, two_subsystems};

/// Part of the energy turned over that rounding may leave, for some hundred phases.
const ROUNDING: f64 = 1e-12;

struct Case {
    name: &'static str,
    input: SceneInput,
    /// None: steady sliding with a push.
    start: Option<State>,
    duration: f64,
    kinds: &'static [EventKind],
}

fn falling() -> State {
    state(&[0.0, 0.1], &[0.5, 0.0], "d")
}

fn table() -> Vec<Case> {
    let damped = |input: SceneInput| SceneInput {
        damping: Damping::Proportional { mass: 0.02, stiffness: 0.01 },
        ..input
    };
    let rough = |friction, restitution| {
        let mut input = two_subsystems(friction, 0.05);
        input.impact_friction = true;
        input.contacts.iter_mut().for_each(|contact| contact.restitution = restitution);
        input
    };
    let coupled = SceneInput {
        mass: Mass::Full(DMatrix::from_row_slice(2, 2, &[1.0, 0.2, 0.2, 1.0])),
        impact_friction: true,
        ..block(ContactInput { restitution: 0.3, ..belt() })
    };
    let springs = Springs { normal: Some(200.0), tangential: Some(150.0) };
    let steps =
        Steps { direction: vec![(0, 0.3)], times: vec![4.0, 9.0], values: vec![0.0, 1.0, -1.0] };
    vec![
        Case {
            name: "slip and stick",
            input: damped(block(belt())),
            start: Some(state(&[0.2, 0.0], &[0.1, 0.0], "s")),
            duration: 60.0,
            kinds: &[SlipPositive, Velocity],
        },
        Case {
            name: "bounces to their limit",
            input: damped(block(ContactInput { restitution: 0.5, ..belt() })),
            start: Some(falling()),
            duration: 30.0,
            kinds: &[Impact, Accumulation, Velocity],
        },
        Case {
            name: "release and impact",
            input: two_subsystems(2.2, 0.05),
            start: None,
            duration: 0.6,
            kinds: &[Release, Impact],
        },
        Case {
            name: "friction of impacts",
            input: rough(1.5, 0.4),
            start: None,
            duration: 0.6,
            kinds: &[Release, Impact, Accumulation],
        },
        Case {
            name: "impacts that mass couples to slip",
            input: coupled,
            start: Some(falling()),
            duration: 30.0,
            kinds: &[Impact, Accumulation],
        },
        Case {
            name: "a contact without mass",
            input: damped(block(ContactInput { springs, ..belt() })),
            start: Some(falling()),
            duration: 30.0,
            kinds: &[Closing, Release, Jump],
        },
        Case {
            name: "a load that is switched",
            input: SceneInput {
                loads: Loads { steps: vec![steps], ..Loads::default() },
                ..damped(block(belt()))
            },
            start: Some(state(&[0.2, 0.0], &[0.1, 0.0], "s")),
            duration: 30.0,
            kinds: &[Load, SlipPositive, Velocity],
        },
    ]
}

#[test]
fn the_energy_balance_closes_for_every_kind_of_event() {
    for Case { name, input, start, duration, kinds } in table() {
        let scene = propagators(input);
        let start = start.unwrap_or_else(|| {
            let mut steady = scene.bare().sliding_equilibrium().expect("steady sliding");
            steady.velocity[0] += 1e-3;
            steady
        });
        let motion = run(&scene, &start, duration, Method::Auto);
        assert_eq!(motion.stop_reason.name(), "duration", "{name}");
        for kind in kinds {
            assert!(motion.events.iter().any(|event| event.kind == *kind), "{name}: no {kind:?}");
        }
        let works = works(&motion, 0.0, motion.end).expect("within the motion");
        let of_phases = works.phases.iter().flat_map(|phase| {
            let damping = phase.damping.iter().map(|work| -work);
            phase.contact.iter().copied().chain([phase.external, phase.circulatory]).chain(damping)
        });
        let of_impacts = works
            .impacts
            .iter()
            .flat_map(|impact| [impact.slider, -impact.normal, -impact.friction]);
        let terms: Vec<f64> = of_phases.chain(of_impacts).collect();
        let turnover: f64 = terms.iter().map(|work| work.abs()).sum();
        let missing = works.kinetic + works.elastic - terms.iter().sum::<f64>();
        assert!(
            turnover > 0.0 && missing.abs() <= ROUNDING * turnover,
            "{name}: {missing:e} of {turnover:e} J"
        );
    }
}
