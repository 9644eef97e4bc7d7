//! The search for the next event: on one panel, and through the panels of a phase.

pub(crate) mod panel;
pub(crate) mod phase;
