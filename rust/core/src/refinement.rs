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
        let conjugates = |i: usize| if self.values[i].im == 0.0 { 1 } else { 2 };
        (0..vectors.len())
            .map(|j| {
                let mut vector = vectors[j].clone();
                for (i, conjugated) in
                    (0..vectors.len()).flat_map(|i| (0..conjugates(i)).map(move |c| (i, c == 1)))
                {
                    if i == j && !conjugated {
                        continue;
                    }
                    let orient = |z: &Complex64| if conjugated { z.conj() } else { *z };
                    let component: Complex64 =
                        duals[i].iter().zip(&residuals[j]).map(|(y, r)| orient(y) * r).sum();
                    let distance =
                        (orient(&self.values[i]) - self.values[j]) * orient(&self.scales[i]);
                    let factor = direction * component / distance;
                    let size = |vector: &[Complex64]| {
                        vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
                    };
                    // Also refuses NaN, of equal values.
                    if factor.norm() * size(&vectors[i]) <= LARGEST * size(&vectors[j]) {
                        for (target, x) in vector.iter_mut().zip(&vectors[i]) {
                            *target += factor * orient(x);
                        }
                    }
                }
                if self.values[j].im == 0.0 {
                    vector.iter_mut().for_each(|z| z.im = 0.0);
                }
                vector
            })
            .collect()
    }
}
