//! The error of the polynomials of a panel.
//!
//! The polynomial P of the state obeys `P' = A P + f + sum b_i y_i(P) - D` with a defect D whose coefficients are
//! those that the series leaves out, all of order DEGREE or more, and the rounding of the others: finite sums. With the norm
//! sigma of A and a Lipschitz bound l_i of y_i around P, `L = h (sigma + sum |b_i| l_i)` and `|D| <= t s^DEGREE + r`, the error of
//! P on a panel of width h is at most
//!
//! ```text
//! |X - P| <= h int e^(L (1 - s)) |D| ds <= h t / (DEGREE - L) + h r (e^L - 1) / L
//! ```
//!
//! (Gronwall, and `s <= e^(s - 1)`), as long as this is within the neighbourhood in which l_i holds. On a part f of the width,
//! t falls with f^DEGREE, and nothing else grows.

use crate::motion::friction::motion::LawMotion;
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_series::{UNIT, product_units, size};
use crate::motion::friction::series::panel_bound::{ContactBounds, LARGEST, PanelBound};
use crate::motion::friction::series::rows::{Measure, Sizes};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{Kernel, Lanes};
use crate::scene::model::Scene;

/// Radius of the neighbourhood of a polynomial in which Lipschitz bounds are taken, relative to the state.
const TUBE: f64 = 1e-6;
/// Its largest change of slip speed, relative to the change over which a law changes.
const TUBE_OF_SLIP: f64 = 0.1;

/// Times that the panel may still be shortened: to its truncation, and where a law ends it.
const TO_COME: usize = 2;
/// Units of rounding of a linear row per shortening of the panel: three powers of the factor, two coefficients and the width.
const PER_ROW: usize = 6;

/// Bounds of the error of the state and of the forces of laws.
struct Bound<'a> {
    motion: &'a mut LawMotion,
    scene: &'a Scene,
    operator: &'a LawOperator,
    scale: f64,
}

impl Kernel for Bound<'_> {
    type Output = PanelBound;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> PanelBound {
        let Self { motion, scene, operator, scale } = self;
        let LawMotion { taylor, contacts, coupling, sizes, shortenings, .. } = motion;
        let shortenings = *shortenings + TO_COME;
        let in_product = product_units(shortenings);
        let in_row = (operator.terms + 8 + PER_ROW * shortenings) as f64;
        let terms = taylor.terms();
        Measure { sizes, terms, size: scene.size, width: taylor.width }.run(simd);
        let reach = operator.taylor.norm() * taylor.width;
        let last = taylor.norm_of(scene, &operator.taylor, DEGREE);
        let slips = operator.contacts.iter().zip(&*contacts);
        let radius = slips.fold(TUBE * scale, |radius, (one, sliding)| {
            radius.min(TUBE_OF_SLIP * sliding.series.reach(&one.law) / one.slip_norm)
        });
        for (one, sliding) in operator.contacts.iter().zip(&mut *contacts) {
            let (excess, normal) = (&sliding.series.excess, &sliding.normal);
            let (mut rest, mut products) = (0.0, 0.0);
            for (w, n) in excess.iter().zip(normal.iter().rev()) {
                rest += n.abs();
                products += w.abs() * rest;
            }
            sliding.bounds = ContactBounds {
                law: sliding.series.bounds(&one.law, radius * one.slip_norm, shortenings),
                excess: size(excess),
                pressed: size(normal),
                products,
                ..ContactBounds::default()
            };
        }
        let pairs = || operator.contacts.iter().zip(contacts.iter().map(|one| &one.bounds));
        // Errors of the polynomials of N, and the change of N per norm of the state.
        let mut off = contacts.iter().map(|one| one.beyond).fold(0.0, f64::max);
        let mut moved = operator.contacts.iter().map(|one| one.normal_norm).fold(0.0, f64::max);
        let mut unsharp = 0.0;
        if operator.response.is_some() {
            let [inverse, response] = coupling.norms;
            let largest = |of: &dyn Fn(&ContactBounds) -> f64| {
                contacts.iter().map(|one| of(&one.bounds)).fold(0.0, f64::max)
            };
            let drift = pairs().map(|(one, ContactBounds { law, excess, .. })| {
                excess + law.truncation + law.rounding + law.slope * one.slip_norm * radius
            });
            let drift = inverse * response * drift.fold(0.0, f64::max);
            let gain = if drift < 0.5 { inverse / (1.0 - drift) } else { f64::INFINITY };
            let part = |of: &ContactBounds| of.products + of.law.truncation * of.pressed;
            off = gain * (off + response * largest(&part));
            let terms = (in_product + contacts.len()) as f64;
            let part = |of: &ContactBounds| {
                (of.law.rounding + UNIT * terms * (1.0 + of.excess)) * of.pressed
            };
            unsharp = gain * (1.0 + response) * largest(&part);
            let by_slip = pairs().map(|(one, of)| of.law.slope * one.slip_norm * of.pressed);
            moved = gain * (moved + response * by_slip.fold(0.0, f64::max));
        }
        // Where the norm is the largest entry and contacts are apart, the worst one counts; else all together.
        let apart = scene.coupled_mass.is_none() && operator.response.is_none();
        let together = |sum: f64, part: f64| if apart { sum.max(part) } else { sum + part };
        let (mut truncated, mut rounded, mut lipschitz) = (0.0, 0.0, 0.0);
        for (one, sliding) in operator.contacts.iter().zip(contacts) {
            let ContactBounds { law, excess, pressed, products, .. } = sliding.bounds;
            let largest = excess + law.truncation + law.rounding;
            let cut = products + law.truncation * pressed + largest * off;
            let size = sliding.at_origin_size + Sizes::of(&sizes.all, &one.normal);
            let terms = in_product as f64 * pressed + in_row * size;
            let round = UNIT * terms * excess + law.rounding * pressed + largest * unsharp;
            let slope = law.slope * one.slip_norm * (pressed + off + unsharp + radius * moved);
            let gain = largest * moved + slope;
            let by_force = taylor.width * one.force_norm;
            truncated = together(truncated, by_force * cut);
            rounded = together(rounded, by_force * round);
            lipschitz = together(lipschitz, one.force_norm * gain);
            sliding.bounds = ContactBounds { cut, round, gain, ..sliding.bounds };
        }
        let beyond = reach / COEFFICIENTS as f64 * last;
        truncated += reach * (last + beyond);
        let of_orders: f64 = match scene.coupled_mass {
            // The largest row sum, over the sum of all orders.
            None => operator.taylor.largest(&sizes.all),
            Some(_) => (0..COEFFICIENTS).map(|k| taylor.norm_of(scene, &operator.taylor, k)).sum(),
        };
        let load = taylor.width * taylor.force_norm(&operator.taylor);
        rounded += UNIT * in_row * (reach * of_orders + load);
        let exponent = reach + taylor.width * lipschitz;
        let mut bound = PanelBound { truncated, rounded, beyond, exponent, holds: false };
        bound.holds = exponent <= LARGEST && bound.of_shorter(1.0) <= radius;
        bound
    }
}

impl LawMotion {
    /// Bounds of the error of the state and of the forces of laws.
    pub(super) fn bound(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        scale: f64,
    ) -> PanelBound {
        let unit = self.unit;
        unit.run(Bound { motion: self, scene, operator, scale })
    }
}
