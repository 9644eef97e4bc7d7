//! A phase as the sum of its modes.

pub(crate) mod basis;
pub(crate) mod forced;
pub(crate) mod level;
pub(crate) mod motion;
pub(crate) mod panels;
pub(crate) mod reference;
pub(crate) mod states;
