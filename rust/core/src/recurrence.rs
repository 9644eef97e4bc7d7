//! Whether a motion has become periodic: recurrence of its events, and of the states after them.
//!
//! The last events of a run are compared with themselves shifted by p = 1, 2, ... events. A recurrence is a
//! guess for Newton's method; the orbit found is what the run settles to if the run is on it, or if the orbit is
//! stable and the run approaches it by at least half of what the multipliers say. A run that alternates around an unstable orbit goes on to 2p, and a
//! multiplier near -1, whose alternation dies slowly, does not double the period.

use crate::attractor::Search;
use crate::cycle::Cycle;
use crate::flow::Flow;
use crate::orbit::{INSTANT, Multipliers, Orbit, Scales, Step};
use crate::saltation::passages;
use crate::simulation::{Controls, Method, simulate};
use crate::status::Combination;
use crate::trajectory::{EventKind, Trajectory};

/// Periods over which events must repeat.
const REPEATS: usize = 3;
/// Mismatch of a recurrence, relative to the range of the motion, up to which Newton's method is tried.
const NEAR: f64 = 0.5;
/// Distance from an orbit at which a run is on it, whether the orbit is stable or not.
const ON: f64 = 1e-8;
/// Recurrences tried: the doublings of a period up to 64, or as many odd ones.
const CANDIDATES: usize = 7;
/// Distance of two states of one orbit that are the same one.
const SAME: f64 = 1e-6;

/// A periodic motion that a run has settled to.
#[derive(Debug)]
pub struct Recurrence {
    pub cycle: Cycle,
    /// Distance of the end of the run from the orbit, relative to its range.
    pub distance: f64,
    approached: bool,
}

type Label = (Vec<(usize, EventKind)>, Combination);

impl Trajectory {
    /// The shortest periodic orbit that the end of the run is on or approaches.
    pub fn recurrence(&self, search: Search<'_>) -> Option<Recurrence> {
        let labels = self.labels();
        let last = labels.len().checked_sub(1)?;
        (1..=last / REPEATS)
            .map(|period| (period, repeats(&labels, period)))
            .filter(|&(period, returns)| returns >= (REPEATS - 1) * period)
            .take(CANDIDATES)
            .take_while(|_| !search.is_interrupted())
            .filter_map(|(period, returns)| {
                self.candidate(search.method, &labels, period, returns / period)
            })
            // A stable orbit that the run does not yet approach is waited for, not passed over for its doubling.
            .next()
            .filter(|found| found.approached)
    }

    /// What happened at the start of every phase but the first, and its combination.
    fn labels(&self) -> Vec<Label> {
        let mut labels: Vec<Label> = self
            .phases
            .iter()
            .skip(1)
            .map(|phase| (Vec::new(), phase.basis.combination.clone()))
            .collect();
        for event in &self.events {
            labels[event.phase - 1].0.push((event.contact, event.kind));
        }
        labels
    }

    fn whole_state(&self, phase: usize) -> &[f64] {
        let size = 2 * self.scene.size;
        &self.states[size * phase..size * (phase + 1)]
    }

    fn candidate(
        &self,
        method: Method,
        labels: &[Label],
        period: usize,
        returns: usize,
    ) -> Option<Recurrence> {
        let last = labels.len();
        let window = (last - period..=last).map(|phase| self.whole_state(phase));
        let scales = Scales::of(self.scene.size, window);
        if !(scales.distance(self.whole_state(last), self.whole_state(last - period)) < NEAR) {
            return None;
        }
        let steps = self.steps(method, labels, last - period..last)?;
        let orbit = Orbit::solve(&self.scene, method, steps).ok()?;
        let distance =
            |phase: usize| scales.distance(self.whole_state(phase), &orbit.steps[0].state);
        let (now, first) = (distance(last), distance(last - returns * period));
        if !(now < NEAR) || orbit.steps.iter().any(|step| step.duration < -INSTANT * orbit.period) {
            return None;
        }
        if orbit.repeats_itself() || !orbit.is_followed() {
            return None;
        }
        let cycle = Cycle::new(orbit.rotated()).ok()?;
        let stable = cycle.multipliers.is_stable();
        let rate = cycle.multipliers.transverse.iter().map(|m| m.norm()).fold(0.0, f64::max);
        let expected = 0.5 * (1.0 + rate.powi(returns.min(i32::MAX as usize) as i32));
        let approached = now < ON || stable && now < expected * first;
        (approached || stable).then_some(Recurrence { cycle, distance: now, approached })
    }

    /// The phases of a range as steps of an orbit.
    fn steps(
        &self,
        method: Method,
        labels: &[Label],
        phases: std::ops::Range<usize>,
    ) -> Option<Vec<Step>> {
        let mut steps = Vec::with_capacity(phases.len());
        for phase in phases {
            let combination = &self.phases[phase].basis.combination;
            let start = self.whole_state(phase);
            let duration = self.phase_duration(phase);
            let flow = Flow::new(&self.scene, combination, method).ok()?;
            let end = flow.end(start, duration);
            let (events, after) = &labels[phase];
            let mut found = passages(&self.scene, combination, &end, events).into_iter().peekable();
            let (mut combination, mut state, mut duration) =
                (combination.clone(), start.to_vec(), duration);
            while let Some(passage) = found.next() {
                let contact = passage.contact;
                let kind = events.iter().find(|event| event.0 == contact)?.1;
                let next = match found.peek() {
                    Some(_) => combination.with(contact, after.statuses()[contact]),
                    None => after.clone(),
                };
                steps.push(Step { combination, state, duration, passage, kind });
                // Events that coincide follow each other in no time.
                (combination, state, duration) = (next, self.whole_state(phase + 1).to_vec(), 0.0);
            }
        }
        (!steps.is_empty()).then_some(steps)
    }
}

/// Labels at the end that equal those `period` before.
fn repeats(labels: &[Label], period: usize) -> usize {
    let last = labels.len();
    (0..last - period)
        .take_while(|&back| labels[last - 1 - back] == labels[last - 1 - back - period])
        .count()
}

/// A sequence in which bounces, which leave the combination as it is, don't count: their number depends on
/// when the limit of a series of them is taken.
fn same_but_bounces(mut sequence: Vec<&Combination>) -> Vec<&Combination> {
    sequence.dedup();
    sequence
}

impl Multipliers {
    /// Whether every neighbour returns.
    pub fn is_stable(&self) -> bool {
        self.transverse.iter().all(|value| value.norm() < 1.0)
    }
}

impl Orbit {
    /// Whether it is a shorter orbit, run through several times.
    fn repeats_itself(&self) -> bool {
        let count = self.steps.len();
        let scales = self.scales();
        (1..count).filter(|part| count.is_multiple_of(*part)).any(|part| {
            (0..count).all(|k| {
                let (a, b) = (&self.steps[k], &self.steps[(k + part) % count]);
                a.combination == b.combination
                    && a.passage.contact == b.passage.contact
                    && scales.distance(&a.state, &b.state) < SAME
            })
        })
    }

    /// Whether a run of one period from the orbit keeps to its sequence and comes back.
    pub fn is_followed(&self) -> bool {
        let longest = (0..self.steps.len())
            .max_by(|&a, &b| self.steps[a].duration.total_cmp(&self.steps[b].duration));
        let Some((longest, Ok(flows))) = longest.map(|k| (k, self.flows())) else { return false };
        let step = &self.steps[longest];
        let middle = flows[longest].end(&step.state, 0.5 * step.duration);
        let state = self.state_of(&middle, &step.combination);
        let Ok(run) = simulate(&self.scene, &state, self.period, self.method, Controls::default())
        else {
            return false;
        };
        let lasting = |k: &usize| self.lasts(*k);
        let expected: Vec<&Combination> = (0..=self.steps.len())
            .map(|k| (longest + k) % self.steps.len())
            .filter(lasting)
            .map(|k| &self.steps[k].combination)
            .collect();
        let met: Vec<&Combination> = (0..run.phases.len())
            .filter(|&k| k + 1 == run.phases.len() || run.phase_duration(k) > INSTANT * self.period)
            .map(|k| &run.phases[k].basis.combination)
            .collect();
        let Ok(end) = run.state(run.end) else { return false };
        let (q, u) = self.scene.to_coordinates(&end.position, &end.velocity);
        same_but_bounces(expected) == same_but_bounces(met)
            && self.scales().distance(&[q, u].concat(), &middle) < SAME
    }

    pub(crate) fn state_of(&self, state: &[f64], combination: &Combination) -> crate::scene::State {
        let (q, u) = state.split_at(self.scene.size);
        crate::scene::State {
            position: self.scene.positions(q),
            velocity: self.scene.velocities(u),
            combination: combination.clone(),
        }
    }

    /// The same orbit from the section at which its combinations come first in the alphabet.
    fn rotated(mut self) -> Self {
        let count = self.steps.len();
        let names: Vec<String> =
            self.steps.iter().map(|step| step.combination.to_string()).collect();
        let rotation = |first: usize| (0..count).map(move |k| (first + k) % count);
        let best = (0..count)
            .filter(|&k| self.lasts(k))
            .min_by(|&a, &b| {
                let sequence = |first| rotation(first).map(|k| names[k].as_str());
                sequence(a).cmp(sequence(b)).then_with(|| {
                    let durations = |first| rotation(first).map(|k| self.steps[k].duration);
                    durations(b).partial_cmp(durations(a)).unwrap_or(std::cmp::Ordering::Equal)
                })
            })
            .unwrap_or_default();
        self.steps.rotate_left(best);
        self
    }
}
