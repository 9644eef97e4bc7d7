//! The state of a modal phase at a time within its panel.

use num_complex::Complex64;
use pulp::bytemuck::cast_slice;
use pulp::cast;

use crate::motion::modal::basis::{ModalBasis, SUPERPOSED};
use crate::motion::modal::motion::{ModalMotion, Modes};
use crate::numerics::phi::exponential_and_phi;
use crate::numerics::simd::{ComplexGroup, GROUP, Group, Kernel, Lanes, ZEROS, add_real_part};

/// Largest square of the ratio of static to moving part at which a mode is computed from its rate, which loses three bits.
const STATIC: f64 = 64.0;

impl ModalMotion {
    /// (q, q') at `offset` after the start of the panel.
    pub fn state(&mut self, basis: &ModalBasis, offset: f64, q: &mut [f64], u: &mut [f64]) {
        self.unit.run(StateAt { motion: self, basis, offset, q, u });
        for (&(k, speed), &at) in basis.sticking.iter().zip(&self.stuck) {
            q[k] = at + speed * (self.start.high + offset);
            u[k] = speed;
        }
    }

    /// z and z' at `offset` after the start of the panel, for the first modes by `z + t z' + t^2 phi2 w` and
    /// `z' + t phi1 w`: on the panel `t^2 phi2(lambda t)` of slow modes is their polynomial, `phi1 = 1 + lambda t phi2`.
    #[inline(always)]
    fn modes_at<S: Lanes>(&mut self, simd: S, basis: &ModalBasis, offset: f64) {
        let level = basis.level(self.level);
        let s = offset / level.width;
        let within = (0.0..=1.0).contains(&s);
        let (slow, series) = if within { (level.slow, &level.phi2[..]) } else { (0, &[][..]) };
        let t = simd.splat_f64s(offset);
        let moved = self.modes.iter().zip(&basis.lambda.0).zip(&mut self.at);
        for (series, ((&Modes { z, dz, w }, &lambda), at)) in series.iter().zip(moved) {
            let phi2 = series.at(simd, s);
            let phi1 = ComplexGroup { re: t, im: ZEROS }.add_product(simd, lambda, phi2);
            *at = [
                z.add_scaled(simd, t, dz).add_product(simd, phi2, w),
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
        let force = self.force(basis, r / GROUP).get(r % GROUP);
        let linear = basis.references[self.reference].linear[r / GROUP].get(r % GROUP);
        // Inverting z' = lambda z + p costs one exponential, and loses no digit unless p / lambda,
        // the static part, is larger than what moves, or lambda is zero.
        if force.norm_sqr() < STATIC * (lambda * z).norm_sqr()
            && linear.norm_sqr() <= STATIC * (lambda * dz).norm_sqr()
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
        simd: S,
        basis: &ModalBasis,
        offset: f64,
        q: &mut [f64],
        u: &mut [f64],
    ) {
        self.modes_at(simd, basis, offset);
        let time = self.start.high + offset;
        for first in (0..basis.positions).step_by(SUPERPOSED) {
            match basis.positions - first {
                1 => self.superpose_groups::<S, 1>(first, simd, basis, time, q, u),
                2 => self.superpose_groups::<S, 2>(first, simd, basis, time, q, u),
                3 => self.superpose_groups::<S, 3>(first, simd, basis, time, q, u),
                _ => {
                    self.superpose_groups::<S, SUPERPOSED>(first, simd, basis, time, q, u);
                }
            }
        }
    }

    #[inline(always)]
    fn superpose_groups<S: Lanes, const N: usize>(
        &self,
        first: usize,
        simd: S,
        basis: &ModalBasis,
        time: f64,
        q: &mut [f64],
        u: &mut [f64],
    ) {
        let mut sums = [[ZEROS; 2]; N];
        let (shapes, _) = basis.shape[first * basis.count..].as_chunks::<N>();
        for (at, shapes) in self.at.iter().zip(shapes[..basis.count].chunks(GROUP)) {
            let [z, dz] = at.map(|at| -> [[f64; GROUP]; 2] { [cast(at.re), cast(at.im)] });
            for (lane, shapes) in shapes.iter().enumerate() {
                let [z, dz] = [z, dz].map(|[re, im]| ComplexGroup {
                    re: simd.splat_f64s(re[lane]),
                    im: simd.splat_f64s(im[lane]),
                });
                for ([position, velocity], &shape) in sums.iter_mut().zip(shapes) {
                    *position = add_real_part(simd, *position, shape, z);
                    *velocity = add_real_part(simd, *velocity, shape, dz);
                }
            }
        }
        let time = simd.splat_f64s(time);
        let about = self.about(basis).iter().zip(&basis.references[self.reference].velocity);
        let kept = basis.kept.chunks(GROUP).zip(about).skip(first);
        for ((kept, (&about, &speed)), [position, velocity]) in kept.zip(sums) {
            let moved = simd.add_f64s(simd.mul_f64s(speed, time), position);
            let position: [f64; GROUP] = cast(simd.add_f64s(about, moved));
            let velocity: [f64; GROUP] = cast(simd.add_f64s(speed, velocity));
            for ((&k, position), velocity) in kept.iter().zip(position).zip(velocity) {
                (q[k], u[k]) = (position, velocity);
            }
        }
    }

    /// Largest |lambda| of the modes whose transient velocity `w / lambda` at `offset` is not yet rounding of the
    /// velocities of all.
    pub fn growth_rate(&self, basis: &ModalBasis, offset: f64) -> f64 {
        let largest =
            |r: usize| (0..basis.structure).map(|k| basis.shape(k, r).norm()).fold(0.0, f64::max);
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
        let speeds = cast_slice::<Group, f64>(&basis.references[self.reference].velocity);
        let steady =
            speeds[..basis.structure].iter().map(|speed| speed.abs()).chain(steady).sum::<f64>();
        let floor = f64::EPSILON * transient.iter().fold(steady, |size, v| size.max(*v));
        // A mode that grows may rise from below rounding.
        (0..basis.count)
            .filter(|&r| {
                !(transient[r] <= floor) || (basis.lambda.get(r).re > 0.0 && transient[r] > 0.0)
            })
            .map(|r| basis.lambda.get(r).norm())
            .fold(0.0, f64::max)
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
        motion.superpose(simd, basis, offset, q, u);
    }
}
