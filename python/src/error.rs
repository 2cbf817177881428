//! Failures as Python exceptions, with the message of the command line.

use camsim::{cli::failure, cli::failure::Failure};
use pyo3::{
    PyErr, PyResult,
    exceptions::{PyOverflowError, PyRuntimeError},
};

pyo3::import_exception!(camsim._errors, InputError);
pyo3::import_exception!(camsim._errors, AdapterError);
pyo3::import_exception!(camsim._errors, RunError);

/// The exception of a failure.
pub fn raise(failure: &Failure) -> PyErr {
    let text = failure.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    // What the command line calls `--set` is a key of `set`, `replace` or `sets` in Python.
    let message = text
        .strip_prefix("--set ")
        .unwrap_or(text)
        .replace("\n--set ", "\n")
        .replace("write --set ", "write ")
        .replace("`camsim render --print-default`", "camsim.default_scenario()");
    match failure.code() {
        failure::BAD_INPUT => InputError::new_err(message),
        failure::NO_ADAPTER => AdapterError::new_err(message),
        _ => RunError::new_err(message),
    }
}

/// Library errors as exceptions.
pub trait OrRaise<T> {
    /// The error is caused by the user's input.
    fn or_input_error(self) -> PyResult<T>;
    /// The error occurred during the work.
    fn or_run_error(self) -> PyResult<T>;
}

impl<T, E: std::error::Error + Send + Sync + 'static> OrRaise<T> for Result<T, E> {
    fn or_input_error(self) -> PyResult<T> {
        self.map_err(|error| raise(&Failure::bad_input(error)))
    }

    fn or_run_error(self) -> PyResult<T> {
        self.map_err(|error| raise(&Failure::failed(error)))
    }
}

/// A message of this crate's own about the user's input.
pub fn input_error(message: impl Into<String>) -> PyErr {
    InputError::new_err(message.into())
}

/// The exception after a panic on another thread, which has printed what went wrong.
pub fn panicked() -> PyErr {
    PyRuntimeError::new_err("a thread of camsim has panicked; its message is on standard error")
}

/// The exception of a number that does not fit.
pub fn too_large(what: &str) -> PyErr {
    PyOverflowError::new_err(format!("{what} is too large"))
}
