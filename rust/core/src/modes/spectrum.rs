//! The quadratic eigenproblem of one status combination: `(lambda^2 M + lambda C + K) xi = 0`.
//!
//! With `C = alpha M + beta K` the m by m problem `K xi = kappa M xi` gives all 2m modes, otherwise a linearisation of
//! twice the size. Every eigenvalue is then corrected by one generalized Rayleigh quotient
//! `v' P(lambda) xi / v' P'(lambda) xi`, whose error is of second order in the errors of the vectors,
//! with the residual `P(lambda) xi` of the *unreduced* matrices in doubled precision.

use crate::error::Error;
use crate::linalg::parallel::each;
use crate::modes::general::general_modes;
use crate::modes::mass_factor::MassFactor;
use crate::modes::mode::{BACKWARD_STABLE, Mode};
use crate::modes::problem::Problem;
use crate::modes::proportional::proportional_modes;
use crate::modes::quadratic_pencil::{Pencil, PencilDamping};
use crate::modes::refinement::inverse_iteration::InverseIteration;

/// Relative residual of the quadratic problem above which an eigenvalue counts as not converged.
/// A backward-stable solver leaves some 1e-15; the margin only has to tell noise from failure.
const CONVERGED: f64 = 1e-10;

/// Free coordinates up to which vectors are refined: beyond, that would cost more than the solution.
pub(crate) const REFINED_SIZE: usize = 60;

/// How far vectors are taken; eigenvalues are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Vectors {
    /// Backward stable, as the solver leaves them.
    Solved,
    /// With one more step that leaves rounding, at several times the cost; for a transient, whose event times are
    /// only as good as they are.
    Refined,
}

/// All modes of a reduced problem, in no particular order.
pub(crate) fn spectrum(pencil: &Pencil, vectors: Vectors) -> Result<Vec<Mode>, Error> {
    let m = pencil.size;
    let factor = MassFactor::new(pencil)?;
    let stiffness = factor.normalised(&pencil.stiffness.to_dense());
    let problem = Problem { pencil, factor, norms: pencil.norms() };
    let is_refined = vectors == Vectors::Refined && m <= REFINED_SIZE;
    let modes = match &pencil.damping {
        &PencilDamping::Proportional { alpha, beta } => {
            proportional_modes(&problem, &stiffness, is_refined, [alpha, beta])
        }
        PencilDamping::General(damping) => general_modes(&problem, damping, &stiffness, is_refined),
    };
    let modes = match modes.iter().any(|mode| mode.residual > BACKWARD_STABLE) {
        true => {
            let iteration = InverseIteration::new(pencil);
            let improve = |mode: Mode| match mode.residual > BACKWARD_STABLE {
                true => iteration.improved(mode),
                false => mode,
            };
            each(m, modes, improve)
        }
        false => modes,
    };
    // A comparison that also fails for NaN.
    match modes.iter().find(|mode| !(mode.residual <= CONVERGED)) {
        Some(mode) => Err(Error::Eigenvalues {
            combination: pencil.combination.to_string(),
            residual: mode.residual,
        }),
        None => Ok(modes),
    }
}
