//! The convolutions of two contacts, in the lanes of the vector unit.
//!
//! Of each contact two products of series grow order by order: the one of its law, and `mu(S) - mu(0)` times N. Their sums
//! over the orders below need no new factor, so that they run ahead of the order that is sought.

use std::array;

use pulp::cast;

use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Group, Lanes, ZEROS};

/// Places below order 0 that the last group of terms may touch.
const BELOW: usize = GROUP - 1;

/// Beyond both ends.
const NONE: [Group; GROUP] = [ZEROS; GROUP];

/// Two contacts share it.
pub(crate) const SHARING: usize = GROUP / 2;

/// Orders beyond DEGREE whose terms are summed with their signs.
const SIGNED: usize = 2;

/// Of the two products of a contact, that of its law and that with N, on a panel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FactorSums {
    /// Sums of the absolute values of the left factors and of the right ones.
    pub left: [f64; 2],
    pub right: [f64; 2],
    /// A bound of the sum of the absolute values of the orders beyond DEGREE.
    pub left_out: [f64; 2],
}

impl FactorSums {
    /// Of a force that is a series of this size alone, times 1.
    pub const fn alone(size: f64) -> Self {
        Self { left: [0.0, size], right: [0.0, 1.0], left_out: [0.0; 2] }
    }
}

/// Both factors of four products, by order. Those of the last order stand apart until the next: what waits for them comes last,
/// number by number, since a group read right after its numbers were written would wait for all of them.
#[derive(Debug, Clone)]
pub(crate) struct Convolutions {
    left: [Group; COEFFICIENTS + GROUP],
    right: [Group; COEFFICIENTS + BELOW],
    newest: [[f64; GROUP]; 2],
}

impl Convolutions {
    pub fn new() -> Self {
        Self {
            left: [ZEROS; COEFFICIENTS + GROUP],
            right: [ZEROS; COEFFICIENTS + BELOW],
            newest: [[0.0; GROUP]; 2],
        }
    }

    /// Begins another panel: left factors that are not known yet have to be zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.left.fill(ZEROS);
    }

    /// The factors of the order before k are no longer the newest.
    #[inline(always)]
    pub fn close(&mut self, k: usize) {
        if let Some(before) = k.checked_sub(1) {
            let [left, right] = self.newest;
            (self.left[before], self.right[before + BELOW]) = (cast(left), cast(right));
        }
    }

    /// The left factors of the newest order of both products of a contact, and the right ones.
    #[inline(always)]
    pub fn push(&mut self, place: usize, [left, right]: [[f64; 2]; 2]) {
        let lanes = 2 * place..2 * (place + 1);
        self.newest[0][lanes.clone()].copy_from_slice(&left);
        self.newest[1][lanes].copy_from_slice(&right);
    }

    /// Where contacts are coupled, their normal forces follow after their laws.
    pub fn set_normal(&mut self, place: usize, normal: f64) {
        self.newest[1][2 * place + 1] = normal;
    }

    /// Sums of both contacts on a panel of `powers[1]` times the width that the factors have.
    #[inline(always)]
    pub fn sums<S: Lanes>(&self, simd: S, powers: &[f64; COEFFICIENTS]) -> [FactorSums; SHARING] {
        let size = |factor: Group, k: usize| {
            simd.mul_f64s(simd.abs_f64s(factor), simd.splat_f64s(powers[k]))
        };
        let (mut left, mut right) = (ZEROS, ZEROS);
        for (k, (a, b)) in self.left.iter().zip(&self.right[BELOW..]).enumerate() {
            left = simd.add_f64s(left, size(*a, k));
            right = simd.add_f64s(right, size(*b, k));
        }
        // The terms of the orders beyond DEGREE + SIGNED, each by its size.
        let (mut rest, mut left_out) = (ZEROS, ZEROS);
        for k in SIGNED + 1..COEFFICIENTS {
            let j = COEFFICIENTS + SIGNED - k;
            rest = simd.add_f64s(rest, size(self.right[j + BELOW], j));
            left_out = simd.mul_add_f64s(size(self.left[k], k), rest, left_out);
        }
        // The rounding of these sums is a part of that of the products of both sums over all orders.
        for order in 1..=SIGNED {
            let mut sum = ZEROS;
            for k in order..COEFFICIENTS {
                let j = DEGREE + order - k;
                sum = simd.mul_add_f64s(self.left[k], self.right[j + BELOW], sum);
            }
            let power = powers[DEGREE] * powers[order];
            left_out = simd.mul_add_f64s(simd.abs_f64s(sum), simd.splat_f64s(power), left_out);
        }
        let [left, right, left_out]: [[f64; GROUP]; 3] = [left, right, left_out].map(cast);
        let of = |all: &[f64; GROUP], first: usize| [all[first], all[first + 1]];
        std::array::from_fn(|i| FactorSums {
            left: of(&left, 2 * i),
            right: of(&right, 2 * i),
            left_out: of(&left_out, 2 * i),
        })
    }

    /// The terms of order k with factors of the orders from 1 to k - 1.
    #[inline(always)]
    pub fn middle<S: Lanes>(&self, simd: S, k: usize) -> [f64; GROUP] {
        let [left, right] = self.newest;
        match k {
            0 | 1 => return [0.0; GROUP],
            2 => return array::from_fn(|i| left[i] * right[i]),
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
        let mut sums: [f64; GROUP] = cast(simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d)));
        let [first_left, first_right]: [[f64; GROUP]; 2] =
            [self.left[1], self.right[1 + BELOW]].map(cast);
        for i in 0..GROUP {
            sums[i] = left[i].mul_add(first_right[i], first_left[i].mul_add(right[i], sums[i]));
        }
        sums
    }
}
