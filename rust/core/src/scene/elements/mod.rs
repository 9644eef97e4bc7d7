//! Springs and dampers that are no linear terms.

pub(crate) mod element;
pub(crate) mod tangent;
