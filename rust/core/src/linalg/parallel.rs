//! Work on all processors, also in a forked process.

use std::sync::Mutex;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Number of free coordinates from which each mode is worth a processor.
const SHARED_SIZE: usize = 100;

/// The threads of the process with this number. A forked child has those of its parent in memory, but none of them runs.
static THREADS: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// What `work` returns, whose parallel iterators run on the threads of the pool in use, or on those of this process. Where
/// the system starts no threads, this one does all of it.
pub(crate) fn in_parallel<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if rayon::current_thread_index().is_some() {
        return work();
    }
    let threads = threads_of_process().or_else(|_| {
        let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        alone.map(|alone| &*Box::leak(Box::new(alone)))
    });
    match threads {
        Ok(threads) => threads.install(work),
        Err(_) => work(),
    }
}

/// One pool a process. The parent's is left alone in a child: to drop it would wait for threads that don't exist.
fn threads_of_process() -> Result<&'static ThreadPool, ThreadPoolBuildError> {
    let process = std::process::id();
    let known = || THREADS.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some((owner, threads)) = *known()
        && owner == process
    {
        return Ok(threads);
    }
    let threads: &'static ThreadPool = Box::leak(Box::new(ThreadPoolBuilder::new().build()?));
    *known() = Some((process, threads));
    Ok(threads)
}

/// Maps modes, or parts of them, one by one, in parallel if the problem is large; `size` counts its free coordinates.
pub(crate) fn each<T: Send, U: Send>(
    size: usize,
    modes: Vec<T>,
    map: impl Fn(T) -> U + Sync + Send,
) -> Vec<U> {
    match size < SHARED_SIZE {
        true => modes.into_iter().map(map).collect(),
        false => in_parallel(|| modes.into_par_iter().map(map).collect()),
    }
}
