//! A computed motion, its samples and its record.

pub(crate) mod events;
pub(crate) mod kept_states;
pub(crate) mod model;
pub(crate) mod record;
pub(crate) mod record_format;
pub(crate) mod sampling;
pub(crate) mod used_bases;
