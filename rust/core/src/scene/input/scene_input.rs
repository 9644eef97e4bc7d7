//! A scene as a user states it.

use nalgebra::DMatrix;

use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::loads::input::Loads;
use crate::scene::massless::coordinates::condensed_stiffness;

/// Mass as a user states it.
#[derive(Debug, Clone)]
pub enum Mass {
    /// Diagonal, kg; 0 where a dof has no mass.
    Lumped(Vec<f64>),
    /// Symmetric, positive definite over the dofs whose rows are not zero, kg.
    Full(DMatrix<f64>),
    /// The same by its nonzero entries, kg.
    Sparse(SparseMatrix),
}

impl Default for Mass {
    fn default() -> Self {
        Self::Lumped(Vec::new())
    }
}

/// Damping as a user states it.
#[derive(Debug, Clone)]
pub enum Damping {
    /// `C = mass M + stiffness K`.
    Proportional {
        /// alpha, 1/s, not negative.
        mass: f64,
        /// beta, s, not negative.
        stiffness: f64,
    },
    /// Any symmetric matrix, N s/m.
    General(SparseMatrix),
}

impl Default for Damping {
    fn default() -> Self {
        Self::Proportional { mass: 0.0, stiffness: 0.0 }
    }
}

impl Damping {
    /// (alpha, beta) as the user stated them.
    pub(crate) fn proportional(&self) -> Option<(f64, f64)> {
        match self {
            Self::Proportional { mass, stiffness } => Some((*mass, *stiffness)),
            Self::General(_) => None,
        }
    }
}

/// Everything a scene is made of; by default it has no dofs.
#[derive(Debug, Clone, Default)]
pub struct SceneInput {
    /// M, n by n, kg.
    pub mass: Mass,
    /// K, n by n, symmetric, N/m.
    pub stiffness: SparseMatrix,
    /// C, n by n, N s/m.
    pub damping: Damping,
    /// G, n by n, skew-symmetric, N s/m: forces of rotating parts, which do no work.
    pub gyroscopic: Option<SparseMatrix>,
    /// H, n by n, any matrix, N/m: forces that follow displacements without a potential, such as follower forces, or
    /// friction that another program put into its stiffness.
    pub circulatory: Option<SparseMatrix>,
    /// F, n entries, N, constant in time.
    pub force: Vec<f64>,
    /// The contacts, in the order of the letters of a combination.
    pub contacts: Vec<ContactInput>,
    /// Whether an impact has a Coulomb impulse too, at most friction times the normal one; else it leaves tangential velocities.
    pub impact_friction: bool,
    /// Loads that depend on time.
    pub loads: Loads,
}

impl SceneInput {
    /// M, C + G, K + H, `K + (H + H') / 2` and `(H - H') / 2` over the dofs.
    pub fn matrices(&self) -> [SparseMatrix; 5] {
        let mass = match &self.mass {
            Mass::Lumped(entries) => SparseMatrix::diagonal(entries),
            Mass::Full(dense) => SparseMatrix::from_dense(dense),
            Mass::Sparse(entries) => entries.clone(),
        };
        let damping = match &self.damping {
            Damping::Proportional { mass: alpha, stiffness: beta } => {
                let stiffness = condensed_stiffness(&mass, &self.stiffness);
                mass.combined(*alpha, stiffness.as_ref().unwrap_or(&self.stiffness), *beta)
            }
            Damping::General(damping) => damping.clone(),
        };
        let damping = match &self.gyroscopic {
            Some(gyroscopic) => damping.combined(1.0, gyroscopic, 1.0),
            None => damping,
        };
        let stiffness = self.stiffness.clone();
        let Some(h) = &self.circulatory else {
            let none = SparseMatrix::from_rows(mass.size(), |_, _| ());
            return [mass, damping, stiffness.clone(), stiffness, none];
        };
        let [symmetric, skew] = h.parts();
        let elastic = stiffness.combined(1.0, &symmetric, 1.0);
        [mass, damping, stiffness.combined(1.0, h, 1.0), elastic, skew]
    }

    /// D by columns: the tangential and the normal direction of every contact; zero where it has none.
    pub fn directions(&self) -> Vec<Vec<f64>> {
        let directions = self.contacts.iter().flat_map(|law| [&law.tangential, &law.normal]);
        directions
            .map(|direction| {
                let mut column = vec![0.0; self.force.len()];
                let entries = direction.iter().flat_map(Direction::nonzero);
                entries.for_each(|(dof, entry)| column[dof] = entry);
                column
            })
            .collect()
    }
}
