//! A frictional unilateral contact with a rigid moving slider, a stop without friction, or friction under a given force.

use crate::error::input::Error;
use crate::linalg::sparse::summed;
use crate::scene::friction::contact_state::ContactState;
use crate::scene::status::Status;

/// A direction whose part independent of the others is smaller than this is refused.
pub(crate) const INDEPENDENCE: f64 = 1e-10;

/// A direction in the space of x.
#[derive(Debug, Clone, PartialEq)]
pub enum Direction {
    /// Along one dof.
    Dof(usize),
    /// Any vector, one entry per dof.
    Vector(Vec<f64>),
    /// Any vector by some of its entries, as (dof, entry), dofs ascending; the others are 0.
    Entries(Vec<(usize, f64)>),
}

impl Direction {
    /// (dof, entry) of every entry that is not zero.
    pub(crate) fn nonzero(&self) -> Vec<(usize, f64)> {
        match self {
            Direction::Dof(dof) => vec![(*dof, 1.0)],
            Direction::Vector(entries) => {
                entries.iter().copied().enumerate().filter(|entry| entry.1 != 0.0).collect()
            }
            Direction::Entries(entries) => {
                entries.iter().copied().filter(|entry| entry.1 != 0.0).collect()
            }
        }
    }

    /// Refuses one that does not fit a scene of `size` dofs.
    fn validate(&self, argument: impl Fn() -> String, size: usize) -> Result<(), Error> {
        let (expected, got) = match self {
            Direction::Dof(dof) if *dof >= size => {
                (format!("a dof index below {size}"), dof.to_string())
            }
            Direction::Vector(entries) if entries.len() != size => {
                (format!("shape ({size},)"), format!("({},)", entries.len()))
            }
            Direction::Dof(_) => return Ok(()),
            Direction::Vector(entries) => return check_finite(&argument(), entries),
            Direction::Entries(entries) => return check_entries(&argument(), entries, size),
        };
        Err(Error::shape(&argument(), &expected, got))
    }
}

/// A contact as a user states it: its directions in the space of x, and its law. One direction may be missing; the default has
/// neither, which a scene refuses, and every number is 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactInput {
    /// t: the slip velocity is `t . x' - slider_speed`. None: a stop without friction.
    pub tangential: Option<Direction>,
    /// n: the gap is `n . x + gap`. None: friction under the normal force `normal_force`, which never opens.
    pub normal: Option<Direction>,
    /// Normal force of a contact without a normal direction, N, positive; 0 with one.
    pub normal_force: f64,
    /// mu, the coefficient of kinetic friction, -, not negative: |T| = mu N while the contact slides.
    pub friction: f64,
    /// Coefficient up to which a sticking contact holds, -, at least `friction`.
    pub static_friction: f64,
    /// Speed of the slider along t, m/s, of either sign.
    pub slider_speed: f64,
    /// Normal velocity after an impact over that before it, -, in [0, 1].
    pub restitution: f64,
    /// Clearance at x = 0, m; negative where the contact is pressed in at x = 0.
    pub gap: f64,
    /// Springs between the contact and the dofs that its directions name.
    pub springs: Springs,
    /// A state in place of Coulomb friction: `friction` and `static_friction` are 0. Loops need a given normal force.
    pub state: Option<ContactState>,
    /// Of friction in a plane: the contact along the other direction, with the same coefficients but its own slider speed. Both have
    /// the same `normal_force`, or one of them has the normal direction, and what belongs to that, for both.
    pub beside: Option<usize>,
}

/// Stiffness of a compliant contact, N/m, along each of its directions; None: rigid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Springs {
    /// Along the normal direction.
    pub normal: Option<f64>,
    /// Along the tangential direction; only where there is one along the normal, too.
    pub tangential: Option<f64>,
}

/// Which coordinates of a contact have mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Inertia {
    #[default]
    Full,
    /// The tangential one alone: gaps close without an impact.
    Tangential,
    /// The normal one alone: refused.
    Normal,
    None,
}

/// Which directions a contact has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Directions {
    /// Friction and unilateral contact.
    Both,
    /// A stop: statuses `+` (closed) and `d`.
    Normal,
    /// Friction under a given normal force: statuses `+`, `-` and `s`; in a plane `o` and `s`, and `d` under that of the
    /// other direction.
    Tangential,
}

impl Directions {
    /// Whether a contact with these directions can have a status.
    pub const fn admit(self, status: Status) -> bool {
        match self {
            Directions::Both => !matches!(status, Status::Slipping | Status::Elastic),
            Directions::Normal => matches!(status, Status::Positive | Status::Detached),
            Directions::Tangential => {
                status.is_closed() && !matches!(status, Status::Slipping | Status::Elastic)
            }
        }
    }
}

/// A contact in contact coordinates: its slip and gap are coordinates of their own. A direction that the contact lacks has a
/// coordinate that is always zero: the tangential one of a stop never moves, and the normal one of friction under a given
/// normal force N is a closed gap without mass on which the load -N acts.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Which directions the contact has.
    pub directions: Directions,
    /// Index of the tangential coordinate.
    pub tangential: usize,
    /// Index of the normal coordinate, which is the gap less the clearance.
    pub normal: usize,
    /// mu, the coefficient of kinetic friction, -: |T| = mu N while the contact slides.
    pub friction: f64,
    /// Coefficient up to which a sticking contact holds, -, at least `friction`.
    pub static_friction: f64,
    /// Speed of the slider along the tangential coordinate, m/s, of either sign.
    pub slider_speed: f64,
    /// Normal velocity after an impact over that before it, -, in [0, 1].
    pub restitution: f64,
    /// Initial clearance, m.
    pub gap: f64,
    /// The other direction of friction in a plane.
    pub plane: Option<Plane>,
    /// The coordinate of a state of its own where the contact can open: held at zero while it is open.
    pub(crate) hidden: Option<usize>,
    pub(crate) inertia: Inertia,
}

/// What one direction of friction in a plane knows of the other one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Index of the contact along the other direction.
    pub beside: usize,
    /// Its tangential coordinate, and the speed of the slider along it, m/s.
    pub tangential: usize,
    pub slider_speed: f64,
    /// Whether their normal force is not given, so that both open at once.
    pub opens: bool,
    /// The component of the direction of slip along the own direction, where this is given.
    pub along: Option<f64>,
    /// The coordinate of the deflection, where a spring ties the contact to its body; see
    /// [`crate::scene::friction::elastic_plane`].
    pub deflection: Option<usize>,
    /// The coordinate of the state of the contact along the other direction, where both can open.
    pub hidden: Option<usize>,
}

impl Contact {
    /// Whether a spring of its own ties it to its body in a plane.
    pub(crate) fn is_elastic(&self) -> bool {
        self.plane.is_some_and(|plane| plane.deflection.is_some())
    }

    /// Whether its normal coordinate is that of the contact along the other direction of its plane.
    pub(crate) fn shares_normal(&self) -> bool {
        self.directions == Directions::Tangential && self.plane.is_some_and(|plane| plane.opens)
    }

    /// Whether it has friction in a plane, of which slip decides the direction.
    pub(crate) fn turns(&self) -> bool {
        self.friction > 0.0 && self.plane.is_some_and(|plane| plane.along.is_none())
    }

    /// The gap at positions q, m.
    pub(crate) fn gap_at(&self, q: &[f64]) -> f64 {
        q[self.normal] + self.gap
    }

    /// The normal coordinate while the contact is closed.
    pub(crate) fn closed(&self) -> f64 {
        0.0 - self.gap
    }

    /// Whether it can open: its normal force is not given.
    pub(crate) fn opens(&self) -> bool {
        self.directions != Directions::Tangential
    }

    pub(crate) fn normal_has_mass(&self) -> bool {
        self.inertia == Inertia::Full
    }

    pub(crate) fn tangential_has_mass(&self) -> bool {
        self.inertia != Inertia::None
    }

    /// Speed of the slider, m/s; 1 of a stop, whose one closed status is `+`.
    pub(crate) fn drive(&self) -> f64 {
        if self.directions == Directions::Normal { 1.0 } else { self.slider_speed }
    }

    /// The status of steady sliding; None where the slider rests.
    pub(crate) fn driven(&self) -> Option<Status> {
        match self.plane {
            None => Status::driven_by(self.drive()),
            Some(plane) => {
                (self.slider_speed != 0.0 || plane.slider_speed != 0.0).then_some(Status::Slipping)
            }
        }
    }

    /// |w| at velocities u, also in a plane.
    pub(crate) fn slip_speed(&self, u: &[f64]) -> f64 {
        let own = u[self.tangential] - self.slider_speed;
        let of_plane = |plane: Plane| own.hypot(u[plane.tangential] - plane.slider_speed);
        self.plane.map_or(own.abs(), of_plane)
    }

    /// Whether it slips in a plane along either direction.
    pub(crate) fn slips_in(&self, plane: Plane, u: &[f64]) -> bool {
        u[self.tangential] != self.slider_speed || u[plane.tangential] != plane.slider_speed
    }

    /// Whether it can have a status.
    pub(crate) fn admits(&self, status: Status) -> bool {
        match self.plane {
            None => self.directions.admit(status),
            Some(plane) => match status {
                Status::Slipping => true,
                Status::Sticking => plane.deflection.is_none(),
                Status::Elastic => plane.deflection.is_some(),
                _ => plane.opens && status == Status::Detached,
            },
        }
    }

    /// T / (mu N) at velocities u: that of a status, or in a plane against the direction of slip.
    pub(crate) fn friction_at(&self, status: Status, u: &[f64]) -> f64 {
        let turns = self.plane.filter(|plane| plane.along.is_none());
        let (Status::Slipping, Some(_)) = (status, turns) else {
            return self.friction_along(status);
        };
        let slip = u[self.tangential] - self.slider_speed;
        let speed = self.slip_speed(u);
        if speed == 0.0 { 0.0 } else { -slip / speed }
    }

    /// T / (mu N) against slip in the given direction of a status.
    pub(crate) fn friction_along(&self, status: Status) -> f64 {
        match status {
            Status::Slipping => -self.plane.and_then(|plane| plane.along).unwrap_or(0.0),
            _ => status.friction_sign(),
        }
    }
}

impl ContactInput {
    pub(crate) fn validate(&self, contact: usize, size: usize) -> Result<(), Error> {
        let named = |field: &str| format!("contact {contact}: {field}");
        if self.tangential.is_none() && self.normal.is_none() {
            return Err(Error::NoDirection { contact });
        }
        for (field, direction) in [("tangential", &self.tangential), ("normal", &self.normal)] {
            let Some(direction) = direction else { continue };
            direction.validate(|| named(field), size)?;
        }
        let (stop, given) = (self.tangential.is_none(), self.normal.is_none());
        let only = |value: f64, missing: bool| !missing || value == 0.0;
        let without_tangential = "0 without a tangential direction";
        let without_normal = "0 without a normal direction";
        let (force, force_holds) = match given {
            // Of friction in a plane the other direction may have the normal one.
            true if self.beside.is_some() => (">= 0", self.normal_force >= 0.0),
            true => ("> 0 without a normal direction", self.normal_force > 0.0),
            false => ("0 with a normal direction", self.normal_force == 0.0),
        };
        let checks = [
            ("friction", self.friction, without_tangential, only(self.friction, stop)),
            (
                "static_friction",
                self.static_friction,
                without_tangential,
                only(self.static_friction, stop),
            ),
            ("slider_speed", self.slider_speed, without_tangential, only(self.slider_speed, stop)),
            ("restitution", self.restitution, without_normal, only(self.restitution, given)),
            ("gap", self.gap, without_normal, only(self.gap, given)),
            ("normal_force", self.normal_force, force, force_holds),
            ("friction", self.friction, ">= 0", self.friction >= 0.0),
            (
                "static_friction",
                self.static_friction,
                ">= friction",
                self.static_friction >= self.friction,
            ),
            ("slider_speed", self.slider_speed, "finite", true),
            ("restitution", self.restitution, "in [0, 1]", (0.0..=1.0).contains(&self.restitution)),
            ("gap", self.gap, "finite", true),
        ];
        let springs = [
            ("normal_stiffness", self.springs.normal, given, without_normal),
            ("tangential_stiffness", self.springs.tangential, stop, without_tangential),
        ];
        let stated = springs.iter().filter_map(|&(field, value, missing, requirement)| {
            Some((field, value?, missing, requirement))
        });
        let positive = stated.clone().map(|(field, value, ..)| (field, value, "> 0", value > 0.0));
        let directed = stated.map(|(field, value, missing, why)| (field, value, why, !missing));
        for (field, value, requirement, holds) in checks.into_iter().chain(positive).chain(directed)
        {
            let requirement = if value.is_finite() { requirement } else { "finite" };
            if !value.is_finite() || !holds {
                return Err(Error::Range { argument: named(field), requirement, value });
            }
        }
        let is_rigid = self.springs.normal.is_none() && !given && self.beside.is_none();
        if self.springs.tangential.is_some() && is_rigid {
            return Err(Error::RigidNormal { contact });
        }
        if let Some(state) = &self.state {
            state.validate(contact, self.slider_speed)?;
            let coulomb = self.static_friction.max(self.friction);
            if coulomb != 0.0 {
                let (argument, requirement) =
                    (named("friction"), "0 beside a state of the contact");
                return Err(Error::Range { argument, requirement, value: coulomb });
            }
        }
        self.check_directions(contact)
    }

    /// The contact with its (tangential, normal) coordinates, of which some have no mass.
    pub(crate) fn in_coordinates(
        &self,
        (tangential, normal): (usize, usize),
        has_mass: impl Fn(usize) -> bool,
    ) -> Contact {
        let inertia = match (self.directions(), has_mass(tangential), has_mass(normal)) {
            (Directions::Tangential, false, _) | (_, false, false) => Inertia::None,
            (_, true, false) => Inertia::Tangential,
            (_, false, true) => Inertia::Normal,
            _ => Inertia::Full,
        };
        Contact {
            directions: self.directions(),
            tangential,
            normal,
            friction: self.friction,
            static_friction: self.static_friction,
            slider_speed: self.slider_speed,
            restitution: self.restitution,
            gap: self.gap,
            plane: None,
            hidden: None,
            inertia,
        }
    }

    /// Whether its normal force is that of the contact along the other direction of its plane.
    pub(crate) fn shares_normal(&self, contacts: &[ContactInput]) -> bool {
        let other = self.beside.and_then(|beside| contacts.get(beside));
        self.normal.is_none() && other.is_some_and(|other| other.normal.is_some())
    }

    /// Which directions it has, of the one at least that it must have.
    pub(crate) fn directions(&self) -> Directions {
        match (&self.tangential, &self.normal) {
            (None, _) => Directions::Normal,
            (_, None) => Directions::Tangential,
            _ => Directions::Both,
        }
    }

    /// Refuses a zero direction, and a normal that is a multiple of the tangential direction.
    fn check_directions(&self, contact: usize) -> Result<(), Error> {
        let (Some(t), Some(n)) = (&self.tangential, &self.normal) else {
            let given = [("tangential", &self.tangential), ("normal", &self.normal)];
            let zero = given.into_iter().find(|(_, direction)| {
                direction.as_ref().is_some_and(|direction| direction.nonzero().is_empty())
            });
            return match zero {
                Some((direction, _)) => Err(Error::ZeroDirection { contact, direction }),
                None => Ok(()),
            };
        };
        let [t, n] = [t, n].map(Direction::nonzero);
        if let ([t], [n]) = (&t[..], &n[..]) {
            return if t.0 == n.0 { Err(Error::NormalIsTangential { contact }) } else { Ok(()) };
        }
        let largest = |entries: &[(usize, f64)]| {
            let values = entries.iter().map(|entry| entry.1);
            values.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
        };
        let (t_largest, n_largest) = (largest(&t), largest(&n));
        for (direction, entry) in [("tangential", t_largest), ("normal", n_largest)] {
            if entry == 0.0 {
                return Err(Error::ZeroDirection { contact, direction });
            }
        }
        // Scaled to the same largest entry, multiples of each other differ by rounding or by sign alone.
        let parallel = |sign: f64| {
            let t = t.iter().map(|&(dof, entry)| (dof, entry / t_largest));
            let n = n.iter().map(|&(dof, entry)| (dof, -sign * entry / n_largest));
            let mut difference = t.chain(n).collect();
            summed(&mut difference);
            difference.iter().all(|entry| entry.1.abs() <= INDEPENDENCE)
        };
        if parallel(1.0) || parallel(-1.0) {
            return Err(Error::NormalIsTangential { contact });
        }
        Ok(())
    }
}

/// Refuses two directions that are not one plane: each names the other, and both have the same numbers.
pub(crate) fn check_planes(contacts: &[ContactInput]) -> Result<(), Error> {
    for (contact, law) in contacts.iter().enumerate() {
        let Some(beside) = law.beside else { continue };
        let refused = |reason| Err(Error::Plane { contact, reason });
        let Some(other) = contacts.get(beside).filter(|other| other.beside == Some(contact)) else {
            return refused("a contact that does not name it as its other direction");
        };
        if beside == contact {
            return refused("itself as its other direction");
        }
        if law.tangential.is_none() {
            return refused("a missing tangential direction");
        }
        let presses = |of: &ContactInput| of.normal.is_some() || of.normal_force > 0.0;
        if law.normal.is_some() && presses(other) || !presses(law) && !presses(other) {
            return refused(
                "a normal direction, or a normal_force, that both directions or none of them states",
            );
        }
        if law.normal.is_some() && beside < contact {
            return refused(
                "a normal direction with the second of its directions; state it with the first",
            );
        }
        if law.state.is_some() {
            return refused("friction with a state");
        }
        let given = law.normal.is_none() && other.normal.is_none();
        let numbers = |of: &ContactInput| {
            [of.friction, of.static_friction, if given { of.normal_force } else { 0.0 }]
        };
        if numbers(law) != numbers(other) {
            return refused("another coefficient or normal force along its other direction");
        }
        if law.friction == 0.0 && law.static_friction > 0.0 {
            let argument = format!("contact {contact}: friction");
            let requirement = "> 0 in a plane beside static friction";
            return Err(Error::Range { argument, requirement, value: 0.0 });
        }
    }
    Ok(())
}

/// Refuses entries of a direction that are not finite, of no dof, or not in the order of dofs.
fn check_entries(argument: &str, entries: &[(usize, f64)], size: usize) -> Result<(), Error> {
    let ascending = entries.windows(2).all(|pair| pair[0].0 < pair[1].0);
    let expected = if ascending { "a dof index below" } else { "ascending dof indices below" };
    match entries.iter().find(|entry| !ascending || entry.0 >= size) {
        Some(&(dof, _)) => {
            Err(Error::shape(argument, &format!("{expected} {size}"), dof.to_string()))
        }
        None => match entries.iter().find(|entry| !entry.1.is_finite()) {
            Some(&(dof, value)) => Err(Error::NotFinite {
                argument: argument.to_owned(),
                place: format!("dof {dof}"),
                value,
            }),
            None => Ok(()),
        },
    }
}

/// Refuses the first entry that is not finite.
pub(crate) fn check_finite(argument: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NotFinite {
            argument: argument.to_owned(),
            place: format!("index {index}"),
            value: values[index],
        }),
        None => Ok(()),
    }
}
