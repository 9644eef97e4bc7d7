//! A computed motion: the state after every event; states between events are computed on demand.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::Wanted;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::partition::Block;
use crate::scene::status::{Combination, Status};
use crate::transient::local::motion::LocalMotion;
use crate::transient::trajectory::events::{Accumulation, Counters, Event, Grazing, StopReason};
use crate::transient::trajectory::kept_states::KeptStates;
use crate::transient::trajectory::used_bases::UsedBasis;

/// One phase: a combination from a state at a time on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// s
    pub start: f64,
    /// Low part of the start: the exact time is `start + rest`, s.
    pub rest: f64,
    /// Place in `Trajectory::bases`; 0 in a local march and in a scene of parts, where no phase is propagated as a whole.
    pub basis: usize,
}

/// The motion of a part that nothing couples to the others.
#[derive(Debug)]
pub(crate) struct PartMotion {
    pub block: Arc<Block>,
    pub motion: Trajectory,
    /// The phases of the whole with which its own begin, ascending.
    pub begins: Vec<usize>,
}

impl PartMotion {
    /// Its phase during a phase of the whole.
    pub(super) fn phase_in(&self, whole: usize) -> usize {
        self.begins.partition_point(|&begin| begin <= whole) - 1
    }

    /// Its phase during a phase of the whole, and the time since its start at the start of that, s.
    pub(super) fn place(&self, whole: usize, phase: &Phase) -> (usize, f64) {
        let own = self.phase_in(whole);
        let begun = &self.motion.phases[own];
        (own, ((phase.start - begun.start) + (phase.rest - begun.rest)).max(0.0))
    }
}

/// Returns the states of so many phases from one on, whose state is kept.
pub(crate) type Again = fn(&Trajectory, Repetition, usize, usize) -> Result<Vec<f64>, RunFailure>;

/// The data by which a run is repeated from one of its states.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Repetition {
    /// Of the whole run, s.
    pub duration: f64,
    /// See [`crate::transient::run_state::Controls`], s.
    pub accumulation_tolerance: f64,
    /// See there, s.
    pub load_time: f64,
    /// The states of some phases, from the first of them on, whose state is kept.
    pub again: Again,
}

/// Phases that there is room for at first: room for one grows four times before a short motion ends.
const FIRST: usize = 32;

/// The motion from 0 to `end`.
#[derive(Debug)]
pub struct Trajectory {
    pub(crate) propagators: Arc<Propagators>,
    pub(crate) phases: Vec<Phase>,
    /// What the phases are propagated by.
    pub(crate) bases: Vec<UsedBasis>,
    /// (q, q') at the start of the phases.
    pub(crate) states: KeptStates,
    /// How the run is repeated between kept states.
    pub(crate) repetition: Option<Repetition>,
    /// Of a local march, instead of states and their repetition.
    pub(crate) local: Option<LocalMotion>,
    /// Of a scene in parts, instead of bases and states.
    pub(crate) parts: Vec<PartMotion>,
    /// All events, in order of time.
    pub events: Vec<Event>,
    /// Touches that rounding could not decide, in order of time.
    pub grazings: Vec<Grazing>,
    /// Limits of series of bounces, in order of time.
    pub accumulations: Vec<Accumulation>,
    /// How much work the run took.
    pub counters: Counters,
    /// Why the motion ends at `end`.
    pub stop_reason: StopReason,
    /// s
    pub end: f64,
}

impl Trajectory {
    /// A motion without phases, events or states.
    pub(crate) fn new(propagators: &Arc<Propagators>) -> Self {
        Self {
            propagators: Arc::clone(propagators),
            phases: Vec::new(),
            bases: Vec::new(),
            states: KeptStates::new(propagators.scene.size, 0, usize::MAX),
            repetition: None,
            local: None,
            parts: Vec::new(),
            events: Vec::new(),
            grazings: Vec::new(),
            accumulations: Vec::new(),
            counters: Counters::default(),
            stop_reason: StopReason::Duration,
            end: 0.0,
        }
    }

    /// Whether there is memory for another phase and the events with which it begins: where there is none, a run can end with its
    /// motion so far.
    #[inline(always)]
    pub(crate) fn has_room(&mut self) -> bool {
        let events = self.events.len() + self.propagators.scene.contacts.len();
        let fits = self.phases.len() < self.phases.capacity() && events < self.events.capacity();
        fits || self.grow()
    }

    #[cold]
    fn grow(&mut self) -> bool {
        let more = self.phases.len().max(FIRST);
        let events = self.events.len().max(FIRST) + self.contact_count();
        self.phases.try_reserve_exact(more).is_ok() && self.events.try_reserve_exact(events).is_ok()
    }

    /// The scene that moves.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.propagators.scene
    }

    /// The combination after an event.
    pub fn combination(&self, event: &Event) -> Cow<'_, Combination> {
        self.combination_of(event.phase)
    }

    /// The combination of a phase.
    pub(crate) fn combination_of(&self, phase: usize) -> Cow<'_, Combination> {
        if !self.parts.is_empty() {
            let mut statuses = vec![Status::Detached; self.contact_count()];
            for part in &self.parts {
                let own = part.motion.combination_of(part.phase_in(phase));
                for (&contact, &status) in part.block.contacts.iter().zip(own.statuses()) {
                    statuses[contact] = status;
                }
            }
            return Cow::Owned(Combination::new(statuses));
        }
        match &self.local {
            Some(local) => Cow::Owned(local.combination(phase)),
            None => Cow::Borrowed(&self.bases[self.phases[phase].basis].combination),
        }
    }

    /// The basis of the combination of a phase.
    pub(crate) fn basis_of(&self, phase: usize) -> Result<Arc<CombinationBasis>, Error> {
        if !self.parts.is_empty() {
            let bases = self.parts.iter().map(|part| part.motion.basis_of(part.phase_in(phase)));
            let bases = bases.collect::<Result<Vec<_>, Error>>()?;
            let combination = self.combination_of(phase).into_owned();
            return Ok(Arc::new(self.propagators.of_parts(combination, bases.into_iter())?));
        }
        match &self.local {
            Some(local) => Ok(self.propagators.basis(&local.combination(phase), Wanted::Series)?.0),
            None => Ok(self.basis(self.phases[phase].basis)),
        }
    }

    /// The basis at a place among those of the motion.
    pub(crate) fn basis(&self, place: usize) -> Arc<CombinationBasis> {
        self.bases[place].again(&self.propagators)
    }

    /// The time of the loads at the start, s.
    pub(crate) fn load_time(&self) -> f64 {
        match (&self.repetition, &self.local) {
            (Some(run), _) => run.load_time,
            (None, Some(local)) => local.load_time,
            (None, None) => self.parts.first().map_or(0.0, |part| part.motion.load_time()),
        }
    }

    /// How many different combinations the phases have, of each part by itself.
    pub(crate) fn combinations_met(&self) -> usize {
        let of_parts: usize = self.parts.iter().map(|part| part.motion.combinations_met()).sum();
        let own = self.bases.iter().map(|basis| &basis.combination);
        own.collect::<HashSet<_>>().len() + of_parts
    }

    /// Bytes taken by the states that are kept; those between are run again when they are asked for.
    pub fn kept_bytes(&self) -> usize {
        let of_parts: usize = self.parts.iter().map(|part| part.motion.kept_bytes()).sum();
        self.local.as_ref().map_or(&self.states, |local| &local.states).bytes() + of_parts
    }

    /// The events at the start of a phase.
    pub(crate) fn events_at(&self, phase: usize) -> impl Iterator<Item = &Event> {
        let first = self.events.partition_point(|event| event.phase < phase);
        self.events[first..].iter().take_while(move |event| event.phase == phase)
    }

    /// Number of dofs.
    pub fn dofs(&self) -> usize {
        self.scene().dofs
    }

    /// Number of contacts.
    pub fn contact_count(&self) -> usize {
        self.scene().contacts.len()
    }

    /// The combinations of its phases that last some time, without repetition of neighbours.
    pub(crate) fn combinations_in_order(&self) -> Vec<Combination> {
        let mut names: Vec<Combination> = Vec::new();
        let count = self.phases.len();
        for (k, phase) in self.phases.iter().enumerate() {
            let lasts = k + 1 == count || self.phases[k + 1].start > phase.start;
            let combination = self.combination_of(k);
            if lasts && names.last() != Some(&*combination) {
                names.push(combination.into_owned());
            }
        }
        names
    }

    /// Exact time between the start of a phase and its end.
    pub(crate) fn phase_duration(&self, phase: usize) -> f64 {
        let this = &self.phases[phase];
        match self.phases.get(phase + 1) {
            Some(next) => (next.start - this.start) + (next.rest - this.rest),
            None => (self.end - this.start) - this.rest,
        }
        .max(0.0)
    }

    pub(crate) fn phase_at(&self, time: f64) -> usize {
        self.phases.partition_point(|phase| phase.start <= time).max(1) - 1
    }
}
