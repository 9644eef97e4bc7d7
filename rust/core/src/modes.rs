//! Complex modes of a status combination, with left and right vectors.
//!
//! `A y' + B y = Q` with `y = (x, x')`, `A = [[C, M], [M, 0]]`, `B = [[K, 0], [0, -M]]`: right vectors
//! `(xi, lambda xi)` with `lambda A r = -B r`, left vectors `(v, lambda v)` with `lambda l' A = -l' B`,
//! bi-orthogonal: `L' A R = diag(a)`, `L' B R = diag(b)`, `lambda = -b / a`.

use num_complex::Complex64;

use crate::error::Error;
use crate::pencil::Pencil;
use crate::reduction::Reduced;
use crate::scene::Scene;
use crate::spectrum::{Mode, Vectors, spectrum};
use crate::status::Combination;

/// All 2m modes of a combination, sorted by modulus, conjugates adjacent, positive imaginary part first.
/// Matrices are column-major: one mode after the other.
#[derive(Debug, Clone)]
pub struct Modes {
    pub reduced: Reduced,
    pub eigenvalues: Vec<Complex64>,
    /// 2m entries per mode; the displacement part's largest entry is 1.
    pub right: Vec<Complex64>,
    /// 2m entries per mode, NaN where the mode is defective.
    pub left: Vec<Complex64>,
    pub a: Vec<Complex64>,
    pub b: Vec<Complex64>,
    /// n entries per mode: the displacement part over all dofs of the scene.
    pub shapes: Vec<Complex64>,
    pub condition: Vec<f64>,
    pub defective: Vec<bool>,
    pub residual: Vec<f64>,
}

impl Modes {
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        let reduced = Reduced::new(scene, combination)?;
        let mut half = spectrum(&Pencil::new(scene, &reduced), Vectors::Refined)?;
        half.sort_by(|p, q| {
            let key =
                |mode: &Mode| (mode.eigenvalue.norm(), mode.eigenvalue.im, mode.eigenvalue.re);
            let (p, q) = (key(p), key(q));
            p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)).then(p.2.total_cmp(&q.2))
        });
        let count = 2 * reduced.size();
        let mut modes = Self {
            eigenvalues: Vec::with_capacity(count),
            right: Vec::with_capacity(count * count),
            left: Vec::with_capacity(count * count),
            a: Vec::with_capacity(count),
            b: Vec::with_capacity(count),
            shapes: Vec::with_capacity(count * scene.size),
            condition: Vec::with_capacity(count),
            defective: Vec::with_capacity(count),
            residual: Vec::with_capacity(count),
            reduced,
        };
        for mode in half {
            let mut mode = normalised(mode);
            modes.push(scene, &mode);
            if !mode.is_real() {
                mode.conjugate();
                modes.push(scene, &mode);
            }
        }
        Ok(modes)
    }

    fn push(&mut self, scene: &Scene, mode: &Mode) {
        let lambda = mode.eigenvalue;
        let defective = mode.is_defective();
        let valid = |z: Complex64| {
            if defective { Complex64::new(f64::NAN, f64::NAN) } else { z }
        };
        self.eigenvalues.push(lambda);
        self.right.extend(mode.right.iter().copied());
        self.right.extend(mode.right.iter().map(|z| lambda * z));
        self.left.extend(mode.left.iter().map(|&z| valid(z)));
        self.left.extend(mode.left.iter().map(|&z| valid(lambda * z)));
        self.a.push(valid(mode.a));
        self.b.push(valid(-lambda * mode.a));
        let part = |f: fn(&Complex64) -> f64| {
            let mut q = vec![0.0; scene.size];
            for (&k, z) in self.reduced.kept.iter().zip(&mode.right) {
                q[k] = f(z);
            }
            scene.velocities(&q)
        };
        let (re, im) = (part(|z| z.re), part(|z| z.im));
        self.shapes.extend(re.into_iter().zip(im).map(|(re, im)| Complex64::new(re, im)));
        self.condition.push(mode.condition);
        self.defective.push(defective);
        self.residual.push(mode.residual);
    }

    /// `left' A y / a` of a reduced state y, given A.
    pub(crate) fn coordinates(&self, state_a: &[f64], y: &[f64]) -> Vec<Complex64> {
        let n = y.len();
        let momentum: Vec<f64> = state_a
            .chunks_exact(n.max(1))
            .map(|row| row.iter().zip(y).map(|(a, y)| a * y).sum())
            .collect();
        self.left
            .chunks_exact(n.max(1))
            .zip(&self.a)
            .map(|(left, a)| left.iter().zip(&momentum).map(|(l, p)| l * p).sum::<Complex64>() / a)
            .collect()
    }

    /// (A, B) of `A y' + B y = Q`, row-major 2m by 2m.
    pub fn state_matrices(&self) -> (Vec<f64>, Vec<f64>) {
        let m = self.reduced.size();
        let n = 2 * m;
        let mut a = vec![0.0; n * n];
        let mut b = vec![0.0; n * n];
        for i in 0..m {
            for j in 0..m {
                let mass = self.reduced.mass[i * m + j];
                a[i * n + j] = self.reduced.damping[i * m + j];
                a[i * n + m + j] = mass;
                a[(m + i) * n + j] = mass;
                b[i * n + j] = self.reduced.stiffness[i * m + j];
                b[(m + i) * n + m + j] = -mass;
            }
        }
        (a, b)
    }
}

/// Scales both vectors so that their largest entries are 1; `a` follows.
pub(crate) fn normalised(mut mode: Mode) -> Mode {
    let largest = |vector: &[Complex64]| {
        vector
            .iter()
            .copied()
            .max_by(|p, q| p.norm_sqr().total_cmp(&q.norm_sqr()))
            .unwrap_or(Complex64::from(1.0))
    };
    let (right, left) = (largest(&mode.right), largest(&mode.left));
    mode.right.iter_mut().for_each(|z| *z /= right);
    mode.left.iter_mut().for_each(|z| *z /= left);
    mode.a /= right * left;
    mode
}
