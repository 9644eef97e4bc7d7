//! Lemke's pivoting method for linear complementarity problems (Cottle, Pang and Stone 1992, section 4.4).

/// Lemke's method for `w = M z + q, w >= 0, z >= 0, w z = 0`; `None` on a secondary ray.
pub(crate) fn lemke(size: usize, matrix: &[f64], q: &[f64]) -> Option<Vec<f64>> {
    if q.iter().all(|&q| q >= 0.0) {
        return Some(vec![0.0; size]);
    }
    // Tableau columns: w (size), z (size), z0, right-hand side.
    let columns = 2 * size + 2;
    let (z0, rhs) = (2 * size, 2 * size + 1);
    let mut tableau = vec![0.0; size * columns];
    for i in 0..size {
        tableau[i * columns + i] = 1.0;
        for j in 0..size {
            tableau[i * columns + size + j] = -matrix[i * size + j];
        }
        tableau[i * columns + z0] = -1.0;
        tableau[i * columns + rhs] = q[i];
    }
    let mut basis: Vec<usize> = (0..size).collect();
    let pivot = |tableau: &mut Vec<f64>, row: usize, column: usize| {
        let factor = tableau[row * columns + column];
        for k in 0..columns {
            tableau[row * columns + k] /= factor;
        }
        let pivot_row = tableau[row * columns..(row + 1) * columns].to_vec();
        for i in (0..size).filter(|&i| i != row) {
            let factor = tableau[i * columns + column];
            if factor != 0.0 {
                for k in 0..columns {
                    tableau[i * columns + k] -= factor * pivot_row[k];
                }
            }
        }
    };
    let mut row = (0..size).min_by(|&i, &j| q[i].total_cmp(&q[j]))?;
    let mut entering = z0;
    // Lemke visits each almost complementary basis once; far fewer in practice.
    for _ in 0..50 * (size + 1) {
        pivot(&mut tableau, row, entering);
        let leaving = std::mem::replace(&mut basis[row], entering);
        if leaving == z0 {
            let mut z = vec![0.0; size];
            for (i, &variable) in basis.iter().enumerate() {
                if (size..2 * size).contains(&variable) {
                    z[variable - size] = tableau[i * columns + rhs].max(0.0);
                }
            }
            return Some(z);
        }
        entering = if leaving < size { leaving + size } else { leaving - size };
        // The smallest ratio; ties by the rest of the row (lexicographic rule), which rules out cycling.
        let entry = |i: usize, k: usize| tableau[i * columns + k] / tableau[i * columns + entering];
        let smaller = |i: usize, j: usize| {
            std::iter::once(rhs)
                .chain(0..size)
                .map(|k| (entry(i, k), entry(j, k)))
                .find(|(a, b)| (a - b).abs() > 1e-11 * (a.abs() + b.abs()).max(1e-3))
                .map_or(std::cmp::Ordering::Equal, |(a, b)| a.total_cmp(&b))
        };
        row = (0..size)
            .filter(|&i| tableau[i * columns + entering] > 1e-12)
            .min_by(|&i, &j| smaller(i, j))?;
    }
    None
}
