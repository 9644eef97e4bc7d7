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
use crate::scene::elements::element::{Element, ElementInput, ElementKind};
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::model::Scene;

impl Scene {
    /// The same scene with springs and dampers.
    pub fn with_elements(mut self, given: &[ElementInput]) -> Result<Self, Error> {
        if given.is_empty() {
            return Ok(self);
        }
        if let Some(reason) = self.refuses_local_forces() {
            return Err(Error::Elements { reason });
        }
        let elements = given.iter().enumerate().map(|(place, one)| self.element(place, one));
        let elements = elements.collect::<Result<Vec<Element>, Error>>()?;
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
        Ok(self)
    }

    /// What elements and bristles are not computed beside, where the scene has such.
    pub(crate) fn refuses_local_forces(&self) -> Option<&'static str> {
        if !self.massless.is_empty() {
            return Some("dofs without mass or compliant contacts");
        }
        if self.has_dependent_directions() {
            return Some("contacts whose directions depend on each other");
        }
        let vibrates = self.loads.vibrations.iter().any(|load| load.amplitude != 0.0);
        vibrates.then_some("sliders that vibrate")
    }

    fn element(&self, place: usize, given: &ElementInput) -> Result<Element, Error> {
        let mut along = vec![0.0; self.dofs];
        for &(dof, entry) in &given.direction {
            *along.get_mut(dof).ok_or_else(|| {
                let expected = format!("dofs below {}", self.dofs);
                Error::shape("elements", &expected, format!("dof {dof} in element {place}"))
            })? += entry;
        }
        let along = self.coordinates.forces_of_dofs(&along).into_iter().enumerate();
        let direction = along.filter(|entry| entry.1 != 0.0).collect();
        given.law.validate_force(place)?;
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
        Ok(Element { kind: given.kind, direction, offset: given.offset, excess, linear })
    }

    pub(crate) fn elements(&self) -> &[Element] {
        self.elements.as_deref().unwrap_or(&[])
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
        let nonlinear: Vec<Element> =
            self.nonlinear_elements().map(|(_, one)| one.clone()).collect();
        if nonlinear.is_empty() {
            return Cow::Borrowed(self);
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
        let mut scene = Self {
            stiffness: with(&self.stiffness, &springs),
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
