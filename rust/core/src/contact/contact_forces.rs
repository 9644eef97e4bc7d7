//! The forces of contacts as functionals of the state, and their values.

use nalgebra::{DMatrix, DVector};

use crate::contact::functional::Functional;
use crate::contact::problem::dependent::Forces;
use crate::contact::problem::held_rows::held_rows;
use crate::linalg::dense::Factors;
use crate::scene::contact_law::Contact;
use crate::scene::friction::contact_state::StateContact;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

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

/// The reaction of a held coordinate, and its rate in a combination in which nothing nonlinear moves it.
pub(crate) fn pressing(scene: &Scene, combination: &Combination, row: usize) -> [Functional; 2] {
    let (position, velocity, constant) = scene.reaction_rate(combination, row);
    [reaction(scene, row), Functional { position, velocity, constant }]
}

/// The contact forces of one combination, in one state after the other.
#[derive(Debug)]
pub(crate) struct ContactForces {
    pub combination: Combination,
    /// (T, N) by contact, where mass couples contacts.
    coupled: Option<Vec<(Functional, Functional)>>,
}

impl ContactForces {
    pub fn new(scene: &Scene, combination: &Combination) -> Self {
        let coupled = scene.contacts_coupled().then(|| contact_forces(scene, combination));
        Self { combination: combination.clone(), coupled }
    }

    /// (N, T) of every contact in state (q, q'). Under laws of friction over slip speed, beside elements, and in planes where
    /// contacts are coupled, the state changes the forces per reaction.
    pub fn values(&self, scene: &Scene, q: &[f64], u: &[f64]) -> Vec<(f64, f64)> {
        let has_laws = scene.laws.is_some() || scene.nonlinear_elements().next().is_some();
        if has_laws || (self.coupled.is_some() && scene.has_planes()) {
            return contact_forces_in(scene, &self.combination, q, u);
        }
        if let Some(forces) = &self.coupled {
            return forces.iter().map(|(t, n)| (n.value(q, u), t.value(q, u))).collect();
        }
        let value = |(law, &status): (&Contact, &Status)| {
            if !status.is_closed() {
                return (0.0, 0.0);
            }
            let normal = scene.reaction_value(law.normal, q, u);
            let friction = match status {
                Status::Sticking => scene.reaction_value(law.tangential, q, u),
                _ => law.friction_at(status, u) * law.friction * normal,
            };
            (normal, friction)
        };
        scene.contacts.iter().zip(self.combination.statuses()).map(value).collect()
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
    if scene.drive.is_some() && scene.has_dependent_directions() {
        carry_along(scene, w, statuses, &mut forces);
    }
    forces
}

/// (N, T) of every contact in state (q, q') of a combination.
pub(crate) fn contact_forces_in(
    scene: &Scene,
    combination: &Combination,
    q: &[f64],
    u: &[f64],
) -> Vec<(f64, f64)> {
    let in_state = &*scene.in_state(combination, q, u);
    let mut forces = ContactForces::new(in_state, combination).values(in_state, q, u);
    for (contact, force) in forces.iter_mut().enumerate() {
        let closed = combination.statuses()[contact].is_closed();
        let in_state = |own: &StateContact| own.normal.is_none() || own.law.is_spring();
        let known = closed && scene.state_of(contact).is_some_and(in_state);
        let own = || scene.of_state(contact, combination, q, u);
        if let Some(own) = known.then(own).flatten() {
            force.1 = own.friction;
        }
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
    if scene.has_dependent_directions() {
        let (held, found) = dependent_forces(scene, w, statuses);
        return found.of_rows * w.select_rows(&held);
    }
    // An equation for each force (T, N): its entry of a vanishes, or another force gives it.
    let mut matrix = DMatrix::identity(w.nrows(), w.nrows());
    let mut rows = Vec::new();
    for held in held_rows(statuses, |i| scene.contacts[i].friction) {
        matrix.set_row(held.row, &w.row(held.row));
        held.forces().skip(1).for_each(|(row, factor)| matrix[(row, held.row)] = -factor);
        rows.push(held.row);
    }
    for contacts in scene.planes().filter(|&[first, _]| statuses[first].is_closed()) {
        let normal = 2 * contacts[0] + 1;
        for contact in contacts {
            let law = &scene.contacts[contact];
            if statuses[contact] == Status::Slipping {
                let factor = law.friction_along(Status::Slipping) * law.friction;
                matrix[(2 * contact, normal)] = -factor;
            }
            if law.shares_normal() {
                let shared = 2 * contact + 1;
                rows.retain(|&row| row != shared);
                (matrix[(shared, shared)], matrix[(shared, normal)]) = (1.0, -1.0);
            }
        }
    }
    let mut held = DMatrix::zeros(w.nrows(), w.nrows());
    rows.into_iter().for_each(|row| held.set_row(row, &w.row(row)));
    Factors::new(matrix).solve(held)
}

/// (T, N) of every contact as sums of the reactions (T, N) of all.
fn force_functionals(
    rows: &[(Functional, Functional)],
    map: &DMatrix<f64>,
) -> Vec<(Functional, Functional)> {
    let parts: Vec<&Functional> = rows.iter().flat_map(|(t, n)| [t, n]).collect();
    let mut terms =
        [sums_of(&parts, |part| &part.position, map), sums_of(&parts, |part| &part.velocity, map)];
    let mut force = |k: usize| {
        let constants = parts.iter().enumerate().map(|(j, part)| map[(k, j)] * part.constant);
        let [position, velocity] = terms.each_mut().map(|of| std::mem::take(&mut of[k]));
        Functional { position, velocity, constant: constants.sum() }
    };
    (0..rows.len()).map(|i| (force(2 * i), force(2 * i + 1))).collect()
}

/// `sum_j map_kj terms_j` for every k. Nearly all parts have the same coordinates where many contacts are coupled, so that
/// each has a dense column of those that any of them has.
fn sums_of(
    parts: &[&Functional],
    terms: fn(&Functional) -> &Vec<(usize, f64)>,
    map: &DMatrix<f64>,
) -> Vec<Vec<(usize, f64)>> {
    let mut coordinates: Vec<usize> =
        parts.iter().flat_map(|part| terms(part)).map(|term| term.0).collect();
    coordinates.sort_unstable();
    coordinates.dedup();
    let mut dense = DMatrix::zeros(coordinates.len(), parts.len());
    for (mut column, part) in dense.column_iter_mut().zip(parts) {
        let mut place = 0;
        for &(k, weight) in terms(part) {
            place += coordinates[place..].partition_point(|&other| other < k);
            column[place] += weight;
        }
    }
    let sum = |k: usize| {
        let mut sums = DVector::zeros(coordinates.len());
        for (j, column) in dense.column_iter().enumerate().filter(|&(j, _)| map[(k, j)] != 0.0) {
            sums.axpy(map[(k, j)], &column, 1.0);
        }
        let terms = coordinates.iter().copied().zip(sums.iter().copied());
        terms.filter(|term| term.1 != 0.0).collect()
    };
    (0..map.nrows()).map(sum).collect()
}

/// Where directions depend on each other: the rows, (tangential, normal) of each contact, that statuses hold, and the
/// forces (T, N) of all contacts by what these rows need.
pub(super) fn dependent_forces(
    scene: &Scene,
    w: &DMatrix<f64>,
    statuses: &[Status],
) -> (Vec<usize>, Forces) {
    Forces::of_statuses(w, statuses, |i| scene.contacts[i].friction)
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

/// The change of the forces (T, N) of all contacts per newton of each force that is no linear function of the state, a column for
/// each: the friction that laws add, of the contacts that slide by laws, and then the elements of the scene. None where no such
/// force changes a contact force.
pub(crate) fn response(scene: &Scene, combination: &Combination) -> Option<DMatrix<f64>> {
    let statuses = combination.statuses();
    // The rate of a state changes no force of a contact.
    let forces = |(contact, _)| {
        let count = scene.state_of(contact).map_or(1, StateContact::forces);
        (0..count).map(move |place| (place == 0).then_some(contact))
    };
    let laws: Vec<Option<usize>> = scene.sliding_by_law(combination).flat_map(forces).collect();
    let by_law = friction_response(scene, combination);
    let count = scene.contacts.len();
    let loads = scene.nonlinear_elements_in(combination).map(|(_, one)| {
        let entry = |k: usize| {
            let own = one.direction.iter().filter(|term| term.0 == k);
            own.map(|term| term.1).sum::<f64>()
        };
        let rows = scene.contacts.iter().flat_map(|law| [law.tangential, law.normal]);
        // The force of an element is a load less, and so a reaction more.
        DVector::from_iterator(2 * count, rows.map(entry))
    });
    let loads: Vec<DVector<f64>> = loads.collect();
    let map = match &scene.coordinates.delassus {
        Some(w) => force_map(scene, w, statuses),
        None => {
            let mut map = DMatrix::zeros(2 * count, 2 * count);
            for (i, (law, &status)) in scene.contacts.iter().zip(statuses).enumerate() {
                let [t, n] = [2 * i, 2 * i + 1];
                match status {
                    Status::Detached => continue,
                    Status::Sticking => map[(t, t)] = 1.0,
                    _ => map[(t, n)] = status.friction_sign() * law.friction,
                }
                map[(n, n)] = 1.0;
            }
            map
        }
    };
    let mut all = DMatrix::zeros(2 * count, laws.len() + loads.len());
    if let Some(by_law) = by_law {
        for (j, &i) in laws.iter().enumerate() {
            let Some(i) = i else { continue };
            // Of bristles a unit of y is a force along the slip, whatever the direction of that.
            let along = scene
                .state_of(i)
                .map_or(1.0, |own| statuses[i].friction_sign() * own.directions()[0].1);
            all.set_column(j, &(along * by_law.column(i)));
        }
    }
    for (j, load) in loads.iter().enumerate() {
        all.set_column(laws.len() + j, &(&map * load));
    }
    // The friction of a contact that slips takes no load along it.
    all.iter().any(|&entry| entry != 0.0).then_some(all)
}

/// The contacts whose forces nothing determines in a combination, because directions of closed contacts depend on each
/// other.
pub fn undetermined(scene: &Scene, combination: &Combination) -> Vec<usize> {
    let Some(free) = free_forces(scene, combination) else { return Vec::new() };
    let moved = |row: usize| free.row(row).iter().any(|&part| part != 0.0);
    (0..scene.contacts.len()).filter(|&i| moved(2 * i) || moved(2 * i + 1)).collect()
}

/// Forces (T, N) of all contacts that nothing determines, one column for each; None where no directions depend on each other.
pub(crate) fn free_forces(scene: &Scene, combination: &Combination) -> Option<DMatrix<f64>> {
    let w = scene.coordinates.delassus.as_ref().filter(|_| scene.has_dependent_directions())?;
    Some(dependent_forces(scene, w, combination.statuses()).1.free)
}
