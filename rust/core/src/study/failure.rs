//! Why a question to a sample has no answer.

use crate::error::input::Error;
use crate::transient::trajectory::events::StopReason;

/// The reason why a question was not answered, by its kind.
#[derive(Debug, Clone, PartialEq)]
pub enum FailureKind {
    /// The sample is no scene, or does not fit the question.
    IllPosed,
    /// There is no steady sliding.
    NoEquilibrium,
    /// Eigenvalues that did not converge.
    Eigenvalues,
    /// The motion ended before the time asked for.
    Stopped(Box<StopReason>),
    /// The attractor of the motion was not found.
    Unsettled,
    /// A defect of the program.
    Error,
}

impl FailureKind {
    /// As columns of answers have it; of a motion the name of its [`StopReason`].
    pub const fn name(&self) -> &'static str {
        match self {
            FailureKind::IllPosed => "ill_posed",
            FailureKind::NoEquilibrium => "no_equilibrium",
            FailureKind::Eigenvalues => "eigenvalues",
            FailureKind::Stopped(reason) => reason.name(),
            FailureKind::Unsettled => "failed",
            FailureKind::Error => "error",
        }
    }
}

/// Why a question was not answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// What kind of failure it is.
    pub kind: FailureKind,
    /// The reason in words.
    pub reason: String,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let kind = match error {
            Error::NoSlidingDirection { .. }
            | Error::NoSteadySliding { .. }
            | Error::TensileEquilibrium { .. }
            | Error::SingularStiffness { .. } => FailureKind::NoEquilibrium,
            Error::Eigenvalues { .. } => FailureKind::Eigenvalues,
            _ => FailureKind::IllPosed,
        };
        Self { kind, reason: error.to_string() }
    }
}

impl Failure {
    /// Why a motion ended before the time asked for; None if it did not.
    pub(crate) fn of_stop(reason: &StopReason) -> Option<Self> {
        let in_words = match reason {
            StopReason::Duration | StopReason::TimeLimit | StopReason::Grazing => return None,
            StopReason::MaxEvents => "more events than max_events".to_owned(),
            StopReason::Unbounded => "the motion grows without bound".to_owned(),
            StopReason::Interrupted | StopReason::Chattering { .. } | StopReason::Failed(_) => {
                reason.to_string()
            }
        };
        Some(Self { kind: FailureKind::Stopped(Box::new(reason.clone())), reason: in_words })
    }
}
