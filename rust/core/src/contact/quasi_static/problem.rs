//! The quasi-static contact problem: which statuses contacts without mass take.
//!
//! For the contacts of one group, `a = a0 + W p` with the flexibility `W = B' Y B` relates their forces (T, N) to
//! the tangential displacement and the gap, and the rates of these forces to slip velocity and speed of the gap. Sought
//! are statuses whose linear equations have a solution that meets every inequality:
//!
//! | contact | status | places and forces | rates |
//! | --- | --- | --- | --- |
//! | touches without force | `d` | | `g' >= 0` |
//! | | `s` | | `abs(T') <= mu_static N'` |
//! | | `+`, `-` | | `N' >= 0`, slip against T |
//! | slides | as before | | slip as before |
//! | | `s` | | `abs(T)` does not grow beyond `mu N` |
//! | any, in a jump | `d` | `g >= 0` | |
//! | | `s` | `abs(T) <= mu_static N` | |
//! | | `+`, `-` | `N >= 0`, displacement against T | |
//!
//! All choices of statuses are tried while they are few, so that a second solution is seen.

use nalgebra::{DMatrix, DVector};

use crate::contact::coupled::contact_problem::{Closed, ContactProblem, Unsolved};
use crate::scene::status::Status;

/// Choices of statuses up to which all are tried.
const ENUMERATED: usize = 4096;
/// Statuses changed one by one where there are more, until none is wrong.
const CHANGES: usize = 1000;
/// Violation of an inequality, relative to its terms, that counts as rounding.
const ROUNDING: f64 = 1e-11;

/// What is known of a contact beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Case {
    /// Nothing but this status is possible.
    Settled(Status),
    /// It closes or opens: gap and normal force are zero.
    Touching,
    /// It slides, or is at the bound of what sticks, in a direction.
    Slipping {
        towards: Status,
        /// Whether its friction force is all that sticking can hold, too.
        at_bound: bool,
        /// Whether the slip velocity has come to zero.
        ends: bool,
    },
    /// Its friction drops from the static to the kinetic one.
    Jumping { towards: Status },
    /// Closed while another one jumps.
    Pressed { before: Status },
}

/// One contact of the problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub case: Case,
    pub friction: f64,
    pub static_friction: f64,
}

/// `a = a0 + W p` over (tangential, normal) of each contact.
#[derive(Debug)]
pub(crate) struct Problem {
    nodes: Vec<Node>,
    linear: ContactProblem,
}

/// Statuses with forces or their rates, (T, N) of each contact.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub statuses: Vec<Status>,
    pub forces: DVector<f64>,
    /// How close each sticking contact is to the bound in whose direction it slid, relative to its terms; 0 at it.
    pub margins: Vec<f64>,
}

impl Problem {
    pub fn new(nodes: Vec<Node>, w: DMatrix<f64>, a0: DVector<f64>) -> Self {
        let law = |node: &Node| Closed {
            friction: node.friction,
            static_friction: node.static_friction,
            sliding: None,
            opens: true,
        };
        let contacts = nodes.iter().map(law).collect();
        Self { nodes, linear: ContactProblem { contacts, w, a0, dependent: false } }
    }

    /// The one answer. Where static friction exceeds the kinetic one, a contact that could go on as it was does so.
    pub fn solve(&self) -> Result<Answer, Unsolved> {
        let choices: Vec<&[Status]> = self.nodes.iter().map(choices).collect();
        let all = choices.iter().fold(1, |all: usize, own| all.saturating_mul(own.len()));
        if all > ENUMERATED {
            return self.search(&choices);
        }
        let mut found: Vec<Answer> = Vec::new();
        for mut index in 0..all {
            let pick = |own: &&[Status]| {
                let status = own[index % own.len()];
                index /= own.len();
                status
            };
            let statuses: Vec<Status> = choices.iter().map(pick).collect();
            if let Ok(answer) = self.verified(statuses)
                && !found.iter().any(|other| same_forces(other, &answer))
            {
                found.push(answer);
            }
        }
        let rank = |answer: &Answer| {
            let keeps = |(node, status): &(&Node, &Status)| match node.case {
                Case::Slipping { towards, at_bound: false, .. } => **status == towards,
                // Static friction is what a contact has before it slips.
                Case::Touching => {
                    node.static_friction > node.friction && **status == Status::Sticking
                }
                Case::Pressed { before } => {
                    node.static_friction > node.friction && **status == before
                }
                _ => false,
            };
            self.nodes.iter().zip(&answer.statuses).filter(keeps).count()
        };
        let best = found.iter().map(rank).max().ok_or(Unsolved::None)?;
        let mut best = found.into_iter().filter(|answer| rank(answer) == best);
        match (best.next(), best.next()) {
            (Some(answer), None) => Ok(answer),
            _ => Err(Unsolved::Several),
        }
    }

    /// Changes the status that is most wrong until none is.
    fn search(&self, choices: &[&[Status]]) -> Result<Answer, Unsolved> {
        let mut at = vec![0; choices.len()];
        for _ in 0..CHANGES {
            let statuses = at.iter().zip(choices).map(|(&k, own)| own[k]).collect();
            let wrong = match self.verified(statuses) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => wrong.ok_or(Unsolved::None)?,
            };
            at[wrong] = (at[wrong] + 1) % choices[wrong].len();
        }
        Err(Unsolved::None)
    }

    /// The answer with these statuses, or the contact whose inequality is violated most; None where the equations
    /// have no solution.
    fn verified(&self, statuses: Vec<Status>) -> Result<Answer, Option<usize>> {
        let forces = self.linear.forces(&statuses).ok_or(None)?;
        let ContactProblem { w, a0, .. } = &self.linear;
        // A sum and the scale of its terms.
        let motion = |k: usize| {
            let terms = w.row(k).iter().zip(&forces).map(|(w, f)| w * f).collect::<Vec<f64>>();
            let size = a0[k].abs() + terms.iter().map(|term| term.abs()).sum::<f64>();
            (a0[k] + terms.iter().sum::<f64>(), size)
        };
        let rounding = |k: usize| match w[(k, k)] {
            0.0 => 0.0,
            own => motion(k).1 / own,
        };
        let mut margins = vec![0.0; statuses.len()];
        let mut wrong = None;
        let mut worst = 0.0;
        for (i, (node, &status)) in self.nodes.iter().zip(&statuses).enumerate() {
            let (t, n) = (2 * i, 2 * i + 1);
            let (friction, normal) = (forces[t], forces[n]);
            let sign = status.friction_sign();
            let slip = || {
                let (slip, size) = motion(t);
                (-sign * slip, size)
            };
            let pressed = (normal, rounding(n));
            let held = |sign: f64, limit: f64| {
                (limit * normal - sign * friction, limit * rounding(n) + rounding(t))
            };
            // What must not be negative, with the scale of its rounding.
            let mut conditions: Vec<(f64, f64)> = Vec::new();
            match (node.case, status) {
                (Case::Settled(_), _) => {}
                (_, Status::Detached) => conditions.push(motion(n)),
                (Case::Slipping { towards, at_bound, .. }, Status::Sticking) => {
                    let bound = held(towards.friction_sign(), node.friction);
                    margins[i] = if bound.1 > 0.0 { (bound.0 / bound.1).max(0.0) } else { 0.0 };
                    conditions.extend(at_bound.then_some(bound));
                }
                (Case::Slipping { .. }, _) => conditions.push(slip()),
                (_, Status::Sticking) => {
                    let limit = node.static_friction;
                    conditions.extend([pressed, held(1.0, limit), held(-1.0, limit)]);
                }
                _ => {
                    conditions.push(pressed);
                    conditions.extend((node.static_friction > 0.0).then(slip));
                }
            }
            for (value, scale) in conditions {
                let violation = if value < -ROUNDING * scale { -value / scale } else { 0.0 };
                if violation > worst {
                    (worst, wrong) = (violation, Some(i));
                }
            }
        }
        match wrong {
            Some(_) => Err(wrong),
            None => Ok(Answer { statuses, forces, margins }),
        }
    }
}

impl Answer {
    /// Whether a sticking contact is at the bound of its friction to rounding, and leaves it at second order.
    pub fn is_at_bound(&self, contact: usize) -> bool {
        self.margins[contact] <= 1e3 * ROUNDING
    }
}

/// The statuses that a contact may take, the likeliest first.
fn choices(node: &Node) -> &'static [Status] {
    use Status::{Detached, Negative, Positive, Sticking};
    let smooth = node.static_friction == 0.0;
    match node.case {
        Case::Settled(Positive) => &[Positive],
        Case::Settled(Negative) => &[Negative],
        Case::Settled(Sticking) => &[Sticking],
        Case::Settled(Detached) => &[Detached],
        Case::Touching | Case::Pressed { .. } if smooth => &[Positive, Detached],
        Case::Touching | Case::Pressed { .. } => &[Sticking, Positive, Negative, Detached],
        Case::Slipping { towards: Negative, ends: false, .. } => &[Negative, Sticking],
        Case::Slipping { ends: false, .. } => &[Positive, Sticking],
        Case::Slipping { towards: Negative, .. } => &[Sticking, Negative],
        Case::Slipping { .. } => &[Sticking, Positive],
        Case::Jumping { towards: Negative } => &[Negative, Detached],
        Case::Jumping { .. } => &[Positive, Detached],
    }
}

/// Whether two answers are the same motion: statuses at a boundary have two names.
fn same_forces(one: &Answer, other: &Answer) -> bool {
    let scale = one.forces.amax().max(other.forces.amax());
    (&one.forces - &other.forces).amax() <= 100.0 * ROUNDING * scale
}
