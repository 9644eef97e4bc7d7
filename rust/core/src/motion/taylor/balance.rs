//! `F - K q` of a dense scene in doubled precision, row by row, for the vector unit.

use pulp::cast;

use crate::motion::taylor::doubled_products::less_product;
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Fills the rows that a combination needs.
pub(super) struct Balance<'a> {
    pub scene: &'a Scene,
    pub reduction: &'a Reduction,
    pub q: &'a [f64],
    pub rows: &'a mut [Doubled],
}

impl Kernel for Balance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { scene, reduction, q, rows } = self;
        let mut gathered: Vec<f64> = Vec::with_capacity(q.len());
        let normals = reduction.merges.iter().map(|merge| merge.normal);
        for row in reduction.kept.iter().copied().chain(normals) {
            let (columns, values) = scene.stiffness.entries_of(row);
            let x = if columns.len() == q.len() {
                q
            } else {
                gathered.clear();
                gathered.extend(columns.iter().map(|&k| q[k]));
                &gathered
            };
            rows[row] = less_dot(simd, scene.force[row], values, x);
        }
    }
}

/// `sum - a . b`
#[inline(always)]
fn less_dot<S: Lanes>(simd: S, sum: f64, a: &[f64], b: &[f64]) -> Doubled {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<GROUP>(), b.as_chunks::<GROUP>());
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
    let total = terms.fold(Doubled::from(sum), Doubled::add);
    [even, other].into_iter().fold(total, |total, part: [Group; 2]| {
        let [high, low]: [[f64; GROUP]; 2] = part.map(cast);
        (0..GROUP)
            .fold(total, |total, lane| total.add(Doubled { high: high[lane], low: low[lane] }))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::simd::VectorUnit;

    struct LessDot<'a>(f64, &'a [f64], &'a [f64]);

    impl Kernel for LessDot<'_> {
        type Output = Doubled;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Doubled {
            less_dot(simd, self.0, self.1, self.2)
        }
    }

    proptest! {
        /// The sum in doubled numbers one after the other.
        #[test]
        fn dots_are_sums_in_doubled_precision(
            sum in -1.0..1.0f64,
            pairs in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 0..60),
        ) {
            let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let found = VectorUnit::default().run(LessDot(sum, &a, &b));
            let portable = VectorUnit::Portable.run(LessDot(sum, &a, &b));
            prop_assert_eq!((found.high, found.low), (portable.high, portable.low));
            let terms = a.iter().zip(&b).map(|(&a, &b)| Doubled::product(-a, b));
            let expected = terms.fold(Doubled::from(sum), Doubled::add);
            let error = (found.high - expected.high) + (found.low - expected.low);
            prop_assert!(error.abs() <= 1e-29, "{error:e}");
        }
    }
}
