//! The matrices of one reduced problem, `P(lambda) = lambda^2 M + lambda C + K`, to twice the working precision.
//!
//! A reduced entry such as `K_tt - mu K_nt` is rounded once when it is stored as a double, which moves an
//! eigenvalue by its condition number times rounding. Here every entry keeps the part lost by that rounding, so
//! residuals belong to the problem that the user stated.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::linalg::eigenpair::norm;
use crate::linalg::sparse::SparseMatrix;
use crate::numerics::double_double::{Doubled, DoubledComplex};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;
use crate::scene::status::Combination;

/// An m by m matrix whose entries keep what rounding loses.
pub(crate) type DoubledRows = SparseMatrix<Doubled>;

impl DoubledRows {
    /// Keeps the nonzero entries.
    pub(crate) fn new(size: usize, entry: impl Fn(usize, usize) -> Doubled) -> Self {
        Self::from_rows(size, |i, row| row.extend((0..size).map(|j| (j, entry(i, j)))))
    }

    /// The matrix times a vector, in doubled precision.
    pub(crate) fn product(&self, vector: &[Complex64]) -> Vec<DoubledComplex> {
        (0..self.size())
            .map(|i| DoubledComplex::dot(self.row(i).map(|(j, value)| (value, vector[j]))))
            .collect()
    }

    /// The matrix times a vector, in working precision.
    pub(crate) fn rounded_product<'a>(
        &'a self,
        vector: &'a [Complex64],
    ) -> impl Iterator<Item = Complex64> + 'a {
        (0..self.size()).map(|i| self.row(i).map(|(j, value)| value.high * vector[j]).sum())
    }

    /// `left' |matrix| right`
    pub(crate) fn form_of_sizes(&self, left: &[f64], right: &[f64]) -> f64 {
        let row = |i: usize| self.row(i).map(|(j, value)| value.high.abs() * right[j]).sum::<f64>();
        left.iter().enumerate().map(|(i, v)| v * row(i)).sum()
    }

    /// All entries, in working precision.
    pub(crate) fn rounded(&self) -> DMatrix<f64> {
        self.to_dense().map(|value| value.high)
    }

    pub(crate) fn frobenius(&self) -> f64 {
        let squares = |i: usize| self.row(i).map(|(_, value)| value.high * value.high);
        (0..self.size()).flat_map(squares).sum::<f64>().sqrt()
    }
}

/// `P(lambda) = lambda^2 M + lambda C + K` of one status combination.
#[derive(Debug, Clone)]
pub(crate) struct Pencil {
    pub combination: Combination,
    pub size: usize,
    pub mass: DoubledRows,
    pub damping: PencilDamping,
    pub stiffness: DoubledRows,
}

/// Reduced damping.
#[derive(Debug, Clone)]
pub(crate) enum PencilDamping {
    /// `C = alpha M + beta K`.
    Proportional {
        alpha: f64,
        beta: f64,
    },
    General(DoubledRows),
}

impl Pencil {
    pub fn new(scene: &Scene, combination: &Combination, reduction: &Reduction) -> Self {
        let add = |sum: Doubled, factor, entry| sum.add(Doubled::product(factor, entry));
        let rows = |matrix: &SparseMatrix| reduction.summed(matrix, add);
        Self {
            combination: combination.clone(),
            size: reduction.size(),
            mass: rows(&scene.mass),
            damping: match scene.proportional {
                Some((alpha, beta)) => PencilDamping::Proportional { alpha, beta },
                None => PencilDamping::General(rows(&scene.damping)),
            },
            stiffness: rows(&scene.stiffness),
        }
    }

    pub fn norms(&self) -> Norms {
        let (mass, stiffness) = (self.mass.frobenius(), self.stiffness.frobenius());
        let damping = match &self.damping {
            // An upper bound within a factor of two, where the matrix itself is not formed.
            PencilDamping::Proportional { alpha, beta } => {
                alpha.abs() * mass + beta.abs() * stiffness
            }
            PencilDamping::General(rows) => rows.frobenius(),
        };
        Norms { mass, damping, stiffness }
    }

    /// The three matrices times a vector.
    pub fn products(&self, vector: &[Complex64]) -> Products {
        let (mass, stiffness) = (self.mass.product(vector), self.stiffness.product(vector));
        let damping = match &self.damping {
            PencilDamping::General(rows) => rows.product(vector),
            PencilDamping::Proportional { alpha, beta } => {
                let products = mass.iter().zip(&stiffness);
                let both = |(m, k): (&DoubledComplex, &DoubledComplex)| {
                    m.times((*alpha).into()).add(k.times((*beta).into()))
                };
                products.map(both).collect()
            }
        };
        Products { mass, damping, stiffness }
    }
}

/// |M|, |C|, |K|, Frobenius.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Norms {
    mass: f64,
    damping: f64,
    stiffness: f64,
}

impl Norms {
    /// `|P(lambda) right| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |right|)` of the rows of `P(lambda) right`.
    pub fn relative_residual(
        self,
        lambda: Complex64,
        right: &[Complex64],
        rows: impl Iterator<Item = Complex64>,
    ) -> f64 {
        let size = lambda.norm();
        let scale = (size * size * self.mass + size * self.damping + self.stiffness) * norm(right);
        match rows.map(|row| row.norm_sqr()).sum::<f64>().sqrt() {
            0.0 => 0.0,
            residual => residual / scale,
        }
    }
}

/// M, C and K times one vector x, in doubled precision.
#[derive(Debug)]
pub(crate) struct Products {
    pub mass: Vec<DoubledComplex>,
    pub damping: Vec<DoubledComplex>,
    pub stiffness: Vec<DoubledComplex>,
}

impl Products {
    /// `P(lambda) x`
    pub fn rows(&self, lambda: Complex64) -> Vec<Complex64> {
        let terms = self.mass.iter().zip(&self.damping).zip(&self.stiffness);
        let row = |((m, c), k): ((&DoubledComplex, &DoubledComplex), &DoubledComplex)| {
            m.times(lambda).add(*c).times(lambda).add(*k).value()
        };
        terms.map(row).collect()
    }

    /// `left' P'(lambda) x`
    pub fn slope(&self, lambda: Complex64, left: &[Complex64]) -> Complex64 {
        let terms = self.mass.iter().zip(&self.damping).zip(left);
        terms.map(|((m, c), v)| v * m.times(2.0 * lambda).add(*c).value()).sum()
    }

    /// lambda less one generalized Rayleigh quotient, `left' P(lambda) x / left' P'(lambda) x`; a real one stays real.
    pub fn corrected(&self, lambda: Complex64, left: &[Complex64]) -> Complex64 {
        let projected: Complex64 = left.iter().zip(self.rows(lambda)).map(|(v, row)| v * row).sum();
        let correction = projected / self.slope(lambda, left);
        lambda - if lambda.im == 0.0 { correction.re.into() } else { correction }
    }
}
