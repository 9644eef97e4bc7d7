//! Work that Ctrl-C stops.

use std::cell::RefCell;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use stickslip_core::{Cancel, Error, RunFailure};

use crate::errors::{raise, raise_failure};

/// Between two looks for Ctrl-C.
pub const PATIENCE: Duration = Duration::from_millis(20);

thread_local! {
    /// What a signal handler raised on this thread while its work went on.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// A token for work on the thread that called: it looks for signals itself. `raised` then says whether a handler raised
/// something else than Ctrl-C does.
pub fn listening() -> Cancel {
    RAISED.take();
    Cancel::asking(|| {
        let heard = Python::attach(|py| py.check_signals());
        let stop = heard.is_err();
        RAISED.set(heard.err());
        stop
    })
}

/// The exception of a signal handler that stopped work under a token of `listening`.
pub fn heard() -> PyResult<()> {
    RAISED.take().map_or(Ok(()), Err)
}

/// The exception of a signal handler that stopped work under a token of `listening`. After Ctrl-C there is none: the
/// work returns what it has.
pub fn raised(py: Python<'_>) -> PyResult<()> {
    match RAISED.take() {
        Some(error) if !error.is_instance_of::<PyKeyboardInterrupt>(py) => Err(error),
        _ => Ok(()),
    }
}

/// What `work` returns, computed while other Python threads run; a panic is a `RunError`.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| RunFailure::guarded(work)).map_err(|failure| raise_failure(py, &failure))
}

/// The same of work that can find its question ill-posed.
pub fn computed<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    detached(py, work)?.map_err(|error| raise(py, &error))
}

/// Runs `compute` on another thread and looks for Ctrl-C here: Python hears signals on its main thread only. On Ctrl-C
/// the token that `compute` holds is set, and its result, which is still awaited, comes with the exception. Where the
/// system starts no thread, `compute` runs on this one. Call this detached. A panic is an error.
pub fn until_interrupted<T: Send>(
    compute: impl Fn(&Cancel) -> T + Sync,
) -> PyResult<(T, Option<PyErr>)> {
    let cancel = Cancel::default();
    let watched = std::thread::scope(|scope| {
        let (done, wait) = channel();
        let (compute, cancel) = (&compute, &cancel);
        let work = Builder::new().spawn_scoped(scope, move || {
            let found = compute(cancel);
            // Dropped by a panic instead, it ends the wait as well.
            let _ = done.send(());
            found
        });
        let work = work.ok()?;
        let mut exception = None;
        while wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            if let Err(raised) = Python::attach(|py| py.check_signals()) {
                cancel.request();
                exception = Some(raised);
            }
        }
        Some((work.join().map_err(RunFailure::of_panic), exception))
    });
    let (found, exception) = watched.unwrap_or_else(|| {
        let cancel = listening();
        (RunFailure::guarded(|| compute(&cancel)), RAISED.take())
    });
    let found = found.map_err(|failure| Python::attach(|py| raise_failure(py, &failure)))?;
    Ok((found, exception))
}
