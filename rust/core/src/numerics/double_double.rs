//! Sums and products carried to twice the working precision.
//!
//! Error-free transformations of Dekker (1971) and Knuth; no fused multiply-add is assumed, so the
//! result is the same on every machine.

use num_complex::Complex64;

/// An unevaluated sum `high + low` with |low| <= ulp(high) / 2.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Doubled {
    pub high: f64,
    pub low: f64,
}

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// The product and its rounding error; exact unless the product leaves the range 1e-290 .. 1e300.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    // 2^27 + 1 splits 53 bits into 26 + 26.
    const SPLITTER: f64 = 134_217_729.0;
    let split = |x: f64| {
        let scaled = SPLITTER * x;
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let product = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (product, ((ah * bh - product) + ah * bl + al * bh) + al * bl)
}

impl From<f64> for Doubled {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Doubled {
    /// The product of two doubles without rounding.
    pub fn product(a: f64, b: f64) -> Self {
        let (high, low) = two_product(a, b);
        Self { high, low }
    }

    pub fn add(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.high, other.high);
        let (high, low) = two_sum(sum, error + self.low + other.low);
        Self { high, low }
    }

    pub fn times(self, factor: f64) -> Self {
        let (product, error) = two_product(self.high, factor);
        let (high, low) = two_sum(product, error + self.low * factor);
        Self { high, low }
    }

    /// `self * other`
    pub fn by(self, other: Self) -> Self {
        let (product, error) = two_product(self.high, other.high);
        let (high, low) = two_sum(product, error + (self.high * other.low + self.low * other.high));
        Self { high, low }
    }

    /// `self / other`, by long division.
    pub fn over(self, other: Self) -> Self {
        let mut rest = self;
        let mut quotient = Self::default();
        for _ in 0..3 {
            let digit = rest.high / other.high;
            quotient = quotient.add(digit.into());
            rest = rest.add(other.times(-digit));
        }
        quotient
    }

    /// `sum_k weight_k x_k`
    pub fn dot(terms: impl Iterator<Item = (Self, f64)>) -> Self {
        terms.fold(Self::default(), |sum, (weight, x)| {
            let (high, low) = two_product(weight.high, x);
            sum.add(Self { high, low: low + weight.low * x })
        })
    }

    pub fn value(self) -> f64 {
        self.high + self.low
    }
}

/// A complex number of two [`Doubled`] parts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DoubledComplex {
    pub re: Doubled,
    pub im: Doubled,
}

impl DoubledComplex {
    pub fn add(self, other: Self) -> Self {
        Self { re: self.re.add(other.re), im: self.im.add(other.im) }
    }

    pub fn times(self, factor: Complex64) -> Self {
        Self {
            re: self.re.times(factor.re).add(self.im.times(-factor.im)),
            im: self.re.times(factor.im).add(self.im.times(factor.re)),
        }
    }

    /// `self - factor other`, rounded.
    pub fn less(&self, other: &Self, factor: Complex64) -> Complex64 {
        if factor.im == 0.0 {
            let part = |a: Doubled, b: Doubled| a.add(b.times(-factor.re)).value();
            return Complex64::new(part(self.re, other.re), part(self.im, other.im));
        }
        self.add(other.times(-factor)).value()
    }

    /// `sum_k weight_k z_k`
    pub fn dot(terms: impl Iterator<Item = (Doubled, Complex64)>) -> Self {
        terms.fold(Self::default(), |sum, (weight, z)| {
            let product = |part: f64| {
                let (high, low) = two_product(weight.high, part);
                Doubled { high, low: low + weight.low * part }
            };
            sum.add(Self { re: product(z.re), im: product(z.im) })
        })
    }

    pub fn value(self) -> Complex64 {
        Complex64::new(self.re.value(), self.im.value())
    }
}
