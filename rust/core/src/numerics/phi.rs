//! The phi functions of exponential integrators, stable for every complex argument.

use num_complex::Complex64;

/// Below this modulus the series is used: the closed form of phi2 would lose more than a digit to cancellation.
const SERIES: f64 = 1.5;

/// Terms of the series of phi2 that reach rounding up to a modulus.
const TERMS: [(f64, usize); 4] = [(0.05, 8), (0.3, 12), (0.8, 16), (SERIES, 24)];

/// 1 / k
const INVERSE: [f64; 64] = {
    let mut inverse = [0.0; 64];
    let mut k = 1;
    while k < 64 {
        inverse[k] = 1.0 / k as f64;
        k += 1;
    }
    inverse
};

/// 1 / k for 0 < k < 64.
pub(crate) const fn inverse(k: usize) -> f64 {
    INVERSE[k]
}

/// None where the closed form is used.
fn terms(modulus: f64) -> Option<usize> {
    TERMS.iter().find(|&&(largest, _)| modulus < largest).map(|&(_, terms)| terms)
}

/// `(e^x, phi1(x), phi2(x))` with `phi1 = (e^x - 1)/x`, `phi2 = (e^x - 1 - x)/x^2`.
pub(crate) fn exponential_and_phi(x: Complex64) -> (Complex64, Complex64, Complex64) {
    if let Some(terms) = terms(x.norm_sqr().sqrt()) {
        // phi2 = sum_k x^k / (k + 2)!, by Horner from the first term below rounding.
        let mut phi2 = Complex64::from(1.0);
        for k in (1..terms).rev() {
            let (re, im) = (x.re * phi2.re - x.im * phi2.im, x.re * phi2.im + x.im * phi2.re);
            phi2 = Complex64::new(1.0 + re * inverse(k + 2), im * inverse(k + 2));
        }
        phi2 *= 0.5;
        let phi1 = Complex64::from(1.0) + x * phi2;
        let exponential = Complex64::from(1.0) + x * phi1;
        (exponential, phi1, phi2)
    } else {
        let exponential = x.exp();
        let inverse = x.inv();
        let phi1 = (exponential - 1.0) * inverse;
        (exponential, phi1, (phi1 - 1.0) * inverse)
    }
}

/// `phi3 = (phi2 - 1/2)/x`.
pub(crate) fn phi3(x: Complex64) -> Complex64 {
    match terms(x.norm()) {
        // sum_k x^k / (k + 3)!
        Some(terms) => {
            let one = Complex64::from(1.0);
            (1..terms).rev().fold(one, |sum, k| one + x * sum * inverse(k + 3)) / 6.0
        }
        None => (exponential_and_phi(x).2 - 0.5) / x,
    }
}

/// phi2 of a real argument >= 0: `sum_k x^k / (k + 2)!`, the bound of |phi2| on the disc of radius x.
pub(crate) fn phi2_bound(x: f64) -> f64 {
    match terms(x) {
        Some(terms) => 0.5 * (1..terms).rev().fold(1.0, |sum, k| 1.0 + x * sum * inverse(k + 2)),
        None => (x.exp() - 1.0 - x) / (x * x),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recurrences `e^x = 1 + x phi1`, `phi1 = 1 + x phi2` across the switch, and known values.
    #[test]
    fn agree_across_the_switch_and_at_known_points() {
        let (e, phi1, phi2) = exponential_and_phi(Complex64::from(0.0));
        assert_eq!((e.re, phi1.re, phi2.re), (1.0, 1.0, 0.5));
        for (modulus, angle) in TERMS.into_iter().flat_map(|term| (0..16).map(move |k| (term.0, k)))
        {
            let direction = Complex64::from_polar(modulus, angle as f64 * 0.4);
            let below = exponential_and_phi(direction * (1.0 - 1e-15));
            let above = exponential_and_phi(direction * (1.0 + 1e-15));
            // Closed form: cancellation of 1 against terms of size |x|, twice.
            assert!((below.0 - above.0).norm() < 4e-15 * below.0.norm().max(1.0));
            assert!((below.1 - above.1).norm() < 8e-15);
            assert!((below.2 - above.2).norm() < 8e-15);
            let phi3 = [1.0 - 1e-15, 1.0 + 1e-15].map(|near| phi3(direction * near));
            assert!((phi3[0] - phi3[1]).norm() < 8e-15);
            assert!((direction * phi3[0] + 0.5 - below.2).norm() < 8e-15);
            let bounds = [1.0 - 1e-15, 1.0 + 1e-15].map(|near| phi2_bound(modulus * near));
            assert!((bounds[0] - bounds[1]).abs() < 8e-15 && bounds[0] >= below.2.norm() - 8e-15);
        }
        let half = exponential_and_phi(Complex64::from(-30.0));
        assert!((half.2.re - 29.0 / 900.0).abs() < 1e-15);
    }
}
