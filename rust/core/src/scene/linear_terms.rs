//! The terms of the equation of motion that are linear in positions and velocities, in contact coordinates.

use crate::linalg::sparse::SparseMatrix;
use crate::scene::coordinates::contact_coordinates::Coordinates;
use crate::scene::input::proportions::proportions;
use crate::scene::input::scene_input::Damping;

/// The parts of the matrices that the energy of a motion distinguishes and the motion itself does not.
#[derive(Debug, Clone)]
pub(crate) struct EnergyParts {
    /// C, which dissipates.
    pub dissipative: SparseMatrix,
    /// `K + (H + H') / 2`, which stores.
    pub elastic: SparseMatrix,
    /// `H_a = (H - H') / 2`, whose power `-u' H_a x` is neither stored nor dissipated.
    pub antisymmetric: SparseMatrix,
}

/// `(C + G) q' + (K + H) q` in contact coordinates.
pub(crate) struct LinearTerms {
    pub damping: SparseMatrix,
    pub stiffness: SparseMatrix,
    pub proportional: Option<(f64, f64)>,
    pub energy_parts: Option<EnergyParts>,
}

impl LinearTerms {
    /// Of K and C, and of G and H, which are stated over the dofs and nodes; `mass` is in contact coordinates.
    pub fn new(
        coordinates: &Coordinates,
        mass: &SparseMatrix,
        (stiffness, damping): (SparseMatrix, Damping),
        further: [Option<SparseMatrix>; 2],
    ) -> Self {
        let [rotating, following] = further.each_ref().map(Option::is_some);
        let elastic = coordinates.congruent(stiffness);
        let (dissipative, law) = match damping {
            Damping::General(damping) => (coordinates.congruent(damping), None),
            Damping::Proportional { mass: alpha, stiffness: beta } => {
                (mass.combined(alpha, &elastic, beta), Some((alpha, beta)))
            }
        };
        let (damping, stiffness, energy_parts) = if rotating || following {
            let [g, h] = further.map(|given| match given {
                Some(matrix) => coordinates.transformed(matrix),
                None => SparseMatrix::from_rows(coordinates.size(), |_, _| ()),
            });
            let [symmetric, antisymmetric] = h.parts();
            let damping = dissipative.combined(1.0, &g, 1.0);
            let stiffness = elastic.combined(1.0, &h, 1.0);
            let elastic = elastic.combined(1.0, &symmetric, 1.0);
            (damping, stiffness, Some(EnergyParts { dissipative, elastic, antisymmetric }))
        } else {
            (dissipative, elastic, None)
        };
        let proportional = match law {
            // With G, or with H beside beta K, the law of C is not that of C + G.
            Some((_, beta)) if !rotating && (!following || beta == 0.0) => law,
            _ => proportions(&damping, mass, &stiffness),
        };
        Self { damping, stiffness, proportional, energy_parts }
    }
}
