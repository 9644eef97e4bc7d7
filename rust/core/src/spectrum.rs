//! The quadratic eigenproblem of one status combination: `(lambda^2 M + lambda C + K) xi = 0`.
//!
//! With `C = alpha M + beta K` the m by m problem `K xi = kappa M xi` gives all 2m modes through
//! `lambda^2 + (alpha + beta kappa) lambda + kappa = 0`; otherwise the linearisation of
//! `y = (gamma x, x')` with `gamma^2 = |M^-1 K|` is solved (scaling of Fan, Lin and Van Dooren 2004).
//! Every eigenvalue is then corrected by one generalized Rayleigh quotient
//! `v' P(lambda) xi / v' P'(lambda) xi`, whose error is of second order in the errors of the vectors,
//! with the residual `P(lambda) xi` of the *unreduced* matrices in doubled precision.

use num_complex::Complex64;

use crate::compensated::DoubledComplex;
use crate::eigen::{self, EigenPair, norm};
use crate::error::Error;
use crate::matrix::SparseMatrix;
use crate::reduction::Reduced;
use crate::scene::Scene;

/// Relative residual of the quadratic problem above which an eigenvalue counts as not converged.
/// A backward-stable solver leaves some 1e-15; the margin only has to tell noise from failure.
const CONVERGED: f64 = 1e-10;

/// One mode, of each conjugate pair the one with positive imaginary part; vectors over the kept coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    pub eigenvalue: Complex64,
    pub right: Vec<Complex64>,
    pub left: Vec<Complex64>,
    /// `a = left' (C + 2 lambda M) right`
    pub a: Complex64,
    /// Condition number of the eigenvalue in mass-normalised, scaled state space.
    pub condition: f64,
    /// `|P(lambda) xi| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |xi|)`
    pub residual: f64,
}

impl Mode {
    pub fn is_real(&self) -> bool {
        self.eigenvalue.im == 0.0
    }
}

/// The factor of the reduced mass that turns the pencil into a standard eigenproblem.
enum MassFactor {
    /// Square roots of a diagonal mass.
    Diagonal(Vec<f64>),
    /// Lower Cholesky factor, row-major.
    Cholesky(Vec<f64>),
    /// The mass itself, neither symmetric nor definite: contacts coupled by mass, sliding with friction.
    General(Vec<f64>),
}

impl MassFactor {
    fn new(reduced: &Reduced) -> Result<Self, Error> {
        let m = reduced.size();
        if reduced.is_lumped() {
            return Ok(Self::Diagonal((0..m).map(|i| reduced.mass[i * m + i].sqrt()).collect()));
        }
        let symmetric =
            (0..m).all(|i| (0..i).all(|j| reduced.mass[i * m + j] == reduced.mass[j * m + i]));
        if symmetric && let Ok(factor) = eigen::cholesky(m, &reduced.mass) {
            return Ok(Self::Cholesky(factor));
        }
        match eigen::smallest_relative_pivot(m, &reduced.mass) {
            pivot if pivot > 1e-14 => Ok(Self::General(reduced.mass.clone())),
            pivot => Err(Error::SingularMass { combination: reduced.combination.clone(), pivot }),
        }
    }

    /// `G^-1 matrix G^-T` for `M = G G'`, or `M^-1 matrix`.
    fn normalised(&self, m: usize, matrix: &[f64]) -> Vec<f64> {
        match self {
            Self::Diagonal(root) => {
                (0..m * m).map(|k| matrix[k] / (root[k / m] * root[k % m])).collect()
            }
            Self::Cholesky(factor) => {
                let mut half = transpose(m, &eigen::lower_solve(m, factor, matrix));
                half = eigen::lower_solve(m, factor, &half);
                transpose(m, &half)
            }
            Self::General(mass) => eigen::solve(m, mass, matrix),
        }
    }

    fn right(&self, vector: &[Complex64]) -> Vec<Complex64> {
        match self {
            Self::Diagonal(root) => vector.iter().zip(root).map(|(z, g)| z / g).collect(),
            Self::Cholesky(factor) => eigen::lower_transposed_solve(factor, vector),
            Self::General(_) => vector.to_vec(),
        }
    }

    fn left(&self, vector: &[Complex64]) -> Vec<Complex64> {
        match self {
            Self::Diagonal(_) | Self::Cholesky(_) => self.right(vector),
            Self::General(mass) => eigen::transposed_solve(mass, vector),
        }
    }
}

fn transpose(m: usize, matrix: &[f64]) -> Vec<f64> {
    (0..m * m).map(|k| matrix[(k % m) * m + k / m]).collect()
}

/// All modes of the reduced system, in no particular order.
pub(crate) fn spectrum(scene: &Scene, reduced: &Reduced) -> Result<Vec<Mode>, Error> {
    let m = reduced.size();
    let factor = MassFactor::new(reduced)?;
    let stiffness = factor.normalised(m, &reduced.stiffness);
    let problem = Problem::new(scene, reduced);
    let modes = match scene.proportional {
        Some((alpha, beta)) => eigen::real_matrix(m, &stiffness)
            .iter()
            .flat_map(|pair| problem.proportional_modes(&factor, pair, alpha, beta))
            .collect::<Vec<_>>(),
        None => {
            let damping = factor.normalised(m, &reduced.damping);
            problem.general_modes(&factor, &stiffness, &damping)
        }
    };
    // A comparison that also fails for NaN.
    match modes.iter().find(|mode| !(mode.residual <= CONVERGED)) {
        Some(mode) => Err(Error::Eigenvalues {
            combination: reduced.combination.clone(),
            residual: mode.residual,
        }),
        None => Ok(modes),
    }
}

/// The reduced problem with access to the rows it was made of.
struct Problem<'a> {
    scene: &'a Scene,
    reduced: &'a Reduced,
    column: Vec<usize>,
    norms: [f64; 3],
}

impl<'a> Problem<'a> {
    fn new(scene: &'a Scene, reduced: &'a Reduced) -> Self {
        let mut column = vec![usize::MAX; scene.size];
        reduced.kept.iter().enumerate().for_each(|(j, &k)| column[k] = j);
        let frobenius = |matrix: &[f64]| matrix.iter().map(|a| a * a).sum::<f64>().sqrt();
        let norms =
            [&reduced.mass, &reduced.damping, &reduced.stiffness].map(|matrix| frobenius(matrix));
        Self { scene, reduced, column, norms }
    }

    /// Row i of `L' matrix R`, times `vector`.
    fn row(&self, matrix: &SparseMatrix, i: usize, vector: &[Complex64]) -> DoubledComplex {
        let dot = |row: usize| {
            DoubledComplex::dot(
                matrix
                    .row(row)
                    .filter(|entry| self.column[entry.0] != usize::MAX)
                    .map(|(k, value)| (value, vector[self.column[k]])),
            )
        };
        self.reduced
            .merges
            .iter()
            .filter(|merge| merge.position == i)
            .fold(dot(self.reduced.kept[i]), |row, merge| {
                row.add(dot(merge.normal).scaled(merge.factor))
            })
    }

    /// `left' P right` for a residual P right given row by row.
    fn project(&self, left: &[Complex64], row: impl Fn(usize) -> Complex64) -> Complex64 {
        left.iter().enumerate().map(|(i, v)| v * row(i)).sum()
    }

    fn proportional_modes(
        &self,
        factor: &MassFactor,
        pair: &EigenPair,
        alpha: f64,
        beta: f64,
    ) -> Vec<Mode> {
        let condition = pair.condition();
        let right = factor.right(&pair.right);
        let left = factor.left(&pair.left);
        let mass_rows: Vec<DoubledComplex> =
            (0..right.len()).map(|i| self.row(&self.scene.mass, i, &right)).collect();
        let modal_mass = self.project(&left, |i| mass_rows[i].value());
        let residual = self.project(&left, |i| {
            self.row(&self.scene.stiffness, i, &right).add(mass_rows[i].times(-pair.value)).value()
        });
        let correction = residual / modal_mass;
        // At a defective eigenvalue the quotient is 0 / 0; the uncorrected value is the best there is.
        let kappa = if correction.norm() <= 1e-6 * (pair.value.norm() + correction.norm()) {
            let corrected = pair.value + correction;
            if pair.value.im == 0.0 { Complex64::from(corrected.re) } else { corrected }
        } else {
            pair.value
        };
        let d = Complex64::from(alpha) + beta * kappa;
        roots_of_mode(kappa, d)
            .into_iter()
            .map(|(lambda, other)| {
                let omega = lambda.norm().max(other.norm());
                // State-space condition of the two-by-two block, right vector (omega, lambda), left (-other, omega).
                let splitting = (omega.hypot(lambda.norm()) * omega.hypot(other.norm()))
                    / (omega * (lambda - other).norm());
                let conjugated = lambda.im < 0.0;
                let orient = |z: Complex64| if conjugated { z.conj() } else { z };
                let mut mode = Mode {
                    eigenvalue: orient(lambda),
                    right: right.iter().copied().map(orient).collect(),
                    left: left.iter().copied().map(orient).collect(),
                    a: orient((lambda - other) * modal_mass),
                    condition: condition
                        * if splitting.is_nan() { f64::INFINITY } else { splitting },
                    residual: 0.0,
                };
                mode.residual = self.residual(&mode);
                mode
            })
            .collect()
    }

    fn general_modes(&self, factor: &MassFactor, stiffness: &[f64], damping: &[f64]) -> Vec<Mode> {
        let m = self.reduced.size();
        let row_sum = |matrix: &[f64]| {
            matrix
                .chunks_exact(m.max(1))
                .map(|row| row.iter().map(|a| a.abs()).sum::<f64>())
                .fold(0.0, f64::max)
        };
        let gamma = row_sum(stiffness).sqrt().max(row_sum(damping)).max(f64::MIN_POSITIVE);
        // gamma enters as a power of two, so the scaling itself is exact.
        let gamma = gamma.log2().round().exp2();
        let size = 2 * m;
        let mut state = vec![0.0; size * size];
        for i in 0..m {
            state[i * size + m + i] = gamma;
            for j in 0..m {
                state[(m + i) * size + j] = -stiffness[i * m + j] / gamma;
                state[(m + i) * size + m + j] = -damping[i * m + j];
            }
        }
        eigen::real_matrix(size, &state)
            .into_iter()
            .map(|pair| {
                let condition = pair.condition();
                let (upper, lower) = pair.right.split_at(m);
                // Both blocks hold the shape; the larger one holds more of its digits.
                let shape = if norm(upper) >= norm(lower) { upper } else { lower };
                let right = factor.right(shape);
                let left = factor.left(&pair.left[m..]);
                let mut mode = Mode {
                    eigenvalue: pair.value,
                    right,
                    left,
                    a: Complex64::default(),
                    condition: if condition.is_nan() { f64::INFINITY } else { condition },
                    residual: 0.0,
                };
                mode.a = self.slope(&mode);
                let correction =
                    self.project(&mode.left, |i| self.quadratic_row(&mode, i)) / mode.a;
                if correction.norm() <= 1e-6 * (mode.eigenvalue.norm() + correction.norm()) {
                    mode.eigenvalue -=
                        if mode.is_real() { correction.re.into() } else { correction };
                    mode.a = self.slope(&mode);
                }
                mode.residual = self.residual(&mode);
                mode
            })
            .collect()
    }

    /// `left' (C + 2 lambda M) right`
    fn slope(&self, mode: &Mode) -> Complex64 {
        self.project(&mode.left, |i| {
            self.row(&self.scene.damping, i, &mode.right)
                .add(self.row(&self.scene.mass, i, &mode.right).times(2.0 * mode.eigenvalue))
                .value()
        })
    }

    /// Row i of `(lambda^2 M + lambda C + K) right`.
    fn quadratic_row(&self, mode: &Mode, i: usize) -> Complex64 {
        self.row(&self.scene.mass, i, &mode.right)
            .times(mode.eigenvalue)
            .add(self.row(&self.scene.damping, i, &mode.right))
            .times(mode.eigenvalue)
            .add(self.row(&self.scene.stiffness, i, &mode.right))
            .value()
    }

    fn residual(&self, mode: &Mode) -> f64 {
        let rows: Vec<Complex64> =
            (0..mode.right.len()).map(|i| self.quadratic_row(mode, i)).collect();
        let size = mode.eigenvalue.norm();
        let [mass, damping, stiffness] = self.norms;
        let scale = (size * size * mass + size * damping + stiffness) * norm(&mode.right);
        match norm(&rows) {
            0.0 => 0.0,
            residual => residual / scale,
        }
    }
}

/// The two roots of `lambda^2 + d lambda + kappa = 0`, each with the other one; of real kappa below
/// critical damping only the one with positive imaginary part.
fn roots_of_mode(kappa: Complex64, d: Complex64) -> Vec<(Complex64, Complex64)> {
    let half = 0.5 * d;
    if kappa.im == 0.0 && d.im == 0.0 {
        let discriminant = half.re * half.re - kappa.re;
        if discriminant < 0.0 {
            let lambda = Complex64::new(-half.re, (-discriminant).sqrt());
            return vec![(lambda, lambda.conj())];
        }
    }
    let root = (half * half - kappa).sqrt();
    // The sum without cancellation first, the other root from their product.
    let root = if (half.conj() * root).re >= 0.0 { root } else { -root };
    let larger = -(half + root);
    let smaller = if larger == Complex64::default() { larger } else { kappa / larger };
    vec![(larger, smaller), (smaller, larger)]
}
