//! Chains of subsystems: matrices from their parameters.

use crate::linalg::sparse::SparseMatrix;

/// One subsystem of a chain: an upper mass (horizontal, vertical) tied to a contact mass (tangential,
/// normal to a slider inclined by `inclination`). SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Subsystem {
    /// Mass of the upper body in both its directions, kg.
    pub upper_mass: f64,
    /// Mass of the contact body in both its directions, kg.
    pub contact_mass: f64,
    /// rad; horizontal of the contact mass is `cos x_t - sin x_n`, vertical `sin x_t + cos x_n`.
    pub inclination: f64,
    /// Stiffness between the verticals of upper and contact mass, N/m.
    pub vertical_stiffness: f64,
    /// Stiffness between the horizontals of upper and contact mass, N/m.
    pub horizontal_stiffness: f64,
    /// Stiffness between the ceiling and the vertical of the upper mass, N/m.
    pub ceiling_stiffness: f64,
    /// How far the ceiling is pressed down, m.
    pub preload_displacement: f64,
    /// Force on the upper mass, N; positive downwards.
    pub external_force: f64,
}

impl Subsystem {
    /// Force on the vertical of the upper mass, N; positive upwards.
    pub(crate) fn load(&self) -> f64 {
        -self.ceiling_stiffness * self.preload_displacement - self.external_force
    }
}

/// The springs between the upper masses of two neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Between the horizontals of the two upper masses, N/m.
    pub horizontal_stiffness: f64,
    /// Between the verticals of the two upper masses, N/m.
    pub vertical_stiffness: f64,
}

/// Dofs per subsystem: upper horizontal, upper vertical, contact tangential, contact normal.
pub const DOFS: usize = 4;

/// Hands every spring of a chain to `spring` as (stiffness, weights): it resists the elongation `sum_k weight_k x_k`.
/// The wall holds the first upper mass horizontally.
pub(crate) fn springs(
    subsystems: &[Subsystem],
    links: &[Link],
    wall_stiffness: f64,
    mut spring: impl FnMut(f64, &[(usize, f64)]),
) {
    for (index, part) in subsystems.iter().enumerate() {
        let [horizontal, vertical, tangential, normal] = [0, 1, 2, 3].map(|k| DOFS * index + k);
        let (sin, cos) = part.inclination.sin_cos();
        if index == 0 {
            spring(wall_stiffness, &[(horizontal, 1.0)]);
        }
        spring(part.ceiling_stiffness, &[(vertical, 1.0)]);
        spring(part.vertical_stiffness, &[(vertical, 1.0), (tangential, -sin), (normal, -cos)]);
        spring(part.horizontal_stiffness, &[(horizontal, 1.0), (tangential, -cos), (normal, sin)]);
        if let Some(link) = links.get(index)
            && index + 1 < subsystems.len()
        {
            spring(link.horizontal_stiffness, &[(horizontal, 1.0), (horizontal + DOFS, -1.0)]);
            spring(link.vertical_stiffness, &[(vertical, 1.0), (vertical + DOFS, -1.0)]);
        }
    }
}

/// (mass, stiffness, force) of a chain.
pub fn chain(
    subsystems: &[Subsystem],
    links: &[Link],
    wall_stiffness: f64,
) -> (Vec<f64>, SparseMatrix, Vec<f64>) {
    let size = DOFS * subsystems.len();
    let mut all = Vec::new();
    springs(subsystems, links, wall_stiffness, |stiffness, elongation| {
        all.push((stiffness, elongation.to_vec()));
    });
    let mut mass = Vec::with_capacity(size);
    let mut force = vec![0.0; size];
    for (index, part) in subsystems.iter().enumerate() {
        force[DOFS * index + 1] = part.load();
        mass.extend([part.upper_mass, part.upper_mass, part.contact_mass, part.contact_mass]);
    }
    (mass, SparseMatrix::of_springs(size, &all), force)
}
