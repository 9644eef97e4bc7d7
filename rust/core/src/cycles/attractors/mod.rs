//! What motions settle to.

pub(crate) mod attractor;
pub(crate) mod ensemble;
pub(crate) mod forced;
pub(crate) mod lyapunov;
pub(crate) mod recurrence;
pub(crate) mod rest;
mod rotation;
pub(crate) mod search;
pub(crate) mod smooth;

pub use attractor::{Attractor, settle, settled_from};
pub use ensemble::{Found, settle_all};
pub use lyapunov::Lyapunov;
pub use recurrence::Recurrence;
pub use recurrence::is_followed;
pub use search::SearchLimits;
pub use smooth::closed;
