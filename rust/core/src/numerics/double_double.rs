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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Integers that doubles hold exactly.
    const WHOLE: i64 = 1 << 53;

    /// The exact value of a sum of two whole doubles.
    fn exact(x: Doubled) -> i128 {
        x.high as i128 + x.low as i128
    }

    /// A whole number of at most 104 bits as the sum of two doubles.
    fn doubled(whole: i128) -> Doubled {
        let high = whole as f64;
        let low = (whole - high as i128) as f64;
        let number = Doubled { high, low };
        assert_eq!(exact(number), whole);
        number
    }

    /// The relative error of an operation on doubled numbers: some units of 2^-104.
    const ACCURACY: f64 = 16.0 / (1u128 << 104) as f64;

    fn near(found: Doubled, expected: i128, size: i128) -> bool {
        let error = exact(found) - expected;
        error.unsigned_abs() as f64 <= ACCURACY * size.unsigned_abs() as f64 + 1.0
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5000))]

        /// Sums of doubles whose exponents differ by up to 60, and products, are exact.
        #[test]
        fn sums_and_products_are_exact(a in -WHOLE..WHOLE, b in -WHOLE..WHOLE, shift in 0u32..60) {
            let (large, small) = ((i128::from(a) << shift) as f64, b as f64);
            let (sum, error) = two_sum(large, small);
            prop_assert_eq!(sum as i128 + error as i128, (i128::from(a) << shift) + i128::from(b));
            prop_assert_eq!(sum, large + small);
            let (product, error) = two_product(a as f64, b as f64);
            prop_assert_eq!(product as i128 + error as i128, i128::from(a) * i128::from(b));
            prop_assert_eq!(product, a as f64 * b as f64);
            prop_assert_eq!(exact(Doubled::product(a as f64, b as f64)), i128::from(a) * i128::from(b));
        }

        #[test]
        fn sums_of_doubled_numbers(a in -WHOLE..WHOLE, b in -WHOLE..WHOLE, c in -WHOLE..WHOLE, d in -WHOLE..WHOLE) {
            let (x, y) = (i128::from(a) * i128::from(b), i128::from(c) * i128::from(d));
            // Both are rounded to half an ulp of the low part of the larger.
            prop_assert!(near(doubled(x / 4).add(doubled(y / 4)), x / 4 + y / 4, x.abs() + y.abs()));
        }

        #[test]
        fn products_of_doubled_numbers(a in any::<i64>(), b in any::<i64>(), factor in -(1i64 << 53)..(1 << 53)) {
            let (a, b) = (i128::from(a) >> 1, i128::from(b) >> 2);
            prop_assert!(near(doubled(a).by(doubled(b)), a * b, a * b));
            prop_assert!(near(doubled(a).times(factor as f64), a * i128::from(factor), a * i128::from(factor)));
        }

        /// Quotients without a remainder, and the one of 1, which times the divisor is 1 again.
        #[test]
        fn quotients(divisor in 1i64..1 << 51, quotient in -(1i64 << 51)..1 << 51) {
            let dividend = doubled(i128::from(divisor) * i128::from(quotient));
            let found = dividend.over((divisor as f64).into());
            let error = found.add((-quotient as f64).into()).value();
            prop_assert!(error.abs() <= ACCURACY * quotient.abs() as f64, "{error}");
            let inverse = Doubled::from(1.0).over((divisor as f64).into());
            let error = inverse.times(divisor as f64).add((-1.0).into()).value();
            prop_assert!(error.abs() <= ACCURACY, "{error}");
        }

        /// Terms of both signs that nearly cancel: the sum of their moduli says what is lost.
        #[test]
        fn dot_products(terms in proptest::collection::vec((-WHOLE..WHOLE, -WHOLE..WHOLE), 1..40)) {
            let whole: i128 = terms.iter().map(|&(a, b)| i128::from(a) * i128::from(b)).sum();
            let size: i128 = terms.iter().map(|&(a, b)| (i128::from(a) * i128::from(b)).abs()).sum();
            let products = terms.iter().map(|&(a, b)| Doubled::product(a as f64, b as f64));
            let found = products.fold(Doubled::default(), Doubled::add);
            let last = terms.len() as f64 * ACCURACY * size as f64 + 1.0;
            prop_assert!((exact(found) - whole).unsigned_abs() as f64 <= last);
        }

        /// A complex product is two real ones in each part; the real way through `less` is the complex one.
        #[test]
        fn complex_products(
            re in -WHOLE / 2..WHOLE / 2,
            im in -WHOLE / 2..WHOLE / 2,
            c in -WHOLE / 2..WHOLE / 2,
            s in -WHOLE / 2..WHOLE / 2,
        ) {
            let z = DoubledComplex { re: (re as f64).into(), im: (im as f64).into() };
            let product = z.times(Complex64::new(c as f64, s as f64));
            let of = |a: i64, b: i64| i128::from(a) * i128::from(b);
            prop_assert_eq!(exact(product.re), of(re, c) - of(im, s));
            prop_assert_eq!(exact(product.im), of(re, s) + of(im, c));
            let one = DoubledComplex { re: 1.0.into(), im: 1.0.into() };
            let real = one.less(&z, Complex64::from(c as f64));
            let part = |x: i64| (1 - of(x, c)) as f64;
            prop_assert_eq!(real, Complex64::new(part(re), part(im)));
        }
    }
}
