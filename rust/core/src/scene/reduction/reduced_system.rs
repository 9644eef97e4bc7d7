//! The linear system that a status combination leaves.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::{Reduction, owned};
use crate::scene::status::Combination;

/// `M q'' + C q' + K q = F0 + F1 t` of one status combination; matrices are m by m.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// Status of every contact.
    pub combination: Combination,
    /// R and L of the combination.
    pub reduction: Reduction,
    /// `L' M R`, kg.
    pub mass: DMatrix<f64>,
    /// `L' C R`, N s/m.
    pub damping: DMatrix<f64>,
    /// `L' K R`, N/m; not symmetric with friction.
    pub stiffness: DMatrix<f64>,
    /// F0 with every sticking contact at q_t0 = 0.
    pub force_constant: Vec<f64>,
    /// F1, m entries, N/s: what the drift of sticking contacts adds to the load per second.
    pub force_linear: Vec<f64>,
    /// What each sticking contact adds to F0 per unit of its q_t0.
    pub sticking_loads: Vec<Vec<f64>>,
    /// The scene in other coordinates, where the combination needs them.
    fitted: Option<Arc<Scene>>,
}

impl Reduced {
    /// The reduced system of `combination`.
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        let (fitted, reduction) = scene.in_motion(combination)?;
        let scene = &*fitted;
        let prescribed_velocity = reduction.prescribed_velocity(scene);
        let load = |&(coordinate, _): &(usize, f64)| reduction.force(&scene.held_load(coordinate));
        let mut linear = vec![0.0; scene.size];
        if !reduction.sticking.is_empty() {
            scene.stiffness.add_product(-1.0, &prescribed_velocity, &mut linear);
        }
        Ok(Self {
            combination: combination.clone(),
            mass: reduction.matrix(&scene.mass),
            damping: reduction.matrix(&scene.damping),
            stiffness: reduction.matrix(&scene.stiffness),
            force_constant: reduction.force_constant(scene),
            force_linear: reduction.force(&linear),
            sticking_loads: reduction.sticking.iter().map(load).collect(),
            reduction,
            fitted: owned(fitted),
        })
    }

    /// The scene in the coordinates of this combination.
    pub(crate) fn scene<'a>(&'a self, scene: &'a Scene) -> &'a Scene {
        self.fitted.as_deref().unwrap_or(scene)
    }

    /// m, the number of coordinates left free.
    pub fn size(&self) -> usize {
        self.reduction.size()
    }

    /// (R, L) over the dofs of the scene, n by m.
    pub fn bases(&self, scene: &Scene) -> Result<(DMatrix<f64>, DMatrix<f64>), Error> {
        let condensed = Condensed::new(scene, &self.combination)?;
        let mut right = DMatrix::zeros(scene.dofs, self.size());
        let mut left = right.clone();
        for (j, &k) in self.reduction.kept.iter().enumerate() {
            let mut unit = vec![0.0; scene.size];
            unit[k] = 1.0;
            let mut shape = unit.clone();
            self.scene(scene).dependents.follow_rates(&mut shape);
            right.column_mut(j).copy_from_slice(&scene.velocities(&shape));
            self.reduction.sources(j).for_each(|(source, factor)| unit[source] = factor);
            match &condensed {
                Some(condensed) => condensed.complete_left(&scene.stiffness, &mut unit),
                None => self.scene(scene).dependents.follow_rates(&mut unit),
            }
            left.column_mut(j).copy_from_slice(&scene.velocities(&unit));
        }
        Ok((right, left))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;
    use crate::linalg::sparse::SparseMatrix;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    fn contact(tangential: Vec<(usize, f64)>, normal: Vec<(usize, f64)>) -> ContactInput {
        ContactInput {
            tangential: Some(Direction::Entries(tangential)),
            normal: Some(Direction::Entries(normal)),
            friction: 0.3,
            static_friction: 0.4,
            slider_speed: 1.0,
            ..Default::default()
        }
    }

    proptest! {
        /// Mass, damping, stiffness and force of a combination are `L' A R` and `L' F` of the matrices over the dofs, whatever
        /// leaves coordinates out: contacts, mass that couples them, dofs without mass, or directions that depend on others.
        #[test]
        fn bases_over_the_dofs_reduce_the_stated_matrices(
            numbers in proptest::collection::vec(-1.0..1.0f64, 50),
            form in 0usize..4,
            held in "[+d-][+ds-]",
        ) {
            let n = 5;
            let definite = |first: usize| {
                let a = DMatrix::from_fn(n, n, |i, j| numbers[(first + i * n + j) % numbers.len()]);
                &a * a.transpose() + DMatrix::identity(n, n)
            };
            let (stiffness, coupled) = (definite(0), definite(25));
            let lumped = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0, 3.0, 1.5, 0.5]));
            let rigid = [contact(vec![(0, 1.0)], vec![(1, 1.0)]), contact(vec![(2, 1.0)], vec![(3, 1.0)])];
            let inclined = [
                contact(vec![(0, 1.0), (1, 0.2)], vec![(2, 1.0)]),
                contact(vec![(3, -0.3), (4, 1.0)], vec![(0, 0.2), (3, -2.0)]),
            ];
            let opposed = [
                contact(vec![(0, 1.0), (1, 0.2)], vec![(2, 1.0)]),
                contact(vec![(0, -0.3), (1, 1.0)], vec![(0, 0.2), (2, -2.0)]),
            ];
            let (mass, contacts) = match form {
                0 => (lumped, rigid),
                1 => (coupled, inclined),
                2 => (DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0, 0.0, 0.0, 0.5])), rigid),
                _ => (lumped, opposed),
            };
            let mass_input = match form {
                1 => Mass::Full(mass.clone()),
                _ => Mass::Lumped(mass.diagonal().data.into()),
            };
            let input = SceneInput {
                mass: mass_input,
                stiffness: SparseMatrix::from_dense(&stiffness),
                damping: Damping::Proportional { mass: 0.2, stiffness: 0.0 },
                force: numbers[..n].to_vec(),
                contacts: contacts.to_vec(),
                ..Default::default()
            };
            let scene = Scene::new(input).expect("a well-posed scene");
            prop_assert_eq!(scene.has_dependent_directions(), form == 3);
            let combination = Combination::parse(&held, 2).expect("statuses");
            let reduced = match Reduced::new(&scene, &combination) {
                // Both close, which may leave the split of their forces open.
                Err(Error::DependentForces { .. }) if form == 3 => return Ok(()),
                reduced => reduced.expect("a regular combination"),
            };
            let (right, left) = reduced.bases(&scene).expect("a regular combination");
            let size = right.amax().max(1.0) * left.amax().max(1.0);
            for (found, stated) in
                [(&reduced.mass, &mass), (&reduced.stiffness, &stiffness), (&reduced.damping, &(&mass * 0.2))]
            {
                let expected = left.transpose() * stated * &right;
                prop_assert!((found - expected).amax() <= 1e-11 * size * stated.amax());
            }
            if !held.contains('s') {
                let force = left.transpose() * DVector::from_column_slice(&numbers[..n]);
                let found = DVector::from_column_slice(&reduced.force_constant);
                prop_assert!((found - force).amax() <= 1e-11 * size);
            }
        }
    }
}
