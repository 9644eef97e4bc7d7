//! A small combination with lumped masses under laws of friction, in rows for the vector unit.
//!
//! The rows of `-M^-1 L'K` and `-M^-1 L'C`, and below them those of the slip speeds, normal forces and event functions, stand in
//! groups of [`ROWS`], and in a group column after column, so that one product per order gives all of them.

use pulp::cast;

use crate::contact::event_function::{EventFunction, Functional};
use crate::linalg::sparse::SparseMatrix;
use crate::motion::friction::series::law_contact::LawContact;
use crate::motion::taylor::dense_rows::DenseRows;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Two groups: with the sums over q and q' four chains of additions, enough to hide their latency.
pub(crate) const ROWS: usize = 2 * GROUP;

/// A column of a group of rows.
type Column = [Group; 2];

#[derive(Debug)]
pub(crate) struct LawRows {
    /// Columns over q and over q'.
    columns: Vec<[Column; 2]>,
    /// Number of columns, of groups of rows of q'' and of the others, and of laws.
    size: usize,
    states: usize,
    outputs: usize,
    laws: usize,
    /// 1 / m of the coordinates left free, 0 of the others; in whole groups of rows.
    inverse_mass: Vec<f64>,
    /// q'' per unit of force of each law, in whole groups of rows.
    by_force: Vec<f64>,
}

impl LawRows {
    /// The rows of a combination, unless it is so large and sparse that they would take longer.
    pub fn new(
        scene: &Scene,
        reduction: &Reduction,
        contacts: &[LawContact],
        functions: &[EventFunction],
    ) -> Option<Self> {
        if !DenseRows::are_quicker(scene) {
            return None;
        }
        let n = scene.size;
        let states = n.div_ceil(ROWS);
        let outputs = (2 * contacts.len() + functions.len()).div_ceil(ROWS);
        let mut columns = vec![[[0.0; ROWS]; 2]; (states + outputs) * n];
        let mut add = |row: usize, column: usize, of: usize, value: f64| {
            columns[row / ROWS * n + column][of][row % ROWS] += value;
        };
        let mut inverse_mass = vec![0.0; states * ROWS];
        for (i, &row) in reduction.kept.iter().enumerate() {
            inverse_mass[row] = 1.0 / scene.mass.get(row, row);
            let mut merge = |matrix: &SparseMatrix, of: usize| {
                for (source, factor) in reduction.sources(i) {
                    for (k, value) in matrix.row(source) {
                        add(row, k, of, -inverse_mass[row] * factor * value);
                    }
                }
            };
            merge(&scene.stiffness, 0);
            merge(&scene.damping, 1);
        }
        let mut output = |place: usize, factor: f64, functional: &Functional| {
            for (of, terms) in [&functional.position, &functional.velocity].into_iter().enumerate()
            {
                terms.iter().for_each(|&(k, w)| add(states * ROWS + place, k, of, factor * w));
            }
        };
        for (i, one) in contacts.iter().enumerate() {
            output(2 * i, -one.sign, &one.slip);
            output(2 * i + 1, 1.0, &one.normal);
        }
        for (i, function) in functions.iter().enumerate() {
            output(2 * contacts.len() + i, 1.0, &function.functional);
        }
        let mut by_force = vec![0.0; contacts.len() * states * ROWS];
        for (one, rows) in contacts.iter().zip(by_force.chunks_exact_mut(states * ROWS)) {
            for &(k, weight) in &one.direction {
                rows[k] = one.sign * weight * inverse_mass[k];
            }
        }
        let columns = columns.into_iter().map(|of| of.map(cast::<[f64; ROWS], Column>)).collect();
        Some(Self {
            columns,
            size: n,
            states,
            outputs,
            laws: contacts.len(),
            inverse_mass,
            by_force,
        })
    }

    /// Groups of rows of q'', and groups of the slip speed and the normal force of every contact and of the event functions.
    pub fn groups(&self) -> [usize; 2] {
        [self.states, self.outputs]
    }

    /// All rows of one order, without what forces add; q' is `rate` times the next coefficients of q.
    #[inline(always)]
    pub fn multiply<S: Lanes>(
        &self,
        simd: S,
        q: &[f64],
        dq: &[f64],
        rate: f64,
        states: &mut [[f64; ROWS]],
        outputs: &mut [[f64; ROWS]],
    ) {
        let rate = simd.splat_f64s(rate);
        let n = self.size;
        let (q, dq) = (&q[..n], &dq[..n]);
        if let ([state], [output]) = (&mut *states, &mut *outputs) {
            let columns = self.columns.split_at(n);
            return both(simd, columns, q, dq, rate, [state, output]);
        }
        // Loops over places: iterators over several slices are not always inlined.
        for g in (0..self.states + self.outputs).rev() {
            let columns = &self.columns[g * n..(g + 1) * n];
            let (mut of_q, mut of_u) = ([ZEROS; 2], [ZEROS; 2]);
            for j in 0..n {
                let (q, dq) = (simd.splat_f64s(q[j]), simd.splat_f64s(dq[j]));
                add_column(simd, &columns[j], [q, dq], [&mut of_q, &mut of_u]);
            }
            let sum = summed(simd, of_q, of_u, rate);
            match states.get_mut(g) {
                Some(state) => *state = cast(sum),
                None => outputs[g - self.states] = cast(sum),
            }
        }
    }

    /// Adds the force at the origin to the rows of q'' of order 0.
    #[inline(always)]
    pub fn load(&self, force: &[f64], rows: &mut [[f64; ROWS]]) {
        let rows = rows.as_flattened_mut().iter_mut().zip(&self.inverse_mass);
        rows.zip(force).for_each(|((row, inverse), force)| *row += inverse * force);
    }

    /// Q of two orders up: `factor` times the rows of q'', with the forces of laws.
    #[inline(always)]
    pub fn next<S: Lanes>(
        &self,
        simd: S,
        rows: &[[f64; ROWS]],
        forces: impl Fn(usize) -> f64,
        factor: f64,
        mut next: &mut [f64],
    ) {
        let groups = self.states * ROWS / GROUP;
        let rows = &rows.as_flattened().as_chunks::<GROUP>().0[..groups];
        let by_force = self.by_force.as_chunks::<GROUP>().0;
        let factor = simd.splat_f64s(factor);
        for g in 0..groups {
            let mut sum = simd.mul_f64s(cast(rows[g]), factor);
            for contact in 0..self.laws {
                // The forces are known last.
                let by_force = simd.mul_f64s(cast(by_force[contact * groups + g]), factor);
                sum = simd.mul_add_f64s(by_force, simd.splat_f64s(forces(contact)), sum);
            }
            let lanes = next.len().min(GROUP);
            let (own, rest) = std::mem::take(&mut next).split_at_mut(lanes);
            store(sum, own);
            next = rest;
        }
    }
}

/// One group of rows of each kind, for which every coordinate is loaded once. Forces, and so the next order, wait for the sums
/// over q' of the outputs, which are therefore two.
#[inline(always)]
fn both<S: Lanes>(
    simd: S,
    (of_state, of_output): (&[[Column; 2]], &[[Column; 2]]),
    q: &[f64],
    dq: &[f64],
    rate: Group,
    [state, output]: [&mut [f64; ROWS]; 2],
) {
    let (mut state_q, mut state_u) = ([ZEROS; 2], [ZEROS; 2]);
    let (mut output_q, mut even, mut odd) = ([ZEROS; 2], [ZEROS; 2], [ZEROS; 2]);
    let pairs = of_state.chunks_exact(2).zip(of_output.chunks_exact(2));
    let numbers = q.chunks_exact(2).zip(dq.chunks_exact(2));
    for ((of_state, of_output), (q, dq)) in pairs.zip(numbers) {
        let first = [q[0], dq[0]].map(|number| simd.splat_f64s(number));
        add_column(simd, &of_output[0], first, [&mut output_q, &mut even]);
        add_column(simd, &of_state[0], first, [&mut state_q, &mut state_u]);
        let second = [q[1], dq[1]].map(|number| simd.splat_f64s(number));
        add_column(simd, &of_output[1], second, [&mut output_q, &mut odd]);
        add_column(simd, &of_state[1], second, [&mut state_q, &mut state_u]);
    }
    if let ([q], [dq]) = (q.chunks_exact(2).remainder(), dq.chunks_exact(2).remainder()) {
        let last = [*q, *dq].map(|number| simd.splat_f64s(number));
        add_column(simd, &of_output[of_output.len() - 1], last, [&mut output_q, &mut even]);
        add_column(simd, &of_state[of_state.len() - 1], last, [&mut state_q, &mut state_u]);
    }
    let output_u = std::array::from_fn(|half| simd.add_f64s(even[half], odd[half]));
    *output = cast(summed(simd, output_q, output_u, rate));
    *state = cast(summed(simd, state_q, state_u, rate));
}

#[inline(always)]
fn add_column<S: Lanes>(
    simd: S,
    [by_q, by_u]: &[Column; 2],
    [q, dq]: [Group; 2],
    [of_q, of_u]: [&mut Column; 2],
) {
    of_q[0] = simd.mul_add_f64s(by_q[0], q, of_q[0]);
    of_q[1] = simd.mul_add_f64s(by_q[1], q, of_q[1]);
    of_u[0] = simd.mul_add_f64s(by_u[0], dq, of_u[0]);
    of_u[1] = simd.mul_add_f64s(by_u[1], dq, of_u[1]);
}

/// `of_q + rate of_u`
#[inline(always)]
fn summed<S: Lanes>(simd: S, of_q: Column, of_u: Column, rate: Group) -> Column {
    [simd.mul_add_f64s(of_u[0], rate, of_q[0]), simd.mul_add_f64s(of_u[1], rate, of_q[1])]
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
                let rate = simd.splat_f64s((k + 1) as f64 * inverse);
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
