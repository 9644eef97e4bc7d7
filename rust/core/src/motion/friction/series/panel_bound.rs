//! The error of a panel, and of a shorter one, from what it is made of.

use crate::motion::friction::series::coefficients::LawBounds;
use crate::motion::friction::series::law_contact::LawContact;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};

/// Largest L for which truncation is bounded.
pub(crate) const LARGEST: f64 = 0.5 * DEGREE as f64;

/// What the error of the state is made of on a panel, in the norm of the operator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PanelBound {
    /// Defects of the equation of motion from truncation and from rounding, times the width h; and a bound of the coefficient of
    /// order DEGREE + 1, which the polynomials of the event functions lack.
    pub truncated: f64,
    pub rounded: f64,
    pub beyond: f64,
    /// L
    pub exponent: f64,
    /// Radius of the neighbourhood in which the Lipschitz bounds of L hold.
    pub radius: f64,
    /// Whether the error is within the neighbourhood.
    pub holds: bool,
}

impl PanelBound {
    /// Error of the state by truncation alone.
    pub fn truncation(&self) -> f64 {
        self.truncated / (DEGREE as f64 - self.exponent.min(LARGEST)) + self.beyond
    }

    /// A bound of the error by rounding alone on a part of the width.
    pub fn rounding(&self, factor: f64) -> f64 {
        let exponent = factor * self.exponent;
        let growth = if exponent > 0.0 { exponent.exp_m1() / exponent } else { 1.0 };
        growth * factor * self.rounded
    }

    /// A bound of the error on a part of the width.
    pub fn of_shorter(&self, factor: f64) -> f64 {
        factor.powi(COEFFICIENTS as i32) * self.truncation() + self.rounding(factor)
    }
}

/// What the bound needs of one contact, and what it says of its force.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactBounds {
    pub law: LawBounds,
    /// `|mu(S) - mu(0)|` and |N|, as sums over their series.
    pub excess: f64,
    pub pressed: f64,
    /// The orders of their product from DEGREE and beyond.
    pub products: f64,
    /// Errors of y by truncation and by rounding, and its change per error of the state.
    pub cut: f64,
    pub round: f64,
    pub gain: f64,
    /// The change of a formula with a state per change of that.
    pub by_state: f64,
    /// Where slip has no mass: the change of its speed per error of the force that it follows from.
    pub by_force: f64,
}

impl ContactBounds {
    /// The change of the law per norm of a state of the scene, by its slip speed and its own state.
    pub fn by_inputs(&self, one: &LawContact) -> f64 {
        let by_state = one.state.as_ref().map_or(0.0, |state| self.by_state * state.norm);
        self.law.slope() * one.slip_norm + by_state
    }

    /// A bound of the error of y on a part of the width, where the state is off by `error`.
    pub fn of_shorter(&self, factor: f64, error: f64) -> f64 {
        self.cut * factor.powi(DEGREE as i32) + self.round + self.gain * error
    }
}
