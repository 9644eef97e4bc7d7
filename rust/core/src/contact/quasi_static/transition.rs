//! The transitions of contacts without mass.
//!
//! Displacements and forces are continuous and only their rates change, unless static friction exceeds kinetic friction:
//! then a contact that begins to slip first jumps to its place under kinetic friction, together with all contacts that
//! follow it. Contacts on which a switched load acts jump in the same way.

use nalgebra::{DMatrix, DVector};

use crate::contact::event_kind::EventKind;
use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::{ContactProblem, Solution};
use crate::contact::settlement::{Departure, Settlement, of_contact, sliding_status};
use crate::error::run::{LawEnd, Level, RunFailure};
use crate::scene::contact_law::{Contact, Inertia};
use crate::scene::massless::coordinates::Group;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// One group at an event.
struct GroupEvent<'a> {
    scene: &'a Scene,
    group: &'a Group,
    time: f64,
}

/// Settles the contacts of a group in state (q, q'), in which velocities of coordinates without mass have no effect.
/// Returns whether forces have jumped.
pub(crate) fn settle_group(
    scene: &Scene,
    group: &Group,
    time: f64,
    triggers: &[(usize, EventKind)],
    settlement: &mut Settlement,
    q: &mut [f64],
    u: &[f64],
) -> Result<bool, RunFailure> {
    let loaded = |trigger: &(usize, EventKind)| trigger.1 == EventKind::Load;
    let switched = triggers.iter().any(loaded) && scene.switches(&group.coordinates);
    let event = GroupEvent { scene, group, time };
    let own: Vec<Option<EventKind>> =
        group.contacts.iter().map(|&contact| of_contact(triggers, contact)).collect();
    let before: Vec<Status> =
        group.contacts.iter().map(|&contact| settlement.statuses[contact]).collect();
    let onset = |k: usize| match own[k] {
        Some(EventKind::SlipPositive) => Some(Status::Positive),
        Some(EventKind::SlipNegative) => Some(Status::Negative),
        _ => None,
    };
    let law = |k: usize| &scene.contacts[group.contacts[k]];
    let excess = |k: usize| law(k).static_friction > law(k).friction;
    let slips = |k: usize| law(k).inertia == Inertia::None;
    let count = group.contacts.len();
    // Where slip follows from a law, the place is a state, and nothing jumps.
    let creeps = |k: usize| scene.creeps(group.contacts[k]);
    let opens = |k: usize| matches!(own[k], Some(EventKind::Closing | EventKind::Release));
    if let Some(k) = (0..count).find(|&k| creeps(k) && opens(k) && !event.is_apart(law(k))) {
        return Err(RunFailure::Law { contact: group.contacts[k], time, end: LawEnd::Opening });
    }
    let jumps: Vec<bool> =
        (0..count).map(|k| slips(k) && excess(k) && onset(k).is_some() && !creeps(k)).collect();
    let jump = switched || jumps.contains(&true);
    let mut statuses = before.clone();
    if jump {
        let cases = (0..count).map(|k| match (onset(k), before[k]) {
            (Some(towards), _) if jumps[k] => Case::Jumping { towards },
            (_, before) if creeps(k) && before.is_closed() => Case::Settled(Status::Sticking),
            (_, before) => Case::Beside { before },
        });
        statuses = event.jump(cases.collect(), q)?;
        if let Some(k) =
            (0..count).find(|&k| creeps(k) && statuses[k].is_closed() != before[k].is_closed())
        {
            return Err(RunFailure::Law { contact: group.contacts[k], time, end: LawEnd::Opening });
        }
    }
    let mut departing = vec![Departure::None; count];
    for k in (0..count).filter(|&k| creeps(k) && before[k].is_closed()) {
        (statuses[k], departing[k]) = event.creep(group.contacts[k], own[k], before[k], jump, q);
    }
    let cases: Vec<Case> = (0..count)
        .map(|k| {
            // Without a jump.
            let touches = matches!(own[k], Some(EventKind::Closing | EventKind::Release)) && !jump;
            let towards = match statuses[k] {
                Status::Sticking => onset(k).filter(|_| slips(k)),
                status => Some(status),
            };
            match (statuses[k], towards) {
                _ if touches => Case::Touching,
                (Status::Detached, _) => Case::Settled(Status::Detached),
                // Its velocity is given, as that of what sticks.
                _ if creeps(k) => Case::Settled(Status::Sticking),
                _ if !slips(k) => Case::Settled(Status::Positive),
                (_, Some(towards)) if law(k).static_friction > 0.0 => Case::Slipping {
                    towards,
                    at_bound: !excess(k),
                    ends: own[k] == Some(EventKind::Velocity),
                },
                (status, _) => Case::Settled(status),
            }
        })
        .collect();
    // A jump of forces or of velocities gives a slip that ends another rate.
    let impact = triggers.iter().any(|trigger| trigger.1 == EventKind::Impact);
    let ended: Option<Vec<Status>> = (!jump && !impact).then(|| {
        let goes_on = |k: usize| match before[k].is_closed() {
            true if creeps(k) => Status::Sticking,
            true if !slips(k) => Status::Positive,
            _ => before[k],
        };
        (0..count).map(goes_on).collect()
    });
    let answer = event.rates(&cases, ended.as_deref(), &statuses, q, u)?;
    for (k, &contact) in group.contacts.iter().enumerate() {
        let after = answer.statuses[k];
        if creeps(k) {
            let (status, departure) = match (cases[k], after) {
                (Case::Touching, Status::Detached) => (after, Departure::Gap(1)),
                (Case::Touching, Status::Sticking) => (after, Departure::Force(1)),
                // Slip speed and normal force would begin together.
                (Case::Touching, _) => {
                    return Err(RunFailure::Law { contact, time, end: LawEnd::Opening });
                }
                _ => (statuses[k], departing[k]),
            };
            settlement.record(contact, own[k], status, departure);
            continue;
        }
        if !slips(k) {
            // If the slip has mass, its velocity decides.
            match cases[k] {
                Case::Touching if after.is_closed() => {
                    let (status, departure) = sliding_with_mass(scene, contact, q, u);
                    settlement.record(contact, own[k], status, departure);
                }
                Case::Touching => settlement.record(contact, own[k], after, Departure::Gap(1)),
                _ if jump && before[k].is_closed() && after == Status::Detached => {
                    settlement.record(contact, own[k], after, Departure::None);
                }
                _ if jump && !before[k].is_closed() && after.is_closed() => {
                    let slip = u[law(k).tangential] - law(k).slider_speed;
                    let status = match law(k).plane {
                        Some(_) => Status::Slipping,
                        None => sliding_status(slip).unwrap_or(after),
                    };
                    let closing = Some(EventKind::Closing);
                    settlement.record(contact, closing, status, Departure::None);
                }
                _ => {}
            }
            continue;
        }
        let departure = match (cases[k], after) {
            (Case::Touching, Status::Detached) => Departure::Gap(1),
            (Case::Touching, _) => Departure::Force(1),
            (Case::Slipping { towards, at_bound: true, ends }, Status::Sticking) => {
                // Slip goes on from zero, also where others end at the same instant.
                let smooth = ends && !jump && !impact && answer.is_at_bound(k);
                Departure::Bound(towards, if smooth { 2 } else { 1 })
            }
            _ => Departure::None,
        };
        let closes = jump && !before[k].is_closed() && after.is_closed();
        let trigger = match own[k] {
            _ if jumps[k] => Some(EventKind::Jump),
            _ if closes => Some(EventKind::Closing),
            own => own,
        };
        settlement.record(contact, trigger, after, departure);
    }
    Ok(jump)
}

/// A gap that has closed without force while the slip has mass.
fn sliding_with_mass(scene: &Scene, contact: usize, q: &[f64], u: &[f64]) -> (Status, Departure) {
    let law = &scene.contacts[contact];
    if let Some(plane) = law.plane {
        let pulls = |row: usize| scene.reaction_value(row, q, u) != 0.0;
        let slips = law.static_friction == 0.0
            || law.slips_in(plane, u)
            || [law.tangential, plane.tangential].map(pulls) != [false; 2];
        return (if slips { Status::Slipping } else { Status::Sticking }, Departure::Force(1));
    }
    if let Some(status) = sliding_status(u[law.tangential] - law.slider_speed) {
        return (status, Departure::Force(1));
    }
    let required = scene.reaction_value(law.tangential, q, u);
    match sliding_status(-required) {
        Some(status) if scene.has_direction(contact) => (status, Departure::SlipAndForce),
        None if law.static_friction > 0.0 => (Status::Sticking, Departure::Force(1)),
        _ => (Status::Positive, Departure::Force(1)),
    }
}

impl GroupEvent<'_> {
    /// Displacements without contact forces, or, of velocities and without loads, the rates of these displacements; and
    /// the sums of the absolute values of their terms.
    fn free(&self, x: &[f64], load: f64) -> (DVector<f64>, DVector<f64>) {
        let Self { scene, group, .. } = self;
        let rhs = group.coordinates.iter().map(|&row| {
            let outside = scene.stiffness.row(row).filter(|entry| group.place(entry.0).is_none());
            let force = load * scene.force[row];
            outside.fold((force, force.abs()), |(sum, size), (k, value)| {
                (sum - value * x[k], size + (value * x[k]).abs())
            })
        });
        let (sums, sizes): (Vec<f64>, Vec<f64>) = rhs.unzip();
        let flexibility = &group.flexibility;
        (flexibility * DVector::from_vec(sums), flexibility.abs() * DVector::from_vec(sizes))
    }

    /// Whether a contact without mass is alone in its group and its friction force does not change its normal force: it then
    /// begins to slip as with the friction of its law at rest, `abs(a) > mu(0) N'`, since its law rises.
    fn is_apart(&self, law: &Contact) -> bool {
        self.group.coordinates.len() == 2
            && self.scene.stiffness.get(law.tangential, law.normal) == 0.0
    }

    /// Places of (tangential, normal) of each contact in the group.
    fn places(&self) -> Vec<Option<usize>> {
        let laws = self.group.contacts.iter().map(|&contact| &self.scene.contacts[contact]);
        laws.flat_map(|law| [self.group.place(law.tangential), self.group.place(law.normal)])
            .collect()
    }

    /// Status and departure of a closed contact whose slip speed follows from its friction force by a law: this force is a
    /// function of the places, which the event leaves unless others have jumped. Slip begins and ends with the slip speed zero
    /// where static friction is that of the law at rest.
    fn creep(
        &self,
        contact: usize,
        own: Option<EventKind>,
        before: Status,
        jump: bool,
        q: &[f64],
    ) -> (Status, Departure) {
        let law = &self.scene.contacts[contact];
        let smooth = law.static_friction == law.friction;
        let begins = if smooth { Departure::Slip(1) } else { Departure::None };
        match own {
            Some(EventKind::SlipPositive) => return (Status::Positive, begins),
            Some(EventKind::SlipNegative) => return (Status::Negative, begins),
            Some(EventKind::Velocity) if smooth => {
                return (Status::Sticking, Departure::Bound(before, 1));
            }
            Some(EventKind::Velocity) => return (Status::Sticking, Departure::None),
            _ if !jump => return (before, Departure::None),
            _ => {}
        }
        let still = vec![0.0; q.len()];
        let [friction, normal] =
            [law.tangential, law.normal].map(|row| self.scene.reaction_value(row, q, &still));
        let towards = if friction > 0.0 { Status::Positive } else { Status::Negative };
        let limit = if before == towards { law.friction } else { law.static_friction };
        let status = if friction.abs() > limit * normal { towards } else { Status::Sticking };
        (status, Departure::None)
    }

    fn problem(
        &self,
        cases: &[Case],
        level: Level,
        (a0, sizes): (DVector<f64>, DVector<f64>),
    ) -> ContactProblem {
        let places = self.places();
        let w = DMatrix::from_fn(places.len(), places.len(), |i, j| match (places[i], places[j]) {
            (Some(i), Some(j)) => self.group.flexibility[(i, j)],
            // A normal force that is given.
            (None, None) if i == j && i % 2 == 1 => 1.0,
            _ => 0.0,
        });
        let conditions = cases.iter().zip(&self.group.contacts).map(|(&case, &contact)| {
            let law = &self.scene.contacts[contact];
            let slips = if law.inertia == Inertia::None { 1.0 } else { 0.0 };
            Conditions {
                case,
                friction: slips * law.friction,
                static_friction: slips * law.static_friction,
                opens: law.opens(),
            }
        });
        ContactProblem { sizes, ..ContactProblem::new(conditions.collect(), level, w, a0) }
    }

    fn solve(&self, problem: &ContactProblem) -> Result<Solution, RunFailure> {
        problem.solve().map_err(|unsolved| RunFailure::QuasiStatic {
            contacts: self.group.contacts.clone(),
            time: self.time,
            level: problem.level,
            reason: unsolved.told(problem.level),
        })
    }

    /// Statuses from the rates of the forces. Under the statuses `ended` slips have come to their end; None if their rates
    /// jump.
    fn rates(
        &self,
        cases: &[Case],
        ended: Option<&[Status]>,
        statuses: &[Status],
        q: &[f64],
        u: &[f64],
    ) -> Result<Solution, RunFailure> {
        let (free, sizes) = self.free(u, 0.0);
        let contacts = self.group.contacts.iter().zip(statuses).zip(cases);
        let speed = |((&contact, &status), &case): ((&usize, &Status), &Case)| {
            let creeps = status.is_sliding() && self.scene.creeps(contact);
            match creeps && case != Case::Touching {
                true => self.scene.creep_rate(contact, status, q),
                false => self.scene.contacts[contact].slider_speed,
            }
        };
        let speeds: Vec<f64> = contacts.flat_map(|each| [speed(each), 0.0]).collect();
        let mut problem = self.problem(cases, Level::Rates, self.relative(&free, &sizes, &speeds));
        if let Some(before) = ended {
            problem.end_slips(before);
        }
        self.solve(&problem)
    }

    /// The entries of `free` at (tangential, normal) of each contact, relative to its place, and the sizes of the terms.
    fn relative(
        &self,
        free: &DVector<f64>,
        sizes: &DVector<f64>,
        from: &[f64],
    ) -> (DVector<f64>, DVector<f64>) {
        let places = self.places();
        let each = places.iter().zip(from).map(|(place, &from)| match place {
            Some(place) => (free[*place] - from, sizes[*place] + from.abs()),
            None => (0.0, 0.0),
        });
        let (a0, sizes): (Vec<f64>, Vec<f64>) = each.unzip();
        (a0.into(), sizes.into())
    }

    /// Moves the group to the place to which it jumps under kinetic friction; returns the statuses there.
    fn jump(&self, cases: Vec<Case>, q: &mut [f64]) -> Result<Vec<Status>, RunFailure> {
        let Self { scene, group, .. } = self;
        let (mut free, sizes) = self.free(q, 1.0);
        let places = self.places();
        let from = places.iter().enumerate().map(|(k, place)| match place {
            Some(place) if k % 2 == 0 => q[group.coordinates[*place]],
            _ => scene.contacts[group.contacts[k / 2]].closed(),
        });
        let (mut a0, sizes) = self.relative(&free, &sizes, &from.collect::<Vec<f64>>());
        for (k, &contact) in group.contacts.iter().enumerate() {
            if places[2 * k + 1].is_none() {
                a0[2 * k + 1] = scene.force[scene.contacts[contact].normal];
            }
        }
        let answer = self.solve(&self.problem(&cases, Level::Forces, (a0, sizes)))?;
        for (place, force) in places.iter().zip(&answer.forces) {
            if let Some(place) = place {
                free += group.flexibility.column(*place) * *force;
            }
        }
        let mut held = vec![false; group.coordinates.len()];
        for (k, &contact) in group.contacts.iter().enumerate() {
            let status = answer.statuses[k];
            if let Some(place) = places[2 * k].filter(|_| status == Status::Sticking) {
                held[place] = true;
            }
            if let Some(place) = places[2 * k + 1].filter(|_| status.is_closed()) {
                held[place] = true;
                q[scene.contacts[contact].normal] = scene.contacts[contact].closed();
            }
        }
        for (place, &coordinate) in group.coordinates.iter().enumerate().filter(|(k, _)| !held[*k])
        {
            q[coordinate] = free[place];
        }
        // A contact whose slip has mass goes on as it was.
        let statuses = answer.statuses.iter().enumerate().map(|(k, &status)| match cases[k] {
            Case::Beside { before }
                if status.is_closed() && before.is_closed() && places[2 * k].is_none() =>
            {
                before
            }
            _ => status,
        });
        Ok(statuses.collect())
    }
}
