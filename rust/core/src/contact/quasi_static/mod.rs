//! Contacts without mass: their forces, and how these change, follow from statics alone.

pub(crate) mod transition;
