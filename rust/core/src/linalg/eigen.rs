//! Dense eigenproblems: the one file that knows the linear-algebra library's low-level calls.
//!
//! The library neither balances nor reports a sweep that did not converge; callers check residuals.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{
    ComputeEigenvectors, EvdParams, SelfAdjointEvdParams, evd_real, evd_scratch, self_adjoint_evd,
    self_adjoint_evd_scratch,
};
use faer::linalg::solvers::ShapeCore;
use faer::prelude::Solve;
use faer::{Auto, Mat, Par, Spec};
use num_complex::Complex64;

use crate::linalg::banded_vectors::Banded;
use crate::linalg::eigenpair::{EigenPair, norm};
use crate::linalg::schur::{self, SMALL};

/// An entry this small beside the diagonal ones of its row and column is a hundredth of their rounding. It can't
/// be seen in the eigenvalues, but balancing would stretch the vectors by the square root of its inverse.
const NEGLIGIBLE: f64 = 1e-2 * f64::EPSILON;

/// Distance of eigenvalues, relative to the largest modulus, below which rounding mixes their vectors.
const INDISTINCT: f64 = 1e-11;
/// Condition of the vectors of such values up to which they span a space of their own each.
const SEMISIMPLE: f64 = 1e4;

/// Eigenpairs of a real matrix (row-major), one of each conjugate pair: the one with positive
/// imaginary part. Diagonal blocks that no entry connects are solved apart.
pub(crate) fn real_matrix(size: usize, matrix: &[f64]) -> Vec<EigenPair> {
    let mut pairs = Vec::with_capacity(size);
    let diagonal: Vec<f64> = (0..size).map(|i| matrix[i * size + i].abs().sqrt()).collect();
    let mut matrix = matrix.to_vec();
    for (row, own) in matrix.chunks_exact_mut(size.max(1)).zip(&diagonal) {
        for (entry, other) in row.iter_mut().zip(&diagonal) {
            if !(entry.abs() > NEGLIGIBLE * (own * other)) {
                *entry = 0.0;
            }
        }
    }
    let blocks = connected_blocks(size, &matrix);
    if blocks.len() == 1 {
        return connected(size, matrix);
    }
    for block in blocks {
        let n = block.len();
        let part = (0..n * n).map(|k| matrix[block[k / n] * size + block[k % n]]).collect();
        for pair in connected(n, part) {
            let scatter = |part: &[Complex64]| {
                let mut whole = vec![Complex64::from(0.0); size];
                block.iter().zip(part).for_each(|(&k, &value)| whole[k] = value);
                whole
            };
            pairs.push(EigenPair {
                value: pair.value,
                right: scatter(&pair.right),
                left: scatter(&pair.left),
            });
        }
    }
    pairs
}

/// Eigenpairs of one block.
fn connected(n: usize, matrix: Vec<f64>) -> Vec<EigenPair> {
    if n == 1 {
        let unit = vec![Complex64::from(1.0)];
        return vec![EigenPair { value: matrix[0].into(), right: unit.clone(), left: unit }];
    }
    let symmetric = (0..n).all(|i| (0..i).all(|j| matrix[i * n + j] == matrix[j * n + i]));
    if symmetric { symmetric_block(n, &matrix) } else { general_block(n, matrix) }
}

/// Index sets that no nonzero entry connects, each ascending.
fn connected_blocks(size: usize, matrix: &[f64]) -> Vec<Vec<usize>> {
    let mut block_of = vec![usize::MAX; size];
    let mut blocks = Vec::new();
    for seed in 0..size {
        if block_of[seed] != usize::MAX {
            continue;
        }
        let mut members = vec![seed];
        block_of[seed] = blocks.len();
        let mut next = 0;
        while next < members.len() {
            let i = members[next];
            next += 1;
            for j in 0..size {
                let connected = matrix[i * size + j] != 0.0 || matrix[j * size + i] != 0.0;
                if connected && block_of[j] == usize::MAX {
                    block_of[j] = blocks.len();
                    members.push(j);
                }
            }
        }
        members.sort_unstable();
        blocks.push(members);
    }
    blocks
}

fn symmetric_block(n: usize, matrix: &[f64]) -> Vec<EigenPair> {
    let matrix = row_major(n, n, matrix);
    let mut values = Diag::<f64>::zeros(n);
    let mut vectors = Mat::<f64>::zeros(n, n);
    let params: Spec<SelfAdjointEvdParams, f64> = Spec::new(Auto::<f64>::auto());
    let mut memory = MemBuffer::new(self_adjoint_evd_scratch::<f64>(
        n,
        ComputeEigenvectors::Yes,
        Par::Seq,
        params,
    ));
    let converged = self_adjoint_evd(
        matrix.as_ref(),
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    (0..n)
        .map(|j| {
            let value = if converged.is_ok() { values[j] } else { f64::NAN };
            let vector: Vec<Complex64> = (0..n).map(|i| Complex64::from(vectors[(i, j)])).collect();
            EigenPair { value: Complex64::from(value), right: vector.clone(), left: vector }
        })
        .collect()
}

fn general_block(n: usize, mut matrix: Vec<f64>) -> Vec<EigenPair> {
    let scale = balance(n, &mut matrix);
    let mut pairs = if n <= SMALL { small_block(n, matrix) } else { large_block(n, &matrix) };
    for pair in &mut pairs {
        pair.right.iter_mut().zip(&scale).for_each(|(z, d)| *z *= d);
        pair.left.iter_mut().zip(&scale).for_each(|(z, d)| *z /= d);
    }
    biorthogonal(&mut pairs);
    pairs
}

/// Makes the left vectors of values that rounding can't tell apart bi-orthogonal to the right ones. The solver
/// leaves any basis X, Y of both invariant subspaces; `Y (X' Y)^-1` is the one with `Y' X = 1`. Of a cluster that
/// is nearly defective X' Y can't be inverted, and the vectors stay, with their condition to tell.
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
        let gram: Vec<Complex64> = (0..size * size)
            .map(|k| {
                let (right, left) =
                    (&pairs[cluster[k / size]].right, &pairs[cluster[k % size]].left);
                right.iter().zip(left).map(|(x, y)| x * y).sum()
            })
            .collect();
        let factors = ComplexFactors::new(size, &gram);
        let lefts: Vec<Vec<Complex64>> = (0..size)
            .map(|j| {
                let mut unit = vec![Complex64::default(); size];
                unit[j] = Complex64::from(1.0);
                let weights = factors.solve(&unit);
                let mut left = vec![Complex64::default(); pairs[seed].left.len()];
                for (weight, &k) in weights.iter().zip(&cluster) {
                    left.iter_mut().zip(&pairs[k].left).for_each(|(sum, y)| *sum += weight * y);
                }
                left
            })
            .collect();
        let condition = |(left, &k): (&Vec<Complex64>, &usize)| norm(left) * norm(&pairs[k].right);
        // A comparison that also fails for NaN.
        if lefts.iter().zip(&cluster).map(condition).all(|condition| condition <= SEMISIMPLE) {
            cluster.into_iter().zip(lefts).for_each(|(k, left)| pairs[k].left = left);
        }
    }
}

fn small_block(n: usize, mut matrix: Vec<f64>) -> Vec<EigenPair> {
    let mut rotation = vec![0.0; n * n];
    let mut values = vec![Complex64::default(); n];
    schur::hessenberg(n, &mut matrix, Some(&mut rotation));
    let converged = schur::francis(n, &mut matrix, Some(&mut rotation), &mut values);
    let size = matrix.iter().map(|a| a.abs()).fold(0.0, f64::max);
    let smallest = (f64::EPSILON * size).max(f64::MIN_POSITIVE);
    let whole = |vector: &[Complex64], from: usize, to: usize| -> Vec<Complex64> {
        let mut whole = vec![Complex64::default(); n];
        for (row, z) in rotation.chunks_exact(n).zip(vector).take(to).skip(from) {
            if z.im == 0.0 {
                whole.iter_mut().zip(row).for_each(|(sum, q)| sum.re += q * z.re);
            } else {
                whole.iter_mut().zip(row).for_each(|(sum, q)| *sum += q * z);
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
        let t = |i: usize, j: usize| matrix[i * n + j];
        schur::quasi_triangular_vector(t, value, last, is_pair, smallest, &mut vector);
        let right = whole(&vector, 0, last + 1);
        // The transposed matrix with both orders reversed is upper quasi-triangular as well.
        let flipped = |i: usize, j: usize| matrix[(n - 1 - j) * n + n - 1 - i];
        let corner = n - 1 - first;
        schur::quasi_triangular_vector(flipped, value, corner, is_pair, smallest, &mut vector);
        vector.reverse();
        pairs.push(EigenPair { value, right, left: whole(&vector, first, n) });
        first = last + 1;
    }
    pairs
}

/// Eigenvalues alone of a real matrix of at most [`SMALL`] rows, or None if the iteration failed.
pub(crate) fn small_values(n: usize, matrix: &mut [f64], values: &mut [Complex64]) -> Option<()> {
    balance(n, matrix);
    schur::hessenberg(n, matrix, None);
    schur::francis(n, matrix, None, values).then_some(())
}

/// Eigenvalues alone of a real matrix of any size (row-major), both of each conjugate pair.
pub(crate) fn values(n: usize, matrix: &[f64]) -> Vec<Complex64> {
    let mut matrix = matrix.to_vec();
    let mut values = vec![Complex64::default(); n];
    if n <= SMALL {
        if small_values(n, &mut matrix, &mut values).is_none() {
            values.fill(f64::NAN.into());
        }
        return values;
    }
    balance(n, &mut matrix);
    large_values(n, &matrix)
}

fn large_values(n: usize, matrix: &[f64]) -> Vec<Complex64> {
    let matrix = row_major(n, n, matrix);
    let (mut re, mut im) = (Diag::<f64>::zeros(n), Diag::<f64>::zeros(n));
    let params: Spec<EvdParams, f64> = Spec::new(Auto::<f64>::auto());
    let none = ComputeEigenvectors::No;
    let mut memory = MemBuffer::new(evd_scratch::<f64>(n, none, none, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    let solved =
        evd_real(matrix.as_ref(), re.as_mut(), im.as_mut(), None, None, Par::Seq, stack, params);
    (0..n)
        .map(|j| if solved.is_ok() { Complex64::new(re[j], im[j]) } else { f64::NAN.into() })
        .collect()
}

fn large_block(n: usize, matrix: &[f64]) -> Vec<EigenPair> {
    if let Some(banded) = Banded::new(n, matrix)
        && let Some(pairs) = banded.pairs(&large_values(n, matrix))
    {
        return pairs;
    }
    let matrix = row_major(n, n, matrix);
    let mut re = Diag::<f64>::zeros(n);
    let mut im = Diag::<f64>::zeros(n);
    let mut left = Mat::<f64>::zeros(n, n);
    let mut right = Mat::<f64>::zeros(n, n);
    let params: Spec<EvdParams, f64> = Spec::new(Auto::<f64>::auto());
    let mut memory = MemBuffer::new(evd_scratch::<f64>(
        n,
        ComputeEigenvectors::Yes,
        ComputeEigenvectors::Yes,
        Par::Seq,
        params,
    ));
    let converged = evd_real(
        matrix.as_ref(),
        re.as_mut(),
        im.as_mut(),
        Some(left.as_mut()),
        Some(right.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    )
    .is_ok();
    let mut pairs = Vec::with_capacity(n);
    let mut j = 0;
    while j < n {
        let is_pair = im[j] != 0.0 && j + 1 < n;
        // Vectors of a pair lie in two columns, real and imaginary part; left ones come conjugated.
        let column = |vectors: &Mat<f64>, conjugate: f64| {
            (0..n)
                .map(|i| {
                    let imaginary = if is_pair { conjugate * vectors[(i, j + 1)] } else { 0.0 };
                    Complex64::new(vectors[(i, j)], imaginary)
                })
                .collect::<Vec<_>>()
        };
        let mut pair = EigenPair {
            value: if converged { Complex64::new(re[j], im[j]) } else { Complex64::from(f64::NAN) },
            right: column(&right, 1.0),
            left: column(&left, -1.0),
        };
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
fn balance(n: usize, matrix: &mut [f64]) -> Vec<f64> {
    let mut scale = vec![1.0; n];
    // Converges in two or three rounds; the bound only guards against cycling by rounding.
    for _ in 0..32 {
        let mut balanced = true;
        for i in 0..n {
            let (mut column, mut row) = (0.0, 0.0);
            for j in (0..n).filter(|&j| j != i) {
                column += matrix[j * n + i].abs();
                row += matrix[i * n + j].abs();
            }
            // Within a factor of four little is gained, and most rows are.
            if column == 0.0 || row == 0.0 || (row < 4.0 * column && column < 4.0 * row) {
                continue;
            }
            let factor = (row / column).sqrt().log2().round().exp2();
            if (column * factor + row / factor) < 0.95 * (column + row) {
                balanced = false;
                scale[i] *= factor;
                for j in 0..n {
                    matrix[j * n + i] *= factor;
                    matrix[i * n + j] /= factor;
                }
            }
        }
        if balanced {
            break;
        }
    }
    scale
}

/// Lower Cholesky factor of a symmetric matrix (row-major), or the first pivot that is not positive
/// (more than rounding of its diagonal entry) with its index.
pub(crate) fn cholesky(n: usize, matrix: &[f64]) -> Result<Vec<f64>, (usize, f64)> {
    let mut factor = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| factor[i * n + k] * factor[j * n + k]).sum();
            let rest = matrix[i * n + j] - dot;
            if i != j {
                factor[i * n + j] = rest / factor[j * n + j];
            } else if rest > 1e-14 * matrix[i * n + i].abs() {
                factor[i * n + i] = rest.sqrt();
            } else {
                return Err((i, rest));
            }
        }
    }
    Ok(factor)
}

/// `G^-1 matrix` for a lower triangular G; all row-major.
pub(crate) fn lower_solve(n: usize, factor: &[f64], matrix: &[f64]) -> Vec<f64> {
    let mut solution = matrix.to_vec();
    for i in 0..n {
        for k in 0..i {
            let entry = factor[i * n + k];
            for j in 0..n {
                solution[i * n + j] -= entry * solution[k * n + j];
            }
        }
        for j in 0..n {
            solution[i * n + j] /= factor[i * n + i];
        }
    }
    solution
}

/// `G^-T vector` for a lower triangular G.
pub(crate) fn lower_transposed_solve(factor: &[f64], vector: &[Complex64]) -> Vec<Complex64> {
    let n = vector.len();
    let mut solution = vector.to_vec();
    for i in (0..n).rev() {
        for k in i + 1..n {
            let above = solution[k];
            solution[i] -= factor[k * n + i] * above;
        }
        solution[i] /= factor[i * n + i];
    }
    solution
}

/// `matrix^-1 rhs`, both n by n and row-major.
pub(crate) fn solve(n: usize, matrix: &[f64], rhs: &[f64]) -> Vec<f64> {
    Factors::new(n, matrix).solve(rhs)
}

/// A real matrix (n by n, row-major) for many solutions with it.
#[derive(Debug)]
pub(crate) struct Factors(faer::linalg::solvers::PartialPivLu<f64>);

impl Factors {
    pub fn new(n: usize, matrix: &[f64]) -> Self {
        Self(row_major(n, n, matrix).partial_piv_lu())
    }

    /// `matrix^-1 rhs`, n rows, row-major.
    pub fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        let n = self.0.nrows();
        let columns = rhs.len() / n.max(1);
        let solution = self.0.solve(row_major(n, columns, rhs));
        (0..rhs.len()).map(|k| solution[(k / columns, k % columns)]).collect()
    }

    /// `matrix^-T vector`
    pub fn transposed_solve(&self, vector: &[Complex64]) -> Vec<Complex64> {
        let part = |i: usize, j: usize| if j == 0 { vector[i].re } else { vector[i].im };
        let solution = self.0.solve_transpose(Mat::from_fn(vector.len(), 2, part));
        (0..vector.len()).map(|i| Complex64::new(solution[(i, 0)], solution[(i, 1)])).collect()
    }
}

/// `matrix^-1 rhs` for a complex matrix (n by n, row-major) and right-hand sides one after the other.
#[derive(Debug)]
pub(crate) struct ComplexFactors(faer::linalg::solvers::PartialPivLu<Complex64>);

impl ComplexFactors {
    pub fn new(n: usize, matrix: &[Complex64]) -> Self {
        Self(Mat::from_fn(n, n, |i, j| matrix[i * n + j]).partial_piv_lu())
    }

    pub fn solve(&self, rhs: &[Complex64]) -> Vec<Complex64> {
        let solution = self.0.solve(Mat::from_fn(rhs.len(), 1, |i, _| rhs[i]));
        (0..rhs.len()).map(|i| solution[(i, 0)]).collect()
    }

    /// `matrix^-T rhs`
    pub fn transposed_solve(&self, rhs: &[Complex64]) -> Vec<Complex64> {
        let solution = self.0.solve_transpose(Mat::from_fn(rhs.len(), 1, |i, _| rhs[i]));
        (0..rhs.len()).map(|i| solution[(i, 0)]).collect()
    }
}

/// Sign of the determinant (row-major), 0 where it is lost in rounding of the equilibrated rows.
pub(crate) fn determinant_sign(n: usize, matrix: &[f64]) -> f64 {
    eliminate(n, &mut matrix.to_vec(), &mut vec![0.0; n])
}

/// Overwrites `rhs` by `matrix^-1 rhs` and the matrix (row-major) by what elimination leaves of it; whether the matrix is
/// regular. In place, without the overhead of a factorization: of a small matrix it takes a part of a microsecond.
pub(crate) fn solve_in_place(n: usize, matrix: &mut [f64], rhs: &mut [f64]) -> bool {
    if eliminate(n, matrix, rhs) == 0.0 {
        return false;
    }
    for i in (0..n).rev() {
        let row = &matrix[i * n..(i + 1) * n];
        let known: f64 = row[i + 1..].iter().zip(&rhs[i + 1..]).map(|(a, x)| a * x).sum();
        rhs[i] = (rhs[i] - known) / row[i];
    }
    true
}

/// Elimination with partial pivoting of the equilibrated rows: an upper triangle stays. Returns the sign of the
/// determinant, 0 where it is lost in rounding.
fn eliminate(n: usize, matrix: &mut [f64], rhs: &mut [f64]) -> f64 {
    for (row, value) in matrix.chunks_exact_mut(n.max(1)).zip(&mut *rhs) {
        let largest = row.iter().map(|a| a.abs()).fold(0.0, f64::max);
        row.iter_mut().for_each(|a| *a /= largest);
        *value /= largest;
    }
    let mut sign = 1.0;
    for k in 0..n {
        let size = |i: usize| matrix[i * n + k].abs();
        let pivot = (k..n).fold(k, |best, i| if size(i) > size(best) { i } else { best });
        // NaN, from a row of zeros, is lost as well.
        if !(size(pivot) > f64::EPSILON * n as f64) {
            return 0.0;
        }
        if pivot != k {
            let (above, below) = matrix.split_at_mut(pivot * n);
            above[k * n..(k + 1) * n].swap_with_slice(&mut below[..n]);
            rhs.swap(pivot, k);
            sign = -sign;
        }
        let (above, below) = matrix.split_at_mut((k + 1) * n);
        let source = &above[k * n + k..];
        sign *= source[0].signum();
        for (i, row) in below.chunks_exact_mut(n).enumerate() {
            let factor = row[k] / source[0];
            row[k..].iter_mut().zip(source).for_each(|(a, b)| *a -= factor * b);
            rhs[k + 1 + i] -= factor * rhs[k];
        }
    }
    sign
}

/// Size up to which a matrix is eliminated with complete pivoting.
const COMPLETE_PIVOTING: usize = 200;

/// Smallest pivot of elimination over the largest one: 0 for a singular matrix. With complete pivoting, but for
/// matrices so large that only partial pivoting is quick.
pub(crate) fn smallest_relative_pivot(n: usize, matrix: &[f64]) -> f64 {
    if n == 0 {
        return 1.0;
    }
    let matrix = row_major(n, n, matrix);
    let diagonal = if n <= COMPLETE_PIVOTING {
        matrix.full_piv_lu().U().diagonal().column_vector().to_owned()
    } else {
        matrix.partial_piv_lu().U().diagonal().column_vector().to_owned()
    };
    let pivots: Vec<f64> = diagonal.iter().map(|pivot| pivot.abs()).collect();
    let largest = pivots.iter().copied().fold(0.0, f64::max);
    let smallest = pivots.iter().copied().fold(f64::INFINITY, f64::min);
    if largest > 0.0 { smallest / largest } else { 0.0 }
}

fn row_major(rows: usize, columns: usize, entries: &[f64]) -> Mat<f64> {
    Mat::from_fn(rows, columns, |i, j| entries[i * columns + j])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eigenpair::norm;

    fn residuals(n: usize, matrix: &[f64], pair: &EigenPair) -> (f64, f64) {
        let norm_matrix = matrix.iter().map(|a| a * a).sum::<f64>().sqrt();
        let right: Vec<Complex64> = (0..n)
            .map(|i| {
                (0..n).map(|j| matrix[i * n + j] * pair.right[j]).sum::<Complex64>()
                    - pair.value * pair.right[i]
            })
            .collect();
        let left: Vec<Complex64> = (0..n)
            .map(|j| {
                (0..n).map(|i| matrix[i * n + j] * pair.left[i]).sum::<Complex64>()
                    - pair.value * pair.left[j]
            })
            .collect();
        (
            norm(&right) / (norm_matrix * norm(&pair.right)),
            norm(&left) / (norm_matrix * norm(&pair.left)),
        )
    }

    proptest::proptest! {
        /// Pins the library's conventions: left vectors conjugated, pairs in two columns, sizes 1 to 12.
        #[test]
        fn right_and_left_residuals(n in 1usize..12, seed in proptest::collection::vec(-1.0f64..1.0, 144)) {
            let matrix = &seed[..n * n];
            let pairs = real_matrix(n, matrix);
            let count: usize = pairs.iter().map(|pair| if pair.value.im == 0.0 { 1 } else { 2 }).sum();
            proptest::prop_assert_eq!(count, n);
            for pair in &pairs {
                let (right, left) = residuals(n, matrix, pair);
                // A backward-stable QR iteration leaves a modest multiple of n ulp.
                proptest::prop_assert!(right < 1e-14 * n as f64 && left < 1e-14 * n as f64);
            }
        }
    }

    #[test]
    fn disconnected_blocks_are_solved_apart() {
        let matrix = [2.0, 0.0, 1.0, 0.0, 5.0, 0.0, 1.0, 0.0, 2.0];
        assert_eq!(connected_blocks(3, &matrix), vec![vec![0, 2], vec![1]]);
        let mut values: Vec<f64> =
            real_matrix(3, &matrix).iter().map(|pair| pair.value.re).collect();
        values.sort_by(f64::total_cmp);
        assert!(values.iter().zip([1.0, 3.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-15 * 8.0));
    }

    proptest::proptest! {
        /// Values alone are those of the pairs, below and above the size at which the solver changes.
        #[test]
        fn values_are_those_of_the_pairs(n in proptest::sample::select(vec![2usize, 6, 12, 31, 33, 40]), seed in 0u64..1000) {
            let mut state = seed.wrapping_mul(2).wrapping_add(1);
            let matrix: Vec<f64> = (0..n * n)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
                })
                .collect();
            let found = values(n, &matrix);
            for pair in real_matrix(n, &matrix) {
                let distance = found.iter().map(|z| (z - pair.value).norm()).fold(f64::INFINITY, f64::min);
                // Both are backward stable; the norm is about the square root of n.
                proptest::prop_assert!(distance <= 1e-14 * n as f64 * pair.condition());
            }
        }

        #[test]
        fn determinant_signs_follow_the_eigenvalues(shift in -3.0f64..3.0) {
            // Rotated by 1 rad, eigenvalues 1 - shift and 2 - shift.
            let (sin, cos) = 1.0f64.sin_cos();
            let matrix = [
                cos * cos + 2.0 * sin * sin - shift, -sin * cos,
                -sin * cos, sin * sin + 2.0 * cos * cos - shift,
            ];
            let expected = ((1.0 - shift) * (2.0 - shift)).signum();
            proptest::prop_assume!((1.0 - shift).abs().min((2.0 - shift).abs()) > 1e-12);
            proptest::prop_assert_eq!(determinant_sign(2, &matrix), expected);
        }
    }

    #[test]
    fn a_lost_determinant_has_no_sign() {
        assert_eq!(determinant_sign(2, &[1.0, 2.0, 2.0, 4.0]), 0.0);
        assert_eq!(determinant_sign(2, &[0.0, 0.0, 2.0, 4.0]), 0.0);
    }

    /// `M^-1 K` with `K = 1` and a mass that is neither symmetric nor of distinct eigenvalues.
    #[test]
    fn vectors_of_repeated_values_are_biorthogonal() {
        for n in [4, SMALL + 8] {
            let entry = |k: usize| match (k / n, k % n) {
                (i, j) if i == j => 1.0,
                (0, _) => 0.3,
                _ => 0.6,
            };
            let matrix: Vec<f64> = (0..n * n).map(entry).collect();
            let pairs = real_matrix(n, &matrix);
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
        let pairs = real_matrix(3, &[2.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 2.0]);
        // The eigenvalue of a triple Jordan block is uncertain by the cube root of rounding.
        assert!(
            pairs.iter().all(|pair| (pair.value - 2.0).norm() < 1e-5 && !(pair.condition() < 1e8))
        );
    }
}
