//! Values and bounds of a local polynomial on [0, 1], by the lanes of the vector unit.

use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group};

/// Degree of the local polynomials: the remainder 3^30 / 30! = 8e-19 stays below rounding.
pub(crate) const DEGREE: usize = 29;
/// Coefficients per function.
pub(crate) const COEFFICIENTS: usize = DEGREE + 1;
/// Room for them: zeros up to a whole number of groups, also when up to three departing roots are divided out.
pub(crate) const ROW: usize = (COEFFICIENTS + 3).next_multiple_of(GROUP);

/// 1, factor, factor^2 .., each the rounded product of the one before with the factor: coefficients that are scaled by them obey
/// linear recurrences as before, but for one rounding. In products of series `p_j p_{k-j}` differs from `p_k` by up to k
/// roundings.
pub(crate) fn powers<const N: usize>(factor: f64) -> [f64; N] {
    let mut powers = [1.0; N];
    for k in 1..N {
        powers[k] = factor * powers[k - 1];
    }
    powers
}

/// `sum_i a_i b_{n-1-i}` of n numbers each, in sums that do not wait for each other.
#[inline(always)]
pub(crate) fn crosswise(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; GROUP];
    for (left, right) in a.chunks(GROUP).zip(b.rchunks(GROUP)) {
        for (sum, (a, b)) in sums.iter_mut().zip(left.iter().zip(right.iter().rev())) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Coefficients in groups, filled up with zeros.
pub(super) type Groups<'a> = &'a [[f64; GROUP]];

/// Value and the first two derivatives at s. With `x = s^4` the coefficients of each lane are a polynomial
/// `V_l(x)` of a quarter of the degree, and `p = sum_l s^l V_l`.
#[inline(always)]
pub(super) fn derivatives<S: Lanes>(simd: S, p: Groups<'_>, s: f64) -> (f64, f64, f64) {
    let square = s * s;
    let x = simd.splat_f64s(square * square);
    let (mut value, mut first, mut second) = (ZEROS, ZEROS, ZEROS);
    for &coefficients in p.iter().rev() {
        second = simd.mul_add_f64s(second, x, first);
        first = simd.mul_add_f64s(first, x, value);
        value = simd.mul_add_f64s(value, x, group(coefficients));
    }
    let cube = square * s;
    let powers = group([1.0, s, square, cube]);
    let of_value = group([0.0, 0.0, 2.0, 6.0 * s]);
    let of_first = group([12.0, 20.0 * s, 28.0 * square, 36.0 * cube]);
    let of_first = simd.mul_f64s(of_first, simd.splat_f64s(square));
    let of_second = simd.mul_f64s(powers, simd.splat_f64s(32.0 * cube * cube));
    let sum = simd.mul_f64s(second, of_second);
    let sum = simd.mul_add_f64s(value, of_value, simd.mul_add_f64s(first, of_first, sum));
    let (value, first) = summed(simd, value, first, powers, s);
    (value, first, simd.reduce_sum_f64s(sum))
}

/// Value and slope of a polynomial, its coefficients in groups.
pub(crate) struct ValueAndSlope<'a>(pub &'a [f64], pub f64);

impl Kernel for ValueAndSlope<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> (f64, f64) {
        value_and_slope(simd, self.0.as_chunks().0, self.1)
    }
}

#[inline(always)]
pub(super) fn value_and_slope<S: Lanes>(simd: S, p: Groups<'_>, s: f64) -> (f64, f64) {
    let square = s * s;
    let x = simd.splat_f64s(square * square);
    let (mut value, mut first) = (ZEROS, ZEROS);
    for &coefficients in p.iter().rev() {
        first = simd.mul_add_f64s(first, x, value);
        value = simd.mul_add_f64s(value, x, group(coefficients));
    }
    summed(simd, value, first, group([1.0, s, square, square * s]), s)
}

/// `sum_l s^l V_l` and its slope `sum_l (l s^{l-1} V_l + 4 s^{3+l} V_l')`.
#[inline(always)]
fn summed<S: Lanes>(simd: S, value: Group, first: Group, powers: Group, s: f64) -> (f64, f64) {
    let slopes = group([0.0, 1.0, 2.0 * s, 3.0 * s * s]);
    let of_first = simd.mul_f64s(powers, simd.splat_f64s(4.0 * s * s * s));
    let slope = simd.mul_add_f64s(first, of_first, simd.mul_f64s(value, slopes));
    (simd.reduce_sum_f64s(simd.mul_f64s(value, powers)), simd.reduce_sum_f64s(slope))
}

/// k (k - 1) (k - 2)
const THIRD: [[f64; GROUP]; COEFFICIENTS.div_ceil(GROUP)] = {
    let mut factors = [[0.0; GROUP]; COEFFICIENTS.div_ceil(GROUP)];
    let mut k = 3;
    while k < COEFFICIENTS {
        factors[k / GROUP][k % GROUP] = (k * (k - 1) * (k - 2)) as f64;
        k += 1;
    }
    factors
};

/// A bound of |p'''| on [0, 1]; of the third derivative alone, not of its modulus, from the `positive` coefficients.
#[inline(always)]
pub(super) fn third_derivative_bound<S: Lanes>(simd: S, p: Groups<'_>, positive: bool) -> f64 {
    let mut sum = ZEROS;
    for (&coefficients, &factors) in p.iter().zip(&THIRD) {
        let coefficients = group(coefficients);
        let counted =
            if positive { simd.max_f64s(coefficients, ZEROS) } else { simd.abs_f64s(coefficients) };
        sum = simd.mul_add_f64s(counted, group(factors), sum);
    }
    simd.reduce_sum_f64s(sum)
}

/// A bound of |p'''| on [s, s + radius] from Taylor's coefficients at s, given that on [0, 1].
pub(super) fn third_derivative_near(p: Groups<'_>, on_all: f64, s: f64, radius: f64) -> f64 {
    let mut about = [0.0; ROW];
    let about = &mut about[..p.as_flattened().len()];
    about.copy_from_slice(p.as_flattened());
    for k in 0..about.len() {
        for j in (k..about.len() - 1).rev() {
            about[j] += s * about[j + 1];
        }
    }
    // The rounding of these coefficients is at most this part of the bound for all of [0, 1].
    let mut sum = (ROW + 2) as f64 * f64::EPSILON * on_all;
    let mut power = 1.0;
    for (c, factor) in about.iter().zip(THIRD.as_flattened()).skip(3) {
        sum += c.abs() * factor * power;
        power *= radius;
    }
    sum.min(on_all)
}

/// A lower bound of p on [0, 1] from its quadratic part and the negative higher coefficients.
#[inline(always)]
pub(super) fn lower_bound<S: Lanes>(simd: S, p: Groups<'_>) -> f64 {
    let Some((&[c0, c1, c2, c3], higher)) = p.split_first() else {
        return 0.0;
    };
    let mut lowest = c0.min(c0 + c1 + c2);
    if c2 > 0.0 && c1 < 0.0 && -c1 < 2.0 * c2 {
        lowest = lowest.min(c0 - 0.25 * c1 * c1 / c2);
    }
    let mut sum = ZEROS;
    for &coefficients in higher {
        sum = simd.add_f64s(sum, simd.min_f64s(group(coefficients), ZEROS));
    }
    lowest + c3.min(0.0) + simd.reduce_sum_f64s(sum)
}
