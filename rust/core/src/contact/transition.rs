//! What the contacts do after an event: the one place where statuses change.

use nalgebra::DMatrix;

use crate::contact::contact_problem::{self, Closed, Solution, Unsolved};
use crate::contact::event_kind::EventKind;
use crate::error::RunFailure;
use crate::linalg::dense::solve;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// Which event function of a contact starts the next phase at zero, and with which multiplicity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Departure {
    #[default]
    None,
    /// The slip velocity: 2 after an onset of slip with mu_static = mu, else 1.
    Slip(usize),
    /// The gap: 1 after a bounce, 2 when a normal force was already negative, 3 after a release.
    Gap(usize),
}

/// Statuses and departures of all contacts, and what has happened to which at the last event.
#[derive(Debug)]
pub(crate) struct Settlement {
    pub statuses: Vec<Status>,
    pub departures: Vec<Departure>,
    /// By contact.
    pub events: Vec<(usize, EventKind)>,
    /// The longest flight, s, that a joint closing of several contacts has left out.
    pub flight: Option<f64>,
}

/// What a series of impacts over several contacts is judged by.
#[derive(Debug, Default)]
pub(crate) struct Series {
    /// Bound of the error of a gap, m.
    pub rounding: f64,
    /// Rest of the impacts of each contact, s, as far as those before tell, infinite where they do not; and the ratio
    /// of the distances of two that follow each other.
    pub rests: Vec<(f64, f64)>,
    /// The rest that may be left out, s.
    pub negligible: f64,
}

/// Settles all contacts at an event in state (q, q'), which is brought to the exact zeros that the event
/// stands for: g = 0 at an impact, slip velocity zero at the end of a slide.
///
/// `triggers` are the event functions that vanish at this instant, by contact.
pub(crate) fn settle(
    scene: &Scene,
    time: f64,
    triggers: &[(usize, EventKind)],
    settlement: &mut Settlement,
    series: &Series,
    q: &mut [f64],
    u: &mut [f64],
) -> Result<(), RunFailure> {
    settlement.flight = None;
    let mut impact = false;
    for &(contact, trigger) in triggers {
        let law = &scene.contacts[contact];
        match trigger {
            EventKind::Velocity => u[law.tangential] = law.slider_speed,
            EventKind::Impact => {
                q[law.normal] = 0.0;
                impact = true;
            }
            EventKind::Accumulation => {
                q[law.normal] = 0.0;
                u[law.normal] = 0.0;
            }
            EventKind::Release | EventKind::SlipPositive | EventKind::SlipNegative => {}
        }
    }
    settlement.events.clear();
    settlement.departures.fill(Departure::None);
    if let Some(w) = &scene.coordinates.delassus {
        let coupled = Coupled { scene, time, w: w.as_slice() };
        let (outcome, joint) = coupled.settle(triggers, &settlement.statuses, series, q, u)?;
        for (contact, (after, departure)) in outcome.into_iter().enumerate() {
            let trigger = match &joint {
                Some(joint) if joint.contacts.contains(&contact) => Some(EventKind::Accumulation),
                _ => of_contact(triggers, contact),
            };
            settlement.record(contact, trigger, after, departure);
        }
        settlement.flight = joint.map(|joint| joint.flight);
        return Ok(());
    }
    for &(contact, trigger) in triggers {
        if trigger == EventKind::Impact {
            strike(scene, contact, u);
        }
    }
    // An impact's velocity jump reaches the other contacts through the damping.
    if impact {
        for contact in 0..settlement.statuses.len() {
            let trigger = of_contact(triggers, contact);
            let before = settlement.statuses[contact];
            if trigger.is_some() || before.is_closed() {
                let (after, departure) =
                    settle_contact(scene, time, contact, trigger, before, q, u)?;
                settlement.record(contact, trigger, after, departure);
            }
        }
        return Ok(());
    }
    for (k, &(contact, _)) in triggers.iter().enumerate() {
        if k == 0 || triggers[k - 1].0 != contact {
            let trigger = of_contact(triggers, contact);
            let before = settlement.statuses[contact];
            let (after, departure) = settle_contact(scene, time, contact, trigger, before, q, u)?;
            settlement.record(contact, trigger, after, departure);
        }
    }
    Ok(())
}

impl Settlement {
    fn record(
        &mut self,
        contact: usize,
        trigger: Option<EventKind>,
        after: Status,
        departure: Departure,
    ) {
        let before = self.statuses[contact];
        self.statuses[contact] = after;
        self.departures[contact] = departure;
        let kind = match trigger {
            Some(EventKind::Impact) => EventKind::Impact,
            Some(EventKind::Accumulation) => EventKind::Accumulation,
            _ if after == before && trigger != Some(EventKind::Velocity) => return,
            _ if after == Status::Detached => EventKind::Release,
            Some(EventKind::Velocity) => EventKind::Velocity,
            _ if before == Status::Sticking && after == Status::Positive => EventKind::SlipPositive,
            _ if before == Status::Sticking && after == Status::Negative => EventKind::SlipNegative,
            // A tangential impulse that stopped or reversed a slip.
            _ => EventKind::Velocity,
        };
        self.events.push((contact, kind));
    }
}

/// The trigger that decides for a contact: a vanishing normal force before a vanishing slip velocity;
/// both cone functions of a sticking contact vanish only with its normal force.
fn of_contact(triggers: &[(usize, EventKind)], contact: usize) -> Option<EventKind> {
    let mut own = triggers.iter().filter(|trigger| trigger.0 == contact).map(|trigger| trigger.1);
    let first = own.next()?;
    Some(if own.next().is_some() { EventKind::Release } else { first })
}

/// The status and departure of an event that changes no velocity and, with mu_static = mu, no force.
fn continuous(scene: &Scene, contact: usize, trigger: EventKind) -> Option<(Status, Departure)> {
    let law = &scene.contacts[contact];
    let onset = if law.static_friction > law.friction { 1 } else { 2 };
    match trigger {
        EventKind::Release => Some((Status::Detached, Departure::Gap(3))),
        EventKind::SlipPositive => Some((Status::Positive, Departure::Slip(onset))),
        EventKind::SlipNegative => Some((Status::Negative, Departure::Slip(onset))),
        EventKind::Velocity | EventKind::Impact | EventKind::Accumulation => None,
    }
}

fn sliding_status(slip: f64) -> Option<Status> {
    match slip {
        slip if slip < 0.0 => Some(Status::Positive),
        slip if slip > 0.0 => Some(Status::Negative),
        _ => None,
    }
}

/// `g'+ = -e g'-`, and with `impact_friction` the Coulomb impulse of at most `mu p_n` that drives slip
/// towards zero; mass does not couple contact coordinates.
fn strike(scene: &Scene, contact: usize, u: &mut [f64]) {
    let law = &scene.contacts[contact];
    let approach = u[law.normal];
    u[law.normal] = -law.restitution * approach;
    if scene.impact_friction {
        let normal_mass = scene.mass.get(law.normal, law.normal);
        let tangential_mass = scene.mass.get(law.tangential, law.tangential);
        let limit = law.friction * (1.0 + law.restitution) * normal_mass * approach.abs();
        let slip = u[law.tangential] - law.slider_speed;
        if tangential_mass * slip.abs() <= limit {
            u[law.tangential] = law.slider_speed;
        } else {
            u[law.tangential] -= slip.signum() * limit / tangential_mass;
        }
    }
}

/// The velocities after contact `struck` closes its gap while the others have `statuses`.
pub(crate) fn impact(
    scene: &Scene,
    statuses: &[Status],
    struck: usize,
    q: &[f64],
    u: &mut [f64],
) -> Result<(), RunFailure> {
    let Some(w) = &scene.coordinates.delassus else {
        strike(scene, struck, u);
        return Ok(());
    };
    let closed: Vec<usize> =
        (0..statuses.len()).filter(|&i| i == struck || statuses[i].is_closed()).collect();
    Coupled { scene, time: 0.0, w: w.as_slice() }.strike(&closed, q, u)
}

/// The statuses of contacts that mass couples once all of `contacts` touch and rest in their normal directions.
pub(crate) fn at_rest(
    scene: &Scene,
    contacts: &[usize],
    q: &[f64],
    u: &[f64],
) -> Result<Vec<Status>, RunFailure> {
    let Some(w) = &scene.coordinates.delassus else { return Ok(Vec::new()) };
    let (mut q, mut u) = (q.to_vec(), u.to_vec());
    for &i in contacts {
        q[scene.contacts[i].normal] = 0.0;
        u[scene.contacts[i].normal] = 0.0;
    }
    let sliding = |i: usize| {
        let law = &scene.contacts[i];
        sliding_status(u[law.tangential] - law.slider_speed).map(Status::friction_sign)
    };
    let problem: Vec<_> = contacts.iter().map(|&i| (i, sliding(i))).collect();
    Ok(Coupled { scene, time: 0.0, w: w.as_slice() }.accelerate(&problem, &q, &u)?.statuses)
}

fn settle_contact(
    scene: &Scene,
    time: f64,
    contact: usize,
    trigger: Option<EventKind>,
    before: Status,
    q: &[f64],
    u: &[f64],
) -> Result<(Status, Departure), RunFailure> {
    let law = &scene.contacts[contact];
    if let Some(settled) = trigger.and_then(|trigger| continuous(scene, contact, trigger)) {
        return Ok(settled);
    }
    if trigger == Some(EventKind::Impact) && u[law.normal] > 0.0 {
        return Ok((Status::Detached, Departure::Gap(1)));
    }
    let normal_force = scene.reaction_value(law.normal, q, u);
    if normal_force < 0.0 {
        return Ok((Status::Detached, Departure::Gap(2)));
    }
    if let Some(status) = sliding_status(u[law.tangential] - law.slider_speed) {
        return Ok((status, Departure::None));
    }
    if law.static_friction == 0.0 {
        let status = if before.is_sliding() { before } else { Status::Positive };
        return Ok((status, Departure::None));
    }
    let required_friction = scene.reaction_value(law.tangential, q, u);
    let limit = law.static_friction * normal_force;
    if required_friction.abs() <= limit {
        Ok((Status::Sticking, Departure::None))
    } else if required_friction > limit {
        Ok((Status::Positive, Departure::Slip(1)))
    } else if required_friction < -limit {
        Ok((Status::Negative, Departure::Slip(1)))
    } else {
        Err(RunFailure::NoConsistentStatus { contact, time, normal_force, required_friction })
    }
}

/// The end of a series of impacts over several contacts.
#[derive(Debug)]
struct JointClosing {
    contacts: Vec<usize>,
    /// The longest flight that it leaves out, s.
    flight: f64,
}

/// Status and departure of every contact, and the end of a series of impacts if there is one.
type Settled = (Vec<(Status, Departure)>, Option<JointClosing>);

/// A quick bound leaves this much to what is then computed.
const MARGIN: f64 = 4.0;

/// Contacts that mass couples: one complementarity problem over all that are closed.
struct Coupled<'a> {
    scene: &'a Scene,
    time: f64,
    w: &'a [f64],
}

impl Coupled<'_> {
    fn settle(
        &self,
        triggers: &[(usize, EventKind)],
        statuses: &[Status],
        series: &Series,
        q: &mut [f64],
        u: &mut [f64],
    ) -> Result<Settled, RunFailure> {
        let contacts = &self.scene.contacts;
        let mut joint = None;
        let struck: Vec<usize> = triggers
            .iter()
            .filter(|trigger| trigger.1 == EventKind::Impact)
            .map(|trigger| trigger.0)
            .collect();
        if !struck.is_empty() {
            let closed: Vec<usize> = (0..contacts.len())
                .filter(|&i| statuses[i].is_closed() || struck.contains(&i))
                .collect();
            self.strike(&closed, q, u)?;
            joint = self.close_jointly(&struck, &closed, series, q, u)?;
        }
        let joins = |i: usize| joint.as_ref().is_some_and(|joint| joint.contacts.contains(&i));
        let mut outcome: Vec<(Status, Departure)> =
            statuses.iter().map(|&status| (status, Departure::None)).collect();
        let mut forces_jump = false;
        let mut problem: Vec<(usize, Option<f64>)> = Vec::new();
        for (i, law) in contacts.iter().enumerate() {
            let trigger = of_contact(triggers, i);
            let settled = trigger.and_then(|trigger| continuous(self.scene, i, trigger));
            if let Some(settled) = settled {
                outcome[i] = settled;
                forces_jump |= settled.0.is_sliding() && law.static_friction > law.friction;
            }
            let arrived =
                trigger == Some(EventKind::Accumulation) || struck.contains(&i) || joins(i);
            forces_jump |= trigger == Some(EventKind::Velocity) || arrived;
            let touching = statuses[i].is_closed() || arrived;
            if touching && u[law.normal] > 0.0 {
                outcome[i] = (Status::Detached, Departure::Gap(1));
            } else if touching && outcome[i].0.is_closed() || arrived {
                let sliding = match settled {
                    Some((status, _)) => Some(status),
                    None => sliding_status(u[law.tangential] - law.slider_speed),
                };
                problem.push((i, sliding.map(Status::friction_sign)));
            }
        }
        if !forces_jump || problem.is_empty() {
            return Ok((outcome, joint));
        }
        let solution = self.accelerate(&problem, q, u)?;
        for (k, &(i, sliding)) in problem.iter().enumerate() {
            let status = solution.statuses[k];
            let before = outcome[i];
            outcome[i] = match status {
                Status::Detached => (status, Departure::Gap(2)),
                Status::Sticking => (status, Departure::None),
                // An onset keeps its multiplicity; a slip that the others' jump sets off starts with s' != 0.
                _ if sliding.is_some() => (status, before.1),
                _ => (status, Departure::Slip(1)),
            };
        }
        Ok((outcome, joint))
    }

    /// The forces of contacts at rest in their normal directions.
    fn accelerate(
        &self,
        problem: &[(usize, Option<f64>)],
        q: &[f64],
        u: &[f64],
    ) -> Result<Solution, RunFailure> {
        let reactions = self.reactions(q, u);
        let size = reactions.len();
        let acceleration =
            |row: usize| -(0..size).map(|k| self.w[row * size + k] * reactions[k]).sum::<f64>();
        self.solve(problem, "accelerations", acceleration, q, u)
    }

    /// Ends a series of impacts in which contacts lift each other, by closing all of them at once.
    ///
    /// Let N be the normal forces of the contacts when all of them are closed. While they fly, their gaps move as
    /// under the constant load -N, with the kinetic energy `1/2 v' W^-1 v` of their normal velocities v, and impacts
    /// only take energy away: of `E = 1/2 v' W^-1 v + N g` nothing comes back. So no gap exceeds `E / N_i` from here
    /// on, and no flight lasts longer than `sqrt(8 E / W_ii) / N_i`. Once all gaps stay below the error to which they
    /// are known, the order of the impacts that follow is not in the numbers any more, but what they do together is:
    /// they end with g = v = 0, so that their impulses are those of N over the rest of the series and the impulse that
    /// takes v away. That one is given here, with its friction, and N acts from now on: after the rest velocities are
    /// the same, and positions differ by those gaps. The same closing takes the place of a series whose measured
    /// rest and whose flights are `negligible`.
    fn close_jointly(
        &self,
        struck: &[usize],
        closed: &[usize],
        series: &Series,
        q: &mut [f64],
        u: &mut [f64],
    ) -> Result<Option<JointClosing>, RunFailure> {
        let contacts = &self.scene.contacts;
        let size = 2 * contacts.len();
        let w = |i: usize, j: usize| self.w[(2 * i + 1) * size + 2 * j + 1];
        let resting = |i: usize, u: &[f64]| closed.contains(&i) && u[contacts[i].normal] == 0.0;
        let near = |i: usize, load: f64| {
            let (gap, speed) = (q[contacts[i].normal], u[contacts[i].normal].abs());
            let soon = series.negligible * w(i, i) * load;
            let low = gap <= series.rounding && speed * speed <= w(i, i) * load * series.rounding;
            low || gap <= soon * series.negligible && speed <= soon
        };
        let others = (0..contacts.len()).filter(|i| !struck.contains(i) && !resting(*i, u));
        if struck.len() + others.clone().count() < 2 {
            return Ok(None);
        }
        let load = MARGIN * self.reactions(q, u).chunks_exact(2).map(|r| r[1].abs()).sum::<f64>();
        let mut moving: Vec<usize> =
            (0..contacts.len()).filter(|&i| !resting(i, u) && near(i, load)).collect();
        while !moving.is_empty() && moving.iter().chain(struck).any(|i| *i != moving[0]) {
            let (mut position, mut velocity) = (q.to_vec(), u.to_vec());
            moving.iter().for_each(|&i| position[contacts[i].normal] = 0.0);
            let joined: Vec<usize> =
                (0..contacts.len()).filter(|&i| resting(i, u) || moving.contains(&i)).collect();
            joined.iter().for_each(|&i| velocity[contacts[i].normal] = 0.0);
            let problem: Vec<(usize, Option<f64>)> = joined
                .iter()
                .map(|&i| {
                    let slip = velocity[contacts[i].tangential] - contacts[i].slider_speed;
                    (i, sliding_status(slip).map(Status::friction_sign))
                })
                .collect();
            let solution = self.accelerate(&problem, &position, &velocity)?;
            let pressed: Vec<(usize, f64)> = problem
                .iter()
                .enumerate()
                .filter(|(k, _)| solution.statuses[*k].is_closed())
                .map(|(k, &(i, _))| (i, solution.forces[2 * k + 1]))
                .collect();
            let count = moving.len();
            moving.retain(|i| pressed.iter().any(|(j, _)| j == i));
            if moving.len() < count {
                continue;
            }
            let mass = DMatrix::from_fn(pressed.len(), pressed.len(), |i, j| {
                w(pressed[i].0, pressed[j].0)
            });
            let speeds: Vec<f64> = pressed.iter().map(|&(i, _)| u[contacts[i].normal]).collect();
            let momenta = solve(mass, &speeds);
            let kinetic: f64 = momenta.iter().zip(&speeds).map(|(p, v)| 0.5 * p * v).sum();
            let lifted: f64 =
                pressed.iter().map(|&(i, n)| n * q[contacts[i].normal].max(0.0)).sum();
            let energy = kinetic + lifted;
            let flight = |i: usize, n: f64| (8.0 * energy / w(i, i)).sqrt() / n;
            let ends = |&(i, n): &(usize, f64)| {
                energy <= n * series.rounding
                    || series.rests[i].0.max(flight(i, n)) <= series.negligible
            };
            let open = pressed.iter().filter(|entry| moving.contains(&entry.0) && !ends(entry));
            if let Some(&(loosest, _)) = open.min_by(|a, b| a.1.total_cmp(&b.1)) {
                moving.retain(|&i| i != loosest);
                continue;
            }
            let Some(mut held) = self.held(&problem, &solution.statuses, u) else {
                return Ok(None);
            };
            let members: Vec<(usize, f64)> = pressed
                .iter()
                .filter(|(i, _)| moving.contains(i) || struck.contains(i))
                .map(|&(i, n)| (i, flight(i, n)))
                .collect();
            let longest = members.iter().map(|member| member.1).fold(0.0, f64::max);
            // What touches and is not part of the closing is drawn onto its slider by it, and strikes it.
            let mut touching: Vec<usize> = closed.iter().chain(&joined).copied().collect();
            touching.sort_unstable();
            touching.dedup();
            if touching.iter().any(|&i| held[contacts[i].normal] < 0.0) {
                self.strike(&touching, &position, &mut held)?;
            }
            q.copy_from_slice(&position);
            u.copy_from_slice(&held);
            return Ok(Some(JointClosing {
                contacts: members.into_iter().map(|member| member.0).collect(),
                flight: longest,
            }));
        }
        Ok(None)
    }

    /// `K q + C q' - F` over (tangential, normal) of every contact.
    fn reactions(&self, q: &[f64], u: &[f64]) -> Vec<f64> {
        self.scene
            .contacts
            .iter()
            .flat_map(|law| {
                [law.tangential, law.normal].map(|row| self.scene.reaction_value(row, q, u))
            })
            .collect()
    }

    /// The velocities when the impulses that the statuses of contacts allow have taken their normal ones away; `None`
    /// where these impulses are not determined.
    fn held(
        &self,
        problem: &[(usize, Option<f64>)],
        statuses: &[Status],
        u: &[f64],
    ) -> Option<Vec<f64>> {
        let (laws, w, velocities) = self.gathered(problem, "impulses", |row| {
            let law = &self.scene.contacts[row / 2];
            match row.is_multiple_of(2) {
                true => u[law.tangential] - law.slider_speed,
                false => u[law.normal],
            }
        });
        let impulses = contact_problem::forces(&laws, &w, &velocities, statuses)?;
        let mut u = u.to_vec();
        let closed: Vec<usize> = problem.iter().map(|entry| entry.0).collect();
        self.push(&closed, &impulses, &mut u);
        for (&i, status) in closed.iter().zip(statuses).filter(|(_, status)| status.is_closed()) {
            let law = &self.scene.contacts[i];
            u[law.normal] = 0.0;
            if *status == Status::Sticking {
                u[law.tangential] = law.slider_speed;
            }
        }
        Some(u)
    }

    /// Adds to the velocities what impulses (tangential, normal) on contacts make of them.
    fn push(&self, contacts: &[usize], impulses: &[f64], u: &mut [f64]) {
        let size = 2 * self.scene.contacts.len();
        for (i, law) in self.scene.contacts.iter().enumerate() {
            for (row, coordinate) in [(2 * i, law.tangential), (2 * i + 1, law.normal)] {
                u[coordinate] += contacts
                    .iter()
                    .enumerate()
                    .map(|(k, &j)| {
                        self.w[row * size + 2 * j] * impulses[2 * k]
                            + self.w[row * size + 2 * j + 1] * impulses[2 * k + 1]
                    })
                    .sum::<f64>();
            }
        }
    }

    /// The laws of the contacts of a problem, their part of W, and `a0` of their rows.
    fn gathered(
        &self,
        problem: &[(usize, Option<f64>)],
        level: &'static str,
        a0: impl Fn(usize) -> f64,
    ) -> (Vec<Closed>, Vec<f64>, Vec<f64>) {
        let contacts = &self.scene.contacts;
        let closed = problem
            .iter()
            .map(|&(i, sliding)| Closed {
                friction: contacts[i].friction,
                static_friction: if level == "impulses" {
                    contacts[i].friction
                } else {
                    contacts[i].static_friction
                },
                sliding,
            })
            .collect();
        let rows: Vec<usize> = problem.iter().flat_map(|&(i, _)| [2 * i, 2 * i + 1]).collect();
        let size = 2 * contacts.len();
        let w = rows
            .iter()
            .flat_map(|&row| rows.iter().map(move |&column| self.w[row * size + column]))
            .collect();
        (closed, w, rows.iter().map(|&row| a0(row)).collect())
    }

    fn solve(
        &self,
        problem: &[(usize, Option<f64>)],
        level: &'static str,
        a0: impl Fn(usize) -> f64,
        q: &[f64],
        u: &[f64],
    ) -> Result<Solution, RunFailure> {
        let contacts = &self.scene.contacts;
        let (closed, w, a0) = self.gathered(problem, level, a0);
        contact_problem::solve(&closed, &w, &a0).map_err(|unsolved| RunFailure::ContactProblem {
            contacts: problem.iter().map(|entry| entry.0).collect(),
            time: self.time,
            level,
            count: match unsolved {
                Unsolved::None => "no solution",
                Unsolved::Several => "several solutions",
            },
            slip: contacts.iter().map(|law| u[law.tangential] - law.slider_speed).collect(),
            reactions: self.reactions(q, u),
        })
    }

    /// The impulses of all closed contacts with Newton restitution, `g'+ + e g'- >= 0`, and Coulomb
    /// friction on the slip velocity after the impact.
    fn strike(&self, closed: &[usize], q: &[f64], u: &mut [f64]) -> Result<(), RunFailure> {
        let contacts = &self.scene.contacts;
        let problem: Vec<(usize, Option<f64>)> = closed.iter().map(|&i| (i, None)).collect();
        let before = u.to_vec();
        let velocity = |row: usize| {
            let law = &contacts[row / 2];
            if row.is_multiple_of(2) {
                before[law.tangential] - law.slider_speed
            } else {
                (1.0 + law.restitution) * before[law.normal]
            }
        };
        let solution = self.solve(&problem, "impulses", velocity, q, &before)?;
        self.push(closed, &solution.forces, u);
        // What the impulses hold at zero is zero exactly.
        for (&i, &status) in closed.iter().zip(&solution.statuses) {
            let law = &contacts[i];
            if status.is_closed() {
                u[law.normal] = -law.restitution * before[law.normal];
            }
            if status == Status::Sticking {
                u[law.tangential] = law.slider_speed;
            }
        }
        Ok(())
    }
}
