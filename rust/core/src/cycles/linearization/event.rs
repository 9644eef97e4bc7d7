//! The value of an event function along a motion, and its change. It is affine in the state, except for the terms that springs and
//! dampers by laws add, and laws of friction over slip speed if mass couples contacts; of a contact in a plane it is a sum of squares
//! of such functions.

use nalgebra::DMatrix;

use crate::contact::contact_forces::response;
use crate::contact::event_function::{ConePart, EventFunction, cone_parts};
use crate::contact::functional::Functional;
use crate::contact::linear_friction::of_phase;
use crate::cycles::linearization::flow::Flow;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// An affine function of the state and of the forces that are no linear function of it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Part {
    functional: Functional,
    /// The change per newton of each such force, those of laws of friction before those of elements; empty if they add nothing.
    by_force: Vec<f64>,
}

impl Part {
    fn value(&self, flow: &Flow<'_>, state: &[f64]) -> (f64, f64) {
        let (q, u) = state.split_at(state.len() / 2);
        let linear = (self.functional.value(q, u), self.functional.magnitude(q, u));
        if self.by_force.is_empty() {
            return linear;
        }
        let terms = self.by_force.iter().zip(flow.friction(state)).map(|(a, y)| a * y);
        terms.fold(linear, |(value, scale), term| (value + term, scale + term.abs()))
    }

    fn rate(&self, flow: &Flow<'_>, state: &[f64], direction: &[f64]) -> f64 {
        let (dq, du) = direction.split_at(direction.len() / 2);
        let linear = self.functional.rate(dq, du);
        if self.by_force.is_empty() {
            return linear;
        }
        let rates = flow.friction_rates(state, direction);
        self.by_force.iter().zip(rates).fold(linear, |sum, (a, dy)| sum + a * dy)
    }
}

/// `h(y)` in one combination.
#[derive(Debug, Clone)]
pub(crate) enum EventValue {
    Affine(Part),
    /// Of a contact in a plane: the functions whose squares add up, with their factors.
    Squares(Vec<(f64, Part)>),
}

impl Default for EventValue {
    fn default() -> Self {
        Self::Affine(Part::default())
    }
}

impl EventValue {
    pub fn new(scene: &Scene, combination: &Combination, function: EventFunction) -> Self {
        let phase = of_phase(scene, combination);
        let by_law = phase.sliding_by_law(combination).next().is_some();
        let is_linear = !by_law && phase.nonlinear_elements_in(combination).next().is_none();
        let response = if is_linear { None } else { response(&phase, combination) };
        let part = |function: EventFunction| {
            let of = |response: &DMatrix<f64>| {
                (0..response.ncols()).map(|source| function.response(response, source)).collect()
            };
            let by_force = response.as_ref().map(of).unwrap_or_default();
            Part { functional: function.functional, by_force }
        };
        match function.cone {
            None => Self::Affine(part(function)),
            Some(_) => {
                let squares = cone_parts(&phase, function.contact, combination).into_iter();
                let sign = |one: &EventFunction| one.cone.map_or(0.0, ConePart::sign);
                Self::Squares(squares.map(|one| (sign(&one), part(one))).collect())
            }
        }
    }

    /// Its value in a state, and the scale of its terms.
    pub fn value(&self, flow: &Flow<'_>, state: &[f64]) -> (f64, f64) {
        match self {
            Self::Affine(part) => part.value(flow, state),
            Self::Squares(parts) => parts.iter().fold((0.0, 0.0), |(sum, size), (sign, part)| {
                let square = part.value(flow, state).0.powi(2);
                (sum + sign * square, size + square)
            }),
        }
    }

    /// How it changes there along a direction (dq, dq').
    pub fn rate(&self, flow: &Flow<'_>, state: &[f64], direction: &[f64]) -> f64 {
        let of_square = |(sign, part): &(f64, Part)| {
            2.0 * sign * part.value(flow, state).0 * part.rate(flow, state, direction)
        };
        match self {
            Self::Affine(part) => part.rate(flow, state, direction),
            Self::Squares(parts) => parts.iter().map(of_square).sum(),
        }
    }
}
