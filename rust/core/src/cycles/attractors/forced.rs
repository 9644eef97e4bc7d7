//! Whether a motion under loads in time has become periodic: its states at whole periods of the loads are compared, as a
//! stroboscope shows them.

use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::cycles::attractors::recurrence::{
    Guess, Label, NEAR_RECURRENCE, Recurrence, condensed, labels, repeats, steps,
};
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::linearization::saltation::Passage;
use crate::cycles::orbits::orbit::{OrbitPhase, Scales};
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::sampling::Cursor;

/// Periods of the loads up to which a period of the motion is looked for.
const LONGEST: usize = 16;
/// Number of instants of a period from which the range of the motion is taken.
const PARTS: usize = 16;
/// Part of a period by which the end of a run may miss the end of its last period.
const ROUNDING: f64 = 1e-9;

/// A motion at whole periods of its loads.
struct Strobe<'a> {
    run: &'a Trajectory,
    period: f64,
    labels: Vec<Label>,
    /// What happened in each period, from the first one on.
    blocks: Vec<Vec<Label>>,
}

/// The shortest periodic orbit that the end of the run is on or approaches, in whole periods of the loads.
pub(super) fn forced_recurrence(run: &Trajectory, search: SearchLimits<'_>) -> Option<Recurrence> {
    let strobe = Strobe::new(run, run.scene().load_period().ok()??)?;
    (1..=LONGEST)
        .take_while(|_| !search.is_over())
        .filter_map(|periods| strobe.candidate(search, periods))
        // A stable orbit that the run does not yet approach is waited for.
        .next()
        .filter(|found| found.approached)
}

impl<'a> Strobe<'a> {
    fn new(run: &'a Trajectory, period: f64) -> Option<Self> {
        let count = (run.end / period + ROUNDING).floor() as usize;
        let labels = labels(run);
        let mut blocks: Vec<Vec<Label>> = vec![Vec::new(); count];
        for entry in condensed(&labels) {
            let block = (run.phases[entry.phase].start / period).floor() as usize;
            if let Some(block) = blocks.get_mut(block) {
                block.push(entry.label);
            }
        }
        // From the last switch of a load on.
        let switched = run.events.iter().rfind(|event| event.kind == EventKind::Load);
        let first = switched.map_or(0, |event| (event.time / period).ceil() as usize);
        (first < count).then(|| {
            (0..first).for_each(|block| blocks[block].clear());
            Self { run, period, labels, blocks }
        })
    }

    fn time(&self, block: usize) -> f64 {
        (block as f64 * self.period).min(self.run.end)
    }

    /// (q, q') at the start of a period.
    fn state(&self, block: usize) -> Option<Vec<f64>> {
        let mut cursor = Cursor::new(self.run);
        cursor.seek("time", self.time(block)).ok()?;
        Some([&cursor.q[..], &cursor.u].concat())
    }

    fn candidate(&self, search: SearchLimits<'_>, periods: usize) -> Option<Recurrence> {
        let (run, count) = (self.run, self.blocks.len());
        let rounds = repeats(&self.blocks).get(periods)? / periods;
        if rounds == 0 {
            return None;
        }
        let (from, to) = (self.time(count - periods), self.time(count));
        let (first, last) = (run.phase_at(from), run.phase_at(to));
        let (before, now) = (self.state(count - periods)?, self.state(count)?);
        let mut cursor = Cursor::new(run);
        let mut states = Vec::new();
        for part in 0..PARTS * periods {
            let share = part as f64 / (PARTS * periods) as f64;
            cursor.seek("time", from + share * (to - from)).ok()?;
            states.push([&cursor.q[..], &cursor.u].concat());
        }
        let scales = Scales::of(run.scene(), states.iter().map(Vec::as_slice));
        if !(scales.distance(&now, &before) < NEAR_RECURRENCE) {
            return None;
        }
        let mut sequence = match first < last {
            true => steps(run, search, &self.labels, first..last)?,
            false => Vec::new(),
        };
        let combination = run.combination_of(last).into_owned();
        let mut tail = OrbitPhase {
            passage: Passage::new(run.scene(), &combination, NO_CONTACT, EventKind::Load),
            kind: EventKind::Load,
            state: run.phase_state(last).to_vec(),
            duration: to - run.phases[last].start,
            combination,
        };
        let head = sequence.first_mut().unwrap_or(&mut tail);
        head.state.clone_from(&before);
        head.duration -= from - run.phases[first].start;
        sequence.push(tail);
        let first = self.state(count - rounds * periods)?;
        let guess = Guess { steps: sequence, load_periods: periods, scales, rounds };
        guess.recurrence(run, search, [&now, &first])
    }
}
