//! Branches of periodic orbits followed along their own length, through folds.
//!
//! Orbit and parameter are unknown together, and a plane across the tangent of the branch takes the place of a
//! given parameter (H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", 1977):
//!
//! ```text
//! [ I - P   -b  ] [ dy_0 ]   [ defect ]
//! [ t_y'    t_p ] [ dp   ] = [ 0      ],   b = d defect / dp
//! ```
//!
//! is regular where I - P is not. The tangent solves the same equations with load (0, 1). b is a
//! central difference between two neighbouring scenes; its error only slows convergence.

use nalgebra::DVector;
use std::sync::Arc;

use crate::cycles::orbits::orbit::{Orbit, OrbitFailure, flows, period_of};
use crate::cycles::orbits::shooting::{Mismatch, Shooting};
use crate::linalg::dense::solve;
use crate::motion::propagators::Propagators;

/// Two scenes on either side of that of an orbit, `width` units of the parameter apart.
#[derive(Debug, Clone, Copy)]
pub struct Sides<'s> {
    /// The scene at the smaller parameter.
    pub below: &'s Arc<Propagators>,
    /// The scene at the larger parameter.
    pub above: &'s Arc<Propagators>,
    /// Distance of the two in the unit of the parameter, positive.
    pub width: f64,
}

/// A direction along a branch; the root of the sum of the squares of all its entries is 1.
#[derive(Debug, Clone)]
pub struct Tangent {
    /// Change of the entries of (q, q') that may vary at the section, displacements and velocities in units of their largest
    /// ranges over the orbit, -.
    pub state: Vec<f64>,
    /// Change of the parameter, in its unit.
    pub parameter: f64,
}

/// One step of Newton's method on an orbit and its parameter.
#[derive(Debug)]
pub struct Correction {
    /// The orbit after the step.
    pub orbit: Orbit,
    /// Change of the parameter, in its unit.
    pub parameter: f64,
    /// Largest change: of states and durations in terms of the orbit, of the parameter in its unit.
    pub size: f64,
}

impl Tangent {
    /// Towards larger values of the parameter.
    fn along_parameter(free: usize) -> Self {
        Self { state: vec![0.0; free], parameter: 1.0 }
    }
}

impl Orbit {
    /// The orbit as a guess in another scene, with the values that the other scene prescribes.
    fn placed(&self, propagators: &Arc<Propagators>) -> Result<Self, OrbitFailure> {
        let mut orbit = Self { propagators: Arc::clone(propagators), ..self.clone() };
        orbit.transfer();
        let flows = flows(propagators, orbit.method, &orbit.steps)?;
        orbit.constrain(&flows)?;
        orbit.period = period_of(&orbit.steps);
        Ok(orbit)
    }

    fn mismatch_in(&self, propagators: &Arc<Propagators>) -> Result<Mismatch, OrbitFailure> {
        let orbit = self.placed(propagators)?;
        let pass = orbit.pass(&orbit.flows()?)?;
        Ok(orbit.mismatches(&pass))
    }

    /// Mismatches per unit of the parameter.
    fn sensitivity(&self, sides: Sides<'_>) -> Result<Mismatch, OrbitFailure> {
        let (below, above) = (self.mismatch_in(sides.below)?, self.mismatch_in(sides.above)?);
        let slope = |above: &[f64], below: &[f64]| -> Vec<f64> {
            above.iter().zip(below).map(|(a, b)| (a - b) / sides.width).collect()
        };
        Ok(Mismatch {
            defects: above.defects.iter().zip(&below.defects).map(|(a, b)| slope(a, b)).collect(),
            delays: slope(&above.delays, &below.delays),
        })
    }

    /// The tangent of the branch, on the side that `before` points to; None: towards larger parameters.
    pub fn tangent(
        &self,
        sides: Sides<'_>,
        before: Option<&Tangent>,
    ) -> Result<Tangent, OrbitFailure> {
        let flows = self.flows()?;
        let pass = self.pass(&flows)?;
        let shooting = Shooting::new(self, &flows, &pass, self.scales());
        let sensitivity = self.sensitivity(sides)?;
        let free = shooting.free.len();
        let first = Tangent::along_parameter(free);
        let before = before.unwrap_or(&first);
        if before.state.len() != free {
            return Err(OrbitFailure::Singular);
        }
        let (state, parameter) = bordered(&shooting, &sensitivity, before, &vec![0.0; free], 1.0)?;
        let length = (state.iter().map(|x| x * x).sum::<f64>() + parameter * parameter).sqrt();
        Ok(Tangent {
            state: state.iter().map(|x| x / length).collect(),
            parameter: parameter / length,
        })
    }

    /// The guess a length away along the tangent; its parameter is `length * tangent.parameter` further.
    pub fn predicted(
        &self,
        sides: Sides<'_>,
        tangent: &Tangent,
        length: f64,
    ) -> Result<Self, OrbitFailure> {
        let flows = self.flows()?;
        let scales = self.scales();
        let shooting = Shooting::new(self, &flows, &self.pass(&flows)?, scales);
        let advance = self.sensitivity(sides)?.times(length * tangent.parameter);
        let section: Vec<f64> = shooting.state(&tangent.state).iter().map(|x| x * length).collect();
        let mut guess = self.clone();
        guess.moved(&flows, scales, shooting.carried(&section, &advance));
        Ok(guess)
    }

    /// One step of Newton's method across the tangent, from a guess for `scene`.
    pub fn corrected(
        &self,
        propagators: &Arc<Propagators>,
        sides: Sides<'_>,
        tangent: &Tangent,
    ) -> Result<Correction, OrbitFailure> {
        let mut orbit = self.placed(propagators)?;
        let flows = flows(propagators, orbit.method, &orbit.steps)?;
        let scales = orbit.scales();
        let pass = orbit.pass(&flows)?;
        orbit.residual = orbit.mismatch(&pass.arrived, scales);
        let shooting = Shooting::new(&orbit, &flows, &pass, scales);
        let sensitivity = orbit.sensitivity(sides)?;
        let load = shooting.load(&shooting.mismatch);
        let (state, parameter) = bordered(&shooting, &sensitivity, tangent, &load, 0.0)?;
        let total = shooting.mismatch.plus(&sensitivity.times(parameter));
        let changes = shooting.carried(&shooting.state(&state), &total);
        let size = orbit.moved(&flows, scales, changes).max(parameter.abs());
        Ok(Correction { orbit, parameter, size })
    }
}

impl Mismatch {
    fn times(&self, factor: f64) -> Self {
        let scaled = |values: &[f64]| values.iter().map(|x| factor * x).collect();
        Self {
            defects: self.defects.iter().map(|defect| scaled(defect)).collect(),
            delays: scaled(&self.delays),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self {
            defects: self.defects.iter().zip(&other.defects).map(|(a, b)| sum(a, b)).collect(),
            delays: sum(&self.delays, &other.delays),
        }
    }
}

/// State and parameter of the bordered equations, in their units.
fn bordered(
    shooting: &Shooting,
    sensitivity: &Mismatch,
    tangent: &Tangent,
    load: &[f64],
    last: f64,
) -> Result<(Vec<f64>, f64), OrbitFailure> {
    let free = load.len();
    let slope = DVector::from(shooting.load(sensitivity));
    let mut whole = shooting.matrix().resize(free + 1, free + 1, tangent.parameter);
    whole.view_mut((0, free), (free, 1)).copy_from(&-slope);
    whole.view_mut((free, 0), (1, free)).copy_from_slice(&tangent.state);
    let right: Vec<f64> = load.iter().copied().chain([last]).collect();
    let solution = solve(whole, &right);
    match solution.iter().all(|x| x.is_finite()) {
        true => Ok((solution[..free].to_vec(), solution[free])),
        false => Err(OrbitFailure::Singular),
    }
}
