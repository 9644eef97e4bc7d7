//! Small dense algebra: operations that nalgebra does not have, and factors by nalgebra or faer, whichever is faster.

use faer::linalg::solvers::{PartialPivLu, SolveCore};
use faer::{Conj, MatMut, MatRef};
use nalgebra::allocator::Allocator;
use nalgebra::{
    Cholesky, DMatrix, DVector, DVectorView, DefaultAllocator, Dim, DimMin, Dyn, LU, Matrix,
    OMatrix, OVector, SMatrix, Scalar, U1, VecStorage,
};
use num_complex::Complex64;

use crate::numerics::singular_values::pseudo_inverse;

/// Number of rows from which faer's blocked factors take less time than nalgebra's: with 6 rows they take three times as
/// long (0.8 against 0.3 us), with 32 rows as long, with 128 rows half as long (100 against 230 us).
const BLOCKED: usize = 40;
/// A reduced mass is singular if its smallest pivot is below this part of its largest one.
pub(crate) const SINGULAR: f64 = 1e-14;
/// A pivot of equilibrated rows below this leaves a first solution that one step of refinement does not mend.
const REFINABLE: f64 = 1e-13;
/// A Cholesky pivot this small beside its diagonal entry is rounding.
pub(crate) const INDEFINITE: f64 = 1e-14;
/// Rows up to which pivots are searched for in the whole matrix; beyond, only partial pivoting is quick.
const COMPLETE_PIVOTING: usize = 200;

/// The largest modulus of an entry.
pub(crate) fn max_norm(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |size: f64, x| size.max(x.abs()))
}

/// The largest modulus of a difference of two entries.
pub(crate) fn max_distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).fold(0.0, |size: f64, (x, y)| size.max((x - y).abs()))
}

/// `matrix x`
pub(crate) fn apply(matrix: &DMatrix<f64>, x: &[f64]) -> Vec<f64> {
    (matrix * DVectorView::from_slice(x, x.len())).data.into()
}

pub(crate) fn is_diagonal(matrix: &DMatrix<f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..matrix.nrows()).all(|i| i == j || matrix[(i, j)] == 0.0))
}

/// Whether a matrix is symmetric to the last bit.
pub(crate) fn is_symmetric(matrix: &DMatrix<f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..j).all(|i| matrix[(i, j)] == matrix[(j, i)]))
}

/// The factor of a symmetric matrix, or the first pivot that is no more than rounding of its diagonal entry, with its
/// index.
pub(crate) fn cholesky(matrix: &DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, (usize, f64)> {
    let n = matrix.nrows();
    let leading = |k: usize| Cholesky::new(matrix.view((0, 0), (k, k)).into_owned());
    let Some(factor) = leading(n) else {
        // The leading blocks are definite up to one of them.
        let (mut definite, mut indefinite) = (0, n);
        while indefinite - definite > 1 {
            let middle = definite.midpoint(indefinite);
            *(if leading(middle).is_some() { &mut definite } else { &mut indefinite }) = middle;
        }
        let row = matrix.view((0, definite), (definite, 1)).into_owned();
        let known = leading(definite)
            .filter(|_| definite > 0)
            .map_or(0.0, |factor| row.dot(&factor.solve(&row)));
        return Err((definite, matrix[(definite, definite)] - known));
    };
    let pivot = |k: usize| factor.l_dirty()[(k, k)].powi(2);
    match (0..n).find(|&k| !(pivot(k) > INDEFINITE * matrix[(k, k)])) {
        Some(k) => Err((k, pivot(k))),
        None => Ok(factor),
    }
}

/// A matrix or a vector.
type Columns<T, C> = Matrix<T, Dyn, C, VecStorage<T, Dyn, C>>;

/// Numbers that both libraries factorize.
pub(crate) trait Field:
    nalgebra::ComplexField<RealField = f64> + faer::traits::ComplexField
{
}
impl Field for f64 {}
impl Field for Complex64 {}

/// The factors of a matrix for many solutions with it, by partial pivoting.
#[derive(Debug)]
pub(crate) enum Factors<T: Field> {
    Small(LU<T, Dyn, Dyn>),
    Large(Box<PartialPivLu<T>>),
}

/// The shortest `f`, zero but for some rows, with `(W f)_row = change_row` in these.
pub(crate) fn impulses_of(w: &DMatrix<f64>, rows: &[usize], change: &[f64]) -> Vec<f64> {
    let within = w.select_rows(rows).select_columns(rows);
    let found = pseudo_inverse(&within) * DVector::from_fn(rows.len(), |k, _| change[rows[k]]);
    let mut impulses = vec![0.0; change.len()];
    rows.iter().zip(&found).for_each(|(&row, &impulse)| impulses[row] = impulse);
    impulses
}

impl<T: Field> Factors<T> {
    pub fn new(matrix: DMatrix<T>) -> Self {
        match matrix.nrows() < BLOCKED {
            true => Self::Small(matrix.lu()),
            false => Self::Large(Box::new(viewed(&matrix).partial_piv_lu())),
        }
    }

    /// The diagonal of U.
    fn pivots(&self) -> Vec<T> {
        match self {
            Self::Small(factors) => factors.lu_internal().diagonal().data.into(),
            Self::Large(factors) => {
                factors.U().diagonal().column_vector().iter().cloned().collect()
            }
        }
    }

    /// `matrix^-1 rhs`; not finite where the matrix is singular.
    pub fn solve<C: Dim>(&self, mut rhs: Columns<T, C>) -> Columns<T, C>
    where
        DefaultAllocator: Allocator<Dyn, C, Buffer<T> = VecStorage<T, Dyn, C>>,
    {
        match self {
            _ if rhs.is_empty() => {}
            Self::Small(factors) => {
                if !factors.solve_mut(&mut rhs) {
                    rhs.fill(T::from_real(f64::NAN));
                }
            }
            Self::Large(factors) => factors.solve_in_place_with_conj(Conj::No, writable(&mut rhs)),
        }
        rhs
    }

    /// `matrix^-T rhs`
    pub fn transposed_solve<C: Dim>(&self, mut rhs: Columns<T, C>) -> Columns<T, C>
    where
        DefaultAllocator: Allocator<Dyn, C, Buffer<T> = VecStorage<T, Dyn, C>>,
    {
        match self {
            _ if rhs.is_empty() => {}
            Self::Small(factors) => {
                let regular = factors.u().tr_solve_upper_triangular_mut(&mut rhs)
                    && factors.l().tr_solve_lower_triangular_mut(&mut rhs);
                if !regular {
                    rhs.fill(T::from_real(f64::NAN));
                }
                factors.p().inv_permute_rows(&mut rhs);
            }
            Self::Large(factors) => {
                factors.solve_transpose_in_place_with_conj(Conj::No, writable(&mut rhs));
            }
        }
        rhs
    }
}

/// A matrix as faer reads it.
pub(crate) fn viewed<T: Scalar>(matrix: &DMatrix<T>) -> MatRef<'_, T> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

fn writable<T: Scalar, C: Dim>(matrix: &mut Columns<T, C>) -> MatMut<'_, T> {
    let (rows, columns) = matrix.shape();
    MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), rows, columns)
}

/// `matrix^-1 rhs`; not finite where the matrix is singular.
pub(crate) fn solve(matrix: DMatrix<f64>, rhs: &[f64]) -> Vec<f64> {
    Factors::new(matrix).solve(DVector::from_column_slice(rhs)).data.into()
}

/// A regular matrix of equilibrated rows.
struct Equilibrated<D: DimMin<D, Output = D>>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    factors: LU<f64, D, D>,
    /// What the rows were divided by: their largest entries.
    sizes: OVector<f64, D>,
}

impl<D: DimMin<D, Output = D>> Equilibrated<D>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    /// None if a pivot is not above `lost`.
    fn new(mut matrix: OMatrix<f64, D, D>, lost: f64) -> Option<Self> {
        let mut sizes = OVector::zeros_generic(matrix.shape_generic().0, U1);
        for column in matrix.column_iter() {
            sizes.zip_apply(&column, |size: &mut f64, entry: f64| *size = size.max(entry.abs()));
        }
        matrix.column_iter_mut().for_each(|mut column| column.component_div_assign(&sizes));
        let factors = matrix.lu();
        let pivot = |k: usize| factors.lu_internal()[(k, k)];
        // NaN, from a row of zeros, is lost as well.
        (0..sizes.len()).all(|k| pivot(k).abs() > lost).then_some(Self { factors, sizes })
    }

    fn solve(&self, rhs: &[f64]) -> Option<OVector<f64, D>> {
        let dimension = self.sizes.shape_generic().0;
        let mut solution = OVector::from_column_slice_generic(dimension, U1, rhs);
        solution.component_div_assign(&self.sizes);
        (rhs.is_empty() || self.factors.solve_mut(&mut solution)).then_some(solution)
    }
}

/// Pivots of equilibrated rows up to which a matrix is singular to rounding.
fn rounding(matrix: &DMatrix<f64>) -> f64 {
    f64::EPSILON * matrix.nrows() as f64
}

/// Sign of the determinant; 0 if the rounding of the equilibrated rows hides it.
pub(crate) fn determinant_sign(matrix: DMatrix<f64>) -> f64 {
    let lost = rounding(&matrix);
    Equilibrated::new(matrix, lost).map_or(0.0, |Equilibrated { factors, .. }| {
        let pivots = factors.lu_internal().diagonal();
        factors.p().determinant::<f64>()
            * pivots.iter().map(|pivot| pivot.signum()).product::<f64>()
    })
}

/// `matrix^-1 rhs`, unless the matrix is singular to rounding of its equilibrated rows.
pub(crate) fn regular_solution(matrix: &DMatrix<f64>, rhs: &[f64]) -> Option<DVector<f64>> {
    let lost = rounding(matrix);
    // Studies ask this of millions of mechanisms of a few masses: a size that is known takes a third of the time.
    macro_rules! of_size {
        ($($n:literal)*) => {
            match matrix.nrows() {
                $($n => {
                    let known = SMatrix::<f64, $n, $n>::from_column_slice(matrix.as_slice());
                    let solution = Equilibrated::new(known, lost)?.solve(rhs)?;
                    Some(DVector::from_column_slice(solution.as_slice()))
                })*
                _ => Equilibrated::new(matrix.clone(), lost)?.solve(rhs),
            }
        };
    }
    of_size!(2 3 4 5 6 7 8)
}

/// x with one step of refinement, where `left` is what x leaves of the right-hand side of `matrix x`, in doubled precision: then
/// x is accurate to its own rounding. None where a pivot of the rows divided by `sizes` is below [`REFINABLE`].
pub(crate) fn refined_solution(
    mut matrix: DMatrix<f64>,
    sizes: &DVector<f64>,
    left: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> Option<DVector<f64>> {
    matrix.column_iter_mut().for_each(|mut column| column.component_div_assign(sizes));
    let factors = Factors::new(matrix);
    if !factors.pivots().iter().all(|pivot| pivot.abs() > REFINABLE) {
        return None;
    }
    let mut solution = DVector::zeros(sizes.len());
    for _ in 0..2 {
        solution += factors.solve(left(&solution).component_div(sizes));
    }
    Some(solution)
}

/// Smallest pivot of elimination over the largest one: 0 for a singular matrix.
pub(crate) fn smallest_relative_pivot(matrix: &DMatrix<f64>) -> f64 {
    if matrix.is_empty() {
        return 1.0;
    }
    let pivots: DVector<f64> = match matrix.nrows() <= COMPLETE_PIVOTING {
        true => matrix.clone().full_piv_lu().lu_internal().diagonal(),
        false => Factors::Large(Box::new(viewed(matrix).partial_piv_lu())).pivots().into(),
    };
    let (smallest, largest) = (pivots.amin(), pivots.amax());
    if largest > 0.0 { smallest / largest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_indefinite_matrix_is_known_by_its_pivot() {
        let matrix = DMatrix::from_row_slice(3, 3, &[4.0, 2.0, 0.0, 2.0, 0.5, 1.0, 0.0, 1.0, 9.0]);
        assert_eq!(cholesky(&matrix).unwrap_err(), (1, -0.5));
        let singular = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0]);
        assert_eq!(cholesky(&singular).unwrap_err(), (1, 0.0));
        assert_eq!(cholesky(&-singular).unwrap_err(), (0, -1.0));
        assert!(cholesky(&DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0])).is_ok());
    }

    /// Both sizes of factors, against the product.
    #[test]
    fn solutions_of_a_matrix_and_its_transpose() {
        for n in [0, 1, 7, BLOCKED, 2 * BLOCKED] {
            let entry = |i: usize, j: usize| {
                Complex64::new(
                    (1.0 + i as f64 * 12.3 + j as f64).sin(),
                    (2.0 + j as f64 * 7.7 + i as f64).cos(),
                )
            };
            let matrix =
                DMatrix::from_fn(n, n, |i, j| entry(i, j) + if i == j { n as f64 } else { 0.0 });
            let rhs = DMatrix::from_fn(n, 2, entry);
            let factors = Factors::new(matrix.clone());
            let left = |found: DMatrix<Complex64>, matrix: &DMatrix<Complex64>| {
                (matrix * found - &rhs).norm()
            };
            // The matrix is diagonally dominant: rounding of n products of entries below n.
            let rounding = 10.0 * f64::EPSILON * (n * n) as f64;
            assert!(left(factors.solve(rhs.clone()), &matrix) <= rounding);
            assert!(left(factors.transposed_solve(rhs.clone()), &matrix.transpose()) <= rounding);
        }
    }

    proptest::proptest! {
        #[test]
        fn determinant_signs_follow_the_eigenvalues(shift in -3.0f64..3.0) {
            // Rotated by 1 rad, eigenvalues 1 - shift and 2 - shift.
            let (sin, cos) = 1.0f64.sin_cos();
            let matrix = DMatrix::from_row_slice(2, 2, &[
                cos * cos + 2.0 * sin * sin - shift, -sin * cos,
                -sin * cos, sin * sin + 2.0 * cos * cos - shift,
            ]);
            let expected = ((1.0 - shift) * (2.0 - shift)).signum();
            proptest::prop_assume!((1.0 - shift).abs().min((2.0 - shift).abs()) > 1e-12);
            proptest::prop_assert_eq!(determinant_sign(matrix), expected);
        }
    }

    #[test]
    fn a_lost_determinant_has_no_sign() {
        let sign = |entries: &[f64]| determinant_sign(DMatrix::from_row_slice(2, 2, entries));
        assert_eq!(sign(&[1.0, 2.0, 2.0, 4.0]), 0.0);
        assert_eq!(sign(&[0.0, 0.0, 2.0, 4.0]), 0.0);
    }
}
