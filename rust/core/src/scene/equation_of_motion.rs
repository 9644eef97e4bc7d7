//! The equation of motion of one status combination, `q'' = M_s^-1 L' (F - C q' - K q)`, without forming `L' K R`.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::linalg::dense::{Factors, SINGULAR, smallest_relative_pivot};
use crate::scene::inertia::coupled_mass::CoupledMass;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::{Reduction, owned};
use crate::scene::status::Combination;

impl Scene {
    /// `load F - C q' - K q`
    pub(crate) fn residual(&self, load: f64, q: &[f64], u: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.force.iter().map(|force| load * force).collect();
        self.stiffness.add_product(-1.0, q, &mut residual);
        self.damping.add_product(-1.0, u, &mut residual);
        residual
    }

    /// The load that a unit displacement of a coordinate causes, `-(K + H)_k`.
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
    /// The scene in other coordinates, where the combination needs them.
    pub fitted: Option<Arc<Scene>>,
}

#[derive(Debug)]
enum InverseMass {
    /// Over the kept coordinates.
    Diagonal(Vec<f64>),
    Coupled {
        mass: Arc<CoupledMass>,
        /// Contact coordinates that are kept, and the inverse of the reduced mass over them.
        contact: Vec<usize>,
        inverse: DMatrix<f64>,
    },
}

impl EquationOfMotion {
    pub fn new(scene: &Scene, combination: &Combination) -> Result<Self, Error> {
        scene.check_combination(combination)?;
        let fitted = scene.fitted(combination);
        let reduction = Reduction::new(&fitted, combination).checked(combination)?;
        let inverse = Self::inverse_mass(&fitted, &reduction, combination)?;
        Ok(Self { reduction, inverse, fitted: owned(fitted) })
    }

    fn inverse_mass(
        scene: &Scene,
        reduction: &Reduction,
        combination: &Combination,
    ) -> Result<InverseMass, Error> {
        let Some(mass) = scene.coupled_mass.as_ref().filter(|_| !scene.mass.is_diagonal()) else {
            let inverse = reduction.kept.iter().map(|&k| 1.0 / scene.mass.get(k, k));
            let inverse = InverseMass::Diagonal(inverse.collect());
            return Ok(inverse);
        };
        let places: Vec<usize> = (0..reduction.size())
            .filter(|&i| mass.contact_place(reduction.kept[i]).is_some())
            .collect();
        let contact: Vec<usize> = places.iter().map(|&i| reduction.kept[i]).collect();
        let reduced = DMatrix::from_fn(contact.len(), contact.len(), |i, j| {
            let sources = reduction.sources(places[i]);
            sources.map(|(row, factor)| factor * scene.mass.get(row, contact[j])).sum()
        });
        let pivot = smallest_relative_pivot(&reduced);
        if pivot < SINGULAR {
            return Err(Error::SingularMass { combination: combination.to_string(), pivot });
        }
        let inverse = Factors::new(reduced).solve(DMatrix::identity(contact.len(), contact.len()));
        let inverse = InverseMass::Coupled { mass: Arc::clone(mass), contact, inverse };
        Ok(inverse)
    }

    /// The scene in the coordinates of this combination.
    pub fn scene<'a>(&'a self, scene: &'a Scene) -> &'a Scene {
        self.fitted.as_deref().unwrap_or(scene)
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let mass = match &self.inverse {
            InverseMass::Diagonal(entries) => entries.len(),
            InverseMass::Coupled { inverse, .. } => inverse.len(),
        };
        mass + 4 * self.reduction.size()
    }

    /// The coordinates without mass that are states of first order.
    pub fn creeping(&self) -> &[usize] {
        &self.reduction.states[self.reduction.kept.len()..]
    }

    /// Every coordinate that is not held at zero.
    pub fn moving(&self) -> impl Iterator<Item = usize> + '_ {
        self.reduction.states.iter().copied().chain(self.reduction.held())
    }

    /// In the norm of M: the largest ratio of an acceleration and of the force on the contact-free structure that causes
    /// it in the dual norm. Above 1 by the friction that normal forces bring along.
    pub fn amplification(&self, mass: &CoupledMass) -> f64 {
        let mut map = DMatrix::zeros(mass.contacts(), mass.contacts());
        let mut add = |of: usize, from: usize, entry: f64| {
            let sources = self.reduction.place(from).map(|place| self.reduction.sources(place));
            for (source, factor) in sources.into_iter().flatten() {
                // The load of a given normal force does not depend on the motion.
                let places = [of, source].map(|k| mass.contact_place(k));
                if let [Some(row), Some(column)] = places {
                    map[(row, column)] += entry * factor;
                }
            }
        };
        match &self.inverse {
            InverseMass::Diagonal(inverse) => {
                let kept = self.reduction.kept.iter().zip(inverse);
                kept.for_each(|(&k, &entry)| add(k, k, entry));
            }
            InverseMass::Coupled { contact, inverse, .. } => {
                for (i, &row) in contact.iter().enumerate() {
                    (0..contact.len()).for_each(|j| add(row, contact[j], inverse[(i, j)]));
                }
            }
        }
        mass.map_norm(&map)
    }

    /// q'' of the kept coordinates from the residual `F - K q - C q'`, which is overwritten.
    pub fn accelerate(&self, residual: &mut [f64], acceleration: &mut [f64]) {
        self.accelerate_contacts(&self.reduction.kept, residual, acceleration);
        if let InverseMass::Coupled { mass, .. } = &self.inverse {
            mass.accelerate_free(residual, acceleration);
        }
    }

    /// The same of the coordinates that contacts couple by mass; where mass is diagonal, of those in `some`.
    pub fn accelerate_contacts(
        &self,
        some: &[usize],
        residual: &mut [f64],
        acceleration: &mut [f64],
    ) {
        let Reduction { kept, merges, .. } = &self.reduction;
        for merge in merges {
            residual[kept[merge.position]] += merge.factor * residual[merge.normal];
        }
        match &self.inverse {
            InverseMass::Diagonal(inverse) => {
                for &k in some {
                    let place = self.reduction.place(k);
                    acceleration[k] = place.map_or(0.0, |place| inverse[place] * residual[k]);
                }
            }
            InverseMass::Coupled { contact, inverse, .. } => {
                for (i, &k) in contact.iter().enumerate() {
                    let row = inverse.row(i);
                    acceleration[k] =
                        contact.iter().zip(&row).map(|(&j, entry)| entry * residual[j]).sum();
                }
            }
        }
    }
}
