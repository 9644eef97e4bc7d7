//! A small combination with lumped masses under laws of friction, in rows for the vector unit.
//!
//! Below the rows of `q''` stand those of normal forces and event functions, in groups of four, and in a block of groups column
//! after column, so that one product per order gives all of them. Where `C = beta K`, the rows act on `z = q + beta q'` alone:
//! `-M^-1 L'K z`. Functionals of one coordinate, such as slip speeds, need no row.

use pulp::cast;

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::linalg::sparse::SparseMatrix;
use crate::motion::friction::series::law_contact::LawContact;
use crate::motion::taylor::dense_rows::DenseRows;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, lanes_of, store};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Groups of rows that are summed together, each in two chains of additions that hide their latency.
const BLOCK: usize = 4;
/// Relative difference of a damping and beta times a stiffness that is their rounding.
const SAME: f64 = 2.0 * f64::EPSILON;

/// Where the coefficients of an event function are.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Source {
    /// In one of the rows below those of q''.
    Row(usize),
    /// In the slip speed of one of the contacts that slide by their laws.
    Slip(usize),
    /// In those of a coordinate.
    Coordinate,
}

#[derive(Debug)]
pub(crate) struct LawRows {
    /// The groups of all columns, block by block.
    columns: Vec<Group>,
    /// Coordinates whose z, and whose q', have a column.
    moving: Vec<usize>,
    damped: Vec<usize>,
    beta: f64,
    /// Number of groups of rows of q'' and of the others, and of laws.
    states: usize,
    outputs: usize,
    laws: usize,
    /// Where the coefficients of each event function are.
    sources: Vec<Source>,
    /// 1 / m of the coordinates left free, 0 of the others; in whole groups of rows.
    inverse_mass: Vec<f64>,
    /// q'' per unit of force of each law, in whole groups of rows.
    by_force: Vec<f64>,
}

/// z and q' of one order, and the rows of all orders.
#[derive(Debug, Default)]
pub(crate) struct Products {
    z: Vec<Group>,
    u: Vec<Group>,
    rows: Vec<Group>,
    /// Of the rows below those of q'': sums of the negative ones from order 1 on, and of the absolute values of all terms,
    /// of all orders and of those from 2 on.
    negative: Vec<Group>,
    sizes: [Vec<Group>; 2],
}

fn numbers(groups: &[Group]) -> &[f64] {
    pulp::bytemuck::cast_slice(groups)
}

impl Products {
    /// The rows of one order, without those of q''.
    #[inline(always)]
    pub fn outputs(&self, all: &LawRows, k: usize) -> &[f64] {
        let groups = all.states + all.outputs;
        pulp::bytemuck::cast_slice(&self.rows[k * groups + all.states..(k + 1) * groups])
    }

    /// Room for the rows of all orders.
    fn room(&mut self, all: &LawRows) {
        self.rows.resize((all.states + all.outputs) * COEFFICIENTS, ZEROS);
    }

    /// The rows of q'' of order 0.
    pub fn states(&mut self, all: &LawRows) -> &mut [f64] {
        pulp::bytemuck::cast_slice_mut(&mut self.rows[..all.states])
    }

    /// One of these rows, of all orders.
    pub fn row(&self, all: &LawRows, place: usize) -> impl Iterator<Item = &f64> {
        let numbers: &[f64] = pulp::bytemuck::cast_slice(&self.rows);
        let stride = (all.states + all.outputs) * GROUP;
        numbers[all.states * GROUP + place..].iter().step_by(stride)
    }

    /// Order 0 of a row below those of q'', and a bound from below of what the other orders add.
    pub fn least(&self, all: &LawRows, place: usize) -> [f64; 2] {
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
        all: &LawRows,
        of: &Sizes,
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
            sizes.push(all.sizes(simd, output, &of.all[0], &of.all[1]));
            higher.push(all.sizes(simd, output, &of.higher[0], &of.higher[1]));
        }
    }

    /// q' of a coordinate in the order in progress.
    #[inline(always)]
    pub fn velocity(&self, place: usize) -> f64 {
        pulp::bytemuck::cast_slice::<Group, f64>(&self.u)[place]
    }
}

impl LawRows {
    /// The rows of a combination, unless it is so large and sparse that they would take longer.
    pub fn new(
        scene: &Scene,
        reduction: &Reduction,
        moving: impl Iterator<Item = usize>,
        contacts: &[LawContact],
        functions: &[EventFunction],
    ) -> Option<Self> {
        if !DenseRows::are_quicker(scene) {
            return None;
        }
        let n = scene.size;
        // Normal forces come first.
        let mut functionals: Vec<&Functional> = contacts.iter().map(|one| &one.normal).collect();
        let mut sources = Vec::with_capacity(functions.len());
        for EventFunction { functional, .. } in functions {
            let is_slip = |one: &LawContact| one.slip.scaled(-one.sign) == *functional;
            let known = functionals.iter().position(|&known| known == functional);
            sources.push(match (known, contacts.iter().position(is_slip)) {
                (Some(place), _) => Source::Row(place),
                (None, Some(contact)) => Source::Slip(contact),
                (None, None) if functional.single().is_some() => Source::Coordinate,
                (None, None) => {
                    functionals.push(functional);
                    Source::Row(functionals.len() - 1)
                }
            });
        }
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
        let moves = |k: usize| moving.contains(&k);
        let mut columns = Vec::new();
        let groups: Vec<usize> = (0..states + outputs).collect();
        for block in groups.chunks(BLOCK) {
            for (of, places) in dense.iter().zip([&moving, &damped]) {
                let column = |k: usize, g: usize| -> [f64; GROUP] {
                    let entry = |lane: usize| of[(g * GROUP + lane) * n + k];
                    if moves(k) { std::array::from_fn(entry) } else { [0.0; GROUP] }
                };
                let groups = places.iter().flat_map(|&k| block.iter().map(move |&g| (k, g)));
                columns.extend(groups.map(|(k, g)| cast::<_, Group>(column(k, g))));
            }
        }
        let mut by_force = vec![0.0; contacts.len() * states * GROUP];
        for (one, rows) in contacts.iter().zip(by_force.chunks_exact_mut(states * GROUP)) {
            for &(k, weight) in &one.direction {
                rows[k] = one.sign * weight * inverse_mass[k];
            }
        }
        Some(Self {
            columns,
            moving,
            damped,
            beta: beta.unwrap_or(0.0),
            states,
            outputs,
            laws: contacts.len(),
            sources,
            inverse_mass,
            by_force,
        })
    }

    /// Where the coefficients of an event function are.
    pub fn source(&self, function: usize) -> Source {
        self.sources[function]
    }

    /// Sums of the absolute values of the terms of four rows below those of q''.
    #[inline(always)]
    fn sizes<S: Lanes>(&self, simd: S, output: usize, q: &[f64], u: &[f64]) -> Group {
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

    /// Begins a panel with the coefficients of q of orders 0 and 1.
    pub fn begin(&self, products: &mut Products, q: &[f64], dq: &[f64], rate: f64) {
        products.room(self);
        let Products { z, u, .. } = products;
        z.resize(self.states, ZEROS);
        u.resize(self.states, ZEROS);
        let numbers = pulp::bytemuck::cast_slice_mut::<Group, f64>;
        for ((z, u), (q, dq)) in numbers(z).iter_mut().zip(numbers(u)).zip(q.iter().zip(dq)) {
            *u = rate * dq;
            *z = q + self.beta * *u;
        }
    }

    /// All rows of one order, without what forces add.
    #[inline(always)]
    pub fn multiply<S: Lanes>(&self, simd: S, k: usize, products: &mut Products) {
        let Products { z, u, rows, .. } = products;
        let groups = self.states + self.outputs;
        let mut rows = &mut rows[k * groups..(k + 1) * groups];
        let (z, u) = (pulp::bytemuck::cast_slice(z), pulp::bytemuck::cast_slice(u));
        let mut columns = &self.columns[..];
        while !rows.is_empty() {
            let count = rows.len().min(BLOCK);
            let (block, next) = columns.split_at(count * (self.moving.len() + self.damped.len()));
            let (sums, others) = rows.split_at_mut(count);
            match count {
                1 => self.block::<1, S>(simd, block, z, u, sums),
                2 => self.block::<2, S>(simd, block, z, u, sums),
                3 => self.block::<3, S>(simd, block, z, u, sums),
                _ => self.block::<BLOCK, S>(simd, block, z, u, sums),
            }
            (columns, rows) = (next, others);
        }
    }

    #[inline(always)]
    fn block<const G: usize, S: Lanes>(
        &self,
        simd: S,
        columns: &[Group],
        z: &[f64],
        u: &[f64],
        sums: &mut [Group],
    ) {
        let (mut even, mut odd) = ([ZEROS; G], [ZEROS; G]);
        let (of_z, of_u) = columns.as_chunks::<G>().0.split_at(self.moving.len());
        for (columns, places, x) in [(of_z, &self.moving, z), (of_u, &self.damped, u)] {
            let (pairs, last) = columns.as_chunks::<2>();
            let (twos, one) = places.as_chunks::<2>();
            for (pair, &[a, b]) in pairs.iter().zip(twos) {
                even = add_column(simd, &pair[0], x[a], even);
                odd = add_column(simd, &pair[1], x[b], odd);
            }
            if let ([column], [a]) = (last, one) {
                even = add_column(simd, column, x[*a], even);
            }
        }
        for (sum, (even, odd)) in sums.iter_mut().zip(even.into_iter().zip(odd)) {
            *sum = simd.add_f64s(even, odd);
        }
    }

    /// Adds the force at the origin to the rows of q'' of order 0.
    #[inline(always)]
    pub fn load(&self, force: &[f64], rows: &mut [f64]) {
        let rows = rows.iter_mut().zip(&self.inverse_mass);
        rows.zip(force).for_each(|((row, inverse), force)| *row += inverse * force);
    }

    /// Q of two orders up: `factor` times the rows of q'', with the forces of laws. `terms` begin with the order between, of `n`
    /// numbers, whose velocity is `rate` times the order found.
    #[inline(always)]
    pub fn next<S: Lanes>(
        &self,
        simd: S,
        k: usize,
        products: &mut Products,
        forces: impl Fn(usize) -> f64,
        [factor, rate]: [f64; 2],
        (n, terms): (usize, &mut [f64]),
    ) {
        let Products { z, u, rows, .. } = products;
        let rows = &rows[k * (self.states + self.outputs)..][..self.states];
        let by_force = self.by_force.as_chunks::<GROUP>().0;
        let [factor, rate, by_beta] = [factor, rate, self.beta * rate].map(|x| simd.splat_f64s(x));
        let (before, found) = terms.split_at_mut(n);
        for g in 0..self.states {
            let mut sum = simd.mul_f64s(rows[g], factor);
            for contact in 0..self.laws {
                // The forces are known last.
                let by_force = simd.mul_f64s(cast(by_force[contact * self.states + g]), factor);
                sum = simd.mul_add_f64s(by_force, simd.splat_f64s(forces(contact)), sum);
            }
            u[g] = simd.mul_f64s(rate, sum);
            let first = g * GROUP;
            let lanes = (n - first).min(GROUP);
            z[g] = simd.mul_add_f64s(by_beta, sum, lanes_of(simd, &before[first..], lanes));
            store(sum, &mut found[first..first + lanes]);
        }
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

/// Sums of absolute values of the coefficients of every coordinate and velocity, of all orders and of those from 2 on.
#[derive(Debug, Default)]
pub(crate) struct Sizes {
    /// Over q and over q'.
    pub all: [Vec<f64>; 2],
    pub higher: [Vec<f64>; 2],
}

impl Sizes {
    /// The sum of the absolute values of the terms of a functional.
    #[inline(always)]
    pub fn of([q, u]: &[Vec<f64>; 2], functional: &Functional) -> f64 {
        let sum = |terms: &[(usize, f64)], sizes: &[f64]| -> f64 {
            terms.iter().map(|&(i, weight)| weight.abs() * sizes[i]).sum()
        };
        sum(&functional.position, q) + sum(&functional.velocity, u)
    }
}

/// Fills them in from the terms of a panel of this width, one order after the other.
pub(crate) struct Measure<'a> {
    pub sizes: &'a mut Sizes,
    pub terms: &'a [f64],
    pub size: usize,
    pub width: f64,
}

impl Kernel for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { sizes: Sizes { all, higher }, terms, size: n, width } = self;
        for sizes in all.iter_mut().chain(higher.iter_mut()) {
            sizes.resize(n, 0.0);
        }
        let ([all_q, all_u], [higher_q, higher_u]) = (all, higher);
        let (orders, inverse) = (terms.len() / n - 1, 1.0 / width);
        let mut first = 0;
        while first < n {
            let lanes = (n - first).min(GROUP);
            let (mut q, mut u) = (ZEROS, ZEROS);
            let (mut of_higher, mut before) = ([ZEROS; 2], ZEROS);
            for (k, terms) in terms.chunks_exact(n).enumerate().rev() {
                // From a small integer the conversion is one instruction.
                let rate = simd.splat_f64s(f64::from(k as u32 + 1) * inverse);
                u = simd.mul_add_f64s(before, rate, u);
                before = simd.abs_f64s(lanes_of(simd, &terms[first..], lanes));
                if k < orders {
                    q = simd.add_f64s(q, before);
                }
                if k == 2 {
                    of_higher = [q, u];
                }
            }
            store(of_higher[0], &mut higher_q[first..first + lanes]);
            store(of_higher[1], &mut higher_u[first..first + lanes]);
            store(q, &mut all_q[first..first + lanes]);
            store(u, &mut all_u[first..first + lanes]);
            first += GROUP;
        }
    }
}
