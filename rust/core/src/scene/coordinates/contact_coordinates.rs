//! Contact coordinates: a basis of the space of x in which every slip and every gap is a coordinate.
//!
//! With D the matrix of contact directions, `x = P q_c + Z q_f`, where `P = M^-1 D (D' M^-1 D)^-1`
//! and the columns of Z span the null space of D'. Then `D' x = q_c`, and `Z' M P = Z' D (..) = 0`:
//! no free coordinate is coupled to a contact coordinate by mass, whatever M is. What is left is the
//! contact block `(D' M^-1 D)^-1`; contacts are *uncoupled* when it is diagonal.
//!
//! Only dofs that a direction or the mass joins depend on each other here. Each such group is transformed by itself, so
//! that sparse matrices stay sparse: lumped masses and contacts on single dofs are their own coordinates, and a contact
//! between two nodes mixes the dofs of these two. A sparse mass, as of consistent finite elements, joins all dofs of a
//! mesh; but `M^-1` decays from node to node, and entries of P below rounding of their column are left out. This changes
//! no equation: T is taken as it then is, and `Z' M P` is as small as rounding makes it anyway.
//!
//! Directions that depend on others are no coordinates of x: a largest independent set of them is, normal directions
//! first, and the others follow. Each of the others gets a coordinate beyond those of the dofs, on which no matrix acts, and
//! so does a direction that a contact lacks.

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::linalg::components::components;
use crate::linalg::dense::is_diagonal;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::coordinates::group::{Group, Row, factors_of, largest_independent};
use crate::scene::dependent::slaved_coordinates::{Slaved, SlavedCoordinates};

/// The change of basis `x = T q`.
#[derive(Debug, Clone)]
pub struct Coordinates {
    /// (tangential, normal) coordinate of each contact.
    pub slots: Vec<(usize, usize)>,
    /// Number of directions that contacts lack; their coordinates are the last ones.
    pub missing: usize,
    /// The directions that depend on others, as sums of these; their coordinates are the last ones.
    pub dependents: SlavedCoordinates,
    /// Whether mass couples a normal direction with a tangential one: `n' M^-1 t` is not zero for all pairs of them, so that an
    /// impulse along the one changes the velocity along the other.
    pub oblique: bool,
    /// Whether no free coordinate is coupled to a contact coordinate by mass, as motions need it.
    pub decoupled: bool,
    dofs: usize,
    transform: Option<Transform>,
    /// `D' M^-1 D` over (tangential, normal) of each contact, when mass couples contact coordinates with each other or
    /// directions depend on each other; `None` when it is diagonal.
    pub delassus: Option<DMatrix<f64>>,
}

/// T, its transpose and its inverse.
#[derive(Debug, Clone)]
struct Transform {
    forward: SparseMatrix,
    transposed: SparseMatrix,
    inverse: SparseMatrix,
}

impl Transform {
    /// None of the identity.
    fn new(forward: SparseMatrix, inverse: impl FnOnce() -> SparseMatrix) -> Option<Self> {
        let moves = forward != SparseMatrix::diagonal(&vec![1.0; forward.size()]);
        moves.then(|| Self { transposed: forward.transposed(), inverse: inverse(), forward })
    }
}

/// The coordinates of (tangential, normal) of each contact, those of directions that it lacks behind the dofs. Both directions of
/// friction in a plane have the normal coordinate of the one that states it.
fn in_pairs(size: usize, contacts: &[ContactInput], slots: &[usize]) -> Vec<(usize, usize)> {
    let (mut own, mut beyond) = (slots.iter().copied(), size..);
    let mut next = |direction: &Option<Direction>| match direction {
        Some(_) => own.next(),
        None => beyond.next(),
    };
    let mut pairs = Vec::with_capacity(contacts.len());
    for law in contacts {
        let tangential = next(&law.tangential);
        let normal = if law.shares_normal(contacts) { Some(size) } else { next(&law.normal) };
        pairs.extend(tangential.zip(normal));
    }
    for (contact, law) in contacts.iter().enumerate().filter(|(_, law)| law.shares_normal(contacts))
    {
        law.beside.iter().for_each(|&beside| pairs[contact].1 = pairs[beside].1);
    }
    pairs
}

/// Number of directions that contacts lack and share with no other one.
fn missing(contacts: &[ContactInput]) -> usize {
    let lacks = |law: &ContactInput| {
        let normal = law.normal.is_none() && !law.shares_normal(contacts);
        usize::from(law.tangential.is_none()) + usize::from(normal)
    };
    contacts.iter().map(lacks).sum()
}

impl Coordinates {
    /// `mass` is symmetric and positive definite.
    pub fn new(mass: &SparseMatrix, contacts: &[ContactInput]) -> Result<Self, Error> {
        let size = mass.size();
        let stated: Vec<Option<&Direction>> = contacts
            .iter()
            .flat_map(|contact| [contact.tangential.as_ref(), contact.normal.as_ref()])
            .collect();
        // Place of each direction among (tangential, normal) of all contacts.
        let whose: Vec<usize> = (0..stated.len()).filter(|&k| stated[k].is_some()).collect();
        let directions: Vec<Vec<(usize, f64)>> =
            stated.iter().flatten().map(|direction| direction.nonzero()).collect();
        let count = directions.len();
        let mut along: Vec<Vec<usize>> = vec![Vec::new(); size];
        for (index, direction) in directions.iter().enumerate() {
            direction.iter().for_each(|&(dof, _)| along[dof].push(index));
        }
        let groups = components(size, |dof, found| {
            found.extend(mass.row(dof).map(|entry| entry.0));
            found
                .extend(along[dof].iter().flat_map(|&k| directions[k].iter().map(|entry| entry.0)));
        });
        let mut slots = vec![0; count];
        // Directions that depend on others, with these and their factors.
        let mut sums: Vec<(usize, Vec<(usize, f64)>)> = Vec::new();
        // The group of a dof and its row there.
        let mut place: Vec<Option<(usize, usize)>> = vec![None; size];
        let mut transformed: Vec<(Vec<usize>, Vec<usize>, Group)> = Vec::new();
        for dofs in groups {
            let mut own: Vec<usize> =
                dofs.iter().flat_map(|&dof| along[dof].iter().copied()).collect();
            own.sort_unstable();
            own.dedup();
            if own.is_empty() {
                continue;
            }
            let own_row = |dof: usize| dofs.partition_point(|&other| other < dof);
            let along: Vec<Row> = own
                .iter()
                .map(|&index| {
                    directions[index].iter().map(|&(dof, entry)| (own_row(dof), entry)).collect()
                })
                .collect();
            let lacking = dofs.iter().filter(|&&dof| mass.get(dof, dof) == 0.0).count();
            if lacking > 0 && lacking < dofs.len() {
                let reason = "its directions tie dofs with mass to dofs without; give all of them mass, or none";
                return Err(Error::MixedMass { contact: whose[own[0]] / 2, reason });
            }
            let group_of = |along: &[Row]| match lacking {
                0 => Group::new(&mass.restricted(&dofs), along),
                _ => Group::massless(dofs.len(), along),
            };
            let group = match group_of(&along) {
                Some(group) => group,
                None => {
                    let mut d = DMatrix::zeros(dofs.len(), own.len());
                    for (j, direction) in along.iter().enumerate() {
                        direction.iter().for_each(|&(row, entry)| d[(row, j)] = entry);
                    }
                    let (base, others) = largest_independent(&d, |j| whose[own[j]] % 2 == 1);
                    let basis = d.select_columns(&base);
                    for &j in &others {
                        let factors = factors_of(&basis, &d.column(j).into_owned());
                        let terms = base.iter().map(|&i| own[i]).zip(factors);
                        sums.push((own[j], terms.filter(|term| term.1 != 0.0).collect()));
                    }
                    let chosen: Vec<Row> = base.iter().map(|&j| along[j].clone()).collect();
                    own = base.into_iter().map(|j| own[j]).collect();
                    let contact = whose[own[0]] / 2;
                    group_of(&chosen).ok_or(Error::AlmostDependentDirections { contact })?
                }
            };
            own.iter().zip(&group.slots).for_each(|(&index, &slot)| slots[index] = dofs[slot]);
            dofs.iter()
                .enumerate()
                .for_each(|(row, &dof)| place[dof] = Some((transformed.len(), row)));
            transformed.push((dofs, own, group));
        }
        let rows = |of: fn(&Group) -> &[Row]| {
            SparseMatrix::from_rows(size, |dof, entries| match place[dof] {
                None => entries.push((dof, 1.0)),
                Some((index, row)) => {
                    let (dofs, _, group) = &transformed[index];
                    entries.extend(of(group)[row].iter().map(|&(k, entry)| (dofs[k], entry)));
                }
            })
        };
        let transform =
            Transform::new(rows(|group| &group.forward), || rows(|group| &group.inverse));
        let coupled = transformed.iter().any(|(_, _, group)| !is_diagonal(&group.delassus));
        let oblique = transformed.iter().any(|(_, own, group)| {
            let is_normal = |k: usize| whose[own[k]] % 2 == 1;
            let mut pairs = (0..own.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            pairs.any(|(i, j)| is_normal(i) != is_normal(j) && group.delassus[(i, j)] != 0.0)
        });
        let missing = missing(contacts);
        let sum = |(k, (index, terms)): (usize, &(usize, Row))| {
            let coordinate = size + missing + k;
            slots[*index] = coordinate;
            let terms = terms.iter().map(|&(i, factor)| (slots[i], factor)).collect();
            Slaved { coordinate, constant: 0.0, terms }
        };
        let dependents = SlavedCoordinates::new(sums.iter().enumerate().map(sum).collect());
        let delassus = (coupled || !sums.is_empty()).then(|| {
            // A direction that a contact lacks is coupled with none.
            let mut whole = DMatrix::identity(stated.len(), stated.len());
            sums.iter().for_each(|(index, _)| whole[(whose[*index], whose[*index])] = 0.0);
            for (_, own, group) in &transformed {
                for (i, j) in (0..own.len()).flat_map(|i| (0..own.len()).map(move |j| (i, j))) {
                    whole[(whose[own[i]], whose[own[j]])] = group.delassus[(i, j)];
                }
            }
            if sums.is_empty() {
                return whole;
            }
            let mut spread = DMatrix::identity(stated.len(), stated.len());
            for (index, terms) in &sums {
                spread[(whose[*index], whose[*index])] = 0.0;
                terms.iter().for_each(|&(i, w)| spread[(whose[*index], whose[i])] = w);
            }
            &spread * whole * spread.transpose()
        });
        Ok(Self {
            slots: in_pairs(size, contacts, &slots),
            missing,
            dependents,
            oblique,
            decoupled: true,
            dofs: size,
            transform,
            delassus,
        })
    }

    /// Contact coordinates that leave matrices sparse; mass couples them with others, so that they are for rest and small
    /// motions alone. None where directions depend on each other, or every direction is along a dof.
    pub fn sparse(size: usize, contacts: &[ContactInput]) -> Option<Self> {
        let stated: Vec<Option<&Direction>> = contacts
            .iter()
            .flat_map(|contact| [contact.tangential.as_ref(), contact.normal.as_ref()])
            .collect();
        let directions: Vec<Row> =
            stated.iter().flatten().map(|direction| direction.nonzero()).collect();
        let (slots, [forward, inverse]) = Group::sparse(size, &directions)?;
        let rows =
            |of: &[Row]| SparseMatrix::from_rows(size, |dof, entries| entries.extend(&of[dof]));
        Some(Self {
            slots: in_pairs(size, contacts, &slots),
            missing: missing(contacts),
            dependents: SlavedCoordinates::default(),
            oblique: false,
            decoupled: false,
            dofs: size,
            transform: Some(Transform::new(rows(&forward), || rows(&inverse))?),
            delassus: None,
        })
    }

    /// Contact coordinates themselves, `size` of them, with the contacts' (tangential, normal).
    pub fn of_contacts(
        size: usize,
        slots: Vec<(usize, usize)>,
        delassus: Option<DMatrix<f64>>,
        oblique: bool,
    ) -> Self {
        let delassus = delassus.filter(|delassus| !is_diagonal(delassus));
        Self {
            slots,
            missing: 0,
            dependents: SlavedCoordinates::default(),
            oblique: oblique && delassus.is_some(),
            decoupled: true,
            dofs: size,
            transform: None,
            delassus,
        }
    }

    /// `T' matrix T`
    pub fn transformed(&self, matrix: SparseMatrix) -> SparseMatrix {
        match &self.transform {
            None => matrix,
            Some(transform) => matrix.transformed(&transform.forward),
        }
        .padded(self.size())
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.dofs + self.missing + self.dependents.len()
    }

    /// The same of a symmetric matrix.
    pub fn congruent(&self, matrix: SparseMatrix) -> SparseMatrix {
        match &self.transform {
            None => matrix,
            Some(transform) => matrix.congruent(&transform.forward),
        }
        .padded(self.size())
    }

    /// Column `slot` of T: the displacement of the dofs when that coordinate moves by one, and the factors by which forces on
    /// the dofs give the force along the contact direction of that coordinate. Zero if the contact lacks this direction.
    pub fn column(&self, slot: usize, size: usize) -> Vec<f64> {
        let mut column = vec![0.0; size];
        if slot >= self.dofs {
            return column;
        }
        match &self.transform {
            None => column[slot] = 1.0,
            Some(transform) => {
                transform.transposed.row(slot).for_each(|(dof, entry)| column[dof] = entry);
            }
        }
        column
    }

    /// A vector times one of the matrices of T.
    fn applied(&self, of: fn(&Transform) -> &SparseMatrix, x: &[f64]) -> Vec<f64> {
        self.transform.as_ref().map_or_else(|| x.to_vec(), |transform| of(transform).apply(x))
    }

    /// `T q`
    pub fn to_dofs(&self, q: &[f64]) -> Vec<f64> {
        self.applied(|transform| &transform.forward, &q[..self.dofs])
    }

    /// `T^-1 x`
    pub fn of_dofs(&self, x: &[f64]) -> Vec<f64> {
        let mut q = self.applied(|transform| &transform.inverse, x);
        q.resize(self.size(), 0.0);
        self.dependents.follow_rates(&mut q);
        q
    }

    /// `T' f`: forces on the coordinates from forces on the dofs.
    pub fn forces_of_dofs(&self, force: &[f64]) -> Vec<f64> {
        let mut forces = self.applied(|transform| &transform.transposed, force);
        forces.resize(self.size(), 0.0);
        forces
    }
}
