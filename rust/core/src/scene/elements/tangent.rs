//! Local nonlinear elements: springs and dampers whose force is a function of one displacement or one velocity.
//!
//! A spring along d has the stretch `u = d . x - offset` and the force `-phi(u) d` on the dofs, a damper the rate `w = d . x'` and
//! the force `-phi(w) d`. Its linear part about zero is a part of K or C and of F, and `psi(u) = phi(u) - phi(0) - phi'(0) u` is
//! what the element keeps:
//!
//! ```text
//! M x'' + (C + phi_w'(0) d d') x' + (K + phi_u'(0) d d') x = F - (phi_u(0) - phi_u'(0) offset) d - psi d + contact forces
//! ```
//!
//! In one state the element acts as its *tangent*, a linear element with the same force and the same slope there. At an event
//! everything that needs forces and their first rates takes the scene with the tangents of its elements. The energy of a
//! spring is `int_0^u phi`.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::elements::element::{Element, ElementInput, ElementKind, ElementPlace};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// What elements and bristles are not computed beside.
const DEPENDENT: &str = "contacts whose directions depend on each other";

/// The stiffness of the node of a compliant contact, about which its law counts: the slope at zero, of a table that of its first piece.
pub fn contact_stiffness(contact: usize, law: &FrictionLaw) -> Result<f64, Error> {
    law.validate_force(&format!("contact {contact}: normal_stiffness"))?;
    let (force, slope) = (law.value(0.0), law.slope(0.0));
    let range = |name: &str, requirement, value| {
        let argument = format!("contact {contact}: normal_stiffness: {name}");
        Err(Error::Range { argument, requirement, value })
    };
    if force != 0.0 {
        return range("force at zero penetration", "0", force);
    }
    let FrictionLaw::Tabulated(table) = law else {
        if !(slope > 0.0 && slope.is_finite()) {
            return range("slope at zero penetration", "> 0 and finite; add a linear term", slope);
        }
        return Ok(slope);
    };
    let first = table.piece(0.0);
    let forces = table.pieces[first + 1..].iter().map(|piece| piece[0]);
    if let Some(force) = forces.clone().find(|&force| !(force > 0.0)) {
        return range("force at a penetration", "> 0", force);
    }
    if let Some(&[_, slope, ..]) = table.pieces.last().filter(|piece| !(piece[1] >= 0.0)) {
        return range("slope beyond the last penetration", ">= 0", slope);
    }
    // Its slope at zero may be zero; that of its first piece as a whole is not.
    let stiffness = forces.zip(&table.speeds[first + 1..]).map(|(force, at)| force / at).next();
    stiffness.map_or_else(|| range("slope", "> 0 somewhere", slope), Ok)
}

impl Scene {
    /// The same scene with springs and dampers.
    pub fn with_elements(mut self, given: &[ElementInput]) -> Result<Self, Error> {
        if given.is_empty() {
            return Ok(self);
        }
        if self.has_dependent_directions() {
            return Err(Error::Elements { reason: DEPENDENT });
        }
        let elements = given.iter().enumerate().map(|(place, one)| self.element(place, one));
        let elements = elements.collect::<Result<Vec<Element>, Error>>()?;
        let moves = |k: usize| elements.iter().any(|one| one.direction.iter().any(|d| d.0 == k));
        if self.vibrating().any(|contact| moves(self.contacts[contact].tangential)) {
            let reason = "sliders that vibrate along directions on which they act";
            return Err(Error::Elements { reason });
        }
        let at_zero = |one: &Element| (one.linear[1], one.preload());
        self = self.beside(&elements, &at_zero);
        let damps = |one: &Element| one.kind == ElementKind::Damper;
        if elements.iter().any(|one| damps(one) || one.linear[1] != 0.0) {
            self.proportional = None;
        }
        let Self { mass, damping, stiffness, coordinates, .. } = &self;
        let proportional = self.proportional;
        let border = Terms { proportional, structure: self.size, massless: &self.massless };
        if coordinates.decoupled {
            self.coupled_mass =
                coupled_mass(mass, damping, stiffness, Some(border), &coordinates.slots)?;
        }
        let mut preload = match &self.preload {
            Some(own) => own.to_vec(),
            None => vec![0.0; self.size],
        };
        for one in &elements {
            one.direction.iter().for_each(|&(k, weight)| preload[k] -= one.preload() * weight);
        }
        self.preload = Some(preload.into());
        self.elements = Some(elements.into());
        self.check_elastic_planes()?;
        Ok(self)
    }

    /// What states of contacts are not computed beside, where the scene has such.
    pub(crate) fn refuses_moving_directions(&self) -> Option<&'static str> {
        if self.has_dependent_directions() {
            return Some(DEPENDENT);
        }
        self.vibrating().next().map(|_| "sliders that vibrate")
    }

    /// The contacts whose sliders vibrate.
    fn vibrating(&self) -> impl Iterator<Item = usize> {
        let vibrates = self.loads.vibrations.iter().filter(|load| load.amplitude != 0.0);
        vibrates.map(|load| load.contact)
    }

    fn element(&self, place: usize, given: &ElementInput) -> Result<Element, Error> {
        let direction = match &given.place {
            ElementPlace::Direction(entries) => entries,
            ElementPlace::Contact(contact) => return self.spring_of_contact(*contact, &given.law),
        };
        let size = self.nodes.as_ref().map_or(self.dofs, |nodes| nodes.size);
        let mut along = vec![0.0; size];
        for &(dof, entry) in direction {
            let known = along[..self.dofs].get_mut(dof);
            *known.ok_or_else(|| {
                let expected = format!("dofs below {}", self.dofs);
                Error::shape("elements", &expected, format!("dof {dof} in element {place}"))
            })? += entry;
        }
        let along = self.coordinates.forces_of_dofs(&along).into_iter().enumerate();
        let direction: Vec<(usize, f64)> = along.filter(|entry| entry.1 != 0.0).collect();
        if direction.iter().any(|entry| self.massless.contains(entry.0)) {
            return Err(Error::Elements { reason: "dofs without mass on which they act" });
        }
        given.law.validate_force(&format!("element {place}: law"))?;
        let linear = [given.law.value(0.0), given.law.slope(0.0)];
        let range = |argument: &str, requirement, value| {
            let argument = format!("element {place}: law: {argument}");
            Err(Error::Range { argument, requirement, value })
        };
        for (argument, value) in [("force at zero", linear[0]), ("slope at zero", linear[1])] {
            if !value.is_finite() {
                return range(argument, "finite; give its argument an offset", value);
            }
        }
        if given.kind == ElementKind::Damper && linear[0] != 0.0 {
            return range("force at rest", "0", linear[0]);
        }
        let excess = given.law.less_line(linear);
        Ok(Element {
            kind: given.kind,
            direction,
            offset: given.offset,
            contact: None,
            node_stiffness: 0.0,
            excess,
            linear,
        })
    }

    /// The spring of a compliant contact beyond the stiffness that its node has already.
    fn spring_of_contact(&self, contact: usize, law: &FrictionLaw) -> Result<Element, Error> {
        let stiffness = contact_stiffness(contact, law)?;
        let nodes = self
            .nodes
            .as_ref()
            .ok_or(Error::ContactLaw { contact, reason: "needs a normal direction" })?;
        let along = nodes.stretch(contact);
        let along = self.coordinates.forces_of_dofs(&along).into_iter().enumerate();
        let direction: Vec<(usize, f64)> = along.filter(|entry| entry.1 != 0.0).collect();
        let of_contact = &self.contacts[contact];
        if !of_contact.tangential_has_mass() {
            let reason = "is not computed beside a tangential_stiffness: the slip of the node would depend on the rate of the normal force";
            return Err(Error::ContactLaw { contact, reason });
        }
        let lacks = |&(k, _): &(usize, f64)| k != of_contact.normal && self.massless.contains(k);
        if direction.iter().any(lacks) {
            let reason = "is not computed where the dofs of the contact have no mass";
            return Err(Error::ContactLaw { contact, reason });
        }
        // No piece ends where the contact opens.
        let law = law.beyond_zero();
        Ok(Element {
            kind: ElementKind::Spring,
            direction,
            offset: 0.0,
            contact: Some(contact),
            node_stiffness: stiffness,
            excess: law.less_line([0.0, stiffness]),
            linear: [0.0; 2],
        })
    }

    pub(crate) fn elements(&self) -> &[Element] {
        self.elements.as_deref().unwrap_or(&[])
    }

    /// Of contacts without a normal force, the first whose spring is still pressed.
    pub(crate) fn pulling(
        &self,
        mut released: impl Iterator<Item = usize>,
        q: &[f64],
    ) -> Option<usize> {
        released.find(|&contact| self.contact_spring(contact).is_some_and(|one| one.pulls(q)))
    }

    /// The spring of a compliant contact whose stiffness is a law.
    pub(crate) fn contact_spring(&self, contact: usize) -> Option<&Element> {
        let mut springs = self.nonlinear_elements().map(|(_, one)| one);
        springs.find(|one| one.contact == Some(contact))
    }

    /// What errors call an element.
    pub(crate) fn element_name(&self, place: usize) -> String {
        match self.elements()[place].contact {
            Some(contact) => format!("normal_stiffness of contact {contact}"),
            None => format!("element {place}"),
        }
    }

    /// Whether the scene has springs or dampers of its own.
    pub fn has_elements(&self) -> bool {
        self.elements.is_some()
    }

    /// Those of its elements that are not linear, tables first.
    pub(crate) fn nonlinear_elements(&self) -> impl Iterator<Item = (usize, &Element)> {
        let of_kind = |tables: bool| {
            let elements = self.elements().iter().enumerate();
            elements.filter(move |(_, one)| !one.is_linear() && one.is_tabulated() == tables)
        };
        of_kind(true).chain(of_kind(false))
    }

    /// The same without the springs of open contacts, which are relaxed.
    pub(crate) fn nonlinear_elements_in<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = (usize, &'a Element)> {
        let presses = |contact: usize| combination.statuses()[contact].is_closed();
        self.nonlinear_elements().filter(move |(_, one)| one.contact.is_none_or(presses))
    }

    /// The same scene, linear where the springs of open contacts alone are not.
    pub(crate) fn pressed_in(&self, combination: &Combination) -> Cow<'_, Self> {
        let relaxed = self.nonlinear_elements_in(combination).next().is_none();
        match relaxed && self.nonlinear_elements().next().is_some() {
            true => Cow::Owned(self.clone().without_elements()),
            false => Cow::Borrowed(self),
        }
    }

    /// Whether some element that is not linear acts on the directions of contacts; others leave contact forces in a state alone.
    pub(crate) fn elements_at_contacts(&self) -> bool {
        let of_contact =
            |k: usize| self.contacts.iter().any(|law| law.tangential == k || law.normal == k);
        let mut elements = self.nonlinear_elements();
        elements.any(|(_, one)| one.direction.iter().any(|term| of_contact(term.0)))
    }

    /// Whether forces in a phase are no linear functions of the state.
    pub(crate) fn is_nonlinear(&self) -> bool {
        self.laws.is_some() || self.has_planes() || self.nonlinear_elements().next().is_some()
    }

    /// F without what elements and bristles bring along.
    pub(crate) fn external_force(&self) -> Cow<'_, [f64]> {
        match &self.preload {
            None => Cow::Borrowed(&self.force),
            Some(preload) => {
                Cow::Owned(self.force.iter().zip(&preload[..]).map(|(f, own)| f - own).collect())
            }
        }
    }

    /// The same scene with the tangents of its elements in a state: forces and their first rates there are those of the scene.
    pub(crate) fn tangent(&self, q: &[f64], u: &[f64]) -> Cow<'_, Self> {
        self.part_of_tangent(1.0, q, u)
    }

    /// The same with a part of the forces psi.
    pub(crate) fn part_of_tangent(&self, part: f64, q: &[f64], u: &[f64]) -> Cow<'_, Self> {
        // Where a contact touches, or is open, its spring has the stiffness of its node.
        let acts = |one: &&Element| one.contact.is_none() || !one.is_relaxed(q);
        let nonlinear: Vec<Element> =
            self.nonlinear_elements().map(|(_, one)| one).filter(acts).cloned().collect();
        if nonlinear.is_empty() {
            return match self.nonlinear_elements().next() {
                Some(_) => Cow::Owned(self.clone().without_elements()),
                None => Cow::Borrowed(self),
            };
        }
        let at = |one: &Element| {
            let argument = one.argument(q, u);
            let slope = part * one.excess.slope(argument);
            (slope, part * one.excess.value(argument) - slope * (argument + one.offset))
        };
        let scene = self.beside(&nonlinear, &at).without_elements();
        Cow::Owned(Self { proportional: None, ..scene })
    }

    /// The same scene in which the elements act as their tangents at a place.
    pub(crate) fn linear_about(&self, q: &[f64]) -> Cow<'_, Self> {
        match self.has_elements() {
            true => {
                Cow::Owned(self.tangent(q, &vec![0.0; self.size]).into_owned().without_elements())
            }
            false => Cow::Borrowed(self),
        }
    }

    /// The scene without its elements; their linear parts stay.
    pub(crate) fn without_elements(self) -> Self {
        let without = |bare: Arc<Self>| Arc::new(Self { elements: None, ..Self::clone(&bare) });
        Self { elements: None, bare: self.bare.clone().map(without), ..self }
    }

    /// With linear elements of slopes and constant forces, (N/m or N s/m, N).
    fn beside(&self, elements: &[Element], linear: &dyn Fn(&Element) -> (f64, f64)) -> Self {
        let of_kind = |kind: ElementKind| {
            let own = elements.iter().filter(|one| one.kind == kind);
            let along: Vec<_> = own.map(|one| (linear(one).0, one.direction.clone())).collect();
            SparseMatrix::of_springs(self.size, &along)
        };
        let mut force = self.force.clone();
        for one in elements {
            let (_, constant) = linear(one);
            one.direction.iter().for_each(|&(k, weight)| force[k] -= constant * weight);
        }
        let [springs, dampers] = [ElementKind::Spring, ElementKind::Damper].map(of_kind);
        let with = |matrix: &SparseMatrix, added: &SparseMatrix| matrix.combined(1.0, added, 1.0);
        let stiffness = with(&self.stiffness, &springs);
        let touched = elements.iter().any(|one| one.contact.is_some());
        let massless = match touched {
            true => self.massless.with_stiffness(&stiffness),
            false => self.massless.clone(),
        };
        let mut scene = Self {
            massless,
            stiffness,
            damping: with(&self.damping, &dampers),
            force,
            bare: None,
            ..self.clone()
        };
        if let Some(parts) = &mut scene.energy_parts {
            parts.elastic = with(&parts.elastic, &springs);
            parts.dissipative = with(&parts.dissipative, &dampers);
        }
        scene.bare = self.bare.as_ref().map(|bare| Arc::new(bare.beside(elements, linear)));
        scene
    }

    /// The energy of its springs beyond what K stores, J.
    pub(crate) fn element_energy(&self, q: &[f64]) -> f64 {
        self.elements().iter().map(|one| one.energy(q)).sum()
    }

    /// Its change between two states.
    pub(crate) fn element_energy_change(&self, from: &[f64], to: &[f64]) -> f64 {
        self.elements().iter().map(|one| one.energy_change(from, to)).sum()
    }

    /// The rate of this energy, W, and the power that dampers take beyond `u' C u`.
    pub(crate) fn element_powers(&self, q: &[f64], u: &[f64]) -> [f64; 2] {
        let mut powers = [0.0; 2];
        for one in self.elements() {
            let force = one.excess.value(one.argument(q, u));
            let (place, constant) = match one.kind {
                ElementKind::Spring => (0, one.preload()),
                ElementKind::Damper => (1, 0.0),
            };
            powers[place] += (force + constant) * one.along(u);
        }
        powers
    }

    /// The first element whose law has no finite force in a state.
    pub(crate) fn undefined_element(&self, q: &[f64], u: &[f64]) -> Option<usize> {
        self.elements().iter().position(|one| !one.has_value(one.argument(q, u)))
    }
}
