//! A request to stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A request to stop, seen by all the work that holds the token: runs look at it every few dozen panels, searches and
/// studies between their steps. Results computed before the request are kept.
#[derive(Debug, Default)]
pub struct Cancel {
    requested: AtomicBool,
    /// Function that is called by all who look at the token, until it returns true.
    ask: Option<fn() -> bool>,
    /// Bits of the motion that a search has followed so far, s.
    followed: AtomicU64,
}

impl Cancel {
    /// A token that also stops work once `ask` says so.
    pub const fn asking(ask: fn() -> bool) -> Self {
        Self { requested: AtomicBool::new(false), ask: Some(ask), followed: AtomicU64::new(0) }
    }

    /// Stops all the work that holds the token.
    pub fn request(&self) {
        self.requested.store(true, Ordering::Relaxed);
    }

    /// Tells those who watch the work how much motion a search has followed, s.
    pub(crate) fn tell_followed(&self, time: f64) {
        self.followed.store(time.to_bits(), Ordering::Relaxed);
    }

    /// The motion that a search under this token has followed so far, s.
    pub fn followed(&self) -> f64 {
        f64::from_bits(self.followed.load(Ordering::Relaxed))
    }

    /// Whether work is to stop; once it is, it stays so.
    pub fn is_requested(&self) -> bool {
        if !self.requested.load(Ordering::Relaxed) && self.ask.is_some_and(|ask| ask()) {
            self.request();
        }
        self.requested.load(Ordering::Relaxed)
    }
}
