//! The motion of a large sparse scene, expanded again only where an event reaches.

mod blocks;
pub(crate) mod field;
pub(crate) mod locality;
pub(crate) mod reach;
pub(crate) mod region;
mod rows;
