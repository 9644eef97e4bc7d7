//! The flow of one status combination: the end of a phase, its derivative by the start, and the vector field.
//!
//! Within a phase the state y = (q, q') moves by `M_s q'' = F_s(t) - C_s q' - K_s q` (see `reduction`), so
//! the state after a time tau is an affine map of the state before, `y(tau) = Phi(tau) y(0) + g(tau)`. A
//! column of Phi is therefore the exact difference of two motions, one of them from the origin, however
//! the combination is propagated. Free to vary are q and q' of the coordinates left free, and the
//! tangential displacement at which a sticking contact sticks: it loads the others for the whole phase.
//!
//! Under a law of friction over slip speed the map is not affine: its derivative comes from the linear equation along the
//! motion (see `motion::friction::neighbours`), and the field holds the forces of the laws.
//!
//! A phase far shorter than the period of every mode is summed as a Taylor series: then the tiny change of a gap in one
//! bounce keeps all digits, which the modal sum would lose by cancellation.

use nalgebra::DMatrix;
use std::cell::RefCell;
use std::sync::Arc;

use crate::contact::linear_friction::of_phase;
use crate::error::input::Error;
use crate::linalg::dense::max_norm;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::operator::LawOperator;
use crate::motion::method::{Method, Wanted};
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
/// Velocity at which a motion is given up, in terms of the largest at the starts of phases: panels become ever shorter where Newton's
/// method follows bristles under tension, whose deflection grows without limit in a finite time.
const BEYOND: f64 = 1e4;

/// One combination of a scene as a flow on states (q, q') of 2n entries.
#[derive(Debug)]
pub(crate) struct Flow<'a> {
    scene: &'a Scene,
    pub basis: Arc<CombinationBasis>,
    equation: EquationOfMotion,
    /// The scene without the coordinates that follow, if some coordinates have no mass.
    left: Option<Arc<Scene>>,
    /// Entries of (q, q') that may vary: the admissible space of the combination.
    pub free: Vec<usize>,
    /// The entries among them that belong to the structure: loads have no neighbours.
    pub section: Vec<usize>,
    /// Bound of the rates of the scene with lumped mass, an estimate of them with another one, 1/s.
    fastest: f64,
    /// The motion last computed, and where it started.
    running: RefCell<(Motion, Vec<f64>)>,
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
        let linear = of_phase(scene, &basis.combination);
        let by_law = linear.sliding_by_law(&basis.combination).next().is_some()
            || linear.slipping_in_planes(&basis.combination).next().is_some()
            || linear.nonlinear_elements_in(&basis.combination).next().is_some();
        let basis = match &basis.propagator {
            // Neighbours are carried in one piece.
            Propagator::Blocks(_) if by_law => {
                Arc::new(CombinationBasis::new(scene, &basis.combination, Wanted::Series)?)
            }
            _ => basis,
        };
        let equation = EquationOfMotion::new(&linear, &basis.combination)?;
        let Reduction { kept, sticking, .. } = &equation.reduction;
        let mut free: Vec<usize> = kept
            .iter()
            .copied()
            .chain(sticking.iter().map(|stick| stick.0).filter(|&k| k < scene.structure()))
            .chain(equation.creeping().iter().copied())
            .filter(|&k| !scene.is_hidden(k))
            .chain(kept.iter().map(|&k| scene.size + k))
            .collect();
        free.sort_unstable();
        let section = free.iter().copied().filter(|&k| scene.is_structure(k)).collect();
        let still = vec![0.0; scene.size];
        let motion = Motion::new(scene, &basis, &still, &still);
        let running = RefCell::new((motion, vec![0.0; 2 * scene.size]));
        let fastest = fastest(&linear);
        let left = basis.left_of(scene);
        Ok(Self { scene, basis, equation, left, free, section, fastest, running })
    }

    pub fn combination(&self) -> &Combination {
        &self.basis.combination
    }

    /// Gives up motions far faster than the fastest start.
    pub fn stay_near<'s>(&self, starts: impl Iterator<Item = &'s [f64]>) {
        let structure = self.scene.structure();
        let speed = starts.fold(0.0, |speed: f64, start| {
            let (q, u) = start.split_at(self.scene.size);
            speed.max(max_norm(&u[..structure])).max(self.fastest * max_norm(&q[..structure]))
        });
        if speed > 0.0 {
            self.running.borrow_mut().0.give_up_beyond(BEYOND * speed);
        }
    }

    /// The state a time `duration` after `start`.
    pub fn end(&self, start: &[f64], duration: f64) -> Vec<f64> {
        if self.law().is_none()
            && duration * self.fastest < SHORT
            && let Some(end) = self.series(start, duration)
        {
            return end;
        }
        let n = self.scene.size;
        let mut end = start.to_vec();
        let (q, u) = start.split_at(n);
        let (end_q, end_u) = end.split_at_mut(n);
        let (motion, from) = &mut *self.running.borrow_mut();
        // The same motion goes on from where it is.
        if from != start || !(duration >= motion.start()) {
            motion.restart(&self.basis, q, u);
            from.copy_from_slice(start);
        }
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
        let halves = |values: &[f64]| {
            let (position, velocity) = values.split_at(self.scene.size);
            (max_norm(position), max_norm(velocity))
        };
        let mut largest = (0.0f64, 0.0f64);
        for order in 2..=TERMS + 1 {
            end.iter_mut().zip(&term).for_each(|(end, term)| *end += term);
            let (position, velocity) = halves(&term);
            largest = (largest.0.max(position), largest.1.max(velocity));
            let factor = duration / order as f64;
            term = self.rate(&term, 0.0, &[]).iter().map(|rate| factor * rate).collect();
        }
        let (position, velocity) = halves(&term);
        let converged = |left: f64, largest: f64| left <= f64::EPSILON * largest;
        (converged(position, largest.0) && converged(velocity, largest.1)).then_some(end)
    }

    pub fn law(&self) -> Option<&LawOperator> {
        match &self.basis.propagator {
            Propagator::Law(operator) => Some(operator),
            _ => None,
        }
    }

    /// The longest stretch that one series covers under a law of friction, s.
    pub fn panel(&self) -> Option<f64> {
        self.law().map(|law| law.taylor.width())
    }

    /// Local time up to which the motion from `start` is one series after `time`, under a law of friction.
    pub fn smooth_until(&self, start: &[f64], time: f64) -> Option<f64> {
        self.law()?;
        self.end(start, time);
        self.running.borrow_mut().0.smooth_until(time)
    }

    /// Carries infinitesimal neighbours (dq, dq') of the motion from `start` over `duration`: what of them is free.
    pub fn carry(&self, start: &[f64], duration: f64, neighbours: &mut [Vec<f64>]) {
        let n = self.scene.size;
        // Coordinates that are sums of others move with them.
        let dependents = self.equation.scene(self.scene).dependents.iter();
        let following = dependents.flat_map(|one| [one.coordinate, n + one.coordinate]);
        let mut moving = vec![false; 2 * n];
        self.free.iter().copied().for_each(|k| moving[k] = true);
        for dy in &mut *neighbours {
            dy.iter_mut().zip(&moving).filter(|entry| !entry.1).for_each(|entry| *entry.0 = 0.0);
        }
        following.for_each(|k| moving[k] = true);
        // Velocities that follow from forces move with these.
        self.equation.creeping().iter().for_each(|k| moving[n + k] = true);
        if self.law().is_some() {
            let (motion, from) = &mut *self.running.borrow_mut();
            let (q, u) = start.split_at(n);
            motion.restart(&self.basis, q, u);
            motion.carry(duration, neighbours);
            // Its panels are those of the neighbours.
            from.fill(f64::NAN);
        } else {
            let origin = self.end(&vec![0.0; 2 * n], duration);
            for dy in &mut *neighbours {
                *dy = self.end(dy, duration);
                dy.iter_mut().zip(&origin).for_each(|(end, origin)| *end -= origin);
            }
        }
        for dy in neighbours {
            dy.iter_mut().zip(&moving).filter(|entry| !entry.1).for_each(|entry| *entry.0 = 0.0);
            let (q, u) = dy.split_at_mut(n);
            for half in [q, u] {
                self.equation.scene(self.scene).dependents.follow_rates(half);
                if let Some(condensed) = &self.basis.condensed {
                    condensed.slaved.follow_rates(half);
                }
            }
        }
    }

    /// Phi(duration) over all entries of (q, q'), along the motion from `start`; columns outside `free` are zero.
    pub fn transition(&self, start: &[f64], duration: f64) -> DMatrix<f64> {
        let size = 2 * self.scene.size;
        let unit = |&column: &usize| {
            let mut dy = vec![0.0; size];
            dy[column] = 1.0;
            dy
        };
        let mut columns: Vec<Vec<f64>> = self.free.iter().map(unit).collect();
        self.carry(start, duration, &mut columns);
        let mut transition = DMatrix::zeros(size, size);
        for (&column, dy) in self.free.iter().zip(&columns) {
            transition.column_mut(column).copy_from_slice(dy);
        }
        transition
    }

    /// Forces of the laws of friction in a state, by contact that slides by its law.
    pub fn friction(&self, state: &[f64]) -> Vec<f64> {
        let (q, u) = state.split_at(self.scene.size);
        self.law().map_or_else(Vec::new, |law| law.forces(q, u))
    }

    /// How these forces change along a direction (dq, dq').
    pub fn friction_rates(&self, state: &[f64], direction: &[f64]) -> Vec<f64> {
        let halves = |state| <[f64]>::split_at(state, self.scene.size).into();
        self.law().map_or_else(Vec::new, |law| law.force_rates(halves(state), halves(direction)))
    }

    /// `y' = (q', q'')`
    pub fn field(&self, state: &[f64]) -> Vec<f64> {
        let mut field = self.rate(state, 1.0, &self.friction(state));
        if let Some(law) = self.law().filter(|_| !self.equation.creeping().is_empty()) {
            let (speed, acceleration) = field.split_at_mut(self.scene.size);
            law.accelerate_flows(&state[..self.scene.size], speed, acceleration);
            if let Some(condensed) = &self.basis.condensed {
                condensed.slaved.follow_rates(acceleration);
            }
        }
        field
    }

    /// y'' in a state with y' = `field`.
    pub fn field_rate(&self, state: &[f64], field: &[f64]) -> Vec<f64> {
        let mut rate = self.rate(field, 0.0, &self.friction_rates(state, field));
        if let Some(law) = self.law().filter(|law| law.has_planes()) {
            let n = self.scene.size;
            let mut residual = vec![0.0; n];
            let mut acceleration = vec![0.0; n];
            let halves = |of| <[f64]>::split_at(of, n).into();
            law.push_rates_in_planes(halves(state), halves(field), &mut residual);
            self.equation.accelerate(&mut residual, &mut acceleration);
            rate[n..].iter_mut().zip(&acceleration).for_each(|(sum, part)| *sum += part);
        }
        rate
    }

    /// Of neighbours just carried up to the end of a slip in a plane: how the time of that grows with each of them.
    pub fn delay_of_stop(&self, neighbour: &[f64]) -> f64 {
        let by_slip = self.running.borrow().0.time_left_by_slip();
        let u = &neighbour[self.scene.size..];
        by_slip.map_or(f64::NAN, |terms| terms.iter().map(|&(k, weight)| weight * u[k]).sum())
    }

    /// The time until the slip of a contact in a plane ends, where this is not after `most`, s.
    pub fn slip_lasts(&self, start: &[f64], contact: usize, most: f64) -> Option<f64> {
        let (motion, from) = &mut *self.running.borrow_mut();
        let (q, u) = start.split_at(self.scene.size);
        motion.restart(&self.basis, q, u);
        from.fill(f64::NAN);
        motion.slip_lasts(contact, most)
    }

    /// `(q', q'')` of a state, with forces, loads and speeds of sticking contacts times `load` (0 leaves the linear part), and
    /// with the forces `friction` that laws add.
    fn rate(&self, state: &[f64], load: f64, friction: &[f64]) -> Vec<f64> {
        let scene = self.equation.scene(self.left.as_deref().unwrap_or(self.scene));
        let n = scene.size;
        let (q, u) = state.split_at(n);
        let mut residual = scene.residual(load, q, u);
        if let Some(law) = self.law() {
            law.push(friction, &mut residual);
            if load != 0.0 {
                law.push_in_planes(q, u, &mut residual);
            }
        }
        let mut field = vec![0.0; 2 * n];
        let (speed, acceleration) = field.split_at_mut(n);
        self.equation.accelerate(&mut residual, acceleration);
        let Reduction { kept, sticking, .. } = &self.equation.reduction;
        kept.iter().chain(self.equation.creeping()).for_each(|&k| speed[k] = u[k]);
        sticking.iter().for_each(|&(k, prescribed)| speed[k] = load * prescribed);
        if let Some(condensed) = &self.basis.condensed {
            condensed.slaved.follow_rates(speed);
            condensed.slaved.follow_rates(acceleration);
        }
        scene.dependents.follow_rates(speed);
        scene.dependents.follow_rates(acceleration);
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
