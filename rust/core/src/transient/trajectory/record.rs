//! Motions as plain numbers, from which, with the scene, they are restored to the last bit.
//!
//! Bases follow from the scene and are computed again.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::error::input::{Error, refused};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::Combination;
use crate::transient::local::motion::LocalMotion;
use crate::transient::local::record::LocalRecord;
use crate::transient::parts::put_together;
use crate::transient::trajectory::events::{Accumulation, Counters, Event, Grazing, StopReason};
use crate::transient::trajectory::kept_states::KeptStates;
use crate::transient::trajectory::model::{Phase, Trajectory};
use crate::transient::trajectory::record_format::{decoded, encoded};
use crate::transient::trajectory::used_bases::UsedBasis;

/// A [`Trajectory`] without its scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryRecord {
    /// The motion of the whole; of a scene in parts, what these do not give.
    pub whole: MotionRecord,
    /// Of a scene in parts: the motions of these.
    pub parts: Vec<MotionRecord>,
}

/// The motion of a scene, or of a part of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MotionRecord {
    /// The different combinations, and by what each is propagated, for each block of the scene.
    pub bases: Vec<(Combination, Vec<Method>)>,
    /// Start and basis of every phase.
    pub phases: Vec<Phase>,
    /// (q, q') at the start of each phase, contact coordinates, 2n per phase.
    pub states: Vec<f64>,
    /// Of a local march, instead of bases, phases and their states.
    pub local: Option<LocalRecord>,
    /// All events, in order of time.
    pub events: Vec<Event>,
    /// Touches that rounding could not decide.
    pub grazings: Vec<Grazing>,
    /// Limits of series of bounces.
    pub accumulations: Vec<Accumulation>,
    /// How much work the run took.
    pub counters: Counters,
    /// Why the motion ends at `end`.
    pub stop_reason: StopReason,
    /// End of the motion, s.
    pub end: f64,
}

impl TrajectoryRecord {
    /// What [`TrajectoryRecord::from_bytes`] takes.
    pub fn to_bytes(&self) -> Vec<u8> {
        encoded("motion", self)
    }

    /// The record in some bytes; [`Trajectory::from_record`] says whether a motion has it.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        decoded("motion", bytes)
    }
}

impl MotionRecord {
    /// Refuses a record that no motion of the scene can have.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let contacts = scene.contacts.len();
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let (Some(first), Some(last)) = (self.phases.first(), self.phases.last()) else {
            return Err(refused("a motion without phases"));
        };
        // Without negative zeros the bits of times are ordered as these are.
        let known = |phase: &Phase| phase.start.is_sign_positive() && phase.rest.is_finite();
        let ordered = self.phases.is_sorted_by(|a, b| a.start <= b.start);
        let begins = first.start == 0.0 && self.phases.iter().all(known);
        let ends = last.start <= self.end && self.end.is_finite();
        if !(begins && ordered && ends && finite(&self.states)) {
            return Err(refused("phases that do not fit each other"));
        }
        // The first phase begins with the motion, every other one with its events.
        let fits = |event: &Event| {
            (event.contact < contacts
                || (event.contact, event.kind) == (NO_CONTACT, EventKind::Load))
                && event.phase > 0
                && self.phases.get(event.phase).is_some_and(|phase| phase.start == event.time)
        };
        if !(self.events.iter().all(fits) && self.events.is_sorted_by_key(|event| event.phase)) {
            return Err(refused("events that do not fit the phases or the scene"));
        }
        let fits = |limit: &Accumulation| {
            let event = self.events.get(limit.event);
            event.is_some_and(|event| event.kind == EventKind::Accumulation) && limit.error >= 0.0
        };
        let limits = &self.accumulations;
        if !(limits.iter().all(fits) && limits.is_sorted_by_key(|limit| limit.event)) {
            return Err(refused("limits of bounces that do not fit the events"));
        }
        let fits = |touch: &Grazing| {
            touch.contact < contacts
                && (0.0..=self.end).contains(&touch.time)
                && finite(&[touch.value, touch.uncertainty])
        };
        if !self.grazings.iter().all(fits) {
            return Err(refused("touches that do not fit the motion or the scene"));
        }
        self.stop_reason.check(contacts)
    }
}

impl StopReason {
    fn check(&self, contacts: usize) -> Result<(), Error> {
        match self {
            Self::Chattering { contact } if *contact >= contacts => {
                Err(refused("chattering of an unknown contact"))
            }
            _ => Ok(()),
        }
    }
}

impl Trajectory {
    /// What [`Trajectory::from_record`] takes.
    pub fn record(&self) -> TrajectoryRecord {
        let parts = self.parts.iter().map(|part| part.motion.recorded()).collect();
        TrajectoryRecord { whole: self.recorded(), parts }
    }

    fn recorded(&self) -> MotionRecord {
        let Self { counters, end, .. } = *self;
        let ending = MotionRecord {
            counters,
            end,
            stop_reason: self.stop_reason.clone(),
            ..Default::default()
        };
        if !self.parts.is_empty() {
            return ending;
        }
        let told = MotionRecord {
            events: self.events.clone(),
            grazings: self.grazings.clone(),
            accumulations: self.accumulations.clone(),
            ..ending
        };
        if let Some(motion) = &self.local {
            return MotionRecord { local: Some(motion.record()), ..told };
        }
        let bases = self.bases.iter();
        MotionRecord {
            bases: bases.map(|basis| (basis.combination.clone(), basis.methods.clone())).collect(),
            phases: self.phases.clone(),
            states: (0..self.phases.len()).flat_map(|k| self.phase_state(k).to_vec()).collect(),
            ..told
        }
    }

    /// The motion that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Arc<Propagators>,
        record: TrajectoryRecord,
    ) -> Result<Self, Error> {
        let TrajectoryRecord { whole, parts } = record;
        if parts.is_empty() {
            return Self::restored(propagators, whole);
        }
        let MotionRecord { counters, stop_reason, end, .. } = whole;
        let known = propagators.parts();
        if parts.len() != known.len()
            || !(end >= 0.0)
            || parts.iter().any(|part| !(part.end >= end))
        {
            return Err(refused("parts that do not fit the scene"));
        }
        stop_reason.check(propagators.scene.contacts.len())?;
        let pairs = known.iter().zip(parts);
        let motions = pairs.map(|(part, record)| Self::restored(&part.propagators, record));
        let motions = motions.collect::<Result<Vec<_>, Error>>()?;
        let is_whole = |whole: &Self| whole.phases.len() == counters.phases;
        let whole = put_together(propagators, motions.into_iter(), end, is_whole);
        if !is_whole(&whole) {
            return Err(refused("parts with other phases than the whole"));
        }
        Ok(Self { counters, stop_reason, ..whole })
    }

    /// The motion of a scene in one piece.
    fn restored(propagators: &Arc<Propagators>, mut record: MotionRecord) -> Result<Self, Error> {
        let scene = &propagators.scene;
        let local = record.local.take();
        let local = local.map(|local| LocalMotion::from_record(propagators, local)).transpose()?;
        if let Some(motion) = &local {
            if record.end > motion.end().next_up() {
                return Err(refused("an end after that of all panels"));
            }
            let phases = (0..=motion.steps.len()).map(|phase| motion.phase(phase));
            record.phases = phases.collect();
        } else if record.states.len() != 2 * scene.size * record.phases.len()
            || record.phases.iter().any(|phase| phase.basis >= record.bases.len())
        {
            return Err(refused("phases that do not fit their states or bases"));
        }
        record.check(scene)?;
        let bases = record.bases.into_iter();
        Ok(Self {
            bases: bases
                .map(|(combination, methods)| {
                    UsedBasis::recorded(propagators, combination, &methods)
                })
                .collect::<Result<_, Error>>()?,
            phases: record.phases,
            states: KeptStates::all(scene.size, record.states),
            local,
            events: record.events,
            grazings: record.grazings,
            accumulations: record.accumulations,
            counters: record.counters,
            stop_reason: record.stop_reason,
            end: record.end,
            ..Self::new(propagators)
        })
    }
}
