//! Elastic slip in a plane: a contact that a spring of its own ties to its body, in all directions of its plane alike.
//!
//! The node of the spring k has no mass. Its place less that of the body is `-z`, so that the body feels `T = -k z`, and with the
//! velocity `w = (t_x . x' - v_x, t_y . x' - v_y)` of the body over the slider and `e = z / |z|`
//!
//! ```text
//! rests, `s`:   z' = w,              |T| <= mu N
//! slips, `o`:   z' = w - e (e . w),  |T|  = mu N,   e . w >= 0
//! ```
//!
//! e . w is the slip speed of the node where mu N is constant: slip ends where it falls to zero, and begins where |T| comes to
//! mu N. These are the equations of bristles with the product `y = e (e . w)`, of which |z| = mu N / k is an invariant, and one
//! to which a motion returns: with `e = k z / (mu N)` in place of `z / |z|`
//!
//! ```text
//! (|z|^2)' = 2 (z . w) (1 - |e|^2)
//! ```
//!
//! This y is a sum of squares times velocities, `4 e_x e_y = (e_x + e_y)^2 - (e_x - e_y)^2`, each of which is the law of a deflection.
//!
//! *Small motions.* Where the node rests, its spring is one more of the structure. About steady slip, `w = -v`, a deflection along the
//! slip is kept by `|z| = mu N / k`, and the one across it, zeta with the unit vector n, has
//!
//! ```text
//! T' = -k n zeta,   zeta' = n . x' - (k |v| / (mu N)) zeta
//! ```
//!
//! a spring in series with the damper `mu N / |v|` of slip with mass.
//!
//! *Energy.* The spring stores `k |z|^2 / 2`, and the node turns `-T . (w - z') = mu N (e . w)` into heat. Two motions come closer,
//! `(z_1 - z_2) . (y_1 - y_2) >= 0`, since both are in the disc `|z| <= mu N / k`.

use crate::error::input::Error;
use crate::scene::contact_law::{Contact, ContactInput, Plane};
use crate::scene::friction::contact_state::{InState, StateContact};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Relative tolerance within which a start state has `|T| = mu N` while its contact slips: that of ten digits.
const AT_LIMIT: f64 = 1e-9;

impl Combination {
    /// The same, in which the contacts in planes with springs of their own that stick are at rest by their nodes.
    pub fn among(self, contacts: &[ContactInput]) -> Self {
        let elastic = |law: &ContactInput| law.beside.is_some() && law.springs.tangential.is_some();
        let of = |(&status, law): (&Status, &ContactInput)| match status {
            Status::Sticking if elastic(law) => Status::Elastic,
            status => status,
        };
        Self::new(self.statuses().iter().zip(contacts).map(of).collect())
    }
}

/// A contact with a spring of its own that slips in a plane, as both directions know it.
pub(crate) struct ElasticPlane<'a> {
    pub directions: [&'a StateContact; 2],
    /// The contact along the second of them.
    pub beside: usize,
    /// Speeds of the slider, m/s.
    pub slider: [f64; 2],
    /// The deflection at which it slips, `mu N / k`, m.
    pub extent: f64,
}

impl ElasticPlane<'_> {
    /// e: the deflections per `mu N / k`.
    fn direction(&self, u: &[f64]) -> [f64; 2] {
        self.directions.map(|own| own.state_in(u) / self.extent)
    }

    /// w
    fn slip(&self, u: &[f64]) -> [f64; 2] {
        [0, 1].map(|i| u[self.directions[i].tangential] - self.slider[i])
    }

    /// mu N
    fn limit(&self) -> f64 {
        let own = self.directions[0];
        own.normal_force * own.steady_friction(0.0)
    }

    /// The slip speed of the node, e . w.
    fn speed(&self, u: &[f64]) -> f64 {
        let ([e, f], [w, v]) = (self.direction(u), self.slip(u));
        e * w + f * v
    }

    /// What small motions about rest of the node, or about its steady slip, add to C and to K along the first of the directions, as
    /// (row, column, entry). The deflection across the slip is the displacement of the coordinate of the first contact of the plane;
    /// the other coordinates of deflections have no terms.
    pub(super) fn tangents(&self, contact: usize, status: Status) -> [Vec<(usize, usize, f64)>; 2] {
        let own = self.directions[0];
        let (t, first) = (own.tangential, contact < self.beside);
        let stiffness = own.spring();
        if status != Status::Slipping {
            return [Vec::new(), vec![(t, t, stiffness)]];
        }
        let [v, beside] = self.slider;
        let speed = v.hypot(beside);
        // n turns with the order of the contacts.
        let n = if first { -beside } else { beside } / speed;
        let p = self.directions[usize::from(!first)].coordinate;
        let mut rates = vec![(p, t, -stiffness * n)];
        let mut springs = vec![(t, p, stiffness * n)];
        if first {
            rates.push((p, p, stiffness));
            springs.push((p, p, stiffness * speed / self.extent));
        }
        [rates, springs]
    }

    /// What the contact along the first of the directions does in a state.
    fn in_state(&self, status: Status, u: &[f64]) -> InState {
        let ([e, f], slip) = (self.direction(u), self.slip(u));
        let slips = status == Status::Slipping;
        let y = if slips { e * self.speed(u) } else { 0.0 };
        let own = self.directions[0];
        let force = -own.spring() * own.state_in(u);
        let [_, (row, weight)] = own.directions();
        // y by the velocities of both directions.
        let factors = if slips { [e * e, e * f] } else { [0.0; 2] };
        let columns = [0, 1].map(|i| (self.directions[i].tangential, factors[i], self.slider[i]));
        InState {
            friction: force,
            stored: -force * (slip[0] - y),
            damping: columns.map(|(column, factor, _)| (row, column, -weight * factor)).to_vec(),
            force: columns.map(|(_, factor, speed)| (row, -weight * factor * speed)).to_vec(),
            wear: Some(-force * y / own.steady_friction(0.0)),
        }
    }
}

impl Scene {
    /// Whether no term moves the deflection of a contact with a spring of its own in a plane, as in small motions.
    pub(crate) fn keeps_deflection(&self, contact: usize) -> Option<usize> {
        let k = self.contacts[contact].plane?.deflection?;
        self.matrices().iter().all(|matrix| matrix.get(k, k) == 0.0).then_some(k)
    }

    /// Whether springs of their own tie contacts in planes to their bodies.
    pub fn has_elastic_planes(&self) -> bool {
        self.contacts.iter().any(Contact::is_elastic)
    }

    /// The spring of a contact in a plane, its own direction first; None where it has none.
    pub(crate) fn elastic_plane(&self, contact: usize) -> Option<ElasticPlane<'_>> {
        let law = &self.contacts[contact];
        let Plane { beside, slider_speed, .. } = law.plane.filter(|_| law.is_elastic())?;
        let directions = [self.state_of(contact)?, self.state_of(beside)?];
        let extent = directions[0].law.steady(1.0);
        Some(ElasticPlane { directions, beside, slider: [law.slider_speed, slider_speed], extent })
    }

    /// What a contact with a spring of its own in a plane does in a state of the scene.
    pub(super) fn of_elastic_plane(
        &self,
        contact: usize,
        status: Status,
        u: &[f64],
    ) -> Option<InState> {
        Some(self.elastic_plane(contact)?.in_state(status, u))
    }

    /// Begins contacts with springs of their own in planes with the friction forces of a state. If it has none, springs are relaxed
    /// where their nodes rest, and pull along the slip with `|T| = mu N` where these slip. Refuses a force beyond that, and one under which the node would slip the other way.
    pub(crate) fn begin_elastic_planes(
        &self,
        combination: &Combination,
        friction_force: &[f64],
        u: &mut [f64],
    ) -> Result<(), Error> {
        for [contact, _] in self.planes() {
            let Some(plane) = self.elastic_plane(contact) else { continue };
            let status = combination.statuses()[contact];
            let slips = status == Status::Slipping;
            let given = !friction_force.is_empty();
            if given {
                for (own, contact) in plane.directions.iter().zip([contact, plane.beside]) {
                    u[own.coordinate] = own.rate_of(-friction_force[contact] / own.spring());
                }
            }
            let parts = if slips && !given { plane.slip(u) } else { plane.direction(u) };
            let size = parts[0].hypot(parts[1]);
            let violated = |quantity, value| {
                let (argument, status) = ("state", status.letter());
                Err(Error::ViolatedStatus { argument, contact, status, quantity, value })
            };
            let fits = match slips {
                true if given => (size - 1.0).abs() <= AT_LIMIT,
                true => size > 0.0,
                false => size <= 1.0 + AT_LIMIT,
            };
            if !fits {
                return violated("friction force", size * plane.limit());
            }
            if slips {
                for (own, part) in plane.directions.iter().zip(parts) {
                    u[own.coordinate] = own.rate_of(plane.extent * part / size);
                }
            }
            let speed = plane.speed(u);
            let rounding = AT_LIMIT * plane.slip(u).map(f64::abs).iter().sum::<f64>();
            let fits = match slips {
                true => speed >= -rounding,
                false => size < 1.0 - AT_LIMIT || speed <= rounding,
            };
            if !fits {
                return violated("slip velocity of its node", speed);
            }
        }
        Ok(())
    }
}
