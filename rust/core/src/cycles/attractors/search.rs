//! The limits of the search for an attractor.

use std::time::Instant;

use crate::error::cancel::Cancel;
use crate::motion::method::Method;
use crate::transient::run_state::Controls;

/// How long to look.
#[derive(Debug, Clone, Copy)]
pub struct SearchLimits<'a> {
    /// Motion computed between two looks, s; later looks take longer.
    pub stretch: f64,
    /// Motion in all, s.
    pub limit: f64,
    /// How the phases of the motion are propagated.
    pub method: Method,
    /// The token that stops the search, where it can be stopped.
    pub cancel: Option<&'a Cancel>,
    /// The time at which the search ends with the knowledge it has, if its computing is limited.
    pub deadline: Option<Instant>,
}

impl SearchLimits<'_> {
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(Cancel::is_requested)
    }

    /// Wall-clock seconds up to the deadline, where there is one.
    pub(crate) fn remaining(&self) -> Option<f64> {
        self.deadline.map(|end| end.saturating_duration_since(Instant::now()).as_secs_f64())
    }

    /// The same limits for a run.
    pub(crate) fn controls(&self) -> Controls<'_> {
        Controls {
            cancel: self.cancel,
            // A run that begins after the deadline still takes its first steps.
            time_limit: self.remaining().map(|rest| rest.max(f64::MIN_POSITIVE)),
            ..Controls::default()
        }
    }

    /// Whether it is to compute no further: cancelled, or late.
    pub(crate) fn is_over(&self) -> bool {
        self.is_cancelled() || self.remaining() == Some(0.0)
    }
}
