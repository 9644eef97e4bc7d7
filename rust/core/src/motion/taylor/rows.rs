//! The equation of motion of a dense combination with lumped masses, `q'' = m^-1 (f - L'K q - L'C q')`, in rows for the vector unit.
//!
//! Below the rows of `q''` stand those of outputs, such as normal forces and event functions, in groups of four, and in a block of
//! groups column after column, so that one product per order gives all of them. Where `C = beta K`, the rows act on
//! `z = q + beta q'` alone: `-M^-1 L'K z`. Coordinates that are held have rows of zeros.

use std::ops::Range;

use pulp::bytemuck::{cast_slice, cast_slice_mut};
use pulp::cast;

use crate::contact::functional::Functional;
use crate::linalg::sparse::SparseMatrix;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, in_groups, store};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Number of dense products that take no longer than one product of a sparse row, whose sum is one chain of additions.
const PER_ENTRY: usize = 8;
/// The same beside contacts with a state, whose deflections follow on wide panels by rows alone.
const BESIDE_STATES: usize = 64;
/// Groups of rows that are summed together, each in two chains of additions that hide their latency.
const BLOCK: usize = 4;
/// Relative difference of a damping and beta times a stiffness that is their rounding.
const SAME: f64 = 2.0 * f64::EPSILON;
/// `(k + 1) (k + 2)`
const STEPS: [f64; COEFFICIENTS] = {
    let mut steps = [0.0; COEFFICIENTS];
    let mut k = 0;
    while k < COEFFICIENTS {
        steps[k] = ((k + 1) * (k + 2)) as f64;
        k += 1;
    }
    steps
};

/// A dense combination with lumped masses.
#[derive(Debug)]
pub(crate) struct Rows {
    /// The groups of all columns, block by block.
    columns: Vec<Group>,
    /// Coordinates whose z, and whose q', have a column.
    moving: Vec<usize>,
    damped: Vec<usize>,
    beta: f64,
    /// Number of groups of rows of q'' and of outputs.
    states: usize,
    outputs: usize,
    /// 1 / m of the coordinates left free, 0 of the others; in whole groups of rows.
    inverse_mass: Vec<f64>,
    /// All bits of the coordinates left free, none of the others.
    free: Vec<Group>,
    /// q'' per unit of the forces beside those of the equation, group of rows by group of rows, each with the place of its force.
    by_force: Vec<(usize, Group)>,
    /// Where in `by_force` every group of rows ends.
    ends: Vec<usize>,
}

/// z and q' of order k, the next order of places, and the rows of this order or, with outputs, of all orders.
#[derive(Debug, Default)]
pub(crate) struct Products {
    z: Vec<Group>,
    u: Vec<Group>,
    /// `Q_{k + 1}`
    newest: Vec<Group>,
    rows: Vec<Group>,
    /// Of the rows below those of q'': sums of the negative ones from order 1 on, and of the absolute values of all terms,
    /// of all orders and of those from 2 on.
    negative: Vec<Group>,
    sizes: [Vec<Group>; 2],
    /// The columns of z, and of q', that count in the order.
    counting: [Vec<usize>; 2],
}

/// What counts in an order of a series: entries of the state that are not below `least` in the norm `max(omega |q|, |q'|)` over
/// weighted coordinates. An order of q'' that leaves out the others is off by at most the norm of the equation times `least`.
#[derive(Clone, Copy)]
pub(crate) struct Counting<'a> {
    pub weight: &'a [f64],
    pub omega: f64,
    pub least: f64,
}

fn numbers(groups: &[Group]) -> &[f64] {
    cast_slice(groups)
}

impl Products {
    /// One of these rows, of all orders.
    pub fn row(&self, all: &Rows, place: usize) -> impl Iterator<Item = &f64> {
        let numbers: &[f64] = cast_slice(&self.rows);
        let stride = (all.states + all.outputs) * GROUP;
        numbers[all.states * GROUP + place..].iter().step_by(stride)
    }

    /// Order 0 of a row below those of q'', and a bound from below of what the other orders add.
    pub fn least(&self, all: &Rows, place: usize) -> [f64; 2] {
        [&self.rows[all.states..], &self.negative[..]].map(|of| numbers(of)[place])
    }

    /// Sums of the absolute values of its terms, of all orders and of those from 2 on.
    pub fn sizes(&self, place: usize) -> [f64; 2] {
        self.sizes.each_ref().map(|of| numbers(of)[place])
    }

    /// Bounds of the rows below those of q'', on a panel of `powers[1]` times the width that the recurrences had.
    #[inline(always)]
    pub fn measure<S: Lanes>(
        &mut self,
        simd: S,
        all: &Rows,
        [of_all, of_higher]: [[&[f64]; 2]; 2],
        powers: &[f64; COEFFICIENTS],
    ) {
        let Self { rows, negative, sizes: [sizes, higher], .. } = self;
        let groups = all.states + all.outputs;
        negative.clear();
        sizes.clear();
        higher.clear();
        for output in 0..all.outputs {
            let mut sum = ZEROS;
            let orders = rows[all.states + output..].iter().step_by(groups).zip(powers);
            for (row, &power) in orders.skip(1) {
                let below = simd.min_f64s(*row, ZEROS);
                sum = simd.mul_add_f64s(below, simd.splat_f64s(power), sum);
            }
            negative.push(sum);
            sizes.push(all.sizes(simd, output, of_all));
            higher.push(all.sizes(simd, output, of_higher));
        }
    }
}

impl Rows {
    /// Whether the rows of a scene are worth forming.
    pub fn are_quicker(scene: &Scene) -> bool {
        let times = if scene.states.is_some() { BESIDE_STATES } else { PER_ENTRY };
        scene.coupled_mass.is_none()
            && scene.size * scene.size
                <= times * scene.stiffness.entries().max(scene.damping.entries())
    }

    /// The rows of a combination, unless it is so large and sparse that they would take longer; with outputs, and with the
    /// direction of each force over the kept coordinates.
    pub fn new(
        scene: &Scene,
        reduction: &Reduction,
        moving: impl Iterator<Item = usize>,
        functionals: &[&Functional],
        forces: &[Vec<(usize, f64)>],
    ) -> Option<Self> {
        if !Self::are_quicker(scene) {
            return None;
        }
        let n = scene.size;
        let (states, outputs) = (n.div_ceil(GROUP), functionals.len().div_ceil(GROUP));
        let beta = scene.proportional.filter(|&(alpha, _)| alpha == 0.0).map(|(_, beta)| beta);
        // Over z and over q', row after row.
        let mut dense = [0, 1].map(|_| vec![0.0; (states + outputs) * GROUP * n]);
        let mut inverse_mass = vec![0.0; states * GROUP];
        for (i, &row) in reduction.kept.iter().enumerate() {
            inverse_mass[row] = 1.0 / scene.mass.get(row, row);
            let mut merge = |matrix: &SparseMatrix, of: usize| {
                for (source, factor) in reduction.sources(i) {
                    for (k, value) in matrix.row(source) {
                        dense[of][row * n + k] -= inverse_mass[row] * factor * value;
                    }
                }
            };
            merge(&scene.stiffness, 0);
            if beta.is_none() {
                merge(&scene.damping, 1);
            }
        }
        for (i, functional) in functionals.iter().enumerate() {
            let row = (states * GROUP + i) * n;
            functional.position.iter().for_each(|&(k, weight)| dense[0][row + k] += weight);
            functional.velocity.iter().for_each(|&(k, weight)| dense[1][row + k] += weight);
            for k in row..row + n {
                let by_z = beta.unwrap_or(0.0) * dense[0][k];
                let rest = dense[1][k] - by_z;
                dense[1][k] = if rest.abs() <= SAME * by_z.abs() { 0.0 } else { rest };
            }
        }
        let moving: Vec<usize> = moving.collect();
        let [_, by_u] = &dense;
        let is_damped = |&k: &usize| by_u.iter().skip(k).step_by(n).any(|&weight| weight != 0.0);
        let damped: Vec<usize> = moving.iter().copied().filter(is_damped).collect();
        let mut moves = vec![false; n];
        moving.iter().for_each(|&k| moves[k] = true);
        let mut columns = Vec::new();
        let groups: Vec<usize> = (0..states + outputs).collect();
        for block in groups.chunks(BLOCK) {
            for (of, places) in dense.iter().zip([&moving, &damped]) {
                let column = |k: usize, g: usize| -> [f64; GROUP] {
                    let entry = |lane: usize| of[(g * GROUP + lane) * n + k];
                    if moves[k] { std::array::from_fn(entry) } else { [0.0; GROUP] }
                };
                let groups = places.iter().flat_map(|&k| block.iter().map(move |&g| (k, g)));
                columns.extend(groups.map(|(k, g)| cast::<_, Group>(column(k, g))));
            }
        }
        let (mut by_force, mut ends) = (Vec::new(), Vec::new());
        for first in (0..states * GROUP).step_by(GROUP) {
            for (place, direction) in forces.iter().enumerate() {
                let mut rows = [0.0; GROUP];
                for &(k, weight) in direction.iter().filter(|term| term.0 / GROUP * GROUP == first)
                {
                    rows[k - first] = weight * inverse_mass[k];
                }
                if rows != [0.0; GROUP] {
                    by_force.push((place, cast(rows)));
                }
            }
            ends.push(by_force.len());
        }
        let bits = |&inverse: &f64| f64::from_bits(if inverse > 0.0 { u64::MAX } else { 0 });
        Some(Self {
            columns,
            moving,
            damped,
            beta: beta.unwrap_or(0.0),
            states,
            outputs,
            free: in_groups(&inverse_mass.iter().map(bits).collect::<Vec<f64>>()),
            inverse_mass,
            by_force,
            ends,
        })
    }

    /// Sums of the absolute values of the terms of four rows below those of q''.
    #[inline(always)]
    fn sizes<S: Lanes>(&self, simd: S, output: usize, [q, u]: [&[f64]; 2]) -> Group {
        let groups = self.states + self.outputs;
        let row = self.states + output;
        let first = row / BLOCK * BLOCK;
        let stride = (groups - first).min(BLOCK);
        let columns = &self.columns[first * (self.moving.len() + self.damped.len())..];
        let mut columns = columns[row - first..].iter().step_by(stride);
        let mut sum = ZEROS;
        for (&k, column) in self.moving.iter().zip(columns.by_ref()) {
            let z = simd.splat_f64s(q[k] + self.beta * u[k]);
            sum = simd.mul_add_f64s(simd.abs_f64s(*column), z, sum);
        }
        for (&k, column) in self.damped.iter().zip(columns) {
            sum = simd.mul_add_f64s(simd.abs_f64s(*column), simd.splat_f64s(u[k]), sum);
        }
        sum
    }

    /// Adds the force at the origin to the rows of q'' of order 0.
    #[inline(always)]
    fn load(&self, force: &[f64], rows: &mut [Group]) {
        let rows = cast_slice_mut::<Group, f64>(rows).iter_mut();
        rows.zip(&self.inverse_mass)
            .zip(force)
            .for_each(|((row, inverse), force)| *row += inverse * force);
    }
}

/// The columns of `G` groups of rows.
struct Block<'a, const G: usize> {
    all: &'a Rows,
    of_z: &'a [[Group; G]],
    of_u: &'a [[Group; G]],
}

/// The product of rows with z and q', without what forces add; of rows of several blocks, with the columns that count.
trait Multiply {
    fn multiply<S: Lanes>(
        &self,
        simd: S,
        state: [&[f64]; 2],
        counting: &[Vec<usize>; 2],
        sums: &mut [Group],
    );
}

impl<'a, const G: usize> Block<'a, G> {
    #[inline(always)]
    fn new(all: &'a Rows, columns: &'a [Group]) -> Self {
        let (of_z, of_u) = columns.as_chunks::<G>().0.split_at(all.moving.len());
        Self { all, of_z, of_u }
    }
}

impl<const G: usize> Block<'_, G> {
    /// The sums of columns times numbers, of those of z and of those of q', each in two chains of additions.
    #[inline(always)]
    fn sum<'c, S: Lanes, T: Iterator<Item = (&'c [Group; G], f64)>>(
        simd: S,
        terms: [T; 2],
        sums: &mut [Group],
    ) {
        let (mut even, mut odd) = ([ZEROS; G], [ZEROS; G]);
        for mut terms in terms {
            while let Some((column, x)) = terms.next() {
                even = add_column(simd, column, x, even);
                if let Some((column, x)) = terms.next() {
                    odd = add_column(simd, column, x, odd);
                }
            }
        }
        for (sum, (even, odd)) in sums.iter_mut().zip(even.into_iter().zip(odd)) {
            *sum = simd.add_f64s(even, odd);
        }
    }

    /// The product with some of the columns.
    #[inline(always)]
    fn multiply_some<S: Lanes>(
        &self,
        simd: S,
        [z, u]: [&[f64]; 2],
        [some_z, some_u]: &[Vec<usize>; 2],
        sums: &mut [Group],
    ) {
        let Self { all: Rows { moving, damped, .. }, of_z, of_u } = *self;
        let parts = [(of_z, moving, some_z, z), (of_u, damped, some_u, u)];
        let terms = parts.map(|(columns, places, some, x)| {
            some.iter().map(move |&term| (&columns[term], x[places[term]]))
        });
        Self::sum(simd, terms, sums);
    }
}

impl<const G: usize> Multiply for Block<'_, G> {
    #[inline(always)]
    fn multiply<S: Lanes>(
        &self,
        simd: S,
        [z, u]: [&[f64]; 2],
        _: &[Vec<usize>; 2],
        sums: &mut [Group],
    ) {
        let Self { all: Rows { moving, damped, .. }, of_z, of_u } = *self;
        let terms = [(of_z, moving, z), (of_u, damped, u)].map(|(columns, places, x)| {
            columns.iter().zip(places).map(|(column, &k)| (column, x[k]))
        });
        Self::sum(simd, terms, sums);
    }
}

#[inline(always)]
fn add_column<const G: usize, S: Lanes>(
    simd: S,
    column: &[Group; G],
    x: f64,
    sum: [Group; G],
) -> [Group; G] {
    let x = simd.splat_f64s(x);
    std::array::from_fn(|g| simd.mul_add_f64s(column[g], x, sum[g]))
}

impl Multiply for Rows {
    #[inline(always)]
    fn multiply<S: Lanes>(
        &self,
        simd: S,
        state: [&[f64]; 2],
        some: &[Vec<usize>; 2],
        mut sums: &mut [Group],
    ) {
        let mut columns = &self.columns[..];
        while !sums.is_empty() {
            let count = sums.len().min(BLOCK);
            let (block, next) = columns.split_at(count * (self.moving.len() + self.damped.len()));
            let (own, others) = sums.split_at_mut(count);
            match count {
                1 => Block::<1>::new(self, block).multiply_some(simd, state, some, own),
                2 => Block::<2>::new(self, block).multiply_some(simd, state, some, own),
                3 => Block::<3>::new(self, block).multiply_some(simd, state, some, own),
                _ => Block::<BLOCK>::new(self, block).multiply_some(simd, state, some, own),
            }
            (columns, sums) = (next, others);
        }
    }
}

/// The places in a list of what counts, without branches that are hard to foresee.
#[inline(always)]
fn keep(places: &mut Vec<usize>, all: &[usize], counts: impl Fn(usize) -> bool) {
    places.resize(all.len(), 0);
    let mut found = 0;
    for (place, &of) in all.iter().enumerate() {
        places[found] = place;
        found += usize::from(counts(of));
    }
    places.truncate(found);
}

impl Counting<'_> {
    /// The columns of the entries that count; also of those that are no numbers, and of coordinates without mass, which the norm
    /// does not weigh.
    #[inline(always)]
    fn select(self, [q, u]: [&[f64]; 2], rows: &Rows, columns: &mut [Vec<usize>; 2]) {
        let Self { weight, omega, least } = self;
        let moves = |k: usize| !(weight[k] * u[k].abs() <= least) || weight[k] == 0.0;
        let counts = |k: usize| !(weight[k] * omega * q[k].abs() <= least) || moves(k);
        let [of_z, of_u] = columns;
        keep(of_z, &rows.moving, counts);
        keep(of_u, &rows.damped, moves);
    }
}

/// Forces that follow from the motion, order by order.
pub(crate) trait Forces {
    /// Finds those of order k from its coefficients of places and of velocities, and from the rows: accelerations without these
    /// forces, and outputs.
    fn follow<S: Lanes>(&mut self, simd: S, k: usize, state: [&[f64]; 2], rows: [&[f64]; 2]);

    /// One of them.
    fn force(&self, place: usize, k: usize) -> f64;

    /// Velocities of coordinates of order k + 1 that are known better than by their rows.
    fn velocities(&self, k: usize) -> impl Iterator<Item = (usize, f64)>;
}

/// The forces of a linear equation, whose rows hold all of them.
pub(super) struct NoForces;

impl Forces for NoForces {
    #[inline(always)]
    fn follow<S: Lanes>(&mut self, _: S, _: usize, _: [&[f64]; 2], _: [&[f64]; 2]) {}

    #[inline(always)]
    fn force(&self, _: usize, _: usize) -> f64 {
        0.0
    }

    #[inline(always)]
    fn velocities(&self, _: usize) -> impl Iterator<Item = (usize, f64)> {
        std::iter::empty()
    }
}

/// Orders of the series, each from the two before.
pub(crate) struct Orders<'a, F> {
    pub rows: &'a Rows,
    pub products: &'a mut Products,
    /// `Q_k = q^(k) h^k / k!` of all coordinates, one order after the other; those of `orders` are two orders up.
    pub terms: &'a mut [f64],
    pub size: usize,
    /// h
    pub width: f64,
    pub orders: Range<usize>,
    pub counting: Counting<'a>,
    /// f of every coordinate, where it acts in the first of the orders.
    pub force: Option<&'a [f64]>,
    pub forces: F,
}

impl<F: Forces> Kernel for Orders<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        // With the number of groups as constants, the loops over those of one block unroll.
        let all = self.rows;
        match (all.states, all.outputs) {
            (1, 0) => self.recur::<1, 1, S>(simd, &Block::<1>::new(all, &all.columns)),
            (2, 0) => self.recur::<2, 2, S>(simd, &Block::<2>::new(all, &all.columns)),
            (3, 0) => self.recur::<3, 3, S>(simd, &Block::<3>::new(all, &all.columns)),
            (1, 1) => self.recur::<1, 2, S>(simd, &Block::<2>::new(all, &all.columns)),
            (2, 1) => self.recur::<2, 3, S>(simd, &Block::<3>::new(all, &all.columns)),
            (3, 1) => self.recur::<3, 4, S>(simd, &Block::<4>::new(all, &all.columns)),
            _ => self.recur::<0, 0, S>(simd, all),
        }
    }
}

impl<F: Forces> Orders<'_, F> {
    /// With `A` groups of rows of q'' and `G` groups of all rows, or with any number of them where these are 0.
    #[inline(always)]
    fn recur<const A: usize, const G: usize, S: Lanes>(self, simd: S, columns: &impl Multiply) {
        let Self { rows: all, products, terms, size: n, width, orders, .. } = self;
        let (counts, mut force, mut forces) = (self.counting, self.force, self.forces);
        let (states, groups) = if A > 0 { (A, G) } else { (all.states, all.states + all.outputs) };
        // Outputs of all orders are read again.
        let kept = if all.outputs > 0 { groups } else { 0 };
        let Products { z, u, newest, rows, counting, .. } = products;
        rows.resize(groups + kept * DEGREE, ZEROS);
        let [z, u, newest] = [z, u, newest].map(|of| {
            of.resize(states, ZEROS);
            &mut of[..states]
        });
        let (free, ends) = (&all.free[..states], &all.ends[..states]);
        let beta = all.beta;
        let (mut q, mut terms) = terms[orders.start * n..].split_at_mut(n);
        let rate = (orders.start + 1) as f64 / width;
        let numbers = cast_slice_mut::<Group, f64>;
        numbers(newest)[..n].copy_from_slice(&terms[..n]);
        for ((z, u), (q, dq)) in numbers(z).iter_mut().zip(numbers(u)).zip(q.iter().zip(&*terms)) {
            *u = rate * dq;
            *z = q + beta * *u;
        }
        let mut rows = &mut rows[orders.start * kept..];
        for k in orders {
            let (own, others) = std::mem::take(&mut rows).split_at_mut(groups);
            let state: [&[f64]; 2] = [cast_slice(z), cast_slice(u)];
            if A == 0 {
                counts.select([q, state[1]], all, counting);
            }
            columns.multiply(simd, state, counting, own);
            if let Some(force) = force.take() {
                all.load(force, &mut own[..states]);
            }
            let (accelerations, outputs) = own.split_at(states);
            let found = [cast_slice(accelerations), cast_slice(outputs)];
            forces.follow(simd, k, [q, state[1]], found);
            if k == DEGREE {
                break;
            }
            let factor = simd.splat_f64s(width * width / STEPS[k]);
            let rate = f64::from(k as u32 + 2) / width;
            let (by_beta, rate) = (simd.splat_f64s(beta * rate), simd.splat_f64s(rate));
            let (before, found) = terms.split_at_mut(n);
            let (mut remaining, mut start) = (&mut found[..n], 0);
            for g in 0..states {
                let mut sum = simd.mul_f64s(accelerations[g], factor);
                // The forces are known last.
                for (place, by_force) in &all.by_force[start..ends[g]] {
                    let force = simd.splat_f64s(forces.force(*place, k));
                    sum = simd.mul_add_f64s(simd.mul_f64s(*by_force, factor), force, sum);
                }
                start = ends[g];
                // What is held stays at zero, even if the others are beyond the range of numbers.
                let sum = simd.and_f64s(free[g], sum);
                u[g] = simd.mul_f64s(rate, sum);
                z[g] = simd.mul_add_f64s(by_beta, sum, newest[g]);
                newest[g] = sum;
                let own;
                (own, remaining) = remaining.split_at_mut(remaining.len().min(GROUP));
                store(sum, own);
            }
            for (place, velocity) in forces.velocities(k) {
                let term = velocity * width / f64::from(k as u32 + 2);
                (numbers(u)[place], numbers(newest)[place], found[place]) = (velocity, term, term);
            }
            (q, terms) = (before, found);
            rows = if kept > 0 { others } else { own };
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::simd::VectorUnit;
    use crate::scene::equation_of_motion::EquationOfMotion;
    use crate::scene::status::Combination;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    /// A mass in every dof, and one contact.
    fn dense(size: usize, numbers: &[f64], damping: Option<f64>) -> Scene {
        let number = |i: usize, j: usize| numbers[(3 * i + 7 * j + i * j) % numbers.len()];
        let entry = |i: usize, j: usize| match i == j {
            true => 10.0 * size as f64,
            false => number(i.min(j), i.max(j)),
        };
        let matrix = SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry));
        let damping = match damping {
            Some(beta) => Damping::Proportional { mass: 0.0, stiffness: beta },
            None => Damping::General(matrix.clone()),
        };
        let contact = ContactInput {
            tangential: Some(Direction::Dof(0)),
            normal: Some(Direction::Dof(1)),
            friction: 0.3,
            static_friction: 0.3,
            slider_speed: 0.1,
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped((0..size).map(|i| 1.5 + number(i, 0)).collect()),
            stiffness: matrix,
            damping,
            force: vec![0.0; size],
            contacts: vec![contact],
            ..Default::default()
        };
        Scene::new(input).expect("well-posed")
    }

    proptest! {
        /// Rows against the equation of motion, outputs against their sums, and every vector unit against the portable one.
        #[test]
        fn rows_are_scalar_sums(
            size in 2usize..40,
            numbers in proptest::collection::vec(-1.0..1.0f64, 200),
            beta in prop_oneof![Just(None), (0.0..0.1f64).prop_map(Some)],
            status in 0usize..3,
            forced in any::<bool>(),
            least in 0.0..3.0f64,
        ) {
            let scene = dense(size, &numbers, beta);
            let combination = Combination::parse(["+", "s", "d"][status], 1).expect("a letter");
            let equation = EquationOfMotion::new(&scene, &combination).expect("regular");
            let output = Functional {
                position: (0..size).map(|k| (k, numbers[k + 20])).collect(),
                velocity: (0..size).map(|k| (k, numbers[k + 80])).collect(),
                constant: 0.0,
            };
            let kept = &equation.reduction.kept;
            let directions: Vec<_> = kept.first().map(|&k| vec![(k, 2.0)]).into_iter().collect();
            let moving: Vec<usize> = equation.moving().collect();
            let new = |outputs: &[&Functional], forces: &[Vec<(usize, f64)>]| {
                let moving = moving.iter().copied();
                Rows::new(&scene, &equation.reduction, moving, outputs, forces).expect("dense")
            };
            let width = 0.01;
            let mut start = vec![0.0; 4 * size];
            for &k in &moving {
                (start[k], start[size + k]) = (numbers[k + 40], numbers[k + 120]);
            }
            let force: Vec<f64> = (0..size).map(|k| numbers[k + 60]).collect();
            let rows = new(&[], &[]);
            let omega = 3.0;
            let weight: Vec<f64> = (0..size).map(|k| scene.mass.get(k, k).sqrt()).collect();
            let by = |unit: VectorUnit, least: f64| {
                let (mut terms, mut products) = (start.clone(), Products::default());
                unit.run(Orders {
                    rows: &rows,
                    products: &mut products,
                    terms: &mut terms,
                    size,
                    width,
                    orders: 0..2,
                    counting: Counting { weight: &weight, omega, least },
                    force: forced.then_some(&force[..]),
                    forces: NoForces,
                });
                terms
            };
            let terms = by(VectorUnit::default(), 0.0);
            prop_assert_eq!(&terms, &by(VectorUnit::Portable, 0.0));
            // Entries that do not count leave out no more of q'' than the norm of its row times the least one.
            let some = by(VectorUnit::default(), least);
            prop_assert_eq!(&some, &by(VectorUnit::Portable, least));
            for (i, &row) in kept.iter().enumerate() {
                let of = |matrix: &SparseMatrix, factor: f64| -> f64 {
                    let entries = equation.reduction.sources(i).flat_map(|(source, merged)| {
                        matrix.row(source).map(move |(k, value)| (k, (merged * value).abs()))
                    });
                    entries.map(|(k, value)| factor * value / weight[k]).sum()
                };
                let norm = of(&scene.stiffness, 1.0 / omega) + of(&scene.damping, 1.0);
                let allowed = norm * least / scene.mass.get(row, row) * width * width / 2.0;
                let off = (some[2 * size + row] - terms[2 * size + row]).abs();
                prop_assert!(off <= allowed + 1e-12, "{off:e} {allowed:e}");
            }
            for k in 0..2 {
                let q = &terms[k * size..(k + 1) * size];
                let u: Vec<f64> = terms[(k + 1) * size..(k + 2) * size]
                    .iter()
                    .map(|dq| (k + 1) as f64 / width * dq)
                    .collect();
                let mut residual = if forced && k == 0 { force.clone() } else { vec![0.0; size] };
                scene.stiffness.add_product(-1.0, q, &mut residual);
                scene.damping.add_product(-1.0, &u, &mut residual);
                // L' of the force is the force itself.
                if forced && k == 0 {
                    let loads = equation.reduction.merges.iter();
                    loads.for_each(|merge| residual[merge.normal] -= force[merge.normal]);
                }
                let mut acceleration = vec![0.0; size];
                equation.accelerate(&mut residual, &mut acceleration);
                let factor = width * width / ((k + 1) * (k + 2)) as f64;
                let largest = acceleration.iter().fold(1.0, |all: f64, a| all.max(a.abs()));
                for i in 0..size {
                    let off = terms[(k + 2) * size + i] - factor * acceleration[i];
                    // Sums of at most 80 terms of the size of the diagonal.
                    prop_assert!(off.abs() <= 1e-12 * factor * largest.max(10.0 * size as f64), "{off:e}");
                }
            }
            let rows = new(&[&output], &directions);
            let (mut terms, mut products) = (start.clone(), Products::default());
            VectorUnit::default().run(Orders {
                rows: &rows,
                products: &mut products,
                terms: &mut terms,
                size,
                width,
                orders: 0..1,
                counting: Counting { weight: &weight, omega, least: 0.0 },
                force: None,
                forces: NoForces,
            });
            let u: Vec<f64> = start[size..2 * size].iter().map(|dq| dq / width).collect();
            let found = *products.row(&rows, 0).next().expect("one order");
            let expected = output.value(&start[..size], &u);
            prop_assert!((found - expected).abs() <= 1e-12 * size as f64 / width);
        }
    }
}
