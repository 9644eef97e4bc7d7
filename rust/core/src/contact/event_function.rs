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

use nalgebra::DMatrix;

use crate::contact::coupled::contact_problem::held_rows;
use crate::contact::coupled::dependent::{Forces, eliminated};
use crate::contact::event_kind::EventKind;
use crate::error::Error;
use crate::linalg::dense::Factors;
use crate::scene::contact_law::Directions;
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Relative difference of two functionals that is rounding.
const MULTIPLE: f64 = 1e-9;

/// `constant + position . q + velocity . q'` in contact coordinates.
#[derive(Debug, Clone, Default, PartialEq)]
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

    /// Its only term, without the constant: (0 of a displacement or 1 of a velocity, coordinate, weight).
    pub fn single(&self) -> Option<(usize, usize, f64)> {
        match (&self.position[..], &self.velocity[..]) {
            (&[(k, weight)], []) => Some((0, k, weight)),
            ([], &[(k, weight)]) => Some((1, k, weight)),
            _ => None,
        }
    }

    /// The change along a direction (dq, dq').
    pub fn rate(&self, dq: &[f64], du: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| weight * x[k]).sum()
        };
        dot(&self.position, dq) + dot(&self.velocity, du)
    }

    /// Sum of the absolute values of the terms: the scale against which `value` is rounded.
    pub fn magnitude(&self, q: &[f64], u: &[f64]) -> f64 {
        let dot = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| (weight * x[k]).abs()).sum()
        };
        self.constant.abs() + dot(&self.position, q) + dot(&self.velocity, u)
    }

    /// Whether the two are positive multiples of each other, up to rounding; terms in the order of their coordinates.
    pub fn is_multiple_of(&self, other: &Self) -> bool {
        let terms = |of: &Self| -> Vec<(usize, usize, f64)> {
            let position = of.position.iter().map(|&(k, weight)| (0, k, weight));
            let velocity = of.velocity.iter().map(|&(k, weight)| (1, k, weight));
            let constant = std::iter::once((2, 0, of.constant));
            position.chain(velocity).chain(constant).filter(|term| term.2 != 0.0).collect()
        };
        let (own, others) = (terms(self), terms(other));
        let largest = |terms: &[(usize, usize, f64)]| {
            terms.iter().map(|term| term.2).max_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let (Some(a), Some(b)) = (largest(&own), largest(&others)) else { return false };
        let near = |(x, y): (&(usize, usize, f64), &(usize, usize, f64))| {
            (x.0, x.1) == (y.0, y.1) && (x.2 / a.abs() - y.2 / b.abs()).abs() <= MULTIPLE
        };
        own.len() == others.len() && own.iter().zip(&others).all(near)
    }

    /// The same functional over the coordinates of x, in a scene in which some coordinates are sums of others.
    pub fn substituted(&self, scene: &Scene) -> Self {
        let mut constant = self.constant;
        let mut over = |terms: &[(usize, f64)], shifts: bool| {
            let mut sums: Vec<(usize, f64)> = Vec::new();
            for &(k, weight) in terms {
                match scene.dependents.iter().find(|one| one.coordinate == k) {
                    None => sums.push((k, weight)),
                    Some(one) => {
                        constant += if shifts { weight * one.offset } else { 0.0 };
                        sums.extend(one.terms.iter().map(|&(j, factor)| (j, weight * factor)));
                    }
                }
            }
            sums.sort_by_key(|term| term.0);
            sums.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            sums
        };
        Self {
            position: over(&self.position, true),
            velocity: over(&self.velocity, false),
            constant,
        }
    }

    pub fn scaled(&self, factor: f64) -> Self {
        let terms = |terms: &[(usize, f64)]| terms.iter().map(|&(k, w)| (k, factor * w)).collect();
        Self {
            position: terms(&self.position),
            velocity: terms(&self.velocity),
            constant: factor * self.constant,
        }
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::sum([(1.0, self), (1.0, other)].into_iter())
    }

    /// The same functional where some coordinates without mass follow the others.
    pub fn condensed(&self, condensed: &Condensed) -> Self {
        let (position, constant) = condensed.replaced(&self.position);
        let (velocity, _) = condensed.replaced(&self.velocity);
        Self { position, velocity, constant: self.constant + constant }
    }

    /// `sum_j factor_j part_j`
    fn sum<'a>(parts: impl Iterator<Item = (f64, &'a Self)> + Clone) -> Self {
        // A dense row of sums if the parts hold many coordinates of the scene; otherwise a sorted list.
        let merged = |of: fn(&Self) -> &[(usize, f64)]| -> Vec<(usize, f64)> {
            let largest = parts.clone().filter_map(|(_, part)| of(part).last());
            let count = largest.map(|term| term.0 + 1).max().unwrap_or(0);
            if 8 * parts.clone().map(|(_, part)| of(part).len()).sum::<usize>() < count {
                let factors = parts.clone().filter(|part| part.0 != 0.0);
                let terms = factors
                    .flat_map(|(factor, part)| of(part).iter().map(move |&(k, w)| (k, factor * w)));
                let mut terms: Vec<(usize, f64)> = terms.collect();
                terms.sort_by_key(|term| term.0);
                terms.dedup_by(|next, kept| {
                    let same = next.0 == kept.0;
                    kept.1 += if same { next.1 } else { 0.0 };
                    same
                });
                return terms;
            }
            let mut sums: Vec<Option<f64>> = vec![None; count];
            for (factor, part) in parts.clone().filter(|part| part.0 != 0.0) {
                for &(k, weight) in of(part) {
                    *sums[k].get_or_insert(0.0) += factor * weight;
                }
            }
            sums.into_iter().enumerate().filter_map(|(k, sum)| Some((k, sum?))).collect()
        };
        Self {
            position: merged(|part| &part.position),
            velocity: merged(|part| &part.velocity),
            constant: parts.clone().map(|(factor, part)| factor * part.constant).sum(),
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
    let mut forces = force_functionals(&rows, &force_map(scene, w, statuses));
    if scene.drive.is_some() && !scene.dependents.is_empty() {
        carry_along(scene, w, statuses, &mut forces);
    }
    forces
}

/// Adds to the forces the part by which held directions that are sums of others follow sliders that vibrate.
fn carry_along(
    scene: &Scene,
    w: &DMatrix<f64>,
    statuses: &[Status],
    forces: &mut [(Functional, Functional)],
) {
    let (held, found) = dependent_forces(scene, w, statuses);
    let of = |&row: &usize| Functional {
        position: scene.carried_acceleration(scene.slot(row)),
        ..Functional::default()
    };
    let carried: Vec<Functional> = held.iter().map(of).collect();
    for (i, (friction, normal)) in forces.iter_mut().enumerate() {
        for (k, force) in [(2 * i, friction), (2 * i + 1, normal)] {
            let weights = found.of_rows.row(k);
            let parts = weights.iter().zip(&carried).map(|(weight, part)| (-weight, part));
            *force = force.plus(&Functional::sum(parts));
        }
    }
}

/// The forces (T, N) of all contacts per reaction, where contacts are coupled.
fn force_map(scene: &Scene, w: &DMatrix<f64>, statuses: &[Status]) -> DMatrix<f64> {
    if !scene.dependents.is_empty() {
        let (held, found) = dependent_forces(scene, w, statuses);
        return found.of_rows * w.select_rows(&held);
    }
    let size = 2 * statuses.len();
    let (mut matrix, mut held) = (DMatrix::identity(size, size), DMatrix::zeros(size, size));
    for (i, (law, &status)) in scene.contacts.iter().zip(statuses).enumerate() {
        let (t, n) = (2 * i, 2 * i + 1);
        for (row, holds) in [(t, status == Status::Sticking), (n, status.is_closed())] {
            if holds {
                matrix.set_row(row, &w.row(row));
                held.set_row(row, &w.row(row));
            }
        }
        if status.is_sliding() {
            matrix[(t, n)] = -status.friction_sign() * law.friction;
        }
    }
    Factors::new(matrix).solve(held)
}

/// The change of the forces (T, N) of all coupled contacts per newton of additional friction against the slip of one of
/// them, a column for each; the additional friction itself is not included. None if contacts are not coupled.
pub(crate) fn friction_response(scene: &Scene, combination: &Combination) -> Option<DMatrix<f64>> {
    let statuses = combination.statuses();
    let map = force_map(scene, scene.coordinates.delassus.as_ref()?, statuses);
    // A load along a contact is a reaction less.
    Some(DMatrix::from_fn(map.nrows(), statuses.len(), |row, contact| {
        -statuses[contact].friction_sign() * map[(row, 2 * contact)]
    }))
}

/// The change of an event function per newton of additional friction of contact `source`, from [`friction_response`].
pub(crate) fn response_of_event(
    scene: &Scene,
    response: &DMatrix<f64>,
    (contact, trigger): (usize, EventKind),
    source: usize,
) -> f64 {
    let force = |row: usize| response[(2 * contact + row, source)];
    let limit = scene.contacts[contact].static_friction;
    match trigger {
        EventKind::Release => force(1),
        EventKind::SlipPositive => limit * force(1) - force(0),
        EventKind::SlipNegative => limit * force(1) + force(0),
        _ => 0.0,
    }
}

/// (T, N) of every contact as sums of the reactions (T, N) of all.
fn force_functionals(
    rows: &[(Functional, Functional)],
    map: &DMatrix<f64>,
) -> Vec<(Functional, Functional)> {
    let parts: Vec<&Functional> = rows.iter().flat_map(|(t, n)| [t, n]).collect();
    let force =
        |k: usize| Functional::sum(parts.iter().enumerate().map(|(j, part)| (map[(k, j)], *part)));
    (0..rows.len()).map(|i| (force(2 * i), force(2 * i + 1))).collect()
}

/// Where directions depend on each other: the rows, (tangential, normal) of each contact, that statuses hold, and the
/// forces (T, N) of all contacts by what these rows need.
fn dependent_forces(scene: &Scene, w: &DMatrix<f64>, statuses: &[Status]) -> (Vec<usize>, Forces) {
    let slope = |i: usize| statuses[i].friction_sign() * scene.contacts[i].friction;
    let (held, map) = held_rows(statuses, slope);
    let found = Forces::new(w, &held, &map);
    (held, found)
}

/// The contacts whose forces nothing determines in a combination, because directions of closed contacts depend on each
/// other.
pub fn undetermined(scene: &Scene, combination: &Combination) -> Vec<usize> {
    let Some(w) = scene.coordinates.delassus.as_ref().filter(|_| !scene.dependents.is_empty())
    else {
        return Vec::new();
    };
    let free = dependent_forces(scene, w, combination.statuses()).1.free;
    let moved = |row: usize| free.row(row).iter().any(|&part| part != 0.0);
    (0..scene.contacts.len()).filter(|&i| moved(2 * i) || moved(2 * i + 1)).collect()
}

/// The event functions of a combination in which some forces are not determined: the inequalities that some split of
/// the forces can satisfy. Each belongs to every contact that it contains; if it contains both friction limits of a
/// contact, it belongs to the normal force of that contact.
fn undetermined_functions(
    scene: &Scene,
    combination: &Combination,
    forces: &[(Functional, Functional)],
    free: &DMatrix<f64>,
) -> Result<Vec<EventFunction>, Error> {
    // (contact, trigger, factor of N, factor of T)
    let mut limits: Vec<(usize, EventKind, f64, f64)> = Vec::new();
    for (i, (law, &status)) in scene.contacts.iter().zip(combination.statuses()).enumerate() {
        if status == Status::Sticking {
            limits.push((i, EventKind::SlipPositive, law.static_friction, -1.0));
            limits.push((i, EventKind::SlipNegative, law.static_friction, 1.0));
        } else if status.is_closed() && law.directions != Directions::Tangential {
            limits.push((i, EventKind::Release, 1.0, 0.0));
        }
    }
    let b = DMatrix::from_fn(limits.len(), free.ncols(), |j, k| {
        let (i, _, normal, tangential) = limits[j];
        normal * free[(2 * i + 1, k)] + tangential * free[(2 * i, k)]
    });
    let inequalities = eliminated(&b)
        .ok_or_else(|| Error::DependentForces { combination: combination.to_string() })?;
    let mut functions = Vec::new();
    for factors in inequalities {
        let parts = factors.iter().flat_map(|&(j, factor)| {
            let (i, _, normal, tangential) = limits[j];
            [(factor * normal, &forces[i].1), (factor * tangential, &forces[i].0)]
        });
        let functional = Functional::sum(parts);
        let mut told: Vec<(usize, EventKind)> =
            factors.iter().map(|&(j, _)| (limits[j].0, limits[j].1)).collect();
        told.sort_by_key(|entry| entry.0);
        for own in told.chunk_by(|a, b| a.0 == b.0) {
            let trigger = if own.len() > 1 { EventKind::Release } else { own[0].1 };
            functions.push(EventFunction {
                contact: own[0].0,
                trigger,
                functional: functional.clone(),
            });
        }
    }
    Ok(functions)
}

pub(crate) fn slip_velocity(scene: &Scene, contact: usize) -> Functional {
    Functional {
        position: Vec::new(),
        velocity: vec![(scene.contacts[contact].tangential, 1.0)],
        constant: -scene.contacts[contact].slider_speed,
    }
}

/// The event functions that are active in `combination`, by contact.
pub(crate) fn event_functions(
    scene: &Scene,
    combination: &Combination,
) -> Result<Vec<EventFunction>, Error> {
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    let statuses = combination.statuses().iter().enumerate();
    let mut functions: Vec<EventFunction> = statuses
        .flat_map(|(contact, &status)| of_contact(scene, contact, status, &coupled))
        .collect();
    if let (Some(w), Some(forces), false) =
        (&scene.coordinates.delassus, &coupled, scene.dependents.is_empty())
    {
        let free = dependent_forces(scene, w, combination.statuses()).1.free;
        if free.ncols() > 0 {
            let kinematic = |trigger| matches!(trigger, EventKind::Velocity | EventKind::Impact);
            functions.retain(|function| kinematic(function.trigger));
            functions.extend(undetermined_functions(scene, combination, forces, &free)?);
            functions.sort_by_key(|function| function.contact);
        }
    }
    Ok(functions)
}

/// The event functions of one contact in a status; mass must not couple contacts.
pub(crate) fn functions_of_contact(
    scene: &Scene,
    contact: usize,
    status: Status,
) -> Vec<EventFunction> {
    of_contact(scene, contact, status, &None)
}

/// The event function by which `trigger` ends the status of one contact; for a sticking contact whose friction cone closes
/// it is that of the normal force. An orbit under loads in time ends with their period, and an orbit without events ends
/// where a contact turns.
pub(crate) fn ending(
    scene: &Scene,
    combination: &Combination,
    contact: usize,
    trigger: EventKind,
) -> Functional {
    if trigger == EventKind::Load {
        return phase_of_loads(scene);
    }
    if trigger == EventKind::Turn {
        let turning = vec![(scene.contacts[contact].tangential, 1.0)];
        return Functional { velocity: turning, ..Functional::default() };
    }
    if !scene.dependents.is_empty()
        && let Ok(functions) = event_functions(scene, combination)
        && let Some(found) = functions
            .into_iter()
            .find(|function| function.contact == contact && function.trigger == trigger)
    {
        return found.functional;
    }
    let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
    let status = combination.statuses()[contact];
    let mut functions = of_contact(scene, contact, status, &coupled).into_iter();
    functions.find(|function| function.trigger == trigger).map_or_else(
        || match coupled {
            Some(mut forces) => forces.swap_remove(contact).1,
            None if status.is_closed() => reaction(scene, scene.contacts[contact].normal),
            None => Functional::default(),
        },
        |function| function.functional,
    )
}

/// `-sin(w t)` of the first oscillator, which vanishes at every period of the loads.
fn phase_of_loads(scene: &Scene) -> Functional {
    let clock = scene.drive.iter().flat_map(|drive| &drive.oscillators).take(1);
    let mut clock = clock.map(|one| (one.coordinate, one.phase.sin_cos(), one.rate)).peekable();
    let position = clock.peek().map(|&(h, (sine, _), _)| (h, sine));
    let velocity = clock.map(|(h, (_, cosine), rate)| (h, cosine / rate));
    Functional {
        position: position.into_iter().collect(),
        velocity: velocity.collect(),
        constant: 0.0,
    }
}

/// The event functions of one contact; `coupled` holds the forces of all contacts if mass couples them.
fn of_contact(
    scene: &Scene,
    contact: usize,
    status: Status,
    coupled: &Option<Vec<(Functional, Functional)>>,
) -> Vec<EventFunction> {
    let law = &scene.contacts[contact];
    let function = |trigger, functional| EventFunction { contact, trigger, functional };
    let (friction, normal) = match coupled {
        _ if !status.is_closed() => Default::default(),
        Some(forces) => forces[contact].clone(),
        None => (reaction(scene, law.tangential), reaction(scene, law.normal)),
    };
    match status {
        Status::Positive | Status::Negative => {
            let sign = -status.friction_sign();
            let slip = (law.static_friction > 0.0)
                .then(|| function(EventKind::Velocity, slip_velocity(scene, contact).scaled(sign)));
            // A given normal force does not vanish.
            let opens = law.directions != Directions::Tangential;
            let release = opens.then(|| function(EventKind::Release, normal));
            slip.into_iter().chain(release).collect()
        }
        Status::Sticking => {
            let cone = |sign: f64| {
                let parts = [(law.static_friction, &normal), (sign, &friction)];
                Functional::sum(parts.into_iter())
            };
            vec![
                function(EventKind::SlipPositive, cone(-1.0)),
                function(EventKind::SlipNegative, cone(1.0)),
            ]
        }
        Status::Detached => {
            let gap = Functional { position: vec![(law.normal, 1.0)], ..Functional::default() };
            let trigger = match law.normal_has_mass() {
                true => EventKind::Impact,
                false => EventKind::Closing,
            };
            vec![function(trigger, gap)]
        }
    }
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
    let scene = &*scene.at_slip(u);
    if scene.contacts_coupled() {
        let forces = contact_forces(scene, combination);
        return forces.iter().map(|(t, n)| (n.value(q, u), t.value(q, u))).collect();
    }
    let statuses = combination.statuses().iter().enumerate();
    statuses.map(|(contact, &status)| contact_force(scene, contact, status, q, u)).collect()
}
