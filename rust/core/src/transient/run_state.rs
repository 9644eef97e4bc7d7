//! The state of a run: where the motion is, when, and what has been recorded.

use std::sync::Arc;
use std::time::Instant;

use crate::error::cancel::Cancel;
use crate::error::input::Error;
use crate::scene::model::Scene;
use crate::transient::clock::Clock;
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::model::Trajectory;

/// Limits and options of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Controls<'a> {
    /// Events after which a run stops.
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

    pub(crate) fn validate(&self) -> Result<(), Error> {
        let limits = [
            ("time_limit", self.time_limit.unwrap_or(1.0), self.time_limit != Some(0.0)),
            ("accumulation_tolerance", self.accumulation_tolerance, true),
        ];
        match limits
            .into_iter()
            .find(|&(_, value, positive)| !(value >= 0.0 && value.is_finite() && positive))
        {
            Some((argument, value, _)) => Err(Error::Range {
                argument: argument.into(),
                requirement: "a finite positive time",
                value,
            }),
            None => Ok(()),
        }
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
    /// Contact coordinates and their velocities at `time`.
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub trajectory: Trajectory,
}

impl RunState<'_> {
    /// The part of the run that is over at a time, by its duration or by the events that it may have.
    pub fn part(&self) -> impl Fn(f64) -> f64 + use<> {
        let events = self.trajectory.events.len() as f64;
        let by_events = self.controls.max_events.map_or(0.0, |most| events / most as f64);
        let duration = self.duration;
        move |time| (time / duration).max(by_events)
    }
}
