//! Cycles without events: contacts that slide all the time, under friction that falls and rises with slip speed, or turns in a plane.
//!
//! Such a cycle has no event at which it could begin. It is cut where the place of a contact that slides by its law or slips in a plane
//! turns back along a direction: `t . x'` passes zero downwards, as it does in every periodic motion that moves this contact.

use crate::contact::event_kind::EventKind;
use crate::cycles::attractors::recurrence::{
    Guess, NEAR_RECURRENCE, Recurrence, condensed, labels, steps,
};
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::cycle::Cycle;
use crate::cycles::orbits::orbit::{Orbit, OrbitFailure, OrbitPhase, Scales};
use crate::numerics::bracket::Bracket;
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::sampling::Cursor;

/// Number of instants of a series at which a turn is looked for, and of a period from which its range is taken.
const PARTS: usize = 4;
const RANGE: usize = 16;
/// Largest number of instants in all.
const MOST: usize = 1 << 20;
/// Longest period that is tried, in turns, and number of rounds that a period must repeat.
const LONGEST: usize = 8;
const ROUNDS: usize = 3;

/// The turns of the contact that moves most in a phase.
struct Turns<'a> {
    run: &'a Trajectory,
    flow: Flow<'a>,
    search: SearchLimits<'a>,
    contact: usize,
    /// Local time, and the state, of the last instant before each turn.
    found: Vec<(f64, Vec<f64>)>,
    width: f64,
}

impl<'a> Turns<'a> {
    fn new(run: &'a Trajectory, phase: usize, search: SearchLimits<'a>) -> Option<Self> {
        let scene = run.scene();
        let combination = run.combination_of(phase);
        // A motion that elements keep within bounds turns at every contact that slides.
        let bounded = scene.nonlinear_elements_in(&combination).next().is_some();
        let statuses = combination.statuses().iter().enumerate();
        let mut contacts: Vec<usize> = match bounded {
            true => statuses.filter(|(_, s)| s.is_sliding()).map(|(contact, _)| contact).collect(),
            false => scene.sliding_by_law(&combination).map(|(contact, _)| contact).collect(),
        };
        contacts.extend(scene.slipping_in_planes(&combination).flatten());
        if contacts.is_empty() {
            return None;
        }
        let flow = Flow::new(&run.propagators, &combination, search.method).ok()?;
        let duration = run.phase_duration(phase);
        let count = (PARTS as f64 * duration / flow.panel()?).ceil();
        if !(count <= MOST as f64) {
            return None;
        }
        let width = duration / count;
        let mut cursor = Cursor::new(run);
        let mut found: Vec<Vec<(f64, Vec<f64>)>> = vec![Vec::new(); contacts.len()];
        let mut fastest = vec![0.0f64; contacts.len()];
        let mut before: Option<(f64, Vec<f64>)> = None;
        for part in 0..=count as usize {
            if search.is_over() {
                return None;
            }
            let time = (part as f64 * width).min(duration);
            cursor.seek_local(phase, time);
            if let Some((earlier, state)) = before.take() {
                for (j, &contact) in contacts.iter().enumerate() {
                    let k = scene.contacts[contact].tangential;
                    if state[scene.size + k] > 0.0 && cursor.u[k] <= 0.0 {
                        found[j].push((earlier, state.clone()));
                    }
                    if 2 * part > count as usize {
                        fastest[j] = fastest[j].max(cursor.u[k].abs());
                    }
                }
            }
            before = Some((time, [&cursor.q[..], &cursor.u].concat()));
        }
        let best = (0..contacts.len()).max_by(|&a, &b| fastest[a].total_cmp(&fastest[b]))?;
        let found = found.swap_remove(best);
        Some(Self { run, flow, search, contact: contacts[best], found, width })
    }

    /// Local time and state of a turn.
    fn at(&self, turn: usize) -> (f64, Vec<f64>) {
        let scene = self.run.scene();
        let k = scene.size + scene.contacts[self.contact].tangential;
        let (time, before) = &self.found[turn];
        let rates = |after: f64| {
            let state = self.flow.end(before, after);
            (state[k], self.flow.field(&state)[k])
        };
        let bracket = Bracket { low: 0.0, high: self.width };
        let ends = [before[k], rates(self.width).0.min(-f64::MIN_POSITIVE)];
        let after = bracket.root(ends, 4.0 * f64::EPSILON * self.width, rates);
        (time + after, self.flow.end(before, after))
    }

    /// The orbit that closes the motion between two turns, as a guess.
    fn step(&self, turns: [usize; 2]) -> OrbitPhase {
        let [(from, state), (to, _)] = turns.map(|turn| self.at(turn));
        let (scene, combination) = (self.run.scene(), self.flow.combination().clone());
        let kind = EventKind::Turn;
        let passage = Passage::new(scene, &combination, self.contact, kind);
        OrbitPhase { combination, state, duration: to - from, passage, kind }
    }

    /// The cycle that the last turns are on or approach after `period` of them.
    fn candidate(&self, period: usize) -> Option<Recurrence> {
        let last = self.found.len() - 1;
        let rounds = last / period;
        let [(until, now), (from, before)] = [last, last - period].map(|turn| self.at(turn));
        let at = |part: usize| self.flow.end(&before, (until - from) * part as f64 / RANGE as f64);
        let scales = Scales::of(
            self.run.scene(),
            (0..RANGE).map(at).collect::<Vec<_>>().iter().map(Vec::as_slice),
        );
        if !(scales.distance(&now, &before) < NEAR_RECURRENCE) {
            return None;
        }
        let steps = vec![self.step([last - period, last])];
        let (_, first) = self.at(last - rounds * period);
        let guess = Guess { steps, load_periods: 0, scales, rounds };
        guess.recurrence(self.run, self.search, [&now, &first])
    }
}

/// The shortest cycle without events that the end of the run is on or approaches.
pub(super) fn smooth_recurrence(run: &Trajectory, search: SearchLimits<'_>) -> Option<Recurrence> {
    let turns = Turns::new(run, run.phases.len().checked_sub(1)?, search)?;
    let last = turns.found.len().checked_sub(1)?;
    (1..=LONGEST.min(last / ROUNDS))
        .take_while(|_| !search.is_over())
        .find_map(|period| turns.candidate(period))
        // A stable orbit that the run does not yet approach is waited for.
        .filter(|found| found.approached)
}

/// The cycle that Newton's method finds from the end of a run, stable or not. The guess is the motion from the last earlier
/// event that is like the last one to the last one, or between the last two turns of a run that ends without events.
pub fn closed(run: &Trajectory, search: SearchLimits<'_>) -> Result<Option<Cycle>, OrbitFailure> {
    let is_over = || search.is_over();
    let smooth = run.phases.len().checked_sub(1).and_then(|last| Turns::new(run, last, search));
    let steps = match smooth.filter(|turns| turns.found.len() > 1) {
        Some(turns) => {
            let last = turns.found.len() - 1;
            vec![turns.step([last - 1, last])]
        }
        None => {
            let labels = labels(run);
            let sequence = condensed(&labels);
            let Some(last) = sequence.last() else { return Ok(None) };
            let like = sequence.iter().rev().skip(1).find(|entry| entry.label == last.label);
            let Some(before) = like else { return Ok(None) };
            let found = steps(run, search, &labels, before.phase..last.phase);
            let Some(steps) = found else { return Ok(None) };
            steps
        }
    };
    let orbit = Orbit::solve(&run.propagators, search.method, steps, 0, &is_over)?;
    Cycle::new(orbit, &is_over).map(Some)
}
