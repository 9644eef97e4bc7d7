//! What a status means: event functions, kinds of events, transitions, admissible starts.

pub(crate) mod admissible_start;
pub(crate) mod contact_forces;
pub(crate) mod coupled;
pub(crate) mod event_function;
pub(crate) mod event_kind;
pub(crate) mod functional;
pub(crate) mod linear_friction;
pub(crate) mod problem;
pub(crate) mod quasi_static;
pub(crate) mod settlement;
pub(crate) mod transition;

pub use admissible_start::{forces_of_state, start_coordinates};
pub use contact_forces::undetermined;
pub use event_kind::{EventKind, NO_CONTACT};

#[cfg(test)]
mod tests;
