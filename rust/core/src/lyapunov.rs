//! How fast neighbours of a motion part: its largest Lyapunov exponent across the flow.
//!
//! A neighbour is carried by the transition matrix of every phase and the saltation of every event, and compared
//! with the motion at its own events, so that a shift along the motion, which neither grows nor decays, does
//! not show (G. Benettin et al., "Lyapunov characteristic exponents for smooth dynamical systems and for
//! Hamiltonian systems", Meccanica 15, 1980; P. Müller, "Calculation of Lyapunov exponents for dynamic systems
//! with discontinuities", Chaos, Solitons & Fractals 5, 1995). A mean rate over a finite time has an
//! error: that of the means of batches much longer than a period, taken as independent of each other.

use crate::error::Error;
use crate::flow::Flow;
use crate::orbit::Scales;
use crate::saltation::passages;
use crate::simulation::Method;
use crate::trajectory::{EventKind, Trajectory};

/// Batches whose means give the error: its own relative error is about `1 / sqrt(2 BATCHES)`.
const BATCHES: usize = 16;

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
        let size = 2 * run.scene.size;
        Self {
            scales: Scales::of(run.scene.size, run.states.chunks_exact(size)),
            // Any direction has a part along the one that grows most.
            apart: (0..size).map(|k| 1.0 + 0.1 * (k as f64).sin()).collect(),
            time: 0.0,
            grown: 0.0,
            history: vec![(0.0, 0.0)],
        }
    }

    /// Carries the neighbour along a run that starts where the one before ended.
    pub fn follow(&mut self, run: &Trajectory, method: Method) -> Result<(), Error> {
        let scene = &run.scene;
        let size = 2 * scene.size;
        let count = run.phases.len();
        let mut events: Vec<Vec<(usize, EventKind)>> = vec![Vec::new(); count + 1];
        for event in &run.events {
            events[event.phase].push((event.contact, event.kind));
        }
        for phase in 0..count {
            let basis = &run.phases[phase].basis;
            let flow = Flow::new(scene, &basis.combination, method)?;
            let start = &run.states[size * phase..size * (phase + 1)];
            let duration = run.phase_duration(phase);
            let end = flow.end(start, duration);
            // Phi times the neighbour: the difference of two motions, which is exact (see `flow`).
            let mut moved = start.to_vec();
            flow.free.iter().for_each(|&k| moved[k] += self.apart[k]);
            let mut apart = flow.end(&moved, duration);
            apart.iter_mut().zip(&end).for_each(|(dy, y)| *dy -= y);
            if phase + 1 < count {
                let arrived = &run.states[size * (phase + 1)..size * (phase + 2)];
                let found = passages(scene, &basis.combination, &end, &events[phase + 1]);
                if let Some(passage) = found.first() {
                    apart = passage.carried(scene, &flow, [start, &end, arrived], &apart);
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
        if distance > 0.0 {
            self.apart.iter_mut().for_each(|x| *x /= distance);
            self.grown += distance.ln();
        } else {
            self.grown = f64::NEG_INFINITY;
        }
        self.history.push((self.time, self.grown));
    }

    /// The rate over the later half of the motion: until then the neighbour turns towards what grows most.
    pub fn growth(&self) -> Lyapunov {
        if self.grown == f64::NEG_INFINITY {
            return Lyapunov { exponent: self.grown, error: 0.0, time: self.time };
        }
        let ends: Vec<(f64, f64)> = (0..=BATCHES)
            .map(|batch| {
                let time = self.time * (0.5 + 0.5 * batch as f64 / BATCHES as f64);
                let next = self.history.partition_point(|entry| entry.0 < time);
                self.history[next.min(self.history.len() - 1)]
            })
            .collect();
        let ((begin, low), (end, high)) = (ends[0], ends[BATCHES]);
        let time = end - begin;
        let exponent = (high - low) / time;
        let square: f64 = ends
            .windows(2)
            .map(|pair| (pair[1].1 - pair[0].1 - exponent * (pair[1].0 - pair[0].0)).powi(2))
            .sum();
        let batches = BATCHES as f64;
        // The batches last time / BATCHES each, up to a phase.
        let error = (square * batches / (batches - 1.0)).sqrt() / time;
        Lyapunov { exponent, error, time }
    }
}
