//! One step of iterative refinement for all eigenvectors of a problem at once.
//!
//! A backward-stable solver leaves in each vector an error of rounding times the norm of the *matrix* over the
//! distance of the eigenvalues: of a mode a thousand times slower than the fastest one, ten digits remain. With the
//! residual `r_j` of vector j in doubled precision, its component along another vector i is known to first order,
//!
//! ```text
//! x_j := x_j - sum_i x_i (y_i' r_j) / ((value_i - value_j) scale_i),   scale_i = y_i' P'(value_i) x_i,
//! ```
//!
//! which squares the relative error (Ogita and Aishima 2018, for one side; both sides here).

use num_complex::Complex64;

use crate::linalg::eigenpair::{norm, turned};
use crate::modes::refinement::columns::{Columns, Factors};

/// Corrections larger than this, relative to the vector, are no refinement: the pair is nearly defective.
const LARGEST: f64 = 1e-4;

/// Eigenvalues, one of each conjugate pair, with vectors and their residuals; all columns of equal length.
pub(crate) struct Eigenvectors<'a> {
    pub values: &'a [Complex64],
    pub scales: &'a [Complex64],
    pub right: &'a [Vec<Complex64>],
    pub left: &'a [Vec<Complex64>],
}

impl Eigenvectors<'_> {
    /// Right vectors with the residuals `P(value_j) x_j` taken out. `direction` is the sign of the derivative of P
    /// by the value in front of the mass: -1 for `K - value M`, +1 for `P(value) = value^2 M + ..`.
    pub fn refined_right(
        &self,
        residuals: &[Vec<Complex64>],
        direction: f64,
    ) -> Vec<Vec<Complex64>> {
        self.refined(self.right, self.left, residuals, direction)
    }

    /// Left vectors with the residuals `y_j' P(value_j)` taken out.
    pub fn refined_left(
        &self,
        residuals: &[Vec<Complex64>],
        direction: f64,
    ) -> Vec<Vec<Complex64>> {
        self.refined(self.left, self.right, residuals, direction)
    }

    fn refined(
        &self,
        vectors: &[Vec<Complex64>],
        duals: &[Vec<Complex64>],
        residuals: &[Vec<Complex64>],
        direction: f64,
    ) -> Vec<Vec<Complex64>> {
        let count = vectors.len();
        let is_pair = |i: usize| self.values[i].im != 0.0;
        let packed = |vectors: &[Vec<Complex64>]| {
            let places = vectors.iter().enumerate().map(|(i, vector)| (&vector[..], is_pair(i)));
            Columns::new(vectors.first().map_or(0, Vec::len), places)
        };
        let components = packed(duals).products(&packed(residuals));
        let sizes: Vec<f64> = vectors.iter().map(|vector| norm(vector)).collect();
        let mut columns = packed(vectors);
        let mut factors = Factors::zeros(&columns);
        for j in 0..count {
            for i in 0..count {
                for conjugate in [false, true] {
                    if i == j && !conjugate || conjugate && !is_pair(i) {
                        continue;
                    }
                    let distance = (turned(self.values[i], conjugate) - self.values[j])
                        * turned(self.scales[i], conjugate);
                    let factor = direction * components.get(i, conjugate, j) / distance;
                    // Also refuses NaN, of equal values.
                    if factor.norm() * sizes[i] <= LARGEST * sizes[j] {
                        factors.add(i, conjugate, j, factor);
                    }
                }
            }
        }
        columns.add_combinations(&factors);
        (0..count).map(|j| columns.vector(j)).collect()
    }
}
