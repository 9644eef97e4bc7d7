//! The modes of a structure and of the oscillators that drive it.
//!
//! With `P(l) = l^2 M + l C + K` of the structure and the load `b(l) = -(K_h + l C_h)` of an oscillator, the pencil
//! of both is block triangular. Its eigenvalues are those of the structure, whose left vectors v gain the entry
//! `v' b(l) / (m_h (l^2 + w^2))`, and `j w` of the oscillator with the right vector `(P(j w)^-1 b(j w), 1)`: the forced
//! motion. Close to resonance both grow without bound while their sum does not. Their growth counts as their condition, so
//! that a resonant combination is propagated by Taylor series.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::dense::Factors;
use crate::modes::mode::Mode;
use crate::modes::quadratic_pencil::Pencil;
use crate::modes::spectrum::modes_of_motion;
use crate::scene::loads::oscillators::Drive;
use crate::scene::model::Scene;
use crate::scene::reduction::reduced_system::Reduced;

/// Distance of an eigenvalue from `j w`, relative to w, below which its left vector is made orthogonal to the forced motion: from
/// `l^2 + w^2` it would take the rounding of l times the square of w over that distance.
const NEAR: f64 = 0.25;

/// Steps of refinement. In a scene whose fastest mode is 1e5 times as fast as its slowest one, the first solution has six
/// digits of the slowest one, and each step adds as many.
const ROUNDS: usize = 6;

/// `P(lambda)^-1 load`, refined with residuals in doubled precision: the slow part of a solution in working precision has an
/// error of rounding times the stiffness of the *fastest* mode over that of the slow one, while the modes of the structure,
/// which it has to meet in a sum, have none.
fn response(
    pencil: &Pencil,
    factors: &Factors<Complex64>,
    lambda: Complex64,
    load: &DVector<Complex64>,
) -> Vec<Complex64> {
    let mut found = factors.solve(load.clone());
    let mut last = f64::INFINITY;
    for _ in 0..ROUNDS {
        let restoring = DVector::from_vec(pencil.products(found.as_slice()).rows(lambda));
        let correction = factors.solve(load - restoring);
        let size = correction.norm();
        // Also of a P that is singular to the last bit.
        if !(size < last) {
            break;
        }
        found += correction;
        if size <= f64::EPSILON * found.norm() {
            break;
        }
        last = size;
    }
    found.data.into()
}

/// The modes of a reduced scene whose last coordinates are oscillators, from those of the structure alone.
pub(crate) fn forced_modes(
    bare: &Scene,
    drive: &Drive,
    reduced: &Reduced,
) -> Result<Vec<Mode>, Error> {
    let structure = Reduced::new(bare, &reduced.combination)?;
    debug_assert!(reduced.reduction.kept.starts_with(&structure.reduction.kept));
    let pencil = Pencil::new(structure.scene(bare), &reduced.combination, &structure.reduction);
    let mut modes = modes_of_motion(&pencil)?;
    let (m, size) = (structure.size(), reduced.size());
    let load = |lambda: Complex64, h: usize| {
        let entry = |i: usize| -(reduced.stiffness[(i, h)] + lambda * reduced.damping[(i, h)]);
        DVector::from_iterator(m, (0..m).map(entry))
    };
    let rates: Vec<(usize, f64)> =
        (m..size).zip(&drive.oscillators).map(|(h, one)| (h, one.rate)).collect();
    let forced = rates.iter().map(|&(h, rate)| {
        let lambda = Complex64::new(0.0, rate);
        let p = DMatrix::from_fn(m, m, |i, j| {
            let at = |matrix: &DMatrix<f64>| Complex64::from(matrix[(i, j)]);
            lambda * lambda * at(&structure.mass)
                + lambda * at(&structure.damping)
                + at(&structure.stiffness)
        });
        let mut right = response(&pencil, &Factors::new(p), lambda, &load(lambda, h));
        right.resize(size, Complex64::default());
        let mut left = vec![Complex64::default(); size];
        (right[h], left[h]) = (1.0.into(), 1.0.into());
        let nearness = modes.iter().map(|mode| {
            let apart = (mode.eigenvalue - lambda).norm();
            rate.max(mode.eigenvalue.norm()) / apart
        });
        Mode {
            eigenvalue: lambda,
            a: 2.0 * lambda * reduced.mass[(h, h)],
            // The distance of a conjugate is no smaller.
            condition: nearness.fold(1.0, f64::max),
            residual: 0.0,
            right,
            left,
        }
    });
    let forced: Vec<Mode> = forced.collect();
    let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
    for mode in &mut modes {
        let lambda = mode.eigenvalue;
        mode.right.resize(size, Complex64::default());
        for &(h, rate) in &rates {
            let mass = reduced.mass[(h, h)];
            let product = |vector: &DVector<Complex64>| -> Complex64 {
                mode.left[..m].iter().zip(vector).map(|(v, b)| v * b).sum()
            };
            let driving = Complex64::new(0.0, rate);
            mode.left.push(if (lambda - driving).norm() < NEAR * rate {
                // v' ((C + (l + j w) M) x + C_h) + m_h (l + j w) left_h = 0.
                let shape = DVector::from_column_slice(&forced[h - m].right[..m]);
                let sum = lambda + driving;
                let inertia = complex(&structure.mass) * sum + complex(&structure.damping);
                let damping = reduced.damping.column(h).rows(0, m).map(Complex64::from);
                -product(&(inertia * shape + damping)) / (mass * sum)
            } else {
                product(&load(lambda, h)) / (mass * (lambda * lambda + rate * rate))
            });
        }
    }
    modes.extend(forced);
    // A comparison that takes NaN as well: the structure is in resonance to the last bit.
    for mode in &mut modes {
        if !(mode.condition < f64::INFINITY) {
            mode.condition = f64::INFINITY;
        }
    }
    Ok(modes)
}
