//! Many scenes at once, one per processor; each result is that of its scene alone.

use std::sync::Arc;

use rayon::prelude::*;

use crate::attractor::{Attractor, Search, settle};
use crate::error::RunFailure;
use crate::scene::{Scene, State};
use crate::trajectory::{StopReason, Trajectory};

/// An attractor, with the last stretch of the motion towards it.
pub type Found = (Attractor, Trajectory);

/// What the motion from every start settles to, in the order given; nothing for those that an interrupt came
/// before.
pub fn settle_all(
    cases: &[(Arc<Scene>, State)],
    search: Search<'_>,
) -> Vec<Option<Result<Found, RunFailure>>> {
    let interrupted = || search.interrupted.is_some_and(|ask| ask());
    cases
        .par_iter()
        .with_max_len(1)
        .map(|(scene, start)| {
            if interrupted() {
                return None;
            }
            let found = RunFailure::guarded(|| settle(scene, start, search));
            let found = found.and_then(|found| Ok(found?));
            let unfinished =
                matches!(&found, Ok((_, run)) if run.stop_reason == StopReason::Interrupted);
            (!unfinished).then_some(found)
        })
        .collect()
}
