//! Modes with general damping, by the linearisation with states `y = (gamma x, x')` with `gamma^2 = |M^-1 K|` (scaling of
//! Fan, Lin and Van Dooren 2004).

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::eigen;
use crate::linalg::eigenpair::{EigenPair, norm};
use crate::linalg::parallel::each;
use crate::modes::mass_factor::MassFactor;
use crate::modes::mode::{BACKWARD_STABLE, Mode};
use crate::modes::quadratic_pencil::{DoubledRows, Pencil, Products};
use crate::modes::refinement::vectors::{Residuals, refined};
use crate::modes::solvers::problem::{Problem, Solved, WELL_CONDITIONED, packed};

/// Rounds of refinement with general damping: the slow modes of a scene with a fast dashpot keep few digits.
const GENERAL_ROUNDS: usize = 2;

/// A mode with the rows of `P(lambda) xi`.
type GeneralMode = (Mode, Vec<Complex64>);

/// The standard eigenproblem of a quadratic one: its matrix, over the states `(gamma x_r, x')` of which those of the
/// coordinates s of first order hold x_s in place of x_s'.
pub(crate) struct StateForm {
    pub matrix: DMatrix<f64>,
    gamma: f64,
    /// r, the coordinates with mass.
    second: Vec<usize>,
}

impl StateForm {
    /// Of a pencil with these rows of C, with the factor of its leading matrix.
    pub fn of(pencil: &Pencil, damping: &DoubledRows) -> Result<(MassFactor, Self), Error> {
        let ([mass, damping, stiffness], first) = pencil.raised(damping);
        let factor = MassFactor::new(mass, &pencil.combination)?;
        let (damping, stiffness) = (factor.normalised(&damping), factor.normalised(&stiffness));
        let gamma = scale(&stiffness, &damping);
        let m = pencil.size;
        let second: Vec<usize> = (0..m).filter(|k| first.binary_search(k).is_err()).collect();
        let count = second.len();
        let mut matrix = DMatrix::zeros(count + m, count + m);
        for (place, &k) in second.iter().enumerate() {
            matrix[(place, count + k)] = gamma;
            matrix.view_mut((count, place), (m, 1)).copy_from(&(stiffness.column(k) / -gamma));
        }
        matrix.view_mut((count, count), (m, m)).copy_from(&-damping);
        Ok((factor, Self { matrix, gamma, second }))
    }

    /// The block of an entry of a state: x_r, x_r' or x_s.
    fn block(&self, entry: usize) -> usize {
        match entry.checked_sub(self.second.len()) {
            None => 0,
            Some(k) if self.second.binary_search(&k).is_ok() => 1,
            Some(_) => 2,
        }
    }

    /// The shape of a right vector. Places and velocities both hold that of x_r; the larger ones hold more of its digits.
    fn shape(&self, value: Complex64, state: &[Complex64]) -> Vec<Complex64> {
        let (places, rates) = state.split_at(self.second.len());
        let velocities: Vec<Complex64> = self.second.iter().map(|&k| rates[k]).collect();
        let by_places = norm(places) >= norm(&velocities);
        let unit = if by_places { self.gamma.into() } else { value };
        let mut shape: Vec<Complex64> = rates.iter().map(|x| unit * x).collect();
        let of_second = if by_places { places } else { &velocities };
        self.second.iter().zip(of_second).for_each(|(&k, &x)| shape[k] = x);
        shape
    }
}

/// gamma as a power of two, so that the scaling itself is exact.
fn scale(stiffness: &DMatrix<f64>, damping: &DMatrix<f64>) -> f64 {
    let row_sum =
        |matrix: &DMatrix<f64>| matrix.row_iter().map(|row| row.lp_norm(1)).fold(0.0, f64::max);
    // Bodies that nothing holds or damps have no scale, and any will do.
    match row_sum(stiffness).sqrt().max(row_sum(damping)) {
        0.0 => 1.0,
        gamma => gamma.log2().round().exp2(),
    }
}

/// All modes, from the rows of C and the standard eigenproblem.
pub(crate) fn general_modes(
    problem: &Problem<'_>,
    damping_rows: &DoubledRows,
    form: &StateForm,
    is_refined: bool,
) -> Vec<Mode> {
    let m = problem.pencil.size;
    let solved = |pair: EigenPair| {
        let condition = match pair.scaled_condition(|entry| form.block(entry)) {
            condition if condition.is_nan() => f64::INFINITY,
            condition => condition,
        };
        Solved {
            value: pair.value,
            condition,
            right: problem.factor.right(form.shape(pair.value, &pair.right)),
            left: problem.factor.left(pair.left[form.second.len()..].to_vec()),
        }
    };
    let pairs = eigen::real_matrix(&form.matrix);
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
        let products =
            products.map(|((mass, damping), stiffness)| Products { mass, damping, stiffness });
        let left: Vec<Vec<Complex64>> = modes
            .iter()
            .zip(products)
            .map(|((mode, _), products)| products.rows(mode.eigenvalue))
            .collect();
        let (solved, residuals): (Vec<Solved>, Vec<Residuals>) = modes
            .into_iter()
            .zip(left)
            .map(|((mode, rows), left)| {
                let Mode { eigenvalue: value, condition, right, left: own, a: scale, .. } = mode;
                let solved = Solved { value, condition, right, left: own };
                (solved, Residuals { scale, right: rows, left })
            })
            .unzip();
        self.general_corrected(refined(solved, &residuals, 1.0), damping)
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
