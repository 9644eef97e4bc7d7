//! The factors that move modes over a panel of one width, and the bound of what its polynomials leave out.

use std::array;

use num_complex::Complex64;

use crate::motion::panel::REACH;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::numerics::phi::{exponential_and_phi, inverse, phi2_bound};
use crate::numerics::simd::{ComplexGroup, ComplexVector, GROUP, Group, Lanes, group};

/// Widths grow by powers of two from the one that the fastest mode allows: enough for forty orders
/// of magnitude between the fastest mode and the duration.
pub(super) const LEVELS: usize = 128;
/// The coefficients from the second power on come in groups.
pub(super) const TAIL_GROUPS: usize = (COEFFICIENTS - 2) / GROUP;
/// Powers below this part of the first are left out: their sum is below its rounding.
const NEGLIGIBLE: f64 = 1e-20;
const _: () = assert!(TAIL_GROUPS * GROUP == COEFFICIENTS - 2);

/// Numbers that depend on the width of a panel alone.
#[derive(Debug)]
pub(super) struct Level {
    pub width: f64,
    /// Modes slow enough for the polynomials: a prefix.
    pub slow: usize,
    /// Powers of each slow mode, and the same powers of each group of modes.
    pub powers: Vec<Powers>,
    pub phi2: Vec<Series>,
    /// What the polynomials leave out, relative to `reach` of the slow modes.
    pub truncation: f64,
    pub modes: Vec<LevelModes>,
}

/// A group of modes on a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelModes {
    /// From the start to the middle of the panel; zero for fast modes, which stay affine there.
    pub half: Step,
    /// From the start to the end of the panel.
    pub whole: Step,
    /// Bound of `|t^2 phi2(lambda t)|` on the panel: by the series, for decaying modes also by
    /// `min(h^2 / 2, (2 + |x|) / |lambda|^2)`; infinite for growing modes too fast for the series.
    pub reach: Group,
    /// The same for fast modes alone, zero for slow ones.
    pub fast_reach: Group,
    /// Bound of what a mode adds, per w at the start, to its quadratic part about the middle:
    /// `|x|^3 / 48 |lambda|^2` for slow modes that decay, `reach` for fast ones.
    pub middle_reach: Group,
    /// 1 / lambda of the modes that turn within the width, `|lambda| h > 1`, else zero; and the bound of
    /// `|e^{lambda t} / lambda^2|` of these, of `|t^2 phi2|` of the others.
    pub turning: ComplexGroup,
    pub envelope: Group,
}

/// The factors that move a group of modes by a step h.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub exponential: ComplexGroup,
    /// `h phi1`, `h^2 phi2`
    pub phi1: ComplexGroup,
    pub phi2: ComplexGroup,
}

/// `x^j h^2 / (j + 2)!` for x = lambda h; zero where below rounding of the first.
#[derive(Debug, Clone)]
pub(super) struct Powers(pub [ComplexGroup; TAIL_GROUPS]);

/// `h^2 phi2(lambda h s) s^2` of a group of modes as a series in s: its coefficients from the second power on, zero for fast
/// modes.
#[derive(Debug, Clone)]
pub(super) struct Series([[ComplexGroup; GROUP]; TAIL_GROUPS]);

impl Series {
    fn of(modes: &[Powers]) -> Self {
        Self(array::from_fn(|i| {
            array::from_fn(|lane| {
                let of = |r: usize| modes.get(r).map(|powers| powers.0[i].get(lane));
                ComplexGroup::of(array::from_fn(|r| of(r).unwrap_or_default()))
            })
        }))
    }

    /// Its value at s. Horner's rule in s^4 for each power below: one chain of products would be waited for.
    #[inline(always)]
    pub fn at<S: Lanes>(&self, simd: S, s: f64) -> ComplexGroup {
        let square = s * s;
        let fourth = simd.splat_f64s(square * square);
        let mut sums = [ComplexGroup::ZERO; GROUP];
        for coefficients in self.0.iter().rev() {
            for (sum, &coefficient) in sums.iter_mut().zip(coefficients) {
                *sum = coefficient.add_scaled(simd, fourth, *sum);
            }
        }
        let (s, square) = (simd.splat_f64s(s), simd.splat_f64s(square));
        let [even, odd, next_even, next_odd] = sums;
        let low = even.add_scaled(simd, s, odd);
        let high = next_even.add_scaled(simd, s, next_odd);
        ComplexGroup::ZERO.add_scaled(simd, square, low.add_scaled(simd, square, high))
    }
}

impl Level {
    pub fn new(lambda: &ComplexVector, count: usize, width: f64) -> Self {
        // Ulps above the reach, so that the fastest mode itself belongs to level 0.
        let longest = REACH * (1.0 + 1e-12);
        let is_slow = |lambda: Complex64| (lambda * width).norm_sqr() <= longest * longest;
        let slow = (0..count).take_while(|&r| is_slow(lambda.get(r))).count();
        let leading = 0.5 * width * width;
        let modes = (0..count.div_ceil(GROUP)).map(|g| {
            let mut modes = [Mover::default(); GROUP];
            for (lane, mode) in modes.iter_mut().enumerate() {
                let r = g * GROUP + lane;
                if r < count {
                    *mode = Mover::new(lambda.get(r), width, r < slow);
                }
            }
            LevelModes::of(&modes)
        });
        let powers: Vec<Powers> =
            (0..slow).map(|r| Powers::new(lambda.get(r) * width, leading)).collect();
        Self {
            width,
            slow,
            phi2: powers.chunks(GROUP).map(Series::of).collect(),
            powers,
            truncation: truncation(),
            modes: modes.collect(),
        }
    }
}

/// One mode on a panel: a lane of `LevelModes`.
#[derive(Clone, Copy, Default)]
struct Mover {
    /// e^x, h phi1 and h^2 phi2
    half: [Complex64; 3],
    whole: [Complex64; 3],
    reach: f64,
    fast_reach: f64,
    middle_reach: f64,
    turning: Complex64,
    envelope: f64,
}

impl Mover {
    fn new(lambda: Complex64, width: f64, slow: bool) -> Self {
        let x = lambda * width;
        let modulus = x.norm_sqr().sqrt();
        let reach = if slow {
            width * width * phi2_bound(modulus)
        } else if lambda.re <= 0.0 {
            (0.5 * width * width).min((2.0 + modulus) / lambda.norm_sqr())
        } else {
            f64::INFINITY
        };
        let turns = modulus > 1.0;
        let growth = x.re.max(0.0).exp();
        let step = |h: f64| {
            let (exponential, phi1, phi2) = exponential_and_phi(lambda * h);
            [exponential, h * phi1, h * h * phi2]
        };
        Self {
            half: if slow { step(0.5 * width) } else { Default::default() },
            whole: step(width),
            reach,
            fast_reach: if slow { 0.0 } else { reach },
            // Taylor's remainder, with |w| at the middle and the growth from there in terms of the start.
            middle_reach: if slow { width * width * modulus * growth / 48.0 } else { reach },
            turning: if turns { lambda.inv() } else { Complex64::default() },
            envelope: if turns { growth / lambda.norm_sqr() } else { reach },
        }
    }
}

impl LevelModes {
    fn of(modes: &[Mover; GROUP]) -> Self {
        let real = |of: fn(&Mover) -> f64| group(modes.each_ref().map(of));
        let complex = |of: fn(&Mover) -> Complex64| ComplexGroup::of(modes.each_ref().map(of));
        let step = |of: fn(&Mover) -> &[Complex64; 3]| {
            let part = |k: usize| ComplexGroup::of(modes.each_ref().map(|mode| of(mode)[k]));
            Step { exponential: part(0), phi1: part(1), phi2: part(2) }
        };
        Self {
            half: step(|mode| &mode.half),
            whole: step(|mode| &mode.whole),
            reach: real(|mode| mode.reach),
            fast_reach: real(|mode| mode.fast_reach),
            middle_reach: real(|mode| mode.middle_reach),
            turning: complex(|mode| mode.turning),
            envelope: real(|mode| mode.envelope),
        }
    }
}

impl Powers {
    fn new(x: Complex64, leading: f64) -> Self {
        let mut groups = [ComplexGroup::ZERO; TAIL_GROUPS];
        let mut power = Complex64::from(leading);
        for (g, group) in groups.iter_mut().enumerate() {
            let mut lanes = [Complex64::default(); GROUP];
            for (lane, value) in lanes.iter_mut().enumerate() {
                if power.l1_norm() > NEGLIGIBLE * leading {
                    *value = power;
                }
                power *= x * inverse(g * GROUP + lane + 3);
            }
            *group = ComplexGroup::of(lanes);
        }
        Self(groups)
    }
}

/// The sum of the terms that the polynomials of a mode leave out, over its whole series, at |x| = REACH;
/// less for slower modes.
fn truncation() -> f64 {
    let first: f64 = (3..=COEFFICIENTS).map(|j| REACH / j as f64).product::<f64>() * 0.5;
    first / (1.0 - REACH / (COEFFICIENTS + 1) as f64) / phi2_bound(REACH)
}
