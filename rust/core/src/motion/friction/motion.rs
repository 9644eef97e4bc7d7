//! One phase in which friction depends on slip speed.
//!
//! Order by order the slip speed S and the normal force N of every contact that slides by its law are known from the
//! orders before, and with them `y = (mu(S) - mu(0)) N`, which loads the next order of the linear series.

use nalgebra::{DMatrix, DVector};

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::error::run::LawEnd;
use crate::motion::friction::operator::{LawOperator, Source};
use crate::motion::friction::plane::series::PlaneSeries;
use crate::motion::friction::plane::widths::CONSTANT;
use crate::motion::friction::series::coefficients::{UNIT, lowest, scale};
use crate::motion::friction::series::convolutions::{Convolutions, SHARING};
use crate::motion::friction::series::followed_state::FollowedState;
use crate::motion::friction::series::law_contact::{Fading, Flow, LawContact, LawOf};
use crate::motion::friction::series::law_series::LawSeries;
use crate::motion::friction::series::panel_bound::ContactBounds;
use crate::motion::panel::Panel;
use crate::motion::series::size_of;
use crate::motion::taylor::motion::{ORDERS, TaylorMotion};
use crate::motion::taylor::rows::Rows;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, powers};
use crate::numerics::simd::{Kernel, Lanes, VectorUnit};
use crate::scene::model::Scene;

/// Largest L of a panel; rounding then grows by (e^L - 1) / L, about 70.
const STEEPEST: f64 = 6.0;
/// Number of times that a panel is shortened before its error counts as unbounded.
pub(super) const TRIALS: usize = 60;
/// Panels one after the other that may be this short in terms of the time, between speeds of tables: the time hardly shows them.
pub(super) const STALLED: usize = 1000;
const SHORT: f64 = 64.0 * f64::EPSILON;
/// Of the last panel before a normal force vanishes: its width per time that is left at the rate of this force, what a deflection
/// that is left out may be on it, relative to the state, and the part of the truncation that its effect on the motion may be.
const BEYOND: f64 = 2.0;
const DEFLECTED: f64 = 1e-8;
const PART: f64 = 0.5;
/// What a panel on which a law has no bound is shortened by.
const UNBOUNDED: f64 = 0.7;
/// Bound of truncation on a panel, relative to the state: two ulps.
pub(super) const TRUNCATION: f64 = 2.0 * f64::EPSILON;
/// What the widths of panels that follow each other may grow by.
pub(super) const GROWTH: f64 = 1.3;
/// Changes of pieces at the start of a panel: each contact may be just at a speed of its table.
const CHANGES: usize = 4;

/// A contact that slides by its law, along the panel.
#[derive(Debug, Default)]
pub(super) struct Sliding {
    pub(super) series: LawSeries,
    /// The state of a formula, what its displacements add in the order beyond, and its value at the origin at rest with the sum of
    /// the absolute values of its terms.
    pub(super) state: [f64; COEFFICIENTS],
    pub(super) state_beyond: f64,
    pub(super) state_at_origin: [f64; 2],
    /// Whether it is left out of the panel, at the end of which its normal force vanishes.
    pub(super) fades: bool,
    /// N, and what its displacements add in the order beyond.
    pub(super) normal: [f64; COEFFICIENTS],
    pub(super) beyond: f64,
    /// y
    pub(super) force: [f64; COEFFICIENTS],
    /// N without what laws add, at the origin at rest.
    pub(super) at_origin: f64,
    /// Sum of the absolute values of its terms.
    pub(super) at_origin_size: f64,
    /// The slip velocity, or the argument of an element, at the origin at rest, and the sum of the absolute values of its terms.
    pub(super) slip_at_origin: [f64; 2],
    /// Where slip has no mass: what displacements add to R in the order beyond, and R at the origin at rest as for N.
    pub(super) friction_beyond: f64,
    pub(super) friction_at_origin: [f64; 2],
    /// Of bristles.
    pub(super) followed: FollowedState,
    /// Bound of the error of y.
    pub(super) error: f64,
    pub(super) bounds: ContactBounds,
}

/// How far a series moves from where it begins, at most.
pub(super) fn moved(series: &[f64; COEFFICIENTS]) -> f64 {
    series[1..].iter().map(|c| c.abs()).sum()
}

/// The larger of two numbers, or NaN if one of them is no number.
pub(super) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl Sliding {
    /// What the pieces of its law are pieces of: the state, where there is one.
    pub(super) fn argument_of_pieces(&self, one: &LawContact) -> &[f64; COEFFICIENTS] {
        if one.state.is_some() { &self.state } else { &self.series.slip }
    }

    /// Whether slip speed and state stay where the series of the law holds.
    fn is_within_reach(&self, one: &LawContact) -> bool {
        let Self { series, state, fades, .. } = self;
        *fades
            || series.range() <= series.reach(&one.law)
                && (one.state.is_none() || moved(state) <= series.reach_of_state())
    }
}

/// Normal forces of contacts that are coupled: `(1 - H w_0) N = N_ref + H c`, where c is the part of y from lower orders, and w_0 is
/// zero of an element, whose whole force is known.
#[derive(Debug, Default)]
pub(super) struct Coupling {
    pub(super) inverse: DMatrix<f64>,
    /// Its largest row sum.
    pub(super) inverse_norm: f64,
}

impl Coupling {
    /// The normal forces of order k, each of which the friction of the others moves.
    pub(super) fn couple(
        &mut self,
        response: &DMatrix<f64>,
        all: &[LawContact],
        contacts: &mut [Sliding],
        k: usize,
    ) {
        let count = contacts.len();
        if k == 0 {
            let matrix = DMatrix::from_fn(count, count, |i, j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                let waits = if all[j].is_element() { 0.0 } else { contacts[j].series.excess[0] };
                unit - response[(i, j)] * waits
            });
            // A singular one leaves no bound.
            let none = || DMatrix::from_element(count, count, f64::INFINITY);
            self.inverse = matrix.try_inverse().unwrap_or_else(none);
            let sums = self.inverse.row_iter().map(|row| row.iter().map(|x| x.abs()).sum());
            self.inverse_norm = sums.fold(0.0, f64::max);
        }
        let normals: Vec<f64> = contacts.iter().map(|one| one.normal[k]).collect();
        let forces: Vec<f64> = contacts.iter().map(|one| one.force[k]).collect();
        let coupled = self.solve(response, &normals, &forces);
        contacts.iter_mut().zip(coupled).for_each(|(one, normal)| one.normal[k] = normal);
    }

    /// N, from what it is without the forces of laws and what these are without the order sought.
    pub(super) fn solve(
        &self,
        response: &DMatrix<f64>,
        normals: &[f64],
        forces: &[f64],
    ) -> Vec<f64> {
        let forces = DVector::from_column_slice(forces);
        let loaded = DVector::from_column_slice(normals) + response * forces;
        (&self.inverse * loaded).as_slice().to_vec()
    }
}

/// One phase by Taylor series of the nonlinear equation of motion.
#[derive(Debug, Default)]
pub(crate) struct LawMotion {
    pub(super) taylor: TaylorMotion,
    /// The force at the origin, without what laws add.
    pub(super) base: Vec<f64>,
    pub(super) contacts: Vec<Sliding>,
    pub(super) coupling: Coupling,
    /// Of two contacts each.
    pub(super) convolutions: Vec<Convolutions>,
    /// Powers of the part that the panel has of the width on which the recurrences were.
    pub(super) powers: [f64; COEFFICIENTS],
    /// Sums of the absolute values of the coefficients of every coordinate and velocity.
    pub(super) sizes: [Vec<f64>; 2],
    /// Width of the next panel before it is shortened to what its error allows, as a part of the operator's.
    pub(super) share: f64,
    /// How often the series was scaled to a shorter panel.
    pub(super) shortenings: usize,
    /// Those that slip in a plane.
    pub(super) planes: Vec<PlaneSeries>,
    /// Width of the panel on which directions of slow slips or deflections followed last, and the time before which this is not tried again, s.
    pub(super) followed: f64,
    pub(super) untried_until: f64,
    /// The one whose slip ends with the panel, and those whose slips have ended.
    pub(super) stopping: Option<usize>,
    stopped: Vec<usize>,
    /// The time left to its end, times the rate of the motion, over which forces on a slip count as constant.
    pub(super) constant: f64,
    /// Velocity beyond which the motion is given up, where there is one.
    pub(crate) most_speed: Option<f64>,
    /// Bound of the error of the state on the panel, in the norm of the operator.
    pub(super) left_out: f64,
    /// Bound of what orders of the state have that the rows did not count, in the same norm.
    pub(super) uncounted: f64,
    /// Least radius of the neighbourhood of the polynomials in which the panel is bounded, in the same norm; 0 unless rounding needs one.
    pub(super) least_tube: f64,
    /// Pieces that tables have from the end of the panel on, as (place, piece), those of planes after those of contacts.
    pub(super) next: Option<(usize, usize)>,
    /// A contact whose law ends the phase at the end of the panel, and one whose law has ended it.
    pub(super) ends: Option<(LawOf, LawEnd)>,
    pub(super) ended: Option<(LawOf, LawEnd)>,
    pub(super) unit: VectorUnit,
}

/// The same series for a shorter panel, from the powers of the factor.
struct Shorten<'a> {
    motion: &'a mut LawMotion,
    powers: [f64; ORDERS],
}

impl Kernel for Shorten<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { motion: LawMotion { taylor, contacts, planes, powers: all, .. }, powers } = self;
        taylor.shorten_by(&powers);
        planes.iter_mut().for_each(|series| series.shorten(&powers));
        scale(all, &powers);
        for sliding in contacts {
            let Sliding {
                series, state, normal, force, beyond, state_beyond, friction_beyond, ..
            } = sliding;
            sliding.followed.shorten(&powers);
            series.shorten(&powers);
            scale(state, &powers);
            scale(normal, &powers);
            scale(force, &powers);
            *beyond *= powers[COEFFICIENTS];
            *state_beyond *= powers[COEFFICIENTS];
            *friction_beyond *= powers[COEFFICIENTS];
        }
    }
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
        self.begin(scene, operator, functions, q, u);
        self.fill(scene, operator);
    }

    /// The same without its series.
    pub(super) fn begin(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        functions: &[EventFunction],
        q: &[f64],
        u: &[f64],
    ) {
        self.taylor.begin(scene, &operator.taylor, functions, q, u);
        self.taylor.width = operator.taylor.width();
        let own = operator.taylor.equation.scene(scene);
        self.base.clone_from(&self.taylor.force);
        (self.next, self.ends, self.ended) = (None, None, None);
        (self.stopping, self.constant) = (None, CONSTANT);
        self.stopped.clear();
        (self.share, self.left_out) = (1.0, 0.0);
        (self.followed, self.untried_until) = (f64::INFINITY, 0.0);
        self.planes.resize_with(operator.planes.len(), PlaneSeries::default);
        for (place, (one, series)) in operator.planes.iter().zip(&mut self.planes).enumerate() {
            let reaction = one.coordinates.map(|row| {
                let mut load = self.taylor.force[row] + self.taylor.load_of(own, row, 0);
                for element in operator.contacts.iter().filter(|law| law.is_element()) {
                    let force = element.excess(q, u);
                    let terms = element.direction.iter().filter(|term| term.0 == row);
                    load += terms.map(|term| element.sign * term.1 * force).sum::<f64>();
                }
                load
            });
            let pressing = one.pressing(|place| operator.contacts[place].excess(q, u));
            let limit = one.limit.value(q, u) + pressing;
            if series.begin(one, u, &self.taylor.origin, (limit, reaction)) {
                self.stopped.push(place);
            }
            if one.is_negative_at(u) {
                self.ended = Some((LawOf::Contact(one.contacts[0]), LawEnd::Negative));
            }
        }
        self.contacts.resize_with(operator.contacts.len(), Sliding::default);
        let pairs = operator.paired.div_ceil(SHARING);
        self.convolutions.resize_with(pairs, Convolutions::new);
        for (one, sliding) in operator.contacts.iter().zip(&mut self.contacts) {
            let speed = -one.sign * one.slip.value(q, u);
            // Where slip has no mass, rounding of its start is left out.
            let speed = if one.flow.is_some() { speed.max(0.0) } else { speed };
            sliding.series.piece = one.piece(speed, q, u);
            (sliding.followed.follows, sliding.followed.relaxed_at) = (false, 0.0);
            if !one.has_sign() && one.state.is_none() && one.law.value(speed.max(0.0)) < 0.0 {
                self.ended = Some((one.of, LawEnd::Negative));
            }
            let origin = &self.taylor.origin;
            let of_origin = |sum: f64, &(k, weight): &(usize, f64)| sum + weight * origin[k];
            let size = |sum: f64, &(k, weight): &(usize, f64)| sum + (weight * origin[k]).abs();
            let at_origin = |Functional { position, constant, .. }: &Functional| {
                [
                    position.iter().fold(*constant, of_origin),
                    position.iter().fold(constant.abs(), size),
                ]
            };
            [sliding.at_origin, sliding.at_origin_size] = at_origin(&one.normal);
            sliding.slip_at_origin = at_origin(&one.slip);
            sliding.state_at_origin =
                one.state.as_ref().map_or([0.0; 2], |state| at_origin(&state.value));
            if let Some(Flow { friction, .. }) = &one.flow {
                sliding.friction_at_origin = at_origin(friction);
                let [friction, normal] = [sliding.friction_at_origin[0], sliding.at_origin];
                let stiffness = one.law.slope(speed) * normal;
                if stiffness > 0.0 && friction.is_finite() {
                    // A first panel over which the coordinate relaxes by no more than a series can follow.
                    let rate = operator.relaxation(one, stiffness);
                    self.share = self.share.min(STEEPEST / (rate * operator.taylor.width()));
                }
            }
        }
    }

    pub fn start(&self) -> f64 {
        self.taylor.start()
    }

    /// Local time to which the series holds.
    pub fn end(&self) -> f64 {
        self.taylor.end()
    }

    /// Whether the panel is the last one of a slip in a plane.
    pub fn ends_slip(&self) -> bool {
        self.stopping.is_some()
    }

    /// Of the last panel of a slip in a plane: how the time that is left grows with the velocities of both directions, by their
    /// coordinates.
    pub fn time_left_by_slip(&self, operator: &LawOperator) -> Option<[(usize, f64); 2]> {
        let place = self.stopping?;
        let one = &operator.planes[place];
        let by_slip = self.planes[place].time_left_by_slip(one)?;
        let coordinates = one.coordinates;
        Some([0, 1].map(|i| (coordinates[i], by_slip[i])))
    }

    /// The contacts in planes whose slips have ended here.
    pub fn stopped(&self, operator: &LawOperator) -> Vec<usize> {
        self.stopped.iter().map(|&place| operator.planes[place].contacts[0]).collect()
    }

    /// Whose law does not hold from here on, and why.
    pub fn exhausted(&self) -> Option<(LawOf, LawEnd)> {
        self.ended
    }

    /// A rate of the linear part of the motion, 1/s; quadratures go by single panels anyway.
    pub fn rate(&self, operator: &LawOperator) -> f64 {
        operator.taylor.norm()
    }

    /// The series on the next panel, and how far it holds.
    pub(super) fn fill(&mut self, scene: &Scene, operator: &LawOperator) {
        self.taylor.width = operator.taylor.width();
        if !self.stopped.is_empty() {
            return;
        }
        self.share = self.share.min(operator.widest());
        if self.share != 1.0 {
            self.taylor.begin_within(self.share);
        }
        self.fade(operator);
        self.powers = [1.0; COEFFICIENTS];
        self.shortenings = 0;
        // Deflections that have followed go on to do so, and need no series in time.
        let has_pieces = || operator.contacts.iter().any(|one| !one.law.knots().is_empty());
        let goes_on = operator.states.is_some() && self.followed.is_finite() && !has_pieces();
        self.contacts.iter_mut().for_each(|one| one.followed.follows = false);
        if !(goes_on && self.follow_balances(scene, operator, false)) {
            self.recur_in_range(scene, operator);
            for _ in 0..CHANGES {
                if !self.change_pieces(operator) {
                    break;
                }
                self.recur_in_range(scene, operator);
            }
            self.ended = self.ended.or_else(|| self.end_of_flow(operator));
            self.end_slip(scene, operator);
            if !goes_on {
                self.follow_balances(scene, operator, true);
            }
        }
        for _ in 0..TRIALS {
            let mut laws = operator.contacts.iter().zip(&self.contacts);
            // Beyond the range of numbers nothing is near.
            let mut planes = operator.planes.iter().zip(&self.planes);
            let turns_within = |(one, series): (_, &PlaneSeries)| {
                series.law_of_speed(one).is_none_or(|(law, own)| own.range() <= own.reach(law))
            };
            if laws.all(|(one, sliding)| sliding.is_within_reach(one)) && planes.all(turns_within) {
                break;
            }
            self.shorten(UNBOUNDED);
        }
        let slips = self.planes.iter().map(PlaneSeries::part_that_slips);
        let part = slips.fold(1.0, f64::min);
        if part < 1.0 {
            self.shorten(part);
        }
        let scale = self.taylor.scale(&operator.taylor);
        self.least_tube = 0.0;
        for _ in 0..TRIALS {
            let bound = self.bound(scene, operator, scale);
            let size = self.size_of_followed(operator, scale).max(self.least_tube);
            let factor = (TRUNCATION * size / bound.truncation()).powf(1.0 / COEFFICIENTS as f64);
            let factor = factor.min(STEEPEST / bound.exponent);
            if bound.holds {
                // None of it grows on a shorter panel, and truncation of the state falls with the 30th power of the width.
                // What the series of a slip that begins or is slow leaves out begins at lower orders.
                // How far a deflection begins from its balance does not fall at all.
                let all = |one: &PlaneSeries| one.begins() || one.follows();
                if factor < 1.0 && (self.planes.iter().any(all) || self.has_followed_state()) {
                    self.shorten(factor);
                    continue;
                }
                let factor = factor.min(1.0);
                self.left_out = bound.of_shorter(factor);
                for sliding in &mut self.contacts {
                    sliding.error = sliding.bounds.of_shorter(factor, self.left_out);
                }
                if factor < 1.0 {
                    self.shorten(factor);
                }
                break;
            }
            self.left_out = f64::INFINITY;
            self.contacts.iter_mut().for_each(|sliding| sliding.error = f64::INFINITY);
            let rounding = bound.rounding(1.0);
            if !(rounding.is_finite() && bound.truncation().is_finite()) {
                // A law has no bound on this width, in no neighbourhood.
                self.shorten(UNBOUNDED.min(factor.max(0.2)));
            } else if factor >= 1.0 && bound.radius < rounding && self.least_tube < rounding {
                self.least_tube = 2.0 * rounding;
            } else {
                self.shorten(if factor > 0.2 { factor.min(0.95) } else { 0.2 });
            }
        }
        if !self.left_out.is_finite() {
            self.ended = self.ended.or_else(|| self.end_of_flow(operator));
            self.ended = self.ended.or_else(|| self.undefined(operator, scale));
        }
        self.ended = self.ended.or_else(|| self.unresolved(operator, scale));
        self.ended = self.ended.or_else(|| self.without_bound(operator));
        if self.is_known_to_its_start_alone() {
            self.taylor.keep_start();
        }
        let width = self.taylor.width;
        match self.has_followed_state() {
            true => self.followed = width,
            false => {
                let left = self.planes.iter().map(PlaneSeries::left_after);
                self.share = left.fold(GROWTH, f64::min) * width / operator.taylor.width();
            }
        }
        self.cut(operator, scale);
    }

    /// Leaves the products of springs in planes out of the last panel before their normal forces vanish, where the deflections that
    /// they change hardly change the motion any more.
    fn fade(&mut self, operator: &LawOperator) {
        let Self { taylor, contacts, .. } = self;
        let scale = taylor.scale_at_start(&operator.taylor);
        let value = |of: &Functional| {
            let terms = of.position.iter().map(|&(k, weight)| weight * taylor.origin[k]);
            of.constant + terms.sum::<f64>() + taylor.coefficient(of, 0)
        };
        contacts.iter_mut().for_each(|sliding| sliding.fades = false);
        let of = |one: &LawContact| one.fading().map(|(_, fading)| fading.contact);
        let mut width = f64::INFINITY;
        let mut first = 0;
        for of_one in operator.contacts.chunk_by(|a, b| of(a) == of(b)) {
            let own = first..first + of_one.len();
            first = own.end;
            let Some((force, Fading { rate, .. })) = of_one[0].fading() else { continue };
            let [force, falls] = [value(force), -value(rate)];
            if !(falls > 0.0) {
                continue;
            }
            let left = BEYOND * force.max(0.0) / falls;
            let largest = |one: &LawContact| one.fading().map_or(0.0, |(_, fading)| fading.largest);
            let rates =
                of_one.iter().map(|one| one.force_norm * largest(one) * value(&one.normal).abs());
            let deflected = left * rates.sum::<f64>();
            let felt = left * operator.taylor.norm() * deflected;
            if deflected <= DEFLECTED * scale && felt <= PART * TRUNCATION * scale {
                contacts[own].iter_mut().for_each(|sliding| sliding.fades = true);
                width = width.min(left);
            }
        }
        if width.is_finite() {
            let share = width.min(operator.taylor.width()) / taylor.width;
            self.taylor.begin_within(share.max(f64::MIN_POSITIVE));
        }
    }

    pub(super) fn shorten(&mut self, factor: f64) {
        let unit = self.unit;
        self.shortenings += 1;
        // No slip ends with a part of its last panel.
        self.stopping = None;
        unit.run(Shorten { motion: self, powers: powers(factor) });
    }

    pub fn expand(
        &mut self,
        operator: &LawOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        if !self.stopped.is_empty() {
            // No series begins here.
            panel.reset(self.taylor.width, functions.len());
            return;
        }
        match &operator.taylor.dense {
            Some(rows) => self.expand_rows(operator, rows, functions, panel),
            None => {
                self.taylor.expand_within(&operator.taylor, functions, panel, self.left_out);
            }
        }
        if let Some(response) = &operator.response {
            self.add_friction(&response.functions, functions, panel);
        }
        if self.ended.is_some() {
            panel.error.fill(f64::INFINITY);
        }
    }

    /// The event functions of a small combination, which the recurrences gave.
    fn expand_rows(
        &self,
        operator: &LawOperator,
        rows: &Rows,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        panel.reset(self.taylor.width, functions.len());
        let rounding = self.taylor.rounding();
        for (index, function) in functions.iter().enumerate() {
            let [at_origin, constant] = self.taylor.constant(index);
            let functional = &function.functional;
            let source = operator.sources[index];
            let [size, higher] = match source {
                Source::Row(place) => self.taylor.products.sizes(place),
                _ => [&self.sizes, &self.taylor.sizes()[2]]
                    .map(|of| size_of(functional, of.each_ref().map(|of| &of[..]))),
            };
            let tail = self.left_out * operator.taylor.function_norm(index);
            let error = rounding * (constant + size) + tail;
            panel.error[index] = error;
            panel.curvature_error[index] = rounding * higher + tail;
            let row = panel.row(index);
            let least = match source {
                Source::Row(place) => {
                    let [start, negative] = self.taylor.products.least(rows, place);
                    at_origin + start + negative
                }
                Source::Slip(contact) => {
                    *row = self.contacts[contact].series.slip;
                    lowest(row)
                }
                Source::Coordinate => {
                    self.taylor.coefficients_of_single(functional, row);
                    row[0] += at_origin;
                    lowest(row)
                }
            };
            panel.excluded[index] = least > error && function.cone.is_none();
            if let (Source::Row(place), false) = (source, panel.excluded[index]) {
                let row = panel.row(index);
                let scaled = self.powers.iter().zip(self.taylor.products.row(rows, place));
                row.iter_mut().zip(scaled).for_each(|(c, (power, term))| *c = power * term);
                row[0] += at_origin;
            }
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
            row[0] += self.taylor.constant(index)[0];
            for (factor, one) in factors.iter().zip(&self.contacts) {
                let terms: f64 = one.force.iter().map(|c| c.abs()).sum();
                error += factor.abs() * (one.error + UNIT * (DEGREE + 4) as f64 * terms);
            }
            let least = lowest(row);
            panel.error[index] += error;
            panel.curvature_error[index] += error;
            panel.excluded[index] = least > panel.error[index] && function.cone.is_none();
        }
    }

    pub fn advance(&mut self, scene: &Scene, operator: &LawOperator) {
        self.taylor.step(&operator.taylor);
        self.ended = self.ended.or(self.ends.take());
        self.stopped.clear();
        if self.stopping.take().is_some() {
            let ended = self.planes.iter().enumerate().filter(|(_, series)| series.ends());
            self.stopped.extend(ended.map(|(place, _)| place));
        }
        if operator.states.is_none() && self.planes.iter().any(PlaneSeries::begins) {
            // A slip that has begun is among those that may follow.
            self.untried_until = self.start();
        }
        self.planes.iter_mut().for_each(PlaneSeries::go_on);
        if let Some((place, piece)) = self.next.take() {
            match place.checked_sub(self.contacts.len()) {
                None => self.contacts[place].series.piece = piece,
                Some(place) => self.planes[place].take_piece(piece),
            }
        }
        self.fill(scene, operator);
    }

    /// Moves on to the panel that holds a local time; false where the motion grows beyond the range of numbers or is given up
    /// before, as one does that is followed past the end of slip.
    pub fn reach(&mut self, scene: &Scene, operator: &LawOperator, time: f64) -> bool {
        let mut stalled = 0;
        while time > self.end() {
            // The motion is known up to here, and a time beyond is so by rounding.
            if self.is_known_to_its_start_alone() {
                return true;
            }
            // Where a law has ended the phase, panels may shrink without end.
            let ended = self.ended.is_some_and(|(_, end)| end != LawEnd::Negative);
            if ended || !self.left_out.is_finite() || stalled > STALLED || self.is_given_up() {
                return false;
            }
            let before = self.end();
            self.advance(scene, operator);
            stalled = if self.goes_on_from(before) { 0 } else { stalled + 1 };
        }
        time <= self.end() || !self.stopped.is_empty()
    }

    /// Whether the time shows a panel that follows another one, which ended at `before`.
    pub(super) fn goes_on_from(&self, before: f64) -> bool {
        self.end() - before > SHORT * self.end()
    }

    /// Whether a velocity of the panel is beyond those that are of interest.
    pub(super) fn is_given_up(&self) -> bool {
        self.most_speed.is_some_and(|most| self.sizes[1].iter().any(|&speed| speed > most))
    }

    /// The state on the panel; one that cannot be resolved is known at its start alone.
    pub fn state(&self, operator: &LawOperator, offset: f64, q: &mut [f64], u: &mut [f64]) {
        let offset = if self.is_known_to_its_start_alone() { 0.0 } else { offset };
        self.taylor.state(&operator.taylor, offset, q, u);
    }

    fn is_known_to_its_start_alone(&self) -> bool {
        !self.stopped.is_empty()
            || matches!(self.ended, Some((_, LawEnd::Unresolved | LawEnd::Undefined)))
    }
}
