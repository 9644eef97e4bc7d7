//! Dense eigenproblems: the one file that knows the low-level calls of faer for them.
//!
//! The library neither balances nor reports a sweep that did not converge; callers check residuals.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{
    ComputeEigenvectors, EvdParams, SelfAdjointEvdParams, evd_real, evd_scratch, self_adjoint_evd,
    self_adjoint_evd_scratch,
};
use faer::{Auto, Mat, Par, Spec};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::linalg::components::components;
use crate::linalg::dense::{Factors, is_symmetric, viewed};
use crate::linalg::eigenpair::{EigenPair, norm};
use crate::linalg::schur::{self, SMALL};

/// An entry this small beside the diagonal ones of its row and column is a hundredth of their rounding. It can't
/// be seen in the eigenvalues, but balancing would stretch the vectors by the square root of its inverse.
const NEGLIGIBLE: f64 = 1e-2 * f64::EPSILON;

/// Distance of eigenvalues, relative to the largest modulus, below which rounding mixes their vectors.
const INDISTINCT: f64 = 1e-11;
/// Eigenvalues that are that close have separate eigenvectors if the condition of their vectors is below this.
const SEMISIMPLE: f64 = 1e4;

/// Eigenpairs of a real matrix, one of each conjugate pair: the one with positive imaginary part. Diagonal blocks that
/// no entry connects are solved apart.
pub(crate) fn real_matrix(matrix: &DMatrix<f64>) -> Vec<EigenPair> {
    let root = matrix.diagonal().map(|a| a.abs().sqrt());
    let significant = matrix.map_with_location(|i, j, entry| {
        if entry.abs() > NEGLIGIBLE * (root[i] * root[j]) { entry } else { 0.0 }
    });
    let blocks = connected_blocks(&significant);
    if blocks.len() == 1 {
        return connected(significant);
    }
    let scattered = |part: &[Complex64], block: &[usize]| {
        let mut whole = vec![Complex64::default(); matrix.nrows()];
        block.iter().zip(part).for_each(|(&k, &value)| whole[k] = value);
        whole
    };
    let of_block = |block: Vec<usize>| {
        let pairs = connected(significant.select_rows(&block).select_columns(&block));
        pairs.into_iter().map(move |EigenPair { value, right, left }| EigenPair {
            value,
            right: scattered(&right, &block),
            left: scattered(&left, &block),
        })
    };
    blocks.into_iter().flat_map(of_block).collect()
}

/// Eigenpairs of one block.
fn connected(matrix: DMatrix<f64>) -> Vec<EigenPair> {
    if matrix.nrows() == 1 {
        let unit = vec![Complex64::from(1.0)];
        return vec![EigenPair { value: matrix[0].into(), right: unit.clone(), left: unit }];
    }
    if is_symmetric(&matrix) { symmetric_block(&matrix) } else { general_block(matrix) }
}

/// Index sets that no nonzero entry connects.
fn connected_blocks(matrix: &DMatrix<f64>) -> Vec<Vec<usize>> {
    components(matrix.nrows(), |i, found| {
        let connected = |&j: &usize| matrix[(i, j)] != 0.0 || matrix[(j, i)] != 0.0;
        found.extend((0..matrix.nrows()).filter(connected));
    })
}

fn symmetric_block(matrix: &DMatrix<f64>) -> Vec<EigenPair> {
    let n = matrix.nrows();
    let (values, vectors) = symmetric(matrix)
        .unwrap_or_else(|| (DVector::from_element(n, f64::NAN), DMatrix::zeros(n, n)));
    (0..n)
        .map(|j| {
            let vector: Vec<Complex64> = vectors.column(j).iter().map(|&x| x.into()).collect();
            EigenPair { value: values[j].into(), right: vector.clone(), left: vector }
        })
        .collect()
}

/// Eigenvalues of a symmetric matrix and its orthonormal eigenvectors, columns; None without convergence.
pub(crate) fn symmetric(matrix: &DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = matrix.nrows();
    let mut values = Diag::<f64>::zeros(n);
    let mut vectors = Mat::<f64>::zeros(n, n);
    // The library solves large matrices by divide and conquer until the secular equation, whose unit is the inverse of
    // that of the matrix, changes by no more than 1e-16: with entries of 1e12 only four digits are right. The QR
    // iteration stops on a relative change.
    let auto = <SelfAdjointEvdParams as Auto<f64>>::auto();
    let params: Spec<SelfAdjointEvdParams, f64> =
        Spec::new(SelfAdjointEvdParams { recursion_threshold: usize::MAX, ..auto });
    let mut memory = MemBuffer::new(self_adjoint_evd_scratch::<f64>(
        n,
        ComputeEigenvectors::Yes,
        Par::Seq,
        params,
    ));
    let converged = self_adjoint_evd(
        viewed(matrix),
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    converged.ok()?;
    Some((DVector::from_fn(n, |j, _| values[j]), DMatrix::from_fn(n, n, |i, j| vectors[(i, j)])))
}

fn general_block(mut matrix: DMatrix<f64>) -> Vec<EigenPair> {
    let scale = balance(&mut matrix);
    let small = matrix.nrows() <= SMALL;
    let mut pairs = if small { small_block(&matrix) } else { large_block(&matrix) };
    for pair in &mut pairs {
        pair.right.iter_mut().zip(&scale).for_each(|(z, d)| *z *= d);
        pair.left.iter_mut().zip(&scale).for_each(|(z, d)| *z /= d);
    }
    biorthogonal(&mut pairs);
    pairs
}

/// Makes the left vectors of values that rounding can't tell apart bi-orthogonal to the right ones. The solver
/// leaves some basis X, Y of both invariant subspaces; `Y (X' Y)^-1` is the one with `Y' X = 1`. If a cluster is nearly
/// defective, X' Y cannot be inverted: the vectors stay as they are, and their condition shows it.
fn biorthogonal(pairs: &mut [EigenPair]) {
    let largest = pairs.iter().map(|pair| pair.value.norm_sqr()).fold(0.0, f64::max);
    let near = |p: Complex64, q: Complex64| (p - q).norm_sqr() <= INDISTINCT.powi(2) * largest;
    let apart = |i: usize| pairs[..i].iter().all(|other| !near(other.value, pairs[i].value));
    if (0..pairs.len()).all(apart) {
        return;
    }
    let mut open: Vec<usize> = (0..pairs.len()).collect();
    while let Some(seed) = open.pop() {
        let mut cluster = vec![seed];
        let mut next = 0;
        while next < cluster.len() {
            let value = pairs[cluster[next]].value;
            let (close, far): (Vec<_>, _) =
                open.iter().partition(|&&k| near(pairs[k].value, value));
            (open, next) = (far, next + 1);
            cluster.extend(close);
        }
        let size = cluster.len();
        if size == 1 {
            continue;
        }
        let basis = |of: fn(&EigenPair) -> &Vec<Complex64>| {
            let columns = cluster.iter().flat_map(|&k| of(&pairs[k]).iter().copied());
            DMatrix::from_iterator(pairs[seed].left.len(), size, columns)
        };
        let (right, left) = (basis(|pair| &pair.right), basis(|pair| &pair.left));
        let weights = Factors::new(right.tr_mul(&left)).solve(DMatrix::identity(size, size));
        let lefts = left * weights;
        let lefts: Vec<Vec<Complex64>> =
            lefts.column_iter().map(|left| left.iter().copied().collect()).collect();
        let condition = |(left, &k): (&Vec<Complex64>, &usize)| norm(left) * norm(&pairs[k].right);
        // A comparison that also fails for NaN.
        if lefts.iter().zip(&cluster).map(condition).all(|condition| condition <= SEMISIMPLE) {
            cluster.into_iter().zip(lefts).for_each(|(k, left)| pairs[k].left = left);
        }
    }
}

fn small_block(matrix: &DMatrix<f64>) -> Vec<EigenPair> {
    let n = matrix.nrows();
    // Row by row, as it is reduced: the columns of the transposed. Those of the rotations are Schur vectors.
    let (mut form, mut rotation) = (matrix.transpose(), DMatrix::zeros(n, n));
    let mut values = vec![Complex64::default(); n];
    schur::hessenberg(n, form.as_mut_slice(), Some(rotation.as_mut_slice()));
    let converged =
        schur::francis(n, form.as_mut_slice(), Some(rotation.as_mut_slice()), &mut values);
    let smallest = (f64::EPSILON * form.amax()).max(f64::MIN_POSITIVE);
    let whole = |vector: &[Complex64], from: usize, to: usize| -> Vec<Complex64> {
        let mut whole = vec![Complex64::default(); n];
        for (column, z) in rotation.as_slice().chunks_exact(n).zip(vector).take(to).skip(from) {
            if z.im == 0.0 {
                whole.iter_mut().zip(column).for_each(|(sum, q)| sum.re += q * z.re);
            } else {
                whole.iter_mut().zip(column).for_each(|(sum, q)| *sum += q * z);
            }
        }
        whole
    };
    let mut pairs = Vec::with_capacity(n);
    let mut vector = vec![Complex64::default(); n];
    let mut first = 0;
    while first < n {
        let is_pair = values[first].im != 0.0;
        let last = if is_pair { first + 1 } else { first };
        let value = if converged { values[first] } else { f64::NAN.into() };
        let t = |i: usize, j: usize| form[(j, i)];
        schur::quasi_triangular_vector(t, value, last, is_pair, smallest, &mut vector);
        let right = whole(&vector, 0, last + 1);
        // The transposed matrix with both orders reversed is upper quasi-triangular as well.
        let flipped = |i: usize, j: usize| form[(n - 1 - i, n - 1 - j)];
        let corner = n - 1 - first;
        schur::quasi_triangular_vector(flipped, value, corner, is_pair, smallest, &mut vector);
        vector.reverse();
        pairs.push(EigenPair { value, right, left: whole(&vector, first, n) });
        first = last + 1;
    }
    pairs
}

/// Eigenvalues alone of a real matrix, both of each conjugate pair; NaN where the iteration failed.
pub(crate) fn values(mut matrix: DMatrix<f64>) -> Vec<Complex64> {
    let mut values = Vec::new();
    values_into(&mut matrix, &mut values);
    values
}

/// [`values`] of a matrix that may be overwritten, in place of those known before.
pub(crate) fn values_into(matrix: &mut DMatrix<f64>, values: &mut Vec<Complex64>) {
    let n = matrix.nrows();
    balance(matrix);
    if n > SMALL {
        *values = large_values(matrix, None);
        return;
    }
    values.resize(n, Complex64::default());
    // Row by row, as it is reduced.
    matrix.transpose_mut();
    schur::hessenberg(n, matrix.as_mut_slice(), None);
    if !schur::francis(n, matrix.as_mut_slice(), None, values) {
        values.fill(f64::NAN.into());
    }
}

/// Eigenvalues of a matrix, conjugates adjacent, +Im first; with `vectors`, its left and right ones are written to these, real and
/// imaginary part of a pair to two columns, left ones conjugated. NaN where the iteration failed.
fn large_values(matrix: &DMatrix<f64>, vectors: Option<[&mut Mat<f64>; 2]>) -> Vec<Complex64> {
    let n = matrix.nrows();
    let (mut re, mut im) = (Diag::<f64>::zeros(n), Diag::<f64>::zeros(n));
    let params: Spec<EvdParams, f64> = Spec::new(Auto::<f64>::auto());
    let wanted = if vectors.is_some() { ComputeEigenvectors::Yes } else { ComputeEigenvectors::No };
    let mut memory = MemBuffer::new(evd_scratch::<f64>(n, wanted, wanted, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    let [left, right] = match vectors {
        Some(vectors) => vectors.map(|vectors| Some(vectors.as_mut())),
        None => [None, None],
    };
    let (re_out, im_out) = (re.as_mut(), im.as_mut());
    let solved = evd_real(viewed(matrix), re_out, im_out, left, right, Par::Seq, stack, params);
    (0..n)
        .map(|j| if solved.is_ok() { Complex64::new(re[j], im[j]) } else { f64::NAN.into() })
        .collect()
}

fn large_block(matrix: &DMatrix<f64>) -> Vec<EigenPair> {
    let n = matrix.nrows();
    let [mut left, mut right] = [(); 2].map(|()| Mat::<f64>::zeros(n, n));
    let values = large_values(matrix, Some([&mut left, &mut right]));
    let mut pairs = Vec::with_capacity(n);
    let mut j = 0;
    while j < n {
        let value = values[j];
        let is_pair = value.im != 0.0 && j + 1 < n;
        let column = |vectors: &Mat<f64>, conjugate: f64| {
            (0..n)
                .map(|i| {
                    let imaginary = if is_pair { conjugate * vectors[(i, j + 1)] } else { 0.0 };
                    Complex64::new(vectors[(i, j)], imaginary)
                })
                .collect::<Vec<_>>()
        };
        let mut pair = EigenPair { value, right: column(&right, 1.0), left: column(&left, -1.0) };
        if pair.value.im < 0.0 {
            pair.value = pair.value.conj();
            pair.right.iter_mut().chain(&mut pair.left).for_each(|z| *z = z.conj());
        }
        pairs.push(pair);
        j += if is_pair { 2 } else { 1 };
    }
    pairs
}

/// Scales rows and columns by powers of two until their norms agree (Parlett and Reinsch 1969; norms
/// over off-diagonal entries). Returns d with `matrix := D^-1 matrix D`.
fn balance(matrix: &mut DMatrix<f64>) -> Vec<f64> {
    let n = matrix.nrows();
    let mut scale = vec![1.0; n];
    // Converges in two or three rounds; the bound only guards against cycling by rounding.
    for _ in 0..32 {
        let mut balanced = true;
        for i in 0..n {
            let (mut column, mut row) = (0.0, 0.0);
            for j in (0..n).filter(|&j| j != i) {
                column += matrix[(j, i)].abs();
                row += matrix[(i, j)].abs();
            }
            // Within a factor of four, where most rows are, balancing gains little.
            if column == 0.0 || row == 0.0 || (row < 4.0 * column && column < 4.0 * row) {
                continue;
            }
            let factor = (row / column).sqrt().log2().round().exp2();
            if (column * factor + row / factor) < 0.95 * (column + row) {
                balanced = false;
                scale[i] *= factor;
                matrix.column_mut(i).iter_mut().for_each(|a| *a *= factor);
                matrix.row_mut(i).iter_mut().for_each(|a| *a /= factor);
            }
        }
        if balanced {
            break;
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn residuals(matrix: &DMatrix<f64>, pair: &EigenPair) -> (f64, f64) {
        let relative = |matrix: DMatrix<f64>, vector: &[Complex64]| {
            let vector = DVector::from_column_slice(vector);
            let residual = matrix.map(Complex64::from) * &vector - &vector * pair.value;
            residual.norm() / (matrix.norm() * vector.norm())
        };
        (relative(matrix.clone(), &pair.right), relative(matrix.transpose(), &pair.left))
    }

    proptest::proptest! {
        /// Pins the library's conventions: left vectors conjugated, pairs in two columns, sizes 1 to 12.
        #[test]
        fn right_and_left_residuals(n in 1usize..12, seed in proptest::collection::vec(-1.0f64..1.0, 144)) {
            let matrix = DMatrix::from_column_slice(n, n, &seed[..n * n]);
            let pairs = real_matrix(&matrix);
            let count: usize = pairs.iter().map(|pair| if pair.value.im == 0.0 { 1 } else { 2 }).sum();
            proptest::prop_assert_eq!(count, n);
            for pair in &pairs {
                let (right, left) = residuals(&matrix, pair);
                // A backward-stable QR iteration leaves a modest multiple of n ulp.
                proptest::prop_assert!(right < 1e-14 * n as f64 && left < 1e-14 * n as f64);
            }
        }
    }

    /// The squares of what a sweep moves leave the range of numbers here, those of the entries do not yet.
    #[test]
    fn eigenvalues_of_matrices_of_extreme_units() {
        let entry =
            |i: usize, j: usize| ((9 * i + j + 1) as f64 * 12.9898).sin() * 43_758.545_3 % 1.0;
        for n in 3..10 {
            let plain = values(DMatrix::from_fn(n, n, entry));
            for unit in [1e-150, 1e-145, 1e145, 1e150] {
                let scaled = values(DMatrix::from_fn(n, n, |i, j| unit * entry(i, j)));
                for (found, expected) in scaled.iter().zip(&plain) {
                    let error = (found / unit - expected).norm();
                    assert!(error < 1e-13, "{error:e} of {expected} in units of {unit}");
                }
            }
        }
    }

    /// Chains of springs between two walls in any unit: `4 s sin^2(k pi / (2 n + 2))`.
    #[test]
    fn large_symmetric_matrices_of_any_unit() {
        for (n, unit) in [(150, 1e-20), (150, 1e12), (200, 1.0), (200, 1e20)] {
            let matrix = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
                0 => 2.0 * unit,
                1 => -unit,
                _ => 0.0,
            });
            for (k, pair) in (1..).zip(real_matrix(&matrix)) {
                let angle = k as f64 * std::f64::consts::FRAC_PI_2 / (n + 1) as f64;
                let exact = 4.0 * unit * angle.sin().powi(2);
                // A backward-stable iteration leaves some ulp of the largest value.
                assert!((pair.value - exact).norm() <= 1e-14 * 4.0 * unit, "{n} {unit:e}: {k}");
                assert!(residuals(&matrix, &pair).0 <= 1e-14, "{n} {unit:e}: {k}");
            }
        }
    }

    #[test]
    fn disconnected_blocks_are_solved_apart() {
        let matrix = DMatrix::from_row_slice(3, 3, &[2.0, 0.0, 1.0, 0.0, 5.0, 0.0, 1.0, 0.0, 2.0]);
        assert_eq!(connected_blocks(&matrix), vec![vec![0, 2], vec![1]]);
        let mut values: Vec<f64> = real_matrix(&matrix).iter().map(|pair| pair.value.re).collect();
        values.sort_by(f64::total_cmp);
        assert!(values.iter().zip([1.0, 3.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-15 * 8.0));
    }

    proptest::proptest! {
        /// Values alone are those of the pairs, below and above the size at which the solver changes.
        #[test]
        fn values_are_those_of_the_pairs(n in proptest::sample::select(vec![2usize, 6, 12, 31, 33, 40]), seed in 0u64..1000) {
            let mut state = seed.wrapping_mul(2).wrapping_add(1);
            let matrix = DMatrix::from_fn(n, n, |_, _| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            });
            let found = values(matrix.clone());
            for pair in real_matrix(&matrix) {
                let distance = found.iter().map(|z| (z - pair.value).norm()).fold(f64::INFINITY, f64::min);
                // Both are backward stable; the norm is about the square root of n.
                proptest::prop_assert!(distance <= 1e-14 * n as f64 * pair.condition());
            }
        }
    }

    /// `M^-1 K` with `K = 1` and a mass that is neither symmetric nor of distinct eigenvalues.
    #[test]
    fn vectors_of_repeated_values_are_biorthogonal() {
        for n in [4, SMALL + 8] {
            let pairs = real_matrix(&DMatrix::from_fn(n, n, |i, j| match i {
                _ if i == j => 1.0,
                0 => 0.3,
                _ => 0.6,
            }));
            for (i, p) in pairs.iter().enumerate() {
                for (j, q) in pairs.iter().enumerate().filter(|&(j, _)| j != i) {
                    let product: Complex64 = p.right.iter().zip(&q.left).map(|(x, y)| x * y).sum();
                    let relative = product.norm() / (norm(&p.right) * norm(&q.left));
                    assert!(relative < 1e-12, "{n}: {i}, {j}: {relative:e}");
                }
            }
        }
    }

    #[test]
    fn a_defective_block_is_solved_and_known_by_its_condition() {
        let pairs = real_matrix(&DMatrix::from_row_slice(
            3,
            3,
            &[2.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 2.0],
        ));
        // The eigenvalue of a triple Jordan block is uncertain by the cube root of rounding.
        assert!(
            pairs.iter().all(|pair| (pair.value - 2.0).norm() < 1e-5 && !(pair.condition() < 1e8))
        );
    }
}
