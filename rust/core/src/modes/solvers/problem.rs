//! A reduced eigenproblem on the way to its modes.

use num_complex::Complex64;

use crate::modes::mass_factor::MassFactor;
use crate::modes::quadratic_pencil::{Norms, Pencil};
use crate::modes::refinement::columns::Columns;

/// Condition number up to which an eigenvalue is corrected by its own Rayleigh quotient. The correction moves it
/// by about the condition number times rounding away from the value its vector belongs to, so a larger limit
/// would show in the residual; the eigenvalue itself is within its condition times rounding in any case.
pub(crate) const WELL_CONDITIONED: f64 = 300.0;

/// A value with its vectors, before it is corrected.
pub(crate) struct Solved {
    pub value: Complex64,
    pub condition: f64,
    pub right: Vec<Complex64>,
    pub left: Vec<Complex64>,
}

/// A pencil with the factor and the norms by which its modes are computed and judged.
pub(crate) struct Problem<'a> {
    pub pencil: &'a Pencil,
    pub factor: MassFactor,
    pub norms: Norms,
}

/// Vectors side by side, those of complex values with their imaginary parts.
pub(crate) fn packed<'a>(
    size: usize,
    vectors: impl Iterator<Item = (Complex64, &'a Vec<Complex64>)> + Clone,
) -> Columns {
    Columns::new(size, vectors.map(|(value, vector)| (&vector[..], value.im != 0.0)))
}

/// `left' column`
pub(crate) fn project(left: &[Complex64], column: impl Iterator<Item = Complex64>) -> Complex64 {
    left.iter().zip(column).map(|(v, z)| v * z).sum()
}
