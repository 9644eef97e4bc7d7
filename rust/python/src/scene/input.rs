//! What describes a scene, as Python passes it.

use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use stickslip_core as core;

use crate::convert::{MatrixInput, vector};

#[derive(FromPyObject)]
pub enum DirectionInput<'py> {
    Dof(usize),
    Vector(PyReadonlyArray1<'py, f64>),
    Entries(Vec<(usize, f64)>),
}

#[derive(FromPyObject)]
pub enum MassInput<'py> {
    Lumped(PyReadonlyArray1<'py, f64>),
    Full(MatrixInput<'py>),
}

#[derive(FromPyObject)]
pub enum DampingInput<'py> {
    Proportional(f64, f64),
    General(MatrixInput<'py>),
}

/// (normal, tangential) stiffness of a compliant contact, and the law of the normal one in place of a number.
type SpringData = (Option<f64>, Option<f64>, Option<LawData>);

pub type ContactData<'py> = (
    Option<DirectionInput<'py>>,
    Option<DirectionInput<'py>>,
    f64,
    f64,
    f64,
    f64,
    f64,
    f64,
    SpringData,
    Option<LawData>,
    Option<usize>,
);

/// The kind of a law of friction, and its numbers in the order of the core; of a table, speeds and pieces by rows of 4;
/// of a formula, its operations: their names, the slots of their operands, and a number; of a state, those of two formulas.
type LawData = (String, Vec<f64>, Vec<[f64; 4]>, Vec<(String, usize, usize, f64)>);

pub type Laws = Vec<Option<core::scene::FrictionLaw>>;

pub fn contact_inputs(
    contacts: &[ContactData<'_>],
) -> Result<Vec<core::ContactInput>, core::Error> {
    let direction = |input: &DirectionInput<'_>| match input {
        DirectionInput::Dof(dof) => core::Direction::Dof(*dof),
        DirectionInput::Vector(entries) => core::Direction::Vector(vector(entries)),
        DirectionInput::Entries(entries) => core::Direction::Entries(entries.clone()),
    };
    contacts
        .iter()
        .enumerate()
        .map(|(place, contact)| {
            let (
                tangential,
                normal,
                friction,
                static_friction,
                speed,
                restitution,
                gap,
                force,
                springs,
                law,
                beside,
            ) = contact;
            let pressed = spring_law(contact)?;
            let pressed = pressed.map(|law| core::scene::contact_stiffness(place, &law));
            Ok(core::ContactInput {
                tangential: tangential.as_ref().map(direction),
                normal: normal.as_ref().map(direction),
                normal_force: *force,
                friction: *friction,
                static_friction: *static_friction,
                slider_speed: *speed,
                restitution: *restitution,
                gap: *gap,
                springs: core::scene::Springs {
                    normal: pressed.transpose()?.or(springs.0),
                    tangential: springs.1,
                },
                state: law.as_ref().map(state).transpose()?.flatten(),
                beside: *beside,
            })
        })
        .collect()
}

/// Of a spring or a damper: its kind, its direction by entries, its offset, and its law.
pub type ElementData = (String, Vec<(usize, f64)>, f64, LawData);

/// The law of the normal stiffness of a contact, where it is no number.
fn spring_law(contact: &ContactData<'_>) -> Result<Option<core::scene::FrictionLaw>, core::Error> {
    let (.., springs, _, _) = contact;
    springs.2.as_ref().map(law).transpose()
}

/// Springs and dampers, and then the springs of contacts whose stiffness is a law.
pub fn elements(
    given: &[ElementData],
    contacts: &[ContactData<'_>],
) -> Result<Vec<core::scene::ElementInput>, core::Error> {
    let element = |(kind, direction, offset, data): &ElementData| {
        Ok(core::scene::ElementInput {
            kind: match &kind[..] {
                "damper" => core::scene::ElementKind::Damper,
                _ => core::scene::ElementKind::Spring,
            },
            place: core::scene::ElementPlace::Direction(direction.clone()),
            offset: *offset,
            law: law(data)?,
        })
    };
    let of_contact = |(place, contact)| {
        let input = |law| core::scene::ElementInput {
            kind: core::scene::ElementKind::Spring,
            place: core::scene::ElementPlace::Contact(place),
            offset: 0.0,
            law,
        };
        Ok(spring_law(contact)?.map(input))
    };
    let springs = contacts.iter().enumerate().map(of_contact).filter_map(Result::transpose);
    given.iter().map(element).chain(springs).collect()
}

/// How friction depends on slip speed, by contact.
pub fn friction_laws(contacts: &[ContactData<'_>]) -> Result<Laws, core::Error> {
    let of_speed = |data: &&LawData| data.0 != "state" && bristles(data).is_none();
    contacts
        .iter()
        .map(|contact| contact.9.as_ref().filter(of_speed).map(law).transpose())
        .collect()
}

/// The state of a contact, where its law has one: bristles, or the operations of force and rate one after the other, with the
/// number of the first ones.
fn state(data: &LawData) -> Result<Option<core::scene::ContactState>, core::Error> {
    let (kind, numbers, _, operations) = data;
    match (&kind[..], &numbers[..]) {
        ("state", &[count]) => {
            let (force, rate) = operations.split_at((count as usize).min(operations.len()));
            let formulas = Arc::new(core::scene::StateFormulas::new(force, rate)?);
            Ok(Some(core::scene::ContactState::Formulas(formulas)))
        }
        _ => Ok(bristles(data).map(core::scene::ContactState::Bristles)),
    }
}

/// The bristles of a contact, where its law has such.
fn bristles((kind, numbers, ..): &LawData) -> Option<core::scene::Bristles> {
    let plain = |kinetic, stiffness| core::scene::Bristles {
        stiffness,
        damping: 0.0,
        viscous: 0.0,
        kinetic,
        at_rest: kinetic,
        speed: 1.0,
        hysteresis: None,
    };
    Some(match (&kind[..], &numbers[..]) {
        ("dahl", &[kinetic, stiffness]) => plain(kinetic, stiffness),
        ("boucwen", &[kinetic, stiffness, exponent, share]) => {
            let hysteresis =
                core::scene::Hysteresis::BoucWen { exponent: exponent as usize, share };
            core::scene::Bristles { hysteresis: Some(hysteresis), ..plain(kinetic, stiffness) }
        }
        ("elastoplastic", &[kinetic, stiffness, break_away, damping, viscous]) => {
            let hysteresis = Some(core::scene::Hysteresis::ElastoPlastic { break_away });
            core::scene::Bristles { hysteresis, damping, viscous, ..plain(kinetic, stiffness) }
        }
        ("lugre", &[at_rest, kinetic, speed, stiffness, damping, viscous]) => {
            let plain = plain(kinetic, stiffness);
            core::scene::Bristles { damping, viscous, at_rest, speed, ..plain }
        }
        _ => return None,
    })
}

fn law(
    (kind, numbers, pieces, operations): &LawData,
) -> Result<core::scene::FrictionLaw, core::Error> {
    let decay = |kind: &str| core::scene::Decay::NAMES.iter().find(|(name, _)| *name == kind);
    Ok(match (decay(kind), &numbers[..]) {
        _ if kind == "formula" => core::scene::FrictionLaw::formula(operations)?,
        (Some(&(_, decay)), &[at_rest, kinetic, speed, ref viscous @ ..]) => {
            let viscous = viscous.first().copied().unwrap_or_default();
            core::scene::FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay }
        }
        (_, &[at_rest, slope]) if kind == "linear" => {
            core::scene::FrictionLaw::Linear { at_rest, slope }
        }
        (_, &[stiffness, exponent, straight_below]) if kind == "hertz" => {
            core::scene::FrictionLaw::power(stiffness, exponent, straight_below)?
        }
        (_, speeds) => core::scene::FrictionLaw::Tabulated(Arc::new(core::scene::Table {
            speeds: speeds.to_vec(),
            pieces: pieces.clone(),
        })),
    })
}

type Entries = Vec<(usize, f64)>;
/// Harmonic loads, switched loads, and vibrations of sliders.
pub type LoadData =
    (Vec<(Entries, f64, f64)>, Vec<(Entries, Vec<f64>, Vec<f64>)>, Vec<(usize, f64, f64, f64)>);

pub fn loads((harmonics, steps, vibrations): LoadData) -> core::scene::Loads {
    let harmonic =
        |(direction, frequency, phase)| core::scene::Harmonic { direction, frequency, phase };
    let step = |(direction, times, values)| core::scene::Steps { direction, times, values };
    let vibration = |(contact, amplitude, frequency, phase)| core::scene::Vibration {
        contact,
        amplitude,
        frequency,
        phase,
    };
    core::scene::Loads {
        harmonics: harmonics.into_iter().map(harmonic).collect(),
        steps: steps.into_iter().map(step).collect(),
        vibrations: vibrations.into_iter().map(vibration).collect(),
    }
}
