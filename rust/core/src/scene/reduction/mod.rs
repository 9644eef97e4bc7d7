//! Any status combination as a smaller linear system.

pub(crate) mod bases;
pub(crate) mod reduced_system;
