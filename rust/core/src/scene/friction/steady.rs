//! Steady sliding under friction that depends on slip speed.
//!
//! A contact that slides steadily has the slip speed |v| of its slider, and the friction of its law there. About it,
//! `|s| = |v| -+ t . x'` changes the friction force by `-N_0 mu'(|v|) t . x'` in either direction of sliding: small
//! motions see the damping matrix `C + N_0 mu' t t'`, negative damping where friction falls with speed.

use std::borrow::Cow;

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::Inertia;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

impl Scene {
    /// The same scene with laws of friction over slip speed, one entry per contact; None where it is constant. `friction`
    /// of the contacts has to be their law at rest.
    ///
    /// Where slip has no mass, the slip speed follows from the friction force by a law that rises; one that falls is refused,
    /// and one that is constant is a number. A law that vanishes at rest has to be a line there.
    pub fn with_friction_laws(mut self, mut laws: Vec<Option<FrictionLaw>>) -> Result<Self, Error> {
        let (given, expected) = (laws.len(), self.contacts.len());
        if given != expected {
            let expected = format!("{expected} entries, one per contact");
            return Err(Error::shape("friction laws", &expected, format!("{given} entries")));
        }
        for (contact, given) in laws.iter_mut().enumerate() {
            if self.state_of(contact).is_some() {
                if given.is_some() && self.contacts[contact].is_elastic() {
                    let reason = "a tangential_stiffness and friction that depends on slip speed; state a number";
                    return Err(Error::Plane { contact, reason });
                }
                if given.is_some() {
                    let reason = "a law of friction over slip speed; state one of the two";
                    return Err(Error::StateBeside { contact, reason });
                }
                *given = self.friction_law(contact).cloned();
                continue;
            }
            let Some(law) = given else { continue };
            law.validate(contact)?;
            if self.contacts[contact].plane.is_some() {
                let at_rest = law.value(0.0);
                if !(at_rest > 0.0) {
                    return Err(Error::Range {
                        argument: format!("contact {contact}: friction"),
                        requirement: "> 0 at rest, in a plane",
                        value: at_rest,
                    });
                }
                if law.linear() == Some(0.0) {
                    *given = None;
                }
                continue;
            }
            if self.contacts[contact].tangential_has_mass() {
                continue;
            }
            if law.linear() == Some(0.0) {
                *given = None;
            } else if law.rises_until().is_none() {
                return Err(Error::LawWithoutMass { contact, falls: law.falls() });
            } else if self.contacts[contact].static_friction == 0.0 && law.linear().is_none() {
                return Err(Error::Range {
                    argument: format!("contact {contact}: friction"),
                    requirement: "> 0 at rest, or a line through 0, where slip has no mass",
                    value: law.value(0.0),
                });
            }
        }
        if let Some([contact, _]) = self.planes().find(|&[one, other]| laws[one] != laws[other]) {
            let reason = "another law of friction along its other direction";
            return Err(Error::Plane { contact, reason });
        }
        self.laws = laws.iter().any(Option::is_some).then(|| laws.into());
        self.check_elastic_planes()?;
        Ok(self)
    }

    /// Whether friction of some contact depends on slip speed.
    pub fn has_friction_laws(&self) -> bool {
        self.laws.is_some()
    }

    /// The law of a contact, where it depends on slip speed.
    pub fn friction_law(&self, contact: usize) -> Option<&FrictionLaw> {
        self.laws.as_ref()?[contact].as_ref()
    }

    /// The contacts of a combination that slide by a law.
    pub(crate) fn sliding_by_law<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = (usize, &'a FrictionLaw)> {
        let statuses = combination.statuses().iter().enumerate();
        // In a plane the friction of a spring is a sum of products of series; that of a mass has a direction.
        let slides = |contact: usize, status: &Status| {
            status.is_sliding()
                || matches!(status, Status::Slipping) && self.contacts[contact].is_elastic()
        };
        let sliding = statuses.filter(move |&(contact, status)| slides(contact, status));
        sliding.filter_map(|(contact, _)| Some((contact, self.friction_law(contact)?)))
    }

    /// Those of them whose slip has no mass, so that their tangential coordinate is a state of first order.
    pub(crate) fn creeping<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = (usize, &'a FrictionLaw)> {
        self.sliding_by_law(combination).filter(|of| !self.contacts[of.0].tangential_has_mass())
    }

    /// Whether slip of a contact follows from its friction force by a law, without mass.
    pub(crate) fn creeps(&self, contact: usize) -> bool {
        self.friction_law(contact).is_some() && !self.contacts[contact].tangential_has_mass()
    }

    /// Whether a contact never sticks and its slip still has an event where it changes its sign: friction vanishes at rest, and
    /// `-mu(|s|) N sgn s` is no analytic function of s. A line through zero is one, without events; `|s| z` of bristles is none.
    pub(crate) fn reverses(&self, contact: usize) -> bool {
        let kinked = |law: &FrictionLaw| law.linear().is_none() || self.state_of(contact).is_some();
        self.contacts[contact].static_friction == 0.0
            && self.friction_law(contact).is_some_and(kinked)
    }

    /// Whether the sign of slip makes a difference to a contact.
    pub(crate) fn has_direction(&self, contact: usize) -> bool {
        self.contacts[contact].static_friction > 0.0 || self.reverses(contact)
    }

    /// The velocity of the tangential coordinate of such a contact that slides in a direction, from the balance of its forces:
    ///
    /// ```text
    /// mu(|s|) N = sigma (K q - F)_t,   q_t' = v - sigma |s|,   sigma = T / (mu N)
    /// ```
    pub(crate) fn creep_rate(&self, contact: usize, status: Status, q: &[f64]) -> f64 {
        let own = &self.contacts[contact];
        let Some(law) = self.friction_law(contact) else { return own.slider_speed };
        let sign = status.friction_sign();
        let reaction = |row: usize| self.stiffness.row_dot(row, q) - self.force[row];
        let (friction, normal) = (sign * reaction(own.tangential), reaction(own.normal));
        if !(normal > 0.0) {
            return own.slider_speed;
        }
        own.slider_speed - sign * law.speed_at((friction - law.value(0.0) * normal) / normal)
    }

    /// The coefficient of kinetic friction of a contact at its slip velocity in a state; 0 of bristles, whose friction is
    /// another one.
    pub(crate) fn friction_at(&self, contact: usize, u: &[f64]) -> f64 {
        if self.state_of(contact).is_some() {
            return 0.0;
        }
        let own = &self.contacts[contact];
        let of_law = |law: &FrictionLaw| law.value(own.slip_speed(u));
        self.friction_law(contact).map_or(own.friction, of_law)
    }

    /// Its slope over the slip speed there, s/m.
    pub(crate) fn friction_slope(&self, contact: usize, u: &[f64]) -> f64 {
        if self.state_of(contact).is_some() {
            return 0.0;
        }
        let speed = self.contacts[contact].slip_speed(u);
        self.friction_law(contact).map_or(0.0, |law| law.slope(speed))
    }

    /// The same scene with the constant friction that its laws have somewhere.
    fn with_friction(&self, friction: impl Fn(usize) -> f64) -> Cow<'_, Self> {
        if self.laws.is_none() {
            return Cow::Borrowed(self);
        }
        let mut scene = Self { laws: None, states: None, ..self.clone() };
        for (contact, own) in scene.contacts.iter_mut().enumerate() {
            own.friction = friction(contact);
        }
        Cow::Owned(scene)
    }

    /// With the friction of slip at the speed of each slider.
    pub(crate) fn at_steady_sliding(&self) -> Cow<'_, Self> {
        let still = vec![0.0; self.size];
        let friction = |contact: usize| {
            let slip = -self.contacts[contact].slider_speed;
            let of_state = self.state_of(contact).map(|own| own.steady_friction(slip));
            of_state.unwrap_or_else(|| self.friction_at(contact, &still))
        };
        let steady = match self.states {
            Some(_) => Cow::Owned(self.without_states().with_friction(friction).into_owned()),
            None => self.with_friction(friction),
        };
        match steady.has_planes() {
            true => Cow::Owned(steady.into_owned().with_slip_directions(&still)),
            false => steady,
        }
    }

    /// With the friction of the slip velocities of a state, and the tangents of elements there.
    pub(crate) fn in_state(
        &self,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Cow<'_, Self> {
        let at_slip = |scene: &Self| {
            let friction = |contact: usize| match scene.state_of(contact) {
                Some(own) if own.normal.is_some() => {
                    let status = combination.statuses()[contact];
                    own.friction_in(status, scene.contacts[contact].slider_speed, u)
                }
                _ => scene.friction_at(contact, u),
            };
            scene.laws.as_ref().map(|_| {
                let mut linear = scene.with_friction(friction).into_owned();
                if let Some((damping, force)) = scene.with_states_in(combination, q, u) {
                    (linear.damping, linear.proportional, linear.force) = (damping, None, force);
                }
                linear
            })
        };
        let in_state = match self.tangent(q, u) {
            Cow::Owned(tangent) => Cow::Owned(at_slip(&tangent).unwrap_or(tangent)),
            Cow::Borrowed(scene) => at_slip(scene).map_or(Cow::Borrowed(scene), Cow::Owned),
        };
        match self.has_planes() {
            true => Cow::Owned(in_state.into_owned().with_slip_directions(u)),
            false => in_state,
        }
    }

    /// Small motions about steady sliding of a combination; the scene itself where no contact slides by a law.
    pub(crate) fn linearised(&self, combination: &Combination) -> Result<Cow<'_, Self>, Error> {
        if self.has_elements() {
            let about = self.about_rest(combination)?;
            return Ok(Cow::Owned(about.linearised(combination)?.into_owned()));
        }
        if self.has_planes() {
            let about = self.about_slip_in_planes(combination)?;
            return Ok(Cow::Owned(about.linearised(combination)?.into_owned()));
        }
        if self.laws.is_none() {
            return Ok(Cow::Borrowed(self));
        }
        let steady = self.at_steady_sliding();
        let mut sliding = self.sliding_by_law(combination).map(|(contact, _)| contact);
        let Some(first) = sliding.next() else {
            // Springs of nodes that all rest.
            return Ok(if self.has_states() { self.about(combination, &[]) } else { steady });
        };
        if let Some(stuck) = combination.statuses().iter().position(|&s| s == Status::Sticking) {
            let combination = combination.to_string();
            return Err(Error::NoSteadyState { contact: first, stuck, combination });
        }
        let pressed = steady.steady(combination)?.margins;
        if sliding.chain([first]).any(|contact| pressed[contact].is_nan()) {
            let combination = combination.to_string();
            return Err(Error::SingularStiffness { combination, reciprocal_condition: 0.0 });
        }
        if self.has_dependent_directions() {
            self.tilted().steady(combination)?;
        }
        Ok(self.about(combination, &pressed))
    }

    /// With the friction of steady sliding and a part of its slope: where nothing determines how normal forces are split, laws of
    /// unlike slopes make the motion depend on the split, also if their friction at the speed of the sliders is alike.
    fn tilted(&self) -> Cow<'_, Self> {
        let still = vec![0.0; self.size];
        let slopes: Vec<f64> =
            (0..self.contacts.len()).map(|contact| self.friction_slope(contact, &still)).collect();
        let largest =
            slopes.iter().fold(f64::MIN_POSITIVE, |largest, slope| slope.abs().max(largest));
        self.with_friction(|contact| self.friction_at(contact, &still) + slopes[contact] / largest)
    }

    /// Small motions about a steady state of a combination with given normal forces of its contacts. Slip without mass moves by
    /// itself, with a damper and no mass.
    pub(crate) fn about(&self, combination: &Combination, pressed: &[f64]) -> Cow<'_, Self> {
        let steady = self.at_steady_sliding();
        let dampers: Vec<(usize, f64)> = self
            .sliding_by_law(combination)
            .filter(|&(contact, _)| self.state_of(contact).is_none())
            .map(|(contact, law)| {
                let slope = law.slope(self.contacts[contact].slider_speed.abs());
                (contact, pressed[contact] * slope)
            })
            .collect();
        let steady = match self.states {
            Some(_) => {
                Cow::Owned(self.with_states_about(combination, steady.into_owned(), pressed))
            }
            None => steady,
        };
        if dampers.is_empty() {
            return steady;
        }
        let mut scene = Self {
            damping: steady.damping_beside(&dampers),
            proportional: None,
            ..steady.into_owned()
        };
        let mut creeping = Vec::new();
        for (contact, _) in self.creeping(combination) {
            scene.contacts[contact].inertia = Inertia::Tangential;
            creeping.push(scene.contacts[contact].tangential);
        }
        if !creeping.is_empty() {
            scene.massless = scene.massless.without(&creeping);
        }
        Cow::Owned(scene)
    }

    /// The scene with dampers between bodies and sliders, by contact, N s/m, beside the friction of its laws at rest.
    pub(crate) fn with_friction_dampers(&self, dampers: &[(usize, f64)]) -> Self {
        let mut force = self.force.clone();
        for &(contact, damper) in dampers {
            let law = &self.contacts[contact];
            for (k, weight) in self.terms_of(law.tangential) {
                force[k] += damper * law.slider_speed * weight;
            }
        }
        let damping = self.damping_beside(dampers);
        let Self { mass, stiffness, coordinates, .. } = self;
        // Its bounds hold for this damping.
        let coupled_mass = coupled_mass(mass, &damping, stiffness, None, &coordinates.slots)
            .expect("the positive definite mass of the scene");
        let proportional = None;
        Self { laws: None, damping, proportional, coupled_mass, force, ..self.clone() }
    }

    /// C + G with dampers along the slip of contacts.
    fn damping_beside(&self, dampers: &[(usize, f64)]) -> SparseMatrix {
        let along = |&(contact, damper): &(usize, f64)| {
            (damper, self.terms_of(self.contacts[contact].tangential))
        };
        let along: Vec<(f64, Vec<(usize, f64)>)> = dampers.iter().map(along).collect();
        let added = SparseMatrix::of_springs(self.size, &along);
        self.damping.combined(1.0, &added, 1.0)
    }
}
