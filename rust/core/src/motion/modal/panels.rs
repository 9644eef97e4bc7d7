//! Panels of a modal phase: each event function as a polynomial with its error bound.
//!
//! An event function `Re sum h_r z_r + ..` is a polynomial with coefficients `Re sum h_r w_r lambda_r^j / (j + 2)!` from
//! the second power on. Before a polynomial is formed, an envelope is tried: the quadratic part is compared with a bound of
//! the terms that the modes can add to it. After some quiet panels the envelope of a much longer interval is tried first.

use pulp::bytemuck::cast_slice;
use pulp::cast;

use crate::motion::modal::basis::{ModalBasis, operations};
use crate::motion::modal::level::{LEVELS, Level, LevelModes, TAIL_GROUPS};
use crate::motion::modal::motion::{Bounds, FIRST_LEAP, ModalMotion, Modes, with_groups};
use crate::motion::panel::{Panel, rounding};
use crate::numerics::simd::{ComplexGroup, GROUP, Group, Kernel, Lanes, ZEROS, add_real_part};

/// Quiet panels before a leap is tried.
const QUIET: u32 = 3;
/// Number of leaps after which a panel is filled in any case. At a panel a run looks whether it is to stop; in a settled
/// motion nothing else ends a series of leaps before the end of the run.
const LEAPS: u32 = 1000;

/// An envelope clears a stretch if it stays above this part of its terms, and above their rounding, which is larger after a
/// thousand panels.
const CLEAR: f64 = 1e-12;

/// Number of panels between two tests whether the fast modes have decayed.
const PANELS_PER_LEVEL: u32 = 4;

impl ModalMotion {
    /// Whether every mode too fast for the polynomials of `level` has decayed below rounding.
    fn allows(&self, basis: &ModalBasis, level: &Level) -> bool {
        basis.functions.iter().zip(self.constants(basis)).all(|(weights, constant)| {
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

    /// Rounding of an event function, relative to the sum of its terms, and that of the recurrence over the panels before.
    fn rounding(&self, basis: &ModalBasis) -> f64 {
        rounding(operations(basis.count), self.panels)
    }

    /// Moves over stretches that the envelope proves free of events, up to `remaining`.
    fn leap(&mut self, basis: &ModalBasis, remaining: f64) -> u32 {
        let mut leaps = 0;
        while self.quiet >= QUIET && leaps < LEAPS {
            let index = (self.level + self.leap).min(LEVELS - 1);
            let level = basis.level(index);
            let within = self.start.add(level.width.into()).high <= remaining;
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
        let clear = CLEAR.max(self.rounding(basis));
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
        let constants = cast_slice::<Group, f64>(&self.parts[basis.positions + 2 * basis.groups..]);
        let slopes = &basis.references[self.reference].slopes;
        for ((weights, function_slope), constant) in
            basis.functions.iter().zip(slopes).zip(constants)
        {
            let weights = &weights[..groups];
            let (mut value, mut slope, mut scale, mut reach) = (ZEROS, ZEROS, ZEROS, ZEROS);
            for g in 0..groups {
                let weight = weights[g];
                value = add_real_part(simd, value, weight.of, affine[g].z);
                slope = add_real_part(simd, slope, weight.of, affine[g].dz);
                scale = simd.mul_add_f64s(weight.rounded, bounds[g].affine, scale);
                reach = simd.mul_add_f64s(weight.magnitude, bounds[g].curvature, reach);
            }
            let offset = constant + function_slope * self.start.high;
            let change = (simd.reduce_sum_f64s(slope) + function_slope) * level.width;
            let reach = simd.reduce_sum_f64s(reach);
            let lowest = offset + simd.reduce_sum_f64s(value) + change.min(0.0) - reach;
            if !(lowest > clear * (offset.abs() + simd.reduce_sum_f64s(scale) + reach)) {
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
            && self.start.high + basis.level(self.level).width < remaining
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
        let rounding = self.rounding(basis);
        let (modes, at) = (&self.modes[..groups], &level.modes[..groups]);
        let (middle, bounds) = (&mut self.middle[..groups], &mut self.bounds[..groups]);
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
                beyond: simd.mul_f64s(of_w, middle_reach),
                rounded,
                fast: simd.mul_f64s(of_w, fast_reach),
            };
            middle[g] = modes[g].after(simd, &at[g].half, half);
        }
        let constants = cast_slice::<Group, f64>(&self.parts[basis.positions + 2 * basis.groups..]);
        let affine = basis.references[self.reference].slopes.iter().zip(constants);
        let functions = basis.functions.iter().zip(affine);
        for (index, (weights, (&slope, &constant))) in functions.enumerate() {
            let weights = &weights[..groups];
            let offset = constant + slope * self.start.high;
            let of_offset = offset.abs().max(constant.abs()) + width * slope.abs();
            // Sums over the modes, in the lanes of a group.
            let (mut value, mut first, mut second, mut beyond) = (ZEROS, ZEROS, ZEROS, ZEROS);
            for g in 0..groups {
                let weight = weights[g];
                value = add_real_part(simd, value, weight.of, middle[g].z);
                first = add_real_part(simd, first, weight.of, middle[g].dz);
                second = add_real_part(simd, second, weight.of, middle[g].w);
                beyond = simd.mul_add_f64s(weight.magnitude, bounds[g].beyond, beyond);
                beyond = simd.mul_add_f64s(weight.rounded, bounds[g].rounded, beyond);
            }
            let c0 = offset + half * slope + simd.reduce_sum_f64s(value);
            let c1 = (half * (slope + simd.reduce_sum_f64s(first))).abs();
            let c2 = 0.5 * simd.reduce_sum_f64s(second) * half * half;
            let lowest = if c1 < 2.0 * c2 { c0 - 0.25 * c1 * c1 / c2 } else { c0 - c1 + c2 };
            let excluded = lowest - simd.reduce_sum_f64s(beyond) > rounding * of_offset;
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
                affine = simd.mul_add_f64s(weight.rounded, bounds[g].affine, affine);
                curvature = simd.mul_add_f64s(weight.rounded, bounds[g].curvature, curvature);
                fast = simd.mul_add_f64s(weight.magnitude, bounds[g].fast, fast);
            }
            let (affine, curvature) =
                (simd.reduce_sum_f64s(affine), simd.reduce_sum_f64s(curvature));
            let remainder = curvature * level.truncation + simd.reduce_sum_f64s(fast);
            panel.curvature_error[index] = rounding * curvature + remainder;
            panel.error[index] = rounding * (of_offset + affine + curvature) + remainder;
            let mut tail = [ZEROS; TAIL_GROUPS];
            for (g, powers) in level.powers.chunks(GROUP).enumerate() {
                let gains = ComplexGroup::ZERO.add_product(simd, weights[g].of, modes[g].w);
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
    use crate::motion::panel::REACH;
    use crate::motion::taylor::motion::TaylorMotion;
    use crate::numerics::simd::VectorUnit;
    use crate::scene::contact_law::{ContactInput, Direction};
    use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
    use crate::scene::model::Scene;
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
            tangential: Some(Direction::Dof(0)),
            normal: Some(Direction::Dof(1)),
            friction: 0.3,
            static_friction: 0.4,
            slider_speed: 0.2,
            springs: crate::scene::contact_law::Springs::default(),
            ..Default::default()
        };
        let scene = Scene::new(SceneInput {
            mass: Mass::Lumped(vec![1.0; size]),
            stiffness: SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry)),
            damping: Damping::Proportional { mass: 0.0, stiffness: damping },
            force: (0..size).map(|k| if k == 1 { -1.0 } else { 0.1 }).collect(),
            contacts: vec![contact],
            ..Default::default()
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

    /// After n panels of an undamped motion the state errs by n roundings of the angles of its modes: neither is an error
    /// of z' integrated from panel to panel, nor does the clock, which adds one width n times, err to one side.
    #[test]
    fn rounding_grows_with_the_number_of_panels() {
        const PANELS: usize = 4096;
        let scene = chain(6, 0.0);
        let combination = Combination::parse("d", 1).expect("a status");
        let basis = CombinationBasis::new(&scene, &combination, Wanted::Modes).expect("modes");
        let Propagator::Modal(modal) = &basis.propagator else { panic!("no modes") };
        let start = ([0.3, 0.5, -0.2, 0.1, 0.4, -0.6], [0.7, -0.1, 0.2, 0.5, -0.3, 0.6]);
        let [mut by_panels, mut at_once] = [(); 2].map(|()| {
            let mut motion = ModalMotion::default();
            motion.restart(modal, &start.0, &start.1);
            motion
        });
        (0..PANELS).for_each(|_| by_panels.advance(modal));
        let [mut found, mut expected] = [start; 2];
        by_panels.state(modal, 0.0, &mut found.0, &mut found.1);
        at_once.state(modal, by_panels.start(), &mut expected.0, &mut expected.1);
        // Of the angle of the fastest mode, in the argument of its exponential and in that of a panel.
        let allowed = 2.0 * f64::EPSILON * REACH * PANELS as f64;
        for (x, y) in found.0.iter().zip(&expected.0).chain(found.1.iter().zip(&expected.1)) {
            assert!((x - y).abs() <= allowed, "{:e} of {allowed:e}", x - y);
        }
    }
}
