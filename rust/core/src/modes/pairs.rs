//! Eigenpairs of a large sparse problem that were found elsewhere, corrected and judged on the stated matrices.
//!
//! A search by shift and invert leaves an error of its tolerance in each vector. The generalized Rayleigh quotient
//! `v' P(lambda) xi / v' P'(lambda) xi` in doubled precision has an error of the product of the errors of both vectors.

use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::parallel::each;
use crate::linalg::sparse::SparseMatrix;
use crate::modes::complex_modes::{normalised, shape};
use crate::modes::mode::Mode;
use crate::modes::quadratic_pencil::{Pencil, PencilDamping};
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Relative correction above which a quotient belongs to no eigenvalue near the given one.
const LARGEST_CORRECTION: f64 = 1e-5;

/// A right and a left vector with their eigenvalue.
pub type Triple = (Complex64, Vec<Complex64>, Vec<Complex64>);

/// One mode of a sparse problem, judged by its matrices; its residual is that of the largest entry and row sum, its condition
/// `(2 |lambda| |xi|_M |v|_M + |xi_s|_C |v_s|_C) / |a|` with the coordinates s that have no mass.
#[derive(Debug, Clone)]
pub struct JudgedPair {
    /// The mode; the largest entry of each of its vectors is 1.
    pub mode: Mode,
    /// xi over all dofs of the scene, n entries.
    pub shape: Vec<Complex64>,
    /// How far rounding of the matrices moves the eigenvalue, 1/s.
    pub rounding: f64,
}

/// `L' M R`, `L' C R` and `L' K R` of a combination, as sparse matrices.
pub fn sparse_pencil(scene: &Scene, combination: &Combination) -> Result<[SparseMatrix; 3], Error> {
    let (moving, reduction) = scene.in_motion(combination)?;
    Ok(moving.matrices().map(|matrix| reduction.sparse_matrix(matrix)))
}

/// Each pair with its eigenvalue corrected on the stated matrices of a combination; vectors are m long.
pub fn judged_pairs(
    scene: &Scene,
    combination: &Combination,
    pairs: Vec<Triple>,
) -> Result<Vec<JudgedPair>, Error> {
    let (moving, reduction) = scene.in_motion(combination)?;
    let row_sum = |matrix| largest_row_sum(&reduction.sparse_matrix(matrix));
    let norms = moving.matrices().map(row_sum);
    let pencil = Pencil::new(&moving, combination, &reduction);
    let over_dofs = |right: &[Complex64]| shape(scene, &moving, &reduction, right);
    let damping = |k: usize| match &pencil.damping {
        PencilDamping::General(rows) => rows.get(k, k).high,
        PencilDamping::Proportional { .. } => 0.0,
    };
    let first_order: Vec<(usize, f64)> =
        pencil.first_order().into_iter().map(|k| (k, damping(k))).collect();
    let norm = |vector: &[Complex64], left: bool| {
        if moving.coordinates.decoupled {
            return m_norm(vector, pencil.mass.rounded_product(vector));
        }
        let mut whole = vec![Complex64::ZERO; moving.size];
        for (i, &entry) in vector.iter().enumerate() {
            let sources = reduction.sources(i).take(if left { usize::MAX } else { 1 });
            sources.for_each(|(k, factor)| whole[k] += factor * entry);
        }
        let product = (0..moving.size)
            .map(|row| moving.mass.row(row).map(|(k, value)| value * whole[k]).sum::<Complex64>());
        m_norm(&whole, product)
    };
    Ok(each(pencil.size, pairs, |pair| judged(&pencil, &first_order, norms, pair, norm, over_dofs)))
}

/// `sqrt(x' M x)` from x and M x.
fn m_norm(vector: &[Complex64], product: impl IntoIterator<Item = Complex64>) -> f64 {
    let terms = product.into_iter().zip(vector);
    terms.map(|(product, z)| z.conj() * product).sum::<Complex64>().norm().sqrt()
}

fn judged(
    pencil: &Pencil,
    first_order: &[(usize, f64)],
    [mass, damping, stiffness]: [f64; 3],
    (start, right, left): Triple,
    m_norm: impl Fn(&[Complex64], bool) -> f64,
    over_dofs: impl Fn(&[Complex64]) -> Vec<Complex64>,
) -> JudgedPair {
    let products = pencil.products(&right);
    let corrected = products.corrected(start, &left);
    // A comparison that keeps the start for NaN as well, of a defective pair.
    let eigenvalue = match (corrected - start).norm() <= LARGEST_CORRECTION * start.norm() {
        true => corrected,
        false => start,
    };
    let a = products.slope(eigenvalue, &left);
    let largest = |vector: &[Complex64]| vector.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let size = eigenvalue.norm();
    let scale = (size * size * mass + size * damping + stiffness) * largest(&right);
    let along = |vector: &[Complex64]| {
        let terms = first_order.iter().map(|&(k, damping)| damping.abs() * vector[k].norm_sqr());
        terms.sum::<f64>().sqrt()
    };
    let second = 2.0 * size * m_norm(&right, false) * m_norm(&left, true);
    let condition = (second + along(&right) * along(&left)) / a.norm();
    let mode = normalised(Mode {
        eigenvalue,
        a,
        condition: if condition.is_nan() { f64::INFINITY } else { condition },
        residual: largest(&products.rows(eigenvalue)) / scale,
        right,
        left,
    });
    JudgedPair { shape: over_dofs(&mode.right), rounding: mode.rounding(pencil), mode }
}

fn largest_row_sum(matrix: &SparseMatrix) -> f64 {
    let sum = |row: usize| matrix.row(row).map(|(_, value)| value.abs()).sum::<f64>();
    (0..matrix.size()).map(sum).fold(0.0, f64::max)
}
