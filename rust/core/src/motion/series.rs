//! Taylor series of many coordinates for the vector unit: values, norms, and sizes of coefficients.
//!
//! Of n coordinates all terms of one order lie one after the other.

use crate::contact::functional::Functional;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::simd::{GROUP, Kernel, Lanes, ZEROS, lanes_of, store};

/// Number of independent sums per pass: as many as stay in registers and hide the latency of an addition.
const AT_ONCE: usize = 4;

/// Work on groups of coordinates.
trait Grouped {
    /// On `COUNT` groups from a coordinate on, with this many lanes each.
    fn groups<const COUNT: usize, S: Lanes>(&mut self, simd: S, first: usize, lanes: usize);

    /// On the groups of n coordinates.
    #[inline(always)]
    fn all<S: Lanes>(&mut self, simd: S, n: usize) {
        let whole = n / GROUP * GROUP;
        let mut first = 0;
        while first < whole {
            let count = ((whole - first) / GROUP).min(AT_ONCE);
            match count {
                1 => self.groups::<1, S>(simd, first, GROUP),
                2 => self.groups::<2, S>(simd, first, GROUP),
                3 => self.groups::<3, S>(simd, first, GROUP),
                _ => self.groups::<AT_ONCE, S>(simd, first, GROUP),
            }
            first += count * GROUP;
        }
        if whole < n {
            self.groups::<1, S>(simd, whole, n - whole);
        }
    }
}

/// Values of coordinates and of their derivatives over s, by Horner's rule.
pub(crate) struct Horner<'a> {
    pub terms: &'a [f64],
    pub s: f64,
    pub q: &'a mut [f64],
    pub u: &'a mut [f64],
}

impl Grouped for Horner<'_> {
    #[inline(always)]
    fn groups<const COUNT: usize, S: Lanes>(&mut self, simd: S, first: usize, lanes: usize) {
        let Self { terms, s, q, u } = self;
        let s = simd.splat_f64s(*s);
        let (mut value, mut slope) = ([ZEROS; COUNT], [ZEROS; COUNT]);
        for terms in terms.chunks_exact(q.len()).rev() {
            for g in 0..COUNT {
                slope[g] = simd.mul_add_f64s(slope[g], s, value[g]);
                let term = lanes_of(simd, &terms[first + g * GROUP..], lanes);
                value[g] = simd.mul_add_f64s(value[g], s, term);
            }
        }
        for g in 0..COUNT {
            let at = first + g * GROUP;
            store(value[g], &mut q[at..at + lanes]);
            store(slope[g], &mut u[at..at + lanes]);
        }
    }
}

impl Kernel for Horner<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let n = self.q.len();
        self.all(simd, n);
    }
}

/// Absolute values of the coefficients of places and of velocities: constant, linear, and the sum of the others.
pub(crate) struct Sizes<'a> {
    pub terms: &'a [f64],
    pub n: usize,
    /// From a coefficient of places of the next order to one of velocities, 1/s.
    pub rates: [f64; COEFFICIENTS],
    pub sizes: &'a mut [[Vec<f64>; 2]; 3],
}

impl Grouped for Sizes<'_> {
    #[inline(always)]
    fn groups<const COUNT: usize, S: Lanes>(&mut self, simd: S, first: usize, lanes: usize) {
        let Self { terms, n, rates, sizes } = self;
        for ([of_q, of_u], orders) in sizes.iter_mut().zip([0..1, 1..2, 2..COEFFICIENTS]) {
            let (mut q, mut u) = ([ZEROS; COUNT], [ZEROS; COUNT]);
            for k in orders {
                let rate = simd.splat_f64s(rates[k]);
                let (of_order, of_next) = terms[k * *n..(k + 2) * *n].split_at(*n);
                for g in 0..COUNT {
                    let at = first + g * GROUP;
                    let size = simd.abs_f64s(lanes_of(simd, &of_order[at..], lanes));
                    q[g] = simd.add_f64s(q[g], size);
                    let size = simd.abs_f64s(lanes_of(simd, &of_next[at..], lanes));
                    u[g] = simd.mul_add_f64s(rate, size, u[g]);
                }
            }
            for g in 0..COUNT {
                let at = first + g * GROUP;
                store(q[g], &mut of_q[at..at + lanes]);
                store(u[g], &mut of_u[at..at + lanes]);
            }
        }
    }
}

impl Kernel for Sizes<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let n = self.n;
        self.all(simd, n);
    }
}

/// The sum of the absolute values of the terms of a functional, from those of places and of velocities.
#[inline(always)]
pub(crate) fn size_of(functional: &Functional, [q, u]: [&[f64]; 2]) -> f64 {
    let sum = |terms: &[(usize, f64)], sizes: &[f64]| -> f64 {
        terms.iter().map(|&(i, weight)| weight.abs() * sizes[i]).sum()
    };
    sum(&functional.position, q) + sum(&functional.velocity, u)
}

/// The largest entry of a state in the norm, infinite beyond the range of numbers.
pub(crate) struct Largest<'a> {
    /// Square roots of masses; 0 of what does not count.
    pub weight: &'a [f64],
    pub q: &'a [f64],
    pub u: &'a [f64],
    /// Of q and of u.
    pub factors: [f64; 2],
}

impl Kernel for Largest<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> f64 {
        let Self { weight, q, u, factors } = self;
        let [omega, rate] = factors.map(|factor| simd.splat_f64s(factor));
        let (mut largest, mut sum) = (ZEROS, ZEROS);
        for (first, weight) in weight.chunks(GROUP).enumerate() {
            let of = |x: &[f64]| lanes_of(simd, &x[first * GROUP..], weight.len());
            let position = simd.mul_f64s(simd.abs_f64s(of(q)), omega);
            let velocity = simd.mul_f64s(simd.abs_f64s(of(u)), rate);
            let weight = lanes_of(simd, weight, weight.len());
            let entry = simd.mul_f64s(weight, simd.max_f64s(position, velocity));
            largest = simd.max_f64s(largest, entry);
            // `max` passes over what is no number.
            sum = simd.add_f64s(sum, simd.add_f64s(position, velocity));
        }
        let finite = simd.reduce_sum_f64s(sum).is_finite();
        if finite { simd.reduce_max_f64s(largest) } else { f64::INFINITY }
    }
}
