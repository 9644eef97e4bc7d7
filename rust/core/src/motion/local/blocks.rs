//! Series of coordinates that begin at times of their own, in groups for the vector unit.
//!
//! A block holds all orders of [`GROUP`] coordinates, one order after the other.

use pulp::cast;

use crate::motion::local::region::TERMS;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group, store};

/// Numbers of a block.
pub(super) const BLOCK: usize = GROUP * TERMS;

/// The place of the first term of a coordinate; the next order follows after [`GROUP`] numbers.
pub(super) fn first_term(k: usize) -> usize {
    k / GROUP * BLOCK + k % GROUP
}

/// Displacements and speeds of whole blocks at a time.
pub(super) struct Values<'a> {
    pub terms: &'a [f64],
    /// When the series begin, and their units of time.
    pub start: &'a [f64],
    pub width: &'a [f64],
    pub at: f64,
    pub q: &'a mut [f64],
    pub u: &'a mut [f64],
}

impl Kernel for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { terms, start, width, at, q, u } = self;
        let at = simd.splat_f64s(at);
        let starts = start.as_chunks::<GROUP>().0.iter().zip(width.as_chunks::<GROUP>().0);
        let of_blocks = terms.as_chunks::<GROUP>().0.chunks_exact(TERMS).zip(starts);
        let values = q.chunks_mut(GROUP).zip(u.chunks_mut(GROUP));
        for ((terms, (&start, &width)), (q, u)) in of_blocks.zip(values) {
            let width = group(width);
            let s = simd.div_f64s(simd.sub_f64s(at, group(start)), width);
            let (mut value, mut slope) = (ZEROS, ZEROS);
            for &term in terms.iter().rev() {
                slope = simd.mul_add_f64s(slope, s, value);
                value = simd.mul_add_f64s(value, s, group(term));
            }
            store(value, q);
            store(simd.div_f64s(slope, width), u);
        }
    }
}

/// Moves the starts of [`GROUP`] series by s and changes their units by a factor.
pub(super) struct Shift<'a> {
    pub terms: &'a mut [Group; TERMS],
    pub s: [f64; GROUP],
    pub factor: [f64; GROUP],
}

impl Kernel for Shift<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { terms, s, factor } = self;
        let (s, factor) = (group(s), group(factor));
        for order in 0..TERMS - 1 {
            for j in (order..TERMS - 1).rev() {
                terms[j] = simd.mul_add_f64s(s, terms[j + 1], terms[j]);
            }
        }
        let mut power: Group = cast([1.0; GROUP]);
        for term in terms {
            *term = simd.mul_f64s(*term, power);
            power = simd.mul_f64s(power, factor);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::simd::VectorUnit;

    proptest! {
        /// A series about another time and in another unit has the same values and slopes.
        #[test]
        fn shifted_series_are_the_same(
            terms in proptest::collection::vec(-1.0..1.0f64, BLOCK),
            start in proptest::array::uniform4(0.0..1.0f64),
            shares in proptest::array::uniform4(0.0..0.5f64),
            after in 0.0..0.5f64,
        ) {
            let width = [1.0, 0.5, 2.0, 1.0];
            let values = |terms: &[f64], start: &[f64], width: &[f64], at: f64| {
                let [mut q, mut u] = [[0.0; GROUP]; 2];
                let unit = VectorUnit::default();
                unit.run(Values { terms, start, width, at, q: &mut q, u: &mut u });
                [q, u]
            };
            for lane in 0..GROUP {
                // All lanes at the time at which this one is asked for.
                let at = start[lane] + shares[lane] * width[lane];
                let unit = 0.5 * width[lane];
                let s: [f64; GROUP] = std::array::from_fn(|i| (at - start[i]) / width[i]);
                let mut moved: [Group; TERMS] =
                    std::array::from_fn(|k| group(std::array::from_fn(|i| terms[k * GROUP + i])));
                let factor = width.map(|width| unit / width);
                VectorUnit::default().run(Shift { terms: &mut moved, s, factor });
                let moved: Vec<f64> =
                    moved.into_iter().flat_map(cast::<Group, [f64; GROUP]>).collect();
                let expected = values(&terms, &start, &width, at + after * unit);
                let found = values(&moved, &[at; GROUP], &[unit; GROUP], at + after * unit);
                let own = |series: &[[f64; GROUP]; 2]| series.map(|of| of[lane]);
                for (found, expected) in own(&found).into_iter().zip(own(&expected)) {
                    prop_assert!((found - expected).abs() <= 1e-11, "{found} for {expected}");
                }
            }
        }
    }
}
