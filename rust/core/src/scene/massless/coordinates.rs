//! Coordinates without mass: the nodes of compliant contacts, and dofs to which a scene gives no mass.
//!
//! They have no damping either, so that they follow the others at once: with `K_bb` positive definite,
//!
//! ```text
//! q_b = Y (F_b - K_bi q_i + B p),   Y = inv(K_bb)
//! ```
//!
//! p being the contact forces. A compliant contact is a node without mass, tied to the body by one spring along its
//! normal and one along its tangential direction; in its scene it is two more dofs, which its contact acts on.

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::linalg::components::components;
use crate::linalg::dense::{Factors, cholesky};
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::scene::contact_law::{Contact, ContactInput, Direction, Directions, Inertia};
use crate::scene::coordinates::contact_coordinates::Coordinates;

/// Roundings of one size that may add up in a sum over the coordinates of a group, for each of these.
const ROUNDING: f64 = 4.0;

/// The coordinates without mass, in groups that stiffness ties.
#[derive(Debug, Clone, Default)]
pub(crate) struct Massless {
    pub groups: Vec<Group>,
    /// Ascending.
    pub coordinates: Vec<usize>,
}

/// Coordinates without mass that follow each other.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    /// Ascending.
    pub coordinates: Vec<usize>,
    /// The contacts whose gap or slip is one of them, ascending.
    pub contacts: Vec<usize>,
    /// Y over the coordinates, m/N.
    pub flexibility: DMatrix<f64>,
}

impl Group {
    pub fn place(&self, coordinate: usize) -> Option<usize> {
        self.coordinates.binary_search(&coordinate).ok()
    }
}

impl Massless {
    /// The coordinates without mass of a scene with these matrices in contact coordinates.
    pub fn new(
        mass: &SparseMatrix,
        stiffness: &SparseMatrix,
        contacts: &[Contact],
        known: usize,
    ) -> Result<Self, Error> {
        // The coordinates beyond those that are `known` belong to directions that contacts lack.
        let size = mass.size();
        let lacks = |k: usize| k < known && mass.get(k, k) == 0.0;
        let coordinates: Vec<usize> = (0..size).filter(|&k| lacks(k)).collect();
        if coordinates.is_empty() {
            return Ok(Self::default());
        }
        let mut partner = vec![None; size];
        let both = |law: &&Contact| law.inertia == Inertia::None && lacks(law.normal);
        for law in contacts.iter().filter(both) {
            partner[law.tangential] = Some(law.normal);
            partner[law.normal] = Some(law.tangential);
        }
        let parts = components(size, |k, found| {
            if lacks(k) {
                found.extend(partner[k]);
                found.extend(stiffness.row(k).map(|entry| entry.0).filter(|&j| lacks(j)));
            }
        });
        let parts = parts.into_iter().filter(|part| lacks(part[0]));
        let groups = parts
            .map(|coordinates| {
                let block = stiffness.restricted(&coordinates).to_dense();
                let factor = cholesky(&block).map_err(|(row, pivot)| Error::FloatingBoundary {
                    coordinate: coordinates[row],
                    pivot,
                })?;
                let within = |law: &Contact| match (law.inertia, law.directions) {
                    (Inertia::None, _) => coordinates.contains(&law.tangential),
                    // The other direction of a plane has this normal coordinate.
                    (_, Directions::Tangential) => false,
                    _ => coordinates.contains(&law.normal),
                };
                let contacts = (0..contacts.len()).filter(|&i| within(&contacts[i])).collect();
                Ok(Group { flexibility: factor.inverse(), contacts, coordinates })
            })
            .collect::<Result<_, Error>>()?;
        Ok(Self { groups, coordinates })
    }

    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The same coordinates under another stiffness.
    pub fn with_stiffness(&self, stiffness: &SparseMatrix) -> Self {
        let flexible = |group: &Group| {
            let block = stiffness.restricted(&group.coordinates).to_dense();
            let unit = DMatrix::identity(block.nrows(), block.ncols());
            Group { flexibility: Factors::new(block).solve(unit), ..group.clone() }
        };
        let groups = self.groups.iter().map(flexible).collect();
        Self { groups, coordinates: self.coordinates.clone() }
    }

    /// The coordinates with mass that stiffness ties to these, ascending.
    pub fn neighbours(&self, stiffness: &SparseMatrix) -> Vec<usize> {
        let rows = self.coordinates.iter().flat_map(|&k| stiffness.row(k));
        let mut found: Vec<usize> = rows.map(|entry| entry.0).collect();
        found.sort_unstable();
        found.dedup();
        found.retain(|&k| !self.contains(k));
        found
    }

    /// `K_ii - K_ib Y K_bi`, with rows of zeros for the coordinates without mass: the stiffness while no contact acts on these.
    /// Coordinates from `structure` on carry loads, and nothing acts on them. Couplings that rounding of the entries of K may
    /// have made are left out.
    pub fn condensed(&self, stiffness: &SparseMatrix, structure: usize) -> SparseMatrix {
        let mut added: Vec<Vec<(usize, f64)>> = vec![Vec::new(); stiffness.size()];
        let mut rounding = added.clone();
        for group in &self.groups {
            let coupling = |row: usize| {
                stiffness.row(group.coordinates[row]).filter(|entry| !self.contains(entry.0))
            };
            let count = group.coordinates.len();
            let mut tied: Vec<usize> = (0..count).flat_map(coupling).map(|entry| entry.0).collect();
            tied.sort_unstable();
            tied.dedup();
            let mut rows = DMatrix::zeros(count, tied.len());
            for e in 0..count {
                for (k, value) in coupling(e) {
                    rows[(e, tied.partition_point(|&other| other < k))] = value;
                }
            }
            let followed = &group.flexibility * &rows;
            let pulled = rows.tr_mul(&followed);
            // `|dK_ib| |Y K_bi|` on both sides, and `|K_ib Y| |dK_bb| |Y K_bi|`.
            let own = stiffness.restricted(&group.coordinates).to_dense().abs();
            let sizes = followed.abs();
            let lost = sizes.tr_mul(&(own * &sizes + 2.0 * rows.abs()));
            let unit = ROUNDING * count as f64 * f64::EPSILON;
            for (i, &row) in tied.iter().enumerate().filter(|(_, row)| **row < structure) {
                // The same to the last bit in both triangles.
                let place = |j: usize| if i < j { (i, j) } else { (j, i) };
                let columns = || tied.iter().copied().enumerate();
                added[row].extend(columns().map(|(j, k)| (k, -pulled[place(j)])));
                rounding[row].extend(columns().map(|(j, k)| (k, unit * lost[place(j)])));
            }
        }
        SparseMatrix::from_rows(stiffness.size(), |row, entries| {
            if self.contains(row) {
                return;
            }
            entries.extend(stiffness.row(row).filter(|entry| !self.contains(entry.0)));
            let known = entries.iter().map(|&(k, value)| (k, f64::EPSILON * value.abs()));
            let mut lost: Vec<(usize, f64)> = known.collect();
            entries.append(&mut added[row]);
            lost.append(&mut rounding[row]);
            summed(entries);
            summed(&mut lost);
            let mut lost = lost.into_iter();
            entries.retain(|&(k, value)| {
                let lost = lost.next().map_or(0.0, |entry| entry.1);
                k == row || value.abs() > lost
            });
        })
    }

    pub fn contains(&self, coordinate: usize) -> bool {
        self.coordinates.binary_search(&coordinate).is_ok()
    }

    /// The same where some of the coordinates move by themselves: the flexibility of the others is that with these held.
    pub fn without(&self, moving: &[usize]) -> Self {
        let stays = |k: &usize| !moving.contains(k);
        let part = |group: &Group| {
            let places = 0..group.coordinates.len();
            let (kept, held): (Vec<usize>, Vec<usize>) =
                places.partition(|&place| stays(&group.coordinates[place]));
            let block =
                |i: &[usize], j: &[usize]| group.flexibility.select_rows(i).select_columns(j);
            let loosened = Factors::new(block(&held, &held)).solve(block(&held, &kept));
            Group {
                coordinates: kept.iter().map(|&place| group.coordinates[place]).collect(),
                contacts: group.contacts.clone(),
                flexibility: block(&kept, &kept) - block(&kept, &held) * loosened,
            }
        };
        let groups = self.groups.iter().map(part).filter(|group| !group.coordinates.is_empty());
        Self {
            groups: groups.collect(),
            coordinates: self.coordinates.iter().copied().filter(stays).collect(),
        }
    }

    /// The coordinates without mass of a part of a scene with these coordinates and contacts, both ascending.
    pub fn restricted(&self, coordinates: &[usize], contacts: &[usize]) -> Self {
        let places = |all: &[usize], of: &[usize]| -> Vec<usize> {
            all.iter().filter_map(|k| of.binary_search(k).ok()).collect()
        };
        let inside = |group: &&Group| coordinates.binary_search(&group.coordinates[0]).is_ok();
        let part = |group: &Group| Group {
            coordinates: places(&group.coordinates, coordinates),
            contacts: places(&group.contacts, contacts),
            flexibility: group.flexibility.clone(),
        };
        Self {
            groups: self.groups.iter().filter(inside).map(part).collect(),
            coordinates: places(&self.coordinates, coordinates),
        }
    }
}

/// The nodes of compliant contacts, and the states of contacts, as dofs behind those of a scene.
#[derive(Debug)]
pub(crate) struct Nodes {
    /// Dofs with the nodes.
    pub size: usize,
    /// (tangential, normal) dof of the node of each contact, where it has one.
    places: Vec<(Option<usize>, Option<usize>)>,
    springs: Vec<Spring>,
    /// Contacts with states, each with the hidden dof of its state.
    pub states: Vec<(usize, usize)>,
}

/// A spring of a compliant contact.
#[derive(Debug)]
struct Spring {
    /// Dof of the node.
    node: usize,
    /// On the body.
    direction: Vec<(usize, f64)>,
    stiffness: f64,
}

impl Nodes {
    pub fn new(size: usize, contacts: &[ContactInput]) -> Self {
        let mut nodes = Self { size, places: Vec::new(), springs: Vec::new(), states: Vec::new() };
        for law in contacts {
            let mut place = |direction: &Option<Direction>, stiffness: Option<f64>| {
                let (direction, stiffness) = (direction.as_ref()?, stiffness?);
                let direction = direction.nonzero();
                nodes.springs.push(Spring { node: nodes.size, direction, stiffness });
                nodes.size += 1;
                Some(nodes.size - 1)
            };
            let tangential = place(&law.tangential, law.springs.tangential);
            let normal = place(&law.normal, law.springs.normal);
            nodes.places.push((tangential, normal));
        }
        for contact in (0..contacts.len()).filter(|&i| contacts[i].state.is_some()) {
            nodes.states.push((contact, nodes.size));
            nodes.size += 1;
        }
        nodes
    }

    pub fn is_empty(&self) -> bool {
        self.springs.is_empty() && self.states.is_empty()
    }

    /// By dof and node: how the spring along the normal of a contact is stretched, `z - n . x`.
    pub fn stretch(&self, contact: usize) -> Vec<f64> {
        let mut along = vec![0.0; self.size];
        let node = self.places[contact].1;
        for spring in self.springs.iter().filter(|spring| Some(spring.node) == node) {
            spring.direction.iter().for_each(|&(dof, entry)| along[dof] -= entry);
            along[spring.node] = 1.0;
        }
        along
    }

    /// K with the springs: `k (z - d . x)^2 / 2` is the energy of each.
    pub fn with_springs(&self, stiffness: SparseMatrix) -> SparseMatrix {
        if self.is_empty() {
            return stiffness;
        }
        let stretch = |Spring { node, direction, stiffness }: &Spring| {
            let body = direction.iter().map(|&(dof, entry)| (dof, -entry));
            (*stiffness, body.chain([(*node, 1.0)]).collect())
        };
        let springs: Vec<(f64, Vec<(usize, f64)>)> = self.springs.iter().map(stretch).collect();
        let springs = SparseMatrix::of_springs(self.size, &springs);
        stiffness.padded(self.size).combined(1.0, &springs, 1.0)
    }

    /// The contacts as they act on dofs and nodes.
    pub fn contacts(&self, contacts: &[ContactInput]) -> Vec<ContactInput> {
        let sparse = |direction: &Direction| match direction {
            Direction::Vector(_) if !self.is_empty() => Direction::Entries(direction.nonzero()),
            _ => direction.clone(),
        };
        let stated = |direction: &Option<Direction>| direction.as_ref().map(sparse);
        let moved =
            |(law, &(tangential, normal)): (&ContactInput, &(Option<usize>, Option<usize>))| {
                ContactInput {
                    tangential: tangential.map(Direction::Dof).or_else(|| stated(&law.tangential)),
                    normal: normal.map(Direction::Dof).or_else(|| stated(&law.normal)),
                    ..law.clone()
                }
            };
        contacts.iter().zip(&self.places).map(moved).collect()
    }

    /// Positions or velocities over dofs, with nodes where their springs are relaxed, and states of zero.
    pub fn extended(&self, x: &[f64]) -> Vec<f64> {
        let mut whole = x.to_vec();
        for Spring { direction, .. } in &self.springs {
            whole.push(direction.iter().map(|&(dof, entry)| entry * x[dof]).sum());
        }
        whole.resize(self.size, 0.0);
        whole
    }
}

/// `K_ii - K_ib Y K_bi` over the dofs with mass: the stiffness that they feel while no contact acts on the others.
pub(crate) fn condensed_stiffness(
    mass: &SparseMatrix,
    stiffness: &SparseMatrix,
) -> Result<SparseMatrix, Error> {
    Ok(Massless::new(mass, stiffness, &[], mass.size())?.condensed(stiffness, mass.size()))
}

/// Refuses contacts of which only the gap has mass, contacts that would bounce without mass, and contacts without mass
/// beside others that mass couples.
pub(crate) fn check_massless(contacts: &[Contact], coordinates: &Coordinates) -> Result<(), Error> {
    for (contact, law) in contacts.iter().enumerate() {
        if law.inertia == Inertia::Full {
            continue;
        }
        if law.inertia == Inertia::Normal {
            let reason = "its normal direction has mass and its tangential one has none; give both mass, or a normal_stiffness";
            return Err(Error::MixedMass { contact, reason });
        }
        if law.restitution != 0.0 {
            return Err(Error::RestitutionWithoutMass { contact, restitution: law.restitution });
        }
        if coordinates.delassus.is_some() {
            let reason = "it has no mass, and mass couples other contacts of the scene with each other; state a lumped mass";
            return Err(Error::MixedMass { contact, reason });
        }
    }
    Ok(())
}
