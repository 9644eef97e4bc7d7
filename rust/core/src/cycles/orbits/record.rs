//! Orbits as plain numbers, from which, with the scene, they are restored to the last bit.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::cycle::Cycle;
use crate::cycles::orbits::orbit::{INSTANT, Orbit, OrbitFailure, OrbitPhase};
use crate::error::input::{Error, refused};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::Scene;
use crate::transient::trajectory::record_format::{decoded, encoded};

/// A [`Cycle`] without its scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CycleRecord {
    method: Method,
    steps: Vec<OrbitPhase>,
    /// Duration of one period, s.
    period: f64,
    /// Largest mismatch between phases, relative to the range of the orbit, -.
    residual: f64,
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
    fn check(&self, scene: &Scene, load_periods: usize) -> Result<(), Error> {
        let contacts = scene.contacts.len();
        let whole: f64 = self.steps.iter().map(|step| step.duration).sum();
        let rounding = self.steps.len() as f64 * f64::EPSILON * self.period;
        let fits = |step: &OrbitPhase| {
            step.state.len() == 2 * scene.size
                && step.state.iter().chain([&step.duration]).all(|x| x.is_finite())
                && step.duration >= -INSTANT * self.period
        };
        // The period is the same sum in another order.
        let periodic = self.period > 0.0 && (self.period - whole).abs() <= rounding;
        if !(periodic && self.residual >= 0.0 && self.steps.iter().all(fits)) {
            return Err(refused("phases that do not fit each other or the scene"));
        }
        let last = self.steps.len() - 1;
        for (k, OrbitPhase { combination, passage, kind, .. }) in self.steps.iter().enumerate() {
            scene.check_combination(combination)?;
            let Passage { contact, trigger, series, .. } = passage;
            let ends = match *contact {
                NO_CONTACT => *kind == EventKind::Load && load_periods > 0 && k == last,
                contact => contact < contacts && kind.can_end(combination.statuses()[contact]),
            };
            let triggered = match kind {
                EventKind::Jump => {
                    matches!(trigger, EventKind::SlipPositive | EventKind::SlipNegative)
                }
                kind => kind == trigger,
            };
            let joins = *kind == EventKind::Accumulation && scene.contacts_coupled();
            let joint = series.is_empty() || joins && series.iter().all(|&one| one < contacts);
            if !(ends && triggered && joint) {
                return Err(refused("events that do not fit the phases they end"));
            }
        }
        if (self.steps[last].kind == EventKind::Load) != (load_periods > 0) {
            return Err(refused("a period that does not fit the loads of the scene"));
        }
        Ok(())
    }
}

impl Cycle {
    /// What [`Cycle::from_record`] takes.
    pub fn record(&self) -> CycleRecord {
        let Orbit { method, period, residual, .. } = self.orbit;
        CycleRecord { method, steps: self.orbit.steps.clone(), period, residual }
    }

    /// The orbit that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Arc<Propagators>,
        record: CycleRecord,
    ) -> Result<Self, OrbitFailure> {
        let scene = &propagators.scene;
        let load_periods = scene
            .load_period()?
            .map_or(0, |period| (record.period / period).round().max(1.0) as usize);
        record.check(scene, load_periods)?;
        let CycleRecord { method, steps, period, residual } = record;
        let propagators = Arc::clone(propagators);
        let mut orbit = Orbit { propagators, method, steps, period, load_periods, residual };
        // The derivatives of passages follow from the scene.
        orbit.transfer();
        Self::new(orbit, &|| false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::attractors::{Attractor, SearchLimits, settle};
    use crate::error::run::RunFailure;
    use crate::scene::status::{Combination, Status};
    use crate::transient::batch::tests::{job, oscillator};

    #[test]
    fn damaged_orbits_are_refused() {
        let scene = oscillator(20.0);
        let start = job(&scene).start.expect("given");
        let propagators = Arc::new(Propagators::new(scene));
        let search = SearchLimits {
            stretch: 1.0,
            limit: 9.0,
            method: Method::Auto,
            cancel: None,
            deadline: None,
        };
        let (found, _) = settle(&propagators, &start, search).expect("a well-posed start");
        let Attractor::Cycle(found) = found else { panic!("no cycle") };
        let whole = found.cycle.record();
        assert!(whole.steps.len() > 1);
        let again = CycleRecord::from_bytes(&whole.to_bytes()).expect("undamaged bytes");
        let again = Cycle::from_record(&propagators, again).expect("an undamaged record");
        assert_eq!(again.record().to_bytes(), whole.to_bytes());
        assert_eq!(again.multipliers.values, found.cycle.multipliers.values);
        type Damage = fn(&mut CycleRecord);
        let damages: Vec<(&str, Damage)> = vec![
            ("no phase", |r| r.steps.clear()),
            ("a state cut short", |r| r.steps[0].state.truncate(3)),
            ("a state that is no number", |r| r.steps[0].state[0] = f64::NAN),
            ("a negative duration", |r| {
                r.steps[0].duration = -1.0;
                r.period = r.steps.iter().map(|step| step.duration).sum();
            }),
            ("a duration that is no number", |r| r.steps[0].duration = f64::NAN),
            ("a period that is not their sum", |r| r.period += 1e-3),
            ("a period that is no number", |r| r.period = f64::NAN),
            ("no period", |r| {
                r.period = 0.0;
                r.steps.iter_mut().for_each(|step| step.duration = 0.0);
            }),
            ("a residual that is no number", |r| r.residual = f64::NAN),
            ("an unknown contact", |r| r.steps[0].passage.contact = 1),
            ("an end without a contact", |r| r.steps[0].passage.contact = NO_CONTACT),
            ("a series of an unknown contact", |r| r.steps[0].passage.series = vec![3]),
            ("a series that closes alone", |r| r.steps[0].passage.series = vec![0]),
            ("another kind than what triggers it", |r| {
                r.steps[0].passage.trigger = EventKind::Release;
            }),
            ("an event that its status can not have", |r| {
                (r.steps[0].kind, r.steps[0].passage.trigger) =
                    (EventKind::Impact, EventKind::Impact);
            }),
            ("a jump that does not slide", |r| {
                let slips = r.steps.iter_mut().find(|step| step.kind != EventKind::Velocity);
                let step = slips.expect("a phase that sticks");
                (step.kind, step.passage.trigger) = (EventKind::Jump, EventKind::Jump);
            }),
            ("an event that ends every motion", |r| {
                (r.steps[0].kind, r.steps[0].passage.trigger) =
                    (EventKind::Exhausted, EventKind::Exhausted);
            }),
            ("a combination of two contacts", |r| {
                r.steps[0].combination = Combination::new(vec![Status::Sticking; 2]);
            }),
        ];
        for (what, damage) in damages {
            let mut record = whole.clone();
            damage(&mut record);
            let found = Cycle::from_record(&propagators, record);
            let told = matches!(
                found,
                Err(OrbitFailure::Failed(RunFailure::Input(
                    Error::Record { .. } | Error::Combination { .. }
                )))
            );
            assert!(told, "{what}: {:?}", found.map(|cycle| cycle.orbit.period));
        }
    }
}
