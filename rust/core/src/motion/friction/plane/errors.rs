//! Bounds of the error of the friction force in a plane on a panel.

use crate::motion::friction::plane::contact::PlaneContact;
use crate::motion::friction::plane::series::{Course, OfSpeed, PlaneSeries, convolved};
use crate::motion::friction::series::coefficients::{UNIT, lowest, size};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, crosswise};
use crate::scene::friction::decay::product;
use crate::scene::friction::law::FrictionLaw;

/// A bound of the slope of a law from below has this rounding.
const FALLS: f64 = 1.0 + 4e-9;

/// Bounds of the error of a friction force by truncation and by rounding, N, of w beside it, and of the change of the force per norm
/// of the state that adds energy to a difference of two motions.
pub(crate) struct PlaneBound {
    pub cut: f64,
    pub round: f64,
    pub apart: f64,
    pub growth: f64,
}

/// What the bound of a panel knows besides: units of rounding of a product, times that the panel was shortened, its width, the errors of
/// `mu(0) N` by truncation and by rounding, its change per norm of the state, and the radius of the neighbourhood in which slopes count.
pub(crate) struct PanelSizes {
    pub units: f64,
    pub shortenings: usize,
    pub width: f64,
    pub of_limit: [f64; 2],
    pub limit_norm: f64,
    pub radius: f64,
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
pub(super) fn apart(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}

impl PlaneSeries {
    /// Bounds of the error of the friction force.
    #[inline(always)]
    pub(crate) fn error(&self, one: &PlaneContact, panel: &PanelSizes) -> PlaneBound {
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
}
