//! What motions and orbits keep: it comes back to the last bit, also of a motion that keeps every k-th state only, and a record
//! that no run leaves behind is refused.

use std::sync::Arc;

use stickslip_core::contact::EventKind;
use stickslip_core::cycles::orbits::CycleRecord;
use stickslip_core::energy::works;
use stickslip_core::error::LawEnd;
use stickslip_core::linalg::SparseMatrix;
use stickslip_core::scene::Mass;
use stickslip_core::transient::{Accumulation, Event, Grazing, MotionRecord, TrajectoryRecord};
use stickslip_core::{
    Combination, ContactInput, Controls, Cycle, Direction, Error, Method, Propagators, RunFailure,
    SceneInput, State, StopReason, Trajectory, simulate,
};

use crate::models::{belt, block, contact, cycle, propagators, run, state, two_subsystems};

type Recorded = (Arc<Propagators>, TrajectoryRecord);

/// Bounces that come to rest, then stick and slip.
fn bouncing(method: Method) -> Recorded {
    let scene = propagators(block(ContactInput { restitution: 0.5, ..belt() }));
    let trajectory = run(&scene, &state(&[0.0, 0.1], &[0.5, 0.0], "d"), 60.0, method);
    let record = trajectory.record();
    (scene, record)
}

/// Two blocks that nothing couples.
fn parts() -> Recorded {
    let second = ContactInput {
        tangential: Some(Direction::Dof(2)),
        normal: Some(Direction::Dof(3)),
        slider_speed: 0.2,
        ..belt()
    };
    let input = SceneInput {
        mass: Mass::Lumped(vec![1.0; 4]),
        stiffness: SparseMatrix::diagonal(&[1.0, 1.0, 2.0, 1.0]),
        force: vec![0.0, -1.0, 0.0, -1.0],
        contacts: vec![belt(), second],
        ..block(contact(0, 1))
    };
    let scene = propagators(input);
    let start = state(&[0.1, 0.0, 0.2, 0.0], &[0.1, 0.0, 0.2, 0.0], "ss");
    let record = run(&scene, &start, 60.0, Method::Auto).record();
    (scene, record)
}

fn orbit() -> (Arc<Propagators>, Cycle) {
    let scene = propagators(block(belt()));
    let cycle = cycle(&scene, &state(&[0.2, 0.0], &[0.1, 0.0], "s"), 60.0, Method::Auto);
    (scene, cycle)
}

fn combination(letters: &str) -> Combination {
    Combination::parse(letters, letters.len()).expect("letters of statuses")
}

#[test]
fn a_motion_comes_back_to_the_last_bit() {
    for (scene, record) in [bouncing(Method::Auto), bouncing(Method::Local), parts()] {
        let read = TrajectoryRecord::from_bytes(&record.to_bytes()).expect("undamaged bytes");
        assert_eq!(read.to_bytes(), record.to_bytes());
        let again = Trajectory::from_record(&scene, read).expect("an undamaged record");
        assert_eq!(again.record(), record);
    }
    let (scene, record) = bouncing(Method::Auto);
    assert!(!record.whole.accumulations.is_empty() && record.whole.events.len() > 5);
    let again = Trajectory::from_record(&scene, record).expect("an undamaged record");
    let original = run(&scene, &state(&[0.0, 0.1], &[0.5, 0.0], "d"), 60.0, Method::Auto);
    let times: Vec<f64> = (0..=600).map(|k| 0.1 * f64::from(k)).collect();
    let (a, b) = (original.sample(&times).expect("times"), again.sample(&times).expect("times"));
    assert_eq!((a.position, a.velocity), (b.position, b.velocity));
    assert_eq!((a.normal_force, a.friction_force), (b.normal_force, b.friction_force));
}

/// Why a motion ended comes back in its words.
#[test]
fn reasons_come_back_in_their_words() {
    let (scene, whole) = bouncing(Method::Auto);
    let failure = RunFailure::Law { contact: 0, time: 1.0, end: LawEnd::Negative };
    let chattering = StopReason::Chattering { contact: 1 }.to_string();
    assert_eq!(chattering, "contact 1 changes status without end at one instant");
    for reason in [
        StopReason::Failed(failure),
        StopReason::Chattering { contact: 0 },
        StopReason::MaxEvents,
        StopReason::Unbounded,
    ] {
        let words = reason.to_string();
        let mut record = whole.clone();
        record.whole.stop_reason = reason.clone();
        let read = TrajectoryRecord::from_bytes(&record.to_bytes()).expect("undamaged bytes");
        let again = Trajectory::from_record(&scene, read).expect("an undamaged record");
        assert_eq!(
            (again.stop_reason.to_string(), again.stop_reason.name()),
            (words, reason.name())
        );
    }
}

/// The form of records is that of their format. Where this fails, `FORMAT` in `record_format.rs` counts up, and the number here
/// with it.
#[test]
fn the_form_of_records_has_its_format() {
    let event = Event { time: 0.0, contact: 300, kind: EventKind::Exhausted, phase: 2 };
    let motion = TrajectoryRecord {
        whole: MotionRecord {
            bases: vec![(combination("+-sd"), vec![Method::Auto, Method::Local])],
            events: vec![event],
            stop_reason: StopReason::Failed(RunFailure::Recorded("no".into())),
            ..MotionRecord::default()
        },
        parts: Vec::new(),
    };
    let expected = [
        // Kind and format.
        &[6][..],
        b"motion",
        &[1],
        // One basis of four statuses and two methods; no phases, states or local march.
        &[1, 4, 0, 1, 2, 3, 2, 0, 3],
        &[0; 3],
        // One event: time, contact, kind, phase.
        &[1],
        &[0; 8],
        &[0xac, 2, 10, 2],
        // No touches and limits, seven counters, the reason, the end, no parts.
        &[0; 2],
        &[0; 7],
        &[7, 2],
        b"no",
        &[0; 8],
        &[0],
    ];
    let expected = expected.concat();
    assert_eq!(motion.to_bytes(), expected);
}

#[test]
fn damaged_motions_are_refused() {
    let (scene, whole) = bouncing(Method::Auto);
    type Damage = fn(&mut MotionRecord);
    let touch = Grazing {
        time: 1.0,
        contact: 0,
        alternative: EventKind::Velocity,
        value: 0.0,
        uncertainty: 1e-15,
    };
    let damages: Vec<(&str, Damage)> = vec![
        ("no phase", |r| r.phases.clear()),
        ("a phase too few", |r| r.phases.truncate(r.phases.len() - 1)),
        ("a state cut short", |r| r.states.truncate(r.states.len() - 1)),
        ("a state too many", |r| r.states.push(0.0)),
        ("a state that is no number", |r| r.states[3] = f64::NAN),
        ("an infinite state", |r| r.states[0] = f64::INFINITY),
        ("a start that is no number", |r| r.phases[1].start = f64::NAN),
        ("a low part that is no number", |r| r.phases[1].rest = f64::NAN),
        ("a first phase that begins later", |r| r.phases[0].start = 1e-3),
        ("a first phase that begins before", |r| r.phases[0].start = -0.0),
        ("phases out of order", |r| r.phases.swap(1, 3)),
        ("phases after the end", |r| r.end = 0.5 * r.phases[2].start),
        ("an infinite end", |r| r.end = f64::INFINITY),
        ("a basis that is not there", |r| r.phases[1].basis = 99),
        ("a combination of two contacts", |r| r.bases[0].0 = combination("dd")),
        ("a basis without a method", |r| r.bases[0].1.clear()),
        ("a basis of two blocks", |r| r.bases[0].1.push(Method::Auto)),
        ("an unknown contact", |r| r.events[0].contact = 1),
        ("an event at the start", |r| r.events[0].phase = 0),
        ("an event after all phases", |r| r.events.last_mut().expect("events").phase = 10_000),
        ("an event between phases", |r| r.events[1].time += 1e-9),
        ("events out of order", |r| r.events.reverse()),
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
    let refused = |what: &str, motion: MotionRecord| {
        let record = TrajectoryRecord { whole: motion, parts: Vec::new() };
        let found = Trajectory::from_record(&scene, record);
        let told = matches!(found, Err(Error::Record { .. } | Error::Combination { .. }));
        assert!(told, "{what}: {:?}", found.map(|run| run.end));
    };
    for (what, damage) in damages {
        let mut record = whole.whole.clone();
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
        refused(what, MotionRecord { grazings: vec![touch], ..whole.whole.clone() });
    }
    // The same touch undamaged is none of these.
    let sound = MotionRecord { grazings: vec![touch], ..whole.whole };
    let sound = TrajectoryRecord { whole: sound, parts: Vec::new() };
    assert!(Trajectory::from_record(&scene, sound).is_ok());
}

#[test]
fn damaged_parts_are_refused() {
    let (scene, whole) = parts();
    type Damage = fn(&mut TrajectoryRecord);
    let damages: Vec<(&str, Damage)> = vec![
        ("a part too few", |r| r.parts.truncate(1)),
        ("a part too many", |r| r.parts.push(r.parts[0].clone())),
        ("the whole as a part", |r| r.parts[0] = r.whole.clone()),
        ("a part without its first phase", |r| r.parts[0].phases.truncate(1)),
        ("a part that ends too early", |r| r.parts[1].end = 0.5 * r.whole.end),
        ("an end after those of the parts", |r| r.whole.end *= 2.0),
        ("an end that is no number", |r| r.whole.end = f64::NAN),
        ("other phases than those of the parts", |r| r.whole.counters.phases += 1),
        ("chattering of an unknown contact", |r| {
            r.whole.stop_reason = StopReason::Chattering { contact: 2 };
        }),
    ];
    for (what, damage) in damages {
        let mut record = whole.clone();
        damage(&mut record);
        assert!(Trajectory::from_record(&scene, record).is_err(), "{what}");
    }
}

/// Every place of some bytes with other values, and every length.
fn damaged(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> + '_ {
    let changed = (0..bytes.len()).flat_map(move |place| {
        [0, 1, 0x40, 0x7f, 0x80, 0xff, bytes[place] ^ 1].into_iter().map(move |value| {
            let mut damaged = bytes.to_vec();
            damaged[place] = value;
            damaged
        })
    });
    changed.chain((0..bytes.len()).map(|end| bytes[..end].to_vec()))
}

/// Damaged bytes are refused or give a motion, which can be looked at.
#[test]
fn damaged_bytes_do_no_harm() {
    for (scene, record) in [bouncing(Method::Auto), bouncing(Method::Local), parts()] {
        let bytes = record.to_bytes();
        let mut read = 0;
        for damaged in damaged(&bytes) {
            let Ok(record) = TrajectoryRecord::from_bytes(&damaged) else { continue };
            read += 1;
            let Ok(run) = Trajectory::from_record(&scene, record) else { continue };
            if run.end > 1e3 {
                continue;
            }
            let times = [0.0, 0.3 * run.end, run.end];
            run.sample(&times).expect("times within the motion");
            run.record();
        }
        assert!(read > bytes.len(), "{read}");
    }
    let (scene, cycle) = orbit();
    for damaged in damaged(&cycle.record().to_bytes()) {
        let Ok(record) = CycleRecord::from_bytes(&damaged) else { continue };
        let _ = Cycle::from_record(&scene, record);
    }
}

#[test]
fn records_of_another_kind_are_refused() {
    let (_, motion) = bouncing(Method::Auto);
    let (_, cycle) = orbit();
    assert!(CycleRecord::from_bytes(&motion.to_bytes()).is_err());
    assert!(TrajectoryRecord::from_bytes(&cycle.record().to_bytes()).is_err());
}

fn keeping(
    scene: &Arc<Propagators>,
    start: &State,
    method: Method,
    kept: Option<usize>,
) -> Trajectory {
    let controls = Controls { kept_numbers: kept, ..Controls::default() };
    simulate(scene, start, 0.6, method, controls).expect("a run")
}

/// Positions and velocities at many times, as bits.
fn samples(run: &Trajectory, times: impl Iterator<Item = usize>) -> Vec<u64> {
    let times: Vec<f64> = times.map(|k| run.end * k as f64 / 1000.0).collect();
    let sample = run.sample(&times).expect("times within the motion");
    let numbers = sample.position.iter().chain(&sample.velocity).chain(&sample.friction_force);
    numbers.map(|x| x.to_bits()).collect()
}

fn uncounted(run: &Trajectory) -> TrajectoryRecord {
    let mut record = run.record();
    record.whole.counters = Default::default();
    record
}

#[test]
fn states_between_the_kept_ones_come_back_to_the_last_bit() {
    let scene = propagators(two_subsystems(1.5, 0.025));
    let mut start = scene.bare().sliding_equilibrium().expect("steady sliding");
    start.velocity[0] += 1e-3;
    for method in [Method::Auto, Method::Taylor] {
        let all = keeping(&scene, &start, method, None);
        let phases = all.counters.phases;
        // 313 phases of 16 numbers.
        for states in [1, 2, 7, 100] {
            let few = keeping(&scene, &start, method, Some(16 * states));
            assert_eq!(few.counters.phases, phases);
            // At most so many states, and the departures of two contacts.
            assert!(few.kept_bytes() <= states * (16 + 2 * 4) * 8, "{}", few.kept_bytes());
            assert_eq!(uncounted(&few), uncounted(&all));
            // In order and backwards, where stretches are run again in another order.
            assert_eq!(samples(&few, 0..=1000), samples(&all, 0..=1000));
            assert_eq!(samples(&few, (0..=1000).rev()), samples(&all, (0..=1000).rev()));
            let [some, whole] = [&few, &all].map(|run| works(run, 0.1, 0.5).expect("works"));
            assert_eq!((some.kinetic, some.elastic), (whole.kinetic, whole.elastic));
            assert_eq!(format!("{:?}", some.impacts), format!("{:?}", whole.impacts));
            for event in few.events.iter().rev().step_by(5) {
                assert_eq!(few.event_state(event), all.event_state(event));
            }
        }
    }
}
