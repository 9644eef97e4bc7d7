//! Products with rows that are subtracted in doubled precision, for the vector unit.

use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group};

/// `-row . moved`, lane by lane in doubled precision.
pub(super) struct LessDot<'a> {
    pub row: &'a [Group],
    pub moved: &'a [Group],
}

impl Kernel for LessDot<'_> {
    type Output = [Group; 2];

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> [Group; 2] {
        let terms = self.row.iter().zip(self.moved);
        terms.fold([ZEROS; 2], |dot, (&a, &b)| less_product(simd, dot, a, b))
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

/// The sum of the lanes and of what they are added to.
pub(super) fn total(start: Doubled, lanes: [Group; 2]) -> Doubled {
    let [high, low]: [[f64; GROUP]; 2] = lanes.map(pulp::cast);
    (0..GROUP).fold(start, |total, lane| total.add(Doubled { high: high[lane], low: low[lane] }))
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
    }
}
