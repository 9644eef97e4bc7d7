//! Modes of a large problem on all processors.

use rayon::prelude::*;

/// Number of free coordinates from which each mode is worth a processor. Below it no other thread is started, because a
/// process with several threads cannot be forked safely.
const SHARED_SIZE: usize = 100;

/// Maps modes, or parts of them, one by one, in parallel if the problem is large; `size` counts its free coordinates.
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
