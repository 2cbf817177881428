//! The command line, for `python -m camsim`.

use std::{ffi::OsString, io, path::PathBuf};

use camsim::cli;
use pyo3::prelude::*;

/// Runs a command as `camsim` does in a terminal, and returns its exit code. The first argument is the
/// program's name.
#[pyfunction]
pub fn run_main(py: Python<'_>, args: Vec<PathBuf>) -> u8 {
    let args: Vec<OsString> = args.into_iter().map(PathBuf::into_os_string).collect();
    py.detach(|| cli::run(args, &mut io::stdout().lock(), &mut io::stderr()))
}
