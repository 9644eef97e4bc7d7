//! Loads that depend on time, and the oscillators that carry them.

pub(crate) mod driven;
pub(crate) mod input;
pub(crate) mod oscillators;
