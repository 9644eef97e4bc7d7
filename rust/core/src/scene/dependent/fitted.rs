//! Scenes whose contact directions depend on each other: a floor and a ceiling on one dof, a rigid pad on two points.
//!
//! Every direction has a coordinate of its own, whose value is known in every state, but only independent ones are
//! coordinates of x: the others are sums of these. A combination may hold one of the others; then they change places, in
//! a scene that is *fitted* to it.

use std::borrow::Cow;

use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::INDEPENDENCE;
use crate::scene::dependent::sums::{Dependent, exchange};
use crate::scene::loads::input::Loads;
use crate::scene::model::{EnergyParts, Scene, coupled_mass};
use crate::scene::status::{Combination, Status};

impl Scene {
    /// Brings the coordinates that are sums of others up to date with these.
    pub(crate) fn follow(&self, q: &mut [f64], u: &mut [f64]) {
        for Dependent { coordinate, terms, offset } in &self.dependents {
            q[*coordinate] = terms.iter().fold(*offset, |sum, &(k, factor)| sum + factor * q[k]);
        }
        self.follow_rates(u);
    }

    /// The same of velocities, and of any other difference of positions.
    pub(crate) fn follow_rates(&self, u: &mut [f64]) {
        follow_rates(&self.dependents, u);
    }

    /// Whether a coordinate is a sum of others.
    pub(crate) fn is_dependent(&self, coordinate: usize) -> bool {
        self.dependents.iter().any(|one| one.coordinate == coordinate)
    }

    /// A coordinate as a sum of coordinates of x, in velocities.
    pub(crate) fn terms_of(&self, coordinate: usize) -> Vec<(usize, f64)> {
        let dependent = self.dependents.iter().find(|one| one.coordinate == coordinate);
        dependent.map_or_else(|| vec![(coordinate, 1.0)], |one| one.terms.clone())
    }

    /// A coordinate as a sum of coordinates of x, and the constant that comes with it.
    pub(crate) fn sum_of(&self, coordinate: usize) -> (Vec<(usize, f64)>, f64) {
        let dependent = self.dependents.iter().find(|one| one.coordinate == coordinate);
        (self.terms_of(coordinate), dependent.map_or(0.0, |one| one.offset))
    }

    /// Brings velocities up to date with those known exactly: of `held` coordinates, of gaps that rest and slip velocities
    /// that vanish. What is the same direction as one of them is known as exactly.
    pub(crate) fn follow_held(&self, held: impl Iterator<Item = usize>, u: &mut [f64]) {
        if self.dependents.is_empty() {
            return;
        }
        let mut held: Vec<usize> = held.collect();
        for law in &self.contacts {
            held.extend((u[law.normal] == 0.0).then_some(law.normal));
            held.extend((u[law.tangential] == law.slider_speed).then_some(law.tangential));
        }
        let fitted = self.dependents_beside(&held);
        follow_rates(fitted.as_ref().unwrap_or(&self.dependents), u);
    }

    /// The scene in coordinates of x among which is all that a combination holds, as far as it is independent.
    pub(crate) fn fitted(&self, combination: &Combination) -> Cow<'_, Self> {
        let held: Vec<usize> = self
            .contacts
            .iter()
            .zip(combination.statuses())
            .flat_map(|(law, &status)| {
                let normal = status.is_closed().then_some(law.normal);
                normal.into_iter().chain((status == Status::Sticking).then_some(law.tangential))
            })
            .collect();
        match self.dependents_beside(&held) {
            None => Cow::Borrowed(self),
            Some(dependents) => Cow::Owned(self.in_terms_of(dependents)),
        }
    }

    /// The sums of others when `held` coordinates are among those of x, as far as they are independent; None: as they are.
    fn dependents_beside(&self, held: &[usize]) -> Option<Vec<Dependent>> {
        let mut dependents = self.dependents.clone();
        let mut changed = false;
        for &wanted in held {
            let Some(index) = dependents.iter().position(|one| one.coordinate == wanted) else {
                continue;
            };
            let size =
                dependents[index].terms.iter().fold(0.0, |size: f64, term| size.max(term.1.abs()));
            let free = dependents[index].terms.iter().filter(|term| !held.contains(&term.0));
            let largest = free.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            // Without one it is held by what is held already.
            let Some(&(given, pivot)) = largest.filter(|term| term.1.abs() > INDEPENDENCE * size)
            else {
                continue;
            };
            exchange(&mut dependents, index, given, pivot);
            changed = true;
        }
        changed.then_some(dependents)
    }

    /// The scene with other coordinates as sums of the rest.
    fn in_terms_of(&self, dependents: Vec<Dependent>) -> Self {
        let size = self.size;
        let place = |k: usize| dependents.iter().find(|one| one.coordinate == k);
        let forward = SparseMatrix::from_rows(size, |k, entries| match place(k) {
            None => entries.push((k, 1.0)),
            Some(one) => {
                entries.extend(one.terms.iter().copied());
                entries.sort_unstable_by_key(|entry| entry.0);
            }
        });
        let mut offset = vec![0.0; size];
        dependents.iter().for_each(|one| offset[one.coordinate] = one.offset);
        // Rows of what was no coordinate of x are empty before, of what is none now afterwards.
        let congruent = |matrix: &SparseMatrix| matrix.congruent(&forward);
        let mut force = self.force.clone();
        self.stiffness.add_product(-1.0, &offset, &mut force);
        let force = forward.transposed().apply(&force);
        let mass = congruent(&self.mass);
        let (damping, stiffness) = match &self.energy_parts {
            None => (congruent(&self.damping), congruent(&self.stiffness)),
            Some(_) => {
                let any = |matrix: &SparseMatrix| matrix.transformed(&forward);
                (any(&self.damping), any(&self.stiffness))
            }
        };
        let slots = &self.coordinates.slots;
        let coupled_mass = coupled_mass(&mass, &damping, &stiffness, slots)
            .expect("the positive definite mass in other coordinates");
        Self {
            size,
            dofs: self.dofs,
            contacts: self.contacts.clone(),
            laws: self.laws.clone(),
            impact_friction: self.impact_friction,
            coordinates: self.coordinates.clone(),
            coupled_mass,
            mass,
            damping,
            proportional: self.proportional,
            stiffness,
            energy_parts: self.energy_parts.as_ref().map(|parts| EnergyParts {
                dissipative: congruent(&parts.dissipative),
                elastic: congruent(&parts.elastic),
                antisymmetric: parts.antisymmetric.transformed(&forward),
            }),
            force,
            dependents,
            nodes: self.nodes.clone(),
            massless: self.massless.clone(),
            condensed: self.condensed,
            // Such a scene has no loads in time.
            loads: Loads::default(),
            drive: None,
            bare: None,
        }
    }
}

fn follow_rates(dependents: &[Dependent], u: &mut [f64]) {
    for Dependent { coordinate, terms, .. } in dependents {
        u[*coordinate] = terms.iter().map(|&(k, factor)| factor * u[k]).sum();
    }
}
