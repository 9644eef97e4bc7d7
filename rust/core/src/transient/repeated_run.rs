//! A run that is repeated from one of its kept states, for the states between that and the next.

use crate::contact::event_kind::EventKind;
use crate::error::run::RunFailure;
use crate::transient::clock::Clock;
use crate::transient::impact_series::SEEN;
use crate::transient::run::PhaseByPhase;
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::phase::PhaseEnd;
use crate::transient::trajectory::model::{Phase, Repetition, Trajectory};
use crate::transient::trajectory::used_bases::HeldBases;

/// How a run is repeated.
pub(crate) fn repetition(duration: f64, controls: &Controls<'_>) -> Repetition {
    let Controls { accumulation_tolerance, load_time, .. } = *controls;
    Repetition { duration, accumulation_tolerance, load_time, again }
}

/// The states at the starts of some phases of a motion, the first of which is kept: the run is repeated from there. Its
/// events come at the same instants to the last bit.
fn again(
    trajectory: &Trajectory,
    run: Repetition,
    first: usize,
    count: usize,
) -> Result<Vec<f64>, RunFailure> {
    let Repetition { duration, accumulation_tolerance, load_time, .. } = run;
    let controls = Controls { accumulation_tolerance, load_time, ..Controls::default() };
    let start = trajectory.phase_state(first);
    let (q, u) = start.parts();
    let start = (q.to_vec(), u.to_vec());
    let mut state = RunState::new(&trajectory.propagators, start, duration, controls);
    let Phase { start, rest, basis } = trajectory.phases[first];
    state.time = Clock { seconds: start, rest };
    let switches = trajectory.events.iter().filter(|event| event.kind == EventKind::Load);
    for _ in switches.take_while(|event| event.phase <= first) {
        state.switched = state.scene.next_switch(state.switched).unwrap_or(state.switched);
    }
    // Earlier impacts decide whether a series over several contacts ends.
    let past = trajectory.events.partition_point(|event| event.phase <= first);
    let seen = past.saturating_sub(SEEN * state.scene.contacts.len());
    state.trajectory.events.extend_from_slice(&trajectory.events[seen..past]);
    let mut held = HeldBases::default();
    let basis = held.get(&trajectory.bases, &trajectory.propagators, basis);
    let departures = trajectory.states.departures(first).to_vec();
    let mut phases = PhaseByPhase::new(&state, basis, departures);
    let mut states = [&state.q[..], &state.u].concat();
    for phase in first + 1..first + count {
        let after = match phases.follow(&mut state, &|_| usize::MAX) {
            PhaseEnd::Event { after } => Some(after),
            PhaseEnd::Switch => None,
            _ => return Err(differs(phase)),
        };
        phases.advance(&mut state, after);
        let Phase { start, rest, basis } = trajectory.phases[phase];
        if state.time != (Clock { seconds: start, rest }) {
            return Err(differs(phase));
        }
        phases.settle(&mut state)?;
        state.trajectory.events.extend(trajectory.events_at(phase).cloned());
        let basis = held.get(&trajectory.bases, &trajectory.propagators, basis);
        phases.begin(&mut state, basis);
        states.extend_from_slice(&state.q);
        states.extend_from_slice(&state.u);
    }
    Ok(states)
}

fn differs(phase: usize) -> RunFailure {
    RunFailure::Internal(format!("phase {phase} of the motion does not begin again where it did"))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::motion::method::Method;
    use crate::motion::propagators::Propagators;
    use crate::scene::{ContactInput, Damping, Direction, Mass, Scene, SceneInput};
    use crate::transient::simulate::simulate;

    /// 1 kg on a spring, pressed onto a belt of 0.1 m/s.
    fn block(stiffness: f64) -> Arc<Propagators> {
        let belt = ContactInput {
            tangential: Some(Direction::Dof(0)),
            normal: Some(Direction::Dof(1)),
            friction: 0.5,
            static_friction: 1.0,
            slider_speed: 0.1,
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0; 2]),
            stiffness: SparseMatrix::diagonal(&[stiffness, 1.0]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
            force: vec![0.0, -1.0],
            contacts: vec![belt],
            ..Default::default()
        };
        Arc::new(Propagators::new(Arc::new(Scene::new(input).expect("well-posed"))))
    }

    /// Of another scene, to another end, or through phases that begin elsewhere, states would be those of another motion.
    #[test]
    fn a_run_that_does_not_come_again_is_an_error() {
        let scene = block(1.0);
        let start = scene.bare().sliding_equilibrium().expect("pressed on");
        let start = crate::scene::State { velocity: vec![-0.15, 0.0], ..start };
        let run = || {
            let controls = Controls::default();
            simulate(&scene, &start, 100.0, Method::Auto, controls).expect("a run")
        };
        let mut one = run();
        let usual = repetition(100.0, &Controls::default());
        let repeat = |run: &Trajectory, how: Repetition| again(run, how, 0, 4).map(|all| all.len());
        assert_eq!(repeat(&one, usual), Ok(16));
        assert!(repeat(&one, Repetition { duration: 1e-3, ..usual }).is_err());
        one.phases[2].start = one.phases[2].start.next_up();
        assert!(repeat(&one, usual).is_err());
        let mut other = run();
        other.propagators = block(1.0_f64.next_up());
        assert!(repeat(&other, usual).is_err());
    }
}
