//! Rest of a structure with nonlinear springs, by Newton's method.
//!
//! About a guess x_k the springs act as their tangents, so that one step is the equilibrium of a linear scene: of one combination
//! a linear system, of steady sliding with open contacts a complementarity problem. Where the steps do not settle, the nonlinear
//! parts `psi` of the springs are brought in by degrees: the rest under `p psi` is the guess for a larger p. There may be several
//! states of rest; this one is connected to that of the linear scene.

use crate::error::input::Error;
use crate::linalg::dense::{max_distance, max_norm};
use crate::scene::model::{Scene, State};
use crate::scene::statics::equilibrium::Equilibrium;
use crate::scene::status::{Combination, Status};

/// Steps of Newton's method at one part of the nonlinear forces.
const STEPS: usize = 60;
/// Halvings of the part by which they are brought in.
const SMALLEST: f64 = 1.0 / 1024.0;
/// Stretches of springs from which Newton's method begins where these alone hold the structure, m.
const STRETCHES: [f64; 6] = [1e-3, -1e-3, 1e-6, -1e-6, 1.0, -1.0];
/// Change of a displacement that ends the steps, relative to the largest: half of the digits, which the step to come doubles.
const NEAR: f64 = 1e-9;

impl Scene {
    /// The equilibrium of steady sliding, with the contacts open that would pull.
    pub(super) fn rest_with_elements(&self) -> Result<Equilibrium, Error> {
        let combination = self.clone().without_elements().sliding_combination();
        let combination = combination.map(|all| all.to_string()).unwrap_or_default();
        let rest = |scene: &Self| Ok(scene.steady_equilibrium()?.0);
        let at = |rest: &Equilibrium| self.touching(&rest.state);
        Ok(self.settle(&combination, rest, at)?.0)
    }

    /// The scene with the tangents of its elements at rest in a combination.
    pub(crate) fn about_rest(&self, combination: &Combination) -> Result<Self, Error> {
        Ok(self.linear_about(&self.place_of_rest(combination)?).into_owned())
    }

    /// The place of rest in a combination, in which contacts that stick are where they would slide steadily; the origin where
    /// nothing depends on it.
    pub(crate) fn place_of_rest(&self, combination: &Combination) -> Result<Vec<f64>, Error> {
        if self.nonlinear_elements_in(combination).next().is_none() {
            return Ok(vec![0.0; self.size]);
        }
        let slides = |(contact, &status): (usize, &Status)| match status {
            Status::Sticking => self.contacts[contact].driven().ok_or(contact),
            _ => Ok(status),
        };
        let statuses = combination.statuses().iter().enumerate().map(slides);
        let sliding = statuses
            .collect::<Result<Vec<Status>, usize>>()
            .map_err(|stuck| Error::PlaceAtRest { stuck, combination: combination.to_string() })?;
        let sliding = Combination::new(sliding);
        let rest = |scene: &Self| scene.at_steady_sliding().rest_of(&sliding);
        let at = |rest: &(Equilibrium, Vec<f64>)| self.touching(&rest.0.state);
        Ok(self.settle(&combination.to_string(), rest, at)?.1)
    }

    /// The place of a state, with the nodes of closed compliant contacts where their gaps are closed.
    fn touching(&self, state: &State) -> Vec<f64> {
        let (mut q, _) = self.to_coordinates(&state.position, &state.velocity);
        let contacts = self.contacts.iter().zip(state.combination.statuses());
        for (law, _) in contacts.filter(|(law, s)| s.is_closed() && !law.normal_has_mass()) {
            q[law.normal] = law.closed();
        }
        q
    }

    /// Newton's method: what `rest` gives with tangents at the place `at` which it rests, and that place.
    fn settle<T>(
        &self,
        combination: &str,
        rest: impl Fn(&Self) -> Result<T, Error>,
        at: impl Fn(&T) -> Vec<f64>,
    ) -> Result<(T, Vec<f64>), Error> {
        let none = || Error::NoRest { combination: combination.into() };
        let Ok(linear) = rest(&self.clone().without_elements()) else {
            // The springs alone may hold the structure: from where they are stretched a little.
            let mut guesses = STRETCHES.iter().map(|&stretch| self.stretched(stretch));
            return guesses.find_map(|q| self.newton(1.0, q, &rest, &at)).ok_or_else(none);
        };
        let (mut guess, mut done, mut step) = (at(&linear), 0.0, 1.0f64);
        loop {
            let part = (done + step).min(1.0);
            match self.newton(part, guess.clone(), &rest, &at) {
                Some(found) if part == 1.0 => return Ok(found),
                Some((_, q)) => (guess, done, step) = (q, part, 2.0 * step),
                None if step > SMALLEST => step *= 0.5,
                None => return Err(none()),
            }
        }
    }

    /// A place in which the springs have about this stretch.
    fn stretched(&self, stretch: f64) -> Vec<f64> {
        let mut q = vec![0.0; self.size];
        for one in self.elements() {
            let square: f64 = one.direction.iter().map(|term| term.1 * term.1).sum();
            one.direction.iter().for_each(|&(k, weight)| q[k] += stretch * weight / square);
        }
        q
    }

    fn newton<T>(
        &self,
        part: f64,
        mut q: Vec<f64>,
        rest: impl Fn(&Self) -> Result<T, Error>,
        at: impl Fn(&T) -> Vec<f64>,
    ) -> Option<(T, Vec<f64>)> {
        let still = vec![0.0; self.size];
        let mut near = false;
        for _ in 0..STEPS {
            if self.undefined_element(&q, &still).is_some() {
                return None;
            }
            let tangent = self.part_of_tangent(part, &q, &still).into_owned().without_elements();
            let found = rest(&tangent).ok()?;
            let next = at(&found);
            if near {
                return Some((found, next));
            }
            near = max_distance(&q, &next) <= NEAR * max_norm(&next);
            q = next;
        }
        None
    }
}
