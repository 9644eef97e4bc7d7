//! How the friction in a plane changes along infinitesimal neighbours of a motion.

use crate::motion::friction::motion::worse;
use crate::motion::friction::plane::contact::PlaneContact;
use crate::motion::friction::plane::series::{Course, OfSpeed, PlaneSeries};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{COLUMNS, Lanes, Side};
use crate::scene::friction::decay::product;
use crate::scene::friction::law::FrictionLaw;

/// How the friction in a plane changes along infinitesimal neighbours of a motion, order by order. With
/// `dt = (db - t da) / (s^p a)`, `de = c^3 (-t, 1) dt`, and `dT = -mu dN e - mu N de`.
#[derive(Debug)]
pub(crate) struct PlaneNeighbour {
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
pub(crate) struct PlaneSlopes {
    cube: [f64; COEFFICIENTS],
    turned: [f64; COEFFICIENTS],
    by_speed: Option<[[f64; COEFFICIENTS]; 2]>,
}

impl Default for PlaneNeighbour {
    fn default() -> Self {
        let none = [Side::ZERO; COEFFICIENTS];
        let slip = [none; 2];
        Self { limit: none, at_rest: none, speed: none, slip, ratio: none, pull: none }
    }
}

/// `sum_i a_{k-i} x_i`, over all of x.
#[inline(always)]
pub(crate) fn convolved_with<S: Lanes>(
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

impl PlaneSeries {
    pub(crate) fn slopes(&self, one: &PlaneContact) -> PlaneSlopes {
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
    pub(crate) fn carry<S: Lanes>(
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
    pub(crate) fn relaxed<S: Lanes>(
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

    /// How far across e_0 a neighbour with dw begins from its balance.
    pub(crate) fn across(&self, own: &PlaneNeighbour, column: usize, slip: [f64; 2]) -> f64 {
        let [x, y] = self.direction;
        let [along, across] = [x * slip[0] + y * slip[1], x * slip[1] - y * slip[0]];
        across - self.ratio[0] * along - self.slip[0][0] * own.ratio[0].columns()[column]
    }

    /// Takes the change of the force across e_0 from `dw = da (1, t) + a (0, dt)`, where the direction follows; how much it was off,
    /// relative to its size, at most.
    #[inline(always)]
    pub(crate) fn improve_neighbour<S: Lanes>(
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
        let off = |&(change, size): &(f64, f64)| if size == 0.0 { 0.0 } else { change / size };
        sizes.iter().map(off).fold(0.0, worse)
    }
}
