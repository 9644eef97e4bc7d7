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
use crate::modes::solvers::problem::{Solved, WELL_CONDITIONED};

/// Corrections larger than this, relative to the vector, are no refinement: the pair is nearly defective.
const LARGEST: f64 = 1e-4;

/// What the refinement of a mode needs beside its value and its vectors.
pub(crate) struct Residuals {
    /// `y' P'(value) x`
    pub scale: Complex64,
    /// `P(value) x`
    pub right: Vec<Complex64>,
    /// `y' P(value)`
    pub left: Vec<Complex64>,
}

/// Modes, one of each conjugate pair, with the residuals taken out of both their vectors; a value too ill-conditioned to be
/// corrected belongs to its vectors as they were solved, and keeps them. `direction` is the sign of the derivative of P by the
/// value in front of the mass: -1 for `K - value M`, +1 for `P(value) = value^2 M + ..`.
pub(crate) fn refined(
    mut modes: Vec<Solved>,
    residuals: &[Residuals],
    direction: f64,
) -> Vec<Solved> {
    let right =
        refined_side(&modes, residuals, direction, [|mode| &mode.right, |mode| &mode.left], |r| {
            &r.right
        });
    let left =
        refined_side(&modes, residuals, direction, [|mode| &mode.left, |mode| &mode.right], |r| {
            &r.left
        });
    for (mode, vectors) in modes.iter_mut().zip(right.into_iter().zip(left)) {
        if mode.condition <= WELL_CONDITIONED {
            (mode.right, mode.left) = vectors;
        }
    }
    modes
}

type Vector<T> = fn(&T) -> &Vec<Complex64>;

/// Refined vectors of one side, from those of the other side and the residuals of this one.
fn refined_side(
    modes: &[Solved],
    residuals: &[Residuals],
    direction: f64,
    [own, dual]: [Vector<Solved>; 2],
    residual: Vector<Residuals>,
) -> Vec<Vec<Complex64>> {
    let count = modes.len();
    let is_pair = |i: usize| modes[i].value.im != 0.0;
    let rows = modes.first().map_or(0, |mode| own(mode).len());
    let packed = |side: Vector<Solved>| {
        Columns::new(rows, modes.iter().map(|mode| (&side(mode)[..], mode.value.im != 0.0)))
    };
    let taken = residuals.iter().enumerate().map(|(j, one)| (&residual(one)[..], is_pair(j)));
    let components = packed(dual).products(&Columns::new(rows, taken));
    let sizes: Vec<f64> = modes.iter().map(|mode| norm(own(mode))).collect();
    let mut columns = packed(own);
    let mut factors = Factors::zeros(&columns);
    for j in 0..count {
        for i in 0..count {
            for conjugate in [false, true] {
                if i == j && !conjugate || conjugate && !is_pair(i) {
                    continue;
                }
                let distance = (turned(modes[i].value, conjugate) - modes[j].value)
                    * turned(residuals[i].scale, conjugate);
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
