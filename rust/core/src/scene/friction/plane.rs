//! Friction in a plane.
//!
//! Two contacts with directions t_x and t_y, perpendicular to each other in the plane, share their status, their coefficients and
//! their normal force N, which is given or that of the normal direction of the first of them. With
//! `w = (t_x . x' - v_x, t_y . x' - v_y)`
//!
//! ```text
//! slips, `o`:   T = -mu N w / |w|
//! sticks, `s`:  w = 0,  |T| <= mu_static N
//! open, `d`:    g > 0,  T = 0
//! ```
//!
//! In steady sliding, `w = -v`, small motions feel friction along -v that follows the normal force, and a damper across the slip,
//! `mu N / |v| (I - e e')` with `e = w / |w|`. Along it friction over slip speed has `mu' N e e'`, and constant friction none.

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{Contact, ContactInput, Plane};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Steps of Newton's method to a direction of slip where masses differ.
const NEWTON: usize = 60;

/// What is left of a momentum or a force R beside a friction limit: `(M k + limit) e = R` with `|e| = 1`, as (k, e); None where the
/// limit is not exceeded. Of a momentum, k is the slip speed after an impulse in the cone of friction.
pub(crate) fn beyond_limit(mass: [f64; 2], limit: f64, r: [f64; 2]) -> Option<(f64, [f64; 2])> {
    let length = |e: [f64; 2]| e[0].hypot(e[1]);
    if !(length(r) > limit) {
        return None;
    }
    let [m, n] = mass;
    if m == n {
        let whole = length(r);
        return Some(((whole - limit) / m, r.map(|part| part / whole)));
    }
    let of = |k: f64| [r[0] / (m * k + limit), r[1] / (n * k + limit)];
    // |e| falls and is convex over k: Newton's method comes from below.
    let mut k = 0.0;
    for _ in 0..NEWTON {
        let e = of(k);
        let fall = m * e[0] * e[0] / (m * k + limit) + n * e[1] * e[1] / (n * k + limit);
        let next = k + (length(e) - 1.0) * length(e) / fall;
        if !(next > k) {
            break;
        }
        k = next;
    }
    let e = of(k);
    Some((k, e.map(|part| part / length(e))))
}

impl Scene {
    /// The same scene, whose contacts know the other directions of their planes.
    pub(crate) fn with_planes(mut self, given: &[ContactInput]) -> Result<Self, Error> {
        let beside = given.iter().enumerate().filter_map(|(i, law)| Some((i, law.beside?)));
        let beside: Vec<(usize, usize)> = beside.collect();
        let Some(&(contact, _)) = beside.first() else { return Ok(self) };
        let refused = |reason| Err(Error::Plane { contact, reason });
        if self.has_dependent_directions() {
            return refused("contacts whose directions depend on each other");
        }
        for (contact, beside) in beside {
            if !self.contacts[contact].tangential_has_mass() {
                return Err(Error::Plane { contact, reason: "dofs without mass on which it acts" });
            }
            let opens = given[contact].normal.is_some() || given[beside].normal.is_some();
            let other = &self.contacts[beside];
            let (tangential, slider_speed) = (other.tangential, other.slider_speed);
            let (gap, restitution, hidden) = (other.gap, other.restitution, other.hidden);
            let own = &mut self.contacts[contact];
            let plane = Plane {
                beside,
                tangential,
                slider_speed,
                opens,
                along: None,
                deflection: None,
                hidden,
            };
            own.plane = Some(plane);
            if own.shares_normal() {
                (own.gap, own.restitution) = (gap, restitution);
            }
        }
        Ok(self)
    }

    /// The two contacts of every plane, by the first of them.
    pub(crate) fn planes(&self) -> impl Iterator<Item = [usize; 2]> {
        let all = self.contacts.iter().enumerate();
        all.filter_map(|(contact, law)| Some([contact, law.plane?.beside]))
            .filter(|[first, second]| first < second)
    }

    /// Whether friction acts in a plane, in no given direction.
    pub fn has_planes(&self) -> bool {
        self.contacts.iter().any(Contact::turns)
    }

    /// A combination with another status of one contact, and of the other direction of its plane.
    pub(crate) fn with_status(
        &self,
        combination: &Combination,
        contact: usize,
        status: Status,
    ) -> Combination {
        let next = combination.with(contact, status);
        let plane = self.contacts.get(contact).and_then(|law| law.plane);
        match plane {
            Some(plane) => next.with(plane.beside, status),
            None => next,
        }
    }

    /// The planes in which contacts of a combination slip, in no given direction.
    pub(crate) fn slipping_in_planes<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = [usize; 2]> + 'a {
        let slips = |&[first, _]: &[usize; 2]| {
            self.contacts[first].turns() && combination.statuses()[first] == Status::Slipping
        };
        self.planes().filter(slips)
    }

    /// The direction of slip in a plane, at slip velocities; zero at rest.
    fn slip_direction(&self, contacts: [usize; 2], u: &[f64]) -> [f64; 2] {
        let slip = contacts.map(|contact| {
            let law = &self.contacts[contact];
            u[law.tangential] - law.slider_speed
        });
        let speed = slip[0].hypot(slip[1]);
        if speed == 0.0 { [0.0; 2] } else { slip.map(|w| w / speed) }
    }

    /// The scene in which friction in planes acts along the slip of a state, in proportion to the normal forces.
    pub(crate) fn with_slip_directions(mut self, u: &[f64]) -> Self {
        let planes: Vec<[usize; 2]> = self.planes().collect();
        for contacts in planes {
            let direction = self.slip_direction(contacts, u);
            for (contact, along) in contacts.into_iter().zip(direction) {
                self.contacts[contact].plane.iter_mut().for_each(|own| own.along = Some(along));
            }
        }
        self
    }

    /// Small motions about steady sliding of a combination in planes.
    pub(super) fn about_slip_in_planes(&self, combination: &Combination) -> Result<Self, Error> {
        let still = vec![0.0; self.size];
        let mut about = self.clone().with_slip_directions(&still);
        let slipping: Vec<[usize; 2]> = self.slipping_in_planes(combination).collect();
        let Some(&[first, _]) = slipping.first() else { return Ok(about) };
        if let Some(&[contact, _]) =
            slipping.iter().find(|of| self.contacts[of[0]].driven().is_none())
        {
            return Err(Error::NoSlidingDirection { contact });
        }
        let pressed = match slipping.iter().any(|of| self.contacts[of[0]].opens()) {
            false => self.contacts.iter().map(|law| -self.force[law.normal]).collect(),
            true => {
                let sticks = |&status: &Status| status == Status::Sticking;
                if let Some(stuck) = combination.statuses().iter().position(sticks) {
                    let combination = combination.to_string();
                    return Err(Error::NoSteadyState { contact: first, stuck, combination });
                }
                about.steady(combination)?.margins
            }
        };
        let dampers = |&[first, second]: &[usize; 2]| {
            let rows = [first, second].map(|contact| self.contacts[contact].tangential);
            let [x, y] = self.slip_direction([first, second], &still);
            let speed = self.contacts[first].slip_speed(&still);
            let along = vec![(rows[0], x), (rows[1], y)];
            let across = vec![(rows[0], -y), (rows[1], x)];
            let [of_along, of_across] = [
                self.friction_slope(first, &still) * pressed[first],
                self.friction_at(first, &still) * pressed[first] / speed,
            ];
            [(of_across, across), (of_along, along)]
        };
        let mut dampers: Vec<_> = slipping.iter().flat_map(dampers).collect();
        dampers.retain(|damper| damper.0 != 0.0);
        if dampers.iter().any(|damper| damper.0.is_nan()) {
            let combination = combination.to_string();
            return Err(Error::SingularStiffness { combination, reciprocal_condition: 0.0 });
        }
        let added = SparseMatrix::of_springs(self.size, &dampers);
        (about.damping, about.proportional) = (self.damping.combined(1.0, &added, 1.0), None);
        Ok(about)
    }
}
