//! Gauss-Legendre integration of works, to rounding.
//!
//! A power is a product of two parts of the state. Let both be bounded off the real axis by
//! `|X(t + z)| <= A e^{rate |z|}`, and let a panel have the half width H.
//! On the Bernstein ellipse of parameter rho the product stays below `A^2 e^{rate H (rho + 1/rho)}`, and the
//! rule of n nodes is off by at most (Trefethen, SIAM Review 50 (2008), Theorem 4.5)
//!
//! ```text
//! |I - I_n| <= (64 / 15) H A^2 e^{rate H (rho + 1/rho)} rho^{-2n} / (1 - rho^{-2})
//! ```
//!
//! With n = 18 and `2 rate H <= REACH` = 6 the minimum over rho, near 12, is 4e-23 H A^2: below the rounding of
//! the integrand even where A, taken at the middle of the panel, is e^3 times the state at its start, and
//! where modes of condition 300 cancel.

use std::sync::OnceLock;

/// Nodes of the rule: exact up to degree 35.
pub(crate) const NODES: usize = 18;
/// Largest rate times width of a panel.
pub(crate) const REACH: f64 = 6.0;

/// Nodes, ascending, and weights on [0, 1].
#[derive(Debug)]
pub(crate) struct GaussRule {
    pub nodes: [f64; NODES],
    pub weights: [f64; NODES],
}

/// The rule, computed once.
pub(crate) fn gauss_rule() -> &'static GaussRule {
    static RULE: OnceLock<GaussRule> = OnceLock::new();
    RULE.get_or_init(|| {
        let mut rule = GaussRule { nodes: [0.0; NODES], weights: [0.0; NODES] };
        for i in 0..NODES.div_ceil(2) {
            // Newton from Tricomi's estimate is quadratic from the first step on: four reach rounding.
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (NODES as f64 + 0.5)).cos();
            for _ in 0..6 {
                let (p, slope) = legendre(x);
                x -= p / slope;
            }
            let slope = legendre(x).1;
            let weight = 1.0 / ((1.0 - x * x) * slope * slope);
            (rule.nodes[i], rule.nodes[NODES - 1 - i]) = (0.5 * (1.0 - x), 0.5 * (1.0 + x));
            (rule.weights[i], rule.weights[NODES - 1 - i]) = (weight, weight);
        }
        rule
    })
}

/// The Legendre polynomial of degree `NODES` and its derivative, |x| < 1.
fn legendre(x: f64) -> (f64, f64) {
    let (mut before, mut p) = (1.0, x);
    for k in 2..=NODES {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
    }
    (p, NODES as f64 * (x * p - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bound of the error of one panel of width 1, relative to A^2: smallest over rho.
    fn bound(reach: f64) -> f64 {
        (110..4000)
            .map(|k| {
                let rho = k as f64 / 100.0;
                let growth = (0.5 * reach * (rho + 1.0 / rho)).exp();
                32.0 / 15.0 * growth * rho.powi(-2 * NODES as i32) / (1.0 - rho.powi(-2))
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        let rule = gauss_rule();
        rule.nodes.iter().zip(&rule.weights).map(|(&x, w)| w * f(x)).sum()
    }

    #[test]
    fn is_exact_up_to_degree_35_and_not_beyond() {
        for degree in 0..2 * NODES {
            let exact = 1.0 / (degree + 1) as f64;
            // A node off by an ulp moves x^degree by degree ulp.
            let rounding = f64::EPSILON * (4 + degree) as f64;
            assert!((integral(|x| x.powi(degree as i32)) - exact).abs() <= rounding * exact);
        }
        let shifted = integral(|x| (2.0 * x - 1.0).powi(36));
        // The leading coefficient of the rule's error: 2^36 (18!)^4 / (37 ((36)!)^2) = 1.1e-10 on [-1, 1].
        assert!((shifted - 1.0 / 37.0).abs() > 1e-11);
    }

    #[test]
    fn integrates_products_of_the_fastest_exponentials_to_rounding() {
        assert!(bound(REACH) < 1e-22);
        // The product of two states at rate REACH: its own rate is twice that.
        let rate = 2.0 * REACH;
        let grown = (rate.exp() - 1.0) / rate;
        assert!((integral(|x| (rate * x).exp()) - grown).abs() <= 8.0 * f64::EPSILON * grown);
        let turned = rate.sin() / rate;
        assert!((integral(|x| (rate * x).cos()) - turned).abs() <= 8.0 * f64::EPSILON);
        // Three times the reach is too much for it: the bound is not idle.
        assert!(
            (integral(|x| (6.0 * rate * x).cos()) - (6.0 * rate).sin() / (6.0 * rate)).abs() > 1e-6
        );
    }
}
