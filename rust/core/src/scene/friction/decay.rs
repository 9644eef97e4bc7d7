//! Decays g(x) from 1 at rest to 0, convex and with g'(0) = -1: their formulas, their Taylor series along a motion, and the
//! errors of these.
//!
//! Along a panel x = S / v is a polynomial on [0, 1]. The recurrences of g(x) are those of
//!
//! ```text
//! g = exp(-x)      k g_k = -sum_j j x_j g_{k-j}          g' = -x' g
//! g = 1 / (1 + x)  g_k = -g_0 sum_{j>0} x_j g_{k-j}      (1 + x) g = 1
//! ```
//!
//! The error of the polynomial G of g follows from the equation that it obeys up to a known rest: with `G' + x' G = R` the
//! error is `|G - g| <= max g / min g * integral |R|`, and with `(1 + x) G = 1 + R` it is `|G - g| <= max |R| max g`. All sums
//! are finite. Another decay is another arm of each function here.

use crate::numerics::first_root::polynomial::{COEFFICIENTS, crosswise};

/// Part of the rise of a bounded law from which on it counts as level.
pub(crate) const LEVEL: f64 = 1e-2;

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

/// How friction passes from its value at rest to that at large speeds, over x = |s| / v.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decay {
    /// `exp(-x)`
    Exponential,
    /// `1 / (1 + x)`
    Rational,
}

/// The sizes that the errors of the polynomial of g follow from, on a panel; `S` in m/s, all others in units of v.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DecayPanel<'a> {
    /// v, m/s
    pub speed: f64,
    /// S
    pub slip: &'a [f64; COEFFICIENTS],
    /// G
    pub decay: &'a [f64; COEFFICIENTS],
    /// Sums of the absolute values of both factors of the convolution, and of its orders beyond the last.
    pub factors: f64,
    pub decays: f64,
    pub left_out: f64,
    /// Sum of `|x_j|` over j > 0, and the same with what x may be off by.
    pub range: f64,
    pub wide: f64,
    /// Bound of g on the panel.
    pub largest: f64,
    /// Units of rounding of a coefficient of a product, and of three factors of which two have been scaled.
    pub of_product: f64,
    pub of_scaled: f64,
}

impl Decay {
    /// All decays.
    pub const NAMES: &[(&str, Self)] = &[
        // By the names of their laws in Python.
        ("stribeck", Self::Exponential),
        ("rational", Self::Rational),
    ];

    /// g, also somewhat below x = 0.
    pub(crate) fn value(self, x: f64) -> f64 {
        match self {
            Self::Exponential => (-x).exp(),
            Self::Rational => 1.0 / (1.0 + x),
        }
    }

    /// `1 - g`
    pub(crate) fn loss(self, x: f64) -> f64 {
        match self {
            Self::Exponential => -(-x).exp_m1(),
            Self::Rational => x / (1.0 + x),
        }
    }

    /// `-g'` and `g''`, of g.
    pub(crate) fn rates(self, g: f64) -> [f64; 2] {
        match self {
            Self::Exponential => [g, g],
            Self::Rational => [g * g, 2.0 * g * g * g],
        }
    }

    /// The series of `-g'(x)`, of that of g.
    pub(crate) fn rate_series(self, g: &[f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
        match self {
            Self::Exponential => *g,
            Self::Rational => product(g, g),
        }
    }

    /// Where `LEVEL` of g is left.
    pub(crate) fn level(self) -> f64 {
        match self {
            Self::Exponential => -LEVEL.ln(),
            Self::Rational => 1.0 / LEVEL,
        }
    }

    /// How far x may go on a panel.
    pub(crate) fn reach(self, x: f64) -> f64 {
        match self {
            // What the factors by which g grows and falls make of its bound stays below e^2.
            Self::Exponential => 1.0 + x / 3.0,
            // 1 + x keeps half of its value.
            Self::Rational => 0.5 * (1.0 + x),
        }
    }

    /// g of order k > 0 from S up to that order, g up to the one before, and the `middle` of the convolution of its two
    /// factors, whose terms of orders from 1 to k - 1 are known. Gives also the left one of this order; the right one is g.
    #[inline(always)]
    pub(crate) fn order(
        self,
        k: usize,
        slip: &[f64; COEFFICIENTS],
        speed: f64,
        g: &[f64; COEFFICIENTS],
        middle: f64,
    ) -> [f64; 2] {
        let s = slip[k];
        // Products with S_k come last: all else is known when S_k is, and the next order waits for it.
        match self {
            Self::Exponential => {
                let part = INVERSE[k] / speed;
                [s.mul_add(-(k as f64 * g[0] * part), -(middle * part)), k as f64 * s]
            }
            Self::Rational => {
                let part = g[0] / speed;
                [s.mul_add(-(g[0] * part), -(middle * part)), s]
            }
        }
    }

    /// Bounds of the error of the polynomial: by truncation, and by rounding in units of it.
    #[inline(always)]
    pub(crate) fn errors(self, panel: &DecayPanel<'_>) -> [f64; 2] {
        let DecayPanel { speed, factors, decays, left_out, range, wide, largest, .. } = *panel;
        let start = panel.slip[0].abs() / speed;
        match self {
            Self::Exponential => {
                let growth = wide.exp();
                let ratio = growth * growth;
                // R begins at order DEGREE, and is integrated: order k counts with 1 / k of the units of its product.
                let rounded = panel.of_scaled * factors * decays + (4.0 + start) * panel.decay[0];
                [ratio * left_out / COEFFICIENTS as f64, ratio * rounded]
            }
            Self::Rational => {
                let terms = (1.0 + start + range) * decays;
                [left_out * largest, (panel.of_product + 2.0) * terms * largest]
            }
        }
    }
}

/// The coefficients of a product.
pub(crate) fn product(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|k| crosswise(&a[..=k], &b[..=k]))
}

/// Sum of the absolute values of all terms of a product beyond its last coefficient, without those of `a_0`.
pub(crate) fn terms_left_out(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    let (mut higher, mut sum) = (0.0, 0.0);
    for m in 1..COEFFICIENTS {
        higher += b[COEFFICIENTS - m].abs();
        sum += a[m].abs() * higher;
    }
    sum
}
