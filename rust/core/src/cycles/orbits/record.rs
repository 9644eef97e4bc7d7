//! Orbits as plain numbers, from which, with the scene, they are restored to the last bit.
//!
//! Passages follow from the scene and are computed again.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::cycle::Cycle;
use crate::cycles::orbits::orbit::{INSTANT, Orbit, OrbitFailure, Step};
use crate::error::input::{Error, refused};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};
use crate::transient::trajectory::record_format::{decoded, encoded};

/// A [`Cycle`] without its scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleRecord {
    /// How the phases are propagated.
    pub method: Method,
    /// The phases, in order of time.
    pub steps: Vec<StepRecord>,
    /// Duration of one period, s.
    pub period: f64,
    /// Largest mismatch between phases, relative to the range of the orbit, -.
    pub residual: f64,
}

/// One phase of an orbit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Its combination.
    pub combination: Combination,
    /// (q, q') at its start, contact coordinates.
    pub state: Vec<f64>,
    /// s
    pub duration: f64,
    /// The contact of the event that ends it.
    pub contact: usize,
    /// The kind of that event.
    pub kind: EventKind,
    /// The contacts that close with it, where it ends a series of impacts over several contacts; else empty.
    pub series: Vec<usize>,
}

impl CycleRecord {
    /// What [`CycleRecord::from_bytes`] takes.
    pub fn to_bytes(&self) -> Vec<u8> {
        encoded("orbit", self)
    }

    /// The record in some bytes; [`Cycle::from_record`] says whether an orbit has it.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        decoded("orbit", bytes)
    }

    /// Refuses a record that no orbit of the scene can have.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let contacts = scene.contacts.len();
        let whole: f64 = self.steps.iter().map(|step| step.duration).sum();
        let rounding = self.steps.len() as f64 * f64::EPSILON * self.period;
        let fits = |step: &StepRecord| {
            step.state.len() == 2 * scene.size
                && step.state.iter().chain([&step.duration]).all(|x| x.is_finite())
                && step.duration >= -INSTANT * self.period
                && step.series.iter().all(|&contact| contact < contacts)
                && (step.contact < contacts
                    || (step.contact, step.kind) == (NO_CONTACT, EventKind::Load))
        };
        // The period is the same sum in another order.
        if !(self.period > 0.0 && (self.period - whole).abs() <= rounding && self.residual >= 0.0)
            || !self.steps.iter().all(fits)
        {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        Ok(())
    }

    /// The step of that number of the orbit.
    fn step(&self, scene: &Scene, k: usize, load_periods: usize) -> Result<Step, Error> {
        let count = self.steps.len();
        let StepRecord { combination, state, duration, contact, kind, series } =
            self.steps[k].clone();
        scene.check_combination(&combination)?;
        let is_joint = !series.is_empty();
        let ends = match contact {
            NO_CONTACT => load_periods > 0 && k + 1 == count,
            contact => kind.can_end(combination.statuses()[contact]),
        };
        if !ends || is_joint && !(kind == EventKind::Accumulation && scene.contacts_coupled()) {
            return Err(refused("events that do not fit the phases they end"));
        }
        let after = self.steps[(k + 1) % count].combination.statuses();
        let trigger = match (kind, after.get(contact)) {
            (EventKind::Jump, Some(Status::Positive)) => EventKind::SlipPositive,
            (EventKind::Jump, Some(Status::Negative)) => EventKind::SlipNegative,
            (EventKind::Jump, _) => return Err(refused("a jump that does not slide")),
            (kind, _) => kind,
        };
        let passage = match is_joint {
            true => Passage::joint(scene, &combination, contact, series),
            false => Passage::new(scene, &combination, contact, trigger),
        };
        Ok(Step { combination, state, duration, passage, kind })
    }
}

impl Cycle {
    /// What [`Cycle::from_record`] takes.
    pub fn record(&self) -> CycleRecord {
        let Orbit { method, period, residual, .. } = self.orbit;
        let record = |step: &Step| StepRecord {
            combination: step.combination.clone(),
            state: step.state.clone(),
            duration: step.duration,
            contact: step.passage.contact,
            kind: step.kind,
            series: step.passage.series.clone(),
        };
        CycleRecord {
            method,
            steps: self.orbit.steps.iter().map(record).collect(),
            period,
            residual,
        }
    }

    /// The orbit that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Arc<Propagators>,
        record: &CycleRecord,
    ) -> Result<Self, OrbitFailure> {
        let scene = &propagators.scene;
        record.check(scene)?;
        let load_periods = scene
            .load_period()?
            .map_or(0, |period| (record.period / period).round().max(1.0) as usize);
        let ends = record.steps.last().is_some_and(|step| step.kind == EventKind::Load);
        if ends != (load_periods > 0) {
            return Err(refused("a period that does not fit the loads of the scene").into());
        }
        let steps = (0..record.steps.len()).map(|k| record.step(scene, k, load_periods));
        let orbit = Orbit {
            propagators: Arc::clone(propagators),
            method: record.method,
            steps: steps.collect::<Result<_, Error>>()?,
            period: record.period,
            load_periods,
            residual: record.residual,
        };
        Self::new(orbit, &|| false)
    }
}
