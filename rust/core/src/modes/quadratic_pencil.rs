//! The matrices of one reduced problem, `P(lambda) = lambda^2 M + lambda C + K`, to twice the working precision.
//!
//! A reduced entry such as `K_tt - mu K_nt` is rounded once when it is stored as a double, which moves an
//! eigenvalue by its condition number times rounding. Here every entry keeps the part lost by that rounding, so
//! residuals belong to the problem that the user stated.

use num_complex::Complex64;

use crate::linalg::sparse::SparseMatrix;
use crate::numerics::double_double::{Doubled, DoubledComplex};
use crate::scene::model::Scene;
use crate::scene::reduction::Reduced;
use crate::scene::status::Combination;

/// An m by m matrix in compressed rows of [`Doubled`] entries.
#[derive(Debug, Clone)]
pub(crate) struct DoubledRows {
    start: Vec<usize>,
    columns: Vec<usize>,
    entries: Vec<Doubled>,
}

impl DoubledRows {
    /// Keeps the nonzero entries.
    pub fn new(size: usize, entry: impl Fn(usize, usize) -> Doubled) -> Self {
        // Rows of a mechanism are short; longer ones make the vectors grow.
        let expected = size * size.min(8);
        let mut rows = Self {
            start: Vec::with_capacity(size + 1),
            columns: Vec::with_capacity(expected),
            entries: Vec::with_capacity(expected),
        };
        rows.start.push(0);
        for i in 0..size {
            for j in 0..size {
                let value = entry(i, j);
                if value.high != 0.0 {
                    rows.columns.push(j);
                    rows.entries.push(value);
                }
            }
            rows.start.push(rows.columns.len());
        }
        rows
    }

    /// `L' matrix R` of a reduction.
    fn reduced(reduced: &Reduced, column: &[usize], matrix: &SparseMatrix) -> Self {
        let m = reduced.size();
        let mut rows = Self { start: vec![0], columns: Vec::new(), entries: Vec::new() };
        let mut row = vec![Doubled::default(); m];
        for (i, &k) in reduced.kept.iter().enumerate() {
            let mut touched: Vec<usize> = Vec::new();
            let mut add = |source: usize, factor: f64| {
                for (k, value) in matrix.row(source).filter(|entry| column[entry.0] != usize::MAX) {
                    let j = column[k];
                    row[j] = row[j].add(Doubled::product(factor, value));
                    touched.push(j);
                }
            };
            add(k, 1.0);
            reduced
                .merges
                .iter()
                .filter(|merge| merge.position == i)
                .for_each(|merge| add(merge.normal, merge.factor));
            touched.sort_unstable();
            touched.dedup();
            for j in touched {
                rows.columns.push(j);
                rows.entries.push(std::mem::take(&mut row[j]));
            }
            rows.start.push(rows.columns.len());
        }
        rows
    }

    pub fn size(&self) -> usize {
        self.start.len() - 1
    }

    /// Columns and entries of row i.
    pub fn row_slices(&self, i: usize) -> (&[usize], &[Doubled]) {
        let range = self.start[i]..self.start[i + 1];
        (&self.columns[range.clone()], &self.entries[range])
    }

    /// Entries of row i as (column, value).
    fn row(&self, i: usize) -> impl Iterator<Item = (usize, Doubled)> + '_ {
        let (columns, entries) = self.row_slices(i);
        columns.iter().copied().zip(entries.iter().copied())
    }

    /// The matrix times a vector, in doubled precision.
    pub fn product(&self, vector: &[Complex64]) -> Vec<DoubledComplex> {
        (0..self.size())
            .map(|i| DoubledComplex::dot(self.row(i).map(|(j, value)| (value, vector[j]))))
            .collect()
    }

    /// The matrix times a vector, in working precision.
    pub fn rounded_product<'a>(
        &'a self,
        vector: &'a [Complex64],
    ) -> impl Iterator<Item = Complex64> + 'a {
        (0..self.size()).map(|i| self.row(i).map(|(j, value)| value.high * vector[j]).sum())
    }

    /// `left' |matrix| right`
    pub fn form_of_sizes(&self, left: &[f64], right: &[f64]) -> f64 {
        let row = |i: usize| self.row(i).map(|(j, value)| value.high.abs() * right[j]).sum::<f64>();
        left.iter().enumerate().map(|(i, v)| v * row(i)).sum()
    }

    pub fn transposed(&self) -> Self {
        let mut start = vec![0; self.size() + 1];
        self.columns.iter().for_each(|&j| start[j + 1] += 1);
        (0..self.size()).for_each(|j| start[j + 1] += start[j]);
        let mut place = start.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut entries = vec![Doubled::default(); self.entries.len()];
        for i in 0..self.size() {
            for (j, value) in self.row(i) {
                (columns[place[j]], entries[place[j]]) = (i, value);
                place[j] += 1;
            }
        }
        Self { start, columns, entries }
    }

    pub fn to_dense(&self) -> Vec<f64> {
        let m = self.size();
        let mut dense = vec![0.0; m * m];
        for i in 0..m {
            self.row(i).for_each(|(j, value)| dense[i * m + j] = value.high);
        }
        dense
    }

    /// All entries, row-major.
    pub fn to_doubled(&self) -> Vec<Doubled> {
        let m = self.size();
        let mut dense = vec![Doubled::default(); m * m];
        for i in 0..m {
            self.row(i).for_each(|(j, value)| dense[i * m + j] = value);
        }
        dense
    }

    pub fn is_diagonal(&self) -> bool {
        (0..self.size()).all(|i| self.row(i).all(|(j, _)| j == i))
    }

    pub fn frobenius(&self) -> f64 {
        self.entries.iter().map(|value| value.high * value.high).sum::<f64>().sqrt()
    }
}

/// `P(lambda) = lambda^2 M + lambda C + K` of one status combination.
#[derive(Debug, Clone)]
pub(crate) struct Pencil {
    pub combination: Combination,
    pub size: usize,
    pub mass: DoubledRows,
    pub damping: Damping,
    pub stiffness: DoubledRows,
}

/// Reduced damping.
#[derive(Debug, Clone)]
pub(crate) enum Damping {
    /// `C = alpha M + beta K`.
    Proportional {
        alpha: f64,
        beta: f64,
    },
    General(DoubledRows),
}

impl Pencil {
    pub fn new(scene: &Scene, reduced: &Reduced) -> Self {
        let mut column = vec![usize::MAX; scene.size];
        reduced.kept.iter().enumerate().for_each(|(j, &k)| column[k] = j);
        let rows = |matrix: &SparseMatrix| DoubledRows::reduced(reduced, &column, matrix);
        Self {
            combination: reduced.combination.clone(),
            size: reduced.size(),
            mass: rows(&scene.mass),
            damping: match scene.proportional {
                Some((alpha, beta)) => Damping::Proportional { alpha, beta },
                None => Damping::General(rows(&scene.damping)),
            },
            stiffness: rows(&scene.stiffness),
        }
    }

    /// (|M|, |C|, |K|), Frobenius.
    pub fn norms(&self) -> [f64; 3] {
        let (mass, stiffness) = (self.mass.frobenius(), self.stiffness.frobenius());
        let damping = match &self.damping {
            // An upper bound within a factor of two, where the matrix itself is not formed.
            Damping::Proportional { alpha, beta } => alpha.abs() * mass + beta.abs() * stiffness,
            Damping::General(rows) => rows.frobenius(),
        };
        [mass, damping, stiffness]
    }
}
