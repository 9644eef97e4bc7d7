//! Parts of a scene that neither a matrix nor a contact couples: found once, run separately, put together at the end.
//!
//! Each part has its own clock, so that an event in one costs the others nothing, and its own combinations, so that their
//! number is the sum over the parts and not the product.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::contact::event_kind::NO_CONTACT;
use crate::error::{Error, RunFailure};
use crate::motion::method::Method;
use crate::motion::propagators::{Part, Propagators};
use crate::scene::partition::Block;
use crate::scene::status::{Combination, Status};
use crate::transient::run::{Progress, Run};
use crate::transient::run_state::Controls;
use crate::transient::trajectory::{
    Accumulation, Counters, Cursor, Event, Grazing, Phase, StopReason, Trajectory,
};

/// One block of a run in progress.
struct PartRun<'a> {
    block: &'a Block,
    run: Run<'a>,
    progress: Progress,
    stopped: Option<StopReason>,
}

impl PartRun<'_> {
    fn is_behind(&self, end: f64) -> bool {
        let begun = !self.run.state.trajectory.phases.is_empty();
        self.stopped.is_none() && !(begun && self.run.state.time.seconds >= end)
    }
}

/// Runs all blocks from (q, q'), always the one that is furthest behind, and puts them together.
pub(crate) fn simulate(
    propagators: &Arc<Propagators>,
    (q, u): (&[f64], &[f64]),
    combination: &Combination,
    duration: f64,
    method: Method,
    controls: Controls<'_>,
) -> Result<Trajectory, Error> {
    // The whole motion, which keeps all states, is put together from those of its parts.
    let part_controls = Controls { kept_numbers: Some(usize::MAX), ..controls };
    let mut parts = Vec::with_capacity(propagators.parts().len());
    for Part { block, propagators } in propagators.parts() {
        let state = (block.gather(q), block.gather(u));
        let mut run = Run::new(propagators, state, duration, method, part_controls);
        let progress = run.begin(&block.statuses(combination))?;
        parts.push(PartRun { block, run, progress, stopped: None });
    }
    let mut end = duration;
    let contacts = propagators.scene.contacts.len();
    let enough = controls.max_events.map(|most| most.saturating_add(contacts));
    // Up to `end`, the earliest time at which one of them stops.
    while let Some(part) = parts
        .iter_mut()
        .filter(|part| part.is_behind(end))
        .min_by(|a, b| a.run.state.time.seconds.total_cmp(&b.run.state.time.seconds))
    {
        part.stopped = part.run.step(&mut part.progress)?;
        if part.stopped.is_some() {
            end = end.min(part.run.state.trajectory.end);
        }
        let events =
            || parts.iter().map(|part| part.run.state.trajectory.events.len()).sum::<usize>();
        if enough.is_some_and(|enough| events() >= enough) {
            // All but the events at the last instant of each block are in order.
            let open = parts.iter().filter(|part| part.stopped.is_none());
            end = open.map(|part| part.run.state.time.seconds).fold(end, f64::min);
            break;
        }
    }
    let reason = parts.iter().filter(|part| part.run.state.trajectory.end <= end).find_map(
        |part| match &part.stopped {
            None | Some(StopReason::Duration) => None,
            Some(reason) => Some(in_whole(reason.clone(), part.block)),
        },
    );
    let blocks: Vec<(&Block, Trajectory)> =
        parts.into_iter().map(|part| (part.block, part.run.state.trajectory)).collect();
    let mut whole = put_together(propagators, &blocks, end, method)?;
    whole.stop_reason = reason.unwrap_or(StopReason::Duration);
    if let Some(most) = controls.max_events {
        stop_after(&mut whole, most);
    }
    whole.counters.phases = whole.phases.len();
    Ok(whole)
}

/// A reason that names contacts by their numbers in the whole scene.
fn in_whole(reason: StopReason, block: &Block) -> StopReason {
    match reason {
        StopReason::Chattering { contact } => {
            StopReason::Chattering { contact: block.contacts[contact] }
        }
        StopReason::Failed(RunFailure::NoConsistentStatus {
            contact,
            time,
            normal_force,
            required_friction,
        }) => StopReason::Failed(RunFailure::NoConsistentStatus {
            contact: block.contacts[contact],
            time,
            normal_force,
            required_friction,
        }),
        StopReason::Failed(RunFailure::ContactProblem {
            contacts,
            time,
            level,
            count,
            slip,
            reactions,
        }) => StopReason::Failed(RunFailure::ContactProblem {
            contacts: contacts.into_iter().map(|contact| block.contacts[contact]).collect(),
            time,
            level,
            count,
            slip,
            reactions,
        }),
        reason => reason,
    }
}

/// One phase of the whole wherever a block begins one, up to `end`.
fn put_together(
    propagators: &Arc<Propagators>,
    blocks: &[(&Block, Trajectory)],
    end: f64,
    method: Method,
) -> Result<Trajectory, Error> {
    // Key: start time, and how many phases of that block began at the same instant before. Value: (block, phase).
    let mut instants: BTreeMap<(u64, usize), Vec<(usize, usize)>> = BTreeMap::new();
    for (b, (_, run)) in blocks.iter().enumerate() {
        let mut before = 0;
        for (index, phase) in
            run.phases.iter().enumerate().take_while(|(_, phase)| phase.start <= end)
        {
            let repeated = index > 0 && run.phases[index - 1].start == phase.start;
            before = if repeated { before + 1 } else { 0 };
            // Times are not negative, so that their bits are ordered as they are.
            instants.entry((phase.start.to_bits(), before)).or_default().push((b, index));
        }
    }
    let scene = &propagators.scene;
    let mut whole = Trajectory::new(propagators);
    whole.end = end;
    whole.phases.reserve_exact(instants.len());
    whole.states.reserve(instants.len());
    let mut cursors: Vec<Cursor<'_>> = blocks.iter().map(|(_, run)| Cursor::new(run)).collect();
    let mut current = vec![0; blocks.len()];
    let mut statuses = vec![Status::Detached; scene.contacts.len()];
    let (mut q, mut u) = (vec![0.0; scene.size], vec![0.0; scene.size]);
    for ((time, _), begun) in instants {
        let time = f64::from_bits(time);
        let mut rest = 0.0;
        for &(b, index) in &begun {
            let (block, run) = &blocks[b];
            current[b] = index;
            rest = run.phases[index].rest;
            let combination = run.combination_of(index);
            for (&contact, &status) in block.contacts.iter().zip(combination.statuses()) {
                statuses[contact] = status;
            }
        }
        for (((block, run), cursor), &index) in blocks.iter().zip(&mut cursors).zip(&current) {
            cursor.seek_local(index, time - run.phases[index].start);
            block.scatter(&cursor.q, &mut q);
            block.scatter(&cursor.u, &mut u);
        }
        let phase = whole.phases.len();
        let combination = Combination::new(statuses.clone());
        let bases = blocks
            .iter()
            .zip(&current)
            .map(|((_, run), &index)| &run.bases[run.phases[index].basis]);
        let basis = if bases.clone().all(|basis| basis.is_modal()) {
            propagators.basis(&combination, method.for_repeated_use())?.0
        } else {
            Arc::new(propagators.of_parts(combination, bases.cloned())?)
        };
        let place = whole.bases.iter().position(|known| Arc::ptr_eq(known, &basis));
        whole.phases.push(Phase { start: time, rest, basis: place.unwrap_or(whole.bases.len()) });
        if place.is_none() {
            whole.bases.push(basis);
        }
        whole.states.push(&q, &u, &[]);
        let mut events: Vec<(Event, Option<Accumulation>)> = Vec::new();
        for &(b, index) in &begun {
            let (block, run) = &blocks[b];
            let first = run.events.partition_point(|event| event.phase < index);
            for (k, event) in run.events_at(index).enumerate() {
                let limit =
                    run.accumulations.binary_search_by_key(&(first + k), |limit| limit.event);
                let contact = block.contacts.get(event.contact).copied().unwrap_or(NO_CONTACT);
                let limit = limit.ok().map(|limit| run.accumulations[limit]);
                events.push((Event { contact, phase, ..event.clone() }, limit));
            }
        }
        // A load that is switched is one event, of all parts.
        events.sort_by_key(|(event, _)| event.contact.wrapping_add(1));
        events.dedup_by(|next, kept| next.0 == kept.0);
        for (event, limit) in events {
            whole
                .accumulations
                .extend(limit.map(|limit| Accumulation { event: whole.events.len(), ..limit }));
            whole.events.push(event);
        }
    }
    for (block, run) in blocks {
        let in_time = run.grazings.iter().filter(|touch| touch.time <= end);
        whole.grazings.extend(
            in_time.map(|touch| Grazing { contact: block.contacts[touch.contact], ..*touch }),
        );
        let Counters {
            phases: _,
            panels,
            leaps,
            refinements,
            combinations,
            taylor_phases,
            expansions: _,
        } = run.counters;
        whole.counters.panels += panels;
        whole.counters.leaps += leaps;
        whole.counters.refinements += refinements;
        whole.counters.combinations += combinations;
        whole.counters.taylor_phases += taylor_phases;
    }
    whole.grazings.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(whole)
}

/// Ends the motion with the phase in which the number of events reaches `most`.
fn stop_after(run: &mut Trajectory, most: usize) {
    let last = match most.checked_sub(1) {
        None => 0,
        Some(last) => match run.events.get(last) {
            Some(event) => event.phase,
            None => return,
        },
    };
    run.phases.truncate(last + 1);
    run.states.truncate(last + 1);
    run.events.truncate(run.events.partition_point(|event| event.phase <= last));
    run.end = run.phases[last].start;
    run.grazings.retain(|touch| touch.time <= run.end);
    run.accumulations.retain(|limit| limit.event < run.events.len());
    run.stop_reason = StopReason::MaxEvents;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::admissible_start::start_coordinates;
    use crate::linalg::SparseMatrix;
    use crate::scene::{ContactInput, Damping, Direction, Mass, Scene, SceneInput, Springs};

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
