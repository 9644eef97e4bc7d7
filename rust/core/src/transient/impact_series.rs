//! Series of impacts that shrink to a limit: the ratio of their intervals, and what their limits leave out.

use crate::contact::event_kind::EventKind;
use crate::contact::settlement::{Series, Settlement};
use crate::transient::run_state::RunState;
use crate::transient::search::panel::Limit;
use crate::transient::search::phase::PhaseSearch;
use crate::transient::trajectory::events::{Accumulation, Event};
use crate::transient::trajectory::model::Trajectory;

/// Impacts of one contact over which the ratio of a series is measured, twice.
const ROUND: usize = 4;
/// Number of events, per contact, among which those impacts are looked for.
pub(crate) const SEEN: usize = 32;

/// Gap, relative to the largest displacement or deflection under the constant load, below which series of
/// impacts over several contacts are not followed. A hundred times smaller gap takes a third more events; the time at which
/// a series ends is known to the root of the gap. Where closed contacts hold all of a scene in place, displacements vanish.
const RESOLUTION: f64 = 8192.0 * f64::EPSILON;

/// Brings up to date what earlier events say about the one at the instant of the state.
pub(crate) fn look_back(series: &mut Series, state: &RunState<'_>, search: &PhaseSearch) {
    let RunState { scene, q, controls, .. } = state;
    let latest = state.trajectory.events.iter().rev();
    let at_this_time = latest.take_while(|event| event.time == state.time.seconds);
    let impacts = at_this_time.filter(|event| event.kind == EventKind::Impact);
    series.struck.clear();
    series.struck.extend(impacts.map(|event| event.contact));
    if !scene.contacts_coupled() {
        return;
    }
    let strikes = |contact| search.triggers.contains(&(contact, EventKind::Impact));
    let places = (0..scene.structure()).map(|k| match scene.stiffness.get(k, k) {
        stiffness if stiffness > 0.0 => q[k].abs().max(scene.force[k].abs() / stiffness),
        _ => q[k].abs(),
    });
    let resolution = RESOLUTION * places.fold(0.0, f64::max);
    let contacts = 0..scene.contacts.len();
    let ulp = state.time.ulp();
    *series = Series {
        struck: std::mem::take(&mut series.struck),
        resolution,
        gaps: search.gaps.iter().map(|gap| gap.max(resolution)).collect(),
        ratios: contacts.map(|contact| ratio(state, contact, strikes(contact))).collect(),
        negligible: controls.accumulation_tolerance.max(ulp),
        ulp,
    };
}

/// The ratio of successive intervals between impacts of a contact; 0 if they do not shrink. Several impacts may make up one
/// round of the series, so intervals are measured over as many impacts as there are, up to `ROUND`.
fn ratio(state: &RunState<'_>, contact: usize, struck: bool) -> f64 {
    let RunState { scene, time, trajectory, .. } = state;
    let earlier = trajectory.events.iter().rev().take(SEEN * scene.contacts.len());
    let strikes = earlier
        .take_while(|event| event.kind != EventKind::Accumulation || event.contact != contact)
        .filter(|event| event.contact == contact && event.kind == EventKind::Impact)
        .map(|event| event.time);
    let times: Vec<f64> =
        struck.then_some(time.seconds).into_iter().chain(strikes).take(2 * ROUND + 1).collect();
    let step = times.len().saturating_sub(1) / 2;
    if step == 0 {
        return 0.0;
    }
    let (last, before) = (times[0] - times[step], times[step] - times[2 * step]);
    match last / before {
        // The clock tells the impacts apart.
        ratio if ratio < 1.0 && last > time.ulp() => ratio.powf(1.0 / step as f64),
        _ => 0.0,
    }
}

/// Records the events that begin the next phase, and of those that end series of bounces what is left out.
pub(crate) fn record_events(
    trajectory: &mut Trajectory,
    time: f64,
    settlement: &Settlement,
    series: &Series,
    limits: &[Limit],
) {
    let phase = trajectory.phases.len();
    for &(contact, kind) in &settlement.events {
        let event = trajectory.events.len();
        trajectory.events.push(Event { time, contact, kind, phase });
        if kind == EventKind::Accumulation {
            let left_out = left_out(event, contact, settlement.rest, series, limits);
            trajectory.accumulations.extend(left_out);
        }
    }
}

/// What the end of a series of bounces leaves out.
#[cold]
fn left_out(
    event: usize,
    contact: usize,
    rest: Option<f64>,
    series: &Series,
    limits: &[Limit],
) -> Option<Accumulation> {
    if let Some(rest) = rest {
        let bounces = (rest / series.ulp).ln() / -series.ratios[contact].ln();
        let bounces = bounces.clamp(1.0, f64::MAX).ceil() as usize;
        return Some(Accumulation { event, bounces, error: rest });
    }
    let limit = limits.iter().find(|limit| limit.contact == contact)?;
    Some(Accumulation { event, bounces: limit.bounces, error: limit.error })
}
