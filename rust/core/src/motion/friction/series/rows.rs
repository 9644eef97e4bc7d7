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
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Groups of rows that are summed together, each in two chains of additions that hide their latency.
pub(crate) const BLOCK: usize = 4;
/// Relative difference of a damping and beta times a stiffness that is their rounding.
const SAME: f64 = 2.0 * f64::EPSILON;

#[derive(Debug)]
pub(crate) struct LawRows {
    /// The groups of all columns, block by block.
    pub columns: Vec<Group>,
    /// Coordinates whose z, and whose q', have a column.
    pub moving: Vec<usize>,
    pub damped: Vec<usize>,
    pub beta: f64,
    /// Number of groups of rows of q'' and of the others, and of laws.
    pub states: usize,
    outputs: usize,
    laws: usize,
    /// Which of the other rows each event function has.
    places: Vec<Option<usize>>,
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
}

impl Products {
    /// The rows of one order, without those of q''.
    #[inline(always)]
    pub fn outputs(&self, all: &LawRows, k: usize) -> &[f64] {
        let groups = all.states + all.outputs;
        pulp::bytemuck::cast_slice(&self.rows[k * groups + all.states..(k + 1) * groups])
    }

    /// Room for the rows of all orders.
    pub fn room(&mut self, all: &LawRows) -> &mut [Group] {
        self.rows.resize((all.states + all.outputs) * COEFFICIENTS, ZEROS);
        &mut self.rows
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
        let mut places = Vec::with_capacity(functions.len());
        for EventFunction { functional, .. } in functions {
            let mut place = functionals.iter().position(|&known| known == functional);
            if place.is_none() && functional.single().is_none() {
                place = Some(functionals.len());
                functionals.push(functional);
            }
            places.push(place);
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
        let mut columns = Vec::new();
        let groups: Vec<usize> = (0..states + outputs).collect();
        for block in groups.chunks(BLOCK) {
            for (of, places) in dense.iter().zip([&moving, &damped]) {
                let column = |k: usize, g: usize| -> [f64; GROUP] {
                    std::array::from_fn(|lane| of[(g * GROUP + lane) * n + k])
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
            places,
            inverse_mass,
            by_force,
        })
    }

    /// The row of an event function among those below q''.
    pub fn place(&self, function: usize) -> Option<usize> {
        self.places[function]
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
        let Products { z, u, rows } = products;
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

    /// Whether all rows are one block with one group below those of q''.
    pub fn is_block(&self) -> bool {
        self.states < BLOCK && self.outputs == 1
    }

    /// q'' per unit of force of one law, in a block; zero of one that is not there.
    #[inline(always)]
    pub fn by_force<const T: usize>(&self, law: usize) -> [Group; T] {
        let rows = self.by_force.as_chunks::<GROUP>().0.get(law * self.states..);
        let mut block = [ZEROS; T];
        let rows = rows.into_iter().flatten().take(self.states);
        block.iter_mut().zip(rows).for_each(|(to, from)| *to = cast(*from));
        block
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
        let Products { z, u, rows } = products;
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
            let mut before = lanes_of(simd, &terms[orders * n + first..], lanes);
            for k in (0..orders).rev() {
                // From a small integer the conversion is one instruction.
                let rate = simd.splat_f64s(f64::from(k as u32 + 1) * inverse);
                u = simd.mul_add_f64s(simd.max_f64s(before, simd.sub_f64s(ZEROS, before)), rate, u);
                before = lanes_of(simd, &terms[k * n + first..], lanes);
                q = simd.add_f64s(q, simd.max_f64s(before, simd.sub_f64s(ZEROS, before)));
                if k == 2 {
                    store(q, &mut higher_q[first..first + lanes]);
                    store(u, &mut higher_u[first..first + lanes]);
                }
            }
            store(q, &mut all_q[first..first + lanes]);
            store(u, &mut all_u[first..first + lanes]);
            first += GROUP;
        }
    }
}

/// The first numbers, and zeros.
#[inline(always)]
fn lanes_of<S: Lanes>(simd: S, numbers: &[f64], lanes: usize) -> Group {
    match numbers.first_chunk::<GROUP>() {
        Some(whole) => cast(*whole),
        None => simd.partial_load_f64s(&numbers[..lanes]),
    }
}

/// The first lanes of a group.
#[inline(always)]
fn store(group: Group, into: &mut [f64]) {
    match into.first_chunk_mut::<GROUP>() {
        Some(whole) => *whole = cast(group),
        None => {
            let lanes: [f64; GROUP] = cast(group);
            into.copy_from_slice(&lanes[..into.len()]);
        }
    }
}
