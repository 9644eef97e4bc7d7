//! A contact whose friction depends on slip speed, or an element of the scene, in one combination.

use crate::contact::functional::Functional;
use crate::scene::friction::formula::Formula;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// Whose law it is, by its index in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LawOf {
    Contact(usize),
    /// Of bristles whose law depends on their deflection.
    Deflection(usize),
    Element(usize),
}

/// A contact that slides by its law; or an element, whose argument stands for the slip speed, with a normal force of 1.
#[derive(Debug)]
pub(crate) struct LawContact {
    pub of: LawOf,
    pub law: FrictionLaw,
    /// T / (mu N)
    pub sign: f64,
    /// The slip velocity, and what multiplies `mu(|s|) - mu(0)`: N without what laws add. Of bristles the deflection z stands for
    /// N everywhere and may be negative, or z for the slip speed and that for N. Of a formula with a state under a given normal
    /// force, 1.
    pub slip: Functional,
    pub normal: Functional,
    /// The coordinate whose velocity alone makes the slip speed, and its weight.
    pub single: Option<(usize, f64)>,
    /// `L' t` over the kept coordinates.
    pub direction: Vec<(usize, f64)>,
    /// Bounds of the slip velocity and of the normal force per norm of a state, and of the norm per unit of force.
    pub slip_norm: f64,
    pub normal_norm: f64,
    pub force_norm: f64,
    /// Where slip has no mass.
    pub flow: Option<Flow>,
    /// The state z of its law, where this is a formula of the slip speed and of z.
    pub state: Option<StateInput>,
}

/// The state that a formula depends on.
#[derive(Debug)]
pub(crate) struct StateInput {
    pub value: Functional,
    /// Bound of it per norm of a state of the scene.
    pub norm: f64,
    /// Whether a normal force that changes multiplies the formula: `y = force(s, z) N`.
    pub pressed: bool,
    /// Of a spring in a plane, whose normal force stands for the state.
    pub fading: Option<Fading>,
}

/// What becomes of a product of a spring in a plane towards the instant at which its normal force vanishes.
#[derive(Debug)]
pub(crate) struct Fading {
    /// The contact along the first direction of the plane.
    pub contact: usize,
    /// N'
    pub rate: Functional,
    /// The largest value of the law while the spring is within its limit.
    pub largest: f64,
}

/// A contact whose tangential coordinate has no mass and is a state of first order: its slip speed follows from
///
/// ```text
/// mu(|s|) N = R = sigma (K q - F)_t,   q_t' = v - sigma |s|
/// ```
///
/// in every order k of the series, as `mu'(S_0) N_0 S_k = R_k - mu(0) N_k - (terms of lower orders of S)`.
#[derive(Debug)]
pub(crate) struct Flow {
    pub coordinate: usize,
    /// v
    pub slider_speed: f64,
    /// R
    pub friction: Functional,
    /// Change of R per displacement of the coordinate, in the direction of R.
    pub spring: f64,
    /// Bound of R per norm of a state.
    pub friction_norm: f64,
    /// The norm per displacement of the coordinate.
    pub weight: f64,
}

impl LawContact {
    /// N, and what becomes of it towards `N = 0`, of a product of a spring in a plane whose normal force changes.
    pub fn fading(&self) -> Option<(&Functional, &Fading)> {
        let state = self.state.as_ref()?;
        Some((&state.value, state.fading.as_ref()?))
    }

    /// |s|
    pub fn speed(&self, q: &[f64], u: &[f64]) -> f64 {
        let argument = -self.sign * self.slip.value(q, u);
        if self.has_sign() { argument } else { argument.max(0.0) }
    }

    pub const fn is_element(&self) -> bool {
        matches!(self.of, LawOf::Element(_))
    }

    /// Whether its argument is no slip speed, which is positive.
    pub const fn has_sign(&self) -> bool {
        matches!(self.of, LawOf::Element(_) | LawOf::Deflection(_))
    }

    /// Whether its force is no product of two series: an element by a formula.
    pub const fn is_alone(&self) -> bool {
        self.is_element() && matches!(self.law, FrictionLaw::Formula(_))
    }

    /// The formula of a contact with a state that holds on a piece of its states, and this state.
    #[inline(always)]
    pub fn with_state(&self, piece: usize) -> Option<(&Formula, &StateInput)> {
        match (self.law.on(piece), &self.state) {
            (FrictionLaw::Formula(formula), Some(state)) => Some((formula, state)),
            _ => None,
        }
    }

    /// The piece of its law that holds in one state, at a slip speed.
    pub fn piece(&self, speed: f64, q: &[f64], u: &[f64]) -> usize {
        let argument = self.state.as_ref().map_or(speed, |state| state.value.value(q, u));
        self.law.piece(argument)
    }

    /// The coordinate whose velocity is the deflection of bristles in its place for N, with its weight.
    pub fn deflection(&self, scene: &Scene) -> Option<(usize, f64)> {
        match (self.of, &self.state) {
            (LawOf::Contact(contact), None) if scene.state_of(contact).is_some() => {
                self.normal.velocity.first().copied()
            }
            _ => None,
        }
    }

    /// Whether the normal force of its contact multiplies its law.
    pub fn multiplies_normal(&self, scene: &Scene) -> bool {
        match (self.of, &self.state) {
            (LawOf::Contact(_), Some(state)) => state.pressed,
            (LawOf::Contact(contact), None) => scene.state_of(contact).is_none(),
            _ => false,
        }
    }

    /// Whether its law is a formula with a state that gives its force without a factor.
    #[inline(always)]
    pub fn is_bare(&self) -> bool {
        self.state.as_ref().is_some_and(|state| !state.pressed)
    }

    /// A formula with a state, in one state, with its slopes over slip speed and state; 0 of other laws.
    pub fn formula_at(&self, q: &[f64], u: &[f64]) -> (f64, [f64; 2]) {
        let speed = self.speed(q, u);
        match self.with_state(self.piece(speed, q, u)) {
            Some((formula, state)) => formula.with_slopes(speed, state.value.value(q, u)),
            None => (0.0, [0.0; 2]),
        }
    }

    /// The value of a formula with a state, which no normal force multiplies; 0 of other laws.
    pub fn value_with_state(&self, q: &[f64], u: &[f64]) -> f64 {
        if self.is_bare() { self.formula_at(q, u).0 } else { 0.0 }
    }

    /// `mu(|s|) - mu(0)`, or a formula with a state that N multiplies; 0 of one without this factor.
    pub fn excess(&self, q: &[f64], u: &[f64]) -> f64 {
        if self.is_bare() {
            return 0.0;
        }
        match self.state {
            Some(_) => self.formula_at(q, u).0,
            None => self.law.value(self.speed(q, u)) - self.law.value(0.0),
        }
    }

    /// Adds what a force of its law is to a residual.
    pub fn push(&self, force: f64, residual: &mut [f64]) {
        for &(row, weight) in &self.direction {
            residual[row] += self.sign * weight * force;
        }
    }
}
