//! The command line in a child process, which can be killed.

#![allow(dead_code, reason = "no test uses all of it")]

use std::{
    ffi::OsString,
    path::Path,
    process::{Child, Command, Stdio},
};

/// Environment variable with the arguments of a child process that runs the command line, and their
/// separator.
const ARGS: &str = "CAMSIM_TEST_ARGS";
const BETWEEN: char = '\u{1f}';

/// Runs the command line in the child process; in the parent it is an empty test.
#[test]
fn runs_as_the_program() {
    let Ok(args) = std::env::var(ARGS) else { return };
    let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
    let code = camsim_cli::run(
        std::iter::once("camsim").chain(args.split(BETWEEN)).map(OsString::from),
        &mut out,
        &mut err,
    );
    #[allow(
        clippy::disallowed_methods,
        reason = "the exit code is what is tested, and nothing is left to be dropped"
    )]
    std::process::exit(i32::from(code));
}

/// Starts the program.
pub fn spawn(folder: &Path, args: &[&str]) -> Child {
    program(folder, args).spawn().unwrap()
}

/// The program, not started. Ctrl-C stops it, also where the tests run in the background of a script, which ignores
/// that.
pub fn program(folder: &Path, args: &[&str]) -> Command {
    with_interrupt("--default-signal=INT", folder, args)
}

/// The program as scripts start it in the background: Ctrl-C is ignored.
#[cfg(target_os = "linux")]
pub fn in_background(folder: &Path, args: &[&str]) -> Command {
    with_interrupt("--ignore-signal=INT", folder, args)
}

/// The program; `option` is that of `env` for the signal.
fn with_interrupt(option: &str, folder: &Path, args: &[&str]) -> Command {
    let this = std::env::current_exe().unwrap();
    let mut program =
        if cfg!(target_os = "linux") { Command::new("/usr/bin/env") } else { Command::new(&this) };
    if cfg!(target_os = "linux") {
        program.arg(option).arg(this);
    }
    program
        .args(["--exact", "program::runs_as_the_program", "--nocapture"])
        .env(ARGS, args.join(&BETWEEN.to_string()))
        .current_dir(folder);
    program.stdout(Stdio::piped()).stderr(Stdio::piped());
    program
}

/// Waits for the program. Returns exit code and standard error.
pub fn wait(child: Child) -> (i32, String) {
    let output = child.wait_with_output().unwrap();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// `camsim` in a working directory.
pub fn camsim(folder: &Path, args: &[&str]) -> (i32, String) {
    wait(spawn(folder, args))
}
