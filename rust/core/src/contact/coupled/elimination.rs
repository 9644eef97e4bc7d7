//! Small linear systems, solved to the rounding of the solution itself.

use crate::numerics::double_double::Doubled;

/// Pivot, relative to the rows' largest entries, below which a matrix is singular.
const SINGULAR: f64 = 1e-13;
/// Steps of refinement: the first leaves the condition times rounding squared.
const REFINEMENTS: usize = 1;

/// Gaussian elimination with row pivoting, and one step of refinement with residuals in doubled precision: the solution
/// then is accurate to its own rounding wherever the matrix allows.
pub(crate) struct Elimination {
    pub size: usize,
    /// Row-major.
    pub matrix: Vec<f64>,
    pub rhs: Vec<f64>,
    factors: Vec<f64>,
    order: Vec<usize>,
}

impl Elimination {
    pub fn new(size: usize) -> Self {
        Self {
            size,
            matrix: vec![0.0; size * size],
            rhs: vec![0.0; size],
            factors: vec![0.0; size * size],
            order: vec![0; size],
        }
    }

    /// The solution, unless the matrix is singular to rounding.
    pub fn solve(&mut self) -> Option<Vec<f64>> {
        self.factorise()?;
        let mut solution = self.substituted(&self.rhs);
        for _ in 0..REFINEMENTS {
            let rows = self.matrix.chunks_exact(self.size).zip(&self.rhs);
            let residual: Vec<f64> = rows
                .map(|(row, &rhs)| {
                    let terms = row.iter().zip(&solution).map(|(&a, &x)| ((-a).into(), x));
                    Doubled::dot(terms).add(rhs.into()).value()
                })
                .collect();
            let correction = self.substituted(&residual);
            solution.iter_mut().zip(correction).for_each(|(x, d)| *x += d);
        }
        Some(solution)
    }

    fn factorise(&mut self) -> Option<()> {
        let n = self.size;
        let a = &mut self.factors;
        a.copy_from_slice(&self.matrix);
        // Rows are of different units.
        for row in a.chunks_exact_mut(n) {
            let largest = row.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
            row.iter_mut().for_each(|x| *x /= largest);
        }
        self.order.iter_mut().enumerate().for_each(|(k, row)| *row = k);
        for k in 0..n {
            let pivot =
                (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))?;
            // A comparison that also refuses NaN.
            if !(a[pivot * n + k].abs() >= SINGULAR) {
                return None;
            }
            if pivot != k {
                (0..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
                self.order.swap(k, pivot);
            }
            for i in k + 1..n {
                let factor = a[i * n + k] / a[k * n + k];
                a[i * n + k] = factor;
                if factor != 0.0 {
                    (k + 1..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
                }
            }
        }
        Some(())
    }

    fn substituted(&self, rhs: &[f64]) -> Vec<f64> {
        let (n, a) = (self.size, &self.factors);
        let scaled = |row: usize| {
            let entries = &self.matrix[row * n..(row + 1) * n];
            rhs[row] / entries.iter().fold(0.0, |size: f64, x| size.max(x.abs()))
        };
        let mut x: Vec<f64> = self.order.iter().map(|&row| scaled(row)).collect();
        for i in 0..n {
            x[i] -= (0..i).map(|j| a[i * n + j] * x[j]).sum::<f64>();
        }
        for i in (0..n).rev() {
            x[i] = (x[i] - (i + 1..n).map(|j| a[i * n + j] * x[j]).sum::<f64>()) / a[i * n + i];
        }
        x
    }
}
