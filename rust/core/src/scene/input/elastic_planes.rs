//! Contacts in planes with a tangential stiffness: what they may have besides, and the state that they have for it.

use crate::error::input::Error;
use crate::scene::contact_law::{ContactInput, Springs};
use crate::scene::friction::bristles::{Bristles, Hysteresis};
use crate::scene::friction::contact_state::ContactState;

/// Contacts in which those in a plane with a tangential stiffness have a state in place of their friction and their spring.
pub(crate) fn with_loops(mut contacts: Vec<ContactInput>) -> Result<Vec<ContactInput>, Error> {
    for contact in 0..contacts.len() {
        let Some(beside) = contacts[contact].beside else { continue };
        let (law, other) = (&contacts[contact], &contacts[beside]);
        // The first direction changes both.
        let rigid = |law: &ContactInput| law.springs.tangential.is_none();
        if law.state.is_some() || rigid(law) && rigid(other) {
            continue;
        }
        let stiffness = spring_of(contact, law, other)?;
        let given = law.normal.is_none() && other.normal.is_none();
        // Where the normal force changes, the numbers of the state are those of one newton.
        let normal_force = if given { law.normal_force } else { 1.0 };
        let state = ContactState::Bristles(Bristles {
            stiffness: stiffness / normal_force,
            damping: 0.0,
            viscous: 0.0,
            kinetic: law.friction,
            at_rest: law.friction,
            speed: 1.0,
            hysteresis: Some(Hysteresis::Plane),
        });
        for own in [contact, beside] {
            contacts[own].state = Some(state.clone());
            contacts[own].normal_force = normal_force;
            (contacts[own].friction, contacts[own].static_friction) = (0.0, 0.0);
            contacts[own].springs = Springs::default();
        }
    }
    Ok(contacts)
}

/// The stiffness of a contact in a plane, where elastic slip is computed.
fn spring_of(contact: usize, law: &ContactInput, other: &ContactInput) -> Result<f64, Error> {
    let refused = |reason| Err(Error::Plane { contact, reason });
    if law.springs.normal.is_some() || other.springs.normal.is_some() {
        return refused("a normal_stiffness; tie a dof with a small mass to the body by a spring");
    }
    let Some(stiffness) = law.springs.tangential.filter(|_| law.springs == other.springs) else {
        return refused("another tangential_stiffness along its other direction");
    };
    if law.static_friction > law.friction {
        return refused(
            "a tangential_stiffness and a static friction above the kinetic one, under which the node would jump",
        );
    }
    if law.friction == 0.0 {
        let argument = format!("contact {contact}: friction");
        let requirement = "> 0 beside a tangential_stiffness in a plane";
        return Err(Error::Range { argument, requirement, value: 0.0 });
    }
    Ok(stiffness)
}
