//! Scenes whose contact directions depend on each other: a floor and a ceiling on one dof, a rigid pad on two points.
//!
//! Every direction has a coordinate of its own, whose value is known in every state, but only independent ones are
//! coordinates of x: the others are sums of these. A combination may hold one of the others; then they change places, in
//! a scene that is *fitted* to it.

use std::borrow::Cow;

use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::INDEPENDENCE;
use crate::scene::dependent::slaved_coordinates::{Slaved, SlavedCoordinates};
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::linear_terms::EnergyParts;
use crate::scene::loads::input::Loads;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

impl Scene {
    /// Brings the coordinates that are sums of others up to date with these.
    pub(crate) fn follow(&self, q: &mut [f64], u: &mut [f64]) {
        self.dependents.follow(q);
        self.dependents.follow_rates(u);
    }

    /// The acceleration that vibrating sliders add to a coordinate that is a sum of others.
    pub(crate) fn carried_acceleration(&self, coordinate: usize) -> Vec<(usize, f64)> {
        let Some(drive) = &self.drive else { return Vec::new() };
        let terms = self.dependents.find(coordinate).into_iter().flat_map(|one| &one.terms);
        terms
            .filter_map(|&(k, factor)| {
                let rate = drive.oscillators.iter().find(|one| one.coordinate == k)?.rate;
                Some((k, -rate * rate * factor))
            })
            .collect()
    }

    /// The coordinate of a row (tangential, normal) of all contacts.
    pub(crate) fn slot(&self, row: usize) -> usize {
        let law = &self.contacts[row / 2];
        if row.is_multiple_of(2) { law.tangential } else { law.normal }
    }

    /// Whether a coordinate is a sum of others.
    pub(crate) fn is_dependent(&self, coordinate: usize) -> bool {
        self.dependents.find(coordinate).is_some()
    }

    /// A coordinate as a sum of coordinates of x, in velocities.
    pub(crate) fn terms_of(&self, coordinate: usize) -> Vec<(usize, f64)> {
        // What carries loads feels no force.
        let structure = |one: &Slaved| {
            one.terms.iter().copied().filter(|term| term.0 < self.structure()).collect()
        };
        self.dependents.find(coordinate).map_or_else(|| vec![(coordinate, 1.0)], structure)
    }

    /// Brings velocities up to date with those that are known exactly: of `held` coordinates, of gaps at rest, and of slip
    /// velocities that vanish. A coordinate with the same direction as one of these is then known as exactly.
    pub(crate) fn follow_held(&self, held: impl Iterator<Item = usize>, u: &mut [f64]) {
        if !self.has_dependent_directions() {
            return;
        }
        let mut held: Vec<usize> = held.collect();
        for law in &self.contacts {
            held.extend((u[law.normal] == 0.0).then_some(law.normal));
            held.extend((u[law.tangential] == law.slider_speed).then_some(law.tangential));
        }
        let fitted = self.dependents_beside(&held);
        fitted.as_ref().unwrap_or(&self.dependents).follow_rates(u);
    }

    /// The scene in coordinates of x that include all directions that a combination holds, as far as they are independent.
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

    /// The dependent coordinates as sums when `held` coordinates are among those of x, as far as they are independent; None
    /// if nothing changes.
    fn dependents_beside(&self, held: &[usize]) -> Option<SlavedCoordinates> {
        let mut dependents = self.dependents.clone();
        let mut changed = false;
        for &wanted in held {
            let Some(own) = dependents.find(wanted) else { continue };
            let terms = own.terms.iter().filter(|term| term.0 < self.structure());
            let size = terms.clone().fold(0.0, |size: f64, term| size.max(term.1.abs()));
            let free = terms.filter(|term| !held.contains(&term.0));
            // Of equal ones the last coordinate, in whatever order the terms are: the modes of the scene without loads have
            // to be in the same coordinates.
            let largest = free.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(a.0.cmp(&b.0)));
            // Without one it is held by what is held already.
            let Some(&(given, pivot)) = largest.filter(|term| term.1.abs() > INDEPENDENCE * size)
            else {
                continue;
            };
            dependents = dependents.exchanged(wanted, given, pivot);
            changed = true;
        }
        changed.then_some(dependents)
    }

    /// The scene with other coordinates as sums of the rest.
    fn in_terms_of(&self, dependents: SlavedCoordinates) -> Self {
        let (size, n) = (self.size, self.structure());
        let forward = dependents.basis(size, size);
        // Nothing acts back on what carries loads.
        let rows = dependents.basis(size, n).transposed();
        // A row is empty before if its coordinate did not belong to x, and afterwards if it does not belong to x any more.
        let congruent = |matrix: &SparseMatrix| matrix.congruent(&forward);
        let any = |matrix: &SparseMatrix| rows.product(&matrix.product(&forward));
        let force = rows.apply(&self.force);
        let (mass, damping, stiffness) = match (&self.drive, &self.energy_parts) {
            (Some(drive), _) => {
                let mass = any(&self.mass);
                // `h'' = -w^2 h` of sliders that carry coordinates along is a load by their place.
                let inertia = SparseMatrix::from_rows(size, |row, entries| {
                    let carried = mass.row(row).filter(|entry| row < n && entry.0 >= n);
                    entries.extend(carried.filter_map(|(h, entry)| {
                        let rate = drive.oscillators.iter().find(|one| one.coordinate == h)?.rate;
                        Some((h, -rate * rate * entry))
                    }));
                });
                let own = mass.filtered(|row, column| (row < n) == (column < n));
                let own = own.combined(0.5, &own.transposed(), 0.5);
                (own, any(&self.damping), any(&self.stiffness).combined(1.0, &inertia, 1.0))
            }
            (None, Some(_)) => (congruent(&self.mass), any(&self.damping), any(&self.stiffness)),
            (None, None) => {
                (congruent(&self.mass), congruent(&self.damping), congruent(&self.stiffness))
            }
        };
        let slots = &self.coordinates.slots;
        // A border serves one combination here, and is not worth its norm.
        let coupled_mass = coupled_mass(&mass, &damping, &stiffness, None, slots)
            .expect("the positive definite mass in other coordinates");
        Self {
            coupled_mass,
            mass,
            damping,
            stiffness,
            energy_parts: self.energy_parts.as_ref().map(|parts| EnergyParts {
                dissipative: congruent(&parts.dissipative),
                elastic: congruent(&parts.elastic),
                antisymmetric: any(&parts.antisymmetric),
            }),
            force,
            dependents,
            loads: Loads::default(),
            ..self.clone()
        }
    }
}
