//! The state of a run: where the motion is, when, and what has been recorded.

use std::sync::Arc;
use std::time::Instant;

use crate::error::cancel::Cancel;
use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::transient::clock::Clock;
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::model::Trajectory;

/// Events that a run without `max_events` may have: with their phases and states about 1 GB, so that endless bounces end with
/// the motion so far before memory is full.
pub(crate) const MOST_EVENTS: usize = 10_000_000;

/// Limits and options of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Controls<'a> {
    /// Events after which a run stops. None: ten million, which are a failure.
    pub max_events: Option<usize>,
    /// Wall-clock seconds.
    pub time_limit: Option<f64>,
    /// Rest of a series of bounces, s, below which its limit is taken; at least one ulp of t.
    pub accumulation_tolerance: f64,
    /// Stop at the first touch that rounding can't decide, instead of keeping the status.
    pub stop_at_grazing: bool,
    /// Numbers of states that the motion keeps, 2n per event. States for which there is no room are computed again when they
    /// are asked for. None: 256 MB.
    pub kept_numbers: Option<usize>,
    /// Time of the loads at which the run begins, s.
    pub load_time: f64,
    /// Asked every few dozen panels.
    pub cancel: Option<&'a Cancel>,
}

impl Controls<'_> {
    /// Whether the caller interrupts the run, or its time is over.
    pub(crate) fn asked_to_stop(&self, started: Instant) -> Option<StopReason> {
        if self.cancel.is_some_and(Cancel::is_requested) {
            return Some(StopReason::Interrupted);
        }
        let late = self.time_limit.is_some_and(|limit| started.elapsed().as_secs_f64() > limit);
        late.then_some(StopReason::TimeLimit)
    }

    /// Why the run stops after so many events, the last of them at `time`.
    pub(crate) fn enough(&self, events: usize, time: f64) -> Option<StopReason> {
        match self.max_events {
            Some(most) => (events >= most).then_some(StopReason::MaxEvents),
            None => (events >= MOST_EVENTS)
                .then_some(StopReason::Failed(RunFailure::TooManyEvents { events, time })),
        }
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        let limits = [
            ("time_limit", self.time_limit.unwrap_or(1.0), self.time_limit != Some(0.0)),
            ("accumulation_tolerance", self.accumulation_tolerance, true),
        ];
        let allowed = |value: f64, positive: bool| value >= 0.0 && value.is_finite() && positive;
        let refused = limits.into_iter().find(|&(_, value, positive)| !allowed(value, positive));
        let requirement = "a finite positive time";
        refused.map_or(Ok(()), |(argument, value, _)| {
            Err(Error::Range { argument: argument.into(), requirement, value })
        })
    }
}

/// What a run changes from phase to phase.
pub(crate) struct RunState<'a> {
    pub scene: &'a Arc<Scene>,
    pub controls: Controls<'a>,
    pub started: Instant,
    /// Number of panels when the run last asked whether it is interrupted.
    pub asked: usize,
    pub duration: f64,
    /// The end of the stretch in progress: the duration, or the next time at which a load is switched.
    pub until: f64,
    /// The time of the loads up to which they have been switched, s.
    pub switched: f64,
    pub time: Clock,
    /// Number of events since time last moved on.
    at_this_instant: usize,
    /// Contact coordinates and their velocities at `time`.
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub trajectory: Trajectory,
}

impl<'a> RunState<'a> {
    /// At time 0, before the first phase.
    pub fn new(
        propagators: &'a Arc<Propagators>,
        (q, u): (Vec<f64>, Vec<f64>),
        duration: f64,
        controls: Controls<'a>,
    ) -> Self {
        Self {
            scene: &propagators.scene,
            controls,
            started: Instant::now(),
            asked: 0,
            duration,
            until: duration,
            switched: controls.load_time,
            time: Clock::default(),
            at_this_instant: 0,
            q,
            u,
            trajectory: Trajectory::new(propagators),
        }
    }

    /// Why the run stops after the event at `time`: it has enough of them, or there is no memory for another one.
    pub fn enough(&mut self, time: f64) -> Option<StopReason> {
        let events = self.trajectory.events.len();
        self.controls.enough(events, time).or_else(|| {
            let failure = StopReason::Failed(RunFailure::Memory { events, time });
            (!self.trajectory.has_room()).then_some(failure)
        })
    }

    /// The end of the stretch that begins now.
    pub fn next_switch(&self) -> f64 {
        let next = self.scene.next_switch(self.switched);
        next.map_or(self.duration, |next| self.duration.min(next - self.controls.load_time))
    }

    /// Moves the clock on to the event that ends a phase; without one, to the end of the stretch, where a load is switched.
    pub fn advance(&mut self, after: Option<f64>) {
        if let Some(after) = after {
            self.time = self.time.after(after);
            return;
        }
        self.time = Clock { seconds: self.until, rest: 0.0 };
        if let (Some(drive), Some(next)) =
            (&self.scene.drive, self.scene.next_switch(self.switched))
        {
            self.switched = next;
            drive.switch(next, &mut self.q);
        }
    }

    /// Counts the events of one instant; true if they are more than contacts explain, so that the event rule goes in circles.
    pub fn goes_in_circles(&mut self, moves_on: bool) -> bool {
        self.at_this_instant = if moves_on { 0 } else { self.at_this_instant + 1 };
        self.at_this_instant > 0 && self.at_this_instant > explained_events(self.scene)
    }

    /// The part of the run that is over at a time, by its duration or by the events that it may have.
    pub fn part(&self) -> impl Fn(f64) -> f64 + use<> {
        let events = self.trajectory.events.len() as f64;
        let by_events = self.controls.max_events.map_or(0.0, |most| events / most as f64);
        let duration = self.duration;
        move |time| (time / duration).max(by_events)
    }
}

/// Number of events at one instant that contacts explain: each can pass each status once, and bounces `ln 2 / -ln e` times
/// while the rest of its series shrinks from two ulp of the clock to one, which ends it.
fn explained_events(scene: &Scene) -> usize {
    let restitutions = scene.contacts.iter().map(|law| law.restitution);
    let bounces =
        restitutions.filter(|&e| e < 1.0).map(|e| (0.5_f64.ln() / e.ln()).ceil() as usize);
    bounces.fold(4 * scene.contacts.len() + 4, usize::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_without_a_limit_end_as_a_failure_before_memory_is_full() {
        let stated = Controls { max_events: Some(2 * MOST_EVENTS), ..Controls::default() };
        assert_eq!(stated.enough(MOST_EVENTS, 1.0), None);
        assert_eq!(stated.enough(2 * MOST_EVENTS, 1.0), Some(StopReason::MaxEvents));
        let silent = Controls::default();
        assert_eq!(silent.enough(MOST_EVENTS - 1, 1.0), None);
        let failure = RunFailure::TooManyEvents { events: MOST_EVENTS, time: 1.0 };
        assert_eq!(silent.enough(MOST_EVENTS, 1.0), Some(StopReason::Failed(failure)));
    }
}
