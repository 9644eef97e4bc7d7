//! Scenes whose parameters change: along a path, and from sample to sample of a study.

pub mod path;
pub mod study;
