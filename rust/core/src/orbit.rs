//! Periodic orbits of a given event sequence, by Newton's method on the exact return map.
//!
//! A cycle of K phases is K start states y_k, durations tau_k and passages with
//!
//! ```text
//! y_{k+1} = g_k(phi_k(y_k, tau_k)),   h_k(phi_k(y_k, tau_k)) = 0,   y_K = y_0
//! ```
//!
//! (multiple shooting, so that an unstable orbit is found as well as a stable one; see `shooting`).
//!
//! Floquet multipliers are the eigenvalues of the product of the `S_k Phi_k`. Sticking and contact leave fewer
//! coordinates free, and the product has no larger rank than its narrowest place: it is formed
//! there, and the rest of the multipliers at the section are zero exactly.

use std::sync::Arc;

use num_complex::Complex64;

use crate::eigen;
use crate::error::{Error, RunFailure};
use crate::event::Trigger;
use crate::flow::Flow;
use crate::saltation::{Linearised, Passage, product};
use crate::scene::Scene;
use crate::shooting::{Pass, Shooting};
use crate::simulation::{Clock, Method};
use crate::status::Combination;
use crate::trajectory::EventKind;

/// Newton steps; from a recurrence within the basin six or seven reach rounding.
const STEPS: usize = 25;
/// A step larger than the orbit itself leads to another orbit, if to any.
const LARGEST_STEP: f64 = 3.0;
/// A relative step below which the orbit is as good as rounding allows.
const ROUNDING: f64 = 1e-13;
/// Part of the period below which a phase between two events is none: they coincide.
pub(crate) const INSTANT: f64 = 1e-11;
/// A flight between two impacts that takes less than this part of the rest of their series is no flight of it: two
/// contacts strike at the same instant.
const FLIGHT: f64 = 1e-6;
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

impl Step {
    /// Of the event that ends it.
    pub const fn contact(&self) -> usize {
        self.passage.contact
    }

    /// The events that end it, by contact: one, or those of all contacts that close jointly.
    pub(crate) fn events(&self) -> Vec<(usize, EventKind)> {
        let Passage { contact, series, .. } = &self.passage;
        if series.is_empty() {
            return vec![(*contact, self.kind)];
        }
        let mut events: Vec<_> =
            series.iter().map(|&member| (member, EventKind::Accumulation)).collect();
        if !series.contains(contact) {
            events.push((*contact, EventKind::Impact));
        }
        events.sort_unstable_by_key(|event| event.0);
        events
    }
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
    /// Descending in modulus, conjugates adjacent. NaN at a corner of the return map (see [`Orbit::corner`]).
    pub values: Vec<Complex64>,
    /// Those of the return map: without the one of the phase of the orbit, which is 1. At a fold, where that one
    /// is defective, they keep their digits.
    pub transverse: Vec<Complex64>,
    pub structural_zeros: usize,
    /// Dimension of the admissible space of every phase.
    pub dimensions: Vec<usize>,
    /// Directions that the event at the end of every phase forgets.
    pub losses: Vec<usize>,
}

/// Typical sizes of displacement changes and velocities along an orbit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    n: usize,
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
            n,
            length: positive((0..n).map(range).fold(0.0, f64::max)),
            speed: positive((n..2 * n).map(range).fold(0.0, f64::max)),
        }
    }

    /// Entries of (q, q').
    pub const fn size(&self) -> usize {
        2 * self.n
    }

    /// Unit of an entry of (q, q').
    pub const fn unit(&self, k: usize) -> f64 {
        if k < self.n { self.length } else { self.speed }
    }

    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter()
            .zip(b)
            .enumerate()
            .map(|(k, (a, b))| (a - b).abs() / self.unit(k))
            .fold(0.0, |size, x| if x.is_nan() { x } else { size.max(x) })
    }
}

impl Multipliers {
    /// Largest modulus across the flow, NaN if one of them is not known.
    pub fn largest(&self) -> f64 {
        let larger = |a: f64, b: f64| if a.is_nan() || a >= b { a } else { b };
        self.transverse.iter().map(|m| m.norm()).fold(0.0, larger)
    }
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
        orbit.transfer();
        let flows = flows(scene, method, &orbit.steps)?;
        let mut last = f64::INFINITY;
        for count in 1..=STEPS {
            let pass = orbit.pass(&flows)?;
            let scales = orbit.scales();
            orbit.residual = orbit.mismatch(&pass, scales);
            let shooting = Shooting::new(&orbit, &flows, &pass, scales);
            let section = shooting.solution()?;
            let change = orbit.moved(&flows, scales, shooting.changes(&section));
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

    /// The events in the laws of the scene, where the steps come from another one.
    pub(crate) fn transfer(&mut self) {
        for step in &mut self.steps {
            step.passage = step.passage.transferred(&self.scene, &step.combination);
        }
    }

    pub(crate) fn flows(&self) -> Result<Vec<Flow<'_>>, Error> {
        flows(&self.scene, self.method, &self.steps)
    }

    pub(crate) fn scales(&self) -> Scales {
        Scales::of(self.scene.size, self.steps.iter().map(|step| step.state.as_slice()))
    }

    /// Derivative of the flow over one period between equal times, over all of (q, q') at the section, row-major:
    /// columns outside the admissible space are zero.
    pub fn monodromy(&self) -> Result<Vec<f64>, OrbitFailure> {
        let flows = self.flows()?;
        let pass = self.pass(&flows)?;
        Ok(chained(2 * self.scene.size, &self.fundamental_maps(&flows, &pass), 0))
    }

    fn fundamental_maps(&self, flows: &[Flow<'_>], pass: &Pass) -> Vec<Vec<f64>> {
        let count = self.steps.len();
        (0..count)
            .map(|k| {
                let next = (k + 1) % count;
                pass.linearised[k].fundamental(&flows[next].field(&pass.arrived[k]))
            })
            .collect()
    }

    /// The Floquet multipliers.
    ///
    /// The product over a period has the rank of its narrowest factor at most, wherever it starts; the other
    /// multipliers are zero. It is formed from the narrowest admissible space on.
    pub fn multipliers(&self) -> Result<Multipliers, OrbitFailure> {
        let flows = self.flows()?;
        let pass = self.pass(&flows)?;
        let count = self.steps.len();
        let dimensions: Vec<usize> = flows.iter().map(|flow| flow.free.len()).collect();
        let losses: Vec<usize> = (0..count)
            .map(|k| {
                let next_field = flows[(k + 1) % count].field(&pass.arrived[k]);
                let jump = &pass.linearised[k].jump;
                self.steps[k].passage.loss(&flows[k].free, jump, &next_field)
            })
            .collect();
        let rank = dimensions.iter().zip(&losses).map(|(d, lost)| d.saturating_sub(*lost)).min();
        let rank = rank.unwrap_or_default();
        let section = dimensions.first().copied().unwrap_or_default();
        let narrowest = (0..count).min_by_key(|&k| dimensions[k]).unwrap_or_default();
        let size = 2 * self.scene.size;
        let free = &flows[narrowest].free;
        let corner = self.corner().is_some();
        let eigenvalues = |maps: &[Vec<f64>], nonzero: usize, dimension: usize| {
            if corner {
                let mut values = vec![Complex64::new(f64::NAN, f64::NAN); nonzero];
                values.resize(dimension, Complex64::default());
                return values;
            }
            let whole = chained(size, maps, narrowest);
            let mut values = spectrum_within(size, &whole, free);
            values.truncate(nonzero);
            values.resize(dimension, Complex64::default());
            values
        };
        let return_maps: Vec<Vec<f64>> =
            pass.linearised.iter().map(Linearised::return_map).collect();
        Ok(Multipliers {
            values: eigenvalues(&self.fundamental_maps(&flows, &pass), rank, section),
            transverse: eigenvalues(
                &return_maps,
                rank.saturating_sub(1),
                section.saturating_sub(1),
            ),
            structural_zeros: section.saturating_sub(rank),
            dimensions,
            losses,
        })
    }

    /// Two contacts whose events coincide and whose order matters to their neighbours: the return map has one
    /// derivative on either side, and no multipliers.
    ///
    /// Slip and its end change the acceleration of their own contact alone and leave velocities as they are, so that
    /// their saltation matrices commute, unless mass couples contacts. An impact changes the forces of others.
    pub fn corner(&self) -> Option<(usize, usize)> {
        let count = self.steps.len();
        let coupled = self.scene.coordinates.delassus.is_some();
        let impact = |passage: &Passage| {
            matches!(passage.trigger, Trigger::GapClosed | Trigger::Accumulated)
        };
        (0..count).filter(|&k| !self.lasts(k) && !self.is_within_series(k)).find_map(|k| {
            let (first, second) =
                (&self.steps[(k + count - 1) % count].passage, &self.steps[k].passage);
            (first.contact != second.contact && (coupled || impact(first) || impact(second)))
                .then_some((first.contact.min(second.contact), first.contact.max(second.contact)))
        })
    }

    /// Whether a step is one of the ever shorter flights of a series of impacts up to its limit, in which several
    /// contacts may strike in turn. They follow each other in an order of their own, also in neighbouring motions,
    /// unless one of them takes no part of the time that the rest of the series takes.
    fn is_within_series(&self, step: usize) -> bool {
        let count = self.steps.len();
        let at = |k: usize| &self.steps[k % count];
        let is_impact = |k: usize| at(k).passage.trigger == Trigger::GapClosed;
        if !is_impact(step + count - 1) {
            return false;
        }
        let limit = (step..step + count).find(|&k| !is_impact(k));
        limit.filter(|&limit| at(limit).passage.trigger == Trigger::Accumulated).is_some_and(
            |limit| {
                let rest: f64 = (step..=limit).map(|k| at(k).duration).sum();
                at(step).duration > FLIGHT * rest
            },
        )
    }

    /// Whether a phase is more than the instant between two events that coincide.
    pub(crate) fn lasts(&self, step: usize) -> bool {
        self.steps[step].duration > INSTANT * self.period
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

pub(crate) fn flows<'a>(
    scene: &'a Arc<Scene>,
    method: Method,
    steps: &[Step],
) -> Result<Vec<Flow<'a>>, Error> {
    steps.iter().map(|step| Flow::new(scene, &step.combination, method)).collect()
}

/// Eigenvalues of a matrix on some of its coordinates, descending in modulus.
fn spectrum_within(size: usize, matrix: &[f64], free: &[usize]) -> Vec<Complex64> {
    let within: Vec<f64> =
        free.iter().flat_map(|&i| free.iter().map(move |&j| matrix[i * size + j])).collect();
    let mut values: Vec<Complex64> = eigen::real_matrix(free.len(), &within)
        .into_iter()
        .flat_map(|pair| match pair.value.im == 0.0 {
            true => vec![pair.value],
            false => vec![pair.value, pair.value.conj()],
        })
        .collect();
    values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    values
}

/// The product of all maps, the one of `first` applied first.
fn chained(size: usize, maps: &[Vec<f64>], first: usize) -> Vec<f64> {
    let mut whole = maps[first].clone();
    for k in 1..maps.len() {
        whole = product(size, &maps[(first + k) % maps.len()], &whole);
    }
    whole
}
