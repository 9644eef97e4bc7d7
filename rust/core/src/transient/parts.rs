//! Motions of parts that nothing couples, put together: the phases and events of all parts in the order of time.
//!
//! Each part keeps its own states and combinations. So an event in one part costs the others nothing, and the number of
//! combinations is the sum over the parts and not the product.

use std::sync::Arc;

use crate::contact::event_kind::NO_CONTACT;
use crate::motion::propagators::Propagators;
use crate::scene::partition::Block;
use crate::transient::trajectory::events::{Accumulation, Event, Grazing, StopReason};
use crate::transient::trajectory::model::{PartMotion, Phase, Trajectory};

/// The whole of the motions of all parts up to `end`, or up to the phase with which it is enough.
pub(crate) fn put_together(
    propagators: &Arc<Propagators>,
    motions: impl Iterator<Item = Trajectory>,
    end: f64,
    enough: impl Fn(&Trajectory) -> bool,
) -> Trajectory {
    let parts = propagators.parts().iter().zip(motions);
    let mut parts: Vec<PartMotion> = parts
        .map(|(part, motion)| {
            let block = Arc::clone(&part.block);
            PartMotion { block, motion, begins: Vec::new() }
        })
        .collect();
    // Start, how many phases of that part began at the same instant before, part, phase.
    let mut begun: Vec<(u64, usize, usize, usize)> = Vec::new();
    for (p, PartMotion { motion, .. }) in parts.iter().enumerate() {
        let mut before = 0;
        let phases = motion.phases.iter().enumerate();
        for (k, phase) in phases.take_while(|(_, phase)| phase.start <= end) {
            let repeated = k > 0 && motion.phases[k - 1].start == phase.start;
            before = if repeated { before + 1 } else { 0 };
            // Times are not negative, so that their bits are ordered as they are.
            begun.push((phase.start.to_bits(), before, p, k));
        }
    }
    begun.sort_unstable();
    let mut whole = Trajectory::new(propagators);
    whole.end = end;
    let mut events: Vec<(Event, Option<Accumulation>)> = Vec::new();
    for together in begun.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let phase = whole.phases.len();
        let mut rest = 0.0;
        for &(_, _, p, k) in together {
            let PartMotion { block, motion, begins } = &mut parts[p];
            begins.push(phase);
            rest = motion.phases[k].rest;
            let first = motion.events.partition_point(|event| event.phase < k);
            for (index, event) in motion.events_at(k).enumerate() {
                let limits = &motion.accumulations;
                let limit = limits.binary_search_by_key(&(first + index), |limit| limit.event);
                let contact = block.contacts.get(event.contact).copied().unwrap_or(NO_CONTACT);
                let limit = limit.ok().map(|limit| limits[limit]);
                events.push((Event { contact, phase, ..event.clone() }, limit));
            }
        }
        let start = f64::from_bits(together[0].0);
        whole.phases.push(Phase { start, rest, basis: 0 });
        // A load that is switched is one event, of all parts.
        events.sort_by_key(|(event, _)| event.contact.wrapping_add(1));
        events.dedup_by(|next, kept| next.0 == kept.0);
        for (event, limit) in events.drain(..) {
            let event_index = whole.events.len();
            whole
                .accumulations
                .extend(limit.map(|limit| Accumulation { event: event_index, ..limit }));
            whole.events.push(event);
        }
        if enough(&whole) {
            break;
        }
    }
    for PartMotion { block, motion, .. } in &parts {
        let contacts = &block.contacts;
        let in_time = motion.grazings.iter().filter(|touch| touch.time <= end);
        let touches = in_time.map(|touch| Grazing { contact: contacts[touch.contact], ..*touch });
        whole.grazings.extend(touches);
        whole.counters.add(motion.counters);
    }
    whole.counters.phases = whole.phases.len();
    whole.grazings.sort_by(|a, b| a.time.total_cmp(&b.time));
    whole.parts = parts;
    whole
}

/// A reason that names contacts by their numbers in the whole scene.
pub(crate) fn in_whole(mut reason: StopReason, block: &Block) -> StopReason {
    match &mut reason {
        StopReason::Chattering { contact } => *contact = block.contacts[*contact],
        StopReason::Failed(failure) => {
            failure
                .contacts_mut()
                .iter_mut()
                .for_each(|contact| *contact = block.contacts[*contact]);
        }
        _ => {}
    }
    reason
}
