//! Motions as plain numbers, from which, with the scene, they are restored to the last bit.
//!
//! Bases follow from the scene and are computed again.

use std::sync::Arc;

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::error::input::{Error, refused};
use crate::error::run::RunFailure;
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
use crate::transient::trajectory::used_bases::UsedBasis;

/// A [`Trajectory`] without its scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrajectoryRecord {
    /// The different combinations, and by what each is propagated, for each block of the scene.
    pub bases: Vec<(String, Vec<Method>)>,
    /// Index into `bases` of every phase.
    pub phase_basis: Vec<usize>,
    /// Start of every phase, s.
    pub phase_start: Vec<f64>,
    /// What rounding takes from `phase_start`.
    pub phase_rest: Vec<f64>,
    /// (q, q') at the start of each phase, contact coordinates, 2n per phase; of a local march at its panels.
    pub states: Vec<f64>,
    /// Of a local march: its panels and steps. Its one basis is the combination of the start.
    pub local: Option<LocalRecord>,
    /// Of a scene in parts: a record for each of them. All other lists are empty.
    pub parts: Vec<TrajectoryRecord>,
    /// Time of every event, s.
    pub event_time: Vec<f64>,
    /// Index of the contact of every event.
    pub event_contact: Vec<usize>,
    /// Kind of every event.
    pub event_kind: Vec<EventKind>,
    /// Index of the phase that begins with each event.
    pub event_phase: Vec<usize>,
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
    /// Refuses a record that no motion of the scene can have.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let (phases, contacts) = (self.phase_basis.len(), scene.contacts.len());
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if phases == 0
            || self.phase_start.len() != phases
            || self.phase_rest.len() != phases
            || self.local.is_none() && self.states.len() != 2 * scene.size * phases
            || self.phase_start[0] != 0.0
            || !self.phase_start.is_sorted()
            || !(finite(&self.phase_rest) && finite(&self.states) && self.end.is_finite())
            || self.phase_start[phases - 1] > self.end
        {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        let events = self.event_time.len();
        if self.event_contact.len() != events
            || self.event_kind.len() != events
            || self.event_phase.len() != events
            || self.event_contact.iter().zip(&self.event_kind).any(|(&contact, &kind)| {
                contact >= contacts && (contact, kind) != (NO_CONTACT, EventKind::Load)
            })
            // The first phase begins with the motion, every other one with its events.
            || self.event_phase.iter().any(|&phase| phase == 0 || phase >= phases)
            || !self.event_phase.is_sorted()
            || self.event_phase.iter().zip(&self.event_time).any(|(&k, &t)| self.phase_start[k] != t)
        {
            return Err(refused("events that do not fit the phases or the scene"));
        }
        let limits: Vec<usize> = self.accumulations.iter().map(|limit| limit.event).collect();
        let is_limit =
            |event: &usize| self.event_kind.get(*event) == Some(&EventKind::Accumulation);
        if !(limits.is_sorted() && limits.iter().all(is_limit))
            || self.accumulations.iter().any(|limit| !(limit.error >= 0.0))
        {
            return Err(refused("limits of bounces that do not fit the events"));
        }
        if self.grazings.iter().any(|touch| {
            touch.contact >= contacts
                || !(touch.time >= 0.0 && touch.time <= self.end)
                || !finite(&[touch.value, touch.uncertainty])
        }) {
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

    /// The reason of a name; `message` and `contact` say more where there is more to say.
    pub fn named(name: &str, message: &str, contact: Option<usize>) -> Result<Self, Error> {
        Ok(match name {
            "duration" => StopReason::Duration,
            "max_events" => StopReason::MaxEvents,
            "time_limit" => StopReason::TimeLimit,
            "grazing" => StopReason::Grazing,
            "unbounded" => StopReason::Unbounded,
            "interrupted" => StopReason::Interrupted,
            "failed" => StopReason::Failed(RunFailure::Recorded(message.to_owned())),
            "chattering" => StopReason::Chattering {
                contact: contact.ok_or_else(|| refused("chattering without a contact"))?,
            },
            _ => return Err(refused("unknown reason of the stop")),
        })
    }
}

impl Trajectory {
    /// What [`Trajectory::from_record`] takes.
    pub fn record(&self) -> TrajectoryRecord {
        if !self.parts.is_empty() {
            return TrajectoryRecord {
                parts: self.parts.iter().map(|part| part.motion.record()).collect(),
                counters: self.counters,
                stop_reason: self.stop_reason.clone(),
                end: self.end,
                ..TrajectoryRecord::default()
            };
        }
        let known = self.bases.iter();
        let mut bases: Vec<_> =
            known.map(|basis| (basis.combination.to_string(), basis.methods.clone())).collect();
        let (local, states) = match &self.local {
            Some(motion) => {
                bases.push((motion.start().to_string(), vec![Method::Local]));
                let (record, states) = motion.record();
                (Some(record), states)
            }
            None => {
                (None, (0..self.phases.len()).flat_map(|k| self.phase_state(k).to_vec()).collect())
            }
        };
        TrajectoryRecord {
            bases,
            phase_basis: self.phases.iter().map(|phase| phase.basis).collect(),
            phase_start: self.phases.iter().map(|phase| phase.start).collect(),
            phase_rest: self.phases.iter().map(|phase| phase.rest).collect(),
            states,
            local,
            parts: Vec::new(),
            event_time: self.events.iter().map(|event| event.time).collect(),
            event_contact: self.events.iter().map(|event| event.contact).collect(),
            event_kind: self.events.iter().map(|event| event.kind).collect(),
            event_phase: self.events.iter().map(|event| event.phase).collect(),
            grazings: self.grazings.clone(),
            accumulations: self.accumulations.clone(),
            counters: self.counters,
            stop_reason: self.stop_reason.clone(),
            end: self.end,
        }
    }

    /// The motion of a scene in parts.
    fn from_parts(propagators: &Arc<Propagators>, record: TrajectoryRecord) -> Result<Self, Error> {
        let TrajectoryRecord { parts, counters, stop_reason, end, .. } = record;
        let known = propagators.parts();
        if parts.len() != known.len()
            || !(end >= 0.0)
            || parts.iter().any(|part| !(part.end >= end))
        {
            return Err(refused("parts that do not fit the scene"));
        }
        stop_reason.check(propagators.scene.contacts.len())?;
        let pairs = known.iter().zip(parts);
        let motions = pairs.map(|(part, record)| Self::from_record(&part.propagators, record));
        let motions = motions.collect::<Result<Vec<_>, Error>>()?;
        let is_whole = |whole: &Self| whole.phases.len() == counters.phases;
        let whole = put_together(propagators, motions.into_iter(), end, is_whole);
        if !is_whole(&whole) {
            return Err(refused("parts with other phases than the whole"));
        }
        Ok(Self { counters, stop_reason, ..whole })
    }

    /// The motion that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Arc<Propagators>,
        record: TrajectoryRecord,
    ) -> Result<Self, Error> {
        let scene = &propagators.scene;
        if !record.parts.is_empty() {
            return Self::from_parts(propagators, record);
        }
        record.check(scene)?;
        let events = record.event_time.len();
        let (local, states) = match record.local {
            Some(local) => {
                let by_local = record.bases.len() == 1 && record.bases[0].1 == [Method::Local];
                if !by_local || record.phase_basis.iter().any(|&basis| basis > 0) {
                    return Err(refused("bases that do not fit a local march"));
                }
                let start = Combination::parse(&record.bases[0].0, scene.contacts.len())?;
                scene.check_combination(&start)?;
                let motion = LocalMotion::from_record(propagators, &start, local, record.states)?;
                let phases = record.phase_start.iter().zip(&record.phase_rest).enumerate();
                if record.phase_start.len() != motion.steps.len() + 1
                    || record.end > motion.end().next_up()
                    || phases
                        .map(|(k, phase)| (motion.phase_start(k), phase))
                        .any(|(clock, phase)| (&clock.seconds, &clock.rest) != phase)
                {
                    return Err(refused("phases that do not fit the steps"));
                }
                (Some(motion), KeptStates::all(scene.size, Vec::new()))
            }
            None => (None, KeptStates::all(scene.size, record.states)),
        };
        if record.phase_basis.iter().any(|&basis| basis >= record.bases.len()) {
            return Err(refused("phases without a basis"));
        }
        let bases = match local {
            Some(_) => Vec::new(),
            None => {
                let known = record.bases.iter();
                known
                    .map(|(name, methods)| UsedBasis::recorded(propagators, name, methods))
                    .collect::<Result<_, Error>>()?
            }
        };
        let numbers = record.phase_start.into_iter().zip(record.phase_rest);
        let phases = numbers
            .zip(record.phase_basis)
            .map(|((start, rest), basis)| Phase { start, rest, basis })
            .collect();
        let events = (0..events)
            .map(|k| Event {
                time: record.event_time[k],
                contact: record.event_contact[k],
                kind: record.event_kind[k],
                phase: record.event_phase[k],
            })
            .collect();
        Ok(Self {
            propagators: Arc::clone(propagators),
            phases,
            bases,
            states,
            repetition: None,
            local,
            parts: Vec::new(),
            events,
            grazings: record.grazings,
            accumulations: record.accumulations,
            counters: record.counters,
            stop_reason: record.stop_reason,
            end: record.end,
        })
    }
}
