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
//! *A normal force that changes* moves the node besides, as `|z| = mu N / k` holds with N: with `r = mu N / k` and the slip speed
//! `s = e . w - r'`
//!
//! ```text
//! slips, `o`:   z' = w - e s,   s >= 0,   (|z|^2 - r^2)' = 2 r s (1 - |e|^2)
//! ```
//!
//! N is affine in the state, and so is N' where nothing else is nonlinear on which the damping of the normal direction acts. The
//! node leaves the slider where `N = 0`, relaxed; towards there its direction changes ever faster, `e' = (I - e e') w / r`, until what
//! it does with |T| <= mu N in the time that is left is below rounding. A force beyond mu N, after a jump of N, moves the node at once to `|z| = r`.
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

use nalgebra::{DMatrix, DVector, RowDVector};

use crate::error::input::Error;
use crate::linalg::dense::Factors;
use crate::linalg::sparse::summed;
use crate::scene::contact_law::{Contact, ContactInput, Plane};
use crate::scene::friction::contact_state::{InState, StateContact};
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;
use crate::scene::status::{Combination, Status};

/// Relative tolerance within which a start state has `|T| = mu N` while its contact slips: that of ten digits.
const AT_LIMIT: f64 = 1e-9;
/// The same, within which an event elsewhere leaves such a force where it is.
const JUMPED: f64 = 1e-12;

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
    /// The coordinate whose reaction is the normal force, where this changes.
    pub normal: Option<usize>,
    /// The deflection at which it slips, `mu N / k`, m; where N changes, per newton.
    pub extent: f64,
}

/// `r = mu N / k`, m, and r', m/s, in a state.
#[derive(Clone, Copy)]
struct Limit {
    extent: f64,
    rate: f64,
}

/// An affine function of the state: terms of q, of q', and a constant.
pub(crate) type Affine = (Vec<(usize, f64)>, Vec<(usize, f64)>, f64);

impl ElasticPlane<'_> {
    /// e: the deflections per `mu N / k`.
    fn direction(&self, u: &[f64], limit: Limit) -> [f64; 2] {
        self.directions.map(|own| own.state_in(u) / limit.extent)
    }

    /// w
    fn slip(&self, u: &[f64]) -> [f64; 2] {
        [0, 1].map(|i| u[self.directions[i].tangential] - self.slider[i])
    }

    /// Moves the node to its limit where the spring is bent beyond, along its force. Gives how far it was bent, per limit.
    fn return_to(&self, limit: Limit, u: &mut [f64]) -> f64 {
        let hidden = self.directions.map(|own| own.coordinate);
        if !(limit.extent > 0.0) {
            hidden.into_iter().for_each(|k| u[k] = 0.0);
            return 0.0;
        }
        let [e, f] = self.direction(u, limit);
        let size = e.hypot(f);
        if size > 1.0 + JUMPED {
            hidden.into_iter().for_each(|k| u[k] /= size);
        }
        size
    }

    /// The slip speed of the node along a direction, `e . w - r'`, and the sum of the absolute values of its terms.
    fn speed(&self, [e, f]: [f64; 2], u: &[f64], limit: Limit) -> [f64; 2] {
        let [w, v] = self.slip(u);
        let terms = [e * w, f * v, -limit.rate];
        [terms.iter().sum(), terms.iter().map(|term| term.abs()).sum()]
    }

    /// What small motions about rest of the node, or about its steady slip, add to C and to K along the first of the directions, as
    /// (row, column, entry). The deflection across the slip is the displacement of the coordinate of the first contact of the plane;
    /// the other coordinates of deflections have no terms.
    pub(super) fn tangents(
        &self,
        contact: usize,
        status: Status,
        pressed: f64,
    ) -> [Vec<(usize, usize, f64)>; 2] {
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
            let extent = self.normal.map_or(self.extent, |_| self.extent * pressed);
            springs.push((p, p, stiffness * speed / extent));
        }
        [rates, springs]
    }

    /// What the contact along the first of the directions does in a state.
    fn in_state(&self, status: Status, u: &[f64], limit: Limit) -> InState {
        let slip = self.slip(u);
        let slips = status == Status::Slipping;
        let [e, f] = if slips { self.direction(u, limit) } else { [0.0; 2] };
        // A deflection that is left out as the normal force vanishes is beyond the limit.
        let beyond = e.hypot(f).max(1.0);
        let [e, f] = [e / beyond, f / beyond];
        let y = if slips { e * self.speed([e, f], u, limit)[0] } else { 0.0 };
        let own = self.directions[0];
        let force = -own.spring() * own.state_in(u);
        let [_, (row, weight)] = own.directions();
        // y by the velocities of both directions.
        let factors = [e * e, e * f];
        let columns = [0, 1].map(|i| (self.directions[i].tangential, factors[i], self.slider[i]));
        let forces = columns.map(|(_, factor, speed)| (row, -weight * factor * speed));
        InState {
            friction: force,
            stored: -force * (slip[0] - y),
            damping: columns.map(|(column, factor, _)| (row, column, -weight * factor)).to_vec(),
            force: forces.into_iter().chain([(row, -weight * e * limit.rate)]).collect(),
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

    /// The contacts with springs of their own in planes that are closed in a combination and whose normal force changes, each with
    /// the coordinate whose reaction this is.
    fn pressed_springs<'a>(
        &'a self,
        combination: &'a Combination,
    ) -> impl Iterator<Item = (usize, ElasticPlane<'a>)> + 'a {
        let closed = |both: &[usize; 2]| combination.statuses()[both[0]].is_closed();
        let springs = self.planes().filter(closed).filter_map(|both| self.elastic_plane(both[0]));
        springs.filter_map(|plane| Some((plane.normal?, plane)))
    }

    /// Moves nodes to the limits of their forces where a jump of the state has lowered these.
    pub(crate) fn return_springs(&self, combination: &Combination, q: &[f64], u: &mut [f64]) {
        for (normal, plane) in self.pressed_springs(combination) {
            let extent = plane.extent * self.reaction_value(normal, q, u);
            plane.return_to(Limit { extent, rate: 0.0 }, u);
        }
    }

    /// The derivative of that, where `matrix` is the one of the jump, from the state before and the one after both. With
    /// `e = z / |z|` before, `z+ = r e`:
    ///
    /// ```text
    /// dz+ = r / |z| (I - e e') dz + e dr
    /// ```
    pub(crate) fn differentiate_return(
        &self,
        combination: &Combination,
        [end, arrived]: [&[f64]; 2],
        matrix: &mut DMatrix<f64>,
    ) {
        let n = self.size;
        for (normal, plane) in self.pressed_springs(combination) {
            let rows = plane.directions.map(|own| n + own.coordinate);
            if rows.iter().all(|&row| end[row] == arrived[row]) {
                continue;
            }
            let [z, moved] =
                [end, arrived].map(|of| plane.directions.map(|own| own.state_in(&of[n..])));
            let size = z[0].hypot(z[1]);
            let e = z.map(|part| part / size);
            let kept = moved[0].hypot(moved[1]) / size;
            let mut by_limit = RowDVector::zeros(2 * n);
            for (k, entry) in self.stiffness.row(normal) {
                by_limit += matrix.row(k) * (plane.extent * entry);
            }
            for (k, entry) in self.damping.row(normal) {
                by_limit += matrix.row(n + k) * (plane.extent * entry);
            }
            let scales = plane.directions.map(|own| own.scale);
            let bent = [0, 1].map(|i| matrix.row(rows[i]) / scales[i]);
            for i in 0..2 {
                let across = &bent[i] - (&bent[0] * e[0] + &bent[1] * e[1]) * e[i];
                matrix.set_row(rows[i], &((across * kept + &by_limit * e[i]) * scales[i]));
            }
        }
    }

    /// Refuses what springs of contacts in planes whose normal force changes are not computed beside: forces that are no linear
    /// functions of the state, where they move this force or, through its damping, its rate.
    pub(crate) fn check_elastic_planes(&self) -> Result<(), Error> {
        let opens = |&[contact, _]: &[usize; 2]| self.contacts[contact].hidden.is_some();
        let elastic = self.planes().filter(|both| self.contacts[both[0]].is_elastic());
        for [contact, _] in elastic.filter(opens) {
            let normal = self.contacts[contact].normal;
            let refused = |reason| Err(Error::Plane { contact, reason });
            if self.contacts_coupled() {
                return refused(
                    "a tangential_stiffness where its normal force changes and mass couples contacts; lump the mass, or state a normal_force",
                );
            }
            if !self.massless.is_empty() {
                return refused(
                    "a tangential_stiffness where its normal force changes beside dofs without mass; state a normal_force, or give the dofs mass",
                );
            }
            let damps = |k: usize| match self.mass.is_diagonal() {
                true => self.damping.get(normal, k) != 0.0,
                false => self.damping.row(normal).any(|entry| entry.1 != 0.0),
            };
            let mut elements = self.nonlinear_elements().flat_map(|(_, one)| &one.direction);
            if elements.any(|&(k, _)| k == normal || damps(k)) {
                return refused(
                    "a tangential_stiffness where an element that is not linear acts on its normal direction, or on a dof to which a damper ties it",
                );
            }
            let bends = |other: usize, law: &Contact| {
                !law.is_elastic() && (law.turns() || self.friction_law(other).is_some())
            };
            let mut others = self.contacts.iter().enumerate();
            if others.any(|(other, law)| bends(other, law) && damps(law.tangential)) {
                return refused(
                    "a tangential_stiffness where damping ties its normal direction to another contact under a law, with a state, or in a plane without a spring",
                );
            }
        }
        Ok(())
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
        let (extent, normal) = (directions[0].law.steady(1.0), directions[0].normal);
        let slider = [law.slider_speed, slider_speed];
        Some(ElasticPlane { directions, beside, slider, normal, extent })
    }

    /// What a contact with a spring of its own in a plane does in a state of the scene.
    pub(super) fn of_elastic_plane(
        &self,
        contact: usize,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Option<InState> {
        let plane = self.elastic_plane(contact)?;
        let status = combination.statuses()[contact];
        // The limit of one that rests bounds its force alone.
        let limit = match status {
            Status::Slipping => self.limit_in(&plane, combination, q, u),
            _ => Limit { extent: plane.extent, rate: 0.0 },
        };
        Some(plane.in_state(status, u, limit))
    }

    /// r and r' of a contact with a spring of its own in a plane.
    fn limit_in(
        &self,
        plane: &ElasticPlane<'_>,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Limit {
        let extent = plane.extent;
        let Some(normal) = plane.normal else { return Limit { extent, rate: 0.0 } };
        let (places, velocities, constant) = self.reaction_rate(combination, normal);
        let sum = |terms: &[(usize, f64)], x: &[f64]| -> f64 {
            terms.iter().map(|&(k, weight)| weight * x[k]).sum()
        };
        let rate = constant + sum(&places, q) + sum(&velocities, u);
        Limit { extent: extent * self.reaction_value(normal, q, u), rate: extent * rate }
    }

    /// The rate of the reaction of a held coordinate, `K q' + C q''` along its row, with the accelerations of a combination.
    pub(crate) fn reaction_rate(&self, combination: &Combination, row: usize) -> Affine {
        let reduction = Reduction::new(self, combination);
        let felt = self.accelerations_felt(&reduction, row);
        let (mut places, mut velocities) =
            (Vec::new(), self.stiffness.row(row).collect::<Vec<_>>());
        let mut constant = 0.0;
        for (i, weight) in felt.into_iter().enumerate().filter(|of| of.1 != 0.0) {
            for (source, factor) in reduction.sources(i) {
                let factor = -weight * factor;
                let scaled = |(k, entry): (usize, f64)| (k, factor * entry);
                places.extend(self.stiffness.row(source).map(scaled));
                velocities.extend(self.damping.row(source).map(scaled));
                constant -= factor * self.force[source];
            }
        }
        summed(&mut places);
        summed(&mut velocities);
        (places, velocities, constant)
    }

    /// `C M^-1` of a row of C: the reaction per force on each of the coordinates that a combination keeps.
    fn accelerations_felt(&self, reduction: &Reduction, row: usize) -> Vec<f64> {
        let mut felt = vec![0.0; reduction.size()];
        for (k, entry) in self.damping.row(row) {
            if let Some(place) = reduction.place(k) {
                felt[place] = entry;
            }
        }
        if felt.iter().all(|&entry| entry == 0.0) {
            return felt;
        }
        if self.mass.is_diagonal() {
            let mass = |place: usize| self.mass.get(reduction.kept[place], reduction.kept[place]);
            felt.iter_mut().enumerate().for_each(|(place, entry)| *entry /= mass(place));
            return felt;
        }
        let mass = Factors::new(reduction.matrix(&self.mass));
        mass.transposed_solve(DVector::from_vec(felt)).as_slice().to_vec()
    }

    /// The status of a closed contact with a spring of its own in a plane after its normal force or its velocity has jumped, and how
    /// many derivatives of its force, from the force itself on, are those of its limit. Beyond the limit its node moves at once, along its force.
    pub(crate) fn settle_elastic_plane(
        &self,
        contact: usize,
        combination: &Combination,
        q: &[f64],
        u: &mut [f64],
    ) -> (Status, u8) {
        let before = combination.statuses()[contact];
        let Some(plane) = self.elastic_plane(contact) else { return (before, 0) };
        let limit = self.limit_in(&plane, combination, q, u);
        let size = plane.return_to(limit, u);
        if size < 1.0 - JUMPED {
            return (Status::Elastic, 0);
        }
        let [speed, terms] = plane.speed(plane.direction(u, limit), u, limit);
        let rounding = JUMPED * terms;
        let slips = speed > rounding || before == Status::Slipping && speed >= -rounding;
        match slips {
            true => (Status::Slipping, 0),
            false => (Status::Elastic, if speed < -rounding { 1 } else { 2 }),
        }
    }

    /// Begins contacts with springs of their own in planes with the friction forces of a state. If it has none, springs are relaxed
    /// where their nodes rest, and pull along the slip with `|T| = mu N` where these slip. Refuses a force beyond that, and one under which the node would slip the other way.
    pub(crate) fn begin_elastic_planes(
        &self,
        combination: &Combination,
        friction_force: &[f64],
        q: &[f64],
        u: &mut [f64],
    ) -> Result<(), Error> {
        for [contact, _] in self.planes() {
            let Some(plane) = self.elastic_plane(contact) else { continue };
            let status = combination.statuses()[contact];
            let slips = status == Status::Slipping;
            let given = !friction_force.is_empty();
            if !status.is_closed() {
                continue;
            }
            let limit = self.limit_in(&plane, combination, q, u);
            if given {
                for (own, contact) in plane.directions.iter().zip([contact, plane.beside]) {
                    u[own.coordinate] = own.rate_of(-friction_force[contact] / own.spring());
                }
            }
            let parts = if slips && !given { plane.slip(u) } else { plane.direction(u, limit) };
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
                return violated(
                    "friction force",
                    size * limit.extent * plane.directions[0].spring(),
                );
            }
            if slips {
                for (own, part) in plane.directions.iter().zip(parts) {
                    u[own.coordinate] = own.rate_of(limit.extent * part / size);
                }
            }
            let [speed, terms] = plane.speed(plane.direction(u, limit), u, limit);
            let rounding = AT_LIMIT * terms;
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
