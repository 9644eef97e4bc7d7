//! Sparse matrices in compressed rows: the one form in which a scene keeps its matrices.

use nalgebra::{DMatrix, Scalar};

use crate::error::input::Error;
use crate::numerics::simd::{Lanes, Side};

/// A square matrix in compressed rows, column indices ascending within a row.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix<T = f64> {
    size: usize,
    row_start: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<T>,
}

impl Default for SparseMatrix {
    /// The matrix without rows.
    fn default() -> Self {
        Self::from_rows(0, |_, _| ())
    }
}

impl<T: Scalar + Copy + Default> SparseMatrix<T> {
    /// `fill` adds (column, value) of a row, columns ascending, to a list; nonzero entries are kept.
    pub(crate) fn from_rows(
        size: usize,
        mut fill: impl FnMut(usize, &mut Vec<(usize, T)>),
    ) -> Self {
        let mut matrix = Self::with_capacity(size, size);
        let mut entries = Vec::new();
        for row in 0..size {
            fill(row, &mut entries);
            for (column, value) in entries.drain(..).filter(|entry| entry.1 != T::default()) {
                matrix.columns.push(column);
                matrix.values.push(value);
            }
            matrix.row_start.push(matrix.columns.len());
        }
        matrix
    }

    fn with_capacity(size: usize, entries: usize) -> Self {
        let mut row_start = Vec::with_capacity(size + 1);
        row_start.push(0);
        Self {
            size,
            row_start,
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
        }
    }

    /// Number of rows, which is that of columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Nonzero entries of a row as (column, value).
    #[inline]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        let (columns, values) = self.entries_of(row);
        columns.iter().copied().zip(values.iter().copied())
    }

    /// Columns and values of a row.
    #[inline]
    pub(crate) fn entries_of(&self, row: usize) -> (&[usize], &[T]) {
        let range = self.row_start[row]..self.row_start[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// The entry at (row, column), 0 where none is stored.
    pub fn get(&self, row: usize, column: usize) -> T {
        let (columns, values) = self.entries_of(row);
        columns.binary_search(&column).map_or_else(|_| T::default(), |place| values[place])
    }

    pub(crate) fn transposed(&self) -> Self {
        let mut place = vec![0; self.size + 1];
        self.columns.iter().for_each(|&column| place[column + 1] += 1);
        (0..self.size).for_each(|k| place[k + 1] += place[k]);
        let row_start = place.clone();
        let count = self.values.len();
        let (mut columns, mut values) = (vec![0; count], vec![T::default(); count]);
        for row in 0..self.size {
            for (column, value) in self.row(row) {
                (columns[place[column]], values[place[column]]) = (row, value);
                place[column] += 1;
            }
        }
        Self { size: self.size, row_start, columns, values }
    }

    /// The same matrix with all its zeros, n by n.
    pub fn to_dense(&self) -> DMatrix<T> {
        let mut dense = DMatrix::from_element(self.size, self.size, T::default());
        for row in 0..self.size {
            self.row(row).for_each(|(column, value)| dense[(row, column)] = value);
        }
        dense
    }
}

impl SparseMatrix {
    /// Keeps the nonzero entries.
    pub fn from_dense(dense: &DMatrix<f64>) -> Self {
        Self::from_rows(dense.nrows(), |row, entries| {
            entries.extend(dense.row(row).iter().copied().enumerate());
        })
    }

    /// A matrix from the compressed rows of a caller: duplicates are refused, columns are sorted.
    pub fn from_compressed_rows(
        argument: &str,
        size: usize,
        row_start: &[i64],
        columns: &[i64],
        values: &[f64],
    ) -> Result<Self, Error> {
        let consistent = row_start.len() == size + 1
            && columns.len() == values.len()
            && row_start.first() == Some(&0)
            && row_start.last() == Some(&(values.len() as i64))
            && row_start.windows(2).all(|pair| pair[0] <= pair[1]);
        if !consistent {
            let (starts, columns, values) = (row_start.len(), columns.len(), values.len());
            let got = format!("{starts} row starts, {columns} columns, {values} values");
            let expected = format!("compressed rows of ({size}, {size})");
            return Err(Error::shape(argument, &expected, got));
        }
        let mut matrix = Self::with_capacity(size, values.len());
        for row in 0..size {
            let range = row_start[row] as usize..row_start[row + 1] as usize;
            let mut entries: Vec<(i64, f64)> =
                columns[range.clone()].iter().copied().zip(values[range].iter().copied()).collect();
            entries.sort_by_key(|entry| entry.0);
            let mut last = -1;
            for (column, value) in entries {
                if column <= last || column >= size as i64 {
                    return Err(Error::SparseIndex {
                        argument: argument.to_owned(),
                        row,
                        index: column,
                        size,
                    });
                }
                last = column;
                if value != 0.0 {
                    matrix.columns.push(column as usize);
                    matrix.values.push(value);
                }
            }
            matrix.row_start.push(matrix.columns.len());
        }
        Ok(matrix)
    }

    /// The diagonal matrix with these entries.
    pub fn diagonal(entries: &[f64]) -> Self {
        Self {
            size: entries.len(),
            row_start: (0..=entries.len()).collect(),
            columns: (0..entries.len()).collect(),
            values: entries.to_vec(),
        }
    }

    /// `sum_i k_i w_i w_i'` of springs with the stiffness k that resist the elongation `w . x`, w by its entries.
    pub(crate) fn of_springs(size: usize, springs: &[(f64, Vec<(usize, f64)>)]) -> Self {
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); size];
        for (stiffness, elongation) in springs {
            for &(i, a) in elongation {
                rows[i].extend(elongation.iter().map(|&(j, b)| (j, stiffness * (a * b))));
            }
        }
        Self::from_rows(size, |row, entries| {
            entries.append(&mut rows[row]);
            summed(entries);
        })
    }

    /// The diagonal matrix of its diagonal entries.
    pub(crate) fn diagonal_part(&self) -> Self {
        let entries: Vec<f64> = (0..self.size).map(|k| self.get(k, k)).collect();
        Self::diagonal(&entries)
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// (data, column indices, row starts), as scipy's `csr_array` takes them.
    pub fn compressed_rows(&self) -> (&[f64], &[usize], &[usize]) {
        (&self.values, &self.columns, &self.row_start)
    }

    /// `row . x`
    #[inline]
    pub fn row_dot(&self, row: usize, x: &[f64]) -> f64 {
        self.row(row).map(|(column, value)| value * x[column]).sum()
    }

    /// `y += factor * self x`
    pub fn add_product(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for (row, target) in y.iter_mut().enumerate() {
            *target += factor * self.row_dot(row, x);
        }
    }

    /// `y += factor * self x` of several columns side by side.
    #[inline(always)]
    pub(crate) fn add_products<S: Lanes>(&self, simd: S, factor: f64, x: &[Side], y: &mut [Side]) {
        for (row, target) in y.iter_mut().enumerate() {
            // Two sums, so that none waits for itself.
            let [mut even, mut odd] = [Side::ZERO; 2];
            let (columns, values) = self.entries_of(row);
            let (columns, last_column) = columns.as_chunks::<2>();
            let (values, last_value) = values.as_chunks::<2>();
            for (&[i, j], &[a, b]) in columns.iter().zip(values) {
                even = even.add_scaled(simd, a, &x[i]);
                odd = odd.add_scaled(simd, b, &x[j]);
            }
            for (&column, &value) in last_column.iter().zip(last_value) {
                even = even.add_scaled(simd, value, &x[column]);
            }
            *target = target.add_scaled(simd, factor, &even).add_scaled(simd, factor, &odd);
        }
    }

    /// Rows and columns `kept`, ascending.
    pub fn restricted(&self, kept: &[usize]) -> Self {
        let mut part = Self::with_capacity(kept.len(), kept.len());
        for &row in kept {
            for (column, value) in self.row(row) {
                if let Ok(place) = kept.binary_search(&column) {
                    part.columns.push(place);
                    part.values.push(value);
                }
            }
            part.row_start.push(part.columns.len());
        }
        part
    }

    /// The matrix with empty rows and columns behind its own.
    pub(crate) fn padded(self, size: usize) -> Self {
        if size == self.size() {
            return self;
        }
        Self::from_rows(size, |row, entries| {
            if row < self.size() {
                entries.extend(self.row(row));
            }
        })
    }

    /// The matrix times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        scaled.values.iter_mut().for_each(|value| *value *= factor);
        scaled
    }

    /// `a self + b other`
    pub fn combined(&self, a: f64, other: &Self, b: f64) -> Self {
        let mut sum = Self::with_capacity(self.size, self.entries().max(other.entries()));
        for row in 0..self.size {
            let mut left = self.row(row).peekable();
            let mut right = other.row(row).peekable();
            loop {
                let column = match (left.peek(), right.peek()) {
                    (Some(l), Some(r)) => l.0.min(r.0),
                    (Some(l), None) => l.0,
                    (None, Some(r)) => r.0,
                    (None, None) => break,
                };
                let l = left.next_if(|entry| entry.0 == column).map_or(0.0, |entry| entry.1);
                let r = right.next_if(|entry| entry.0 == column).map_or(0.0, |entry| entry.1);
                sum.columns.push(column);
                sum.values.push(a * l + b * r);
            }
            sum.row_start.push(sum.columns.len());
        }
        sum
    }

    /// Whether a row is that of the identity.
    fn is_unit(&self, row: usize) -> bool {
        self.row(row).eq([(row, 1.0)])
    }

    /// `self other`
    pub(crate) fn product(&self, other: &Self) -> Self {
        let mut sums: Vec<Option<f64>> = vec![None; self.size];
        let mut touched = Vec::new();
        Self::from_rows(self.size, |row, entries| {
            // A change of basis leaves most rows as they are.
            if self.is_unit(row) {
                return entries.extend(other.row(row));
            }
            if self.row(row).all(|(k, _)| other.is_unit(k)) {
                return entries.extend(self.row(row));
            }
            for (k, factor) in self.row(row) {
                for (column, value) in other.row(k) {
                    let sum = sums[column].get_or_insert_with(|| {
                        touched.push(column);
                        0.0
                    });
                    *sum += factor * value;
                }
            }
            touched.sort_unstable();
            entries.extend(touched.drain(..).filter_map(|k| Some((k, sums[k].take()?))));
        })
    }

    /// `self dense`
    pub(crate) fn times(&self, dense: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.size, dense.ncols(), |i, j| {
            self.row(i).map(|(k, value)| value * dense[(k, j)]).sum()
        })
    }

    /// `transform' self transform`
    pub(crate) fn transformed(&self, transform: &Self) -> Self {
        transform.transposed().product(&self.product(transform))
    }

    /// The same of a symmetric matrix.
    pub(crate) fn congruent(&self, transform: &Self) -> Self {
        let congruent = self.transformed(transform);
        // Rounding leaves the two triangles different by an ulp; the problem is symmetric.
        congruent.combined(0.5, &congruent.transposed(), 0.5)
    }

    /// The entries whose (row, column) is wanted.
    pub(crate) fn filtered(&self, wanted: impl Fn(usize, usize) -> bool) -> Self {
        Self::from_rows(self.size, |row, entries| {
            entries.extend(self.row(row).filter(|&(column, _)| wanted(row, column)));
        })
    }

    pub(crate) fn is_diagonal(&self) -> bool {
        (0..self.size).all(|row| self.row(row).all(|(column, _)| column == row))
    }

    /// `self x`
    pub(crate) fn apply(&self, x: &[f64]) -> Vec<f64> {
        (0..self.size).map(|row| self.row_dot(row, x)).collect()
    }

    /// Refuses entries that are not finite.
    pub(crate) fn check_finite(&self, argument: &str) -> Result<(), Error> {
        for row in 0..self.size {
            for (column, value) in self.row(row) {
                if !value.is_finite() {
                    return Err(Error::NotFinite {
                        argument: argument.to_owned(),
                        place: format!("({row}, {column})"),
                        value,
                    });
                }
            }
        }
        Ok(())
    }

    /// Refuses entries that are not finite and an asymmetry above rounding (1e-12 of the larger
    /// diagonal entries), then returns the symmetric part.
    pub(crate) fn validated_symmetric(self, argument: &str) -> Result<Self, Error> {
        self.check_finite(argument)?;
        let mut symmetric = true;
        for row in 0..self.size {
            for (column, value) in self.row(row) {
                let mirrored = self.get(column, row);
                if value != mirrored {
                    symmetric = false;
                    let scale = (value.abs().max(mirrored.abs()))
                        .max((self.get(row, row) * self.get(column, column)).abs().sqrt());
                    if (value - mirrored).abs() > 1e-12 * scale {
                        return Err(Error::NotSymmetric {
                            argument: argument.to_owned(),
                            skew: false,
                            row,
                            column,
                            value,
                            mirrored,
                        });
                    }
                }
            }
        }
        if symmetric {
            return Ok(self);
        }
        let transposed = self.transposed();
        Ok(self.combined(0.5, &transposed, 0.5))
    }

    /// Refuses entries that are not finite and a part above rounding (1e-12 of an entry) that is not skew, then returns
    /// the skew part.
    pub(crate) fn validated_skew(self, argument: &str) -> Result<Self, Error> {
        self.check_finite(argument)?;
        for row in 0..self.size {
            for (column, value) in self.row(row) {
                let mirrored = self.get(column, row);
                if (value + mirrored).abs() > 1e-12 * value.abs().max(mirrored.abs()) {
                    return Err(Error::NotSymmetric {
                        argument: argument.to_owned(),
                        skew: true,
                        row,
                        column,
                        value,
                        mirrored,
                    });
                }
            }
        }
        Ok(self.combined(0.5, &self.transposed(), -0.5))
    }

    /// `(A + A') / 2` and `(A - A') / 2`, without zeros.
    pub(crate) fn parts(&self) -> [Self; 2] {
        let mirrored = self.transposed();
        [0.5, -0.5].map(|sign| self.combined(0.5, &mirrored, sign).filtered(|_, _| true))
    }
}

/// Makes a sum of terms (coordinate, weight) a sparse vector: ascending, the terms of one coordinate added up in their order.
pub(crate) fn summed(entries: &mut Vec<(usize, f64)>) {
    let size = entries.iter().map(|entry| entry.0 + 1).max().unwrap_or(0);
    if entries.len() > size {
        // A place for every column is quicker than an order.
        let sums = placed(size, entries.drain(..));
        entries.extend(found(&sums));
        return;
    }
    entries.sort_by_key(|entry| entry.0);
    entries.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        kept.1 += if same { next.1 } else { 0.0 };
        same
    });
}

/// The same of terms that are not listed, so that many terms of few coordinates take the room of these.
pub(crate) fn sum_of(terms: impl Iterator<Item = (usize, f64)> + Clone) -> Vec<(usize, f64)> {
    let of = |(count, size): (usize, usize), (k, _)| (count + 1, size.max(k + 1));
    let (count, size) = terms.clone().fold((0, 0), of);
    if count > size {
        return found(&placed(size, terms)).collect();
    }
    let mut entries = terms.collect();
    summed(&mut entries);
    entries
}

/// Sums of the terms of each coordinate, in their order, and whether there is a term.
fn placed(size: usize, terms: impl Iterator<Item = (usize, f64)>) -> (Vec<f64>, Vec<bool>) {
    // Negative zero leaves the first term as it is.
    let (mut sums, mut there) = (vec![-0.0; size], vec![false; size]);
    terms.for_each(|(k, value)| {
        sums[k] += value;
        there[k] = true;
    });
    (sums, there)
}

fn found((sums, there): &(Vec<f64>, Vec<bool>)) -> impl Iterator<Item = (usize, f64)> + '_ {
    let all = sums.iter().zip(there).enumerate();
    all.filter_map(|(k, (&sum, &there))| there.then_some((k, sum)))
}
