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
//! Under loads in time the period is a multiple of theirs. The orbit then begins where their phase is 0 and ends there,
//! with the phase of a load as the last h_k: the section is that of a stroboscope, and the loads, which are coordinates of
//! their own in y (see `scene::loads`), have no neighbours.

use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::event_kind::EventKind;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::saltation::Passage;
use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::Combination;
use crate::transient::clock::Clock;

/// Two events coincide if the phase between them is shorter than this part of the period.
pub(crate) const INSTANT: f64 = 1e-11;

/// Number of instants of a phase from which the range of an orbit under loads in time is taken.
const PARTS: usize = 5;

/// One phase of a cycle and the event that ends it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OrbitPhase {
    /// Status of every contact during the phase.
    pub combination: Combination,
    /// (q, q') at its start, contact coordinates.
    pub(crate) state: Vec<f64>,
    /// Length of the phase, s.
    pub duration: f64,
    pub(crate) passage: Passage,
    /// Kind of the event that ends it.
    pub kind: EventKind,
}

impl OrbitPhase {
    /// The contact of the event that ends the phase; none if the period of the loads ends it.
    pub const fn contact(&self) -> usize {
        self.passage.contact
    }

    /// The contacts that close with that event, where it ends a series over several contacts; else none.
    pub fn series(&self) -> &[usize] {
        &self.passage.series
    }

    /// The events that end it, by contact: one, or those of all contacts that close jointly.
    pub(crate) fn events(&self) -> Vec<(usize, EventKind)> {
        let Passage { contact, series, .. } = &self.passage;
        if series.is_empty() {
            let mut events: Vec<_> =
                self.passage.own().map(|contact| (contact, self.kind)).collect();
            events.sort_unstable_by_key(|event| event.0);
            return events;
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
    /// Newton's method used all its steps without convergence.
    #[error(
        "Newton's method did not converge: the last of {steps} steps changed the orbit by {change:e} of its size"
    )]
    Diverged {
        /// Number of steps taken.
        steps: usize,
        /// Change by the last step, relative to the orbit, -.
        change: f64,
    },
    /// Newton's method has no unique step, because a second multiplier is 1 (a fold, or a family of orbits).
    #[error("the return map has a multiplier 1 besides the one of its phase")]
    Singular,
    /// The motion from a guess ends, or grows without limit, before the phase of the sequence does.
    #[error("the motion from a guess of the orbit does not reach the end of phase {phase}")]
    Lost {
        /// Place of the phase in the sequence, from 0.
        phase: usize,
    },
    /// Newton's method shrank the guess to a state that does not move.
    #[error("the orbit shrank to a steady state")]
    Vanished,
    /// A computation ended before its result was there: interrupted, or its time was over.
    #[error("the computation of the orbit was stopped")]
    Stopped,
    /// The motion along the guess can't be computed.
    #[error(transparent)]
    Failed(#[from] RunFailure),
}

/// A failure as soon as a computation is over, interrupted or late.
pub(crate) fn go_on(is_over: &dyn Fn() -> bool) -> Result<(), OrbitFailure> {
    if is_over() { Err(OrbitFailure::Stopped) } else { Ok(()) }
}

impl From<Error> for OrbitFailure {
    fn from(error: Error) -> Self {
        Self::Failed(error.into())
    }
}

/// A periodic orbit of a scene.
#[derive(Debug, Clone)]
pub struct Orbit {
    pub(crate) propagators: Arc<Propagators>,
    pub(crate) method: Method,
    /// The phases of one period, in order of time.
    pub steps: Vec<OrbitPhase>,
    /// Duration of one period, s.
    pub period: f64,
    /// How many periods of the loads in time it lasts; 0 without such loads.
    pub load_periods: usize,
    /// Largest mismatch of a phase's end and the next one's start, relative to the range of the orbit.
    pub residual: f64,
}

/// Typical sizes of displacement changes and velocities along an orbit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    n: usize,
    /// Coordinates of the structure; the others carry loads.
    structure: usize,
    /// The first one whose displacement means nothing, and the first after these.
    hidden: [usize; 2],
    pub length: f64,
    pub speed: f64,
}

impl Scales {
    pub fn of(scene: &Scene, states: impl Iterator<Item: Deref<Target = [f64]>>) -> Self {
        let (n, structure) = (scene.size, scene.structure());
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); 2 * n];
        for state in states {
            let entries = ends.iter_mut().zip(state.iter());
            entries.for_each(|((low, high), &x)| (*low, *high) = (low.min(x), high.max(x)));
        }
        let range = |k: usize| ends[k].1 - ends[k].0;
        let positive = |size: f64| if size > 0.0 { size } else { 1.0 };
        let shown = (0..structure).filter(|&k| !scene.is_hidden(k));
        Self {
            n,
            structure,
            hidden: [scene.hidden().start, scene.hidden().end],
            length: positive(shown.map(range).fold(0.0, f64::max)),
            speed: positive((n..n + structure).map(range).fold(0.0, f64::max)),
        }
    }

    /// Entries of (q, q').
    pub const fn size(&self) -> usize {
        2 * self.n
    }

    /// Unit of an entry of (q, q').
    pub const fn unit(&self, k: usize) -> f64 {
        match (k < self.n, k % self.n < self.structure) {
            (true, true) if self.hidden[0] <= k && k < self.hidden[1] => f64::INFINITY,
            (true, true) => self.length,
            (false, true) => self.speed,
            // Coordinates that carry loads follow the clock.
            (_, false) => f64::INFINITY,
        }
    }

    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter()
            .zip(b)
            .enumerate()
            .map(|(k, (a, b))| (a - b).abs() / self.unit(k))
            .fold(0.0, |size, x| if x.is_nan() { x } else { size.max(x) })
    }
}

impl Orbit {
    pub(crate) fn scene(&self) -> &Arc<Scene> {
        &self.propagators.scene
    }

    /// Adapts the events to the laws of the scene, if the steps come from another scene.
    pub(crate) fn transfer(&mut self) {
        for step in &mut self.steps {
            step.passage = step.passage.transferred(&self.propagators.scene, &step.combination);
        }
    }

    pub(crate) fn flows(&self) -> Result<Vec<Flow<'_>>, Error> {
        flows(&self.propagators, self.method, &self.steps)
    }

    pub(crate) fn scales(&self) -> Scales {
        let whole = self.load_periods > 0 || self.steps.iter().any(|s| s.kind == EventKind::Turn);
        let flows = if whole { self.flows().ok() } else { None };
        match flows {
            // Under loads in time and without events there may be a whole period between two states.
            Some(flows) => {
                let at = |(step, flow): (&OrbitPhase, &Flow<'_>), part: usize| {
                    flow.end(&step.state, step.duration * part as f64 / PARTS as f64)
                };
                let steps = self.steps.iter().zip(&flows);
                let states = steps.flat_map(|pair| (0..PARTS).map(move |part| at(pair, part)));
                Scales::of(self.scene(), states.collect::<Vec<_>>().iter().map(Vec::as_slice))
            }
            None => Scales::of(self.scene(), self.steps.iter().map(|step| step.state.as_slice())),
        }
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

/// The time at which a trajectory over these steps ends.
pub(crate) fn period_of(steps: &[OrbitPhase]) -> f64 {
    steps.iter().fold(Clock::default(), |time, step| time.after(step.duration)).seconds
}

pub(crate) fn flows<'a>(
    propagators: &'a Propagators,
    method: Method,
    steps: &[OrbitPhase],
) -> Result<Vec<Flow<'a>>, Error> {
    let new = |step: &OrbitPhase| Flow::new(propagators, &step.combination, method);
    let flows = steps.iter().map(new).collect::<Result<Vec<_>, _>>()?;
    flows.iter().for_each(|flow| flow.stay_near(steps.iter().map(|step| &step.state[..])));
    Ok(flows)
}
