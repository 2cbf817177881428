//! `camsim viewer`.

use std::path::PathBuf;

use crate::failure::{Failure, OrFail};

/// Open the viewer
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenario to open; without one, the built-in flight
    scenario: Option<PathBuf>,
}

/// Opens the window and stays until it is closed.
pub fn run(args: &Args) -> Result<(), Failure> {
    camsim_viewer::run(args.scenario.clone(), None).or_failed()
}
