//! Friction that depends on slip speed: its laws, and what they do to small motions about steady sliding.

pub(crate) mod law;
pub(crate) mod steady;
