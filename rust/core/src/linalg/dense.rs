//! Products of dense square matrices, row-major.

/// `a b` of square row-major matrices, rows of zeros in `a` left out.
pub(crate) fn product(size: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; size * size];
    for i in 0..size {
        for k in 0..size {
            let factor = a[i * size + k];
            if factor != 0.0 {
                for j in 0..size {
                    c[i * size + j] += factor * b[k * size + j];
                }
            }
        }
    }
    c
}

/// `matrix vector`
pub(crate) fn apply(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix
        .chunks_exact(vector.len())
        .map(|row| row.iter().zip(vector).map(|(a, x)| a * x).sum())
        .collect()
}
