//! The transitions of contacts at an event: the one place where statuses change.

use crate::contact::contact_forces::reaction;
use crate::contact::coupled::contacts::Coupled;
use crate::contact::coupled::transition::settle_coupled;
use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::contact::quasi_static::transition::settle_group;
use crate::contact::settlement::{
    Departure, NODE_ROUNDING, Series, Settlement, continuous, of_contact, sliding_status,
};
use crate::error::run::{LawEnd, RunFailure};
use crate::scene::contact_law::{Contact, Directions, Plane};
use crate::scene::friction::plane::beyond_limit;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Part of a friction limit within which a force is at it: a node comes to rest with the rounding of its slip.
const AT_LIMIT: f64 = 1e-11;

/// Settles all contacts at an event in state (q, q'), which is brought to the exact zeros that the event
/// stands for: g = 0 at an impact, slip velocity zero at the end of a slide.
///
/// `triggers` are the event functions that vanish at this instant, by contact; `among` are the contacts that the event
/// can reach at once, ascending: all of them where mass couples contacts.
#[allow(clippy::too_many_arguments, reason = "what a transition is made of")]
pub(crate) fn settle(
    scene: &Scene,
    time: f64,
    triggers: &[(usize, EventKind)],
    among: impl Iterator<Item = usize> + Clone,
    settlement: &mut Settlement,
    series: &Series,
    q: &mut [f64],
    u: &mut [f64],
) -> Result<(), RunFailure> {
    settlement.rest = None;
    let releases = triggers.iter().filter(|trigger| trigger.1 == EventKind::Release);
    if let Some(contact) = scene.pulling(releases.map(|trigger| trigger.0), q) {
        return Err(RunFailure::Law { contact, time, end: LawEnd::Pulling });
    }
    let tangent = scene.elements_at_contacts().then(|| scene.tangent(q, u));
    let scene = tangent.as_deref().unwrap_or(scene);
    // A gap that rounding has made negative by the time of another contact's event is zero.
    for contact in among.clone() {
        if settlement.statuses[contact] == Status::Detached {
            let law = &scene.contacts[contact];
            q[law.normal] = q[law.normal].max(law.closed());
        }
    }
    let (mut impact, mut switched) = (false, false);
    for &(contact, trigger) in triggers {
        if contact == NO_CONTACT {
            switched = true;
            continue;
        }
        impact |= trigger == EventKind::Impact;
        trigger.sets(&scene.contacts[contact]).for_each(|set| set.apply(q, u));
    }
    let struck = triggers.iter().filter(|trigger| trigger.1 == EventKind::Impact);
    scene.follow_held(struck.map(|trigger| scene.contacts[trigger.0].normal), u);
    settlement.events.clear();
    if switched {
        settlement.events.push((NO_CONTACT, EventKind::Load));
    }
    if let Some(w) = &scene.coordinates.delassus {
        let coupled = Coupled { scene, time, w };
        // States of contacts that open are not computed beside these.
        settle_coupled(&coupled, triggers, settlement, series, q, u)?;
        settlement.depart(scene, among, q, u);
        return Ok(());
    }
    among.clone().for_each(|contact| settlement.departures[contact] = Departure::None);
    if impact {
        let struck = triggers.iter().filter(|trigger| trigger.1 == EventKind::Impact);
        struck.for_each(|trigger| strike(scene, trigger.0, u));
    }
    let mut jump = false;
    for group in &scene.massless.groups {
        let stepped = switched && scene.switches(&group.coordinates);
        let own = |trigger: &(usize, EventKind)| group.contacts.contains(&trigger.0);
        if impact || stepped || triggers.iter().any(own) {
            jump |= settle_group(scene, group, time, triggers, settlement, q, u)?;
        }
    }
    for contact in among.clone() {
        let trigger = of_contact(triggers, contact);
        let before = settlement.statuses[contact];
        let law = &scene.contacts[contact];
        let opens = matches!(trigger, Some(EventKind::Closing | EventKind::Release));
        // What opens or closes without mass is settled with its group.
        let is_settled = opens && !law.normal_has_mass();
        if let Some(plane) = law.plane {
            // The first direction settles both.
            // Velocities that jump elsewhere leave a spring as it is, where they do not change its normal force.
            let given = law.is_elastic() && !plane.opens;
            let reached = (impact || switched || jump) && before.is_closed() && !given;
            let touched = (trigger.is_some() || reached) && !is_settled;
            if contact < plane.beside && touched {
                let (after, departure) = match law.is_elastic() {
                    true => {
                        settle_spring_in_plane(scene, contact, trigger, &settlement.statuses, q, u)
                    }
                    false => settle_in_plane(scene, contact, plane, trigger, q, u),
                };
                settlement.record(contact, trigger, after, departure);
            }
            if contact < plane.beside {
                settlement.statuses[plane.beside] = settlement.statuses[contact];
            }
            continue;
        }
        if !law.tangential_has_mass() || is_settled {
            continue;
        }
        // An impact's velocity jump reaches the other contacts through the damping, a switched load all of them.
        if trigger.is_some() || (impact || switched || jump) && before.is_closed() {
            let (after, mut departure) =
                settle_contact(scene, time, contact, trigger, before, q, u)?;
            // A contact that opens strikes once more at once where rounding of its motion outweighs its acceleration: it
            // departs by the change of its acceleration, as at a release.
            if series.struck.contains(&contact)
                && trigger == Some(EventKind::Impact)
                && departure == Departure::Gap(2)
            {
                departure = Departure::Gap(3);
            }
            settlement.record(contact, trigger, after, departure);
        }
    }
    if !scene.massless.is_empty() {
        take_along(scene, among.clone(), settlement, q, u);
    }
    // A contact may open at the event of another.
    let open = among.clone().filter(|&i| settlement.statuses[i] == Status::Detached);
    open.filter_map(|i| scene.contacts[i].hidden).for_each(|hidden| u[hidden] = 0.0);
    settlement.depart(scene, among, q, u);
    Ok(())
}

/// When a body starts to slip, massless nodes on it that are at their friction limit may start with it: a node under a given
/// normal force that came to rest with its body stays there until the body slips. Two outcomes: the slip stretches the spring of
/// the node further, and the node slips with the body in the same instant; or the node sticks, and its force leaves the limit
/// one order of time later than the slip of the body leaves zero. The same holds for a node that still slides, at slip velocity
/// zero, since an impact has stopped its body.
fn take_along(
    scene: &Scene,
    among: impl Iterator<Item = usize> + Clone,
    settlement: &mut Settlement,
    q: &[f64],
    u: &[f64],
) {
    for body in among.clone().filter(|&i| scene.contacts[i].tangential_has_mass()) {
        let Departure::Slip(order) = settlement.departures[body] else { continue };
        let slips = settlement.statuses[body].friction_sign();
        for node in among.clone() {
            let law = &scene.contacts[node];
            let tie = scene.stiffness.get(law.tangential, scene.contacts[body].tangential);
            let held = law.directions == Directions::Tangential
                && law.static_friction == law.friction
                && law.friction > 0.0
                && settlement.statuses[node].is_closed();
            let by_itself = law.tangential_has_mass() || scene.creeps(node);
            if by_itself || !held || tie == 0.0 || !rests(scene, law, u) {
                continue;
            }
            let status = settlement.statuses[node];
            if status.is_sliding() {
                if settlement.departures[node] != Departure::None {
                    continue;
                }
                if status.friction_sign() * tie * slips < 0.0 {
                    settlement.departures[node] = Departure::Slip(order);
                } else {
                    let departure = Departure::Bound(status, order + 1);
                    let ends = Some(EventKind::Velocity);
                    settlement.record(node, ends, Status::Sticking, departure);
                }
                continue;
            }
            let force = scene.reaction_value(law.tangential, q, u);
            let limit = law.static_friction * scene.reaction_value(law.normal, q, u);
            // Both ends of its spring move with the slider, and their places are rounded.
            let pulls = scene.stiffness.row(law.tangential).map(|(k, stiffness)| stiffness * q[k]);
            let size: f64 = pulls.map(f64::abs).sum();
            if limit - force.abs() > AT_LIMIT * limit + NODE_ROUNDING * size {
                continue;
            }
            let (bound, kind) = match force > 0.0 {
                true => (Status::Positive, EventKind::SlipPositive),
                false => (Status::Negative, EventKind::SlipNegative),
            };
            if bound.friction_sign() * tie * slips < 0.0 {
                settlement.record(node, Some(kind), bound, Departure::Slip(order));
            } else {
                settlement.departures[node] = Departure::Bound(bound, order + 1);
            }
        }
    }
}

/// Whether the body of a node under a given normal force moves with the slider of the node, but for rounding.
fn rests(scene: &Scene, law: &Contact, u: &[f64]) -> bool {
    let own = scene.stiffness.get(law.tangential, law.tangential);
    let others = scene.stiffness.row(law.tangential).filter(|entry| entry.0 != law.tangential);
    let terms = others.map(|(k, stiffness)| -stiffness / own * u[k]);
    let start = (-law.slider_speed, law.slider_speed.abs());
    let (sum, size) = terms.fold(start, |(sum, size), term| (sum + term, size + term.abs()));
    sum.abs() <= NODE_ROUNDING * size
}

/// The same of a contact in a plane that a spring ties to its body. Where its slip ends, `|T|` is at its limit and its rate, which is
/// proportional to the slip speed, at zero. Where it closes, its spring is relaxed.
fn settle_spring_in_plane(
    scene: &Scene,
    contact: usize,
    trigger: Option<EventKind>,
    statuses: &[Status],
    q: &[f64],
    u: &mut [f64],
) -> (Status, Departure) {
    let normal = scene.contacts[contact].normal;
    match trigger {
        Some(EventKind::Slip) => return (Status::Slipping, Departure::None),
        Some(EventKind::Velocity) => {
            return (Status::Elastic, Departure::Bound(Status::Slipping, 2));
        }
        Some(EventKind::Release) => return (Status::Detached, Departure::Gap(3)),
        Some(EventKind::Impact) if u[normal] > 0.0 => return (Status::Detached, Departure::Gap(1)),
        _ => {}
    }
    let normal_force = scene.reaction_value(normal, q, u);
    if touches(scene, normal, trigger, normal_force, q, u) {
        return (Status::Elastic, Departure::Force(1));
    }
    if normal_force < 0.0 {
        return (Status::Detached, Departure::Gap(2));
    }
    if !statuses[contact].is_closed() {
        return (Status::Elastic, Departure::None);
    }
    let combination = Combination::new(statuses.to_vec());
    let (status, order) = scene.settle_elastic_plane(contact, &combination, q, u);
    let departure =
        if order == 0 { Departure::None } else { Departure::Bound(Status::Slipping, order) };
    (status, departure)
}

/// The status of a contact in a plane, which both directions have, and its departure.
fn settle_in_plane(
    scene: &Scene,
    contact: usize,
    plane: Plane,
    trigger: Option<EventKind>,
    q: &[f64],
    u: &[f64],
) -> (Status, Departure) {
    let law = &scene.contacts[contact];
    if trigger == Some(EventKind::Release) {
        return (Status::Detached, Departure::Gap(3));
    }
    if trigger == Some(EventKind::Impact) && u[law.normal] > 0.0 {
        return (Status::Detached, Departure::Gap(1));
    }
    let normal_force = scene.reaction_value(law.normal, q, u);
    let (normal_force, departure) = match touches(scene, law.normal, trigger, normal_force, q, u) {
        true => (0.0, Departure::Force(1)),
        false => (normal_force, Departure::None),
    };
    if normal_force < 0.0 {
        return (Status::Detached, Departure::Gap(2));
    }
    let required = [law.tangential, plane.tangential].map(|row| scene.reaction_value(row, q, u));
    let exceeds = required[0].hypot(required[1]) > law.static_friction * normal_force;
    let slips = law.slips_in(plane, u) || law.static_friction == 0.0;
    match slips || trigger == Some(EventKind::Slip) || exceeds {
        true => (Status::Slipping, departure),
        false => (Status::Sticking, departure),
    }
}

/// `g'+ = -e g'-`, and with `impact_friction` the Coulomb impulse of at most `mu p_n` that drives slip
/// towards zero; mass does not couple contact coordinates.
fn strike(scene: &Scene, contact: usize, u: &mut [f64]) {
    let law = &scene.contacts[contact];
    let approach = u[law.normal];
    u[law.normal] = -law.restitution * approach;
    if let Some(plane) = law.plane.filter(|_| scene.impact_friction) {
        let friction = scene.friction_at(contact, u);
        let limit = friction * (1.0 + law.restitution) * approach.abs();
        let limit = limit * scene.mass.get(law.normal, law.normal);
        let coordinates = [law.tangential, plane.tangential];
        let mass = coordinates.map(|k| scene.mass.get(k, k));
        let sliders = [law.slider_speed, plane.slider_speed];
        let momentum = [0, 1].map(|i| mass[i] * (u[coordinates[i]] - sliders[i]));
        let (speed, direction) = beyond_limit(mass, limit, momentum).unwrap_or_default();
        (0..2).for_each(|i| u[coordinates[i]] = sliders[i] + speed * direction[i]);
    } else if scene.impact_friction {
        let normal_mass = scene.mass.get(law.normal, law.normal);
        let tangential_mass = scene.mass.get(law.tangential, law.tangential);
        let friction = scene.friction_at(contact, u);
        let limit = friction * (1.0 + law.restitution) * normal_mass * approach.abs();
        let slip = u[law.tangential] - law.slider_speed;
        if tangential_mass * slip.abs() <= limit {
            u[law.tangential] = law.slider_speed;
        } else {
            u[law.tangential] -= slip.signum() * limit / tangential_mass;
        }
    }
}

/// The velocities after contacts `struck` close their gaps while the others have `statuses`.
pub(crate) fn impact(
    scene: &Scene,
    statuses: &[Status],
    struck: &[usize],
    q: &[f64],
    u: &mut [f64],
) -> Result<(), RunFailure> {
    let Some(w) = &scene.coordinates.delassus else {
        struck.iter().for_each(|&contact| strike(scene, contact, u));
        return Ok(());
    };
    let closed: Vec<usize> =
        (0..statuses.len()).filter(|&i| struck.contains(&i) || statuses[i].is_closed()).collect();
    Coupled { scene, time: 0.0, w }.strike(&closed, q, u)
}

fn settle_contact(
    scene: &Scene,
    time: f64,
    contact: usize,
    trigger: Option<EventKind>,
    before: Status,
    q: &[f64],
    u: &[f64],
) -> Result<(Status, Departure), RunFailure> {
    let law = &scene.contacts[contact];
    if let Some(settled) = trigger.and_then(|trigger| continuous(scene, contact, trigger, before)) {
        return Ok(settled);
    }
    if trigger == Some(EventKind::Impact) && u[law.normal] > 0.0 {
        return Ok((Status::Detached, Departure::Gap(1)));
    }
    let normal_force = scene.reaction_value(law.normal, q, u);
    if touches(scene, law.normal, trigger, normal_force, q, u) {
        let (status, departure) = settle_closed(scene, time, contact, before, 0.0, q, u)?;
        let both = matches!(departure, Departure::Slip(_));
        let departure = if both { Departure::SlipAndForce } else { Departure::Force(1) };
        return Ok((status, departure));
    }
    if normal_force < 0.0 {
        return Ok((Status::Detached, Departure::Gap(2)));
    }
    if !scene.has_direction(contact) && before.is_sliding() && trigger.is_none() {
        // Its letter says nothing, and no event elsewhere changes it.
        return Ok((before, Departure::None));
    }
    settle_closed(scene, time, contact, before, normal_force, q, u)
}

/// Whether a contact that stays closed after an impact begins without a normal force, but for rounding, as at the place where its
/// body would rest without it.
fn touches(
    scene: &Scene,
    normal: usize,
    trigger: Option<EventKind>,
    normal_force: f64,
    q: &[f64],
    u: &[f64],
) -> bool {
    matches!(trigger, Some(EventKind::Impact | EventKind::Accumulation))
        && normal_force.abs() <= NODE_ROUNDING * reaction(scene, normal).magnitude(q, u)
}

/// The status of a contact along a line that is closed under a normal force.
fn settle_closed(
    scene: &Scene,
    time: f64,
    contact: usize,
    before: Status,
    normal_force: f64,
    q: &[f64],
    u: &[f64],
) -> Result<(Status, Departure), RunFailure> {
    let law = &scene.contacts[contact];
    if let Some(status) = sliding_status(u[law.tangential] - law.slider_speed) {
        return Ok((status, Departure::None));
    }
    if !scene.has_direction(contact) {
        let status = if before.is_sliding() { before } else { Status::Positive };
        return Ok((status, Departure::None));
    }
    let required_friction = scene.reaction_value(law.tangential, q, u);
    let limit = law.static_friction * normal_force;
    if required_friction.abs() <= limit && law.static_friction > 0.0 {
        Ok((Status::Sticking, Departure::None))
    } else if required_friction > limit {
        Ok((Status::Positive, Departure::Slip(1)))
    } else if required_friction < -limit {
        Ok((Status::Negative, Departure::Slip(1)))
    } else if law.static_friction == 0.0 && required_friction == 0.0 {
        // Nothing moves it, and friction that vanishes at rest needs no force.
        Ok((Status::Positive, Departure::Slip(1)))
    } else {
        Err(RunFailure::NoConsistentStatus { contact, time, normal_force, required_friction })
    }
}
