//! The equation of motion of one status combination, `q'' = M_s^-1 L' (F - C q' - K q)`, without forming `L' K R`.

use nalgebra::DMatrix;

use crate::error::Error;
use crate::linalg::dense::{Factors, SINGULAR, smallest_relative_pivot};
use crate::scene::model::Scene;
use crate::scene::reduction::Reduction;
use crate::scene::status::Combination;

impl Scene {
    /// `load F - C q' - K q`
    pub(crate) fn residual(&self, load: f64, q: &[f64], u: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.force.iter().map(|force| load * force).collect();
        self.stiffness.add_product(-1.0, q, &mut residual);
        self.damping.add_product(-1.0, u, &mut residual);
        residual
    }

    /// What a displacement of one of a coordinate adds to the loads, `-(K + H)_k`.
    pub(crate) fn held_load(&self, coordinate: usize) -> Vec<f64> {
        let mut load = vec![0.0; self.size];
        if self.energy_parts.is_none() && self.drive.is_none() && !self.condensed {
            // K is symmetric: its row is its column.
            self.stiffness.row(coordinate).for_each(|(k, value)| load[k] = -value);
        } else {
            load.iter_mut()
                .enumerate()
                .for_each(|(k, load)| *load = 0.0 - self.stiffness.get(k, coordinate));
        }
        load
    }
}

#[derive(Debug)]
pub(crate) struct EquationOfMotion {
    pub reduction: Reduction,
    inverse: InverseMass,
}

/// Over the kept coordinates.
#[derive(Debug)]
enum InverseMass {
    Diagonal(Vec<f64>),
    Full(DMatrix<f64>),
}

impl EquationOfMotion {
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        scene.check_combination(combination)?;
        let reduction = Reduction::new(scene, combination);
        let m = reduction.size();
        let inverse = if scene.lumped {
            let inverse = reduction.kept.iter().map(|&k| 1.0 / scene.mass.get(k, k));
            InverseMass::Diagonal(inverse.collect())
        } else {
            let mass = reduction.matrix(&scene.mass);
            let pivot = smallest_relative_pivot(&mass);
            if pivot < SINGULAR {
                return Err(Error::SingularMass { combination: combination.to_string(), pivot });
            }
            InverseMass::Full(Factors::new(mass).solve(DMatrix::identity(m, m)))
        };
        Ok(Self { reduction, inverse })
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let mass = match &self.inverse {
            InverseMass::Diagonal(entries) => entries.len(),
            InverseMass::Full(entries) => entries.len(),
        };
        mass + 4 * self.reduction.size()
    }

    /// Every coordinate that is not held at zero.
    pub fn moving(&self) -> impl Iterator<Item = usize> + '_ {
        let Reduction { kept, sticking, .. } = &self.reduction;
        kept.iter().copied().chain(sticking.iter().map(|stick| stick.0))
    }

    /// `|M_s^-1| sizes`
    pub fn accelerated_sizes(&self, sizes: &[f64]) -> Vec<f64> {
        match &self.inverse {
            InverseMass::Diagonal(inverse) => {
                inverse.iter().zip(sizes).map(|(inverse, size)| inverse * size).collect()
            }
            InverseMass::Full(inverse) => inverse
                .row_iter()
                .map(|row| row.iter().zip(sizes).map(|(a, size)| a.abs() * size).sum())
                .collect(),
        }
    }

    /// q'' of the kept coordinates from the residual `F - K q - C q'`, which is overwritten.
    pub fn accelerate(&self, residual: &mut [f64], acceleration: &mut [f64]) {
        let Reduction { kept, merges, .. } = &self.reduction;
        for merge in merges {
            residual[kept[merge.position]] += merge.factor * residual[merge.normal];
        }
        match &self.inverse {
            InverseMass::Diagonal(inverse) => {
                for (&k, inverse) in kept.iter().zip(inverse) {
                    acceleration[k] = inverse * residual[k];
                }
            }
            InverseMass::Full(inverse) => {
                kept.iter().for_each(|&k| acceleration[k] = 0.0);
                for (&j, column) in kept.iter().zip(inverse.column_iter()) {
                    for (&k, entry) in kept.iter().zip(&column) {
                        acceleration[k] += entry * residual[j];
                    }
                }
            }
        }
    }
}
