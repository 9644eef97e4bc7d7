//! Motions and orbits as plain numbers: what has to be kept beside a scene to have them again to the last bit.
//!
//! Bases and passages follow from the scene and are found anew.

use std::sync::Arc;

use crate::basis::CombinationBasis;
use crate::cycle::Cycle;
use crate::error::{Error, RunFailure};
use crate::orbit::{Orbit, OrbitFailure, Step};
use crate::saltation::Passage;
use crate::scene::Scene;
use crate::simulation::Method;
use crate::status::Combination;
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
    pub period: f64,
    pub residual: f64,
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
        let (phases, contacts) = (record.phase_basis.len(), scene.contacts().len());
        if phases == 0
            || record.phase_start.len() != phases
            || record.phase_rest.len() != phases
            || record.states.len() != 2 * scene.size * phases
            || !record.phase_start.is_sorted()
        {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        let events = record.event_time.len();
        if record.event_contact.len() != events
            || record.event_kind.len() != events
            || record.event_phase.len() != events
            || record.event_contact.iter().any(|&contact| contact >= contacts)
            || record.event_phase.iter().any(|&phase| phase >= phases)
            || !record.event_phase.is_sorted()
            || record.accumulations.iter().any(|limit| limit.event >= events)
            || record.grazings.iter().any(|touch| touch.contact >= contacts)
        {
            return Err(refused("events that do not fit the phases or the scene"));
        }
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
            period: self.orbit.period,
            residual: self.orbit.residual,
        }
    }

    /// The orbit that a record was made of, in the same scene.
    pub fn from_record(scene: &Arc<Scene>, record: &CycleRecord) -> Result<Self, OrbitFailure> {
        let (count, width) = (record.combinations.len(), 2 * scene.size);
        if count == 0
            || record.states.len() != width * count
            || record.durations.len() != count
            || record.contacts.len() != count
            || record.kinds.len() != count
            || record.contacts.iter().any(|&contact| contact >= scene.contacts().len())
        {
            return Err(refused("phases that do not fit each other or the scene").into());
        }
        let steps = (0..count)
            .map(|k| {
                let (contact, kind) = (record.contacts[k], record.kinds[k]);
                let combination =
                    Combination::parse(&record.combinations[k], scene.contacts().len())?;
                Ok(Step {
                    state: record.states[width * k..width * (k + 1)].to_vec(),
                    duration: record.durations[k],
                    passage: Passage::of_event(scene, &combination, contact, kind),
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
