//! What can be wrong with a question, what can stop a run, and the request to stop it.

pub(crate) mod cancel;
pub(crate) mod input;
pub(crate) mod run;

pub use cancel::Cancel;
pub use input::Error;
pub use run::{LawEnd, Level, RunFailure};
