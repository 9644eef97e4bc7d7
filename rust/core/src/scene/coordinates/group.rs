//! One group of dofs that directions or mass join, in its own contact coordinates.

use nalgebra::{DMatrix, DVector};

use crate::linalg::components::components;
use crate::linalg::dense::Factors;
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::linalg::sparse_factors::SparseCholesky;
use crate::scene::contact_law::INDEPENDENCE;

/// Dofs from which a mass is factorized as a sparse matrix if no more than one in `SPARSE_ROW` of its entries is stored.
const SPARSE_SIZE: usize = 60;
const SPARSE_ROW: usize = 5;

/// Part of the largest entry of a direction down to which a dof is replaced by its coordinate: fill against accuracy.
const PIVOT: f64 = 0.1;

/// Relative size below which a coupling of contact directions by mass is rounding of `D' M^-1 D`.
const COUPLING_ROUNDING: f64 = 1e-13;

/// The part of the contact coordinates that one group of dofs contributes, over its own dofs and directions.
pub(super) struct Group {
    /// The dof whose place the coordinate of each direction takes.
    pub slots: Vec<usize>,
    /// Rows of T and of its inverse.
    pub forward: Vec<Row>,
    pub inverse: Vec<Row>,
    pub delassus: DMatrix<f64>,
}

/// (column, entry), columns ascending.
pub(super) type Row = Vec<(usize, f64)>;

impl Group {
    /// A group of dofs without mass, which couples nothing.
    pub fn massless(size: usize, directions: &[Row]) -> Option<Self> {
        let group = Self::new(&SparseMatrix::diagonal(&vec![1.0; size]), directions)?;
        Some(Self { delassus: DMatrix::identity(directions.len(), directions.len()), ..group })
    }

    /// The group of a mass and its directions over the dofs of the group; None if the directions depend on each other.
    pub fn new(mass: &SparseMatrix, directions: &[Row]) -> Option<Self> {
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

impl Group {
    /// All dofs of a scene in contact coordinates that mass couples with others, and that leave matrices sparse: only one dof
    /// of each direction is replaced, `x_s = inv(D_s') (q_c - D_f' x_f)`. None if the directions depend on each other.
    /// Gives the replaced dofs, and the rows of T and of its inverse.
    pub fn sparse(size: usize, directions: &[Row]) -> Option<(Vec<usize>, [Vec<Row>; 2])> {
        let slots = sparse_slots(size, directions)?;
        let count = slots.len();
        let mut owner: Vec<Option<usize>> = vec![None; size];
        slots.iter().enumerate().for_each(|(j, &slot)| owner[slot] = Some(j));
        // Directions that have a replaced dof of another one are solved together.
        let shares = |i: usize| directions[i].iter().filter_map(|&(dof, _)| owner[dof]);
        let mut sharing: Vec<Vec<usize>> = vec![Vec::new(); count];
        (0..count).for_each(|i| shares(i).for_each(|j| sharing[j].push(i)));
        let blocks = components(count, |i, found| {
            found.extend(shares(i));
            found.extend(&sharing[i]);
        });
        let mut forward: Vec<Row> = (0..size).map(|dof| vec![(dof, 1.0)]).collect();
        let mut inverse = forward.clone();
        for block in blocks {
            let mut own = DMatrix::zeros(block.len(), block.len());
            for (row, &i) in block.iter().enumerate() {
                for &(dof, entry) in &directions[i] {
                    let column = owner[dof].and_then(|j| block.binary_search(&j).ok());
                    column.into_iter().for_each(|column| own[(row, column)] = entry);
                }
            }
            let solved = Factors::new(own).solve(DMatrix::identity(block.len(), block.len()));
            for (j, &direction) in block.iter().enumerate() {
                let mut row: Row = Vec::new();
                for (i, &other) in block.iter().enumerate().filter(|&(i, _)| solved[(j, i)] != 0.0)
                {
                    row.push((slots[other], solved[(j, i)]));
                    let free = directions[other].iter().filter(|entry| owner[entry.0].is_none());
                    row.extend(free.map(|&(dof, entry)| (dof, -solved[(j, i)] * entry)));
                }
                summed(&mut row);
                forward[slots[direction]] = row;
                inverse[slots[direction]] = directions[direction].clone();
            }
        }
        Some((slots, [forward, inverse]))
    }
}

/// A dof of its own for each direction that as few others as possible move: elimination then fills little. An entry down to
/// [`PIVOT`] of the largest of its direction is taken. None if the directions depend on each other.
fn sparse_slots(size: usize, directions: &[Row]) -> Option<Vec<usize>> {
    let mut moving = vec![0_usize; size];
    directions.iter().flatten().for_each(|&(dof, _)| moving[dof] += 1);
    let mut slots = vec![0; directions.len()];
    let largest = |row: &Row| row.iter().map(|entry| entry.1.abs()).fold(0.0, f64::max);
    let mut remaining: Vec<(usize, f64, Row)> =
        directions.iter().enumerate().map(|(i, row)| (i, largest(row), row.clone())).collect();
    while !remaining.is_empty() {
        let mut best: Option<(usize, usize, usize, f64)> = None;
        for (position, (_, norm, row)) in remaining.iter().enumerate() {
            let most = largest(row);
            if !(most > INDEPENDENCE * norm) {
                return None;
            }
            for &(dof, entry) in row.iter().filter(|entry| entry.1.abs() >= PIVOT * most) {
                let share = entry.abs() / most;
                let better = best.is_none_or(|(_, _, movers, other)| {
                    moving[dof] < movers || moving[dof] == movers && share > other
                });
                if better {
                    best = Some((position, dof, moving[dof], share));
                }
            }
        }
        let (position, slot, ..) = best?;
        let (index, _, pivot) = remaining.swap_remove(position);
        slots[index] = slot;
        pivot.iter().for_each(|&(dof, _)| moving[dof] -= 1);
        let at = |row: &Row| row.iter().find(|entry| entry.0 == slot).map_or(0.0, |entry| entry.1);
        let own = at(&pivot);
        for (_, _, row) in remaining.iter_mut().filter(|(_, _, row)| at(row) != 0.0) {
            let factor = at(row) / own;
            row.iter().for_each(|&(dof, _)| moving[dof] -= 1);
            row.extend(pivot.iter().map(|&(dof, entry)| (dof, -factor * entry)));
            summed(row);
            row.retain(|entry| entry.0 != slot);
            row.iter().for_each(|&(dof, _)| moving[dof] += 1);
        }
    }
    Some(slots)
}

/// `M^-1 loads`
fn inverse_times(mass: &SparseMatrix, loads: DMatrix<f64>) -> DMatrix<f64> {
    let size = mass.size();
    if size >= SPARSE_SIZE
        && SPARSE_ROW * mass.entries() <= size * size
        && let Ok(factor) = SparseCholesky::new(mass)
    {
        return factor.solve(loads);
    }
    Factors::new(mass.to_dense()).solve(loads)
}

/// Columns of a largest independent set, those that are `first` before others, and the columns that depend on them.
pub(super) fn largest_independent(
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
pub(super) fn factors_of(basis: &DMatrix<f64>, direction: &DVector<f64>) -> Vec<f64> {
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
    let (orthogonal, triangular) = basis.clone().qr().unpack();
    let least_squares = |rest: &DVector<f64>| {
        let mut factors = orthogonal.tr_mul(rest);
        // Independent columns leave no zero on the diagonal.
        triangular.solve_upper_triangular_mut(&mut factors);
        factors
    };
    let mut factors = least_squares(direction);
    factors += least_squares(&(direction - basis * &factors));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// `d = 3 a - 2 b` of columns a and b that differ by 1e-8: normal equations, of condition 1e16, know neither factor.
    #[test]
    fn factors_of_nearly_dependent_directions_leave_a_residual_of_rounding_alone() {
        let a = [0.3, -0.7, 0.2, 0.5];
        let b: Vec<f64> = a.iter().zip([1.0, 2.0, -1.0, 0.5]).map(|(x, y)| x + 1e-8 * y).collect();
        let basis = DMatrix::from_fn(4, 2, |i, j| if j == 0 { a[i] } else { b[i] });
        let direction = DVector::from_fn(4, |i, _| 3.0 * a[i] - 2.0 * b[i]);
        let factors = DVector::from_vec(factors_of(&basis, &direction));
        // Their sum is known to rounding, each of them to rounding times the condition.
        let largest = factors.amax() * basis.amax();
        assert!((&basis * &factors - &direction).amax() <= 16.0 * f64::EPSILON * largest);
        assert!((factors[0] - 3.0).abs() <= 1e-6 && (factors[1] + 2.0).abs() <= 1e-6);
    }
}
