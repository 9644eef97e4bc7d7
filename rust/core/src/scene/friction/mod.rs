//! Friction that depends on slip speed: its laws, and their effect on small motions about steady sliding.

pub(crate) mod bristles;
pub(crate) mod contact_state;
pub(crate) mod decay;
pub(crate) mod elastic_plane;
pub(crate) mod formula;
pub(crate) mod law;
pub(crate) mod plane;
pub(crate) mod steady;
pub(crate) mod with_states;
