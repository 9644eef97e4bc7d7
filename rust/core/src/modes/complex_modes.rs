//! Complex modes of a status combination, with left and right vectors.
//!
//! `A y' + B y = Q` with `y = (x, x')`, `A = [[C, M], [M, 0]]`, `B = [[K, 0], [0, -M]]`: right vectors
//! `(xi, lambda xi)` with `lambda A r = -B r`, left vectors `(v, lambda v)` with `lambda l' A = -l' B`,
//! bi-orthogonal: `L' A R = diag(a)`, `L' B R = diag(b)`, `lambda = -b / a`.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::eigenpair::turned;
use crate::linalg::parallel::each;
use crate::modes::mode::Mode;
use crate::modes::quadratic_pencil::Pencil;
use crate::modes::spectrum::{Vectors, spectrum};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::status::Combination;

/// Stands for the left vector of a defective mode, and for numbers that are divided by its product with the right one.
const UNDEFINED: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// All modes of a combination, sorted by modulus, conjugates adjacent, positive imaginary part first: 2m less one for each
/// coordinate of first order.
/// Matrices are column-major: one mode after the other. Only the displacement parts of the vectors are kept.
#[derive(Debug, Clone)]
pub struct Modes {
    /// The reduced system that the modes solve.
    pub reduced: Reduced,
    /// lambda, 1/s; a positive real part grows, the imaginary part is in rad/s.
    pub eigenvalues: Vec<Complex64>,
    /// xi, m entries per mode; the largest one is 1.
    pub right: Vec<Complex64>,
    /// v, m entries per mode, NaN where the mode is defective.
    pub left: Vec<Complex64>,
    /// `a = l' A r` of each mode, NaN where it is defective.
    pub a: Vec<Complex64>,
    /// `b = l' B r = -lambda a` of each mode, NaN where it is defective.
    pub b: Vec<Complex64>,
    /// xi over all dofs of the scene, n entries per mode.
    pub shapes: Vec<Complex64>,
    /// Condition number of each eigenvalue in mass-normalised, scaled state space, -.
    pub condition: Vec<f64>,
    /// Whether the condition number is so large that the mode has no left vector.
    pub defective: Vec<bool>,
    /// `|P(lambda) xi| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |xi|)` of each mode, -.
    pub residual: Vec<f64>,
    /// How far rounding of the matrices moves each eigenvalue.
    pub rounding: Vec<f64>,
}

impl Modes {
    /// Modes of one combination; fails where the reduced mass is singular or an eigenvalue does not converge.
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        let reduced = Reduced::new(scene, combination)?;
        let pencil = Pencil::new(reduced.scene(scene), combination, &reduced.reduction);
        let mut half = spectrum(&pencil, Vectors::Refined)?;
        half.sort_by(|p, q| {
            let key =
                |mode: &Mode| (mode.eigenvalue.norm(), mode.eigenvalue.im, mode.eigenvalue.re);
            let (p, q) = (key(p), key(q));
            p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)).then(p.2.total_cmp(&q.2))
        });
        let (m, n) = (reduced.size(), scene.dofs);
        let half = each(m, half, normalised);
        let roundings = each(m, half.iter().collect(), |mode: &Mode| mode.rounding(&pencil));
        let whole: Vec<(&Mode, bool)> = half
            .iter()
            .flat_map(|mode| {
                std::iter::once((mode, false)).chain((!mode.is_real()).then_some((mode, true)))
            })
            .collect();
        let values = |value: &dyn Fn(&Mode) -> Complex64| -> Vec<Complex64> {
            whole.iter().map(|&(mode, conjugate)| turned(value(mode), conjugate)).collect()
        };
        let valid = |mode: &Mode, z| if mode.is_defective() { UNDEFINED } else { z };
        let zeros = |length: usize| vec![Complex64::default(); whole.len() * length];
        let (mut right, mut left, mut shapes) = (zeros(m), zeros(m), zeros(n));
        // Chunks of length zero are not allowed, and there is nothing in them.
        let columns = right
            .chunks_mut(m.max(1))
            .zip(left.chunks_mut(m.max(1)))
            .zip(shapes.chunks_mut(n.max(1)))
            .zip(&whole);
        each(m, columns.collect(), |(((right, left), shape_column), &(mode, conjugate))| {
            let copy = |target: &mut [Complex64], source: &[Complex64]| {
                let entries = target.iter_mut().zip(source);
                entries.for_each(|(entry, &z)| *entry = turned(z, conjugate));
            };
            copy(right, &mode.right);
            match mode.is_defective() {
                true => left.fill(UNDEFINED),
                false => copy(left, &mode.left),
            }
            let over_dofs = shape(scene, reduced.scene(scene), &reduced.reduction, right);
            shape_column.copy_from_slice(&over_dofs);
        });
        Ok(Self {
            eigenvalues: values(&|mode| mode.eigenvalue),
            right,
            left,
            a: values(&|mode| valid(mode, mode.a)),
            b: values(&|mode| valid(mode, -mode.eigenvalue * mode.a)),
            shapes,
            condition: whole.iter().map(|(mode, _)| mode.condition).collect(),
            defective: whole.iter().map(|(mode, _)| mode.is_defective()).collect(),
            residual: whole.iter().map(|(mode, _)| mode.residual).collect(),
            rounding: half
                .iter()
                .zip(roundings)
                .flat_map(|(mode, moved)| vec![moved; if mode.is_real() { 1 } else { 2 }])
                .collect(),
            reduced,
        })
    }

    /// `left' A y / a` of a reduced state y, left = (v, lambda v): `v' (C x + M x' + lambda M x) / a`.
    pub(crate) fn coordinates(&self, y: &[f64]) -> Vec<Complex64> {
        let m = self.reduced.size();
        let (x, velocity) = y.split_at(m);
        let (x, velocity) = (DVector::from_column_slice(x), DVector::from_column_slice(velocity));
        let Reduced { mass, damping, .. } = &self.reduced;
        let (momentum, inertia) = (damping * &x + mass * velocity, mass * &x);
        let lefts = self.left.chunks_exact(m.max(1));
        lefts
            .zip(&self.eigenvalues)
            .zip(&self.a)
            .map(|((left, lambda), a)| {
                let terms = left.iter().zip(&momentum).zip(&inertia);
                terms.map(|((v, p), s)| v * (p + lambda * s)).sum::<Complex64>() / a
            })
            .collect()
    }
}

/// A right vector over all dofs of a scene; `moving` is the scene that a reduction is of.
pub(crate) fn shape(
    scene: &Scene,
    moving: &Scene,
    reduction: &Reduction,
    right: &[Complex64],
) -> Vec<Complex64> {
    let part = |part: fn(&Complex64) -> f64| {
        let mut q = vec![0.0; scene.size];
        reduction.kept.iter().zip(right).for_each(|(&k, z)| q[k] = part(z));
        moving.dependents.follow_rates(&mut q);
        scene.velocities(&q)
    };
    let parts = part(|z| z.re).into_iter().zip(part(|z| z.im));
    parts.map(|(re, im)| Complex64::new(re, im)).collect()
}

/// Scales both vectors so that their largest entries are 1; `a` follows.
pub(crate) fn normalised(mut mode: Mode) -> Mode {
    let largest = |vector: &[Complex64]| {
        vector
            .iter()
            .copied()
            .max_by(|p, q| p.norm_sqr().total_cmp(&q.norm_sqr()))
            .unwrap_or(Complex64::from(1.0))
    };
    let (right, left) = (largest(&mode.right), largest(&mode.left));
    mode.right.iter_mut().for_each(|z| *z /= right);
    mode.left.iter_mut().for_each(|z| *z /= left);
    mode.a /= right * left;
    mode
}
