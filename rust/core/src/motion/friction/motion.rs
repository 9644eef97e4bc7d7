//! One phase in which friction depends on slip speed.
//!
//! Order by order the slip speed S and the normal force N of every contact that slides by its law are known from the
//! orders before, and with them `y = (mu(S) - mu(0)) N`, which loads the next order of the linear series.
//!
//! *The bound.* The polynomial P of the state obeys `P' = A P + f + sum b_i y_i(P) - D` with a defect D whose coefficients are
//! those that the series leaves out and the rounding of the others: finite sums. With the norm sigma of A and a Lipschitz
//! bound l_i of y_i around P, the error of P on a panel of width h is at most
//!
//! ```text
//! |X - P| <= h |D| (e^L - 1) / L,    L = h (sigma + sum |b_i| l_i)
//! ```
//!
//! (Gronwall), as long as this is within the neighbourhood in which l_i holds.

use nalgebra::DMatrix;

use crate::contact::event_function::EventFunction;
use crate::motion::friction::law_series::{LawSeries, scale};
use crate::motion::friction::operator::LawOperator;
use crate::motion::panel::Panel;
use crate::motion::taylor::motion::{TRUNCATION, TaylorMotion};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, ROW};
use crate::numerics::first_root::search::{FirstRoot, Verdict};
use crate::numerics::simd::VectorUnit;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// One unit of rounding.
const UNIT: f64 = 0.5 * f64::EPSILON;
/// Radius of the neighbourhood of a polynomial in which Lipschitz bounds are taken, relative to the state.
const TUBE: f64 = 1e-6;
/// Largest L of a panel: rounding grows by (e^L - 1) / L, some 70.
const STEEPEST: f64 = 6.0;
/// Times that a panel is shortened before its error counts as unbounded.
const TRIALS: usize = 60;
/// Distance from a speed of a table, relative to it, that is rounding of the motion to it.
const AT_KNOT: f64 = 1e-12;
/// A crossing of a speed of a table nearer than this part of the panel is taken at its start.
const AT_ONCE: f64 = 1e-9;
/// Changes of pieces at the start of a panel: each contact may be just at a speed of its table.
const CHANGES: usize = 4;

/// A contact that slides by its law, along the panel.
#[derive(Debug)]
struct Sliding {
    series: LawSeries,
    /// N, and what its displacements add in the order beyond.
    normal: [f64; COEFFICIENTS],
    beyond: f64,
    /// y
    force: [f64; COEFFICIENTS],
    /// N without what laws add, at the origin at rest.
    at_origin: f64,
    /// Bound of the error of y.
    error: f64,
}

/// Normal forces of contacts that are coupled: `(1 - H w_0) N = N_ref + H c`, with c what lower orders make of y.
#[derive(Debug, Default)]
struct Coupling {
    inverse: DMatrix<f64>,
    /// Largest row sums of this inverse, and of H.
    norms: [f64; 2],
}

/// One phase by Taylor series of the nonlinear equation of motion.
#[derive(Debug, Default)]
pub(crate) struct LawMotion {
    taylor: TaylorMotion,
    /// The force at the origin, without what laws add.
    base: Vec<f64>,
    contacts: Vec<Sliding>,
    coupling: Coupling,
    /// Bound of the error of the state on the panel, in the norm of the operator.
    left_out: f64,
    /// Pieces that tables have from the end of the panel on, as (place, piece).
    next: Option<(usize, usize)>,
    /// A contact whose law reaches 0 at the end of the panel, and one whose law has.
    ends: Option<usize>,
    ended: Option<usize>,
    unit: VectorUnit,
}

impl LawMotion {
    /// Starts a phase at local time 0 from (q, q').
    pub fn restart(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        functions: &[EventFunction],
        q: &[f64],
        u: &[f64],
    ) {
        self.taylor.begin(scene, &operator.taylor, functions, q, u);
        self.base.clone_from(&self.taylor.force);
        (self.next, self.ends, self.ended) = (None, None, None);
        self.contacts.clear();
        for (place, one) in operator.contacts.iter().enumerate() {
            let mut series = LawSeries::new();
            let speed = -one.sign * one.slip.value(q, u);
            if let FrictionLaw::Tabulated(table) = &one.law {
                series.piece = table.piece(speed);
            }
            if one.law.value(speed) < 0.0 {
                self.ended = Some(place);
            }
            let origin = &self.taylor.origin;
            let terms = one.normal.position.iter().map(|&(k, weight)| weight * origin[k]);
            let at_origin = terms.fold(one.normal.constant, |sum, term| sum + term);
            let none = [0.0; COEFFICIENTS];
            self.contacts.push(Sliding {
                series,
                normal: none,
                beyond: 0.0,
                force: none,
                at_origin,
                error: 0.0,
            });
        }
        self.fill(scene, operator);
    }

    pub fn start(&self) -> f64 {
        self.taylor.start()
    }

    /// Local time to which the series holds.
    pub fn end(&self) -> f64 {
        self.taylor.end()
    }

    /// The contact whose law would be negative from here on.
    pub fn exhausted(&self, operator: &LawOperator) -> Option<usize> {
        self.ended.map(|place| operator.contacts[place].contact)
    }

    /// The piece of the table of a contact on the panel.
    #[cfg(test)]
    pub fn piece(&self, place: usize) -> usize {
        self.contacts[place].series.piece
    }

    /// A rate of the linear part of the motion, 1/s; quadratures go by single panels anyway.
    pub fn rate(&self, operator: &LawOperator) -> f64 {
        operator.taylor.norm()
    }

    /// The series on the next panel, and how far it holds.
    fn fill(&mut self, scene: &Scene, operator: &LawOperator) {
        for _ in 0..CHANGES {
            self.recur(scene, operator);
            if !self.change_pieces(operator) {
                break;
            }
        }
        for _ in 0..TRIALS {
            let mut laws = operator.contacts.iter().zip(&self.contacts);
            // Beyond the range of numbers nothing is near.
            if laws.all(|(one, Sliding { series, .. })| series.range() <= series.reach(&one.law)) {
                break;
            }
            self.shorten(0.7);
        }
        let scale = self.taylor.scale(&operator.taylor);
        for _ in 0..TRIALS {
            let (truncation, error, exponent) = self.bound(scene, operator, scale);
            self.left_out = error;
            if truncation <= TRUNCATION * scale && error.is_finite() && exponent <= STEEPEST {
                break;
            }
            let factor = (TRUNCATION * scale / truncation).powf(1.0 / COEFFICIENTS as f64);
            let factor = factor.min(STEEPEST / exponent);
            self.shorten(if factor > 0.2 { factor.min(0.95) } else { 0.2 });
            self.left_out = f64::INFINITY;
        }
        self.cut(operator);
    }

    /// The recurrences of state, slip speed, normal force and law.
    fn recur(&mut self, scene: &Scene, operator: &LawOperator) {
        self.taylor.width = operator.taylor.width();
        for k in 0..COEFFICIENTS {
            let Self { taylor, contacts, .. } = self;
            for (one, sliding) in operator.contacts.iter().zip(contacts) {
                let Sliding { series, normal, force, at_origin, .. } = sliding;
                let [slip, constant] = match k {
                    0 => [one.slip.constant, *at_origin],
                    _ => [0.0; 2],
                };
                series.slip[k] = -one.sign * (taylor.coefficient(&one.slip, k) + slip);
                normal[k] = taylor.coefficient(&one.normal, k) + constant;
                series.extend(&one.law, k);
                // What lower orders of N make of y.
                force[k] = (1..=k).map(|j| series.excess[j] * normal[k - j]).sum();
            }
            if let Some(response) = &operator.response {
                self.couple(&response.normal, k);
            }
            let Self { taylor, contacts, base, .. } = self;
            if k == 0 {
                taylor.force.copy_from_slice(base);
            } else {
                taylor.force.fill(0.0);
            }
            for (one, Sliding { series, normal, force, .. }) in
                operator.contacts.iter().zip(contacts)
            {
                force[k] += series.excess[0] * normal[k];
                for &(row, weight) in &one.direction {
                    taylor.force[row] += one.sign * weight * force[k];
                }
            }
            if k < DEGREE {
                taylor.order(scene, &operator.taylor, k, true);
            }
        }
        let Self { taylor, contacts, base, .. } = self;
        taylor.force.copy_from_slice(base);
        for (one, sliding) in operator.contacts.iter().zip(contacts) {
            sliding.beyond = taylor.displacement(&one.normal, COEFFICIENTS).abs();
        }
    }

    /// The normal forces of order k, each of which the friction of the others moves.
    fn couple(&mut self, response: &DMatrix<f64>, k: usize) {
        let Self { contacts, coupling, .. } = self;
        let count = contacts.len();
        if k == 0 {
            let matrix = DMatrix::from_fn(count, count, |i, j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                unit - response[(i, j)] * contacts[j].series.excess[0]
            });
            // A singular one leaves no bound.
            let none = || DMatrix::from_element(count, count, f64::INFINITY);
            coupling.inverse = matrix.try_inverse().unwrap_or_else(none);
            let norm = |matrix: &DMatrix<f64>| {
                let sums = matrix.row_iter().map(|row| row.iter().map(|x| x.abs()).sum());
                sums.fold(0.0, f64::max)
            };
            coupling.norms = [norm(&coupling.inverse), norm(response)];
        }
        let loaded: Vec<f64> = (0..count)
            .map(|i| {
                let by_others =
                    contacts.iter().enumerate().map(|(j, one)| response[(i, j)] * one.force[k]);
                contacts[i].normal[k] + by_others.sum::<f64>()
            })
            .collect();
        for (i, one) in contacts.iter_mut().enumerate() {
            one.normal[k] = coupling.inverse.row(i).iter().zip(&loaded).map(|(a, b)| a * b).sum();
        }
    }

    fn shorten(&mut self, factor: f64) {
        self.taylor.shorten(factor);
        for Sliding { series, normal, force, beyond, .. } in &mut self.contacts {
            series.shorten(factor);
            scale(normal, factor);
            scale(force, factor);
            *beyond *= factor.powi(COEFFICIENTS as i32);
        }
    }

    /// Bounds of the error of the state by truncation alone, and of all of it, and L.
    fn bound(&mut self, scene: &Scene, operator: &LawOperator, scale: f64) -> (f64, f64, f64) {
        let Self { taylor, contacts, coupling, .. } = self;
        let reach = operator.taylor.norm() * taylor.width;
        let last = taylor.norm_of(scene, &operator.taylor, DEGREE);
        let radius = TUBE * scale;
        let size = |all: &[f64; COEFFICIENTS]| all.iter().map(|c| c.abs()).sum::<f64>();
        // Of each contact: bounds of its law, |excess|, |N|, and the orders of their product from DEGREE and beyond.
        let laws: Vec<_> = operator
            .contacts
            .iter()
            .zip(&*contacts)
            .map(|(one, Sliding { series, normal, .. })| {
                let law = series.bounds(&one.law, radius * one.slip_norm);
                let (mut rest, mut products) = (0.0, 0.0);
                for (i, coefficient) in series.excess.iter().enumerate() {
                    rest += normal[DEGREE - i].abs();
                    products += coefficient.abs() * rest;
                }
                (law, size(&series.excess), size(normal), products)
            })
            .collect();
        // How far off the polynomials of N are, and how much N moves per norm of the state.
        let mut off = contacts.iter().map(|one| one.beyond).fold(0.0, f64::max);
        let mut moved = operator.contacts.iter().map(|one| one.normal_norm).fold(0.0, f64::max);
        let mut unsharp = 0.0;
        if operator.response.is_some() {
            let [inverse, response] = coupling.norms;
            let pairs = || operator.contacts.iter().zip(&laws);
            let drift = pairs().map(|(one, (law, excess, ..))| {
                excess + law.truncation + law.rounding + law.slope * one.slip_norm * radius
            });
            let drift = inverse * response * drift.fold(0.0, f64::max);
            let gain = if drift < 0.5 { inverse / (1.0 - drift) } else { f64::INFINITY };
            let parts =
                laws.iter().map(|(law, _, pressed, products)| products + law.truncation * pressed);
            off = gain * (off + response * parts.fold(0.0, f64::max));
            let parts = laws.iter().map(|(law, excess, pressed, _)| {
                (law.rounding + UNIT * (DEGREE + 4 + laws.len()) as f64 * (1.0 + excess)) * pressed
            });
            unsharp = gain * (1.0 + response) * parts.fold(0.0, f64::max);
            let by_slip =
                pairs().map(|(one, (law, _, pressed, _))| law.slope * one.slip_norm * pressed);
            moved = gain * (moved + response * by_slip.fold(0.0, f64::max));
        }
        // Where the norm is the largest entry and contacts are apart, the worst one counts; else all together.
        let apart = scene.coupled_mass.is_none() && operator.response.is_none();
        let together = |sum: f64, part: f64| if apart { sum.max(part) } else { sum + part };
        let (mut truncated, mut rounded, mut lipschitz) = (0.0, 0.0, 0.0);
        let mut of_products = Vec::with_capacity(laws.len());
        for (one, (law, excess, pressed, products)) in operator.contacts.iter().zip(&laws) {
            let largest = excess + law.truncation + law.rounding;
            let cut = products + law.truncation * pressed + largest * off;
            let size = taylor.size_of(&one.normal);
            let terms = (DEGREE + 4) as f64 * pressed + (operator.terms + 8) as f64 * size;
            let round = UNIT * terms * excess + law.rounding * pressed + largest * unsharp;
            let slope = law.slope * one.slip_norm * (pressed + off + unsharp + radius * moved);
            let gain = largest * moved + slope;
            let by_force = taylor.width * one.force_norm;
            truncated = together(truncated, by_force * cut);
            rounded = together(rounded, by_force * round);
            lipschitz = together(lipschitz, one.force_norm * gain);
            of_products.push((cut + round, gain));
        }
        let beyond = reach / COEFFICIENTS as f64 * last;
        truncated += reach * (last + beyond);
        let sizes: f64 =
            (0..COEFFICIENTS).map(|k| taylor.norm_of(scene, &operator.taylor, k)).sum();
        let load = taylor.width * taylor.force_norm(&operator.taylor);
        rounded += UNIT * (operator.terms + 8) as f64 * (reach * sizes + load);
        let exponent = reach + taylor.width * lipschitz;
        let growth = if exponent > 0.0 { exponent.exp_m1() / exponent } else { 1.0 };
        let inside = growth * (truncated + rounded) <= radius;
        let error = if inside { growth * (truncated + rounded) + beyond } else { f64::INFINITY };
        for (sliding, (own, gain)) in contacts.iter_mut().zip(of_products) {
            sliding.error = own + gain * error;
        }
        (growth * truncated + beyond, error, exponent)
    }

    /// Takes the pieces of tables by the direction in which a slip speed leaves a border of two; whether some changed.
    fn change_pieces(&mut self, operator: &LawOperator) -> bool {
        let mut changed = false;
        for (one, Sliding { series, .. }) in operator.contacts.iter().zip(&mut self.contacts) {
            let FrictionLaw::Tabulated(table) = &one.law else { continue };
            for (border, beyond) in borders(&table.speeds, series.piece) {
                let outwards = if beyond > series.piece { series.slip[1] } else { -series.slip[1] };
                if (series.slip[0] - border).abs() <= AT_KNOT * border && outwards > 0.0 {
                    series.piece = beyond;
                    changed = true;
                    break;
                }
            }
        }
        changed
    }

    /// Ends the panel where the first slip speed comes to the border of a piece, or the first law to 0.
    fn cut(&mut self, operator: &LawOperator) {
        (self.next, self.ends) = (None, None);
        let mut first = 1.0;
        for (place, (one, Sliding { series, .. })) in
            operator.contacts.iter().zip(&self.contacts).enumerate()
        {
            let root = |border: f64, above: bool, end: f64| {
                if series.range() < (series.slip[0] - border).abs() {
                    return None;
                }
                let side = if above { -1.0 } else { 1.0 };
                let mut p = [0.0; ROW];
                p.iter_mut().zip(&series.slip).for_each(|(p, c)| *p = side * c);
                p[0] -= side * border;
                // A panel that begins at the border leaves it.
                let departs = p[0].abs() <= AT_KNOT * border;
                if departs {
                    p.copy_within(1.., 0);
                    p[ROW - 1] = 0.0;
                }
                let error = UNIT * (border.abs() + series.range());
                match self.unit.run(FirstRoot { polynomial: &p, error, end }) {
                    Verdict::Crossing { root, .. } if root > AT_ONCE => Some(root),
                    _ => None,
                }
            };
            match &one.law {
                FrictionLaw::Tabulated(table) => {
                    for (border, beyond) in borders(&table.speeds, series.piece) {
                        if let Some(at) = root(border, beyond > series.piece, first) {
                            first = at;
                            (self.next, self.ends) = (Some((place, beyond)), None);
                        }
                    }
                }
                FrictionLaw::Linear { at_rest, slope } if *slope < 0.0 => {
                    if let Some(at) = root(-at_rest / slope, true, first) {
                        first = at;
                        (self.next, self.ends) = (None, Some(place));
                    }
                }
                _ => {}
            }
        }
        if first < 1.0 {
            self.shorten(first);
        }
    }

    pub fn expand(
        &mut self,
        operator: &LawOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        self.taylor.expand_within(&operator.taylor, functions, panel, self.left_out);
        if let Some(response) = &operator.response {
            self.add_friction(&response.functions, functions, panel);
        }
        if self.ended.is_some() {
            panel.error.fill(f64::INFINITY);
        }
    }

    /// What friction adds to the event functions of coupled contacts.
    fn add_friction(
        &self,
        response: &DMatrix<f64>,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        for (index, function) in functions.iter().enumerate() {
            let factors = response.row(index);
            if factors.iter().all(|&factor| factor == 0.0) {
                continue;
            }
            let mut error = 0.0;
            let row = panel.row(index);
            for (k, c) in row.iter_mut().enumerate() {
                let by = factors.iter().zip(&self.contacts).map(|(a, one)| a * one.force[k]);
                *c = self.taylor.coefficient(&function.functional, k) + by.sum::<f64>();
            }
            row[0] += self.taylor.at_origin(index);
            for (factor, one) in factors.iter().zip(&self.contacts) {
                let terms: f64 = one.force.iter().map(|c| c.abs()).sum();
                error += factor.abs() * (one.error + UNIT * (DEGREE + 4) as f64 * terms);
            }
            let least = row[1..].iter().fold(row[0], |sum, c| sum + c.min(0.0));
            panel.error[index] += error;
            panel.curvature_error[index] += error;
            panel.excluded[index] = least > panel.error[index];
        }
    }

    pub fn advance(&mut self, scene: &Scene, operator: &LawOperator) {
        self.taylor.step(&operator.taylor);
        self.ended = self.ended.or(self.ends.take());
        if let Some((place, piece)) = self.next.take() {
            self.contacts[place].series.piece = piece;
        }
        self.fill(scene, operator);
    }

    pub fn state(&self, operator: &LawOperator, offset: f64, q: &mut [f64], u: &mut [f64]) {
        self.taylor.state(&operator.taylor, offset, q, u);
    }
}

/// The borders of a piece of a table, each with the piece beyond it; rest is none, and the last piece has no end.
fn borders(speeds: &[f64], piece: usize) -> impl Iterator<Item = (f64, usize)> {
    let below = (piece > 0).then(|| (speeds[piece], piece - 1));
    let above = speeds.get(piece + 1).map(|&speed| (speed, piece + 1));
    below.into_iter().chain(above)
}
