//! A path with those who watch the work along it.

use std::ops::Deref;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::cancel::Cancel;
use crate::error::input::Error;
use crate::locus::parameter_path::Path;

/// A path whose eigenproblems are counted, and along which work ends once it is cancelled.
#[derive(Debug, Clone, Copy)]
pub struct WatchedPath<'a> {
    /// The path.
    pub path: &'a Path,
    /// The token that stops the work, where it can be stopped.
    pub cancel: Option<&'a Cancel>,
    /// Number of eigenproblems begun.
    pub eigenproblems: &'a AtomicUsize,
}

impl WatchedPath<'_> {
    /// An error once the work is cancelled.
    pub(crate) fn go_on(&self) -> Result<(), Error> {
        if self.cancel.is_some_and(Cancel::is_requested) { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Counts an eigenproblem, which is not begun once the work is cancelled.
    pub(crate) fn begin_eigenproblem(&self) -> Result<(), Error> {
        self.go_on()?;
        self.eigenproblems.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

impl Deref for WatchedPath<'_> {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.path
    }
}
