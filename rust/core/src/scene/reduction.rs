//! Any status combination as a smaller linear system, by a pair of bases.
//!
//! `R` says which motions are allowed and `L` how the equations combine: a detached contact keeps both
//! coordinates in both; a sliding one drops its normal coordinate from R and merges its normal row into
//! its tangential row with factor -mu (`+`) or +mu (`-`); a sticking one drops both, and its tangential
//! coordinate becomes the prescribed motion `q_t0 + v t`. Then
//!
//! ```text
//! M_s = L' M R,  C_s = L' C R,  K_s = L' K R,  F_s(t) = L' (F - C q'_presc - K q_presc(t)) = F0 + F1 t
//! ```

use nalgebra::DMatrix;

use crate::error::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// `M q'' + C q' + K q = F0 + F1 t` of one status combination; matrices are m by m.
#[derive(Debug, Clone)]
pub struct Reduced {
    pub combination: Combination,
    /// Contact coordinates left free, ascending; the columns of R.
    pub kept: Vec<usize>,
    /// The rest of L.
    pub merges: Vec<RowMerge>,
    pub mass: DMatrix<f64>,
    pub damping: DMatrix<f64>,
    pub stiffness: DMatrix<f64>,
    /// F0 with every sticking contact at q_t0 = 0.
    pub force_constant: Vec<f64>,
    pub force_linear: Vec<f64>,
    /// What each sticking contact adds to F0 per unit of its q_t0.
    pub sticking: Vec<StickingLoad>,
}

/// Row `normal`, times `factor`, is added to the row of the kept coordinate at `position`.
#[derive(Debug, Clone, Copy)]
pub struct RowMerge {
    pub position: usize,
    pub normal: usize,
    pub factor: f64,
}

/// `F0 += load * q_t0`, and the prescribed speed.
#[derive(Debug, Clone)]
pub struct StickingLoad {
    pub contact: usize,
    pub coordinate: usize,
    pub speed: f64,
    pub load: Vec<f64>,
}

impl Reduced {
    /// The reduced system of `combination`.
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        scene.check_combination(combination)?;
        let (kept, merges) = Self::bases_of(scene, combination);
        let mut column = vec![usize::MAX; scene.size];
        for (j, &k) in kept.iter().enumerate() {
            column[k] = j;
        }
        let reduce = |matrix: &SparseMatrix| {
            let m = kept.len();
            let mut reduced = DMatrix::zeros(m, m);
            let mut add = |i: usize, row: usize, factor: f64| {
                for (k, value) in matrix.row(row) {
                    if column[k] != usize::MAX {
                        reduced[(i, column[k])] += factor * value;
                    }
                }
            };
            for (i, &k) in kept.iter().enumerate() {
                add(i, k, 1.0);
            }
            for merge in &merges {
                add(merge.position, merge.normal, merge.factor);
            }
            reduced
        };
        let left = |force: &[f64]| -> Vec<f64> {
            let mut reduced: Vec<f64> = kept.iter().map(|&k| force[k]).collect();
            for merge in &merges {
                reduced[merge.position] += merge.factor * force[merge.normal];
            }
            reduced
        };

        let mut prescribed_velocity = vec![0.0; scene.size];
        let mut sticking = Vec::new();
        for (index, (contact, &status)) in
            scene.contacts.iter().zip(combination.statuses()).enumerate()
        {
            if status == Status::Sticking {
                prescribed_velocity[contact.tangential] = contact.slider_speed;
                // K is symmetric: its row is its column.
                let mut load = vec![0.0; scene.size];
                for (k, value) in scene.stiffness.row(contact.tangential) {
                    load[k] = -value;
                }
                sticking.push(StickingLoad {
                    contact: index,
                    coordinate: contact.tangential,
                    speed: contact.slider_speed,
                    load: left(&load),
                });
            }
        }
        let mut constant = scene.force.clone();
        let mut linear = vec![0.0; scene.size];
        if !sticking.is_empty() {
            scene.damping.add_product(-1.0, &prescribed_velocity, &mut constant);
            scene.stiffness.add_product(-1.0, &prescribed_velocity, &mut linear);
        }
        Ok(Self {
            combination: combination.clone(),
            mass: reduce(&scene.mass),
            damping: reduce(&scene.damping),
            stiffness: reduce(&scene.stiffness),
            force_constant: left(&constant),
            force_linear: left(&linear),
            kept,
            merges,
            sticking,
        })
    }

    /// R and L of a combination: the coordinates left free, ascending, and the merges of rows.
    pub(crate) fn bases_of(
        scene: &Scene,
        combination: &Combination,
    ) -> (Vec<usize>, Vec<RowMerge>) {
        let mut dropped = vec![false; scene.size];
        for (contact, &status) in scene.contacts.iter().zip(combination.statuses()) {
            dropped[contact.normal] = status.is_closed();
            dropped[contact.tangential] = status == Status::Sticking;
        }
        let kept: Vec<usize> = (0..scene.size).filter(|&k| !dropped[k]).collect();
        let merges = scene
            .contacts
            .iter()
            .zip(combination.statuses())
            .filter(|(contact, status)| status.is_sliding() && contact.friction > 0.0)
            .map(|(contact, status)| RowMerge {
                position: kept.partition_point(|&k| k < contact.tangential),
                normal: contact.normal,
                factor: -status.friction_sign() * contact.friction,
            })
            .collect();
        (kept, merges)
    }

    /// m, the number of coordinates left free.
    pub fn size(&self) -> usize {
        self.kept.len()
    }

    /// (R, L) over the dofs of the scene, n by m.
    pub fn bases(&self, scene: &Scene) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut right = DMatrix::zeros(scene.size, self.size());
        let mut left = right.clone();
        for (j, &k) in self.kept.iter().enumerate() {
            let mut unit = vec![0.0; scene.size];
            unit[k] = 1.0;
            right.column_mut(j).copy_from_slice(&scene.coordinates.to_dofs(&unit));
            for merge in self.merges.iter().filter(|merge| merge.position == j) {
                unit[merge.normal] = merge.factor;
            }
            left.column_mut(j).copy_from_slice(&scene.coordinates.to_dofs(&unit));
        }
        (right, left)
    }
}
