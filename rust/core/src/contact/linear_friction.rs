//! Laws of friction that leave a phase linear.
//!
//! A contact that slides by `mu = mu_0 + m |s|` under a normal force N that does not change has the friction force
//!
//! ```text
//! T = -sign(s) mu_0 N - m N s,   s = t . x' - v
//! ```
//!
//! constant friction, and a damper between body and slider: `C + m N t t'` and `F + m N v t` in place of C and F.
//! Where m < 0, the phase ends at the latest at the slip speed `mu_0 / -m`, at which friction is zero.

use std::borrow::Cow;
use std::sync::Arc;

use crate::contact::contact_forces::{contact_forces, friction_response, reaction, undetermined};
use crate::contact::event_function::{EventFunction, slip_velocity};
use crate::contact::event_kind::EventKind;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// The contacts that slide by a law, each with its damper, N s/m. None where no contact does so, or where the friction of one
/// of them is not linear in the state.
pub(crate) fn friction_dampers(
    scene: &Scene,
    combination: &Combination,
) -> Option<Vec<(usize, f64)>> {
    let sliding = scene.sliding_by_law(combination);
    // What bristles multiply is their deflection, no constant force.
    let dashpot = |contact: usize, law: &FrictionLaw| match scene.state_of(contact) {
        None => law.linear(),
        Some(_) => None,
    };
    let slopes: Option<Vec<(usize, f64)>> =
        sliding.map(|(contact, law)| Some((contact, dashpot(contact, law)?))).collect();
    let slopes = slopes.filter(|slopes| !slopes.is_empty())?;
    // A damper on a coordinate without mass leaves an equation of first order.
    if scene.creeping(combination).next().is_some() {
        return None;
    }
    // Where its slip is a sum of others that vibrating sliders carry along, a damper would have to follow these, too.
    let carried = |contact: usize| {
        scene.drive.is_some() && scene.is_dependent(scene.contacts[contact].tangential)
    };
    if slopes.iter().any(|&(contact, _)| carried(contact)) {
        return None;
    }
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    let response = friction_response(scene, combination);
    let open = undetermined(scene, combination);
    let laws = scene.contacts.iter().zip(combination.statuses());
    let closed: Vec<(usize, f64)> = laws
        .filter(|(_, status)| status.is_closed())
        .map(|(law, _)| (law.normal, law.closed()))
        .collect();
    let place = |k: usize| closed.iter().find(|held| held.0 == k).map(|held| held.1);
    let unmoved = |terms: &[(usize, f64)]| {
        terms.iter().all(|&(k, weight)| weight == 0.0 || place(k).is_some())
    };
    let constant = |contact: usize| {
        let normal = match &coupled {
            Some(forces) => forces[contact].1.clone(),
            None => reaction(scene, scene.contacts[contact].normal),
        };
        let alone = response.as_ref().is_none_or(|all| {
            slopes.iter().all(|&(other, _)| all[(2 * contact + 1, other)] == 0.0)
        });
        let holds = alone && unmoved(&normal.position) && unmoved(&normal.velocity);
        let held = normal.position.iter().filter_map(|&(k, weight)| Some(weight * place(k)?));
        (holds && !open.contains(&contact)).then(|| held.fold(normal.constant, |sum, x| sum + x))
    };
    slopes.iter().map(|&(contact, slope)| Some((contact, slope * constant(contact)?))).collect()
}

/// The scene in which a combination moves by constant friction and dampers; itself where no law of friction does so.
pub(crate) fn of_phase<'a>(scene: &'a Scene, combination: &Combination) -> Cow<'a, Scene> {
    match friction_dampers(scene, combination) {
        None => Cow::Borrowed(scene),
        Some(dampers) => {
            let damped = |scene: &Scene| scene.with_friction_dampers(&dampers);
            let bare = scene.bare.as_ref().map(|bare| Arc::new(damped(bare)));
            Cow::Owned(Scene { bare, ..damped(scene) })
        }
    }
}

/// Where friction that falls with slip speed reaches zero: `mu_0 + m |s|`.
pub(crate) fn exhaustions(scene: &Scene, combination: &Combination) -> Vec<EventFunction> {
    let falling = scene.sliding_by_law(combination).filter_map(|(contact, law)| {
        let slope = law.linear().filter(|&slope| slope < 0.0)?;
        let sign = combination.statuses()[contact].friction_sign();
        let mut functional = slip_velocity(scene, contact).scaled(-sign * slope);
        functional.constant += law.value(0.0);
        Some(EventFunction::kinematic(contact, EventKind::Exhausted, functional))
    });
    falling.collect()
}
