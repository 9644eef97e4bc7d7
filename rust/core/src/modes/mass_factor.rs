//! The factor of the reduced mass that turns `K x = kappa M x` into a standard eigenproblem.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::dense::{
    Factors, SINGULAR, cholesky, is_diagonal, is_symmetric, smallest_relative_pivot,
};
use crate::scene::status::Combination;

pub(crate) enum MassFactor {
    /// Square roots of a diagonal mass.
    Diagonal(DVector<f64>),
    /// `M = G G'`
    Cholesky(Cholesky<f64, Dyn>),
    /// The mass itself, neither symmetric nor definite: contacts coupled by mass, sliding with friction.
    General { mass: DMatrix<f64>, factors: Factors<f64> },
}

impl MassFactor {
    /// Of the mass of a combination.
    pub fn new(mass: DMatrix<f64>, combination: &Combination) -> Result<Self, Error> {
        let diagonal = mass.diagonal();
        if is_diagonal(&mass) && diagonal.iter().all(|&entry| entry > 0.0) {
            return Ok(Self::Diagonal(diagonal.map(f64::sqrt)));
        }
        if is_symmetric(&mass)
            && let Ok(factor) = cholesky(&mass)
        {
            return Ok(Self::Cholesky(factor));
        }
        match smallest_relative_pivot(&mass) {
            pivot if pivot > SINGULAR => {
                Ok(Self::General { factors: Factors::new(mass.clone()), mass })
            }
            pivot => Err(Error::SingularMass { combination: combination.to_string(), pivot }),
        }
    }

    /// `G^-1 matrix G^-T` for `M = G G'`, or `M^-1 matrix`.
    pub fn normalised(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Self::Diagonal(root) => {
                matrix.map_with_location(|i, j, entry| entry / (root[i] * root[j]))
            }
            Self::Cholesky(factor) => {
                let mut half = matrix.clone();
                factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut half);
                let mut turned = half.transpose();
                factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut turned);
                // Rounding would hide the symmetry that makes the vectors of a repeated value orthogonal.
                match is_symmetric(matrix) {
                    true => 0.5 * (&turned + turned.transpose()),
                    false => turned.transpose(),
                }
            }
            Self::General { factors, .. } => factors.solve(matrix.clone()),
        }
    }

    /// `G' inverse G`, or `inverse M`: the inverse of the normalised stiffness from the inverse of the stiffness.
    pub fn inverted(&self, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Self::Diagonal(root) => {
                inverse.map_with_location(|i, j, entry| entry * root[i] * root[j])
            }
            Self::Cholesky(factor) => factor.l().tr_mul(&(inverse * factor.l())),
            Self::General { mass, .. } => inverse * mass,
        }
    }

    /// The right vector of the problem itself from one of the normalised problem.
    pub fn right(&self, mut vector: Vec<Complex64>) -> Vec<Complex64> {
        match self {
            Self::Diagonal(root) => {
                vector.iter_mut().zip(root).for_each(|(z, g)| *z /= g);
                vector
            }
            Self::Cholesky(factor) => in_parts(&vector, |mut parts| {
                factor.l_dirty().tr_solve_lower_triangular_unchecked_mut(&mut parts);
                parts
            }),
            Self::General { .. } => vector,
        }
    }

    /// The left vector of the problem itself from one of the normalised problem.
    pub fn left(&self, vector: Vec<Complex64>) -> Vec<Complex64> {
        match self {
            Self::Diagonal(_) | Self::Cholesky(_) => self.right(vector),
            Self::General { factors, .. } => {
                in_parts(&vector, |parts| factors.transposed_solve(parts))
            }
        }
    }
}

/// Applies a real map to a complex vector, to its real and its imaginary part side by side.
fn in_parts(
    vector: &[Complex64],
    map: impl FnOnce(DMatrix<f64>) -> DMatrix<f64>,
) -> Vec<Complex64> {
    let part = |i: usize, j: usize| if j == 0 { vector[i].re } else { vector[i].im };
    let mapped = map(DMatrix::from_fn(vector.len(), 2, part));
    mapped.row_iter().map(|row| Complex64::new(row[0], row[1])).collect()
}
