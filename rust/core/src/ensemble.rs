//! Many scenes at once, one per processor; each result is that of its scene alone.

use std::sync::Arc;

use rayon::prelude::*;

use crate::attractor::{Attractor, Search, settle};
use crate::error::Error;
use crate::scene::{Scene, State};
use crate::trajectory::Trajectory;

/// What the motion from every start settles to, in the order given.
pub fn settle_all(
    cases: &[(Arc<Scene>, State)],
    search: Search<'_>,
) -> Vec<Result<(Attractor, Trajectory), Error>> {
    cases.par_iter().map(|(scene, start)| settle(scene, start, search)).collect()
}
