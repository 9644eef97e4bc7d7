//! Modes of a large problem on all processors.

use rayon::prelude::*;

/// Free coordinates from which single modes are worth a processor each. Below, no other thread is started: a process
/// that has some can't be forked.
const SHARED_SIZE: usize = 100;

/// Maps modes, or parts of them, one by one; those of a large problem in parallel. `size`: free coordinates.
pub(crate) fn each<T: Send, U: Send>(
    size: usize,
    modes: Vec<T>,
    map: impl Fn(T) -> U + Sync + Send,
) -> Vec<U> {
    match size < SHARED_SIZE {
        true => modes.into_iter().map(map).collect(),
        false => modes.into_par_iter().map(map).collect(),
    }
}
