//! One eigenvalue with its vectors, and how well it is conditioned.

use num_complex::Complex64;

/// One eigenvalue with its right and left vector: `S x = value x`, `y' S = value y'` (plain transpose).
#[derive(Debug, Clone)]
pub(crate) struct EigenPair {
    pub value: Complex64,
    pub right: Vec<Complex64>,
    pub left: Vec<Complex64>,
}

impl EigenPair {
    /// `y' x`
    pub fn product(&self) -> Complex64 {
        self.right.iter().zip(&self.left).map(|(x, y)| x * y).sum()
    }

    /// |x| |y| / |y' x|: how much the eigenvalue moves per unit change of the matrix.
    pub fn condition(&self) -> f64 {
        norm(&self.right) * norm(&self.left) / self.product().norm()
    }

    /// The condition of a pair of `(gamma x, x')` in the gamma in which it is smallest: the scale of velocity
    /// against position is for each mode its own.
    pub fn scaled_condition(&self) -> f64 {
        let m = self.right.len() / 2;
        let block = |range: std::ops::Range<usize>| {
            norm(&self.right[range.clone()]) * norm(&self.left[range])
        };
        (block(0..m) + block(m..2 * m)) / self.product().norm()
    }
}

/// z, or its conjugate.
pub(crate) fn turned(z: Complex64, conjugate: bool) -> Complex64 {
    if conjugate { z.conj() } else { z }
}

pub(crate) fn norm(vector: &[Complex64]) -> f64 {
    vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
}
