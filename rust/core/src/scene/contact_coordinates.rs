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
//! first, and the others follow. Each of them gets a coordinate beyond those of the dofs, on which no matrix acts, and so
//! does a direction that a contact has not.

use nalgebra::{DMatrix, DVector};

use crate::error::Error;
use crate::linalg::components::components;
use crate::linalg::dense::{Factors, is_diagonal};
use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::SparseCholesky;
use crate::scene::contact_law::{ContactInput, Direction, INDEPENDENCE};

/// Dofs from which a mass is factorized as a sparse matrix if no more than one in `SPARSE_ROW` of its entries is stored.
const SPARSE_SIZE: usize = 60;
const SPARSE_ROW: usize = 5;

/// Relative size below which a coupling of contact directions by mass is rounding of `D' M^-1 D`.
const COUPLING_ROUNDING: f64 = 1e-13;

/// The change of basis `x = T q`.
#[derive(Debug, Clone)]
pub struct Coordinates {
    /// (tangential, normal) coordinate of each contact.
    pub slots: Vec<(usize, usize)>,
    /// Number of directions that contacts have not; their coordinates are the last ones.
    pub missing: usize,
    /// Coordinate of every direction that depends on others, and the terms of those in which it is a sum; the coordinates
    /// are the last ones.
    pub followers: Vec<(usize, Vec<(usize, f64)>)>,
    /// Whether mass couples contact coordinates.
    pub coupled: bool,
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

/// What one group of dofs contributes, over its own dofs and directions.
struct Group {
    /// The dof whose place the coordinate of each direction takes.
    slots: Vec<usize>,
    /// Rows of T and of its inverse.
    forward: Vec<Row>,
    inverse: Vec<Row>,
    delassus: DMatrix<f64>,
}

/// (column, entry), columns ascending.
type Row = Vec<(usize, f64)>;

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
        let missing = stated.len() - count;
        let in_pairs = |slots: &[usize]| -> Vec<(usize, usize)> {
            let mut beyond = size..;
            let mut all: Vec<Option<usize>> = vec![None; stated.len()];
            whose.iter().zip(slots).for_each(|(&k, &slot)| all[k] = Some(slot));
            let mut all =
                all.into_iter().map(|slot| slot.or_else(|| beyond.next()).unwrap_or(size));
            contacts.iter().filter_map(|_| Some((all.next()?, all.next()?))).collect()
        };
        let nodal = directions.iter().all(|direction| matches!(direction[..], [(_, 1.0)]));
        if nodal && mass.is_diagonal() {
            let mut taken = vec![false; size];
            let slots: Vec<usize> = directions.iter().map(|direction| direction[0].0).collect();
            if !slots.iter().any(|&dof| std::mem::replace(&mut taken[dof], true)) {
                return Ok(Self {
                    slots: in_pairs(&slots),
                    missing,
                    followers: Vec::new(),
                    coupled: false,
                    dofs: size,
                    transform: None,
                    delassus: None,
                });
            }
        }
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
                    match group_of(&chosen) {
                        Some(group) => group,
                        None => unreachable!("independent directions"),
                    }
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
        let forward = rows(|group| &group.forward);
        let transform = (forward != SparseMatrix::diagonal(&vec![1.0; size])).then(|| Transform {
            transposed: forward.transposed(),
            inverse: rows(|group| &group.inverse),
            forward,
        });
        let coupled = transformed.iter().any(|(_, _, group)| !is_diagonal(&group.delassus));
        let followers: Vec<(usize, Vec<(usize, f64)>)> = sums
            .iter()
            .enumerate()
            .map(|(k, (index, terms))| {
                slots[*index] = size + missing + k;
                (slots[*index], terms.iter().map(|&(i, factor)| (slots[i], factor)).collect())
            })
            .collect();
        let delassus = (coupled || !sums.is_empty()).then(|| {
            // A direction that a contact has not is coupled with none.
            let mut whole = DMatrix::identity(stated.len(), stated.len());
            sums.iter().for_each(|(index, _)| whole[(whose[*index], whose[*index])] = 0.0);
            for (_, own, group) in &transformed {
                for (i, j) in (0..own.len()).flat_map(|i| (0..own.len()).map(move |j| (i, j))) {
                    whole[(whose[own[i]], whose[own[j]])] = group.delassus[(i, j)];
                }
            }
            let mut spread = DMatrix::identity(stated.len(), stated.len());
            for (index, terms) in &sums {
                spread[(whose[*index], whose[*index])] = 0.0;
                terms.iter().for_each(|&(i, w)| spread[(whose[*index], whose[i])] = w);
            }
            if sums.is_empty() { whole } else { &spread * whole * spread.transpose() }
        });
        Ok(Self {
            slots: in_pairs(&slots),
            missing,
            followers,
            coupled,
            dofs: size,
            transform,
            delassus,
        })
    }

    /// Contact coordinates themselves, `size` of them, with the contacts' (tangential, normal).
    pub fn of_contacts(
        size: usize,
        slots: Vec<(usize, usize)>,
        delassus: Option<DMatrix<f64>>,
        coupled: bool,
    ) -> Self {
        let delassus = delassus.filter(|delassus| !is_diagonal(delassus));
        Self {
            slots,
            missing: 0,
            followers: Vec::new(),
            coupled: coupled && delassus.is_some(),
            dofs: size,
            transform: None,
            delassus,
        }
    }

    /// `T' matrix T`
    pub fn transformed(&self, matrix: SparseMatrix) -> SparseMatrix {
        match &self.transform {
            None => self.extended(matrix),
            Some(transform) => self.extended(matrix.transformed(&transform.forward)),
        }
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.dofs + self.missing + self.followers.len()
    }

    /// With empty rows and columns of what is no coordinate of x.
    fn extended(&self, matrix: SparseMatrix) -> SparseMatrix {
        match self.size() {
            size if size == self.dofs => matrix,
            size => SparseMatrix::from_rows(size, |row, entries| {
                if row < self.dofs {
                    entries.extend(matrix.row(row));
                }
            }),
        }
    }

    /// The same of a symmetric matrix.
    pub fn congruent(&self, matrix: SparseMatrix) -> SparseMatrix {
        match &self.transform {
            None => self.extended(matrix),
            Some(transform) => self.extended(matrix.congruent(&transform.forward)),
        }
    }

    /// Column `slot` of T: how the dofs move where that coordinate moves by one, and how a force along the contact
    /// direction of that coordinate is told from forces on the dofs. Zero where the contact has no such direction.
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

    /// `T q`
    pub fn to_dofs(&self, q: &[f64]) -> Vec<f64> {
        let q = &q[..self.dofs];
        self.transform.as_ref().map_or_else(|| q.to_vec(), |transform| transform.forward.apply(q))
    }

    /// `T^-1 x`
    pub fn of_dofs(&self, x: &[f64]) -> Vec<f64> {
        let applied = |transform: &Transform| transform.inverse.apply(x);
        let mut q = self.transform.as_ref().map_or_else(|| x.to_vec(), applied);
        q.resize(self.size(), 0.0);
        for (coordinate, terms) in &self.followers {
            q[*coordinate] = terms.iter().map(|&(k, factor)| factor * q[k]).sum();
        }
        q
    }

    /// `T' f`: forces on the coordinates from forces on the dofs.
    pub fn forces_of_dofs(&self, force: &[f64]) -> Vec<f64> {
        let applied = |transform: &Transform| transform.transposed.apply(force);
        let mut forces = self.transform.as_ref().map_or_else(|| force.to_vec(), applied);
        forces.resize(self.size(), 0.0);
        forces
    }
}

impl Group {
    /// Of dofs without mass, which couples nothing.
    fn massless(size: usize, directions: &[Row]) -> Option<Self> {
        let group = Self::new(&SparseMatrix::diagonal(&vec![1.0; size]), directions)?;
        Some(Self { delassus: DMatrix::identity(directions.len(), directions.len()), ..group })
    }

    /// Of the mass and the directions over the dofs of the group, or None if they depend on each other.
    fn new(mass: &SparseMatrix, directions: &[Row]) -> Option<Self> {
        let (size, count) = (mass.size(), directions.len());
        // Dofs that a direction moves; elimination needs no others.
        let mut moved: Vec<usize> = directions.iter().flatten().map(|&(dof, _)| dof).collect();
        moved.sort_unstable();
        moved.dedup();
        let mut d = DMatrix::zeros(moved.len(), count);
        for (j, direction) in directions.iter().enumerate() {
            for &(dof, entry) in direction {
                d[(moved.partition_point(|&other| other < dof), j)] = entry;
            }
        }
        let places = choose_slots(&d)?;
        let slots: Vec<usize> = places.iter().map(|&place| moved[place]).collect();
        let mut loads = DMatrix::zeros(size, count);
        for (place, &dof) in moved.iter().enumerate() {
            loads.set_row(dof, &d.row(place));
        }
        let inverse_mass_d = inverse_times(mass, loads);
        let mut delassus = d.tr_mul(&inverse_mass_d.select_rows(&moved));
        for (i, j) in (0..count).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let scale = (delassus[(i, i)] * delassus[(j, j)]).sqrt();
            let coupling = delassus[(i, j)];
            let kept = if coupling.abs() <= COUPLING_ROUNDING * scale { 0.0 } else { coupling };
            (delassus[(i, j)], delassus[(j, i)]) = (kept, kept);
        }
        if size == 1 {
            // One dof and one direction, without rounding.
            let entry = d[(0, 0)];
            let (forward, inverse) = (vec![vec![(0, 1.0 / entry)]], vec![vec![(0, entry)]]);
            return Some(Self { slots, forward, inverse, delassus });
        }
        let contact_mass = Factors::new(delassus.clone()).solve(DMatrix::identity(count, count));
        let mut p = inverse_mass_d * contact_mass;
        let root: Vec<f64> = (0..size).map(|dof| mass.get(dof, dof).sqrt()).collect();
        for mut column in p.column_iter_mut() {
            let largest =
                column.iter().zip(&root).map(|(p, root)| p.abs() * root).fold(0.0, f64::max);
            let seen = |entry: f64, root: f64| entry.abs() * root > f64::EPSILON * largest;
            column
                .iter_mut()
                .zip(&root)
                .filter(|(p, root)| !seen(**p, **root))
                .for_each(|(p, _)| *p = 0.0);
        }
        // Z: unit in one free dof each, the slot dofs follow from D' x = 0.
        let followed: Vec<usize> =
            (0..moved.len()).filter(|place| !places.contains(place)).collect();
        let followers = Factors::new(d.select_rows(&places).transpose())
            .solve(d.select_rows(&followed).transpose());
        let mut slot_of: Vec<Option<usize>> = vec![None; size];
        slots.iter().enumerate().for_each(|(j, &slot)| slot_of[slot] = Some(j));
        let sorted = |mut row: Row| {
            row.sort_unstable_by_key(|entry| entry.0);
            row
        };
        // q_c = D' x; q_f = x_f - P_f D' x.
        let forward = |dof: usize| {
            let mut row: Row = slots.iter().copied().zip(p.row(dof).iter().copied()).collect();
            match slot_of[dof] {
                Some(j) => row.extend(
                    followed
                        .iter()
                        .enumerate()
                        .map(|(k, &place)| (moved[place], -followers[(j, k)])),
                ),
                None => row.push((dof, 1.0)),
            }
            sorted(row)
        };
        let inverse = |dof: usize| match slot_of[dof] {
            Some(j) => directions[j].clone(),
            None => {
                let column = (&d * p.row(dof).transpose()).data.into();
                let column: Vec<f64> = column;
                let mut row: Row =
                    moved.iter().copied().zip(column.iter().map(|sum| -sum)).collect();
                match row.binary_search_by_key(&dof, |entry| entry.0) {
                    Ok(place) => row[place].1 += 1.0,
                    Err(place) => row.insert(place, (dof, 1.0)),
                }
                row
            }
        };
        let (forward, inverse) =
            ((0..size).map(forward).collect(), (0..size).map(inverse).collect());
        Some(Self { slots, forward, inverse, delassus })
    }
}

/// `M^-1 loads`
fn inverse_times(mass: &SparseMatrix, loads: DMatrix<f64>) -> DMatrix<f64> {
    let size = mass.size();
    if size >= SPARSE_SIZE && SPARSE_ROW * mass.entries() <= size * size {
        match SparseCholesky::new(mass) {
            Ok(factor) => return factor.solve(loads),
            Err(_) => unreachable!("a positive definite mass"),
        }
    }
    Factors::new(mass.to_dense()).solve(loads)
}

/// Columns of a largest independent set, those that are `first` before others, and the columns that depend on them.
fn largest_independent(
    d: &DMatrix<f64>,
    first: impl Fn(usize) -> bool,
) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..d.ncols()).collect();
    order.sort_by_key(|&j| !first(j));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let (mut base, mut others): (Vec<usize>, Vec<usize>) = order.into_iter().partition(|&j| {
        let mut part: DVector<f64> = d.column(j) / d.column(j).norm();
        // Twice, so that rounding of the first is gone.
        for _ in 0..2 {
            basis.iter().for_each(|unit| part.axpy(-unit.dot(&part), unit, 1.0));
        }
        let size = part.norm();
        let independent = size > INDEPENDENCE;
        if independent {
            basis.push(part / size);
        }
        independent
    });
    base.sort_unstable();
    others.sort_unstable();
    (base, others)
}

/// The factors of independent columns whose sum is `direction`, without those that are rounding.
fn factors_of(basis: &DMatrix<f64>, direction: &DVector<f64>) -> Vec<f64> {
    // One column that is a multiple of it needs no arithmetic but a division.
    for (j, column) in basis.column_iter().enumerate() {
        let k = column.iamax();
        let factor = direction[k] / column[k];
        if (column * factor - direction).amax() <= f64::EPSILON * direction.amax() {
            let mut factors = vec![0.0; basis.ncols()];
            factors[j] = factor;
            return factors;
        }
    }
    let gram = Factors::new(basis.tr_mul(basis));
    let mut factors = gram.solve(basis.tr_mul(direction));
    factors += gram.solve(basis.tr_mul(&(direction - basis * &factors)));
    let rounding = COUPLING_ROUNDING * factors.amax();
    factors.iter().map(|&factor| if factor.abs() <= rounding { 0.0 } else { factor }).collect()
}

/// Gives each direction (a column) a dof of its own by elimination with complete pivoting, which also shows whether the
/// directions are independent; None if not. A direction along one dof gets that dof.
fn choose_slots(directions: &DMatrix<f64>) -> Option<Vec<usize>> {
    let (size, count) = directions.shape();
    let mut slots = vec![0; count];
    let mut taken = vec![false; size];
    let mut remaining = Vec::new();
    for (index, direction) in directions.column_iter().enumerate() {
        let mut dofs = (0..size).filter(|&dof| direction[dof] != 0.0);
        match (dofs.next(), dofs.next()) {
            (Some(dof), None) if taken[dof] => return None,
            (Some(dof), None) => (slots[index], taken[dof]) = (dof, true),
            _ => remaining.push((index, direction.amax(), direction.into_owned())),
        }
    }
    for (_, _, part) in &mut remaining {
        part.iter_mut().zip(&taken).filter(|pair| *pair.1).for_each(|pair| *pair.0 = 0.0);
    }
    let largest = |part: &(usize, f64, DVector<f64>)| part.2.amax() / part.1;
    while let Some(position) = (0..remaining.len())
        .max_by(|&i, &j| largest(&remaining[i]).total_cmp(&largest(&remaining[j])))
    {
        let (index, norm, pivot_row) = remaining.swap_remove(position);
        let slot = pivot_row.iamax();
        if pivot_row[slot].abs() <= INDEPENDENCE * norm {
            return None;
        }
        slots[index] = slot;
        for (_, _, part) in &mut remaining {
            let factor = part[slot] / pivot_row[slot];
            part.axpy(-factor, &pivot_row, 1.0);
            part[slot] = 0.0;
        }
    }
    Some(slots)
}
