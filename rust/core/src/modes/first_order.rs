//! Coordinates of first order in a quadratic problem: the slip of contacts without mass under a law that rises.
//!
//! The column of M of such a coordinate s is zero, and that of C is not. With `D = diag(1, lambda)`, lambda in the places of
//! these coordinates and r the others,
//!
//! ```text
//! P(lambda) D = lambda^2 [M_r, C_s] + lambda [C_r, K_s] + [K_r, 0]
//! ```
//!
//! has the same left vectors and a regular leading matrix. Its linearisation in `(gamma x, x')` has columns of zeros at
//! `gamma x_s`. Without these columns and their rows it has the eigenvalues of P, no more and no fewer, with the states
//! `(gamma x_r, x_r', x_s)`: nothing has to be told from zero.

use nalgebra::{DMatrix, DVector};

use crate::modes::quadratic_pencil::{DoubledRows, Pencil, PencilDamping};

impl Pencil {
    /// The coordinates of first order, ascending: their columns of M are zero.
    pub fn first_order(&self) -> Vec<usize> {
        let mut moved = vec![false; self.size];
        for i in 0..self.size {
            self.mass.row(i).for_each(|(k, _)| moved[k] = true);
        }
        (0..self.size).filter(|&k| !moved[k]).collect()
    }

    /// The coefficient matrix `[M_r, C_s]`, whose determinant is the coefficient of the highest power in `det P(lambda)`.
    pub fn leading(&self) -> DMatrix<f64> {
        match &self.damping {
            PencilDamping::General(damping) => self.raised(damping).0[0].clone(),
            PencilDamping::Proportional { .. } => self.mass.rounded(),
        }
    }

    /// `[[M_r, C_s], [C_r, K_s], [K_r, 0]]` from the rows of C, and the coordinates of first order.
    pub fn raised(&self, damping: &DoubledRows) -> ([DMatrix<f64>; 3], Vec<usize>) {
        let [mut mass, mut damping, mut stiffness] =
            [&self.mass, damping, &self.stiffness].map(DoubledRows::rounded);
        let first = self.first_order();
        for &k in &first {
            mass.set_column(k, &damping.column(k));
            damping.set_column(k, &stiffness.column(k));
            stiffness.set_column(k, &DVector::zeros(self.size));
        }
        ([mass, damping, stiffness], first)
    }
}
