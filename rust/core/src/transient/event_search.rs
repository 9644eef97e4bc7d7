//! One phase, followed to its first event: panel by panel, until a certified root is found.

use crate::contact::event_function::EventFunction;
use crate::contact::event_kind::EventKind;
use crate::contact::settlement::Departure;
use crate::error::{Cancel, RunFailure};
use crate::motion::panel::Panel;
use crate::motion::phase_motion::{CoupledMotion, Motion};
use crate::numerics::first_root::polynomial::{ROW, ValueAndSlope};
use crate::numerics::first_root::search::{FirstRoot, Touch, Verdict};
use crate::numerics::simd::VectorUnit;
use crate::transient::run_state::RunState;
use crate::transient::trajectory::{Accumulation, Cursor, Grazing, StopReason};

/// Coordinates times panels between two questions whether the run is interrupted: some 0.1 ms.
const WORK_PER_QUESTION: usize = 512;
/// A bounce slower than this, relative to the fastest coordinate, is rounding of the impact before it.
const BOUNCE_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// A flight is searched for within this many times its parabola first.
const FLIGHT: f64 = 4.0;
/// Rounding of a gap from its own polynomial, relative to the gap and to what its speed adds: Horner's rule.
const GAP_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// How a phase ended.
pub(crate) enum PhaseEnd {
    /// What is in `triggers` vanished `after` the start of the phase; the run holds the state there.
    Event {
        after: f64,
    },
    Stop(StopReason),
    /// All the panels that were allowed are used up.
    TooLong,
}

/// Where a series of bounces ends, in the unit of the panel.
struct Limit {
    function: usize,
    at: f64,
    bounces: usize,
    error: f64,
}

/// The search for the first event, with buffers that serve one phase after the other.
#[derive(Debug, Default)]
pub(crate) struct PhaseSearch {
    panel: Panel,
    /// Of the zero at the start of the first panel, per event function.
    multiplicity: Vec<usize>,
    /// Touches at the end of a panel wait for the next one to say whether they were crossings.
    pending: Vec<Option<Grazing>>,
    /// Whether any does.
    waiting: bool,
    touches: Vec<Grazing>,
    unit: VectorUnit,
    /// Where mass couples contacts, on the first panel of a phase: its gaps are exact at its start.
    exact: bool,
    /// Bound of the error of the gap of each contact at the event found, m, where mass couples contacts.
    pub gaps: Vec<f64>,
    /// What vanishes at the event found, by contact.
    pub triggers: Vec<(usize, EventKind)>,
}

impl PhaseSearch {
    /// Follows one phase to its first event and leaves the state there in the run.
    pub fn follow(
        &mut self,
        run: &mut RunState<'_>,
        motion: &mut Motion,
        departures: Option<&[Departure]>,
        mut panels: usize,
    ) -> PhaseEnd {
        let Some(mut motion) = motion.coupled() else {
            let failure = RunFailure::Internal("uncoupled parts were run as one".into());
            return PhaseEnd::Stop(StopReason::Failed(failure));
        };
        let functions = motion.functions;
        let motion = &mut motion;
        let remaining = run.until - run.time.seconds;
        self.multiplicity.clear();
        self.multiplicity.extend(functions.iter().map(|function| {
            let departure = departures.map_or(Departure::None, |all| all[function.contact]);
            departure.multiplicity(function.trigger)
        }));
        if self.waiting || self.pending.len() != functions.len() {
            self.pending.clear();
            self.pending.resize(functions.len(), None);
            self.waiting = false;
        }
        let mut bouncing = self.multiplicity.contains(&1);
        loop {
            let leaps = self.panel.leaps;
            motion.expand(remaining, &mut self.panel);
            run.trajectory.counters.leaps += self.panel.leaps - leaps;
            run.trajectory.counters.panels += 1;
            if let Some(reason) = asked_to_stop(run) {
                return stop(run, motion, 0.0, reason);
            }
            let width = self.panel.width;
            let last = motion.start() + width >= remaining;
            let end = if last { ((remaining - motion.start()) / width).min(1.0) } else { 1.0 };
            if !self.panel.error.iter().all(|error| error.is_finite()) {
                if let Some(contact) = motion.exhausted() {
                    let time = run.time.after(motion.start()).seconds;
                    let failure = RunFailure::NegativeFriction { contact, time };
                    return stop(run, motion, 0.0, StopReason::Failed(failure));
                }
                return stop_unbounded(run, motion.start());
            }
            self.exact = run.scene.contacts_coupled() && motion.start() == 0.0;
            if self.exact {
                self.begin_exactly(run, functions);
            }
            let limit = if bouncing { self.bounces(run, functions) } else { None };
            let allowed = limit.as_ref().map_or(end, |limit| end.min(limit.at));
            let skipped = limit.as_ref().map(|limit| limit.function);
            let found = self.first_crossing(run, motion, functions, allowed, skipped);
            let until = found.map_or(allowed, |(_, at)| at);
            if let Some(touch) = self.report_touches(run, motion, until) {
                let offset = touch.time - run.time.seconds - motion.start();
                return stop(run, motion, offset.clamp(0.0, width), StopReason::Grazing);
            }
            self.triggers.clear();
            if let Some((index, at)) = found {
                for (other, function) in functions.iter().enumerate() {
                    if other == index || self.vanishes(other, function.trigger, at) {
                        self.triggers.push((function.contact, function.trigger));
                    }
                }
                if run.scene.contacts_coupled() {
                    self.gaps.clear();
                    self.gaps.resize(run.scene.contacts.len(), 0.0);
                    for (index, function) in functions.iter().enumerate() {
                        if function.trigger == EventKind::Impact {
                            self.gaps[function.contact] = self.gap_error(index, at);
                        }
                    }
                }
                self.state(run, motion, functions, at);
                self.exact_approach(run, functions, index, at);
                return PhaseEnd::Event { after: motion.start() + at * width };
            }
            if let Some(limit) = limit.filter(|limit| limit.at <= end) {
                self.state(run, motion, functions, limit.at);
                run.trajectory.accumulations.push(Accumulation {
                    event: run.trajectory.events.len(),
                    bounces: limit.bounces,
                    error: limit.error,
                });
                self.triggers.push((functions[limit.function].contact, EventKind::Accumulation));
                return PhaseEnd::Event { after: motion.start() + limit.at * width };
            }
            if last {
                let offset = (remaining - motion.start()).min(width);
                return stop(run, motion, offset, StopReason::Duration);
            }
            panels -= 1;
            if panels == 0 {
                return PhaseEnd::TooLong;
            }
            motion.advance();
            self.multiplicity.fill(0);
            bouncing = false;
        }
    }

    /// The first crossing of any event function up to `end` of the panel: its function and place.
    fn first_crossing(
        &mut self,
        run: &mut RunState<'_>,
        motion: &CoupledMotion<'_>,
        functions: &[EventFunction],
        end: f64,
        skipped: Option<usize>,
    ) -> Option<(usize, f64)> {
        let mut found = None;
        let mut first = end;
        self.touches.clear();
        for (index, function) in functions.iter().enumerate() {
            if self.panel.excluded[index] && self.multiplicity[index] == 0 || skipped == Some(index)
            {
                if self.waiting {
                    self.touches.extend(self.pending[index].take());
                }
                continue;
            }
            run.trajectory.counters.refinements += 1;
            let impact = function.trigger == EventKind::Impact;
            let bounce = self.multiplicity[index] == 1 && impact;
            if (bounce || self.exact && impact && self.multiplicity[index] == 0)
                && let Some(root) = self.short_flight(index, first)
            {
                first = root;
                found = Some((index, root));
                continue;
            }
            let departing = self.multiplicity[index];
            let p = self.panel.polynomial(index, departing);
            let error = if departing >= 2 || bounce {
                self.panel.curvature_error[index]
            } else {
                self.panel.error[index]
            };
            let grazing = |touch: Touch| Grazing {
                time: run.time.seconds + motion.start() + touch.at * self.panel.width,
                contact: function.contact,
                alternative: function.trigger,
                value: touch.value,
                uncertainty: error,
            };
            let verdict = self.unit.run(FirstRoot { polynomial: p, error, end: first });
            match verdict {
                Verdict::Clear { touch, in_band } => {
                    let before = self.pending[index].take().filter(|_| in_band.is_none());
                    self.touches.extend(touch.map(grazing).or(before));
                    self.pending[index] = in_band.map(grazing);
                    self.waiting |= in_band.is_some();
                }
                Verdict::Crossing { root, touch } => {
                    self.touches.extend(touch.map(grazing));
                    self.pending[index] = None;
                    first = root;
                    found = Some((index, root));
                }
            }
        }
        found
    }

    /// The end of a flight that is short beside the panel, found in the scale of the flight itself: there the
    /// errors of the higher coefficients are small beside the gap and its speed, which are known exactly.
    fn short_flight(&self, function: usize, end: f64) -> Option<f64> {
        let multiplicity = self.multiplicity[function];
        let p = self.panel.polynomial(function, multiplicity);
        let parabola = match multiplicity {
            0 => {
                // The later root of a gap that is positive now, without cancellation.
                let root = (p[1] * p[1] - 4.0 * p[0] * p[2]).sqrt();
                if p[1] > 0.0 { -0.5 * (p[1] + root) / p[2] } else { 2.0 * p[0] / (root - p[1]) }
            }
            _ => -p[0] / p[1],
        };
        let scale = FLIGHT * parabola;
        if !(scale > 0.0 && scale < 1.0) {
            return None;
        }
        let mut scaled = [0.0; ROW];
        let mut power = 1.0;
        for (target, c) in scaled.iter_mut().zip(p) {
            *target = c * power;
            power *= scale;
        }
        let error = match multiplicity {
            0 => self.gap_error(function, scale),
            _ => self.panel.curvature_error[function] * scale,
        };
        let end = (end / scale).min(1.0);
        match self.unit.run(FirstRoot { polynomial: &scaled[..p.len()], error, end }) {
            Verdict::Crossing { root, .. } => Some(root * scale),
            Verdict::Clear { .. } => None,
        }
    }

    /// Where mass couples contacts, series of impacts shrink without end, and superposition leaves some ulp of the
    /// whole motion in a gap. The gap and its speed at the start of a phase are known beside it.
    fn begin_exactly(&mut self, run: &RunState<'_>, functions: &[EventFunction]) {
        for (index, function) in functions.iter().enumerate() {
            if function.trigger != EventKind::Impact || self.panel.excluded[index] {
                continue;
            }
            let normal = run.scene.contacts[function.contact].normal;
            let c = &mut self.panel.coefficients[index * ROW..];
            (c[0], c[1]) = (run.q[normal], run.u[normal] * self.panel.width);
            self.panel.error[index] = self.gap_error(index, 1.0);
        }
    }

    /// Bound of the error of a gap on `[0, s]` of the panel.
    fn gap_error(&self, function: usize, s: f64) -> f64 {
        if !self.exact || self.panel.excluded[function] {
            return self.panel.error[function];
        }
        let c = self.panel.polynomial(function, 0);
        GAP_ROUNDING * (c[0].abs() + c[1].abs() * s) + self.panel.curvature_error[function] * s * s
    }

    /// Leaves the state at s of the panel in the run, gaps by their own polynomials where these are exact.
    fn state(
        &self,
        run: &mut RunState<'_>,
        motion: &mut CoupledMotion<'_>,
        functions: &[EventFunction],
        s: f64,
    ) {
        motion.state(s * self.panel.width, &mut run.q, &mut run.u);
        for (index, function) in functions.iter().enumerate() {
            let known = self.exact && !self.panel.excluded[index];
            if known && function.trigger == EventKind::Impact {
                let (gap, slope) = self.unit.run(ValueAndSlope(self.panel.polynomial(index, 0), s));
                let normal = run.scene.contacts[function.contact].normal;
                (run.q[normal], run.u[normal]) = (gap, slope / self.panel.width);
            }
        }
    }

    /// The gap's speed at an impact, from its own polynomial: after a bounce that keeps the digits which the
    /// superposition of the whole motion has not.
    fn exact_approach(
        &self,
        run: &mut RunState<'_>,
        functions: &[EventFunction],
        index: usize,
        at: f64,
    ) {
        if functions[index].trigger == EventKind::Impact {
            let (_, slope) = self.unit.run(ValueAndSlope(self.panel.polynomial(index, 0), at));
            let normal = run.scene.contacts[functions[index].contact].normal;
            run.u[normal] = (slope / self.panel.width).min(0.0);
        }
    }

    /// Whether an event function is within its error of zero, and falling, at `s` of the panel.
    fn vanishes(&self, function: usize, trigger: EventKind, s: f64) -> bool {
        let multiplicity = self.multiplicity[function];
        if self.panel.excluded[function] && multiplicity == 0 {
            return false;
        }
        let p = self.panel.polynomial(function, multiplicity);
        let (value, slope) = self.unit.run(ValueAndSlope(p, s));
        let (value, error) = match self.exact && trigger == EventKind::Impact {
            true => (value * s.powi(multiplicity as i32), self.gap_error(function, s)),
            false => (value, self.panel.error[function]),
        };
        value <= error && slope < 0.0
    }

    /// The nearest limit of a series of bounces in this panel whose rest is negligible. After a bounce the gap
    /// is `c1 s + c2 s^2 + c3 s^3 ..`; with constant acceleration the flight lasts `-c1 / c2`, the whole series
    /// that over `1 - e`, and the neglected c3 changes the flight by about its square times c3 / c2.
    fn bounces(&mut self, run: &RunState<'_>, functions: &[EventFunction]) -> Option<Limit> {
        let mut nearest: Option<Limit> = None;
        for (function, event) in functions.iter().enumerate() {
            if self.multiplicity[function] != 1 || event.trigger != EventKind::Impact {
                continue;
            }
            let law = &run.scene.contacts[event.contact];
            let width = self.panel.width;
            let c = &mut self.panel.coefficients[function * ROW..];
            c[1] = run.u[law.normal] * width;
            let (c1, c2, c3) = (c[1], c[2], c[3]);
            if !(c2 < 0.0 && law.restitution < 1.0) {
                continue;
            }
            let at = -c1 / c2 / (1.0 - law.restitution);
            let rest = at * width;
            let ulp = run.time.seconds.next_up() - run.time.seconds;
            let speed =
                run.u[..run.scene.structure()].iter().fold(0.0, |size: f64, u| size.max(u.abs()));
            let negligible = rest <= run.controls.accumulation_tolerance.max(ulp)
                || run.u[law.normal] <= BOUNCE_ROUNDING * speed;
            if negligible && at <= 1.0 && nearest.as_ref().is_none_or(|limit| at < limit.at) {
                nearest = Some(Limit {
                    function,
                    at,
                    bounces: ((rest / ulp).ln() / -law.restitution.ln()).ceil().max(1.0) as usize,
                    error: rest
                        * (2.0 * at * (c3 / c2).abs() + self.panel.curvature_error[function]),
                });
            }
        }
        nearest
    }

    /// Records the touches up to `until` of the panel; the first of them when the run is to stop there.
    fn report_touches(
        &mut self,
        run: &mut RunState<'_>,
        motion: &CoupledMotion<'_>,
        until: f64,
    ) -> Option<Grazing> {
        if self.touches.is_empty() {
            return None;
        }
        let until = run.time.seconds + motion.start() + until * self.panel.width;
        self.touches.retain(|touch| touch.time <= until);
        self.touches.sort_by(|a, b| a.time.total_cmp(&b.time));
        if run.controls.stop_at_grazing {
            self.touches.truncate(1);
        }
        run.trajectory.grazings.extend_from_slice(&self.touches);
        self.touches.first().copied().filter(|_| run.controls.stop_at_grazing)
    }
}

fn asked_to_stop(run: &RunState<'_>) -> Option<StopReason> {
    let interval = (WORK_PER_QUESTION / run.scene.size).max(1);
    if !run.trajectory.counters.panels.is_multiple_of(interval) {
        return None;
    }
    if run.controls.cancel.is_some_and(Cancel::is_requested) {
        return Some(StopReason::Interrupted);
    }
    let elapsed = || run.started.elapsed().as_secs_f64();
    let late = run.controls.time_limit.is_some_and(|limit| elapsed() > limit);
    late.then_some(StopReason::TimeLimit)
}

fn stop(
    run: &mut RunState<'_>,
    motion: &mut CoupledMotion<'_>,
    offset: f64,
    reason: StopReason,
) -> PhaseEnd {
    motion.state(offset, &mut run.q, &mut run.u);
    // Without contacts, no event function tells that numbers ran out.
    if !run.q.iter().chain(&run.u).all(|x| x.is_finite()) {
        return stop_unbounded(run, motion.start() + offset);
    }
    run.trajectory.end = if reason == StopReason::Duration {
        run.until
    } else {
        run.time.after(motion.start() + offset).seconds
    };
    PhaseEnd::Stop(reason)
}

/// Ends at the last time, up to `until` of this phase, at which the motion still is within the range of numbers.
fn stop_unbounded(run: &mut RunState<'_>, until: f64) -> PhaseEnd {
    let phase = run.trajectory.phases.len() - 1;
    let mut finite = 0.0;
    let mut step = until;
    for _ in 0..40 {
        let mut cursor = Cursor::new(&run.trajectory);
        cursor.seek_local(phase, finite + step);
        if cursor.q.iter().chain(&cursor.u).all(|x| x.is_finite()) {
            finite += step;
        }
        step *= 0.5;
    }
    run.trajectory.end = run.time.after(finite).seconds;
    PhaseEnd::Stop(StopReason::Unbounded)
}
