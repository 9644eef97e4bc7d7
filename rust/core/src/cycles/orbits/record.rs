//! Orbits as plain numbers, from which, with the scene, they are restored to the last bit.
//!
//! Passages follow from the scene and are computed again.

use std::sync::Arc;

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::cycle::Cycle;
use crate::cycles::orbits::orbit::{INSTANT, Orbit, OrbitFailure, Step};
use crate::error::input::{Error, refused};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// A [`Cycle`] without its scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleRecord {
    /// How the phases are propagated.
    pub method: Method,
    /// Combination of each phase, one letter per contact.
    pub combinations: Vec<String>,
    /// (q, q') at the start of each phase, contact coordinates, 2n per phase.
    pub states: Vec<f64>,
    /// Length of each phase, s.
    pub durations: Vec<f64>,
    /// The contact and the kind of the event that ends each phase.
    pub contacts: Vec<usize>,
    /// Kind of the event that ends each phase.
    pub kinds: Vec<EventKind>,
    /// The contacts that close with it, where it ends a series of impacts over several contacts; else empty.
    pub series: Vec<Vec<usize>>,
    /// Duration of one period, s.
    pub period: f64,
    /// Largest mismatch between phases, relative to the range of the orbit, -.
    pub residual: f64,
}

impl CycleRecord {
    /// Refuses a record that no orbit of the scene can have.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let (count, width) = (self.combinations.len(), 2 * scene.size);
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let whole: f64 = self.durations.iter().sum();
        if count == 0
            || self.states.len() != width * count
            || self.durations.len() != count
            || self.contacts.len() != count
            || self.kinds.len() != count
            || self.series.len() != count
            || self.series.iter().flatten().any(|&contact| contact >= scene.contacts.len())
            || self.contacts.iter().zip(&self.kinds).any(|(&contact, &kind)| {
                contact >= scene.contacts.len() && (contact, kind) != (NO_CONTACT, EventKind::Load)
            })
            || !(finite(&self.states) && finite(&self.durations) && self.residual >= 0.0)
            // The same sum in another order.
            || !(self.period > 0.0 && (self.period - whole).abs() <= count as f64 * f64::EPSILON * self.period)
            || self.durations.iter().any(|&duration| duration < -INSTANT * self.period)
        {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        Ok(())
    }
}

impl Cycle {
    /// What [`Cycle::from_record`] takes.
    pub fn record(&self) -> CycleRecord {
        let steps = &self.orbit.steps;
        CycleRecord {
            method: self.orbit.method,
            combinations: steps.iter().map(|step| step.combination.to_string()).collect(),
            states: steps.iter().flat_map(|step| step.state.iter().copied()).collect(),
            durations: steps.iter().map(|step| step.duration).collect(),
            contacts: steps.iter().map(|step| step.passage.contact).collect(),
            kinds: steps.iter().map(|step| step.kind).collect(),
            series: steps.iter().map(|step| step.passage.series.clone()).collect(),
            period: self.orbit.period,
            residual: self.orbit.residual,
        }
    }

    /// The orbit that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Arc<Propagators>,
        record: &CycleRecord,
    ) -> Result<Self, OrbitFailure> {
        let scene = &propagators.scene;
        let (count, width) = (record.combinations.len(), 2 * scene.size);
        record.check(scene)?;
        let load_periods = scene
            .load_period()?
            .map_or(0, |period| (record.period / period).round().max(1.0) as usize);
        let ends = record.kinds[count - 1] == EventKind::Load;
        if ends != (load_periods > 0) {
            return Err(refused("a period that does not fit the loads of the scene").into());
        }
        let steps = (0..count)
            .map(|k| {
                let (contact, kind) = (record.contacts[k], record.kinds[k]);
                let combination =
                    Combination::parse(&record.combinations[k], scene.contacts().len())?;
                propagators.scene.check_combination(&combination)?;
                let series = &record.series[k];
                let is_joint = !series.is_empty();
                let ends = match contact {
                    NO_CONTACT => load_periods > 0 && k + 1 == count,
                    contact => kind.can_end(combination.statuses()[contact]),
                };
                if !ends
                    || is_joint && !(kind == EventKind::Accumulation && scene.contacts_coupled())
                {
                    return Err(refused("events that do not fit the phases they end"));
                }
                Ok(Step {
                    state: record.states[width * k..width * (k + 1)].to_vec(),
                    duration: record.durations[k],
                    passage: match is_joint {
                        true => Passage::joint(scene, &combination, contact, series.clone()),
                        false if kind == EventKind::Jump => {
                            let after = &record.combinations[(k + 1) % count];
                            let trigger = match after.as_bytes().get(contact) {
                                Some(b'+') => EventKind::SlipPositive,
                                Some(b'-') => EventKind::SlipNegative,
                                _ => return Err(refused("a jump that does not slide")),
                            };
                            Passage::new(scene, &combination, contact, trigger)
                        }
                        false => Passage::new(scene, &combination, contact, kind),
                    },
                    kind,
                    combination,
                })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        Self::new(Orbit {
            propagators: Arc::clone(propagators),
            method: record.method,
            steps,
            period: record.period,
            load_periods,
            residual: record.residual,
        })
    }
}
