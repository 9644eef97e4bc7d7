//! The kinds of events, and their names.

use crate::error::input::Error;
use crate::scene::contact_law::Contact;
use crate::scene::status::Status;

/// What happened to one contact at one instant, and the zero of the event function that says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
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
}

/// A coordinate whose place, m, or speed, m/s, is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Set {
    Place(usize, f64),
    Speed(usize, f64),
}

impl Set {
    pub fn apply(self, q: &mut [f64], u: &mut [f64]) {
        match self {
            Set::Place(coordinate, place) => q[coordinate] = place,
            Set::Speed(coordinate, speed) => u[coordinate] = speed,
        }
    }
}

/// Stands for the contact of an event that belongs to no contact.
pub const NO_CONTACT: usize = usize::MAX;

impl EventKind {
    /// The name that events carry in records and in Python: `slip+`.
    pub const fn name(self) -> &'static str {
        match self {
            EventKind::Velocity => "velocity",
            EventKind::SlipPositive => "slip+",
            EventKind::SlipNegative => "slip-",
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

    const ALL: [EventKind; 11] = [
        EventKind::Velocity,
        EventKind::SlipPositive,
        EventKind::SlipNegative,
        EventKind::Release,
        EventKind::Impact,
        EventKind::Accumulation,
        EventKind::Closing,
        EventKind::Jump,
        EventKind::Load,
        EventKind::Turn,
        EventKind::Exhausted,
    ];

    /// What an event sets in the coordinates of its contact to the exact value that it stands for, before anything jumps.
    pub(crate) fn sets(self, law: &Contact) -> Vec<Set> {
        match self {
            EventKind::Velocity => vec![Set::Speed(law.tangential, law.slider_speed)],
            EventKind::Impact | EventKind::Closing => vec![Set::Place(law.normal, law.closed())],
            EventKind::Accumulation => {
                vec![Set::Place(law.normal, law.closed()), Set::Speed(law.normal, 0.0)]
            }
            EventKind::Release
            | EventKind::SlipPositive
            | EventKind::SlipNegative
            | EventKind::Jump
            | EventKind::Load
            | EventKind::Turn
            | EventKind::Exhausted => Vec::new(),
        }
    }

    /// Whether a contact of this status can have such an event, and the motion goes on after it.
    pub(crate) const fn can_end(self, status: Status) -> bool {
        match self {
            EventKind::Velocity | EventKind::Turn => status.is_sliding(),
            EventKind::SlipPositive | EventKind::SlipNegative | EventKind::Jump => {
                matches!(status, Status::Sticking)
            }
            EventKind::Release => status.is_closed(),
            EventKind::Impact | EventKind::Accumulation | EventKind::Closing => !status.is_closed(),
            EventKind::Load | EventKind::Exhausted => false,
        }
    }

    /// The kind of that name; refuses any other name as a broken record.
    pub fn named(name: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or(Error::Record { reason: "unknown kind of event" })
    }
}
