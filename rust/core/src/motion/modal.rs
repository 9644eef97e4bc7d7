//! Modal propagation: every mode of the combination moves on its own.
//!
//! The modes move about a reference, where it can be the equilibrium of the phase: rounding of the projection, which
//! grows with the square of the condition of the modes, is then a part of the motion and not of the static
//! displacement. `z' = lambda z + p0 + p1 t` for each mode, p0 and p1 what the reference leaves unbalanced. With `w = z''`, which is a pure exponential,
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
use pulp::cast;

use crate::motion::modal_basis::{LEVELS, Level, LevelModes, ModalBasis, Step, TAIL_GROUPS};
use crate::motion::panel::Panel;
use crate::numerics::first_root::DEGREE;
use crate::numerics::phi::exponential_and_phi;
use crate::numerics::simd::{
    ComplexGroup, GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, add_real_part, group,
};

/// Quiet panels before a leap is tried, and the first leap in powers of two panels.
const QUIET: u32 = 2;
const FIRST_LEAP: usize = 3;

/// The reference is at most so many times as far from the origin as the state.
const FARTHEST: f64 = 16.0;

/// Panels between two questions whether the fast modes have decayed.
const PANELS_PER_LEVEL: u32 = 4;

/// A group of modes at one time.
#[derive(Debug, Clone, Copy)]
struct Modes {
    z: ComplexGroup,
    dz: ComplexGroup,
    /// z''
    w: ComplexGroup,
}

/// Bounds, of a group of modes per unit weight, on a panel.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    /// Of the affine part, and of what the mode adds to it.
    affine: Group,
    curvature: Group,
    /// Of what the mode adds to its quadratic part about the middle, rounding included.
    rest: Group,
    /// Of what a mode that has no polynomial adds to its affine part.
    fast: Group,
}

/// One phase in modal coordinates; its buffers serve every phase of a run.
#[derive(Debug, Default)]
pub(crate) struct ModalMotion {
    unit: VectorUnit,
    start: f64,
    panels: u32,
    level: usize,
    quiet: u32,
    leap: usize,
    /// At the start of the panel.
    modes: Vec<Modes>,
    middle: Vec<Modes>,
    bounds: Vec<Bounds>,
    /// Weight times w of one event function.
    gains: Vec<ComplexGroup>,
    /// t^2 phi2, and z and z' at a time within the panel.
    phi2: Vec<ComplexGroup>,
    at: Vec<[ComplexGroup; 2]>,
    /// Of the basis: the one about which the modes move.
    reference: usize,
    /// (q, q') of the kept coordinates along the reference at local time 0.
    about: Vec<[f64; 2]>,
    /// Constant part of each event function at local time 0.
    constants: Vec<f64>,
    /// (q, q') of the kept coordinates at local time 0, from the reference.
    gathered: Vec<[f64; 2]>,
    /// q at local time 0 of the coordinates that stick, in the order of the basis.
    stuck: Vec<f64>,
}

impl ModalMotion {
    /// Starts a phase at local time 0 from (q, q').
    pub fn restart(&mut self, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        self.start = 0.0;
        self.panels = 0;
        self.level = 0;
        self.quiet = 0;
        self.leap = FIRST_LEAP;
        self.stuck.clear();
        self.stuck.extend(basis.sticking.iter().map(|&(k, _)| q[k]));
        self.refer(basis, q, u);
        let stuck = &self.stuck;
        self.constants.clear();
        self.constants.extend(basis.references[self.reference].functions.iter().map(|function| {
            let stuck = function.sticking.iter().zip(stuck).map(|(weight, at)| weight * at);
            function.constant + stuck.sum::<f64>()
        }));
        if self.modes.len() < basis.groups {
            self.grow(basis.groups);
        }
        self.unit.run(Project { motion: self, basis, q, u });
    }

    /// Chooses the equilibrium as the reference, unless it is so far away that the difference would cost digits.
    fn refer(&mut self, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        for (index, reference) in basis.references.iter().enumerate().rev() {
            self.about.clear();
            self.about.extend_from_slice(&reference.at);
            for (sticking, &at) in reference.sticking.iter().zip(&self.stuck) {
                for (about, of) in self.about.iter_mut().zip(sticking) {
                    about[0] += of * at;
                }
            }
            let largest = |x: &[f64]| x.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
            let part = |k: usize| self.about.iter().fold(0.0, |size: f64, x| size.max(x[k].abs()));
            if part(0) <= FARTHEST * largest(q) && part(1) <= FARTHEST * largest(u) {
                self.reference = index;
                return;
            }
        }
        self.reference = 0;
    }

    #[cold]
    fn grow(&mut self, groups: usize) {
        let zero = ComplexGroup::ZERO;
        let modes = Modes { z: zero, dz: zero, w: zero };
        self.modes.resize(groups, modes);
        self.middle.resize(groups, modes);
        let bounds = Bounds { affine: ZEROS, curvature: ZEROS, rest: ZEROS, fast: ZEROS };
        self.bounds.resize(groups, bounds);
        self.gains.resize(groups, zero);
        self.phi2.resize(groups, zero);
        self.at.resize(groups, [zero; 2]);
    }

    #[inline(always)]
    fn project<S: Lanes>(
        &mut self,
        groups: usize,
        simd: S,
        basis: &ModalBasis,
        q: &[f64],
        u: &[f64],
    ) {
        let gathered = &mut self.gathered;
        gathered.clear();
        let kept = basis.kept.iter().zip(&self.about);
        gathered.extend(kept.map(|(&k, about)| [q[k] - about[0], u[k] - about[1]]));
        let force = &basis.references[self.reference].force[..groups];
        for (g, modes) in self.modes[..groups].iter_mut().enumerate() {
            let mut z = ComplexGroup::ZERO;
            let rows = basis.projection[g..].iter().step_by(groups);
            for (&[q, u], row) in gathered.iter().zip(rows) {
                z = z.add_scaled(simd, simd.splat_f64s(q), row.position);
                z = z.add_scaled(simd, simd.splat_f64s(u), row.velocity);
            }
            let (force, lambda) = (&force[g], basis.lambda.0[g]);
            let mut constant = force.constant;
            for (&stick, &at) in force.sticking.iter().zip(&self.stuck) {
                constant = constant.add_scaled(simd, simd.splat_f64s(at), stick);
            }
            let dz = constant.add_product(simd, lambda, z);
            *modes = Modes { z, dz, w: force.linear.add_product(simd, lambda, dz) };
        }
    }

    pub fn start(&self) -> f64 {
        self.start
    }

    /// Whether every mode too fast for the polynomials of `level` has decayed below rounding.
    fn allows(&self, basis: &ModalBasis, level: &Level) -> bool {
        basis.functions.iter().zip(&self.constants).all(|(weights, constant)| {
            let (mut bound, mut scale) = (0.0, constant.abs());
            for (g, weight) in weights.iter().enumerate() {
                let magnitudes: [f64; GROUP] = cast(weight.magnitude);
                let reach: [f64; GROUP] = cast(level.modes[g].reach);
                for lane in 0..GROUP {
                    let r = g * GROUP + lane;
                    scale += magnitudes[lane] * self.modes[g].z.get(lane).l1_norm();
                    if (level.slow..basis.count).contains(&r) {
                        bound +=
                            magnitudes[lane] * self.modes[g].w.get(lane).l1_norm() * reach[lane];
                    }
                }
            }
            bound <= f64::EPSILON * scale
        })
    }

    /// Moves over stretches that the envelope proves free of events, up to `remaining`.
    fn leap(&mut self, basis: &ModalBasis, remaining: f64) -> u32 {
        let mut leaps = 0;
        while self.quiet >= QUIET {
            let index = (self.level + self.leap).min(LEVELS - 1);
            let level = basis.level(index);
            let within = self.start + level.width <= remaining;
            if !(within && self.unit.run(IsQuiet { motion: self, basis, level })) {
                if self.leap <= 1 {
                    self.quiet = 0;
                    self.leap = FIRST_LEAP;
                    break;
                }
                self.leap -= 1;
                continue;
            }
            self.advance_by(basis, level);
            self.leap += 1;
            leaps += 1;
        }
        leaps
    }

    /// Whether all event functions stay positive over `level.width`: with `f = A + B t + sum Re(h w / lambda^2
    /// e^{lambda t})` over the modes that turn within it, and the bound of the series for those that don't.
    #[inline(always)]
    fn is_quiet<S: Lanes>(
        &mut self,
        groups: usize,
        simd: S,
        basis: &ModalBasis,
        level: &Level,
    ) -> bool {
        let width = simd.splat_f64s(level.width);
        let (modes, at) = (&self.modes[..groups], &level.modes[..groups]);
        let (affine, bounds) = (&mut self.middle[..groups], &mut self.bounds[..groups]);
        for g in 0..groups {
            let Modes { z, dz, w } = modes[g];
            let turning = at[g].turning;
            let still =
                ComplexGroup { re: simd.neg_f64s(turning.re), im: simd.neg_f64s(turning.im) };
            // -w / lambda and -w / lambda^2
            let first = ComplexGroup::ZERO.add_product(simd, still, w);
            affine[g].z = z.add_product(simd, first, turning);
            affine[g].dz = ComplexGroup {
                re: simd.add_f64s(dz.re, first.re),
                im: simd.add_f64s(dz.im, first.im),
            };
            bounds[g].affine = simd.mul_add_f64s(dz.size(simd), width, z.size(simd));
            bounds[g].curvature = simd.mul_f64s(w.size(simd), at[g].envelope);
        }
        let affine_parts = &basis.references[self.reference].functions;
        let functions = basis.functions.iter().zip(affine_parts).zip(&self.constants);
        for ((weights, function), constant) in functions {
            let weights = &weights[..groups];
            let (mut value, mut slope, mut scale, mut reach) = (ZEROS, ZEROS, ZEROS, ZEROS);
            for g in 0..groups {
                let weight = weights[g];
                value = add_real_part(simd, value, weight.of, affine[g].z);
                slope = add_real_part(simd, slope, weight.of, affine[g].dz);
                scale = simd.mul_add_f64s(weight.magnitude, bounds[g].affine, scale);
                reach = simd.mul_add_f64s(weight.magnitude, bounds[g].curvature, reach);
            }
            let offset = constant + function.slope * self.start;
            let change = (simd.reduce_sum_f64s(slope) + function.slope) * level.width;
            let reach = simd.reduce_sum_f64s(reach);
            let lowest = offset + simd.reduce_sum_f64s(value) + change.min(0.0) - reach;
            if !(lowest > 1e-12 * (offset.abs() + simd.reduce_sum_f64s(scale) + reach)) {
                return false;
            }
        }
        true
    }

    pub fn expand(&mut self, basis: &ModalBasis, remaining: f64, panel: &mut Panel) {
        panel.leaps += self.leap(basis, remaining) as usize;
        // A panel beyond the end of the phase would only spread its rounding over a longer line.
        let asked = basis.count == 0 || self.panels % PANELS_PER_LEVEL == PANELS_PER_LEVEL - 1;
        while asked
            && self.level + 1 < LEVELS
            && self.start + basis.level(self.level).width < remaining
            && self.allows(basis, basis.level(self.level + 1))
        {
            self.level += 1;
        }
        let level = basis.level(self.level);
        panel.reset(level.width, basis.functions.len());
        self.unit.run(Fill { motion: self, basis, level, panel });
        let all_quiet = panel.excluded.iter().all(|&excluded| excluded);
        self.quiet = if all_quiet { self.quiet + 1 } else { 0 };
    }

    #[inline(always)]
    fn fill<S: Lanes>(
        &mut self,
        groups: usize,
        simd: S,
        basis: &ModalBasis,
        level: &Level,
        panel: &mut Panel,
    ) {
        let width = level.width;
        // Dot products of `count` complex terms, a table built by DEGREE multiplications, Horner's rule,
        // and the recurrence over the panels before this one, each a few roundings of relative size u.
        let unit = 0.5 * f64::EPSILON;
        let rounding = unit * (2 * basis.count + 3 * DEGREE + 10 + 8 * self.panels as usize) as f64;
        let (modes, at) = (&self.modes[..groups], &level.modes[..groups]);
        let (middle, bounds) = (&mut self.middle[..groups], &mut self.bounds[..groups]);
        let gains = &mut self.gains[..groups];
        let half = 0.5 * width;
        for g in 0..groups {
            let LevelModes { reach, fast_reach, middle_reach, .. } = at[g];
            let (of_z, of_dz) = (modes[g].z.size(simd), modes[g].dz.size(simd));
            let of_w = modes[g].w.size(simd);
            let affine = simd.mul_add_f64s(of_dz, simd.splat_f64s(width), of_z);
            let curvature = simd.mul_f64s(of_w, reach);
            let rounded =
                simd.mul_f64s(simd.add_f64s(affine, curvature), simd.splat_f64s(rounding));
            bounds[g] = Bounds {
                affine,
                curvature,
                rest: simd.mul_add_f64s(of_w, middle_reach, rounded),
                fast: simd.mul_f64s(of_w, fast_reach),
            };
            middle[g] = modes[g].after(simd, &at[g].half, half);
        }
        let affine_parts = &basis.references[self.reference].functions;
        for (index, (weights, function)) in basis.functions.iter().zip(affine_parts).enumerate() {
            let weights = &weights[..groups];
            let (constant, slope) = (self.constants[index], function.slope);
            let offset = constant + slope * self.start;
            let of_offset = offset.abs().max(constant.abs()) + width * slope.abs();
            // Sums over the modes, in the lanes of a group.
            let (mut value, mut first, mut second, mut rest) = (ZEROS, ZEROS, ZEROS, ZEROS);
            for g in 0..groups {
                let weight = weights[g];
                value = add_real_part(simd, value, weight.of, middle[g].z);
                first = add_real_part(simd, first, weight.of, middle[g].dz);
                second = add_real_part(simd, second, weight.of, middle[g].w);
                rest = simd.mul_add_f64s(weight.magnitude, bounds[g].rest, rest);
            }
            let c0 = offset + half * slope + simd.reduce_sum_f64s(value);
            let c1 = (half * (slope + simd.reduce_sum_f64s(first))).abs();
            let c2 = 0.5 * simd.reduce_sum_f64s(second) * half * half;
            let lowest = if c1 < 2.0 * c2 { c0 - 0.25 * c1 * c1 / c2 } else { c0 - c1 + c2 };
            let excluded = lowest - simd.reduce_sum_f64s(rest) > rounding * of_offset;
            panel.excluded[index] = excluded;
            if excluded {
                continue;
            }
            let (mut value, mut first) = (ZEROS, ZEROS);
            let (mut affine, mut curvature, mut fast) = (ZEROS, ZEROS, ZEROS);
            for g in 0..groups {
                let weight = weights[g];
                value = add_real_part(simd, value, weight.of, modes[g].z);
                first = add_real_part(simd, first, weight.of, modes[g].dz);
                affine = simd.mul_add_f64s(weight.magnitude, bounds[g].affine, affine);
                curvature = simd.mul_add_f64s(weight.magnitude, bounds[g].curvature, curvature);
                fast = simd.mul_add_f64s(weight.magnitude, bounds[g].fast, fast);
                gains[g] = ComplexGroup::ZERO.add_product(simd, weight.of, modes[g].w);
            }
            let (affine, curvature) =
                (simd.reduce_sum_f64s(affine), simd.reduce_sum_f64s(curvature));
            let remainder = curvature * level.truncation + simd.reduce_sum_f64s(fast);
            panel.curvature_error[index] = rounding * curvature + remainder;
            panel.error[index] = rounding * (of_offset + affine + curvature) + remainder;
            let mut tail = [ZEROS; TAIL_GROUPS];
            for (gains, powers) in gains.iter().zip(level.powers.chunks(GROUP)) {
                let (re, im): ([f64; GROUP], [f64; GROUP]) = (cast(gains.re), cast(gains.im));
                for (lane, powers) in powers.iter().enumerate() {
                    let gain = ComplexGroup {
                        re: simd.splat_f64s(re[lane]),
                        im: simd.splat_f64s(im[lane]),
                    };
                    for (sum, &powers) in tail.iter_mut().zip(&powers.0) {
                        *sum = add_real_part(simd, *sum, gain, powers);
                    }
                }
            }
            let c = panel.row(index);
            c[0] = offset + simd.reduce_sum_f64s(value);
            c[1] = (slope + simd.reduce_sum_f64s(first)) * width;
            let (targets, _) = c[2..].as_chunks_mut::<GROUP>();
            for (target, sums) in targets.iter_mut().zip(tail) {
                *target = cast(sums);
            }
        }
    }

    fn advance_by(&mut self, basis: &ModalBasis, level: &Level) {
        self.unit.run(Advance { motion: self, basis, level });
        self.start += level.width;
        self.panels += 1;
    }

    #[inline(always)]
    fn shift<S: Lanes>(&mut self, groups: usize, simd: S, level: &Level) {
        for (modes, at) in self.modes[..groups].iter_mut().zip(&level.modes[..groups]) {
            *modes = modes.after(simd, &at.whole, level.width);
        }
    }

    pub fn advance(&mut self, basis: &ModalBasis) {
        self.advance_by(basis, basis.level(self.level));
    }

    /// (q, q') at `offset` after the start of the panel.
    pub fn state(&mut self, basis: &ModalBasis, offset: f64, q: &mut [f64], u: &mut [f64]) {
        self.unit.run(StateAt { motion: self, basis, offset, q, u });
        for (&(k, speed), &at) in basis.sticking.iter().zip(&self.stuck) {
            q[k] = at + speed * (self.start + offset);
            u[k] = speed;
        }
    }

    /// z and z' at `offset` after the start of the panel, for the first modes by `z + t z' + t^2 phi2 w` and
    /// `z' + t phi1 w`: on the panel `t^2 phi2(lambda t)` of slow modes is their polynomial, `phi1 = 1 + lambda t phi2`.
    #[inline(always)]
    fn modes_at<S: Lanes>(&mut self, groups: usize, simd: S, basis: &ModalBasis, offset: f64) {
        let level = basis.level(self.level);
        let s = offset / level.width;
        let slow = if (0.0..=1.0).contains(&s) { level.slow } else { 0 };
        let square = s * s;
        let fourth = simd.splat_f64s(square * square);
        let mut power = group([square, square * s, square * square, square * square * s]);
        let mut place = [ZEROS; TAIL_GROUPS];
        for powers in &mut place {
            *powers = power;
            power = simd.mul_f64s(power, fourth);
        }
        let phi2 = &mut self.phi2[..groups];
        for (phi2, powers) in phi2.iter_mut().zip(level.powers[..slow].chunks(GROUP)) {
            for (lane, powers) in powers.iter().enumerate() {
                let mut sum = ComplexGroup::ZERO;
                for (&place, &powers) in place.iter().zip(&powers.0) {
                    sum = sum.add_scaled(simd, place, powers);
                }
                let (re, im) = (simd.reduce_sum_f64s(sum.re), simd.reduce_sum_f64s(sum.im));
                phi2.set(lane, Complex64::new(re, im));
            }
        }
        let t = simd.splat_f64s(offset);
        let (modes, lambda, at) =
            (&self.modes[..groups], &basis.lambda.0[..groups], &mut self.at[..groups]);
        for g in 0..groups {
            let Modes { z, dz, w } = modes[g];
            let phi1 = ComplexGroup { re: t, im: ZEROS }.add_product(simd, lambda[g], phi2[g]);
            at[g] = [
                z.add_scaled(simd, t, dz).add_product(simd, phi2[g], w),
                dz.add_product(simd, phi1, w),
            ];
        }
        for r in slow..basis.count {
            let (z, dz) = self.mode_at(basis, r, offset);
            self.at[r / GROUP][0].set(r % GROUP, z);
            self.at[r / GROUP][1].set(r % GROUP, dz);
        }
    }

    /// z and z' of one mode at `offset` after the start of the panel, for every lambda.
    fn mode_at(&self, basis: &ModalBasis, r: usize, offset: f64) -> (Complex64, Complex64) {
        let lambda = basis.lambda.get(r);
        let Modes { z, dz, w } = self.modes[r / GROUP];
        let [z, dz, w] = [z, dz, w].map(|group| group.get(r % GROUP));
        let linear = basis.references[self.reference].force[r / GROUP].linear.get(r % GROUP);
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
    fn superpose<S: Lanes>(
        &mut self,
        groups: usize,
        simd: S,
        basis: &ModalBasis,
        offset: f64,
        q: &mut [f64],
        u: &mut [f64],
    ) {
        self.modes_at(groups, simd, basis, offset);
        let at = &self.at[..groups];
        let time = self.start + offset;
        let kept = basis.kept.chunks(GROUP).zip(self.about.chunks(GROUP));
        for ((kept, about), shape) in kept.zip(basis.shape.chunks(basis.count.max(1))) {
            let (mut position, mut velocity) = (ZEROS, ZEROS);
            for (at, shape) in at.iter().zip(shape.chunks(GROUP)) {
                let [z, dz] =
                    at.each_ref().map(|at| -> [[f64; GROUP]; 2] { [cast(at.re), cast(at.im)] });
                for (lane, &shape) in shape.iter().enumerate() {
                    let [z, dz] = [z, dz].map(|[re, im]| ComplexGroup {
                        re: simd.splat_f64s(re[lane]),
                        im: simd.splat_f64s(im[lane]),
                    });
                    position = add_real_part(simd, position, shape, z);
                    velocity = add_real_part(simd, velocity, shape, dz);
                }
            }
            let [position, velocity]: [[f64; GROUP]; 2] = [cast(position), cast(velocity)];
            for (lane, (&k, about)) in kept.iter().zip(about).enumerate() {
                q[k] = about[0] + (about[1] * time + position[lane]);
                u[k] = about[1] + velocity[lane];
            }
        }
    }

    /// Largest |lambda| of the modes whose transient velocity `w / lambda` at `offset` is not yet rounding of the
    /// velocities of all.
    pub fn growth_rate(&self, basis: &ModalBasis, offset: f64) -> f64 {
        let shape = |k: usize, r: usize| basis.shape[k / GROUP * basis.count + r].get(k % GROUP);
        let largest =
            |r: usize| (0..basis.kept.len()).map(|k| shape(k, r).norm()).fold(0.0, f64::max);
        let of = |r: usize, part: fn(&Modes) -> ComplexGroup| {
            part(&self.modes[r / GROUP]).get(r % GROUP).norm()
        };
        let transient: Vec<f64> = (0..basis.count)
            .map(|r| {
                let lambda = basis.lambda.get(r);
                let decay = (lambda.re * offset).exp();
                largest(r) * of(r, |modes| modes.w) * decay / lambda.norm().max(f64::MIN_POSITIVE)
            })
            .collect();
        let steady = (0..basis.count).map(|r| largest(r) * of(r, |modes| modes.dz));
        let steady = self.about.iter().map(|about| about[1].abs()).chain(steady).sum::<f64>();
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

impl Modes {
    /// A step of `h` later.
    #[inline(always)]
    fn after<S: Lanes>(&self, simd: S, step: &Step, h: f64) -> Self {
        let Self { z, dz, w } = *self;
        Self {
            z: z.add_scaled(simd, simd.splat_f64s(h), dz).add_product(simd, step.phi2, w),
            dz: dz.add_product(simd, step.phi1, w),
            w: ComplexGroup::ZERO.add_product(simd, step.exponential, w),
        }
    }
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

struct Project<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    q: &'a [f64],
    u: &'a [f64],
}

impl Kernel for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, basis, q, u } = self;
        with_groups!(basis.groups, motion.project(simd, basis, q, u));
    }
}

struct StateAt<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    offset: f64,
    q: &'a mut [f64],
    u: &'a mut [f64],
}

impl Kernel for StateAt<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, basis, offset, q, u } = self;
        with_groups!(basis.groups, motion.superpose(simd, basis, offset, q, u));
    }
}

struct IsQuiet<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
}

impl Kernel for IsQuiet<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> bool {
        let Self { motion, basis, level } = self;
        with_groups!(basis.groups, motion.is_quiet(simd, basis, level))
    }
}

struct Fill<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
    panel: &'a mut Panel,
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, basis, level, panel } = self;
        with_groups!(basis.groups, motion.fill(simd, basis, level, panel));
    }
}

struct Advance<'a> {
    motion: &'a mut ModalMotion,
    basis: &'a ModalBasis,
    level: &'a Level,
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, basis, level } = self;
        with_groups!(basis.groups, motion.shift(simd, level));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::contact::event_function::EventFunction;
    use crate::linalg::sparse::SparseMatrix;
    use crate::modes::complex_modes;
    use crate::motion::combination_basis::{CombinationBasis, Propagator};
    use crate::motion::method::Wanted;
    use crate::motion::taylor::TaylorMotion;
    use crate::scene::contact_law::{ContactInput, Direction};
    use crate::scene::model::{Damping, Mass, Scene, SceneInput};
    use crate::scene::status::Combination;
    use nalgebra::DMatrix;

    /// A chain of masses between two walls, the first two of them in contact; one to three groups of modes.
    fn chain(size: usize, damping: f64) -> Arc<Scene> {
        let entry = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 2.0 + 0.1 * i as f64,
            1 => -1.0,
            _ => 0.0,
        };
        let contact = ContactInput {
            tangential: Direction::Dof(0),
            normal: Direction::Dof(1),
            friction: 0.3,
            static_friction: 0.4,
            slider_speed: 0.2,
            restitution: 0.0,
            gap: 0.0,
        };
        let scene = Scene::new(SceneInput {
            mass: Mass::Lumped(vec![1.0; size]),
            stiffness: SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry)),
            damping: Damping::Proportional { mass: 0.0, stiffness: damping },
            gyroscopic: None,
            circulatory: None,
            force: (0..size).map(|k| if k == 1 { -1.0 } else { 0.1 }).collect(),
            contacts: vec![contact],
            impact_friction: false,
        });
        Arc::new(scene.expect("well-posed"))
    }

    /// Coefficients and bounds of some panels, and a state within each, to the last bit.
    fn panels(
        unit: VectorUnit,
        basis: &ModalBasis,
        functions: &[EventFunction],
        (q, u): (&[f64], &[f64]),
    ) -> Vec<(Panel, Vec<f64>, Vec<f64>)> {
        let mut motion = ModalMotion { unit, ..ModalMotion::default() };
        motion.restart(basis, q, u);
        let mut found = Vec::new();
        for _ in 0..12 {
            let mut panel = Panel::default();
            panel.reset(0.0, functions.len());
            motion.expand(basis, 1000.0, &mut panel);
            let (mut q, mut u) = (q.to_vec(), u.to_vec());
            motion.state(basis, 0.37 * panel.width, &mut q, &mut u);
            found.push((panel, q, u));
            motion.advance(basis);
        }
        found
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Every vector unit gives the same bits; each polynomial is its event function of the state within its bound;
        /// and the state is that of the Taylor series.
        #[test]
        fn panels_are_those_of_scalars_and_of_series(
            size in 3usize..12,
            damping in 0.001..0.2f64,
            numbers in proptest::collection::vec(-1.0..1.0f64, 24),
            letter in prop_oneof![Just("+"), Just("-"), Just("s"), Just("d")],
        ) {
            let scene = chain(size, damping);
            let combination = Combination::parse(letter, 1).expect("a status");
            // Modes of condition c lose c^2 roundings of the motion; beyond 300 they are not used.
            let modes = complex_modes::Modes::new(&scene, &combination).expect("modes");
            let condition = modes.condition.iter().copied().fold(1.0, f64::max);
            let accuracy = 64.0 * f64::EPSILON * condition * condition;
            prop_assume!(condition < 300.0);
            let basis = CombinationBasis::new(&scene, &combination, Wanted::Modes).expect("modes");
            let Propagator::Modal(modal) = &basis.propagator else { panic!("no modes") };
            let series = CombinationBasis::new(&scene, &combination, Wanted::Series).expect("series");
            let Propagator::Taylor(operator) = &series.propagator else { panic!("no series") };
            let (mut q, mut u) = (numbers[..size].to_vec(), numbers[12..12 + size].to_vec());
            if letter != "d" {
                (q[1], u[1]) = (0.0, 0.0);
            }
            if letter == "s" {
                u[0] = 0.2;
            }
            let found = panels(VectorUnit::default(), modal, &basis.functions, (&q, &u));
            let portable = panels(VectorUnit::Portable, modal, &basis.functions, (&q, &u));
            let mut taylor = TaylorMotion::default();
            taylor.restart(&scene, operator, &series.functions, &q, &u);
            for ((panel, at_q, at_u), (other, other_q, other_u)) in found.iter().zip(&portable) {
                prop_assert_eq!(panel.width, other.width);
                prop_assert_eq!(&panel.excluded, &other.excluded);
                prop_assert_eq!(&panel.error, &other.error);
                prop_assert_eq!((at_q, at_u), (other_q, other_u));
                for (index, function) in basis.functions.iter().enumerate() {
                    if panel.excluded[index] {
                        continue;
                    }
                    let coefficients = panel.polynomial(index, 0);
                    prop_assert_eq!(coefficients, other.polynomial(index, 0));
                    let by_panel = coefficients.iter().rev().fold(0.0, |sum, c| sum * 0.37 + c);
                    let by_state = function.functional.value(at_q, at_u);
                    // The bound is that of the polynomial; the state has roundings of its own.
                    let bound = panel.error[index] + accuracy;
                    let error = (by_panel - by_state).abs();
                    prop_assert!(error <= bound, "{error} of {bound}, {by_state}");
                }
            }
            // The first panel begins at 0 unless stretches were passed over before it.
            let (first, at_q, at_u) = &found[0];
            let reached = 0.37 * first.width;
            prop_assert!(first.leaps == 0);
            while taylor.end() < reached {
                taylor.advance(&scene, operator);
            }
            let (mut series_q, mut series_u) = (q.clone(), u.clone());
            taylor.state(operator, reached - taylor.start(), &mut series_q, &mut series_u);
            for k in 0..size {
                prop_assert!((at_q[k] - series_q[k]).abs() <= accuracy, "{k}: {at_q:?}, {series_q:?}");
                prop_assert!((at_u[k] - series_u[k]).abs() <= accuracy, "{k}: {at_u:?}, {series_u:?}");
            }
        }
    }
}
