//! The convolutions of two contacts, in the lanes of the vector unit.
//!
//! Of each contact two products of series grow order by order: the one of its law, and `mu(S) - mu(0)` times N. Their sums
//! over the orders below need no new factor, so that they run ahead of the order that is sought.

use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::simd::{GROUP, Group, Lanes, ZEROS};

/// Places below order 0 that the last group of terms may touch.
const BELOW: usize = GROUP - 1;

/// Beyond both ends.
const NONE: [Group; GROUP] = [ZEROS; GROUP];

/// Two contacts share it.
pub(crate) const SHARING: usize = GROUP / 2;

/// Both factors of four products, by order.
#[derive(Debug, Clone)]
pub(crate) struct Convolutions {
    left: [Group; COEFFICIENTS + GROUP],
    right: [Group; COEFFICIENTS + BELOW],
}

impl Convolutions {
    pub fn new() -> Self {
        Self { left: [ZEROS; COEFFICIENTS + GROUP], right: [ZEROS; COEFFICIENTS + BELOW] }
    }

    /// Begins another panel: left factors that are not known yet have to be zero.
    pub fn clear(&mut self) {
        self.left.fill(ZEROS);
    }

    #[inline(always)]
    pub fn set(&mut self, k: usize, left: Group, right: Group) {
        self.left[k] = left;
        self.right[k + BELOW] = right;
    }

    /// Where contacts are coupled, their normal forces follow after their laws.
    pub fn set_normal(&mut self, k: usize, place: usize, normal: f64) {
        pulp::bytemuck::cast_mut::<Group, [f64; GROUP]>(&mut self.right[k + BELOW])
            [2 * place + 1] = normal;
    }

    /// The terms of order k with factors of the orders from 1 to k - 1.
    #[inline(always)]
    pub fn middle<S: Lanes>(&self, simd: S, k: usize) -> Group {
        let mut sums = [ZEROS; GROUP];
        let mut first = 1;
        while first < k {
            let left: &[Group; GROUP] = self.left[first..].first_chunk().unwrap_or(&NONE);
            // The order k - first stands at the end of it.
            let right: &[Group; GROUP] = self.right[k - first..].first_chunk().unwrap_or(&NONE);
            for lane in 0..GROUP {
                sums[lane] = simd.mul_add_f64s(left[lane], right[GROUP - 1 - lane], sums[lane]);
            }
            first += GROUP;
        }
        let [a, b, c, d] = sums;
        simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d))
    }
}
