//! Inverse iteration for one mode of a quadratic problem, in the scaling of its own matrices.
//!
//! A solver that is backward stable for the mass-normalised matrix leaves a residual of rounding times *its* norm. Where
//! masses and stiffnesses spread over many orders of magnitude this can be large in the scaling that they were given
//! in. Newton's method for `P(lambda) xi = 0`, `xi := P(lambda)^-1 P'(lambda) xi` on equilibrated rows and columns
//! (Ruhe 1973), on the left side as well, and a Rayleigh quotient in doubled precision take it out.

use num_complex::Complex64;

use crate::linalg::eigen::ComplexFactors;
use crate::linalg::eigenpair::norm;
use crate::modes::mode::{BACKWARD_STABLE, Mode, SETTLED};
use crate::modes::quadratic_pencil::{Damping, Pencil};
use crate::numerics::double_double::DoubledComplex;

/// Rounds; from a usual result the first one does nearly all of it, from a slow mode lost in rounding it takes some.
const ROUNDS: usize = 6;

/// M, C and K, row-major.
pub(crate) struct InverseIteration<'a> {
    pencil: &'a Pencil,
    mass: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
    /// Norms of M, C and K.
    norms: [f64; 3],
}

impl<'a> InverseIteration<'a> {
    pub fn new(pencil: &'a Pencil) -> Self {
        let (mass, stiffness) = (pencil.mass.to_dense(), pencil.stiffness.to_dense());
        let damping = match &pencil.damping {
            Damping::General(rows) => rows.to_dense(),
            Damping::Proportional { alpha, beta } => {
                mass.iter().zip(&stiffness).map(|(m, k)| alpha * m + beta * k).collect()
            }
        };
        Self { pencil, mass, damping, stiffness, norms: pencil.norms() }
    }

    /// The mode with the smallest residual among the given one and its iterates.
    pub fn improved(&self, mode: Mode) -> Mode {
        let mut best = mode.clone();
        let mut current = mode;
        for _ in 0..ROUNDS {
            let before = current.eigenvalue;
            current = self.iterate(&current);
            // Of a P that is singular to the last bit.
            if current.residual.is_nan() {
                break;
            }
            if current.residual < best.residual {
                best = current.clone();
            }
            let moved = (current.eigenvalue - before).norm();
            if best.residual <= BACKWARD_STABLE && moved <= SETTLED * before.norm() {
                break;
            }
        }
        best
    }

    fn iterate(&self, mode: &Mode) -> Mode {
        let m = self.pencil.size;
        let lambda = mode.eigenvalue;
        let entry =
            |k: usize| lambda * (lambda * self.mass[k] + self.damping[k]) + self.stiffness[k];
        let p: Vec<Complex64> = (0..m * m).map(entry).collect();
        let slope: Vec<Complex64> =
            (0..m * m).map(|k| 2.0 * lambda * self.mass[k] + self.damping[k]).collect();
        // Equilibrated by the square roots of the diagonal's terms, which do not cancel.
        let scale: Vec<f64> = (0..m)
            .map(|i| {
                let k = i * m + i;
                let size = lambda.norm();
                let terms = size * size * self.mass[k].abs()
                    + size * self.damping[k].abs()
                    + self.stiffness[k].abs();
                1.0 / terms.max(f64::MIN_POSITIVE).sqrt()
            })
            .collect();
        let scaled: Vec<Complex64> =
            (0..m * m).map(|k| scale[k / m] * p[k] * scale[k % m]).collect();
        let factors = ComplexFactors::new(m, &scaled);
        let times_scale = |vector: Vec<Complex64>| -> Vec<Complex64> {
            vector.iter().zip(&scale).map(|(z, d)| z * d).collect()
        };
        let unit = |solution: Vec<Complex64>| -> Vec<Complex64> {
            let vector = times_scale(solution);
            let length = norm(&vector);
            vector.into_iter().map(|z| z / length).collect()
        };
        let load = |a: &dyn Fn(usize, usize) -> Complex64, x: &[Complex64]| {
            (0..m).map(|i| (0..m).map(|j| a(i, j) * x[j]).sum()).collect::<Vec<Complex64>>()
        };
        let at = |matrix: &'_ [Complex64], i: usize, j: usize| matrix[i * m + j];
        let right_load = times_scale(load(&|i, j| at(&slope, i, j), &mode.right));
        let left_load = times_scale(load(&|i, j| at(&slope, j, i), &mode.left));
        let right = unit(factors.solve(&right_load));
        let left = unit(factors.transposed_solve(&left_load));
        self.judged(lambda, right, left, mode.condition)
    }

    /// A mode of new vectors, its eigenvalue corrected by their Rayleigh quotient.
    fn judged(
        &self,
        lambda: Complex64,
        right: Vec<Complex64>,
        left: Vec<Complex64>,
        condition: f64,
    ) -> Mode {
        let mass = self.pencil.mass.product(&right);
        let stiffness = self.pencil.stiffness.product(&right);
        let damping: Vec<DoubledComplex> = match &self.pencil.damping {
            Damping::General(rows) => rows.product(&right),
            Damping::Proportional { alpha, beta } => mass
                .iter()
                .zip(&stiffness)
                .map(|(m, k)| m.times((*alpha).into()).add(k.times((*beta).into())))
                .collect(),
        };
        let rows = |lambda: Complex64| -> Vec<Complex64> {
            let terms = mass.iter().zip(&damping).zip(&stiffness);
            terms.map(|((m, c), k)| m.times(lambda).add(*c).times(lambda).add(*k).value()).collect()
        };
        let slope = |lambda: Complex64| -> Complex64 {
            let terms = mass.iter().zip(&damping).zip(&left);
            terms.map(|((m, c), v)| v * m.times(2.0 * lambda).add(*c).value()).sum()
        };
        let projected: Complex64 = left.iter().zip(rows(lambda)).map(|(v, row)| v * row).sum();
        let correction = projected / slope(lambda);
        let eigenvalue =
            lambda - if lambda.im == 0.0 { Complex64::from(correction.re) } else { correction };
        let size = eigenvalue.norm();
        let [m, c, k] = self.norms;
        let scale = (size * size * m + size * c + k) * norm(&right);
        Mode {
            eigenvalue,
            a: slope(eigenvalue),
            condition,
            residual: norm(&rows(eigenvalue)) / scale,
            right,
            left,
        }
    }
}
