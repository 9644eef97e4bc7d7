//! Records of motions and orbits: what they keep comes back to the last bit, and what no run leaves behind is refused.

use stickslip_core::contact::EventKind;
use stickslip_core::cycles::attractors::{Search, settle};
use stickslip_core::cycles::orbits::{CycleRecord, OrbitFailure};
use stickslip_core::transient::{Accumulation, Grazing, TrajectoryRecord};
use stickslip_core::{
    Attractor, ContactInput, Cycle, Error, Method, RunFailure, StopReason, Trajectory,
};

use crate::models::{belt, block, propagators, run, state};

/// Bounces that come to rest, then stick and slip.
fn record() -> (std::sync::Arc<stickslip_core::Propagators>, TrajectoryRecord) {
    let scene = propagators(block(ContactInput { restitution: 0.5, ..belt() }));
    let trajectory = run(&scene, &state(&[0.0, 0.1], &[0.5, 0.0], "d"), 60.0, Method::Auto);
    let record = trajectory.record();
    (scene, record)
}

#[test]
fn a_motion_comes_back_to_the_last_bit() {
    let (scene, record) = record();
    assert!(!record.accumulations.is_empty() && record.event_time.len() > 5);
    let again = Trajectory::from_record(&scene, record.clone()).expect("an undamaged record");
    assert_eq!(again.record(), record);
    let original = run(&scene, &state(&[0.0, 0.1], &[0.5, 0.0], "d"), 60.0, Method::Auto);
    let times: Vec<f64> = (0..=600).map(|k| 0.1 * f64::from(k)).collect();
    let (a, b) = (original.sample(&times).expect("times"), again.sample(&times).expect("times"));
    assert_eq!((a.position, a.velocity), (b.position, b.velocity));
    assert_eq!((a.normal_force, a.friction_force), (b.normal_force, b.friction_force));
}

#[test]
fn damaged_motions_are_refused() {
    let (scene, whole) = record();
    type Damage = fn(&mut TrajectoryRecord);
    let touch = Grazing {
        time: 1.0,
        contact: 0,
        alternative: EventKind::Velocity,
        value: 0.0,
        uncertainty: 1e-15,
    };
    let damages: Vec<(&str, Damage)> = vec![
        ("no phase", |r| r.phase_basis.clear()),
        ("a phase without its start", |r| r.phase_start.truncate(r.phase_start.len() - 1)),
        ("a phase without its low part", |r| r.phase_rest.truncate(r.phase_rest.len() - 1)),
        ("a state cut short", |r| r.states.truncate(r.states.len() - 1)),
        ("a state too many", |r| r.states.push(0.0)),
        ("a state that is no number", |r| r.states[3] = f64::NAN),
        ("an infinite state", |r| r.states[0] = f64::INFINITY),
        ("a start that is no number", |r| r.phase_start[1] = f64::NAN),
        ("a low part that is no number", |r| r.phase_rest[1] = f64::NAN),
        ("a first phase that begins later", |r| r.phase_start[0] = 1e-3),
        ("phases out of order", |r| r.phase_start.swap(1, 3)),
        ("phases after the end", |r| r.end = 0.5 * r.phase_start[2]),
        ("an infinite end", |r| r.end = f64::INFINITY),
        ("a basis that is not there", |r| r.phase_basis[1] = 99),
        ("a combination of two contacts", |r| r.bases[0].0 = "dd".into()),
        ("a combination of unknown letters", |r| r.bases[0].0 = "x".into()),
        ("a basis without a method", |r| r.bases[0].1.clear()),
        ("a basis of two blocks", |r| r.bases[0].1.push(Method::Auto)),
        ("an unknown contact", |r| r.event_contact[0] = 1),
        ("an event without a contact", |r| r.event_contact.truncate(r.event_contact.len() - 1)),
        ("an event without a kind", |r| r.event_kind.truncate(r.event_kind.len() - 1)),
        ("an event without a phase", |r| r.event_phase.truncate(r.event_phase.len() - 1)),
        ("an event at the start", |r| r.event_phase[0] = 0),
        ("an event after all phases", |r| *r.event_phase.last_mut().expect("events") = 10_000),
        ("an event between phases", |r| r.event_time[1] += 1e-9),
        ("a limit of no bounces", |r| r.accumulations[0].event = 0),
        ("a limit of an event that is not there", |r| r.accumulations[0].event = 10_000),
        ("a limit with a negative error", |r| r.accumulations[0].error = -1.0),
        ("a limit whose error is no number", |r| r.accumulations[0].error = f64::NAN),
        ("limits out of order", |r| {
            let last = Accumulation { event: usize::MAX, bounces: 1, error: 0.0 };
            r.accumulations.insert(0, last);
        }),
        ("chattering of an unknown contact", |r| {
            r.stop_reason = StopReason::Chattering { contact: 7 };
        }),
    ];
    let refused = |what: &str, record: TrajectoryRecord| {
        let found = Trajectory::from_record(&scene, record);
        let told = matches!(found, Err(Error::Record { .. } | Error::Combination { .. }));
        assert!(told, "{what}: {:?}", found.map(|run| run.end));
    };
    for (what, damage) in damages {
        let mut record = whole.clone();
        damage(&mut record);
        refused(what, record);
    }
    for (what, touch) in [
        ("a touch of an unknown contact", Grazing { contact: 4, ..touch }),
        ("a touch before the start", Grazing { time: -1.0, ..touch }),
        ("a touch after the end", Grazing { time: 1e9, ..touch }),
        ("a touch that is no number", Grazing { value: f64::NAN, ..touch }),
        ("a touch with an infinite bound", Grazing { uncertainty: f64::INFINITY, ..touch }),
    ] {
        refused(what, TrajectoryRecord { grazings: vec![touch], ..whole.clone() });
    }
    // The same touch undamaged is none of these.
    let sound = TrajectoryRecord { grazings: vec![touch], ..whole.clone() };
    assert!(Trajectory::from_record(&scene, sound).is_ok());
}

#[test]
fn damaged_orbits_are_refused() {
    let scene = propagators(block(belt()));
    let search =
        Search { stretch: 60.0, limit: 120.0, method: Method::Auto, cancel: None, deadline: None };
    let start = state(&[0.2, 0.0], &[0.1, 0.0], "s");
    let (found, _) = settle(&scene, &start, search).expect("a well-posed start");
    let Attractor::Cycle(found) = found else { panic!("no cycle") };
    let whole = found.cycle.record();
    let again = Cycle::from_record(&scene, &whole).expect("an undamaged record");
    assert_eq!(again.record(), whole);
    assert_eq!(again.multipliers.values, found.cycle.multipliers.values);
    type Damage = fn(&mut CycleRecord);
    let damages: Vec<(&str, Damage)> = vec![
        ("no phase", |r| {
            r.combinations.clear();
            r.states.clear();
            r.durations.clear();
            r.contacts.clear();
            r.kinds.clear();
            r.series.clear();
        }),
        ("a state cut short", |r| r.states.truncate(r.states.len() - 1)),
        ("a state that is no number", |r| r.states[0] = f64::NAN),
        ("a phase without a duration", |r| r.durations.truncate(r.durations.len() - 1)),
        ("a negative duration", |r| {
            r.durations[0] = -1.0;
            r.period = r.durations.iter().sum();
        }),
        ("a duration that is no number", |r| r.durations[0] = f64::NAN),
        ("a period that is not their sum", |r| r.period += 1e-3),
        ("a period that is no number", |r| r.period = f64::NAN),
        ("no period", |r| {
            r.period = 0.0;
            r.durations.fill(0.0);
        }),
        ("a residual that is no number", |r| r.residual = f64::NAN),
        ("an unknown contact", |r| r.contacts[0] = 1),
        ("a phase without an event", |r| r.kinds.truncate(r.kinds.len() - 1)),
        ("a series of an unknown contact", |r| r.series[0] = vec![3]),
        ("a series that closes alone", |r| r.series[0] = vec![0]),
        ("an event that its status can not have", |r| r.kinds[0] = EventKind::Impact),
        ("an event that ends every motion", |r| {
            let slip_ends = r.kinds.iter().position(|&kind| kind == EventKind::Velocity);
            r.kinds[slip_ends.expect("a phase of slip")] = EventKind::Exhausted;
        }),
        ("an unknown combination", |r| r.combinations[0] = "?".into()),
        ("a combination of two contacts", |r| r.combinations[0] = "ss".into()),
    ];
    for (what, damage) in damages {
        let mut record = whole.clone();
        damage(&mut record);
        let found = Cycle::from_record(&scene, &record);
        let told = matches!(
            found,
            Err(OrbitFailure::Failed(RunFailure::Input(
                Error::Record { .. } | Error::Combination { .. }
            )))
        );
        assert!(told, "{what}: {:?}", found.map(|cycle| cycle.orbit.period));
    }
}
