//! One mode of a quadratic eigenproblem.

use num_complex::Complex64;

/// Condition number above which an eigenvalue counts as defective: a defective pair splits by about
/// the square root of rounding, which leaves a condition number of about its inverse, 7e7; less a margin of 20.
const DEFECTIVE: f64 = 3.4e6;

/// Relative residual up to which a mode is as good as its matrices; above, scaling has cost digits.
pub(crate) const BACKWARD_STABLE: f64 = 3e-14;
/// Relative correction of an eigenvalue below which the next one, of about its square, is rounding. A larger one
/// belongs to a mode much slower than the fastest, and vectors whose error is as large: they are refined first.
pub(crate) const SETTLED: f64 = 1e-9;

/// One mode, of each conjugate pair the one with positive imaginary part; vectors over the kept coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    pub eigenvalue: Complex64,
    pub right: Vec<Complex64>,
    pub left: Vec<Complex64>,
    /// `a = left' (C + 2 lambda M) right`
    pub a: Complex64,
    /// Condition number of the eigenvalue in mass-normalised, scaled state space.
    pub condition: f64,
    /// `|P(lambda) xi| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |xi|)`
    pub residual: f64,
}

impl Mode {
    pub fn is_real(&self) -> bool {
        self.eigenvalue.im == 0.0
    }

    /// Whether it has no bi-orthogonal pair of vectors.
    pub fn is_defective(&self) -> bool {
        // A comparison that takes NaN as well.
        !(self.condition < DEFECTIVE)
    }

    /// Turns it into the mode of the conjugate eigenvalue.
    pub fn conjugate(&mut self) {
        self.eigenvalue = self.eigenvalue.conj();
        self.a = self.a.conj();
        self.right.iter_mut().chain(&mut self.left).for_each(|z| z.im = -z.im);
    }
}
