//! How wide a panel of slip in a plane is, whether the direction follows from its balance there, and the last panel of a slip.

use crate::motion::friction::plane::contact::{PlaneContact, dot};
use crate::motion::friction::plane::errors::apart;
use crate::motion::friction::plane::series::{Course, PlaneSeries};
use crate::motion::friction::series::coefficients::size;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::scene::friction::decay::product;

/// Time to the end of slip, times the rate of the motion, from which on R is constant: its square is rounding.
pub(crate) const CONSTANT: f64 = 1e-8;

/// The same where masses differ, and the time is a bound, and for neighbours of a motion, of which the first order counts.
pub(crate) const NO_TIME: f64 = 8.0 * f64::EPSILON;

/// Times that the direction of slip relaxes over a panel from which on it follows from a balance, and the part of what is left of a
/// slip that such a panel has at most; and times that it relaxes over a panel that a series in time follows.
pub(crate) const STIFF: f64 = 40.0;
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

impl PlaneSeries {
    /// The widest panel up to a width, a power of two of the `full` one, on which directions may follow: on which little of this slip
    /// ends; of one that has not come to its balance, on which it relaxes no more than a series can follow.
    pub(crate) fn widest(&self, one: &PlaneContact, [width, full]: [f64; 2], start: f64) -> f64 {
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
    pub(crate) fn relaxation(&self, one: &PlaneContact) -> f64 {
        self.limit[0] / (one.mass[0].max(one.mass[1]) * self.slip[0][0])
    }

    /// Lets the direction follow from the balance of forces on a panel over which it relaxes many times; whether it does.
    pub(crate) fn let_follow(&mut self, one: &PlaneContact, width: f64, start: f64) -> bool {
        if matches!(self.course, Course::Slips | Course::Follows) {
            let stiff = self.relaxation(one) * width > STIFF && start >= self.relaxed_at;
            self.course = if stiff { Course::Follows } else { Course::Slips };
            self.pull = [0.0; COEFFICIENTS];
            self.of_speed.iter_mut().for_each(|of_speed| of_speed.turned = [0.0; COEFFICIENTS]);
        }
        self.follows()
    }

    /// Takes the rest of the force across e_0 from `w = a (1, t)`; its change, and how far w begins from there.
    pub(crate) fn improve(&mut self, one: &PlaneContact, width: f64) -> [f64; 2] {
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

    pub(crate) fn follows(&self) -> bool {
        self.course == Course::Follows
    }

    /// `r - a` of `w = a (1, t)`, where the direction follows.
    pub(super) fn turned_from_before(&self) -> [f64; COEFFICIENTS] {
        if self.of_speed.is_none() {
            return [0.0; COEFFICIENTS];
        }
        let a = &self.slip[0];
        let across = product(&self.ratio, a);
        let speed = product(a, &self.along);
        let turned = product(&across, &self.across);
        std::array::from_fn(|k| speed[k] + turned[k] - a[k])
    }

    /// The part of the panel on which no order of the direction is large.
    pub(crate) fn part(&self) -> f64 {
        let order = |k: usize| self.along[k].abs().max(self.across[k].abs());
        let far = (1..COEFFICIENTS).find(|&k| !(order(k) <= WIDE));
        far.map_or(1.0, |k| if order(k).is_finite() { order(k).powf(-1.0 / k as f64) } else { 0.1 })
    }

    /// The part of the panel on which the slip along e_0 is known to keep about a tenth of what it begins with. What `lowest` takes from
    /// that is convex in the part of the panel, so that Newton's steps come from above.
    pub(crate) fn part_that_slips(&self) -> f64 {
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

    /// The power of time with which slip begins, at least the one given: higher where the forces on the contact are at its limit for more
    /// than an instant, as at a start from rest.
    pub(super) fn power(&self, least: usize) -> usize {
        let [a, _] = &self.slip;
        let vanishes = VANISHES * size(a);
        let found = (least..=MOST).find(|&k| a[k].abs() > vanishes);
        found.unwrap_or(least)
    }

    /// The time after the panel in which the slip along e_0 would end at the rate with which the panel ends, in widths of it.
    pub(crate) fn left_after(&self) -> f64 {
        let a = &self.slip[0];
        let rate: f64 = a.iter().enumerate().map(|(k, c)| k as f64 * c).sum();
        let end: f64 = a.iter().sum();
        match self.ends() {
            false if rate < 0.0 && end > 0.0 => end / -rate,
            _ => f64::INFINITY,
        }
    }

    /// The time until slip ends where that is so short that the forces on the contact are constant, and whether it is slower than
    /// velocities are resolved; the next panel then ends with it.
    pub(crate) fn end(
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

    /// How the time that is left of its slip grows with w, where the panel is the last one. What turns w has come to rest, so that w
    /// falls along itself at a rate a, `M^-1 (R - mu N e) = -a e`. The time T left obeys `dT/dw . M^-1 (R - mu N w / |w|) = -1`
    /// and is proportional to |w|, of which follows `dT/dw = M e / (a e . M e)`.
    pub(crate) fn time_left_by_slip(&self, one: &PlaneContact) -> Option<[f64; 2]> {
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
    pub(crate) fn ends_about(&self, time: f64, tolerance: f64) -> bool {
        (self.left - time).abs() <= tolerance
    }
}
