//! The equation of motion of a small combination, `q'' = m^-1 (f - L'K q - L'C q')`, for the vector unit.
//!
//! The rows of `L'K` stand in groups of [`ROWS`], and in a group column after column, so that one coordinate is
//! multiplied with all rows of a group at once. Coordinates that are held have rows of zeros.

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
    /// Coordinates that can be other than zero.
    moving: Vec<usize>,
    stiffness: Vec<Column>,
    /// Where damping is not proportional to stiffness alone.
    damping: Option<Vec<Column>>,
    /// C = beta K otherwise.
    beta: f64,
    /// 1 / m of the coordinates left free, 0 of the others.
    inverse_mass: Vec<f64>,
}

/// One order of the series: q'' from its coefficients.
pub(crate) struct Order<'a> {
    /// Coefficients of q of this order and of the next.
    pub q: &'a [f64],
    pub dq: &'a [f64],
    /// From a coefficient of q of the next order to one of q' of this order.
    pub rate: f64,
    /// From a coefficient of q'' of this order to one of q two orders up.
    pub factor: f64,
    /// f of every coordinate, and whether it acts in this order.
    pub force: &'a [f64],
    pub forced: bool,
    pub next: &'a mut [f64],
}

/// By dense rows, with a buffer.
struct Advance<'a>(&'a DenseRows, Order<'a>, &'a mut Vec<f64>);

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
        let mut moving: Vec<usize> = moving.collect();
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

    /// Fills one order of the series.
    pub fn advance(&self, order: Order<'_>, moved: &mut Vec<f64>) {
        self.unit.run(Advance(self, order, moved));
    }
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self(rows, Order { q, dq, rate, factor, force, forced, next }, moved) = self;
        let count = rows.moving.len();
        moved.resize(2 * count, 0.0);
        let (x, slope) = moved.split_at_mut(count);
        for (j, &k) in rows.moving.iter().enumerate() {
            slope[j] = rate * dq[k];
            x[j] = q[k] + rows.beta * slope[j];
        }
        let forced = if forced { 1.0 } else { 0.0 };
        for (g, next) in next.chunks_mut(ROWS).enumerate() {
            let range = g * count..(g + 1) * count;
            let mut sum = product(simd, &rows.stiffness[range.clone()], x);
            if let Some(damping) = &rows.damping {
                sum = added(simd, sum, product(simd, &damping[range], slope));
            }
            let sum: [f64; ROWS] = cast(sum);
            let (force, inverse) = (&force[g * ROWS..], &rows.inverse_mass[g * ROWS..]);
            for row in 0..next.len() {
                let acceleration = inverse[row] * (forced * force[row] - sum[row]);
                // A held coordinate stays at zero, even if the others are beyond the range of numbers.
                next[row] = if inverse[row] == 0.0 { 0.0 } else { factor * acceleration };
            }
        }
    }
}

/// A group of rows times a vector over the moving coordinates.
#[inline(always)]
fn product<S: Lanes>(simd: S, columns: &[Column], x: &[f64]) -> Column {
    let columns = &columns[..x.len()];
    let even = x.len() & !1;
    let (mut first, mut second) = ([ZEROS; 2], [ZEROS; 2]);
    for j in (0..even).step_by(2) {
        first = with_product(simd, first, &columns[j], x[j]);
        second = with_product(simd, second, &columns[j + 1], x[j + 1]);
    }
    if even < x.len() {
        first = with_product(simd, first, &columns[even], x[even]);
    }
    added(simd, first, second)
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
            let (q, dq, force) = (next(count), next(count), next(rows));
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
            let (rate, factor) = (1.5, 0.25);
            let by = |unit: VectorUnit| {
                let (mut moved, mut next) = (Vec::new(), vec![f64::NAN; count]);
                let order = Order {
                    q: &q, dq: &dq, rate, factor, force: &force, forced, next: &mut next,
                };
                operator(unit).advance(order, &mut moved);
                next
            };
            let found = by(VectorUnit::default());
            prop_assert_eq!(&found, &by(VectorUnit::Portable));
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
