//! Modes with proportional damping `C = alpha M + beta K`: those of `K xi = kappa M xi`, and
//! `lambda^2 + (alpha + beta kappa) lambda + kappa = 0`.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::linalg::eigen;
use crate::linalg::eigenpair::EigenPair;
use crate::linalg::parallel::each;
use crate::modes::mode::{BACKWARD_STABLE, Mode, SETTLED};
use crate::modes::refinement::slow_modes;
use crate::modes::refinement::vectors::{Residuals, refined};
use crate::modes::solvers::problem::{Problem, Solved, WELL_CONDITIONED, packed, project};
use crate::numerics::double_double::DoubledComplex;

/// Rounds of refinement; each squares the error, so three take one digit to rounding.
const ROUNDS: usize = 3;

/// From this relative correction on the vectors may be entirely wrong, so that refinement does not help.
const LOST: f64 = 1e-7;
/// An eigenvalue this small beside the largest one is zero, a rigid-body mode: doubled precision tells no more.
const ZERO: f64 = 1e-28;
/// Number of free coordinates up to which the stiffness is inverted in doubled precision, which then takes some seconds.
const INVERTED_SIZE: usize = 400;

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

/// All modes, from the mass-normalised stiffness and `[alpha, beta]`.
pub(crate) fn proportional_modes(
    problem: &Problem<'_>,
    stiffness: &DMatrix<f64>,
    is_refined: bool,
    damping: [f64; 2],
) -> Vec<Mode> {
    let [alpha, beta] = damping;
    let modes =
        each(problem.pencil.size, problem.half_modes(stiffness, is_refined, damping), |half| {
            problem.modes_of(half, alpha, beta).collect::<Vec<_>>()
        });
    modes.into_iter().flatten().collect()
}

impl Problem<'_> {
    /// Eigenpairs of `K x = kappa M x` from those of the mass-normalised matrix, with corrected values.
    fn half_modes(
        &self,
        stiffness: &DMatrix<f64>,
        is_refined: bool,
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
        if std::env::var("NO_SLOW").is_err()
            && open(&halves, LOST)
            && m <= INVERTED_SIZE
            && let Some(inverse) = slow_modes::inverse(self.pencil.stiffness.to_dense())
        {
            let inverted = eigen::real_matrix(&self.factor.inverted(&inverse));
            halves = corrected(slow_modes::joined(eigen::real_matrix(stiffness), inverted));
        }
        for round in 0..ROUNDS {
            // One round for all modes costs as much as inverse iteration for a few.
            let unstable = |half: &HalfMode| self.half_residual(half, damping) > BACKWARD_STABLE;
            let first = round == 0 && (is_refined || halves.iter().any(unstable));
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
        // Products that are exact to rounding leave a residual that is: of |K|, which is what it is compared with.
        let row = |(m, k): (&DoubledComplex, &DoubledComplex)| k.value() - half.kappa * m.value();
        let rows = products.map(|products| row(products).norm_sqr()).sum::<f64>().sqrt();
        let (larger, smaller) = roots_of_mode(half.kappa, alpha + beta * half.kappa);
        let of_root = |lambda: Complex64| {
            let length = (1.0 + beta * lambda) * rows;
            self.norms.relative_residual(lambda, &half.right, std::iter::once(length))
        };
        // Of a conjugate pair both are the same.
        match smaller == larger.conj() {
            true => of_root(larger),
            false => of_root(larger).max(of_root(smaller)),
        }
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
    fn refined(&self, halves: Vec<HalfMode>) -> Vec<HalfMode> {
        let columns = packed(self.pencil.size, halves.iter().map(|half| (half.kappa, &half.left)));
        let mass = self.pencil.mass.transposed().products(&columns);
        let stiffness = self.pencil.stiffness.transposed().products(&columns);
        let residual = |kappa: Complex64, mass: &[DoubledComplex], stiffness: &[DoubledComplex]| {
            mass.iter().zip(stiffness).map(|(m, k)| k.less(m, kappa)).collect::<Vec<_>>()
        };
        let (solved, residuals): (Vec<Solved>, Vec<Residuals>) = halves
            .into_iter()
            .zip(mass.iter().zip(&stiffness))
            .map(|(half, (mass, stiffness))| {
                let residuals = Residuals {
                    scale: half.modal_mass,
                    right: residual(half.kappa, &half.mass, &half.stiffness),
                    left: residual(half.kappa, mass, stiffness),
                };
                let HalfMode { kappa: value, condition, right, left, .. } = half;
                (Solved { value, condition, right, left }, residuals)
            })
            .unzip();
        self.corrected(refined(solved, &residuals, -1.0))
    }

    /// The modes of both roots lambda; of real kappa below critical damping only the one that is not a conjugate.
    fn modes_of(
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
    let root = square_root(half * half - kappa);
    // The sum without cancellation first, the other root from their product.
    let root = if (half.conj() * root).re >= 0.0 { root } else { -root };
    let larger = -(half + root);
    let zero = Complex64::default();
    let smaller = if larger == zero { larger } else { kappa / larger };
    // No zero keeps a minus.
    (larger + zero, smaller + zero)
}

/// The root with a real part of zero or more, without angles: studies take it millions of times.
fn square_root(z: Complex64) -> Complex64 {
    let larger = (0.5 * (z.norm() + z.re.abs())).sqrt();
    let smaller = if larger == 0.0 { 0.0 } else { 0.5 * z.im.abs() / larger };
    let (re, im) = if z.re < 0.0 { (smaller, larger) } else { (larger, smaller) };
    Complex64::new(re, im.copysign(z.im))
}
