//! The statuses that a contact may take at an event, and the conditions of each.
//!
//! | contact | status | condition |
//! | --- | --- | --- |
//! | rests or closes | `d` | `a_n >= 0` |
//! | | `s` | `N >= 0`, `abs(T) <= mu_static N` |
//! | | `+`, `-` | `N >= 0`, slip against T |
//! | slides on | `+` or `-` | `N >= 0` |
//! | | `d` | `a_n >= 0` |
//! | slides without mass | as before | slip against T |
//! | | `s` | T does not grow beyond `mu N` |

use crate::scene::status::Status;

/// Rate, relative to its terms, that is rounding of the root at which a slip has come to its end.
pub(super) const AT_REST: f64 = 1e-8;

/// The statuses that a contact can have, as far as they are known beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Case {
    /// Nothing but this status is possible.
    Settled(Status),
    /// It touches and its slip velocity is zero.
    Resting,
    /// It slides in this direction, with or without a normal force.
    Sliding(Status),
    /// A contact without mass closes or opens: gap and normal force are zero.
    Touching,
    /// A contact without mass slides in a direction, or its friction force is at the limit of sticking in that direction.
    Slipping {
        towards: Status,
        /// Whether its friction force is also the largest that sticking can hold.
        at_bound: bool,
        /// Whether the slip velocity has come to zero.
        ends: bool,
    },
    /// The friction of a contact without mass drops from the static to the kinetic one.
    Jumping { towards: Status },
    /// Another contact without mass jumps, or a load is switched: the contact may take any status from its present place.
    Beside { before: Status },
}

/// One contact of a problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    pub case: Case,
    /// mu, -.
    pub friction: f64,
    /// mu_static, -.
    pub static_friction: f64,
    /// Whether it can open: its normal force is not given.
    pub opens: bool,
}

impl Conditions {
    /// Whether static friction exceeds kinetic friction.
    pub fn has_excess(&self) -> bool {
        self.static_friction > self.friction
    }

    /// The statuses that it may take, the likeliest first.
    pub fn choices(&self) -> &'static [Status] {
        use Status::{Detached, Elastic, Negative, Positive, Slipping, Sticking};
        let smooth = self.static_friction == 0.0;
        let all: &[Status] = match self.case {
            Case::Settled(Positive) => &[Positive],
            Case::Settled(Negative) => &[Negative],
            Case::Settled(Sticking) => &[Sticking],
            Case::Settled(Detached) => &[Detached],
            Case::Settled(Slipping) => &[Slipping],
            Case::Settled(Elastic) => &[Elastic],
            Case::Beside { before: Detached } if smooth => &[Detached, Positive],
            Case::Resting | Case::Touching | Case::Beside { .. } if smooth => &[Positive, Detached],
            // If one motion has two names, the contact keeps the one it has.
            Case::Beside { before: Positive } => &[Positive, Sticking, Negative, Detached],
            Case::Beside { before: Negative } => &[Negative, Sticking, Positive, Detached],
            Case::Beside { before: Detached } => &[Detached, Sticking, Positive, Negative],
            Case::Resting | Case::Touching | Case::Beside { .. } => {
                &[Sticking, Positive, Negative, Detached]
            }
            Case::Slipping { towards: Negative, ends: false, .. } => &[Negative, Sticking],
            Case::Slipping { ends: false, .. } => &[Positive, Sticking],
            Case::Slipping { towards: Negative, .. } => &[Sticking, Negative],
            Case::Slipping { .. } => &[Sticking, Positive],
            Case::Sliding(Negative) | Case::Jumping { towards: Negative } => &[Negative, Detached],
            Case::Sliding(_) | Case::Jumping { .. } => &[Positive, Detached],
        };
        let closed = all.iter().take_while(|status| self.opens || status.is_closed());
        &all[..closed.count().max(1)]
    }
}
