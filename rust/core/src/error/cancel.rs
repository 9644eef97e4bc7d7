//! A request to stop.

use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop, seen by all the work that holds the token: runs look at it every few dozen panels, searches and
/// studies between their steps. Results computed before the request are kept.
#[derive(Debug, Default)]
pub struct Cancel {
    requested: AtomicBool,
    /// Function that is called by all who look at the token, until it returns true.
    ask: Option<fn() -> bool>,
}

impl Cancel {
    /// A token that also stops work once `ask` says so.
    pub const fn asking(ask: fn() -> bool) -> Self {
        Self { requested: AtomicBool::new(false), ask: Some(ask) }
    }

    /// Stops all the work that holds the token.
    pub fn request(&self) {
        self.requested.store(true, Ordering::Relaxed);
    }

    /// Whether work is to stop; once it is, it stays so.
    pub fn is_requested(&self) -> bool {
        if !self.requested.load(Ordering::Relaxed) && self.ask.is_some_and(|ask| ask()) {
            self.request();
        }
        self.requested.load(Ordering::Relaxed)
    }
}
