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

use crate::contact::event_kind::EventKind;
use crate::linalg::eigen;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

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

    pub fn scaled(&self, factor: f64) -> Self {
        self.combined(factor, &Self::default(), 0.0)
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
    pub trigger: EventKind,
    pub functional: Functional,
}

/// The force that holds contact coordinate `row` when all others are held too, `(K q + C q' - F)_row`:
/// where mass does not couple contact coordinates, N for a normal and the required friction force for a
/// tangential one.
pub(crate) fn reaction(scene: &Scene, row: usize) -> Functional {
    Functional {
        position: scene.stiffness.row(row).collect(),
        velocity: scene.damping.row(row).collect(),
        constant: -scene.force[row],
    }
}

/// (T, N) of every contact as functionals of the state. Where mass couples contacts, the accelerations
/// `W (forces - reactions)` that the statuses hold at zero make the forces a linear map of the reactions.
pub(crate) fn contact_forces(
    scene: &Scene,
    combination: &Combination,
) -> Vec<(Functional, Functional)> {
    let statuses = combination.statuses();
    let rows: Vec<(Functional, Functional)> = scene
        .contacts
        .iter()
        .map(|law| (reaction(scene, law.tangential), reaction(scene, law.normal)))
        .collect();
    let Some(w) = &scene.coordinates.delassus else {
        return rows
            .into_iter()
            .zip(scene.contacts.iter().zip(statuses))
            .map(|((required, normal), (law, &status))| match status {
                Status::Sticking => (required, normal),
                Status::Detached => Default::default(),
                _ => (normal.scaled(status.friction_sign() * law.friction), normal),
            })
            .collect();
    };
    let size = 2 * statuses.len();
    let (mut matrix, mut held) = (vec![0.0; size * size], vec![0.0; size * size]);
    for (i, (law, &status)) in scene.contacts.iter().zip(statuses).enumerate() {
        let (t, n) = (2 * i, 2 * i + 1);
        for (row, holds) in [(t, status == Status::Sticking), (n, status.is_closed())] {
            if holds {
                let range = row * size..(row + 1) * size;
                matrix[range.clone()].copy_from_slice(&w[range.clone()]);
                held[range.clone()].copy_from_slice(&w[range]);
            } else {
                matrix[row * size + row] = 1.0;
            }
        }
        if status.is_sliding() {
            matrix[t * size + n] = -status.friction_sign() * law.friction;
        }
    }
    let map = eigen::solve(size, &matrix, &held);
    let force = |k: usize| {
        rows.iter().enumerate().fold(Functional::default(), |sum, (j, (required, normal))| {
            sum.combined(1.0, required, map[k * size + 2 * j]).combined(
                1.0,
                normal,
                map[k * size + 2 * j + 1],
            )
        })
    };
    (0..statuses.len()).map(|i| (force(2 * i), force(2 * i + 1))).collect()
}

pub(crate) fn slip_velocity(scene: &Scene, contact: usize) -> Functional {
    Functional {
        position: Vec::new(),
        velocity: vec![(scene.contacts[contact].tangential, 1.0)],
        constant: -scene.contacts[contact].slider_speed,
    }
}

/// The event functions that are active in `combination`, by contact.
pub(crate) fn event_functions(scene: &Scene, combination: &Combination) -> Vec<EventFunction> {
    let mut functions = Vec::new();
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    for (contact, (law, &status)) in scene.contacts.iter().zip(combination.statuses()).enumerate() {
        let mut add = |trigger, functional| {
            functions.push(EventFunction { contact, trigger, functional });
        };
        let force = |normal: bool| match (&coupled, normal) {
            (Some(forces), true) => forces[contact].1.clone(),
            (Some(forces), false) => forces[contact].0.clone(),
            (None, true) => reaction(scene, law.normal),
            (None, false) => reaction(scene, law.tangential),
        };
        match status {
            Status::Positive | Status::Negative => {
                if law.static_friction > 0.0 {
                    let slip = slip_velocity(scene, contact);
                    let sign = -status.friction_sign();
                    add(EventKind::Velocity, slip.scaled(sign));
                }
                add(EventKind::Release, force(true));
            }
            Status::Sticking => {
                let (friction, normal) = (force(false), force(true));
                for (trigger, sign) in
                    [(EventKind::SlipPositive, -1.0), (EventKind::SlipNegative, 1.0)]
                {
                    add(trigger, normal.combined(law.static_friction, &friction, sign));
                }
            }
            Status::Detached => add(
                EventKind::Impact,
                Functional { position: vec![(law.normal, 1.0)], ..Functional::default() },
            ),
        }
    }
    functions
}

/// (N, T) of a contact in state (q, q'); mass must not couple contacts.
pub(crate) fn contact_force(
    scene: &Scene,
    contact: usize,
    status: Status,
    q: &[f64],
    u: &[f64],
) -> (f64, f64) {
    let law = &scene.contacts[contact];
    if !status.is_closed() {
        return (0.0, 0.0);
    }
    let normal = scene.reaction_value(law.normal, q, u);
    let friction = match status {
        Status::Sticking => scene.reaction_value(law.tangential, q, u),
        _ => status.friction_sign() * law.friction * normal,
    };
    (normal, friction)
}

/// (N, T) of every contact in state (q, q') of a combination.
pub(crate) fn contact_forces_in(
    scene: &Scene,
    combination: &Combination,
    q: &[f64],
    u: &[f64],
) -> Vec<(f64, f64)> {
    if scene.contacts_coupled() {
        let forces = contact_forces(scene, combination);
        return forces.iter().map(|(t, n)| (n.value(q, u), t.value(q, u))).collect();
    }
    let statuses = combination.statuses().iter().enumerate();
    statuses.map(|(contact, &status)| contact_force(scene, contact, status, q, u)).collect()
}
