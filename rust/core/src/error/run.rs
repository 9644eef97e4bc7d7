//! What can stop a run.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::input::{Error, rounded};

/// What the unknown forces of a contact problem change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Forces, with static friction as the bound of what sticks.
    Accelerations,
    /// The impulses of an impact, with kinetic friction alone.
    Impulses,
    /// Forces of contacts without mass, which change places.
    Forces,
    /// Rates of these forces, which change slip velocities and speeds of gaps.
    Rates,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Level::Accelerations => "accelerations",
            Level::Impulses => "impulses",
            Level::Forces => "forces",
            Level::Rates => "rates",
        })
    }
}

/// Why a law of friction over slip speed ends a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LawEnd {
    /// A law that falls with slip speed has reached the coefficient 0.
    #[error("its friction reaches 0 at this slip speed and would be negative beyond it")]
    Negative,
    /// A law that levels off has come to where it is level, and slip has no mass.
    #[error(
        "its friction levels off at this slip speed, and without mass in the tangential direction the slip speed does not follow from a friction force beyond it; state a law that rises at every slip speed, or give the dofs mass"
    )]
    Level,
    /// A contact opens or closes whose slip has no mass.
    #[error(
        "it opens or closes, and where friction depends on slip speed without mass in the tangential direction, this is computed only if the contact does not slip as it does, and if no stiffness ties that direction to the normal one or to other contacts without mass; leave tangential_stiffness out, give the dofs mass, or state constant friction"
    )]
    Opening,
    /// The law of a contact spring would pull.
    #[error(
        "the law of its normal_stiffness comes to force 0 while it is still pressed, and would pull beyond; state a law that presses at every penetration"
    )]
    Pulling,
    /// Friction changes over slip speeds that are lost in the rounding of the motion.
    #[error(
        "its friction changes over slip speeds that are lost in the rounding of the motion; give the law a larger speed, or state constant friction"
    )]
    Unresolved,
    /// A law has no finite value and slope there, or its series no bound.
    #[error(
        "its law has no finite value, slope or bound at what it has come to; state a law that is smooth there, or a table"
    )]
    Undefined,
}

/// Why a motion could not be continued; the part computed so far is kept beside it.
///
/// In all variants `contact` and `contacts` are indices, of a problem those of all its contacts, and `time` is that of the event, s,
/// if nothing else is said.
#[allow(missing_docs, reason = "those of fields stand once, above")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunFailure {
    /// The question itself is ill-posed.
    #[error(transparent)]
    Input(#[from] Error),
    /// A law of friction over slip speed ends the motion.
    #[error("contact {contact} at t = {time} s: {end}")]
    Law {
        contact: usize,
        /// Time up to which the motion is known, s.
        time: f64,
        /// What ends it.
        end: LawEnd,
    },
    /// The law of a spring or a damper ends.
    #[error("element {element} at t = {time} s: {end}")]
    Element {
        /// Index of the element.
        element: usize,
        time: f64,
        end: LawEnd,
    },
    /// After an event a closed contact can neither stick nor slide.
    #[error(
        "contact {contact} at t = {time} s: no status is consistent with the state after the event (normal force {} N, required friction {} N)",
        rounded(*normal_force),
        rounded(*required_friction)
    )]
    NoConsistentStatus {
        contact: usize,
        time: f64,
        /// Normal force after the event, N; compression is positive.
        normal_force: f64,
        /// Friction force that sticking would need, N, along the tangential direction.
        required_friction: f64,
    },
    /// The joint contact problem of coupled contacts has no solution, or several.
    #[error(
        "contacts {contacts:?} at t = {time} s: the contact problem of their {level} has {count}; state after the event: slip velocities {slip:?} m/s, reactions {reactions:?} N"
    )]
    ContactProblem {
        contacts: Vec<usize>,
        time: f64,
        /// Whether forces or impulses are unknown.
        level: Level,
        /// "no solution" or "several solutions", and why.
        count: &'static str,
        /// Slip velocity after the event of every contact of the block of the scene that moves with them, m/s.
        slip: Vec<f64>,
        /// (tangential, normal) of each contact.
        reactions: Vec<f64>,
    },
    /// The quasi-static contact problem of contacts without mass has no solution, or several.
    #[error(
        "contacts {contacts:?} at t = {time} s: the quasi-static contact problem of their {level} {reason}"
    )]
    QuasiStatic {
        contacts: Vec<usize>,
        time: f64,
        /// Whether forces or their rates are unknown.
        level: Level,
        /// What happened, and the remedy.
        reason: &'static str,
    },
    /// A run that states no `max_events` has come to as many as fit in memory.
    #[error(
        "{events} events by t = {time} s, as many as a run without max_events may have; a larger max_events allows more, and accumulation_tolerance ends series of bounces early"
    )]
    TooManyEvents {
        /// Number of events so far.
        events: usize,
        /// Time of the last one, s.
        time: f64,
    },
    /// There is no memory for the record of another event.
    #[error(
        "no memory for the record of more than {events} events, by t = {time} s; fewer max_events or a shorter duration need less, and accumulation_tolerance ends series of bounces early"
    )]
    Memory {
        /// Number of events so far.
        events: usize,
        /// Time of the last one, s.
        time: f64,
    },
    /// Why a motion read back from its record could not be continued, in the words of then.
    #[error("{0}")]
    Recorded(String),
    /// A defect of the program, in the words of the panic that it caused.
    #[error("internal error: {0}")]
    Internal(String),
}

impl RunFailure {
    /// The indices of the contacts that it names.
    pub(crate) const fn contacts_mut(&mut self) -> &mut [usize] {
        match self {
            Self::Law { contact, .. } | Self::NoConsistentStatus { contact, .. } => {
                std::slice::from_mut(contact)
            }
            Self::ContactProblem { contacts, .. } | Self::QuasiStatic { contacts, .. } => {
                contacts.as_mut_slice()
            }
            Self::Input(_)
            | Self::Element { .. }
            | Self::TooManyEvents { .. }
            | Self::Memory { .. }
            | Self::Recorded(_)
            | Self::Internal(_) => &mut [],
        }
    }

    /// What `work` returns. A panic in one of many pieces of work is the failure of that piece: the others go on.
    pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Self> {
        catch_unwind(AssertUnwindSafe(work)).map_err(Self::of_panic)
    }

    /// The failure of a thread that panicked.
    pub fn of_panic(panic: Box<dyn Any + Send>) -> Self {
        let text = panic.downcast_ref::<&str>().map(|&text| text.to_owned());
        let message = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Self::Internal(message.unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_gives_every_contact_that_it_names() {
        let (contact, time) = (0, 1.0);
        let one = vec![
            RunFailure::Law { contact, time, end: LawEnd::Negative },
            RunFailure::NoConsistentStatus {
                contact,
                time,
                normal_force: 1.0,
                required_friction: 2.0,
            },
            RunFailure::QuasiStatic {
                contacts: vec![0],
                time,
                level: Level::Forces,
                reason: "fails",
            },
            RunFailure::ContactProblem {
                contacts: vec![0],
                time,
                level: Level::Impulses,
                count: "no solution",
                slip: Vec::new(),
                reactions: Vec::new(),
            },
        ];
        for mut failure in one {
            failure.contacts_mut().fill(7);
            let told = failure.to_string();
            assert!(told.contains("contact 7 ") || told.contains("contacts [7] "), "{told}");
        }
        assert!(RunFailure::TooManyEvents { events: 1, time }.contacts_mut().is_empty());
    }
}
