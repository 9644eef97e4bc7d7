//! Marches of large sparse scenes, in which an event costs what it touches.

pub(crate) mod march;
pub(crate) mod motion;
pub(crate) mod record;
