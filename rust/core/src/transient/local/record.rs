//! The motion of a local march as plain numbers, which give it again to the last bit.

use crate::error::input::{Error, refused};
use crate::motion::local::field::Reset;
use crate::motion::propagators::Propagators;
use crate::scene::status::{Combination, Status};
use crate::transient::clock::Clock;
use crate::transient::local::motion::{LocalMotion, PanelStart, Step};
use crate::transient::trajectory::kept_states::KeptStates;

/// Panels may miss each other by so much of the time, by rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// What a local march keeps beside its events: panels, the states at some of them, and what its steps have set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocalRecord {
    /// Time of the loads at the start, s.
    pub load_time: f64,
    /// Every how many panels the state is kept.
    pub stride: usize,
    /// Start of every panel, s.
    pub panel_start: Vec<f64>,
    /// What rounding takes from `panel_start`.
    pub panel_rest: Vec<f64>,
    /// Length of every panel, s.
    pub panel_length: Vec<f64>,
    /// The panel of every step, one for each phase but the first.
    pub step_panel: Vec<usize>,
    /// Its time after the start of that, s.
    pub step_at: Vec<f64>,
    /// Whether the panel begins with it.
    pub step_begins: Vec<bool>,
    /// The step of every status that is set.
    pub status_step: Vec<usize>,
    /// Its contact.
    pub status_contact: Vec<usize>,
    /// Its letter.
    pub status: String,
    /// The step of every coordinate whose place and speed are set.
    pub reset_step: Vec<usize>,
    /// That coordinate.
    pub reset_coordinate: Vec<usize>,
    /// Place and speed of each.
    pub reset_state: Vec<f64>,
}

impl LocalMotion {
    /// What [`LocalMotion::from_record`] takes, with the kept states.
    pub fn record(&self) -> (LocalRecord, Vec<f64>) {
        let mut record = LocalRecord {
            load_time: self.load_time,
            stride: self.states.stride(),
            panel_start: self.panels.iter().map(|panel| panel.clock.seconds).collect(),
            panel_rest: self.panels.iter().map(|panel| panel.clock.rest).collect(),
            panel_length: self.panels.iter().map(|panel| panel.end).collect(),
            ..LocalRecord::default()
        };
        for (k, step) in self.steps.iter().enumerate() {
            record.step_panel.push(step.panel);
            record.step_at.push(step.at);
            record.step_begins.push(step.begins);
            for &(contact, status) in &step.statuses {
                record.status_step.push(k);
                record.status_contact.push(contact);
                record.status.push(status.letter());
            }
            for reset in &step.resets {
                record.reset_step.push(k);
                record.reset_coordinate.push(reset.coordinate);
                record.reset_state.extend([reset.q, reset.u]);
            }
        }
        (record, self.states.values().to_vec())
    }

    /// The motion that a record was made of, in the same scene.
    pub fn from_record(
        propagators: &Propagators,
        start: &Combination,
        record: LocalRecord,
        states: Vec<f64>,
    ) -> Result<Self, Error> {
        let locality = propagators.locality()?;
        let scene = &propagators.scene;
        let LocalRecord { load_time, stride, .. } = record;
        let width = (1.0 + ROUNDING) * locality.width();
        let panels = panels_of(&record, width)?;
        let steps = steps_of(&record, scene.size, scene.contacts.len())?;
        let admits = |contact: usize, status| {
            let law = &scene.contacts[contact];
            law.directions.admit(status)
                && (status != Status::Sticking || law.static_friction > 0.0)
        };
        let mut set = steps.iter().flat_map(|step| &step.statuses);
        if stride == 0
            || !load_time.is_finite()
            || states.len() != 2 * scene.size * panels.len().div_ceil(stride)
            || set.any(|&(contact, status)| !admits(contact, status))
        {
            return Err(refused("panels that do not fit the scene"));
        }
        let placed = steps.iter().all(|step| {
            panels.get(step.panel).is_some_and(|panel| step.at >= 0.0 && step.at <= panel.end)
                && !(step.begins && (step.panel == 0 || step.at != 0.0))
        });
        let place = |step: &Step| (step.panel, !step.begins, step.at);
        if !placed || !steps.is_sorted_by(|a, b| place(a) <= place(b)) {
            return Err(refused("steps that do not fit the panels"));
        }
        let mut motion = Self::new(scene, &locality, start, (load_time, None));
        motion.states = KeptStates::every(scene.size, stride, panels.len(), states);
        let before = |panel| {
            steps.partition_point(|step| step.panel < panel || step.panel == panel && step.begins)
        };
        let panels = panels.into_iter().enumerate();
        motion.panels = panels.map(|(k, panel)| PanelStart { steps: before(k), ..panel }).collect();
        motion.steps = steps;
        Ok(motion)
    }

    /// The time at which a phase begins.
    pub fn phase_start(&self, phase: usize) -> Clock {
        match phase.checked_sub(1).map(|step| &self.steps[step]) {
            None => Clock::default(),
            Some(step) => self.panels[step.panel].clock.after(step.at),
        }
    }

    /// The end of the last panel, s.
    pub fn end(&self) -> f64 {
        self.panels.last().map_or(0.0, |panel| panel.clock.after(panel.end).seconds)
    }
}

/// Panels that follow each other, without their steps.
fn panels_of(record: &LocalRecord, width: f64) -> Result<Vec<PanelStart>, Error> {
    let LocalRecord { panel_start, panel_rest, panel_length, .. } = record;
    let count = panel_start.len();
    let follows = |k: usize| {
        let from = if k == 0 { 0.0 } else { panel_start[k - 1] + panel_length[k - 1] };
        let start = panel_start[k];
        (start - from).abs() <= ROUNDING * start && panel_rest[k].abs() <= f64::EPSILON * start
    };
    if count == 0
        || panel_rest.len() != count
        || panel_length.len() != count
        || !panel_length.iter().all(|&length| length >= 0.0 && length <= width)
        || !(0..count).all(follows)
    {
        return Err(refused("panels that do not follow each other"));
    }
    let starts = panel_start.iter().zip(panel_rest).zip(panel_length);
    Ok(starts
        .map(|((&seconds, &rest), &end)| PanelStart {
            clock: Clock { seconds, rest },
            end,
            steps: 0,
        })
        .collect())
}

/// Steps with what they set.
fn steps_of(record: &LocalRecord, size: usize, contacts: usize) -> Result<Vec<Step>, Error> {
    let count = record.step_panel.len();
    let lengths_fit = record.step_at.len() == count
        && record.step_begins.len() == count
        && record.status_contact.len() == record.status_step.len()
        && record.reset_coordinate.len() == record.reset_step.len()
        && record.reset_state.len() == 2 * record.reset_step.len();
    let ordered =
        |steps: &[usize]| steps.is_sorted() && steps.last().is_none_or(|&step| step < count);
    if !(lengths_fit
        && ordered(&record.status_step)
        && ordered(&record.reset_step)
        && record.status_contact.iter().all(|&contact| contact < contacts)
        && record.reset_coordinate.iter().all(|&coordinate| coordinate < size)
        && record.reset_state.iter().all(|x| x.is_finite()))
    {
        return Err(refused("steps that do not fit the scene"));
    }
    let heads = record.step_panel.iter().zip(&record.step_at).zip(&record.step_begins);
    let mut steps: Vec<Step> = heads
        .map(|((&panel, &at), &begins)| Step {
            panel,
            at,
            begins,
            statuses: Vec::new(),
            resets: Vec::new(),
        })
        .collect();
    let statuses = Combination::parse(&record.status, record.status_step.len())?;
    let set: Vec<(usize, Status)> =
        record.status_contact.iter().copied().zip(statuses.statuses().iter().copied()).collect();
    for (&step, status) in record.status_step.iter().zip(set) {
        steps[step].statuses.push(status);
    }
    let places = record.reset_coordinate.iter().zip(record.reset_state.chunks_exact(2));
    for (&step, (&coordinate, state)) in record.reset_step.iter().zip(places) {
        steps[step].resets.push(Reset { coordinate, q: state[0], u: state[1] });
    }
    Ok(steps)
}
