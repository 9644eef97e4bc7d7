//! One mode of a quadratic eigenproblem.

use num_complex::Complex64;

use crate::modes::quadratic_pencil::{DoubledRows, Pencil, PencilDamping};

/// Condition number above which an eigenvalue counts as defective: a defective pair splits by about
/// the square root of rounding, which leaves a condition number of about its inverse, 7e7; less a margin of 20.
const DEFECTIVE: f64 = 3.4e6;

/// Number of roundings in an entry of a reduced matrix, which is the sum of few products.
const ROUNDINGS: f64 = 4.0;

/// Up to this relative residual a mode is as accurate as its matrices; above it, scaling has cost digits.
pub(crate) const BACKWARD_STABLE: f64 = 3e-14;
/// Below this relative correction of an eigenvalue the next correction, of about its square, is rounding. A larger correction
/// belongs to a mode much slower than the fastest one, whose vectors have an error as large: they are refined first.
pub(crate) const SETTLED: f64 = 1e-9;

/// One mode, of each conjugate pair the one with positive imaginary part; vectors over the kept coordinates.
#[derive(Debug, Clone)]
pub struct Mode {
    /// lambda, 1/s.
    pub eigenvalue: Complex64,
    /// xi, m entries.
    pub right: Vec<Complex64>,
    /// v, m entries.
    pub left: Vec<Complex64>,
    /// `a = left' (C + 2 lambda M) right`
    pub a: Complex64,
    /// Condition number of the eigenvalue in mass-normalised, scaled state space, -.
    pub condition: f64,
    /// `|P(lambda) xi| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |xi|)`, -.
    pub residual: f64,
}

impl Mode {
    pub(crate) fn is_real(&self) -> bool {
        self.eigenvalue.im == 0.0
    }

    /// Whether it has no bi-orthogonal pair of vectors.
    pub fn is_defective(&self) -> bool {
        // A comparison that takes NaN as well.
        !(self.condition < DEFECTIVE)
    }

    /// How far rounding of the entries of M, C and K moves the eigenvalue: entries that change by a relative epsilon
    /// each change a simple one, to first order, by at most `epsilon s / |a|` with
    /// `s = |v|' (|lambda|^2 |M| + |lambda| |C| + |K|) |xi|`, a double one, whose a vanishes, by about the root of
    /// `epsilon s / (|v|' |M| |xi|)`; the smaller one counts.
    pub(crate) fn rounding(&self, pencil: &Pencil) -> f64 {
        let [change, mass] = self.rounding_forms(pencil);
        // The minimum of a number and NaN is the number.
        let moved = (change / self.a.norm()).min((change / mass).sqrt());
        if moved.is_nan() { 0.0 } else { moved }
    }

    /// Whether nothing but rounding, up to `margin` times as large, may tell its eigenvalue from another one: a rigid body
    /// without damping has the double eigenvalue zero, which rounding of K splits. In a superposition of such a pair each
    /// part is larger than the sum by the inverse of the splitting.
    pub(crate) fn is_split_by_rounding(&self, pencil: &Pencil, margin: f64) -> bool {
        let [change, mass] = self.rounding_forms(pencil);
        self.a.norm() < margin * (change * mass).sqrt()
    }

    /// `epsilon s` and `|v|' |M| |xi|` of [`Self::rounding`].
    fn rounding_forms(&self, pencil: &Pencil) -> [f64; 2] {
        let sizes = |vector: &[Complex64]| vector.iter().map(|z| z.norm()).collect::<Vec<f64>>();
        let (right, left) = (sizes(&self.right), sizes(&self.left));
        let form = |rows: &DoubledRows| rows.form_of_sizes(&left, &right);
        let (mass, stiffness) = (form(&pencil.mass), form(&pencil.stiffness));
        let damping = match &pencil.damping {
            PencilDamping::Proportional { alpha, beta } => {
                alpha.abs() * mass + beta.abs() * stiffness
            }
            PencilDamping::General(rows) => form(rows),
        };
        let size = self.eigenvalue.norm();
        let change = ROUNDINGS * f64::EPSILON * (size * size * mass + size * damping + stiffness);
        [change, mass]
    }

    /// The sign of its growth, 0 where that is zero within rounding: the one meaning of unstable, stable and marginal.
    pub(crate) fn growth_sign(&self, rounding: f64) -> f64 {
        if self.eigenvalue.re.abs() > rounding { self.eigenvalue.re.signum() } else { 0.0 }
    }

    /// Turns it into the mode of the conjugate eigenvalue.
    pub(crate) fn conjugate(&mut self) {
        self.eigenvalue = self.eigenvalue.conj();
        self.a = self.a.conj();
        self.right.iter_mut().chain(&mut self.left).for_each(|z| z.im = -z.im);
    }
}
