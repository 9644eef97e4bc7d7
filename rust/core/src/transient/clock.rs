//! The time of a run.

use serde::{Deserialize, Serialize};

/// Time carried as an unevaluated sum, so that thousands of phases add no rounding to it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Clock {
    pub seconds: f64,
    pub rest: f64,
}

impl Clock {
    pub fn after(self, step: f64) -> Self {
        let sum = self.seconds + step;
        let part = sum - self.seconds;
        let rest = self.rest + ((self.seconds - (sum - part)) + (step - part));
        let seconds = sum + rest;
        Self { seconds, rest: rest - (seconds - sum) }
    }

    /// The resolution of the seconds, s.
    pub fn ulp(self) -> f64 {
        self.seconds.next_up() - self.seconds
    }
}
