//! Motions and orbits as plain numbers: what has to be kept beside a scene to have them again to the last bit.
//!
//! Bases and passages follow from the scene and are found anew.

use std::sync::Arc;

use crate::basis::CombinationBasis;
use crate::cycle::Cycle;
use crate::error::{Error, RunFailure};
use crate::orbit::{INSTANT, Orbit, OrbitFailure, Step};
use crate::saltation::Passage;
use crate::scene::Scene;
use crate::simulation::Method;
use crate::status::{Combination, Status};
use crate::trajectory::{
    Accumulation, Counters, Event, EventKind, Grazing, Phase, StopReason, Trajectory,
};

/// A [`Trajectory`] without its scene.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRecord {
    /// The different combinations, and by what each is propagated, for each block of the scene.
    pub bases: Vec<(String, Vec<Method>)>,
    /// Index into `bases` of every phase.
    pub phase_basis: Vec<usize>,
    pub phase_start: Vec<f64>,
    /// What rounding takes from `phase_start`.
    pub phase_rest: Vec<f64>,
    /// (q, q') at the start of each phase, contact coordinates, 2n per phase.
    pub states: Vec<f64>,
    pub event_time: Vec<f64>,
    pub event_contact: Vec<usize>,
    pub event_kind: Vec<EventKind>,
    /// Index of the phase that begins with each event.
    pub event_phase: Vec<usize>,
    pub grazings: Vec<Grazing>,
    pub accumulations: Vec<Accumulation>,
    pub counters: Counters,
    pub stop_reason: StopReason,
    pub end: f64,
}

/// A [`Cycle`] without its scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleRecord {
    pub method: Method,
    pub combinations: Vec<String>,
    /// (q, q') at the start of each phase, contact coordinates, 2n per phase.
    pub states: Vec<f64>,
    pub durations: Vec<f64>,
    /// The contact and the kind of the event that ends each phase.
    pub contacts: Vec<usize>,
    pub kinds: Vec<EventKind>,
    /// The contacts that close with it, where it ends a series of impacts over several contacts; else empty.
    pub series: Vec<Vec<usize>>,
    pub period: f64,
    pub residual: f64,
}

impl TrajectoryRecord {
    /// Refuses what no motion of the scene leaves behind.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let (phases, contacts) = (self.phase_basis.len(), scene.contacts.len());
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if phases == 0
            || self.phase_start.len() != phases
            || self.phase_rest.len() != phases
            || self.states.len() != 2 * scene.size * phases
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
            || self.event_contact.iter().any(|&contact| contact >= contacts)
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
        match self.stop_reason {
            StopReason::Chattering { contact } if contact >= contacts => {
                Err(refused("chattering of an unknown contact"))
            }
            _ => Ok(()),
        }
    }
}

impl CycleRecord {
    /// Refuses what no orbit of the scene leaves behind.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let (count, width) = (self.combinations.len(), 2 * scene.size);
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let whole: f64 = self.durations.iter().sum();
        if count == 0
            || self.states.len() != width * count
            || self.durations.len() != count
            || self.contacts.len() != count
            || self.kinds.len() != count
            || self.series.len() != count
            || self.series.iter().flatten().any(|&contact| contact >= scene.contacts.len())
            || self.contacts.iter().any(|&contact| contact >= scene.contacts.len())
            || !(finite(&self.states) && finite(&self.durations) && self.residual >= 0.0)
            // The same sum in another order.
            || !(self.period > 0.0 && (self.period - whole).abs() <= count as f64 * f64::EPSILON * self.period)
            || self.durations.iter().any(|&duration| duration < -INSTANT * self.period)
        {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        Ok(())
    }
}

fn refused(reason: &'static str) -> Error {
    Error::Record { reason }
}

fn recorded_basis(
    scene: &Scene,
    name: &str,
    methods: &[Method],
) -> Result<Arc<CombinationBasis>, Error> {
    let combination = Combination::parse(name, scene.contacts().len())?;
    scene.check_combination(&combination)?;
    let basis = |scene: &Scene, combination: &Combination, method: Method| {
        Ok(scene.basis(combination, method.for_repeated_use())?.0)
    };
    let blocks = scene.blocks();
    if methods.len() != blocks.len().max(1) {
        return Err(refused("bases that do not fit the scene"));
    }
    if blocks.is_empty() {
        return basis(scene, &combination, methods[0]);
    }
    let parts = blocks.iter().zip(methods);
    let parts: Vec<_> = parts
        .map(|(block, &method)| basis(&block.scene, &block.statuses(&combination), method))
        .collect::<Result<_, Error>>()?;
    Ok(Arc::new(CombinationBasis::of_blocks(scene, combination, parts.into_iter())))
}

impl EventKind {
    const ALL: [EventKind; 6] = [
        EventKind::Velocity,
        EventKind::SlipPositive,
        EventKind::SlipNegative,
        EventKind::Release,
        EventKind::Impact,
        EventKind::Accumulation,
    ];

    /// Whether a contact of this status can have such an event.
    const fn can_end(self, status: Status) -> bool {
        match self {
            EventKind::Velocity => status.is_sliding(),
            EventKind::SlipPositive | EventKind::SlipNegative => matches!(status, Status::Sticking),
            EventKind::Release => status.is_closed(),
            EventKind::Impact | EventKind::Accumulation => !status.is_closed(),
        }
    }

    pub fn named(name: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| refused("unknown kind of event"))
    }
}

impl StopReason {
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
        let mut bases: Vec<(String, Vec<Method>)> = Vec::new();
        let mut seen: Vec<(&CombinationBasis, usize)> = Vec::new();
        let phase_basis = self
            .phases
            .iter()
            .map(|phase| {
                let basis = phase.basis.as_ref();
                if let Some(&(_, index)) =
                    seen.iter().find(|(known, _)| std::ptr::eq(*known, basis))
                {
                    return index;
                }
                bases.push((basis.combination.to_string(), basis.methods()));
                seen.push((basis, bases.len() - 1));
                bases.len() - 1
            })
            .collect();
        TrajectoryRecord {
            bases,
            phase_basis,
            phase_start: self.phases.iter().map(|phase| phase.start).collect(),
            phase_rest: self.phases.iter().map(|phase| phase.rest).collect(),
            states: self.states.clone(),
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

    /// The motion that a record was made of, in the same scene.
    pub fn from_record(scene: &Arc<Scene>, record: TrajectoryRecord) -> Result<Self, Error> {
        record.check(scene)?;
        let events = record.event_time.len();
        let bases = record
            .bases
            .iter()
            .map(|(name, methods)| recorded_basis(scene, name, methods))
            .collect::<Result<Vec<_>, Error>>()?;
        let numbers = record.phase_start.into_iter().zip(record.phase_rest);
        let phases = numbers
            .zip(record.phase_basis)
            .map(|((start, rest), index)| {
                let basis = bases.get(index).ok_or_else(|| refused("phases without a basis"))?;
                Ok(Phase { start, rest, basis: Arc::clone(basis) })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let events = (0..events)
            .map(|k| Event {
                time: record.event_time[k],
                contact: record.event_contact[k],
                kind: record.event_kind[k],
                phase: record.event_phase[k],
            })
            .collect();
        Ok(Self {
            scene: Arc::clone(scene),
            phases,
            states: record.states,
            events,
            grazings: record.grazings,
            accumulations: record.accumulations,
            counters: record.counters,
            stop_reason: record.stop_reason,
            end: record.end,
        })
    }
}

impl Cycle {
    /// What [`Cycle::from_record`] takes.
    pub fn record(&self) -> CycleRecord {
        let steps = &self.orbit.steps;
        CycleRecord {
            method: self.orbit.method,
            combinations: steps.iter().map(|step| step.combination.to_string()).collect(),
            states: steps.iter().flat_map(|step| step.state.iter().copied()).collect(),
            durations: steps.iter().map(|step| step.duration).collect(),
            contacts: steps.iter().map(|step| step.passage.contact).collect(),
            kinds: steps.iter().map(|step| step.kind).collect(),
            series: steps.iter().map(|step| step.passage.series.clone()).collect(),
            period: self.orbit.period,
            residual: self.orbit.residual,
        }
    }

    /// The orbit that a record was made of, in the same scene.
    pub fn from_record(scene: &Arc<Scene>, record: &CycleRecord) -> Result<Self, OrbitFailure> {
        let (count, width) = (record.combinations.len(), 2 * scene.size);
        record.check(scene)?;
        let steps = (0..count)
            .map(|k| {
                let (contact, kind) = (record.contacts[k], record.kinds[k]);
                let combination =
                    Combination::parse(&record.combinations[k], scene.contacts().len())?;
                scene.check_combination(&combination)?;
                let series = &record.series[k];
                let is_joint = !series.is_empty();
                if !kind.can_end(combination.statuses()[contact])
                    || is_joint && !(kind == EventKind::Accumulation && scene.contacts_coupled())
                {
                    return Err(refused("events that do not fit the phases they end"));
                }
                Ok(Step {
                    state: record.states[width * k..width * (k + 1)].to_vec(),
                    duration: record.durations[k],
                    passage: match is_joint {
                        true => Passage::joint(scene, &combination, contact, series.clone()),
                        false => Passage::of_event(scene, &combination, contact, kind),
                    },
                    kind,
                    combination,
                })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        Self::new(Orbit {
            scene: Arc::clone(scene),
            method: record.method,
            steps,
            period: record.period,
            residual: record.residual,
        })
    }
}
