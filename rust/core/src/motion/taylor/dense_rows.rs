//! The equation of motion of a small combination, `q'' = m^-1 (f - L'K q - L'C q')`, for the vector unit.
//!
//! The rows of `L'K` stand in groups of [`ROWS`], and in a group column after column, so that one coordinate is
//! multiplied with all rows of a group at once. Coordinates that are held have rows of zeros.

use std::ops::Range;

use pulp::cast;

use crate::linalg::sparse::SparseMatrix;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, group};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Two groups: with the two sums that `product` keeps, enough to hide the latency of additions.
const ROWS: usize = 2 * GROUP;
/// Number of dense products that take no longer than one product of a sparse row, whose sum is one chain of additions.
const PER_ENTRY: usize = 8;

/// A column of a group of rows.
type Column = [Group; 2];

/// A small combination with lumped masses.
#[derive(Debug)]
pub(crate) struct DenseRows {
    unit: VectorUnit,
    /// Coordinates that can be other than zero; all of them where they are at most `ROWS`.
    moving: Vec<usize>,
    stiffness: Vec<Column>,
    /// Where damping is not proportional to stiffness alone.
    damping: Option<Vec<Column>>,
    /// C = beta K otherwise.
    beta: f64,
    /// 1 / m of the coordinates left free, 0 of the others.
    inverse_mass: Vec<f64>,
}

/// Orders of the series, each from the two before.
pub(crate) struct Orders<'a> {
    /// `Q_k = q^(k) h^k / k!` of all coordinates, one order after the other; those of `orders` are two orders up.
    pub terms: &'a mut [f64],
    pub size: usize,
    /// h
    pub width: f64,
    pub orders: Range<usize>,
    /// f of every coordinate, where it acts in the first of the orders.
    pub force: Option<&'a [f64]>,
}

/// By dense rows, with a buffer.
struct Advance<'a>(&'a DenseRows, Orders<'a>, &'a mut Vec<f64>);

impl DenseRows {
    /// Whether the rows of a scene are worth forming.
    pub fn are_quicker(scene: &Scene) -> bool {
        scene.coupled_mass.is_none()
            && scene.size * scene.size <= PER_ENTRY * scene.stiffness.entries()
    }

    /// The rows of a combination with lumped masses, unless it is so large and sparse that they would take longer.
    pub fn new(
        scene: &Scene,
        reduction: &Reduction,
        moving: impl Iterator<Item = usize>,
    ) -> Option<Self> {
        let n = scene.size;
        if !Self::are_quicker(scene) {
            return None;
        }
        let mut moving: Vec<usize> = match n {
            ..=ROWS => (0..n).collect(),
            _ => moving.collect(),
        };
        moving.sort_unstable();
        let mut column = vec![None; n];
        moving.iter().enumerate().for_each(|(j, &k)| column[k] = Some(j));
        let count = moving.len();
        let rows = n.next_multiple_of(ROWS);
        let merged = |matrix: &SparseMatrix| -> Vec<Column> {
            let mut columns = vec![[0.0; ROWS]; rows / ROWS * count];
            for (i, &row) in reduction.kept.iter().enumerate() {
                for (source, factor) in reduction.sources(i) {
                    for (k, value) in matrix.row(source) {
                        if let Some(j) = column[k] {
                            columns[row / ROWS * count + j][row % ROWS] += factor * value;
                        }
                    }
                }
            }
            columns.into_iter().map(cast).collect()
        };
        let mut inverse_mass = vec![0.0; rows];
        for &k in &reduction.kept {
            inverse_mass[k] = 1.0 / scene.mass.get(k, k);
        }
        let beta = scene.proportional.filter(|&(alpha, _)| alpha == 0.0).map(|(_, beta)| beta);
        Some(Self {
            unit: VectorUnit::default(),
            stiffness: merged(&scene.stiffness),
            damping: beta.is_none().then(|| merged(&scene.damping)),
            beta: beta.unwrap_or(0.0),
            moving,
            inverse_mass,
        })
    }

    /// Fills orders of the series.
    pub fn advance(&self, orders: Orders<'_>, moved: &mut Vec<f64>) {
        self.unit.run(Advance(self, orders, moved));
    }

    /// The same for at most `G` groups of coordinates, which stay in registers from order to order.
    #[inline(always)]
    fn fill_groups<const G: usize, S: Lanes>(&self, simd: S, orders: Orders<'_>) {
        let Orders { terms, size, width, orders, force } = orders;
        let filled = |x: &[f64]| -> [Group; G] {
            let entry = |k: usize| x[..size].get(k).copied().unwrap_or(0.0);
            std::array::from_fn(|g| group(std::array::from_fn(|lane| entry(g * GROUP + lane))))
        };
        let inverse = filled(&self.inverse_mass);
        let mut force = force.map_or([ZEROS; G], filled);
        let beta = simd.splat_f64s(self.beta);
        let mut q = filled(&terms[orders.start * size..]);
        let mut dq = filled(&terms[(orders.start + 1) * size..]);
        for k in orders {
            let rate = simd.splat_f64s((k + 1) as f64 / width);
            let (mut x, mut slope) = (q, dq);
            for g in 0..G {
                slope[g] = simd.mul_f64s(rate, dq[g]);
                x[g] = simd.add_f64s(q[g], simd.mul_f64s(beta, slope[g]));
            }
            let mut sum = product_of_groups(simd, &self.stiffness, &x);
            if let Some(damping) = &self.damping {
                let damped = product_of_groups(simd, damping, &slope);
                for g in 0..G {
                    sum[g] = simd.add_f64s(sum[g], damped[g]);
                }
            }
            let factor = width * width / ((k + 1) * (k + 2)) as f64;
            let next = &mut terms[(k + 2) * size..][..size];
            q = dq;
            for g in 0..G {
                dq[g] = next_order(simd, inverse[g], force[g], sum[g], factor);
                put(next.get_mut(g * GROUP..).unwrap_or_default(), dq[g]);
            }
            force = [ZEROS; G];
        }
    }

    /// The same for any number of coordinates.
    #[inline(always)]
    fn fill<S: Lanes>(&self, simd: S, orders: Orders<'_>, moved: &mut Vec<f64>) {
        let Orders { terms, size, width, orders, mut force } = orders;
        let count = self.moving.len();
        moved.resize(2 * count, 0.0);
        let (x, slope) = moved.split_at_mut(count);
        for k in orders {
            let (known, next) = terms.split_at_mut((k + 2) * size);
            let (q, dq) = known[k * size..].split_at(size);
            let rate = (k + 1) as f64 / width;
            let factor = width * width / ((k + 1) * (k + 2)) as f64;
            for (j, &k) in self.moving.iter().enumerate() {
                slope[j] = rate * dq[k];
                x[j] = q[k] + self.beta * slope[j];
            }
            let force = force.take();
            for (g, next) in next[..size].chunks_mut(ROWS).enumerate() {
                let range = g * count..(g + 1) * count;
                let mut sum = product(simd, &self.stiffness[range.clone()], x);
                if let Some(damping) = &self.damping {
                    sum = added(simd, sum, product(simd, &damping[range], slope));
                }
                for ((l, next), sum) in next.chunks_mut(GROUP).enumerate().zip(sum) {
                    let first = g * ROWS + l * GROUP;
                    let inverse = group(*self.inverse_mass[first..].first_chunk().expect(PADDED));
                    let force = force.map_or(ZEROS, |force| {
                        let row = |lane: usize| force.get(first + lane).copied();
                        group(std::array::from_fn(|lane| row(lane).unwrap_or(0.0)))
                    });
                    put(next, next_order(simd, inverse, force, sum, factor));
                }
            }
        }
    }
}

/// `factor m^-1 (f - sum)`. A held coordinate stays at zero, even if the others are beyond the range of numbers.
#[inline(always)]
fn next_order<S: Lanes>(simd: S, inverse: Group, force: Group, sum: Group, factor: f64) -> Group {
    let acceleration = simd.mul_f64s(inverse, simd.sub_f64s(force, sum));
    let held = simd.equal_f64s(inverse, ZEROS);
    simd.select_f64s(held, ZEROS, simd.mul_f64s(simd.splat_f64s(factor), acceleration))
}

#[inline(always)]
fn put(next: &mut [f64], found: Group) {
    let found: [f64; GROUP] = cast(found);
    match next.first_chunk_mut() {
        Some(next) => *next = found,
        None => next.iter_mut().zip(found).for_each(|(next, found)| *next = found),
    }
}

/// Why a group of inverse masses is whole.
const PADDED: &str = "rows are filled up to groups";

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self(rows, orders, moved) = self;
        match orders.size {
            ..=GROUP => rows.fill_groups::<1, S>(simd, orders),
            size if size <= ROWS => rows.fill_groups::<{ ROWS / GROUP }, S>(simd, orders),
            _ => rows.fill(simd, orders, moved),
        }
    }
}

/// A group of rows times a vector over the moving coordinates.
#[inline(always)]
fn product<S: Lanes>(simd: S, columns: &[Column], x: &[f64]) -> Column {
    let (mut first, mut second) = ([ZEROS; 2], [ZEROS; 2]);
    let (columns, last_column) = columns[..x.len()].as_chunks();
    let (x, last) = x.as_chunks();
    for (&[a, b], &[x, y]) in columns.iter().zip(x) {
        first = with_product(simd, first, &a, x);
        second = with_product(simd, second, &b, y);
    }
    for (column, &x) in last_column.iter().zip(last) {
        first = with_product(simd, first, column, x);
    }
    added(simd, first, second)
}

/// The same of the first groups of rows, over all coordinates.
#[inline(always)]
fn product_of_groups<const G: usize, S: Lanes>(
    simd: S,
    columns: &[Column],
    x: &[Group; G],
) -> [Group; G] {
    let (mut first, mut second) = ([ZEROS; G], [ZEROS; G]);
    let x: [[f64; GROUP]; G] = x.map(cast);
    for (j, (column, &x)) in columns.iter().zip(x.as_flattened()).enumerate() {
        let sum = if j % 2 == 0 { &mut first } else { &mut second };
        for g in 0..G {
            sum[g] = simd.mul_add_f64s(column[g], group([x; GROUP]), sum[g]);
        }
    }
    for g in 0..G {
        first[g] = simd.add_f64s(first[g], second[g]);
    }
    first
}

#[inline(always)]
fn with_product<S: Lanes>(simd: S, sum: Column, column: &Column, x: f64) -> Column {
    let x = group([x; GROUP]);
    [simd.mul_add_f64s(column[0], x, sum[0]), simd.mul_add_f64s(column[1], x, sum[1])]
}

#[inline(always)]
fn added<S: Lanes>(simd: S, a: Column, b: Column) -> Column {
    [simd.add_f64s(a[0], b[0]), simd.add_f64s(a[1], b[1])]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The kernel against the sum that it stands for, and every vector unit against the portable one.
        #[test]
        fn rows_are_scalar_sums(
            count in 1usize..14,
            numbers in proptest::collection::vec(-1.0..1.0f64, 1000),
            held in proptest::collection::vec(any::<bool>(), 14),
            beta in prop_oneof![Just(None), (0.0..0.1f64).prop_map(Some)],
            forced in any::<bool>(),
        ) {
            let rows = count.next_multiple_of(ROWS);
            let mut numbers = numbers.into_iter();
            let mut next = |length: usize| -> Vec<f64> { numbers.by_ref().take(length).collect() };
            let (stiffness, damping) = (next(rows * count), next(rows * count));
            let (mut terms, force) = (next(4 * count), next(count));
            // Row by row in, group of rows by group out.
            let columns = |matrix: &[f64]| -> Vec<Column> {
                let of = |g: usize, j: usize| {
                    cast::<[f64; ROWS], Column>(std::array::from_fn(|r| matrix[(g * ROWS + r) * count + j]))
                };
                (0..rows / ROWS).flat_map(|g| (0..count).map(move |j| of(g, j))).collect()
            };
            let inverse_mass: Vec<f64> = (0..rows)
                .map(|row| if row < count && !held[row] { 0.5 + row as f64 } else { 0.0 })
                .collect();
            let operator = |unit: VectorUnit| DenseRows {
                unit,
                moving: (0..count).collect(),
                stiffness: columns(&stiffness),
                damping: beta.is_none().then(|| columns(&damping)),
                beta: beta.unwrap_or(0.0),
                inverse_mass: inverse_mass.clone(),
            };
            let (width, k) = (0.75, 1);
            let mut by = |unit: VectorUnit| {
                let orders = Orders {
                    terms: &mut terms,
                    size: count,
                    width,
                    orders: k..k + 1,
                    force: forced.then_some(&force[..]),
                };
                operator(unit).advance(orders, &mut Vec::new());
                terms.clone()
            };
            let terms = by(VectorUnit::default());
            prop_assert_eq!(&terms, &by(VectorUnit::Portable));
            let (rate, factor) = (2.0 / width, width * width / 6.0);
            let (q, dq, found) =
                (&terms[count..2 * count], &terms[2 * count..3 * count], &terms[3 * count..]);
            for row in 0..count {
                let spring: f64 = (0..count)
                    .map(|j| stiffness[row * count + j] * (q[j] + beta.unwrap_or(0.0) * rate * dq[j]))
                    .sum();
                let damper: f64 = match beta {
                    Some(_) => 0.0,
                    None => (0..count).map(|j| damping[row * count + j] * rate * dq[j]).sum(),
                };
                let load = if forced { force[row] } else { 0.0 };
                let expected = factor * inverse_mass[row] * (load - spring - damper);
                // Some dozen terms of order one.
                prop_assert!((found[row] - expected).abs() <= 64.0 * f64::EPSILON * (1.0 + inverse_mass[row]));
            }
        }
    }
}
