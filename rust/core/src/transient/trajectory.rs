//! A computed motion: the state after every event; states between events are computed on demand.

use std::borrow::Cow;
use std::collections::HashSet;
use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;

use crate::contact::event_function::Functional;
use crate::contact::event_function::{contact_force, contact_forces, contact_forces_in};
use crate::contact::event_kind::EventKind;
use crate::error::Error;
use crate::modes::complex_modes::Modes;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::Wanted;
use crate::motion::phase_motion::Motion;
use crate::motion::propagators::Propagators;
use crate::scene::model::{Scene, State};
use crate::scene::partition::Block;
use crate::scene::status::{Combination, Status};
use crate::transient::kept_states::{KeptStates, PhaseState};
use crate::transient::local::motion::LocalMotion;

/// One event; the combination is that after everything that happened at the instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// s
    pub time: f64,
    /// Index of the contact; [`crate::contact::NO_CONTACT`] where a load was switched.
    pub contact: usize,
    /// What happened.
    pub kind: EventKind,
    /// Index into [`Trajectory::phases`] of the phase that begins here.
    pub(crate) phase: usize,
}

/// A touch of an event function within rounding: the status was kept, though `alternative` may be true.
#[derive(Debug, Clone, Copy, PartialEq)]
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
#[derive(Debug, Clone, Copy, PartialEq)]
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
#[derive(Debug, Clone, PartialEq, Default)]
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
    Failed(crate::error::RunFailure),
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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

/// One phase: a combination from a state at a time on.
#[derive(Debug)]
pub(crate) struct Phase {
    pub start: f64,
    /// Low part of the start: the exact time is `start + rest`, s.
    pub rest: f64,
    /// Place in [`Trajectory::bases`]; 0 in a local march and in a scene of parts, where no phase is propagated as a whole.
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
    fn phase_in(&self, whole: usize) -> usize {
        self.begins.partition_point(|&begin| begin <= whole) - 1
    }

    /// Its phase during a phase of the whole, and the time since its start at the start of that, s.
    fn place(&self, whole: usize, phase: &Phase) -> (usize, f64) {
        let own = self.phase_in(whole);
        let begun = &self.motion.phases[own];
        (own, ((phase.start - begun.start) + (phase.rest - begun.rest)).max(0.0))
    }
}

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
    pub again: fn(&Trajectory, Repetition, usize, usize) -> Vec<f64>,
}

/// The motion from 0 to `end`.
#[derive(Debug)]
pub struct Trajectory {
    pub(crate) propagators: Arc<Propagators>,
    pub(crate) phases: Vec<Phase>,
    /// What the phases are propagated by.
    pub(crate) bases: Vec<Arc<CombinationBasis>>,
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

/// Positions and velocities over dofs, contact forces and statuses at a series of instants; row-major.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// m, n per instant.
    pub position: Vec<f64>,
    /// m/s, n per instant.
    pub velocity: Vec<f64>,
    /// N >= 0 of every contact, N.
    pub normal_force: Vec<f64>,
    /// T of every contact, N.
    pub friction_force: Vec<f64>,
    /// Of every contact.
    pub status: Vec<Status>,
}

/// The contact forces of a combination of a scene whose contacts are coupled by mass.
type CoupledForces = (Combination, Vec<(Functional, Functional)>);

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
            None => Ok(Arc::clone(&self.bases[self.phases[phase].basis])),
        }
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

    /// (q, q') at the start of a phase, contact coordinates.
    pub(crate) fn phase_state(&self, phase: usize) -> PhaseState<'_> {
        if self.local.is_some() || !self.parts.is_empty() {
            let mut cursor = Cursor::new(self);
            cursor.seek_local(phase, 0.0);
            let state = [cursor.q, cursor.u].concat();
            let all = 0..state.len();
            return PhaseState::Repeated(Arc::new(state), all);
        }
        self.states.state(phase, |first, count| {
            self.repetition.map_or_else(Vec::new, |run| (run.again)(self, run, first, count))
        })
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

    /// (position, velocity) over dofs just after an event.
    pub fn event_state(&self, event: &Event) -> (Vec<f64>, Vec<f64>) {
        let state = self.phase_state(event.phase);
        let (q, u) = state.parts();
        self.scene().dof_state(q, u)
    }

    /// The state at a time within the motion; at an event time the state after it.
    pub fn state(&self, time: f64) -> Result<State, Error> {
        let mut cursor = Cursor::new(self);
        cursor.seek("time", time)?;
        let combination = self.combination_of(cursor.phase);
        Ok(self.scene().state(&cursor.q, &cursor.u, &combination))
    }

    /// (q, q') at a time within the motion; at an event time those after it.
    pub(crate) fn coordinates(&self, time: f64) -> Result<(Vec<f64>, Vec<f64>), Error> {
        let mut cursor = Cursor::new(self);
        cursor.seek("time", time)?;
        Ok((cursor.q, cursor.u))
    }

    /// States and contact forces at `times`, in any order.
    pub fn sample(&self, times: &[f64]) -> Result<Sample, Error> {
        let mut sample = Sample::default();
        let mut coupled: Option<CoupledForces> = None;
        let mut cursor = Cursor::new(self);
        for &time in times {
            cursor.seek("times", time)?;
            let (position, velocity) = self.scene().dof_state(&cursor.q, &cursor.u);
            sample.position.extend(position);
            sample.velocity.extend(velocity);
            let combination = &*self.combination_of(cursor.phase);
            if self.scene().contacts_coupled()
                && coupled.as_ref().is_none_or(|known: &CoupledForces| known.0 != *combination)
            {
                coupled = Some((combination.clone(), contact_forces(self.scene(), combination)));
            }
            let statuses = combination.statuses();
            let of_laws = match self.scene().has_friction_laws() {
                true => contact_forces_in(self.scene(), combination, &cursor.q, &cursor.u),
                false => Vec::new(),
            };
            for (contact, &status) in statuses.iter().enumerate() {
                let (normal, friction) = match &coupled {
                    _ if self.scene().has_friction_laws() => of_laws[contact],
                    Some((_, forces)) => (
                        forces[contact].1.value(&cursor.q, &cursor.u),
                        forces[contact].0.value(&cursor.q, &cursor.u),
                    ),
                    None => contact_force(self.scene(), contact, status, &cursor.q, &cursor.u),
                };
                sample.normal_force.push(normal);
                sample.friction_force.push(friction);
                sample.status.push(status);
            }
        }
        Ok(sample)
    }

    /// Coordinates `left' (A y) / a` in the modes of the combination of each instant, in the order and
    /// normalisation of [`Modes`]; NaN for defective ones. With steady forces z follows
    /// `z' = lambda z + left' Q / a`.
    pub fn modal_coordinates(&self, times: &[f64]) -> Result<Vec<ModalRun>, Error> {
        let mut cursor = Cursor::new(self);
        let mut runs: Vec<ModalRun> = Vec::new();
        let mut known: Vec<(Combination, Modes)> = Vec::new();
        for (index, &time) in times.iter().enumerate() {
            cursor.seek("times", time)?;
            let combination = &*self.combination_of(cursor.phase);
            let position = match known.iter().position(|entry| entry.0 == *combination) {
                Some(position) => position,
                None => {
                    known
                        .push((combination.clone(), Modes::new(self.scene().bare(), combination)?));
                    known.len() - 1
                }
            };
            let (_, modes) = &known[position];
            let kept = &modes.reduced.reduction.kept;
            let (q, u) = self.scene().at_rest(&cursor.q, &cursor.u);
            let y: Vec<f64> =
                kept.iter().map(|&k| q[k]).chain(kept.iter().map(|&k| u[k])).collect();
            if runs.last().is_none_or(|run| run.combination != *combination) {
                runs.push(ModalRun {
                    combination: combination.clone(),
                    indices: Vec::new(),
                    coordinates: Vec::new(),
                });
            }
            if let Some(run) = runs.last_mut() {
                run.indices.push(index);
                run.coordinates.extend(modes.coordinates(&y));
            }
        }
        Ok(runs)
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

/// Modal coordinates at successive instants within one combination.
#[derive(Debug, Clone)]
pub struct ModalRun {
    /// Status of every contact at these instants.
    pub combination: Combination,
    /// Indices into the times asked for.
    pub indices: Vec<usize>,
    /// One row of 2m per instant.
    pub coordinates: Vec<Complex64>,
}

/// Walks through a trajectory, reusing the phase in progress for times that go on from it.
pub(crate) struct Cursor<'a> {
    trajectory: &'a Trajectory,
    pub phase: usize,
    /// The phase that `motion` follows.
    in_motion: usize,
    motion: Option<Motion>,
    /// One for each part of a scene in parts.
    parts: Vec<Cursor<'a>>,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
}

impl<'a> Cursor<'a> {
    pub fn new(trajectory: &'a Trajectory) -> Self {
        let n = trajectory.scene().size;
        Self {
            trajectory,
            phase: usize::MAX,
            in_motion: usize::MAX,
            motion: None,
            parts: trajectory.parts.iter().map(|part| Self::new(&part.motion)).collect(),
            q: vec![0.0; n],
            u: vec![0.0; n],
        }
    }

    /// Brings phase, q and q' to `time`; at an event time to the state after it.
    pub fn seek(&mut self, argument: &'static str, time: f64) -> Result<(), Error> {
        let trajectory = self.trajectory;
        if !(time >= 0.0 && time <= trajectory.end) {
            return Err(Error::TimeOutside { argument, value: time, end: trajectory.end });
        }
        let phase = trajectory.phases.partition_point(|phase| phase.start <= time).max(1) - 1;
        let local = time - trajectory.phases[phase].start;
        self.seek_local(phase, local);
        Ok(())
    }

    /// Brings q and q' to a time counted from the start of a phase, which may lie at its very end.
    pub fn seek_local(&mut self, phase: usize, local: f64) {
        let trajectory = self.trajectory;
        if let Some(motion) = &trajectory.local {
            self.phase = phase;
            motion.state(phase, local, &mut self.q, &mut self.u);
            return;
        }
        if !self.parts.is_empty() {
            self.phase = phase;
            for (part, cursor) in trajectory.parts.iter().zip(&mut self.parts) {
                let (own, since) = part.place(phase, &trajectory.phases[phase]);
                cursor.seek_local(own, since + local);
                part.block.scatter(&cursor.q, &mut self.q);
                part.block.scatter(&cursor.u, &mut self.u);
            }
            return;
        }
        let state = trajectory.phase_state(phase);
        let (q, u) = state.parts();
        let usable = phase == self.in_motion
            && self.motion.as_ref().is_some_and(|motion| motion.start() <= local);
        // Coordinates held at zero are not written by the motion.
        if phase != self.phase || local == 0.0 {
            self.q.copy_from_slice(q);
            self.u.copy_from_slice(u);
        }
        self.phase = phase;
        if local == 0.0 {
            return;
        }
        if !usable {
            let basis = &trajectory.bases[trajectory.phases[phase].basis];
            match &mut self.motion {
                Some(motion) => motion.restart(basis, q, u),
                None => self.motion = Some(Motion::new(trajectory.scene(), basis, q, u)),
            }
            self.in_motion = phase;
        }
        if let Some(motion) = &mut self.motion {
            motion.seek(local, &mut self.q, &mut self.u);
        }
    }

    /// Local time up to which the motion of a phase is one series from a local time on, where it is not smooth everywhere.
    pub fn smooth_until(&mut self, phase: usize, local: f64) -> Option<f64> {
        let trajectory = self.trajectory;
        let of_parts = trajectory.parts.iter().zip(&mut self.parts).filter_map(|(part, cursor)| {
            let (own, since) = part.place(phase, &trajectory.phases[phase]);
            Some(cursor.smooth_until(own, since + local)? - since)
        });
        if let Some(first) = of_parts.reduce(f64::min) {
            return Some(first);
        }
        self.seek_local(phase, local.max(f64::MIN_POSITIVE));
        self.motion.as_mut()?.smooth_until(local)
    }

    /// A rate such that the motion of a phase grows by at most `e^{rate |z|}` around a local time, off the real axis too; modes
    /// that have decayed below rounding do not count. 1/s.
    pub fn growth_rate(&mut self, phase: usize, local: f64) -> f64 {
        if let Some(motion) = &self.trajectory.local {
            return motion.growth_rate();
        }
        let trajectory = self.trajectory;
        let of_parts = trajectory.parts.iter().zip(&mut self.parts).map(|(part, cursor)| {
            let (own, since) = part.place(phase, &trajectory.phases[phase]);
            cursor.growth_rate(own, since + local)
        });
        if let Some(largest) = of_parts.reduce(f64::max) {
            return largest;
        }
        // Local time 0 is known without a motion.
        self.seek_local(phase, local.max(f64::MIN_POSITIVE));
        let own = self.motion.as_ref().map_or(0.0, |motion| motion.growth_rate(local));
        // A slider that vibrates carries the contacts that stick to it, which have no motion of their own.
        let drive = self.trajectory.scene().drive.iter();
        drive.flat_map(|drive| &drive.oscillators).fold(own, |rate, one| rate.max(one.rate))
    }
}
