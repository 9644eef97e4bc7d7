//! Products with rows that are subtracted in doubled precision, for the vector unit.

use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group};

/// `sum - row . moved`
pub(super) struct LessDot<'a> {
    pub sum: Doubled,
    pub row: &'a [f64],
    pub moved: &'a [f64],
}

impl Kernel for LessDot<'_> {
    type Output = Doubled;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Doubled {
        let Self { sum, row, moved } = self;
        let ((a, a_rest), (b, b_rest)) = (row.as_chunks::<GROUP>(), moved.as_chunks::<GROUP>());
        let ((pairs, odd), (pairs_b, odd_b)) = (a.as_chunks::<2>(), b.as_chunks::<2>());
        // Two sums hide half of the latency of additions.
        let [mut even, mut other] = [[ZEROS; 2]; 2];
        for (&[a, c], &[b, d]) in pairs.iter().zip(pairs_b) {
            even = less_product(simd, even, group(a), group(b));
            other = less_product(simd, other, group(c), group(d));
        }
        for (&a, &b) in odd.iter().zip(odd_b) {
            even = less_product(simd, even, group(a), group(b));
        }
        let terms = a_rest.iter().zip(b_rest).map(|(&a, &b)| Doubled::product(-a, b));
        [even, other].into_iter().fold(terms.fold(sum, Doubled::add), |total, part| {
            let [high, low]: [[f64; GROUP]; 2] = part.map(pulp::cast);
            (0..GROUP)
                .fold(total, |total, lane| total.add(Doubled { high: high[lane], low: low[lane] }))
        })
    }
}

/// `sum -= row by`, with `by` in doubled precision.
pub(super) struct LessRow<'a> {
    pub row: &'a [Group],
    pub by: [f64; 2],
    pub sum: &'a mut [Group],
    pub low: &'a mut [Group],
}

impl Kernel for LessRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { row, by, sum, low } = self;
        let [high, rest] = by.map(|by| group([by; GROUP]));
        for ((sum, low), &row) in sum.iter_mut().zip(low).zip(row) {
            [*sum, *low] = less_product(simd, [*sum, *low], row, high);
            *low = simd.negate_mul_add_f64s(row, rest, *low);
        }
    }
}

/// `sum - a b`, with what rounding loses added to the second part.
#[inline(always)]
pub(crate) fn less_product<S: Lanes>(
    simd: S,
    [sum, low]: [Group; 2],
    a: Group,
    b: Group,
) -> [Group; 2] {
    let product = simd.mul_f64s(a, b);
    // `product - a b`
    let lost = simd.negate_mul_add_f64s(a, b, product);
    let total = simd.sub_f64s(sum, product);
    let part = simd.sub_f64s(total, sum);
    let of_sum = simd.sub_f64s(sum, simd.sub_f64s(total, part));
    let of_product = simd.add_f64s(product, part);
    let lost = simd.add_f64s(simd.sub_f64s(of_sum, of_product), lost);
    [total, simd.add_f64s(low, lost)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::simd::VectorUnit;

    /// `sum - a b`, of four numbers each.
    struct Less([[f64; GROUP]; 4]);

    impl Kernel for Less {
        type Output = [Group; 2];

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> [Group; 2] {
            let [sum, low, a, b] = self.0.map(group);
            less_product(simd, [sum, low], a, b)
        }
    }

    proptest! {
        /// A product is subtracted as doubled numbers are, and the same on every vector unit.
        #[test]
        fn products_are_subtracted_in_doubled_precision(
            parts in proptest::array::uniform4(proptest::array::uniform4(-1.0..1.0f64)),
        ) {
            let [sum, low, a, b] = parts;
            let low = low.map(|part| 1e-17 * part);
            let by = |unit: VectorUnit| -> [[f64; GROUP]; 2] {
                unit.run(Less([sum, low, a, b])).map(pulp::cast)
            };
            let [high, rest] = by(VectorUnit::default());
            prop_assert_eq!([high, rest], by(VectorUnit::Portable));
            for lane in 0..GROUP {
                let before = Doubled { high: sum[lane], low: low[lane] };
                let expected = before.add(Doubled::product(-a[lane], b[lane]));
                let found = Doubled::from(high[lane]).add(Doubled::from(rest[lane]));
                let error = (found.high - expected.high) + (found.low - expected.low);
                prop_assert!(error.abs() <= 1e-31, "{found:?} of {expected:?}");
            }
        }

        /// The sum in doubled numbers one after the other.
        #[test]
        fn dots_are_sums_in_doubled_precision(
            sum in -1.0..1.0f64,
            pairs in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 0..60),
        ) {
            let (row, moved): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let sum = Doubled::from(sum);
            let by = |unit: VectorUnit| unit.run(LessDot { sum, row: &row, moved: &moved });
            let [found, portable] = [VectorUnit::default(), VectorUnit::Portable].map(by);
            prop_assert_eq!((found.high, found.low), (portable.high, portable.low));
            let terms = row.iter().zip(&moved).map(|(&a, &b)| Doubled::product(-a, b));
            let error = found.add(terms.fold(sum, Doubled::add).times(-1.0)).value();
            prop_assert!(error.abs() <= 1e-29, "{error:e}");
        }
    }
}
