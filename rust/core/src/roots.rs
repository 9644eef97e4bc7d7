//! The certified first root of a polynomial that is known up to an error bound.
//!
//! The true function lies within `error` of `p` on [0, 1] and starts positive. A march from the left
//! uses the cubic lower bound `p(s) + p'(s) d + p''(s) d^2 / 2 - M d^3 / 6` with `M >= max |p'''|`: where
//! that stays above `error` there is provably no root. The march slows down only where p approaches the
//! band |p| <= error; what happens there is a crossing (p leaves the band below), a touch (it leaves
//! above), or undecided at the end of the interval.
//!
//! Everything is inlined into its caller, which is compiled for the vector units found at run time; products
//! and sums are fused on every machine.

use pulp::{Simd, WithSimd};

use crate::motion::COEFFICIENTS;

/// Where a polynomial stands on the interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Verdict {
    /// No crossing up to the end. `touch` is the lowest point within the band that was left upwards;
    /// `in_band` says that the end itself lies within the band, entered there.
    Clear { touch: Option<Touch>, in_band: Option<Touch> },
    /// The first crossing to negative values.
    Crossing { root: f64, touch: Option<Touch> },
}

/// A local minimum within the error band: whether it crosses can't be decided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touch {
    pub at: f64,
    pub value: f64,
}

/// Value and the first two derivatives at s.
#[inline(always)]
fn derivatives(p: &[f64], s: f64) -> (f64, f64, f64) {
    let (mut value, mut first, mut second) = (0.0f64, 0.0f64, 0.0f64);
    for &c in p.iter().rev() {
        second = second.mul_add(s, first);
        first = first.mul_add(s, value);
        value = value.mul_add(s, c);
    }
    (value, first, 2.0 * second)
}

/// Value and slope of a polynomial.
pub(crate) struct ValueAndSlope<'a>(pub &'a [f64], pub f64);

impl WithSimd for ValueAndSlope<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (f64, f64) {
        value_and_slope(self.0, self.1)
    }
}

/// By two interleaved chains over the even and the odd powers, `p = e(s^2) + s o(s^2)`: half the latency.
#[inline(always)]
fn value_and_slope(p: &[f64], s: f64) -> (f64, f64) {
    let square = s * s;
    let (mut even, mut odd, mut even_slope, mut odd_slope) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let (pairs, rest) = p.as_chunks::<2>();
    if let &[last] = rest {
        even = last;
    }
    for &[e, o] in pairs.iter().rev() {
        even_slope = even_slope.mul_add(square, even);
        odd_slope = odd_slope.mul_add(square, odd);
        even = even.mul_add(square, e);
        odd = odd.mul_add(square, o);
    }
    let value = odd.mul_add(s, even);
    let slope = (2.0 * s).mul_add(odd_slope.mul_add(s, even_slope), odd);
    (value, slope)
}

/// A bound of |p'''| on [0, 1].
#[inline(always)]
fn third_derivative_bound(p: &[f64]) -> f64 {
    lanes(p, |k, c| (k * (k - 1.0) * (k - 2.0)) * c.abs())
}

/// A lower bound of p on [0, 1] from its quadratic part and the negative higher coefficients.
#[inline(always)]
fn lower_bound(p: &[f64]) -> f64 {
    let coefficient = |k: usize| p.get(k).copied().unwrap_or(0.0);
    let (c0, c1, c2) = (coefficient(0), coefficient(1), coefficient(2));
    let mut lowest = c0.min(c0 + c1 + c2);
    if c2 > 0.0 && c1 < 0.0 && -c1 < 2.0 * c2 {
        lowest = lowest.min(c0 - 0.25 * c1 * c1 / c2);
    }
    lowest + lanes(p, |_, c| c.min(0.0))
}

/// `sum_k term(k, p_k)` over the powers from the third on, in four independent sums.
#[inline(always)]
fn lanes(p: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let tail = p.get(3..).unwrap_or(&[]);
    let (groups, rest) = tail.as_chunks::<4>();
    let mut sums = [0.0; 4];
    let mut powers = [3.0, 4.0, 5.0, 6.0];
    for group in groups {
        for lane in 0..4 {
            sums[lane] += term(powers[lane], group[lane]);
            powers[lane] += 4.0;
        }
    }
    let rest: f64 = rest.iter().zip(powers).map(|(&c, k)| term(k, c)).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// The largest step d <= longest on which `v + v1 d + v2 d^2 / 2 - m d^3 / 6 > floor`, from below:
/// any value on which the inequality holds for all smaller d is valid.
#[inline(always)]
fn safe_step(v: f64, v1: f64, v2: f64, m: f64, floor: f64, longest: f64) -> f64 {
    let margin = v - floor;
    let positive_to = |d: f64| {
        // Lowest of the cubic bound on [0, d]: concave part bounded by its end, convex part by its minimum.
        let cubic = m * d * d * d / 6.0;
        let end = margin + v1 * d + 0.5 * v2 * d * d - cubic;
        let vertex = if v2 > 0.0 && v1 < 0.0 && -v1 < v2 * d {
            margin - 0.5 * v1 * v1 / v2 - cubic
        } else {
            f64::INFINITY
        };
        end.min(vertex).min(margin) > 0.0
    };
    if positive_to(longest) {
        return longest;
    }
    // The zero of the bound by a few safeguarded Newton steps from the left, then pulled back.
    let slope_bound =
        v1.min(0.0).abs() + 0.5 * v2.min(0.0).abs() * longest + m * longest * longest / 6.0;
    let mut step = (margin / slope_bound).min(longest);
    for _ in 0..6 {
        let value = margin + v1 * step + 0.5 * v2 * step * step - m * step * step * step / 6.0;
        let slope = v1 + v2 * step - 0.5 * m * step * step;
        if slope >= 0.0 || value <= 0.0 {
            break;
        }
        let next = step - value / slope;
        if next <= step || next > longest || !positive_to(next) {
            break;
        }
        step = next;
    }
    // Doubling covers the case where a convex stretch lets the bound rise again.
    while 2.0 * step < longest && positive_to(2.0 * step) {
        step *= 2.0;
    }
    step
}

/// A value below this many errors is near the band: there small steps of bounded change take over.
const NEAR: f64 = 2.0;
/// Bound on the number of marching steps; a polynomial that needs more is reported as a touch where it
/// stands. Quadratic convergence needs fewer than ten, a double root within the band some forty.
const STEPS: usize = 400;

/// The first root of `polynomial` on [0, end], end <= 1.
pub(crate) struct FirstRoot<'a> {
    pub polynomial: &'a [f64],
    pub error: f64,
    pub end: f64,
}

impl WithSimd for FirstRoot<'_> {
    type Output = Verdict;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Verdict {
        first_root(self.polynomial, self.error, self.end)
    }
}

#[inline(always)]
fn first_root(p: &[f64], error: f64, end: f64) -> Verdict {
    if lower_bound(p) > error {
        return Verdict::Clear { touch: None, in_band: None };
    }
    let (short, wider) = shortened(p, error);
    if let Some(root) = lone_root(short, wider, end) {
        // The search bears the error of the coefficients left out, the root need not.
        let (v, v1) = value_and_slope(p, root);
        return Verdict::Crossing { root: root - v / v1, touch: None };
    }
    march(p, error, end)
}

/// Drops the highest coefficients that together stay below a quarter of the error, and adds them to it.
#[inline(always)]
fn shortened(p: &[f64], error: f64) -> (&[f64], f64) {
    let mut dropped = 0.0;
    let mut length = p.len();
    while length > 3 && dropped + p[length - 1].abs() <= 0.25 * error {
        dropped += p[length - 1].abs();
        length -= 1;
    }
    (&p[..length], error + dropped)
}

/// The usual case, a single transversal crossing: where p ends below the band, a root r is found by Newton's
/// method and divided out; `p = (r - s) q` with q proved positive on [0, r] has no root before r.
#[inline(always)]
fn lone_root(p: &[f64], error: f64, end: f64) -> Option<f64> {
    if p[0] <= error {
        return None;
    }
    let (at_end, slope_at_end) = value_and_slope(p, end);
    if !(at_end < -error && slope_at_end < 0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0, end);
    let mut s = hermite_root(p[0], p[1] * end, at_end, slope_at_end * end) * end;
    for _ in 0..20 {
        let (v, v1) = value_and_slope(p, s);
        if v > 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - v / v1;
        let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
        let step = (next - s).abs();
        s = next;
        // The next step would be about the square of this one.
        if step <= 1e-9 * s {
            return is_first(p, error, s).then_some(s);
        }
    }
    None
}

/// A root on [0, 1] of the cubic with values `a > 0 > b` and slopes `da`, `db` at 0 and 1: a start that leaves
/// two or three steps on p itself.
#[inline(always)]
fn hermite_root(a: f64, da: f64, b: f64, db: f64) -> f64 {
    let c2 = 3.0 * (b - a) - 2.0 * da - db;
    let c3 = 2.0 * (a - b) + da + db;
    let (mut low, mut high) = (0.0, 1.0);
    let mut s = a / (a - b);
    for _ in 0..5 {
        let value = ((c3 * s + c2) * s + da) * s + a;
        let slope = (3.0 * c3 * s + 2.0 * c2) * s + da;
        if value > 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - value / slope;
        s = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
    }
    s
}

/// Whether p has no root on [0, root) but for the error of its last part.
#[inline(always)]
fn is_first(p: &[f64], error: f64, root: f64) -> bool {
    // Horner's scheme at the root leaves the coefficients of p / (s - root), here scaled to [0, 1].
    let mut quotient = [0.0; COEFFICIENTS];
    let length = p.len() - 1;
    let mut carried = 0.0;
    for k in (0..length).rev() {
        carried = carried * root + p[k + 1];
        quotient[k] = -carried;
    }
    let mut power = 1.0;
    for c in &mut quotient[..length] {
        *c *= power;
        power *= root;
    }
    lower_bound(&quotient[..length]) * root > 2.0 * error
}

#[inline(always)]
fn march(p: &[f64], error: f64, end: f64) -> Verdict {
    let m = third_derivative_bound(p);
    let mut s = 0.0;
    let mut touch: Option<Touch> = None;
    for _ in 0..STEPS {
        let (v, v1, v2) = derivatives(p, s);
        if v > NEAR * error {
            if let Some(high) = monotone_crossing(v, v1, v2, m, error, 1.0 - s) {
                let root = bracketed_root(p, s, s + high);
                if root > end {
                    return Verdict::Clear { touch, in_band: None };
                }
                return Verdict::Crossing { root, touch };
            }
            // Down to between the band and what counts as near it, so that the march always arrives.
            let floor = 0.5 * (1.0 + NEAR) * error;
            let step = safe_step(v, v1, v2, m, floor, end - s);
            if s + step >= end {
                return Verdict::Clear { touch, in_band: None };
            }
            s = (s + step).max(s + f64::EPSILON * s.max(1e-6));
            continue;
        }
        match leave_band(p, error, m, s, end) {
            Exit::Below { root } => return Verdict::Crossing { root, touch },
            Exit::Above { at, lowest } => {
                let lowest = lowest
                    .filter(|lowest| touch.is_none_or(|touch: Touch| lowest.value < touch.value));
                touch = lowest.or(touch);
                s = at;
            }
            Exit::Undecided { lowest } => return Verdict::Clear { touch, in_band: lowest },
        }
        if s >= end {
            return Verdict::Clear { touch, in_band: None };
        }
    }
    // Not decided in bounded work: said, not guessed.
    let (value, _) = value_and_slope(p, s);
    Verdict::Clear { touch, in_band: Some(Touch { at: s, value }) }
}

/// A distance d by which p has certainly fallen through the band, decreasing all the way.
#[inline(always)]
fn monotone_crossing(v: f64, v1: f64, v2: f64, m: f64, error: f64, longest: f64) -> Option<f64> {
    if v1 >= 0.0 {
        return None;
    }
    let d = 1.5 * (v + error) / -v1;
    let slope = v1 + v2.max(0.0) * d + 0.5 * m * d * d;
    let value = v + v1 * d + 0.5 * v2 * d * d + m * d * d * d / 6.0;
    (d <= longest && slope < 0.0 && value < -error).then_some(d)
}

/// The lowest point is told when it lies within the band.
enum Exit {
    Below { root: f64 },
    Above { at: f64, lowest: Option<Touch> },
    Undecided { lowest: Option<Touch> },
}

/// Follows p from the edge of the band |p| <= error until it is certainly outside.
#[inline(always)]
fn leave_band(p: &[f64], error: f64, m: f64, entry: f64, end: f64) -> Exit {
    let mut s = entry;
    let mut lowest = Touch { at: entry, value: f64::INFINITY };
    for _ in 0..STEPS {
        let (v, v1, v2) = derivatives(p, s);
        if v < lowest.value {
            lowest = Touch { at: s, value: v };
        }
        let within = Some(lowest).filter(|lowest| lowest.value <= error);
        if v < -error {
            return Exit::Below { root: bracketed_root(p, entry, s) };
        }
        // Farther out than where it was entered, or the two would take turns.
        if v > 1.5 * NEAR * error && s > entry {
            return Exit::Above { at: s, lowest: within };
        }
        if s >= end {
            return Exit::Undecided { lowest: within };
        }
        // Largest step over which p can't change by more than half the band: no excursion is stepped over.
        let change = 0.5 * error;
        let mut step = end - s;
        let variation = |d: f64| v1.abs() * d + 0.5 * v2.abs() * d * d + m * d * d * d / 6.0;
        if variation(step) > change {
            step = step.min(change / v1.abs().max(f64::MIN_POSITIVE));
            step = step.min((2.0 * change / v2.abs().max(f64::MIN_POSITIVE)).sqrt());
            step = step.min((6.0 * change / m.max(f64::MIN_POSITIVE)).cbrt());
            // Three terms, each within the change alone.
            while variation(step) > 3.0 * change {
                step *= 0.5;
            }
        }
        s = (s + step).max(s + f64::EPSILON * s.max(1e-9)).min(end);
    }
    Exit::Undecided { lowest: Some(lowest) }
}

/// The zero of p between `low` and `high`, where p changes from >= 0 to < 0: Newton kept inside the bracket.
#[inline(always)]
fn bracketed_root(p: &[f64], low: f64, high: f64) -> f64 {
    let (mut low, mut high) = (low, high);
    if value_and_slope(p, low).0 <= 0.0 {
        return low;
    }
    let mut s = 0.5 * (low + high);
    for _ in 0..100 {
        let (v, v1) = value_and_slope(p, s);
        if v > 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - v / v1;
        let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
        if (next - s).abs() <= f64::EPSILON * s.abs() || high - low <= f64::EPSILON * high {
            return next;
        }
        s = next;
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line: the simplest function there is, with its root in the first part of the interval.
    #[test]
    fn a_line_crosses_once() {
        let mut p = [0.0; COEFFICIENTS];
        (p[0], p[1]) = (10.0, -3750.0);
        for end in [0.05, 1.0] {
            let Verdict::Crossing { root, touch: None } = first_root(&p, 4e-11, end) else {
                panic!("no crossing up to {end}");
            };
            assert!((root - 10.0 / 3750.0).abs() < 1e-17);
        }
        assert!(matches!(
            first_root(&p, 4e-11, 0.002),
            Verdict::Clear { touch: None, in_band: None }
        ));
    }
}
