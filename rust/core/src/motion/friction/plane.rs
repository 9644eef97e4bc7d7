//! Friction in a plane: the direction of slip as a series, the error of that, the onset of slip, and its end.
//!
//! A contact that slips by w in a plane feels `T = -mu N e`, `e = w / |w|`. In the frame of the direction e_0 with which the panel
//! begins, `w = s^p (a, b)` with `a > 0`, and
//!
//! ```text
//! t = b / a,   c = (1 + t^2)^(-1/2),   e = (c, t c)
//! ```
//!
//! p is 0 while the contact slips. Slip begins with p = 1 where the friction force drops, as `w_1` is in balance with the forces R
//! on the contact, `M w' = R - mu N e`; where it does not (`|R| = mu N`), with p = 2: then e follows from the balance across e_0
//! in every order, and w from that along it. This series of p = 2 is an asymptotic one, taken on a panel that is short enough.
//!
//! *Error.* e is the gradient of the convex `|w|`, so `(w_1 - w_2) . (e_1 - e_2) >= 0`: a difference of two motions loses energy by
//! friction. In the energy norm (and where the norm is the largest entry, in that with `(w_x^2 + w_y^2)^(1/2)` in place of both
//! entries) only the defect of the series counts, no slope of e, however slow the slip is.
//!
//! *Friction over slip speed.* With a law mu(r), `r = |w| = w . e` is one more series, known from w and lower orders of e, and mu(r) one of
//! it. `mu(r) e` is the gradient of `int mu dr`, to which `f |w|^2 / 2` makes a convex one where `mu' >= -f` and `mu >= -f r`: then
//!
//! ```text
//! (w_1 - w_2) . (mu_1 e_1 - mu_2 e_2) >= -f |w_1 - w_2|^2
//! ```
//!
//! so that of the law only its fall counts, as a rate `N f / m` at which differences grow.
//!
//! *Slow slip.* The direction relaxes at the rate `mu N / (m r)`. Where this is fast, no series of t in time holds for longer; but the
//! direction that has relaxed follows from the balance across e_0, `mu N e = R - M w'` there with `w = a (1, t)`. Two terms of each order
//! come from the series before, which is formed again until nothing changes. What is left of this balance is the defect of that w,
//! whatever the rate.
//!
//! *End of slip.* With r = |w|, f = |R| and equal masses m, `r (mu N + R . e)` falls at the rate `((mu N)^2 - f^2) / m` while R is constant
//! (the energy and the momentum along R together), so that slip ends after `m r (mu N + R . e) / ((mu N)^2 - f^2)`. Panels shrink
//! with r until R is constant over that time to rounding; the last one takes w to zero at a constant rate.

use crate::contact::functional::Functional;
use crate::motion::friction::series::coefficients::{UNIT, lowest, scale, size};
use crate::motion::friction::series::convolutions::{Convolutions, FactorSums};
use crate::motion::friction::series::law_series::LawSeries;
use crate::motion::taylor::motion::{ORDERS, TaylorMotion};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, crosswise};
use crate::numerics::simd::{COLUMNS, Lanes, Side};
use crate::scene::friction::decay::{product, terms_left_out};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::friction::plane::beyond_limit;
use crate::scene::model::Scene;

/// Difference of `|R|` and `mu N`, relative to that, below which slip begins without a drop of friction.
const EQUAL: f64 = 1e-9;
/// Time to the end of slip, times the rate of the motion, from which on R is constant: its square is rounding.
pub(super) const CONSTANT: f64 = 1e-8;
/// The same where masses differ, and the time is a bound, and for neighbours of a motion, of which the first order counts.
pub(super) const NO_TIME: f64 = 8.0 * f64::EPSILON;
/// Times that the direction of slip relaxes over a panel from which on it follows from a balance, and the part of what is left of a
/// slip that such a panel has at most; and times that it relaxes over a panel that a series in time follows.
pub(super) const STIFF: f64 = 40.0;
const FOLLOWED: f64 = 4.0;
const REMAINS: f64 = 0.5;
/// An order of a slip that begins, relative to all of them, that is rounding; and the highest power with which slip begins.
const VANISHES: f64 = 1e-14;
const MOST: usize = 8;
/// The part of what a slip begins a panel with that it keeps on it, and Newton's steps to the width on which it does.
const KEEPS: f64 = 0.1;
const NEWTON: usize = 8;
/// A coefficient of the direction from which on a panel is too wide for its series.
const WIDE: f64 = 1e3;
/// A bound of the slope of a law from below has this rounding.
const FALLS: f64 = 1.0 + 4e-9;

/// A contact that slips in a plane.
#[derive(Debug)]
pub(crate) struct PlaneContact {
    /// The contacts along both directions, and their tangential coordinates.
    pub contacts: [usize; 2],
    pub coordinates: [usize; 2],
    /// Speeds of the slider, m/s.
    pub slider: [f64; 2],
    /// mu N, and mu, where the normal force is one of the outputs of dense rows, with its place there; both at rest, where mu depends
    /// on the slip speed by a law.
    pub limit: Functional,
    pub friction: f64,
    pub law: Option<FrictionLaw>,
    /// What forces of elements add to `mu N`, by their places among the laws, per newton.
    pub pressed_by: Vec<(usize, f64)>,
    pub output: Option<usize>,
    pub mass: [f64; 2],
    /// The norm of the operator per unit of force.
    pub force_norm: f64,
    /// What an error of the state leaves in w along the first direction, in w along the lighter one, and in `mu N`.
    pub slip_norm: f64,
    pub speed_norm: f64,
    pub limit_norm: f64,
}

/// Friction over slip speed along a panel.
#[derive(Debug, Clone)]
struct OfSpeed {
    /// `mu(r) - mu(0)` over r, with the factors of its product.
    series: LawSeries,
    factors: [[f64; COEFFICIENTS]; 2],
    /// `mu(0) N`
    at_rest: [f64; COEFFICIENTS],
    /// `r - a`, where the direction follows: from the series before.
    turned: [f64; COEFFICIENTS],
}

/// Bounds of the error of a friction force by truncation and by rounding, N, of w beside it, and of the change of the force per norm
/// of the state that adds energy to a difference of two motions.
pub(super) struct PlaneBound {
    pub cut: f64,
    pub round: f64,
    pub apart: f64,
    pub growth: f64,
}

/// What the bound of a panel knows besides: units of rounding of a product, times that the panel was shortened, its width, the errors of
/// `mu(0) N` by truncation and by rounding, its change per norm of the state, and the radius of the neighbourhood in which slopes count.
pub(super) struct PanelSizes {
    pub units: f64,
    pub shortenings: usize,
    pub width: f64,
    pub of_limit: [f64; 2],
    pub limit_norm: f64,
    pub radius: f64,
}

/// How the series of a panel is found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Course {
    /// Slip that goes on: p = 0.
    #[default]
    Slips,
    /// Slip that begins, with its p.
    Begins(usize),
    /// Slip that is so slow that its direction follows from the balance across it.
    Follows,
    /// The force that takes w to zero at the end of the panel.
    Ends([f64; 2]),
}

/// One of them along the panel.
#[derive(Debug, Clone)]
pub(super) struct PlaneSeries {
    /// `mu N`, at the origin at rest with the sum of the absolute values of its terms, and what displacements add in the order beyond.
    pub limit: [f64; COEFFICIENTS],
    pub at_origin: [f64; 2],
    pub beyond: f64,
    /// The time that is left of a slip whose forces are constant, s; infinite of one that they do not end.
    left: f64,
    course: Course,
    /// The time in the phase before which it has not come to the balance from which its direction follows, s.
    pub relaxed_at: f64,
    /// e_0
    direction: [f64; 2],
    /// w of order k in the frame of e_0.
    slip: [[f64; COEFFICIENTS]; 2],
    /// t, `1 + t^2`, c and t c.
    ratio: [f64; COEFFICIENTS],
    square: [f64; COEFFICIENTS],
    along: [f64; COEFFICIENTS],
    across: [f64; COEFFICIENTS],
    /// R of order 0 without friction.
    reaction: [f64; 2],
    /// Where the direction follows: what the balance across e_0 took from the series before.
    pull: [f64; COEFFICIENTS],
    products: [Convolutions; 2],
    of_speed: Option<Box<OfSpeed>>,
}

/// Errors of the direction by truncation and by rounding, relative; those of the force besides, N; and of w.
#[derive(Default)]
struct OfDirection {
    cut: f64,
    round: f64,
    force: f64,
    defect: f64,
    apart: f64,
}

/// Terms of products of order k that have factors of the orders from 1 to k - 1.
struct Lower {
    /// Of t and a, and of t with itself; where the direction follows, of t c and of c with themselves.
    turned: [f64; 2],
    /// Of `1 + t^2` and c, times the order of the former, and as they are.
    root: [f64; 2],
    /// Of t and c, of `mu N` and c, and of `mu N` and t c.
    ratio: f64,
    pressed: [f64; 2],
}

impl Default for PlaneSeries {
    fn default() -> Self {
        let none = [0.0; COEFFICIENTS];
        Self {
            limit: none,
            at_origin: [0.0; 2],
            beyond: 0.0,
            course: Course::default(),
            left: f64::INFINITY,
            relaxed_at: 0.0,
            direction: [1.0, 0.0],
            slip: [none; 2],
            ratio: none,
            square: none,
            along: none,
            across: none,
            reaction: [0.0; 2],
            pull: none,
            products: std::array::from_fn(|_| Convolutions::new()),
            of_speed: None,
        }
    }
}

impl Default for OfSpeed {
    fn default() -> Self {
        let none = [0.0; COEFFICIENTS];
        Self { series: LawSeries::default(), factors: [none; 2], at_rest: none, turned: none }
    }
}

impl OfSpeed {
    /// `mu N` of order k, from r and `mu(0) N` of that order.
    fn press(&mut self, law: &FrictionLaw, k: usize, [speed, at_rest]: [f64; 2]) -> f64 {
        let Self { series, factors: [left, right], at_rest: all, .. } = self;
        all[k] = at_rest;
        let middle = (1..k).map(|j| left[j] * right[k - j]).sum();
        (_, [left[k], right[k]]) = series.extend(law, k, [speed, 0.0], middle);
        at_rest + convolved(&series.excess, all, k) / law.value(0.0)
    }

    /// The sums of its factors, of which the law has its bounds.
    fn sums(&self) -> FactorSums {
        let [left, right] = &self.factors;
        FactorSums {
            left: [size(left), size(&self.series.excess)],
            right: [size(right), 0.0],
            left_out: [terms_left_out(left, right), 0.0],
        }
    }

    /// `mu / mu(0)`
    fn ratio(&self, at_rest: f64) -> [f64; COEFFICIENTS] {
        let mut ratio = self.series.excess.map(|excess| excess / at_rest);
        ratio[0] += 1.0;
        ratio
    }
}

/// The coefficient of order k of a product.
#[inline(always)]
fn convolved(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS], k: usize) -> f64 {
    crosswise(&a[..=k], &b[..=k])
}

/// The sum of the absolute values of the coefficients of a product from an order on.
#[inline(always)]
fn left_out(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS], first: usize) -> f64 {
    let mut sum = 0.0;
    for k in first..2 * COEFFICIENTS - 1 {
        let low = (k + 1).saturating_sub(COEFFICIENTS);
        sum += crosswise(&a[low..=k.min(DEGREE)], &b[low..=k.min(DEGREE)]).abs();
    }
    sum
}

/// A bound of the coefficients of a product from an order on, `sum_{i + j >= first} |a_i| |b_j|`.
#[inline(always)]
fn beyond(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS], first: usize) -> f64 {
    let mut tails = [0.0; COEFFICIENTS + 1];
    for j in (0..COEFFICIENTS).rev() {
        tails[j] = tails[j + 1] + b[j].abs();
    }
    let of = |(i, a): (usize, &f64)| a.abs() * tails[first.saturating_sub(i).min(COEFFICIENTS)];
    a.iter().enumerate().map(of).sum()
}

/// The sum of the absolute differences of two series.
fn apart(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}

/// `sum_i a_{k-i} x_i`, over all of x.
#[inline(always)]
pub(super) fn convolved_with<S: Lanes>(
    simd: S,
    a: &[f64; COEFFICIENTS],
    x: &[Side],
    k: usize,
) -> Side {
    let mut sum = Side::ZERO;
    for (x, a) in x.iter().zip(a[..=k].iter().rev()) {
        sum = sum.add_scaled(simd, *a, x);
    }
    sum
}

/// Columns along and across a direction, as `PlaneContact::turned`.
#[inline(always)]
fn turned<S: Lanes>(simd: S, [x, y]: [f64; 2], [a, b]: [&Side; 2]) -> [Side; 2] {
    [Side::combined(simd, [x, y], [a, b]), Side::combined(simd, [-y, x], [a, b])]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl PlaneContact {
    /// w
    fn slip_at(&self, u: &[f64]) -> [f64; 2] {
        [0, 1].map(|i| u[self.coordinates[i]] - self.slider[i])
    }

    /// |w|
    pub fn speed(&self, u: &[f64]) -> f64 {
        let [x, y] = self.slip_at(u);
        x.hypot(y)
    }

    /// w along and across a direction.
    fn turned(direction: [f64; 2], w: [f64; 2]) -> [f64; 2] {
        let [x, y] = direction;
        [x * w[0] + y * w[1], x * w[1] - y * w[0]]
    }

    fn turned_back(direction: [f64; 2], w: [f64; 2]) -> [f64; 2] {
        let [x, y] = direction;
        [x * w[0] - y * w[1], y * w[0] + x * w[1]]
    }

    /// What forces of laws add to `mu N`.
    #[inline(always)]
    pub fn pressing(&self, force: impl Fn(usize) -> f64) -> f64 {
        self.pressed_by.iter().map(|&(place, weight)| weight * force(place)).sum()
    }

    /// The friction force under a limit `mu(0) N` at slip velocities; where slip begins, by the forces R on the contact.
    pub fn friction(&self, at_rest: f64, u: &[f64], reaction: [f64; 2]) -> [f64; 2] {
        let w = self.slip_at(u);
        let speed = w[0].hypot(w[1]);
        let limit = at_rest * self.ratio_at(speed);
        let direction = match speed == 0.0 {
            true => self.departs(limit, reaction),
            false => w.map(|w| w / speed),
        };
        direction.map(|e| -limit * e)
    }

    /// How it changes along rates of the limit and of the slip velocities; not at all where slip begins.
    pub fn friction_rate(&self, [at_rest, rate]: [f64; 2], [u, du]: [&[f64]; 2]) -> [f64; 2] {
        let w = self.slip_at(u);
        let speed = w[0].hypot(w[1]);
        if speed == 0.0 {
            return [0.0; 2];
        }
        let direction = w.map(|w| w / speed);
        let [along, across] = Self::turned(direction, self.coordinates.map(|row| du[row]));
        let ratio = self.ratio_at(speed);
        let by_speed =
            self.law.as_ref().map_or(0.0, |law| along * law.slope(speed) / law.value(0.0));
        let pressing = ratio * rate + by_speed * at_rest;
        let turning = ratio * at_rest * across / speed;
        Self::turned_back(direction, [-pressing, -turning])
    }

    /// `mu / mu(0)` at a slip speed.
    fn ratio_at(&self, speed: f64) -> f64 {
        self.law.as_ref().map_or(1.0, |law| law.value(speed) / law.value(0.0))
    }

    /// Whether its friction is below zero at the slip velocities of a state.
    pub fn is_negative_at(&self, u: &[f64]) -> bool {
        self.ratio_at(self.speed(u)) < 0.0
    }

    /// The force across a direction that accelerations along and across it take.
    fn force_across(&self, direction: [f64; 2], [along, across]: [f64; 2]) -> f64 {
        let [_, of_across, of_both] = self.masses(direction);
        of_across * across + of_both * along
    }

    /// Masses along, across, and between both, in the frame of a direction.
    fn masses(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [m, n] = self.mass;
        [m * x * x + n * y * y, m * y * y + n * x * x, (n - m) * x * y]
    }

    /// The direction in which slip begins under forces R on the contact that its friction does not hold; that of R where they are at
    /// the limit.
    fn departs(&self, limit: f64, reaction: [f64; 2]) -> [f64; 2] {
        let length = reaction[0].hypot(reaction[1]);
        let found = beyond_limit(self.mass, limit, reaction);
        found.map_or(reaction.map(|part| part / length), |(_, direction)| direction)
    }
}

impl PlaneSeries {
    /// Begins a phase at velocities, under a limit `mu(0) N` and with forces R on the contact; whether it rests.
    pub(super) fn begin(
        &mut self,
        one: &PlaneContact,
        u: &[f64],
        origin: &[f64],
        (limit, reaction): (f64, [f64; 2]),
    ) -> bool {
        let Functional { position, constant, .. } = &one.limit;
        let add = |[sum, size]: [f64; 2], &(k, weight): &(usize, f64)| {
            let term = weight * origin[k];
            [sum + term, size + term.abs()]
        };
        self.at_origin = position.iter().fold([*constant, constant.abs()], add);
        match &one.law {
            Some(law) => {
                self.of_speed.get_or_insert_default().series.piece = law.piece(one.speed(u));
            }
            None => self.of_speed = None,
        }
        self.relaxed_at = 0.0;
        let w = one.slip_at(u);
        if w != [0.0; 2] {
            self.course = Course::Slips;
            return false;
        }
        let excess = reaction[0].hypot(reaction[1]) / limit - 1.0;
        self.course = Course::Begins(if excess <= EQUAL { 2 } else { 1 });
        self.direction = one.departs(limit, reaction);
        excess < -EQUAL
    }

    /// The next panel of a phase.
    pub(super) fn go_on(&mut self) {
        self.course = Course::Slips;
    }

    /// Another slip ends before, or with it.
    pub(super) fn end_later(&mut self) {
        if self.ends() {
            self.course = Course::Slips;
        }
    }

    /// Whether the forces R of order k on the contact matter: to slip that goes on, those of order 0, which tell when it ends.
    pub(super) fn needs_reaction(&self, k: usize) -> bool {
        k == 0 || !matches!(self.course, Course::Slips | Course::Ends(_))
    }

    pub(super) fn ends(&self) -> bool {
        matches!(self.course, Course::Ends(_))
    }

    pub(super) fn begins(&self) -> bool {
        matches!(self.course, Course::Begins(_))
    }

    /// The friction force of order k, from `mu N` and w of that order and, where slip begins, from the forces R of that order.
    #[inline(always)]
    pub(super) fn extend<S: Lanes>(
        &mut self,
        simd: S,
        one: &PlaneContact,
        k: usize,
        of_order: (f64, [[f64; 2]; 2]),
        width: f64,
    ) -> [f64; 2] {
        let [of_turned, of_pressed] = &mut self.products;
        if k == 0 {
            // On a panel that was too wide, factors may have been infinite.
            (*of_turned, *of_pressed) = (Convolutions::new(), Convolutions::new());
        }
        // Not by a closure, which the vector unit would be called through for every product.
        let [a, b, c, d] = of_turned.middle(simd, k);
        let [e, f, g, _] = of_pressed.middle(simd, k);
        of_turned.close(k);
        of_pressed.close(k);
        let lower = Lower { turned: [a, b], root: [c, d], ratio: e, pressed: [f, g] };
        let force = self.extend_from(one, k, of_order, &lower, width);
        let [ratio, along, across] = [&self.ratio, &self.along, &self.across].map(|of| of[k]);
        let (turned, square) = match self.course {
            Course::Follows => ([[across, along]; 2], 0.0),
            _ => ([[ratio; 2], [self.slip[0][k], ratio]], self.square[k]),
        };
        let [of_turned, of_pressed] = &mut self.products;
        of_turned.push(0, turned);
        of_turned.push(1, [[k as f64 * square, square], [along; 2]]);
        of_pressed.push(0, [[ratio, self.limit[k]], [along; 2]]);
        of_pressed.push(1, [[self.limit[k], 0.0], [across, 0.0]]);
        force
    }

    fn extend_from(
        &mut self,
        one: &PlaneContact,
        k: usize,
        (limit, [mut w, reaction]): (f64, [[f64; 2]; 2]),
        lower: &Lower,
        width: f64,
    ) -> [f64; 2] {
        let at_rest = if k == 0 { limit + self.at_origin[0] } else { limit };
        if k == 0 {
            w = [0, 1].map(|i| w[i] - one.slider[i]);
            self.reaction = reaction;
        }
        match self.course {
            Course::Ends(force) => {
                self.keep(k, w);
                self.limit[k] = at_rest * one.ratio_at(self.slip[0][0]);
                if k == 0 { force } else { [0.0; 2] }
            }
            Course::Slips => {
                if k == 0 {
                    let length = w[0].hypot(w[1]);
                    self.direction = w.map(|part| part / length);
                }
                self.keep(k, w);
                self.follow(k, lower);
                self.press(one, k, at_rest);
                self.force(k, lower)
            }
            Course::Follows => {
                self.keep(k, w);
                self.press(one, k, at_rest);
                self.balance_across(one, k, lower, reaction, width);
                self.force(k, lower)
            }
            Course::Begins(power) => {
                self.keep(k, if k < power { [0.0; 2] } else { w });
                // Slip of order 0 is zero, so that the direction of this order does not count.
                (self.along[k], self.across[k]) = (if k == 0 { 1.0 } else { 0.0 }, 0.0);
                self.press(one, k, at_rest);
                self.balance(one, k, (power, lower), reaction, width);
                if k == 0 && power == 2 {
                    // Exactly, so that slip does not begin by rounding.
                    return reaction.map(|part| -part);
                }
                self.force(k, lower)
            }
        }
    }

    /// `mu N` of order k, from that at rest.
    fn press(&mut self, one: &PlaneContact, k: usize, at_rest: f64) {
        let (Some(of_speed), Some(law)) = (&mut self.of_speed, &one.law) else {
            self.limit[k] = at_rest;
            return;
        };
        let [a, b] = &self.slip;
        let speed = match self.course {
            Course::Follows => a[k] + of_speed.turned[k],
            _ => convolved(a, &self.along, k) + convolved(b, &self.across, k),
        };
        self.limit[k] = of_speed.press(law, k, [speed, at_rest]);
    }

    /// What orders of `mu N` after the first give along and across e_0.
    fn pressed(&self, k: usize, lower: &Lower) -> [f64; 2] {
        if k == 0 {
            return [0.0; 2];
        }
        let [along, across] = [self.along[0], self.across[0]].map(|of| self.limit[k] * of);
        [along + lower.pressed[0], across + lower.pressed[1]]
    }

    fn keep(&mut self, k: usize, w: [f64; 2]) {
        let [along, across] = PlaneContact::turned(self.direction, w);
        self.slip[0][k] = along;
        // The panel begins along e_0.
        self.slip[1][k] = if k == 0 { 0.0 } else { across };
    }

    /// c and t of order k from the balance across e_0, `mu N e = R - M w'` there with `w = a (1, t)`, of which
    /// `(k + 1) / h (t_{k+1} a_0 + t_0 a_{k+1})` alone comes from the series before: the rest of this order has known factors, and t_k.
    fn balance_across(
        &mut self,
        one: &PlaneContact,
        k: usize,
        lower: &Lower,
        reaction: [f64; 2],
        width: f64,
    ) {
        let [_, across] = PlaneContact::turned(self.direction, reaction);
        let [_, pressed] = self.pressed(k, lower);
        let rest = across - self.pull[k] - pressed;
        if k == 0 {
            self.across[0] = rest / self.limit[0];
        } else {
            let (a, first) = (&self.slip[0], self.along[0]);
            let rate = (k + 1) as f64 / width * one.masses(self.direction)[1];
            let turned: f64 = (1..k).map(|i| self.ratio[i] * a[k + 1 - i]).sum();
            // c_k and t_k grow with t c of this order by these factors.
            let by_across = -self.across[0] / first;
            let turning = (1.0 - self.ratio[0] * by_across) / first;
            let along = -0.5 * (lower.turned[0] + lower.turned[1]) / first;
            let ratio = -(self.ratio[0] * along + lower.ratio) / first;
            let known = rest - rate * (turned + a[1] * ratio);
            self.across[k] = known / (self.limit[0] + rate * a[1] * turning);
        }
        self.close(k, lower);
    }

    /// What the balance across e_0 of order k takes from the series before: the next order of w along e_0 and of t.
    fn taken_from_before(&self, one: &PlaneContact, k: usize, width: f64) -> f64 {
        let ([along, _], ratio) = (&self.slip, &self.ratio);
        let moved = self.ratio[0] * along[k + 1] + ratio[k + 1] * self.slip[0][0];
        (k + 1) as f64 / width * one.force_across(self.direction, [along[k + 1], moved])
    }

    /// c and t of order k from t c: `c^2 + (t c)^2 = 1`.
    fn close(&mut self, k: usize, lower: &Lower) {
        let first = self.across[0];
        self.along[k] = match k {
            0 => (1.0 - first * first).max(0.0).sqrt(),
            _ => {
                let square = 2.0 * first * self.across[k] + lower.turned[0];
                -0.5 * (square + lower.turned[1]) / self.along[0]
            }
        };
        let known = if k == 0 { 0.0 } else { self.ratio[0] * self.along[k] + lower.ratio };
        self.ratio[k] = (self.across[k] - known) / self.along[0];
    }

    /// The widest panel up to a width, a power of two of the `full` one, on which directions may follow: on which little of this slip
    /// ends; of one that has not come to its balance, on which it relaxes no more than a series can follow.
    pub(super) fn widest(&self, one: &PlaneContact, [width, full]: [f64; 2], start: f64) -> f64 {
        let wide = ((REMAINS * self.left).min(width) / full).log2().floor().exp2() * full;
        match self.course {
            Course::Begins(_) | Course::Ends(_) => width,
            _ if self.relaxation(one) * width <= STIFF => width,
            _ if start < self.relaxed_at || self.relaxation(one) * wide <= STIFF => {
                FOLLOWED / self.relaxation(one)
            }
            _ => wide,
        }
    }

    /// The rate at which the direction of slip relaxes, at least, 1/s.
    pub(super) fn relaxation(&self, one: &PlaneContact) -> f64 {
        self.limit[0] / (one.mass[0].max(one.mass[1]) * self.slip[0][0])
    }

    /// Lets the direction follow from the balance of forces on a panel over which it relaxes many times; whether it does.
    pub(super) fn let_follow(&mut self, one: &PlaneContact, width: f64, start: f64) -> bool {
        if matches!(self.course, Course::Slips | Course::Follows) {
            let stiff = self.relaxation(one) * width > STIFF && start >= self.relaxed_at;
            self.course = if stiff { Course::Follows } else { Course::Slips };
            self.pull = [0.0; COEFFICIENTS];
            self.of_speed.iter_mut().for_each(|of_speed| of_speed.turned = [0.0; COEFFICIENTS]);
        }
        self.follows()
    }

    /// Takes the rest of the force across e_0 from `w = a (1, t)`; its change, and how far w begins from there.
    pub(super) fn improve(&mut self, one: &PlaneContact, width: f64) -> [f64; 2] {
        let mut change = 0.0;
        for k in 0..DEGREE {
            let force = self.taken_from_before(one, k, width);
            change += (force - self.pull[k]).abs();
            self.pull[k] = force;
        }
        let turned = self.turned_from_before();
        if let (Some(of_speed), Some(law)) = (&mut self.of_speed, &one.law) {
            let faster = apart(&of_speed.turned, &turned);
            let slope = of_speed.series.slope(law) / law.value(0.0);
            change += faster * (slope * of_speed.at_rest[0]).abs();
            of_speed.turned = turned;
        }
        [change, (self.ratio[0] * self.slip[0][0]).abs()]
    }

    pub(super) fn follows(&self) -> bool {
        self.course == Course::Follows
    }

    /// `r - a` of `w = a (1, t)`, where the direction follows.
    fn turned_from_before(&self) -> [f64; COEFFICIENTS] {
        if self.of_speed.is_none() {
            return [0.0; COEFFICIENTS];
        }
        let a = &self.slip[0];
        let across = product(&self.ratio, a);
        let speed = product(a, &self.along);
        let turned = product(&across, &self.across);
        std::array::from_fn(|k| speed[k] + turned[k] - a[k])
    }

    /// Where friction depends on the slip speed: its law, and that along the panel; not on the last panel of a slip, whose force is
    /// constant.
    pub(super) fn law_of_speed<'a>(
        &'a self,
        one: &'a PlaneContact,
    ) -> Option<(&'a FrictionLaw, &'a LawSeries)> {
        if self.ends() {
            return None;
        }
        Some((one.law.as_ref()?, &self.of_speed.as_ref()?.series))
    }

    /// Goes on with another piece of a table.
    pub(super) fn take_piece(&mut self, piece: usize) {
        self.of_speed.iter_mut().for_each(|of_speed| of_speed.series.piece = piece);
    }

    /// t, c and t c of order k from w.
    fn follow(&mut self, k: usize, lower: &Lower) {
        let [a, b] = &self.slip;
        self.ratio[k] = if k == 0 { 0.0 } else { (b[k] - lower.turned[0]) / a[0] };
        self.root(k, lower);
        self.across[k] = lower.ratio + self.ratio[k];
    }

    /// `1 + t^2` and c of order k, which t of this order does not change.
    fn root(&mut self, k: usize, lower: &Lower) {
        if k == 0 {
            (self.square[0], self.along[0]) = (1.0, 1.0);
            return;
        }
        self.square[k] = lower.turned[1];
        // `k c_k = sum (i / 2 - k) (1 + t^2)_i c_{k-i}`
        let [by_order, root] = lower.root;
        self.along[k] = 0.5 * by_order / k as f64 - root - 0.5 * self.square[k];
    }

    /// The same from the balance of forces, `(k + 1) / h M w_{k+1} = R_k - mu N e_k` with `w_{k+1} = (a, b)_{k+1-p}`.
    fn balance(
        &mut self,
        one: &PlaneContact,
        k: usize,
        (power, lower): (usize, &Lower),
        reaction: [f64; 2],
        width: f64,
    ) {
        let [of_along, of_across, of_both] = one.masses(self.direction);
        let [mut along, mut across] = PlaneContact::turned(self.direction, reaction);
        let rate = (k + 1) as f64 / width;
        let limit = self.limit[0];
        self.ratio[k] = 0.0;
        self.root(k, lower);
        let pressed = self.pressed(k, lower);
        (along, across) = (along - pressed[0], across - pressed[1]);
        // The known part of t c.
        let known = lower.ratio;
        let forward = along - limit * self.along[k];
        let shifted =
            |of: &[f64; COEFFICIENTS], j: usize| of.get(j + power).copied().unwrap_or(0.0);
        if power == 1 {
            // b_k = a_0 t_k + sum t_j a_{k-j}; a_k and b_k are unknown.
            let first = match k {
                0 => forward / (rate * of_along),
                _ => self.slip[0][1],
            };
            let turned: f64 = (1..k).map(|j| self.ratio[j] * shifted(&self.slip[0], k - j)).sum();
            let stiff = rate * of_across + limit / first;
            let right = across - limit * (known - turned / first);
            let determinant = rate * of_along * stiff - (rate * of_both) * (rate * of_both);
            let b = (rate * of_along * right - rate * of_both * forward) / determinant;
            self.ratio[k] = if k == 0 { 0.0 } else { (b - turned) / first };
        } else if k > 0 {
            // w_{k+1}, of which b is known from t and lower orders of a, and a from the balance along e_0.
            let j = k - 1;
            let turned: f64 = (1..j).map(|i| self.ratio[i] * shifted(&self.slip[0], j - i)).sum();
            let first = match j {
                0 => forward / (rate * of_along),
                _ => self.slip[0][2],
            };
            let b = if j == 0 { 0.0 } else { turned + self.ratio[j] * first };
            let a = (forward / rate - of_both * b) / of_along;
            let e = (across - rate * (of_across * b + of_both * a)) / limit;
            self.ratio[k] = e - known;
        }
        self.across[k] = known + self.ratio[k];
    }

    fn force(&self, k: usize, lower: &Lower) -> [f64; 2] {
        let [along, across] = self.pressed(k, lower);
        let along = self.limit[0] * self.along[k] + along;
        let across = self.limit[0] * self.across[k] + across;
        PlaneContact::turned_back(self.direction, [-along, -across])
    }

    /// The part of the panel on which no order of the direction is large.
    pub(super) fn part(&self) -> f64 {
        let order = |k: usize| self.along[k].abs().max(self.across[k].abs());
        let far = (1..COEFFICIENTS).find(|&k| !(order(k) <= WIDE));
        far.map_or(1.0, |k| if order(k).is_finite() { order(k).powf(-1.0 / k as f64) } else { 0.1 })
    }

    /// The part of the panel on which the slip along e_0 is known to keep about a tenth of what it begins with. What `lowest` takes from
    /// that is convex in the part of the panel, so that Newton's steps come from above.
    pub(super) fn part_that_slips(&self) -> f64 {
        let power = match self.course {
            Course::Slips | Course::Follows => 0,
            Course::Begins(power) => self.power(power),
            Course::Ends(_) => return 1.0,
        };
        let a = &self.slip[0][power..];
        let [most, enough] = [1.0 - KEEPS, 1.0 - 0.5 * KEEPS].map(|lost| lost * a[0]);
        let mut part = 1.0;
        for _ in 0..NEWTON {
            let (mut lost, mut slope, mut scaled) = (0.0, 0.0, 1.0);
            for (k, c) in a.iter().enumerate().skip(1) {
                slope += k as f64 * c.min(0.0) * scaled;
                scaled *= part;
                lost += c.min(0.0) * scaled;
            }
            if !(lost < -enough && a[0] > 0.0) {
                break;
            }
            part += (lost + most) / -slope;
        }
        part
    }

    /// The time after the panel in which the slip along e_0 would end at the rate with which the panel ends, in widths of it.
    pub(super) fn left_after(&self) -> f64 {
        let a = &self.slip[0];
        let rate: f64 = a.iter().enumerate().map(|(k, c)| k as f64 * c).sum();
        let end: f64 = a.iter().sum();
        match self.ends() {
            false if rate < 0.0 && end > 0.0 => end / -rate,
            _ => f64::INFINITY,
        }
    }

    pub(super) fn shorten(&mut self, powers: &[f64; ORDERS]) {
        let [a, b] = &mut self.slip;
        let turning = [&mut self.ratio, &mut self.square, &mut self.along, &mut self.across];
        for of in turning.into_iter().chain([a, b, &mut self.pull, &mut self.limit]) {
            scale(of, powers);
        }
        if let Some(of_speed) = &mut self.of_speed {
            let OfSpeed { series, factors: [left, right], at_rest, turned } = &mut **of_speed;
            series.shorten(powers);
            [left, right, at_rest, turned].into_iter().for_each(|of| scale(of, powers));
        }
        self.beyond *= powers[COEFFICIENTS];
    }

    /// Bounds of the error of the friction force.
    #[inline(always)]
    pub(super) fn error(&self, one: &PlaneContact, panel: &PanelSizes) -> PlaneBound {
        let PanelSizes { units, width, of_limit, limit_norm, .. } = *panel;
        let limit = size(&self.limit);
        let largest = size(&self.along) + size(&self.across);
        let product = beyond(&self.limit, &self.along, COEFFICIENTS)
            + beyond(&self.limit, &self.across, COEFFICIENTS);
        let OfDirection { cut, round, force, defect, apart } =
            self.error_of_direction(one, [limit, units], width);
        let of_force = UNIT * units * limit * largest;
        let ends = self.ends();
        let [of_cut, of_round, growth] = match (&self.of_speed, &one.law) {
            (Some(of_speed), Some(law)) if !ends => {
                self.error_of_law(one, (law, of_speed), [cut, round], panel)
            }
            _ => [of_limit[0], of_limit[1], limit_norm],
        };
        // What `mu N` of higher orders has in the last one, which is not integrated.
        let changes = |of: &[f64; COEFFICIENTS]| {
            (convolved(&self.limit, of, DEGREE) - self.limit[0] * of[DEGREE]).abs()
        };
        let last = if ends { 0.0 } else { changes(&self.along) + changes(&self.across) };
        // What has no bound may be no number.
        let bounded = |bound: f64| if bound.is_nan() { f64::INFINITY } else { bound };
        PlaneBound {
            cut: bounded(limit * cut + force + product + last + of_cut * largest),
            round: bounded(limit * round + defect + of_force + of_round * largest),
            apart,
            growth: bounded(growth),
        }
    }

    /// Errors of `mu N` by truncation and by rounding where mu depends on the slip speed, with those of the direction, and the change of
    /// the friction force per norm of the state.
    fn error_of_law(
        &self,
        one: &PlaneContact,
        (law, of_speed): (&FrictionLaw, &OfSpeed),
        [cut, round]: [f64; 2],
        &PanelSizes { units, shortenings, of_limit, limit_norm, radius, .. }: &PanelSizes,
    ) -> [f64; 3] {
        let OfSpeed { series, at_rest, turned, .. } = of_speed;
        let friction = law.value(0.0);
        let [a, b] = self.slip.each_ref().map(size);
        let [along, across] = [size(&self.along), size(&self.across)];
        // Of r = w . e.
        let mut off = [(a + b) * cut, (a + b) * round + UNIT * units * (a * along + b * across)];
        match self.course {
            Course::Follows => off[1] += apart(turned, &self.turned_from_before()),
            _ => {
                off[0] += beyond(&self.slip[0], &self.along, COEFFICIENTS)
                    + beyond(&self.slip[1], &self.across, COEFFICIENTS);
            }
        }
        let wide = radius * one.speed_norm + off[0] + off[1];
        let bounds = series.bounds(law, wide, shortenings, &of_speed.sums());
        let ratio = size(&of_speed.ratio(friction));
        let pressed = size(at_rest) / friction;
        let of = |of_law: f64, off: f64| (of_law + bounds.slope() * off) * pressed;
        let product = beyond(&series.excess, at_rest, COEFFICIENTS) / friction;
        let terms = UNIT * units * ratio * size(at_rest);
        let largest = ratio + bounds.slope() * wide / friction;
        // How fast friction falls with the slip speed, or is below what any rising one is.
        let mut least = series.excess;
        least[0] += friction;
        let least = lowest(&least) - bounds.slope() * wide - bounds.truncation - bounds.rounding;
        let slowest = lowest(&series.slip) - wide;
        let below = match least < 0.0 {
            true if slowest > 0.0 => -least / slowest,
            true => f64::INFINITY,
            false => 0.0,
        };
        let least_slope = match law {
            // What is off may be on another piece.
            FrictionLaw::Tabulated(_) => bounds.slopes.low,
            _ => series.least_slope(law, wide),
        };
        let falls = (FALLS * -least_slope).max(below).max(0.0);
        let growth = largest * limit_norm
            + falls * (pressed + radius * limit_norm / friction) * one.speed_norm;
        [
            of_limit[0] * largest + product + of(bounds.truncation, off[0]),
            of_limit[1] * largest + terms + of(bounds.rounding, off[1]),
            growth,
        ]
    }

    /// Errors of the direction, and of the force beside what follows from them.
    #[inline(always)]
    fn error_of_direction(
        &self,
        one: &PlaneContact,
        [limit, units]: [f64; 2],
        width: f64,
    ) -> OfDirection {
        let power = match self.course {
            Course::Slips => 0,
            Course::Begins(power) => self.power(power),
            Course::Follows => return self.error_of_following(one, units, width),
            // R is constant to rounding.
            Course::Ends(force) => {
                let defect = UNIT * units * force[0].hypot(force[1]);
                return OfDirection { defect, ..OfDirection::default() };
            }
        };
        let part = |of: &[f64; COEFFICIENTS]| {
            let mut part = [0.0; COEFFICIENTS];
            part[..COEFFICIENTS - power].copy_from_slice(&of[power..]);
            part
        };
        let [a, b] = [part(&self.slip[0]), part(&self.slip[1])];
        let least = lowest(&a);
        if !(least > 0.0) {
            return OfDirection { cut: f64::INFINITY, ..OfDirection::default() };
        }
        let first = COEFFICIENTS - power;
        // Where w shrinks, its terms cancel.
        let of_ratio = left_out(&self.ratio, &a, first) / least;
        // c^2 (1 + t^2) - 1
        let both = product(&self.along, &self.along);
        let of_square = beyond(&self.ratio, &self.ratio, COEFFICIENTS);
        let [sized, squared] = [size(&both), size(&self.square)];
        let root = beyond(&both, &self.square, COEFFICIENTS)
            + beyond(&self.along, &self.along, COEFFICIENTS) * squared
            + of_square * sized;
        let of_product = beyond(&self.ratio, &self.along, COEFFICIENTS);
        let apart = self.slip.iter().flat_map(|of| &of[..power]).map(|c| c.abs()).sum();
        let terms = (size(&self.ratio) * size(&a) + size(&b)) / least
            + sized * squared
            + size(&self.ratio) * size(&self.along);
        OfDirection {
            cut: of_ratio + root + of_product,
            round: UNIT * units * terms,
            force: limit * self.last_of_direction(),
            defect: 0.0,
            apart,
        }
    }

    /// The power of time with which slip begins, at least the one given: higher where the forces on the contact are at its limit for more
    /// than an instant, as at a start from rest.
    fn power(&self, least: usize) -> usize {
        let [a, _] = &self.slip;
        let vanishes = VANISHES * size(a);
        let found = (least..=MOST).find(|&k| a[k].abs() > vanishes);
        found.unwrap_or(least)
    }

    /// The last order of the direction, which is not integrated.
    fn last_of_direction(&self) -> f64 {
        self.along[DEGREE].abs() + self.across[DEGREE].abs()
    }

    /// The same where the direction follows: `a (1, t)` obeys the equation but for the defect of the balance across e_0, and w of the
    /// series is near it.
    fn error_of_following(&self, one: &PlaneContact, units: f64, width: f64) -> OfDirection {
        let [a, b] = &self.slip;
        if !(lowest(a) > 0.0 && self.along[0] > 0.5) {
            return OfDirection { cut: f64::INFINITY, ..OfDirection::default() };
        }
        let [_, of_across, _] = one.masses(self.direction);
        let (mut defect, mut apart) = (0.0, 0.0);
        for k in 0..COEFFICIENTS {
            let moved = convolved(&self.ratio, a, k);
            apart += (b[k] - moved).abs();
            if k > 0 {
                let force = self.taken_from_before(one, k - 1, width);
                defect += (force - self.pull[k - 1]).abs();
            }
        }
        let rate = 2.0 * COEFFICIENTS as f64 / width;
        let left_out = of_across * rate * beyond(&self.ratio, a, COEFFICIENTS);
        let circle = beyond(&self.along, &self.along, COEFFICIENTS)
            + beyond(&self.across, &self.across, COEFFICIENTS)
            + beyond(&self.ratio, &self.along, COEFFICIENTS);
        let sizes = [&self.along, &self.across, &self.ratio].map(size);
        let terms = sizes[0] * (sizes[0] + sizes[2]) + sizes[1] * sizes[1];
        OfDirection {
            cut: circle + self.last_of_direction(),
            round: UNIT * units * terms,
            force: left_out,
            defect,
            apart,
        }
    }

    /// The time until slip ends where that is so short that the forces on the contact are constant, and whether it is slower than
    /// velocities are resolved; the next panel then ends with it.
    pub(super) fn end(
        &mut self,
        one: &PlaneContact,
        [width, panel]: [f64; 2],
        rate: f64,
        [constant, unresolved]: [f64; 2],
    ) -> Option<(f64, bool)> {
        if self.course != Course::Slips {
            return None;
        }
        let r = self.slip[0][0];
        let [m, n] = one.mass;
        let limit = self.limit[0];
        let reaction = self.reaction;
        let force = reaction[0].hypot(reaction[1]);
        let along = dot(reaction, self.direction);
        let (time, constant) = if force < limit {
            match m == n {
                true => {
                    let rate = (limit - force) * (limit + force);
                    // What R changes counts beside `mu N - |R|`.
                    let excess = (limit - force) / limit;
                    (m * r * (limit + along) / rate, constant * excess.sqrt())
                }
                false => {
                    let energy = dot(one.mass, self.direction.map(|e| e * e)).sqrt() * r;
                    (energy * m.max(n).sqrt() / (limit - force), NO_TIME)
                }
            }
        } else {
            (r * m.max(n) / (limit + force), 0.0)
        };
        self.left = if force < limit { time } else { f64::INFINITY };
        if along > limit {
            // It speeds up, however slow it is.
            return None;
        }
        // Relative to what it is, N may change faster than the motion.
        let rate = rate.max((self.limit[1] / (panel * limit)).abs());
        let rests = r <= unresolved * one.slip_norm;
        if !((rests || time * rate <= constant) && time < width) {
            return None;
        }
        let w = self.direction.map(|e| e * r);
        self.course = Course::Ends([0, 1].map(|i| -reaction[i] - one.mass[i] * w[i] / time));
        Some((time, rests))
    }
}

/// Those that slip in a plane, order by order.
pub(super) struct Planes<'a> {
    pub contacts: &'a [PlaneContact],
    pub series: &'a mut [PlaneSeries],
}

impl Planes<'_> {
    /// Adds the friction of order k to the loads, from which its forces R follow, and which hold the `forces` of laws.
    #[inline(always)]
    pub fn push<S: Lanes>(
        &mut self,
        simd: S,
        (scene, taylor): (&Scene, &TaylorMotion),
        k: usize,
        (load, force): (&mut [f64], impl Fn(usize) -> f64),
    ) {
        for (one, series) in self.contacts.iter().zip(&mut *self.series) {
            let w = one.coordinates.map(|row| taylor.rate_of(row, k));
            let reaction = match series.needs_reaction(k) {
                true => one.coordinates.map(|row| load[row] + taylor.load_of(scene, row, k)),
                false => [0.0; 2],
            };
            let limit = taylor.coefficient(&one.limit, k) + one.pressing(&force);
            let of_order = (limit, [w, reaction]);
            let force = series.extend(simd, one, k, of_order, taylor.width);
            one.coordinates.iter().zip(force).for_each(|(&row, part)| load[row] += part);
        }
    }
}

/// How the friction in a plane changes along infinitesimal neighbours of a motion, order by order. With
/// `dt = (db - t da) / (s^p a)`, `de = c^3 (-t, 1) dt`, and `dT = -mu dN e - mu N de`.
#[derive(Debug)]
pub(super) struct PlaneNeighbour {
    /// `d (mu N)`, `mu(0) dN`, and the change of r, or what is known of that besides dw along e_0 where the direction follows.
    limit: [Side; COEFFICIENTS],
    at_rest: [Side; COEFFICIENTS],
    speed: [Side; COEFFICIENTS],
    slip: [[Side; COEFFICIENTS]; 2],
    ratio: [Side; COEFFICIENTS],
    /// The change of the force that accelerates slip across e_0, where the direction follows from the balance.
    pull: [Side; COEFFICIENTS],
}

/// What all neighbours of a panel need of its series: `mu N c^3` and `mu N t c^3`, and where mu depends on the slip speed
/// `mu / mu(0)` and `mu' N`.
pub(super) struct PlaneSlopes {
    cube: [f64; COEFFICIENTS],
    turned: [f64; COEFFICIENTS],
    by_speed: Option<[[f64; COEFFICIENTS]; 2]>,
}

impl PlaneSeries {
    /// How the time that is left of its slip grows with w, where the panel is the last one. What turns w has come to rest, so that w
    /// falls along itself at a rate a, `M^-1 (R - mu N e) = -a e`. The time T left obeys `dT/dw . M^-1 (R - mu N w / |w|) = -1`
    /// and is proportional to |w|, of which follows `dT/dw = M e / (a e . M e)`.
    pub(super) fn time_left_by_slip(&self, one: &PlaneContact) -> Option<[f64; 2]> {
        if !self.ends() {
            return None;
        }
        let (e, [m, n]) = (self.direction, one.mass);
        if m == n {
            return Some(e.map(|e| e * self.left / self.slip[0][0]));
        }
        let force = [0, 1].map(|i| self.limit[0] * e[i] - self.reaction[i]);
        let rate = e[0] * force[0] / m + e[1] * force[1] / n;
        let heavy = [m * e[0], n * e[1]];
        Some(heavy.map(|part| part / (rate * dot(heavy, e))))
    }

    /// Whether slip ends at about a time after the start of the panel, s.
    pub(super) fn ends_about(&self, time: f64, tolerance: f64) -> bool {
        (self.left - time).abs() <= tolerance
    }

    pub(super) fn slopes(&self, one: &PlaneContact) -> PlaneSlopes {
        let square = product(&self.along, &self.along);
        let cube = product(&product(&square, &self.along), &self.limit);
        let of_law = |(law, of_speed): (&FrictionLaw, &OfSpeed)| {
            let friction = law.value(0.0);
            let slopes = of_speed.series.slopes(law).map(|slope| slope / friction);
            [of_speed.ratio(friction), product(&slopes, &of_speed.at_rest)]
        };
        let by_speed = one.law.as_ref().zip(self.of_speed.as_deref()).map(of_law);
        PlaneSlopes { turned: product(&self.ratio, &cube), cube, by_speed }
    }

    /// The direction along which columns in the frame of e_0 are turned back.
    fn back(&self) -> [f64; 2] {
        let [x, y] = self.direction;
        [x, -y]
    }

    /// What a later order of dw across e_0 has of known orders of that along e_0, and of dt.
    #[inline(always)]
    fn known_across<S: Lanes>(
        &self,
        simd: S,
        along: &[Side],
        ratio: &[Side],
        order: usize,
    ) -> Side {
        let by_along = convolved_with(simd, &self.ratio, along, order);
        by_along.add_scaled(simd, 1.0, &convolved_with(simd, &self.slip[0], ratio, order))
    }

    /// The change of the friction force of order k, from those of `mu N`, of w of that order and of the forces R.
    #[inline(always)]
    pub(super) fn carry<S: Lanes>(
        &self,
        simd: S,
        one: &PlaneContact,
        slopes: &PlaneSlopes,
        neighbour: &mut PlaneNeighbour,
        (k, width): (usize, f64),
        (limit, slip, reaction): (Side, [Side; 2], [Side; 2]),
    ) -> [Side; 2] {
        let PlaneNeighbour { limit: pressed, at_rest, speed, slip: own, ratio, pull } = neighbour;
        let [a, _] = &self.slip;
        let follows = self.course == Course::Follows;
        [own[0][k], own[1][k]] = turned(simd, self.direction, slip.each_ref());
        pressed[k] = limit;
        if let Some([of_law, slope]) = &slopes.by_speed {
            at_rest[k] = limit;
            let of_normal = convolved_with(simd, of_law, &at_rest[..=k], k);
            let faster: [Side; COEFFICIENTS];
            let all = match follows {
                true => {
                    faster = std::array::from_fn(|j| match j <= k {
                        true => own[0][j].add_scaled(simd, 1.0, &speed[j]),
                        false => Side::ZERO,
                    });
                    &faster
                }
                false => {
                    speed[k] = self.faster(simd, [&own[0], &own[1]], k);
                    &*speed
                }
            };
            let of_speed = convolved_with(simd, slope, &all[..=k], k);
            pressed[k] = of_normal.add_scaled(simd, 1.0, &of_speed);
        }
        let pressed_along = convolved_with(simd, &self.along, &pressed[..=k], k);
        let pressed_across = convolved_with(simd, &self.across, &pressed[..=k], k);
        let power = match self.course {
            Course::Ends(_) => return [Side::ZERO; 2],
            Course::Slips | Course::Follows => 0,
            Course::Begins(power) => power,
        };
        let along_known = convolved_with(simd, &slopes.turned, &ratio[..k], k);
        let across_known = convolved_with(simd, &slopes.cube, &ratio[..k], k);
        let [of_along, of_across, of_both] = one.masses(self.direction);
        let rate = (k + 1) as f64 / width;
        let limit = self.limit[0];
        let [force_along, force_across] = turned(simd, self.direction, reaction.each_ref());
        let force_across = force_across.add_scaled(simd, -1.0, &pressed_across);
        let forward =
            force_along.add_scaled(simd, -1.0, &pressed_along).add_scaled(simd, 1.0, &along_known);
        ratio[k] = match power {
            0 if follows => {
                // As in the balance of the motion, two terms come from the series before.
                let turned = self.known_across(simd, &own[0][..=k], &ratio[..k], k + 1);
                force_across
                    .add_scaled(simd, -1.0, &pull[k])
                    .add_scaled(simd, -1.0, &across_known)
                    .add_scaled(simd, -rate * of_across, &turned)
                    .scaled(simd, 1.0 / (slopes.cube[0] + rate * of_across * a[1]))
            }
            0 => own[1][k]
                .add_scaled(simd, -1.0, &convolved_with(simd, &self.ratio, &own[0][..=k], k))
                .add_scaled(simd, -1.0, &convolved_with(simd, a, &ratio[..k], k))
                .scaled(simd, 1.0 / a[0]),
            1 => {
                let first = a[1];
                let known = self.known_across(simd, &own[0][..=k], &ratio[..k], k + 1);
                let stiff = rate * of_across + limit / first;
                let right = force_across.add_scaled(simd, -1.0, &across_known).add_scaled(
                    simd,
                    limit / first,
                    &known,
                );
                let determinant = rate * of_along * stiff - (rate * of_both) * (rate * of_both);
                let by = [rate * of_along / determinant, -rate * of_both / determinant];
                Side::combined(simd, by, [&right, &forward])
                    .add_scaled(simd, -1.0, &known)
                    .scaled(simd, 1.0 / first)
            }
            _ => {
                let next = self.known_across(simd, &own[0][..=k], &ratio[..k], k + 1);
                let by = [1.0 / (rate * of_along), -of_both / of_along];
                let faster = Side::combined(simd, by, [&forward, &next]);
                force_across
                    .add_scaled(simd, -rate * of_across, &next)
                    .add_scaled(simd, -rate * of_both, &faster)
                    .add_scaled(simd, -1.0, &across_known)
                    .scaled(simd, 1.0 / limit)
            }
        };
        let along = along_known.add_scaled(simd, slopes.turned[0], &ratio[k]).add_scaled(
            simd,
            -1.0,
            &pressed_along,
        );
        let across = Side::ZERO
            .add_scaled(simd, -1.0, &across_known)
            .add_scaled(simd, -slopes.cube[0], &ratio[k])
            .add_scaled(simd, -1.0, &pressed_across);
        turned(simd, self.back(), [&along, &across])
    }

    /// `dr = dw . e` of order k.
    #[inline(always)]
    fn faster<S: Lanes>(&self, simd: S, [along, across]: [&[Side]; 2], k: usize) -> Side {
        let of_across = convolved_with(simd, &self.across, &across[..=k], k);
        convolved_with(simd, &self.along, &along[..=k], k).add_scaled(simd, 1.0, &of_across)
    }

    /// dw, times a width, where that across e_0 has relaxed: what it was leaves nothing.
    #[inline(always)]
    pub(super) fn relaxed<S: Lanes>(
        &self,
        simd: S,
        own: &PlaneNeighbour,
        slip: [Side; 2],
        width: f64,
    ) -> [Side; 2] {
        if !self.follows() {
            return slip;
        }
        let [along, _] = turned(simd, self.direction, slip.each_ref());
        let by = [self.ratio[0], width * self.slip[0][0]];
        let across = Side::combined(simd, by, [&along, &own.ratio[0]]);
        turned(simd, self.back(), [&along, &across])
    }

    /// Takes the change of the force across e_0 from `dw = da (1, t) + a (0, dt)`, where the direction follows; how much it was off,
    /// relative to its size, at most.
    #[inline(always)]
    pub(super) fn improve_neighbour<S: Lanes>(
        &self,
        simd: S,
        one: &PlaneContact,
        slopes: &PlaneSlopes,
        neighbour: &mut PlaneNeighbour,
        width: f64,
    ) -> f64 {
        if !self.follows() {
            return 0.0;
        }
        let PlaneNeighbour { slip, ratio, pull, speed, .. } = neighbour;
        let [_, of_across, of_both] = one.masses(self.direction);
        let mut sizes = [(0.0, 0.0); COLUMNS];
        if let Some([_, slope]) = &slopes.by_speed {
            let across: [Side; COEFFICIENTS] =
                std::array::from_fn(|k| self.known_across(simd, &slip[0][..=k], &ratio[..=k], k));
            for k in 0..COEFFICIENTS {
                let faster = self.faster(simd, [&slip[0], &across], k);
                let turned = faster.add_scaled(simd, -1.0, &slip[0][k]);
                let columns = turned.columns().iter().zip(speed[k].columns());
                for ((change, _), (now, before)) in sizes.iter_mut().zip(columns) {
                    *change += (slope[0] * (now - before)).abs();
                }
                speed[k] = turned;
            }
        }
        for k in 0..DEGREE {
            let rate = (k + 1) as f64 / width;
            let by = [of_across * self.ratio[0] + of_both, of_across * self.slip[0][0]];
            let of_next = [&slip[0][k + 1], &ratio[k + 1]];
            let force = Side::combined(simd, by.map(|factor| rate * factor), of_next);
            let columns = force.columns().iter().zip(pull[k].columns()).zip(ratio[k].columns());
            for ((change, size), ((force, pull), ratio)) in sizes.iter_mut().zip(columns) {
                *change += (force - pull).abs();
                *size += self.limit[0] * ratio.abs() + force.abs();
            }
            pull[k] = force;
        }
        let off = |&(change, size): &(f64, f64)| if size > 0.0 { change / size } else { 0.0 };
        sizes.iter().map(off).fold(0.0, f64::max)
    }
}

impl Default for PlaneNeighbour {
    fn default() -> Self {
        let none = [Side::ZERO; COEFFICIENTS];
        let slip = [none; 2];
        Self { limit: none, at_rest: none, speed: none, slip, ratio: none, pull: none }
    }
}
