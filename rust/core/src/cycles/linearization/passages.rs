//! Which passages end a phase: the events of one instant, without those that only follow from an impact.

use crate::contact::event_kind::EventKind;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::joint::coupled_with;
use crate::cycles::linearization::saltation::Passage;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Part of its terms below which an event function counts as zero at the instant of another event.
const COINCIDENCE: f64 = 1e-10;

/// The passages behind the events of one instant, in the order of the contacts: a consequence of an
/// impact, whose own event function is not at zero, is none.
pub(crate) fn passages(
    scene: &Scene,
    flow: &Flow<'_>,
    [start, end]: [&[f64]; 2],
    events: &[(usize, EventKind)],
) -> Vec<Passage> {
    let before = flow.combination();
    let impact =
        events.iter().any(|event| matches!(event.1, EventKind::Impact | EventKind::Accumulation));
    let own = |passage: &Passage| {
        let direct = matches!(passage.trigger, EventKind::Impact | EventKind::Accumulation);
        let (value, scale) = passage.value(flow, end);
        direct || !impact || value.abs() <= COINCIDENCE * scale
    };
    let mut found = joint_closings(scene, before, [start, end], events);
    let joined: Vec<usize> = match &scene.coordinates.delassus {
        Some(w) => found.iter().flat_map(|passage| coupled_with(w, passage.contact)).collect(),
        None => Vec::new(),
    };
    for &(contact, kind) in events.iter().filter(|event| !joined.contains(&event.0)) {
        let accompanies =
            |passage: &Passage| passage.trigger == kind && passage.companions.contains(&contact);
        if !found.iter().any(accompanies) {
            let passage = match kind {
                EventKind::Jump => onset(scene, flow, contact, end),
                kind => Passage::new(scene, before, contact, kind),
            };
            found.extend(Some(passage).filter(&own));
        }
    }
    found.sort_by_key(|passage| passage.contact);
    found
}

/// The end of sticking at which the friction of a contact without mass drops: at the bound that it is nearer to.
fn onset(scene: &Scene, flow: &Flow<'_>, contact: usize, end: &[f64]) -> Passage {
    let [one, other] = [EventKind::SlipPositive, EventKind::SlipNegative]
        .map(|trigger| Passage::new(scene, flow.combination(), contact, trigger));
    if one.value(flow, end).0 <= other.value(flow, end).0 { one } else { other }
}

/// Whether the neighbours of a motion jump with this contact alone: contacts that slide afterwards have no place of their
/// own.
pub(crate) fn jumps_alone(scene: &Scene, contact: usize, after: &Combination) -> bool {
    let groups = &scene.massless.groups;
    let own = groups.iter().find(|group| group.contacts.contains(&contact));
    after.statuses()[contact].is_sliding() && own.is_some_and(|group| group.contacts.len() == 1)
}

/// The joint closings among the events of one instant: an impact comes with them, whose contact may close as well. The
/// limit of the bounces of one contact has none beside it, and its last phase begins with a bounce.
fn joint_closings(
    scene: &Scene,
    before: &Combination,
    [start, end]: [&[f64]; 2],
    events: &[(usize, EventKind)],
) -> Vec<Passage> {
    let Some(w) = &scene.coordinates.delassus else { return Vec::new() };
    let (q, u) = end.split_at(scene.size);
    let mut rest: Vec<(usize, EventKind)> = events.to_vec();
    let mut found = Vec::new();
    while let Some(&(first, _)) = rest.iter().find(|event| event.1 == EventKind::Accumulation) {
        let tied = coupled_with(w, first);
        let (own, others): (Vec<_>, Vec<_>) =
            rest.into_iter().partition(|event| tied.contains(&event.0));
        rest = others;
        let of_kind =
            |kind: EventKind| own.iter().filter(move |event| event.1 == kind).map(|event| event.0);
        let series: Vec<usize> = of_kind(EventKind::Accumulation).collect();
        let candidates = series.iter().copied().chain(of_kind(EventKind::Impact));
        // The contact that strikes has the gap that closes soonest: those of the others are not in the numbers any more.
        let time = |contact: &usize| {
            let law = &scene.contacts[*contact];
            (law.gap_at(q) / u[law.normal]).abs()
        };
        let struck = candidates
            .filter(|&contact| !before.statuses()[contact].is_closed())
            .min_by(|a, b| time(a).total_cmp(&time(b)));
        let law = &scene.contacts[first];
        let bounced = law.gap_at(start) == 0.0 && start[scene.size + law.normal] > 0.0;
        let is_joint = series.len() > 1 || of_kind(EventKind::Impact).next().is_some() || !bounced;
        found.extend(
            struck.filter(|_| is_joint).map(|struck| Passage::joint(scene, before, struck, series)),
        );
    }
    found
}
