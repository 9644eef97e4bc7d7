//! Parameter values at which stability, or steady sliding, changes.

pub(crate) mod exceptional_point;
pub(crate) mod hopf;
pub(crate) mod lock_ins;
pub(crate) mod pair;
pub(crate) mod point;
pub(crate) mod roots;
pub(crate) mod search;
pub(crate) mod separation;

#[cfg(test)]
mod tests;
