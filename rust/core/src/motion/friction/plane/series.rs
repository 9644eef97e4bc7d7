//! Slip in a plane, its direction and its friction force as series, order by order.

use crate::contact::functional::Functional;
use crate::motion::friction::plane::contact::PlaneContact;
use crate::motion::friction::series::coefficients::{scale, size};
use crate::motion::friction::series::convolutions::{Convolutions, FactorSums};
use crate::motion::friction::series::law_series::LawSeries;
use crate::motion::taylor::motion::{ORDERS, TaylorMotion};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, crosswise};
use crate::numerics::simd::Lanes;
use crate::scene::friction::decay::terms_left_out;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// Difference of `|R|` and `mu N`, relative to that, below which slip begins without a drop of friction.
const EQUAL: f64 = 1e-9;

/// The slip of a contact along a panel, its direction and its friction force.
#[derive(Debug, Clone)]
pub(crate) struct PlaneSeries {
    /// `mu N`, at the origin at rest with the sum of the absolute values of its terms, and what displacements add in the order beyond.
    pub limit: [f64; COEFFICIENTS],
    pub at_origin: [f64; 2],
    pub beyond: f64,
    /// The time that is left of a slip whose forces are constant, s; infinite of one that they do not end.
    pub(super) left: f64,
    pub(super) course: Course,
    /// The time in the phase before which it has not come to the balance from which its direction follows, s.
    pub relaxed_at: f64,
    /// e_0
    pub(super) direction: [f64; 2],
    /// w of order k in the frame of e_0.
    pub(super) slip: [[f64; COEFFICIENTS]; 2],
    /// t, `1 + t^2`, c and t c.
    pub(super) ratio: [f64; COEFFICIENTS],
    pub(super) square: [f64; COEFFICIENTS],
    pub(super) along: [f64; COEFFICIENTS],
    pub(super) across: [f64; COEFFICIENTS],
    /// R of order 0 without friction.
    pub(super) reaction: [f64; 2],
    /// Where the direction follows: what the balance across e_0 took from the series before.
    pub(super) pull: [f64; COEFFICIENTS],
    pub(super) products: [Convolutions; 2],
    pub(super) of_speed: Option<Box<OfSpeed>>,
}

/// How the series of a panel is found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Course {
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

/// Friction over slip speed along a panel.
#[derive(Debug, Clone)]
pub(super) struct OfSpeed {
    /// `mu(r) - mu(0)` over r, with the factors of its product.
    pub(super) series: LawSeries,
    pub(super) factors: [[f64; COEFFICIENTS]; 2],
    /// `mu(0) N`
    pub(super) at_rest: [f64; COEFFICIENTS],
    /// `r - a`, where the direction follows: from the series before.
    pub(super) turned: [f64; COEFFICIENTS],
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
    pub(super) fn sums(&self) -> FactorSums {
        let [left, right] = &self.factors;
        FactorSums {
            left: [size(left), size(&self.series.excess)],
            right: [size(right), 0.0],
            left_out: [terms_left_out(left, right), 0.0],
        }
    }

    /// `mu / mu(0)`
    pub(super) fn ratio(&self, at_rest: f64) -> [f64; COEFFICIENTS] {
        let mut ratio = self.series.excess.map(|excess| excess / at_rest);
        ratio[0] += 1.0;
        ratio
    }
}

/// The coefficient of order k of a product.
#[inline(always)]
pub(super) fn convolved(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS], k: usize) -> f64 {
    crosswise(&a[..=k], &b[..=k])
}

impl PlaneSeries {
    /// Begins a phase at velocities, under a limit `mu(0) N` and with forces R on the contact; whether it rests.
    pub(crate) fn begin(
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
    pub(crate) fn go_on(&mut self) {
        self.course = Course::Slips;
    }

    /// Another slip ends before, or with it.
    pub(crate) fn end_later(&mut self) {
        if self.ends() {
            self.course = Course::Slips;
        }
    }

    /// Whether the forces R of order k on the contact matter: to slip that goes on, those of order 0, which tell when it ends.
    pub(crate) fn needs_reaction(&self, k: usize) -> bool {
        k == 0 || !matches!(self.course, Course::Slips | Course::Ends(_))
    }

    pub(crate) fn ends(&self) -> bool {
        matches!(self.course, Course::Ends(_))
    }

    pub(crate) fn begins(&self) -> bool {
        matches!(self.course, Course::Begins(_))
    }

    /// The friction force of order k, from `mu N` and w of that order and, where slip begins, from the forces R of that order.
    #[inline(always)]
    pub(crate) fn extend<S: Lanes>(
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
    pub(super) fn taken_from_before(&self, one: &PlaneContact, k: usize, width: f64) -> f64 {
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

    /// Where friction depends on the slip speed: its law, and that along the panel; not on the last panel of a slip, whose force is
    /// constant.
    pub(crate) fn law_of_speed<'a>(
        &'a self,
        one: &'a PlaneContact,
    ) -> Option<(&'a FrictionLaw, &'a LawSeries)> {
        if self.ends() {
            return None;
        }
        Some((one.law.as_ref()?, &self.of_speed.as_ref()?.series))
    }

    /// Goes on with another piece of a table.
    pub(crate) fn take_piece(&mut self, piece: usize) {
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

    pub(crate) fn shorten(&mut self, powers: &[f64; ORDERS]) {
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
}

/// Those that slip in a plane, order by order.
pub(crate) struct Planes<'a> {
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
