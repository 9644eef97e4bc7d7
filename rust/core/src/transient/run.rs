//! One run: phase, first event, settlement, next phase.

use std::sync::Arc;

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
use crate::scene::status::Combination;
use crate::transient::impact_series::{look_back, record_events};
use crate::transient::met_combinations::MetCombinations;
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::phase::{PhaseEnd, PhaseSearch};
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::kept_states::{KEPT, KeptStates};
use crate::transient::trajectory::model::{Phase, Trajectory};

/// A run in progress.
pub(crate) struct Run<'a> {
    pub state: RunState<'a>,
    met: MetCombinations<'a>,
    /// Place of the combination of the phase in progress among those met.
    current: usize,
    phases: PhaseByPhase,
}

/// One phase after the other, whatever finds the basis of the next one.
pub(crate) struct PhaseByPhase {
    pub settlement: Settlement,
    series: Series,
    motion: Motion,
    search: PhaseSearch,
}

impl PhaseByPhase {
    /// The phase that begins in a state, with the multiplicities with which its event functions leave zero.
    pub fn new(
        state: &RunState<'_>,
        basis: &Arc<CombinationBasis>,
        departures: Vec<Departure>,
    ) -> Self {
        let statuses = basis.combination.statuses().to_vec();
        Self {
            settlement: Settlement { statuses, departures, events: Vec::new(), rest: None },
            series: Series::default(),
            motion: Motion::new(state.scene, basis, &state.q, &state.u),
            search: PhaseSearch::default(),
        }
    }

    /// Follows the phase to its end. `allowed(t)`: the number of panels it may take to reach time t, s.
    pub fn follow(&mut self, state: &mut RunState<'_>, allowed: &dyn Fn(f64) -> usize) -> PhaseEnd {
        state.until = state.next_switch();
        let departures = &self.settlement.departures[..];
        let departing = departures.iter().any(|&d| d != Departure::None);
        self.search.follow(state, &mut self.motion, departing.then_some(departures), allowed)
    }

    /// Moves on to the end of the phase, `after` its start; without an event, a load is switched there.
    pub fn advance(&mut self, state: &mut RunState<'_>, after: Option<f64>) {
        state.advance(after);
        if after.is_none() {
            self.search.triggers.clear();
            self.search.triggers.push((NO_CONTACT, EventKind::Load));
        }
    }

    /// State, statuses and departures after the event that the phase has come to.
    pub fn settle(&mut self, state: &mut RunState<'_>) -> Result<(), RunFailure> {
        look_back(&mut self.series, state, &self.search);
        let RunState { scene, time, q, u, .. } = state;
        let all = 0..scene.contacts.len();
        let triggers = &self.search.triggers;
        settle(scene, time.seconds, triggers, all, &mut self.settlement, &self.series, q, u)
    }

    /// Begins the next phase. Coordinates that follow from others come up to date, and with them their departures.
    pub fn begin(&mut self, state: &mut RunState<'_>, basis: &Arc<CombinationBasis>) {
        let RunState { scene, q, u, .. } = state;
        basis.complete(q, u);
        if !scene.massless.is_empty() {
            self.settlement.depart_with_bodies(scene, &basis.functions, q, u);
        }
        if !scene.dependents.is_empty() {
            self.settlement.depart(scene, 0..scene.contacts.len(), q, u);
        }
        self.motion.restart(basis, q, u);
    }
}

impl<'a> Run<'a> {
    /// A run from (q, q') at time 0.
    pub fn new(
        propagators: &'a Arc<Propagators>,
        start: (Vec<f64>, Vec<f64>),
        combination: &Combination,
        duration: f64,
        method: Method,
        controls: Controls<'a>,
    ) -> Result<Self, Error> {
        let mut state = RunState::new(propagators, start, duration, controls);
        let (scene, kept) = (state.scene, controls.kept_numbers.unwrap_or(KEPT));
        state.trajectory.states = KeptStates::new(scene.size, scene.contacts.len(), kept);
        let mut met = MetCombinations::new(propagators, method);
        let current = met.meet(&mut state, combination.statuses())?;
        let basis = met.held(&state.trajectory, current);
        let departures = initial_departures(scene, combination, &state.q, &state.u);
        let phases = PhaseByPhase::new(&state, basis, departures);
        Ok(Self { state, met, current, phases })
    }

    /// Follows one phase and settles the event that ends it; the reason if the motion ends before.
    pub fn step(&mut self) -> Option<StopReason> {
        match self.next_phase() {
            Ok(reason) => reason,
            Err(failure) => Some(self.ended_here(StopReason::Failed(failure))),
        }
    }

    fn next_phase(&mut self) -> Result<Option<StopReason>, RunFailure> {
        let RunState { trajectory, time, q, u, .. } = &mut self.state;
        let basis = self.met.basis(self.current);
        trajectory.phases.push(Phase { start: time.seconds, rest: time.rest, basis });
        trajectory.states.push(q, u, &self.phases.settlement.departures);
        let begin = time.seconds;
        trajectory.end = begin;
        if let Some(reason) = self.state.enough(begin) {
            return Ok(Some(reason));
        }
        let grazings = self.state.trajectory.grazings.len();
        let after = loop {
            let panels = self.state.trajectory.counters.panels;
            let basis = self.met.basis(self.current);
            let allowed = self.met.allowed_panels(self.current, &self.state);
            let end = self.phases.follow(&mut self.state, &allowed);
            let Trajectory { bases, counters, .. } = &mut self.state.trajectory;
            self.met.add_panels(self.current, counters.panels - panels);
            if !matches!(end, PhaseEnd::TooLong) {
                counters.taylor_phases += usize::from(!bases[basis].is_modal());
            }
            match end {
                PhaseEnd::Event { after } => break Some(after),
                PhaseEnd::Switch => break None,
                PhaseEnd::Stop(reason) => return Ok(Some(reason)),
                PhaseEnd::TooLong => {
                    self.state.trajectory.grazings.truncate(grazings);
                    self.begin_again()?;
                }
            }
        };
        self.phases.advance(&mut self.state, after);
        let moves_on = self.state.time.seconds > begin;
        if self.state.goes_in_circles(moves_on) {
            let contact = self.phases.search.triggers[0].0;
            return Ok(Some(self.ended_here(StopReason::Chattering { contact })));
        }
        self.phases.settle(&mut self.state)?;
        // An event is part of the motion once the phase that it begins can be propagated.
        let PhaseByPhase { settlement, series, search, .. } = &self.phases;
        let left = &self.state.trajectory.bases[self.met.basis(self.current)];
        let returns = settlement.statuses == left.combination.statuses();
        if !returns || self.met.is_over(self.current, &self.state) {
            self.current = self.met.meet(&mut self.state, &settlement.statuses)?;
        }
        let RunState { trajectory, time, .. } = &mut self.state;
        record_events(trajectory, time.seconds, settlement, series, &search.limits);
        let basis = self.met.held(trajectory, self.current);
        self.phases.begin(&mut self.state, basis);
        Ok(None)
    }

    /// Begins the phase in progress once more from its start, by modes.
    #[cold]
    fn begin_again(&mut self) -> Result<(), Error> {
        self.met.meet(&mut self.state, &self.phases.settlement.statuses)?;
        let RunState { trajectory, q, u, .. } = &mut self.state;
        let basis = self.met.basis(self.current);
        if let Some(phase) = trajectory.phases.last_mut() {
            phase.basis = basis;
        }
        let basis = self.met.held(trajectory, self.current);
        self.phases.motion.restart(basis, q, u);
        Ok(())
    }

    /// Ends the motion at the clock: just before the event in progress, if no phase can follow it.
    #[cold]
    fn ended_here(&mut self, reason: StopReason) -> StopReason {
        self.state.trajectory.end = self.state.time.seconds;
        reason
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::admissible_start::start_coordinates;
    use crate::linalg::SparseMatrix;
    use crate::motion::propagators::Part;
    use crate::scene::{ContactInput, Damping, Direction, Mass, Scene, SceneInput};

    #[test]
    fn uncoupled_parts_are_not_run_as_one() {
        let contact = |part: usize| ContactInput {
            tangential: Some(Direction::Dof(2 * part)),
            normal: Some(Direction::Dof(2 * part + 1)),
            friction: 0.5,
            static_friction: 0.7,
            slider_speed: 0.1,
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0; 4]),
            stiffness: SparseMatrix::diagonal(&[3e4, 5e4, 4e4, 6e4]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 1e-5 },
            force: vec![0.0, -20.0, 0.0, -20.0],
            contacts: vec![contact(0), contact(1)],
            ..Default::default()
        };
        let scene = Arc::new(Scene::new(input).expect("well-posed"));
        let start = scene.sliding_equilibrium().expect("pressed on");
        let state = start_coordinates(&scene, &start).expect("admissible");
        let whole = Arc::new(Propagators::new(scene));
        assert_eq!(whole.parts().len(), 2);
        let ended = |propagators: &Arc<Propagators>, state, combination: &Combination| {
            let controls = Controls::default();
            let run = Run::new(propagators, state, combination, 0.1, Method::Auto, controls);
            run.expect("modes").step()
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
