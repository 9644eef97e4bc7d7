//! Intervals with outward rounding, and numbers with two derivatives.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What formulas are evaluated with.
pub(crate) trait Number:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    /// The power to a constant exponent, of a positive number.
    fn powf(self, exponent: f64) -> Self;
    fn tanh(self) -> Self;
    fn atan(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn square(self) -> Self;
}

impl Number for f64 {
    fn exp(self) -> Self {
        self.exp()
    }
    fn ln(self) -> Self {
        self.ln()
    }
    fn powf(self, exponent: f64) -> Self {
        self.powf(exponent)
    }
    fn tanh(self) -> Self {
        self.tanh()
    }
    fn atan(self) -> Self {
        self.atan()
    }
    fn sin(self) -> Self {
        self.sin()
    }
    fn cos(self) -> Self {
        self.cos()
    }
    fn square(self) -> Self {
        self * self
    }
}

/// All numbers from `low` to `high`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// Units in the last place by which a function of the standard library may be off.
const UNITS: usize = 2;
/// Distance of an angle from a turn, relative to the angle, that may be none.
const TURNED: f64 = 1e-12;

impl Interval {
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// What a sum or a product was rounded to, widened by one unit on either side.
    fn around(low: f64, high: f64) -> Self {
        match low.is_nan() || high.is_nan() {
            true => Self::ALL,
            false => Self { low: low.next_down(), high: high.next_up() },
        }
    }

    fn monotone(self, function: impl Fn(f64) -> f64) -> Self {
        let widened = |one: Self, _| Self::around(one.low, one.high);
        let ends = Self { low: function(self.low), high: function(self.high) };
        (0..UNITS).fold(ends, widened)
    }

    /// A sine or a cosine, which is 1 at `top` and every turn from there.
    fn wave(self, function: impl Fn(f64) -> f64, top: f64) -> Self {
        let slack = TURNED * (1.0 + self.largest());
        // Whether a turn from there is within, or next to it.
        let holds = |at: f64| {
            let [low, high] = [self.low - slack, self.high + slack].map(|x| (x - at) / TAU);
            !(high.floor() <= low.floor())
        };
        let [first, last] = [self.low, self.high].map(function);
        let ends = Self { low: first.min(last), high: first.max(last) }.monotone(|x| x);
        Self {
            low: if holds(top + PI) { -1.0 } else { ends.low.max(-1.0) },
            high: if holds(top) { 1.0 } else { ends.high.min(1.0) },
        }
    }

    /// The largest and the smallest absolute value.
    pub fn largest(self) -> f64 {
        f64::max(-self.low, self.high)
    }

    pub fn smallest(self) -> f64 {
        self.low.max(-self.high).max(0.0)
    }
}

impl From<f64> for Interval {
    fn from(value: f64) -> Self {
        Self { low: value, high: value }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::around(self.low + other.low, self.high + other.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let zero = Self::from(0.0);
        if self == zero || other == zero {
            return zero;
        }
        let ends = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        if ends.iter().any(|end| end.is_nan()) {
            return Self::ALL;
        }
        let low = ends.iter().copied().fold(f64::INFINITY, f64::min);
        Self::around(low, ends.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match other.smallest() > 0.0 {
            true => self * Self::around(1.0 / other.high, 1.0 / other.low),
            false => Self::ALL,
        }
    }
}

impl Number for Interval {
    fn exp(self) -> Self {
        let Self { low, high } = self.monotone(f64::exp);
        Self { low: low.max(0.0), high }
    }

    fn ln(self) -> Self {
        if self.low > 0.0 { self.monotone(f64::ln) } else { Self::ALL }
    }

    fn powf(self, exponent: f64) -> Self {
        match (self.low > 0.0, exponent < 0.0) {
            (false, _) => Self::ALL,
            (true, false) => self.monotone(|x| x.powf(exponent)),
            (true, true) => Self { low: self.high, high: self.low }.monotone(|x| x.powf(exponent)),
        }
    }

    fn tanh(self) -> Self {
        let Self { low, high } = self.monotone(f64::tanh);
        Self { low: low.max(-1.0), high: high.min(1.0) }
    }

    fn atan(self) -> Self {
        self.monotone(f64::atan)
    }

    fn sin(self) -> Self {
        self.wave(f64::sin, FRAC_PI_2)
    }

    fn cos(self) -> Self {
        self.wave(f64::cos, 0.0)
    }

    fn square(self) -> Self {
        let [low, high] = [self.smallest(), self.largest()];
        let Self { low, high } = Self::around(low * low, high * high);
        Self { low: low.max(0.0), high }
    }
}

/// A function of one argument with its first and second derivative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Jet<T> {
    pub value: T,
    pub first: T,
    pub second: T,
}

impl<T: Number> Jet<T> {
    pub fn argument(value: T) -> Self {
        Self { value, first: 1.0.into(), second: 0.0.into() }
    }

    pub fn constant(value: f64) -> Self {
        Self { value: value.into(), first: 0.0.into(), second: 0.0.into() }
    }

    pub fn affine(self, factor: f64, shift: f64) -> Self {
        let Self { value, first, second } = self;
        let factor = T::from(factor);
        Self {
            value: factor * value + shift.into(),
            first: factor * first,
            second: factor * second,
        }
    }

    pub fn sum(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }

    pub fn product(self, other: Self) -> Self {
        let crossed = self.first * other.first;
        Self {
            value: self.value * other.value,
            first: self.value * other.first + self.first * other.value,
            second: self.value * other.second + self.second * other.value + crossed + crossed,
        }
    }

    /// From `q b = a`: `q' = (a' - q b') / b`, `q'' = (a'' - 2 q' b' - q b'') / b`.
    pub fn quotient(self, divisor: Self) -> Self {
        let value = self.value / divisor.value;
        let first = (self.first - value * divisor.first) / divisor.value;
        let crossed = first * divisor.first;
        let second = self.second - crossed - crossed - value * divisor.second;
        Self { value, first, second: second / divisor.value }
    }

    /// A function of it, by its value and its derivatives there.
    fn chain(self, value: T, first: T, second: T) -> Self {
        Self {
            value,
            first: first * self.first,
            second: second * self.first * self.first + first * self.second,
        }
    }

    pub fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value, value)
    }

    pub fn ln(self) -> Self {
        let inverse = T::from(1.0) / self.value;
        self.chain(self.value.ln(), inverse, -(inverse * inverse))
    }

    pub fn powf(self, exponent: f64) -> Self {
        let of = |factor: f64, below: f64| T::from(factor) * self.value.powf(exponent - below);
        let second = of(exponent * (exponent - 1.0), 2.0);
        self.chain(self.value.powf(exponent), of(exponent, 1.0), second)
    }

    pub fn tanh(self) -> Self {
        let value = self.value.tanh();
        // `1 - tanh^2` loses its digits where tanh is about 1.
        let cosine = self.value.exp() + (-self.value).exp();
        let first = T::from(4.0) / (cosine * cosine);
        self.chain(value, first, -(value * first + value * first))
    }

    pub fn atan(self) -> Self {
        let first = T::from(1.0) / (T::from(1.0) + self.value.square());
        let turned = self.value * first * first;
        self.chain(self.value.atan(), first, -(turned + turned))
    }

    pub fn sin(self) -> Self {
        let [sine, cosine] = [self.value.sin(), self.value.cos()];
        self.chain(sine, cosine, -sine)
    }

    pub fn cos(self) -> Self {
        let [sine, cosine] = [self.value.sin(), self.value.cos()];
        self.chain(cosine, -sine, -cosine)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Function = fn(f64) -> f64;

    proptest! {
        /// A function of an interval holds its values there, and no more than these where the interval is short.
        #[test]
        fn functions_of_intervals_hold_their_values(low in -20.0..20.0f64, width in 0.0..8.0f64) {
            const PARTS: u32 = 400;
            let interval = Interval { low, high: low + width };
            let functions: [(Function, Interval); 4] = [
                (f64::sin, interval.sin()),
                (f64::cos, interval.cos()),
                (f64::atan, interval.atan()),
                (|x| x * x, interval.square()),
            ];
            for (function, found) in functions {
                let values = (0..=PARTS).map(|part| {
                    function((low + width * f64::from(part) / f64::from(PARTS)).min(interval.high))
                });
                let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                    (a.min(x), b.max(x))
                });
                prop_assert!(found.low <= least && most <= found.high, "{found:?}");
                // The slopes are at most 56.
                let step = 1e-9 + 56.0 * width / f64::from(PARTS);
                prop_assert!(least - found.low <= step && found.high - most <= step, "{found:?}");
            }
        }
    }
}
