//! What a motion settles to: an equilibrium, a periodic orbit, or neither.

use std::sync::Arc;

use num_complex::Complex64;

use crate::eigen;
use crate::error::Error;
use crate::flow::Flow;
use crate::modes::Modes;
use crate::recurrence::Recurrence;
use crate::saltation::passages;
use crate::scene::{Scene, State};
use crate::simulation::{Controls, Method, simulate};
use crate::status::Status;
use crate::trajectory::{EventKind, StopReason, Trajectory};

/// Growth of neighbours, as a power of e, over the later half of the motion that makes it chaotic.
const CHAOS: f64 = 12.0;

/// Where a motion ends up.
#[derive(Debug)]
pub enum Attractor {
    /// Rest or steady sliding: every mode of the combination decays and no event function can reach zero.
    Equilibrium,
    /// A periodic orbit.
    Cycle(Box<Recurrence>),
    /// No recurrence within the motion looked at.
    Aperiodic {
        /// Largest Lyapunov exponent across the flow over the later half of the motion, 1/s: positive in chaos, zero on
        /// a torus, negative while the motion still settles.
        exponent: f64,
        /// The time over which it was measured, s.
        time: f64,
    },
    /// The motion grew beyond the range of numbers.
    Unbounded,
    /// The run could not go on, for the reason its trajectory states.
    Stopped,
}

/// How long to look.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Motion computed between two looks, s.
    pub stretch: f64,
    /// Motion in all, s.
    pub limit: f64,
    pub method: Method,
    pub interrupted: Option<&'a (dyn Fn() -> bool + Sync)>,
}

/// Follows the motion from `start` until it is known what it settles to; with its last stretch.
pub fn settle(
    scene: &Arc<Scene>,
    start: &State,
    search: Search<'_>,
) -> Result<(Attractor, Trajectory), Error> {
    let controls = Controls { interrupted: search.interrupted, ..Controls::default() };
    let mut elapsed = 0.0;
    let mut growth: Vec<(f64, f64)> = Vec::new();
    let mut state = start.clone();
    loop {
        let run = simulate(scene, &state, search.stretch, search.method, controls)?;
        elapsed += run.end;
        if let Some(attractor) = run.attractor(search.method) {
            return Ok((attractor, run));
        }
        growth.push((run.lyapunov_exponent(search.method)?, run.end));
        let later = &growth[growth.len() / 2..];
        let time: f64 = later.iter().map(|(_, time)| time).sum();
        let exponent = later.iter().map(|(rate, time)| rate * time).sum::<f64>() / time;
        if exponent * time > CHAOS || elapsed >= search.limit {
            return Ok((Attractor::Aperiodic { exponent, time }, run));
        }
        state = run.state(run.end)?;
    }
}

impl Trajectory {
    /// What the run settles to: shown by its own end, or by the motion that follows, of which the last stretch
    /// comes with it.
    pub fn settled(&self, search: Search<'_>) -> Result<(Attractor, Option<Self>), Error> {
        if let Some(attractor) = self.attractor(search.method) {
            return Ok((attractor, None));
        }
        if !(search.limit > 0.0) {
            let exponent = self.lyapunov_exponent(search.method)?;
            return Ok((Attractor::Aperiodic { exponent, time: self.end }, None));
        }
        let (attractor, run) = settle(&self.scene, &self.state(self.end)?, search)?;
        Ok((attractor, Some(run)))
    }

    /// What the run has settled to, if its end shows it.
    pub fn attractor(&self, method: Method) -> Option<Attractor> {
        match self.stop_reason {
            StopReason::Unbounded => return Some(Attractor::Unbounded),
            StopReason::Failed(_) | StopReason::Chattering { .. } | StopReason::Interrupted => {
                return Some(Attractor::Stopped);
            }
            _ => {}
        }
        if self.comes_to_rest() {
            return Some(Attractor::Equilibrium);
        }
        self.recurrence(method).map(|recurrence| Attractor::Cycle(Box::new(recurrence)))
    }

    /// Whether no event can follow: with modal deviations z from the equilibrium of the last combination,
    /// an event function never falls below its value there less `sum |h_r| |z_r|`.
    fn comes_to_rest(&self) -> bool {
        let scene = &self.scene;
        let Some(phase) = self.phases.last() else { return false };
        let combination = &phase.basis.combination;
        let carried = scene
            .contacts
            .iter()
            .zip(combination.statuses())
            .any(|(law, &status)| status == Status::Sticking && law.slider_speed != 0.0);
        if carried {
            return false;
        }
        let Ok(modes) = Modes::new(scene, combination) else { return false };
        if modes.defective.contains(&true) || modes.eigenvalues.iter().any(|l| l.re >= 0.0) {
            return false;
        }
        let Ok(end) = self.state(self.end) else { return false };
        let (q, u) = scene.to_coordinates(&end.position, &end.velocity);
        let reduced = &modes.reduced;
        let m = reduced.size();
        let mut force = reduced.force_constant.clone();
        for stick in &reduced.sticking {
            force
                .iter_mut()
                .zip(&stick.load)
                .for_each(|(f, load)| *f += load * q[stick.coordinate]);
        }
        let mut rest = q.clone();
        let solved = eigen::solve(m, &reduced.stiffness, &force);
        reduced.kept.iter().zip(solved).for_each(|(&k, x)| rest[k] = x);
        let deviation: Vec<f64> = reduced
            .kept
            .iter()
            .map(|&k| q[k] - rest[k])
            .chain(reduced.kept.iter().map(|&k| u[k]))
            .collect();
        let z = modes.coordinates(&modes.state_matrices().0, &deviation);
        let still = vec![0.0; scene.size];
        phase.basis.functions.iter().all(|function| {
            let functional = &function.functional;
            let reach: f64 = z
                .iter()
                .zip(modes.right.chunks_exact(2 * m))
                .map(|(z, right)| {
                    let part = |terms: &[(usize, f64)], offset: usize| -> Complex64 {
                        terms
                            .iter()
                            .filter_map(|&(k, weight)| {
                                let j = reduced.kept.iter().position(|&kept| kept == k)?;
                                Some(weight * right[offset + j])
                            })
                            .sum()
                    };
                    (part(&functional.position, 0) + part(&functional.velocity, m)).norm()
                        * z.norm()
                })
                .sum();
            functional.value(&rest, &still) > reach
        })
    }

    /// Largest Lyapunov exponent across the flow, 1/s: the mean growth rate of a neighbour from event to
    /// event, carried by the phases' transition matrices and the saltation of every event.
    pub fn lyapunov_exponent(&self, method: Method) -> Result<f64, Error> {
        let scene = &self.scene;
        let n = scene.size;
        let size = 2 * n;
        let mut events: Vec<Vec<(usize, EventKind)>> = vec![Vec::new(); self.phases.len()];
        for event in &self.events {
            events[event.phase].push((event.contact, event.kind));
        }
        // Any direction has a part along the one that grows most.
        let mut neighbour: Vec<f64> = (0..size).map(|k| 1.0 + 0.1 * (k as f64).sin()).collect();
        let (mut growth, mut time) = (0.0, 0.0);
        for phase in 1..self.phases.len().saturating_sub(1) {
            let basis = &self.phases[phase].basis;
            let flow = Flow::new(scene, &basis.combination, method)?;
            let start = &self.states[size * phase..size * (phase + 1)];
            let duration = self.phase_duration(phase);
            let end = flow.end(start, duration);
            let arrived = &self.states[size * (phase + 1)..size * (phase + 2)];
            let found = passages(scene, &basis.combination, &end, &events[phase + 1]);
            let mut admissible = vec![0.0; size];
            flow.free.iter().for_each(|&k| admissible[k] = neighbour[k]);
            neighbour = admissible;
            // Phi times the neighbour: the difference of two motions, which is exact (see `flow`).
            let moved: Vec<f64> = start.iter().zip(&neighbour).map(|(y, dy)| y + dy).collect();
            neighbour = flow.end(&moved, duration);
            neighbour.iter_mut().zip(&end).for_each(|(dy, y)| *dy -= y);
            if let Some(passage) = found.first() {
                neighbour = passage.carried(scene, &flow, [start, &end, arrived], &neighbour);
            }
            let norm = neighbour.iter().map(|x| x * x).sum::<f64>().sqrt();
            if norm == 0.0 {
                return Ok(f64::NEG_INFINITY);
            }
            neighbour.iter_mut().for_each(|x| *x /= norm);
            time += duration;
            // The first phases turn the neighbour; what they add is a constant.
            growth += if phase > 1 { norm.ln() } else { 0.0 };
        }
        Ok(if time > 0.0 { growth / time } else { f64::NAN })
    }
}
