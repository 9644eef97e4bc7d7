//! Event functions: the affine functionals of the state whose first zero ends a phase.
//!
//! | status | event function, positive while the status holds | at its zero |
//! | --- | --- | --- |
//! | `+` / `-` | -s / +s | slip velocity zero |
//! | `+` / `-` by a law without mass | `abs(T) - mu(0) N` | slip velocity zero |
//! | `+` / `-` | N, or the stretch of a contact spring by a law | normal force zero |
//! | `s` | mu_static N - T, mu_static N + T | onset of slip `+`, `-` |
//! | `o` | N | normal force zero |
//! | `s` in a plane | `(mu_static N)^2 - T_x^2 - T_y^2` | onset of slip `o` |
//! | `s` in a plane | N | normal force zero |
//! | `o` on a spring of its own | `-T . w - r r'`, `r = mu N / k` | the node comes to rest |
//! | `d` | g | gap closes |
//!
//! Both functions of a contact that sticks along a line are positive only while N is, so N needs none of its own.

use nalgebra::DMatrix;

use crate::contact::contact_forces::{contact_forces, dependent_forces, pressing, reaction};
use crate::contact::event_kind::EventKind;
use crate::contact::functional::Functional;
use crate::contact::problem::dependent::{MOST, eliminated};
use crate::error::input::Error;
use crate::scene::contact_law::Contact;
use crate::scene::friction::contact_state::StateContact;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// One event function of a status combination.
#[derive(Debug, Clone)]
pub(crate) struct EventFunction {
    pub contact: usize,
    pub trigger: EventKind,
    pub functional: Functional,
    /// The contact forces of which it is a sum, as (row, weight): T of contact i has row 2 i, N has row 2 i + 1. Empty where it
    /// is a gap or a slip velocity.
    pub forces: Vec<(usize, f64)>,
    /// Of contacts in a plane: the functional is a part of a sum of squares, which is the event function of both directions. Of
    /// one that sticks this is `(mu_static N)^2 - T_x^2 - T_y^2`.
    pub cone: Option<ConePart>,
}

/// What an event function of a contact in a plane stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ConePart {
    /// T along the direction of the contact, or another functional whose square is subtracted.
    Force,
    /// `mu_static N`, or another functional whose square is added.
    Limit,
}

impl ConePart {
    /// The factor of its square.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Force => -1.0,
            Self::Limit => 1.0,
        }
    }
}

impl EventFunction {
    /// A function of gaps and velocities.
    pub fn kinematic(contact: usize, trigger: EventKind, functional: Functional) -> Self {
        Self { contact, trigger, functional, forces: Vec::new(), cone: None }
    }

    /// Its change per newton of force `source`, from [`response`](crate::contact::contact_forces::response).
    pub fn response(&self, response: &DMatrix<f64>, source: usize) -> f64 {
        self.forces.iter().map(|&(row, weight)| weight * response[(row, source)]).sum()
    }
}

pub(crate) fn slip_velocity(scene: &Scene, contact: usize) -> Functional {
    Functional {
        position: Vec::new(),
        velocity: vec![(scene.contacts[contact].tangential, 1.0)],
        constant: -scene.contacts[contact].slider_speed,
    }
}

/// The event functions that are active in `combination`, by contact.
pub(crate) fn event_functions(
    scene: &Scene,
    combination: &Combination,
) -> Result<Vec<EventFunction>, Error> {
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    let contacts = 0..scene.contacts.len();
    let mut functions: Vec<EventFunction> =
        contacts.flat_map(|contact| of_contact(scene, contact, combination, &coupled)).collect();
    if let (Some(w), Some(forces), false) =
        (&scene.coordinates.delassus, &coupled, !scene.has_dependent_directions())
    {
        let free = dependent_forces(scene, w, combination.statuses()).1.free;
        if free.ncols() > 0 {
            let kinematic = |trigger| matches!(trigger, EventKind::Velocity | EventKind::Impact);
            functions.retain(|function| kinematic(function.trigger));
            functions.extend(undetermined_functions(scene, combination, forces, &free)?);
            functions.sort_by_key(|function| function.contact);
        }
    }
    Ok(functions)
}

/// The event functions of one contact in a combination; mass must not couple contacts.
pub(crate) fn functions_of_contact(
    scene: &Scene,
    contact: usize,
    combination: &Combination,
) -> Vec<EventFunction> {
    of_contact(scene, contact, combination, &None)
}

/// The event function by which `trigger` ends the status of one contact; for a sticking contact whose friction cone closes
/// it is that of the normal force. An orbit under loads in time ends with their period, and an orbit without events ends
/// where a contact turns.
pub(crate) fn ending(
    scene: &Scene,
    combination: &Combination,
    contact: usize,
    trigger: EventKind,
) -> EventFunction {
    let kinematic = |functional| EventFunction::kinematic(contact, trigger, functional);
    if trigger == EventKind::Load {
        return kinematic(phase_of_loads(scene));
    }
    if trigger == EventKind::Turn {
        let turning = vec![(scene.contacts[contact].tangential, 1.0)];
        return kinematic(Functional { velocity: turning, ..Functional::default() });
    }
    if scene.has_dependent_directions()
        && let Ok(functions) = event_functions(scene, combination)
        && let Some(found) = functions
            .into_iter()
            .find(|function| function.contact == contact && function.trigger == trigger)
    {
        return found;
    }
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    let status = combination.statuses()[contact];
    let mut functions = of_contact(scene, contact, combination, &coupled).into_iter();
    functions.find(|function| function.trigger == trigger).unwrap_or_else(|| {
        let normal = match coupled {
            Some(mut forces) => forces.swap_remove(contact).1,
            None if status.is_closed() => reaction(scene, scene.contacts[contact].normal),
            None => return kinematic(Functional::default()),
        };
        EventFunction { forces: vec![(2 * contact + 1, 1.0)], ..kinematic(normal) }
    })
}

/// `-sin(w t)` of the first oscillator, which vanishes at every period of the loads.
fn phase_of_loads(scene: &Scene) -> Functional {
    let clock = scene.drive.iter().flat_map(|drive| &drive.oscillators).take(1);
    let mut clock = clock.map(|one| (one.coordinate, one.phase.sin_cos(), one.rate)).peekable();
    let position = clock.peek().map(|&(h, (sine, _), _)| (h, sine));
    let velocity = clock.map(|(h, (_, cosine), rate)| (h, cosine / rate));
    Functional {
        position: position.into_iter().collect(),
        velocity: velocity.collect(),
        constant: 0.0,
    }
}

/// The gap of a contact.
pub(crate) fn gap_of(law: &Contact) -> Functional {
    let position = vec![(law.normal, 1.0)];
    Functional { position, constant: law.gap, ..Functional::default() }
}

/// The event functions of one contact; `coupled` holds the forces of all contacts if mass couples them.
fn of_contact(
    scene: &Scene,
    contact: usize,
    combination: &Combination,
    coupled: &Option<Vec<(Functional, Functional)>>,
) -> Vec<EventFunction> {
    let law = &scene.contacts[contact];
    let status = combination.statuses()[contact];
    let function = |trigger, functional| EventFunction::kinematic(contact, trigger, functional);
    let [t, n] = [2 * contact, 2 * contact + 1];
    let (friction, normal) = match coupled {
        _ if !status.is_closed() => Default::default(),
        Some(forces) => forces[contact].clone(),
        None => (reaction(scene, law.tangential), reaction(scene, law.normal)),
    };
    match status {
        Status::Positive | Status::Negative => {
            let sign = status.friction_sign();
            // Where slip has no mass, |s| follows from `R = mu(|s|) N`, and both vanish at once.
            let slip = || match scene.creeps(contact) {
                true => Functional::sum([(sign, &friction), (-law.friction, &normal)].into_iter()),
                false => slip_velocity(scene, contact).scaled(-sign),
            };
            let slip = scene.has_direction(contact).then(|| function(EventKind::Velocity, slip()));
            slip.into_iter().chain(releases(scene, contact, normal)).collect()
        }
        Status::Slipping | Status::Elastic if let Some(own) = scene.state_of(contact) => {
            of_spring_in_plane(scene, (contact, own), combination)
        }
        Status::Sticking if let Some(plane) = law.plane => {
            let part = |part, force, functional| EventFunction {
                forces: vec![force],
                cone: Some(part),
                ..function(EventKind::Slip, functional)
            };
            let limit = normal.scaled(law.static_friction);
            let limit = part(ConePart::Limit, (n, law.static_friction), limit);
            let force = part(ConePart::Force, (t, 1.0), friction);
            if contact > plane.beside {
                return vec![force];
            }
            // Without a friction force the cone only touches zero where N falls through it.
            [force, limit].into_iter().chain(releases(scene, contact, normal)).collect()
        }
        // Both directions of a plane open and close at once.
        _ if law.shares_normal() => Vec::new(),
        Status::Slipping | Status::Elastic => releases(scene, contact, normal),
        Status::Sticking => {
            let limit = law.static_friction;
            let cone = |trigger, sign: f64| EventFunction {
                forces: vec![(n, limit), (t, sign)],
                ..function(
                    trigger,
                    Functional::sum([(limit, &normal), (sign, &friction)].into_iter()),
                )
            };
            let cones = [cone(EventKind::SlipPositive, -1.0), cone(EventKind::SlipNegative, 1.0)];
            // The force of a spring by a law may touch zero without a change of its sign.
            let spring = scene.contact_spring(contact);
            let opening = spring.map(|_| releases(scene, contact, normal.clone()));
            cones.into_iter().chain(opening.into_iter().flatten()).collect()
        }
        Status::Detached => {
            let trigger = match law.normal_has_mass() {
                true => EventKind::Impact,
                false => EventKind::Closing,
            };
            vec![function(trigger, gap_of(law))]
        }
    }
}

/// Where a contact opens, if it can: N; or of a spring by a law its stretch, and N of a formula, which might come to zero before.
fn releases(scene: &Scene, contact: usize, normal: Functional) -> Vec<EventFunction> {
    if !scene.contacts[contact].opens() {
        return Vec::new();
    }
    let by_force = EventFunction {
        forces: vec![(2 * contact + 1, 1.0)],
        ..EventFunction::kinematic(contact, EventKind::Release, normal.clone())
    };
    let Some(spring) = scene.contact_spring(contact) else { return vec![by_force] };
    // The linear part of N is the stretch times a stiffness.
    let stretch = EventFunction::kinematic(contact, EventKind::Release, normal);
    let of_force = (!spring.is_tabulated()).then_some(by_force);
    std::iter::once(stretch).chain(of_force).collect()
}

/// Those of one direction of a contact in a plane that a spring ties to its body: of one that rests parts of
/// `(mu N)^2 - T_x^2 - T_y^2`. One that slips does so while `z . w > 0`, with the deflection z and the velocity w of the body;
/// with c of the first direction, `4 c z w = (c z + w)^2 - (c z - w)^2`. Where N changes it does so while `z . w > r r'` with
/// `r = mu N / k`, and r and r' take the places of z and w in squares of their own, of the other sign.
fn of_spring_in_plane(
    scene: &Scene,
    (contact, own): (usize, &StateContact),
    combination: &Combination,
) -> Vec<EventFunction> {
    let part = |trigger, part, functional| EventFunction {
        cone: Some(part),
        ..EventFunction::kinematic(contact, trigger, functional)
    };
    let Some(plane) = scene.elastic_plane(contact) else { return Vec::new() };
    let is_first = contact < plane.beside;
    let scale = plane.directions[usize::from(!is_first)].scale;
    let opens = match plane.normal {
        Some(normal) if is_first => releases(scene, contact, reaction(scene, normal)),
        _ => Vec::new(),
    };
    if combination.statuses()[contact] == Status::Slipping {
        let slip = slip_velocity(scene, contact);
        let (coordinate, weight) = own.as_velocity();
        let velocity = vec![(coordinate, weight * scale)];
        let deflection = Functional { velocity, ..Functional::default() };
        let of = |[length, rate]: [&Functional; 2]| {
            let half = |sign: f64| Functional::sum([(0.5, length), (0.5 * sign, rate)].into_iter());
            [1.0, -1.0].map(half)
        };
        let trigger = EventKind::Velocity;
        let [sum, difference] = of([&deflection, &slip]);
        let mut parts =
            vec![part(trigger, ConePart::Force, difference), part(trigger, ConePart::Limit, sum)];
        if let Some(normal) = plane.normal.filter(|_| is_first) {
            let [force, rate] = pressing(scene, combination, normal);
            let [length, rate] = [force.scaled(scale * plane.extent), rate.scaled(plane.extent)];
            let [sum, difference] = of([&length, &rate]);
            parts.push(part(trigger, ConePart::Force, sum));
            parts.push(part(trigger, ConePart::Limit, difference));
        }
        return parts.into_iter().chain(opens).collect();
    }
    let (trigger, (coordinate, weight)) = (EventKind::Slip, own.as_velocity());
    let force = Functional {
        velocity: vec![(coordinate, -own.spring() * weight)],
        ..Functional::default()
    };
    let limit = own.normal_force * own.steady_friction(0.0);
    let limit = match plane.normal {
        Some(normal) => reaction(scene, normal).scaled(limit),
        None => Functional { constant: limit, ..Functional::default() },
    };
    let mut parts = vec![part(trigger, ConePart::Force, force)];
    parts.extend(is_first.then(|| part(trigger, ConePart::Limit, limit)));
    parts.into_iter().chain(opens).collect()
}

/// The parts of the event function of a contact in a plane.
pub(crate) fn cone_parts(
    scene: &Scene,
    contact: usize,
    combination: &Combination,
) -> Vec<EventFunction> {
    let Some(plane) = scene.contacts[contact].plane else { return Vec::new() };
    let both = [contact, plane.beside].map(|one| functions_of_contact(scene, one, combination));
    both.into_iter().flatten().filter(|one| one.cone.is_some()).collect()
}

/// The event functions of a combination in which some forces are not determined: the inequalities that some split of
/// the forces can satisfy. Each belongs to every contact that it contains; if it contains both friction limits of a
/// contact, it belongs to the normal force of that contact.
fn undetermined_functions(
    scene: &Scene,
    combination: &Combination,
    forces: &[(Functional, Functional)],
    free: &DMatrix<f64>,
) -> Result<Vec<EventFunction>, Error> {
    // (contact, trigger, factor of N, factor of T)
    let mut limits: Vec<(usize, EventKind, f64, f64)> = Vec::new();
    for (i, (law, &status)) in scene.contacts.iter().zip(combination.statuses()).enumerate() {
        if status == Status::Sticking {
            limits.push((i, EventKind::SlipPositive, law.static_friction, -1.0));
            limits.push((i, EventKind::SlipNegative, law.static_friction, 1.0));
        } else if status.is_closed() && law.opens() {
            limits.push((i, EventKind::Release, 1.0, 0.0));
        }
    }
    let b = DMatrix::from_fn(limits.len(), free.ncols(), |j, k| {
        let (i, _, normal, tangential) = limits[j];
        normal * free[(2 * i + 1, k)] + tangential * free[(2 * i, k)]
    });
    let inequalities = eliminated(&b)
        .ok_or_else(|| Error::ManySplits { combination: combination.to_string(), most: MOST })?;
    let mut functions = Vec::new();
    for factors in inequalities {
        let parts = factors.iter().flat_map(|&(j, factor)| {
            let (i, _, normal, tangential) = limits[j];
            [(2 * i + 1, factor * normal), (2 * i, factor * tangential)]
        });
        let parts: Vec<(usize, f64)> = parts.collect();
        let functional = Functional::sum(parts.iter().map(|&(row, factor)| {
            let (friction, normal) = &forces[row / 2];
            (factor, if row % 2 == 1 { normal } else { friction })
        }));
        let mut told: Vec<(usize, EventKind)> =
            factors.iter().map(|&(j, _)| (limits[j].0, limits[j].1)).collect();
        told.sort_by_key(|entry| entry.0);
        for own in told.chunk_by(|a, b| a.0 == b.0) {
            let trigger = if own.len() > 1 { EventKind::Release } else { own[0].1 };
            functions.push(EventFunction {
                contact: own[0].0,
                trigger,
                functional: functional.clone(),
                forces: parts.clone(),
                cone: None,
            });
        }
    }
    Ok(functions)
}
