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

/// Both factors of four products, by order. Those of the last order stand apart until the next: what waits for them comes last.
#[derive(Debug, Clone)]
pub(crate) struct Convolutions {
    left: [Group; COEFFICIENTS + GROUP],
    right: [Group; COEFFICIENTS + BELOW],
    pub newest: [Group; 2],
}

impl Convolutions {
    pub fn new() -> Self {
        Self {
            left: [ZEROS; COEFFICIENTS + GROUP],
            right: [ZEROS; COEFFICIENTS + BELOW],
            newest: [ZEROS; 2],
        }
    }

    /// Begins another panel: left factors that are not known yet have to be zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.left.fill(ZEROS);
    }

    /// The factors of order k.
    #[inline(always)]
    pub fn set(&mut self, k: usize, [left, right]: [Group; 2]) {
        self.left[k] = left;
        self.right[k + BELOW] = right;
    }

    /// The factors of order k, of which those of the order before are no longer the newest.
    #[inline(always)]
    pub fn push(&mut self, k: usize, newest: [Group; 2]) {
        if let Some(before) = k.checked_sub(1) {
            self.set(before, self.newest);
        }
        self.newest = newest;
    }

    /// Where contacts are coupled, their normal forces follow after their laws.
    pub fn set_normal(&mut self, place: usize, normal: f64) {
        let [_, right] = &mut self.newest;
        pulp::bytemuck::cast_mut::<Group, [f64; GROUP]>(right)[2 * place + 1] = normal;
    }

    /// The terms of order k with factors of the orders from 1 to k - 1, the last of them given.
    #[inline(always)]
    pub fn middle<S: Lanes>(
        &self,
        simd: S,
        k: usize,
        [newest_left, newest_right]: [Group; 2],
    ) -> Group {
        match k {
            0 | 1 => return ZEROS,
            2 => return simd.mul_f64s(newest_left, newest_right),
            _ => {}
        }
        let mut sums = [ZEROS; GROUP];
        let mut first = 2;
        while first < k - 1 {
            let left: &[Group; GROUP] = self.left[first..].first_chunk().unwrap_or(&NONE);
            // The order k - first stands at the end of it.
            let right: &[Group; GROUP] = self.right[k - first..].first_chunk().unwrap_or(&NONE);
            for lane in 0..GROUP {
                sums[lane] = simd.mul_add_f64s(left[lane], right[GROUP - 1 - lane], sums[lane]);
            }
            first += GROUP;
        }
        let [a, b, c, d] = sums;
        let sum = simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
        let sum = simd.mul_add_f64s(self.left[1], newest_right, sum);
        simd.mul_add_f64s(newest_left, self.right[1 + BELOW], sum)
    }
}
