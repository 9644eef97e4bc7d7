//! How fast neighbours of a motion part: its largest Lyapunov exponent across the flow.
//!
//! A neighbour is carried by the transition matrix of every phase and the saltation of every event, and compared
//! with the motion at its own events, so that a shift along the motion, which neither grows nor decays, does
//! not show (G. Benettin et al., "Lyapunov characteristic exponents for smooth dynamical systems and for
//! Hamiltonian systems", Meccanica 15, 1980; P. Müller, "Calculation of Lyapunov exponents for dynamic systems
//! with discontinuities", Chaos, Solitons & Fractals 5, 1995). A mean rate over a finite time has an
//! error: that of the means of batches much longer than a period, taken as independent of each other. Means are
//! weighted smoothly towards the ends, where a rate that repeats almost converges faster than one that is
//! chaotic (S. Das et al., "Measuring quasiperiodicity", Europhysics Letters 114, 2016): on a torus the error
//! is small, in weak chaos it is not.

use std::num::NonZeroUsize;
use std::sync::Arc;

use lru::LruCache;

use crate::contact::event_kind::EventKind;
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::passages::{jumps_alone, passages};
use crate::cycles::orbits::orbit::Scales;
use crate::error::input::Error;
use crate::transient::trajectory::model::Trajectory;

/// Batches whose means give the error: its own relative error is about `1 / sqrt(2 BATCHES)`.
const BATCHES: usize = 8;
/// Entries kept of the history: many to a batch, however long the motion.
const ENTRIES: usize = 1 << 16;
/// Phases between two looks at the clock and for an interrupt, about a millisecond.
const PATIENCE: usize = 64;

/// Combinations whose flows are kept, with their buffers: a motion returns to some of them again and again.
const FLOWS: NonZeroUsize = NonZeroUsize::new(64).expect("not zero");

/// A mean growth rate of neighbours, 1/s.
#[derive(Debug, Clone, Copy)]
pub struct Lyapunov {
    /// Positive in chaos, zero on a torus, negative while the motion still settles.
    pub exponent: f64,
    /// Its standard error.
    pub error: f64,
    /// The time over which it was measured, s.
    pub time: f64,
}

impl Lyapunov {
    /// An unknown rate: the neighbours of a motion without an event grow by its modes, and those of a motion that only touches
    /// the zero of an event function have no derivative.
    pub const UNKNOWN: Self = Self { exponent: f64::NAN, error: f64::INFINITY, time: 0.0 };
}

/// An infinitesimal neighbour of a motion that is computed run after run.
#[derive(Debug)]
pub(crate) struct Neighbour {
    scales: Scales,
    apart: Vec<f64>,
    time: f64,
    grown: f64,
    /// Time and logarithm of the distance after every phase.
    history: Vec<(f64, f64)>,
}

impl Neighbour {
    pub fn new(run: &Trajectory) -> Self {
        let size = 2 * run.scene().size;
        Self {
            scales: Scales::of(
                run.scene(),
                (0..run.phases.len()).map(|phase| run.phase_state(phase)),
            ),
            // Any direction has a part along the one that grows most.
            apart: (0..size)
                .map(|k| match run.scene().is_structure(k) && !run.scene().is_hidden(k) {
                    true => 1.0 + 0.1 * (k as f64).sin(),
                    false => 0.0,
                })
                .collect(),
            time: 0.0,
            grown: 0.0,
            history: vec![(0.0, 0.0)],
        }
    }

    /// Carries the neighbour along a run that starts where the one before ended, until the search is over.
    pub fn follow(&mut self, run: &Trajectory, search: SearchLimits<'_>) -> Result<(), Error> {
        let scene = run.scene();
        let size = 2 * scene.size;
        let count = run.phases.len();
        let mut events: Vec<Vec<(usize, EventKind)>> = vec![Vec::new(); count + 1];
        for event in &run.events {
            events[event.phase].push((event.contact, event.kind));
        }
        let mut flows = LruCache::new(FLOWS);
        for phase in 0..count {
            if phase % PATIENCE == 0 && search.is_over() {
                return Ok(());
            }
            let basis = &run.basis_of(phase)?;
            // An eigenproblem for each combination does not pay if a motion meets ever new ones: the propagator of the run also
            // carries its neighbour.
            let new = || Flow::by(&run.propagators, Arc::clone(basis));
            let flow = flows.try_get_or_insert_ref(&basis.combination, new)?;
            let start = &run.phase_state(phase)[..];
            let duration = run.phase_duration(phase);
            let end = flow.end(start, duration);
            let mut apart = std::mem::take(&mut self.apart);
            flow.carry(start, duration, std::slice::from_mut(&mut apart));
            if phase + 1 < count {
                let arrived = &run.phase_state(phase + 1)[..];
                let found = passages(scene, flow, [start, &end], &events[phase + 1]);
                let after = &*run.combination_of(phase + 1);
                let mut between = basis.combination.clone();
                let jump = |event: &&(usize, EventKind)| event.1 == EventKind::Jump;
                let mut jumps = events[phase + 1].iter().filter(jump);
                if !jumps.all(|event| jumps_alone(scene, event.0, after)) {
                    apart.fill(f64::NAN);
                }
                for (index, passage) in found.iter().enumerate() {
                    // Events that coincide follow each other in no time.
                    let states = if index == 0 { [start, &end, arrived] } else { [arrived; 3] };
                    let new = || Flow::new(&run.propagators, &between, search.method);
                    let flow = flows.try_get_or_insert_ref(&between, new)?;
                    let carried = passage.carried(scene, flow, states, &apart);
                    // If a neighbour cannot be carried on, its distance is unknown.
                    apart = carried.unwrap_or_else(|_| vec![f64::NAN; size]);
                    between = passage.settled(scene, &between, after);
                }
            }
            self.apart = apart;
            self.rescale(duration);
        }
        Ok(())
    }

    fn rescale(&mut self, duration: f64) {
        let scaled = self.apart.iter().enumerate().map(|(k, x)| (x / self.scales.unit(k)).powi(2));
        let distance = scaled.sum::<f64>().sqrt();
        self.time += duration;
        if distance == 0.0 {
            // The neighbour has come to the motion itself, as all others do, and stays there.
            self.grown = f64::NEG_INFINITY;
        } else {
            self.apart.iter_mut().for_each(|x| *x /= distance);
            self.grown += distance.ln();
        }
        self.history.push((self.time, self.grown));
        if self.history.len() > ENTRIES {
            // Every second one, from the first on.
            let mut odd = false;
            self.history.retain(|_| {
                odd = !odd;
                odd
            });
        }
    }

    /// The rate over the later half of the motion: before, the neighbour turns towards the direction that grows most.
    pub fn growth(&self) -> Lyapunov {
        if self.grown.is_nan() {
            return Lyapunov::UNKNOWN;
        }
        if self.grown == f64::NEG_INFINITY {
            return Lyapunov { exponent: self.grown, error: 0.0, time: self.time };
        }
        let time = 0.5 * self.time;
        let exponent = self.smooth_rate(time, self.time);
        let width = time / BATCHES as f64;
        let square: f64 = (0..BATCHES)
            .map(|batch| time + width * batch as f64)
            .map(|begin| (self.smooth_rate(begin, begin + width) - exponent).powi(2))
            .sum();
        let count = BATCHES as f64;
        Lyapunov { exponent, error: (square / (count * (count - 1.0))).sqrt(), time }
    }

    /// Mean growth rate from `begin` to `end`, weighted by `exp(-1 / (s (1 - s)))` over 0 < s < 1.
    fn smooth_rate(&self, begin: f64, end: f64) -> f64 {
        let first = self.history.partition_point(|entry| entry.0 <= begin).max(1);
        let (mut growth, mut time) = (0.0, 0.0);
        for pair in self.history[first - 1..].windows(2) {
            let (from, to) = (pair[0].0.max(begin), pair[1].0.min(end));
            let s = (0.5 * (from + to) - begin) / (end - begin);
            if from >= end || !(s > 0.0 && s < 1.0 && to > from) {
                continue;
            }
            let weight = (-1.0 / (s * (1.0 - s))).exp() * (to - from);
            growth += weight * (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0);
            time += weight;
        }
        growth / time
    }
}
