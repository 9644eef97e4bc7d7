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

use std::array::from_fn;

use num_complex::Complex64;
use pulp::{Simd, WithSimd};

use super::modal_basis::{
    GROUP, Group, LEVELS, Level, ModalBasis, SplitComplex, Step, TAIL_GROUPS, add_product, size,
    subtract_product,
};
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
    sizes: [Vec<Group>; 3],
    /// On the panel: bounds of each mode's affine part, of what it adds to that, and of what it adds to its quadratic
    /// part about the middle, rounding included.
    bounds: [Vec<Group>; 3],
    /// z, z' and w in the middle of the panel.
    middle: [SplitComplex; 3],
    /// Weight times w of one event function.
    gains: SplitComplex,
    /// t^2 phi2, z and z' at a time within the panel.
    phi2: SplitComplex,
    z_at: SplitComplex,
    dz_at: SplitComplex,
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
            bounds: Default::default(),
            middle: Default::default(),
            gains: SplitComplex::default(),
            phi2: SplitComplex::default(),
            z_at: SplitComplex::default(),
            dz_at: SplitComplex::default(),
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
        for buffer in self.sizes.iter_mut().chain(&mut self.bounds) {
            buffer.resize(basis.groups, [0.0; GROUP]);
        }
        let Self { z, dz, w, gains, phi2, z_at, dz_at, middle, .. } = self;
        for buffer in [z, dz, w, gains, phi2, z_at, dz_at].into_iter().chain(middle) {
            buffer.resize(basis.groups);
        }
        self.arch.dispatch(Project { motion: self, basis, q, u });
    }

    #[inline(always)]
    fn project(&mut self, groups: usize, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        let gathered = &mut self.gathered;
        gathered.clear();
        gathered.extend(basis.kept.iter().map(|&k| [q[k], u[k]]));
        let rows = gathered.len() * groups;
        let (q_re, q_im) = basis.from_position.parts(rows);
        let (u_re, u_im) = basis.from_velocity.parts(rows);
        let (lambda_re, lambda_im) = basis.lambda.parts(groups);
        let (force_re, force_im) = basis.force_constant.parts(groups);
        let (linear_re, linear_im) = basis.force_linear.parts(groups);
        let (z_re, z_im) = self.z.parts_mut(groups);
        let (dz_re, dz_im) = self.dz.parts_mut(groups);
        let (w_re, w_im) = self.w.parts_mut(groups);
        for g in 0..groups {
            let (mut re, mut im) = ([0.0; GROUP], [0.0; GROUP]);
            let mut row = g;
            for &[q, u] in gathered.iter() {
                let (q, u) = ([q; GROUP], [u; GROUP]);
                re = add_product(add_product(re, &q, &q_re[row]), &u, &u_re[row]);
                im = add_product(add_product(im, &q, &q_im[row]), &u, &u_im[row]);
                row += groups;
            }
            (z_re[g], z_im[g]) = (re, im);
            let (mut force_re, mut force_im) = (force_re[g], force_im[g]);
            for (stick, &at) in basis.sticking.iter().zip(&self.stuck) {
                force_re = add_product(force_re, &[at; GROUP], &stick.force.re[g]);
                force_im = add_product(force_im, &[at; GROUP], &stick.force.im[g]);
            }
            let lambda = (&lambda_re[g], &lambda_im[g]);
            let dz = add_complex((force_re, force_im), lambda, (&re, &im));
            let w = add_complex((linear_re[g], linear_im[g]), lambda, (&dz.0, &dz.1));
            (dz_re[g], dz_im[g]) = dz;
            (w_re[g], w_im[g]) = w;
        }
    }

    pub fn start(&self) -> f64 {
        self.start
    }

    #[inline(always)]
    fn measure(&mut self, groups: usize) {
        let [of_z, of_dz, of_w] = &mut self.sizes;
        for (sizes, values) in [(of_z, &self.z), (of_dz, &self.dz), (of_w, &self.w)] {
            let (sizes, (re, im)) = (&mut sizes[..groups], values.parts(groups));
            for g in 0..groups {
                sizes[g] = from_fn(|lane| size(re[g][lane], im[g][lane]));
            }
        }
    }

    /// Whether every mode too fast for the polynomials of `level` has decayed below rounding.
    fn allows(&self, basis: &ModalBasis, level: &Level) -> bool {
        basis.functions.iter().all(|function| {
            let magnitudes = function.magnitudes.as_flattened();
            let (of_z, of_w) = (self.sizes[0].as_flattened(), self.sizes[2].as_flattened());
            let reach = level.reach.as_flattened();
            let fast = level.slow..basis.count;
            let bound: f64 = fast.map(|r| magnitudes[r] * of_w[r] * reach[r]).sum();
            let scale: f64 = magnitudes.iter().zip(of_z).map(|(h, z)| h * z).sum();
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
            self.advance_by(basis, level);
            self.arch.dispatch(Measure { motion: self, basis });
            self.leap += 1;
            leaps += 1;
        }
        leaps
    }

    /// Whether all event functions stay positive over `level.width`: with `f = A + B t + sum Re(g / lambda^2
    /// e^{lambda t})` over the modes that turn within it, and the bound of the series for those that don't.
    fn is_quiet(&self, basis: &ModalBasis, level: &Level) -> bool {
        let [of_z, of_dz, of_w] = self.sizes.each_ref().map(|sizes| sizes.as_flattened());
        let reach = level.reach.as_flattened();
        basis.functions.iter().enumerate().all(|(index, function)| {
            let mut value = self.constants[index] + function.slope * self.start;
            let mut slope = function.slope;
            let (mut envelope, mut scale) = (0.0, value.abs());
            let magnitudes = function.magnitudes.as_flattened();
            for r in 0..basis.count {
                let weight = function.weights.get(r);
                value += (weight * self.z.get(r)).re;
                slope += (weight * self.dz.get(r)).re;
                scale += magnitudes[r] * (of_z[r] + level.width * of_dz[r]);
                let amplitude = magnitudes[r] * of_w[r];
                if level.turns[r] {
                    let inverse = basis.inverse.get(r);
                    let first = weight * self.w.get(r) * inverse;
                    slope -= first.re;
                    value -= (first * inverse).re;
                    envelope += amplitude * level.growth[r];
                } else {
                    envelope += amplitude * reach[r];
                }
            }
            let lowest = value + (slope * level.width).min(0.0) - envelope;
            lowest > 1e-12 * (scale + envelope)
        })
    }

    pub fn expand(&mut self, basis: &ModalBasis, remaining: f64, panel: &mut Panel) {
        self.arch.dispatch(Measure { motion: self, basis });
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
    fn fill(&mut self, groups: usize, basis: &ModalBasis, level: &Level, panel: &mut Panel) {
        let width = level.width;
        // Dot products of `count` complex terms, a table built by DEGREE multiplications, Horner's rule,
        // and the recurrence over the panels before this one, each a few roundings of relative size u.
        let unit = 0.5 * f64::EPSILON;
        let rounding = unit * (2 * basis.count + 3 * DEGREE + 10 + 8 * self.panels as usize) as f64;
        let (z_re, z_im) = self.z.parts(groups);
        let (dz_re, dz_im) = self.dz.parts(groups);
        let (w_re, w_im) = self.w.parts(groups);
        let [of_z, of_dz, of_w] = self.sizes.each_ref().map(|sizes| &sizes[..groups]);
        let (reach, middle_reach) = (&level.reach[..groups], &level.middle_reach[..groups]);
        let [affine, curvature, rest] = self.bounds.each_mut().map(|bound| &mut bound[..groups]);
        let [z_middle, dz_middle, w_middle] = self.middle.each_mut();
        for g in 0..groups {
            let zero = [0.0; GROUP];
            affine[g] = add_product(of_z[g], &of_dz[g], &[width; GROUP]);
            curvature[g] = add_product(zero, &of_w[g], &reach[g]);
            let total = from_fn(|lane| affine[g][lane] + curvature[g][lane]);
            let rounded = add_product(zero, &total, &[rounding; GROUP]);
            rest[g] = add_product(rounded, &of_w[g], &middle_reach[g]);
            let moved = moved(
                &level.half,
                g,
                [(z_re[g], z_im[g]), (dz_re[g], dz_im[g]), (w_re[g], w_im[g])],
            );
            for (target, value) in
                [&mut *z_middle, &mut *dz_middle, &mut *w_middle].into_iter().zip(moved)
            {
                (target.re[g], target.im[g]) = value;
            }
        }
        let (z_middle, dz_middle) = (z_middle.parts(groups), dz_middle.parts(groups));
        let w_middle = w_middle.parts(groups);
        for (index, function) in basis.functions.iter().enumerate() {
            let (re, im) = function.weights.parts(groups);
            let magnitude = &function.magnitudes[..groups];
            let (constant, slope) = (self.constants[index], function.slope);
            let offset = constant + slope * self.start;
            let of_offset = offset.abs().max(constant.abs()) + width * slope.abs();
            // Sums over the modes, each in the lanes of a group.
            let mut sums = [[0.0; GROUP]; 4];
            for g in 0..groups {
                for (k, (part_re, part_im)) in
                    [z_middle, dz_middle, w_middle].into_iter().enumerate()
                {
                    sums[k] = add_product(sums[k], &re[g], &part_re[g]);
                    sums[k] = subtract_product(sums[k], &im[g], &part_im[g]);
                }
                sums[3] = add_product(sums[3], &magnitude[g], &rest[g]);
            }
            let [value, first, second, rest] = sums.map(sum_of);
            let half = 0.5 * width;
            let (c0, c1) = (offset + half * slope + value, (half * (slope + first)).abs());
            let c2 = 0.5 * second * half * half;
            let lowest =
                if c1 < 2.0 * c2 { c0 - 0.25 * c1 * c1 / c2 } else { c0 - c1 + c2 };
            panel.excluded[index] = lowest - rest > rounding * of_offset;
            if panel.excluded[index] {
                continue;
            }
            let mut sums = [[0.0; GROUP]; 4];
            for g in 0..groups {
                for (k, (part_re, part_im)) in
                    [(z_re, z_im), (dz_re, dz_im)].into_iter().enumerate()
                {
                    sums[k] = add_product(sums[k], &re[g], &part_re[g]);
                    sums[k] = subtract_product(sums[k], &im[g], &part_im[g]);
                }
                sums[2] = add_product(sums[2], &magnitude[g], &affine[g]);
                sums[3] = add_product(sums[3], &magnitude[g], &curvature[g]);
            }
            let [value, first, affine, curvature] = sums.map(sum_of);
            let mut remainder = curvature * level.truncation;
            if level.slow < basis.count {
                let (magnitudes, of_w) = (magnitude.as_flattened(), of_w.as_flattened());
                let fast = level.slow..basis.count;
                let reach = reach.as_flattened();
                remainder += fast.map(|r| magnitudes[r] * of_w[r] * reach[r]).sum::<f64>();
            }
            panel.curvature_error[index] = rounding * curvature + remainder;
            panel.error[index] = rounding * (of_offset + affine + curvature) + remainder;
            let (gain_re, gain_im) = self.gains.parts_mut(groups);
            for g in 0..groups {
                let zero = ([0.0; GROUP], [0.0; GROUP]);
                (gain_re[g], gain_im[g]) =
                    add_complex(zero, (&re[g], &im[g]), (&w_re[g], &w_im[g]));
            }
            let gains = gain_re.as_flattened().iter().zip(gain_im.as_flattened());
            let mut tail = [[0.0; GROUP]; TAIL_GROUPS];
            for (powers, (&re, &im)) in level.powers.iter().zip(gains) {
                for (k, sum) in tail.iter_mut().enumerate() {
                    *sum = add_product(*sum, &[re; GROUP], &powers.re[k]);
                    *sum = subtract_product(*sum, &[im; GROUP], &powers.im[k]);
                }
            }
            let c = &mut panel.coefficients[index * COEFFICIENTS..(index + 1) * COEFFICIENTS];
            (c[0], c[1]) = (offset + value, (slope + first) * width);
            c[2..].copy_from_slice(tail.as_flattened());
        }
    }

    fn advance_by(&mut self, basis: &ModalBasis, level: &Level) {
        self.arch.dispatch(Advance { motion: self, basis, level });
        self.start += level.width;
        self.panels += 1;
    }

    #[inline(always)]
    fn shift(&mut self, groups: usize, level: &Level) {
        let (z_re, z_im) = self.z.parts_mut(groups);
        let (dz_re, dz_im) = self.dz.parts_mut(groups);
        let (w_re, w_im) = self.w.parts_mut(groups);
        for g in 0..groups {
            let now = [(z_re[g], z_im[g]), (dz_re[g], dz_im[g]), (w_re[g], w_im[g])];
            [(z_re[g], z_im[g]), (dz_re[g], dz_im[g]), (w_re[g], w_im[g])] =
                moved(&level.whole, g, now);
        }
    }

    pub fn advance(&mut self, basis: &ModalBasis) {
        self.advance_by(basis, basis.level(self.level));
    }

    /// (q, q') at `offset` after the start of the panel.
    pub fn state(&mut self, basis: &ModalBasis, offset: f64, q: &mut [f64], u: &mut [f64]) {
        self.arch.dispatch(StateAt { motion: self, basis, offset, q, u });
        for (stick, &at) in basis.sticking.iter().zip(&self.stuck) {
            q[stick.coordinate] = at + stick.speed * (self.start + offset);
            u[stick.coordinate] = stick.speed;
        }
    }

    /// z and z' at `offset` after the start of the panel, for the first modes by `z + t z' + t^2 phi2 w` and
    /// `z' + t phi1 w`: on the panel `t^2 phi2(lambda t)` of slow modes is their polynomial, `phi1 = 1 + lambda t phi2`.
    #[inline(always)]
    fn modes_at(&mut self, groups: usize, basis: &ModalBasis, offset: f64) {
        let level = basis.level(self.level);
        let s = offset / level.width;
        let slow = if (0.0..=1.0).contains(&s) { level.slow } else { 0 };
        let square = s * s;
        let mut power = [square, square * s, square * square, square * square * s];
        let mut place = [[0.0; GROUP]; TAIL_GROUPS];
        for powers in &mut place {
            *powers = power;
            power = power.map(|power| power * (square * square));
        }
        let (phi2_re, phi2_im) = self.phi2.parts_mut(groups);
        let sums = phi2_re.as_flattened_mut().iter_mut().zip(phi2_im.as_flattened_mut());
        for (powers, (sum_re, sum_im)) in level.powers[..slow].iter().zip(sums) {
            let (mut re, mut im) = ([0.0; GROUP], [0.0; GROUP]);
            for k in 0..TAIL_GROUPS {
                re = add_product(re, &powers.re[k], &place[k]);
                im = add_product(im, &powers.im[k], &place[k]);
            }
            (*sum_re, *sum_im) = (sum_of(re), sum_of(im));
        }
        let (lambda_re, lambda_im) = basis.lambda.parts(groups);
        let (z_re, z_im) = self.z.parts(groups);
        let (dz_re, dz_im) = self.dz.parts(groups);
        let (w_re, w_im) = self.w.parts(groups);
        let (z_at_re, z_at_im) = self.z_at.parts_mut(groups);
        let (dz_at_re, dz_at_im) = self.dz_at.parts_mut(groups);
        let t = [offset; GROUP];
        for g in 0..groups {
            let (w, phi2) = ((&w_re[g], &w_im[g]), (&phi2_re[g], &phi2_im[g]));
            let linear = (add_product(z_re[g], &t, &dz_re[g]), add_product(z_im[g], &t, &dz_im[g]));
            (z_at_re[g], z_at_im[g]) = add_complex(linear, phi2, w);
            let phi1 = add_complex((t, [0.0; GROUP]), (&lambda_re[g], &lambda_im[g]), phi2);
            let dz = (dz_re[g], dz_im[g]);
            (dz_at_re[g], dz_at_im[g]) = add_complex(dz, (&phi1.0, &phi1.1), w);
        }
        for r in slow..basis.count {
            let (z, dz) = self.mode_at(basis, r, offset);
            self.z_at.set(r, z);
            self.dz_at.set(r, dz);
        }
    }

    /// z and z' of one mode at `offset` after the start of the panel, for every lambda.
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
    fn superpose(
        &mut self,
        groups: usize,
        basis: &ModalBasis,
        offset: f64,
        q: &mut [f64],
        u: &mut [f64],
    ) {
        self.modes_at(groups, basis, offset);
        let (shape_re, shape_im) = basis.shape.parts(basis.kept.len() * groups);
        let (z_re, z_im) = self.z_at.parts(groups);
        let (dz_re, dz_im) = self.dz_at.parts(groups);
        for (row, &k) in basis.kept.iter().enumerate() {
            let (mut position, mut velocity) = ([0.0; GROUP], [0.0; GROUP]);
            for g in 0..groups {
                let (re, im) = (&shape_re[row * groups + g], &shape_im[row * groups + g]);
                position = subtract_product(add_product(position, re, &z_re[g]), im, &z_im[g]);
                velocity = subtract_product(add_product(velocity, re, &dz_re[g]), im, &dz_im[g]);
            }
            (q[k], u[k]) = (sum_of(position), sum_of(velocity));
        }
    }

    /// Largest |lambda| of the modes whose transient velocity `w / lambda` at `offset` is not yet rounding of the
    /// velocities of all.
    pub fn growth_rate(&self, basis: &ModalBasis, offset: f64) -> f64 {
        let rows = 0..basis.kept.len();
        let largest = |r: usize| {
            rows.clone().map(|j| basis.shape.get(j * basis.groups * GROUP + r).norm()).fold(0.0, f64::max)
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
                !(transient[r] <= floor) || (basis.lambda.get(r).re > 0.0 && transient[r] > 0.0)
            })
            .map(|r| basis.lambda.get(r).norm())
            .fold(0.0, f64::max)
    }
}

/// (z, z', w) of a group of modes after a step.
#[inline(always)]
fn moved(step: &Step, g: usize, [z, dz, w]: [(Group, Group); 3]) -> [(Group, Group); 3] {
    let h = [step.length; GROUP];
    let linear = (add_product(z.0, &h, &dz.0), add_product(z.1, &h, &dz.1));
    let w = (&w.0, &w.1);
    let zero = ([0.0; GROUP], [0.0; GROUP]);
    [
        add_complex(linear, (&step.phi2.re[g], &step.phi2.im[g]), w),
        add_complex(dz, (&step.phi1.re[g], &step.phi1.im[g]), w),
        add_complex(zero, (&step.exponential.re[g], &step.exponential.im[g]), w),
    ]
}

/// `sum + a b`, complex.
#[inline(always)]
fn add_complex(
    sum: (Group, Group),
    (a_re, a_im): (&Group, &Group),
    (b_re, b_im): (&Group, &Group),
) -> (Group, Group) {
    (
        subtract_product(add_product(sum.0, a_re, b_re), a_im, b_im),
        add_product(add_product(sum.1, a_re, b_im), a_im, b_re),
    )
}

#[inline(always)]
fn sum_of(lanes: Group) -> f64 {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// Calls a method with the number of groups as a constant where it is small, so that its loops are unrolled.
macro_rules! with_groups {
    ($groups:expr, $motion:ident.$method:ident($($argument:expr),*)) => {
        match $groups {
            1 => $motion.$method(1, $($argument),*),
            2 => $motion.$method(2, $($argument),*),
            groups => $motion.$method(groups, $($argument),*),
        }
    };
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
        let Self { motion, basis, q, u } = self;
        with_groups!(basis.groups, motion.project(basis, q, u));
    }
}

struct StateAt<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    offset: f64,
    q: &'a mut [f64],
    u: &'a mut [f64],
}

impl WithSimd for StateAt<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { motion, basis, offset, q, u } = self;
        with_groups!(basis.groups, motion.superpose(basis, offset, q, u));
    }
}

struct Measure<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
}

impl WithSimd for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { motion, basis } = self;
        with_groups!(basis.groups, motion.measure());
    }
}

struct Fill<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
    panel: &'a mut Panel,
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { motion, basis, level, panel } = self;
        with_groups!(basis.groups, motion.fill(basis, level, panel));
    }
}

struct Advance<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { motion, basis, level } = self;
        with_groups!(basis.groups, motion.shift(level));
    }
}
