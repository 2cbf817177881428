//! `camsim completions`.

use crate::{console::Console, failure::Failure};

/// Print completions for a shell
///
/// For example: camsim completions bash > ~/.local/share/bash-completion/completions/camsim
#[derive(Debug, clap::Args)]
pub struct CompletionsArgs {
    /// Shell
    shell: clap_complete::Shell,
}

/// Prints the script for the command line `C`.
pub fn run<C: clap::CommandFactory>(
    args: &CompletionsArgs,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut C::command(), "camsim", &mut script);
    console.stdout().write_all(&script)?;
    Ok(())
}
