//! How a motion depends on its start: through its phases, and through the events that end them.

pub(crate) mod coupled_impact;
pub(crate) mod event;
pub(crate) mod flow;
pub(crate) mod joint;
pub(crate) mod passages;
pub(crate) mod saltation;
