//! Why a law of friction ends a phase.

use crate::error::run::RunFailure;

/// Why a law ends a phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LawEnd {
    /// Friction would be negative.
    Negative,
    /// Where slip has no mass: friction is level from this slip speed on.
    Level,
    /// Where slip has no mass: the normal force vanishes.
    Opening,
    /// Friction changes over slip speeds that are lost in rounding.
    Unresolved,
}

impl LawEnd {
    pub fn failure(self, contact: usize, time: f64) -> RunFailure {
        match self {
            Self::Negative => RunFailure::NegativeFriction { contact, time },
            Self::Level => RunFailure::LevelFriction { contact, time },
            Self::Opening => RunFailure::OpensWithoutMass { contact, time },
            Self::Unresolved => RunFailure::UnresolvedFriction { contact, time },
        }
    }
}
