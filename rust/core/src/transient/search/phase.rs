//! One phase, followed to its first event: panel by panel, until a certified root is found.
//!
//! What most events do without is marked as cold and stays out of the loop over panels. Together with portable kernels that are
//! called and not inlined, this saves the reference run 1 % of its instructions.

use crate::contact::event_function::EventFunction;
use crate::contact::event_kind::EventKind;
use crate::contact::settlement::Departure;
use crate::error::run::{LawEnd, RunFailure};
use crate::linalg::dense::max_norm;
use crate::motion::friction::series::law_contact::LawOf;
use crate::motion::phase_motion::{CoupledMotion, Motion};
use crate::numerics::first_root::polynomial::{ROW, ValueAndSlope};
use crate::transient::run_state::RunState;
use crate::transient::search::panel::{Limit, PanelSearch};
use crate::transient::trajectory::events::{Grazing, StopReason};
use crate::transient::trajectory::sampling::Cursor;

/// Coordinates times panels between two questions whether the run is interrupted: some 0.1 ms.
const WORK_PER_QUESTION: usize = 2048;
/// How far before their panel series under laws of friction are followed to a root, in units of its width: what they leave out is then
/// nothing, and where a table begins another cubic at the panel, its slope is continuous.
const BEFORE: f64 = 1.0 / 64.0;

/// How a phase ended.
pub(crate) enum PhaseEnd {
    /// The event functions in `triggers` vanish `after` the start of the phase; the run holds the state there.
    Event {
        after: f64,
    },
    /// Nothing has happened up to the end of the stretch, where a load is switched.
    Switch,
    Stop(StopReason),
    /// All the panels that were allowed are used up.
    TooLong,
}

/// The search for the first event, with buffers that serve one phase after the other.
#[derive(Debug, Default)]
pub(crate) struct PhaseSearch {
    on_panel: PanelSearch,
    /// Bound of the error of the gap of each contact at the event found, m, where mass couples contacts.
    pub gaps: Vec<f64>,
    /// The event functions that vanish at the event found, by contact.
    pub triggers: Vec<(usize, EventKind)>,
    /// The series of bounces that end at the event found.
    pub limits: Vec<Limit>,
}

impl PhaseSearch {
    /// Follows one phase to its first event and leaves the state there in the run. `allowed` tells of a time of the run how many
    /// panels the phase may have if it comes as far.
    pub fn follow(
        &mut self,
        run: &mut RunState<'_>,
        motion: &mut Motion,
        departures: Option<&[Departure]>,
        allowed: &dyn Fn(f64) -> usize,
    ) -> PhaseEnd {
        let Some(mut motion) = motion.coupled() else {
            let failure = RunFailure::Internal("uncoupled parts were run as one".into());
            return PhaseEnd::Stop(StopReason::Failed(failure));
        };
        let functions = motion.functions;
        let motion = &mut motion;
        let remaining = run.until - run.time.seconds;
        let (mut panels, mut most) = (0, allowed(run.time.seconds));
        self.on_panel.begin(functions.iter().map(|function| {
            let departure = departures.map_or(Departure::None, |all| all[function.contact]);
            departure.multiplicity(function.trigger)
        }));
        let mut bouncing = self.on_panel.multiplicity.contains(&1);
        loop {
            let leaps = self.on_panel.panel.leaps;
            motion.expand(remaining, &mut self.on_panel.panel);
            run.trajectory.counters.leaps += self.on_panel.panel.leaps - leaps;
            run.trajectory.counters.panels += 1;
            if let Some(reason) = asked_to_stop(run) {
                return stop(run, motion, 0.0, reason);
            }
            let width = self.on_panel.panel.width;
            let last = motion.start() + width >= remaining;
            let end = if last { ((remaining - motion.start()) / width).min(1.0) } else { 1.0 };
            let stopped = motion.stopped();
            if !stopped.is_empty() {
                self.triggers.clear();
                self.triggers.extend(stopped.into_iter().map(|one| (one, EventKind::Velocity)));
                self.limits.clear();
                motion.state(0.0, &mut run.q, &mut run.u);
                return PhaseEnd::Event { after: motion.start() };
            }
            let exhausted = motion.exhausted();
            if exhausted.is_some() || !self.on_panel.panel.is_bounded() {
                if let Some((of, end)) = exhausted {
                    let time = run.time.after(motion.start()).seconds;
                    let failure = match of {
                        LawOf::Contact(contact) | LawOf::Deflection(contact) => {
                            RunFailure::Law { contact, time, end }
                        }
                        LawOf::Element(element) => match run.scene.elements()[element].contact {
                            Some(contact) => RunFailure::Law { contact, time, end },
                            None => RunFailure::Element { element, time, end },
                        },
                    };
                    return stop(run, motion, 0.0, StopReason::Failed(failure));
                }
                return stop_unbounded(run, motion.start());
            }
            self.on_panel.exact = motion.start() == 0.0;
            if self.on_panel.waiting {
                let most = if motion.is_linear() { 1.0 } else { BEFORE };
                self.on_panel.before = (motion.start() / width).min(most);
            }
            if self.on_panel.exact {
                self.begin_exactly(run, functions);
            }
            self.limits.clear();
            if bouncing {
                self.end_bounces(run, functions);
            }
            let limit = self.limits.first().map(|limit| limit.at);
            let searched = limit.map_or(end, |limit| end.min(limit));
            let begin = run.time.seconds + motion.start();
            let counters = &mut run.trajectory.counters;
            let found =
                self.on_panel.first_crossing(counters, begin, functions, searched, &self.limits);
            let until = found.map_or(searched, |(_, at)| at);
            if !self.on_panel.touches.is_empty()
                && let Some(touch) = self.report_touches(run, motion, until)
            {
                let offset = touch.time - run.time.seconds - motion.start();
                return stop(run, motion, offset.clamp(0.0, width), StopReason::Grazing);
            }
            self.triggers.clear();
            if let Some((index, at)) = found {
                let at = self.on_panel.panel.polished(index, at);
                for (other, function) in functions.iter().enumerate() {
                    if other == index || self.on_panel.vanishes(other, function.trigger, at) {
                        self.triggers.push((function.contact, function.trigger));
                    }
                }
                let exhausted = |trigger: &&(usize, EventKind)| trigger.1 == EventKind::Exhausted;
                if let Some(&(contact, _)) = self.triggers.iter().find(exhausted) {
                    let time = run.time.after(motion.start() + at * width).seconds;
                    let failure = RunFailure::Law { contact, time, end: LawEnd::Negative };
                    return stop(run, motion, at * width, StopReason::Failed(failure));
                }
                if run.scene.contacts_coupled() {
                    self.bound_gaps(run.scene.contacts.len(), functions, at);
                }
                self.state(run, motion, functions, at);
                self.exact_approach(run, functions, index, at);
                self.limits.clear();
                return PhaseEnd::Event { after: motion.start() + at * width };
            }
            if let Some(limit) = limit.filter(|&limit| limit <= end) {
                self.state(run, motion, functions, limit);
                let ended = self.limits.iter().map(|one| (one.contact, EventKind::Accumulation));
                self.triggers.extend(ended);
                return PhaseEnd::Event { after: motion.start() + limit * width };
            }
            if last {
                let offset = (remaining - motion.start()).min(width);
                return match stop(run, motion, offset, StopReason::Duration) {
                    PhaseEnd::Stop(StopReason::Duration) if run.until < run.duration => {
                        PhaseEnd::Switch
                    }
                    end => end,
                };
            }
            panels += 1;
            if panels >= most {
                most = allowed(run.time.after(motion.start() + width).seconds);
                if panels >= most {
                    return PhaseEnd::TooLong;
                }
            }
            motion.advance();
            self.on_panel.multiplicity.fill(0);
            bouncing = false;
        }
    }

    /// Series of impacts shrink without end, and superposition leaves some ulp of the whole motion in a gap. The gap and its
    /// speed at the start of a phase are known beside it.
    fn begin_exactly(&mut self, run: &RunState<'_>, functions: &[EventFunction]) {
        for (index, function) in functions.iter().enumerate() {
            if function.trigger != EventKind::Impact || self.on_panel.panel.excluded[index] {
                continue;
            }
            let law = &run.scene.contacts[function.contact];
            let c = &mut self.on_panel.panel.coefficients[index * ROW..];
            (c[0], c[1]) = (law.gap_at(&run.q), run.u[law.normal] * self.on_panel.panel.width);
            self.on_panel.panel.error[index] = self.on_panel.gap_error(index, 1.0);
        }
    }

    /// Leaves the state at s of the panel in the run, gaps by their own polynomials where these are exact.
    fn state(
        &self,
        run: &mut RunState<'_>,
        motion: &mut CoupledMotion<'_>,
        functions: &[EventFunction],
        s: f64,
    ) {
        motion.state(s * self.on_panel.panel.width, &mut run.q, &mut run.u);
        for (index, function) in functions.iter().enumerate() {
            let known = self.on_panel.exact && !self.on_panel.panel.excluded[index];
            if known && function.trigger == EventKind::Impact {
                let (gap, slope) = self
                    .on_panel
                    .unit
                    .run(ValueAndSlope(self.on_panel.panel.polynomial(index, 0), s));
                let law = &run.scene.contacts[function.contact];
                run.q[law.normal] = gap - law.gap;
                run.u[law.normal] = slope / self.on_panel.panel.width;
            }
        }
    }

    /// The gap's speed at an impact, from its own polynomial, which after a bounce has digits that the superposition of the whole
    /// motion loses.
    fn exact_approach(
        &self,
        run: &mut RunState<'_>,
        functions: &[EventFunction],
        index: usize,
        at: f64,
    ) {
        if functions[index].trigger == EventKind::Impact {
            let (_, slope) =
                self.on_panel.unit.run(ValueAndSlope(self.on_panel.panel.polynomial(index, 0), at));
            let normal = run.scene.contacts[functions[index].contact].normal;
            run.u[normal] = (slope / self.on_panel.panel.width).min(0.0);
        }
    }

    /// Finds the nearest limit of a series of bounces, and the series that end with it. Where mass couples contacts, the
    /// impacts of one are no series of its own while others bounce.
    fn end_bounces(&mut self, run: &RunState<'_>, functions: &[EventFunction]) {
        let RunState { scene, u, time, controls, .. } = run;
        let fastest = || max_norm(&u[..scene.structure()]);
        let tolerance = controls.accumulation_tolerance;
        let seconds = time.seconds;
        if let Some(limit) = self.on_panel.bounces(scene, functions, u, seconds, tolerance, fastest)
        {
            self.limits.push(limit);
            if !scene.contacts_coupled() {
                let (ulp, panel) = (time.ulp(), &self.on_panel);
                let negligible = tolerance.max(ulp);
                self.limits.extend(panel.ending_with(&limit, scene, functions, negligible, ulp));
            }
        }
    }

    /// Bounds of the errors of all gaps at `at` of the panel.
    #[cold]
    fn bound_gaps(&mut self, contacts: usize, functions: &[EventFunction], at: f64) {
        self.gaps.clear();
        self.gaps.resize(contacts, 0.0);
        for (index, function) in functions.iter().enumerate() {
            if function.trigger == EventKind::Impact {
                self.gaps[function.contact] = self.on_panel.gap_error(index, at);
            }
        }
    }

    /// Records the touches up to `until` of the panel; the first of them when the run is to stop there.
    #[cold]
    fn report_touches(
        &mut self,
        run: &mut RunState<'_>,
        motion: &CoupledMotion<'_>,
        until: f64,
    ) -> Option<Grazing> {
        let until = run.time.seconds + motion.start() + until * self.on_panel.panel.width;
        self.on_panel.touches.retain(|touch| touch.time <= until);
        self.on_panel.touches.sort_by(|a, b| a.time.total_cmp(&b.time));
        if run.controls.stop_at_grazing {
            self.on_panel.touches.truncate(1);
        }
        run.trajectory.grazings.extend_from_slice(&self.on_panel.touches);
        self.on_panel.touches.first().copied().filter(|_| run.controls.stop_at_grazing)
    }
}

fn asked_to_stop(run: &mut RunState<'_>) -> Option<StopReason> {
    let panels = run.trajectory.counters.panels;
    if (panels - run.asked) * run.scene.size < WORK_PER_QUESTION {
        return None;
    }
    run.asked = panels;
    run.controls.asked_to_stop(run.started)
}

#[cold]
fn stop(
    run: &mut RunState<'_>,
    motion: &mut CoupledMotion<'_>,
    offset: f64,
    reason: StopReason,
) -> PhaseEnd {
    motion.state(offset, &mut run.q, &mut run.u);
    // Without contacts, no event function shows that the motion has left the range of numbers.
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
#[cold]
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
