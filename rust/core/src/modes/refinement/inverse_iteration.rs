//! Inverse iteration for one mode of a quadratic problem, in the scaling of its own matrices.
//!
//! A solver that is backward stable for the mass-normalised matrix leaves a residual of rounding times *its* norm. Where
//! masses and stiffnesses spread over many orders of magnitude this can be large in the scaling that they were given
//! in. Newton's method for `P(lambda) xi = 0`, `xi := P(lambda)^-1 P'(lambda) xi` on equilibrated rows and columns
//! (Ruhe 1973), on the left side as well, and a Rayleigh quotient in doubled precision take it out.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::linalg::dense::Factors;
use crate::modes::mode::{BACKWARD_STABLE, Mode, SETTLED};
use crate::modes::quadratic_pencil::{Norms, Pencil, PencilDamping};

/// Number of rounds. The first one removes nearly all of a usual error; a slow mode lost in rounding takes several.
const ROUNDS: usize = 6;

/// M, C and K.
pub(crate) struct InverseIteration<'a> {
    pencil: &'a Pencil,
    mass: DMatrix<f64>,
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    norms: Norms,
}

impl<'a> InverseIteration<'a> {
    pub fn new(pencil: &'a Pencil) -> Self {
        let (mass, stiffness) = (pencil.mass.rounded(), pencil.stiffness.rounded());
        let damping = match &pencil.damping {
            PencilDamping::General(rows) => rows.rounded(),
            PencilDamping::Proportional { alpha, beta } => &mass * *alpha + &stiffness * *beta,
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
        let lambda = mode.eigenvalue;
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
        let [mass, damping, stiffness] = [&self.mass, &self.damping, &self.stiffness].map(complex);
        let p = (&mass * lambda + &damping) * lambda + stiffness;
        let slope = mass * (2.0 * lambda) + damping;
        // Equilibrated by the square roots of the diagonal's terms, which do not cancel.
        let size = lambda.norm();
        let scale = DVector::from_fn(p.nrows(), |i, _| {
            let terms = size * size * self.mass[(i, i)].abs()
                + size * self.damping[(i, i)].abs()
                + self.stiffness[(i, i)].abs();
            1.0 / terms.max(f64::MIN_POSITIVE).sqrt()
        });
        let factors = Factors::new(p.map_with_location(|i, j, z| scale[i] * z * scale[j]));
        let scale = scale.map(Complex64::from);
        let scaled = |vector: DVector<Complex64>| vector.component_mul(&scale);
        let unit = |solution: DVector<Complex64>| -> Vec<Complex64> {
            let vector = scaled(solution);
            let length = Complex64::from(vector.norm());
            (vector / length).data.into()
        };
        let right = unit(factors.solve(scaled(&slope * DVector::from_column_slice(&mode.right))));
        let left = unit(
            factors.transposed_solve(scaled(slope.tr_mul(&DVector::from_column_slice(&mode.left)))),
        );
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
        let products = self.pencil.products(&right);
        let eigenvalue = products.corrected(lambda, &left);
        let rows = products.rows(eigenvalue).into_iter();
        Mode {
            eigenvalue,
            a: products.slope(eigenvalue, &left),
            condition,
            residual: self.norms.relative_residual(eigenvalue, &right, rows),
            right,
            left,
        }
    }
}
