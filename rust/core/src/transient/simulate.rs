//! The event-driven run: parts that nothing couples, each by phases or as a local march, always the one that is furthest
//! behind. A scene that is coupled throughout is one part.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;
use std::time::Instant;

use crate::contact::admissible_start::coordinates_at;
use crate::contact::event_kind::EventKind;
use crate::error::input::Error;
use crate::motion::method::Method;
use crate::motion::method_cost::marches_locally;
use crate::motion::propagators::{Part, Propagators};
use crate::scene::contact_law::Directions;
use crate::scene::model::State;
use crate::scene::status::Combination;
use crate::transient::local::march::March;
use crate::transient::parts::{in_whole, put_together};
use crate::transient::repeated_run::repetition;
use crate::transient::run::Run;
use crate::transient::run_state::{Controls, MOST_EVENTS, RunState};
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::kept_states::KEPT;
use crate::transient::trajectory::model::Trajectory;

/// Steps of parts between two questions whether the run is interrupted.
const STEPS_PER_QUESTION: usize = 64;

/// Runs from `start` at time 0 for `duration` seconds, or until a limit.
pub fn simulate(
    propagators: &Arc<Propagators>,
    start: &State,
    duration: f64,
    method: Method,
    controls: Controls<'_>,
) -> Result<Trajectory, Error> {
    if !(duration > 0.0 && duration.is_finite()) {
        return Err(Error::Range {
            argument: "duration".into(),
            requirement: "a positive finite time",
            value: duration,
        });
    }
    let scene = &propagators.scene;
    let rubs = scene.contacts.iter().any(|law| law.directions == Directions::Both);
    if scene.coordinates.oblique && rubs && !scene.impact_friction {
        return Err(Error::CoupledImpacts);
    }
    controls.validate()?;
    let (q, u) = coordinates_at(scene, start, controls.load_time)?;
    // To a march by wish, uncoupled parts are no special case.
    let parts = if method == Method::Local { &[] } else { propagators.parts() };
    if parts.is_empty() {
        let state = (q, u);
        let statuses = &start.combination;
        let mut run = PartRun::new(propagators, state, statuses, duration, method, controls)?;
        while run.stopped.is_none() {
            run.step();
        }
        return Ok(run.into_motion());
    }
    let kept = controls.kept_numbers.unwrap_or(KEPT) as f64 / scene.size as f64;
    let mut runs = Vec::with_capacity(parts.len());
    for Part { block, propagators } in parts {
        let share = (kept * propagators.scene.size as f64) as usize;
        let controls = Controls { kept_numbers: Some(share), ..controls };
        let state = (block.gather(&q), block.gather(&u));
        let statuses = block.statuses(&start.combination);
        runs.push(PartRun::new(propagators, state, &statuses, duration, method, controls)?);
    }
    let (end, to_stop) = follow(&mut runs, duration, controls);
    let motions: Vec<Trajectory> = runs.into_iter().map(PartRun::into_motion).collect();
    let stopped = parts.iter().zip(&motions).filter(|(_, motion)| motion.end <= end);
    let reason = stopped
        .filter(|(_, motion)| motion.stop_reason != StopReason::Duration)
        .map(|(part, motion)| in_whole(motion.stop_reason.clone(), &part.block))
        .next();
    let enough = |whole: &Trajectory| {
        let time = whole.phases.last().map_or(0.0, |phase| phase.start);
        controls.enough(whole.events.len(), time)
    };
    let is_enough = |whole: &Trajectory| enough(whole).is_some();
    let mut whole = put_together(propagators, motions.into_iter(), end, is_enough);
    whole.stop_reason = reason.or(to_stop).unwrap_or(StopReason::Duration);
    if let Some(reason) = enough(&whole) {
        whole.end = whole.phases[whole.phases.len() - 1].start;
        whole.grazings.retain(|touch| touch.time <= whole.end);
        whole.stop_reason = reason;
    }
    Ok(whole)
}

/// Lets the runs step, always the one that is furthest behind, until all have come to the earliest time at which one of them
/// stops, or have found enough events, or are to stop; returns the time up to which all are known, and why they are to stop.
fn follow(
    runs: &mut [PartRun<'_>],
    duration: f64,
    controls: Controls<'_>,
) -> (f64, Option<StopReason>) {
    let started = Instant::now();
    let (mut end, mut events, mut steps) = (duration, 0, 0);
    let most = controls.max_events.unwrap_or(MOST_EVENTS);
    // Steps after which the events are counted that are in order.
    let mut count_at = 0;
    // First all begin. Times are not negative, so that their bits are ordered as they are.
    let mut queue: BinaryHeap<_> =
        (0..runs.len()).map(|index| Reverse((0, false, index))).collect();
    while let Some(Reverse((_, begun, index))) = queue.pop() {
        let run = &mut runs[index];
        if begun && run.time() >= end {
            continue;
        }
        let before = run.motion().events.len();
        run.step();
        steps += 1;
        events += run.motion().events.len() - before;
        match run.stopped {
            Some(_) => end = end.min(run.motion().end),
            None => queue.push(Reverse((run.time().to_bits(), true, index))),
        }
        if steps < runs.len() {
            continue;
        }
        let asked = steps.is_multiple_of(STEPS_PER_QUESTION);
        let reason = if asked { controls.asked_to_stop(started) } else { None };
        let may_be_enough = steps >= count_at && events >= most;
        if reason.is_none() && !may_be_enough {
            continue;
        }
        let open = runs.iter().filter(|run| run.stopped.is_none());
        let known = open.map(PartRun::time).fold(end, f64::min);
        if reason.is_some() || events_before(runs, known) >= most {
            return (known, reason);
        }
        count_at = steps + runs.len();
    }
    (end, None)
}

/// The number of events before a time up to which all parts are known: later ones are not in order yet, and at that time itself
/// others may follow. A load that is switched is one event of all parts.
fn events_before(runs: &[PartRun<'_>], known: f64) -> usize {
    let of_part = |(index, run): (usize, &PartRun<'_>)| {
        let before = run.motion().events.iter().take_while(|event| event.time < known);
        before.filter(|event| index == 0 || event.kind != EventKind::Load).count()
    };
    runs.iter().enumerate().map(of_part).sum()
}

/// The run of one part in progress.
struct PartRun<'a> {
    propagation: Propagation<'a>,
    stopped: Option<StopReason>,
}

/// How a part is followed, one step after the other.
enum Propagation<'a> {
    /// From event to event.
    Phases(Box<Run<'a>>),
    /// From panel to panel, which its events restart where they reach.
    Panels(Box<March<'a>>),
}

impl<'a> PartRun<'a> {
    fn new(
        propagators: &'a Arc<Propagators>,
        state: (Vec<f64>, Vec<f64>),
        combination: &Combination,
        duration: f64,
        method: Method,
        controls: Controls<'a>,
    ) -> Result<Self, Error> {
        let marches = || marches_locally(&propagators.scene) && propagators.locality().is_ok();
        let propagation = if method == Method::Local || method == Method::Auto && marches() {
            let march = March::new(propagators, state, combination, duration, controls)?;
            Propagation::Panels(Box::new(march))
        } else {
            let mut run = Run::new(propagators, state, combination, duration, method, controls)?;
            run.state.trajectory.repetition = Some(repetition(duration, &controls));
            Propagation::Phases(Box::new(run))
        };
        Ok(Self { propagation, stopped: None })
    }

    fn step(&mut self) {
        self.stopped = match &mut self.propagation {
            Propagation::Phases(run) => run.step(),
            Propagation::Panels(march) => march.step(),
        };
    }

    fn state(&self) -> &RunState<'a> {
        match &self.propagation {
            Propagation::Phases(run) => &run.state,
            Propagation::Panels(march) => &march.state,
        }
    }

    /// The time up to which it is known, s.
    fn time(&self) -> f64 {
        self.state().time.seconds
    }

    fn motion(&self) -> &Trajectory {
        &self.state().trajectory
    }

    /// The motion so far.
    fn into_motion(self) -> Trajectory {
        let time = self.time();
        let mut motion = match self.propagation {
            Propagation::Phases(run) => run.state.trajectory,
            Propagation::Panels(march) => march.into_motion(),
        };
        match self.stopped {
            Some(reason) => motion.stop_reason = reason,
            None => {
                // An event is part of the motion once the phase that it begins is.
                let known =
                    motion.events.partition_point(|event| event.phase < motion.phases.len());
                motion.events.truncate(known);
                motion.accumulations.retain(|limit| limit.event < known);
                motion.grazings.retain(|touch| touch.time <= time);
                motion.end = time;
            }
        }
        motion.counters.phases = motion.phases.len();
        motion
    }
}
