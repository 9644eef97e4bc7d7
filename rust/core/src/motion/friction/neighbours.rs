//! Infinitesimal neighbours of a motion under a law of friction, by the Taylor series of their linear equation.
//!
//! With `a = mu'(S) N` and `b = mu(S) - mu(0)` along the motion, a neighbour changes the force of the law by
//! `dy = a dS + b dN`, and of a formula with a state z by `dy = a dS + c dz + b dN`. The series of a and b follow from those of the motion, so that the recurrences of a neighbour are those
//! of the motion with known coefficients. Its panels are shortened until the last two terms of its own series are rounding: where slip in
//! a plane is straight and slow, the series of the motion ends early, and those of neighbours beside it may not converge at all.

use crate::contact::functional::Functional;
use crate::linalg::dense::max_norm;
use crate::linalg::parallel::each;
use crate::motion::friction::balances::BALANCES;
use crate::motion::friction::motion::{LawMotion, STALLED, Sliding, TRIALS, worse};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::neighbour::{PlaneNeighbour, PlaneSlopes, convolved_with};
use crate::motion::friction::plane::series::PlaneSeries;
use crate::motion::friction::plane::widths::NO_TIME;
use crate::motion::taylor::motion::TRUNCATION;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{COLUMNS, Kernel, Lanes, Side};
use crate::scene::friction::decay::product;
use crate::scene::model::Scene;

/// Part of its duration about which a phase ends with a slip in a plane, and which it does not outlast.
const NEAR: f64 = 1e-9;
const FAR: f64 = 2.0;
/// Part of its size to which a balance across a slow slip is known, and part of a neighbour by which its slip begins away from there.
const BALANCED: f64 = 1e-15;
const AWAY: f64 = 1e-14;
/// The part of a panel on which series are tried again that numbers have no room for.
const SHORTEST: f64 = 0.1;

/// `a`, `b` and `c` of a contact along a panel.
struct Slopes {
    by_slip: [f64; COEFFICIENTS],
    by_normal: [f64; COEFFICIENTS],
    by_state: [f64; COEFFICIENTS],
}

/// The series of a few neighbours: `dQ_0 .. dQ_{DEGREE + 1}`, of all coordinates one after the other, and what of it the laws take.
struct Series {
    terms: Vec<Side>,
    slips: Vec<[Side; COEFFICIENTS]>,
    normals: Vec<[Side; COEFFICIENTS]>,
    states: Vec<[Side; COEFFICIENTS]>,
    planes: Vec<PlaneNeighbour>,
    /// How much the balances of slow slips in planes were off when they were improved last, relative to their size, and how far from
    /// them neighbours begin, relative to theirs.
    off: f64,
    away: f64,
}

impl LawMotion {
    /// Carries neighbours (dq, dq') of the motion from its start over `duration`.
    pub fn carry(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        duration: f64,
        neighbours: &mut [Vec<f64>],
    ) {
        let (mut before, mut stalled, mut trials) = (f64::NEG_INFINITY, 0, 0);
        self.constant = NO_TIME;
        self.follow_later(scene, operator);
        // The derivative of a slip that ends by its neighbours is that of the time left.
        while !self.ends_slip() {
            let slopes: Vec<Slopes> = operator
                .contacts
                .iter()
                .zip(&self.contacts)
                .map(|(one, Sliding { series, normal, fades, .. })| {
                    match one.with_state(series.piece) {
                        _ if *fades => {
                            let [by_slip, by_normal, by_state] = [[0.0; COEFFICIENTS]; 3];
                            Slopes { by_slip, by_normal, by_state }
                        }
                        Some((formula, input)) => {
                            let slopes = series.slopes_with_state(formula);
                            let [by_slip, by_state] = match input.pressed {
                                true => slopes.map(|slope| product(&slope, normal)),
                                false => slopes,
                            };
                            // Where no normal force multiplies the formula, this series is 0.
                            Slopes { by_slip, by_normal: series.excess, by_state }
                        }
                        None => Slopes {
                            by_slip: product(&series.slopes(&one.law), normal),
                            by_normal: series.excess,
                            by_state: [0.0; COEFFICIENTS],
                        },
                    }
                })
                .collect();
            let planes: Vec<PlaneSlopes> = {
                let all = operator.planes.iter().zip(&self.planes);
                all.map(|(one, series)| series.slopes(one)).collect()
            };
            let of = |some| self.of_neighbours(scene, operator, (&slopes, &planes), some);
            let all: Vec<Series> = each(scene.size, neighbours.chunks(COLUMNS).collect(), of);
            let settles = all.iter().all(Series::settles);
            let all = (0..neighbours.len()).map(|i| (&all[i / COLUMNS], i % COLUMNS));
            let width = self.taylor.width;
            let part = |(of, column): (&Series, _)| {
                of.part_that_holds(column, scene.size, width, operator)
            };
            let factor = all.clone().map(part).fold(1.0, f64::min);
            stalled = if self.goes_on_from(before) { 0 } else { stalled + 1 };
            if trials > TRIALS || self.end().is_nan() || stalled > STALLED || self.is_given_up() {
                // Beyond the range of numbers, or of interest.
                neighbours.iter_mut().for_each(|dy| dy.fill(f64::NAN));
                return;
            }
            if !settles {
                // One of them has not relaxed as the motion has.
                trials += 1;
                self.follow_later(scene, operator);
                continue;
            }
            if factor == 0.0 {
                trials += 1;
                self.shorten(SHORTEST);
                (self.next, self.ends) = (None, None);
                continue;
            }
            trials = 0;
            let (start, end) = (self.start(), self.start() + factor * width);
            let left = duration - start;
            let ends = self.planes.iter().any(|one| one.ends_about(left, NEAR * duration));
            let last = !(end < duration) && !ends;
            before = end;
            let offset = if last { duration - start } else { factor * width };
            for (dy, (series, column)) in neighbours.iter_mut().zip(all) {
                series.at(column, offset / width, width, dy);
            }
            if last {
                return;
            }
            if factor < 1.0 {
                self.shorten(factor);
                // The law ends no shorter panel.
                (self.next, self.ends) = (None, None);
            }
            if self.end() > FAR * duration {
                neighbours.iter_mut().for_each(|dy| dy.fill(f64::NAN));
                return;
            }
            self.advance(scene, operator);
        }
    }

    /// The series of a few neighbours.
    fn of_neighbours(
        &self,
        scene: &Scene,
        operator: &LawOperator,
        along: (&[Slopes], &[PlaneSlopes]),
        neighbours: &[Vec<f64>],
    ) -> Series {
        let mut series = Series::of(along, scene.size);
        let follows = self.planes.iter().any(PlaneSeries::follows);
        for improved in 0..BALANCES {
            let (motion, series) = (self, &mut series);
            self.unit.run(Extend { motion, scene, operator, along, neighbours, series });
            // A series begins with the dt of the balance before, the first one with none.
            if series.is_balanced() && (improved > 0 || !follows) {
                break;
            }
        }
        series
    }
}

/// Forms the series of neighbours where the balances of slow slips in planes are as they are known, and improves these.
struct Extend<'a> {
    motion: &'a LawMotion,
    scene: &'a Scene,
    operator: &'a LawOperator,
    along: (&'a [Slopes], &'a [PlaneSlopes]),
    neighbours: &'a [Vec<f64>],
    series: &'a mut Series,
}

impl Kernel for Extend<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, scene, operator, along, neighbours, series } = self;
        let equation = &operator.taylor.equation;
        let own = equation.scene(scene);
        let (n, h) = (own.size, motion.taylor.width);
        series.terms.fill(Side::ZERO);
        for (column, dy) in neighbours.iter().enumerate() {
            for k in equation.moving() {
                series.terms[k].columns_mut()[column] = dy[k];
            }
            // Velocities that follow from forces are found with their order.
            for &k in &equation.reduction.kept {
                series.terms[n + k].columns_mut()[column] = h * dy[n + k];
            }
        }
        for (place, one) in operator.planes.iter().enumerate() {
            let slip = one.coordinates.map(|k| series.terms[n + k]);
            let relaxed = motion.planes[place].relaxed(simd, &series.planes[place], slip, h);
            one.coordinates.iter().zip(relaxed).for_each(|(&k, slip)| series.terms[n + k] = slip);
        }
        let [mut velocities, mut residuals] = [(); 2].map(|()| vec![Side::ZERO; n]);
        let [mut residual, mut acceleration] = [(); 2].map(|()| vec![0.0; n]);
        for k in 0..DEGREE {
            let rate = (k + 1) as f64 / h;
            let (positions, rates) = series.terms[k * n..(k + 2) * n].split_at(n);
            for (velocity, term) in velocities.iter_mut().zip(rates) {
                *velocity = term.scaled(simd, rate);
            }
            residuals.fill(Side::ZERO);
            own.stiffness.add_products(simd, -1.0, positions, &mut residuals);
            own.damping.add_products(simd, -1.0, &velocities, &mut residuals);
            motion.push_neighbour(simd, operator, along, series, (k, &velocities), &mut residuals);
            for column in 0..neighbours.len() {
                for (value, of_all) in residual.iter_mut().zip(&residuals) {
                    *value = of_all.columns()[column];
                }
                equation.accelerate(&mut residual, &mut acceleration);
                for &i in &equation.reduction.kept {
                    let term = &mut series.terms[(k + 2) * n + i].columns_mut()[column];
                    *term = h * h / ((k + 1) * (k + 2)) as f64 * acceleration[i];
                }
            }
            for (one, slip) in operator.contacts.iter().zip(&series.slips) {
                if let Some(flow) = &one.flow {
                    series.terms[(k + 1) * n + flow.coordinate] =
                        slip[k].scaled(simd, -one.sign / rate);
                }
            }
        }
        (series.off, series.away) = (0.0, 0.0);
        for (place, one) in operator.planes.iter().enumerate() {
            let (slip, own) = (&motion.planes[place], &mut series.planes[place]);
            let off = slip.improve_neighbour(simd, one, &along.1[place], own, h);
            series.off = worse(series.off, off);
            if !slip.follows() {
                continue;
            }
            for (column, dy) in neighbours.iter().enumerate() {
                let (q, u) = dy.split_at(n);
                let size = worse(operator.taylor.omega() * max_norm(q), max_norm(u));
                let across = slip.across(own, column, one.coordinates.map(|k| u[k]));
                if across != 0.0 {
                    series.away = worse(series.away, across.abs() / size);
                }
            }
        }
    }
}

/// The change of a functional along directions (dq, dq').
#[inline(always)]
fn rate<S: Lanes>(simd: S, of: &Functional, q: &[Side], u: &[Side]) -> Side {
    let mut sum = Side::ZERO;
    for &(k, weight) in &of.position {
        sum = sum.add_scaled(simd, weight, &q[k]);
    }
    for &(k, weight) in &of.velocity {
        sum = sum.add_scaled(simd, weight, &u[k]);
    }
    sum
}

impl LawMotion {
    /// Adds what the laws add to the residuals of neighbours of order k.
    #[inline(always)]
    fn push_neighbour<S: Lanes>(
        &self,
        simd: S,
        operator: &LawOperator,
        (slopes, planes): (&[Slopes], &[PlaneSlopes]),
        neighbours: &mut Series,
        (k, u): (usize, &[Side]),
        residuals: &mut [Side],
    ) {
        let Series { terms, slips, normals, states, planes: slipping, .. } = neighbours;
        let n = u.len();
        let q = &terms[k * n..(k + 1) * n];
        let mut forces = Vec::with_capacity(slopes.len());
        for (j, one) in operator.contacts.iter().enumerate() {
            let Slopes { by_slip, by_normal, by_state } = &slopes[j];
            let (slips, normals, states) = (&mut slips[j], &mut normals[j], &mut states[j]);
            normals[k] = rate(simd, &one.normal, q, u);
            if let Some(state) = &one.state {
                states[k] = rate(simd, &state.value, q, u);
            }
            slips[k] = match &one.flow {
                None => rate(simd, &one.slip, q, u).scaled(simd, -one.sign),
                Some(flow) => rate(simd, &flow.friction, q, u)
                    .add_scaled(simd, -one.law.value(0.0), &normals[k])
                    .add_scaled(simd, -1.0, &convolved_with(simd, by_slip, &slips[..k], k))
                    .add_scaled(simd, -1.0, &convolved_with(simd, by_normal, &normals[..=k], k))
                    .scaled(simd, 1.0 / by_slip[0]),
            };
            let of_lower = convolved_with(simd, by_slip, &slips[..=k], k)
                .add_scaled(simd, 1.0, &convolved_with(simd, by_state, &states[..=k], k))
                .add_scaled(simd, 1.0, &convolved_with(simd, by_normal, &normals[..k], k));
            forces.push(of_lower);
        }
        if let Some(response) = &operator.response {
            for column in 0..COLUMNS {
                let linear: Vec<f64> = normals.iter().map(|of| of[k].columns()[column]).collect();
                let lower: Vec<f64> = forces.iter().map(|of| of.columns()[column]).collect();
                let coupled = self.coupling.solve(&response.normal, &linear, &lower);
                for (normal, dn) in normals.iter_mut().zip(coupled) {
                    normal[k].columns_mut()[column] = dn;
                }
            }
        }
        for (j, one) in operator.contacts.iter().enumerate() {
            forces[j] = forces[j].add_scaled(simd, slopes[j].by_normal[0], &normals[j][k]);
            for &(row, weight) in &one.direction {
                residuals[row] = residuals[row].add_scaled(simd, one.sign * weight, &forces[j]);
            }
        }
        for (place, one) in operator.planes.iter().enumerate() {
            let mut limit = rate(simd, &one.limit, q, u);
            for &(j, weight) in &one.pressed_by {
                limit = limit.add_scaled(simd, weight, &forces[j]);
            }
            let [slip, reaction] = [u, &*residuals].map(|of| one.coordinates.map(|row| of[row]));
            let (series, slipping) = (&self.planes[place], &mut slipping[place]);
            let given = (limit, slip, reaction);
            let order = (k, self.taylor.width);
            let force = series.carry(simd, one, &planes[place], slipping, order, given);
            for (&row, part) in one.coordinates.iter().zip(&force) {
                residuals[row] = residuals[row].add_scaled(simd, 1.0, part);
            }
        }
    }
}

impl Series {
    fn of((slopes, planes): (&[Slopes], &[PlaneSlopes]), n: usize) -> Self {
        let none = || vec![[Side::ZERO; COEFFICIENTS]; slopes.len()];
        Self {
            terms: vec![Side::ZERO; n * (DEGREE + 2)],
            slips: none(),
            normals: none(),
            states: none(),
            planes: planes.iter().map(|_| PlaneNeighbour::default()).collect(),
            off: 0.0,
            away: 0.0,
        }
    }

    fn is_balanced(&self) -> bool {
        self.off <= BALANCED
    }

    /// Whether directions of slip have come to their balances and follow from them on the panel.
    fn settles(&self) -> bool {
        self.is_balanced() && self.away <= AWAY
    }

    /// The part of the panel on which the last two terms of a neighbour are rounding of another one, which may be any where the series
    /// does not converge on all of the panel; 0 where they are no numbers.
    fn part_that_holds(&self, column: usize, n: usize, width: f64, operator: &LawOperator) -> f64 {
        let size =
            |terms: &[Side]| terms.iter().map(|x| x.columns()[column].abs()).fold(0.0, worse);
        let of: [f64; COEFFICIENTS] = std::array::from_fn(|k| {
            let (q, dq) = self.terms[k * n..(k + 2) * n].split_at(n);
            worse(operator.taylor.omega() * size(q), (k + 1) as f64 / width * size(dq))
        });
        if of.iter().any(|size| !size.is_finite()) {
            return 0.0;
        }
        if of[DEGREE - 1..] == [0.0; 2] {
            return 1.0;
        }
        let part = |(k, size): (usize, &f64)| {
            let last = [DEGREE - 1, DEGREE]
                .map(|m| (TRUNCATION * size / of[m]).powf(1.0 / (m - k) as f64));
            last[0].min(last[1])
        };
        of[..DEGREE - 1].iter().enumerate().map(part).fold(0.0, f64::max).min(1.0)
    }

    /// Writes (dq, dq') of a neighbour at s of the panel.
    fn at(&self, column: usize, s: f64, width: f64, dy: &mut [f64]) {
        let n = dy.len() / 2;
        dy.fill(0.0);
        let (q, u) = dy.split_at_mut(n);
        for terms in self.terms.chunks_exact(n).rev() {
            for ((q, u), term) in q.iter_mut().zip(u.iter_mut()).zip(terms) {
                *u = *u * s + *q;
                *q = *q * s + term.columns()[column];
            }
        }
        u.iter_mut().for_each(|u| *u /= width);
    }
}
