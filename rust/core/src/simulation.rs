//! The event-driven run: phase, first event, settlement, next phase.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use crate::basis::{CombinationBasis, Wanted};
use crate::blocks;
use crate::cost::{AT_ONCE, Cost, Novelty, Rental};
use crate::error::{Error, RunFailure};
use crate::event::Trigger;
use crate::motion::Motion;
use crate::phase::{PhaseEnd, PhaseSearch};
use crate::scene::{Scene, State};
use crate::status::{Combination, Status};
use crate::trajectory::{Accumulation, Event, EventKind, Phase, StopReason, Trajectory};
use crate::transition::{Departure, Series, Settlement, settle};

/// How phases are propagated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Modes where they are well conditioned and worth their cost (see `cost.rs`), Taylor series elsewhere.
    Auto,
    Modal,
    Taylor,
}

impl Method {
    pub const fn name(self) -> &'static str {
        match self {
            Method::Auto => "auto",
            Method::Modal => "modal",
            Method::Taylor => "taylor",
        }
    }

    /// For a combination that is propagated again and again.
    pub(crate) const fn for_repeated_use(self) -> Wanted {
        match self {
            Method::Auto => Wanted::SoundModes,
            Method::Modal => Wanted::Modes,
            Method::Taylor => Wanted::Series,
        }
    }
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

impl Controls<'_> {
    fn validate(&self) -> Result<(), Error> {
        let limits = [
            ("time_limit", self.time_limit.unwrap_or(1.0), self.time_limit != Some(0.0)),
            ("accumulation_tolerance", self.accumulation_tolerance, true),
        ];
        match limits
            .into_iter()
            .find(|&(_, value, positive)| !(value >= 0.0 && value.is_finite() && positive))
        {
            Some((argument, value, _)) => Err(Error::Range {
                argument: argument.into(),
                requirement: "a finite positive time",
                value,
            }),
            None => Ok(()),
        }
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
    controls.validate()?;
    let (q, u) = scene.start_coordinates(start)?;
    if !scene.blocks().is_empty() {
        return blocks::simulate(scene, (&q, &u), &start.combination, duration, method, controls);
    }
    let mut run = Run::new(scene, (q, u), duration, method, controls);
    let mut progress = run.begin(&start.combination)?;
    let reason = loop {
        if let Some(reason) = run.step(&mut progress)? {
            break reason;
        }
    };
    run.trajectory.stop_reason = reason;
    run.trajectory.counters.phases = run.trajectory.phases.len();
    Ok(run.trajectory)
}

/// Time carried as an unevaluated sum, so that thousands of phases add no rounding to it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Clock {
    pub seconds: f64,
    pub rest: f64,
}

impl Clock {
    pub fn after(self, step: f64) -> Self {
        let sum = self.seconds + step;
        let part = sum - self.seconds;
        let rest = self.rest + ((self.seconds - (sum - part)) + (step - part));
        let seconds = sum + rest;
        Self { seconds, rest: rest - (seconds - sum) }
    }
}

/// The bound of the error of a gap adds up roundings as if all had one sign: what is left of them, about.
const UNRESOLVED: f64 = 1.0 / 64.0;
/// Impacts of one contact over which the ratio of a series is measured, twice.
const ROUND: usize = 4;
/// Events, per contact, among which those impacts are looked for.
const SEEN: usize = 32;

/// Combinations that a run looks up by comparing statuses; those met later by their hash.
const COMPARED: usize = 24;

/// A combination that a run has met.
struct Known {
    basis: Arc<CombinationBasis>,
    rental: Option<Rental>,
}

/// A run in progress.
pub(crate) struct Run<'a> {
    pub scene: &'a Arc<Scene>,
    method: Method,
    pub controls: Controls<'a>,
    pub started: Instant,
    pub duration: f64,
    pub time: Clock,
    known: Vec<Known>,
    /// Places of those from `COMPARED` on.
    places: HashMap<Combination, usize>,
    novelty: Novelty,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub trajectory: Trajectory,
}

/// What a run carries from one phase to the next beside its state.
pub(crate) struct Progress {
    /// Place of the combination among those known.
    current: usize,
    basis: Arc<CombinationBasis>,
    settlement: Settlement,
    motion: Motion,
    search: PhaseSearch,
    at_this_instant: usize,
}

impl<'a> Run<'a> {
    /// A run from (q, q') at time 0.
    pub fn new(
        scene: &'a Arc<Scene>,
        (q, u): (Vec<f64>, Vec<f64>),
        duration: f64,
        method: Method,
        controls: Controls<'a>,
    ) -> Self {
        Self {
            scene,
            method,
            controls,
            started: Instant::now(),
            duration,
            time: Clock::default(),
            known: Vec::new(),
            places: HashMap::new(),
            novelty: Novelty::default(),
            q,
            u,
            trajectory: Trajectory::new(scene),
        }
    }

    pub fn begin(&mut self, combination: &Combination) -> Result<Progress, Error> {
        let current = self.meet(combination.statuses())?;
        let basis = Arc::clone(&self.known[current].basis);
        Ok(Progress {
            current,
            settlement: Settlement {
                statuses: combination.statuses().to_vec(),
                departures: self.scene.initial_departures(combination, &self.q, &self.u),
                events: Vec::new(),
                flight: None,
            },
            motion: Motion::new(self.scene, &basis, &self.q, &self.u),
            search: PhaseSearch::default(),
            at_this_instant: 0,
            basis,
        })
    }

    /// Follows one phase and settles the event that ends it; the reason if the motion ends before.
    pub fn step(&mut self, progress: &mut Progress) -> Result<Option<StopReason>, Error> {
        let Progress { current, basis, settlement, motion, search, at_this_instant } = progress;
        let departing = settlement.departures.iter().any(|&d| d != Departure::None);
        self.trajectory.phases.push(Phase {
            start: self.time.seconds,
            rest: self.time.rest,
            basis: Arc::clone(basis),
        });
        self.trajectory.states.extend_from_slice(&self.q);
        self.trajectory.states.extend_from_slice(&self.u);
        self.trajectory.end = self.time.seconds;
        if self.controls.max_events.is_some_and(|most| self.trajectory.events.len() >= most) {
            return Ok(Some(StopReason::MaxEvents));
        }
        let departures = departing.then_some(&settlement.departures[..]);
        let grazings = self.trajectory.grazings.len();
        let after = loop {
            let panels = self.trajectory.counters.panels;
            let rental = self.known[*current].rental;
            let allowed = rental.map_or(usize::MAX, |rental| rental.panels(self.novelty));
            let end = search.follow(self, motion, basis, departures, allowed);
            if let Some(rental) = &mut self.known[*current].rental {
                rental.add(self.trajectory.counters.panels - panels);
            }
            let taylor = usize::from(!basis.is_modal());
            match end {
                PhaseEnd::Event { after } => {
                    self.trajectory.counters.taylor_phases += taylor;
                    break after;
                }
                PhaseEnd::Stop(reason) => {
                    self.trajectory.counters.taylor_phases += taylor;
                    return Ok(Some(reason));
                }
                // Once more from its start, by modes.
                PhaseEnd::TooLong => {
                    *basis = match self.meet(&settlement.statuses) {
                        Ok(place) => Arc::clone(&self.known[place].basis),
                        Err(error) => {
                            return Ok(Some(StopReason::Failed(RunFailure::Input(error))));
                        }
                    };
                    if let Some(phase) = self.trajectory.phases.last_mut() {
                        phase.basis = Arc::clone(basis);
                    }
                    self.trajectory.grazings.truncate(grazings);
                    motion.restart(basis, &self.q, &self.u);
                }
            }
        };
        let before = self.time.seconds;
        self.time = self.time.after(after);
        *at_this_instant = if self.time.seconds > before { 0 } else { *at_this_instant + 1 };
        // Each contact can pass each status once; more means that the event rule goes in circles.
        if *at_this_instant > 4 * self.scene.contacts.len() + 4 {
            let contact = search.triggers[0].0;
            return Ok(Some(self.ended_at_event(StopReason::Chattering { contact })));
        }
        let series = match self.scene.contacts_coupled() {
            true => self.series(search),
            false => Series::default(),
        };
        let settled = settle(
            self.scene,
            self.time.seconds,
            &search.triggers,
            settlement,
            &series,
            &mut self.q,
            &mut self.u,
        );
        if let Err(failure) = settled {
            return Ok(Some(self.ended_at_event(StopReason::Failed(failure))));
        }
        // An event is part of the motion once the phase that it begins can be propagated.
        let returns = settlement.statuses == basis.combination.statuses();
        let novelty = self.novelty;
        if !returns || self.known[*current].rental.is_some_and(|rental| rental.is_over(novelty)) {
            *current = match self.meet(&settlement.statuses) {
                Ok(current) => current,
                Err(error) => {
                    let failure = StopReason::Failed(RunFailure::Input(error));
                    return Ok(Some(self.ended_at_event(failure)));
                }
            };
            *basis = Arc::clone(&self.known[*current].basis);
        }
        let phase = self.trajectory.phases.len();
        let time = self.time.seconds;
        self.count_accumulations(settlement, &series);
        self.trajectory.events.extend(settlement.events.iter().map(|&(contact, kind)| Event {
            time,
            contact,
            kind,
            phase,
        }));
        motion.restart(basis, &self.q, &self.u);
        Ok(None)
    }

    /// Ends the motion just before the event in progress, which no phase can follow.
    fn ended_at_event(&mut self, reason: StopReason) -> StopReason {
        let Trajectory { events, accumulations, end, .. } = &mut self.trajectory;
        *end = self.time.seconds;
        accumulations.retain(|limit| limit.event < events.len());
        reason
    }

    /// How far a series of impacts over several contacts has come.
    fn series(&self, search: &PhaseSearch) -> Series {
        let time = self.time.seconds;
        let struck = |contact| search.triggers.contains(&(contact, Trigger::GapClosed));
        Series {
            rounding: UNRESOLVED * search.error,
            rests: (0..self.scene.contacts.len())
                .map(|contact| self.rest(contact, struck(contact)))
                .collect(),
            negligible: self.controls.accumulation_tolerance.max(time.next_up() - time),
        }
    }

    /// The rest, s, of the impacts of a contact as a geometric series through the last ones, and the ratio of two
    /// impacts that follow each other; infinite and 0 where their distances do not shrink. Several impacts of a contact
    /// may make up one round of the series, so distances are measured over as many as there are, up to `ROUND`.
    fn rest(&self, contact: usize, struck: bool) -> (f64, f64) {
        let earlier = self.trajectory.events.iter().rev().take(SEEN * self.scene.contacts.len());
        let strikes = earlier
            .take_while(|event| event.kind != EventKind::Accumulation || event.contact != contact)
            .filter(|event| event.contact == contact && event.kind == EventKind::Impact)
            .map(|event| event.time);
        let times: Vec<f64> = struck
            .then_some(self.time.seconds)
            .into_iter()
            .chain(strikes)
            .take(2 * ROUND + 1)
            .collect();
        let step = times.len().saturating_sub(1) / 2;
        if step == 0 {
            return (f64::INFINITY, 0.0);
        }
        let (last, before) = (times[0] - times[step], times[step] - times[2 * step]);
        match last / before {
            ratio if ratio < 1.0 => (last * ratio / (1.0 - ratio), ratio.powf(1.0 / step as f64)),
            _ => (f64::INFINITY, 0.0),
        }
    }

    /// Writes down what the accumulations among the events to come have left out.
    fn count_accumulations(&mut self, settlement: &Settlement, series: &Series) {
        let first = self.trajectory.events.len();
        let limits = settlement.events.iter().enumerate();
        let limits = limits.filter(|(_, event)| event.1 == EventKind::Accumulation);
        let Some(flight) = settlement.flight else {
            // Of one contact: other contacts may have events at the same instant.
            for (k, _) in limits {
                if let Some(limit) = self.trajectory.accumulations.last_mut() {
                    limit.event = first + k;
                }
            }
            return;
        };
        let time = self.time.seconds;
        for (k, &(contact, _)) in limits {
            let (rest, ratio) = series.rests[contact];
            let error = if rest.is_finite() { rest } else { flight };
            let bounces = (error / (time.next_up() - time)).ln() / -ratio.ln();
            self.trajectory.accumulations.push(Accumulation {
                event: first + k,
                bounces: bounces.clamp(1.0, f64::MAX).ceil() as usize,
                error,
            });
        }
    }

    /// The place of a combination among those known, with the basis that the phase to come is to have.
    fn meet(&mut self, statuses: &[Status]) -> Result<usize, Error> {
        let compared = self.known.iter().take(COMPARED);
        let place = compared
            .map(|known| known.basis.combination.statuses())
            .position(|known| known == statuses)
            .or_else(|| match self.places.is_empty() {
                true => None,
                false => self.places.get(&Combination::new(statuses.to_vec())).copied(),
            });
        self.novelty.count(place.is_none());
        if let Some(place) = place {
            if self.known[place].rental.is_some_and(|rental| rental.is_over(self.novelty)) {
                let combination = self.known[place].basis.combination.clone();
                let basis = self.find(&combination, Wanted::SoundModes)?;
                self.known[place] = Known { basis, rental: None };
            }
            return Ok(place);
        }
        let combination = Combination::new(statuses.to_vec());
        let free = self.scene.free(&combination);
        let renting = self.method == Method::Auto && free > AT_ONCE;
        let wanted = if renting { Wanted::Series } else { self.method.for_repeated_use() };
        let basis = self.find(&combination, wanted)?;
        let rental = renting.then(|| Rental::new(Cost::new(self.scene, free)));
        let place = self.known.len();
        self.known.push(Known { basis, rental });
        if place >= COMPARED {
            self.places.insert(combination, place);
        }
        Ok(place)
    }

    fn find(
        &mut self,
        combination: &Combination,
        wanted: Wanted,
    ) -> Result<Arc<CombinationBasis>, Error> {
        let (basis, computed) = self.scene.basis(combination, wanted)?;
        self.trajectory.counters.combinations += usize::from(computed);
        Ok(basis)
    }
}
