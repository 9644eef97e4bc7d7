//! The kinds of events, and their names.

use serde::{Deserialize, Serialize};

use crate::scene::contact_law::{Contact, Plane};
use crate::scene::status::Status;

/// What happened to one contact at one instant, and the zero of the event function that says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum EventKind {
    /// The slip velocity of a sliding contact reached zero.
    Velocity,
    /// T of a sticking contact reached +mu_static N: it slides with T = +mu N.
    SlipPositive,
    /// T of a sticking contact reached -mu_static N: it slides with T = -mu N.
    SlipNegative,
    /// The normal force reached zero and the contact opened.
    Release,
    /// The gap of an open contact closed.
    Impact,
    /// Infinitely many bounces came to rest; this kind has no event function of its own.
    Accumulation,
    /// The gap of an open contact without mass closed: nothing bounces.
    Closing,
    /// T of a sticking contact without mass reached mu_static N and dropped to mu N, which moved it at once; its event
    /// functions are those of `SlipPositive` and `SlipNegative`.
    Jump,
    /// A load was switched; the event belongs to no contact.
    Load,
    /// The place of a sliding contact turned back along its slider: where an orbit without events is cut. No run has one.
    Turn,
    /// Friction that falls with slip speed reached zero, which ends a run. No run has one.
    Exhausted,
    /// T of a contact that sticks in a plane reached `|T| = mu_static N`: it slips.
    Slip,
}

/// Stands for the contact of an event that belongs to no contact.
pub const NO_CONTACT: usize = usize::MAX;

impl EventKind {
    /// The name that events carry in Python: `slip+`.
    pub const fn name(self) -> &'static str {
        match self {
            EventKind::Velocity => "velocity",
            EventKind::SlipPositive => "slip+",
            EventKind::SlipNegative => "slip-",
            EventKind::Slip => "slip",
            EventKind::Release => "release",
            EventKind::Impact => "impact",
            EventKind::Accumulation => "accumulation",
            EventKind::Closing => "closing",
            EventKind::Jump => "jump",
            EventKind::Load => "load",
            EventKind::Turn => "turn",
            EventKind::Exhausted => "exhausted",
        }
    }

    /// Whether a contact of this status can have such an event, and the motion goes on after it.
    pub(crate) const fn can_end(self, status: Status) -> bool {
        match self {
            EventKind::Velocity => status.is_sliding() || matches!(status, Status::Slipping),
            EventKind::Turn => status.is_sliding(),
            EventKind::SlipPositive
            | EventKind::SlipNegative
            | EventKind::Slip
            | EventKind::Jump => {
                matches!(status, Status::Sticking | Status::Elastic)
            }
            EventKind::Release => status.is_closed(),
            EventKind::Impact | EventKind::Accumulation | EventKind::Closing => !status.is_closed(),
            EventKind::Load | EventKind::Exhausted => false,
        }
    }

    /// What the event sets at once, before forces and impulses follow.
    pub(crate) fn sets(self, contact: &Contact) -> impl Iterator<Item = Set> {
        let closed = (contact.normal, contact.closed());
        let held = |plane: Plane| Set::Speed(plane.tangential, plane.slider_speed);
        // A node that comes to rest sets nothing of its body.
        let stops = self == EventKind::Velocity && !contact.is_elastic();
        let beside = contact.plane.filter(|_| stops).map(held);
        let (place, speed) = match self {
            EventKind::Velocity if stops => {
                (None, Some((contact.tangential, contact.slider_speed)))
            }
            EventKind::Impact | EventKind::Closing => (Some(closed), None),
            EventKind::Accumulation => (Some(closed), Some((contact.normal, 0.0))),
            EventKind::Velocity
            | EventKind::Release
            | EventKind::SlipPositive
            | EventKind::SlipNegative
            | EventKind::Slip
            | EventKind::Jump
            | EventKind::Load
            | EventKind::Turn
            | EventKind::Exhausted => (None, None),
        };
        let place = place.into_iter().map(|(coordinate, place)| Set::Place(coordinate, place));
        let speed = speed.map(|(coordinate, speed)| Set::Speed(coordinate, speed));
        // An open contact has no state, so that one that closes begins without.
        let opens_or_closes = matches!(
            self,
            EventKind::Release | EventKind::Impact | EventKind::Closing | EventKind::Accumulation
        );
        let both = [contact.hidden, contact.plane.and_then(|plane| plane.hidden)];
        let states = both.into_iter().flatten().filter(move |_| opens_or_closes);
        place.chain(speed).chain(beside).chain(states.map(|hidden| Set::Speed(hidden, 0.0)))
    }
}

/// A value of a coordinate that an event sets, whatever it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Set {
    /// Coordinate and place, m.
    Place(usize, f64),
    /// Coordinate and speed, m/s.
    Speed(usize, f64),
}

impl Set {
    pub const fn apply(self, q: &mut [f64], u: &mut [f64]) {
        match self {
            Self::Place(coordinate, place) => q[coordinate] = place,
            Self::Speed(coordinate, speed) => u[coordinate] = speed,
        }
    }

    /// The entry of (q, q') that is set, of n coordinates.
    pub const fn entry(self, n: usize) -> usize {
        match self {
            Self::Place(coordinate, _) => coordinate,
            Self::Speed(coordinate, _) => n + coordinate,
        }
    }
}
