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
        scene.check_combination(combination)?;
        let fitted = scene.moving(combination)?;
        let scene = &*fitted;
        let reduction = Reduction::new(scene, combination).checked(combination)?;
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
            if let Some(condensed) = &condensed {
                condensed.slaved.follow_rates(&mut shape);
            }
            self.scene(scene).dependents.follow_rates(&mut shape);
            right.column_mut(j).copy_from_slice(&scene.velocities(&shape));
            self.reduction.sources(j).for_each(|(source, factor)| unit[source] = factor);
            if let Some(condensed) = &condensed {
                condensed.complete_left(&scene.stiffness, &mut unit);
            }
            self.scene(scene).dependents.follow_rates(&mut unit);
            left.column_mut(j).copy_from_slice(&scene.velocities(&unit));
        }
        Ok((right, left))
    }
}
