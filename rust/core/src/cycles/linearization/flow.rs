//! The flow of one status combination: the end of a phase, its derivative by the start, and the vector field.
//!
//! Within a phase the state y = (q, q') moves by `M_s q'' = F_s(t) - C_s q' - K_s q` (see `reduction`), so
//! the state after a time tau is an affine map of the state before, `y(tau) = Phi(tau) y(0) + g(tau)`. A
//! column of Phi is therefore the exact difference of two motions, one of them from the origin, however
//! the combination is propagated. Free to vary are q and q' of the coordinates left free, and the
//! tangential displacement at which a sticking contact sticks: it loads the others for the whole phase.
//!
//! A phase far shorter than the period of every mode is summed as a Taylor series: then the tiny change of a gap in one
//! bounce keeps all digits, which the modal sum would lose by cancellation.

use nalgebra::DMatrix;
use std::cell::RefCell;
use std::sync::Arc;

use crate::error::Error;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::Method;
use crate::motion::phase_motion::Motion;
use crate::motion::propagators::Propagators;
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;
use crate::scene::status::Combination;

/// Duration, in terms of the fastest rate of the scene, below which a phase is summed as a series, and its terms:
/// the first one left out is below `SHORT^TERMS / (TERMS + 1)!` of the increment.
const SHORT: f64 = 0.01;
const TERMS: usize = 7;

/// One combination of a scene as a flow on states (q, q') of 2n entries.
#[derive(Debug)]
pub(crate) struct Flow<'a> {
    scene: &'a Scene,
    pub basis: Arc<CombinationBasis>,
    equation: EquationOfMotion,
    /// Entries of (q, q') that may vary: the admissible space of the combination.
    pub free: Vec<usize>,
    /// The entries among them that belong to the structure: loads have no neighbours.
    pub section: Vec<usize>,
    /// Bound of the rates of the scene with lumped mass, an estimate of them with another one, 1/s.
    fastest: f64,
    /// Buffers of the motions.
    running: RefCell<Motion>,
}

impl<'a> Flow<'a> {
    pub fn new(
        propagators: &'a Propagators,
        combination: &Combination,
        method: Method,
    ) -> Result<Self, Error> {
        let (basis, _) = propagators.basis(combination, method.for_repeated_use())?;
        Self::by(propagators, basis)
    }

    /// The flow of a combination that is propagated already.
    pub fn by(propagators: &'a Propagators, basis: Arc<CombinationBasis>) -> Result<Self, Error> {
        let scene = &propagators.scene;
        if let Some(contact) = (0..scene.contacts.len()).find(|&i| scene.friction_law(i).is_some())
        {
            return Err(Error::FrictionLawCycle { contact });
        }
        let equation = EquationOfMotion::new(scene, &basis.combination)?;
        let Reduction { kept, sticking, .. } = &equation.reduction;
        let mut free: Vec<usize> = kept
            .iter()
            .copied()
            .chain(sticking.iter().map(|stick| stick.0).filter(|&k| k < scene.structure()))
            .chain(kept.iter().map(|&k| scene.size + k))
            .collect();
        free.sort_unstable();
        let section = free.iter().copied().filter(|&k| scene.is_structure(k)).collect();
        let still = vec![0.0; scene.size];
        let motion = Motion::new(scene, &basis, &still, &still);
        let running = RefCell::new(motion);
        let fastest = fastest(scene);
        Ok(Self { scene, basis, equation, free, section, fastest, running })
    }

    pub fn combination(&self) -> &Combination {
        &self.basis.combination
    }

    /// The state a time `duration` after `start`.
    pub fn end(&self, start: &[f64], duration: f64) -> Vec<f64> {
        if duration * self.fastest < SHORT
            && let Some(end) = self.series(start, duration)
        {
            return end;
        }
        let n = self.scene.size;
        let mut end = start.to_vec();
        let (q, u) = start.split_at(n);
        let (end_q, end_u) = end.split_at_mut(n);
        let mut motion = self.running.borrow_mut();
        motion.restart(&self.basis, q, u);
        motion.seek(duration, end_q, end_u);
        // A combination that leaves nothing free still moves its sticking contacts.
        for &(k, speed) in &self.equation.reduction.sticking {
            end_q[k] = q[k] + speed * duration;
            end_u[k] = speed;
        }
        self.basis.complete(end_q, end_u);
        self.equation.scene(self.scene).follow(end_q, end_u);
        end
    }

    /// The same by its Taylor series, unless that has not converged.
    fn series(&self, start: &[f64], duration: f64) -> Option<Vec<f64>> {
        let mut end = start.to_vec();
        let mut term: Vec<f64> = self.field(start).iter().map(|rate| duration * rate).collect();
        let size = |values: &[f64]| values.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let halves = |values: &[f64]| {
            let (position, velocity) = values.split_at(self.scene.size);
            (size(position), size(velocity))
        };
        let mut largest = (0.0f64, 0.0f64);
        for order in 2..=TERMS + 1 {
            end.iter_mut().zip(&term).for_each(|(end, term)| *end += term);
            let (position, velocity) = halves(&term);
            largest = (largest.0.max(position), largest.1.max(velocity));
            let factor = duration / order as f64;
            term = self.rate(&term, 0.0).iter().map(|rate| factor * rate).collect();
        }
        let (position, velocity) = halves(&term);
        let converged = |left: f64, largest: f64| left <= f64::EPSILON * largest;
        (converged(position, largest.0) && converged(velocity, largest.1)).then_some(end)
    }

    /// Phi(duration) over all entries of (q, q'); columns outside `free` are zero.
    pub fn transition(&self, duration: f64) -> DMatrix<f64> {
        let size = 2 * self.scene.size;
        let mut start = vec![0.0; size];
        let origin = self.end(&start, duration);
        let mut transition = DMatrix::zeros(size, size);
        // Coordinates that are sums of others move with them.
        let dependents = self.equation.scene(self.scene).dependents.iter();
        let following: Vec<usize> =
            dependents.flat_map(|one| [one.coordinate, self.scene.size + one.coordinate]).collect();
        for &column in &self.free {
            start[column] = 1.0;
            let end = self.end(&start, duration);
            start[column] = 0.0;
            for &row in self.free.iter().chain(&following) {
                transition[(row, column)] = end[row] - origin[row];
            }
            if let Some(condensed) = &self.basis.condensed {
                let mut column = transition.column_mut(column);
                let (q, u) = column.as_mut_slice().split_at_mut(self.scene.size);
                condensed.complete_rates(q);
                condensed.complete_rates(u);
            }
        }
        transition
    }

    /// `y' = (q', q'')`
    pub fn field(&self, state: &[f64]) -> Vec<f64> {
        self.rate(state, 1.0)
    }

    /// `y'' = Phi' y'`: what the field becomes without loads and speeds of sticking contacts.
    pub fn linear_field(&self, field: &[f64]) -> Vec<f64> {
        self.rate(field, 0.0)
    }

    /// The same with all loads, forces and speeds of sticking contacts, times `load`: 0 leaves the linear part.
    fn rate(&self, state: &[f64], load: f64) -> Vec<f64> {
        let scene = self.equation.scene(self.basis.scene(self.scene));
        let n = scene.size;
        let (q, u) = state.split_at(n);
        let mut residual = scene.residual(load, q, u);
        let mut field = vec![0.0; 2 * n];
        let (speed, acceleration) = field.split_at_mut(n);
        self.equation.accelerate(&mut residual, acceleration);
        let Reduction { kept, sticking, .. } = &self.equation.reduction;
        kept.iter().for_each(|&k| speed[k] = u[k]);
        sticking.iter().for_each(|&(k, prescribed)| speed[k] = load * prescribed);
        if let Some(condensed) = &self.basis.condensed {
            condensed.complete_rates(speed);
            condensed.complete_rates(acceleration);
        }
        scene.follow_rates(speed);
        scene.follow_rates(acceleration);
        field
    }
}

/// The fastest rate is at most the root of the trace of `M^-1 K`, or the trace of `M^-1 C`, where M is diagonal.
fn fastest(scene: &Scene) -> f64 {
    // Coordinates without mass have no rate of their own.
    let massive = (0..scene.size).filter(|&k| scene.mass.get(k, k) > 0.0);
    let (stiff, damped) = massive.fold((0.0, 0.0), |(stiff, damped), k| {
        let mass = scene.mass.get(k, k);
        (stiff + scene.stiffness.get(k, k) / mass, damped + scene.damping.get(k, k) / mass)
    });
    f64::max(stiff.sqrt(), damped)
}
