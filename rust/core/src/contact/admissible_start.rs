//! The start of a run: a state brought to contact coordinates and to the exact zeros of its combination.

use crate::contact::contact_forces::{
    contact_forces, contact_forces_in, reaction, undetermined as undetermined_in,
};
use crate::contact::event_function::{event_functions, gap_of};
use crate::contact::event_kind::EventKind;
use crate::contact::functional::Functional;
use crate::contact::settlement::Departure;
use crate::error::input::Error;
use crate::linalg::dense::max_norm;
use crate::scene::contact_law::{Contact, Plane, check_finite};
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::{Scene, State};
use crate::scene::status::{Combination, Status};

/// Relative tolerance to which a start state may miss the constraints of its combination: a state written with ten digits
/// meets it.
const START_TOLERANCE: f64 = 1e-9;

/// (N, T) of every contact in a state, refused if it penetrates or violates its combination.
pub fn forces_of_state(scene: &Scene, state: &State) -> Result<Vec<(f64, f64)>, Error> {
    let (q, u) = start_coordinates(scene, state)?;
    Ok(contact_forces_in(scene, &state.combination, &q, &u))
}

/// Brings a start state to contact coordinates, refusing one that penetrates or violates its combination.
pub fn start_coordinates(scene: &Scene, state: &State) -> Result<(Vec<f64>, Vec<f64>), Error> {
    coordinates_at(scene, state, 0.0)
}

/// The same for a state at a time, on which the loads depend.
pub(crate) fn coordinates_at(
    scene: &Scene,
    state: &State,
    time: f64,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    for (argument, values) in [("position", &state.position), ("velocity", &state.velocity)] {
        if values.len() != scene.dofs {
            let expected = format!("shape ({},)", scene.dofs);
            return Err(Error::shape(argument, &expected, format!("({},)", values.len())));
        }
        check_finite(argument, values)?;
    }
    if state.combination.statuses().len() != scene.contacts.len() {
        return Err(Error::Combination {
            got: state.combination.to_string(),
            contacts: scene.contacts.len(),
        });
    }
    scene.check_combination(&state.combination)?;
    let (mut q, mut u) = scene.moving_coordinates(&state.position, &state.velocity, time);
    hold_nodes(scene, state, &mut q, &mut u)?;
    give_states(scene, state, &mut u)?;
    let condensed = Condensed::new(scene, &state.combination)?;
    if let Some(condensed) = &condensed {
        condensed.complete(&mut q, &mut u);
    }
    let violated = |contact, status: Status, argument, quantity, value| {
        let status = status.letter();
        Error::ViolatedStatus { argument, contact, status, quantity, value }
    };
    let (length, speed) = {
        let (q, u) = scene.at_rest(&q, &u);
        (max_norm(&q), max_norm(&u))
    };
    for (contact, (law, &status)) in
        scene.contacts.iter().zip(state.combination.statuses()).enumerate()
    {
        let violated =
            |argument, quantity, value| violated(contact, status, argument, quantity, value);
        let gap = law.gap_at(&q);
        let length_tolerance = START_TOLERANCE * length.max(law.gap.abs());
        let speed_tolerance = START_TOLERANCE * speed.max(law.slider_speed.abs());
        if gap < -length_tolerance {
            return Err(Error::Penetration { contact, gap });
        }
        if !status.is_closed() {
            q[law.normal] = q[law.normal].max(law.closed());
            if gap <= 0.0 && u[law.normal] < -speed_tolerance {
                return Err(violated("velocity", "gap velocity", u[law.normal]));
            }
            continue;
        }
        if gap > length_tolerance {
            return Err(violated("position", "gap", gap));
        }
        if u[law.normal].abs() > speed_tolerance {
            return Err(violated("velocity", "gap velocity", u[law.normal]));
        }
        q[law.normal] = law.closed();
        u[law.normal] = 0.0;
        let slip = u[law.tangential] - law.slider_speed;
        let consistent = match status {
            Status::Sticking => slip.abs() <= speed_tolerance,
            // It follows from forces.
            _ if scene.creeps(contact) => status.friction_sign() * slip <= speed_tolerance,
            Status::Slipping | Status::Elastic => true,
            Status::Positive => slip <= 0.0 || !scene.has_direction(contact),
            _ => slip >= 0.0 || !scene.has_direction(contact),
        };
        if !consistent {
            return Err(violated("velocity", "slip velocity", slip));
        }
        if status == Status::Sticking {
            u[law.tangential] = law.slider_speed;
        }
    }
    scene.begin_elastic_planes(&state.combination, &state.friction_force, &q, &mut u)?;
    let (mut undetermined, mut functions) = (Vec::new(), Vec::new());
    if scene.has_dependent_directions() {
        scene.fitted(&state.combination).follow(&mut q, &mut u);
        undetermined = undetermined_in(scene, &state.combination);
        functions = event_functions(scene, &state.combination)?;
    }
    if let Some(element) = scene.undefined_element(&q, &u) {
        return Err(Error::UndefinedElement { element: scene.element_name(element) });
    }
    // Where mass couples contacts, the forces of one follow from the friction of all at their slip speeds.
    let at_slip = scene.in_state(&state.combination, &q, &u);
    for (contact, (law, &status)) in
        at_slip.contacts.iter().zip(state.combination.statuses()).enumerate()
    {
        if !status.is_closed() {
            continue;
        }
        let violated = |quantity, value| violated(contact, status, "state", quantity, value);
        let (_, normal) = force_as(&at_slip, &state.combination, contact, status);
        let normal_force = normal.value(&q, &u);
        let tolerance = START_TOLERANCE * normal.magnitude(&q, &u);
        if undetermined.contains(&contact) {
            // One split of the forces that satisfies the inequalities is enough.
            let own = functions.iter().filter(|function| function.contact == contact);
            let kinematic = |kind| matches!(kind, EventKind::Velocity | EventKind::Impact);
            for function in own.filter(|function| !kinematic(function.trigger)) {
                let value = function.functional.value(&q, &u);
                if value < -START_TOLERANCE * function.functional.magnitude(&q, &u) {
                    return Err(violated("limit of its contact forces", value));
                }
            }
            continue;
        }
        if normal_force < -tolerance {
            return Err(violated("normal force", normal_force));
        }
        if law.is_elastic() {
            continue;
        }
        if let Some(plane) = law.plane {
            check_in_plane(&at_slip, contact, plane, status, &q, &u)?;
            continue;
        }
        let slip = u[law.tangential] - law.slider_speed;
        // Without mass, what sticks may also be at rest by its place alone.
        let held = status == Status::Sticking || law.tangential_has_mass();
        if slip == 0.0 && scene.has_direction(contact) && held {
            let (friction, _) = force_as(&at_slip, &state.combination, contact, Status::Sticking);
            let required = friction.value(&q, &u);
            let limit = law.static_friction * normal_force;
            let tolerance =
                law.static_friction * tolerance + START_TOLERANCE * friction.magnitude(&q, &u);
            let holds = match status {
                Status::Sticking => required.abs() <= limit + tolerance,
                Status::Positive => required >= law.friction * normal_force - tolerance,
                _ => required <= -law.friction * normal_force + tolerance,
            };
            if !holds {
                return Err(violated("required friction force at slip velocity 0", required));
            }
        }
    }
    if let Some(condensed) = &condensed {
        condensed.complete(&mut q, &mut u);
    }
    Ok((q, u))
}

/// Refuses a state in which the forces that a contact in a plane needs at rest do not fit its status.
fn check_in_plane(
    scene: &Scene,
    contact: usize,
    plane: Plane,
    status: Status,
    q: &[f64],
    u: &[f64],
) -> Result<(), Error> {
    let law = &scene.contacts[contact];
    let forces = [law.tangential, plane.tangential].map(|row| reaction(scene, row));
    let required = forces.each_ref().map(|force| force.value(q, u));
    let required = required[0].hypot(required[1]);
    let limit = law.static_friction * scene.reaction_value(law.normal, q, u);
    let size: f64 = forces.iter().map(|force| force.magnitude(q, u)).sum();
    let tolerance = START_TOLERANCE * (limit + size);
    // Friction of slip counts as a load in this scene.
    let holds = match status {
        Status::Sticking => required <= limit + tolerance,
        _ => law.slips_in(plane, u) || required >= limit - tolerance,
    };
    let (argument, quantity) = ("state", "required friction force at slip velocity 0");
    let violated = || {
        let status = status.letter();
        Error::ViolatedStatus { argument, contact, status, quantity, value: required }
    };
    if holds { Ok(()) } else { Err(violated()) }
}

/// Puts nodes of compliant contacts where their springs carry the friction forces of the state: those that stick, and those that
/// slide by laws. If the state has no friction forces, these slide steadily.
fn hold_nodes(scene: &Scene, state: &State, q: &mut [f64], u: &mut [f64]) -> Result<(), Error> {
    let forces = &state.friction_force;
    let statuses = state.combination.statuses();
    let spring = |law: &Contact| scene.stiffness.get(law.tangential, law.tangential);
    if forces.is_empty() {
        let mut held = q.to_vec();
        let closed = scene.contacts.iter().zip(statuses).filter(|(_, s)| s.is_closed());
        closed.for_each(|(law, _)| held[law.normal] = law.closed());
        for (contact, own) in scene.creeping(&state.combination) {
            let law = &scene.contacts[contact];
            if law.tangential >= scene.dofs {
                let normal = scene.reaction_value(law.normal, &held, u);
                let friction = own.value(law.slider_speed.abs()) * normal;
                q[law.tangential] += statuses[contact].friction_sign() * friction / spring(law);
            }
        }
        return Ok(());
    }
    if forces.len() != scene.contacts.len() {
        let expected = format!("shape ({},)", scene.contacts.len());
        return Err(Error::shape("friction_force", &expected, format!("({},)", forces.len())));
    }
    check_finite("friction_force", forces)?;
    for (contact, (law, (&status, force))) in
        scene.contacts.iter().zip(statuses.iter().zip(forces)).enumerate()
    {
        let held = status == Status::Sticking || status.is_sliding() && scene.creeps(contact);
        if held && law.tangential >= scene.dofs {
            q[law.tangential] += force / spring(law);
        }
    }
    Ok(())
}

/// Gives the contacts their states: those that are given, or those of steady slip at the slip velocity of the state, and 0 where this
/// vanishes. Open contacts have none. The deflection of a spring in a plane follows from its friction force instead.
fn give_states(scene: &Scene, state: &State, u: &mut [f64]) -> Result<(), Error> {
    let given = &state.internal;
    if !given.is_empty() && given.len() != scene.contacts.len() {
        let expected = format!("shape ({},)", scene.contacts.len());
        return Err(Error::shape("internal", &expected, format!("({},)", given.len())));
    }
    check_finite("internal", given)?;
    for (contact, &value) in given.iter().enumerate() {
        let closed = state.combination.statuses()[contact].is_closed();
        if value != 0.0 && !(closed && scene.internal_state_of(contact).is_some()) {
            let argument = format!("internal: contact {contact}");
            let requirement = "0 where a contact is open or has no state";
            return Err(Error::Range { argument, requirement, value });
        }
    }
    for (contact, own) in scene.state_contacts() {
        let law = &scene.contacts[*contact];
        if law.is_elastic() {
            continue;
        }
        if let Some(&value) = given.get(*contact) {
            u[own.coordinate] = own.rate_of(value);
            continue;
        }
        let slip = u[law.tangential] - law.slider_speed;
        let rounding = START_TOLERANCE * u[law.tangential].abs().max(law.slider_speed.abs());
        if slip.abs() > rounding && state.combination.statuses()[*contact].is_closed() {
            let rate = own.steady_rate(slip);
            if !rate.is_finite() {
                let reason = format!(
                    "there is no steady slip at the slip velocity {slip:e} m/s of the start; give its internal state"
                );
                return Err(Error::StateFormulas { contact: *contact, reason });
            }
            u[own.coordinate] = rate;
        }
    }
    Ok(())
}

/// (T, N) of a contact with a given status, while the others have their status of `combination`: if mass couples
/// contacts, the forces of one depend on the statuses of all.
fn force_as(
    scene: &Scene,
    combination: &Combination,
    contact: usize,
    status: Status,
) -> (Functional, Functional) {
    if !scene.contacts_coupled() {
        let law = &scene.contacts[contact];
        return (reaction(scene, law.tangential), reaction(scene, law.normal));
    }
    let mut statuses = combination.statuses().to_vec();
    statuses[contact] = status;
    contact_forces(scene, &Combination::new(statuses)).swap_remove(contact)
}

/// Event functions that are exactly zero in the start state depart from zero: their multiplicity follows
/// from the derivatives, each compared with its rounding.
pub(crate) fn initial_departures(
    scene: &Scene,
    combination: &Combination,
    q: &[f64],
    u: &[f64],
) -> Vec<Departure> {
    let scene = &*scene.in_state(combination, q, u);
    combination
        .statuses()
        .iter()
        .enumerate()
        .map(|(contact, &status)| {
            let law = &scene.contacts[contact];
            let force = |status| force_as(scene, combination, contact, status);
            let vanishes = |reaction: &Functional| {
                reaction.value(q, u).abs() <= START_TOLERANCE * reaction.magnitude(q, u)
            };
            if !law.normal_has_mass()
                && let Some(departure) = departure_without_mass(scene, contact, status, q, u)
            {
                return departure;
            }
            match status {
                Status::Detached if law.gap_at(q) == 0.0 => {
                    if u[law.normal] > 0.0 {
                        Departure::Gap(1)
                    } else if vanishes(&force(Status::Positive).1) {
                        Departure::Gap(3)
                    } else {
                        Departure::Gap(2)
                    }
                }
                _ if status.is_sliding() && u[law.tangential] == law.slider_speed => {
                    let normal = force(status).1.value(q, u);
                    let friction = status.friction_sign() * law.friction * normal;
                    let required = force(Status::Sticking).0;
                    let excess = (required.value(q, u) - friction).abs();
                    let rounding = START_TOLERANCE * required.magnitude(q, u);
                    Departure::Slip(if excess <= rounding { 2 } else { 1 })
                }
                _ => Departure::None,
            }
        })
        .collect()
}

/// The same for a contact without mass, whose forces and gap have rates that follow from the state; None if its slip, which
/// has mass, decides.
fn departure_without_mass(
    scene: &Scene,
    contact: usize,
    status: Status,
    q: &[f64],
    u: &[f64],
) -> Option<Departure> {
    let law = &scene.contacts[contact];
    if status.is_sliding() && scene.creeps(contact) {
        let slip = u[law.tangential] - law.slider_speed;
        let begins = slip.abs() <= START_TOLERANCE * law.slider_speed.abs();
        return Some(if begins { Departure::Slip(1) } else { Departure::None });
    }
    let multiplicity = |function: &Functional| {
        let rounding = START_TOLERANCE * function.magnitude(q, u);
        if function.value(q, u).abs() > rounding {
            return 0;
        }
        let rate = Functional { constant: 0.0, ..function.clone() };
        if rate.value(u, u).abs() > START_TOLERANCE * rate.magnitude(u, u) { 1 } else { 2 }
    };
    let normal = reaction(scene, law.normal);
    if status == Status::Detached {
        return Some(match multiplicity(&gap_of(law)) {
            0 => Departure::None,
            order => Departure::Gap(order),
        });
    }
    match multiplicity(&normal) {
        0 => {}
        order => return Some(Departure::Force(order)),
    }
    if law.tangential_has_mass() {
        return None;
    }
    if status == Status::Sticking {
        let friction = reaction(scene, law.tangential);
        for (bound, sign) in [(Status::Positive, -1.0), (Status::Negative, 1.0)] {
            let cone = normal.scaled(law.static_friction).plus(&friction.scaled(sign));
            match multiplicity(&cone) {
                0 => {}
                order => return Some(Departure::Bound(bound, order)),
            }
        }
    }
    Some(Departure::None)
}
