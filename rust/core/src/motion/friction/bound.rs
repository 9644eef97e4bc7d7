//! The error of the polynomials of a panel.
//!
//! The polynomial P of the state obeys `P' = A P + f + sum b_i y_i(P) - D` with a defect D whose coefficients are
//! those that the series leaves out and the rounding of the others: finite sums. With the norm sigma of A and a Lipschitz
//! bound l_i of y_i around P, the error of P on a panel of width h is at most
//!
//! ```text
//! |X - P| <= h |D| (e^L - 1) / L,    L = h (sigma + sum |b_i| l_i)
//! ```
//!
//! (Gronwall), as long as this is within the neighbourhood in which l_i holds.

use crate::motion::friction::law_series::UNIT;
use crate::motion::friction::motion::{LawMotion, Sliding};
use crate::motion::friction::operator::LawOperator;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::scene::model::Scene;

/// Radius of the neighbourhood of a polynomial in which Lipschitz bounds are taken, relative to the state.
const TUBE: f64 = 1e-6;
/// Its largest change of slip speed, relative to the change over which a law changes.
const TUBE_OF_SLIP: f64 = 0.1;

impl LawMotion {
    /// Bounds of the error of the state by truncation alone, and of all of it, and L.
    pub(super) fn bound(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        scale: f64,
    ) -> (f64, f64, f64) {
        let Self { taylor, contacts, coupling, .. } = self;
        let reach = operator.taylor.norm() * taylor.width;
        let last = taylor.norm_of(scene, &operator.taylor, DEGREE);
        let slips = operator.contacts.iter().zip(&*contacts);
        let radius = slips.fold(TUBE * scale, |radius, (one, sliding)| {
            radius.min(TUBE_OF_SLIP * sliding.series.reach(&one.law) / one.slip_norm)
        });
        let size = |all: &[f64; COEFFICIENTS]| all.iter().map(|c| c.abs()).sum::<f64>();
        // Of each contact: bounds of its law, |excess|, |N|, and the orders of their product from DEGREE and beyond.
        let laws: Vec<_> = operator
            .contacts
            .iter()
            .zip(&*contacts)
            .map(|(one, Sliding { series, normal, .. })| {
                let law = series.bounds(&one.law, radius * one.slip_norm);
                let (mut rest, mut products) = (0.0, 0.0);
                for (i, coefficient) in series.excess.iter().enumerate() {
                    rest += normal[DEGREE - i].abs();
                    products += coefficient.abs() * rest;
                }
                (law, size(&series.excess), size(normal), products)
            })
            .collect();
        // Errors of the polynomials of N, and the change of N per norm of the state.
        let mut off = contacts.iter().map(|one| one.beyond).fold(0.0, f64::max);
        let mut moved = operator.contacts.iter().map(|one| one.normal_norm).fold(0.0, f64::max);
        let mut unsharp = 0.0;
        if operator.response.is_some() {
            let [inverse, response] = coupling.norms;
            let pairs = || operator.contacts.iter().zip(&laws);
            let drift = pairs().map(|(one, (law, excess, ..))| {
                excess + law.truncation + law.rounding + law.slope * one.slip_norm * radius
            });
            let drift = inverse * response * drift.fold(0.0, f64::max);
            let gain = if drift < 0.5 { inverse / (1.0 - drift) } else { f64::INFINITY };
            let parts =
                laws.iter().map(|(law, _, pressed, products)| products + law.truncation * pressed);
            off = gain * (off + response * parts.fold(0.0, f64::max));
            let parts = laws.iter().map(|(law, excess, pressed, _)| {
                (law.rounding + UNIT * (DEGREE + 4 + laws.len()) as f64 * (1.0 + excess)) * pressed
            });
            unsharp = gain * (1.0 + response) * parts.fold(0.0, f64::max);
            let by_slip =
                pairs().map(|(one, (law, _, pressed, _))| law.slope * one.slip_norm * pressed);
            moved = gain * (moved + response * by_slip.fold(0.0, f64::max));
        }
        // Where the norm is the largest entry and contacts are apart, the worst one counts; else all together.
        let apart = scene.coupled_mass.is_none() && operator.response.is_none();
        let together = |sum: f64, part: f64| if apart { sum.max(part) } else { sum + part };
        let (mut truncated, mut rounded, mut lipschitz) = (0.0, 0.0, 0.0);
        let mut of_products = Vec::with_capacity(laws.len());
        for (one, (law, excess, pressed, products)) in operator.contacts.iter().zip(&laws) {
            let largest = excess + law.truncation + law.rounding;
            let cut = products + law.truncation * pressed + largest * off;
            let size = taylor.size_of(&one.normal);
            let terms = (DEGREE + 4) as f64 * pressed + (operator.terms + 8) as f64 * size;
            let round = UNIT * terms * excess + law.rounding * pressed + largest * unsharp;
            let slope = law.slope * one.slip_norm * (pressed + off + unsharp + radius * moved);
            let gain = largest * moved + slope;
            let by_force = taylor.width * one.force_norm;
            truncated = together(truncated, by_force * cut);
            rounded = together(rounded, by_force * round);
            lipschitz = together(lipschitz, one.force_norm * gain);
            of_products.push((cut + round, gain));
        }
        let beyond = reach / COEFFICIENTS as f64 * last;
        truncated += reach * (last + beyond);
        let sizes: f64 =
            (0..COEFFICIENTS).map(|k| taylor.norm_of(scene, &operator.taylor, k)).sum();
        let load = taylor.width * taylor.force_norm(&operator.taylor);
        rounded += UNIT * (operator.terms + 8) as f64 * (reach * sizes + load);
        let exponent = reach + taylor.width * lipschitz;
        let growth = if exponent > 0.0 { exponent.exp_m1() / exponent } else { 1.0 };
        let inside = growth * (truncated + rounded) <= radius;
        let error = if inside { growth * (truncated + rounded) + beyond } else { f64::INFINITY };
        for (sliding, (own, gain)) in contacts.iter_mut().zip(of_products) {
            sliding.error = own + gain * error;
        }
        (growth * truncated + beyond, error, exponent)
    }
}
