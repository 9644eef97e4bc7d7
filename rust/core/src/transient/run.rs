//! One run: phase, first event, settlement, next phase.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use crate::contact::admissible_start::initial_departures;
use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::contact::settlement::{Departure, Series, Settlement};
use crate::contact::transition::settle;
use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::{Method, Wanted};
use crate::motion::method_cost::{AT_ONCE, Novelty, Rental};
use crate::motion::phase_motion::Motion;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};
use crate::transient::clock::Clock;
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::phase::{PhaseEnd, PhaseSearch};
use crate::transient::trajectory::events::{Accumulation, Event, StopReason};
use crate::transient::trajectory::kept_states::{KEPT, KeptStates};
use crate::transient::trajectory::model::{Phase, Repetition, Trajectory};

/// Impacts of one contact over which the ratio of a series is measured, twice.
const ROUND: usize = 4;
/// Number of events, per contact, among which those impacts are looked for.
const SEEN: usize = 32;

/// Gap, relative to the largest displacement, gap of the input or deflection under the constant load, below which series of
/// impacts over several contacts are not followed. A hundred times smaller gap takes a third more events; the time at which
/// a series ends is known to the root of the gap. Where closed contacts hold all of a scene in place, displacements vanish.
const RESOLUTION: f64 = 8192.0 * f64::EPSILON;

/// Combinations that a run looks up by comparing statuses; those met later by their hash.
const COMPARED: usize = 24;

/// A combination that a run has met.
#[derive(Clone, Copy)]
struct Known {
    /// Place of its basis in those of the trajectory.
    basis: usize,
    rental: Option<Rental>,
}

/// A run in progress.
pub(crate) struct Run<'a> {
    pub state: RunState<'a>,
    propagators: &'a Propagators,
    method: Method,
    known: Vec<Known>,
    /// Places of those from `COMPARED` on.
    places: HashMap<Combination, usize>,
    novelty: Novelty,
}

/// Data that a run carries from one phase to the next beside its state.
pub(crate) struct Progress {
    /// Place of the combination among those known.
    current: usize,
    settlement: Settlement,
    motion: Motion,
    search: PhaseSearch,
    at_this_instant: usize,
}

impl<'a> Run<'a> {
    /// A run from (q, q') at time 0.
    pub fn new(
        propagators: &'a Arc<Propagators>,
        (q, u): (Vec<f64>, Vec<f64>),
        duration: f64,
        method: Method,
        controls: Controls<'a>,
    ) -> Self {
        let Scene { size, contacts, .. } = &*propagators.scene;
        let kept = controls.kept_numbers.unwrap_or(KEPT);
        let mut trajectory = Trajectory::new(propagators);
        trajectory.states = KeptStates::new(*size, contacts.len(), kept);
        trajectory.repetition = Some(Repetition {
            duration,
            accumulation_tolerance: controls.accumulation_tolerance,
            load_time: controls.load_time,
            again: Run::again,
        });
        Self {
            state: RunState {
                scene: &propagators.scene,
                controls,
                started: Instant::now(),
                asked: 0,
                duration,
                until: duration,
                switched: controls.load_time,
                time: Clock::default(),
                q,
                u,
                trajectory,
            },
            propagators,
            method,
            known: Vec::new(),
            places: HashMap::new(),
            novelty: Novelty::default(),
        }
    }

    pub fn begin(&mut self, combination: &Combination) -> Result<Progress, Error> {
        let current = self.meet(combination.statuses())?;
        let basis = &self.state.trajectory.bases[self.known[current].basis];
        Ok(Progress {
            current,
            settlement: Settlement {
                statuses: combination.statuses().to_vec(),
                departures: initial_departures(
                    self.state.scene,
                    combination,
                    &self.state.q,
                    &self.state.u,
                ),
                events: Vec::new(),
                rest: None,
            },
            motion: Motion::new(self.state.scene, basis, &self.state.q, &self.state.u),
            search: PhaseSearch::default(),
            at_this_instant: 0,
        })
    }

    /// Follows one phase and settles the event that ends it; the reason if the motion ends before.
    pub fn step(&mut self, progress: &mut Progress) -> Result<Option<StopReason>, Error> {
        let Progress { current, settlement, motion, search, at_this_instant } = progress;
        let departing = settlement.departures.iter().any(|&d| d != Departure::None);
        let RunState { trajectory, time, q, u, controls, .. } = &mut self.state;
        let basis = self.known[*current].basis;
        trajectory.phases.push(Phase { start: time.seconds, rest: time.rest, basis });
        trajectory.states.push(q, u, &settlement.departures);
        trajectory.end = time.seconds;
        if controls.max_events.is_some_and(|most| trajectory.events.len() >= most) {
            return Ok(Some(StopReason::MaxEvents));
        }
        self.state.until = self.next_switch();
        let departures = departing.then_some(&settlement.departures[..]);
        let grazings = self.state.trajectory.grazings.len();
        let after = loop {
            let panels = self.state.trajectory.counters.panels;
            let Known { basis, rental } = self.known[*current];
            let (novelty, part) = (self.novelty, self.state.part());
            let allowed =
                |time: f64| rental.map_or(usize::MAX, |rental| rental.panels(novelty, part(time)));
            let end = search.follow(&mut self.state, motion, departures, &allowed);
            if let Some(rental) = &mut self.known[*current].rental {
                rental.add(self.state.trajectory.counters.panels - panels);
            }
            if !matches!(end, PhaseEnd::TooLong) {
                let Trajectory { bases, counters, .. } = &mut self.state.trajectory;
                counters.taylor_phases += usize::from(!bases[basis].is_modal());
            }
            match end {
                PhaseEnd::Event { after } => break Some(after),
                PhaseEnd::Stop(StopReason::Duration) if self.state.until < self.state.duration => {
                    break None;
                }
                PhaseEnd::Stop(reason) => return Ok(Some(reason)),
                PhaseEnd::TooLong => {
                    self.state.trajectory.grazings.truncate(grazings);
                    if let Err(error) = self.begin_again(*current, &settlement.statuses, motion) {
                        return Ok(Some(StopReason::Failed(RunFailure::Input(error))));
                    }
                }
            }
        };
        let before = self.state.time.seconds;
        self.advance(after, search);
        *at_this_instant = if self.state.time.seconds > before { 0 } else { *at_this_instant + 1 };
        // Each contact can pass each status once; more means that the event rule goes in circles.
        if *at_this_instant > 4 * self.state.scene.contacts.len() + 4 {
            let contact = search.triggers[0].0;
            return Ok(Some(self.ended_at_event(StopReason::Chattering { contact })));
        }
        let series = self.series(search);
        if let Err(failure) = self.settle(search, settlement, &series) {
            return Ok(Some(self.ended_at_event(StopReason::Failed(failure))));
        }
        // An event is part of the motion once the phase that it begins can be propagated.
        let left = &self.state.trajectory.bases[self.known[*current].basis];
        let returns = settlement.statuses == left.combination.statuses();
        if !returns || self.is_over(*current) {
            *current = match self.meet(&settlement.statuses) {
                Ok(current) => current,
                Err(error) => {
                    let failure = StopReason::Failed(RunFailure::Input(error));
                    return Ok(Some(self.ended_at_event(failure)));
                }
            };
        }
        let phase = self.state.trajectory.phases.len();
        let time = self.state.time.seconds;
        self.count_accumulations(settlement, &series);
        self.state.trajectory.events.extend(
            settlement.events.iter().map(|&(contact, kind)| Event { time, contact, kind, phase }),
        );
        let RunState { scene, trajectory, q, u, .. } = &mut self.state;
        let basis = &trajectory.bases[self.known[*current].basis];
        complete(scene, basis, settlement, q, u);
        motion.restart(basis, q, u);
        Ok(None)
    }

    /// Begins the phase in progress once more from its start, by modes.
    #[cold]
    fn begin_again(
        &mut self,
        current: usize,
        statuses: &[Status],
        motion: &mut Motion,
    ) -> Result<(), Error> {
        self.meet(statuses)?;
        let RunState { trajectory, q, u, .. } = &mut self.state;
        let basis = self.known[current].basis;
        if let Some(phase) = trajectory.phases.last_mut() {
            phase.basis = basis;
        }
        motion.restart(&trajectory.bases[basis], q, u);
        Ok(())
    }

    /// The end of the stretch that begins now.
    fn next_switch(&self) -> f64 {
        let RunState { scene, controls, switched, duration, .. } = &self.state;
        let next = scene.next_switch(*switched);
        next.map_or(*duration, |next| duration.min(next - controls.load_time))
    }

    /// Moves the clock on to the event that ends a phase; without one, a load is switched.
    fn advance(&mut self, after: Option<f64>, search: &mut PhaseSearch) {
        let RunState { scene, switched, time, until, q, .. } = &mut self.state;
        match after {
            Some(after) => *time = time.after(after),
            None => {
                *time = Clock { seconds: *until, rest: 0.0 };
                search.triggers.clear();
                search.triggers.push((NO_CONTACT, EventKind::Load));
                if let (Some(drive), Some(next)) = (&scene.drive, scene.next_switch(*switched)) {
                    *switched = next;
                    drive.switch(next, q);
                }
            }
        }
    }

    /// State, statuses and departures after the event that a phase has come to.
    fn settle(
        &mut self,
        search: &PhaseSearch,
        settlement: &mut Settlement,
        series: &Series,
    ) -> Result<(), RunFailure> {
        let RunState { scene, time, q, u, .. } = &mut self.state;
        let all = 0..scene.contacts.len();
        settle(scene, time.seconds, &search.triggers, all, settlement, series, q, u)
    }

    /// The states at the starts of some phases of a motion, the first of which is kept: the run is repeated from there.
    fn again(trajectory: &Trajectory, run: Repetition, first: usize, count: usize) -> Vec<f64> {
        let Repetition { duration, accumulation_tolerance, load_time, .. } = run;
        let controls = Controls { accumulation_tolerance, load_time, ..Controls::default() };
        let start = trajectory.phase_state(first);
        let (q, u) = start.parts();
        let mut run = Run::new(
            &trajectory.propagators,
            (q.to_vec(), u.to_vec()),
            duration,
            Method::Auto,
            controls,
        );
        let Phase { start, rest, basis } = &trajectory.phases[first];
        let basis = &trajectory.bases[*basis];
        run.state.time = Clock { seconds: *start, rest: *rest };
        let switches = trajectory.events.iter().filter(|event| event.kind == EventKind::Load);
        for _ in switches.take_while(|event| event.phase <= first) {
            let RunState { scene, switched, .. } = &mut run.state;
            *switched = scene.next_switch(*switched).unwrap_or(*switched);
        }
        // Earlier impacts decide whether a series over several contacts ends.
        let past = trajectory.events.partition_point(|event| event.phase <= first);
        let seen = past.saturating_sub(SEEN * run.state.scene.contacts.len());
        run.state.trajectory.events.extend_from_slice(&trajectory.events[seen..past]);
        let mut settlement = Settlement {
            statuses: basis.combination.statuses().to_vec(),
            departures: trajectory.states.departures(first).to_vec(),
            events: Vec::new(),
            rest: None,
        };
        let mut motion = Motion::new(run.state.scene, basis, &run.state.q, &run.state.u);
        let mut search = PhaseSearch::default();
        let mut states = [&run.state.q[..], &run.state.u].concat();
        for phase in first + 1..first + count {
            let departing = settlement.departures.iter().any(|&d| d != Departure::None);
            let departures = departing.then_some(&settlement.departures[..]);
            run.state.until = run.next_switch();
            let after =
                match search.follow(&mut run.state, &mut motion, departures, &|_| usize::MAX) {
                    PhaseEnd::Event { after } => Some(after),
                    PhaseEnd::Stop(StopReason::Duration) => None,
                    _ => unreachable!("what ended by an event does so again"),
                };
            run.advance(after, &mut search);
            let series = run.series(&search);
            let settled = run.settle(&search, &mut settlement, &series);
            debug_assert!(settled.is_ok());
            run.state.trajectory.events.extend(trajectory.events_at(phase).cloned());
            let basis = &trajectory.bases[trajectory.phases[phase].basis];
            let RunState { scene, q, u, .. } = &mut run.state;
            complete(scene, basis, &mut settlement, q, u);
            motion.restart(basis, q, u);
            states.extend_from_slice(&run.state.q);
            states.extend_from_slice(&run.state.u);
        }
        states
    }

    /// Ends the motion just before the event in progress, which no phase can follow.
    #[cold]
    fn ended_at_event(&mut self, reason: StopReason) -> StopReason {
        let Trajectory { events, accumulations, end, .. } = &mut self.state.trajectory;
        *end = self.state.time.seconds;
        accumulations.retain(|limit| limit.event < events.len());
        reason
    }

    /// The resolution of the clock, s.
    fn ulp(&self) -> f64 {
        self.state.time.seconds.next_up() - self.state.time.seconds
    }

    /// The limits for a series of impacts over several contacts at this instant.
    fn series(&self, search: &PhaseSearch) -> Series {
        if !self.state.scene.contacts_coupled() {
            return Series::default();
        }
        let struck = |contact| search.triggers.contains(&(contact, EventKind::Impact));
        let RunState { scene, q, .. } = &self.state;
        let places = (0..scene.structure()).map(|k| match scene.stiffness.get(k, k) {
            stiffness if stiffness > 0.0 => q[k].abs().max(scene.force[k].abs() / stiffness),
            _ => q[k].abs(),
        });
        let lengths = places.chain(scene.contacts.iter().map(|law| law.gap.abs()));
        let resolution = RESOLUTION * lengths.fold(0.0, f64::max);
        Series {
            resolution,
            gaps: search.gaps.iter().map(|gap| gap.max(resolution)).collect(),
            ratios: (0..self.state.scene.contacts.len())
                .map(|contact| self.ratio(contact, struck(contact)))
                .collect(),
            negligible: self.state.controls.accumulation_tolerance.max(self.ulp()),
            ulp: self.ulp(),
        }
    }

    /// The ratio of successive intervals between impacts of a contact; 0 if they do not shrink. Several impacts may make up one
    /// round of the series, so intervals are measured over as many impacts as there are, up to `ROUND`.
    fn ratio(&self, contact: usize, struck: bool) -> f64 {
        let earlier =
            self.state.trajectory.events.iter().rev().take(SEEN * self.state.scene.contacts.len());
        let strikes = earlier
            .take_while(|event| event.kind != EventKind::Accumulation || event.contact != contact)
            .filter(|event| event.contact == contact && event.kind == EventKind::Impact)
            .map(|event| event.time);
        let times: Vec<f64> = struck
            .then_some(self.state.time.seconds)
            .into_iter()
            .chain(strikes)
            .take(2 * ROUND + 1)
            .collect();
        let step = times.len().saturating_sub(1) / 2;
        if step == 0 {
            return 0.0;
        }
        let (last, before) = (times[0] - times[step], times[step] - times[2 * step]);
        match last / before {
            // The clock tells the impacts apart.
            ratio if ratio < 1.0 && last > self.ulp() => ratio.powf(1.0 / step as f64),
            _ => 0.0,
        }
    }

    /// Records the parts of series that the accumulations among the events to come leave out.
    fn count_accumulations(&mut self, settlement: &Settlement, series: &Series) {
        let first = self.state.trajectory.events.len();
        let limits = settlement.events.iter().enumerate();
        let limits = limits.filter(|(_, event)| event.1 == EventKind::Accumulation);
        let Some(rest) = settlement.rest else {
            // Of one contact: other contacts may have events at the same instant.
            for (k, _) in limits {
                if let Some(limit) = self.state.trajectory.accumulations.last_mut() {
                    limit.event = first + k;
                }
            }
            return;
        };
        for (k, &(contact, _)) in limits {
            let ratio = series.ratios[contact];
            let bounces = (rest / series.ulp).ln() / -ratio.ln();
            self.state.trajectory.accumulations.push(Accumulation {
                event: first + k,
                bounces: bounces.clamp(1.0, f64::MAX).ceil() as usize,
                error: rest,
            });
        }
    }

    /// The place of a combination among those known, with the basis that the phase to come is to have.
    fn meet(&mut self, statuses: &[Status]) -> Result<usize, Error> {
        let bases = &self.state.trajectory.bases;
        let compared = self.known.iter().take(COMPARED);
        let place = compared
            .map(|known| bases[known.basis].combination.statuses())
            .position(|known| known == statuses)
            .or_else(|| match self.places.is_empty() {
                true => None,
                false => self.places.get(&Combination::new(statuses.to_vec())).copied(),
            });
        self.novelty.count(place.is_none());
        if let Some(place) = place {
            if self.is_over(place) {
                let combination = bases[self.known[place].basis].combination.clone();
                let basis = self.find(&combination, Wanted::SoundModes)?;
                self.known[place] = Known { basis, rental: None };
            }
            return Ok(place);
        }
        let combination = Combination::new(statuses.to_vec());
        let free = self.state.scene.free(&combination);
        let renting = self.method == Method::Auto && free > AT_ONCE;
        let wanted = if renting { Wanted::Series } else { self.method.for_repeated_use() };
        let basis = self.find(&combination, wanted)?;
        let rental = renting.then(|| Rental::new(self.propagators.cost(free)));
        let place = self.known.len();
        self.known.push(Known { basis, rental });
        if place >= COMPARED {
            self.places.insert(combination, place);
        }
        Ok(place)
    }

    /// Whether the modes of a combination are worth their cost by now.
    fn is_over(&self, place: usize) -> bool {
        self.known[place].rental.is_some_and(|rental| {
            rental.is_over(self.novelty, self.state.part()(self.state.time.seconds))
        })
    }

    /// The place of a basis among those of the trajectory.
    fn find(&mut self, combination: &Combination, wanted: Wanted) -> Result<usize, Error> {
        let (basis, computed) = self.propagators.basis(combination, wanted)?;
        let Trajectory { counters, bases, .. } = &mut self.state.trajectory;
        counters.combinations += usize::from(computed);
        bases.push(basis);
        Ok(bases.len() - 1)
    }
}

/// Brings the coordinates that follow from others up to date as a phase begins, and adds the departures of those.
fn complete(
    scene: &Scene,
    basis: &CombinationBasis,
    settlement: &mut Settlement,
    q: &mut [f64],
    u: &mut [f64],
) {
    basis.complete(q, u);
    if !scene.massless.is_empty() {
        settlement.depart_with_bodies(scene, &basis.functions, q, u);
    }
    if !scene.dependents.is_empty() {
        settlement.depart(scene, 0..scene.contacts.len(), q, u);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::admissible_start::start_coordinates;
    use crate::linalg::SparseMatrix;
    use crate::motion::propagators::Part;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput, Springs};

    #[test]
    fn uncoupled_parts_are_not_run_as_one() {
        let contact = |part: usize| ContactInput {
            tangential: Some(Direction::Dof(2 * part)),
            normal: Some(Direction::Dof(2 * part + 1)),
            normal_force: 0.0,
            friction: 0.5,
            static_friction: 0.7,
            slider_speed: 0.1,
            restitution: 0.0,
            gap: 0.0,
            springs: Springs::default(),
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0; 4]),
            stiffness: SparseMatrix::diagonal(&[3e4, 5e4, 4e4, 6e4]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 1e-5 },
            gyroscopic: None,
            circulatory: None,
            force: vec![0.0, -20.0, 0.0, -20.0],
            contacts: vec![contact(0), contact(1)],
            impact_friction: false,
            loads: Default::default(),
        };
        let scene = Arc::new(Scene::new(input).expect("well-posed"));
        let start = scene.sliding_equilibrium().expect("pressed on");
        let state = start_coordinates(&scene, &start).expect("admissible");
        let whole = Arc::new(Propagators::new(scene));
        assert_eq!(whole.parts().len(), 2);
        let ended = |propagators: &Arc<Propagators>, state, combination: &Combination| {
            let mut run = Run::new(propagators, state, 0.1, Method::Auto, Controls::default());
            let mut progress = run.begin(combination).expect("modes");
            run.step(&mut progress).expect("a phase")
        };
        let refused = ended(&whole, state.clone(), &start.combination);
        assert!(matches!(refused, Some(StopReason::Failed(RunFailure::Internal(_)))));
        for Part { block, propagators } in whole.parts() {
            let state = (block.gather(&state.0), block.gather(&state.1));
            let combination = block.statuses(&start.combination);
            assert_eq!(ended(propagators, state, &combination), Some(StopReason::Duration));
        }
    }
}
