//! Event functions: the affine functionals of the state whose first zero ends a phase.
//!
//! | status | event function, positive while the status holds | at its zero |
//! | --- | --- | --- |
//! | `+` / `-` | -s / +s | slip velocity zero |
//! | `+` / `-` | N | normal force zero |
//! | `s` | mu_static N - T, mu_static N + T | onset of slip `+`, `-` |
//! | `d` | g | gap closes |
//!
//! Both functions of a sticking contact are positive only while N is, so N needs none of its own.

use crate::scene::Scene;
use crate::status::{Combination, Status};

/// What the zero of an event function means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Trigger {
    /// The slip velocity of a sliding contact reaches zero.
    SlipZero,
    /// The normal force of a sliding contact reaches zero.
    Release,
    /// T of a sticking contact reaches +mu_static N.
    SlipPositive,
    /// T of a sticking contact reaches -mu_static N.
    SlipNegative,
    /// The gap of an open contact closes.
    GapClosed,
}

/// `constant + position . q + velocity . q'` in contact coordinates.
#[derive(Debug, Clone, Default)]
pub(crate) struct Functional {
    pub position: Vec<(usize, f64)>,
    pub velocity: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Functional {
    pub fn value(&self, q: &[f64], u: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| weight * x[k]).sum()
        };
        self.constant + dot(&self.position, q) + dot(&self.velocity, u)
    }

    /// Sum of the absolute values of the terms: the scale against which `value` is rounded.
    pub fn magnitude(&self, q: &[f64], u: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| (weight * x[k]).abs()).sum()
        };
        self.constant.abs() + dot(&self.position, q) + dot(&self.velocity, u)
    }

    /// `a self + b other`
    fn combined(&self, a: f64, other: &Self, b: f64) -> Self {
        let merge = |left: &[(usize, f64)], right: &[(usize, f64)]| {
            let mut sum: Vec<(usize, f64)> = left.iter().map(|&(k, w)| (k, a * w)).collect();
            for &(k, weight) in right {
                match sum.iter_mut().find(|entry| entry.0 == k) {
                    Some(entry) => entry.1 += b * weight,
                    None => sum.push((k, b * weight)),
                }
            }
            sum
        };
        Self {
            position: merge(&self.position, &other.position),
            velocity: merge(&self.velocity, &other.velocity),
            constant: a * self.constant + b * other.constant,
        }
    }
}

/// One event function of a status combination.
#[derive(Debug, Clone)]
pub(crate) struct EventFunction {
    pub contact: usize,
    pub trigger: Trigger,
    pub functional: Functional,
}

impl Scene {
    /// The force that keeps the acceleration of contact coordinate `row` at zero, `(K q + C q' - F)_row`:
    /// N for a normal coordinate, the required friction force for a tangential one. Mass must not couple
    /// contact coordinates.
    pub(crate) fn reaction(&self, row: usize) -> Functional {
        Functional {
            position: self.stiffness.row(row).collect(),
            velocity: self.damping.row(row).collect(),
            constant: -self.force[row],
        }
    }

    pub(crate) fn slip_velocity(&self, contact: usize) -> Functional {
        Functional {
            position: Vec::new(),
            velocity: vec![(self.contacts[contact].tangential, 1.0)],
            constant: -self.contacts[contact].slider_speed,
        }
    }

    /// The event functions that are active in `combination`, by contact.
    pub(crate) fn event_functions(&self, combination: &Combination) -> Vec<EventFunction> {
        let mut functions = Vec::new();
        for (contact, (law, &status)) in
            self.contacts.iter().zip(combination.statuses()).enumerate()
        {
            let mut add = |trigger, functional| {
                functions.push(EventFunction {
                    contact,
                    trigger,
                    functional,
                });
            };
            let normal_force = || self.reaction(law.normal);
            match status {
                Status::Positive | Status::Negative => {
                    if law.static_friction > 0.0 {
                        let slip = self.slip_velocity(contact);
                        let sign = -status.friction_sign();
                        add(
                            Trigger::SlipZero,
                            slip.combined(sign, &Functional::default(), 0.0),
                        );
                    }
                    add(Trigger::Release, normal_force());
                }
                Status::Sticking => {
                    let friction = self.reaction(law.tangential);
                    let normal = normal_force();
                    for (trigger, sign) in
                        [(Trigger::SlipPositive, -1.0), (Trigger::SlipNegative, 1.0)]
                    {
                        add(
                            trigger,
                            normal.combined(law.static_friction, &friction, sign),
                        );
                    }
                }
                Status::Detached => add(
                    Trigger::GapClosed,
                    Functional {
                        position: vec![(law.normal, 1.0)],
                        ..Functional::default()
                    },
                ),
            }
        }
        functions
    }
}
