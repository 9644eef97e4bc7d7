//! What a user states of a scene, checked before anything is made of it.

pub(crate) mod elastic_planes;
pub(crate) mod proportions;
pub(crate) mod scene_input;
pub(crate) mod validated;
pub(crate) mod with_nodes;
