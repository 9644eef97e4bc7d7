//! Whether a motion has become periodic: recurrence of its events, and of the states after them.
//!
//! The last events of a run are compared with themselves shifted by p = 1, 2, ... events. A recurrence is a
//! guess for Newton's method. The run has settled to the orbit found if it is on the orbit, or if the orbit is stable and
//! the run approaches it at least half as fast as the multipliers say. A run that alternates around an unstable orbit is
//! tried with 2p, and a multiplier near -1, whose alternation decays slowly, does not double the period.
//!
//! The impacts of a series that ends at its limit are one event: their number depends on rounding, and no sequence
//! that counts them would recur.

use crate::contact::event_kind::EventKind;
use crate::cycles::attractors::rotation::rotated;
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::passages::{jumps_alone, passages};
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::cycle::{Cycle, Stability};
use crate::cycles::orbits::orbit::{INSTANT, Orbit, OrbitPhase, Scales};
use crate::scene::status::Combination;
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::model::Trajectory;

/// Periods over which events must repeat.
const REPEATS: usize = 3;
/// Mismatch of a recurrence, relative to the range of the motion, up to which Newton's method is tried.
pub(super) const NEAR_RECURRENCE: f64 = 0.5;
/// Distance from an orbit at which a run is on it, whether the orbit is stable or not.
const ON: f64 = 1e-8;
/// Number of recurrences tried: the doublings of a period up to 64, or as many odd ones.
const CANDIDATES: usize = 7;
/// Phases of an orbit between two looks at whether the search is over.
const PATIENCE: usize = 16;
/// Distance of two states of one orbit that are the same one.
const SAME: f64 = 1e-6;

/// A periodic motion that a run has settled to.
#[derive(Debug)]
pub struct Recurrence {
    /// The orbit that the run has settled to, with its stability.
    pub cycle: Cycle,
    /// Distance of the end of the run from the orbit, relative to its range.
    pub distance: f64,
    pub(super) approached: bool,
}

/// What happened at the start of a phase, and its combination.
pub(super) type Label = (Vec<(usize, EventKind)>, Combination);

/// One entry of a sequence of events: the events of an instant, and the phase that begins then.
#[derive(Debug)]
pub(super) struct Entry {
    pub label: Label,
    pub phase: usize,
}

/// Phases do not recur, but what happens at their starts.
impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.label == other.label
    }
}

impl Entry {
    /// Whether a contact struck, whatever the effect on others.
    fn is_impact(&self) -> bool {
        self.label.0.iter().any(|event| event.1 == EventKind::Impact)
    }
}

/// The shortest periodic orbit that the end of the run is on or approaches.
pub fn recurrence(run: &Trajectory, search: SearchLimits<'_>) -> Option<Recurrence> {
    let labels = labels(run);
    let mut sequence = condensed(&labels);
    recurring(run, search, &labels, &sequence).or_else(|| {
        // The run may end within a series of impacts, whose limit it does not reach.
        let whole = sequence.len();
        while sequence.pop_if(|entry| entry.is_impact()).is_some() {}
        let ends_within = sequence.len() < whole;
        ends_within.then(|| recurring(run, search, &labels, &sequence)).flatten()
    })
}

fn recurring(
    run: &Trajectory,
    search: SearchLimits<'_>,
    labels: &[Label],
    sequence: &[Entry],
) -> Option<Recurrence> {
    let last = sequence.len().checked_sub(1)?;
    let repeats = repeats(sequence);
    (1..=last / REPEATS)
        .map(|period| (period, repeats[period]))
        .filter(|&(period, returns)| returns >= (REPEATS - 1) * period)
        .take(CANDIDATES)
        .take_while(|_| !search.is_over())
        .filter_map(|(period, returns)| {
            let compared = &sequence[last - returns..];
            let phases: Vec<usize> = compared.iter().map(|entry| entry.phase).collect();
            candidate(run, search, labels, &phases, period)
        })
        // A stable orbit that the run does not yet approach is waited for, not passed over for its doubling.
        .next()
        .filter(|found| found.approached)
}

/// What happened at the start of every phase but the first, and its combination.
pub(super) fn labels(run: &Trajectory) -> Vec<Label> {
    let mut labels: Vec<Label> = (1..run.phases.len())
        .map(|phase| (Vec::new(), run.combination_of(phase).into_owned()))
        .collect();
    for event in &run.events {
        labels[event.phase - 1].0.push((event.contact, event.kind));
    }
    labels
}

/// The combinations of the phases that last, neighbours that are equal once: bounces don't change them, and
/// the phases within a series of impacts don't count.
fn lasting_combinations(run: &Trajectory, period: f64) -> Vec<Combination> {
    let count = run.phases.len();
    let lasts = |k: usize| k + 1 == count || run.phase_duration(k) > INSTANT * period;
    let after = condensed(&labels(run)).into_iter().map(|entry| entry.phase);
    let mut sequence: Vec<Combination> = std::iter::once(0)
        .chain(after)
        .filter(|&k| lasts(k))
        .map(|k| run.combination_of(k).into_owned())
        .collect();
    sequence.dedup();
    sequence
}

/// The orbit behind a recurrence: `ends` are the phases at which the compared entries of the sequence begin,
/// of which the last `period` make up one round.
fn candidate(
    run: &Trajectory,
    search: SearchLimits<'_>,
    labels: &[Label],
    ends: &[usize],
    period: usize,
) -> Option<Recurrence> {
    let count = ends.len() - 1;
    let rounds = count / period;
    let (last, before) = (ends[count], ends[count - period]);
    let window = (before..=last).map(|phase| run.phase_state(phase));
    let scales = Scales::of(run.scene(), window);
    if !(scales.distance(&run.phase_state(last), &run.phase_state(before)) < NEAR_RECURRENCE) {
        return None;
    }
    let steps = steps(run, search, labels, before..last)?;
    let [now, first] = [last, ends[count - rounds * period]].map(|phase| run.phase_state(phase));
    let guess = Guess { steps, load_periods: 0, scales, rounds };
    guess.recurrence(run, search, [&now, &first])
}

/// A guess of an orbit from the end of a run that repeats itself.
pub(super) struct Guess {
    pub steps: Vec<OrbitPhase>,
    /// Periods of the loads in time; 0 without such loads.
    pub load_periods: usize,
    pub scales: Scales,
    /// How often the run repeats itself.
    pub rounds: usize,
}

impl Guess {
    /// The orbit near the guess, if the run is on it or approaches it, or may yet do so. Its states at the end and all rounds
    /// before are `now` and `first`.
    pub fn recurrence(
        self,
        run: &Trajectory,
        search: SearchLimits<'_>,
        [now, first]: [&[f64]; 2],
    ) -> Option<Recurrence> {
        let Self { steps, load_periods, scales, rounds } = self;
        let is_over = || search.is_over();
        let orbit =
            Orbit::solve(&run.propagators, search.method, steps, load_periods, &is_over).ok()?;
        let [now, first] = [now, first].map(|state| scales.distance(state, &orbit.steps[0].state));
        let backwards = |step: &OrbitPhase| step.duration < -INSTANT * orbit.period;
        if !(now < NEAR_RECURRENCE) || orbit.steps.iter().any(backwards) {
            return None;
        }
        let orbit = match load_periods {
            0 if repeats_itself(&orbit) => return None,
            0 => rotated(orbit),
            // Its section is where the period of the loads begins.
            _ => orbit,
        };
        if is_over() || !follows(&orbit, search.controls()) {
            return None;
        }
        let cycle = Cycle::new(orbit, &is_over).ok()?;
        let stable = cycle.stability == Stability::Stable;
        let rate = cycle.multipliers.largest();
        let expected = 0.5 * (1.0 + rate.powi(rounds.min(i32::MAX as usize) as i32));
        let approached = now < ON || stable && now < expected * first;
        (approached || stable).then_some(Recurrence { cycle, distance: now, approached })
    }
}

/// The phases of a range as steps of an orbit; None where they cannot be, or if the search is over.
pub(super) fn steps(
    run: &Trajectory,
    search: SearchLimits<'_>,
    labels: &[Label],
    phases: std::ops::Range<usize>,
) -> Option<Vec<OrbitPhase>> {
    let mut steps = Vec::with_capacity(phases.len());
    for phase in phases {
        if phase.is_multiple_of(PATIENCE) && search.is_over() {
            return None;
        }
        let combination = &*run.combination_of(phase);
        let start = &run.phase_state(phase)[..];
        let duration = run.phase_duration(phase);
        let flow = Flow::new(&run.propagators, combination, search.method).ok()?;
        let end = flow.end(start, duration);
        let (events, after) = &labels[phase];
        let mut jumps = events.iter().filter(|event| event.1 == EventKind::Jump);
        if !jumps.all(|event| jumps_alone(run.scene(), event.0, after)) {
            return None;
        }
        let mut found = passages(run.scene(), &flow, [start, &end], events);
        // The limit of the bounces of a contact comes before what coincides with it.
        let is_limit =
            |passage: &Passage| passage.trigger == EventKind::Accumulation && !passage.is_joint();
        if let Some(limit) = found.iter().position(is_limit) {
            found = vec![found.swap_remove(limit)];
        }
        let mut found = found.into_iter().peekable();
        let (mut combination, mut state, mut duration) =
            (combination.clone(), start.to_vec(), duration);
        while let Some(passage) = found.next() {
            let contact = passage.contact;
            let kind = match passage.is_joint() {
                true => EventKind::Accumulation,
                false => events.iter().find(|event| event.0 == contact)?.1,
            };
            let next = match found.peek() {
                Some(_) => passage.settled(run.scene(), &combination, after),
                None => after.clone(),
            };
            steps.push(OrbitPhase { combination, state, duration, passage, kind });
            // Events that coincide follow each other in no time.
            (combination, state, duration) = (next, run.phase_state(phase + 1).to_vec(), 0.0);
        }
    }
    (!steps.is_empty()).then_some(steps)
}

/// The sequence of labels in which every series of impacts up to its limit is one entry: the contacts in it, and the
/// combination after it.
pub(super) fn condensed(labels: &[Label]) -> Vec<Entry> {
    let mut sequence: Vec<Entry> = Vec::with_capacity(labels.len());
    for (k, (events, combination)) in labels.iter().enumerate() {
        let is_limit = events.iter().any(|event| event.1 == EventKind::Accumulation);
        let mut events = events.clone();
        while is_limit && let Some(before) = sequence.pop_if(|entry| entry.is_impact()) {
            events.extend(before.label.0);
        }
        if is_limit {
            events.retain(|event| matches!(event.1, EventKind::Impact | EventKind::Accumulation));
            events.iter_mut().for_each(|event| event.1 = EventKind::Accumulation);
            events.sort_unstable_by_key(|event| event.0);
            events.dedup();
        }
        sequence.push(Entry { label: (events, combination.clone()), phase: k + 1 });
    }
    sequence
}

/// Entries at the end that equal those `period` before, for every period from 0 on, in linear time: the function
/// Z of the sequence read backwards (Gusfield, Algorithms on Strings, Trees, and Sequences, 1997, section 1.3).
pub(super) fn repeats<T: PartialEq>(sequence: &[T]) -> Vec<usize> {
    let count = sequence.len();
    let entry = |back: usize| &sequence[count - 1 - back];
    let mut repeats = vec![count; count];
    // The known match that reaches furthest: entries begin..end equal the first ones.
    let (mut begin, mut end) = (0, 0);
    for period in 1..count {
        let mut equal = if period < end { repeats[period - begin].min(end - period) } else { 0 };
        while period + equal < count && entry(equal) == entry(period + equal) {
            equal += 1;
        }
        if period + equal > end {
            (begin, end) = (period, period + equal);
        }
        repeats[period] = equal;
    }
    repeats
}

/// Whether it is a shorter orbit, run through several times.
fn repeats_itself(orbit: &Orbit) -> bool {
    let count = orbit.steps.len();
    let scales = orbit.scales();
    (1..count).filter(|part| count.is_multiple_of(*part)).any(|part| {
        (0..count).all(|k| {
            let (a, b) = (&orbit.steps[k], &orbit.steps[(k + part) % count]);
            a.combination == b.combination
                && a.passage.contact == b.passage.contact
                && scales.distance(&a.state, &b.state) < SAME
        })
    })
}

/// Whether a run of one period from the orbit keeps to its sequence and comes back.
pub fn is_followed(orbit: &Orbit) -> bool {
    follows(orbit, Controls::default())
}

fn follows(orbit: &Orbit, controls: Controls<'_>) -> bool {
    let longest = (0..orbit.steps.len())
        .max_by(|&a, &b| orbit.steps[a].duration.total_cmp(&orbit.steps[b].duration));
    let Some((longest, Ok(flows))) = longest.map(|k| (k, orbit.flows())) else { return false };
    let step = &orbit.steps[longest];
    let middle = flows[longest].end(&step.state, 0.5 * step.duration);
    let state = state_of(orbit, &middle, &step.combination);
    let scene = orbit.scene();
    let begun = orbit.times()[longest].seconds + 0.5 * step.duration;
    let Ok(load_time) = scene.after_switches().map(|switched| switched + begun) else {
        return false;
    };
    let controls = Controls { load_time, ..controls };
    let run = simulate(&orbit.propagators, &state, orbit.period, orbit.method, controls);
    let Ok(run) = run else { return false };
    let mut turned = orbit.clone();
    turned.steps.rotate_left(longest);
    let Ok(expected) = turned.trajectory() else { return false };
    let (q, u) = if scene.has_massless() || scene.has_states() {
        let Ok(end) = run.coordinates(run.end) else { return false };
        end
    } else {
        let Ok(end) = run.state(run.end) else { return false };
        scene.moving_coordinates(&end.position, &end.velocity, load_time + orbit.period)
    };
    lasting_combinations(&expected, orbit.period) == lasting_combinations(&run, orbit.period)
        && orbit.scales().distance(&[q, u].concat(), &middle) < SAME
}

pub(crate) fn state_of(
    orbit: &Orbit,
    state: &[f64],
    combination: &Combination,
) -> crate::scene::model::State {
    let (q, u) = state.split_at(orbit.scene().size);
    orbit.scene().state(q, u, combination)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Few labels and a repeated end, so that long matches overlap.
        #[test]
        fn the_repeats_of_every_period_are_those_of_the_comparison_one_by_one(
            start in prop::collection::vec(0..2usize, 0..12),
            round in prop::collection::vec(0..2usize, 1..6),
            rounds in 1..6usize,
        ) {
            let contacts = start.into_iter().chain(round.iter().copied().cycle().take(rounds * round.len()));
            let combination = Combination::parse("s", 1).expect("a combination");
            let entry = |(phase, contact)| Entry {
                label: (vec![(contact, EventKind::Velocity)], combination.clone()),
                phase,
            };
            let sequence: Vec<Entry> = contacts.enumerate().map(entry).collect();
            let backwards: Vec<&Label> = sequence.iter().rev().map(|entry| &entry.label).collect();
            for (period, &found) in repeats(&sequence).iter().enumerate() {
                let pairs = backwards.iter().zip(&backwards[period..]);
                prop_assert_eq!(found, pairs.take_while(|(a, b)| a == b).count());
            }
        }
    }
}
