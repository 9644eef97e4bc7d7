//! Marches of large sparse scenes, in which an event costs only the work on the coordinates that it reaches.

pub(crate) mod march;
pub(crate) mod motion;
pub(crate) mod next_events;
pub(crate) mod record;
