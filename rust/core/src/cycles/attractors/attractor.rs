//! What a motion settles to: an equilibrium, a periodic orbit, or neither.

use std::sync::Arc;

use num_complex::Complex64;

use crate::cycles::attractors::forced::forced_recurrence;
use crate::cycles::attractors::lyapunov::{Lyapunov, Neighbour};
use crate::cycles::attractors::recurrence::Recurrence;
use crate::cycles::attractors::recurrence::recurrence;
use crate::cycles::attractors::search::Search;
use crate::error::Error;
use crate::linalg::dense::solve;
use crate::modes::complex_modes::Modes;
use crate::motion::propagators::Propagators;
use crate::scene::model::State;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::status::Status;
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::{Cursor, StopReason, Trajectory};

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
    search: Search<'_>,
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
        let controls = Controls {
            load_time: elapsed,
            cancel: search.cancel,
            // A run that begins after the deadline still takes its first steps.
            time_limit: search.remaining().map(|rest| rest.max(f64::MIN_POSITIVE)),
            ..Controls::default()
        };
        let mut run = simulate(propagators, &state, look, search.method, controls)?;
        elapsed += run.end;
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
    search: Search<'_>,
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
pub fn attractor(run: &Trajectory, search: Search<'_>) -> Option<Attractor> {
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
        false => recurrence(run, search),
    };
    found.map(|recurrence| Attractor::Cycle(Box::new(recurrence)))
}

/// Whether loads oscillate.
fn is_forced(run: &Trajectory) -> bool {
    run.scene().drive.as_ref().is_some_and(|drive| !drive.oscillators.is_empty())
}

/// Whether no event can follow: with modal deviations z from the equilibrium of the last combination,
/// an event function never falls below its value there less `sum |h_r| |z_r|`.
fn comes_to_rest(run: &Trajectory) -> bool {
    let scene = run.scene();
    // Loads that oscillate go on, and those that are yet to be switched come.
    let load_time = run.load_time();
    if is_forced(run) || scene.next_switch(load_time + run.end).is_some() {
        return false;
    }
    let Some(last) = run.phases.len().checked_sub(1) else { return false };
    let Ok(basis) = run.basis_of(last) else { return false };
    let combination = &basis.combination;
    let carried = scene
        .contacts
        .iter()
        .zip(combination.statuses())
        .any(|(law, &status)| status == Status::Sticking && law.slider_speed != 0.0);
    if carried {
        return false;
    }
    let Ok(modes) = Modes::new(scene.bare(), combination) else { return false };
    let Ok(reduced) = Reduced::new(scene, combination) else { return false };
    if modes.defective.contains(&true) || modes.eigenvalues.iter().any(|l| l.re >= 0.0) {
        return false;
    }
    let mut cursor = Cursor::new(run);
    if cursor.seek("time", run.end).is_err() {
        return false;
    }
    let (q, u) = (cursor.q, cursor.u);
    let mut force = reduced.force_constant.clone();
    for (loads, &(k, _)) in reduced.sticking_loads.iter().zip(&reduced.reduction.sticking) {
        force.iter_mut().zip(loads).for_each(|(f, load)| *f += load * q[k]);
    }
    let mut rest = q.clone();
    let solved = solve(reduced.stiffness.clone(), &force);
    let kept = &reduced.reduction.kept;
    kept.iter().zip(solved).for_each(|(&k, x)| rest[k] = x);
    let deviation: Vec<f64> =
        kept.iter().map(|&k| q[k] - rest[k]).chain(kept.iter().map(|&k| u[k])).collect();
    let z = modes.coordinates(&deviation);
    let still = vec![0.0; scene.size];
    basis.functions.iter().all(|function| {
        let functional = &function.functional;
        let reach: f64 = z
            .iter()
            .zip(modes.right.chunks_exact(reduced.size().max(1)))
            .zip(&modes.eigenvalues)
            .map(|((z, right), lambda)| {
                let part = |terms: &[(usize, f64)]| -> Complex64 {
                    terms
                        .iter()
                        .filter_map(|&(k, weight)| {
                            let j = reduced.reduction.place(k)?;
                            Some(weight * right[j])
                        })
                        .sum()
                };
                (part(&functional.position) + lambda * part(&functional.velocity)).norm() * z.norm()
            })
            .sum();
        functional.value(&rest, &still) > reach
    })
}
