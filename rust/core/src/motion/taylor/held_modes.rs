//! The modes of the structure with held contacts, as coordinates of the series of a dense scene.
//!
//! In contact coordinates mass does not couple those of the contacts, c, with the others, f. With the modes of these,
//! `K_ff Phi = M_ff Phi diag(w^2)`, `Phi' M_ff Phi = 1`, the coordinates z of `q_f = Phi z` have
//!
//! `M = diag(M_cc, 1)`, `K = [K_cc, K_cf Phi; Phi' K_fc, diag(w^2)]`,
//!
//! as a model of Craig and Bampton (AIAA Journal 6, 1968) that leaves no mode out: contacts are the border of K, whatever
//! the matrices were, and an order of the series costs O(n c). Statuses act on contact coordinates, which stay what they
//! are, so that one eigenproblem serves all combinations.

use nalgebra::{DMatrix, DVector};

use crate::linalg::dense::cholesky;
use crate::linalg::eigen::symmetric;
use crate::linalg::sparse::SparseMatrix;
use crate::modes::mass_factor::MassFactor;
use crate::motion::taylor::bordered::border_of;
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::model::Scene;

/// Residual of a mode relative to the rounding of the product that it takes the place of. Modes of a scene whose slow
/// coordinates are known better than the fast ones round them leave more, and are not used.
const RESIDUAL: f64 = 16.0;
/// Steps by which modes are refined at most (Ogita, Aishima, Japan Journal of Industrial and Applied Mathematics 35, 2018):
/// factors of the mass round more than products with it.
const STEPS: usize = 2;
/// Modes that a step would mix by more than this have equal frequencies to rounding; any orthogonal ones of them will do.
const CLOSE: f64 = 1e-3;

/// A scene in the modes of its structure with held contacts.
#[derive(Debug)]
pub(crate) struct HeldModes {
    /// Its equation of motion; the mode k has the place of `free[k]`. Dofs are not those of this scene.
    pub scene: Scene,
    free: Vec<usize>,
    /// Phi, and its inverse `Phi' M_ff`.
    shapes: DMatrix<f64>,
    inverse: DMatrix<f64>,
}

impl HeldModes {
    /// None of a scene that has other terms than M, `C = alpha M + beta K` and K, whose modes are less exact than its
    /// products, or whose contacts are too many for a border.
    pub fn new(scene: &Scene) -> Option<Self> {
        let (alpha, beta) = scene.proportional?;
        let is_plain = !scene.is_nonlinear()
            && scene.energy_parts.is_none()
            && scene.drive.is_none()
            && scene.massless.is_empty()
            && scene.dependents.is_empty();
        if !is_plain {
            return None;
        }
        let n = scene.size;
        let mut is_free: Vec<bool> = (0..n).map(|k| scene.mass.get(k, k) > 0.0).collect();
        for &(tangential, normal) in &scene.coordinates.slots {
            (is_free[tangential], is_free[normal]) = (false, false);
        }
        let free: Vec<usize> = (0..n).filter(|&k| is_free[k]).collect();
        let [mass, stiffness] =
            [&scene.mass, &scene.stiffness].map(|matrix| matrix.restricted(&free).to_dense());
        let Structure { shapes, squares, inverse } = Structure::new(&mass, &stiffness)?;
        let mut place = vec![None; n];
        free.iter().enumerate().for_each(|(k, &coordinate)| place[coordinate] = Some(k));
        // The part of a row over the free coordinates, in modes.
        let of_modes = |row: &dyn Fn(usize) -> f64| -> DVector<f64> {
            shapes.tr_mul(&DVector::from_iterator(free.len(), free.iter().map(|&j| row(j))))
        };
        let contact: Vec<usize> = (0..n).filter(|&k| !is_free[k]).collect();
        let sides: Vec<DVector<f64>> =
            contact.iter().map(|&c| of_modes(&|j| scene.stiffness.get(c, j))).collect();
        let rows_of = |own: &SparseMatrix, side: bool, diagonal: &dyn Fn(usize) -> f64| {
            SparseMatrix::from_rows(n, |row, entries| {
                match place[row] {
                    None => {
                        entries.extend(own.row(row).filter(|entry| place[entry.0].is_none()));
                        if let (true, Ok(c)) = (side, contact.binary_search(&row)) {
                            let modes = free.iter().zip(&sides[c]);
                            entries.extend(modes.map(|(&j, &value)| (j, value)));
                        }
                    }
                    Some(k) => {
                        entries.push((row, diagonal(k)));
                        if side {
                            entries.extend(contact.iter().zip(&sides).map(|(&c, of)| (c, of[k])));
                        }
                    }
                }
                entries.retain(|entry| entry.1 != 0.0);
                entries.sort_unstable_by_key(|entry| entry.0);
            })
        };
        let mass = rows_of(&scene.mass, false, &|_| 1.0);
        let stiffness = rows_of(&scene.stiffness, true, &|k| squares[k]);
        let damping = mass.combined(alpha, &stiffness, beta);
        let slots = &scene.coordinates.slots;
        let border =
            Terms { proportional: scene.proportional, structure: n, massless: &scene.massless };
        let coupled_mass = coupled_mass(&mass, &damping, &stiffness, Some(border), slots).ok()?;
        let mut force = scene.force.clone();
        let modal = of_modes(&|j| scene.force[j]);
        free.iter().zip(&modal).for_each(|(&j, &value)| force[j] = value);
        let scene = Scene { mass, stiffness, damping, force, coupled_mass, ..scene.clone() };
        border_of(&scene)?;
        Some(Self { scene, free, shapes, inverse })
    }

    /// Positions or velocities in modes.
    pub fn amplitudes(&self, x: &[f64]) -> Vec<f64> {
        let mut x = x.to_vec();
        self.replace(&self.inverse, &mut x);
        x
    }

    /// Displacements or velocities of the scene, from those in modes.
    pub fn displace(&self, x: &mut [f64]) {
        self.replace(&self.shapes, x);
    }

    /// Coordinates that are not those of contacts.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    fn replace(&self, by: &DMatrix<f64>, x: &mut [f64]) {
        let part = DVector::from_iterator(self.free.len(), self.free.iter().map(|&k| x[k]));
        let found = by * part;
        self.free.iter().zip(&found).for_each(|(&k, &value)| x[k] = value);
    }
}

/// Modes of M and K, `K Phi = M Phi diag(squares)` and `Phi' M Phi = 1`.
struct Structure {
    /// Phi, by columns.
    shapes: DMatrix<f64>,
    squares: Vec<f64>,
    /// `Phi' M`
    inverse: DMatrix<f64>,
}

impl Structure {
    /// None where modes are less exact than products with K.
    fn new(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Option<Self> {
        let factor = cholesky(mass).ok()?;
        let normalised = MassFactor::Cholesky(factor.clone()).normalised(stiffness);
        let mut shapes = symmetric(&normalised)?.1;
        factor.l_dirty().tr_solve_lower_triangular_unchecked_mut(&mut shapes);
        let root = mass.diagonal().map(f64::sqrt);
        let limit = RESIDUAL * f64::EPSILON;
        for _ in 0..=STEPS {
            let inverse = shapes.transpose() * mass;
            let forces = stiffness * &shapes;
            let pairs = shapes.column_iter().zip(forces.column_iter());
            let squares: Vec<f64> = pairs.map(|(x, f)| x.dot(&f)).collect();
            // Against the rounding of K phi, in mass-weighted coordinates.
            let sizes = stiffness.abs() * shapes.abs();
            let is_exact = |(k, &square): (usize, &f64)| {
                let residual = forces.column(k) - square * inverse.row(k).transpose();
                let size = sizes.column(k).component_div(&root).amax();
                residual.component_div(&root).amax() <= limit * size
            };
            let masses = symmetric_part(&inverse * &shapes);
            let size = (inverse.abs() * shapes.abs()).amax();
            let is_unit = masses.map_with_location(|i, j, m| m - unit(i, j)).amax() <= limit * size;
            if is_unit && squares.iter().enumerate().all(is_exact) {
                return Some(Self { shapes, squares, inverse });
            }
            // Rounding that is not symmetric would be divided by small differences of slow modes.
            let energies = symmetric_part(shapes.transpose() * &forces);
            let change = DMatrix::from_fn(squares.len(), squares.len(), |i, j| {
                let lost = unit(i, j) - masses[(i, j)];
                let mixed = energies[(i, j)] + squares[j] * lost;
                let apart = squares[j] - squares[i];
                if i != j && mixed.abs() <= CLOSE * apart.abs() {
                    mixed / apart
                } else {
                    0.5 * lost
                }
            });
            shapes += &shapes * change;
        }
        None
    }
}

fn symmetric_part(matrix: DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (&matrix + matrix.transpose())
}

/// An entry of the unit matrix.
fn unit(i: usize, j: usize) -> f64 {
    f64::from(u8::from(i == j))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::linalg::dense::{is_diagonal, max_norm};
    use crate::motion::method_cost::pays_held_modes;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    const SIZE: usize = 32;

    /// A scene of two contacts with directions of two dofs each.
    fn scene(mass: Mass, stiffness: &DMatrix<f64>) -> Scene {
        let along = |dof: usize, part: f64| Direction::Entries(vec![(dof, 1.0), (dof + 20, part)]);
        let contact = |dof: usize| ContactInput {
            tangential: Some(along(dof, 0.5)),
            normal: Some(along(dof + 1, -0.5)),
            friction: 0.5,
            static_friction: 0.5,
            slider_speed: 0.1,
            ..Default::default()
        };
        let input = SceneInput {
            mass,
            stiffness: SparseMatrix::from_dense(stiffness),
            damping: Damping::Proportional { mass: 0.5, stiffness: 1e-5 },
            force: (0..SIZE).map(|k| k as f64).collect(),
            contacts: vec![contact(0), contact(7)],
            impact_friction: true,
            ..Default::default()
        };
        Scene::new(input).expect("well-posed")
    }

    fn square(entries: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(SIZE, SIZE, |i, j| entries[i * SIZE + j])
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        /// Accelerations under the forces of a random state are those of the scene itself.
        #[test]
        fn modes_move_as_the_scene(
            entries in proptest::collection::vec(-1.0..1.0f64, SIZE * SIZE),
            state in proptest::collection::vec(-1.0..1.0f64, SIZE),
            fastest in 1.0..8.0f64,
            coupled in any::<bool>(),
        ) {
            let random = square(&entries);
            let mass = 0.02 * &random * random.transpose() + DMatrix::identity(SIZE, SIZE);
            let turn = random.qr().q();
            let squares = DVector::from_fn(SIZE, |k, _| 10f64.powf(fastest * k as f64 / SIZE as f64));
            let stiffness = &turn * DMatrix::from_diagonal(&squares) * turn.transpose();
            let mass = match coupled {
                true => Mass::Full(mass),
                false => Mass::Lumped(mass.diagonal().iter().copied().collect()),
            };
            let scene = scene(mass, &(0.5 * (&stiffness + stiffness.transpose())));
            let modes = HeldModes::new(&scene).expect("a dense scene");
            prop_assert!(pays_held_modes(&scene) == coupled, "few coordinates with lumped mass stay as they are");
            prop_assert!(!pays_held_modes(&modes.scene));
            let free = modes.scene.mass.restricted(modes.free()).to_dense();
            prop_assert!(is_diagonal(&free));
            // There and back.
            let mut back = modes.amplitudes(&state);
            let z = back.clone();
            modes.displace(&mut back);
            for (back, x) in back.iter().zip(&state) {
                prop_assert!((back - x).abs() <= 1e-12);
            }
            // The same forces, as work done over every coordinate.
            let held = modes.scene.residual(1.0, &z, &z);
            let mut found = held.clone();
            let part = DVector::from_iterator(modes.free.len(), modes.free.iter().map(|&k| held[k]));
            let forces = modes.inverse.tr_mul(&part);
            modes.free.iter().zip(&forces).for_each(|(&k, &force)| found[k] = force);
            let expected = scene.residual(1.0, &state, &state);
            let size = max_norm(&expected);
            for (found, expected) in found.iter().zip(&expected) {
                prop_assert!((found - expected).abs() <= 1e-12 * size, "{found} of {expected}");
            }
        }

        /// Slow modes of a stiffness that knows them to their last digit are not lost among the rounding of fast ones:
        /// they are refused, or the product of all squares is the determinant, which factors find from every entry.
        #[test]
        fn slow_modes_are_as_exact_as_the_stiffness(
            entries in proptest::collection::vec(-1.0..1.0f64, SIZE * SIZE),
            grade in 0.0..8.0f64,
        ) {
            let random = square(&entries);
            let even = 0.02 * &random * random.transpose() + DMatrix::identity(SIZE, SIZE);
            let grades = DVector::from_fn(SIZE, |k, _| 10f64.powf(-grade * k as f64 / SIZE as f64));
            let graded = DMatrix::from_diagonal(&grades);
            let mass = DMatrix::identity(SIZE, SIZE);
            let stiffness = &graded * &even * &graded;
            let found = Structure::new(&mass, &stiffness);
            prop_assert!(found.is_some() || grade > 4.0);
            let Some(found) = found else { return Ok(()) };
            let determinant = 2.0 * grades.map(f64::ln).sum() + even.determinant().ln();
            let sum: f64 = found.squares.iter().map(|square| square.ln()).sum();
            prop_assert!((sum - determinant).abs() <= 1e-11 * (1.0 + determinant.abs()));
        }
    }
}
