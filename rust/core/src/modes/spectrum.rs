//! The quadratic eigenproblem of one status combination: `(lambda^2 M + lambda C + K) xi = 0`.
//!
//! With `C = alpha M + beta K` the m by m problem `K xi = kappa M xi` gives all 2m modes through
//! `lambda^2 + (alpha + beta kappa) lambda + kappa = 0`; otherwise the linearisation of
//! `y = (gamma x, x')` with `gamma^2 = |M^-1 K|` is solved (scaling of Fan, Lin and Van Dooren 2004).
//! Every eigenvalue is then corrected by one generalized Rayleigh quotient
//! `v' P(lambda) xi / v' P'(lambda) xi`, whose error is of second order in the errors of the vectors,
//! with the residual `P(lambda) xi` of the *unreduced* matrices in doubled precision.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::error::Error;
use crate::linalg::eigen;
use crate::linalg::eigenpair::{EigenPair, norm};
use crate::linalg::parallel::each;
use crate::modes::mass_factor::MassFactor;
use crate::modes::mode::{BACKWARD_STABLE, Mode, SETTLED};
use crate::modes::quadratic_pencil::{Damping, DoubledRows, Norms, Pencil, Products};
use crate::modes::refinement::columns::Columns;
use crate::modes::refinement::inverse_iteration::InverseIteration;
use crate::modes::refinement::slow_modes;
use crate::modes::refinement::vectors::Eigenvectors;
use crate::numerics::double_double::DoubledComplex;

/// Relative residual of the quadratic problem above which an eigenvalue counts as not converged.
/// A backward-stable solver leaves some 1e-15; the margin only has to tell noise from failure.
const CONVERGED: f64 = 1e-10;

/// Condition number up to which an eigenvalue is corrected by its own Rayleigh quotient. The correction moves it
/// by about the condition number times rounding away from the value its vector belongs to, so a larger limit
/// would show in the residual; the eigenvalue itself is within its condition times rounding in any case.
pub(crate) const WELL_CONDITIONED: f64 = 300.0;
/// Free coordinates up to which vectors are refined: beyond, that would cost more than the solution.
pub(crate) const REFINED_SIZE: usize = 60;

/// Rounds of refinement with general damping: the slow modes of a scene with a fast dashpot keep few digits.
const GENERAL_ROUNDS: usize = 2;

/// Rounds of refinement; each squares the error, so three take one digit to rounding.
const ROUNDS: usize = 3;

/// Relative correction from which the vectors may be wrong altogether, and refinement of no use.
const LOST: f64 = 1e-7;
/// An eigenvalue this small beside the largest one is zero, a rigid-body mode: doubled precision tells no more.
const ZERO: f64 = 1e-28;
/// Free coordinates up to which the stiffness is inverted in doubled precision, some seconds there.
const INVERTED_SIZE: usize = 400;

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
    let modes = match &pencil.damping {
        &Damping::Proportional { alpha, beta } => {
            each(m, problem.half_modes(&stiffness, vectors, [alpha, beta]), |half| {
                problem.proportional_modes(half, alpha, beta).collect::<Vec<_>>()
            })
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
        }
        Damping::General(damping) => problem.general_modes(damping, &stiffness, vectors),
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

/// A value with its vectors, before it is corrected.
struct Solved {
    value: Complex64,
    condition: f64,
    right: Vec<Complex64>,
    left: Vec<Complex64>,
}

/// An eigenpair of `K x = kappa M x`.
struct HalfMode {
    kappa: Complex64,
    condition: f64,
    /// Last correction of kappa.
    correction: f64,
    /// `left' M right`
    modal_mass: Complex64,
    right: Vec<Complex64>,
    left: Vec<Complex64>,
    /// M and K times the right vector.
    mass: Vec<DoubledComplex>,
    stiffness: Vec<DoubledComplex>,
}

/// A mode with the rows of `P(lambda) xi`.
type GeneralMode = (Mode, Vec<Complex64>);

struct Problem<'a> {
    pencil: &'a Pencil,
    factor: MassFactor,
    norms: Norms,
}

impl Problem<'_> {
    /// Eigenpairs of `K x = kappa M x` from those of the mass-normalised matrix, with corrected values.
    fn half_modes(
        &self,
        stiffness: &DMatrix<f64>,
        vectors: Vectors,
        damping: [f64; 2],
    ) -> Vec<HalfMode> {
        let m = self.pencil.size;
        let corrected = |pairs: Vec<EigenPair>| -> Vec<HalfMode> {
            let solved = |pair: EigenPair| Solved {
                condition: pair.condition(),
                value: pair.value,
                right: self.factor.right(pair.right),
                left: self.factor.left(pair.left),
            };
            self.corrected(each(m, pairs, solved))
        };
        let mut halves = corrected(eigen::real_matrix(stiffness));
        let largest =
            |halves: &[HalfMode]| halves.iter().map(|half| half.kappa.norm()).fold(0.0, f64::max);
        let open = |halves: &[HalfMode], limit: f64| {
            let zero = ZERO * largest(halves);
            halves.iter().any(|half| half.correction > limit * half.kappa.norm().max(zero))
        };
        if open(&halves, LOST)
            && m <= INVERTED_SIZE
            && let Some(inverse) = slow_modes::inverse(self.pencil.stiffness.to_doubled())
        {
            let inverted = eigen::real_matrix(&self.factor.inverted(&inverse));
            halves = corrected(slow_modes::joined(eigen::real_matrix(stiffness), inverted));
        }
        let wanted = vectors == Vectors::Refined && m <= REFINED_SIZE;
        for round in 0..ROUNDS {
            // One round for all modes costs as much as inverse iteration for a few.
            let unstable = |half: &HalfMode| self.half_residual(half, damping) > BACKWARD_STABLE;
            let first = round == 0 && (wanted || halves.iter().any(unstable));
            if !(first || open(&halves, SETTLED)) {
                break;
            }
            halves = self.refined(halves);
        }
        halves
    }

    /// The relative residual of the modes of an eigenpair, the larger one of both:
    /// `P(lambda) = (1 + beta lambda) (K - kappa M)`.
    fn half_residual(&self, half: &HalfMode, [alpha, beta]: [f64; 2]) -> f64 {
        let products = half.mass.iter().zip(&half.stiffness);
        let rows = products.map(|(m, k)| k.less(m, half.kappa).norm_sqr()).sum::<f64>().sqrt();
        let (larger, smaller) = roots_of_mode(half.kappa, alpha + beta * half.kappa);
        let of_root = |lambda: Complex64| {
            let length = (1.0 + beta * lambda) * rows;
            self.norms.relative_residual(lambda, &half.right, std::iter::once(length))
        };
        of_root(larger).max(of_root(smaller))
    }

    /// Values with their vectors, corrected by their Rayleigh quotients `y' K x / y' M x`.
    fn corrected(&self, solved: Vec<Solved>) -> Vec<HalfMode> {
        let m = self.pencil.size;
        let columns = packed(m, solved.iter().map(|half| (half.value, &half.right)));
        let mass = self.pencil.mass.products(&columns);
        let stiffness = self.pencil.stiffness.products(&columns);
        let whole = solved.into_iter().zip(mass).zip(stiffness).collect();
        each(m, whole, |((solved, mass), stiffness)| {
            let Solved { value: mut kappa, condition, right, left } = solved;
            let modal_mass = project(&left, mass.iter().map(|row| row.value()));
            let mut correction = 0.0;
            if condition <= WELL_CONDITIONED {
                let residual = mass.iter().zip(&stiffness).map(|(m, k)| k.less(m, kappa));
                let step = project(&left, residual) / modal_mass;
                kappa += if kappa.im == 0.0 { step.re.into() } else { step };
                correction = step.norm();
            }
            HalfMode { kappa, condition, correction, modal_mass, right, left, mass, stiffness }
        })
    }

    /// All vectors after one step of refinement, and values corrected by them.
    fn refined(&self, mut halves: Vec<HalfMode>) -> Vec<HalfMode> {
        let m = self.pencil.size;
        let residual = |kappa: Complex64, mass: &[DoubledComplex], stiffness: &[DoubledComplex]| {
            mass.iter().zip(stiffness).map(|(m, k)| k.less(m, kappa)).collect::<Vec<_>>()
        };
        let right: Vec<_> =
            halves.iter().map(|half| residual(half.kappa, &half.mass, &half.stiffness)).collect();
        let columns = packed(m, halves.iter().map(|half| (half.kappa, &half.left)));
        let mass = self.pencil.mass.transposed().products(&columns);
        let stiffness = self.pencil.stiffness.transposed().products(&columns);
        let left: Vec<_> = halves
            .iter()
            .zip(mass.iter().zip(&stiffness))
            .map(|(half, (mass, stiffness))| residual(half.kappa, mass, stiffness))
            .collect();
        let scales: Vec<Complex64> = halves.iter().map(|half| half.modal_mass).collect();
        let values: Vec<Complex64> = halves.iter().map(|half| half.kappa).collect();
        let vectors: (Vec<_>, Vec<_>) = halves
            .iter_mut()
            .map(|half| (std::mem::take(&mut half.right), std::mem::take(&mut half.left)))
            .unzip();
        let before =
            Eigenvectors { values: &values, scales: &scales, right: &vectors.0, left: &vectors.1 };
        let refined_right = before.refined_right(&right, -1.0);
        let refined_left = before.refined_left(&left, -1.0);
        let solved = vectors.0.into_iter().zip(vectors.1);
        let refined = refined_right.into_iter().zip(refined_left);
        let each = halves.into_iter().zip(solved).zip(refined);
        let chosen = each.map(|((half, solved), refined)| {
            // A value that is not corrected belongs to its vectors as they were solved.
            let well = half.condition <= WELL_CONDITIONED;
            let (right, left) = if well { refined } else { solved };
            Solved { value: half.kappa, condition: half.condition, right, left }
        });
        self.corrected(chosen.collect())
    }

    /// The modes of both roots lambda; of real kappa below critical damping only the one that is not a conjugate.
    fn proportional_modes(
        &self,
        half: HalfMode,
        alpha: f64,
        beta: f64,
    ) -> impl Iterator<Item = Mode> + use<> {
        let (larger, smaller) = roots_of_mode(half.kappa, alpha + beta * half.kappa);
        // Moduli of a conjugate pair are those of one mode.
        let is_pair = half.kappa.im == 0.0 && larger.im != 0.0;
        let HalfMode { condition, modal_mass, right, left, mass, stiffness, .. } = half;
        let mode = |lambda: Complex64, other: Complex64, right: Vec<_>, left: Vec<_>| {
            // State-space condition of the two-by-two block, right vector (omega, lambda), left (-other, omega), in
            // the scale omega^2 = |lambda other| in which it is smallest: an overdamped mode is well conditioned.
            let splitting = (lambda.norm() + other.norm()) / (lambda - other).norm();
            // The products are exact to rounding; what cancels between them now is the residual itself.
            let (by_mass, by_stiffness) = (lambda * (lambda + alpha), 1.0 + beta * lambda);
            let rows = mass.iter().zip(&stiffness);
            let rows = rows.map(|(m, k)| by_mass * m.value() + by_stiffness * k.value());
            let mut mode = Mode {
                eigenvalue: lambda,
                a: (lambda - other) * modal_mass,
                condition: condition * if splitting.is_nan() { f64::INFINITY } else { splitting },
                residual: self.norms.relative_residual(lambda, &right, rows),
                right,
                left,
            };
            if lambda.im < 0.0 {
                mode.conjugate();
            }
            mode
        };
        let second = (!is_pair).then(|| mode(smaller, larger, right.clone(), left.clone()));
        std::iter::once(mode(larger, smaller, right, left)).chain(second)
    }

    fn general_modes(
        &self,
        damping_rows: &DoubledRows,
        stiffness: &DMatrix<f64>,
        vectors: Vectors,
    ) -> Vec<Mode> {
        let m = self.pencil.size;
        let damping = self.factor.normalised(&damping_rows.to_dense());
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
                right: self.factor.right(shape.to_vec()),
                left: self.factor.left(pair.left[m..].to_vec()),
            }
        };
        let pairs = eigen::real_matrix(&state_matrix(stiffness, &damping));
        let solved = self.general_corrected(each(m, pairs, solved), damping_rows);
        let rounds = match vectors {
            Vectors::Refined if m <= REFINED_SIZE => GENERAL_ROUNDS,
            _ => usize::from(solved.iter().any(|(mode, _)| mode.residual > BACKWARD_STABLE)),
        };
        (0..rounds)
            .fold(solved, |modes, _| self.general_refined(modes, damping_rows))
            .into_iter()
            .map(|(mode, _)| mode)
            .collect()
    }

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

/// Vectors side by side, those of complex values with their imaginary parts.
fn packed<'a>(
    size: usize,
    vectors: impl Iterator<Item = (Complex64, &'a Vec<Complex64>)> + Clone,
) -> Columns {
    Columns::new(size, vectors.map(|(value, vector)| (&vector[..], value.im != 0.0)))
}

/// `left' column`
fn project(left: &[Complex64], column: impl Iterator<Item = Complex64>) -> Complex64 {
    left.iter().zip(column).map(|(v, z)| v * z).sum()
}

/// The two roots of `lambda^2 + d lambda + kappa = 0`, the larger one first; of a conjugate pair the one with positive
/// imaginary part.
pub(crate) fn roots_of_mode(kappa: Complex64, d: Complex64) -> (Complex64, Complex64) {
    let half = 0.5 * d;
    if kappa.im == 0.0 && d.im == 0.0 {
        let discriminant = half.re * half.re - kappa.re;
        if discriminant < 0.0 {
            let lambda = Complex64::new(0.0 - half.re, (-discriminant).sqrt());
            return (lambda, lambda.conj());
        }
    }
    let root = (half * half - kappa).sqrt();
    // The sum without cancellation first, the other root from their product.
    let root = if (half.conj() * root).re >= 0.0 { root } else { -root };
    let larger = -(half + root);
    let zero = Complex64::default();
    let smaller = if larger == zero { larger } else { kappa / larger };
    // No zero keeps a minus.
    (larger + zero, smaller + zero)
}
