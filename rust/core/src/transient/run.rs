//! One run: phase, first event, settlement, next phase.

use std::sync::Arc;
use std::time::Instant;

use crate::contact::admissible_start::initial_departures;
use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::contact::settlement::{Departure, Series, Settlement};
use crate::contact::transition::settle;
use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::Method;
use crate::motion::phase_motion::Motion;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};
use crate::transient::clock::Clock;
use crate::transient::impact_series::{count_accumulations, explained_events, series};
use crate::transient::met_combinations::MetCombinations;
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::phase::{PhaseEnd, PhaseSearch};
use crate::transient::trajectory::events::{Event, StopReason};
use crate::transient::trajectory::kept_states::{KEPT, KeptStates};
use crate::transient::trajectory::model::{Phase, Trajectory};
use crate::transient::trajectory::used_bases::HeldBases;

/// A run in progress.
pub(crate) struct Run<'a> {
    pub state: RunState<'a>,
    met: MetCombinations<'a>,
    held: HeldBases,
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
            met: MetCombinations::new(propagators, method),
            held: HeldBases::default(),
        }
    }

    pub fn begin(&mut self, combination: &Combination) -> Result<Progress, Error> {
        let current = self.met.meet(&mut self.state, combination.statuses())?;
        let basis = self.held.get(
            &self.state.trajectory.bases,
            &self.state.trajectory.propagators,
            self.met.basis(current),
        );
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
        let basis = self.met.basis(*current);
        trajectory.phases.push(Phase { start: time.seconds, rest: time.rest, basis });
        trajectory.states.push(q, u, &settlement.departures);
        trajectory.end = time.seconds;
        if let Some(reason) = controls.enough(trajectory.events.len(), time.seconds) {
            return Ok(Some(reason));
        }
        self.state.until = self.next_switch();
        let departures = departing.then_some(&settlement.departures[..]);
        let grazings = self.state.trajectory.grazings.len();
        let after = loop {
            let panels = self.state.trajectory.counters.panels;
            let basis = self.met.basis(*current);
            let allowed = self.met.allowed_panels(*current, &self.state);
            let end = search.follow(&mut self.state, motion, departures, &allowed);
            self.met.add_panels(*current, self.state.trajectory.counters.panels - panels);
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
        // More means that the event rule goes in circles.
        if *at_this_instant > 0 && *at_this_instant > explained_events(self.state.scene) {
            let contact = search.triggers[0].0;
            return Ok(Some(self.ended_at_event(StopReason::Chattering { contact })));
        }
        let series = series(&self.state, search);
        if let Err(failure) = self.settle(search, settlement, &series) {
            return Ok(Some(self.ended_at_event(StopReason::Failed(failure))));
        }
        // An event is part of the motion once the phase that it begins can be propagated.
        let left = &self.state.trajectory.bases[self.met.basis(*current)];
        let returns = settlement.statuses == left.combination.statuses();
        if !returns || self.met.is_over(*current, &self.state) {
            *current = match self.met.meet(&mut self.state, &settlement.statuses) {
                Ok(current) => current,
                Err(error) => {
                    let failure = StopReason::Failed(RunFailure::Input(error));
                    return Ok(Some(self.ended_at_event(failure)));
                }
            };
        }
        let phase = self.state.trajectory.phases.len();
        let time = self.state.time.seconds;
        count_accumulations(&mut self.state.trajectory, settlement, &series, &search.limits);
        self.state.trajectory.events.extend(
            settlement.events.iter().map(|&(contact, kind)| Event { time, contact, kind, phase }),
        );
        let RunState { scene, trajectory, q, u, .. } = &mut self.state;
        let basis =
            self.held.get(&trajectory.bases, &trajectory.propagators, self.met.basis(*current));
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
        self.met.meet(&mut self.state, statuses)?;
        let RunState { trajectory, q, u, .. } = &mut self.state;
        let basis = self.met.basis(current);
        if let Some(phase) = trajectory.phases.last_mut() {
            phase.basis = basis;
        }
        motion.restart(self.held.get(&trajectory.bases, &trajectory.propagators, basis), q, u);
        Ok(())
    }

    /// The end of the stretch that begins now.
    pub(super) fn next_switch(&self) -> f64 {
        let RunState { scene, controls, switched, duration, .. } = &self.state;
        let next = scene.next_switch(*switched);
        next.map_or(*duration, |next| duration.min(next - controls.load_time))
    }

    /// Moves the clock on to the event that ends a phase; without one, a load is switched.
    pub(super) fn advance(&mut self, after: Option<f64>, search: &mut PhaseSearch) {
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
    pub(super) fn settle(
        &mut self,
        search: &PhaseSearch,
        settlement: &mut Settlement,
        series: &Series,
    ) -> Result<(), RunFailure> {
        let RunState { scene, time, q, u, .. } = &mut self.state;
        let all = 0..scene.contacts.len();
        settle(scene, time.seconds, &search.triggers, all, settlement, series, q, u)
    }

    /// Ends the motion just before the event in progress, which no phase can follow.
    #[cold]
    fn ended_at_event(&mut self, reason: StopReason) -> StopReason {
        self.state.trajectory.end = self.state.time.seconds;
        reason
    }
}

/// Brings the coordinates that follow from others up to date as a phase begins, and adds the departures of those.
pub(super) fn complete(
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
