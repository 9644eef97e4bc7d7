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

use crate::contact::coupled::contact_problem::{Closed, ContactProblem};
use crate::scene::status::Status;

/// Choices of statuses up to which all are tried.
const ENUMERATED: usize = 4096;
/// Changes of single statuses that are tried if there are more choices, until no status is wrong.
const CHANGES: usize = 1000;
/// Violation of an inequality, relative to its terms, that counts as rounding.
const ROUNDING: f64 = 1e-11;
/// Rate, relative to its terms, that is rounding of the root at which a slip has come to its end.
const AT_REST: f64 = 1e-8;

/// The statuses that a contact can have, as far as they are known beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Case {
    /// Nothing but this status is possible.
    Settled(Status),
    /// The contact closes or opens: gap and normal force are zero.
    Touching,
    /// The contact slides in a direction, or its friction force is at the limit of sticking in that direction.
    Slipping {
        towards: Status,
        /// Whether its friction force is also the largest that sticking can hold.
        at_bound: bool,
        /// Whether the slip velocity has come to zero.
        ends: bool,
    },
    /// Its friction drops from the static to the kinetic one.
    Jumping { towards: Status },
    /// Another contact of the group jumps, or a load is switched: the contact may take any status from its present place.
    Beside { before: Status },
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
    /// The sum of the absolute values of the terms of each entry of a0.
    sizes: DVector<f64>,
}

/// Statuses with forces or their rates, (T, N) of each contact.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub statuses: Vec<Status>,
    pub forces: DVector<f64>,
    /// How close each sticking contact is to the bound in whose direction it slid, relative to its terms; 0 at it.
    pub margins: Vec<f64>,
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unsolved {
    /// No choice of statuses is one.
    None,
    /// None of those tried is one, and not all were tried.
    NotFound,
    /// Several are.
    Several,
    /// Several are, which differ in contacts that static friction holds.
    Held,
}

impl Unsolved {
    /// What happened, and the remedy, as the end of a sentence about the problem.
    pub const fn told(self) -> &'static str {
        match self {
            Self::None => {
                "has no solution: friction is too large for the stiffness that ties them; give them a normal_stiffness and a tangential_stiffness, or less friction"
            }
            Self::NotFound => {
                "has too many combinations of statuses to try all, and those tried are no solution; tie fewer contacts without mass to each other, or give them a normal_stiffness and a tangential_stiffness"
            }
            Self::Several => {
                "has several solutions: friction is too large for the stiffness that ties them; give them a normal_stiffness and a tangential_stiffness, or less friction"
            }
            Self::Held => {
                "has several solutions: static friction above the kinetic one can hold some of them or others; give them static_friction = friction, or a load that tells them apart"
            }
        }
    }
}

impl Problem {
    pub fn new(nodes: Vec<Node>, w: DMatrix<f64>, a0: DVector<f64>, sizes: DVector<f64>) -> Self {
        let law = |node: &Node| Closed {
            friction: node.friction,
            static_friction: node.static_friction,
            sliding: None,
            opens: true,
        };
        let contacts = nodes.iter().map(law).collect();
        Self { nodes, linear: ContactProblem::new(contacts, w, a0, false), sizes }
    }

    /// Takes slip velocities that come to their end to zero, which they are under the statuses `before`: where a slip slows
    /// down fast, an ulp of time leaves it more than the rounding of its terms.
    pub fn end_slips(&mut self, before: &[Status]) {
        let ends = |node: &Node| matches!(node.case, Case::Slipping { ends: true, .. });
        if !self.nodes.iter().any(ends) {
            return;
        }
        // Without forces the slips keep their rounding, and what is found with it is verified all the same.
        let Some(forces) = self.linear.forces(before) else { return };
        let rates = &self.linear.w * forces;
        for k in (0..self.nodes.len()).filter(|&k| ends(&self.nodes[k])) {
            self.linear.a0[2 * k] = -rates[2 * k];
        }
    }

    /// The one answer. If static friction exceeds kinetic friction, a contact keeps its status if it can.
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
                && !found.iter().any(|other| self.same_forces(other, &answer))
            {
                found.push(answer);
            }
        }
        // Number of contacts that keep their status, and of touching contacts that static friction holds.
        let rank = |answer: &Answer| {
            let (mut goes_on, mut held) = (0, 0);
            for (node, status) in self.nodes.iter().zip(&answer.statuses) {
                let excess = node.static_friction > node.friction;
                match node.case {
                    Case::Slipping { towards, at_bound: false, .. } => {
                        goes_on += usize::from(*status == towards);
                    }
                    Case::Beside { before } if excess => goes_on += usize::from(*status == before),
                    Case::Touching if excess => held += usize::from(*status == Status::Sticking),
                    _ => {}
                }
            }
            (goes_on, held)
        };
        let best = found.iter().map(rank).max().ok_or(Unsolved::None)?;
        let mut best = found.into_iter().filter(|answer| rank(answer) == best);
        match (best.next(), best.next()) {
            (Some(answer), None) => Ok(answer),
            (Some(one), Some(other)) => Err(self.ambiguity(&one, &other)),
            (None, _) => Err(Unsolved::None),
        }
    }

    fn ambiguity(&self, one: &Answer, other: &Answer) -> Unsolved {
        let held = |(k, node): (usize, &Node)| {
            let statuses = [one.statuses[k], other.statuses[k]];
            node.static_friction > node.friction
                && statuses[0] != statuses[1]
                && statuses.contains(&Status::Sticking)
        };
        if self.nodes.iter().enumerate().any(held) { Unsolved::Held } else { Unsolved::Several }
    }

    /// Changes the status that is most wrong until none is.
    fn search(&self, choices: &[&[Status]]) -> Result<Answer, Unsolved> {
        let mut at = vec![0; choices.len()];
        for _ in 0..CHANGES {
            let statuses = at.iter().zip(choices).map(|(&k, own)| own[k]).collect();
            let wrong = match self.verified(statuses) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => wrong.ok_or(Unsolved::NotFound)?,
            };
            at[wrong] = (at[wrong] + 1) % choices[wrong].len();
        }
        Err(Unsolved::NotFound)
    }

    /// Whether two answers are the same motion: statuses at a boundary have two names.
    fn same_forces(&self, one: &Answer, other: &Answer) -> bool {
        let w = &self.linear.w;
        let rounded = self.sizes.iter().enumerate().map(|(k, size)| match w[(k, k)] {
            0.0 => 0.0,
            own => size / own,
        });
        let scale = rounded.fold(one.forces.amax().max(other.forces.amax()), f64::max);
        (&one.forces - &other.forces).amax() <= 100.0 * ROUNDING * scale
    }

    /// The answer with these statuses, or the contact whose inequality is violated most; None where the equations
    /// have no solution.
    fn verified(&self, statuses: Vec<Status>) -> Result<Answer, Option<usize>> {
        let forces = self.linear.forces(&statuses).ok_or(None)?;
        let ContactProblem { w, a0, .. } = &self.linear;
        // A sum and the scale of its terms.
        let motion = |k: usize| {
            let terms = w.row(k).iter().zip(&forces).map(|(w, f)| w * f).collect::<Vec<f64>>();
            let size = self.sizes[k] + terms.iter().map(|term| term.abs()).sum::<f64>();
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
            // Numbers that must not be negative, each with the scale of its rounding.
            let mut conditions: Vec<(f64, f64)> = Vec::new();
            match (node.case, status) {
                (Case::Settled(_), _) => {}
                (_, Status::Detached) => conditions.push(motion(n)),
                (Case::Slipping { towards, at_bound, ends }, Status::Sticking) => {
                    let bound = held(towards.friction_sign(), node.friction);
                    margins[i] = if bound.1 > 0.0 { (bound.0 / bound.1).max(0.0) } else { 0.0 };
                    let rest = if ends { AT_REST * bound.1 } else { 0.0 };
                    conditions.extend(at_bound.then_some((bound.0 + rest, bound.1)));
                }
                // A contact that has come to rest slips again only if a force moves it.
                (Case::Slipping { ends: true, .. }, _) => {
                    let (value, size) = slip();
                    conditions.push((value - AT_REST * size, size));
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
    /// Whether the friction force of a sticking contact is at its limit to rounding, so that it leaves it at second order.
    pub fn is_at_bound(&self, contact: usize) -> bool {
        self.margins[contact] <= AT_REST
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
        Case::Beside { before: Detached } if smooth => &[Detached, Positive],
        Case::Touching | Case::Beside { .. } if smooth => &[Positive, Detached],
        // If one motion has two names, the contact keeps the one it has.
        Case::Beside { before: Positive } => &[Positive, Sticking, Negative, Detached],
        Case::Beside { before: Negative } => &[Negative, Sticking, Positive, Detached],
        Case::Beside { before: Detached } => &[Detached, Sticking, Positive, Negative],
        Case::Touching | Case::Beside { .. } => &[Sticking, Positive, Negative, Detached],
        Case::Slipping { towards: Negative, ends: false, .. } => &[Negative, Sticking],
        Case::Slipping { ends: false, .. } => &[Positive, Sticking],
        Case::Slipping { towards: Negative, .. } => &[Sticking, Negative],
        Case::Slipping { .. } => &[Sticking, Positive],
        Case::Jumping { towards: Negative } => &[Negative, Detached],
        Case::Jumping { .. } => &[Positive, Detached],
    }
}
