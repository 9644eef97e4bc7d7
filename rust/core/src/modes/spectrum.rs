//! The quadratic eigenproblem of one status combination: `(lambda^2 M + lambda C + K) xi = 0`.
//!
//! With `C = alpha M + beta K` the m by m problem `K xi = kappa M xi` gives all 2m modes, otherwise a linearisation of
//! twice the size, without the velocities of [coordinates of first order](crate::modes::first_order). Every eigenvalue is
//! then corrected by one generalized Rayleigh quotient `v' P(lambda) xi / v' P'(lambda) xi`, whose error is of second order
//! in the errors of the vectors, with the residual `P(lambda) xi` of the *unreduced* matrices in doubled precision.

use crate::error::input::Error;
use crate::linalg::eigenpair::turned;
use crate::linalg::parallel::each;
use crate::modes::mass_factor::MassFactor;
use crate::modes::mode::{BACKWARD_STABLE, Mode};
use crate::modes::quadratic_pencil::{Pencil, PencilDamping};
use crate::modes::refinement::inverse_iteration::InverseIteration;
use crate::modes::solvers::general::{StateForm, general_modes};
use crate::modes::solvers::problem::{Problem, WELL_CONDITIONED};
use crate::modes::solvers::proportional::proportional_modes;

/// Relative residual of the quadratic problem above which an eigenvalue counts as not converged.
/// A backward-stable solver leaves some 1e-15; the margin only has to tell noise from failure.
const CONVERGED: f64 = 1e-10;

/// Free coordinates up to which vectors are refined: beyond, that would cost more than the solution.
pub(crate) const REFINED_SIZE: usize = 60;

/// Share of the fastest rate up to which an eigenvalue may be one of a pair that rounding alone has split: farther from zero
/// such a pair has a condition that shows it.
const SLOW: f64 = 1e-2;

/// Margin above rounding of the distance of two real rates of one motion, of a body that only weak dampers hold. Position and
/// velocity are a sum and a difference of both parts, which are larger than the motion by the rate of the stiffness at the
/// body over that distance: by up to 1e3, which costs up to 4e-13. A conjugate pair holds both in one complex number.
const PARTED: f64 = 4e4;

/// Relative distance of eigenvalues that may be one multiple one, and the largest part of one mode in another.
const CLOSE: f64 = 1e-6;
const MIXED: f64 = 1e-12;

/// How accurate the vectors have to be; the eigenvalues are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Vectors {
    /// Vectors as the backward-stable solver returns them.
    Solved,
    /// Vectors after one more step, which are accurate to rounding at several times the cost: the event times of a transient
    /// are only as accurate as they are.
    Refined,
}

/// All modes of a reduced problem, in no particular order.
pub(crate) fn spectrum(pencil: &Pencil, vectors: Vectors) -> Result<Vec<Mode>, Error> {
    let modes = all_at_once(pencil, vectors)?;
    let modes = match modes.iter().any(is_imprecise) {
        true => {
            let iteration = InverseIteration::new(pencil);
            let improve =
                |mode: Mode| if is_imprecise(&mode) { iteration.improved(mode) } else { mode };
            each(pencil.size, modes, improve)
        }
        false => modes,
    };
    // A comparison that also fails for NaN.
    match modes.iter().find(|mode| !(mode.residual <= CONVERGED)) {
        Some(mode) => Err(Error::Eigenvalues {
            combination: pencil.combination.to_string(),
            residual: mode.residual,
        }),
        None => Ok(modes),
    }
}

/// The modes from which motions are superposed, with refined vectors. A pair that rounding alone may have split, or whose real
/// rates are nearly one, counts as defective: it would cost as many digits as the splitting is small beside the rates of the
/// problem.
pub(crate) fn modes_of_motion(pencil: &Pencil) -> Result<Vec<Mode>, Error> {
    let mut modes = spectrum(pencil, Vectors::Refined)?;
    let fastest = modes.iter().map(|mode| mode.eigenvalue.norm()).fold(0.0, f64::max);
    for mode in &mut modes {
        let is_slow = mode.eigenvalue.norm() <= SLOW * fastest;
        let margin = if mode.is_real() { PARTED } else { WELL_CONDITIONED };
        if is_slow && mode.is_split_by_rounding(pencil, margin) {
            mode.condition = f64::INFINITY;
        }
    }
    mark_mixed(pencil, &mut modes, SLOW * fastest);
    Ok(modes)
}

/// Gives modes whose left vectors belong to no single right one an infinite condition: to a multiple eigenvalue a solver
/// finds vectors that are not bi-orthogonal, `v_i' (C + (lambda_i + lambda_j) M) x_j != 0`, and each is sound by itself.
fn mark_mixed(pencil: &Pencil, modes: &mut [Mode], slow: f64) {
    let sizes: Vec<f64> = modes.iter().map(|mode| mode.eigenvalue.norm()).collect();
    for j in 0..modes.len() {
        let other = &modes[j];
        let is_close = |i: usize, conjugate: bool| {
            let distance = turned(modes[i].eigenvalue, conjugate) - other.eigenvalue;
            sizes[i].max(sizes[j]) <= slow || distance.norm() <= CLOSE * sizes[j]
        };
        // A pair stands for its conjugate, too: rounding makes one of the equal rates of two bodies.
        let close: Vec<(usize, bool)> = (0..modes.len())
            .flat_map(|i| [(i, false), (i, true)])
            .filter(|&(i, conjugate)| if conjugate { !modes[i].is_real() } else { i != j })
            .filter(|&(i, conjugate)| is_close(i, conjugate))
            .collect();
        if close.is_empty() {
            continue;
        }
        let products = pencil.products(&other.right);
        let is_mixed = |&(i, conjugate): &(usize, bool)| {
            let (mode, size) = (&modes[i], (modes[i].a.norm() * other.a.norm()).sqrt());
            let middle = 0.5 * (turned(mode.eigenvalue, conjugate) + other.eigenvalue);
            let left: Vec<_> = mode.left.iter().map(|&v| turned(v, conjugate)).collect();
            !(products.slope(middle, &left).norm() <= MIXED * size)
        };
        if close.iter().any(is_mixed) {
            modes[j].condition = f64::INFINITY;
        }
    }
}

/// Whether a mode needs inverse iteration of its own.
fn is_imprecise(mode: &Mode) -> bool {
    mode.residual > BACKWARD_STABLE
}

/// The modes from the solver that computes all of them at once.
fn all_at_once(pencil: &Pencil, vectors: Vectors) -> Result<Vec<Mode>, Error> {
    let is_refined = vectors == Vectors::Refined && pencil.size <= REFINED_SIZE;
    let problem = |factor| Problem { pencil, factor, norms: pencil.norms() };
    Ok(match &pencil.damping {
        &PencilDamping::Proportional { alpha, beta } => {
            let factor = MassFactor::new(pencil.mass.rounded(), &pencil.combination)?;
            let stiffness = factor.normalised(&pencil.stiffness.rounded());
            proportional_modes(&problem(factor), &stiffness, is_refined, [alpha, beta])
        }
        PencilDamping::General(damping) => {
            let (factor, form) = StateForm::of(pencil, damping)?;
            general_modes(&problem(factor), damping, &form, is_refined)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::quadratic_pencil::DoubledRows;
    use crate::modes::solvers::proportional::roots_of_mode;
    use crate::numerics::double_double::Doubled;
    use crate::scene::status::Combination;

    /// A chain of 160 masses between two walls, in units of a steel mesh (K over M of 1e12 1/s^2), without and with a
    /// circulatory part that makes it unsymmetric: its modes come all at once, and inverse iteration, of one
    /// factorisation a mode, has nothing to do.
    #[test]
    fn modes_of_a_large_chain_come_all_at_once() {
        let (n, kappa, beta) = (160, 1e12, 1e-8);
        for skew in [0.0, 1e-3] {
            let entry = |i: usize, j: usize| match (i.abs_diff(j), i < j) {
                (0, _) => 2.0 * kappa,
                (1, true) => -kappa * (1.0 + skew),
                (1, false) => -kappa * (1.0 - skew),
                _ => 0.0,
            };
            let pencil = Pencil {
                combination: Combination::new(Vec::new()),
                size: n,
                mass: DoubledRows::new(n, |i, j| f64::from(u8::from(i == j)).into()),
                damping: PencilDamping::Proportional { alpha: 0.0, beta },
                stiffness: DoubledRows::new(n, |i, j| entry(i, j).into()),
            };
            let modes = all_at_once(&pencil, Vectors::Solved).unwrap();
            assert_eq!(modes.iter().filter(|mode| is_imprecise(mode)).count(), 0, "{skew}");
            // Of a tridiagonal Toeplitz matrix: 2 kappa (1 - sqrt(1 - skew^2) cos(k pi / (n + 1))).
            for k in 1..=n {
                let cosine = (k as f64 * std::f64::consts::PI / (n + 1) as f64).cos();
                let value = 2.0 * kappa * (1.0 - (1.0 - skew * skew).sqrt() * cosine);
                let exact = roots_of_mode(value.into(), (beta * value).into()).0;
                let distance = |mode: &Mode| (mode.eigenvalue - exact).norm();
                let nearest = modes.iter().map(distance).fold(f64::INFINITY, f64::min);
                // The closed form loses two digits of a slow mode to its cosine.
                assert!(nearest <= 1e-12 * exact.norm(), "{skew}: {k}: {nearest:e}");
            }
        }
    }

    /// Two bodies, each of two masses that a spring of stiffness k joins, on soft springs: their slow modes are those of rigid
    /// bodies to 1 / k, though k leaves nothing of the soft springs in working precision.
    #[test]
    fn slow_modes_of_stiff_bodies_keep_their_digits() {
        let (ground, link) = ([1.0, 2.0], 0.5);
        for stiff in [1e6, 1e10, 1e14] {
            let entry = |i: usize, j: usize| match (i, j) {
                (0, 0) => Doubled::from(stiff).add(ground[0].into()),
                (1, 1) => Doubled::from(stiff).add(link.into()),
                (2, 2) => Doubled::from(stiff).add((ground[1] + link).into()),
                (3, 3) => stiff.into(),
                (0, 1) | (1, 0) | (2, 3) | (3, 2) => (-stiff).into(),
                (1, 2) | (2, 1) => (-link).into(),
                _ => 0.0.into(),
            };
            let masses = [1.0, 1.0, 2.0, 2.0];
            let pencil = Pencil {
                combination: Combination::new(Vec::new()),
                size: 4,
                mass: DoubledRows::new(
                    4,
                    |i, j| if i == j { masses[i].into() } else { 0.0.into() },
                ),
                damping: PencilDamping::Proportional { alpha: 0.0, beta: 0.0 },
                stiffness: DoubledRows::new(4, entry),
            };
            let modes = spectrum(&pencil, Vectors::Solved).unwrap();
            let mut found: Vec<f64> = modes.iter().map(|mode| mode.eigenvalue.norm_sqr()).collect();
            found.sort_by(f64::total_cmp);
            // Of masses 2 and 4: kappa^2 - (a + b) kappa + a b - c = 0.
            let (a, b) = ((ground[0] + link) / 2.0, (ground[1] + link) / 4.0);
            let root = (0.25 * (a - b) * (a - b) + link * link / 8.0).sqrt();
            for (found, exact) in found.iter().zip([0.5 * (a + b) - root, 0.5 * (a + b) + root]) {
                assert!((found - exact).abs() <= 4.0 / stiff + 1e-14, "{stiff:e}: {found} {exact}");
            }
        }
    }
}
