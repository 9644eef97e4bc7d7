//! Newton's method on all phases of an orbit at once (multiple shooting), condensed to the section.
//!
//! Every passage gives the duration of its phase, which leaves `dy_{k+1} = P_k dy_k + r_k` with the derivative
//! P_k of the return map and the mismatch r_k (see `orbit`). Chained over a period, y_K = y_0 leaves
//!
//! ```text
//! (I - P_{K-1} ... P_0) dy_0 = defect,   defect = sum_k P_{K-1} ... P_{k+1} r_k
//! ```
//!
//! in the admissible space at the section.

use nalgebra::DMatrix;
use std::sync::Arc;

use crate::contact::event_kind::EventKind;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::saltation::Linearised;
use crate::cycles::orbits::orbit::{Orbit, OrbitFailure, OrbitPhase, Scales, flows, period_of};
use crate::error::input::Error;
use crate::linalg::dense::{apply, solve};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::numerics::singular_values::pseudo_inverse;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// Newton steps; from a recurrence within the basin six or seven reach rounding.
const STEPS: usize = 25;
/// A step larger than the orbit itself leads to another orbit, if to any.
const LARGEST_STEP: f64 = 3.0;
/// A relative step below which the orbit is as good as rounding allows.
const ROUNDING: f64 = 1e-13;
/// Part of its first speeds below which an orbit is a steady state.
const STILL: f64 = 1e-6;
/// Durations of a phase after which a slip in a plane that ends it counts as endless.
const LATEST: f64 = 4.0;
/// A relative step below which derivatives along laws are those of the step before, as long as steps fall by this factor.
const CLOSE: f64 = 1e-3;
const FALLS: f64 = 0.1;
/// A relative step that may be the last one if the next is no smaller.
const NEARLY: f64 = 1e-9;

/// One pass along an orbit: where every phase ends, and all derivatives there.
pub(crate) struct Pass {
    pub arrived: Vec<Vec<f64>>,
    pub linearised: Vec<Linearised>,
}

/// Derivatives by the state at the start of a phase: of its end, and of the time of its event.
struct Derivatives {
    transition: DMatrix<f64>,
    timing: Vec<f64>,
}

/// The linear equations of one step.
pub(crate) struct Shooting {
    /// Derivative of the time of every event by the state at the start of its phase.
    timings: Vec<Vec<f64>>,
    maps: Vec<DMatrix<f64>>,
    pub mismatch: Mismatch,
    pub whole: DMatrix<f64>,
    pub free: Vec<usize>,
    scales: Scales,
}

/// How far the phases of a guess are from an orbit.
#[derive(Debug, Clone)]
pub(crate) struct Mismatch {
    /// r_k
    pub defects: Vec<Vec<f64>>,
    /// How much later every event comes than its phase ends, s.
    pub delays: Vec<f64>,
}

/// A change of the state at the start of a phase and of its duration.
pub(crate) struct Change {
    pub state: Vec<f64>,
    pub delay: f64,
}

impl Shooting {
    pub fn new(orbit: &Orbit, flows: &[Flow<'_>], pass: &Pass, scales: Scales) -> Self {
        let maps: Vec<DMatrix<f64>> = pass.linearised.iter().map(Linearised::return_map).collect();
        let whole = maps[1..].iter().fold(maps[0].clone(), |whole, map| map * whole);
        Self {
            timings: pass.linearised.iter().map(|linear| linear.timing.clone()).collect(),
            maps,
            mismatch: orbit.mismatches(pass),
            whole,
            free: flows[0].section.clone(),
            scales,
        }
    }

    /// The sum of the mismatches of the phases, carried to the end of the period.
    pub fn defect(&self, mismatch: &Mismatch) -> Vec<f64> {
        let zero = vec![0.0; self.scales.size()];
        self.maps.iter().zip(&mismatch.defects).fold(zero, |sum, (map, defect)| {
            apply(map, &sum).iter().zip(defect).map(|(a, b)| a + b).collect()
        })
    }

    /// I - P over the admissible space, in the units of the orbit.
    pub fn matrix(&self) -> DMatrix<f64> {
        let unit = |k: usize| self.scales.unit(k);
        let entry = |i: usize, j: usize| {
            f64::from(u8::from(i == j)) - self.whole[(i, j)] * unit(j) / unit(i)
        };
        DMatrix::from_fn(self.free.len(), self.free.len(), |i, j| entry(self.free[i], self.free[j]))
    }

    pub fn load(&self, mismatch: &Mismatch) -> Vec<f64> {
        let defect = self.defect(mismatch);
        self.free.iter().map(|&k| defect[k] / self.scales.unit(k)).collect()
    }

    /// The whole state of which the entries in the admissible space are given in the units of the orbit.
    pub fn state(&self, entries: &[f64]) -> Vec<f64> {
        let mut state = vec![0.0; self.scales.size()];
        self.free.iter().zip(entries).for_each(|(&k, x)| state[k] = x * self.scales.unit(k));
        state
    }

    /// dy_0; that to the nearest orbit where the orbits are a family, such as those of a contact that sticks at any place of
    /// a vibrating slider, or that sticks on a spring whose force is a free constant.
    pub fn solution(&self) -> Result<Vec<f64>, OrbitFailure> {
        let (matrix, load) = (self.matrix(), self.load(&self.mismatch));
        let entries = solve(matrix.clone(), &load);
        if entries.iter().all(|x| x.is_finite()) {
            return Ok(self.state(&entries));
        }
        if !matrix.iter().chain(&load).all(|x| x.is_finite()) {
            return Err(OrbitFailure::Singular);
        }
        let nearest = apply(&pseudo_inverse(&matrix), &load);
        let mut missed = apply(&matrix, &nearest).into_iter().zip(&load);
        let rounding = ROUNDING * load.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
        match missed.all(|(reached, x)| (reached - x).abs() <= rounding) {
            true => Ok(self.state(&nearest)),
            false => Err(OrbitFailure::Singular),
        }
    }

    /// The changes of all phases that follow from one at the section.
    pub fn changes(&self, section: &[f64]) -> Vec<Change> {
        self.carried(section, &self.mismatch)
    }

    pub fn carried(&self, section: &[f64], mismatch: &Mismatch) -> Vec<Change> {
        let mut state = section.to_vec();
        (0..self.maps.len())
            .map(|k| {
                let timing: f64 = self.timings[k].iter().zip(&state).map(|(a, x)| a * x).sum();
                let mut next = apply(&self.maps[k], &state);
                next.iter_mut()
                    .zip(&mismatch.defects[k])
                    .for_each(|(next, defect)| *next += defect);
                let state = std::mem::replace(&mut state, next);
                Change { state, delay: timing + mismatch.delays[k] }
            })
            .collect()
    }
}

impl Orbit {
    /// The orbit of `scene` with the event sequence of `guess`, starting from its states and durations; a failure as soon as
    /// `is_over`, which every phase asks.
    pub fn solve(
        propagators: &Arc<Propagators>,
        method: Method,
        guess: Vec<OrbitPhase>,
        load_periods: usize,
        is_over: &dyn Fn() -> bool,
    ) -> Result<Self, OrbitFailure> {
        let mut orbit = Self {
            propagators: Arc::clone(propagators),
            method,
            period: period_of(&guess),
            load_periods,
            steps: guess,
            residual: f64::INFINITY,
        };
        orbit.transfer();
        let flows = flows(propagators, method, &orbit.steps)?;
        // In another scene contacts stick at other speeds, and slips in planes last longer or shorter.
        orbit.constrain(&flows)?;
        orbit.period = period_of(&orbit.steps);
        let begun = orbit.scales().speed;
        let by_law = flows.iter().any(|flow| flow.law().is_some());
        let (mut last, mut known) = (f64::INFINITY, Vec::new());
        for count in 1..=STEPS {
            let renewed = known.is_empty();
            let mut found = Vec::new();
            let pass = orbit.pass_by(&flows, &known, by_law.then_some(&mut found), is_over)?;
            if renewed {
                known = found;
            }
            let scales = orbit.scales();
            orbit.residual = orbit.mismatch(&pass.arrived, scales);
            let shooting = Shooting::new(&orbit, &flows, &pass, scales);
            let section = shooting.solution()?;
            let change = orbit.moved(&flows, scales, shooting.changes(&section));
            if !(change <= LARGEST_STEP) {
                return Err(OrbitFailure::Diverged { steps: count, change });
            }
            if scales.speed <= STILL * begun {
                return Err(OrbitFailure::Vanished);
            }
            if change <= ROUNDING || (last <= NEARLY && change >= 0.5 * last) {
                let ends = (0..flows.len()).map(|k| orbit.end_of(k, &flows));
                let arrived = ends.map(|ends| ends.map(|[_, arrived]| arrived));
                let arrived = arrived.collect::<Result<Vec<_>, _>>()?;
                orbit.residual = orbit.mismatch(&arrived, orbit.scales());
                return Ok(orbit);
            }
            // Derivatives along laws take nearly all of the time, and near the orbit are those of the step before.
            if change > CLOSE || !(renewed || change <= FALLS * last) {
                known.clear();
            }
            last = change;
        }
        Err(OrbitFailure::Diverged { steps: STEPS, change: last })
    }

    /// All phases in turn, each linearised.
    pub(crate) fn pass(&self, flows: &[Flow<'_>]) -> Result<Pass, OrbitFailure> {
        self.pass_until(flows, &|| false)
    }

    /// The same, given up once `is_over`.
    pub(super) fn pass_until(
        &self,
        flows: &[Flow<'_>],
        is_over: &dyn Fn() -> bool,
    ) -> Result<Pass, OrbitFailure> {
        self.pass_by(flows, &[], None, is_over)
    }

    /// The same with the derivatives of all phases in a pass near by, unless there are none; the ones that it computes are added to
    /// those `found`.
    fn pass_by(
        &self,
        flows: &[Flow<'_>],
        known: &[Derivatives],
        mut found: Option<&mut Vec<Derivatives>>,
        is_over: &dyn Fn() -> bool,
    ) -> Result<Pass, OrbitFailure> {
        let mut pass = Pass { arrived: Vec::new(), linearised: Vec::new() };
        for (k, (step, flow)) in self.steps.iter().zip(flows).enumerate() {
            if is_over() {
                return Err(OrbitFailure::Stopped);
            }
            let [end, arrived] = self.end_of(k, flows)?;
            if !arrived.iter().all(|x| x.is_finite()) {
                return Err(OrbitFailure::Lost { phase: k });
            }
            let states = [&step.state[..], &end, &arrived];
            let by = |transition| step.passage.linearised(self.scene(), flow, transition, states);
            let linearised = match known.get(k) {
                Some(Derivatives { transition, timing }) => {
                    Linearised { timing: timing.clone(), ..by(transition)? }
                }
                None => {
                    let transition = flow.transition(&step.state, step.duration);
                    let linearised = by(&transition)?;
                    if let Some(found) = &mut found {
                        found.push(Derivatives { transition, timing: linearised.timing.clone() });
                    }
                    linearised
                }
            };
            pass.linearised.push(linearised);
            pass.arrived.push(arrived);
        }
        Ok(pass)
    }

    /// The states in which a phase ends, and in which its event leaves it.
    fn end_of(&self, place: usize, flows: &[Flow<'_>]) -> Result<[Vec<f64>; 2], OrbitFailure> {
        let step = &self.steps[place];
        let end = flows[place].end(&step.state, step.duration);
        let mut arrived = end.clone();
        step.passage.jump(self.scene(), &step.combination, &mut arrived)?;
        let (q, u) = arrived.split_at_mut(self.scene().size);
        flows[(place + 1) % flows.len()].basis.complete(q, u);
        Ok([end, arrived])
    }

    pub(crate) fn mismatch(&self, arrived: &[Vec<f64>], scales: Scales) -> f64 {
        let count = self.steps.len();
        (0..count)
            .map(|k| scales.distance(&arrived[k], &self.steps[(k + 1) % count].state))
            .fold(0.0, |size, x| if x.is_nan() { x } else { size.max(x) })
    }

    pub(crate) fn mismatches(&self, pass: &Pass) -> Mismatch {
        let count = self.steps.len();
        let delays: Vec<f64> =
            pass.linearised.iter().map(|linear| -linear.value / linear.speed).collect();
        let defects = (0..count)
            .map(|k| {
                let linear = &pass.linearised[k];
                let pushed = linear.jump.apply(&linear.field);
                let next = &self.steps[(k + 1) % count].state;
                (0..next.len())
                    .map(|i| pass.arrived[k][i] + pushed[i] * delays[k] - next[i])
                    .collect()
            })
            .collect();
        Mismatch { defects, delays }
    }

    /// Applies the changes of all phases; the largest, relative to the orbit.
    pub(crate) fn moved(
        &mut self,
        flows: &[Flow<'_>],
        scales: Scales,
        changes: Vec<Change>,
    ) -> f64 {
        let mut largest = 0.0f64;
        for (k, change) in changes.into_iter().enumerate() {
            for &i in &flows[k].free {
                self.steps[k].state[i] += change.state[i];
                let size = (change.state[i] / scales.unit(i)).abs();
                largest = if size.is_nan() { size } else { largest.max(size) };
            }
            largest = largest.max((change.delay / self.period).abs());
            self.steps[k].duration += change.delay;
        }
        if self.constrain(flows).is_err() {
            return f64::NAN;
        }
        self.period = period_of(&self.steps);
        if self.period.is_finite() { largest } else { f64::NAN }
    }

    /// Sets the values that the combinations prescribe.
    pub(crate) fn constrain(&mut self, flows: &[Flow<'_>]) -> Result<(), Error> {
        let n = self.scene().size;
        let scene = Arc::clone(self.scene());
        for (step, flow) in self.steps.iter_mut().zip(flows) {
            for (law, &status) in scene.contacts.iter().zip(step.combination.statuses()) {
                if status.is_closed() {
                    step.state[law.normal] = law.closed();
                    step.state[n + law.normal] = 0.0;
                }
                if status == Status::Sticking {
                    step.state[n + law.tangential] = law.slider_speed;
                }
            }
            let (q, u) = step.state.split_at_mut(n);
            flow.basis.complete(q, u);
            scene.fitted(&step.combination).follow(q, u);
            if let Some(duration) = explicit_time(&scene, flow, step) {
                step.duration = duration;
            }
        }
        self.keep_time()
    }

    /// Under loads in time, makes the period a whole number of theirs and sets their phase at every step.
    fn keep_time(&mut self) -> Result<(), Error> {
        let scene = Arc::clone(self.scene());
        let (Some(period), Some(drive)) = (scene.load_period()?, &scene.drive) else {
            return Ok(());
        };
        let whole = self.load_periods as f64 * period;
        let lasts: f64 = self.steps.iter().map(|step| step.duration).sum();
        let mut time = 0.0;
        for step in &mut self.steps {
            step.duration *= whole / lasts;
            for oscillator in &drive.oscillators {
                let k = oscillator.coordinate;
                (step.state[k], step.state[scene.size + k]) = oscillator.at(time);
            }
            time += step.duration;
        }
        Ok(())
    }
}

/// The duration of a phase that ends where a series of bounces comes to rest, or a slip in a plane.
fn explicit_time(scene: &Scene, flow: &Flow<'_>, step: &OrbitPhase) -> Option<f64> {
    if step.passage.stops_in_plane(scene) {
        return flow.slip_lasts(&step.state, step.passage.contact, LATEST * step.duration);
    }
    if step.kind != EventKind::Accumulation || step.passage.is_joint() {
        return None;
    }
    let law = &scene.contacts[step.passage.contact];
    let row = scene.size + law.normal;
    Some(-2.0 * step.state[row] / (flow.field(&step.state)[row] * (1.0 - law.restitution)))
}
