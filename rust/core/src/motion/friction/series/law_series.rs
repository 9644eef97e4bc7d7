//! Taylor series of a law of friction along a slip speed that is a polynomial, with a bound of their error.
//!
//! Decays have their recurrences and errors in [`crate::scene::friction::decay`]; those of a table are products.

use crate::error::input::Error;
use crate::motion::friction::series::coefficients::{LawBounds, UNIT, product_units, scale, size};
use crate::motion::friction::series::convolutions::FactorSums;
use crate::motion::friction::series::formula_series::FormulaSeries;
use crate::motion::taylor::motion::ORDERS;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::interval::Interval;
use crate::scene::elements::element::Element;
use crate::scene::friction::decay::{DecayPanel, product, terms_left_out};
use crate::scene::friction::formula::{Formula, seeds};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// What a decay counts as zero below: products with it would leave the range of numbers.
const VANISHED: f64 = 1e-260;

/// `mu(S) - mu(0)` along a panel.
#[derive(Debug, Clone, Default)]
pub(crate) struct LawSeries {
    /// S
    pub slip: [f64; COEFFICIENTS],
    /// g of a decay, or the quotient of the cubic of a table by its distance.
    inner: [f64; COEFFICIENTS],
    /// `mu(S) - mu(0)`
    pub excess: [f64; COEFFICIENTS],
    /// Piece of a table.
    pub piece: usize,
    /// The slots of a formula.
    formula: FormulaSeries,
}

/// mu and its first three derivatives over |s|, at a slip speed >= 0.
pub fn law_derivatives(law: &FrictionLaw, speed: f64) -> [f64; 4] {
    let (LawSeries { excess, .. }, _) = LawSeries::along(law, &[speed, 1.0, 0.0, 0.0]);
    [law.value(speed), excess[1], 2.0 * excess[2], 6.0 * excess[3]]
}

/// By element, at rest in a combination: its stretch or rate, phi and its first three derivatives.
pub fn elements_at_rest(scene: &Scene, combination: &Combination) -> Result<Vec<[f64; 5]>, Error> {
    let q = scene.place_of_rest(combination)?;
    let still = vec![0.0; q.len()];
    let derivatives = |one: &Element| {
        let argument = one.argument(&q, &still);
        let [value, linear] = one.linear;
        let slope = linear + one.node_stiffness;
        let [excess, first, second, third] = law_derivatives(&one.excess, argument);
        [argument, excess + value + slope * argument, first + slope, second, third]
    };
    Ok(scene.elements().iter().map(derivatives).collect())
}

/// Slopes that are known by their largest size.
fn up_to(size: f64) -> Interval {
    Interval { low: -size, high: size }
}

impl LawSeries {
    /// The coefficients of order k, from those of S and of the state and the `middle` of the convolution of what it gave for the
    /// orders from 1 to k - 1. Gives that of `mu(S) - mu(0)`, or of a formula with a state, and the two factors of this order.
    #[inline(always)]
    pub fn extend(
        &mut self,
        law: &FrictionLaw,
        k: usize,
        [s, z]: [f64; 2],
        middle: f64,
    ) -> (f64, [f64; 2]) {
        let Self { slip, inner, excess, piece, formula: slots } = self;
        slip[k] = s;
        let law = law.on(*piece);
        let (of_order, of_inner, left) = match law {
            FrictionLaw::Linear { slope, .. } => (slope * s, 0.0, 0.0),
            FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
                let falling = at_rest - kinetic;
                if k == 0 {
                    let value = decay.value(s / speed);
                    let value = if value < VANISHED { 0.0 } else { value };
                    (viscous * s - falling * decay.loss(s / speed), value, 0.0)
                } else {
                    let [value, left] = decay.order(k, slip, *speed, inner, middle);
                    (falling.mul_add(value, viscous * s), value, left)
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
            FrictionLaw::Formula(formula) => {
                let value = slots.order(formula, k, s, z);
                let at_rest = || if formula.has_state() { 0.0 } else { law.value(0.0) };
                (if k == 0 { value - at_rest() } else { value }, 0.0, 0.0)
            }
            FrictionLaw::Pieces(_) => (f64::NAN, 0.0, 0.0),
        };
        (excess[k], inner[k]) = (of_order, of_inner);
        (of_order, [left, of_inner])
    }

    /// How far the state may move on a panel.
    pub fn reach_of_state(&self) -> f64 {
        self.formula.reaches[1]
    }

    /// Bounds of a law with a state on a panel that was shortened some times, the slopes also where slip speed and state, which
    /// begins at `state` and moves that far, are off by `beyond`, and a bound of the slope over the state.
    pub fn bounds_with_state(
        &self,
        law: &FrictionLaw,
        [state, moves]: [f64; 2],
        beyond: [f64; 2],
        shortenings: usize,
    ) -> (LawBounds, f64) {
        let FrictionLaw::Formula(formula) = law.on(self.piece) else {
            return (LawBounds::NONE, f64::INFINITY);
        };
        let (speed, wide) = (self.slip[0], self.range() + beyond[0]);
        let inputs = [(speed, wide), (state, moves + beyond[1])];
        let (mut bounds, mut by_state) = self.formula.bounds(formula, inputs, shortenings);
        for (border, piece) in borders(law.knots(), self.piece) {
            // The polynomial stays in its piece, as the panel is cut at a border; what is off by `beyond` may be past it.
            let FrictionLaw::Formula(other) = law.on(piece) else { continue };
            if (state - border).abs() > inputs[1].1 {
                continue;
            }
            let around = |at: f64, wide: f64| Interval { low: at - wide, high: at + wide };
            let [of_speed, of_state] = seeds(around(speed, wide), around(border, beyond[1]))
                .map(|inputs| other.slots(inputs).last().map_or(Interval::ALL, |jet| jet.first));
            let Interval { low, high } = bounds.slopes;
            bounds.slopes = Interval { low: low.min(of_speed.low), high: high.max(of_speed.high) };
            by_state = by_state.max(of_state.largest());
        }
        (bounds, by_state)
    }

    /// Its slopes over the slip speed and over the state, along the panel.
    pub fn slopes_with_state(&self, formula: &Formula) -> [[f64; COEFFICIENTS]; 2] {
        [false, true].map(|over_state| self.formula.slopes(formula, over_state))
    }

    /// The law along a slip speed that is a polynomial, and the left factors of all orders.
    pub(crate) fn along(law: &FrictionLaw, slip: &[f64]) -> (Self, [f64; COEFFICIENTS]) {
        let (mut series, [mut lefts, mut rights]) = (Self::default(), [[0.0; COEFFICIENTS]; 2]);
        series.piece = law.piece(slip[0]);
        for (k, s) in slip.iter().enumerate() {
            let middle = (1..k).map(|j| lefts[j] * rights[k - j]).sum();
            (_, [lefts[k], rights[k]]) = series.extend(law, k, [*s, 0.0], middle);
        }
        (series, lefts)
    }

    /// The factor of S_k in the coefficient of order k > 0, `mu'(S_0)`.
    pub fn slope(&self, law: &FrictionLaw) -> f64 {
        let Self { slip, inner, piece, .. } = self;
        match law.on(*piece) {
            FrictionLaw::Linear { slope, .. } => *slope,
            FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
                viscous - (at_rest - kinetic) / speed * decay.rates(inner[0])[0]
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[*piece];
                let x = slip[0] - table.speeds[*piece];
                b + x * (2.0 * c + 3.0 * x * d)
            }
            FrictionLaw::Formula(formula) => formula.jet(slip[0]).first,
            FrictionLaw::Pieces(_) => f64::NAN,
        }
    }

    /// A bound from below of `mu'(S)` on the panel, also where S is off by `beyond`.
    pub fn least_slope(&self, law: &FrictionLaw, beyond: f64) -> f64 {
        let wide = self.range() + beyond;
        let (low, high) = (self.slip[0] - wide, self.slip[0] + wide);
        let least = match law.on(self.piece) {
            FrictionLaw::Linear { slope, .. } => *slope,
            // Its slope is monotone, where it has one.
            FrictionLaw::Decaying { speed, decay, .. } => {
                match is_decay(decay.value(low / speed)) {
                    true => law.slope(low).min(law.slope(high)),
                    false => f64::NEG_INFINITY,
                }
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[self.piece];
                let slope = |x: f64| b + x * (2.0 * c + 3.0 * x * d);
                let [low, high] = [low, high].map(|speed| speed - table.speeds[self.piece]);
                let ends = slope(low).min(slope(high));
                let turn = -c / (3.0 * d);
                if d > 0.0 && low < turn && turn < high { ends.min(slope(turn)) } else { ends }
            }
            FrictionLaw::Formula(formula) => formula.between(low, high).first.low,
            FrictionLaw::Pieces(_) => f64::NAN,
        };
        least * (1.0 - 1e-9)
    }

    /// A distance from the polynomial of S in which Lipschitz bounds are taken where slip has no mass.
    pub fn tube(&self, law: &FrictionLaw) -> f64 {
        match law.on(self.piece) {
            FrictionLaw::Linear { .. } => f64::MAX,
            FrictionLaw::Decaying { .. } | FrictionLaw::Formula(_) => {
                match 5e-2 * self.reach(law) {
                    tube if tube.is_finite() => tube,
                    // Where a polynomial has a series everywhere, its slope still changes with S.
                    _ => 5e-2 * (self.slip[0].abs() + self.range()),
                }
            }
            // The last piece is level, and slip without mass never is on it: no neighbourhood has a bound.
            FrictionLaw::Tabulated(table) => match table.speeds[self.piece..] {
                [low, high, ..] => 1e-3 * (high - low),
                _ => 0.0,
            },
            FrictionLaw::Pieces(_) => 0.0,
        }
    }

    /// How far S may move from S_0 on a panel.
    pub fn reach(&self, law: &FrictionLaw) -> f64 {
        match law.on(self.piece) {
            FrictionLaw::Decaying { speed, decay, .. } => speed * decay.reach(self.slip[0] / speed),
            FrictionLaw::Formula(_) => self.formula.reaches[0],
            FrictionLaw::Linear { .. } | FrictionLaw::Tabulated(_) => f64::INFINITY,
            FrictionLaw::Pieces(_) => 0.0,
        }
    }

    /// The change of S over which the law changes.
    pub fn resolution(&self, law: &FrictionLaw) -> f64 {
        match law {
            FrictionLaw::Tabulated(table) => {
                let widths = table.speeds.windows(2).map(|pair| pair[1] - pair[0]);
                widths.fold(f64::INFINITY, f64::min) + 0.5 * self.slip[0].abs()
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
        let whole = law;
        let law = law.on(*piece);
        let ([factors, excess], [inners, _], [rest, _]) = (sums.left, sums.right, sums.left_out);
        let range = self.range();
        let wide = range + beyond;
        let product = product_units(shortenings) as f64;
        // Sums of at most three terms, whose scaling rounds both sides.
        let short = (3 + 2 * shortenings) as f64 * excess;
        let bounds = match law {
            FrictionLaw::Linear { slope, .. } => {
                LawBounds { truncation: 0.0, rounding: UNIT * short, slopes: (*slope).into() }
            }
            FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
                let falling = (at_rest - kinetic).abs();
                let largest = decay.value((slip[0] - wide) / speed);
                if !is_decay(largest) {
                    return LawBounds::NONE;
                }
                let errors = decay.errors(&DecayPanel {
                    speed: *speed,
                    slip,
                    decay: inner,
                    factors: factors / speed,
                    decays: inners,
                    left_out: rest / speed,
                    range: range / speed,
                    wide: wide / speed,
                    largest,
                    of_product: product,
                    of_scaled: (4 + 2 * shortenings) as f64,
                });
                // What vanishes is dropped: it grows by no power of the width.
                let ([cut, rounded], dropped) = match inner[0] == 0.0 {
                    true => ([0.0; 2], largest),
                    false => (errors, 0.0),
                };
                let [steepest, _] = decay.rates(largest * (1.0 + 1e-12));
                LawBounds {
                    truncation: falling * cut,
                    rounding: UNIT * (falling * rounded + short) + falling * dropped,
                    slopes: up_to(viscous + falling / speed * steepest),
                }
            }
            FrictionLaw::Tabulated(table) => {
                let [_, b, c, d] = table.pieces[*piece];
                let far = factors + beyond;
                // The polynomial stays in its piece, as the panel is cut at a border; what is off by `beyond` may be past it.
                let ends = table.speeds[*piece..].iter().take(2);
                let near = ends.filter(|&border| (slip[0] - border).abs() <= wide);
                let of_neighbours = near.map(|end| table.steepest(end - beyond, end + beyond));
                let product_rest = terms_left_out(slip, inner);
                let terms = far * (size(inner) + (c.abs() + d.abs() * far) * far);
                LawBounds {
                    truncation: far * d.abs() * rest + product_rest,
                    rounding: UNIT * ((2.0 * product + 4.0) * terms + short),
                    slopes: up_to(
                        of_neighbours
                            .fold(b.abs() + far * (2.0 * c.abs() + 3.0 * far * d.abs()), f64::max),
                    ),
                }
            }
            FrictionLaw::Formula(formula) => {
                self.formula.bounds(formula, [(slip[0], wide), (0.0, 0.0)], shortenings).0
            }
            FrictionLaw::Pieces(_) => LawBounds::NONE,
        };
        match whole {
            FrictionLaw::Pieces(_) => {
                let near = borders(whole.knots(), *piece)
                    .filter(|(border, _)| (slip[0] - border).abs() <= wide);
                let slopes =
                    near.map(|(border, _)| whole.steepness(border - beyond, border + beyond)[0]);
                LawBounds { slopes: up_to(slopes.fold(bounds.slope(), f64::max)), ..bounds }
            }
            _ => bounds,
        }
    }

    /// `mu'(S)` along the panel.
    pub fn slopes(&self, law: &FrictionLaw) -> [f64; COEFFICIENTS] {
        let constant = |k: usize, value: f64| if k == 0 { value } else { 0.0 };
        let Self { slip, inner, piece, .. } = self;
        match law.on(*piece) {
            FrictionLaw::Linear { slope, .. } => std::array::from_fn(|k| constant(k, *slope)),
            FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
                let factor = -(at_rest - kinetic) / speed;
                let rates = decay.rate_series(inner);
                std::array::from_fn(|k| constant(k, *viscous) + factor * rates[k])
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
            FrictionLaw::Formula(formula) => self.formula.slopes(formula, false),
            FrictionLaw::Pieces(_) => [f64::NAN; COEFFICIENTS],
        }
    }

    /// The same series for a shorter panel, from the powers of the factor.
    #[inline(always)]
    pub fn shorten(&mut self, powers: &[f64; ORDERS]) {
        for all in [&mut self.slip, &mut self.inner, &mut self.excess] {
            scale(all, powers);
        }
        self.formula.shorten(powers);
    }
}

/// The borders of a piece, each with the piece beyond it; the first piece has no beginning, and the last one no end.
pub(crate) fn borders(knots: &[f64], piece: usize) -> impl Iterator<Item = (f64, usize)> {
    let below = (piece > 0).then(|| (knots[piece], piece - 1));
    let above = knots.get(piece + 1).map(|&knot| (knot, piece + 1));
    below.into_iter().chain(above)
}

/// Whether a decay has a value there: one that is vanishingly small may have rounded to 0.
fn is_decay(value: f64) -> bool {
    value >= 0.0 && value.is_finite()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::friction::decay::Decay;

    /// The sum of a polynomial with rounding of a few units of its terms.
    fn at(coefficients: &[f64], s: f64) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, c| sum.mul_add(s, *c))
    }

    /// The law along a slip speed that is a polynomial, as a panel has it.
    fn series(law: &FrictionLaw, slip: &[f64; COEFFICIENTS]) -> (LawSeries, FactorSums) {
        let (series, lefts) = LawSeries::along(law, slip);
        let left_out = terms_left_out(&lefts, &series.inner);
        let sums = FactorSums {
            left: [size(&lefts), size(&series.excess)],
            right: [size(&series.inner), 0.0],
            left_out: [left_out, 0.0],
        };
        (series, sums)
    }

    proptest! {
        /// The polynomial of every decay is within its bounds of the formula, its slope within those of the slope, and the
        /// bounds are small: of a slip speed that moves as far as the decay allows, or less.
        #[test]
        fn decays_are_within_their_bounds_of_their_formulas(
            start in 0.0..5.0f64,
            far in -4.0..0.0f64,
            signs in proptest::array::uniform29(-1.0..1.0f64),
            at_rest in 0.1..1.0f64,
            kinetic in 0.1..1.0f64,
            speed in 0.01..1.0f64,
            viscous in 0.0..0.5f64,
        ) {
            for &(name, decay) in Decay::NAMES {
                let law = FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay };
                let reach = 0.5 * speed * decay.reach(start) * far.exp2();
                let mut slip = [0.0; COEFFICIENTS];
                for (k, (value, sign)) in slip.iter_mut().zip(signs).enumerate() {
                    *value = if k == 0 { start * speed } else { 0.5 * sign * reach * 0.5_f64.powi(k as i32) };
                }
                let (series, sums) = series(&law, &slip);
                let bounds = series.bounds(&law, 0.0, 0, &sums);
                let slopes = series.slopes(&law);
                prop_assert!(bounds.truncation < 1e-6, "{name}: {:e}", bounds.truncation);
                for s in (0..=16).map(|k| f64::from(k) / 16.0) {
                    let here = at(&slip, s);
                    let off = (at(&series.excess, s) - law.excess(here)).abs();
                    // Of the formula, and of S.
                    let rounding = 32.0 * UNIT * (law.value(here) + at_rest + bounds.slope() * here.abs());
                    let bound = bounds.truncation + bounds.rounding + rounding;
                    prop_assert!(off <= bound, "{name} at {s}: {off:e} {bound:e}");
                    let slope = law.slope(here);
                    prop_assert!(slope.abs() <= bounds.slope(), "{name} at {s}: {slope} {}", bounds.slope());
                    prop_assert!(series.least_slope(&law, 0.0) <= slope + 1e-9 * slope.abs());
                    let apart = (at(&slopes, s) - slope).abs();
                    prop_assert!(apart <= 1e-6 * bounds.slope(), "{name} at {s}: {apart:e}");
                    let step = 1e-4 * (speed + here.abs());
                    let numeric = (law.value(here + step) - law.value(here - step)) / (2.0 * step);
                    prop_assert!((numeric - slope).abs() <= 1e-5 * bounds.slope(), "{name}: {numeric} {slope}");
                }
                let level = law.value(speed * decay.level()) - viscous * speed * decay.level() - kinetic;
                prop_assert!(level.abs() <= 0.011 * (at_rest - kinetic).abs());
            }
        }
    }
}
