//! Friction in a plane, under a given normal force N.
//!
//! Two contacts with directions t_x and t_y, perpendicular to each other in the plane, share their status and their limit. With
//! `w = (t_x . x' - v_x, t_y . x' - v_y)`
//!
//! ```text
//! slips, `o`:   T = -mu N w / |w|
//! sticks, `s`:  w = 0,  |T| <= mu_static N
//! ```
//!
//! In steady sliding, `w = -v`, small motions feel a damper across the slip alone, `mu N / |v| (I - e e')` with `e = w / |w|`: constant
//! friction has none along it.

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{ContactInput, Plane};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

impl Scene {
    /// The same scene, whose contacts know the other directions of their planes.
    pub(crate) fn with_planes(mut self, given: &[ContactInput]) -> Result<Self, Error> {
        let beside = given.iter().enumerate().filter_map(|(i, law)| Some((i, law.beside?)));
        let beside: Vec<(usize, usize)> = beside.collect();
        let Some(&(contact, _)) = beside.first() else { return Ok(self) };
        let refused = |reason| Err(Error::Plane { contact, reason });
        if self.contacts_coupled() {
            return refused("contacts that mass couples or whose directions depend on each other");
        }
        if !self.massless.is_empty() {
            return refused("dofs without mass or compliant contacts");
        }
        for (contact, beside) in beside {
            let other = &self.contacts[beside];
            let (tangential, slider_speed) = (other.tangential, other.slider_speed);
            self.contacts[contact].plane = Some(Plane { beside, tangential, slider_speed });
        }
        Ok(self)
    }

    /// The two contacts of every plane, by the first of them.
    pub(crate) fn planes(&self) -> impl Iterator<Item = [usize; 2]> {
        let all = self.contacts.iter().enumerate();
        all.filter_map(|(contact, law)| Some([contact, law.plane?.beside]))
            .filter(|[first, second]| first < second)
    }

    /// Whether friction acts in a plane.
    pub fn has_planes(&self) -> bool {
        self.contacts.iter().any(|law| law.plane.is_some() && law.friction > 0.0)
    }

    /// A contact in a plane along whose directions the masses differ.
    pub(crate) fn unlike_masses_in_planes(&self) -> Option<usize> {
        let mass = |k: usize| self.mass.get(k, k);
        self.contacts.iter().position(|law| {
            law.plane.is_some_and(|plane| mass(law.tangential) != mass(plane.tangential))
        })
    }

    /// The planes in which contacts of a combination slip with friction.
    pub(crate) fn slipping_in_planes<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = [usize; 2]> + 'a {
        let slips = |first: usize| combination.statuses()[first] == Status::Slipping;
        self.planes().filter(move |&[first, _]| slips(first) && self.contacts[first].friction > 0.0)
    }

    /// `mu N` and `mu_static N`
    pub(crate) fn limits_in_plane(&self, contact: usize) -> [f64; 2] {
        let law = &self.contacts[contact];
        [law.friction, law.static_friction].map(|mu| -mu * self.force[law.normal])
    }

    /// The friction forces in a plane with their tangential coordinates, at slip velocities; none at rest.
    fn slip_forces(&self, [first, second]: [usize; 2], u: &[f64]) -> [(usize, f64); 2] {
        let along = [first, second].map(|contact| {
            let law = &self.contacts[contact];
            (law.tangential, u[law.tangential] - law.slider_speed)
        });
        let speed = along[0].1.hypot(along[1].1);
        let [limit, _] = self.limits_in_plane(first);
        along.map(|(k, w)| (k, if speed == 0.0 { 0.0 } else { -limit * w / speed }))
    }

    /// The friction force of a contact that slips in a plane.
    pub(crate) fn slip_force(&self, contact: usize, u: &[f64]) -> f64 {
        let beside = self.contacts[contact].plane.map(|plane| plane.beside);
        beside.map_or(0.0, |beside| self.slip_forces([contact, beside], u)[0].1)
    }

    /// The scene in which the friction of a state in planes is a constant force.
    pub(crate) fn with_slip_forces(mut self, u: &[f64]) -> Self {
        let planes: Vec<[usize; 2]> = self.planes().collect();
        for contacts in planes {
            for (k, force) in self.slip_forces(contacts, u) {
                self.force[k] += force;
            }
            contacts.iter().for_each(|&contact| self.contacts[contact].friction = 0.0);
        }
        self
    }

    /// C with the dampers of planes across steady sliding; None where nothing slips in a plane.
    pub(crate) fn with_dampers_across(&self, combination: &Combination) -> Option<SparseMatrix> {
        let damper = |contacts: [usize; 2]| {
            let [along, across] = contacts.map(|contact| &self.contacts[contact]);
            let speed = along.slider_speed.hypot(across.slider_speed);
            let direction = vec![
                (along.tangential, -across.slider_speed / speed),
                (across.tangential, along.slider_speed / speed),
            ];
            (self.limits_in_plane(contacts[0])[0] / speed, direction)
        };
        let dampers: Vec<_> = self.slipping_in_planes(combination).map(damper).collect();
        let added = SparseMatrix::of_springs(self.size, &dampers);
        (!dampers.is_empty()).then(|| self.damping.combined(1.0, &added, 1.0))
    }
}
