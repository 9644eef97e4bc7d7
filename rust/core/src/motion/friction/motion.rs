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

use crate::contact::event_function::EventFunction;
use crate::motion::friction::law_series::{LawSeries, scale};
use crate::motion::friction::operator::{LawContact, LawOperator};
use crate::motion::panel::Panel;
use crate::motion::taylor::motion::{TRUNCATION, TaylorMotion};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, ROW};
use crate::numerics::first_root::search::{FirstRoot, Verdict};
use crate::numerics::simd::VectorUnit;
use crate::scene::FrictionLaw;
use crate::scene::model::Scene;

/// One unit of rounding.
const UNIT: f64 = 0.5 * f64::EPSILON;
/// Radius of the neighbourhood of a polynomial in which Lipschitz bounds are taken, relative to the state.
const TUBE: f64 = 1e-6;
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
    /// N, of one order more than the others by the displacements alone.
    normal: [f64; COEFFICIENTS + 1],
    /// N at the origin at rest.
    at_origin: f64,
    /// Sum of the absolute values of all terms of N.
    size: f64,
}

/// One phase by Taylor series of the nonlinear equation of motion.
#[derive(Debug, Default)]
pub(crate) struct LawMotion {
    taylor: TaylorMotion,
    /// The force at the origin, without what laws add.
    base: Vec<f64>,
    contacts: Vec<Sliding>,
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
            let speed = -one.sign * (u[one.tangential] - one.slider_speed);
            if let FrictionLaw::Tabulated(table) = &one.law {
                series.piece = table.piece(speed);
            }
            if one.law.value(speed) < 0.0 {
                self.ended = Some(place);
            }
            let origin = &self.taylor.origin;
            let terms = one.normal.position.iter().map(|&(k, weight)| weight * origin[k]);
            let at_origin = terms.fold(one.normal.constant, |sum, term| sum + term);
            let normal = [0.0; COEFFICIENTS + 1];
            self.contacts.push(Sliding { series, normal, at_origin, size: 0.0 });
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

    /// A rate of the motion for quadratures: they take no longer steps than the series.
    pub fn rate(&self, operator: &LawOperator) -> f64 {
        operator.taylor.norm().max(2.0 / self.taylor.width)
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
            let (truncation, error) = self.bound(scene, operator, scale);
            self.left_out = error;
            if truncation <= TRUNCATION * scale && error.is_finite() {
                break;
            }
            let factor = (TRUNCATION * scale / truncation).powf(1.0 / COEFFICIENTS as f64);
            self.shorten(if factor > 0.2 { factor.min(0.95) } else { 0.2 });
            self.left_out = f64::INFINITY;
        }
        self.cut(operator);
    }

    /// The recurrences of state, slip speed, normal force and law.
    fn recur(&mut self, scene: &Scene, operator: &LawOperator) {
        let Self { taylor, base, contacts, .. } = self;
        taylor.width = operator.taylor.width();
        for k in 0..COEFFICIENTS {
            if k == 0 {
                taylor.force.copy_from_slice(base);
            } else {
                taylor.force.fill(0.0);
            }
            for (one, sliding) in operator.contacts.iter().zip(contacts.iter_mut()) {
                let Sliding { series, normal, at_origin, .. } = sliding;
                let velocity = taylor.velocity(one.tangential, k);
                let relative = if k == 0 { velocity - one.slider_speed } else { velocity };
                series.slip[k] = -one.sign * relative;
                normal[k] =
                    taylor.coefficient(&one.normal, k) + if k == 0 { *at_origin } else { 0.0 };
                series.extend(&one.law, k);
                let product: f64 = (0..=k).map(|j| series.excess[j] * normal[k - j]).sum();
                taylor.force[one.tangential] += one.sign * product;
            }
            if k < DEGREE {
                taylor.order(scene, &operator.taylor, k, true);
            }
        }
        taylor.force.copy_from_slice(base);
        for (one, sliding) in operator.contacts.iter().zip(contacts) {
            sliding.normal[COEFFICIENTS] = taylor.displacement(&one.normal, COEFFICIENTS);
            sliding.size = taylor.size_of(&one.normal);
        }
    }

    fn shorten(&mut self, factor: f64) {
        self.taylor.shorten(factor);
        for Sliding { series, normal, .. } in &mut self.contacts {
            series.shorten(factor);
            scale(normal, factor);
        }
    }

    /// Bounds of the error of the state by truncation alone, and of all of it.
    fn bound(&self, scene: &Scene, operator: &LawOperator, scale: f64) -> (f64, f64) {
        let taylor = &self.taylor;
        let reach = operator.taylor.norm() * taylor.width;
        let last = taylor.norm_of(scene, &operator.taylor, DEGREE);
        let radius = TUBE * scale;
        // Where the norm is the largest entry, the worst contact counts; else all together.
        let together = |sum: &mut f64, part: f64| {
            *sum = if scene.coupled_mass.is_some() { *sum + part } else { sum.max(part) };
        };
        let (mut truncated, mut rounded, mut lipschitz) = (0.0, 0.0, 0.0);
        for (one, Sliding { series, normal, size, .. }) in
            operator.contacts.iter().zip(&self.contacts)
        {
            let law = series.bounds(&one.law, radius * one.slip_norm);
            let excess: f64 = series.excess.iter().map(|c| c.abs()).sum();
            let pressed: f64 = normal.iter().map(|c| c.abs()).sum();
            // sum of |excess_i| |N_j| with i + j >= DEGREE
            let (mut rest, mut products) = (0.0, 0.0);
            for (i, coefficient) in series.excess.iter().enumerate() {
                rest += normal[DEGREE - i].abs()
                    + if i == 0 { normal[COEFFICIENTS].abs() } else { 0.0 };
                products += coefficient.abs() * rest;
            }
            let by_force = taylor.width * one.force_norm;
            together(&mut truncated, by_force * (products + law.truncation * pressed));
            let terms = (DEGREE + 4) as f64 * excess * pressed
                + (operator.terms + 8) as f64 * excess * size;
            together(&mut rounded, by_force * (UNIT * terms + law.rounding * pressed));
            let largest = excess + law.truncation + law.rounding;
            let of_law = (pressed + radius * one.normal_norm) * law.slope * one.slip_norm;
            together(&mut lipschitz, one.force_norm * (largest * one.normal_norm + of_law));
        }
        let beyond = reach / COEFFICIENTS as f64 * last;
        truncated += reach * (last + beyond);
        let sizes: f64 =
            (0..COEFFICIENTS).map(|k| taylor.norm_of(scene, &operator.taylor, k)).sum();
        let load = taylor.width * taylor.force_norm(&operator.taylor);
        rounded += UNIT * (operator.terms + 8) as f64 * (reach * sizes + load);
        let exponent = reach + taylor.width * lipschitz;
        let growth = if exponent > 0.0 { exponent.exp_m1() / exponent } else { 1.0 };
        let error = growth * (truncated + rounded);
        let inside = error <= radius;
        (growth * truncated + beyond, if inside { error + beyond } else { f64::INFINITY })
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
        if self.ended.is_some() {
            panel.error.fill(f64::INFINITY);
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
