//! A run that is repeated from one of its kept states, for the states between that and the next.

use crate::contact::event_kind::EventKind;
use crate::contact::settlement::{Departure, Settlement};
use crate::motion::method::Method;
use crate::motion::phase_motion::Motion;
use crate::transient::clock::Clock;
use crate::transient::impact_series::{SEEN, series};
use crate::transient::run::{Run, complete};
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::phase::{PhaseEnd, PhaseSearch};
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::model::{Phase, Repetition, Trajectory};
use crate::transient::trajectory::used_bases::HeldBases;

/// How a run is repeated.
pub(crate) fn repetition(duration: f64, controls: &Controls<'_>) -> Repetition {
    let Controls { accumulation_tolerance, load_time, .. } = *controls;
    Repetition { duration, accumulation_tolerance, load_time, again }
}

/// The states at the starts of some phases of a motion, the first of which is kept: the run is repeated from there.
fn again(trajectory: &Trajectory, run: Repetition, first: usize, count: usize) -> Vec<f64> {
    let Repetition { duration, accumulation_tolerance, load_time, .. } = run;
    let controls = Controls { accumulation_tolerance, load_time, ..Controls::default() };
    let start = trajectory.phase_state(first);
    let (q, u) = start.parts();
    let mut run = Run::new(
        &trajectory.propagators,
        (q.to_vec(), u.to_vec()),
        duration,
        Method::Auto,
        controls,
    );
    let Phase { start, rest, basis } = &trajectory.phases[first];
    let mut held = HeldBases::default();
    let basis = held.get(&trajectory.bases, &trajectory.propagators, *basis);
    run.state.time = Clock { seconds: *start, rest: *rest };
    let switches = trajectory.events.iter().filter(|event| event.kind == EventKind::Load);
    for _ in switches.take_while(|event| event.phase <= first) {
        let RunState { scene, switched, .. } = &mut run.state;
        *switched = scene.next_switch(*switched).unwrap_or(*switched);
    }
    // Earlier impacts decide whether a series over several contacts ends.
    let past = trajectory.events.partition_point(|event| event.phase <= first);
    let seen = past.saturating_sub(SEEN * run.state.scene.contacts.len());
    run.state.trajectory.events.extend_from_slice(&trajectory.events[seen..past]);
    let mut settlement = Settlement {
        statuses: basis.combination.statuses().to_vec(),
        departures: trajectory.states.departures(first).to_vec(),
        events: Vec::new(),
        rest: None,
    };
    let mut motion = Motion::new(run.state.scene, basis, &run.state.q, &run.state.u);
    let mut search = PhaseSearch::default();
    let mut states = [&run.state.q[..], &run.state.u].concat();
    for phase in first + 1..first + count {
        let departing = settlement.departures.iter().any(|&d| d != Departure::None);
        let departures = departing.then_some(&settlement.departures[..]);
        run.state.until = run.next_switch();
        let after = match search.follow(&mut run.state, &mut motion, departures, &|_| usize::MAX) {
            PhaseEnd::Event { after } => Some(after),
            PhaseEnd::Stop(StopReason::Duration) => None,
            _ => unreachable!("what ended by an event does so again"),
        };
        run.advance(after, &mut search);
        let series = series(&run.state, &search);
        let settled = run.settle(&search, &mut settlement, &series);
        debug_assert!(settled.is_ok());
        run.state.trajectory.events.extend(trajectory.events_at(phase).cloned());
        let basis =
            held.get(&trajectory.bases, &trajectory.propagators, trajectory.phases[phase].basis);
        let RunState { scene, q, u, .. } = &mut run.state;
        complete(scene, basis, &mut settlement, q, u);
        motion.restart(basis, q, u);
        states.extend_from_slice(&run.state.q);
        states.extend_from_slice(&run.state.u);
    }
    states
}
