//! Taylor propagation: derivatives of the state by repeated use of the equation of motion, matrix-free.
//!
//! With `Q_k = q^(k) h^k / k!` the equation of motion gives
//! `(k + 1)(k + 2) Q_{k+2} = h^2 M^-1 (F_k - K Q_k - C (k + 1) Q_{k+1} / h)` row by row of the
//! combination. No eigenvector is needed, so nothing is lost at a defective point.
//!
//! The series is that of the displacement from the start of the phase, under the force `F - K q(0)` formed in doubled
//! precision: rounding is then relative to the motion and not to the static displacement.

use std::ops::Range;

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::motion::panel::{Panel, rounding};
use crate::motion::series::{Horner, Sizes, size_of};
use crate::motion::taylor::bordered::{Buffers, Order};
use crate::motion::taylor::doubled_products::LessDot;
use crate::motion::taylor::function_rows::{FunctionRow, FunctionRows, LONG};
use crate::motion::taylor::operator::{InModes, TaylorOperator};
use crate::motion::taylor::rows::{Counting, NoForces, Orders, Products, Rows};
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, powers};
use crate::numerics::simd::{Lanes, VectorUnit};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::RowMerge;

/// Bound of the terms that the series may leave out, relative to the state.
pub(crate) const TRUNCATION: f64 = 0.1 * f64::EPSILON;

/// Orders of the terms.
pub(crate) const ORDERS: usize = DEGREE + 2;

/// One phase by Taylor series; its buffers serve every phase of a run.
#[derive(Debug, Default)]
pub(crate) struct TaylorMotion {
    start: Doubled,
    panels: u32,
    /// Of the panel, s.
    pub(crate) width: f64,
    /// Coordinates.
    size: usize,
    /// q at local time 0, from which displacements count, and `L' (F - K q)` there.
    pub(crate) origin: Vec<f64>,
    /// The same place in the coordinates of the scene, where the series moves in others.
    place: Vec<f64>,
    pub(crate) force: Vec<f64>,
    /// Norm of the origin.
    scale: f64,
    /// Each event function at the origin at rest, and the sum of the absolute values of its terms.
    constants: Vec<[f64; 2]>,
    /// Q_0 .. Q_{DEGREE + 1} of the displacement, one after the other; and coordinate by coordinate, of a small scene.
    terms: Vec<f64>,
    series: Vec<f64>,
    residual: Vec<f64>,
    combined: Vec<f64>,
    /// Of dense rows.
    pub(crate) products: Products,
    /// Of the product with a border.
    buffers: Buffers,
    /// Absolute values of coefficients, of position and velocity: constant, linear, and the sum of the others.
    sizes: [[Vec<f64>; 2]; 3],
    /// The same of `q + beta q'`.
    together: [Vec<f64>; 3],
    /// Functions that the sizes alone can't exclude.
    open: Vec<usize>,
    unit: VectorUnit,
}

impl TaylorMotion {
    /// Starts a phase at local time 0 from (q, q').
    pub fn restart(
        &mut self,
        scene: &Scene,
        operator: &TaylorOperator,
        functions: &[EventFunction],
        q: &[f64],
        u: &[f64],
    ) {
        let Some(InModes { modes, functions }) = &operator.held else {
            self.begin(scene, operator, functions, q, u);
            return self.fill(scene, operator);
        };
        let [z, rates] = [q, u].map(|of| modes.amplitudes(of));
        self.begin(&modes.scene, operator, functions, &z, &rates);
        self.place.clone_from(&self.origin);
        modes.free().iter().for_each(|&k| self.place[k] = q[k]);
        self.fill(&modes.scene, operator);
    }

    /// The same without its series.
    pub(crate) fn begin(
        &mut self,
        scene: &Scene,
        operator: &TaylorOperator,
        functions: &[EventFunction],
        q: &[f64],
        u: &[f64],
    ) {
        let n = scene.size;
        self.start = Doubled::default();
        self.panels = 0;
        self.size = n;
        self.origin.clear();
        self.origin.resize(n, 0.0);
        self.terms.clear();
        self.terms.resize(n * ORDERS, 0.0);
        self.residual.resize(n, 0.0);
        self.combined.resize(n, 0.0);
        for &k in &operator.equation.reduction.states {
            self.origin[k] = q[k];
            self.terms[n + k] = u[k] * operator.width;
        }
        for &(k, speed) in &operator.equation.reduction.sticking {
            self.origin[k] = q[k];
            self.terms[n + k] = speed * operator.width;
        }
        operator.equation.reduction.place_closed(&mut self.origin);
        self.balance(scene, operator);
        let origin = &self.origin;
        self.constants.clear();
        self.constants.extend(functions.iter().map(|EventFunction { functional, .. }| {
            let terms = functional.position.iter().map(|&(k, weight)| weight * origin[k]);
            terms.fold([functional.constant, functional.constant.abs()], |[sum, size], term| {
                [sum + term, size + term.abs()]
            })
        }));
    }

    /// The force at the origin, and the norm of the origin.
    fn balance(&mut self, scene: &Scene, operator: &TaylorOperator) {
        let Self { origin, force, buffers, unit, .. } = self;
        force.clear();
        force.resize(origin.len(), 0.0);
        if let Some(rows) = &operator.bordered {
            rows.balance(scene, &operator.equation, origin, force, buffers);
        } else {
            let reduction = &operator.equation.reduction;
            let mut gathered: Vec<f64> = Vec::with_capacity(origin.len());
            let mut of_row = |row: usize| {
                let (columns, values) = scene.stiffness.entries_of(row);
                let sum = Doubled::from(scene.force[row]);
                if columns.len() < LONG {
                    let terms = columns.iter().zip(values);
                    let terms = terms.map(|(&k, &value)| Doubled::product(-value, origin[k]));
                    return terms.fold(sum, Doubled::add);
                }
                gathered.clear();
                gathered.extend(columns.iter().map(|&k| origin[k]));
                unit.run(LessDot { sum, row: values, moved: &gathered })
            };
            reduction.kept.iter().for_each(|&k| force[k] = of_row(k).value());
            for merges in reduction.merges.chunk_by(|a, b| a.position == b.position) {
                let k = reduction.kept[merges[0].position];
                let first = of_row(k);
                let merged = |sum: Doubled, merge: &RowMerge| {
                    sum.add(of_row(merge.normal).times(merge.factor))
                };
                force[k] = merges.iter().fold(first, merged).value();
            }
        }
        let sizes = operator
            .equation
            .reduction
            .states
            .iter()
            .map(|&k| operator.weight[k] * origin[k].abs());
        self.scale = operator.omega * sizes.fold(0.0, f64::max);
    }

    pub fn start(&self) -> f64 {
        self.start.high
    }

    /// Local time to which the series holds.
    pub fn end(&self) -> f64 {
        self.start.high + self.width
    }

    /// Q_2 and up from Q_0 and Q_1.
    fn fill(&mut self, scene: &Scene, operator: &TaylorOperator) {
        let h = operator.width;
        self.width = h;
        match &operator.dense {
            Some(rows) => self.by_rows(operator, rows, 0..DEGREE, true),
            None => (0..DEGREE).for_each(|k| self.order(scene, operator, k, k == 0)),
        }
        let scale = self.scale(operator);
        let tail = operator.tail(h) * self.last_norm(scene, operator);
        if tail > TRUNCATION * scale {
            self.shorten((TRUNCATION * scale / tail).powf(1.0 / COEFFICIENTS as f64));
        }
    }

    /// Q_{k+2} from the two before, with the force in this order where it is `forced`.
    #[inline]
    pub(crate) fn order(
        &mut self,
        scene: &Scene,
        operator: &TaylorOperator,
        k: usize,
        forced: bool,
    ) {
        let (n, h) = (self.size, self.width);
        if let Some(rows) = &operator.dense {
            return self.by_rows(operator, rows, k..k + 1, forced);
        }
        let (known, next) = self.terms.split_at_mut((k + 2) * n);
        let (q, dq) = (&known[k * n..(k + 1) * n], &known[(k + 1) * n..]);
        let next = &mut next[..n];
        let rate = (k + 1) as f64 / h;
        let factor = h * h / ((k + 1) * (k + 2)) as f64;
        let force = &self.force;
        if let Some(rows) = &operator.bordered {
            let order = Order { q, dq, rate, factor, force, forced, next };
            return rows.advance(scene, &operator.equation, order, &mut self.buffers);
        }
        let (residual, combined) = (&mut self.residual[..], &mut self.combined[..]);
        if forced {
            residual.copy_from_slice(&self.force);
        } else {
            residual.fill(0.0);
        }
        match scene.proportional {
            // K (q + beta q') in one product.
            Some((alpha, beta)) => {
                for i in 0..n {
                    combined[i] = q[i] + beta * rate * dq[i];
                }
                scene.stiffness.add_product(-1.0, combined, residual);
                if alpha != 0.0 {
                    scene.mass.add_product(-alpha * rate, dq, residual);
                }
            }
            None => {
                scene.stiffness.add_product(-1.0, q, residual);
                scene.damping.add_product(-rate, dq, residual);
            }
        }
        operator.equation.accelerate(residual, next);
        operator.equation.reduction.kept.iter().for_each(|&i| next[i] *= factor);
    }

    /// Orders of the series by dense rows, with the force in the first of them where that is `forced`.
    #[inline]
    fn by_rows(
        &mut self,
        operator: &TaylorOperator,
        rows: &Rows,
        orders: Range<usize>,
        forced: bool,
    ) {
        let unit = self.unit;
        unit.run(self.orders_by_rows((operator, rows), orders, (forced, NoForces), 0.0));
    }

    /// The same beside forces that follow from the motion, without entries of the state that are below `least` in the norm.
    pub(crate) fn orders_by_rows<'a, F>(
        &'a mut self,
        (operator, rows): (&'a TaylorOperator, &'a Rows),
        orders: Range<usize>,
        (forced, forces): (bool, F),
        least: f64,
    ) -> Orders<'a, F> {
        let Self { terms, force, products, size, width, .. } = self;
        let (size, width) = (*size, *width);
        let force = forced.then_some(&force[..]);
        let counting = Counting { weight: &operator.weight, omega: operator.omega, least };
        Orders { rows, products, terms, size, width, orders, counting, force, forces }
    }

    /// The largest entry of the state at the start of the panel, or of the origin, in the norm.
    pub(crate) fn scale_at_start(&self, operator: &TaylorOperator) -> f64 {
        self.term_norm(operator, 0).max(self.scale)
    }

    /// Absolute values of coefficients, of position and velocity: constant, linear, and the sum of the others.
    pub(crate) fn sizes(&self) -> &[[Vec<f64>; 2]; 3] {
        &self.sizes
    }

    /// Coefficients of q of order k and of the next.
    #[cfg(test)]
    pub(crate) fn orders(&self, k: usize) -> [&[f64]; 2] {
        let (q, dq) = self.terms[k * self.size..(k + 2) * self.size].split_at(self.size);
        [q, dq]
    }

    /// The coefficient of order k of the velocity of a coordinate.
    pub(crate) fn rate_of(&self, coordinate: usize, k: usize) -> f64 {
        (k + 1) as f64 / self.width * self.terms[(k + 1) * self.size + coordinate]
    }

    /// Begins the panel with another velocity of a coordinate.
    pub(crate) fn set_rate(&mut self, coordinate: usize, rate: f64) {
        self.terms[self.size + coordinate] = self.width * rate;
    }

    /// What the motion adds to the load of a row in order k, `-(K q + C q')`.
    pub(crate) fn load_of(&self, scene: &Scene, row: usize, k: usize) -> f64 {
        let (q, dq) = self.terms[k * self.size..(k + 2) * self.size].split_at(self.size);
        let rate = (k + 1) as f64 / self.width;
        -scene.stiffness.row_dot(row, q) - rate * scene.damping.row_dot(row, dq)
    }

    /// The rate of a coordinate in order k, from which follows the next order of its place.
    pub(crate) fn flow(&mut self, coordinate: usize, k: usize, rate: f64) {
        self.terms[(k + 1) * self.size + coordinate] = self.width * rate / (k + 1) as f64;
    }

    /// The norm of the state to which the terms left out are relative.
    pub(crate) fn scale(&self, operator: &TaylorOperator) -> f64 {
        let largest = |orders: Range<usize>, least: f64| {
            orders.map(|k| self.term_norm(operator, k)).fold(least, f64::max)
        };
        let first = largest(0..2, self.scale);
        // What begins at rest at the origin, and is moved by what a slider takes along, has no terms of lower orders.
        if first == 0.0 { largest(2..COEFFICIENTS, 0.0) } else { first }
    }

    /// A panel narrower by `factor`, of which only the orders 0 and 1 are known.
    pub(crate) fn begin_within(&mut self, factor: f64) {
        self.width *= factor;
        self.terms[self.size..2 * self.size].iter_mut().for_each(|rate| *rate *= factor);
    }

    /// The same series for a panel shorter by `factor`.
    pub(crate) fn shorten(&mut self, factor: f64) {
        self.shorten_by(&powers(factor));
    }

    /// The same from the powers of the factor.
    #[inline(always)]
    pub(crate) fn shorten_by(&mut self, powers: &[f64; ORDERS]) {
        self.width *= powers[1];
        for (terms, power) in self.terms.chunks_exact_mut(self.size).zip(powers) {
            terms.iter_mut().for_each(|term| *term *= power);
        }
    }

    /// Norm of the k-th term of the state, `max(omega |q|, |q'|)` in mass-weighted coordinates; infinite
    /// beyond the range of numbers, where `max` would pass over what is not one.
    fn term_norm(&self, operator: &TaylorOperator, k: usize) -> f64 {
        let n = self.size;
        let (q, u) = self.terms[k * n..(k + 2) * n].split_at(n);
        self.unit.run(operator.largest_of([q, u], (k + 1) as f64 / self.width))
    }

    /// Norm of the last term of the state, as the bound of what follows needs it.
    fn last_norm(&self, scene: &Scene, operator: &TaylorOperator) -> f64 {
        self.norm_of(scene, operator, DEGREE)
    }

    /// Norm of the k-th term of the state.
    pub(crate) fn norm_of(&self, scene: &Scene, operator: &TaylorOperator, k: usize) -> f64 {
        let Some(mass) = &scene.coupled_mass else { return self.term_norm(operator, k) };
        let rate = (k + 1) as f64 / self.width;
        let norm = |terms: &[f64]| {
            let sum: f64 = terms.iter().zip(&operator.weight).map(|(x, w)| (w * x) * (w * x)).sum();
            let square = |k: usize| operator.weight[k] * terms[k] * operator.weight[k];
            let coupled = operator.coupled.iter();
            let beside = coupled.map(|&k| terms[k] * (scene.mass.row_dot(k, terms) - square(k)));
            let added = mass.added.iter().map(|&(k, mass)| mass * terms[k] * terms[k]);
            let sum = sum + beside.sum::<f64>() + added.sum::<f64>();
            // Beyond the range of numbers there is no bound.
            if sum.is_finite() { sum.max(0.0).sqrt() } else { f64::INFINITY }
        };
        let (q, dq) = self.terms[k * self.size..(k + 2) * self.size].split_at(self.size);
        (operator.omega * norm(q)).max(rate * norm(dq))
    }

    pub fn expand(
        &mut self,
        scene: &Scene,
        operator: &TaylorOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        let (scene, functions) = operator.inside(scene, functions);
        let tail = operator.tail(self.width) * self.last_norm(scene, operator);
        self.measure();
        let rounded = operator.rounding(self.width, &self.sizes, self.panels);
        self.fill_panel(operator, functions, panel, tail + rounded, |motion, index| {
            let rows = operator.row_rounding(scene, &functions[index].functional, index)?;
            let of_rows = rows.of(motion.width, &motion.sizes, &motion.force);
            let rounded = operator.rounding_of_rows(motion.panels) * of_rows;
            Some(tail * operator.function_norms[index] + rounded)
        });
    }

    /// The same where `off` bounds the error of the state, in the norm of the operator.
    pub(crate) fn expand_within(
        &mut self,
        operator: &TaylorOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
        off: f64,
    ) {
        self.measure();
        self.fill_panel(operator, functions, panel, off, |_, _| None);
    }

    /// The same from the sizes of the coefficients; `closer` bounds what an error of the state leaves in one function.
    fn fill_panel(
        &mut self,
        operator: &TaylorOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
        off: f64,
        closer: impl Fn(&Self, usize) -> Option<f64>,
    ) {
        panel.reset(self.width, functions.len());
        let rounding = self.rounding();
        let rows = &operator.long;
        if let Some(beta) = rows.beta() {
            for (together, [of_q, of_u]) in self.together.iter_mut().zip(&self.sizes) {
                together.clear();
                together.extend(of_q.iter().zip(of_u).map(|(q, u)| q + beta * u));
            }
        }
        let long = |index: usize| rows.get(index);
        let sum = |index: usize, order: usize| -> f64 {
            let [of_q, of_u] = &self.sizes[order];
            match long(index) {
                Some(row) => {
                    let sizes = match row.factors {
                        (_, 0.0) => of_q,
                        (0.0, _) => of_u,
                        _ => &self.together[order],
                    };
                    rows.size(row, sizes) + size_of(&row.rest, [of_q, of_u])
                }
                None => size_of(&functions[index].functional, [of_q, of_u]),
            }
        };
        self.open.clear();
        for (index, function) in functions.iter().enumerate() {
            let (higher, linear) = (sum(index, 2), sum(index, 1));
            let [at_origin, size] = self.constants[index];
            let constant = size + sum(index, 0);
            let mut of_state = off * operator.function_norms[index];
            let own = rounding * (constant + linear + higher);
            let start = at_origin
                + match long(index) {
                    Some(row) => {
                        let dots = [0, 1].map(|k| self.dot(rows, row, k));
                        self.coefficient_of(row, 0, dots)
                    }
                    None => self.coefficient(&function.functional, 0),
                };
            let lowest = start - linear - higher - own;
            if !(lowest > of_state) {
                of_state = closer(self, index).unwrap_or(of_state);
            }
            panel.error[index] = own + of_state;
            panel.curvature_error[index] = rounding * higher + of_state;
            panel.excluded[index] = lowest > of_state && function.cone.is_none();
            if !panel.excluded[index] {
                panel.row(index)[0] = start;
                self.open.push(index);
            }
        }
        let short = self.open.iter().filter(|&&index| long(index).is_none());
        if operator.dense.is_some() {
            let rates = std::array::from_fn(|k| (k + 1) as f64 / self.width);
            self.series.resize(self.size * ORDERS, 0.0);
            for (k, terms) in self.terms.chunks_exact(self.size).enumerate() {
                for (series, &term) in self.series.chunks_exact_mut(ORDERS).zip(terms) {
                    series[k] = term;
                }
            }
            for &index in short {
                self.coefficients(&rates, &functions[index].functional, panel.row(index));
            }
        } else {
            // Order by order, so that the terms of one order stay in the cache for all functions.
            for k in 1..COEFFICIENTS {
                for &index in short.clone() {
                    panel.row(index)[k] = self.coefficient(&functions[index].functional, k);
                }
            }
        }
        for &index in &self.open {
            let Some(row) = long(index) else { continue };
            let mut dots = [0.0, self.dot(rows, row, 1)];
            for k in 1..COEFFICIENTS {
                dots = [dots[1], self.dot(rows, row, k + 1)];
                panel.row(index)[k] = self.coefficient_of(row, k, dots);
            }
        }
        for &index in &self.open {
            let (constant, others) = panel.row(index).split_at(1);
            let lowest = others.iter().fold(constant[0], |sum, c| sum + c.min(0.0));
            let excluded = lowest > panel.error[index] && functions[index].cone.is_none();
            panel.excluded[index] = excluded;
        }
    }

    /// The coefficient of order k of a functional, without its value at the origin.
    pub(crate) fn coefficient(&self, functional: &Functional, k: usize) -> f64 {
        let n = self.size;
        let (q, dq) = self.terms[k * n..(k + 2) * n].split_at(n);
        let rate = (k + 1) as f64 / self.width;
        let position = functional.position.iter().map(|&(i, weight)| weight * q[i]);
        let velocity = functional.velocity.iter().map(|&(i, weight)| weight * rate * dq[i]);
        velocity.fold(position.fold(0.0, |sum, term| sum + term), |sum, term| sum + term)
    }

    /// All coefficients of a functional of one term.
    pub(crate) fn coefficients_of_single(
        &self,
        functional: &Functional,
        row: &mut [f64; COEFFICIENTS],
    ) {
        row.fill(0.0);
        let Some((of, i, weight)) = functional.single() else { return };
        let inverse = 1.0 / self.width;
        for (k, c) in row.iter_mut().enumerate() {
            let rate = if of == 0 { 1.0 } else { f64::from(k as u32 + 1) * inverse };
            *c = weight * rate * self.terms[(k + of) * self.size + i];
        }
    }

    /// The coefficients of a functional from the first order on, from the series of each coordinate.
    fn coefficients(
        &self,
        rates: &[f64; COEFFICIENTS],
        functional: &Functional,
        row: &mut [f64; COEFFICIENTS],
    ) {
        let series = |i: usize| &self.series[i * ORDERS..(i + 1) * ORDERS];
        let (row, rates) = (&mut row[1..], &rates[1..]);
        row.fill(0.0);
        for &(i, weight) in &functional.position {
            for (c, q) in row.iter_mut().zip(&series(i)[1..]) {
                *c += weight * q;
            }
        }
        for &(i, weight) in &functional.velocity {
            for ((c, rate), dq) in row.iter_mut().zip(rates).zip(&series(i)[2..]) {
                *c += weight * rate * dq;
            }
        }
    }

    /// The product of a long function with the coefficients of order k.
    fn dot(&self, rows: &FunctionRows, row: &FunctionRow, k: usize) -> f64 {
        rows.dot(row, &self.terms[k * self.size..(k + 1) * self.size])
    }

    /// Its coefficient of order k from the products of this order and of the next.
    fn coefficient_of(&self, row: &FunctionRow, k: usize, [of_q, of_dq]: [f64; 2]) -> f64 {
        let rate = (k + 1) as f64 / self.width;
        let (a, b) = row.factors;
        a * of_q + b * rate * of_dq + self.coefficient(&row.rest, k)
    }

    /// An event function at the origin at rest, and the sum of the absolute values of its terms.
    pub(crate) fn constant(&self, index: usize) -> [f64; 2] {
        self.constants[index]
    }

    /// Rounding of an event function from a state, relative to the sum of its terms: sparse dot products and Horner's rule
    /// over the degree, and the sums of the panels before.
    pub(crate) fn rounding(&self) -> f64 {
        rounding(40 + 6 * DEGREE, self.panels)
    }

    /// The coefficient of order k of the displacements in a functional.
    pub(crate) fn displacement(&self, functional: &Functional, k: usize) -> f64 {
        let q = &self.terms[k * self.size..];
        functional.position.iter().map(|&(i, weight)| weight * q[i]).sum()
    }

    /// Norm of the force at the origin.
    pub(crate) fn force_norm(&self, operator: &TaylorOperator) -> f64 {
        let kept = operator.equation.reduction.kept.iter();
        kept.map(|&k| self.force[k].abs() / operator.weight[k]).sum()
    }

    /// Absolute values of the coefficients of every coordinate and velocity.
    pub(crate) fn measure(&mut self) {
        let Self { terms, sizes, size: n, width, unit, .. } = self;
        sizes.iter_mut().flatten().for_each(|sizes| sizes.resize(*n, 0.0));
        let rates = std::array::from_fn(|k| (k + 1) as f64 / *width);
        unit.run(Sizes { terms, n: *n, rates, sizes });
    }

    /// Bounds of the outputs of dense rows, from the sizes of all coefficients.
    #[inline(always)]
    pub(crate) fn measure_outputs<S: Lanes>(
        &mut self,
        simd: S,
        rows: &Rows,
        all: [&[f64]; 2],
        powers: &[f64; COEFFICIENTS],
    ) {
        let higher = self.sizes[2].each_ref().map(|of| &of[..]);
        self.products.measure(simd, rows, [all, higher], powers);
    }

    pub fn advance(&mut self, scene: &Scene, operator: &TaylorOperator) {
        self.step(operator);
        self.fill(operator.inside(scene, &[]).0, operator);
    }

    /// Moves the start to the end of the panel.
    pub(crate) fn step(&mut self, operator: &TaylorOperator) {
        let n = self.size;
        let (mut q, mut u) =
            (std::mem::take(&mut self.residual), std::mem::take(&mut self.combined));
        q.resize(n, 0.0);
        u.resize(n, 0.0);
        self.horner(1.0, &mut q, &mut u);
        for i in operator.equation.moving() {
            self.terms[i] = q[i];
            self.terms[n + i] = u[i] * operator.width;
        }
        (self.residual, self.combined) = (q, u);
        for &(i, speed) in &operator.equation.reduction.sticking {
            self.terms[n + i] = speed * operator.width;
        }
        self.start = self.start.add(self.width.into());
        self.panels += 1;
    }

    /// All coordinates and velocities at s of the panel.
    fn horner(&self, s: f64, q: &mut [f64], u: &mut [f64]) {
        let n = self.size;
        let (q, u) = (&mut q[..n], &mut u[..n]);
        self.unit.run(Horner { terms: &self.terms, s, q, u });
        u.iter_mut().for_each(|u| *u /= self.width);
    }

    /// Keeps of the panel the state at its start alone, where the other orders may be no numbers.
    pub(crate) fn keep_start(&mut self) {
        self.terms[2 * self.size..].fill(0.0);
    }

    pub fn state(&self, operator: &TaylorOperator, offset: f64, q: &mut [f64], u: &mut [f64]) {
        // A coordinate that is held at zero has no terms and stays at zero.
        self.horner(offset / self.width, q, u);
        let origin = match &operator.held {
            None => &self.origin,
            Some(InModes { modes, .. }) => {
                modes.displace(q);
                modes.displace(u);
                &self.place
            }
        };
        q.iter_mut().zip(origin).for_each(|(q, origin)| *q += origin);
        for &(i, speed) in &operator.equation.reduction.sticking {
            u[i] = speed;
        }
    }
}
