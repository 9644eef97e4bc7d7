//! What all series of laws share: sizes and scales of coefficients, units of rounding, and the bounds that a law gives.

use crate::motion::taylor::motion::ORDERS;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::interval::Interval;
use crate::numerics::simd::GROUP;

/// One unit of rounding.
pub(crate) const UNIT: f64 = 0.5 * f64::EPSILON;

/// Units of rounding of the coefficients of a product, relative to the sums of their terms' absolute values: those of the sum
/// itself, and per shortening of the panel three coefficients that are scaled, and at most DEGREE units between the rounded
/// powers of the factor, `p_j p_{k-j}` and `p_k`.
pub(crate) fn product_units(shortenings: usize) -> usize {
    DEGREE + 4 + shortenings * (DEGREE + 3)
}

/// Bounds of `mu(S) - mu(0)` and its series on [0, 1].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LawBounds {
    /// Largest difference from its polynomial, by truncation and by rounding.
    pub truncation: f64,
    pub rounding: f64,
    /// `d mu / dS` for S within the panel, and somewhat beyond.
    pub slopes: Interval,
}

impl LawBounds {
    /// Of a law that has no series on the panel.
    pub const NONE: Self =
        Self { truncation: f64::INFINITY, rounding: f64::INFINITY, slopes: Interval::ALL };

    /// The largest |d mu / dS|.
    pub fn slope(&self) -> f64 {
        self.slopes.largest()
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

/// `c_0 + sum min(c_k, 0)`, below the polynomial on [0, 1].
#[inline(always)]
pub(crate) fn lowest(coefficients: &[f64; COEFFICIENTS]) -> f64 {
    // The comparison, unlike `min`, is one instruction for several numbers.
    let mut negative = coefficients.map(|c| if c < 0.0 { c } else { 0.0 });
    negative[0] = 0.0;
    coefficients[0] - size(&negative)
}

/// Coefficients for a shorter panel, from the powers of the factor.
#[inline(always)]
pub(crate) fn scale(coefficients: &mut [f64; COEFFICIENTS], powers: &[f64; ORDERS]) {
    for k in 0..COEFFICIENTS {
        coefficients[k] *= powers[k];
    }
}
