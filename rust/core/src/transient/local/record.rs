//! The motion of a local march as plain numbers, which give it again to the last bit.

use serde::{Deserialize, Serialize};

use crate::error::input::{Error, refused};
use crate::motion::propagators::Propagators;
use crate::scene::status::{Combination, Status};
use crate::transient::clock::Clock;
use crate::transient::local::motion::{LocalMotion, MarchStep, PanelStart};
use crate::transient::trajectory::kept_states::KeptStates;
use crate::transient::trajectory::model::Phase;

/// Panels may miss each other by so much of the time, by rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// What a local march keeps beside its events: panels, the states at some of them, and what its steps have set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocalRecord {
    /// The combination at the start.
    start: Combination,
    /// Time of the loads at the start, s.
    load_time: f64,
    /// Every how many panels the state is kept.
    stride: usize,
    /// Those states, (q, q').
    states: Vec<f64>,
    panels: Vec<PanelStart>,
    /// One for each phase but the first.
    steps: Vec<MarchStep>,
}

impl LocalMotion {
    /// What [`LocalMotion::from_record`] takes.
    pub fn record(&self) -> LocalRecord {
        LocalRecord {
            start: self.start(),
            load_time: self.load_time,
            stride: self.states.stride(),
            states: self.states.values().to_vec(),
            panels: self.panels.clone(),
            steps: self.steps.clone(),
        }
    }

    /// The motion that a record was made of, in the same scene.
    pub fn from_record(propagators: &Propagators, record: LocalRecord) -> Result<Self, Error> {
        let locality = propagators.locality()?;
        let scene = &propagators.scene;
        let LocalRecord { start, load_time, stride, states, mut panels, steps } = record;
        scene.check_combination(&start)?;
        let width = (1.0 + ROUNDING) * locality.width();
        let follows = |before: Option<&PanelStart>, panel: &PanelStart| {
            let Clock { seconds, rest } = panel.clock;
            let from = before.map_or(0.0, |before| before.clock.seconds + before.end);
            (0.0..=width).contains(&panel.end)
                && (seconds - from).abs() <= ROUNDING * seconds
                && rest.abs() <= f64::EPSILON * seconds
        };
        let earlier = std::iter::once(None).chain(panels.iter().map(Some));
        if panels.is_empty() || !earlier.zip(&panels).all(|(before, panel)| follows(before, panel))
        {
            return Err(refused("panels that do not follow each other"));
        }
        if stride == 0
            || !load_time.is_finite()
            || states.len() != 2 * scene.size * panels.len().div_ceil(stride)
            || !states.iter().all(|x| x.is_finite())
        {
            return Err(refused("panels that do not fit the scene"));
        }
        let admits = |&(contact, status): &(usize, Status)| {
            scene.contacts.get(contact).is_some_and(|law| {
                law.directions.admit(status)
                    && (status != Status::Sticking || law.static_friction > 0.0)
            })
        };
        let sets = |step: &MarchStep| {
            step.statuses.iter().all(admits)
                && step.resets.iter().all(|reset| {
                    reset.coordinate < scene.size && reset.q.is_finite() && reset.u.is_finite()
                })
        };
        if !steps.iter().all(sets) {
            return Err(refused("steps that do not fit the scene"));
        }
        let placed = steps.iter().all(|step| {
            panels.get(step.panel).is_some_and(|panel| (0.0..=panel.end).contains(&step.at))
                && !(step.begins && (step.panel == 0 || step.at != 0.0))
        });
        let place = |step: &MarchStep| (step.panel, !step.begins, step.at);
        if !placed || !steps.is_sorted_by(|a, b| place(a) <= place(b)) {
            return Err(refused("steps that do not fit the panels"));
        }
        let before = |panel| {
            steps.partition_point(|step| step.panel < panel || step.panel == panel && step.begins)
        };
        panels.iter_mut().enumerate().for_each(|(k, panel)| panel.steps = before(k));
        let mut motion = Self::new(scene, &locality, &start, (load_time, None));
        motion.states = KeptStates::every(scene.size, stride, panels.len(), states);
        (motion.panels, motion.steps) = (panels, steps);
        Ok(motion)
    }

    /// The phase of that number.
    pub fn phase(&self, phase: usize) -> Phase {
        let Clock { seconds: start, rest } =
            match phase.checked_sub(1).map(|step| &self.steps[step]) {
                None => Clock::default(),
                Some(step) => self.panels[step.panel].clock.after(step.at),
            };
        Phase { start, rest, basis: 0 }
    }

    /// The end of the last panel, s.
    pub fn end(&self) -> f64 {
        self.panels.last().map_or(0.0, |panel| panel.clock.after(panel.end).seconds)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::motion::local::field::Reset;
    use crate::motion::method::Method;
    use crate::transient::batch::tests::{job, oscillator};
    use crate::transient::run_state::Controls;
    use crate::transient::simulate::simulate;

    #[test]
    fn damaged_marches_are_refused() {
        let scene = oscillator(20.0);
        let start = job(&scene).start.expect("given");
        let propagators = Arc::new(Propagators::new(scene));
        let run = simulate(&propagators, &start, 1.0, Method::Local, Controls::default());
        let whole = run.expect("a march").local.expect("by panels").record();
        assert!(whole.panels.len() > 3 && whole.steps.len() > 1);
        let read = |record| LocalMotion::from_record(&propagators, record);
        assert_eq!(read(whole.clone()).expect("undamaged").record(), whole);
        type Damage = fn(&mut LocalRecord);
        let damages: Vec<(&str, Damage)> = vec![
            ("a start of two contacts", |r| r.start = Combination::new(vec![Status::Detached; 2])),
            ("no panels", |r| r.panels.clear()),
            ("a panel too many", |r| r.panels.extend(r.panels.last().cloned())),
            ("panels out of order", |r| r.panels.swap(1, 2)),
            ("a panel of negative length", |r| r.panels[1].end = -1.0),
            ("a panel of no length", |r| r.panels[1].end = f64::NAN),
            ("a panel too long", |r| r.panels[0].end = 1e3),
            ("a start that is no number", |r| r.panels[1].clock.seconds = f64::NAN),
            ("a low part that is none", |r| r.panels[1].clock.rest = 1.0),
            ("no stride", |r| r.stride = 0),
            ("a stride that skips states", |r| r.stride = 2),
            ("a state too few", |r| r.states.truncate(r.states.len() - 1)),
            ("a state that is no number", |r| r.states[0] = f64::NAN),
            ("a time of loads that is no number", |r| r.load_time = f64::INFINITY),
            ("a step of a panel that is not there", |r| r.steps[0].panel = 10_000),
            ("a step after its panel", |r| r.steps[0].at = 1e3),
            ("a step before its panel", |r| r.steps[0].at = -1e-9),
            ("steps out of order", |r| r.steps.reverse()),
            ("a step that begins the motion", |r| {
                (r.steps[0].panel, r.steps[0].at, r.steps[0].begins) = (0, 0.0, true);
            }),
            ("an unknown contact", |r| r.steps[0].statuses.push((1, Status::Sticking))),
            ("an unknown coordinate", |r| {
                let reset = Reset { coordinate: 2, q: 0.0, u: 0.0 };
                r.steps[0].resets.push(reset);
            }),
            ("a reset that is no number", |r| {
                let reset = Reset { coordinate: 1, q: 0.0, u: f64::NAN };
                r.steps[0].resets.push(reset);
            }),
        ];
        for (what, damage) in damages {
            let mut record = whole.clone();
            damage(&mut record);
            assert!(read(record).is_err(), "{what}");
        }
    }
}
