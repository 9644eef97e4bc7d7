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

use crate::motion::modal::basis::ModalBasis;
use crate::motion::modal::level::{Level, Step};
use crate::motion::modal::reference::{Reference, largest};
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{ComplexGroup, Group, Kernel, Lanes, VectorUnit, ZEROS};

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
    /// Bound of the terms that the mode adds to its quadratic part about the middle, rounding included.
    pub(super) beyond: Group,
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
    /// p at the start of the panel.
    pub(super) force: Vec<ComplexGroup>,
    pub(super) middle: Vec<Modes>,
    pub(super) bounds: Vec<Bounds>,
    /// Weight times w of one event function.
    pub(super) gains: Vec<ComplexGroup>,
    /// t^2 phi2, and z and z' at a time within the panel.
    pub(super) phi2: Vec<ComplexGroup>,
    pub(super) at: Vec<[ComplexGroup; 2]>,
    /// Of the basis: the one about which the modes move.
    pub(super) reference: usize,
    /// (q, q') of the kept coordinates along the reference at local time 0.
    pub(super) about: Vec<[f64; 2]>,
    /// Constant part of each event function at local time 0.
    pub(super) constants: Vec<f64>,
    /// (q, q') of the kept coordinates at local time 0, from the reference.
    pub(super) gathered: Vec<[f64; 2]>,
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
        let size = [largest(q), largest(u)];
        let is_near = |reference: &Reference| {
            let stuck = reference.sticking.iter().zip(&self.stuck);
            let position = stuck.fold(reference.size[0], |sum, (of, at)| sum + of.size * at.abs());
            position <= FARTHEST * size[0] && reference.size[1] <= FARTHEST * size[1]
        };
        self.reference = basis.references.iter().rposition(is_near).unwrap_or(0);
        let reference = &basis.references[self.reference];
        self.about.clear();
        self.about.extend_from_slice(&reference.at);
        for (sticking, at) in reference.sticking.iter().zip(&self.stuck) {
            for (about, of) in self.about.iter_mut().zip(&sticking.of) {
                about[0] += of * at;
            }
        }
    }

    #[cold]
    fn grow(&mut self, groups: usize) {
        let zero = ComplexGroup::ZERO;
        let modes = Modes { z: zero, dz: zero, w: zero };
        self.modes.resize(groups, modes);
        self.middle.resize(groups, modes);
        self.force.resize(groups, zero);
        let bounds = Bounds { affine: ZEROS, curvature: ZEROS, beyond: ZEROS, fast: ZEROS };
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
        let forces = &basis.references[self.reference].force[..groups];
        for (g, modes) in self.modes[..groups].iter_mut().enumerate() {
            let mut z = ComplexGroup::ZERO;
            let rows = basis.projection[g..].iter().step_by(groups);
            for (&[q, u], row) in gathered.iter().zip(rows) {
                z = z.add_scaled(simd, simd.splat_f64s(q), row.position);
                z = z.add_scaled(simd, simd.splat_f64s(u), row.velocity);
            }
            let mut force = forces[g].constant;
            for (&stick, &at) in forces[g].sticking.iter().zip(&self.stuck) {
                force = force.add_scaled(simd, simd.splat_f64s(at), stick);
            }
            self.force[g] = force;
            let lambda = basis.lambda.0[g];
            let dz = force.add_product(simd, lambda, z);
            *modes = Modes { z, dz, w: forces[g].linear.add_product(simd, lambda, dz) };
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
        for (g, modes) in self.modes[..groups].iter_mut().enumerate() {
            let Step { exponential, phi1, phi2 } = level.modes[g].whole;
            let force = &mut self.force[g];
            // A closure would not be compiled for the vector unit.
            let zero = ComplexGroup::ZERO;
            let mut z = zero.add_product(simd, exponential, modes.z);
            let mut dz = zero.add_product(simd, exponential, modes.dz);
            let w = zero.add_product(simd, exponential, modes.w);
            z = z.add_product(simd, phi1, *force);
            if !reference.is_steady {
                let linear = reference.force[g].linear;
                z = z.add_product(simd, phi2, linear);
                dz = dz.add_product(simd, phi1, linear);
                *force = force.add_scaled(simd, width, linear);
            }
            *modes = Modes { z, dz, w };
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
