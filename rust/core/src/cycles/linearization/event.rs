//! The value of an event function along a motion, and its change. It is affine in the state, except for the terms that laws
//! of friction over slip speed add if mass couples contacts.

use crate::contact::contact_forces::response;
use crate::contact::event_function::{EventFunction, cone_parts};
use crate::contact::functional::Functional;
use crate::contact::linear_friction::of_phase;
use crate::cycles::linearization::flow::Flow;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// `h(y)` in one combination.
#[derive(Debug, Clone, Default)]
pub(crate) struct EventValue {
    pub functional: Functional,
    /// The change per newton of each law of friction, by contact that slides by its law; empty if the laws add nothing.
    friction: Vec<f64>,
    /// Of a contact in a plane: the functionals whose squares add up, with their factors; else empty.
    squares: Vec<(f64, Functional)>,
}

impl EventValue {
    pub fn new(scene: &Scene, combination: &Combination, function: EventFunction) -> Self {
        let mut friction = Vec::new();
        let phase = of_phase(scene, combination);
        let by_law = phase.sliding_by_law(combination).next().is_some();
        if (by_law || phase.nonlinear_elements_in(combination).next().is_some())
            && let Some(response) = response(&phase, combination)
        {
            friction
                .extend((0..response.ncols()).map(|source| function.response(&response, source)));
        }
        let status = |contact: usize| combination.statuses()[contact];
        let squares = match function.cone {
            Some(_) => cone_parts(&phase, function.contact, status(function.contact)),
            None => Vec::new(),
        };
        Self { functional: function.functional, friction, squares }
    }

    /// Its value in a state, and the scale of its terms.
    pub fn value(&self, flow: &Flow<'_>, state: &[f64]) -> (f64, f64) {
        let (q, u) = state.split_at(state.len() / 2);
        if !self.squares.is_empty() {
            let squares = self.squares.iter().map(|(sign, part)| (sign, part.value(q, u).powi(2)));
            return squares.fold((0.0, 0.0), |(sum, size), (sign, x)| (sum + sign * x, size + x));
        }
        let linear = (self.functional.value(q, u), self.functional.magnitude(q, u));
        if self.friction.is_empty() {
            return linear;
        }
        let terms = self.friction.iter().zip(flow.friction(state)).map(|(a, y)| a * y);
        terms.fold(linear, |(value, scale), term| (value + term, scale + term.abs()))
    }

    /// How it changes there along a direction (dq, dq').
    pub fn rate(&self, flow: &Flow<'_>, state: &[f64], direction: &[f64]) -> f64 {
        let (dq, du) = direction.split_at(direction.len() / 2);
        if !self.squares.is_empty() {
            let (q, u) = state.split_at(state.len() / 2);
            let rate = |(sign, f): &(f64, Functional)| 2.0 * sign * f.value(q, u) * f.rate(dq, du);
            return self.squares.iter().map(rate).sum();
        }
        let linear = self.functional.rate(dq, du);
        if self.friction.is_empty() {
            return linear;
        }
        let rates = flow.friction_rates(state, direction);
        self.friction.iter().zip(rates).fold(linear, |sum, (a, dy)| sum + a * dy)
    }
}
