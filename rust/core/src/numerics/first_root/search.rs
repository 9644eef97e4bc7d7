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

use crate::numerics::first_root::polynomial::{
    Groups, ROW, derivatives, lower_bound, third_derivative_bound, third_derivative_near,
    value_and_slope,
};
use crate::numerics::simd::{GROUP, Kernel, Lanes};

/// Where a polynomial stands on the interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Verdict {
    /// No crossing up to the end. `touch` is the lowest point of a stretch in the band that p left upwards; `in_band` is
    /// the point at which p entered the band if p is still in the band at the end.
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

/// A value below this many errors is near the band, where the march takes small steps of bounded change.
const NEAR_BAND: f64 = 2.0;
/// A value within this many errors of an edge of the band counts as beyond the edge; otherwise steps would shrink to
/// nothing there. The rounding of p itself is larger.
pub(super) const RESOLUTION: f64 = 1e-6;
/// Bound on the number of marching steps; a polynomial that needs more is reported as a touch where it
/// stands. Quadratic convergence needs fewer than ten, a double root within the band some forty.
const STEPS: usize = 400;
/// Newton steps to a local minimum. They begin within the band, where two or three are enough.
const NEWTON: usize = 4;
/// After so many steps M is taken about the place itself: a flat dip, or roots close together, need small third
/// derivatives there, which the bound for all of [0, 1] does not show.
const PATIENCE: usize = 16;

/// The first root of `polynomial`, its coefficients in groups, on [0, end], end <= 1.
pub(crate) struct FirstRoot<'a> {
    pub polynomial: &'a [f64],
    pub error: f64,
    pub end: f64,
}

impl Kernel for FirstRoot<'_> {
    type Output = Verdict;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Verdict {
        let (p, _) = self.polynomial.as_chunks();
        if let Some(root) = lone_root(simd, p, self.error, self.end) {
            return Verdict::Crossing { root, touch: None };
        }
        if lower_bound(simd, p) > self.error {
            return Verdict::Clear { touch: None, in_band: None };
        }
        march(simd, p, self.error, self.end)
    }
}

/// The usual case, a single transversal crossing: where p ends below the band, a root is found by Newton's
/// method and proved to be the first.
#[inline(always)]
fn lone_root<S: Lanes>(simd: S, p: Groups<'_>, error: f64, end: f64) -> Option<f64> {
    let &[c0, c1, ..] = p.first()?;
    if c0 <= error {
        return None;
    }
    let (at_end, slope_at_end) = value_and_slope(simd, p, end);
    if !(at_end < -error && slope_at_end < 0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0, end);
    let mut s = hermite_root(c0, c1 * end, at_end, slope_at_end * end) * end;
    for _ in 0..20 {
        let (v, v1, v2) = derivatives(simd, p, s);
        // One division after the other would be waited for.
        let inverse = 1.0 / v1;
        let newton = v * inverse;
        // Chebyshev's step, of third order.
        let next = s - newton * (1.0 + 0.5 * newton * v2 * inverse);
        if newton.abs() <= 1e-6 * s {
            return is_first(simd, p, error, s, [v, v1, v2]).then_some(next);
        }
        if v > 0.0 {
            low = s;
        } else {
            high = s;
        }
        s = if next >= low && next <= high { next } else { 0.5 * (low + high) };
    }
    None
}

/// Nearly the root on [0, 1] of the cubic with values `a > 0 > b` and slopes `da`, `db` at 0 and 1, by Chebyshev's step from
/// the chord: on p itself two such steps are left. A second one on the cubic would save none of them.
#[inline(always)]
fn hermite_root(a: f64, da: f64, b: f64, db: f64) -> f64 {
    let c2 = 3.0 * (b - a) - 2.0 * da - db;
    let c3 = 2.0 * (a - b) + da + db;
    let s = a / (a - b);
    let value = ((c3 * s + c2) * s + da) * s + a;
    let inverse = 1.0 / ((3.0 * c3 * s + 2.0 * c2) * s + da);
    let newton = value * inverse;
    let next = s - newton * (1.0 + newton * (3.0 * c3 * s + c2) * inverse);
    let (low, high) = if value > 0.0 { (s, 1.0) } else { (0.0, s) };
    if next >= low && next <= high { next } else { 0.5 * (low + high) }
}

/// Whether p has no root on [0, s) but for the error of its last part. With d = s - r,
/// `p(r) >= p(s) + d (-p'(s) + p''(s) d / 2 - M d^2 / 6)`, M >= p''' on [0, 1], where the bracket is concave in d
/// and so lowest at an end; failing that, `p = (r - s) q` with q bounded from below.
#[inline(always)]
fn is_first<S: Lanes>(simd: S, p: Groups<'_>, error: f64, s: f64, [v, v1, v2]: [f64; 3]) -> bool {
    let m = third_derivative_bound(simd, p, true);
    let needed = 2.0 * (error + v.abs());
    let lowest = (-v1).min(-v1 + s * (0.5 * v2 - s * m / 6.0));
    if lowest * s > needed {
        return true;
    }
    // Horner's scheme at s leaves the coefficients of (p - p(s)) / (r - s), here scaled to [0, 1].
    let mut quotient = [[0.0; GROUP]; ROW / GROUP];
    let coefficients = quotient.as_flattened_mut();
    let p = p.as_flattened();
    let mut carried = 0.0;
    for k in (1..p.len()).rev() {
        carried = carried * s + p[k];
        coefficients[k - 1] = -carried;
    }
    let mut power = 1.0;
    for c in &mut coefficients[..p.len() - 1] {
        *c *= power;
        power *= s;
    }
    lower_bound(simd, &quotient[..p.len() / GROUP]) * s > needed
}

#[inline(always)]
fn march<S: Lanes>(simd: S, p: Groups<'_>, error: f64, end: f64) -> Verdict {
    let m = third_derivative_bound(simd, p, false);
    let mut s = 0.0;
    let mut touch: Option<Touch> = None;
    let mut step = 0.0_f64;
    for taken in 0..STEPS {
        let (v, v1, v2) = derivatives(simd, p, s);
        if v > NEAR_BAND * error {
            if let Some(high) = monotone_crossing(v, v1, v2, m, error, 1.0 - s) {
                let root = bracketed_root(simd, p, s, s + high);
                if root > end {
                    return Verdict::Clear { touch, in_band: None };
                }
                return Verdict::Crossing { root, touch };
            }
            // Half-way between the band and the limit of `NEAR_BAND`, so that the march always arrives.
            let floor = 0.5 * (1.0 + NEAR_BAND) * error;
            let previous = step;
            step = safe_step(v, v1, v2, m, floor, end - s);
            if taken >= PATIENCE {
                let radius = (4.0 * step.max(previous)).min(end - s);
                let near = third_derivative_near(p, m, s, radius);
                step = step.max(safe_step(v, v1, v2, near, floor, radius));
            }
            if s + step >= end {
                return Verdict::Clear { touch, in_band: None };
            }
            s = (s + step).max(s + f64::EPSILON * s.max(1e-6));
            continue;
        }
        match leave_band(simd, p, error, m, s, end) {
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
    // The work is bounded: an undecided polynomial is reported as a touch, not guessed.
    let (value, _) = value_and_slope(simd, p, s);
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

/// How p leaves the band; with its lowest point, if that lies within the band.
enum Exit {
    Below { root: f64 },
    Above { at: f64, lowest: Option<Touch> },
    Undecided { lowest: Option<Touch> },
}

/// Follows p from the edge of the band |p| <= error until it is certainly outside.
#[inline(always)]
fn leave_band<S: Lanes>(simd: S, p: Groups<'_>, error: f64, m: f64, entry: f64, end: f64) -> Exit {
    let mut s = entry;
    let mut lowest = Touch { at: entry, value: f64::INFINITY };
    let mut step = 0.0_f64;
    let (upper, lower) = ((1.0 + RESOLUTION) * error, -(1.0 - RESOLUTION) * error);
    for taken in 0..STEPS {
        let (v, v1, v2) = derivatives(simd, p, s);
        if v < lowest.value {
            lowest = Touch { at: s, value: v };
        }
        if v < lower {
            return Exit::Below { root: bracketed_root(simd, p, entry, s) };
        }
        // Above the value at which the band was entered; otherwise march and band would take turns.
        let above = v > 1.5 * NEAR_BAND * error && s > entry;
        if above || s >= end {
            let lowest = Some(lowest).filter(|lowest| lowest.value <= upper);
            let lowest = lowest.map(|touch| lowest_nearby(simd, p, touch, (entry, s)));
            return if above { Exit::Above { at: s, lowest } } else { Exit::Undecided { lowest } };
        }
        // No term of Taylor's formula changes p by more than half of the error, so that the steps meet the lowest value
        // nearly; and p certainly stays above the edge of the band that lies below it.
        let change = 0.5 * error;
        let longest = (end - s)
            .min(change / v1.abs().max(f64::MIN_POSITIVE))
            .min((2.0 * change / v2.abs().max(f64::MIN_POSITIVE)).sqrt());
        let floor = if v > upper { error } else { -error };
        let certain = |m: f64, longest: f64| {
            let longest = longest.min((6.0 * change / m.max(f64::MIN_POSITIVE)).cbrt());
            safe_step(v, v1, v2, m, floor, longest)
        };
        let previous = step;
        step = certain(m, longest);
        if taken >= PATIENCE {
            let radius = (4.0 * step.max(previous)).min(longest);
            step = step.max(certain(third_derivative_near(p, m, s, radius), radius));
        }
        s = (s + step).max(s + f64::EPSILON * s.max(1e-9)).min(end);
    }
    Exit::Undecided { lowest: Some(lowest) }
}

/// The local minimum beside a touch that the march has met, by Newton's method on the slope: steps of the march are as long as
/// the error allows, which may be far from the minimum.
#[inline(always)]
fn lowest_nearby<S: Lanes>(
    simd: S,
    p: Groups<'_>,
    mut touch: Touch,
    (entry, end): (f64, f64),
) -> Touch {
    for _ in 0..NEWTON {
        let (_, v1, v2) = derivatives(simd, p, touch.at);
        let at = (touch.at - v1 / v2).clamp(entry, end);
        let (value, _) = value_and_slope(simd, p, at);
        if !(v2 > 0.0 && value <= touch.value) {
            break;
        }
        touch = Touch { at, value };
    }
    touch
}

/// The zero of p between `low` and `high`, where p changes from >= 0 to < 0: Newton kept inside the bracket.
#[inline(always)]
fn bracketed_root<S: Lanes>(simd: S, p: Groups<'_>, low: f64, high: f64) -> f64 {
    let (mut low, mut high) = (low, high);
    if value_and_slope(simd, p, low).0 <= 0.0 {
        return low;
    }
    let mut s = 0.5 * (low + high);
    for _ in 0..100 {
        let (v, v1) = value_and_slope(simd, p, s);
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
