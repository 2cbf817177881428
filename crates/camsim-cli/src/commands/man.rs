//! `camsim man`, for packages: not listed in the help.

use std::path::PathBuf;

use anyhow::anyhow;

use crate::{console::Console, failure::Failure};

/// Write the manual pages of all commands into a folder
///
/// For example: camsim man ~/.local/share/man/man1
#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Folder, made if it is missing
    folder: PathBuf,
}

/// Writes one page for the command line `C` and one for each command.
pub fn run<C: clap::CommandFactory>(args: &ManArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let folder = args.folder.display();
    std::fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(C::command(), &args.folder))
        .map_err(|error| Failure::failed(anyhow!("cannot write manual pages to {folder}: {error}")))?;
    console.note(format!("manual pages are in {folder}"));
    Ok(())
}
