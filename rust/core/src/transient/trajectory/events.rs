//! What a run tells beside its states: events, touches, limits of bounces, its work and its end.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::contact::event_kind::EventKind;
use crate::error::run::RunFailure;

/// One event; the combination is that after everything that happened at the instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// s
    pub time: f64,
    /// Index of the contact; [`crate::contact::NO_CONTACT`] where a load was switched.
    pub contact: usize,
    /// What happened.
    pub kind: EventKind,
    /// Index into `Trajectory::phases` of the phase that begins here.
    pub phase: usize,
}

/// A touch of an event function within rounding: the status was kept, though `alternative` may be true.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grazing {
    /// s
    pub time: f64,
    /// Index of the contact.
    pub contact: usize,
    /// The event that would have happened.
    pub alternative: EventKind,
    /// The event function at the touch, in its own unit (m/s, N or m).
    pub value: f64,
    /// The bound on its error, same unit.
    pub uncertainty: f64,
}

/// The limit of a series of bounces, taken instead of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Accumulation {
    /// Index of its event.
    pub event: usize,
    /// Number of bounces left out whose remaining time is at least one ulp of t; the rest of the geometric series is shorter
    /// than that.
    pub bounces: usize,
    /// Bound of the error of its time, s: the gap's acceleration is taken as constant over the rest.
    pub error: f64,
}

/// Why the computed motion ends where it does.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub enum StopReason {
    /// The duration asked for was reached.
    #[default]
    Duration,
    /// `max_events` events were found.
    MaxEvents,
    /// The wall-clock limit was reached.
    TimeLimit,
    /// A touch that rounding could not decide, with `on_grazing` set to stop there.
    Grazing,
    /// The motion grew beyond the range of numbers.
    Unbounded,
    /// More events at one instant than the contacts can explain.
    Chattering {
        /// Index of that contact.
        contact: usize,
    },
    /// The caller interrupted the run.
    Interrupted,
    /// The motion can't be continued.
    Failed(#[serde(serialize_with = "in_words", deserialize_with = "from_words")] RunFailure),
}

/// A record tells a failure in words.
fn in_words<S: Serializer>(failure: &RunFailure, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(failure)
}

fn from_words<'de, D: Deserializer<'de>>(deserializer: D) -> Result<RunFailure, D::Error> {
    String::deserialize(deserializer).map(RunFailure::Recorded)
}

impl StopReason {
    /// The name of the reason in Python: `max_events`.
    pub const fn name(&self) -> &'static str {
        match self {
            StopReason::Duration => "duration",
            StopReason::MaxEvents => "max_events",
            StopReason::TimeLimit => "time_limit",
            StopReason::Grazing => "grazing",
            StopReason::Unbounded => "unbounded",
            StopReason::Chattering { .. } => "chattering",
            StopReason::Interrupted => "interrupted",
            StopReason::Failed(_) => "failed",
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StopReason::Failed(failure) => failure.fmt(f),
            StopReason::Chattering { contact } => {
                write!(f, "contact {contact} changes status without end at one instant")
            }
            reason => f.write_str(reason.name()),
        }
    }
}

/// Counts of the work of a run. They are exact, so that tests can compare them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Phases of the motion.
    pub phases: usize,
    /// Stretches on which the event functions were expanded.
    pub panels: usize,
    /// Longer stretches passed over at once.
    pub leaps: usize,
    /// Event functions on panels that the envelope could not exclude.
    pub refinements: usize,
    /// Combinations decomposed or set up for this run, not found in the scene's memory.
    pub combinations: usize,
    /// Phases propagated by Taylor series.
    pub taylor_phases: usize,
    /// Coordinates whose series a local march expanded, for panels and for events.
    pub expansions: usize,
}

impl Counters {
    /// Adds the work on a part, but for its phases, which may coincide with those of others.
    pub(crate) fn add(&mut self, part: Self) {
        let Self { phases: _, panels, leaps, refinements, combinations, taylor_phases, expansions } =
            part;
        self.panels += panels;
        self.leaps += leaps;
        self.refinements += refinements;
        self.combinations += combinations;
        self.taylor_phases += taylor_phases;
        self.expansions += expansions;
    }
}
