//! Eigenvectors of a banded matrix from its eigenvalues, by inverse iteration.
//!
//! The matrix of a chain of n coordinates has a band of a few diagonals. To accumulate the rotations of the QR iteration and
//! to solve in the dense triangle takes `O(n^3)`, which is more time than the eigenvalues themselves take; a solution with
//! the band of `A - lambda` takes `O(n)`. A computed eigenvalue is one of `A + E` with |E| a few ulp of |A|, so `A - lambda`
//! is singular to rounding, and two solutions leave a residual of rounding, for left vectors by the same factors
//! (Wilkinson 1965, chapter 9; Ipsen 1997). Vectors that are solved one by one contain a part `ulp |A| / (lambda - mu)` of
//! each other, so vectors of close eigenvalues are made bi-orthogonal. Eigenvalues that are equal to rounding cannot be
//! separated.

use std::ops::{AddAssign, Div, Mul, Sub, SubAssign};

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::linalg::eigenpair::{EigenPair, norm, turned};
use crate::linalg::parallel::each;

/// A band is used if the matrix has at least this many times as many rows as its factors are wide.
const NARROW: usize = 8;
/// Eigenvalues closer than this many ulp of |A| are not separated: after two steps of inverse iteration a vector still
/// holds 1e-8 of its neighbour.
const PARTED: f64 = 1e4;
/// Largest residual of a vector, in ulp of the matrix and per row.
const RESIDUAL: f64 = 10.0;
/// Distance of two eigenvalues, of the norm of the matrix, beyond which their vectors are orthogonal to some 1e-14.
const NEAR: f64 = 1e-2;
/// Largest part of another vector that is taken out in one step, which leaves the square of this part.
const MIXED: f64 = 1e-7;
/// Fractional parts of its multiples are evenly spread: a start vector without structure, equal on every machine.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

trait Number:
    Copy
    + Default
    + From<f64>
    + AddAssign
    + SubAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Into<Complex64>
{
    /// A number within a factor of two of the modulus.
    fn size(self) -> f64;
}

impl Number for f64 {
    fn size(self) -> f64 {
        self.abs()
    }
}

impl Number for Complex64 {
    fn size(self) -> f64 {
        self.l1_norm()
    }
}

/// A square matrix with zeros beyond some diagonals.
pub(crate) struct Banded {
    size: usize,
    /// Number of diagonals below the main one, and above it once rows have been exchanged.
    below: usize,
    above: usize,
    /// Row i from column `i - below` to `i + above`.
    rows: Vec<f64>,
    /// Its largest row sum.
    norm: f64,
    /// Numbers between 1/2 and 3/2 without a pattern, which hold some of nearly any vector.
    start: Vec<f64>,
}

impl Banded {
    /// The band of a dense matrix; None if the band is not narrow.
    pub fn new(matrix: &DMatrix<f64>) -> Option<Self> {
        let size = matrix.nrows();
        let (mut below, mut above) = (0, 0);
        for (j, column) in matrix.column_iter().enumerate() {
            let first = column.iter().position(|&a| a != 0.0).unwrap_or(j);
            let last = column.iter().rposition(|&a| a != 0.0).unwrap_or(j);
            above = above.max(j.saturating_sub(first));
            below = below.max(last.saturating_sub(j));
        }
        above += below;
        if (below + above + 1) * NARROW > size {
            return None;
        }
        let mut rows = vec![0.0; size * (below + above + 1)];
        for (i, part) in rows.chunks_exact_mut(below + above + 1).enumerate() {
            for (j, entry) in part.iter_mut().enumerate() {
                if let Some(j) = (i + j).checked_sub(below).filter(|&j| j < size) {
                    *entry = matrix[(i, j)];
                }
            }
        }
        let sums = matrix.row_iter().map(|row| row.iter().map(|a| a.abs()).sum());
        let norm = sums.fold(0.0, f64::max);
        let start = (1..=size).map(|k| 0.5 + (k as f64 * GOLDEN).fract()).collect();
        Some(Self { size, below, above, rows, norm, start })
    }

    /// The eigenpairs of all eigenvalues, one of each conjugate pair; None if some are missing, cannot be separated or have
    /// no vector of a small residual.
    pub fn pairs(&self, values: &[Complex64]) -> Option<Vec<EigenPair>> {
        let mut values: Vec<Complex64> =
            values.iter().copied().filter(|value| value.im >= 0.0).collect();
        let count: usize = values.iter().map(|value| if value.im == 0.0 { 1 } else { 2 }).sum();
        if count != self.size {
            return None;
        }
        values.sort_by(|p, q| p.re.total_cmp(&q.re));
        let least = PARTED * f64::EPSILON * self.norm;
        for (k, value) in values.iter().enumerate() {
            let close = |other: &&Complex64| other.re - value.re <= least;
            if values[k + 1..].iter().take_while(close).any(|other| (other - value).norm() <= least)
                || (value.im != 0.0 && 2.0 * value.im <= least)
            {
                return None;
            }
        }
        let pair = |value: Complex64| match value.im == 0.0 {
            true => self.pair(value, value.re),
            false => self.pair(value, value),
        };
        let pairs: Option<Vec<EigenPair>> = each(self.size, values, pair).into_iter().collect();
        self.orthogonal(pairs?)
    }

    /// Pairs sorted by the real parts of their eigenvalues, with `y_i' x_j` taken out of the right vectors, by
    /// `x_j -= x_i y_i' x_j / y_i' x_i` over all i near j and their conjugates. It adds to the residual of x_j as little
    /// as they differ in eigenvalue; what is left is of second order.
    fn orthogonal(&self, mut pairs: Vec<EigenPair>) -> Option<Vec<EigenPair>> {
        let near = NEAR * self.norm;
        let residual = self.largest_residual();
        let own: Vec<Complex64> = pairs.iter().map(EigenPair::product).collect();
        let corrected = |j: usize| -> Option<Vec<Complex64>> {
            let EigenPair { value, right, .. } = &pairs[j];
            let mut x = right.clone();
            let first = pairs.partition_point(|other| other.value.re < value.re - near);
            let others = pairs.iter().zip(&own).enumerate().skip(first);
            for (i, (other, own)) in others.take_while(|o| o.1.0.value.re <= value.re + near) {
                // Of real eigenvalues both vectors are real.
                let real = value.im == 0.0 && other.value.im == 0.0;
                for conjugate in [false, true] {
                    let turned = |z| turned(z, conjugate);
                    let distance = (turned(other.value) - value).norm();
                    let is_own = !conjugate && i == j;
                    let is_twice = conjugate && other.value.im == 0.0;
                    if is_own || is_twice || distance > near {
                        continue;
                    }
                    let terms = other.left.iter().zip(right);
                    let product: Complex64 = match real {
                        true => terms.map(|(y, x)| y.re * x.re).sum::<f64>().into(),
                        false => terms.map(|(y, &x)| turned(*y) * x).sum(),
                    };
                    let factor = product / turned(*own);
                    // A comparison that refuses NaN as well.
                    if !(factor.norm() <= MIXED && factor.norm() * distance <= residual) {
                        return None;
                    }
                    let entries = x.iter_mut().zip(&other.right);
                    match real {
                        true => entries.for_each(|(x, other)| x.re -= factor.re * other.re),
                        false => entries.for_each(|(x, &other)| *x -= factor * turned(other)),
                    }
                }
            }
            Some(x)
        };
        let indices = (0..pairs.len()).collect();
        let right: Option<Vec<Vec<Complex64>>> =
            each(self.size, indices, corrected).into_iter().collect();
        pairs.iter_mut().zip(right?).for_each(|(pair, right)| pair.right = right);
        Some(pairs)
    }

    /// Largest residual of a vector whose largest entry is 1.
    fn largest_residual(&self) -> f64 {
        RESIDUAL * f64::EPSILON * self.norm * self.size as f64
    }

    fn pair<T: Number>(&self, value: Complex64, shift: T) -> Option<EigenPair> {
        let factors = Factors::new(self, shift);
        let largest = |x: &[T]| x.iter().map(|z| z.size()).fold(0.0, f64::max);
        let vector = |solve: &dyn Fn(&mut [T])| -> Option<Vec<Complex64>> {
            let mut x: Vec<T> = self.start.iter().map(|&entry| T::from(entry)).collect();
            solve(&mut x);
            let scale = T::from(1.0 / largest(&x));
            x.iter_mut().for_each(|z| *z = *z * scale);
            solve(&mut x);
            let growth = largest(&x);
            let scale = T::from(1.0 / growth);
            let x: Vec<Complex64> = x.into_iter().map(|z| (z * scale).into()).collect();
            // A comparison that refuses NaN as well.
            (growth * self.largest_residual() >= 1.0 && norm(&x).is_finite()).then_some(x)
        };
        let right = vector(&|x| factors.solve(x))?;
        let left = vector(&|x| factors.solve_transposed(x))?;
        Some(EigenPair { value, right, left })
    }
}

/// `P (A - shift) = L U`, by partial pivoting within the band.
struct Factors<T> {
    below: usize,
    /// Row k of U from its diagonal on in row k of this width, behind what was eliminated.
    width: usize,
    upper: Vec<T>,
    /// Column k of L below its diagonal, `below` entries each.
    lower: Vec<T>,
    /// Inverse diagonal of U.
    inverse: Vec<T>,
    pivots: Vec<usize>,
}

impl<T: Number> Factors<T> {
    fn new(matrix: &Banded, shift: T) -> Self {
        let Banded { size, below, above, .. } = *matrix;
        let width = below + above + 1;
        let mut rows: Vec<T> = matrix.rows.iter().map(|&a| T::from(a)).collect();
        rows.iter_mut().skip(below).step_by(width).for_each(|diagonal| *diagonal -= shift);
        let mut lower = vec![T::default(); size * below];
        let (mut inverse, mut pivots) = (Vec::with_capacity(size), Vec::with_capacity(size));
        let smallest = (f64::EPSILON * matrix.norm).max(f64::MIN_POSITIVE);
        for k in 0..size {
            let (head, tail) = rows.split_at_mut((k + 1) * width);
            let upper = &mut head[k * width + below..];
            // Row k + 1 + i has column k one place further left than the row above it.
            let others = below.min(size - k - 1);
            let (mut pivot, mut largest) = (k, upper[0].size());
            for i in 0..others {
                let size = tail[i * width + below - 1 - i].size();
                if size > largest {
                    (pivot, largest) = (k + 1 + i, size);
                }
            }
            pivots.push(pivot);
            if pivot != k {
                let start = (pivot - k - 1) * width + below + k - pivot;
                upper.swap_with_slice(&mut tail[start..start + width - below]);
            }
            if largest < smallest {
                upper[0] = T::from(smallest);
            }
            let inverted = T::from(1.0) / upper[0];
            inverse.push(inverted);
            let factors = &mut lower[k * below..(k + 1) * below];
            let rows = tail.chunks_exact_mut(width).take(others).enumerate();
            for ((i, row), slot) in rows.zip(factors) {
                let row = &mut row[below - 1 - i..];
                let factor = row[0] * inverted;
                *slot = factor;
                row[1..].iter_mut().zip(&upper[1..]).for_each(|(a, u)| *a -= factor * *u);
            }
        }
        Self { width, below, upper: rows, lower, inverse, pivots }
    }

    /// Row k of U right of its diagonal.
    fn right_of(&self, k: usize) -> &[T] {
        &self.upper[k * self.width + self.below + 1..(k + 1) * self.width]
    }

    /// Column k of L below its diagonal.
    fn under(&self, k: usize) -> &[T] {
        &self.lower[k * self.below..(k + 1) * self.below]
    }

    /// `x := (A - shift)^-1 x`
    fn solve(&self, x: &mut [T]) {
        for k in 0..x.len() {
            x.swap(k, self.pivots[k]);
            let (head, tail) = x.split_at_mut(k + 1);
            let value = head[k];
            tail.iter_mut().zip(self.under(k)).for_each(|(z, l)| *z -= *l * value);
        }
        for k in (0..x.len()).rev() {
            let (head, tail) = x.split_at_mut(k + 1);
            head[k] = (head[k] - dot(self.right_of(k), tail)) * self.inverse[k];
        }
    }

    /// `x := (A - shift)^-T x`
    fn solve_transposed(&self, x: &mut [T]) {
        for k in 0..x.len() {
            let (head, tail) = x.split_at_mut(k + 1);
            head[k] = head[k] * self.inverse[k];
            let value = head[k];
            tail.iter_mut().zip(self.right_of(k)).for_each(|(z, u)| *z -= *u * value);
        }
        for k in (0..x.len()).rev() {
            let (head, tail) = x.split_at_mut(k + 1);
            head[k] -= dot(self.under(k), tail);
            x.swap(k, self.pivots[k]);
        }
    }
}

/// The scalar product over the length of the shorter vector.
fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    let mut sum = T::default();
    a.iter().zip(b).for_each(|(a, b)| sum += *a * *b);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eigen;
    use nalgebra::DVector;

    /// With `below` and `above` diagonals of entries between -1 and 1.
    fn matrix(size: usize, below: usize, above: usize, seed: u64) -> DMatrix<f64> {
        let mut state = 2 * seed + 1;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let mut entries = DMatrix::zeros(size, size);
        for i in 0..size {
            for j in i.saturating_sub(below)..(i + above + 1).min(size) {
                entries[(i, j)] = draw();
            }
        }
        entries
    }

    proptest::proptest! {
        #[test]
        fn pairs_have_residuals_of_rounding_on_both_sides(
            size in 80usize..110, below in 0usize..4, above in 0usize..4, seed in 0u64..1000,
        ) {
            let entries = matrix(size, below, above, seed);
            let banded = Banded::new(&entries).expect("a narrow band");
            let values = eigen::values(entries.clone());
            let pairs = banded.pairs(&values);
            proptest::prop_assume!(pairs.is_some());
            let pairs = pairs.unwrap_or_default();
            proptest::prop_assert_eq!(
                pairs.len(), values.iter().filter(|value| value.im >= 0.0).count()
            );
            for EigenPair { value, right, left } in &pairs {
                for (vector, transposed) in [(right, false), (left, true)] {
                    let matrix = if transposed { entries.transpose() } else { entries.clone() };
                    let vector = DVector::from_column_slice(vector);
                    let residual = matrix.map(Complex64::from) * &vector - &vector * *value;
                    // What is accepted, in the largest entry.
                    let bound = 2.0 * banded.largest_residual();
                    proptest::prop_assert!(residual.norm() <= bound * vector.norm() * (size as f64).sqrt());
                }
            }
            // What was taken out of each other leaves its square, and its own rounding.
            for (i, one) in pairs.iter().enumerate() {
                for (j, other) in pairs.iter().enumerate().filter(|&(j, _)| j != i) {
                    if (one.value - other.value).norm() > NEAR * banded.norm {
                        continue;
                    }
                    let product: Complex64 =
                        one.left.iter().zip(&other.right).map(|(y, x)| y * x).sum();
                    let limit = 1e-12 * norm(&one.left) * norm(&other.right);
                    proptest::prop_assert!(product.norm() <= limit, "{i} {j} {product}");
                }
            }
        }
    }

    #[test]
    fn equal_eigenvalues_and_wide_bands_are_left_to_others() {
        let mut entries = matrix(64, 1, 1, 1);
        let banded = Banded::new(&entries);
        // Numbers that are no eigenvalues.
        let wrong: Vec<Complex64> = (0..64).map(|k| f64::from(k).into()).collect();
        assert!(banded.is_some_and(|banded| {
            banded.pairs(&wrong).is_none() && banded.pairs(&wrong[1..]).is_none()
        }));
        let ones = vec![Complex64::from(1.0); 64];
        let banded = Banded::new(&DMatrix::identity(64, 64));
        assert!(banded.is_some_and(|banded| banded.pairs(&ones).is_none()));
        entries[(0, 63)] = 1.0;
        assert!(Banded::new(&entries).is_none());
    }
}
