//! A periodic orbit as a motion: its trajectory, its extremes, and how far it is from other event sequences.

use std::fmt;
use std::sync::Arc;

use crate::contact::event_function::ConePart;
use crate::contact::event_kind::EventKind;
use crate::cycles::linearization::event::EventValue;
use crate::cycles::orbits::floquet::Multipliers;
use crate::cycles::orbits::orbit::{Orbit, OrbitFailure, go_on};
use crate::error::input::Error;
use crate::motion::propagators::Propagators;
use crate::numerics::bracket::Bracket;
use crate::scene::status::Status;
use crate::transient::clock::Clock;
use crate::transient::trajectory::events::Event;
use crate::transient::trajectory::model::{Phase, Trajectory};
use crate::transient::trajectory::used_bases::UsedBasis;

/// Instants per phase at which an extreme is looked for, and per period besides; between two of
/// them a velocity has changed sign once.
const PHASE_GRID: usize = 8;
const PERIOD_GRID: usize = 512;

/// Part of the grid to which the instant of an extreme is found: an error of it leaves its square in the extreme.
const TURNED: f64 = 1e-8;

/// Part of its terms below which an event function starts a phase at zero.
const LEAVING: f64 = 1e-10;

/// A periodic orbit with its multipliers, stability and extremes.
#[derive(Debug, Clone)]
pub struct Cycle {
    /// The closed orbit itself.
    pub orbit: Orbit,
    /// Its Floquet multipliers.
    pub multipliers: Multipliers,
    /// Whether it attracts its neighbours.
    pub stability: Stability,
    /// Smallest and largest displacement of every dof, m.
    pub extremes: Extremes,
}

/// Whether the neighbours of an orbit return to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// All multipliers across the flow lie within the unit circle.
    Stable,
    /// One of them lies outside.
    Unstable,
    /// Events of these contacts coincide, and the order in which a neighbour meets them matters to it.
    Corner {
        /// Indices of the two contacts whose events coincide.
        contacts: (usize, usize),
    },
    /// The largest multiplier is 1 in modulus to rounding.
    Marginal {
        /// A contact that sticks throughout, if such contacts account for all these multipliers.
        held: Option<usize>,
    },
    /// The return map has no derivative: an event function only touches zero.
    Touch,
}

/// Distance from 1 of the modulus of the largest multiplier up to which rounding decides on which side it is.
const MARGIN: f64 = 1e-11;

impl Stability {
    fn of(orbit: &Orbit, multipliers: &Multipliers) -> Self {
        let largest = multipliers.largest();
        match orbit.corner() {
            Some(contacts) => Self::Corner { contacts },
            None if largest < 1.0 - MARGIN => Self::Stable,
            None if largest > 1.0 + MARGIN => Self::Unstable,
            None if largest.is_nan() => Self::Touch,
            None => Self::Marginal { held: held(orbit, multipliers) },
        }
    }

    /// Whether the orbit is stable; None if that is not known.
    pub const fn is_stable(self) -> Option<bool> {
        match self {
            Self::Stable => Some(true),
            Self::Unstable => Some(false),
            Self::Corner { .. } | Self::Marginal { .. } | Self::Touch => None,
        }
    }
}

/// A contact that sticks throughout, if there are as many of them as multipliers on or outside the unit circle.
fn held(orbit: &Orbit, multipliers: &Multipliers) -> Option<usize> {
    let sticks = |contact: &usize| {
        let mut statuses = orbit.steps.iter().map(|step| step.combination.statuses()[*contact]);
        statuses.all(|status| status == Status::Sticking)
    };
    let neutral = multipliers.transverse.iter().filter(|m| !(m.norm() < 1.0 - MARGIN)).count();
    let mut contacts = (0..orbit.scene().contacts.len()).filter(sticks);
    let first = contacts.next()?;
    (neutral <= 1 + contacts.count()).then_some(first)
}

impl fmt::Display for Stability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stable => f.write_str("stable"),
            Self::Unstable => f.write_str("unstable"),
            Self::Corner { contacts: (a, b) } => write!(
                f,
                "stability not known: events of contacts {a} and {b} coincide, and their order matters to neighbours"
            ),
            Self::Marginal { held: Some(contact) } => write!(
                f,
                "stability not known: a multiplier is 1, as contact {contact} sticks throughout and every motion keeps the place at which it sticks, or the friction force of its spring there; all other differences decay"
            ),
            Self::Marginal { held: None } => f.write_str(
                "stability not known: the largest multiplier is 1 in modulus to rounding",
            ),
            Self::Touch => f.write_str("stability not known: an event function only touches zero"),
        }
    }
}

impl Cycle {
    /// Computes multipliers, stability and extremes of an orbit; a failure as soon as `is_over`, which every phase asks.
    pub fn new(orbit: Orbit, is_over: &dyn Fn() -> bool) -> Result<Self, OrbitFailure> {
        let multipliers = orbit.multipliers(is_over)?;
        let stability = Stability::of(&orbit, &multipliers);
        Ok(Self { extremes: orbit.extremes(is_over)?, multipliers, stability, orbit })
    }
}

/// Smallest and largest displacement of every dof over a period, m.
#[derive(Debug, Clone)]
pub struct Extremes {
    /// Smallest displacement of every dof, m.
    pub minimum: Vec<f64>,
    /// Largest displacement of every dof, m.
    pub maximum: Vec<f64>,
}

/// The smallest value of an event function that ends no phase: its zero would change the sequence.
#[derive(Debug, Clone, Copy)]
pub struct Margin {
    /// Index of the phase in [`Orbit::steps`].
    pub step: usize,
    /// Index of the contact.
    pub contact: usize,
    /// The event that would happen.
    pub kind: EventKind,
    /// Lowest value, in the unit of the event function; negative where the orbit violates a contact law.
    pub value: f64,
    /// Time within the period, s.
    pub time: f64,
    /// Lowest within the phase (a touch there), not at its end (two events that meet).
    pub interior: bool,
}

impl Orbit {
    /// One period as a trajectory, from just after the last event to just after it again.
    pub fn trajectory(&self) -> Result<Trajectory, Error> {
        let times = self.times();
        let flows = self.flows()?;
        let mut trajectory = Trajectory::new(&self.propagators);
        let wanted = self.method.for_repeated_use();
        trajectory.bases = flows.iter().map(|flow| UsedBasis::new(&flow.basis, wanted)).collect();
        let count = self.steps.len();
        trajectory.end = times[count].seconds;
        for k in 0..=count {
            let step = &self.steps[k % count];
            let Clock { seconds: start, rest } = times[k];
            trajectory.phases.push(Phase { start, rest, basis: k % count });
            let (q, u) = step.state.split_at(self.scene().size);
            trajectory.states.push(q, u, &[]);
            // The period of the loads is no event, nor is the cut of an orbit without any.
            let cut = |kind| matches!(kind, EventKind::Load | EventKind::Turn);
            if k > 0 && !cut(self.steps[k - 1].kind) {
                let ended = &self.steps[k - 1];
                let time = times[k].seconds;
                trajectory.events.extend(ended.events().into_iter().map(|(contact, kind)| Event {
                    time,
                    contact,
                    kind,
                    phase: k,
                }));
            }
        }
        trajectory.counters.phases = count + 1;
        let taylor = (0..=count).filter(|k| !flows[k % count].basis.is_modal());
        trajectory.counters.taylor_phases = taylor.count();
        Ok(trajectory)
    }

    /// The orbit with the same event sequence in another scene; a failure as soon as `is_over`, which every phase asks.
    pub fn continued(
        &self,
        propagators: &Arc<Propagators>,
        is_over: &dyn Fn() -> bool,
    ) -> Result<Self, OrbitFailure> {
        let scene = &propagators.scene;
        let both = [scene, self.scene()];
        let loads = both.map(|scene| (scene.size - scene.structure()).to_string());
        let sizes =
            both.map(|scene| format!("{} dofs and {} contacts", scene.dofs, scene.contacts.len()));
        for ([got, own], what) in [(loads, " loads in time of different frequencies"), (sizes, "")]
        {
            if got != own {
                let (argument, expected) = ("scene".into(), format!("{own}{what}, like the orbit"));
                return Err(Error::Shape { argument, expected, got }.into());
            }
        }
        Self::solve(propagators, self.method, self.steps.clone(), self.load_periods, is_over)
    }

    fn grid(&self, duration: f64) -> usize {
        PHASE_GRID + (PERIOD_GRID as f64 * (duration / self.period).abs()).ceil() as usize
    }

    /// Smallest and largest displacement of every dof; where a velocity changes sign, by Newton's method.
    fn extremes(&self, is_over: &dyn Fn() -> bool) -> Result<Extremes, OrbitFailure> {
        let scene = self.scene();
        let (coordinates, n) = (scene.size, scene.dofs);
        let mut extremes =
            Extremes { minimum: vec![f64::INFINITY; n], maximum: vec![f64::NEG_INFINITY; n] };
        let dofs = |state: &[f64]| {
            let (q, u) = state.split_at(coordinates);
            scene.dof_state(q, u)
        };
        for (step, flow) in self.steps.iter().zip(self.flows()?) {
            go_on(is_over)?;
            let count = self.grid(step.duration);
            let width = step.duration / count as f64;
            let mut before: Option<(Vec<f64>, Vec<f64>)> = None;
            for i in 0..=count {
                let at = dofs(&flow.end(&step.state, width * i as f64));
                for dof in 0..n {
                    extremes.include(dof, at.0[dof]);
                    let turns = before.as_ref().is_some_and(|b| b.1[dof] * at.1[dof] < 0.0);
                    if let (true, Some(before)) = (turns, &before) {
                        let bracket =
                            Bracket { low: width * (i - 1) as f64, high: width * i as f64 };
                        let velocities = [before.1[dof], at.1[dof]];
                        let time = bracket.root(velocities, TURNED * width, |time| {
                            let state = flow.end(&step.state, time);
                            let acceleration = scene.accelerations(&flow.field(&state))[dof];
                            (dofs(&state).1[dof], acceleration)
                        });
                        extremes.include(dof, dofs(&flow.end(&step.state, time)).0[dof]);
                    }
                }
                before = Some(at);
            }
        }
        Ok(extremes)
    }

    /// How fast the event function of the event that ends each phase crosses zero, `grad h . f-`, its unit per second:
    /// zero where the event only touches. It is 1 where the time of the event is known explicitly.
    pub fn crossing_speeds(&self) -> Result<Vec<f64>, OrbitFailure> {
        let pass = self.pass(&self.flows()?)?;
        Ok(pass.linearised.iter().map(|event| event.speed).collect())
    }

    /// The margins of all event functions over their phases, except those that end them.
    pub fn margins(&self, is_over: &dyn Fn() -> bool) -> Result<Vec<Margin>, OrbitFailure> {
        let mut margins = Vec::new();
        let times = self.times();
        for (index, (step, flow)) in self.steps.iter().zip(self.flows()?).enumerate() {
            go_on(is_over)?;
            let count = self.grid(step.duration);
            let width = step.duration / count as f64;
            let at = |time: f64| {
                let state = flow.end(&step.state, time);
                let field = flow.field(&state);
                (state, field)
            };
            let samples: Vec<_> = (0..=count).map(|i| at(width * i as f64)).collect();
            for function in &flow.basis.functions {
                let beside =
                    self.scene().contacts[function.contact].plane.map(|plane| plane.beside);
                // In a plane one function is made of several parts.
                let first = beside.is_none_or(|beside| function.contact < beside);
                if !(function.cone.is_none() || function.cone == Some(ConePart::Limit) && first) {
                    continue;
                }
                let event = EventValue::new(self.scene(), &step.combination, function.clone());
                let value = |state: &[f64]| event.value(&flow, state).0;
                let slope = |state: &[f64], field: &[f64]| event.rate(&flow, state, field);
                let passage = &step.passage;
                let own = |&contact: &usize| contact == function.contact || Some(contact) == beside;
                let ends = match passage.is_joint() {
                    false => {
                        function.trigger == passage.trigger && passage.own().any(|one| own(&one))
                    }
                    true => {
                        function.trigger == EventKind::Impact
                            && (own(&passage.contact) || passage.series.iter().any(own))
                    }
                };
                let slopes: Vec<f64> = samples.iter().map(|at| slope(&at.0, &at.1)).collect();
                let mut lowest: Option<(f64, f64, bool)> = None;
                let mut include = |value: f64, time: f64, interior: bool| {
                    if lowest.is_none_or(|low| value < low.0) {
                        lowest = Some((value, time, interior));
                    }
                };
                // A function that leaves from zero does so with a slope of its own, or of rounding.
                let (start_value, scale) = event.value(&flow, &step.state);
                let first = usize::from(start_value.abs() <= LEAVING * scale);
                for i in first..count {
                    if slopes[i] < 0.0 && slopes[i + 1] >= 0.0 {
                        let bracket =
                            Bracket { low: width * i as f64, high: width * (i + 1) as f64 };
                        let resolution = 4.0 * f64::EPSILON * step.duration;
                        let time = bracket.root([slopes[i], slopes[i + 1]], resolution, |time| {
                            let (state, field) = at(time);
                            let rate = flow.field_rate(&state, &field);
                            (slope(&state, &field), slope(&state, &rate))
                        });
                        include(value(&at(time).0), time, true);
                    }
                }
                if !ends {
                    include(value(&samples[count].0), step.duration, false);
                }
                margins.extend(lowest.map(|(value, time, interior)| Margin {
                    step: index,
                    contact: function.contact,
                    kind: function.trigger,
                    value,
                    time: times[index].seconds + time,
                    interior,
                }));
            }
        }
        Ok(margins)
    }
}

impl Extremes {
    fn include(&mut self, dof: usize, displacement: f64) {
        self.minimum[dof] = self.minimum[dof].min(displacement);
        self.maximum[dof] = self.maximum[dof].max(displacement);
    }
}
