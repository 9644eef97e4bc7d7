//! Periodic orbits of a given event sequence, by Newton's method on the exact return map.
//!
//! A cycle of K phases is K start states y_k, durations tau_k and passages with
//!
//! ```text
//! y_{k+1} = g_k(phi_k(y_k, tau_k)),   h_k(phi_k(y_k, tau_k)) = 0,   y_K = y_0
//! ```
//!
//! (multiple shooting, so that an unstable orbit is found as well as a stable one). Every passage gives
//! its duration, which leaves `dy_{k+1} = P_k dy_k + r_k` with the return map's derivative P_k; chaining them
//! leaves one linear system of the admissible space at the section y_0, just after an event.
//!
//! Floquet multipliers are the eigenvalues of the product of the `S_k Phi_k`. Sticking and contact leave fewer
//! coordinates free, and the product has no larger rank than its narrowest place: it is formed
//! there, and the rest of the multipliers at the section are zero exactly.

use std::sync::Arc;

use num_complex::Complex64;

use crate::eigen;
use crate::error::{Error, RunFailure};
use crate::flow::Flow;
use crate::saltation::{Linearised, Passage, product};
use crate::scene::Scene;
use crate::simulation::{Clock, Method};
use crate::status::Combination;
use crate::trajectory::EventKind;

/// Newton steps; from a recurrence within the basin six or seven reach rounding.
const STEPS: usize = 25;
/// A step larger than the orbit itself leads to another orbit, if to any.
const LARGEST_STEP: f64 = 3.0;
/// A relative step below which the orbit is as good as rounding allows.
const ROUNDING: f64 = 1e-13;
/// A relative step that may be the last one if the next is no smaller.
const NEARLY: f64 = 1e-9;

/// One phase of a cycle and the event that ends it.
#[derive(Debug, Clone)]
pub struct Step {
    pub combination: Combination,
    /// (q, q') at its start, contact coordinates.
    pub(crate) state: Vec<f64>,
    pub duration: f64,
    pub(crate) passage: Passage,
    pub kind: EventKind,
}

/// Why no orbit was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrbitFailure {
    #[error(
        "Newton's method did not converge: the last of {steps} steps changed the orbit by {change:e} of its size"
    )]
    Diverged { steps: usize, change: f64 },
    #[error("the return map has a multiplier 1 besides the one of its phase")]
    Singular,
    #[error(transparent)]
    Failed(#[from] RunFailure),
}

impl From<Error> for OrbitFailure {
    fn from(error: Error) -> Self {
        Self::Failed(error.into())
    }
}

/// A periodic orbit of a scene.
#[derive(Debug, Clone)]
pub struct Orbit {
    pub(crate) scene: Arc<Scene>,
    pub(crate) method: Method,
    pub steps: Vec<Step>,
    pub period: f64,
    /// Largest mismatch of a phase's end and the next one's start, relative to the range of the orbit.
    pub residual: f64,
}

/// The multipliers at the section and how many of them are zero by structure.
#[derive(Debug, Clone)]
pub struct Multipliers {
    /// Descending in modulus, conjugates adjacent.
    pub values: Vec<Complex64>,
    pub structural_zeros: usize,
}

/// Typical sizes of displacement changes and velocities along an orbit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    pub length: f64,
    pub speed: f64,
}

impl Scales {
    pub fn of<'s>(n: usize, states: impl Iterator<Item = &'s [f64]> + Clone) -> Self {
        let range = |k: usize| {
            let (low, high) = states
                .clone()
                .map(|state| state[k])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                    (low.min(x), high.max(x))
                });
            high - low
        };
        let positive = |size: f64| if size > 0.0 { size } else { 1.0 };
        Self {
            length: positive((0..n).map(range).fold(0.0, f64::max)),
            speed: positive((n..2 * n).map(range).fold(0.0, f64::max)),
        }
    }

    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let n = a.len() / 2;
        a.iter()
            .zip(b)
            .enumerate()
            .map(|(k, (a, b))| (a - b).abs() / if k < n { self.length } else { self.speed })
            .fold(0.0, |size, x| if x.is_nan() { x } else { size.max(x) })
    }
}

/// One pass along an orbit: where every phase ends, and all derivatives there.
struct Pass {
    arrived: Vec<Vec<f64>>,
    linearised: Vec<Linearised>,
}

impl Orbit {
    /// The orbit of `scene` with the event sequence of `guess`, starting from its states and durations.
    pub fn solve(
        scene: &Arc<Scene>,
        method: Method,
        guess: Vec<Step>,
    ) -> Result<Self, OrbitFailure> {
        let mut orbit = Self {
            scene: Arc::clone(scene),
            method,
            period: guess.iter().map(|step| step.duration).sum(),
            steps: guess,
            residual: f64::INFINITY,
        };
        // The guess may come from another scene: its contact laws, not its constraints, have changed.
        for step in &mut orbit.steps {
            step.passage =
                Passage::new(scene, &step.combination, step.passage.contact, step.passage.trigger);
        }
        let flows = flows(scene, method, &orbit.steps)?;
        let mut last = f64::INFINITY;
        for count in 1..=STEPS {
            let pass = orbit.pass(&flows)?;
            let scales = orbit.scales();
            orbit.residual = orbit.mismatch(&pass, scales);
            let change = orbit.newton_step(&flows, &pass, scales)?;
            if !(change <= LARGEST_STEP) {
                return Err(OrbitFailure::Diverged { steps: count, change });
            }
            if change <= ROUNDING || (last <= NEARLY && change >= 0.5 * last) {
                let pass = orbit.pass(&flows)?;
                orbit.residual = orbit.mismatch(&pass, orbit.scales());
                return Ok(orbit);
            }
            last = change;
        }
        Err(OrbitFailure::Diverged { steps: STEPS, change: last })
    }

    pub(crate) fn flows(&self) -> Result<Vec<Flow<'_>>, Error> {
        flows(&self.scene, self.method, &self.steps)
    }

    pub(crate) fn scales(&self) -> Scales {
        Scales::of(self.scene.size, self.steps.iter().map(|step| step.state.as_slice()))
    }

    fn pass(&self, flows: &[Flow<'_>]) -> Result<Pass, OrbitFailure> {
        let mut pass = Pass { arrived: Vec::new(), linearised: Vec::new() };
        for (step, flow) in self.steps.iter().zip(flows) {
            let end = flow.end(&step.state, step.duration);
            let mut arrived = end.clone();
            step.passage.jump(&self.scene, &step.combination, &mut arrived)?;
            let transition = flow.transition(step.duration);
            pass.linearised.push(step.passage.linearised(
                &self.scene,
                flow,
                &transition,
                [&step.state, &end, &arrived],
            ));
            pass.arrived.push(arrived);
        }
        Ok(pass)
    }

    fn mismatch(&self, pass: &Pass, scales: Scales) -> f64 {
        let count = self.steps.len();
        (0..count)
            .map(|k| scales.distance(&pass.arrived[k], &self.steps[(k + 1) % count].state))
            .fold(0.0, |size, x| if x.is_nan() { x } else { size.max(x) })
    }

    /// One step of Newton's method; its relative size.
    fn newton_step(
        &mut self,
        flows: &[Flow<'_>],
        pass: &Pass,
        scales: Scales,
    ) -> Result<f64, OrbitFailure> {
        let (count, n) = (self.steps.len(), self.scene.size);
        let size = 2 * n;
        let mut whole = vec![0.0; size * size];
        (0..size).for_each(|k| whole[k * size + k] = 1.0);
        let mut maps = Vec::with_capacity(count);
        let mut rests = Vec::with_capacity(count);
        let mut rest_sum = vec![0.0; size];
        let mut lateness = Vec::with_capacity(count);
        for (k, linear) in pass.linearised.iter().enumerate() {
            let map = linear.return_map();
            let late = -linear.value / linear.speed;
            let pushed = crate::saltation::apply(&linear.jump, &linear.field);
            let next = &self.steps[(k + 1) % count].state;
            let rest: Vec<f64> =
                (0..size).map(|i| pass.arrived[k][i] + pushed[i] * late - next[i]).collect();
            rest_sum = crate::saltation::apply(&map, &rest_sum);
            rest_sum.iter_mut().zip(&rest).for_each(|(sum, rest)| *sum += rest);
            whole = product(size, &map, &whole);
            maps.push(map);
            rests.push(rest);
            lateness.push(late);
        }
        let free = &flows[0].free;
        let unit = |k: usize| if k < n { scales.length } else { scales.speed };
        let matrix: Vec<f64> = free
            .iter()
            .flat_map(|&i| {
                let whole = &whole;
                free.iter().map(move |&j| {
                    f64::from(u8::from(i == j)) - whole[i * size + j] * unit(j) / unit(i)
                })
            })
            .collect();
        let load: Vec<f64> = free.iter().map(|&i| rest_sum[i] / unit(i)).collect();
        let solution = eigen::solve(free.len(), &matrix, &load);
        if solution.iter().any(|x| !x.is_finite()) {
            return Err(OrbitFailure::Singular);
        }
        let mut change = vec![0.0; size];
        free.iter().zip(&solution).for_each(|(&k, x)| change[k] = x * unit(k));
        let mut largest = 0.0f64;
        let mut next_changes = Vec::with_capacity(count);
        for (k, linear) in pass.linearised.iter().enumerate() {
            let timing: f64 = linear.timing.iter().zip(&change).map(|(a, x)| a * x).sum();
            let delay = timing + lateness[k];
            let mut next = crate::saltation::apply(&maps[k], &change);
            next.iter_mut().zip(&rests[k]).for_each(|(next, rest)| *next += rest);
            largest = largest.max((delay / self.period).abs());
            next_changes.push((change, delay));
            change = next;
        }
        for (k, (change, delay)) in next_changes.into_iter().enumerate() {
            for &i in &flows[k].free {
                self.steps[k].state[i] += change[i];
                largest = largest.max((change[i] / unit(i)).abs());
                if change[i].is_nan() {
                    largest = f64::NAN;
                }
            }
            self.constrain(k);
            let step = &mut self.steps[k];
            step.duration = match explicit_time(&self.scene, &flows[k], step) {
                Some(duration) => duration,
                None => step.duration + delay,
            };
        }
        self.period = self.steps.iter().map(|step| step.duration).sum();
        Ok(if self.period.is_finite() { largest } else { f64::NAN })
    }

    /// Sets what the combination of a step prescribes.
    fn constrain(&mut self, k: usize) {
        let n = self.scene.size;
        let step = &mut self.steps[k];
        for (law, &status) in self.scene.contacts.iter().zip(step.combination.statuses()) {
            if status.is_closed() {
                step.state[law.normal] = 0.0;
                step.state[n + law.normal] = 0.0;
            }
            if status == crate::status::Status::Sticking {
                step.state[n + law.tangential] = law.slider_speed;
            }
        }
    }

    /// Derivative of the flow over one period between equal times, over all of (q, q') at the section, row-major:
    /// columns outside the admissible space are zero.
    pub fn monodromy(&self) -> Result<Vec<f64>, OrbitFailure> {
        let flows = self.flows()?;
        let maps = self.fundamental_maps(&flows)?;
        Ok(chained(2 * self.scene.size, &maps, 0))
    }

    fn fundamental_maps(&self, flows: &[Flow<'_>]) -> Result<Vec<Vec<f64>>, OrbitFailure> {
        let pass = self.pass(flows)?;
        let count = self.steps.len();
        Ok((0..count)
            .map(|k| {
                let next = (k + 1) % count;
                pass.linearised[k].fundamental(&flows[next].field(&pass.arrived[k]))
            })
            .collect())
    }

    /// The Floquet multipliers.
    pub fn multipliers(&self) -> Result<Multipliers, OrbitFailure> {
        let flows = self.flows()?;
        let maps = self.fundamental_maps(&flows)?;
        let size = 2 * self.scene.size;
        let count = self.steps.len();
        let narrowest = (0..count).min_by_key(|&k| flows[k].free.len()).unwrap_or_default();
        let rank = (0..count)
            .map(|k| {
                let next = (k + 1) % count;
                let lost = self.steps[k].passage.forgotten(
                    &self.scene,
                    &self.steps[next].combination,
                    &self.steps[next].state,
                );
                flows[k].free.len() - lost
            })
            .min()
            .unwrap_or_default();
        let whole = chained(size, &maps, narrowest);
        let free = &flows[narrowest].free;
        let admissible: Vec<f64> = free
            .iter()
            .flat_map(|&i| free.iter().map(|&j| whole[i * size + j]).collect::<Vec<_>>())
            .collect();
        let mut values: Vec<Complex64> = eigen::real_matrix(free.len(), &admissible)
            .into_iter()
            .flat_map(|pair| match pair.value.im == 0.0 {
                true => vec![pair.value],
                false => vec![pair.value, pair.value.conj()],
            })
            .collect();
        values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        values.truncate(rank);
        let section = flows[0].free.len();
        let structural_zeros = section - values.len();
        values.resize(section, Complex64::default());
        Ok(Multipliers { values, structural_zeros })
    }

    /// Start times of the steps; the last entry is the end of the period.
    pub(crate) fn times(&self) -> Vec<Clock> {
        let mut times = vec![Clock::default()];
        for step in &self.steps {
            times.push(times[times.len() - 1].after(step.duration));
        }
        times
    }
}

fn flows<'a>(
    scene: &'a Arc<Scene>,
    method: Method,
    steps: &[Step],
) -> Result<Vec<Flow<'a>>, Error> {
    steps.iter().map(|step| Flow::new(scene, &step.combination, method)).collect()
}

/// The product of all maps, the one of `first` applied first.
fn chained(size: usize, maps: &[Vec<f64>], first: usize) -> Vec<f64> {
    let mut whole = maps[first].clone();
    for k in 1..maps.len() {
        whole = product(size, &maps[(first + k) % maps.len()], &whole);
    }
    whole
}

/// The duration of a phase that ends where a series of bounces comes to rest.
fn explicit_time(scene: &Scene, flow: &Flow<'_>, step: &Step) -> Option<f64> {
    if step.kind != EventKind::Accumulation {
        return None;
    }
    let law = &scene.contacts[step.passage.contact];
    let row = scene.size + law.normal;
    Some(-2.0 * step.state[row] / (flow.field(&step.state)[row] * (1.0 - law.restitution)))
}
