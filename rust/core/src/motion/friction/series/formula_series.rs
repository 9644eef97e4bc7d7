//! Taylor series of a formula along an argument S that is a polynomial on [0, 1], with a bound of their error.
//!
//! Every operation has its recurrence. With the coefficients a_k, b_k of its operands, and `a_0 > 0` in the logarithm and the
//! power,
//!
//! ```text
//! product      c_k = sum_i a_i b_{k-i}
//! quotient     b_0 q_k = a_k - sum_{i>0} b_i q_{k-i}
//! exponential  k e_k = sum_{i>0} i a_i e_{k-i}                                     e' = a' e
//! logarithm    a_0 l_k = a_k - 1/k sum_{0<i<k} i l_i a_{k-i}                       a l' = a'
//! power c      k a_0 p_k = sum_{i>0} (c i a_i p_{k-i}) - sum_{0<i<k} a_i (k-i) p_{k-i}    a p' = c a' p
//! tangent      k t_k = k a_k - sum_{i>0} i a_i w_{k-i},  w = t^2                   t' = (1 - t^2) a'
//! arctangent   b_0 r_k = a_k - 1/k sum_{0<i<k} i r_i b_{k-i},  b = 1 + a^2         b r' = a'
//! sine         k s_k = sum_{i>0} i a_i c_{k-i},  k c_k = -sum_{i>0} i a_i s_{k-i}  s' = c a', c' = -s a'
//! ```
//!
//! (Knuth, The Art of Computer Programming 2, 4.7; Griewank and Walther, Evaluating Derivatives, 13.2). The polynomial of a slot
//! obeys its equation up to a rest R of the orders that the series leaves out and of rounding: finite sums. The error follows:
//! with A for the polynomial that stands for a, and `least` for the smallest |A| on the panel,
//!
//! ```text
//! product      R + |A| |B - b| + |b| |A - a|
//! quotient     (R + |A - a| + |q| |B - b|) / least B
//! exponential  max e / min e int |R| + max e |A - a|
//! logarithm    (int |R| + |A - a|) / least
//! power        max p / min p int |R| / least + |c| max p / least |A - a|
//! tangent      e^(2 int |A'|) int |R| + |A - a|
//! arctangent   (int |R| + int |A'| |1 + A^2 - B|) / least B + |A - a|
//! sine         int (|R_s| + |R_c|) + |A - a|, as both turn about zero
//! ```

use crate::motion::friction::series::coefficients::{LawBounds, UNIT, product_units, scale, size};
use crate::motion::taylor::motion::ORDERS;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::interval::{Interval, Jet};
use crate::numerics::simd::GROUP;
use crate::scene::friction::decay::{product, terms_left_out};
use crate::scene::friction::formula::{Formula, Operation, seeds};

/// Below it an exponential counts as zero: products with it would leave the range of numbers.
const VANISHED: f64 = 1e-260;
/// Largest error of what an exponential is taken of for which its own is bounded.
const SMALL: f64 = 1e-2;
/// Units of rounding of a function of the standard library and of its argument.
const FUNCTION: f64 = 4.0;

type Series = [f64; COEFFICIENTS];

/// The coefficients a_k of a slot, and `k a_k`.
#[derive(Debug, Clone)]
struct Slot {
    terms: Series,
    rates: Series,
}

/// All slots of a formula along a panel.
#[derive(Debug, Clone, Default)]
pub(crate) struct FormulaSeries {
    slots: Vec<Slot>,
    /// What lower orders add to the order sought of a product.
    ahead: Vec<f64>,
    /// How far S and the state may move from where they begin.
    pub reaches: [f64; 2],
}

/// Bounds of what the polynomial of a slot is off by: truncation, which grows with the power COEFFICIENTS of the width or
/// faster, and rounding.
#[derive(Debug, Clone, Copy, Default)]
struct Off {
    cut: f64,
    round: f64,
}

impl Off {
    fn sum(self) -> f64 {
        self.cut + self.round
    }

    fn times(self, factor: f64) -> Self {
        Self { cut: factor * self.cut, round: factor * self.round }
    }

    fn plus(self, other: Self) -> Self {
        Self { cut: self.cut + other.cut, round: self.round + other.round }
    }
}

/// `sum a_i b_{k-i}` over i from `first` to `last`, in sums that do not wait for each other.
#[inline(always)]
fn convolved(a: &Series, b: &Series, k: usize, first: usize, last: usize) -> f64 {
    if first > last {
        return 0.0;
    }
    let (a, b) = (&a[first..=last], &b[k - last..=k - first]);
    let (left, right) = (a.chunks_exact(GROUP), b.rchunks_exact(GROUP));
    let rest = left.remainder().iter().zip(right.remainder().iter().rev());
    let rest = rest.fold(0.0, |sum, (a, b)| a.mul_add(*b, sum));
    let mut sums = [0.0; GROUP];
    for (a, b) in left.zip(right) {
        for lane in 0..GROUP {
            sums[lane] = a[lane].mul_add(b[GROUP - 1 - lane], sums[lane]);
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// `sum a_i a_{k-i}` over i from 1 to k - 1, each pair of terms once; k from 2 on.
#[inline(always)]
fn squared(a: &Series, k: usize) -> f64 {
    let middle = if k.is_multiple_of(2) { a[k / 2] * a[k / 2] } else { 0.0 };
    2.0_f64.mul_add(convolved(a, a, k, 1, k.div_ceil(2) - 1), middle)
}

/// The coefficients of a quotient.
fn quotient(a: &Series, b: &Series) -> Series {
    let mut q = [0.0; COEFFICIENTS];
    for k in 0..COEFFICIENTS {
        let lower: f64 = (1..=k).map(|i| b[i] * q[k - i]).sum();
        q[k] = (a[k] - lower) / b[0];
    }
    q
}

impl FormulaSeries {
    /// The coefficient of mu of order k, from those of S and of the state.
    #[inline(always)]
    pub fn order(&mut self, formula: &Formula, k: usize, s: f64, z: f64) -> f64 {
        let operations = formula.operations();
        if k == 0 {
            let zeros = Slot { terms: [0.0; COEFFICIENTS], rates: [0.0; COEFFICIENTS] };
            self.slots.resize(operations.len() + 1, zeros);
            self.reaches = formula.reaches(s, z);
        }
        self.run_ahead(operations, k);
        let order = k as f64;
        let Slot { terms, rates } = &mut self.slots[0];
        (terms[k], rates[k]) = (s, order * s);
        let mut value = s;
        for (place, operation) in operations.iter().enumerate() {
            let (slots, rest) = self.slots.split_at_mut(place + 1);
            let of = |slot: usize| slots[slot].terms[k];
            let own = &rest[0];
            let at_start = |start: f64, constant: f64| if k == 0 { start } else { constant };
            value = match *operation {
                Operation::Constant(value) => at_start(value, 0.0),
                Operation::State => z,
                Operation::Affine { of: slot, factor, shift } => {
                    factor.mul_add(of(slot), at_start(shift, 0.0))
                }
                Operation::Sum(a, b) => of(a) + of(b),
                Operation::Product(a, b) if k == 0 => of(a) * of(b),
                Operation::Product(a, b) => {
                    let [a, b] = [a, b].map(|slot| &slots[slot].terms);
                    a[0].mul_add(b[k], a[k].mul_add(b[0], self.ahead[place]))
                }
                Operation::Quotient(a, b) => {
                    let lower = convolved(&slots[b].terms, &own.terms, k, 1, k);
                    (of(a) - lower) / slots[b].terms[0]
                }
                Operation::Exponential(a) if k == 0 => {
                    let value = of(a).exp();
                    if value < VANISHED { 0.0 } else { value }
                }
                Operation::Exponential(a) => {
                    convolved(&slots[a].rates, &own.terms, k, 1, k) / order
                }
                Operation::Logarithm(a) if k == 0 => of(a).ln(),
                Operation::Power(a, exponent) if k == 0 => of(a).powf(exponent),
                Operation::Power(a, exponent) => {
                    let Slot { terms, rates } = &slots[a];
                    let of_rates = exponent * convolved(rates, &own.terms, k, 1, k);
                    (of_rates - convolved(terms, &own.rates, k, 1, k - 1)) / (order * terms[0])
                }
                Operation::Tangent(a) if k == 0 => of(a).tanh(),
                Operation::Tangent(a) => {
                    let square = &rest[1].terms;
                    let lower = convolved(&slots[a].rates, square, k, 1, k - 1);
                    ((1.0 - square[0]) * slots[a].rates[k] - lower) / order
                }
                Operation::Arctangent(a, _) if k == 0 => of(a).atan(),
                Operation::Logarithm(a @ divisor) | Operation::Arctangent(a, divisor) => {
                    let divisor = &slots[divisor].terms;
                    (of(a) - convolved(&own.rates, divisor, k, 1, k - 1) / order) / divisor[0]
                }
                Operation::Sine(a) if k == 0 => of(a).sin(),
                Operation::Cosine(a) if k == 0 => of(a).cos(),
                Operation::Sine(a) => convolved(&slots[a].rates, &rest[1].terms, k, 1, k) / order,
                Operation::Cosine(a) => {
                    -convolved(&slots[a].rates, &slots[place].terms, k, 1, k) / order
                }
            };
            let Slot { terms, rates } = &mut rest[0];
            (terms[k], rates[k]) = (value, order * value);
        }
        value
    }

    /// The sums of the terms of order k of products that lower orders give: none of them waits for another.
    #[inline(always)]
    fn run_ahead(&mut self, operations: &[Operation], k: usize) {
        let Self { slots, ahead, .. } = self;
        ahead.resize(operations.len(), 0.0);
        for (operation, ahead) in operations.iter().zip(ahead) {
            *ahead = match *operation {
                Operation::Product(..) if k < 2 => 0.0,
                Operation::Product(a, b) if a == b => squared(&slots[a].terms, k),
                Operation::Product(a, b) => {
                    convolved(&slots[a].terms, &slots[b].terms, k, 1, k - 1)
                }
                _ => continue,
            };
        }
    }

    /// The same series for a shorter panel.
    #[inline(always)]
    pub fn shorten(&mut self, powers: &[f64; ORDERS]) {
        for Slot { terms, rates } in &mut self.slots {
            scale(terms, powers);
            scale(rates, powers);
        }
    }

    /// Bounds of mu on a panel that was shortened some times: of its error where S and the state are their polynomials, and of
    /// its slopes where they are within `wide` of where they begin.
    pub fn bounds(
        &self,
        formula: &Formula,
        [(speed, wide), (state, state_wide)]: [(f64, f64); 2],
        shortenings: usize,
    ) -> (LawBounds, f64) {
        let around = |at: f64, wide: f64| Interval { low: at - wide, high: at + wide };
        let [by_speed, by_state] = seeds(around(speed, wide), around(state, state_wide));
        let jets: Vec<Jet<Interval>> = formula.slots(by_speed);
        let short = (3 + 2 * shortenings) as f64;
        let of_product = product_units(shortenings) as f64;
        // An order k of a product is integrated, and counts with 1 / k of its units.
        let of_integral = (5 + 4 * shortenings) as f64;
        let integral = 1.0 / COEFFICIENTS as f64;
        let sizes: Vec<[f64; 2]> =
            self.slots.iter().map(|slot| [size(&slot.terms), size(&slot.rates)]).collect();
        let mut all = vec![Off::default(); self.slots.len()];
        for (place, operation) in formula.operations().iter().enumerate() {
            let slot = place + 1;
            let own = &self.slots[slot];
            let [terms, rates] = sizes[slot];
            let largest = |of: usize| jets[of].value.largest();
            let least = |of: usize| jets[of].value.smallest() - all[of].sum();
            let left_out = |a: &Series, b: &Series| terms_left_out(a, b);
            all[slot] = match *operation {
                Operation::Constant(_) | Operation::State => Off::default(),
                Operation::Affine { of, factor, shift } => {
                    let terms = factor.abs() * sizes[of][0] + shift.abs();
                    all[of].times(factor.abs()).plus(Off { cut: 0.0, round: UNIT * short * terms })
                }
                Operation::Sum(a, b) => {
                    let round = UNIT * short * (sizes[a][0] + sizes[b][0]);
                    all[a].plus(all[b]).plus(Off { cut: 0.0, round })
                }
                Operation::Product(a, b) => {
                    let own = Off {
                        cut: left_out(&self.slots[a].terms, &self.slots[b].terms),
                        round: UNIT * of_product * sizes[a][0] * sizes[b][0],
                    };
                    own.plus(all[b].times(sizes[a][0])).plus(all[a].times(largest(b)))
                }
                Operation::Quotient(a, b) => {
                    let own = Off {
                        cut: left_out(&self.slots[b].terms, &own.terms),
                        round: UNIT * of_product * (sizes[b][0] * terms + sizes[a][0]),
                    };
                    let of_operands = all[a].plus(all[b].times(largest(slot)));
                    own.plus(of_operands).times(inverse(least(b)))
                }
                // What vanishes is dropped: it grows by no power of the width.
                Operation::Exponential(_) if own.terms[0] == 0.0 => {
                    Off { cut: 0.0, round: largest(slot) }
                }
                Operation::Exponential(a) => {
                    let Interval { low, high } = jets[a].value;
                    let off = all[a].sum();
                    let ratio =
                        if off < SMALL { (high - low + 2.0 * off).exp() } else { f64::INFINITY };
                    let own = Off {
                        cut: integral * left_out(&self.slots[a].rates, &own.terms),
                        round: UNIT * (of_integral * sizes[a][1] * terms + FUNCTION * own.terms[0]),
                    };
                    own.times(ratio).plus(all[a].times((1.0 + SMALL) * largest(slot)))
                }
                Operation::Logarithm(a) => {
                    let of = &self.slots[a];
                    let own_off = Off {
                        cut: integral * left_out(&own.rates, &of.terms),
                        round: UNIT * of_integral * (rates * sizes[a][0] + sizes[a][1]),
                    };
                    let start = Off { cut: 0.0, round: FUNCTION * UNIT * own.terms[0].abs() };
                    own_off.plus(all[a]).times(inverse(least(a))).plus(start)
                }
                Operation::Power(a, exponent) => {
                    let (of, exponent) = (&self.slots[a], exponent.abs());
                    let inverse = inverse(least(a));
                    let ratio = ((largest(a) + all[a].sum()) * inverse).powf(exponent);
                    let left = exponent * left_out(&of.rates, &own.terms)
                        + left_out(&own.rates, &of.terms);
                    let products = exponent * sizes[a][1] * terms + sizes[a][0] * rates;
                    let start = FUNCTION * (1.0 + exponent) * own.terms[0];
                    let own = Off {
                        cut: integral * left * inverse,
                        round: UNIT * (of_integral * products * inverse + start),
                    };
                    let of_operand = exponent * ratio * largest(slot) * inverse;
                    own.times(ratio).plus(all[a].times(of_operand))
                }
                Operation::Tangent(a) => {
                    let (of, square) = (&self.slots[a], &self.slots[slot + 1]);
                    let moving = sizes[a][0] - of.terms[0].abs();
                    let squared = left_out(&own.terms, &own.terms);
                    let products = of_integral * sizes[a][1] * (1.0 + sizes[slot + 1][0])
                        + moving * of_product * terms * terms;
                    let own = Off {
                        cut: integral * left_out(&of.rates, &square.terms) + moving * squared,
                        round: UNIT * (products + FUNCTION * own.terms[0].abs()),
                    };
                    own.times((2.0 * moving).exp()).plus(all[a])
                }
                Operation::Arctangent(a, more) => {
                    let (of, by) = (&self.slots[a], &self.slots[more]);
                    let moving = sizes[a][0] - of.terms[0].abs();
                    let divisor = all[more].plus(all[a].times(sizes[a][0] + largest(a)));
                    let rest = Off {
                        cut: integral * left_out(&own.rates, &by.terms),
                        round: UNIT * of_integral * (rates * sizes[more][0] + sizes[a][1]),
                    };
                    let start = Off { cut: 0.0, round: FUNCTION * UNIT * own.terms[0].abs() };
                    let turned = rest.plus(divisor.times(moving)).times(inverse(least(more)));
                    turned.plus(all[a]).plus(start)
                }
                Operation::Sine(a) | Operation::Cosine(a) => {
                    let first = match operation {
                        Operation::Sine(_) => slot,
                        _ => slot - 1,
                    };
                    let rest = |of: usize| Off {
                        cut: integral * left_out(&self.slots[a].rates, &self.slots[of].terms),
                        round: UNIT * (of_integral * sizes[a][1] * sizes[of][0] + FUNCTION),
                    };
                    rest(first).plus(rest(first + 1)).plus(all[a])
                }
            };
        }
        let last = self.slots.len() - 1;
        let bounded = |x: f64| if x.is_nan() { f64::INFINITY } else { x };
        let bounds = LawBounds {
            truncation: bounded(all[last].cut),
            rounding: bounded(all[last].round + UNIT * short * sizes[last][0]),
            slopes: jets[last].first,
        };
        let of_state = || bounded(formula.slots(by_state)[last].first.largest());
        (bounds, if formula.has_state() { of_state() } else { 0.0 })
    }

    /// The slopes over S, or over the state, along the panel, operation by operation.
    pub fn slopes(&self, formula: &Formula, over_state: bool) -> Series {
        let mut unit = [0.0; COEFFICIENTS];
        unit[0] = 1.0;
        let nothing = [0.0; COEFFICIENTS];
        let [of_speed, of_state] = if over_state { [nothing, unit] } else { [unit, nothing] };
        let mut slopes = vec![of_speed];
        for (place, operation) in formula.operations().iter().enumerate() {
            let of = |slot: usize| &self.slots[slot].terms;
            let own = of(place + 1);
            let sum = |a: &Series, b: &Series, sign: f64| -> Series {
                std::array::from_fn(|k| a[k] + sign * b[k])
            };
            slopes.push(match *operation {
                Operation::Constant(_) => nothing,
                Operation::State => of_state,
                Operation::Affine { of, factor, .. } => slopes[of].map(|c| factor * c),
                Operation::Sum(a, b) => sum(&slopes[a], &slopes[b], 1.0),
                Operation::Product(a, b) => {
                    sum(&product(&slopes[a], of(b)), &product(of(a), &slopes[b]), 1.0)
                }
                Operation::Quotient(a, b) => {
                    quotient(&sum(&slopes[a], &product(own, &slopes[b]), -1.0), of(b))
                }
                Operation::Exponential(a) => product(own, &slopes[a]),
                Operation::Logarithm(a) => quotient(&slopes[a], of(a)),
                Operation::Power(a, exponent) => {
                    quotient(&product(own, &slopes[a]).map(|c| exponent * c), of(a))
                }
                Operation::Tangent(a) => sum(&slopes[a], &product(of(place + 2), &slopes[a]), -1.0),
                Operation::Arctangent(a, more) => quotient(&slopes[a], of(more)),
                Operation::Sine(a) => product(of(place + 2), &slopes[a]),
                Operation::Cosine(a) => product(of(place), &slopes[a]).map(|c| -c),
            });
        }
        slopes[slopes.len() - 1]
    }
}

/// Its inverse where a divisor is positive.
fn inverse(divisor: f64) -> f64 {
    if divisor > 0.0 { 1.0 / divisor } else { f64::INFINITY }
}
