//! Contacts that mass couples: impulses and forces from one complementarity problem over all that touch.

use nalgebra::{DMatrix, DVector};

use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::{ContactProblem, Solution};
use crate::contact::settlement::sliding_status;
use crate::error::run::{Level, RunFailure};
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// A contact of a problem, and its status where it slips; `None` where slip is zero.
pub(crate) type Touching = (usize, Option<Status>);

/// Number of impacts that follow each other at one instant before one impact takes the rest of them.
const ROUNDS: usize = 64;
/// Part of its terms below which the rate of a slip velocity is rounding: the start of slip is a root known to rounding.
const AT_REST: f64 = 1e-9;

/// Part of the changes by single impulses below which their sum is rounding.
const CANCELLED: f64 = 1e-12;
/// Part of the changes that impulses could cause at most, `sqrt(W_rr W_kk) p_k`, below which a change is their rounding.
const ROUNDED: f64 = 64.0 * f64::EPSILON;

/// Contacts brought to rest in their normal directions, and the forces that they then have.
pub(crate) struct Resting {
    pub position: Vec<f64>,
    pub problem: Vec<Touching>,
    pub solution: Solution,
}

/// Contacts that mass couples: one complementarity problem over all that are closed.
pub(crate) struct Coupled<'a> {
    pub scene: &'a Scene,
    pub time: f64,
    /// `D' M^-1 D` over (tangential, normal) of every contact.
    pub w: &'a DMatrix<f64>,
}

/// The rows (tangential, normal) of the contacts of a problem.
fn rows(problem: &[Touching]) -> impl Iterator<Item = usize> {
    problem.iter().flat_map(|&(i, _)| [2 * i, 2 * i + 1])
}

impl Coupled<'_> {
    /// The forces of contacts at rest in their normal directions.
    pub fn accelerate(
        &self,
        problem: &[Touching],
        q: &[f64],
        u: &[f64],
    ) -> Result<Solution, RunFailure> {
        let reactions = self.reactions(q, u);
        let acceleration = |row: usize| self.accelerations(row, q, &reactions).sum();
        let mut gathered = self.gathered(problem, Level::Accelerations, acceleration, u);
        for (carried, row) in gathered.carried.iter_mut().zip(rows(problem)) {
            let terms = self.carried(row, q);
            *carried = terms.fold([0.0, 0.0], |[sum, size], a| [sum + a, size + a.abs()]);
        }
        self.solve(&gathered, problem, Level::Accelerations, q, u)
    }

    /// The rate that the forces of a solution leave the slip velocity of a contact, m/s^2; 0 within the rounding of its terms.
    pub fn slip_rate(
        &self,
        contact: usize,
        problem: &[Touching],
        solution: &Solution,
        q: &[f64],
        u: &[f64],
    ) -> f64 {
        let row = 2 * contact;
        let pushed = rows(problem).zip(&solution.forces).map(|(k, force)| self.w[(row, k)] * force);
        let reactions = self.reactions(q, u);
        let terms = self.accelerations(row, q, &reactions).chain(pushed);
        let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), a| (sum + a, size + a.abs()));
        if sum.abs() > AT_REST * size { sum } else { 0.0 }
    }

    /// The terms of the acceleration that a row (tangential, normal) has without contact forces.
    fn accelerations(&self, row: usize, q: &[f64], reactions: &[f64]) -> impl Iterator<Item = f64> {
        let pulled = reactions.iter().enumerate().map(move |(k, r)| -self.w[(row, k)] * r);
        self.carried(row, q).chain(pulled)
    }

    /// The terms of the acceleration of a row that come from sliders that vibrate.
    fn carried(&self, row: usize, q: &[f64]) -> impl Iterator<Item = f64> {
        let carried = self.scene.carried_acceleration(self.scene.slot(row));
        carried.into_iter().map(|(h, factor)| factor * q[h])
    }

    /// The statuses and forces of `contacts` when all of them touch and rest in their normal directions.
    pub fn resting(&self, contacts: &[usize], q: &[f64], u: &[f64]) -> Result<Resting, RunFailure> {
        let laws = &self.scene.contacts;
        let (mut position, mut velocity) = (q.to_vec(), u.to_vec());
        for &i in contacts {
            position[laws[i].normal] = laws[i].closed();
            velocity[laws[i].normal] = 0.0;
        }
        let slip = |i: usize| velocity[laws[i].tangential] - laws[i].slider_speed;
        let problem: Vec<Touching> =
            contacts.iter().map(|&i| (i, sliding_status(slip(i)))).collect();
        let solution = self.accelerate(&problem, &position, &velocity)?;
        Ok(Resting { position, problem, solution })
    }

    /// `K q + C q' - F` over (tangential, normal) of every contact.
    pub fn reactions(&self, q: &[f64], u: &[f64]) -> Vec<f64> {
        self.scene
            .contacts
            .iter()
            .flat_map(|law| {
                [law.tangential, law.normal].map(|row| self.scene.reaction_value(row, q, u))
            })
            .collect()
    }

    /// The velocities after the impulses that the statuses of contacts allow have stopped their normal velocities; `None`
    /// if these impulses are not determined.
    pub fn held(&self, problem: &[Touching], statuses: &[Status], u: &[f64]) -> Option<Vec<f64>> {
        let impulses =
            self.gathered(problem, Level::Impulses, |row| self.rate(row, u), u).forces(statuses)?;
        let mut u = u.to_vec();
        let closed: Vec<usize> = problem.iter().map(|entry| entry.0).collect();
        self.push(&closed, impulses.as_slice(), &mut u);
        self.hold(&closed, statuses, |_| 0.0, &mut u);
        self.scene.follow_held(std::iter::empty(), &mut u);
        Some(u)
    }

    /// The slip velocity or the speed of the gap of a row (tangential, normal).
    fn rate(&self, row: usize, u: &[f64]) -> f64 {
        let law = &self.scene.contacts[row / 2];
        match row.is_multiple_of(2) {
            true => u[law.tangential] - law.slider_speed,
            false => u[law.normal],
        }
    }

    /// Sets the velocities that impulses hold at a speed exactly to it: of gaps that stay closed, and of what sticks.
    fn hold(
        &self,
        contacts: &[usize],
        statuses: &[Status],
        rebound: impl Fn(usize) -> f64,
        u: &mut [f64],
    ) {
        for (&i, status) in contacts.iter().zip(statuses).filter(|(_, status)| status.is_closed()) {
            let law = &self.scene.contacts[i];
            u[law.normal] = rebound(i);
            if *status == Status::Sticking {
                u[law.tangential] = law.slider_speed;
            }
        }
    }

    /// Adds to the velocities the changes that impulses (tangential, normal) on contacts cause.
    fn push(&self, contacts: &[usize], impulses: &[f64], u: &mut [f64]) {
        for (i, law) in self.scene.contacts.iter().enumerate() {
            for (row, coordinate) in [(2 * i, law.tangential), (2 * i + 1, law.normal)] {
                u[coordinate] += contacts
                    .iter()
                    .enumerate()
                    .map(|(k, &j)| {
                        self.w[(row, 2 * j)] * impulses[2 * k]
                            + self.w[(row, 2 * j + 1)] * impulses[2 * k + 1]
                    })
                    .sum::<f64>();
            }
        }
    }

    /// Whether impulses (tangential, normal) on contacts change the velocity of a row by no more than their rounding.
    fn cancel(&self, row: usize, contacts: &[usize], impulses: &DVector<f64>) -> bool {
        let rows = contacts.iter().flat_map(|&i| [2 * i, 2 * i + 1]);
        let (mut sum, mut size, mut most) = (0.0_f64, 0.0, 0.0);
        for (k, impulse) in rows.zip(impulses) {
            let change = self.w[(row, k)] * impulse;
            sum += change;
            size += change.abs();
            most += (self.w[(row, row)] * self.w[(k, k)]).sqrt() * impulse.abs();
        }
        sum.abs() <= CANCELLED * size + ROUNDED * most
    }

    /// The contacts of a problem with their part of W, and `a0` of their rows.
    fn gathered(
        &self,
        problem: &[Touching],
        level: Level,
        a0: impl Fn(usize) -> f64,
        u: &[f64],
    ) -> ContactProblem {
        let contacts = &self.scene.contacts;
        let closed = problem
            .iter()
            .map(|&(i, sliding)| {
                let mut own = Conditions {
                    case: sliding.map_or(Case::Resting, Case::Sliding),
                    friction: self.scene.friction_at(i, u),
                    static_friction: contacts[i].static_friction,
                    opens: contacts[i].opens(),
                };
                if level == Level::Impulses {
                    own.friction = if self.scene.impacts_rub() { own.friction } else { 0.0 };
                    own.static_friction = own.friction;
                }
                own
            })
            .collect();
        let rows: Vec<usize> = rows(problem).collect();
        let w = self.w.select_rows(&rows).select_columns(&rows);
        let a0 = DVector::from_iterator(rows.len(), rows.iter().map(|&row| a0(row)));
        let dependent = self.scene.has_dependent_directions();
        ContactProblem { dependent, ..ContactProblem::new(closed, level, w, a0) }
    }

    fn solve(
        &self,
        gathered: &ContactProblem,
        problem: &[Touching],
        level: Level,
        q: &[f64],
        u: &[f64],
    ) -> Result<Solution, RunFailure> {
        let contacts = &self.scene.contacts;
        gathered.solve().map_err(|unsolved| RunFailure::ContactProblem {
            contacts: problem.iter().map(|entry| entry.0).collect(),
            time: self.time,
            level,
            count: unsolved.told(level),
            slip: contacts.iter().map(|law| u[law.tangential] - law.slider_speed).collect(),
            reactions: self.reactions(q, u),
        })
    }

    /// The impacts of one instant, which begin with those of `struck`; the contacts that they press on join these.
    ///
    /// An impact may press another contact into its slider. Where that one's gap is below its error in `gaps`, it
    /// strikes at the same instant, and may press the first again: the impacts follow each other as they would across
    /// a gap that vanishes, and a contact that has come to rest on the way, and is pressed on by the forces, takes part
    /// in the next. A series that has no end is cut after [`ROUNDS`]: its velocities are then taken together.
    pub fn strike_in_turn(
        &self,
        statuses: &[Status],
        gaps: &[f64],
        struck: &mut Vec<usize>,
        q: &mut [f64],
        u: &mut [f64],
    ) -> Result<(), RunFailure> {
        let contacts = &self.scene.contacts;
        for round in 0.. {
            let at_rest: Vec<usize> = (0..contacts.len())
                .filter(|&i| statuses[i].is_closed() || struck.contains(&i))
                .filter(|&i| u[contacts[i].normal] == 0.0)
                .collect();
            let pressed_on = match round == 0 || at_rest.is_empty() {
                true => Vec::new(),
                false => self.resting(&at_rest, q, u)?.solution.statuses,
            };
            let rests = |i: usize| {
                at_rest.iter().zip(&pressed_on).any(|(&j, status)| i == j && status.is_closed())
            };
            // The contacts of the event come first, however slowly they approach.
            let turn = round == 0 || round >= ROUNDS;
            let strikes = |i: usize| turn || u[contacts[i].normal] < 0.0 || rests(i);
            let touching: Vec<usize> = (0..contacts.len())
                .filter(|&i| statuses[i].is_closed() || struck.contains(&i) && strikes(i))
                .collect();
            self.strike(&touching, q, u)?;
            let pressed: Vec<usize> = (0..contacts.len())
                .filter(|&i| {
                    let touches = struck.contains(&i) || contacts[i].gap_at(q) <= gaps[i];
                    !statuses[i].is_closed() && touches && u[contacts[i].normal] < 0.0
                })
                .collect();
            if pressed.is_empty() {
                break;
            }
            pressed.iter().for_each(|&i| q[contacts[i].normal] = contacts[i].closed());
            struck.extend(pressed);
            struck.sort_unstable();
            struck.dedup();
        }
        Ok(())
    }

    /// The impulses of contacts that touch with Newton restitution, `g'+ + e g'- >= 0`, and Coulomb
    /// friction on the slip velocity after the impact; a contact that lifts off does not approach, `g'+ >= 0`.
    pub fn strike(&self, touching: &[usize], q: &[f64], u: &mut [f64]) -> Result<(), RunFailure> {
        let contacts = &self.scene.contacts;
        // A given normal force has no impulse.
        let touching = touching.iter().copied().filter(|&i| contacts[i].opens());
        let touching: Vec<usize> = touching.collect();
        let problem: Vec<Touching> = touching.iter().map(|&i| (i, None)).collect();
        let before = u.to_vec();
        let rebound = |i: usize| -contacts[i].restitution * before[contacts[i].normal].min(0.0);
        let velocity = |row: usize| {
            self.rate(row, &before) - if row % 2 == 1 { rebound(row / 2) } else { 0.0 }
        };
        let gathered = self.gathered(&problem, Level::Impulses, velocity, &before);
        let solution = self.solve(&gathered, &problem, Level::Impulses, q, &before)?;
        self.push(&touching, solution.forces.as_slice(), u);
        self.hold(&touching, &solution.statuses, rebound, u);
        // So is one that vanished before, where the impulses cancel each other.
        for (i, law) in contacts.iter().enumerate() {
            let rows = [(2 * i, law.tangential, law.slider_speed), (2 * i + 1, law.normal, 0.0)];
            for (row, coordinate, rest) in rows {
                if before[coordinate] == rest && self.cancel(row, &touching, &solution.forces) {
                    u[coordinate] = rest;
                }
            }
        }
        let struck =
            touching.iter().zip(&solution.statuses).filter(|(_, status)| status.is_closed());
        self.scene.follow_held(struck.map(|(&i, _)| contacts[i].normal), u);
        Ok(())
    }
}
