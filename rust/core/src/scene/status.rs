//! The status of a contact, and the combination of the statuses of all contacts.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::input::Error;

/// The status of one contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
pub enum Status {
    /// `+`: closed, slip velocity < 0, friction force T = +mu N.
    Positive,
    /// `-`: closed, slip velocity > 0, T = -mu N.
    Negative,
    /// `s`: closed, slip velocity = 0, T a reaction with |T| <= mu_static N.
    Sticking,
    /// `d`: open, no force.
    Detached,
    /// `o`: closed, slips in a plane along two directions, T of both opposite to the slip velocity, `|T| = mu N`.
    Slipping,
    /// `s` of a contact in a plane with a spring of its own: the node of the spring rests on the slider, and the body moves.
    Elastic,
}

impl Status {
    /// The letter of the status in a combination: `+`, `-`, `s`, `d` or `o`.
    pub const fn letter(self) -> char {
        match self {
            Status::Positive => '+',
            Status::Negative => '-',
            Status::Sticking | Status::Elastic => 's',
            Status::Detached => 'd',
            Status::Slipping => 'o',
        }
    }

    /// The sliding status of a contact at rest on a slider of this speed; None where the slider rests as well.
    pub fn driven_by(slider_speed: f64) -> Option<Self> {
        match slider_speed {
            speed if speed > 0.0 => Some(Status::Positive),
            speed if speed < 0.0 => Some(Status::Negative),
            _ => None,
        }
    }

    /// Whether the contact touches its slider: it sticks or slides.
    pub const fn is_closed(self) -> bool {
        !matches!(self, Status::Detached)
    }

    /// Whether the contact slides along a line, in either direction.
    pub const fn is_sliding(self) -> bool {
        matches!(self, Status::Positive | Status::Negative)
    }

    /// The other direction of sliding; any other status is its own opposite.
    pub const fn reversed(self) -> Self {
        match self {
            Status::Positive => Status::Negative,
            Status::Negative => Status::Positive,
            other => other,
        }
    }

    /// T / (mu N) of a contact that slides along a line, 0 otherwise.
    pub const fn friction_sign(self) -> f64 {
        match self {
            Status::Positive => 1.0,
            Status::Negative => -1.0,
            Status::Sticking | Status::Detached | Status::Slipping | Status::Elastic => 0.0,
        }
    }
}

/// One status per contact, in the order of the contacts.
#[derive(Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Combination(Box<[Status]>);

impl Combination {
    /// The combination of these statuses, one per contact.
    pub fn new(statuses: Vec<Status>) -> Self {
        Self(statuses.into_boxed_slice())
    }

    /// Reads `"+s"` for `contacts` contacts.
    pub fn parse(text: &str, contacts: usize) -> Result<Self, Error> {
        let statuses: Option<Vec<Status>> = text
            .chars()
            .map(|letter| match letter {
                '+' => Some(Status::Positive),
                '-' => Some(Status::Negative),
                's' => Some(Status::Sticking),
                'd' => Some(Status::Detached),
                'o' => Some(Status::Slipping),
                _ => None,
            })
            .collect();
        match statuses {
            Some(statuses) if statuses.len() == contacts => Ok(Self::new(statuses)),
            _ => Err(Error::Combination { got: text.to_owned(), contacts }),
        }
    }

    /// The statuses, one per contact.
    pub fn statuses(&self) -> &[Status] {
        &self.0
    }

    /// The same combination with another status of one contact.
    pub fn with(&self, contact: usize, status: Status) -> Self {
        let mut next = self.clone();
        next.0[contact] = status;
        next
    }
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|status| write!(f, "{}", status.letter()))
    }
}

impl fmt::Debug for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}
