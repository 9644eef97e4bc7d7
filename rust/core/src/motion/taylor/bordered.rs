//! The equation of motion of a scene whose stiffness couples coordinates through contacts alone, for the vector unit.
//!
//! With `y = q + beta q'` the force on each other coordinate is `-(D y)_i - sum_r K_ri y_r` over the border, and that on
//! the border is `-sum_i K_ri y_i`: one row of K serves both, and an order of the series costs O(n c). A combination
//! needs nothing but the choice of its rows, its merges and the inverse mass of its contact coordinates; with compliant
//! contacts the springs that their statuses leave between coordinates of the border.

use pulp::bytemuck::{cast_slice, cast_slice_mut};

use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, group};
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::inertia::border::Border;
use crate::scene::model::Scene;

/// Rows that are multiplied at once.
const BLOCK: usize = 4;

/// One combination of a scene whose stiffness has a border.
#[derive(Debug)]
pub(crate) struct BorderedRows {
    unit: VectorUnit,
    /// Places in the border whose coordinate moves or whose force counts, in whole blocks.
    active: Vec<Option<usize>>,
    /// Kept coordinates of the border.
    kept: Vec<usize>,
    beta: f64,
    /// What coordinates without mass add to rows of K, by row: of the border, or of gaps that are held.
    springs: Vec<(usize, Vec<(usize, f64)>)>,
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

/// Buffers of the products.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    moved: Vec<Group>,
    sum: Vec<Group>,
    low: Vec<Group>,
    dots: Vec<f64>,
    residual: Vec<f64>,
    acceleration: Vec<f64>,
}

impl BorderedRows {
    pub fn new(scene: &Scene, equation: &EquationOfMotion) -> Option<Self> {
        let border = border_of(scene)?;
        let reduction = &equation.reduction;
        let mut counts = vec![false; scene.size];
        equation.moving().for_each(|k| counts[k] = true);
        reduction.merges.iter().for_each(|merge| counts[merge.normal] = true);
        let places = border.coordinates.iter().enumerate().filter(|(_, k)| counts[**k]);
        let mut active: Vec<Option<usize>> = places.map(|(place, _)| Some(place)).collect();
        active.resize(active.len().next_multiple_of(BLOCK), None);
        let contacts = &border.coordinates[..border.contacts];
        let kept = contacts.iter().copied().filter(|&k| reduction.place(k).is_some());
        let springs = if scene.condensed { springs(scene, border, equation) } else { Vec::new() };
        let kept = kept.collect();
        Some(Self { unit: VectorUnit::default(), active, kept, beta: border.beta, springs })
    }

    /// Bound of what the springs add to the stiffness, in the norm of M: `|A|^2 <= |A|_1 |A|_inf`. 1/s^2
    pub fn spring_rate(&self, scene: &Scene, equation: &EquationOfMotion) -> f64 {
        let root = |k: usize| scene.mass.get(k, k).sqrt();
        let mut columns = vec![0.0; scene.size];
        let mut largest = 0.0_f64;
        for (i, &k) in equation.reduction.kept.iter().enumerate() {
            let mut row: Vec<(usize, f64)> = Vec::new();
            for (source, factor) in equation.reduction.sources(i) {
                let own = self.springs.iter().filter(|spring| spring.0 == source);
                let terms = own.flat_map(|spring| &spring.1);
                row.extend(terms.map(|&(j, value)| (j, (factor * value).abs())));
            }
            // Coordinates without mass move with the sliders.
            row.retain(|&(j, _)| root(j) > 0.0);
            row.iter_mut().for_each(|(j, value)| *value /= root(*j) * root(k));
            row.iter().for_each(|&(j, value)| columns[j] += value);
            largest = largest.max(row.iter().map(|entry| entry.1).sum());
        }
        (largest * columns.into_iter().fold(0.0, f64::max)).sqrt()
    }

    /// Fills one order of the series.
    pub fn advance(
        &self,
        scene: &Scene,
        equation: &EquationOfMotion,
        order: Order<'_>,
        buffers: &mut Buffers,
    ) {
        let Some(border) = border_of(scene) else { return };
        let Order { q, dq, rate, factor, force, forced, next } = order;
        let Buffers { moved, sum, dots, residual, acceleration, .. } = buffers;
        moved.resize(border.groups, ZEROS);
        sum.resize(border.groups, ZEROS);
        dots.resize(self.active.len(), 0.0);
        residual.resize(q.len(), 0.0);
        acceleration.resize(q.len(), 0.0);
        let beta = self.beta * rate;
        let load = |k: usize| if forced { force[k] } else { 0.0 };
        let rows = &self.active;
        let loads = if forced { force } else { &[] };
        let (sum, to) = (&mut *sum, &mut *next);
        self.unit.run(Product {
            border,
            rows,
            moved,
            sum,
            dots: &mut *dots,
            loads,
            beta,
            q,
            dq,
            rate,
            factor,
            next: to,
        });
        // The border follows; what is held stays at zero, even where the rest is beyond the range of numbers.
        border.coordinates.iter().chain(&border.massless).for_each(|&k| next[k] = 0.0);
        self.springs.iter().for_each(|&(k, _)| residual[k] = 0.0);
        for (place, dot) in self.active.iter().zip(dots) {
            let Some(place) = place else { continue };
            let k = border.coordinates[*place];
            residual[k] = load(k) - *dot;
            for &(j, drag) in border.drags.get(*place).into_iter().flatten() {
                residual[k] -= rate * drag * dq[j];
            }
        }
        for (k, terms) in &self.springs {
            residual[*k] -= terms.iter().map(|&(j, value)| value * q[j]).sum::<f64>();
        }
        equation.accelerate_contacts(&self.kept, residual, acceleration);
        self.kept.iter().for_each(|&k| next[k] = factor * acceleration[k]);
        // An oscillator counts from the place at which the phase began.
        for &(k, square) in &border.loads {
            let from = if forced { force[k] / scene.mass.get(k, k) } else { 0.0 };
            next[k] = factor * (from - square * q[k]);
        }
    }

    /// `L' (F - K q)`, summed in doubled precision.
    pub fn balance(
        &self,
        scene: &Scene,
        equation: &EquationOfMotion,
        q: &[f64],
        force: &mut [f64],
        buffers: &mut Buffers,
    ) {
        let Some(border) = border_of(scene) else { return };
        let Buffers { moved, sum, low, .. } = buffers;
        for (buffer, values) in [(&mut *moved, q), (&mut *sum, &scene.force[..])] {
            buffer.clear();
            buffer.resize(border.groups, ZEROS);
            cast_slice_mut(buffer)[..q.len()].copy_from_slice(values);
        }
        low.clear();
        low.resize(border.groups, ZEROS);
        // A given normal force is that of a coordinate without mass or stiffness, which is not on the border.
        let mut rows: Vec<Doubled> = scene.force.iter().map(|&force| force.into()).collect();
        for place in self.active.iter().flatten() {
            let sum = &mut *sum;
            let dot = self.unit.run(Balance { border, place: *place, moved, sum, low });
            let [high, low]: [[f64; GROUP]; 2] = dot.map(pulp::cast);
            let k = border.coordinates[*place];
            rows[k] = (0..GROUP).fold(Doubled::from(scene.force[k]), |total, lane| {
                total.add(Doubled { high: high[lane], low: low[lane] })
            });
        }
        for (k, terms) in &self.springs {
            let products = terms.iter().map(|&(j, value)| Doubled::product(-value, q[j]));
            rows[*k] = products.fold(rows[*k], Doubled::add);
        }
        let inverse: &[f64] = cast_slice(&border.inverse_mass);
        let diagonal: &[f64] = cast_slice(&border.diagonal);
        let (high, low): (&[f64], &[f64]) = (cast_slice(sum), cast_slice(low));
        for (i, force) in force.iter_mut().enumerate().filter(|(i, _)| inverse[*i] != 0.0) {
            let others = Doubled { high: high[i], low: low[i] };
            *force = others.add(Doubled::product(-diagonal[i], q[i])).value();
        }
        let kept = &equation.reduction.kept;
        for merge in &equation.reduction.merges {
            let merged = rows[merge.normal].times(merge.factor);
            rows[kept[merge.position]] = rows[kept[merge.position]].add(merged);
        }
        self.kept.iter().for_each(|&k| force[k] = rows[k].value());
        border.loads.iter().for_each(|&(k, _)| force[k] = -scene.stiffness.get(k, k) * q[k]);
    }
}

/// The rows of a scene whose coordinates without mass follow the others, less those that its border has.
fn springs(
    scene: &Scene,
    border: &Border,
    equation: &EquationOfMotion,
) -> Vec<(usize, Vec<(usize, f64)>)> {
    let merged = equation.reduction.merges.iter().map(|merge| merge.normal);
    let held = merged.filter(|k| border.coordinates.binary_search(k).is_err());
    let places = border.coordinates[..border.contacts].iter().copied().enumerate();
    let rows = places.map(|(place, k)| (k, Some(place))).chain(held.map(|k| (k, None)));
    let less = |(k, place): (usize, Option<usize>)| {
        let known: &[f64] = cast_slice(border.row(place));
        let changed = (0..scene.size).map(|j| (j, scene.stiffness.get(k, j) - known[j]));
        (k, changed.filter(|entry| entry.1 != 0.0).collect::<Vec<_>>())
    };
    rows.map(less).filter(|spring| !spring.1.is_empty()).collect()
}

/// The border of the stiffness of a scene.
pub(crate) fn border_of(scene: &Scene) -> Option<&Border> {
    scene.coupled_mass.as_deref()?.border.as_ref()
}

/// y, `D y` and the active rows: their products with y, and what their coordinates add to the others.
struct Product<'a> {
    border: &'a Border,
    rows: &'a [Option<usize>],
    moved: &'a mut [Group],
    sum: &'a mut [Group],
    dots: &'a mut [f64],
    /// Loads of the coordinates, if they act in this order.
    loads: &'a [f64],
    /// From dq to what damping adds to q.
    beta: f64,
    q: &'a [f64],
    dq: &'a [f64],
    rate: f64,
    factor: f64,
    next: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { border, rows, moved, sum, dots, loads, beta, q, dq, rate, factor, next } = self;
        let groups = border.groups;
        let y: &mut [f64] = &mut cast_slice_mut(moved)[..q.len()];
        let dq = &dq[..q.len()];
        for j in 0..q.len() {
            y[j] = q[j] + beta * dq[j];
        }
        // Loads are forces by their place.
        border.loads.iter().for_each(|&(k, _)| y[k] = q[k]);
        let (moved, sum, diagonal) =
            (&moved[..groups], &mut sum[..groups], &border.diagonal[..groups]);
        for g in 0..groups {
            sum[g] = simd.mul_f64s(diagonal[g], moved[g]);
        }
        let y: &[f64] = cast_slice(moved);
        for (places, dots) in rows.chunks_exact(BLOCK).zip(dots.chunks_exact_mut(BLOCK)) {
            let mut of = [&border.rows[..0]; BLOCK];
            let mut x = [ZEROS; BLOCK];
            for r in 0..BLOCK {
                of[r] = &border.row(places[r])[..groups];
                if let Some(place) = places[r] {
                    x[r] = group([y[border.coordinates[place]]; GROUP]);
                }
            }
            let mut products = [ZEROS; BLOCK];
            for g in 0..groups {
                let mut total = sum[g];
                for r in 0..BLOCK {
                    products[r] = simd.mul_add_f64s(of[r][g], moved[g], products[r]);
                    total = simd.mul_add_f64s(of[r][g], x[r], total);
                }
                sum[g] = total;
            }
            for r in 0..BLOCK {
                dots[r] = simd.reduce_sum_f64s(products[r]);
            }
        }
        let (sum, inverse): (&[f64], &[f64]) = (cast_slice(sum), cast_slice(&border.inverse_mass));
        let n = next.len();
        let decay: &[f64] = cast_slice(&border.decay);
        let (sum, inverse, dq, decay) = (&sum[..n], &inverse[..n], &dq[..n], &decay[..n]);
        for i in 0..n {
            next[i] = -factor * (inverse[i] * sum[i] + rate * decay[i] * dq[i]);
        }
        for (i, load) in loads.iter().enumerate() {
            next[i] += factor * (inverse[i] * load);
        }
    }
}

/// The same of one row, subtracted in doubled precision; the product of the row lane by lane.
struct Balance<'a> {
    border: &'a Border,
    place: usize,
    moved: &'a [Group],
    sum: &'a mut [Group],
    low: &'a mut [Group],
}

impl Kernel for Balance<'_> {
    type Output = [Group; 2];

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> [Group; 2] {
        let Self { border, place, moved, sum, low } = self;
        let y: &[f64] = cast_slice(moved);
        let x = group([y[border.coordinates[place]]; GROUP]);
        let mut dot = [ZEROS; 2];
        let groups = border.groups;
        let (row, moved) = (&border.row(Some(place))[..groups], &moved[..groups]);
        let (sum, low) = (&mut sum[..groups], &mut low[..groups]);
        for g in 0..groups {
            [sum[g], low[g]] = less_product(simd, [sum[g], low[g]], row[g], x);
            dot = less_product(simd, dot, row[g], moved[g]);
        }
        dot
    }
}

/// `sum - a b`, with what rounding loses added to the second part.
#[inline(always)]
pub(super) fn less_product<S: Lanes>(
    simd: S,
    [sum, low]: [Group; 2],
    a: Group,
    b: Group,
) -> [Group; 2] {
    let product = simd.mul_f64s(a, b);
    // `product - a b`
    let lost = simd.negate_mul_add_f64s(a, b, product);
    let total = simd.sub_f64s(sum, product);
    let part = simd.sub_f64s(total, sum);
    let of_sum = simd.sub_f64s(sum, simd.sub_f64s(total, part));
    let of_product = simd.add_f64s(product, part);
    let lost = simd.add_f64s(simd.sub_f64s(of_sum, of_product), lost);
    [total, simd.add_f64s(low, lost)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `sum - a b`, of four numbers each.
    struct Less([[f64; GROUP]; 4]);

    impl Kernel for Less {
        type Output = [Group; 2];

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> [Group; 2] {
            let [sum, low, a, b] = self.0.map(group);
            less_product(simd, [sum, low], a, b)
        }
    }

    proptest! {
        /// A product is subtracted as doubled numbers are, and the same on every vector unit.
        #[test]
        fn products_are_subtracted_in_doubled_precision(
            parts in proptest::array::uniform4(proptest::array::uniform4(-1.0..1.0f64)),
        ) {
            let [sum, low, a, b] = parts;
            let low = low.map(|part| 1e-17 * part);
            let by = |unit: VectorUnit| -> [[f64; GROUP]; 2] {
                unit.run(Less([sum, low, a, b])).map(pulp::cast)
            };
            let [high, rest] = by(VectorUnit::default());
            prop_assert_eq!([high, rest], by(VectorUnit::Portable));
            for lane in 0..GROUP {
                let before = Doubled { high: sum[lane], low: low[lane] };
                let expected = before.add(Doubled::product(-a[lane], b[lane]));
                let found = Doubled::from(high[lane]).add(Doubled::from(rest[lane]));
                let error = (found.high - expected.high) + (found.low - expected.low);
                prop_assert!(error.abs() <= 1e-31, "{found:?} of {expected:?}");
            }
        }
    }
}
