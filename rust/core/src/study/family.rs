//! Scenes as functions of numbers: a template, and what each parameter sets in it.
//!
//! A template is a chain of subsystems or any scene; a slot is one field of it, at one place or at all of them.

use std::sync::Arc;

use crate::error::input::Error;
use crate::modes::growth::{ChainMatrices, Verdict, chain_growth};
use crate::scene::chain::{Link, Subsystem, chain};
use crate::scene::contact_law::{ContactInput, Directions};
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::loads::input::Loads;
use crate::scene::model::Scene;
use crate::scene::statics::margins::Steady;
use crate::scene::status::{Combination, Status};
use crate::study::fields::{Field, Slot};

/// A chain of subsystems with its contacts.
#[derive(Debug, Clone)]
pub struct Chain {
    /// The subsystems from the wall on.
    pub subsystems: Vec<Subsystem>,
    /// The springs between neighbours, link i between subsystems i and i + 1.
    pub links: Vec<Link>,
    /// Between the wall and the horizontal of the first upper mass, N/m.
    pub wall_stiffness: f64,
    /// beta of `C = beta K`.
    pub damping: f64,
    /// The contacts; their dofs are those of the chain, four per subsystem.
    pub contacts: Vec<ContactInput>,
    /// Whether an impact has a Coulomb impulse too; see [`SceneInput::impact_friction`].
    pub impact_friction: bool,
}

impl Chain {
    /// The matrices, force and contacts of the chain, not yet validated.
    pub fn input(&self) -> SceneInput {
        let (mass, stiffness, force) = chain(&self.subsystems, &self.links, self.wall_stiffness);
        SceneInput {
            mass: Mass::Lumped(mass),
            stiffness,
            damping: Damping::Proportional { mass: 0.0, stiffness: self.damping },
            gyroscopic: None,
            circulatory: None,
            force,
            contacts: self.contacts.clone(),
            impact_friction: self.impact_friction,
            loads: Default::default(),
        }
    }

    /// The verdict on a chain whose contacts all slide, in a combination or as their sliders drive them, without its scene; None
    /// where that has to be asked.
    pub(crate) fn verdict(
        &self,
        combination: Option<&Combination>,
        matrices: &mut ChainMatrices,
    ) -> Option<Verdict> {
        let driven = |contact: &ContactInput| Status::driven_by(contact.slider_speed);
        let statuses: Vec<Status> = match combination {
            Some(combination) => combination.statuses().to_vec(),
            None => self.contacts.iter().map(driven).collect::<Option<_>>()?,
        };
        let slides = |status: &Status| matches!(status, Status::Positive | Status::Negative);
        let has_both = |contact: &ContactInput| contact.directions() == Directions::Both;
        let is_sliding = statuses.iter().all(slides) && self.contacts.iter().all(has_both);
        if !(is_sliding && self.is_well_posed()) {
            return None;
        }
        let friction = |part: usize| statuses[part].friction_sign() * self.contacts[part].friction;
        let Self { subsystems, links, wall_stiffness, damping, .. } = self;
        let (growth, margins) =
            chain_growth(subsystems, links, *wall_stiffness, *damping, friction, matrices);
        let mut contacts = self.contacts.iter().zip(&statuses);
        let exists = contacts.all(|(contact, &status)| driven(contact) == Some(status))
            && margins.iter().all(|&normal_force| normal_force >= 0.0);
        Some(Verdict { growth, steady: Steady { exists, margins } })
    }

    /// Whether the numbers that parameters set make a valid scene.
    pub fn is_well_posed(&self) -> bool {
        let size = crate::scene::chain::DOFS * self.subsystems.len();
        let positive = |value: f64| value > 0.0 && value.is_finite();
        self.wall_stiffness.is_finite()
            && self.damping.is_finite()
            && self.subsystems.iter().all(|part| {
                positive(part.upper_mass)
                    && positive(part.contact_mass)
                    && part.inclination.is_finite()
                    && part.vertical_stiffness.is_finite()
                    && part.horizontal_stiffness.is_finite()
                    && part.ceiling_stiffness.is_finite()
                    && part.preload_displacement.is_finite()
                    && part.external_force.is_finite()
            })
            && self.links.iter().all(|link| {
                link.horizontal_stiffness.is_finite() && link.vertical_stiffness.is_finite()
            })
            && self.contacts.iter().enumerate().all(|(i, law)| law.validate(i, size).is_ok())
    }
}

/// The scene in which parameters set numbers.
#[derive(Debug, Clone)]
pub enum Template {
    /// A chain: all its fields can be set.
    Chain(Chain),
    /// Any scene: the fields of its contacts can be set.
    Scene(Box<SceneInput>),
}

/// A template and the slots that a row of numbers fills, one number per slot.
#[derive(Debug, Clone)]
pub struct Family {
    template: Template,
    slots: Vec<Slot>,
    /// Contacts whose static friction equals their friction, whatever that is.
    following: Vec<usize>,
}

impl Family {
    /// `following`: for each contact whether its static friction equals its friction. None where a slot does not
    /// belong to the template.
    pub fn new(template: Template, slots: Vec<Slot>, following: &[bool]) -> Option<Self> {
        let sets_static = |contact: usize| {
            slots.iter().any(|slot| {
                slot.field == Field::StaticFriction && slot.place.is_none_or(|k| k == contact)
            })
        };
        let following = (0..following.len()).filter(|&k| following[k] && !sets_static(k)).collect();
        let mut family = Self { template, slots: Vec::new(), following };
        let mut probe = family.template.clone();
        for &slot in &slots {
            if !visit(&mut probe, slot, |_| {}) {
                return None;
            }
        }
        family.slots = slots;
        Some(family)
    }

    /// Numbers per row.
    pub fn width(&self) -> usize {
        self.slots.len()
    }

    /// A copy of the template, to be filled row by row.
    pub fn template(&self) -> Template {
        self.template.clone()
    }

    /// Puts a row into a template of this family.
    pub fn fill(&self, template: &mut Template, row: &[f64]) {
        for (&slot, &value) in self.slots.iter().zip(row) {
            visit(template, slot, |entry| *entry = value);
            let shared =
                matches!(slot.field, Field::Friction | Field::StaticFriction | Field::NormalForce);
            if let (true, Some(place), Template::Scene(input)) = (shared, slot.place, &*template)
                && let Some(beside) = input.contacts[place].beside
            {
                // Both directions of friction in a plane have one.
                let slot = Slot { place: Some(beside), ..slot };
                visit(template, slot, |entry| *entry = value);
            }
        }
        let contacts = match template {
            Template::Chain(chain) => &mut chain.contacts,
            Template::Scene(input) => &mut input.contacts,
        };
        for &contact in &self.following {
            contacts[contact].static_friction = contacts[contact].friction;
        }
    }
}

impl Template {
    /// The validated scene of the numbers now in the template.
    pub fn scene(&self) -> Result<Arc<Scene>, Error> {
        let input = match self {
            Template::Chain(chain) => {
                let input = chain.input();
                // Every mass of a chain is one of its parameters.
                if let Mass::Lumped(mass) = &input.mass
                    && let Some(dof) = mass.iter().position(|&mass| mass == 0.0)
                {
                    return Err(Error::IndefiniteMass { dof, value: 0.0 });
                }
                input
            }
            Template::Scene(input) => (**input).clone(),
        };
        Scene::new(input).map(Arc::new)
    }
}

/// The number of a load in time that a slot stands for.
fn load_number(loads: &mut Loads, Slot { field, place }: Slot) -> Option<&mut f64> {
    let place = place?;
    let Loads { harmonics, steps, vibrations } = loads;
    match field {
        Field::HarmonicAmplitude => only(&mut harmonics.get_mut(place)?.direction),
        Field::HarmonicFrequency => Some(&mut harmonics.get_mut(place)?.frequency),
        Field::HarmonicPhase => Some(&mut harmonics.get_mut(place)?.phase),
        Field::StepsAmplitude => only(&mut steps.get_mut(place)?.direction),
        Field::StepsTimes => steps.iter_mut().flat_map(|load| &mut load.times).nth(place),
        Field::StepsValues => steps.iter_mut().flat_map(|load| &mut load.values).nth(place),
        Field::VibrationAmplitude => Some(&mut vibrations.get_mut(place)?.amplitude),
        Field::VibrationFrequency => Some(&mut vibrations.get_mut(place)?.frequency),
        Field::VibrationPhase => Some(&mut vibrations.get_mut(place)?.phase),
        _ => None,
    }
}

/// The entry of a load along one dof.
fn only(direction: &mut [(usize, f64)]) -> Option<&mut f64> {
    match direction {
        [(_, entry)] => Some(entry),
        _ => None,
    }
}

/// Hands every number that a slot stands for to `change`; whether there is one.
fn visit(template: &mut Template, slot: Slot, mut change: impl FnMut(&mut f64)) -> bool {
    let (contacts, chain) = match template {
        Template::Chain(Chain { subsystems, links, wall_stiffness, damping, contacts, .. }) => {
            (contacts, Some((subsystems, links, wall_stiffness, damping)))
        }
        Template::Scene(input) => {
            if let Some(entry) = load_number(&mut input.loads, slot) {
                change(entry);
                return true;
            }
            (&mut input.contacts, None)
        }
    };
    let Slot { field, place } = slot;
    let mut found = false;
    let mut set = |entry: &mut f64| {
        found = true;
        change(entry);
    };
    if let Some((about, number)) = contact_number(field) {
        // A number for all contacts sets those that have such a field.
        let concerned = |law: &ContactInput| place.is_some() || about.contains(&law.directions());
        let chosen = at(contacts, place).filter(|law| concerned(law));
        chosen.filter_map(number).for_each(&mut set);
    }
    if let Some((parts, links, wall, damping)) = chain {
        if let Some(number) = subsystem_number(field) {
            at(parts, place).for_each(|part| set(number(part)));
        }
        if let Some(number) = link_number(field) {
            at(links, place).for_each(|link| set(number(link)));
        }
        match field {
            Field::WallStiffness if place.is_none() => set(wall),
            Field::Damping if place.is_none() => set(damping),
            _ => {}
        }
    }
    found
}

/// The items at a place, or all of them.
fn at<T>(items: &mut [T], place: Option<usize>) -> impl Iterator<Item = &mut T> {
    let all = items.iter_mut().enumerate();
    all.filter(move |(k, _)| place.is_none_or(|place| place == *k)).map(|(_, item)| item)
}

/// The number of a contact that a field stands for, and the directions of the contacts that have it.
type ContactNumber = (&'static [Directions], fn(&mut ContactInput) -> Option<&mut f64>);

fn contact_number(field: Field) -> Option<ContactNumber> {
    const SLIPPING: &[Directions] = &[Directions::Both, Directions::Tangential];
    const CLOSING: &[Directions] = &[Directions::Both, Directions::Normal];
    const ALL: &[Directions] = &[Directions::Both, Directions::Tangential, Directions::Normal];
    Some(match field {
        Field::Friction => (SLIPPING, |law| Some(&mut law.friction)),
        Field::StaticFriction => (SLIPPING, |law| Some(&mut law.static_friction)),
        Field::SliderSpeed => (SLIPPING, |law| Some(&mut law.slider_speed)),
        Field::Restitution => (CLOSING, |law| Some(&mut law.restitution)),
        Field::Gap => (CLOSING, |law| Some(&mut law.gap)),
        Field::NormalForce => (&[Directions::Tangential], |law| {
            Some(&mut law.normal_force).filter(|force| **force > 0.0)
        }),
        Field::NormalStiffness => (ALL, |law| law.springs.normal.as_mut()),
        Field::TangentialStiffness => (ALL, |law| law.springs.tangential.as_mut()),
        _ => return None,
    })
}

/// The number of a subsystem that a field stands for.
fn subsystem_number(field: Field) -> Option<fn(&mut Subsystem) -> &mut f64> {
    Some(match field {
        Field::UpperMass => |part| &mut part.upper_mass,
        Field::ContactMass => |part| &mut part.contact_mass,
        Field::Inclination => |part| &mut part.inclination,
        Field::VerticalStiffness => |part| &mut part.vertical_stiffness,
        Field::HorizontalStiffness => |part| &mut part.horizontal_stiffness,
        Field::CeilingStiffness => |part| &mut part.ceiling_stiffness,
        Field::PreloadDisplacement => |part| &mut part.preload_displacement,
        Field::ExternalForce => |part| &mut part.external_force,
        _ => return None,
    })
}

/// The number of a link that a field stands for.
fn link_number(field: Field) -> Option<fn(&mut Link) -> &mut f64> {
    Some(match field {
        Field::LinkHorizontalStiffness => |link| &mut link.horizontal_stiffness,
        Field::LinkVerticalStiffness => |link| &mut link.vertical_stiffness,
        _ => return None,
    })
}
