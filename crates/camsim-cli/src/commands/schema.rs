//! `camsim schema`.

use std::path::PathBuf;

use camsim_io::scenario_file::json_schema;

use crate::{
    console::Console,
    failure::Failure,
    output::{check_output, write_output},
};

/// Print the JSON schema of scenarios, by which editors complete and check keys
///
/// Write `#:schema ./scenario.schema.json` as the first line of a scenario: Visual Studio Code (Even Better TOML,
/// Tombi) and editors with these language servers then complete keys and words, show what they mean, and mark
/// mistakes.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  camsim schema -o scenario.schema.json")]
pub struct SchemaArgs {
    /// File [default: standard output]
    #[arg(short, long, value_name = "JSON")]
    output: Option<PathBuf>,
}

/// Runs `camsim schema`.
pub fn run(args: &SchemaArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    args.output.as_deref().map_or(Ok(()), check_output)?;
    write_output(args.output.as_deref(), console, |out| writeln!(out, "{:#}", json_schema()))
}
