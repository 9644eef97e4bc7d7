//! Many scenes at once, one per processor; each result is that of its scene alone.

use std::sync::Arc;

use rayon::prelude::*;

use crate::attractor::{Attractor, Search, settle};
use crate::error::Error;
use crate::scene::{Scene, State};
use crate::trajectory::{StopReason, Trajectory};

/// An attractor, with the last stretch of the motion towards it.
pub type Found = (Attractor, Trajectory);

/// What the motion from every start settles to, in the order given; nothing for those that an interrupt came
/// before.
pub fn settle_all(
    cases: &[(Arc<Scene>, State)],
    search: Search<'_>,
) -> Vec<Option<Result<Found, Error>>> {
    let interrupted = || search.interrupted.is_some_and(|ask| ask());
    cases
        .par_iter()
        .with_max_len(1)
        .map(|(scene, start)| {
            match interrupted() {
            true => None,
            false => Some(settle(scene, start, search)).filter(|settled| {
                !matches!(settled, Ok((_, run)) if run.stop_reason == StopReason::Interrupted)
            }),
        }
        })
        .collect()
}
