//! Modal propagation: every mode of the combination moves on its own.
//!
//! The modes move about a reference, where it can be the equilibrium of the phase: rounding of the projection, which
//! grows with the square of the condition of the modes, is then a part of the motion and not of the static
//! displacement. Each mode follows `z' = lambda z + p`, where `p = p0 + p1 t` is the force that the reference leaves
//! unbalanced. With `w = z''`, which is a pure exponential,
//!
//! ```text
//! z(t + h) = z + h z' + h^2 phi2(lambda h) w,   z'(t + h) = z' + h phi1(lambda h) w,   w(t + h) = e^{lambda h} w
//! ```
//!
//! holds for every lambda, zero included, without cancellation. From panel to panel
//!
//! ```text
//! z(t + h) = e^{lambda h} z + h phi1(lambda h) p + h^2 phi2(lambda h) p1,   z'(t + h) = e^{lambda h} z' + h phi1(lambda h) p1
//! ```
//!
//! is used instead: a rounding error then moves and decays as the mode does, while a rounding error of z' in the first form
//! would be integrated for the rest of the phase.

use pulp::bytemuck::cast_slice;

use crate::motion::modal::basis::{ModalBasis, PROJECTED};
use crate::motion::modal::level::{Level, Step};
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{ComplexGroup, GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, group};

/// The first leap, in powers of two panels.
pub(super) const FIRST_LEAP: usize = 3;

/// The reference is at most so many times as far from the origin as the state.
const FARTHEST: f64 = 16.0;

/// A group of modes at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Modes {
    pub(super) z: ComplexGroup,
    pub(super) dz: ComplexGroup,
    /// z''
    pub(super) w: ComplexGroup,
}

/// Bounds, of a group of modes per unit weight, on a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Bounds of the affine part, and of the terms that the mode adds to it.
    pub(super) affine: Group,
    pub(super) curvature: Group,
    /// Bound of the terms that the mode adds to its quadratic part about the middle, and the rounding of all of them.
    pub(super) beyond: Group,
    pub(super) rounded: Group,
    /// Bound of the terms that a mode without polynomial adds to its affine part.
    pub(super) fast: Group,
}

/// One phase in modal coordinates; its buffers serve every phase of a run.
#[derive(Debug, Default)]
pub(crate) struct ModalMotion {
    pub(super) unit: VectorUnit,
    /// Local time at which the panel starts: summed in doubled precision, because one width is added over and over and
    /// errs to one side.
    pub(super) start: Doubled,
    pub(super) panels: u32,
    pub(super) level: usize,
    pub(super) quiet: u32,
    pub(super) leap: usize,
    /// At the start of the panel.
    pub(super) modes: Vec<Modes>,
    pub(super) middle: Vec<Modes>,
    pub(super) bounds: Vec<Bounds>,
    /// z and z' at a time within the panel.
    pub(super) at: Vec<[ComplexGroup; 2]>,
    /// Of the basis: the one about which the modes move.
    pub(super) reference: usize,
    /// The parts of the reference with the sticking contacts where they are: at local time 0, of the force p at the start
    /// of the panel.
    pub(super) parts: Vec<Group>,
    /// q at local time 0 of the coordinates that stick, in the order of the basis.
    pub(super) stuck: Vec<f64>,
}

impl ModalMotion {
    /// Starts a phase at local time 0 from (q, q').
    pub fn restart(&mut self, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        self.start = Doubled::default();
        self.panels = 0;
        self.level = 0;
        self.quiet = 0;
        self.leap = FIRST_LEAP;
        self.stuck.clear();
        self.stuck.extend(basis.sticking.iter().map(|&(k, _)| q[k]));
        if self.modes.len() < basis.groups || self.parts.len() < basis.parts {
            self.grow(basis);
        }
        self.unit.run(Project { motion: self, basis, q, u });
    }

    /// Positions of the reference at local time 0, of the kept coordinates in groups.
    pub(super) fn about<'a>(&'a self, basis: &ModalBasis) -> &'a [Group] {
        &self.parts[..basis.positions]
    }

    /// Constant part of each event function at local time 0.
    pub(super) fn constants<'a>(&'a self, basis: &ModalBasis) -> &'a [f64] {
        let first = basis.positions + 2 * basis.groups;
        &cast_slice(&self.parts[first..])[..basis.functions.len()]
    }

    /// p at the start of the panel, of a group of modes.
    #[inline(always)]
    pub(super) fn force(&self, basis: &ModalBasis, g: usize) -> ComplexGroup {
        let first = basis.positions + 2 * g;
        ComplexGroup { re: self.parts[first], im: self.parts[first + 1] }
    }

    /// Chooses the equilibrium as the reference, unless it is so far away that the difference would cost digits.
    #[inline(always)]
    fn refer<S: Lanes>(&mut self, simd: S, basis: &ModalBasis, q: &[f64], u: &[f64]) {
        let allowed = [FARTHEST * largest(simd, q), FARTHEST * largest(simd, u)];
        for (index, reference) in basis.references.iter().enumerate().rev() {
            self.reference = index;
            let parts = &mut self.parts[..basis.parts];
            let (fixed, of_sticks) = reference.parts.split_at(parts.len());
            parts.iter_mut().zip(fixed).for_each(|(part, fixed)| *part = *fixed);
            for (stick, &at) in self.stuck.iter().enumerate() {
                let at = simd.splat_f64s(at);
                for (part, &of) in parts.iter_mut().zip(&of_sticks[stick * basis.parts..]) {
                    *part = simd.mul_add_f64s(of, at, *part);
                }
            }
            let mut size = ZEROS;
            for &at in &parts[..basis.positions] {
                size = simd.max_f64s(size, simd.abs_f64s(at));
            }
            if simd.reduce_max_f64s(size) <= allowed[0] && reference.speed <= allowed[1] {
                return;
            }
        }
    }

    #[cold]
    fn grow(&mut self, basis: &ModalBasis) {
        let groups = basis.groups.max(self.modes.len());
        let zero = ComplexGroup::ZERO;
        let modes = Modes { z: zero, dz: zero, w: zero };
        self.modes.resize(groups, modes);
        self.middle.resize(groups, modes);
        let bounds =
            Bounds { affine: ZEROS, curvature: ZEROS, beyond: ZEROS, rounded: ZEROS, fast: ZEROS };
        self.bounds.resize(groups, bounds);
        self.at.resize(groups, [zero; 2]);
        self.parts.resize(basis.parts.max(self.parts.len()), ZEROS);
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
        self.refer(simd, basis, q, u);
        for first in (0..groups).step_by(PROJECTED) {
            match groups - first {
                1 => self.project_groups::<S, 1>(first, simd, basis, q, u),
                _ => self.project_groups::<S, PROJECTED>(first, simd, basis, q, u),
            }
        }
    }

    #[inline(always)]
    fn project_groups<S: Lanes, const N: usize>(
        &mut self,
        first: usize,
        simd: S,
        basis: &ModalBasis,
        q: &[f64],
        u: &[f64],
    ) {
        let reference = &basis.references[self.reference];
        let about: &[f64] = cast_slice(&self.parts[..basis.positions]);
        let velocity: &[f64] = cast_slice(&reference.velocity);
        // Sums of positions and of velocities, each half as long a chain of additions.
        let mut sums = [[ComplexGroup::ZERO; 2]; N];
        let (rows, _) = basis.projection[first * basis.kept.len()..].as_chunks::<N>();
        let at = basis.kept.iter().zip(about.iter().zip(velocity));
        for ((&k, (about, velocity)), row) in at.zip(rows) {
            let (q, u) = (simd.splat_f64s(q[k] - about), simd.splat_f64s(u[k] - velocity));
            for ([of_q, of_u], factors) in sums.iter_mut().zip(row) {
                *of_q = of_q.add_scaled(simd, q, factors.position);
                *of_u = of_u.add_scaled(simd, u, factors.velocity);
            }
        }
        for (g, [of_q, of_u]) in (first..).zip(sums) {
            let z = ComplexGroup {
                re: simd.add_f64s(of_q.re, of_u.re),
                im: simd.add_f64s(of_q.im, of_u.im),
            };
            let lambda = basis.lambda.0[g];
            let dz = self.force(basis, g).add_product(simd, lambda, z);
            self.modes[g] = Modes { z, dz, w: reference.linear[g].add_product(simd, lambda, dz) };
        }
    }

    pub fn start(&self) -> f64 {
        self.start.high
    }

    pub(super) fn advance_by(&mut self, basis: &ModalBasis, level: &Level) {
        self.unit.run(Advance { motion: self, basis, level });
        self.start = self.start.add(level.width.into());
        self.panels += 1;
    }

    #[inline(always)]
    fn shift<S: Lanes>(&mut self, groups: usize, simd: S, basis: &ModalBasis, level: &Level) {
        let width = simd.splat_f64s(level.width);
        let reference = &basis.references[self.reference];
        let (modes, at) = (&mut self.modes[..groups], &level.modes[..groups]);
        let (forces, _) = self.parts[basis.positions..].as_chunks_mut::<2>();
        let (forces, linear) = (&mut forces[..groups], &reference.linear[..groups]);
        for g in 0..groups {
            let Step { exponential, phi1, phi2 } = &at[g].whole;
            let force = ComplexGroup { re: forces[g][0], im: forces[g][1] };
            let Modes { z, dz, w } = &mut modes[g];
            // A closure would not be compiled for the vector unit.
            let zero = ComplexGroup::ZERO;
            *z = zero.add_product(simd, *exponential, *z).add_product(simd, *phi1, force);
            *dz = zero.add_product(simd, *exponential, *dz);
            *w = zero.add_product(simd, *exponential, *w);
            if !reference.is_steady {
                *z = z.add_product(simd, *phi2, linear[g]);
                *dz = dz.add_product(simd, *phi1, linear[g]);
                let force = force.add_scaled(simd, width, linear[g]);
                forces[g] = [force.re, force.im];
            }
        }
    }

    pub fn advance(&mut self, basis: &ModalBasis) {
        self.advance_by(basis, basis.level(self.level));
    }
}

impl Modes {
    /// A step of `h` later.
    #[inline(always)]
    pub(super) fn after<S: Lanes>(&self, simd: S, step: &Step, h: f64) -> Self {
        let Self { z, dz, w } = *self;
        Self {
            z: z.add_scaled(simd, simd.splat_f64s(h), dz).add_product(simd, step.phi2, w),
            dz: dz.add_product(simd, step.phi1, w),
            w: ComplexGroup::ZERO.add_product(simd, step.exponential, w),
        }
    }
}

/// The largest modulus.
#[inline(always)]
fn largest<S: Lanes>(simd: S, x: &[f64]) -> f64 {
    let (groups, others) = x.as_chunks::<GROUP>();
    let mut size = ZEROS;
    for &x in groups {
        size = simd.max_f64s(size, simd.abs_f64s(group(x)));
    }
    let mut size = simd.reduce_max_f64s(size);
    for x in others {
        // `f64::max` looks for NaN, which takes three times as long.
        size = if x.abs() > size { x.abs() } else { size };
    }
    size
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
pub(super) use with_groups;

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
        with_groups!(basis.groups, motion.shift(simd, basis, level));
    }
}
