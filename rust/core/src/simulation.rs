//! The event-driven run: phase, first event, settlement, next phase.

use std::sync::Arc;
use std::time::Instant;

use crate::basis::CombinationBasis;
use crate::error::{Error, RunFailure};
use crate::event::{EventFunction, Trigger};
use crate::motion::{COEFFICIENTS, Motion, Panel};
use crate::roots::{Touch, Verdict, first_root};
use crate::scene::{Scene, State};
use crate::status::{Combination, Status};
use crate::trajectory::{
    Accumulation, Counters, Event, EventKind, Grazing, Phase, StopReason, Trajectory,
};
use crate::transition::{Departure, settle};

/// How phases are propagated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Modes where they are well conditioned and cheap, Taylor series elsewhere.
    Auto,
    Modal,
    Taylor,
}

/// What a run does besides following the motion for its duration.
#[derive(Clone, Copy, Default)]
pub struct Controls<'a> {
    pub max_events: Option<usize>,
    /// Wall-clock seconds.
    pub time_limit: Option<f64>,
    /// Rest of a series of bounces, s, below which its limit is taken; at least one ulp of t.
    pub accumulation_tolerance: f64,
    /// Stop at the first touch that rounding can't decide, instead of keeping the status.
    pub stop_at_grazing: bool,
    /// Asked every few dozen panels.
    pub interrupted: Option<&'a (dyn Fn() -> bool + Sync)>,
}

/// Panels between two questions whether the run is interrupted: about 50 us of small-scene work.
const PANELS_PER_QUESTION: usize = 64;
/// A bounce slower than this, relative to the fastest coordinate, is rounding of the impact before it.
const BOUNCE_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Relative tolerance to which a start state may miss the constraints of its combination.
const START_TOLERANCE: f64 = 1e-9;

impl Scene {
    /// Brings a start state to contact coordinates, refusing one that penetrates or violates its combination.
    pub fn start_coordinates(&self, state: &State) -> Result<(Vec<f64>, Vec<f64>), Error> {
        for (argument, values) in [("position", &state.position), ("velocity", &state.velocity)] {
            if values.len() != self.size {
                return Err(Error::Shape {
                    argument: argument.into(),
                    expected: format!("({},)", self.size),
                    got: format!("({},)", values.len()),
                });
            }
            crate::contact::check_finite(argument, values)?;
        }
        if state.combination.statuses().len() != self.contacts.len() {
            return Err(Error::Combination {
                got: state.combination.to_string(),
                contacts: self.contacts.len(),
            });
        }
        self.check_combination(&state.combination)?;
        let (mut q, mut u) = self.to_coordinates(&state.position, &state.velocity);
        let length = q.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let speed = u.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        for (contact, (law, &status)) in
            self.contacts.iter().zip(state.combination.statuses()).enumerate()
        {
            let violated = |argument, quantity, value| Error::ViolatedStatus {
                argument,
                contact,
                status: status.letter(),
                quantity,
                value,
            };
            let gap = q[law.normal];
            let length_tolerance = START_TOLERANCE * length.max(law.gap.abs());
            let speed_tolerance = START_TOLERANCE * speed.max(law.slider_speed.abs());
            if gap < -length_tolerance {
                return Err(Error::Penetration { contact, gap });
            }
            if !status.is_closed() {
                q[law.normal] = gap.max(0.0);
                if gap <= 0.0 && u[law.normal] < -speed_tolerance {
                    return Err(violated("velocity", "gap velocity", u[law.normal]));
                }
                continue;
            }
            if gap > length_tolerance {
                return Err(violated("position", "gap", gap));
            }
            if u[law.normal].abs() > speed_tolerance {
                return Err(violated("velocity", "gap velocity", u[law.normal]));
            }
            q[law.normal] = 0.0;
            u[law.normal] = 0.0;
            let slip = u[law.tangential] - law.slider_speed;
            let consistent = match status {
                Status::Sticking => slip.abs() <= speed_tolerance,
                Status::Positive => slip <= 0.0 || law.static_friction == 0.0,
                _ => slip >= 0.0 || law.static_friction == 0.0,
            };
            if !consistent {
                return Err(violated("velocity", "slip velocity", slip));
            }
            if status == Status::Sticking {
                u[law.tangential] = law.slider_speed;
            }
        }
        for (contact, (law, &status)) in
            self.contacts.iter().zip(state.combination.statuses()).enumerate()
        {
            if !status.is_closed() {
                continue;
            }
            let violated = |quantity, value| Error::ViolatedStatus {
                argument: "state",
                contact,
                status: status.letter(),
                quantity,
                value,
            };
            let normal = self.reaction(law.normal);
            let normal_force = normal.value(&q, &u);
            let tolerance = START_TOLERANCE * normal.magnitude(&q, &u);
            if normal_force < -tolerance {
                return Err(violated("normal force", normal_force));
            }
            let slip = u[law.tangential] - law.slider_speed;
            if slip == 0.0 && law.static_friction > 0.0 {
                let friction = self.reaction(law.tangential);
                let required = friction.value(&q, &u);
                let limit = law.static_friction * normal_force;
                let tolerance =
                    law.static_friction * tolerance + START_TOLERANCE * friction.magnitude(&q, &u);
                let holds = match status {
                    Status::Sticking => required.abs() <= limit + tolerance,
                    Status::Positive => required >= law.friction * normal_force - tolerance,
                    _ => required <= -law.friction * normal_force + tolerance,
                };
                if !holds {
                    return Err(violated("required friction force at slip velocity 0", required));
                }
            }
        }
        Ok((q, u))
    }
}

/// Runs from `start` at time 0 for `duration` seconds, or until a limit.
pub fn simulate(
    scene: &Arc<Scene>,
    start: &State,
    duration: f64,
    method: Method,
    controls: Controls<'_>,
) -> Result<Trajectory, Error> {
    if !(duration > 0.0 && duration.is_finite()) {
        return Err(Error::Range {
            argument: "duration".into(),
            requirement: "a positive finite time",
            value: duration,
        });
    }
    if scene.contacts_coupled() && !scene.impact_friction {
        return Err(Error::CoupledImpacts);
    }
    let limits = [
        ("time_limit", controls.time_limit.unwrap_or(1.0), controls.time_limit != Some(0.0)),
        ("accumulation_tolerance", controls.accumulation_tolerance, true),
    ];
    for (argument, value, positive) in limits {
        if !(value >= 0.0 && value.is_finite() && positive) {
            return Err(Error::Range {
                argument: argument.into(),
                requirement: "a finite positive time",
                value,
            });
        }
    }
    let (q, u) = scene.start_coordinates(start)?;
    let mut run = Run {
        scene,
        method,
        controls,
        started: Instant::now(),
        duration,
        time: Clock::default(),
        panel: Panel::default(),
        trajectory: Trajectory {
            scene: Arc::clone(scene),
            phases: Vec::new(),
            states: Vec::new(),
            events: Vec::new(),
            grazings: Vec::new(),
            accumulations: Vec::new(),
            counters: Counters::default(),
            stop_reason: StopReason::Duration,
            end: 0.0,
        },
    };
    let reason = run.advance(start.combination.clone(), q, u)?;
    run.trajectory.stop_reason = reason;
    run.trajectory.counters.phases = run.trajectory.phases.len();
    Ok(run.trajectory)
}

/// Time carried as an unevaluated sum, so that thousands of phases add no rounding to it.
#[derive(Debug, Clone, Copy, Default)]
struct Clock {
    seconds: f64,
    rest: f64,
}

impl Clock {
    fn after(self, step: f64) -> Self {
        let sum = self.seconds + step;
        let part = sum - self.seconds;
        let rest = self.rest + ((self.seconds - (sum - part)) + (step - part));
        let seconds = sum + rest;
        Self { seconds, rest: rest - (seconds - sum) }
    }
}

struct Run<'a> {
    scene: &'a Arc<Scene>,
    method: Method,
    controls: Controls<'a>,
    started: Instant,
    duration: f64,
    time: Clock,
    panel: Panel,
    trajectory: Trajectory,
}

/// Where a series of bounces ends, in the unit of the panel.
struct Limit {
    function: usize,
    at: f64,
    bounces: usize,
    error: f64,
}

/// How a phase ended.
enum PhaseEnd {
    /// What vanished `after` the start of the phase, by contact.
    Event {
        after: f64,
        triggers: Vec<(usize, Trigger)>,
    },
    Stop(StopReason),
}

impl Run<'_> {
    fn advance(
        &mut self,
        combination: Combination,
        mut q: Vec<f64>,
        mut u: Vec<f64>,
    ) -> Result<StopReason, Error> {
        let mut basis = self.basis(&combination)?;
        let mut departures = self.initial_departures(&combination, &q, &u);
        let mut at_this_instant = 0;
        loop {
            self.trajectory
                .phases
                .push(Phase { start: self.time.seconds, basis: Arc::clone(&basis) });
            self.trajectory.states.extend_from_slice(&q);
            self.trajectory.states.extend_from_slice(&u);
            self.trajectory.end = self.time.seconds;
            if self.controls.max_events.is_some_and(|most| self.trajectory.events.len() >= most) {
                return Ok(StopReason::MaxEvents);
            }
            let (after, triggers) = match self.phase(&basis, &departures, &mut q, &mut u) {
                PhaseEnd::Event { after, triggers } => (after, triggers),
                PhaseEnd::Stop(reason) => return Ok(reason),
            };
            let before = self.time.seconds;
            self.time = self.time.after(after);

            at_this_instant = if self.time.seconds > before { 0 } else { at_this_instant + 1 };
            // Each contact can pass each status once; more means that the event rule goes in circles.
            if at_this_instant > 4 * self.scene.contacts.len() + 4 {
                return Ok(StopReason::Chattering { contact: triggers[0].0 });
            }
            let settled = match settle(
                self.scene,
                self.time.seconds,
                &triggers,
                basis.combination.statuses(),
                &mut q,
                &mut u,
            ) {
                Ok(settled) => settled,
                Err(failure) => {
                    self.trajectory.end = self.time.seconds;
                    return Ok(StopReason::Failed(failure));
                }
            };
            let phase = self.trajectory.phases.len();
            self.trajectory.events.extend(settled.events.iter().map(|&(contact, kind)| Event {
                time: self.time.seconds,
                contact,
                kind,
                phase,
            }));
            departures = settled.departures;
            let next = Combination::new(settled.statuses);
            if next != basis.combination {
                basis = match self.basis(&next) {
                    Ok(basis) => basis,
                    Err(error) => return Ok(StopReason::Failed(RunFailure::Input(error))),
                };
            }
        }
    }

    fn basis(&mut self, combination: &Combination) -> Result<Arc<CombinationBasis>, Error> {
        let (basis, computed) = self.scene.basis(combination, self.method)?;
        self.trajectory.counters.combinations += usize::from(computed);
        Ok(basis)
    }

    /// Functions of the start state that are exactly zero leave from zero: their multiplicity is found
    /// from the derivatives, each compared with its rounding.
    fn initial_departures(
        &self,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Vec<Departure> {
        combination
            .statuses()
            .iter()
            .enumerate()
            .map(|(contact, &status)| {
                let law = &self.scene.contacts[contact];
                let vanishes = |row: usize| {
                    let reaction = self.scene.reaction(row);
                    reaction.value(q, u).abs() <= START_TOLERANCE * reaction.magnitude(q, u)
                };
                match status {
                    Status::Detached if q[law.normal] == 0.0 => {
                        if u[law.normal] > 0.0 {
                            Departure::Gap(1)
                        } else if vanishes(law.normal) {
                            Departure::Gap(3)
                        } else {
                            Departure::Gap(2)
                        }
                    }
                    _ if status.is_sliding() && u[law.tangential] == law.slider_speed => {
                        let normal = self.scene.reaction(law.normal).value(q, u);
                        let friction = status.friction_sign() * law.friction * normal;
                        let required = self.scene.reaction(law.tangential);
                        let excess = (required.value(q, u) - friction).abs();
                        let rounding = START_TOLERANCE * required.magnitude(q, u);
                        Departure::Slip(if excess <= rounding { 2 } else { 1 })
                    }
                    _ => Departure::None,
                }
            })
            .collect()
    }

    /// Follows one phase to its first event and leaves the state there in (q, u).
    fn phase(
        &mut self,
        basis: &CombinationBasis,
        departures: &[Departure],
        q: &mut [f64],
        u: &mut [f64],
    ) -> PhaseEnd {
        self.trajectory.counters.taylor_phases += usize::from(!basis.is_modal());
        let mut motion = basis.motion(self.scene, q, u);
        let remaining = self.duration - self.time.seconds;
        let mut multiplicity: Vec<usize> = basis
            .functions
            .iter()
            .map(|function| match (departures[function.contact], function.trigger) {
                (Departure::Slip(multiplicity), Trigger::SlipZero)
                | (Departure::Gap(multiplicity), Trigger::GapClosed) => multiplicity,
                _ => 0,
            })
            .collect();
        // Touches at the end of a panel wait for the next one to say whether they were crossings.
        let mut pending: Vec<Option<Grazing>> = vec![None; basis.functions.len()];
        let mut verdicts: Vec<Option<Grazing>> = vec![None; basis.functions.len()];
        loop {
            motion.expand(&mut self.panel);
            self.trajectory.counters.panels += 1;
            if self.trajectory.counters.panels.is_multiple_of(PANELS_PER_QUESTION) {
                let elapsed = || self.started.elapsed().as_secs_f64();
                if self.controls.interrupted.is_some_and(|interrupted| interrupted()) {
                    return self.stop_within(&motion, 0.0, q, u, StopReason::Interrupted);
                }
                if self.controls.time_limit.is_some_and(|limit| elapsed() > limit) {
                    return self.stop_within(&motion, 0.0, q, u, StopReason::TimeLimit);
                }
            }
            let width = self.panel.width;
            let last = motion.start() + width >= remaining;
            let end = if last { ((remaining - motion.start()) / width).min(1.0) } else { 1.0 };
            if self.panel.error.iter().any(|error| !error.is_finite()) {
                return self.stop_within(&motion, 0.0, q, u, StopReason::Unbounded);
            }
            let (mut first, mut found) = (end, None);
            for (index, function) in basis.functions.iter().enumerate() {
                if multiplicity[index] == 1 && function.trigger == Trigger::GapClosed {
                    // The speed of a bounce is known exactly, however small beside the motion it is.
                    let normal = self.scene.contacts[function.contact].normal;
                    self.panel.coefficients[index * COEFFICIENTS + 1] = u[normal] * width;
                }
            }
            let limit = self.accumulation(basis, &multiplicity, u);
            if let Some(limit) = &limit {
                first = first.min(limit.at);
            }
            for (index, function) in basis.functions.iter().enumerate() {
                if limit.as_ref().is_some_and(|limit| limit.function == index) {
                    continue;
                }
                let departing = multiplicity[index];
                let p = &self.panel.polynomial(index)[departing..];
                let error = if departing >= 2 {
                    self.panel.curvature_error[index]
                } else {
                    self.panel.error[index]
                };
                let grazing = |touch: Touch| Grazing {
                    time: self.time.seconds + motion.start() + touch.at * width,
                    contact: function.contact,
                    alternative: alternative(function.trigger),
                    value: touch.value,
                    uncertainty: error,
                };
                let (verdict, refined) = first_root(p, error, first);
                self.trajectory.counters.refinements += usize::from(refined);
                match verdict {
                    Verdict::Clear { touch, in_band } => {
                        verdicts[index] =
                            touch.map(grazing).or(pending[index].filter(|_| in_band.is_none()));
                        pending[index] = in_band.map(grazing);
                    }
                    Verdict::Crossing { root, touch } => {
                        verdicts[index] = touch.map(grazing);
                        pending[index] = None;
                        first = root;
                        found = Some(index);
                    }
                }
            }
            let until = self.time.seconds + motion.start() + first * width;
            let before = self.trajectory.grazings.len();
            self.trajectory.grazings.extend(
                verdicts.iter_mut().filter_map(Option::take).filter(|touch| touch.time <= until),
            );
            if self.controls.stop_at_grazing
                && let Some(touch) = self.trajectory.grazings.get(before)
            {
                let offset = touch.time - self.time.seconds - motion.start();
                self.trajectory.grazings.truncate(before + 1);
                return self.stop_within(&motion, offset.max(0.0), q, u, StopReason::Grazing);
            }
            if let Some(index) = found {
                let triggers = (0..basis.functions.len())
                    .filter(|&other| {
                        other == index || self.vanishes(other, multiplicity[other], first)
                    })
                    .map(|k| (basis.functions[k].contact, basis.functions[k].trigger))
                    .collect();
                let offset = first * width;
                motion.state(offset, q, u);
                return PhaseEnd::Event { after: motion.start() + offset, triggers };
            }
            if let Some(limit) = limit.filter(|limit| limit.at <= end) {
                let offset = limit.at * width;
                motion.state(offset, q, u);
                self.trajectory.accumulations.push(Accumulation {
                    event: self.trajectory.events.len(),
                    bounces: limit.bounces,
                    error: limit.error,
                });
                let contact = basis.functions[limit.function].contact;
                return PhaseEnd::Event {
                    after: motion.start() + offset,
                    triggers: vec![(contact, Trigger::Accumulated)],
                };
            }
            if last {
                let offset = (remaining - motion.start()).min(width);
                return self.stop_within(&motion, offset, q, u, StopReason::Duration);
            }
            motion.advance();
            multiplicity.fill(0);
        }
    }

    /// The nearest limit of a series of bounces in this panel whose rest is negligible. After a bounce the gap is
    /// `c1 s + c2 s^2 + c3 s^3 ..`; with constant acceleration the flight lasts `-c1 / c2`, the whole series
    /// that over `1 - e`, and the neglected c3 changes the flight by about its square times c3 / c2.
    fn accumulation(
        &self,
        basis: &CombinationBasis,
        multiplicity: &[usize],
        u: &[f64],
    ) -> Option<Limit> {
        let ulp = self.time.seconds.next_up() - self.time.seconds;
        let tolerance = self.controls.accumulation_tolerance.max(ulp);
        let speed = u.iter().fold(0.0, |size: f64, u| size.max(u.abs()));
        let limit = |(function, event): (usize, &EventFunction)| {
            let restitution = self.scene.contacts[event.contact].restitution;
            let &[_, c1, c2, c3, ..] = self.panel.polynomial(function) else { return None };
            if !(c2 < 0.0 && restitution < 1.0) {
                return None;
            }
            let at = -c1 / c2 / (1.0 - restitution);
            let rest = at * self.panel.width;
            let negligible = rest <= tolerance || c1 <= BOUNCE_ROUNDING * speed * self.panel.width;
            (negligible && at <= 1.0).then(|| Limit {
                function,
                at,
                bounces: ((rest / ulp).ln() / -restitution.ln()).ceil().max(1.0) as usize,
                error: rest * (2.0 * at * (c3 / c2).abs() + self.panel.error[function] / c1),
            })
        };
        let bounced = |entry: &(usize, &EventFunction)| {
            entry.1.trigger == Trigger::GapClosed && multiplicity[entry.0] == 1
        };
        basis
            .functions
            .iter()
            .enumerate()
            .filter(bounced)
            .filter_map(limit)
            .min_by(|a, b| a.at.total_cmp(&b.at))
    }

    /// Whether an event function is within its error of zero, and falling, at `s` of the panel.
    fn vanishes(&self, function: usize, departing: usize, s: f64) -> bool {
        let p = &self.panel.polynomial(function)[departing..];
        let (mut value, mut slope) = (0.0, 0.0);
        for &c in p.iter().rev() {
            slope = slope * s + value;
            value = value * s + c;
        }
        value <= self.panel.error[function] && slope < 0.0
    }

    fn stop_within(
        &mut self,
        motion: &Motion<'_>,
        offset: f64,
        q: &mut [f64],
        u: &mut [f64],
        reason: StopReason,
    ) -> PhaseEnd {
        motion.state(offset, q, u);
        self.trajectory.end = if reason == StopReason::Duration {
            self.duration
        } else {
            self.time.after(motion.start() + offset).seconds
        };
        PhaseEnd::Stop(reason)
    }
}

const fn alternative(trigger: Trigger) -> EventKind {
    match trigger {
        Trigger::SlipZero => EventKind::Velocity,
        Trigger::Release => EventKind::Release,
        Trigger::SlipPositive => EventKind::SlipPositive,
        Trigger::SlipNegative => EventKind::SlipNegative,
        Trigger::GapClosed => EventKind::Impact,
        Trigger::Accumulated => EventKind::Accumulation,
    }
}
