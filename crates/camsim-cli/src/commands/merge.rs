//! `camsim merge`.

use std::path::PathBuf;

use camsim_io::merge::merge;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// Join the folders of a run's shards
///
/// Makes the folder that one run without --shard would have made: frames are linked (copied where the file system has
/// no links), tables joined. Refused if a shard is missing, unfinished or of another scenario, or if a file does not
/// have the size and CRC-32 in its shard's checksums.csv (`camsim render --checksums`).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim merge shards/* -o frames")]
pub struct MergeArgs {
    /// Folders of all shards, in any order
    #[arg(required = true, value_name = "SHARD")]
    shards: Vec<PathBuf>,
    /// Folder of the joined run
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Merges shards.
pub fn run(args: &MergeArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let report = merge(&args.shards, &args.output).or_bad_input()?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    if report.checked < report.shards {
        console.warn(format_args!(
            "{} of {} shards have no checksums.csv, so that damage to their files is not found (camsim render \
             --checksums)",
            report.shards - report.checked,
            report.shards
        ));
    }
    Ok(console.line(format_args!(
        "{} frames of {} shards in {}",
        report.frames,
        report.shards,
        args.output.display()
    ))?)
}
