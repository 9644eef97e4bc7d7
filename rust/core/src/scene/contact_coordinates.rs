//! Contact coordinates: a basis of the space of x in which every slip and every gap is a coordinate.
//!
//! With D the matrix of contact directions, `x = P q_c + Z q_f`, where `P = M^-1 D (D' M^-1 D)^-1`
//! and the columns of Z span the null space of D'. Then `D' x = q_c`, and `Z' M P = Z' D (..) = 0`:
//! no free coordinate is coupled to a contact coordinate by mass, whatever M is. What is left is the
//! contact block `(D' M^-1 D)^-1`; contacts are *uncoupled* when it is diagonal. For lumped masses and
//! contacts on single dofs all of this is the identity, and nothing is transformed.

use faer::Mat;
use faer::prelude::*;

use crate::error::Error;
use crate::scene::contact_law::{ContactInput, Direction, INDEPENDENCE};

/// Relative size below which a coupling of contact directions by mass is rounding of `D' M^-1 D`.
const COUPLING_ROUNDING: f64 = 1e-13;

/// The change of basis `x = T q`.
#[derive(Debug, Clone)]
pub struct Coordinates {
    /// (tangential, normal) coordinate of each contact.
    pub slots: Vec<(usize, usize)>,
    /// `T` and its inverse, row-major; `None` is the identity.
    transform: Option<(Vec<f64>, Vec<f64>)>,
    /// `D' M^-1 D` over (tangential, normal) of each contact, row-major, when mass couples contact
    /// coordinates with each other; `None` when it is diagonal.
    pub delassus: Option<Vec<f64>>,
}

impl Coordinates {
    /// `mass` is row-major, symmetric positive definite; `lumped` says that it is diagonal.
    pub fn new(
        size: usize,
        lumped: bool,
        mass: impl Fn() -> Vec<f64>,
        contacts: &[ContactInput],
    ) -> Result<Self, Error> {
        let directions: Vec<&Direction> =
            contacts.iter().flat_map(|contact| [&contact.tangential, &contact.normal]).collect();
        let slots = choose_slots(size, &directions)?;
        let pairs = slots.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        let nodal =
            directions.iter().all(|direction| matches!(direction.single_dof(), Some((_, 1.0))));
        if nodal && lumped {
            return Ok(Self { slots: pairs, transform: None, delassus: None });
        }
        let directions: Vec<Vec<f64>> =
            directions.iter().map(|direction| direction.entries(size)).collect();
        Ok(Self::general(size, &mass(), &directions, &slots, pairs))
    }

    fn general(
        size: usize,
        mass: &[f64],
        directions: &[Vec<f64>],
        slots: &[usize],
        pairs: Vec<(usize, usize)>,
    ) -> Self {
        let count = directions.len();
        let mass = Mat::from_fn(size, size, |i, j| mass[i * size + j]);
        let d = Mat::from_fn(size, count, |i, j| directions[j][i]);
        let inverse_mass_d = mass.partial_piv_lu().solve(&d);
        let mut delassus = d.transpose() * &inverse_mass_d;
        let mut coupled = false;
        for i in 0..count {
            for j in 0..i {
                let scale = (delassus[(i, i)] * delassus[(j, j)]).sqrt();
                if delassus[(i, j)].abs() <= COUPLING_ROUNDING * scale {
                    delassus[(i, j)] = 0.0;
                    delassus[(j, i)] = 0.0;
                } else {
                    coupled = true;
                }
            }
        }
        let contact_mass = delassus.partial_piv_lu().solve(Mat::<f64>::identity(count, count));
        let p = &inverse_mass_d * &contact_mass;

        // Z: unit in one free dof each, the slot dofs follow from D' x = 0.
        let free: Vec<usize> = (0..size).filter(|dof| !slots.contains(dof)).collect();
        let d_slots = Mat::from_fn(count, count, |i, j| directions[i][slots[j]]);
        let d_free = Mat::from_fn(count, free.len(), |i, j| directions[i][free[j]]);
        let followers = d_slots.partial_piv_lu().solve(&d_free);

        let mut forward = vec![0.0; size * size];
        for (j, &slot) in slots.iter().enumerate() {
            for i in 0..size {
                forward[i * size + slot] = p[(i, j)];
            }
        }
        for (j, &dof) in free.iter().enumerate() {
            forward[dof * size + dof] = 1.0;
            for (i, &slot) in slots.iter().enumerate() {
                forward[slot * size + dof] = -followers[(i, j)];
            }
        }
        // q_c = D' x; q_f = x_f - P_f D' x.
        let mut inverse = vec![0.0; size * size];
        for (j, &slot) in slots.iter().enumerate() {
            for i in 0..size {
                inverse[slot * size + i] = directions[j][i];
            }
        }
        for &dof in &free {
            inverse[dof * size + dof] += 1.0;
            for j in 0..count {
                for i in 0..size {
                    inverse[dof * size + i] -= p[(dof, j)] * directions[j][i];
                }
            }
        }
        let identity =
            (0..size * size).all(|k| forward[k] == if k / size == k % size { 1.0 } else { 0.0 });
        Self {
            slots: pairs,
            transform: (!identity).then_some((forward, inverse)),
            delassus: coupled
                .then(|| (0..count * count).map(|k| delassus[(k / count, k % count)]).collect()),
        }
    }

    /// Contact coordinates themselves, with the contacts' (tangential, normal).
    pub fn of_contacts(slots: Vec<(usize, usize)>, delassus: Option<Vec<f64>>) -> Self {
        Self { slots, transform: None, delassus }
    }

    /// T, row-major, unless it is the identity.
    pub fn transform(&self) -> Option<&[f64]> {
        self.transform.as_ref().map(|pair| pair.0.as_slice())
    }

    /// Column `slot` of T: how the dofs move where that coordinate moves by one, and how a force along the contact
    /// direction of that coordinate is told from forces on the dofs.
    pub fn column(&self, slot: usize, size: usize) -> Vec<f64> {
        match &self.transform {
            None => (0..size).map(|dof| f64::from(u8::from(dof == slot))).collect(),
            Some((forward, _)) => (0..size).map(|dof| forward[dof * size + slot]).collect(),
        }
    }

    /// `T q`
    pub fn to_dofs(&self, q: &[f64]) -> Vec<f64> {
        match &self.transform {
            None => q.to_vec(),
            Some((forward, _)) => product(forward, q),
        }
    }

    /// `T^-1 x`
    pub fn of_dofs(&self, x: &[f64]) -> Vec<f64> {
        match &self.transform {
            None => x.to_vec(),
            Some((_, inverse)) => product(inverse, x),
        }
    }

    /// `T' f`: forces on the coordinates from forces on the dofs.
    pub fn forces_of_dofs(&self, force: &[f64]) -> Vec<f64> {
        match &self.transform {
            None => force.to_vec(),
            Some((forward, _)) => {
                let n = force.len();
                (0..n).map(|j| (0..n).map(|i| forward[i * n + j] * force[i]).sum()).collect()
            }
        }
    }
}

fn product(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(x.len()).map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
}

/// Gives each direction a dof of its own by elimination with complete pivoting, which also shows
/// whether the directions are independent. A direction along one dof gets that dof.
fn choose_slots(size: usize, directions: &[&Direction]) -> Result<Vec<usize>, Error> {
    if directions.len() > size {
        return Err(Error::TooManyDirections { contacts: directions.len() / 2, dofs: size });
    }
    let dependent = |index: usize| Error::DependentDirection {
        contact: index / 2,
        direction: if index.is_multiple_of(2) { "tangential" } else { "normal" },
    };
    let mut slots = vec![usize::MAX; directions.len()];
    let mut taken = vec![false; size];
    // Directions along single dofs need no elimination: with a thousand contacts it would be too slow.
    let mut remaining: Vec<(usize, f64, Vec<f64>)> = Vec::new();
    for (index, direction) in directions.iter().enumerate() {
        match direction.single_dof() {
            Some((dof, _)) if taken[dof] => return Err(dependent(index)),
            Some((dof, _)) => {
                taken[dof] = true;
                slots[index] = dof;
            }
            None => {
                let part = direction.entries(size);
                let norm = part.iter().fold(0.0, |norm: f64, entry| norm.max(entry.abs()));
                remaining.push((index, norm, part));
            }
        }
    }
    for (_, _, part) in &mut remaining {
        part.iter_mut().zip(&taken).filter(|pair| *pair.1).for_each(|pair| *pair.0 = 0.0);
    }
    while !remaining.is_empty() {
        let (position, slot, pivot) = remaining
            .iter()
            .enumerate()
            .map(|(position, (_, norm, part))| {
                let (slot, entry) = part
                    .iter()
                    .enumerate()
                    .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
                    .map_or((0, 0.0), |(slot, entry)| (slot, entry.abs()));
                (position, slot, if *norm > 0.0 { entry / norm } else { 0.0 })
            })
            .max_by(|a, b| a.2.total_cmp(&b.2))
            .unwrap_or((0, 0, 0.0));
        let (index, _, pivot_row) = remaining.swap_remove(position);
        if pivot <= INDEPENDENCE {
            return Err(dependent(index));
        }
        slots[index] = slot;
        for (_, _, part) in &mut remaining {
            let factor = part[slot] / pivot_row[slot];
            part.iter_mut().zip(&pivot_row).for_each(|(entry, pivot)| *entry -= factor * pivot);
            part[slot] = 0.0;
        }
    }
    Ok(slots)
}
