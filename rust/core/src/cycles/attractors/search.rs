//! How long a search for what a motion settles to follows the motion.

use crate::motion::method::Method;

/// How long to look.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Motion computed between two looks, s; later looks take longer.
    pub stretch: f64,
    /// Motion in all, s.
    pub limit: f64,
    pub method: Method,
    pub interrupted: Option<&'a (dyn Fn() -> bool + Sync)>,
}

impl Search<'_> {
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupted.is_some_and(|ask| ask())
    }
}
