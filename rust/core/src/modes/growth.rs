//! The stability verdict alone: the largest real part of all eigenvalues, without vectors.
//!
//! With `C = alpha M + beta K` the eigenvalues kappa of the mass-normalised stiffness suffice:
//! `lambda = -d / 2 +- sqrt(d^2 / 4 - kappa)` with `d = alpha + beta kappa`. Where a real part is so small that rounding
//! may have given it its sign, the vectors are computed too and say whether the mode grows, decays or neither.

use std::borrow::Cow;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::dense::regular_solution;
use crate::linalg::eigen;
use crate::modes::mass_factor::MassFactor;
use crate::modes::quadratic_pencil::{DoubledRows, Pencil, PencilDamping};
use crate::modes::solvers::general::StateForm;
use crate::modes::solvers::proportional::roots_of_mode;
use crate::modes::spectrum::{Vectors, spectrum};
use crate::numerics::double_double::Doubled;
use crate::scene::chain::{DOFS, Link, Subsystem, springs};
use crate::scene::model::Scene;
use crate::scene::statics::margins::Steady;
use crate::scene::status::{Combination, Status};

/// The sign of a real part is doubtful below this part of its modulus: a defective pair splits by the square root of
/// rounding.
const DOUBTFUL: f64 = 1e-7;
/// The sign of a real part is doubtful below this part of the largest modulus, the error of the solver in a zero real part.
const NOISE: f64 = 1e3 * f64::EPSILON;

/// The least stable eigenvalue, with nonnegative imaginary part; NaN where the iteration failed. A real part that is
/// zero within rounding is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// lambda of the largest real part, 1/s; -infinity where there is no mode.
    pub eigenvalue: Complex64,
    /// How many modes have a positive real part: a conjugate pair is one.
    pub unstable_modes: usize,
    /// How many eigenvalues have one: both of a conjugate pair count.
    pub unstable_eigenvalues: usize,
}

impl Growth {
    const NONE: Self = Self {
        eigenvalue: Complex64::new(f64::NEG_INFINITY, 0.0),
        unstable_modes: 0,
        unstable_eigenvalues: 0,
    };

    fn include(&mut self, lambda: Complex64) {
        self.unstable_modes += usize::from(lambda.re > 0.0 && lambda.im >= 0.0);
        self.unstable_eigenvalues += usize::from(lambda.re > 0.0);
        // Not so for NaN, which has to stay.
        if !(lambda.re <= self.eigenvalue.re) {
            self.eigenvalue = Complex64::new(lambda.re, lambda.im.abs());
        }
    }

    /// The verdict from all eigenvalues; None if a real part is doubtful.
    fn of_values(values: &[Complex64]) -> Option<Self> {
        let largest = values.iter().map(Complex64::norm_sqr).fold(0.0, f64::max).sqrt();
        let mut growth = Self::NONE;
        for &lambda in values {
            // No doubt is larger than that of the largest value: most moduli are not needed.
            let part = lambda.re.abs();
            if part != 0.0
                && part <= (DOUBTFUL + NOISE) * largest
                && part <= DOUBTFUL * lambda.norm() + NOISE * largest
            {
                return None;
            }
            growth.include(lambda);
        }
        Some(growth)
    }

    /// The verdict from the modes with their vectors.
    fn of_modes(pencil: &Pencil) -> Result<Self, Error> {
        let mut growth = Self::NONE;
        for mode in spectrum(pencil, Vectors::Solved)? {
            let mut lambda = mode.eigenvalue;
            if mode.growth_sign(mode.rounding(pencil)) == 0.0 {
                lambda.re = 0.0;
            }
            growth.include(lambda);
            if !mode.is_real() {
                growth.include(lambda.conj());
            }
        }
        Ok(growth)
    }

    /// The verdict on one combination of a scene.
    pub fn of_scene(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        let (moving, reduction) = scene.in_motion(combination)?;
        pencil_growth(&Pencil::new(&moving, combination, &reduction))
    }
}

/// Arrays that one chain after the other reuses.
#[derive(Debug, Default)]
pub(crate) struct ChainMatrices {
    full: DMatrix<f64>,
    reduced: DMatrix<f64>,
    rows: Vec<SlidingRows>,
    position: Vec<f64>,
    kappas: Vec<Complex64>,
    lambdas: Vec<Complex64>,
}

/// The divisors of the rows of one sliding subsystem, and the factor with which the normal row is merged.
#[derive(Debug)]
struct SlidingRows {
    /// 1 over the upper and the contact mass, 1/kg.
    upper: f64,
    contact: f64,
    /// T / N
    friction: f64,
}

/// The verdict on a chain with `C = beta K` whose contacts all slide, and their normal forces in equilibrium, NaN where
/// that is not unique; `friction(part) = T / N`, negative in negative sliding.
pub(crate) fn chain_growth(
    subsystems: &[Subsystem],
    links: &[Link],
    wall_stiffness: f64,
    beta: f64,
    friction: impl Fn(usize) -> f64,
    matrices: &mut ChainMatrices,
) -> (Growth, Vec<f64>) {
    let count = subsystems.len();
    let (size, m) = (DOFS * count, (DOFS - 1) * count);
    let ChainMatrices { full, reduced, rows, position, kappas, lambdas } = matrices;
    if full.nrows() != size {
        (*full, *reduced) = (DMatrix::zeros(size, size), DMatrix::zeros(m, m));
    }
    full.fill(0.0);
    springs(subsystems, links, wall_stiffness, |k, weights| {
        for &(i, a) in weights {
            for &(j, b) in weights {
                full[(i, j)] += k * (a * b);
            }
        }
    });
    // Row i of the sliding chain is that of its coordinate, with that of the normal coordinate merged into it by friction,
    // over its mass. Not mass-normalised symmetrically but by rows: the eigenvalues are the same, and balancing follows.
    rows.clear();
    position.clear();
    for (part, Subsystem { upper_mass, contact_mass, .. }) in subsystems.iter().enumerate() {
        let (upper, contact) = (1.0 / upper_mass, 1.0 / contact_mass);
        rows.push(SlidingRows { upper, contact, friction: friction(part) });
        position.extend([0.0, subsystems[part].load() * upper, 0.0]);
    }
    let place = |i: usize| DOFS * (i / 3) + i % 3;
    let normal = |part: usize| DOFS * part + 3;
    for j in 0..m {
        let column = full.column(place(j));
        let parts = column.as_slice().chunks_exact(DOFS).zip(&*rows);
        let mut merged = reduced.column_mut(j);
        for (entries, (whole, row)) in merged.as_mut_slice().chunks_exact_mut(3).zip(parts) {
            entries[0] = whole[0] * row.upper;
            entries[1] = whole[1] * row.upper;
            entries[2] = (whole[2] - row.friction * whole[3]) * row.contact;
        }
    }
    let solution = regular_solution(reduced, position);
    let normal_force = |part: usize| {
        solution
            .as_ref()
            .map_or(f64::NAN, |q| (0..m).map(|j| full[(normal(part), place(j))] * q[j]).sum())
    };
    let normal_forces = (0..count).map(normal_force).collect();
    eigen::values_into(reduced, kappas);
    proportional_values(kappas, 0.0, beta, lambdas);
    let growth = Growth::of_values(lambdas).unwrap_or_else(|| {
        let mass = |i: usize| {
            let Subsystem { upper_mass, contact_mass, .. } = subsystems[i / 3];
            if i % 3 == 2 { contact_mass } else { upper_mass }
        };
        let entry = |i: usize, j: usize| {
            let own = Doubled::from(full[(place(i), place(j))]);
            match i % 3 {
                2 => own.add(Doubled::product(-friction(i / 3), full[(normal(i / 3), place(j))])),
                _ => own,
            }
        };
        let pencil = Pencil {
            combination: Combination::new(vec![Status::Positive; count]),
            size: m,
            mass: DoubledRows::new(m, |i, j| Doubled::from(if i == j { mass(i) } else { 0.0 })),
            damping: PencilDamping::Proportional { alpha: 0.0, beta },
            stiffness: DoubledRows::new(m, entry),
        };
        let unknown = Complex64::new(f64::NAN, f64::NAN);
        Growth::of_modes(&pencil).unwrap_or(Growth { eigenvalue: unknown, ..Growth::NONE })
    });
    (growth, normal_forces)
}

/// The eigenvalues that belong to those of the mass-normalised stiffness.
fn proportional_values(kappas: &[Complex64], alpha: f64, beta: f64, lambdas: &mut Vec<Complex64>) {
    lambdas.clear();
    lambdas.extend(kappas.iter().flat_map(|&kappa| {
        let (larger, smaller) = roots_of_mode(kappa, beta * kappa + alpha);
        [larger, smaller]
    }));
}

/// The verdict on a pencil.
pub(crate) fn pencil_growth(pencil: &Pencil) -> Result<Growth, Error> {
    match &pencil.damping {
        &PencilDamping::Proportional { alpha, beta } => {
            let factor = MassFactor::new(pencil.mass.rounded(), &pencil.combination)?;
            let stiffness = pencil.stiffness.rounded();
            proportional_growth(&factor, &stiffness, [alpha, beta], || Cow::Borrowed(pencil))
        }
        PencilDamping::General(rows) => {
            let (_, form) = StateForm::of(pencil, rows)?;
            growth_of(&eigen::values(form.matrix), || Cow::Borrowed(pencil))
        }
    }
}

/// The verdict with `C = alpha M + beta K`, from the factor of M, K in working precision and `[alpha, beta]`; the pencil
/// says what they leave in doubt.
pub(crate) fn proportional_growth<'a>(
    factor: &MassFactor,
    stiffness: &DMatrix<f64>,
    [alpha, beta]: [f64; 2],
    pencil: impl Fn() -> Cow<'a, Pencil>,
) -> Result<Growth, Error> {
    let mut lambdas = Vec::new();
    proportional_values(&eigen::values(factor.normalised(stiffness)), alpha, beta, &mut lambdas);
    growth_of(&lambdas, pencil)
}

fn growth_of<'a>(
    lambdas: &[Complex64],
    pencil: impl Fn() -> Cow<'a, Pencil>,
) -> Result<Growth, Error> {
    let growth = Growth::of_values(lambdas).map_or_else(|| Growth::of_modes(&pencil()), Ok)?;
    if growth.eigenvalue.re.is_nan() {
        let combination = pencil().combination.to_string();
        return Err(Error::Eigenvalues { combination, residual: f64::NAN });
    }
    Ok(growth)
}

/// The verdict on one combination, and whether it is steady sliding.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Its least stable eigenvalue, and how many grow.
    pub growth: Growth,
    /// Whether its steady sliding exists, with the margins of its contacts.
    pub steady: Steady,
}

impl Verdict {
    /// The verdict on one scene in the combination given, or in that of its own sliding.
    pub fn of_scene(scene: &Scene, combination: Option<&Combination>) -> Result<Self, Error> {
        let combination =
            combination.map_or_else(|| scene.sliding_combination(), |c| Ok(c.clone()))?;
        Ok(Self {
            growth: Growth::of_scene(scene, &combination)?,
            steady: scene.steady(&combination)?,
        })
    }
}
