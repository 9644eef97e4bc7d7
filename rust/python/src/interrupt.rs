//! Work that Ctrl-C stops.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use stickslip_core::RunFailure;

use crate::errors::raise_failure;

/// Between two looks for Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(20);

/// What `work` returns, computed while other Python threads run; a panic is a `RunError`.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| RunFailure::guarded(work)).map_err(|failure| raise_failure(py, &failure))
}

/// What `compute` returns, and what interrupted it; it is told by its argument, and waited for in any case. Call it
/// detached: Python hears signals on its main thread only, which waits here while another works. A panic is an error.
pub fn until_interrupted<T: Send>(
    compute: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<(T, Option<PyErr>)> {
    let stopped = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (done, wait) = channel();
        let stopped = &stopped;
        let work = scope.spawn(move || {
            let found = compute(stopped);
            // Dropped by a panic instead, it ends the wait as well.
            let _ = done.send(());
            found
        });
        let mut exception = None;
        while wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            if let Err(raised) = Python::attach(|py| py.check_signals()) {
                stopped.store(true, Ordering::Relaxed);
                exception = Some(raised);
            }
        }
        let found = work.join().map_err(RunFailure::of_panic);
        let found = found.map_err(|failure| Python::attach(|py| raise_failure(py, &failure)))?;
        Ok((found, exception))
    })
}
