//! Parts of a scene that neither a matrix nor a contact couples: found once, run apart, put together at the end.
//!
//! Each keeps its own clock, so that an event in one leaves the others alone; and its own combinations, whose
//! number is the sum of those of the parts instead of their product.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::basis::CombinationBasis;
use crate::coordinates::Coordinates;
use crate::error::{Error, RunFailure};
use crate::matrix::SparseMatrix;
use crate::scene::Scene;
use crate::simulation::{Controls, Method, Progress, Run};
use crate::status::{Combination, Status};
use crate::trajectory::{
    Accumulation, Counters, Cursor, Event, Grazing, Phase, StopReason, Trajectory,
};

/// One part, as a scene of its own in contact coordinates.
#[derive(Debug)]
pub(crate) struct Block {
    pub scene: Arc<Scene>,
    /// Its coordinates and contacts in the whole scene, ascending.
    pub coordinates: Vec<usize>,
    pub contacts: Vec<usize>,
}

impl Block {
    pub fn statuses(&self, whole: &Combination) -> Combination {
        let statuses = whole.statuses();
        Combination::new(self.contacts.iter().map(|&contact| statuses[contact]).collect())
    }

    pub fn gather(&self, whole: &[f64]) -> Vec<f64> {
        self.coordinates.iter().map(|&k| whole[k]).collect()
    }

    pub fn scatter(&self, part: &[f64], whole: &mut [f64]) {
        self.coordinates.iter().zip(part).for_each(|(&k, value)| whole[k] = *value);
    }
}

/// The blocks of a scene; none if all of it is coupled.
pub(crate) fn blocks_of(scene: &Scene) -> Vec<Arc<Block>> {
    let n = scene.size;
    let mut root: Vec<usize> = (0..n).collect();
    fn find(root: &mut [usize], mut k: usize) -> usize {
        while root[k] != k {
            root[k] = root[root[k]];
            k = root[k];
        }
        k
    }
    let mut join = |i: usize, j: usize| {
        let (a, b) = (find(&mut root, i), find(&mut root, j));
        root[a.max(b)] = a.min(b);
    };
    for matrix in [&scene.mass, &scene.damping, &scene.stiffness] {
        for i in 0..n {
            matrix.row(i).filter(|entry| entry.1 != 0.0).for_each(|(j, _)| join(i, j));
        }
    }
    scene.contacts.iter().for_each(|contact| join(contact.tangential, contact.normal));
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for k in 0..n {
        members.entry(find(&mut root, k)).or_default().push(k);
    }
    if members.len() == 1 {
        return Vec::new();
    }
    members.into_values().map(|coordinates| Arc::new(block(scene, coordinates))).collect()
}

fn block(scene: &Scene, coordinates: Vec<usize>) -> Block {
    let place = |k: usize| coordinates.binary_search(&k).ok();
    let contacts: Vec<usize> = (0..scene.contacts.len())
        .filter(|&contact| place(scene.contacts[contact].normal).is_some())
        .collect();
    let laws = contacts.iter().map(|&contact| {
        let mut law = scene.contacts[contact].clone();
        for slot in [&mut law.tangential, &mut law.normal] {
            *slot = place(*slot).unwrap_or_default();
        }
        law
    });
    let laws: Vec<_> = laws.collect();
    let rows: Vec<usize> =
        contacts.iter().flat_map(|&contact| [2 * contact, 2 * contact + 1]).collect();
    let all = 2 * scene.contacts.len();
    let delassus = scene.coordinates.delassus.as_ref().and_then(|whole| {
        let part: Vec<f64> =
            rows.iter().flat_map(|&i| rows.iter().map(move |&j| whole[i * all + j])).collect();
        let coupled = (0..part.len()).any(|k| k / rows.len() != k % rows.len() && part[k] != 0.0);
        coupled.then_some(part)
    });
    let matrix = |whole: &SparseMatrix| whole.restricted(&coordinates);
    let part = Scene {
        size: coordinates.len(),
        impact_friction: scene.impact_friction,
        coordinates: Coordinates::of_contacts(
            laws.iter().map(|law| (law.tangential, law.normal)).collect(),
            delassus,
        ),
        contacts: laws,
        mass: matrix(&scene.mass),
        lumped: scene.lumped,
        damping: matrix(&scene.damping),
        proportional: scene.proportional,
        stiffness: matrix(&scene.stiffness),
        force: coordinates.iter().map(|&k| scene.force[k]).collect(),
        bases: Default::default(),
        blocks: Default::default(),
    };
    Block { scene: Arc::new(part), coordinates, contacts }
}

/// One block of a run in progress.
struct Part<'a> {
    block: &'a Block,
    run: Run<'a>,
    progress: Progress,
    stopped: Option<StopReason>,
}

impl Part<'_> {
    fn is_behind(&self, end: f64) -> bool {
        let begun = !self.run.trajectory.phases.is_empty();
        self.stopped.is_none() && !(begun && self.run.time.seconds >= end)
    }
}

/// Runs all blocks from (q, q'), always the one that is furthest behind, and puts them together.
pub(crate) fn simulate(
    scene: &Arc<Scene>,
    (q, u): (&[f64], &[f64]),
    combination: &Combination,
    duration: f64,
    method: Method,
    controls: Controls<'_>,
) -> Result<Trajectory, Error> {
    let mut parts = Vec::with_capacity(scene.blocks().len());
    for block in scene.blocks() {
        let state = (block.gather(q), block.gather(u));
        let mut run = Run::new(&block.scene, state, duration, method, controls);
        let progress = run.begin(&block.statuses(combination))?;
        parts.push(Part { block, run, progress, stopped: None });
    }
    let mut end = duration;
    let contacts = scene.contacts.len();
    let enough = controls.max_events.map(|most| most.saturating_add(contacts));
    // Up to `end`, the earliest time at which one of them stops.
    while let Some(part) = parts
        .iter_mut()
        .filter(|part| part.is_behind(end))
        .min_by(|a, b| a.run.time.seconds.total_cmp(&b.run.time.seconds))
    {
        part.stopped = part.run.step(&mut part.progress)?;
        if part.stopped.is_some() {
            end = end.min(part.run.trajectory.end);
        }
        let events = || parts.iter().map(|part| part.run.trajectory.events.len()).sum::<usize>();
        if enough.is_some_and(|enough| events() >= enough) {
            // All but the events at the last instant of each block are in order.
            let open = parts.iter().filter(|part| part.stopped.is_none());
            end = open.map(|part| part.run.time.seconds).fold(end, f64::min);
            break;
        }
    }
    let reason = parts.iter().filter(|part| part.run.trajectory.end <= end).find_map(|part| {
        match &part.stopped {
            None | Some(StopReason::Duration) => None,
            Some(reason) => Some(in_whole(reason.clone(), part.block)),
        }
    });
    let blocks: Vec<(&Block, Trajectory)> =
        parts.into_iter().map(|part| (part.block, part.run.trajectory)).collect();
    let mut whole = put_together(scene, &blocks, end, method)?;
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
    scene: &Arc<Scene>,
    blocks: &[(&Block, Trajectory)],
    end: f64,
    method: Method,
) -> Result<Trajectory, Error> {
    // By time, and by how many phases of the same block began at it before: the phases that begin.
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
    let mut whole = Trajectory::new(scene);
    whole.end = end;
    whole.phases.reserve_exact(instants.len());
    whole.states.reserve_exact(2 * scene.size * instants.len());
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
            let combination = &run.phases[index].basis.combination;
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
        let bases = blocks.iter().zip(&current).map(|((_, run), &index)| &run.phases[index].basis);
        let basis = if bases.clone().all(|basis| basis.is_modal()) {
            scene.basis(&combination, method.for_repeated_use())?.0
        } else {
            Arc::new(CombinationBasis::of_blocks(scene, combination, bases.cloned()))
        };
        whole.phases.push(Phase { start: time, rest, basis });
        whole.states.extend_from_slice(&q);
        whole.states.extend_from_slice(&u);
        let mut events: Vec<(Event, Option<Accumulation>)> = Vec::new();
        for &(b, index) in &begun {
            let (block, run) = &blocks[b];
            let first = run.events.partition_point(|event| event.phase < index);
            for (k, event) in run.events_at(index).enumerate() {
                let limit =
                    run.accumulations.binary_search_by_key(&(first + k), |limit| limit.event);
                let contact = block.contacts[event.contact];
                let limit = limit.ok().map(|limit| run.accumulations[limit]);
                events.push((Event { contact, phase, ..event.clone() }, limit));
            }
        }
        events.sort_by_key(|(event, _)| event.contact);
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
        let Counters { phases: _, panels, leaps, refinements, combinations, taylor_phases } =
            run.counters;
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
    run.states.truncate(2 * run.scene.size * (last + 1));
    run.events.truncate(run.events.partition_point(|event| event.phase <= last));
    run.end = run.phases[last].start;
    run.grazings.retain(|touch| touch.time <= run.end);
    run.accumulations.retain(|limit| limit.event < run.events.len());
    run.stop_reason = StopReason::MaxEvents;
}
