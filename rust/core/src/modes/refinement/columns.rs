//! Complex vectors as real columns that the vector unit works on eight at a time.
//!
//! The product of a matrix in doubled precision with one vector waits for the last sum at every entry. Columns side by side
//! have separate sums and share the entry, which gives the same digits in a tenth of the time.

use nalgebra::DMatrix;
use num_complex::Complex64;
use pulp::cast;

use crate::linalg::parallel::each;
use crate::modes::quadratic_pencil::DoubledRows;
use crate::numerics::double_double::{Doubled, DoubledComplex};
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS};

/// Columns of a block.
const WIDTH: usize = 2 * GROUP;

/// One row of a block.
type Slice = [f64; WIDTH];
type Sums = [Group; 2];

/// One column of a real vector, two of a complex one: real and imaginary part.
#[derive(Debug, Clone, Copy)]
struct Place {
    first: usize,
    is_complex: bool,
}

/// Vectors of equal length as real columns side by side.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    places: Vec<Place>,
    columns: DMatrix<f64>,
}

impl Columns {
    /// Packs vectors with `rows` entries, each with whether it is complex; the imaginary parts of the others are left out.
    pub fn new<'a>(
        rows: usize,
        vectors: impl Iterator<Item = (&'a [Complex64], bool)> + Clone,
    ) -> Self {
        let mut width = 0;
        let places = vectors.clone().map(|(_, is_complex)| {
            let first = width;
            width += if is_complex { 2 } else { 1 };
            Place { first, is_complex }
        });
        let places: Vec<Place> = places.collect();
        let mut columns = DMatrix::zeros(rows, width);
        for (&Place { first, is_complex }, (vector, _)) in places.iter().zip(vectors) {
            for (i, z) in vector.iter().enumerate() {
                columns[(i, first)] = z.re;
                if is_complex {
                    columns[(i, first + 1)] = z.im;
                }
            }
        }
        Self { places, columns }
    }

    /// Columns of a block, row by row; columns that are left over hold zeros.
    fn block(&self, first: usize) -> Vec<Slice> {
        let columns = self.columns.columns_range(first..self.columns.ncols().min(first + WIDTH));
        let row = |i: usize| std::array::from_fn(|k| columns.get((i, k)).copied().unwrap_or(0.0));
        (0..columns.nrows()).map(row).collect()
    }

    /// Vector k.
    pub fn vector(&self, k: usize) -> Vec<Complex64> {
        let Place { first, is_complex } = self.places[k];
        let imaginary = |i: usize| if is_complex { self.columns[(i, first + 1)] } else { 0.0 };
        let entry = |i: usize| Complex64::new(self.columns[(i, first)], imaginary(i));
        (0..self.columns.nrows()).map(entry).collect()
    }

    /// Products of every real column here with every one there, one row for each column here.
    pub fn products(&self, other: &Self) -> Products {
        let products = self.columns.transpose() * &other.columns;
        Products {
            places: self.places.clone(),
            products: Self { places: other.places.clone(), columns: products },
        }
    }

    /// To every vector j here is added `sum_i factor_ij x_i`, over vectors i and their conjugates.
    pub fn add_combinations(&mut self, factors: &Factors) {
        self.columns += &self.columns * &factors.0.columns;
    }
}

/// The result of [`Columns::products`].
pub(crate) struct Products {
    places: Vec<Place>,
    products: Columns,
}

impl Products {
    /// `y_i' r_j`, or `conj(y_i)' r_j`.
    #[inline]
    pub fn get(&self, i: usize, conjugate: bool, j: usize) -> Complex64 {
        let (here, there) = (self.places[i], self.products.places[j]);
        // Real modes are most of those of proportional damping.
        if !here.is_complex && !there.is_complex {
            return self.products.columns[(here.first, there.first)].into();
        }
        let row = |offset: usize| {
            let part = |column: usize| self.products.columns[(here.first + offset, column)];
            let imaginary = if there.is_complex { part(there.first + 1) } else { 0.0 };
            Complex64::new(part(there.first), imaginary)
        };
        if !here.is_complex {
            return row(0);
        }
        let (real, imaginary) = (row(0), row(1) * Complex64::i());
        if conjugate { real - imaginary } else { real + imaginary }
    }
}

/// Real factors of the combinations that [`Columns::add_combinations`] adds.
pub(crate) struct Factors(Columns);

impl Factors {
    /// All zero, for vectors packed like `columns`.
    pub fn zeros(columns: &Columns) -> Self {
        let width = columns.columns.ncols();
        Self(Columns { places: columns.places.clone(), columns: DMatrix::zeros(width, width) })
    }

    /// Adds `factor x_i`, or `factor conj(x_i)`, to x_j.
    pub fn add(&mut self, i: usize, conjugate: bool, j: usize, factor: Complex64) {
        let (here, there) = (self.0.places[i], self.0.places[j]);
        let mut add = |row: usize, column: usize, value: f64| {
            self.0.columns[(row, column)] += value;
        };
        // Of x_i = a + i b.
        let sign = if conjugate { -1.0 } else { 1.0 };
        let turned = sign * factor * Complex64::i();
        for (offset, factor) in [factor, turned].into_iter().enumerate() {
            if offset == 1 && !here.is_complex {
                break;
            }
            add(here.first + offset, there.first, factor.re);
            if there.is_complex {
                add(here.first + offset, there.first + 1, factor.im);
            }
        }
    }
}

/// A matrix times a block: `(sum, rest)` of each row in twice the working precision (Ogita, Rump and Oishi 2005).
struct DoubledProduct<'a> {
    matrix: &'a DoubledRows,
    block: &'a [Slice],
}

impl Kernel for DoubledProduct<'_> {
    type Output = Vec<(Slice, Slice)>;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Vec<(Slice, Slice)> {
        let mut product = Vec::with_capacity(self.matrix.size());
        for i in 0..self.matrix.size() {
            let (columns, entries) = self.matrix.entries_of(i);
            let (mut sums, mut rests): (Sums, Sums) = ([ZEROS; 2], [ZEROS; 2]);
            for (&k, value) in columns.iter().zip(entries) {
                let (high, low) = (simd.splat_f64s(value.high), simd.splat_f64s(value.low));
                let slice: Sums = cast(self.block[k]);
                for g in 0..2 {
                    let product = simd.mul_f64s(high, slice[g]);
                    let lost = simd.mul_add_f64s(high, slice[g], simd.neg_f64s(product));
                    let next = simd.add_f64s(sums[g], product);
                    let part = simd.sub_f64s(next, sums[g]);
                    let before = simd.sub_f64s(sums[g], simd.sub_f64s(next, part));
                    let error = simd.add_f64s(before, simd.sub_f64s(product, part));
                    let small = simd.mul_add_f64s(low, slice[g], simd.add_f64s(lost, error));
                    rests[g] = simd.add_f64s(rests[g], small);
                    sums[g] = next;
                }
            }
            product.push((cast(sums), cast(rests)));
        }
        product
    }
}

impl DoubledRows {
    /// The matrix times each vector, in doubled precision.
    pub(crate) fn products(&self, columns: &Columns) -> Vec<Vec<DoubledComplex>> {
        let firsts = (0..columns.columns.ncols()).step_by(WIDTH).collect();
        let blocks = each(self.size(), firsts, |first| {
            let block = &columns.block(first);
            VectorUnit::default().run(DoubledProduct { matrix: self, block })
        });
        let part = |row: usize, column: usize| {
            let (sums, rests) = &blocks[column / WIDTH][row];
            Doubled::from(sums[column % WIDTH]).add(rests[column % WIDTH].into())
        };
        let vector = |place: &Place| {
            let entry = |i: usize| DoubledComplex {
                re: part(i, place.first),
                im: if place.is_complex { part(i, place.first + 1) } else { Doubled::default() },
            };
            (0..self.size()).map(entry).collect()
        };
        columns.places.iter().map(vector).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in (-1, 1) without structure.
    fn drawn(count: usize) -> Vec<f64> {
        (1..=count).map(|k| (k as f64 * 12.9898).sin() * 43_758.545_3 % 1.0).collect()
    }

    /// Three vectors of five entries; the second one is real.
    fn vectors() -> Vec<Vec<Complex64>> {
        let numbers = drawn(30);
        let entry =
            |k: usize| Complex64::new(numbers[k], if k / 5 == 1 { 0.0 } else { numbers[15 + k] });
        (0..3).map(|v| (0..5).map(|i| entry(5 * v + i)).collect()).collect()
    }

    fn packed(vectors: &[Vec<Complex64>]) -> Columns {
        Columns::new(5, vectors.iter().enumerate().map(|(k, vector)| (&vector[..], k != 1)))
    }

    /// The product of one row of three entries, exact but for the last rounding, in units that leave nothing of a
    /// product in working precision.
    #[test]
    fn products_keep_what_cancels() {
        let (big, tiny) = (1e8 + 1.0, 1e-7);
        let row = [big, -big, tiny];
        let matrix = DoubledRows::new(3, |_, j| row[j].into());
        let vector: Vec<Complex64> = [big, big - tiny, 1.0].map(Complex64::from).to_vec();
        let product = matrix.products(&Columns::new(3, std::iter::once((&vector[..], false))));
        // big - tiny is rounded; big times what it lost is what remains.
        let expected = big * (big - (big - tiny)) + tiny;
        assert!((product[0][0].value().re - expected).abs() <= 4.0 * f64::EPSILON * expected);
    }

    #[test]
    fn many_vectors_at_once_give_what_one_does() {
        let numbers = drawn(50);
        let entry = |i: usize, j: usize| Doubled {
            high: numbers[5 * i + j],
            low: numbers[25 + 5 * i + j] * 1e-17,
        };
        let matrix = DoubledRows::new(5, entry);
        let vectors = vectors();
        for (product, vector) in matrix.products(&packed(&vectors)).iter().zip(&vectors) {
            for (found, one) in product.iter().zip(matrix.product(vector)) {
                // Both are within some squares of a rounding of sums of five products below 1.
                let difference = found.add(one.times(Complex64::from(-1.0))).value().norm();
                assert!(difference <= 100.0 * f64::EPSILON * f64::EPSILON);
            }
        }
    }

    #[test]
    fn combinations_of_vectors_and_conjugates() {
        let (left, right) = (vectors(), vectors().into_iter().rev().collect::<Vec<_>>());
        let is_complex = |k: usize| k != 1;
        let products = packed(&left).products(&packed(&right));
        let dot = |y: &[Complex64], conjugate: bool, x: &[Complex64]| -> Complex64 {
            y.iter().zip(x).map(|(y, x)| if conjugate { y.conj() * x } else { y * x }).sum()
        };
        let mut combined = packed(&left);
        let mut factors = Factors::zeros(&combined);
        let mut expected = left.clone();
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            for conjugate in [false, true] {
                let found = products.get(i, conjugate, j);
                let difference = (found - dot(&left[i], conjugate, &right[j])).norm();
                assert!(difference <= 10.0 * f64::EPSILON);
                // Into a real vector the sum of two conjugate parts is real; else only its real part is kept.
                let factor = Complex64::new(0.5 + i as f64, if conjugate { -0.25 } else { 0.25 });
                if conjugate && !is_complex(i) {
                    continue;
                }
                factors.add(i, conjugate, j, factor);
                for (target, x) in expected[j].iter_mut().zip(&left[i]) {
                    *target += factor * if conjugate { x.conj() } else { *x };
                }
            }
        }
        combined.add_combinations(&factors);
        for (j, expected) in expected.iter().enumerate() {
            for (found, wanted) in combined.vector(j).iter().zip(expected) {
                let part = if is_complex(j) { wanted.im } else { 0.0 };
                let difference = (found - Complex64::new(wanted.re, part)).norm();
                // Sums of up to six terms of modulus below 4.
                assert!(difference <= 100.0 * f64::EPSILON);
            }
        }
    }
}
