//! Modes with general damping, by the linearisation of `y = (gamma x, x')` with `gamma^2 = |M^-1 K|` (scaling of Fan, Lin
//! and Van Dooren 2004).

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::linalg::eigen;
use crate::linalg::eigenpair::{EigenPair, norm};
use crate::linalg::parallel::each;
use crate::modes::mode::{BACKWARD_STABLE, Mode};
use crate::modes::quadratic_pencil::{DoubledRows, Pencil, Products};
use crate::modes::refinement::vectors::Eigenvectors;
use crate::modes::solvers::problem::{Problem, Solved, WELL_CONDITIONED, packed};

/// Rounds of refinement with general damping: the slow modes of a scene with a fast dashpot keep few digits.
const GENERAL_ROUNDS: usize = 2;

/// A mode with the rows of `P(lambda) xi`.
type GeneralMode = (Mode, Vec<Complex64>);

/// All modes, from the rows of C and the mass-normalised stiffness.
pub(crate) fn general_modes(
    problem: &Problem<'_>,
    damping_rows: &DoubledRows,
    stiffness: &DMatrix<f64>,
    is_refined: bool,
) -> Vec<Mode> {
    let m = problem.pencil.size;
    let damping = problem.factor.normalised(&damping_rows.to_dense());
    let solved = |pair: EigenPair| {
        let (upper, lower) = pair.right.split_at(m);
        // Both blocks hold the shape; the larger one holds more of its digits.
        let shape = if norm(upper) >= norm(lower) { upper } else { lower };
        let condition = match pair.scaled_condition() {
            condition if condition.is_nan() => f64::INFINITY,
            condition => condition,
        };
        Solved {
            value: pair.value,
            condition,
            right: problem.factor.right(shape.to_vec()),
            left: problem.factor.left(pair.left[m..].to_vec()),
        }
    };
    let pairs = eigen::real_matrix(&state_matrix(stiffness, &damping));
    let solved = problem.general_corrected(each(m, pairs, solved), damping_rows);
    let rounds = match is_refined {
        true => GENERAL_ROUNDS,
        false => usize::from(solved.iter().any(|(mode, _)| mode.residual > BACKWARD_STABLE)),
    };
    (0..rounds)
        .fold(solved, |modes, _| problem.general_refined(modes, damping_rows))
        .into_iter()
        .map(|(mode, _)| mode)
        .collect()
}

impl Problem<'_> {
    /// All modes after one step of refinement of their vectors.
    fn general_refined(&self, modes: Vec<GeneralMode>, damping: &DoubledRows) -> Vec<GeneralMode> {
        let Pencil { mass, stiffness, size, .. } = self.pencil;
        let columns = packed(*size, modes.iter().map(|(mode, _)| (mode.eigenvalue, &mode.left)));
        let [mass, damping_products, stiffness] =
            [mass, damping, stiffness].map(|matrix| matrix.transposed().products(&columns));
        let products = mass.into_iter().zip(damping_products).zip(stiffness);
        let left_residuals: Vec<Vec<Complex64>> = modes
            .iter()
            .zip(products)
            .map(|((mode, _), ((mass, damping), stiffness))| {
                Products { mass, damping, stiffness }.rows(mode.eigenvalue)
            })
            .collect();
        let part = |f: &dyn Fn(&Mode) -> Complex64| -> Vec<Complex64> {
            modes.iter().map(|(mode, _)| f(mode)).collect()
        };
        let (values, scales) = (part(&|mode| mode.eigenvalue), part(&|mode| mode.a));
        let (modes, right_residuals): (Vec<Mode>, Vec<_>) = modes.into_iter().unzip();
        let right: Vec<_> = modes.iter().map(|mode| mode.right.clone()).collect();
        let left: Vec<_> = modes.iter().map(|mode| mode.left.clone()).collect();
        let before = Eigenvectors { values: &values, scales: &scales, right: &right, left: &left };
        let refined = before
            .refined_right(&right_residuals, 1.0)
            .into_iter()
            .zip(before.refined_left(&left_residuals, 1.0));
        let chosen = modes.into_iter().zip(refined).map(|(mode, refined)| {
            // A value that is not corrected belongs to its vectors as they were solved.
            let well = mode.condition <= WELL_CONDITIONED;
            let (right, left) = if well { refined } else { (mode.right, mode.left) };
            Solved { value: mode.eigenvalue, condition: mode.condition, right, left }
        });
        self.general_corrected(chosen.collect(), damping)
    }

    /// Modes of these vectors, their eigenvalues corrected by Rayleigh quotients.
    fn general_corrected(&self, solved: Vec<Solved>, damping: &DoubledRows) -> Vec<GeneralMode> {
        let m = self.pencil.size;
        let columns = packed(m, solved.iter().map(|mode| (mode.value, &mode.right)));
        let [mass, damping, stiffness] = [&self.pencil.mass, damping, &self.pencil.stiffness]
            .map(|matrix| matrix.products(&columns));
        let whole = solved.into_iter().zip(mass).zip(damping).zip(stiffness).collect();
        each(m, whole, |(((solved, mass), damping), stiffness)| {
            let Solved { value: mut eigenvalue, mut condition, right, left } = solved;
            let products = Products { mass, damping, stiffness };
            // A rigid body: in the scaling in which its condition is smallest, two equal zeros seem to be simple.
            let terms = products.mass.iter().zip(&products.damping).zip(&left);
            let scale: f64 = terms
                .map(|((m, c), v)| {
                    v.norm() * (2.0 * eigenvalue.norm() * m.value().norm() + c.value().norm())
                })
                .sum();
            if products.slope(eigenvalue, &left).norm() <= f64::EPSILON * scale {
                condition = f64::INFINITY;
            }
            if condition <= WELL_CONDITIONED {
                eigenvalue = products.corrected(eigenvalue, &left);
            }
            let rows = products.rows(eigenvalue);
            let mode = Mode {
                eigenvalue,
                a: products.slope(eigenvalue, &left),
                condition,
                residual: self.norms.relative_residual(eigenvalue, &right, rows.iter().copied()),
                right,
                left,
            };
            (mode, rows)
        })
    }
}

/// The linearisation of `y = (gamma x, x')`, of mass-normalised stiffness and damping.
pub(crate) fn state_matrix(stiffness: &DMatrix<f64>, damping: &DMatrix<f64>) -> DMatrix<f64> {
    let m = stiffness.nrows();
    let row_sum =
        |matrix: &DMatrix<f64>| matrix.row_iter().map(|row| row.lp_norm(1)).fold(0.0, f64::max);
    // Bodies that nothing holds or damps have no scale, and any will do.
    let gamma = match row_sum(stiffness).sqrt().max(row_sum(damping)) {
        0.0 => 1.0,
        gamma => gamma,
    };
    // gamma enters as a power of two, so the scaling itself is exact.
    let gamma = gamma.log2().round().exp2();
    let mut state = DMatrix::zeros(2 * m, 2 * m);
    state.view_mut((0, m), (m, m)).fill_diagonal(gamma);
    state.view_mut((m, 0), (m, m)).copy_from(&(stiffness / -gamma));
    state.view_mut((m, m), (m, m)).copy_from(&-damping);
    state
}
