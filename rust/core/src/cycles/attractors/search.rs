//! How long a search for what a motion settles to follows the motion.

use crate::error::Cancel;
use crate::motion::method::Method;

/// How long to look.
#[derive(Debug, Clone, Copy)]
pub struct Search<'a> {
    /// Motion computed between two looks, s; later looks take longer.
    pub stretch: f64,
    /// Motion in all, s.
    pub limit: f64,
    /// How the phases of the motion are propagated.
    pub method: Method,
    /// The token that stops the search, where it can be stopped.
    pub cancel: Option<&'a Cancel>,
}

impl Search<'_> {
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(Cancel::is_requested)
    }
}
