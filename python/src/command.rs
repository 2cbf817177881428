//! The command line, for `python -m camsim` and for what Python asks of it.

use std::{
    ffi::OsString,
    io::{self, Write},
    path::PathBuf,
};

use camsim::cli;
use pyo3::{prelude::*, types::PyBytes};

/// Runs a command as `camsim` does in a terminal, and returns its exit code. The first argument is the
/// program's name.
#[pyfunction]
pub fn run_main(py: Python<'_>, args: Vec<PathBuf>) -> u8 {
    let args: Vec<OsString> = args.into_iter().map(PathBuf::into_os_string).collect();
    py.detach(|| cli::run(args, &mut io::stdout().lock(), &mut io::stderr()))
}

/// Runs a command: its exit code, and what it prints to standard output and to standard error.
#[pyfunction]
pub fn run<'py>(py: Python<'py>, args: Vec<PathBuf>) -> (u8, Bound<'py, PyBytes>, Bound<'py, PyBytes>) {
    let args = std::iter::once("camsim".into()).chain(args).map(PathBuf::into_os_string);
    let args: Vec<OsString> = args.collect();
    let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
    let code = py.detach(|| cli::run(args, &mut stdout as &mut dyn Write, &mut stderr));
    (code, PyBytes::new(py, &stdout), PyBytes::new(py, &stderr))
}
