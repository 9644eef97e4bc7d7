//! Taylor series of a law of friction along a slip speed that is a polynomial, with a bound of their error.
//!
//! With `S = S_0 + S_1 s + ..` on [0, 1], the recurrences are those of
//!
//! ```text
//! e = exp(-S / v)      (k + 1) e_{k+1} = -sum_i (i + 1) S_{i+1} / v e_{k-i}        v e' = -S' e
//! g = 1 / (1 + S / v)  g_k = -g_0 sum_{i>0} S_i / v g_{k-i}                        (1 + S / v) g = 1
//! ```
//!
//! and of products for a table. The errors of the polynomials follow from the equations that they obey up to a known rest: with
//! `E' + S' E / v = R` the error `|E - e| <= max e / min e * integral |R|`, and with `(1 + S / v) G = 1 + R` it is
//! `|G - g| <= max |R| / min (1 + S / v)`. All sums are finite.

use crate::motion::friction::series::convolutions::FactorSums;
use crate::motion::taylor::motion::ORDERS;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::GROUP;
use crate::scene::friction::law::FrictionLaw;

/// One unit of rounding.
pub(crate) const UNIT: f64 = 0.5 * f64::EPSILON;

/// 1 / k
const INVERSE: [f64; COEFFICIENTS] = {
    let mut inverse = [0.0; COEFFICIENTS];
    let mut k = 1;
    while k < COEFFICIENTS {
        inverse[k] = 1.0 / k as f64;
        k += 1;
    }
    inverse
};

/// Slip speeds, as multiples of v, from which on e counts as zero: it is below 1e-260.
const FAR: f64 = 600.0;

/// Units of rounding of the coefficients of a product, relative to the sums of their terms' absolute values: those of the sum
/// itself, and per shortening of the panel three coefficients that are scaled, and at most DEGREE units between the rounded
/// powers of the factor, `p_j p_{k-j}` and `p_k`.
pub(crate) fn product_units(shortenings: usize) -> usize {
    DEGREE + 4 + shortenings * (DEGREE + 3)
}

/// Exponents from which on `e^x - 1` is less than half.
const NEAR: f64 = -0.6;

/// `mu(S) - mu(0)` along a panel.
#[derive(Debug, Clone, Default)]
pub(crate) struct LawSeries {
    /// S
    pub slip: [f64; COEFFICIENTS],
    /// e, g, or the quotient of the cubic of a table by its distance.
    inner: [f64; COEFFICIENTS],
    /// `mu(S) - mu(0)`
    pub excess: [f64; COEFFICIENTS],
    /// Piece of a table.
    pub piece: usize,
}

/// Bounds of `mu(S) - mu(0)` and its series on [0, 1].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LawBounds {
    /// Largest difference from its polynomial, by truncation and by rounding.
    pub truncation: f64,
    pub rounding: f64,
    /// Largest |d mu / dS| for S within the panel, and somewhat beyond.
    pub slope: f64,
}

impl LawSeries {
    /// The coefficients of order k, from that of S and the `middle` of the convolution of what it gave for the orders from 1 to
    /// k - 1. Gives that of `mu(S) - mu(0)`, and the two factors of this order.
    #[inline(always)]
    pub fn extend(&mut self, law: &FrictionLaw, k: usize, s: f64, middle: f64) -> (f64, [f64; 2]) {
        let Self { slip, inner, excess, piece } = self;
        slip[k] = s;
        // Products with S_k come last: all else is known when S_k is, and the next order waits for it.
        let (of_order, of_inner, left) = match law {
            FrictionLaw::Linear { slope, .. } => (slope * s, 0.0, 0.0),
            FrictionLaw::Stribeck { at_rest, kinetic, speed, viscous } => {
                let falling = at_rest - kinetic;
                if k == 0 {
                    let exponent = -s / speed;
                    let less = exponent.exp_m1();
                    let value = match exponent {
                        // Here the sum is as good as another exponential: two units.
                        NEAR..=0.0 => 1.0 + less,
                        _ if -exponent > FAR => 0.0,
                        _ => exponent.exp(),
                    };
                    (falling * less + viscous * s, value, 0.0)
                } else {
                    let part = INVERSE[k] / speed;
                    let value = s.mul_add(-(k as f64 * inner[0] * part), -(middle * part));
                    (falling.mul_add(value, viscous * s), value, k as f64 * s)
                }
            }
            FrictionLaw::Rational { at_rest, kinetic, speed } => {
                let falling = at_rest - kinetic;
                if k == 0 {
                    let value = 1.0 / (1.0 + s / speed);
                    (-falling * (s / speed) * value, value, 0.0)
                } else {
                    let part = inner[0] / speed;
                    let value = s.mul_add(-(inner[0] * part), -(middle * part));
                    (falling * value, value, s)
                }
            }
            FrictionLaw::Tabulated(table) => {
                let [a, b, c, d] = table.pieces[*piece];
                let knot = table.speeds[*piece];
                // S less the speed at which the piece begins.
                let from_knot = |j: usize| if j == 0 { slip[0] - knot } else { slip[j] };
                let (first, last) = (from_knot(0), from_knot(k));
                let square = if k == 0 { first * first } else { middle + 2.0 * first * last };
                inner[k] = if k == 0 { b } else { 0.0 } + c * last + d * square;
                let product: f64 = (0..=k).map(|j| from_knot(j) * inner[k - j]).sum();
                excess[k] = if k == 0 { a - law.value(0.0) } else { 0.0 } + product;
                return (excess[k], [last; 2]);
            }
        };
        (excess[k], inner[k]) = (of_order, of_inner);
        (of_order, [left, of_inner])
    }

    /// The factor of S_k in the coefficient of order k > 0, `mu'(S_0)`.
    pub fn slope(&self, law: &FrictionLaw) -> f64 {
        let Self { slip, inner, piece, .. } = self;
        match law {
            FrictionLaw::Linear { slope, .. } => *slope,
            FrictionLaw::Stribeck { at_rest, kinetic, speed, viscous } => {
                viscous - (at_rest - kinetic) / speed * inner[0]
            }
            FrictionLaw::Rational { at_rest, kinetic, speed } => {
                -(at_rest - kinetic) / speed * inner[0] * inner[0]
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[*piece];
                let x = slip[0] - table.speeds[*piece];
                b + x * (2.0 * c + 3.0 * x * d)
            }
        }
    }

    /// A bound from below of `mu'(S)` on the panel, also where S is off by `beyond`.
    pub fn least_slope(&self, law: &FrictionLaw, beyond: f64) -> f64 {
        let wide = self.range() + beyond;
        let (low, high) = (self.slip[0] - wide, self.slip[0] + wide);
        let least = match law {
            FrictionLaw::Linear { slope, .. } => *slope,
            // These slopes are monotone.
            FrictionLaw::Stribeck { .. } => law.slope(low).min(law.slope(high)),
            FrictionLaw::Rational { speed, .. } if low <= -speed => f64::NEG_INFINITY,
            FrictionLaw::Rational { .. } => law.slope(low).min(law.slope(high)),
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[self.piece];
                let slope = |x: f64| b + x * (2.0 * c + 3.0 * x * d);
                let [low, high] = [low, high].map(|speed| speed - table.speeds[self.piece]);
                let ends = slope(low).min(slope(high));
                let turn = -c / (3.0 * d);
                if d > 0.0 && low < turn && turn < high { ends.min(slope(turn)) } else { ends }
            }
        };
        least * (1.0 - 1e-9)
    }

    /// A distance from the polynomial of S in which Lipschitz bounds are taken where slip has no mass.
    pub fn tube(&self, law: &FrictionLaw) -> f64 {
        match law {
            FrictionLaw::Linear { .. } => f64::MAX,
            FrictionLaw::Stribeck { .. } | FrictionLaw::Rational { .. } => 5e-2 * self.reach(law),
            // The last piece is level, and slip without mass never is on it: no neighbourhood has a bound.
            FrictionLaw::Tabulated(table) => match table.speeds[self.piece..] {
                [low, high, ..] => 1e-3 * (high - low),
                _ => 0.0,
            },
        }
    }

    /// How far S may move from S_0 on a panel.
    pub fn reach(&self, law: &FrictionLaw) -> f64 {
        match law {
            // What the factors by which e grows and falls make of its bound stays below e^2.
            FrictionLaw::Stribeck { speed, .. } => speed + self.slip[0] / 3.0,
            // 1 + S / v keeps half of its value.
            FrictionLaw::Rational { speed, .. } => 0.5 * (speed + self.slip[0]),
            FrictionLaw::Linear { .. } | FrictionLaw::Tabulated(_) => f64::INFINITY,
        }
    }

    /// The change of S over which the law changes.
    pub fn resolution(&self, law: &FrictionLaw) -> f64 {
        match law {
            FrictionLaw::Tabulated(table) => {
                let widths = table.speeds.windows(2).map(|pair| pair[1] - pair[0]);
                widths.fold(f64::INFINITY, f64::min) + 0.5 * self.slip[0]
            }
            _ => self.reach(law),
        }
    }

    /// How far S moves from S_0, at most.
    #[inline(always)]
    pub fn range(&self) -> f64 {
        let mut moving = self.slip;
        moving[0] = 0.0;
        size(&moving)
    }

    /// Bounds on a panel that was shortened some times, the slope also where S is off by `beyond`.
    #[inline(always)]
    pub fn bounds(
        &self,
        law: &FrictionLaw,
        beyond: f64,
        shortenings: usize,
        sums: &FactorSums,
    ) -> LawBounds {
        let Self { slip, inner, piece, .. } = self;
        let ([factors, excess], [inners, _], [rest, _]) = (sums.left, sums.right, sums.left_out);
        let range = self.range();
        let wide = range + beyond;
        let product = product_units(shortenings) as f64;
        // Sums of at most three terms, whose scaling rounds both sides.
        let short = (3 + 2 * shortenings) as f64 * excess;
        match law {
            FrictionLaw::Linear { slope, .. } => {
                LawBounds { truncation: 0.0, rounding: UNIT * short, slope: slope.abs() }
            }
            FrictionLaw::Stribeck { at_rest, kinetic, speed, viscous } => {
                let falling = (at_rest - kinetic).abs();
                let (ratio, dropped, steepest) = match slip[0] > FAR * speed {
                    true => {
                        let largest = ((wide - slip[0]) / speed).exp();
                        (0.0, largest, largest)
                    }
                    // The first value of e has few units of rounding per unit of its exponent.
                    false => {
                        let growth = (wide / speed).exp();
                        (growth * growth, 0.0, growth * inner[0] * (1.0 + 1e-12))
                    }
                };
                // R begins at order DEGREE, and is integrated.
                let rest = rest / (speed * COEFFICIENTS as f64);
                let start = (4.0 + slip[0].abs() / speed) * inner[0];
                // Integrated, order k counts with 1 / k of the units of its product.
                let units = (4 + 2 * shortenings) as f64;
                let rounded = units * factors / speed * inners + start;
                LawBounds {
                    truncation: falling * ratio * rest,
                    // What is dropped is below 1e-170 and grows by no power of the width.
                    rounding: UNIT * (falling * ratio * rounded + short) + falling * dropped,
                    slope: viscous + falling / speed * steepest,
                }
            }
            FrictionLaw::Rational { at_rest, kinetic, speed } => {
                let falling = (at_rest - kinetic).abs();
                let least = 1.0 + (slip[0] - wide) / speed;
                if !(least > 0.0) {
                    let none = f64::INFINITY;
                    return LawBounds { truncation: none, rounding: none, slope: none };
                }
                let rest = rest / speed;
                let terms = (1.0 + (slip[0].abs() + range) / speed) * inners;
                let rounded = (product + 2.0) * terms / least;
                LawBounds {
                    truncation: falling * rest / least,
                    rounding: UNIT * (falling * rounded + short),
                    slope: falling / speed / (least * least),
                }
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[*piece];
                let far = factors + beyond;
                // The polynomial stays in its piece, as the panel is cut at a border; what is off by `beyond` may be past it.
                let ends = table.speeds[*piece..].iter().take(2);
                let near = ends.filter(|&border| (slip[0] - border).abs() <= wide);
                let of_neighbours = near.map(|end| table.steepest(end - beyond, end + beyond));
                // sum of |S_m| |inner_j| over m > 0 and j with m + j > DEGREE.
                let (mut higher, mut product_rest) = (0.0, 0.0);
                for m in 1..COEFFICIENTS {
                    higher += inner[COEFFICIENTS - m].abs();
                    product_rest += slip[m].abs() * higher;
                }
                let terms = far * (size(inner) + (c.abs() + d.abs() * far) * far);
                LawBounds {
                    truncation: far * d.abs() * rest + product_rest,
                    rounding: UNIT * ((2.0 * product + 4.0) * terms + short),
                    slope: of_neighbours
                        .fold(b.abs() + far * (2.0 * c.abs() + 3.0 * far * d.abs()), f64::max),
                }
            }
        }
    }

    /// `mu'(S)` along the panel.
    pub fn slopes(&self, law: &FrictionLaw) -> [f64; COEFFICIENTS] {
        let constant = |k: usize, value: f64| if k == 0 { value } else { 0.0 };
        let Self { slip, inner, piece, .. } = self;
        match law {
            FrictionLaw::Linear { slope, .. } => std::array::from_fn(|k| constant(k, *slope)),
            FrictionLaw::Stribeck { at_rest, kinetic, speed, viscous } => {
                let factor = -(at_rest - kinetic) / speed;
                std::array::from_fn(|k| constant(k, *viscous) + factor * inner[k])
            }
            FrictionLaw::Rational { at_rest, kinetic, speed } => {
                let factor = -(at_rest - kinetic) / speed;
                product(inner, inner).map(|c| factor * c)
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[*piece];
                let mut from_knot = *slip;
                from_knot[0] -= table.speeds[*piece];
                let square = product(&from_knot, &from_knot);
                std::array::from_fn(|k| {
                    constant(k, b) + 2.0 * c * from_knot[k] + 3.0 * d * square[k]
                })
            }
        }
    }

    /// The same series for a shorter panel, from the powers of the factor.
    #[inline(always)]
    pub fn shorten(&mut self, powers: &[f64; ORDERS]) {
        for all in [&mut self.slip, &mut self.inner, &mut self.excess] {
            scale(all, powers);
        }
    }
}

/// Sum of absolute values, in sums that do not wait for each other.
#[inline(always)]
pub(crate) fn size(coefficients: &[f64; COEFFICIENTS]) -> f64 {
    let mut sums = [0.0; GROUP];
    let mut k = 0;
    while k + GROUP <= COEFFICIENTS {
        for lane in 0..GROUP {
            sums[lane] += coefficients[k + lane].abs();
        }
        k += GROUP;
    }
    while k < COEFFICIENTS {
        sums[0] += coefficients[k].abs();
        k += 1;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// The coefficients of a product.
pub(crate) fn product(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|k| (0..=k).map(|j| a[j] * b[k - j]).sum())
}

/// Coefficients for a shorter panel, from the powers of the factor.
#[inline(always)]
pub(crate) fn scale(coefficients: &mut [f64; COEFFICIENTS], powers: &[f64; ORDERS]) {
    for k in 0..COEFFICIENTS {
        coefficients[k] *= powers[k];
    }
}
