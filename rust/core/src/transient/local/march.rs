//! The run of a large sparse scene: all coordinates share panels, a queue orders the next events of all contacts, and an
//! event expands and searches again only what it reaches.

use std::collections::HashMap;
use std::sync::Arc;

use crate::contact::admissible_start::initial_departures;
use crate::contact::event_function::{EventFunction, functions_of_contact};
use crate::contact::event_kind::{EventKind, NO_CONTACT};
use crate::contact::settlement::{Departure, Series, Settlement};
use crate::contact::transition::settle;
use crate::error::input::Error;
use crate::linalg::dense::max_norm;
use crate::motion::local::field::{Field, Reset};
use crate::motion::local::locality::Kind;
use crate::motion::local::reach::Reaches;
use crate::motion::propagators::Propagators;
use crate::scene::status::Combination;
use crate::transient::clock::Clock;
use crate::transient::impact_series::record_events;
use crate::transient::local::motion::{LocalMotion, MarchStep, PanelStart};
use crate::transient::local::next_events::{COINCIDENT, Entry, NextEvents};
use crate::transient::run_state::{Controls, RunState};
use crate::transient::search::panel::{Limit, PanelSearch};
use crate::transient::trajectory::events::{Grazing, StopReason};
use crate::transient::trajectory::model::{Phase, Trajectory};

/// Events between two questions whether the run is interrupted.
const EVENTS_PER_QUESTION: usize = 64;
/// Part of a panel before its end that is not worth a restart: the event ends the panel.
const SLIVER: f64 = 1e-9;
/// How a panel ended.
enum PanelEnd {
    /// At a time after its start; the state there is that of the march.
    At(f64),
    Stop(f64, StopReason),
}

/// A run in progress.
pub(crate) struct March<'a> {
    /// Its time is the start of the panel, where (q, q') is the state; while a panel is followed, it holds the entries that the
    /// last event needed.
    pub state: RunState<'a>,
    locality: Arc<Reaches>,
    field: Field,
    settlement: Settlement,
    /// When the departures of each contact were found, s.
    departed: Vec<f64>,
    functions: Vec<Vec<EventFunction>>,
    next: NextEvents,
    search: PanelSearch,
    /// Touches at the end of a panel, by contact.
    pending: HashMap<usize, Vec<Option<Grazing>>>,
    /// Of the fastest coordinate at the start of the panel.
    speed: f64,
    motion: LocalMotion,
}

impl<'a> March<'a> {
    /// A run from (q, q') at time 0.
    pub fn new(
        propagators: &'a Arc<Propagators>,
        start: (Vec<f64>, Vec<f64>),
        combination: &Combination,
        duration: f64,
        controls: Controls<'a>,
    ) -> Result<Self, Error> {
        let locality = propagators.locality()?;
        let scene = &propagators.scene;
        let statuses = combination.statuses();
        let contacts = statuses.len();
        let mut state = RunState::new(propagators, start, duration, controls);
        state.trajectory.phases.push(Phase { start: 0.0, rest: 0.0, basis: 0 });
        Ok(Self {
            field: Field::new(scene, &locality),
            settlement: Settlement {
                statuses: statuses.to_vec(),
                departures: initial_departures(scene, combination, &state.q, &state.u),
                events: Vec::new(),
                rest: None,
            },
            departed: vec![0.0; contacts],
            functions: (0..contacts).map(|i| functions_of_contact(scene, i, combination)).collect(),
            next: NextEvents::new(contacts),
            search: PanelSearch::default(),
            pending: HashMap::new(),
            speed: 0.0,
            motion: LocalMotion::new(
                scene,
                &locality,
                combination,
                (controls.load_time, controls.kept_numbers),
            ),
            state,
            locality,
        })
    }

    /// Follows one panel; the reason if the motion ends in it.
    pub fn step(&mut self) -> Option<StopReason> {
        self.state.until = self.state.next_switch();
        let remaining = self.state.until - self.state.time.seconds;
        let end = self.panel(remaining);
        if let Some(panel) = self.motion.panels.last_mut() {
            panel.end = match end {
                PanelEnd::At(at) | PanelEnd::Stop(at, _) => at,
            };
        }
        match end {
            PanelEnd::Stop(at, reason) => {
                self.state.trajectory.end = self.state.time.after(at).seconds;
                Some(reason)
            }
            PanelEnd::At(at) if at >= remaining => {
                let RunState { trajectory, until, duration, .. } = &mut self.state;
                trajectory.end = *until;
                if until >= duration {
                    return Some(StopReason::Duration);
                }
                self.state.advance(None);
                self.switch()
            }
            PanelEnd::At(at) => {
                let pending = self.pending.values_mut().flatten().flatten();
                pending.for_each(|touch| touch.time -= at);
                self.state.advance(Some(at));
                None
            }
        }
    }

    /// The motion so far.
    pub fn into_motion(mut self) -> Trajectory {
        let last = self.motion.steps.last();
        // The last event begins a panel that there is not yet.
        if last.is_some_and(|step| step.panel == self.motion.panels.len()) {
            self.begin_panel();
        }
        let mut trajectory = self.state.trajectory;
        trajectory.counters.taylor_phases = trajectory.phases.len();
        trajectory.local = Some(self.motion);
        trajectory
    }

    fn begin_panel(&mut self) {
        let steps = self.motion.steps.len();
        self.motion.panels.push(PanelStart { clock: self.state.time, end: 0.0, steps });
        self.motion.states.push(&self.state.q, &self.state.u, &[]);
    }

    /// Follows one panel from the state of the march, for at most the time that remains.
    fn panel(&mut self, remaining: f64) -> PanelEnd {
        self.begin_panel();
        if !self.state.q.iter().chain(&self.state.u).all(|x| x.is_finite()) {
            return PanelEnd::Stop(0.0, StopReason::Unbounded);
        }
        if let Some(reason) = self.asked_to_stop() {
            return PanelEnd::Stop(0.0, reason);
        }
        self.speed = max_norm(&self.state.u[..self.state.scene.structure()]);
        self.field.begin(&self.settlement.statuses, &self.state.q, &self.state.u);
        self.state.trajectory.counters.panels += 1;
        self.next.begin_panel();
        if let Err(reason) = self.look(0.0, self.state.time.seconds, true) {
            return PanelEnd::Stop(0.0, reason);
        }
        loop {
            let horizon = self.field.end.min(remaining);
            let Some(entry) = self.next.pop(horizon) else {
                self.field.values(horizon, &mut self.state.q, &mut self.state.u);
                return PanelEnd::At(horizon);
            };
            if let Some(touch) = self.next.touch(&entry) {
                let time = self.state.time.after(touch.time).seconds;
                self.state.trajectory.grazings.push(Grazing { time, ..touch });
                if self.state.controls.stop_at_grazing {
                    return PanelEnd::Stop(entry.at, StopReason::Grazing);
                }
                continue;
            }
            if let Some(end) = self.happen(entry) {
                return end;
            }
        }
    }

    /// Looks for the next event of every contact among the coordinates expanded last, on the rest of the panel.
    fn look(&mut self, at: f64, time: f64, continues: bool) -> Result<(), StopReason> {
        self.state.trajectory.counters.expansions += self.field.expanded().len();
        for place in 0..self.field.expanded().len() {
            let k = self.field.expanded()[place];
            if let Kind::Normal(contact) = self.locality.kinds[k] {
                self.look_at(contact, at, time, continues)?;
            }
        }
        Ok(())
    }

    fn look_at(
        &mut self,
        contact: usize,
        at: f64,
        time: f64,
        continues: bool,
    ) -> Result<(), StopReason> {
        let Self { search, state: RunState { scene, u, controls, trajectory, .. }, speed, .. } =
            self;
        let functions = &self.functions[contact];
        let departure = match self.departed[contact] == time {
            true => self.settlement.departures[contact],
            false => Departure::None,
        };
        search.begin(functions.iter().map(|one| departure.multiplicity(one.trigger)));
        if !self.pending.is_empty()
            && let Some(pending) = self.pending.remove(&contact).filter(|_| continues)
        {
            (search.pending, search.waiting) = (pending, true);
        }
        self.field.functions(functions, &mut search.panel);
        if !search.panel.is_bounded() {
            return Err(StopReason::Unbounded);
        }
        let unit = self.field.unit();
        let end = ((self.field.end - at) / unit).min(1.0);
        let limit = match search.multiplicity.contains(&1) {
            true => {
                let tolerance = controls.accumulation_tolerance;
                search.bounces(scene, functions, u, time, tolerance, || *speed)
            }
            false => None,
        };
        let allowed = limit.as_ref().map_or(end, |limit| end.min(limit.at));
        let counters = &mut trajectory.counters;
        let found = search.first_crossing(counters, at, functions, allowed, limit.as_slice());
        let next = self.next.searched(contact);
        next.touches.append(&mut search.touches);
        let event = match (found, limit) {
            (Some((index, s)), _) => {
                let vanishing = functions.iter().enumerate().filter(|&(other, function)| {
                    other == index || search.vanishes(other, function.trigger, s)
                });
                for (slot, (_, function)) in next.triggers.iter_mut().zip(vanishing) {
                    *slot = Some(function.trigger);
                }
                Some((s, search.spread(index, s).min(COINCIDENT)))
            }
            (None, Some(limit)) if limit.at <= end => {
                next.triggers[0] = Some(EventKind::Accumulation);
                next.limit = Some(limit);
                Some((limit.at, 0.0))
            }
            _ => None,
        };
        if search.waiting && search.pending.iter().any(Option::is_some) {
            self.pending.insert(contact, std::mem::take(&mut search.pending));
            search.waiting = false;
        }
        let event = event.map(|(s, spread)| {
            let time = at + s * unit;
            (time, time - spread * unit)
        });
        self.next.enqueue(contact, event);
        Ok(())
    }

    /// Takes the event of an entry, with all event functions that vanish within their errors at its time.
    fn happen(&mut self, entry: Entry) -> Option<PanelEnd> {
        let at = entry.at;
        let struck = self.next.coincident(&entry, self.locality.width());
        let triggers = self.next.triggers(&struck);
        let mut among = struck;
        for &(contact, _) in triggers.iter().filter(|trigger| trigger.1 == EventKind::Impact) {
            let law = &self.state.scene.contacts[contact];
            among.extend(self.locality.contacts_felt_at_once(law.tangential));
            among.extend(self.locality.contacts_felt_at_once(law.normal));
        }
        among.sort_unstable();
        among.dedup();
        self.gather(&among, at);
        let time = self.state.time.after(at);
        let before = self.state.trajectory.phases.last().map_or(0.0, |phase| phase.start);
        if self.state.goes_in_circles(time.seconds > before) {
            return Some(PanelEnd::Stop(at, StopReason::Chattering { contact: entry.contact }));
        }
        let begins = self.field.end - at <= SLIVER * self.locality.width();
        let changed = match self.settle(time, &triggers, &among, at, begins) {
            Ok(changed) => changed,
            Err(reason) => return Some(PanelEnd::Stop(at, reason)),
        };
        if begins {
            let resets = &self.motion.steps[self.motion.steps.len() - 1].resets;
            self.field.values(at, &mut self.state.q, &mut self.state.u);
            for &Reset { coordinate, q, u } in resets {
                (self.state.q[coordinate], self.state.u[coordinate]) = (q, u);
            }
            return Some(PanelEnd::At(at));
        }
        let step = &self.motion.steps[self.motion.steps.len() - 1];
        self.field.restart(&self.settlement.statuses, &changed, &step.resets, at);
        if let Err(reason) = self.look(at, time.seconds, false) {
            return Some(PanelEnd::Stop(at, reason));
        }
        if let Some(reason) =
            self.state.controls.enough(self.state.trajectory.events.len(), time.seconds)
        {
            return Some(PanelEnd::Stop(at, reason));
        }
        let asked = self.state.trajectory.phases.len().is_multiple_of(EVENTS_PER_QUESTION);
        let reason = if asked { self.asked_to_stop() } else { None };
        reason.map(|reason| PanelEnd::Stop(at, reason))
    }

    /// Gathers (q, q') of the coordinates on which the reactions of some contacts depend.
    fn gather(&mut self, contacts: &[usize], at: f64) {
        let Self { state: RunState { scene, q, u, .. }, field, .. } = self;
        for &contact in contacts {
            let law = &scene.contacts[contact];
            for row in [law.tangential, law.normal] {
                let matrices = [&scene.stiffness, &scene.damping];
                let needed = matrices.into_iter().flat_map(|matrix| matrix.row(row));
                for k in needed.map(|entry| entry.0).chain([row]) {
                    (q[k], u[k]) = field.value(k, at);
                }
            }
        }
    }

    /// Settles contacts in the state of the march, records the changes, and returns the contacts that have changed.
    fn settle(
        &mut self,
        time: Clock,
        triggers: &[(usize, EventKind)],
        among: &[usize],
        at: f64,
        begins: bool,
    ) -> Result<Vec<usize>, StopReason> {
        let Self { state: RunState { scene, q, u, trajectory, .. }, settlement, .. } = self;
        let pairs = |contact: usize| {
            let law = &scene.contacts[contact];
            [law.tangential, law.normal]
        };
        let state = |q: &[f64], u: &[f64], contact: usize| pairs(contact).map(|k| (q[k], u[k]));
        let before: Vec<_> = among
            .iter()
            .map(|&contact| (settlement.statuses[contact], state(q, u, contact)))
            .collect();
        let (all, series) = (among.iter().copied(), Series::default());
        settle(scene, time.seconds, triggers, all, settlement, &series, q, u)
            .map_err(StopReason::Failed)?;
        let (mut changed, mut resets) = (Vec::new(), Vec::new());
        let mut combination = None;
        for (&contact, &(status, values)) in among.iter().zip(&before) {
            self.departed[contact] = time.seconds;
            let after = settlement.statuses[contact];
            let moved = state(q, u, contact) != values;
            if status != after {
                let next = || Combination::new(settlement.statuses.clone());
                let next = combination.get_or_insert_with(next);
                self.functions[contact] = functions_of_contact(scene, contact, next);
            }
            let struck = triggers.iter().any(|trigger| trigger.0 == contact);
            if struck || moved || status != after {
                changed.push(contact);
            }
            if moved {
                let reset = |k: usize| Reset { coordinate: k, q: q[k], u: u[k] };
                resets.extend(pairs(contact).map(reset));
            }
        }
        let limits: Vec<Limit> = among.iter().filter_map(|&i| self.next.limit(i)).collect();
        record_events(trajectory, time.seconds, settlement, &series, &limits);
        trajectory.phases.push(Phase { start: time.seconds, rest: time.rest, basis: 0 });
        let panel = self.motion.panels.len() - usize::from(!begins);
        let statuses = changed.iter().map(|&contact| (contact, settlement.statuses[contact]));
        let at = if begins { 0.0 } else { at };
        let statuses = statuses.collect();
        self.motion.steps.push(MarchStep { panel, at, begins, statuses, resets });
        Ok(changed)
    }

    /// Settles all contacts after a load was switched.
    fn switch(&mut self) -> Option<StopReason> {
        let all: Vec<usize> = (0..self.next.contacts()).collect();
        let triggers = [(NO_CONTACT, EventKind::Load)];
        if let Err(reason) = self.settle(self.state.time, &triggers, &all, 0.0, true) {
            return Some(reason);
        }
        let Self { state: RunState { scene, q, u, .. }, motion, .. } = self;
        let switches = scene.drive.iter().flat_map(|drive| &drive.switches);
        let resets = switches.map(|switch| switch.coordinate).map(|k| Reset {
            coordinate: k,
            q: q[k],
            u: u[k],
        });
        if let Some(step) = motion.steps.last_mut() {
            step.resets.extend(resets);
        }
        self.state.controls.enough(self.state.trajectory.events.len(), self.state.time.seconds)
    }

    fn asked_to_stop(&self) -> Option<StopReason> {
        let enough =
            self.state.controls.enough(self.state.trajectory.events.len(), self.state.time.seconds);
        enough.or_else(|| self.state.controls.asked_to_stop(self.state.started))
    }
}
