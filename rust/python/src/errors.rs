//! Core errors as the classes of `stickslip.errors`.

use pyo3::prelude::*;
use pyo3::types::PyString;
use stickslip_core::{Error, RunFailure};

/// The Python exception of ill-posed input.
pub fn raise(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::NoSteadySliding { .. } | Error::NoSteadyState { .. } => "NoSteadyStateError",
        _ => "InputError",
    };
    named(py, class, &error.to_string())
}

/// The Python exception of what kept a motion from being computed.
pub fn raise_failure(py: Python<'_>, failure: &RunFailure) -> PyErr {
    match failure {
        RunFailure::Input(error) => raise(py, error),
        _ => named(py, "RunError", &failure.to_string()),
    }
}

/// An exception of class `name` of `stickslip.errors`.
pub fn named(py: Python<'_>, name: &str, message: &str) -> PyErr {
    let exception = py
        .import("stickslip.errors")
        .and_then(|module| module.getattr(name))
        .and_then(|class| class.call1((PyString::new(py, message),)));
    match exception {
        Ok(exception) => PyErr::from_value(exception),
        Err(import_error) => import_error,
    }
}
