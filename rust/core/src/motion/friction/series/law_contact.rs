//! A contact whose friction depends on slip speed, in one combination.

use crate::contact::functional::Functional;
use crate::scene::friction::law::FrictionLaw;

/// A contact that slides by its law.
#[derive(Debug)]
pub(crate) struct LawContact {
    pub contact: usize,
    pub law: FrictionLaw,
    /// T / (mu N)
    pub sign: f64,
    /// The slip velocity, and N without what laws add.
    pub slip: Functional,
    pub normal: Functional,
    /// `L' t` over the kept coordinates.
    pub direction: Vec<(usize, f64)>,
    /// Bounds of the slip velocity and of the normal force per norm of a state, and of the norm per unit of force.
    pub slip_norm: f64,
    pub normal_norm: f64,
    pub force_norm: f64,
}

impl LawContact {
    /// |s|
    pub fn speed(&self, q: &[f64], u: &[f64]) -> f64 {
        (-self.sign * self.slip.value(q, u)).max(0.0)
    }

    /// `mu(|s|) - mu(0)`
    pub fn excess(&self, q: &[f64], u: &[f64]) -> f64 {
        self.law.value(self.speed(q, u)) - self.law.value(0.0)
    }

    /// Adds what a force of its law is to a residual.
    pub fn push(&self, force: f64, residual: &mut [f64]) {
        for &(row, weight) in &self.direction {
            residual[row] += self.sign * weight * force;
        }
    }
}
