//! Modal propagation: every mode of the combination moves on its own.
//!
//! `z' = lambda z + p0 + p1 t` for each mode. With `w = z''`, which is a pure exponential,
//!
//! ```text
//! z(t + h) = z + h z' + h^2 phi2(lambda h) w,   z'(t + h) = z' + h phi1(lambda h) w,   w(t + h) = e^{lambda h} w
//! ```
//!
//! holds for every lambda, zero included, without cancellation; an event function `Re sum h_r z_r + ..`
//! is then a polynomial with coefficients `Re sum h_r w_r lambda_r^j / (j + 2)!` from the second power on.
//! Before a polynomial is formed, an envelope is tried: the quadratic part against the sum of what the
//! modes can add to it; and before a panel is taken, after some quiet ones, the envelope of a far longer
//! stretch.

use num_complex::Complex64;
use pulp::{Simd, WithSimd};

use super::modal_basis::{GROUP, LEVELS, Level, ModalBasis, SplitComplex, TAIL, size};
use super::phi::exponential_and_phi;
use super::{COEFFICIENTS, DEGREE, Panel};

/// Quiet panels before a leap is tried, and the first leap in powers of two panels.
const QUIET: u32 = 2;
const FIRST_LEAP: usize = 3;

/// One phase in modal coordinates; its buffers serve every phase of a run.
#[derive(Debug)]
pub(crate) struct ModalMotion {
    arch: pulp::Arch,
    start: f64,
    panels: u32,
    level: usize,
    quiet: u32,
    leap: usize,
    z: SplitComplex,
    dz: SplitComplex,
    /// z''
    w: SplitComplex,
    /// Sizes |z|, |z'|, |w| as sums of the moduli of their parts.
    sizes: [Vec<f64>; 3],
    /// Constant part of each event function at local time 0.
    constants: Vec<f64>,
    /// (q, q') of the kept coordinates at local time 0.
    gathered: Vec<[f64; 2]>,
    /// q at local time 0 of the coordinates that stick, in the order of the basis.
    stuck: Vec<f64>,
}

impl ModalMotion {
    pub fn new() -> Self {
        Self {
            arch: pulp::Arch::new(),
            start: 0.0,
            panels: 0,
            level: 0,
            quiet: 0,
            leap: FIRST_LEAP,
            z: SplitComplex::default(),
            dz: SplitComplex::default(),
            w: SplitComplex::default(),
            sizes: Default::default(),
            constants: Vec::new(),
            gathered: Vec::new(),
            stuck: Vec::new(),
        }
    }

    /// Starts a phase at local time 0 from (q, q').
    pub fn restart(&mut self, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        self.start = 0.0;
        self.panels = 0;
        self.level = 0;
        self.quiet = 0;
        self.leap = FIRST_LEAP;
        self.stuck.clear();
        self.stuck.extend(basis.sticking.iter().map(|stick| q[stick.coordinate]));
        self.constants.clear();
        self.constants.extend(basis.functions.iter().map(|function| {
            let stuck: f64 = function.sticking.iter().map(|&(k, weight)| weight * q[k]).sum();
            function.constant + stuck
        }));
        self.sizes.iter_mut().for_each(|sizes| sizes.resize(basis.stride, 0.0));
        self.arch.dispatch(Project { motion: self, basis, q, u });
    }

    #[inline(always)]
    fn project(&mut self, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        let Self { z, dz, w, stuck, gathered, .. } = self;
        gathered.clear();
        gathered.extend(basis.kept.iter().map(|&k| [q[k], u[k]]));
        z.resize(basis.stride);
        let count = basis.stride / GROUP;
        let rows = gathered.len() * count;
        let (from_q, from_u) = (&basis.from_position, &basis.from_velocity);
        for (part, of_q, of_u) in
            [(&mut z.re, &from_q.re, &from_u.re), (&mut z.im, &from_q.im, &from_u.im)]
        {
            let (of_q, of_u) = (in_groups(of_q, rows), in_groups(of_u, rows));
            for (g, target) in part.as_chunks_mut::<GROUP>().0.iter_mut().enumerate() {
                let mut sum = [0.0; GROUP];
                let mut row = g;
                for &[q, u] in gathered.iter() {
                    sum = add_product(sum, &[q; GROUP], &of_q[row]);
                    sum = add_product(sum, &[u; GROUP], &of_u[row]);
                    row += count;
                }
                *target = sum;
            }
        }
        // dz holds the force until it is used.
        dz.copy_from(&basis.force_constant);
        for (stick, &at) in basis.sticking.iter().zip(stuck.iter()) {
            dz.add_scaled(at, &stick.force);
        }
        dz.add_product(&basis.lambda, z);
        w.copy_from(&basis.force_linear);
        w.add_product(&basis.lambda, dz);
    }

    pub fn start(&self) -> f64 {
        self.start
    }

    #[inline(always)]
    fn measure(&mut self) {
        let Self { z, dz, w, sizes: [of_z, of_dz, of_w], .. } = self;
        for (sizes, values) in [(of_z, z), (of_dz, dz), (of_w, w)] {
            for ((target, re), im) in sizes.iter_mut().zip(&values.re).zip(&values.im) {
                *target = size(*re, *im);
            }
        }
    }

    /// Whether every mode too fast for the polynomials of `level` has decayed below rounding.
    fn allows(&self, basis: &ModalBasis, level: &Level) -> bool {
        let fast = level.slow..basis.count;
        basis.functions.iter().all(|function| {
            let bound: f64 = fast
                .clone()
                .map(|r| function.magnitudes[r] * self.sizes[2][r] * level.reach[r])
                .sum();
            let scale: f64 =
                function.magnitudes.iter().zip(&self.sizes[0]).map(|(h, z)| h * z).sum();
            bound <= f64::EPSILON * scale
        })
    }

    /// Moves over stretches that the envelope proves free of events, up to `remaining`.
    fn leap(&mut self, basis: &ModalBasis, remaining: f64) -> u32 {
        let mut leaps = 0;
        while self.quiet >= QUIET {
            let index = (self.level + self.leap).min(LEVELS - 1);
            let level = basis.level(index);
            if self.start + level.width > remaining || !self.is_quiet(basis, level) {
                if self.leap <= 1 {
                    self.quiet = 0;
                    self.leap = FIRST_LEAP;
                    break;
                }
                self.leap -= 1;
                continue;
            }
            self.advance_by(level);
            self.arch.dispatch(Measure { motion: self });
            self.leap += 1;
            leaps += 1;
        }
        leaps
    }

    /// Whether all event functions stay positive over `level.width`: with `f = A + B t + sum Re(g / lambda^2
    /// e^{lambda t})` over the modes that turn within it, and the bound of the series for those that don't.
    fn is_quiet(&self, basis: &ModalBasis, level: &Level) -> bool {
        basis.functions.iter().enumerate().all(|(index, function)| {
            let mut value = self.constants[index] + function.slope * self.start;
            let mut slope = function.slope;
            let (mut envelope, mut scale) = (0.0, value.abs());
            for r in 0..basis.count {
                let (hr, hi) = (function.weights.re[r], function.weights.im[r]);
                value += hr * self.z.re[r] - hi * self.z.im[r];
                slope += hr * self.dz.re[r] - hi * self.dz.im[r];
                scale +=
                    function.magnitudes[r] * (self.sizes[0][r] + level.width * self.sizes[1][r]);
                let amplitude = function.magnitudes[r] * self.sizes[2][r];
                if level.turns[r] {
                    let (gr, gi) = (
                        hr * self.w.re[r] - hi * self.w.im[r],
                        hr * self.w.im[r] + hi * self.w.re[r],
                    );
                    let (ir, ii) = (basis.inverse.re[r], basis.inverse.im[r]);
                    // g / lambda and g / lambda^2
                    let (ar, ai) = (gr * ir - gi * ii, gr * ii + gi * ir);
                    slope -= ar;
                    value -= ar * ir - ai * ii;
                    envelope += amplitude * level.growth[r];
                } else {
                    envelope += amplitude * level.reach[r];
                }
            }
            let lowest = value + (slope * level.width).min(0.0) - envelope;
            lowest > 1e-12 * (scale + envelope)
        })
    }

    pub fn expand(&mut self, basis: &ModalBasis, remaining: f64, panel: &mut Panel) {
        self.arch.dispatch(Measure { motion: self });
        panel.leaps += self.leap(basis, remaining) as usize;
        // A panel beyond the end of the phase would only spread its rounding over a longer line.
        while self.level + 1 < LEVELS
            && self.start + basis.level(self.level).width < remaining
            && self.allows(basis, basis.level(self.level + 1))
        {
            self.level += 1;
        }
        let level = basis.level(self.level);
        panel.reset(level.width, basis.functions.len());
        self.arch.dispatch(Fill { motion: self, basis, level, panel });
        let all_quiet = panel.excluded.iter().all(|&excluded| excluded);
        self.quiet = if all_quiet { self.quiet + 1 } else { 0 };
    }

    #[inline(always)]
    fn fill(&self, basis: &ModalBasis, level: &Level, panel: &mut Panel) {
        let width = level.width;
        // Dot products of `count` complex terms, a table built by DEGREE multiplications, Horner's rule,
        // and the recurrence over the panels before this one, each a few roundings of relative size u.
        let unit = 0.5 * f64::EPSILON;
        let rounding = unit * (2 * basis.count + 3 * DEGREE + 10 + 8 * self.panels as usize) as f64;
        let [of_z, of_dz, of_w] = &self.sizes;
        let count = basis.stride / GROUP;
        let state = [&self.z, &self.dz, &self.w]
            .map(|part| (in_groups(&part.re, count), in_groups(&part.im, count)));
        let sizes = [of_z, of_dz, of_w].map(|sizes| in_groups(sizes, count));
        let (reach, cubic_reach) =
            (in_groups(&level.reach, count), in_groups(&level.cubic_reach, count));
        for (index, function) in basis.functions.iter().enumerate() {
            let (hr, hi) = (&function.weights.re[..], &function.weights.im[..]);
            let (re, im) = (in_groups(hr, count), in_groups(hi, count));
            let magnitude = in_groups(&function.magnitudes, count);
            // Seven sums over the modes, each in the lanes of a group.
            let mut sums = [[0.0; GROUP]; 7];
            for g in 0..count {
                for k in 0..3 {
                    let (part_re, part_im) = (&state[k].0[g], &state[k].1[g]);
                    sums[k] = add_product(sums[k], &re[g], part_re);
                    sums[k] = subtract_product(sums[k], &im[g], part_im);
                }
                sums[3] = add_product(sums[3], &magnitude[g], &sizes[0][g]);
                sums[4] = add_product(sums[4], &magnitude[g], &sizes[1][g]);
                let amplitude = add_product([0.0; GROUP], &magnitude[g], &sizes[2][g]);
                sums[5] = add_product(sums[5], &amplitude, &reach[g]);
                sums[6] = add_product(sums[6], &amplitude, &cubic_reach[g]);
            }
            let offset = self.constants[index] + function.slope * self.start;
            let value = offset + sum_of(sums[0]);
            let slope = function.slope + sum_of(sums[1]);
            let second = sum_of(sums[2]);
            let affine = offset.abs().max(self.constants[index].abs())
                + width * (function.slope.abs() + sum_of(sums[4]))
                + sum_of(sums[3]);
            let (curvature, cubic) = (sum_of(sums[5]), sum_of(sums[6]));
            let remainder = curvature * level.truncation + {
                let fast = level.slow..basis.count;
                fast.map(|r| function.magnitudes[r] * of_w[r] * level.reach[r]).sum::<f64>()
            };
            panel.curvature_error[index] = rounding * curvature + remainder;
            panel.error[index] = rounding * (affine + curvature) + remainder;
            let (c0, c1, c2) = (value, slope * width, 0.5 * second * width * width);
            let mut lowest = c0.min(c0 + c1 + c2);
            if c2 > 0.0 && c1 < 0.0 && -c1 < 2.0 * c2 {
                lowest = c0 - 0.25 * c1 * c1 / c2;
            }
            panel.excluded[index] = lowest - cubic > panel.error[index];
            if panel.excluded[index] {
                continue;
            }
            let c = &mut panel.coefficients[index * COEFFICIENTS..(index + 1) * COEFFICIENTS];
            c[0] = c0;
            c[1] = c1;
            let tail: &mut [f64; TAIL] = match (&mut c[2..]).try_into() {
                Ok(tail) => tail,
                Err(_) => unreachable!("COEFFICIENTS is TAIL + 2"),
            };
            let (w_re, w_im) = (&self.w.re[..level.slow], &self.w.im[..level.slow]);
            let (hr, hi) = (&hr[..level.slow], &hi[..level.slow]);
            *tail = [0.0; TAIL];
            let tail = tail.as_chunks_mut::<GROUP>().0;
            for (r, powers) in level.powers.iter().enumerate() {
                let g_re = [hr[r] * w_re[r] - hi[r] * w_im[r]; GROUP];
                let g_im = [hr[r] * w_im[r] + hi[r] * w_re[r]; GROUP];
                for (sum, (re, im)) in tail.iter_mut().zip(powers) {
                    *sum = subtract_product(add_product(*sum, &g_re, re), &g_im, im);
                }
            }
        }
    }

    fn advance_by(&mut self, level: &Level) {
        self.arch.dispatch(Advance { motion: self, level });
        self.start += level.width;
        self.panels += 1;
    }

    #[inline(always)]
    fn shift(&mut self, level: &Level) {
        self.z.add_scaled(level.width, &self.dz);
        self.z.add_product(&level.phi2, &self.w);
        self.dz.add_product(&level.phi1, &self.w);
        self.w.multiply(&level.exponential);
    }

    pub fn advance(&mut self, basis: &ModalBasis) {
        self.advance_by(basis.level(self.level));
    }

    /// (q, q') at `offset` after the start of the panel.
    pub fn state(&self, basis: &ModalBasis, offset: f64, q: &mut [f64], u: &mut [f64]) {
        self.arch.dispatch(StateAt { motion: self, basis, offset, q, u });
        for (stick, &at) in basis.sticking.iter().zip(&self.stuck) {
            q[stick.coordinate] = at + stick.speed * (self.start + offset);
            u[stick.coordinate] = stick.speed;
        }
    }

    /// z and z' of one mode at `offset` after the start of the panel.
    #[inline(always)]
    fn mode_at(&self, basis: &ModalBasis, r: usize, offset: f64) -> (Complex64, Complex64) {
        let lambda = basis.lambda.get(r);
        let (z, dz, w) = (self.z.get(r), self.dz.get(r), self.w.get(r));
        let linear = basis.force_linear.get(r);
        // The force at the start of the panel.
        let force = dz - lambda * z;
        // Inverting z' = lambda z + p costs one exponential, and loses no digit unless p / lambda,
        // the static part, is larger than what moves.
        if force.norm_sqr() <= 64.0 * (lambda * z).norm_sqr()
            && linear.norm_sqr() <= 64.0 * (lambda * dz).norm_sqr()
        {
            let inverse = basis.inverse.get(r);
            let dz = ((lambda * offset).exp() * w - linear) * inverse;
            ((dz - force - linear * offset) * inverse, dz)
        } else {
            let (_, phi1, phi2) = exponential_and_phi(lambda * offset);
            (z + offset * (dz + offset * phi2 * w), dz + offset * phi1 * w)
        }
    }

    #[inline(always)]
    fn superpose(&self, basis: &ModalBasis, offset: f64, q: &mut [f64], u: &mut [f64]) {
        let count = basis.stride / GROUP;
        let rows = basis.kept.len() * count;
        let (shape_re, shape_im) =
            (in_groups(&basis.shape.re, rows), in_groups(&basis.shape.im, rows));
        for g in 0..count {
            let mut parts = [[0.0; GROUP]; 4];
            for lane in 0..GROUP.min(basis.count - g * GROUP) {
                let (z, dz) = self.mode_at(basis, g * GROUP + lane, offset);
                for (part, value) in parts.iter_mut().zip([z.re, z.im, dz.re, dz.im]) {
                    part[lane] = value;
                }
            }
            let [z_re, z_im, dz_re, dz_im] = &parts;
            let mut row = g;
            for &k in &basis.kept {
                let (re, im) = (&shape_re[row], &shape_im[row]);
                let position = subtract_product(add_product([0.0; GROUP], re, z_re), im, z_im);
                let velocity = subtract_product(add_product([0.0; GROUP], re, dz_re), im, dz_im);
                let (position, velocity) = (sum_of(position), sum_of(velocity));
                if g == 0 {
                    (q[k], u[k]) = (position, velocity);
                } else {
                    q[k] += position;
                    u[k] += velocity;
                }
                row += count;
            }
        }
    }

    /// Largest |lambda| of the modes whose transient velocity `w / lambda` at `offset` is not yet rounding of the
    /// velocities of all.
    pub fn growth_rate(&self, basis: &ModalBasis, offset: f64) -> f64 {
        let rows = 0..basis.kept.len();
        let largest = |r: usize| {
            rows.clone().map(|j| basis.shape.get(j * basis.stride + r).norm()).fold(0.0, f64::max)
        };
        let transient: Vec<f64> = (0..basis.count)
            .map(|r| {
                let lambda = basis.lambda.get(r);
                let decay = (lambda.re * offset).exp();
                largest(r) * self.w.get(r).norm() * decay / lambda.norm().max(f64::MIN_POSITIVE)
            })
            .collect();
        let steady = (0..basis.count).map(|r| largest(r) * self.dz.get(r).norm()).sum::<f64>();
        let floor = f64::EPSILON * transient.iter().fold(steady, |size, v| size.max(*v));
        // One that grows may rise from below rounding.
        (0..basis.count)
            .filter(|&r| {
                !(transient[r] <= floor) || (basis.lambda.re[r] > 0.0 && transient[r] > 0.0)
            })
            .map(|r| basis.lambda.get(r).norm())
            .fold(0.0, f64::max)
    }
}

/// The first `count` groups of an array.
#[inline(always)]
fn in_groups(values: &[f64], count: usize) -> &[[f64; GROUP]] {
    &values.as_chunks::<GROUP>().0[..count]
}

#[inline(always)]
fn add_product(mut sum: [f64; GROUP], a: &[f64; GROUP], b: &[f64; GROUP]) -> [f64; GROUP] {
    for lane in 0..GROUP {
        sum[lane] = a[lane].mul_add(b[lane], sum[lane]);
    }
    sum
}

#[inline(always)]
fn subtract_product(mut sum: [f64; GROUP], a: &[f64; GROUP], b: &[f64; GROUP]) -> [f64; GROUP] {
    for lane in 0..GROUP {
        sum[lane] = (-a[lane]).mul_add(b[lane], sum[lane]);
    }
    sum
}

#[inline(always)]
fn sum_of(lanes: [f64; GROUP]) -> f64 {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// Work on all modes, compiled for the vector units found at run time. Only what is inlined into `with_simd` is.
struct Project<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    q: &'a [f64],
    u: &'a [f64],
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.motion.project(self.basis, self.q, self.u);
    }
}

struct StateAt<'a> {
    motion: &'a ModalMotion,
    basis: &'a ModalBasis,
    offset: f64,
    q: &'a mut [f64],
    u: &'a mut [f64],
}

impl WithSimd for StateAt<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.motion.superpose(self.basis, self.offset, self.q, self.u);
    }
}

struct Measure<'a> {
    motion: &'a mut ModalMotion,
}

impl WithSimd for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.motion.measure();
    }
}

struct Fill<'a> {
    motion: &'a ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
    panel: &'a mut Panel,
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.motion.fill(self.basis, self.level, self.panel);
    }
}

struct Advance<'a> {
    motion: &'a mut ModalMotion,
    level: &'a Level,
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.motion.shift(self.level);
    }
}
