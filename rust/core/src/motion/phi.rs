//! The phi functions of exponential integrators, stable for every complex argument.

use num_complex::Complex64;

/// Below this modulus the series is used: it then needs at most 24 terms, and the closed form of phi2
/// would lose more than a digit to cancellation.
const SERIES: f64 = 1.5;

/// `(e^x, phi1(x), phi2(x))` with `phi1 = (e^x - 1)/x`, `phi2 = (e^x - 1 - x)/x^2`.
pub(crate) fn exponential_and_phi(x: Complex64) -> (Complex64, Complex64, Complex64) {
    if x.norm_sqr() < SERIES * SERIES {
        // phi2 = sum_k x^k / (k + 2)!, by Horner from the first term below rounding.
        let mut phi2 = Complex64::from(0.0);
        for k in (0..24).rev() {
            phi2 = Complex64::from(1.0) + x * phi2 / (k + 3) as f64;
        }
        phi2 *= 0.5;
        let phi1 = Complex64::from(1.0) + x * phi2;
        let exponential = Complex64::from(1.0) + x * phi1;
        (exponential, phi1, phi2)
    } else {
        let exponential = x.exp();
        let phi1 = (exponential - 1.0) / x;
        (exponential, phi1, (phi1 - 1.0) / x)
    }
}

/// phi2 of a real argument >= 0: `sum_k x^k / (k + 2)!`, the bound of |phi2| on the disc of radius x.
pub(crate) fn phi2_bound(x: f64) -> f64 {
    exponential_and_phi(Complex64::from(x)).2.re
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recurrences `e^x = 1 + x phi1`, `phi1 = 1 + x phi2` across the switch, and known values.
    #[test]
    fn agree_across_the_switch_and_at_known_points() {
        let (e, phi1, phi2) = exponential_and_phi(Complex64::from(0.0));
        assert_eq!((e.re, phi1.re, phi2.re), (1.0, 1.0, 0.5));
        for angle in 0..16 {
            let direction = Complex64::from_polar(1.0, angle as f64 * 0.4);
            let below = exponential_and_phi(direction * (SERIES * (1.0 - 1e-15)));
            let above = exponential_and_phi(direction * (SERIES * (1.0 + 1e-15)));
            // Closed form: cancellation of 1 against terms of size |x|, twice.
            assert!((below.0 - above.0).norm() < 4e-15 * below.0.norm().max(1.0));
            assert!((below.1 - above.1).norm() < 8e-15);
            assert!((below.2 - above.2).norm() < 8e-15);
        }
        let half = exponential_and_phi(Complex64::from(-30.0));
        assert!((half.2.re - 29.0 / 900.0).abs() < 1e-15);
    }
}
