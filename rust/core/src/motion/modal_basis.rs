//! The modes of one combination, laid out for propagation: everything that does not depend on the state.

use std::sync::OnceLock;

use num_complex::Complex64;

use super::phi::{exponential_and_phi, phi2_bound};
use super::{COEFFICIENTS, REACH};
use crate::event::EventFunction;
use crate::reduction::Reduced;
use crate::spectrum::Mode;

/// Widths grow by powers of two from the one that the fastest mode allows: enough for forty orders
/// of magnitude between the fastest mode and the duration.
pub(super) const LEVELS: usize = 128;
/// Modes, and coefficients from the second power on, are kept in groups of this many: no loop has a remainder.
pub(super) const GROUP: usize = 4;
pub(super) const TAIL_GROUPS: usize = (COEFFICIENTS - 2) / GROUP;
const _: () = assert!(TAIL_GROUPS * GROUP == COEFFICIENTS - 2);

/// What one vector instruction works on.
pub(super) type Group = [f64; GROUP];

/// `sum + a b`
#[inline(always)]
pub(super) fn add_product(mut sum: Group, a: &Group, b: &Group) -> Group {
    for lane in 0..GROUP {
        sum[lane] = a[lane].mul_add(b[lane], sum[lane]);
    }
    sum
}

/// `sum - a b`
#[inline(always)]
pub(super) fn subtract_product(mut sum: Group, a: &Group, b: &Group) -> Group {
    for lane in 0..GROUP {
        sum[lane] = (-a[lane]).mul_add(b[lane], sum[lane]);
    }
    sum
}

/// Real numbers in groups, the last filled up with zeros.
pub(super) fn in_groups(values: &[f64]) -> Vec<Group> {
    let whole = values.chunks(GROUP).map(|chunk| {
        let mut group = [0.0; GROUP];
        group[..chunk.len()].copy_from_slice(chunk);
        group
    });
    whole.collect()
}

/// Complex numbers with their parts in two arrays of groups.
#[derive(Debug, Clone, Default)]
pub(super) struct SplitComplex {
    pub re: Vec<Group>,
    pub im: Vec<Group>,
}

impl SplitComplex {
    pub(super) fn of(values: &[Complex64]) -> Self {
        let part = |of: fn(&Complex64) -> f64| {
            in_groups(&values.iter().map(of).collect::<Vec<_>>())
        };
        Self { re: part(|value| value.re), im: part(|value| value.im) }
    }

    #[inline(always)]
    pub fn get(&self, r: usize) -> Complex64 {
        Complex64::new(self.re[r / GROUP][r % GROUP], self.im[r / GROUP][r % GROUP])
    }

    pub fn set(&mut self, r: usize, value: Complex64) {
        (self.re[r / GROUP][r % GROUP], self.im[r / GROUP][r % GROUP]) = (value.re, value.im);
    }

    pub fn resize(&mut self, groups: usize) {
        self.re.resize(groups, [0.0; GROUP]);
        self.im.resize(groups, [0.0; GROUP]);
    }

    /// Both parts of the first `groups` groups.
    #[inline(always)]
    pub fn parts(&self, groups: usize) -> (&[Group], &[Group]) {
        (&self.re[..groups], &self.im[..groups])
    }

    #[inline(always)]
    pub fn parts_mut(&mut self, groups: usize) -> (&mut [Group], &mut [Group]) {
        (&mut self.re[..groups], &mut self.im[..groups])
    }
}

/// Modes ascending in modulus, one of each conjugate pair, in groups filled up with zeros.
#[derive(Debug)]
pub(crate) struct ModalBasis {
    pub(super) kept: Vec<usize>,
    pub(super) count: usize,
    pub(super) groups: usize,
    pub(super) lambda: SplitComplex,
    /// 1 / lambda, 0 where lambda is.
    pub(super) inverse: SplitComplex,
    /// Right vectors with the weight of the conjugate, one row per kept coordinate:
    /// `q_k = Re sum_r shape[k][r] z_r`.
    pub(super) shape: SplitComplex,
    /// `z_r = sum_k from_position[k][r] q_k + from_velocity[k][r] q'_k`.
    pub(super) from_position: SplitComplex,
    pub(super) from_velocity: SplitComplex,
    pub(super) force_constant: SplitComplex,
    pub(super) force_linear: SplitComplex,
    pub(super) sticking: Vec<StickingForce>,
    pub(super) functions: Vec<ModalFunction>,
    base_width: f64,
    levels: [OnceLock<Box<Level>>; LEVELS],
}

/// The modal force per unit of the tangential displacement at which a contact sticks.
#[derive(Debug)]
pub(super) struct StickingForce {
    pub coordinate: usize,
    pub speed: f64,
    pub force: SplitComplex,
}

/// An event function in modal coordinates: `constant + slope t + Re sum_r weights_r z_r`.
#[derive(Debug)]
pub(super) struct ModalFunction {
    pub weights: SplitComplex,
    /// |weights|
    pub magnitudes: Vec<Group>,
    pub constant: f64,
    /// (coordinate, weight) of the tangential displacements of sticking contacts.
    pub sticking: Vec<(usize, f64)>,
    pub slope: f64,
}

/// What depends on the width of a panel alone.
#[derive(Debug)]
pub(super) struct Level {
    pub width: f64,
    /// From the start to the end of the panel.
    pub whole: Step,
    /// Modes slow enough for the polynomials: a prefix.
    pub slow: usize,
    /// Of each slow mode.
    pub powers: Vec<Powers>,
    /// Bound of `|t^2 phi2(lambda t)|` on the panel: by the series, for decaying modes also by
    /// `min(h^2 / 2, (2 + |x|) / |lambda|^2)`; infinite for growing modes too fast for the series.
    pub reach: Vec<Group>,
    /// From the start to the middle of the panel; zero for fast modes, which stay affine there.
    pub half: Step,
    /// Bound of what a mode adds, per w at the start, to its quadratic part about the middle:
    /// `|x|^3 / 48 |lambda|^2` for slow modes that decay, `reach` for fast ones.
    pub middle_reach: Vec<Group>,
    /// What the polynomials leave out, relative to `reach` of the slow modes.
    pub truncation: f64,
    /// Modes that turn within the width, `|lambda| h > 1`, and the bound of `|e^{lambda t} / lambda^2|`.
    pub turns: Vec<bool>,
    pub growth: Vec<f64>,
}

/// What moves the modes by a step h.
#[derive(Debug)]
pub(super) struct Step {
    pub length: f64,
    pub exponential: SplitComplex,
    /// `h phi1`, `h^2 phi2`
    pub phi1: SplitComplex,
    pub phi2: SplitComplex,
}

/// Real and imaginary parts of `x^j h^2 / (j + 2)!` for x = lambda h; zero where below rounding of the first.
#[derive(Debug, Clone)]
pub(super) struct Powers {
    pub re: [Group; TAIL_GROUPS],
    pub im: [Group; TAIL_GROUPS],
}

impl ModalBasis {
    pub fn new(reduced: &Reduced, functions: &[EventFunction], mut modes: Vec<Mode>) -> Self {
        modes.sort_by(|p, q| p.eigenvalue.norm().total_cmp(&q.eigenvalue.norm()));
        let m = reduced.size();
        let count = modes.len();
        let groups = count.div_ceil(GROUP);
        let stride = groups * GROUP;
        let lambda: Vec<Complex64> = modes.iter().map(|mode| mode.eigenvalue).collect();
        let mut shape = vec![Complex64::default(); m * stride];
        let mut from_position = shape.clone();
        let mut from_velocity = shape.clone();
        for (r, mode) in modes.iter().enumerate() {
            let weight = if mode.is_real() { 1.0 } else { 2.0 };
            for k in 0..m {
                shape[k * stride + r] = weight * mode.right[k];
                // left' ((C + lambda M) q + M q') / a
                let product = |matrix: &[f64]| -> Complex64 {
                    (0..m).map(|i| mode.left[i] * matrix[i * m + k]).sum::<Complex64>() / mode.a
                };
                from_velocity[k * stride + r] = product(&reduced.mass);
                from_position[k * stride + r] =
                    product(&reduced.damping) + mode.eigenvalue * from_velocity[k * stride + r];
            }
        }
        let modal_force = |force: &[f64]| -> SplitComplex {
            let of_mode = |mode: &Mode| {
                mode.left.iter().zip(force).map(|(v, f)| v * f).sum::<Complex64>() / mode.a
            };
            SplitComplex::of(&modes.iter().map(of_mode).collect::<Vec<_>>())
        };
        let sticking: Vec<StickingForce> = reduced
            .sticking
            .iter()
            .map(|stick| StickingForce {
                coordinate: stick.coordinate,
                speed: stick.speed,
                force: modal_force(&stick.load),
            })
            .collect();
        let mut column = vec![usize::MAX; reduced.kept.last().map_or(0, |last| last + 1)];
        reduced.kept.iter().enumerate().for_each(|(j, &k)| column[k] = j);
        let column = |k: usize| column.get(k).copied().filter(|&j| j != usize::MAX);
        let functions = functions
            .iter()
            .map(|function| {
                let functional = &function.functional;
                let mut weights = vec![Complex64::default(); stride];
                let mut constant = functional.constant;
                let mut slope = 0.0;
                let mut stuck_terms = Vec::new();
                let stuck = |k: usize| sticking.iter().find(|stick| stick.coordinate == k);
                for &(k, weight) in &functional.position {
                    if let Some(j) = column(k) {
                        for r in 0..count {
                            weights[r] += weight * shape[j * stride + r];
                        }
                    } else if let Some(stick) = stuck(k) {
                        stuck_terms.push((k, weight));
                        slope += weight * stick.speed;
                    }
                }
                for &(k, weight) in &functional.velocity {
                    if let Some(j) = column(k) {
                        for r in 0..count {
                            weights[r] += weight * lambda[r] * shape[j * stride + r];
                        }
                    } else if let Some(stick) = stuck(k) {
                        constant += weight * stick.speed;
                    }
                }
                ModalFunction {
                    magnitudes: in_groups(&weights.iter().map(|h| h.norm()).collect::<Vec<_>>()),
                    weights: SplitComplex::of(&weights),
                    constant,
                    sticking: stuck_terms,
                    slope,
                }
            })
            .collect();
        let fastest = lambda.last().map_or(0.0, |lambda| lambda.norm());
        let inverse: Vec<Complex64> = lambda
            .iter()
            .map(|lambda| if lambda.norm() > 0.0 { lambda.inv() } else { Complex64::default() })
            .collect();
        Self {
            kept: reduced.kept.clone(),
            count,
            groups,
            shape: SplitComplex::of(&shape),
            from_position: SplitComplex::of(&from_position),
            from_velocity: SplitComplex::of(&from_velocity),
            force_constant: modal_force(&reduced.force_constant),
            force_linear: modal_force(&reduced.force_linear),
            sticking,
            functions,
            // Without modes every motion is prescribed and linear: the width grows to that of the phase.
            base_width: if fastest > 0.0 { REACH / fastest } else { 1e-12 },
            levels: [const { OnceLock::new() }; LEVELS],
            lambda: SplitComplex::of(&lambda),
            inverse: SplitComplex::of(&inverse),
        }
    }

    pub(super) fn level(&self, level: usize) -> &Level {
        self.levels[level]
            .get_or_init(|| Box::new(Level::new(self, self.base_width * (level as f64).exp2())))
    }
}

impl Level {
    fn new(basis: &ModalBasis, width: f64) -> Self {
        let stride = basis.groups * GROUP;
        let lambdas: Vec<Complex64> = (0..stride).map(|r| basis.lambda.get(r)).collect();
        // Ulps above the reach, so that the fastest mode itself belongs to level 0.
        let is_slow = |lambda: &Complex64| lambda.norm() * width <= REACH * (1.0 + 1e-12);
        let slow = lambdas[..basis.count].partition_point(is_slow);
        let (mut reach, mut middle_reach) = (vec![0.0; stride], vec![0.0; stride]);
        let mut growth = vec![0.0; stride];
        let mut powers = Vec::with_capacity(slow);
        let leading = 0.5 * width * width;
        for (r, &lambda) in lambdas[..basis.count].iter().enumerate() {
            let x = lambda * width;
            growth[r] = x.re.max(0.0).exp() / lambda.norm_sqr();
            if r < slow {
                powers.push(Powers::new(x, leading));
                reach[r] = width * width * phi2_bound(x.norm());
                // Taylor's remainder, with |w| at the middle and the growth from there in terms of the start.
                middle_reach[r] = width * width * x.norm() * x.re.max(0.0).exp() / 48.0;
            } else if lambda.re <= 0.0 {
                reach[r] = leading.min((2.0 + x.norm()) / lambda.norm_sqr());
                middle_reach[r] = reach[r];
            } else {
                reach[r] = f64::INFINITY;
                middle_reach[r] = f64::INFINITY;
            }
        }
        Self {
            width,
            whole: Step::new(&lambdas, width, basis.count),
            slow,
            powers,
            reach: in_groups(&reach),
            half: Step::new(&lambdas, 0.5 * width, slow),
            middle_reach: in_groups(&middle_reach),
            truncation: truncation(),
            turns: lambdas.iter().map(|lambda| lambda.norm() * width > 1.0).collect(),
            growth,
        }
    }
}

impl Step {
    /// Of the first `moving` modes.
    fn new(lambdas: &[Complex64], length: f64, moving: usize) -> Self {
        let mut all = vec![Default::default(); lambdas.len()];
        for (target, lambda) in all[..moving].iter_mut().zip(lambdas) {
            *target = exponential_and_phi(lambda * length);
        }
        let split = |f: &dyn Fn(&(Complex64, Complex64, Complex64)) -> Complex64| {
            SplitComplex::of(&all.iter().map(f).collect::<Vec<_>>())
        };
        Self {
            length,
            exponential: split(&|f| f.0),
            phi1: split(&|f| length * f.1),
            phi2: split(&|f| length * length * f.2),
        }
    }
}

impl Powers {
    fn new(x: Complex64, leading: f64) -> Self {
        let (mut re, mut im) = ([[0.0; GROUP]; TAIL_GROUPS], [[0.0; GROUP]; TAIL_GROUPS]);
        let mut power = Complex64::from(leading);
        for j in 0..TAIL_GROUPS * GROUP {
            if size(power.re, power.im) > 1e-20 * leading {
                re[j / GROUP][j % GROUP] = power.re;
                im[j / GROUP][j % GROUP] = power.im;
            }
            power *= x / (j + 3) as f64;
        }
        Self { re, im }
    }
}

/// An upper bound of the modulus, within a factor of sqrt 2.
pub(super) fn size(re: f64, im: f64) -> f64 {
    re.abs() + im.abs()
}

/// The sum of the terms that the polynomials of a mode leave out, over its whole series, at |x| = REACH;
/// less for slower modes.
fn truncation() -> f64 {
    let first: f64 = (3..=COEFFICIENTS).map(|j| REACH / j as f64).product::<f64>() * 0.5;
    first / (1.0 - REACH / (COEFFICIENTS + 1) as f64) / phi2_bound(REACH)
}
