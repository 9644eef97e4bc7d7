//! Eigenvalues of small matrices by `linalg/schur.rs` and by nalgebra: time, and iterations that fail.
//!
//! `cargo bench --package stickslip-core --bench small_schur`

use std::hint::black_box;
use std::time::Instant;

use nalgebra::DMatrix;
use nalgebra::linalg::Schur;
use num_complex::Complex64;

#[allow(dead_code)]
#[path = "../src/linalg/schur.rs"]
mod schur;

/// Rounds of which the quickest counts.
const ROUNDS: usize = 9;
/// Sweeps per row after which nalgebra's iteration counts as failed.
const SWEEPS: usize = 60;

fn own(matrix: &DMatrix<f64>) -> bool {
    let n = matrix.nrows();
    let mut rows = matrix.transpose();
    let mut values = vec![Complex64::default(); n];
    schur::hessenberg(n, rows.as_mut_slice(), None);
    let converged = schur::francis(n, rows.as_mut_slice(), None, &mut values);
    black_box(&values);
    converged
}

fn nalgebras(matrix: &DMatrix<f64>) -> bool {
    let form = Schur::try_new(matrix.clone(), f64::EPSILON, SWEEPS * matrix.nrows());
    black_box(form.as_ref().map(Schur::complex_eigenvalues));
    form.is_some()
}

/// Microseconds per matrix, and how many iterations failed.
fn measured(matrices: &[DMatrix<f64>], solve: impl Fn(&DMatrix<f64>) -> bool) -> (f64, usize) {
    let mut best = f64::INFINITY;
    let mut failed = 0;
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        failed = matrices.iter().filter(|matrix| !solve(matrix)).count();
        best = best.min(begin.elapsed().as_secs_f64());
    }
    (1e6 * best / matrices.len() as f64, failed)
}

fn main() {
    let mut state = 1_u64;
    let mut draw = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for n in [4, 6, 8, 12, 16, 32] {
        let dense: Vec<DMatrix<f64>> =
            (0..1000).map(|_| DMatrix::from_fn(n, n, |_, _| draw())).collect();
        let companion = |_| {
            DMatrix::from_fn(n, n, |i, j| match (i, j) {
                (i, j) if i == j + 1 => 1.0,
                (_, j) if j + 1 == n => (4.0 * draw()).round(),
                _ => 0.0,
            })
        };
        let companions: Vec<DMatrix<f64>> = (0..1000).map(companion).collect();
        for (name, matrices) in [("random", &dense), ("companion", &companions)] {
            let ((time, failed), (peer, lost)) =
                (measured(matrices, own), measured(matrices, nalgebras));
            println!(
                "{n:2} rows, {name}: {time:.2} us, {failed} failed; nalgebra {peer:.2} us, {lost} failed"
            );
        }
    }
}
