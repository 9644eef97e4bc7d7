//! Infinitesimal neighbours of a motion under a law of friction, by the Taylor series of their linear equation.
//!
//! With `a = mu'(S) N` and `b = mu(S) - mu(0)` along the motion, a neighbour changes the force of the law by
//! `dy = a dS + b dN`, and of a formula with a state z by `dy = a dS + c dz + b dN`. The series of a and b follow from those of the motion, so that the recurrences of a neighbour are those
//! of the motion with known coefficients. Its panels are shortened until the last two terms of its own series are rounding.

use crate::linalg::parallel::each;
use crate::linalg::sparse::LANES;
use crate::motion::friction::balances::BALANCES;
use crate::motion::friction::motion::{LawMotion, STALLED, Sliding, worse};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::{NO_TIME, PlaneNeighbour, PlaneSeries, PlaneSlopes};
use crate::motion::taylor::motion::TRUNCATION;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::scene::friction::decay::product;
use crate::scene::model::Scene;

/// Part of its duration about which a phase ends with a slip in a plane, and which it does not outlast.
const NEAR: f64 = 1e-9;
const FAR: f64 = 2.0;
/// Part of its size to which a balance across a slow slip is known.
const BALANCED: f64 = 1e-15;
/// A panel is shortened to no less than this part of its width at a time.
const SHORTEST: f64 = 0.1;

/// `a`, `b` and `c` of a contact along a panel.
struct Slopes {
    by_slip: [f64; COEFFICIENTS],
    by_normal: [f64; COEFFICIENTS],
    by_state: [f64; COEFFICIENTS],
}

/// The series of a neighbour: `dQ_0 .. dQ_{DEGREE + 1}`, of all coordinates one after the other, and what of it the laws take.
struct Series {
    terms: Vec<f64>,
    slips: Vec<[f64; COEFFICIENTS]>,
    normals: Vec<[f64; COEFFICIENTS]>,
    states: Vec<[f64; COEFFICIENTS]>,
    planes: Vec<PlaneNeighbour>,
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
        let (mut before, mut stalled) = (f64::NEG_INFINITY, 0);
        self.constant = NO_TIME;
        // A neighbour has deflections that have not relaxed.
        self.follow_none(scene, operator);
        loop {
            let slopes: Vec<Slopes> = operator
                .contacts
                .iter()
                .zip(&self.contacts)
                .map(|(one, Sliding { series, normal, .. })| match one.with_state() {
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
                })
                .collect();
            let planes: Vec<PlaneSlopes> = self.planes.iter().map(PlaneSeries::slopes).collect();
            let of = |some| self.of_neighbours(scene, operator, (&slopes, &planes), some);
            let all: Vec<Series> = each(scene.size, neighbours.chunks(LANES).collect(), of)
                .into_iter()
                .flatten()
                .collect();
            let width = self.taylor.width;
            let left_out = |one: &Series| one.left_out(scene.size, width, operator);
            let worst = all.iter().map(left_out).fold(0.0, worse);
            stalled = if self.end() > before { 0 } else { stalled + 1 };
            if !worst.is_finite() || self.end().is_nan() || stalled > STALLED {
                // Beyond the range of numbers.
                neighbours.iter_mut().for_each(|dy| dy.fill(f64::NAN));
                return;
            }
            let factor = (TRUNCATION / worst).powf(1.0 / DEGREE as f64).clamp(SHORTEST, 1.0);
            let (start, end) = (self.start(), self.start() + factor * width);
            if self.ends_slip() {
                // Slip ends at once, and its derivative by the neighbours is that of the time left.
                return;
            }
            let left = duration - start;
            let ends = self.planes.iter().any(|one| one.ends_about(left, NEAR * duration));
            let last = !(end < duration) && !ends;
            before = end;
            let offset = if last { duration - start } else { factor * width };
            for (dy, series) in neighbours.iter_mut().zip(&all) {
                series.at(offset / width, width, dy);
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
    ) -> Vec<Series> {
        let mut all: Vec<Series> = neighbours.iter().map(|_| Series::of(along)).collect();
        let mut left: Vec<(&[f64], &mut Series)> =
            neighbours.iter().map(Vec::as_slice).zip(&mut all).collect();
        for round in 1..=BALANCES {
            self.extend_neighbours(scene, operator, along, &mut left);
            // Where a balance does not settle, the series shows it by its last terms.
            if round < BALANCES {
                left.retain_mut(|(_, series)| {
                    let planes = operator.planes.iter().zip(&self.planes).zip(&mut series.planes);
                    let width = self.taylor.width;
                    let off =
                        planes.map(|((one, slip), own)| slip.improve_neighbour(one, own, width));
                    off.fold(0.0, f64::max) > BALANCED
                });
            }
        }
        all
    }

    /// The series of neighbours where the balances of slow slips in planes are as they are known.
    fn extend_neighbours(
        &self,
        scene: &Scene,
        operator: &LawOperator,
        along: (&[Slopes], &[PlaneSlopes]),
        neighbours: &mut [(&[f64], &mut Series)],
    ) {
        let equation = &operator.taylor.equation;
        let own = equation.scene(scene);
        let (n, h) = (own.size, self.taylor.width);
        for (dy, series) in &mut *neighbours {
            series.terms = vec![0.0; n * (DEGREE + 2)];
            let terms = &mut series.terms;
            for k in equation.moving() {
                terms[k] = dy[k];
            }
            // Velocities that follow from forces are found with their order.
            for &k in &equation.reduction.kept {
                terms[n + k] = h * dy[n + k];
            }
            for (one, (slip, own)) in
                operator.planes.iter().zip(self.planes.iter().zip(&series.planes))
            {
                let relaxed = slip.relaxed(own, one.coordinates.map(|k| terms[n + k]), h);
                one.coordinates.iter().zip(relaxed).for_each(|(&k, slip)| terms[n + k] = slip);
            }
        }
        if neighbours.is_empty() {
            return;
        }
        let [mut q, mut u, mut residuals] = [(); 3].map(|()| vec![[0.0; LANES]; n]);
        let mut of_one = [(); 3].map(|()| vec![0.0; n]);
        for k in 0..DEGREE {
            let rate = (k + 1) as f64 / h;
            for (lane, (_, series)) in neighbours.iter().enumerate() {
                let (positions, rates) = series.terms[k * n..(k + 2) * n].split_at(n);
                for i in 0..n {
                    (q[i][lane], u[i][lane]) = (positions[i], rate * rates[i]);
                }
            }
            residuals.fill([0.0; LANES]);
            own.stiffness.add_products(-1.0, &q, &mut residuals);
            own.damping.add_products(-1.0, &u, &mut residuals);
            for (lane, (_, series)) in neighbours.iter_mut().enumerate() {
                let [velocity, residual, acceleration] = &mut of_one;
                for i in 0..n {
                    (velocity[i], residual[i]) = (u[i][lane], residuals[i][lane]);
                }
                self.push_neighbour(operator, along, series, k, velocity, residual);
                equation.accelerate(residual, acceleration);
                series.add_order(operator, k, h, acceleration);
            }
        }
    }

    /// Adds what the laws add to the residual of a neighbour of order k.
    fn push_neighbour(
        &self,
        operator: &LawOperator,
        (slopes, planes): (&[Slopes], &[PlaneSlopes]),
        neighbour: &mut Series,
        k: usize,
        u: &[f64],
        residual: &mut [f64],
    ) {
        let Series { terms, slips, normals, states, planes: slipping } = neighbour;
        let n = u.len();
        let q = &terms[k * n..(k + 1) * n];
        for (j, one) in operator.contacts.iter().enumerate() {
            normals[j][k] = one.normal.rate(q, u);
            states[j][k] = one.state.as_ref().map_or(0.0, |state| state.value.rate(q, u));
            slips[j][k] = match &one.flow {
                None => -one.sign * one.slip.rate(q, u),
                Some(flow) => {
                    let force = flow.friction.rate(q, u) - one.law.value(0.0) * normals[j][k];
                    let Slopes { by_slip, by_normal, .. } = &slopes[j];
                    let of_slip = (1..=k).map(|i| by_slip[i] * slips[j][k - i]).sum::<f64>();
                    let of_normal = (0..=k).map(|i| by_normal[i] * normals[j][k - i]).sum::<f64>();
                    (force - of_slip - of_normal) / by_slip[0]
                }
            };
        }
        let lower = |j: usize, normals: &[[f64; COEFFICIENTS]]| -> f64 {
            let Slopes { by_slip, by_normal, by_state } = &slopes[j];
            let of_slip = (0..=k).map(|i| by_slip[i] * slips[j][k - i]).sum::<f64>();
            let of_state = (0..=k).map(|i| by_state[i] * states[j][k - i]).sum::<f64>();
            let of_normal = (1..=k).map(|i| by_normal[i] * normals[j][k - i]).sum::<f64>();
            of_slip + of_state + of_normal
        };
        let mut forces: Vec<f64> = (0..slopes.len()).map(|j| lower(j, normals)).collect();
        if let Some(response) = &operator.response {
            let linear: Vec<f64> = normals.iter().map(|normal| normal[k]).collect();
            let coupled = self.coupling.solve(&response.normal, &linear, &forces);
            normals.iter_mut().zip(coupled).for_each(|(normal, dn)| normal[k] = dn);
        }
        for (j, force) in forces.iter_mut().enumerate() {
            *force += slopes[j].by_normal[0] * normals[j][k];
        }
        operator.push(&forces, residual);
        for (place, one) in operator.planes.iter().enumerate() {
            let of = |values: &[f64]| one.coordinates.map(|row| values[row]);
            let given = (one.limit.rate(q, u), of(u), of(residual));
            let (series, slipping) = (&self.planes[place], &mut slipping[place]);
            let width = self.taylor.width;
            let force = series.carry(one, &planes[place], slipping, k, given, width);
            one.coordinates.iter().zip(force).for_each(|(&row, part)| residual[row] += part);
        }
    }
}

impl Series {
    fn of((slopes, planes): (&[Slopes], &[PlaneSlopes])) -> Self {
        let [slips, normals, states] = [(); 3].map(|()| vec![[0.0; COEFFICIENTS]; slopes.len()]);
        let planes = planes.iter().map(|_| PlaneNeighbour::default()).collect();
        Self { terms: Vec::new(), slips, normals, states, planes }
    }

    /// Adds the terms of order k + 2, and those of order k + 1 whose rates follow from forces.
    fn add_order(&mut self, operator: &LawOperator, k: usize, h: f64, acceleration: &[f64]) {
        let n = acceleration.len();
        for (one, slip) in operator.contacts.iter().zip(&self.slips) {
            if let Some(flow) = &one.flow {
                self.terms[(k + 1) * n + flow.coordinate] =
                    -one.sign * slip[k] * h / (k + 1) as f64;
            }
        }
        let factor = h * h / ((k + 1) * (k + 2)) as f64;
        for &i in &operator.taylor.equation.reduction.kept {
            self.terms[(k + 2) * n + i] = factor * acceleration[i];
        }
    }

    /// The larger one of the last two terms, relative to the largest.
    fn left_out(&self, n: usize, width: f64, operator: &LawOperator) -> f64 {
        let size = |terms: &[f64]| terms.iter().map(|x| x.abs()).fold(0.0, worse);
        let of = |k: usize| {
            let (q, dq) = self.terms[k * n..(k + 2) * n].split_at(n);
            worse(operator.taylor.omega() * size(q), (k + 1) as f64 / width * size(dq))
        };
        let largest = (0..COEFFICIENTS).map(of).fold(0.0, worse);
        if largest == 0.0 { 0.0 } else { worse(of(DEGREE - 1), of(DEGREE)) / largest }
    }

    /// Writes (dq, dq') at s of the panel.
    fn at(&self, s: f64, width: f64, dy: &mut [f64]) {
        let n = dy.len() / 2;
        dy.fill(0.0);
        let (q, u) = dy.split_at_mut(n);
        for terms in self.terms.chunks_exact(n).rev() {
            for ((q, u), term) in q.iter_mut().zip(u.iter_mut()).zip(terms) {
                *u = *u * s + *q;
                *q = *q * s + term;
            }
        }
        u.iter_mut().for_each(|u| *u /= width);
    }
}
