//! The methods by which a phase can be propagated.

use serde::{Deserialize, Serialize};

/// How phases are propagated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Method {
    /// Modes where they are well conditioned and worth their cost (see `method_cost.rs`), Taylor series elsewhere.
    Auto,
    /// Modes alone; a combination whose modes are nearly defective is refused.
    Modal,
    /// Taylor series alone.
    Taylor,
    /// Taylor series that an event restarts only where it reaches, in large sparse scenes.
    Local,
}

impl Method {
    /// The name of the method in Python: `modal`.
    pub const fn name(self) -> &'static str {
        match self {
            Method::Auto => "auto",
            Method::Modal => "modal",
            Method::Taylor => "taylor",
            Method::Local => "local",
        }
    }

    /// For a combination that is propagated again and again.
    pub(crate) const fn for_repeated_use(self) -> Wanted {
        match self {
            Method::Auto => Wanted::SoundModes,
            Method::Modal => Wanted::Modes,
            Method::Taylor | Method::Local => Wanted::Series,
        }
    }
}

/// How a combination is to be propagated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Wanted {
    /// By modes, or not at all.
    Modes,
    /// By modes unless they are ill-conditioned or too many.
    SoundModes,
    /// By Taylor series.
    Series,
}
