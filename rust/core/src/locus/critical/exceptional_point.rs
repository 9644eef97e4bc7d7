//! Exceptional points: parameter values, complex in general, at which two eigenvalues and their vectors coalesce.
//!
//! The implicit determinant method (Spence and Poulton 2005; Freitag and Spence 2011): with fixed borders b, c
//!
//! ```text
//! [ P(lambda, p)  b ] [ x ]   [ 0 ]
//! [ c'            0 ] [ g ] = [ 1 ]
//! ```
//!
//! defines an analytic g(lambda, p) that vanishes exactly where P is singular, and with `dg/d lambda = 0` where the
//! eigenvalue is double. The bordered matrix is regular there if the double eigenvalue has one vector, so Newton's
//! method for `(g, dg/d lambda) = 0` converges quadratically where eigenvalues themselves lose half their digits.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::linalg::dense::Factors;
use crate::locus::parameter_path::{Expansion, Path};

/// Newton steps before a start is given up; from a useful start six suffice.
const STEPS: usize = 40;

/// g and the derivatives of it that Newton's methods need.
#[derive(Debug)]
pub(crate) struct ImplicitDeterminant {
    pub g: Complex64,
    pub by_lambda: Complex64,
    pub by_parameter: Complex64,
    pub by_lambda_twice: Complex64,
    pub by_both: Complex64,
}

impl ImplicitDeterminant {
    /// `right` and `left` near the null vectors, `v' P ~ 0`.
    pub fn new(
        expansion: &Expansion<Complex64>,
        lambda: Complex64,
        right: &[Complex64],
        left: &[Complex64],
    ) -> Self {
        let m = right.len();
        let [mass, damping, stiffness] = &expansion.matrices;
        let [mass_slope, damping_slope, stiffness_slope] = &expansion.slopes;
        let p = (mass * lambda + damping) * lambda + stiffness;
        let p_lambda = mass * (2.0 * lambda) + damping;
        let p_parameter = (mass_slope * lambda + damping_slope) * lambda + stiffness_slope;
        let p_both = mass_slope * (2.0 * lambda) + damping_slope;
        let size = Complex64::from(p.norm().max(f64::MIN_POSITIVE));
        let border = |v: &[Complex64]| DVector::from_column_slice(v).conjugate().normalize();
        let mut bordered = (p / size).resize(m + 1, m + 1, Complex64::default());
        bordered.view_mut((0, m), (m, 1)).copy_from(&border(left));
        bordered.view_mut((m, 0), (1, m)).copy_from(&border(right).transpose());
        let factors = Factors::new(bordered);
        let solve =
            |load: DVector<Complex64>, last: f64| factors.solve((load / size).push(last.into()));
        let own = |solution: &DVector<Complex64>| solution.rows(0, m).into_owned();
        let x = solve(DVector::zeros(m), 1.0);
        let vector = own(&x);
        let x_lambda = solve(-(&p_lambda * &vector), 0.0);
        let x_parameter = solve(-(&p_parameter * &vector), 0.0);
        let (by_lambda, by_parameter) = (own(&x_lambda), own(&x_parameter));
        let x_twice = solve((&p_lambda * &by_lambda + mass * &vector) * Complex64::from(-2.0), 0.0);
        let x_both =
            solve(-(p_both * vector + p_lambda * by_parameter + p_parameter * by_lambda), 0.0);
        Self {
            g: x[m],
            by_lambda: x_lambda[m],
            by_parameter: x_parameter[m],
            by_lambda_twice: x_twice[m],
            by_both: x_both[m],
        }
    }
}

/// A double eigenvalue with one vector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExceptionalPoint {
    pub parameter: Complex64,
    pub eigenvalue: Complex64,
}

/// The exceptional point near a start, if Newton's method reaches one within `reach` of it.
pub(crate) fn exceptional_point(
    path: &Path,
    start: ExceptionalPoint,
    right: &[Complex64],
    left: &[Complex64],
    reach: f64,
) -> Option<ExceptionalPoint> {
    let ExceptionalPoint { mut parameter, mut eigenvalue } = start;
    let (lower, upper) = path.range();
    let scale = parameter.norm().max(upper - lower);
    let mut converged = false;
    for _ in 0..STEPS {
        let d = ImplicitDeterminant::new(&path.expansion(parameter), eigenvalue, right, left);
        let determinant = d.by_lambda * d.by_both - d.by_parameter * d.by_lambda_twice;
        let step_lambda = (d.by_both * d.g - d.by_parameter * d.by_lambda) / determinant;
        let step_parameter = (d.by_lambda * d.by_lambda - d.by_lambda_twice * d.g) / determinant;
        eigenvalue -= step_lambda;
        parameter -= step_parameter;
        // Not so for NaN, which a semisimple double eigenvalue ends in.
        if !((parameter - start.parameter).norm() <= reach) {
            return None;
        }
        // The step after this size is of the order of its square.
        if converged {
            return Some(ExceptionalPoint { parameter, eigenvalue });
        }
        converged = step_parameter.norm() <= 1e-9 * scale
            && step_lambda.norm() <= 1e-6 * eigenvalue.norm().max(f64::MIN_POSITIVE);
    }
    None
}
