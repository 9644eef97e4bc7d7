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

    /// The condition of a pair whose entries are in up to three blocks, in the units of the blocks in which it is smallest:
    /// the scale of velocity against position is for each mode its own.
    pub fn scaled_condition(&self, block: impl Fn(usize) -> usize) -> f64 {
        let mut squares = [[0.0; 2]; 3];
        for (i, (x, y)) in self.right.iter().zip(&self.left).enumerate() {
            let [right, left] = &mut squares[block(i)];
            *right += x.norm_sqr();
            *left += y.norm_sqr();
        }
        let sizes = squares.map(|[right, left]| right.sqrt() * left.sqrt());
        sizes.iter().sum::<f64>() / self.product().norm()
    }
}

/// z, or its conjugate.
pub(crate) fn turned(z: Complex64, conjugate: bool) -> Complex64 {
    if conjugate { z.conj() } else { z }
}

pub(crate) fn norm(vector: &[Complex64]) -> f64 {
    vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
}
