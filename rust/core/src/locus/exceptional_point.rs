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

use num_complex::Complex64;

use crate::linalg::eigen::ComplexFactors;
use crate::locus::parameter_path::{Expansion, Path};

/// Newton steps before a start is given up; from a useful start six suffice.
const STEPS: usize = 40;

/// g and what Newton's methods need of its derivatives.
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
        expansion: &Expansion,
        lambda: Complex64,
        right: &[Complex64],
        left: &[Complex64],
    ) -> Self {
        let m = right.len();
        let [mass, damping, stiffness] = &expansion.matrices;
        let [mass_slope, damping_slope, stiffness_slope] = &expansion.slopes;
        let at = |f: &dyn Fn(usize) -> Complex64| (0..m * m).map(f).collect::<Vec<_>>();
        let p = at(&|k| lambda * (lambda * mass[k] + damping[k]) + stiffness[k]);
        let p_lambda = at(&|k| 2.0 * lambda * mass[k] + damping[k]);
        let p_parameter =
            at(&|k| lambda * (lambda * mass_slope[k] + damping_slope[k]) + stiffness_slope[k]);
        let p_both = at(&|k| 2.0 * lambda * mass_slope[k] + damping_slope[k]);
        let size = p.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let length = |v: &[Complex64]| v.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
        let (right_length, left_length) = (length(right), length(left));
        let n = m + 1;
        let mut bordered = vec![Complex64::default(); n * n];
        for i in 0..m {
            for j in 0..m {
                bordered[i * n + j] = p[i * m + j] / size;
            }
            bordered[i * n + m] = left[i].conj() / left_length;
            bordered[m * n + i] = right[i].conj() / right_length;
        }
        let factors = ComplexFactors::new(n, &bordered);
        let solve = |load: &dyn Fn(usize) -> Complex64, last: f64| {
            let mut rhs: Vec<Complex64> = (0..m).map(|i| load(i) / size).collect();
            rhs.push(last.into());
            factors.solve(&rhs)
        };
        let row = |matrix: &[Complex64], i: usize, x: &[Complex64]| -> Complex64 {
            matrix[i * m..(i + 1) * m].iter().zip(x).map(|(a, z)| a * z).sum()
        };
        let x = solve(&|_| Complex64::default(), 1.0);
        let x_lambda = solve(&|i| -row(&p_lambda, i, &x), 0.0);
        let x_parameter = solve(&|i| -row(&p_parameter, i, &x), 0.0);
        let x_twice = solve(&|i| -2.0 * (row(&p_lambda, i, &x_lambda) + row(mass, i, &x)), 0.0);
        let x_both = solve(
            &|i| {
                -row(&p_both, i, &x)
                    - row(&p_lambda, i, &x_parameter)
                    - row(&p_parameter, i, &x_lambda)
            },
            0.0,
        );
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
