//! What a motion settles to: an equilibrium, a periodic orbit, or neither.

use std::sync::Arc;

use crate::cycles::attractors::forced::forced_recurrence;
use crate::cycles::attractors::lyapunov::{Lyapunov, Neighbour};
use crate::cycles::attractors::recurrence::Recurrence;
use crate::cycles::attractors::recurrence::recurrence;
use crate::cycles::attractors::rest::{comes_to_rest, is_forced};
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::attractors::smooth::smooth_recurrence;
use crate::error::input::Error;
use crate::motion::propagators::Propagators;
use crate::scene::model::State;
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::model::Trajectory;

/// Chaotic: a perturbation grows by more than e^CHAOS over the second half of the observed time.
const CHAOS: f64 = 12.0;
/// Each further run is this many times as long as all before it ...
const LONGER: f64 = 0.5;
/// ... but at most this many times as long as the first, so that it fits into memory.
const LONGEST: f64 = 32.0;
/// Least length of a look in periods of the loads in time.
const PERIODS: f64 = 16.0;
/// Number of standard errors by which the growth rate must exceed zero in chaos.
const CERTAIN: f64 = 4.0;

/// Where a motion ends up.
#[derive(Debug)]
pub enum Attractor {
    /// Rest or steady sliding: every mode of the combination decays and no event function can reach zero.
    Equilibrium,
    /// A periodic orbit.
    Cycle(Box<Recurrence>),
    /// No recurrence within the motion looked at.
    Aperiodic(Lyapunov),
    /// The motion grew beyond the range of numbers.
    Unbounded,
    /// The run could not go on, for the reason its trajectory states.
    Stopped,
}

/// Follows the motion from `start` until it is known what it settles to; with its last stretch.
pub fn settle(
    propagators: &Arc<Propagators>,
    start: &State,
    search: SearchLimits<'_>,
) -> Result<(Attractor, Trajectory), Error> {
    let mut elapsed = 0.0;
    let mut neighbour: Option<Neighbour> = None;
    let mut state = start.clone();
    let period = propagators.moving().load_period()?;
    loop {
        // A recurrence shows within one look only: long periods need long ones.
        let longer = (LONGER * elapsed).min(LONGEST * search.stretch);
        let look = search.stretch.max(longer.min(search.limit - elapsed));
        // Under loads in time a look begins and ends at the same phase of theirs.
        let look = period.map_or(look, |period| (look / period).ceil().max(PERIODS) * period);
        let controls = Controls { load_time: elapsed, ..search.controls() };
        let mut run = simulate(propagators, &state, look, search.method, controls)?;
        elapsed += run.end;
        if let Some(cancel) = search.cancel {
            cancel.tell_followed(elapsed);
        }
        if let Some(attractor) = attractor(&run, search) {
            return Ok((attractor, run));
        }
        if neighbour.is_none() && meets_events(&run) {
            neighbour = Some(Neighbour::new(&run));
        }
        if let Some(neighbour) = &mut neighbour {
            neighbour.follow(&run, search)?;
        }
        if search.is_cancelled() {
            run.stop_reason = StopReason::Interrupted;
            return Ok((Attractor::Stopped, run));
        }
        let growth = neighbour.as_ref().map_or(Lyapunov::UNKNOWN, Neighbour::growth);
        let Lyapunov { exponent, error, time } = growth;
        let is_chaotic = exponent * time > CHAOS && exponent > CERTAIN * error;
        if search.remaining() == Some(0.0) {
            run.stop_reason = StopReason::TimeLimit;
        }
        if is_chaotic || elapsed >= search.limit || run.stop_reason == StopReason::TimeLimit {
            return Ok((Attractor::Aperiodic(growth), run));
        }
        state = run.state(run.end)?;
    }
}

/// The attractor of the run, found from its own end or from the motion that follows, whose last stretch is returned too.
pub fn settled_from(
    run: &Trajectory,
    search: SearchLimits<'_>,
) -> Result<(Attractor, Option<Trajectory>), Error> {
    if let Some(attractor) = attractor(run, search) {
        return Ok((attractor, None));
    }
    if !(search.limit > 0.0) {
        if !meets_events(run) {
            return Ok((Attractor::Aperiodic(Lyapunov::UNKNOWN), None));
        }
        let mut neighbour = Neighbour::new(run);
        neighbour.follow(run, search)?;
        return Ok((Attractor::Aperiodic(neighbour.growth()), None));
    }
    // The motion that follows begins anew: the loads are those of the start.
    let (attractor, run) = match run.propagators.moving().drive {
        Some(_) => settle(&run.propagators, &run.state(0.0)?, search)?,
        None => settle(&run.propagators, &run.state(run.end)?, search)?,
    };
    Ok((attractor, Some(run)))
}

/// Whether events begin in the first half of the run: before the first event neighbours grow by the modes of one combination,
/// which says nothing about the attractor.
fn meets_events(run: &Trajectory) -> bool {
    run.events.first().is_some_and(|event| event.time <= 0.5 * run.end)
}

/// The attractor of the run, if its end shows it.
pub fn attractor(run: &Trajectory, search: SearchLimits<'_>) -> Option<Attractor> {
    match run.stop_reason {
        StopReason::Unbounded => return Some(Attractor::Unbounded),
        StopReason::Failed(_) | StopReason::Chattering { .. } | StopReason::Interrupted => {
            return Some(Attractor::Stopped);
        }
        _ => {}
    }
    if comes_to_rest(run) {
        return Some(Attractor::Equilibrium);
    }
    let found = match is_forced(run) {
        true => forced_recurrence(run, search),
        false => smooth_recurrence(run, search).or_else(|| recurrence(run, search)),
    };
    found.map(|recurrence| Attractor::Cycle(Box::new(recurrence)))
}
