//! Eigenpairs of `K x = kappa M x` whose values spread over more orders of magnitude than a double has digits.
//!
//! A backward-stable solver leaves in every eigenvalue of `S = G^-1 K G^-T`, `M = G G'`, an error of rounding times the
//! *largest* one, in which a slow mode drowns. In the eigenvalues of `S^-1 = G' K^-1 G` the error is rounding times the
//! inverse of the smallest one, so that slow modes are accurate. The stiffness is inverted in doubled precision: if two
//! masses are joined by a stiff spring and held by a soft one, the soft one is only in the last digits of the entries.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::linalg::eigenpair::EigenPair;
use crate::numerics::double_double::Doubled;

/// Pivot, of the largest entry of its row, below which a matrix is singular in doubled precision.
const SINGULAR: f64 = 1e-28;

/// The inverse of a matrix, each entry rounded once; None if it is singular.
pub(crate) fn inverse(mut matrix: DMatrix<Doubled>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let mut inverse = DMatrix::from_fn(n, n, |i, j| Doubled::from(f64::from(u8::from(i == j))));
    let size =
        |row: usize| matrix.row(row).iter().map(|entry| entry.high.abs()).fold(0.0, f64::max);
    let mut sizes: Vec<f64> = (0..n).map(size).collect();
    for k in 0..n {
        let relative = |i: usize| matrix[(i, k)].high.abs() / sizes[i];
        let pivot = (k..n).fold(k, |best, i| if relative(i) > relative(best) { i } else { best });
        if !(relative(pivot) > SINGULAR) {
            return None;
        }
        sizes.swap(pivot, k);
        matrix.swap_rows(pivot, k);
        inverse.swap_rows(pivot, k);
        let factors: Vec<Doubled> = (0..n).map(|i| matrix[(i, k)].times(-1.0)).collect();
        let unit = matrix[(k, k)];
        for mut column in matrix.column_iter_mut().chain(inverse.column_iter_mut()) {
            column[k] = column[k].over(unit);
            let own = column[k];
            for (i, factor) in factors.iter().enumerate() {
                if i != k && factor.high != 0.0 {
                    column[i] = column[i].add(own.by(*factor));
                }
            }
        }
    }
    Some(inverse.map(Doubled::value))
}

/// The fast eigenpairs of S and the slow eigenpairs of its inverse, divided at the place at which the larger of their
/// errors is smallest.
pub(crate) fn joined(mut whole: Vec<EigenPair>, mut inverted: Vec<EigenPair>) -> Vec<EigenPair> {
    inverted.iter_mut().for_each(|pair| {
        // A mode so fast that its inverse is lost is found in S.
        pair.value = if pair.value.norm() > 0.0 { pair.value.inv() } else { f64::INFINITY.into() };
        if pair.value.im < 0.0 {
            *pair = conjugated(pair);
        }
    });
    let size = |pair: &EigenPair| pair.value.norm();
    let by_size = |p: &EigenPair, q: &EigenPair| size(p).total_cmp(&size(q));
    whole.sort_by(by_size);
    inverted.sort_by(by_size);
    let count = |pairs: &[EigenPair]| -> usize {
        pairs.iter().map(|pair| if pair.value.im == 0.0 { 1 } else { 2 }).sum()
    };
    let total = count(&whole);
    let spread = |pairs: &[EigenPair]| match pairs {
        [first, .., last] if size(first) > 0.0 => size(last) / size(first),
        [] => 1.0,
        [only] if size(only) > 0.0 && size(only).is_finite() => 1.0,
        // A mode lost altogether.
        _ => f64::INFINITY,
    };
    let mut best = (spread(&whole), 0, 0);
    for slow in 1..=inverted.len() {
        let fast = (0..=whole.len())
            .find(|&fast| count(&inverted[..slow]) + count(&whole[fast..]) == total);
        if let Some(fast) = fast {
            let cost = spread(&inverted[..slow]).max(spread(&whole[fast..]));
            if cost < best.0 {
                best = (cost, slow, fast);
            }
        }
    }
    let (_, slow, fast) = best;
    inverted.truncate(slow);
    inverted.extend(whole.drain(fast..));
    inverted
}

fn conjugated(pair: &EigenPair) -> EigenPair {
    let all = |vector: &[Complex64]| vector.iter().map(Complex64::conj).collect();
    EigenPair { value: pair.value.conj(), right: all(&pair.right), left: all(&pair.left) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two masses joined by a spring of 1e15 and held by one of 1: the inverse is [[1, 1], [1, 1 + 1e-15]].
    #[test]
    fn a_soft_spring_beside_a_stiff_one_is_inverted() {
        let stiff = 1e15;
        let corner = Doubled::from(stiff).add(1.0.into());
        let entries = [corner, (-stiff).into(), (-stiff).into(), stiff.into()];
        let found = inverse(DMatrix::from_row_slice(2, 2, &entries)).unwrap();
        assert_eq!(found, DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0 + 1e-15]));
    }

    #[test]
    fn a_singular_matrix_has_no_inverse() {
        assert!(inverse(DMatrix::from_element(2, 2, Doubled::from(1.0))).is_none());
    }

    #[test]
    fn slow_pairs_come_from_the_inverse() {
        let pair = |value: f64| EigenPair {
            value: value.into(),
            right: vec![1.0.into()],
            left: vec![1.0.into()],
        };
        let whole = vec![pair(1e20), pair(3e2), pair(1e15)];
        let inverted = vec![pair(1e-21), pair(1e-15), pair(1.0)];
        let values: Vec<f64> = joined(whole, inverted).iter().map(|pair| pair.value.re).collect();
        assert_eq!(values, [1.0, 1e15, 1e20]);
    }

    #[test]
    fn a_mode_lost_on_one_side_comes_from_the_other() {
        let pair = |value: f64| EigenPair {
            value: value.into(),
            right: vec![1.0.into()],
            left: vec![1.0.into()],
        };
        let values = |whole: [f64; 3], inverted: [f64; 3]| -> Vec<f64> {
            let pairs = |values: [f64; 3]| values.map(pair).to_vec();
            let found = joined(pairs(whole), pairs(inverted));
            found.iter().map(|pair| pair.value.re).collect()
        };
        assert_eq!(values([1e20, 0.0, 1e15], [0.0, 1e-14, 1.0]), [1.0, 1e15, 1e20]);
        assert_eq!(values([1e20, 2.0, 1e15], [0.0, 0.0, 1.0]), [1.0, 1e15, 1e20]);
    }
}
