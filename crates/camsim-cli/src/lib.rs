//! The camsim command line: arguments -> scenario -> engine -> writers.
//!
//! Each command is one file in `commands/` with its arguments and a `run`. Everything else is shared:
//! [`console`] (where text goes), [`failure`] (exit codes), `inputs` (scenario and loading), `frame_list`
//! (`--frames`), `frame_source` (what renders), `render_run` (from there to an output folder).

use std::{
    ffi::OsString,
    io::{self, Write},
    process::ExitCode,
};

use clap::{Parser, Subcommand, error::ErrorKind};

mod commands;
pub mod console;
pub mod failure;
mod frame_list;
mod frame_source;
mod inputs;
mod interrupt;
mod output;
mod progress;
mod render_run;
mod times_table;
mod tolerances;

use console::Console;
use failure::Failure;

const AFTER_HELP: &str = "\
Examples:
  camsim demo                                     the built-in flight, as pictures, in ./camsim-demo
  camsim render flight.toml -o frames             every frame of a scenario
  camsim render flight.toml --frames 0..10 --set camera.shutter.readout_ms=0
  camsim explain flight.toml --frame 7            what a frame takes, and what it doesn't
  camsim verify flight.toml                       how far off its pixels are, and were said to be
  camsim camera import calib.yaml -o CAMERA.toml  calibrations of other programs
  camsim apply CAMERA.toml FRAME.toml -o out.png  an ideal RGB-D picture of any origin, through the camera

Exit codes:
  0  done
  1  it failed on the way (disk, device, a check that did not hold)
  2  wrong usage or bad input: the message says where, and what to do
  3  no usable graphics adapter
  130  stopped by Ctrl-C: what is written is whole, and the message says how to go on; a second Ctrl-C ends at once, without it

CAMSIM_ADAPTER=part-of-a-name picks the adapter (names: `camsim info`). CAMSIM_REVERSE=device or host says where output frames are made from
ideal frames, CAMSIM_IDEAL=device or host where those are drawn (`camsim info --help`).";

/// Pictures of a real, imperfect airborne camera, and the truth about them.
#[derive(Debug, Parser)]
#[command(name = "camsim", version, after_help = AFTER_HELP, arg_required_else_help = true, max_term_width = 110)]
struct Cli {
    /// Say only what was asked for: no progress, no notes, no warnings
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more
    #[arg(short, long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(commands::demo::Args),
    Render(commands::render::Args),
    Explain(commands::explain::Args),
    Verify(commands::verify::Args),
    Track(commands::track::Args),
    Lens(commands::lens::Args),
    Camera(commands::camera::Args),
    Apply(commands::apply::Args),
    Board(commands::board::Args),
    Compare(commands::compare::Args),
    Bench(commands::bench::Args),
    Reproduce(commands::reproduce::Args),
    Info(commands::info::Args),
    Viewer(commands::viewer::Args),
    Completions(commands::completions::Args),
}

/// Runs the program with the process's arguments.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os(), &mut io::stdout().lock(), &mut io::stderr()))
}

/// Runs the program with `args` (the first is the program's name) and gives the exit code.
pub fn run(args: impl IntoIterator<Item = OsString>, stdout: &mut dyn Write, stderr: &mut dyn Write) -> u8 {
    let mut console = Console::new(stdout, stderr);
    let args: Vec<OsString> = args.into_iter().collect();
    console.set_typed(args.clone());
    let outcome = match Cli::try_parse_from(args) {
        Ok(cli) => {
            console.set_volume(cli.quiet, cli.verbose);
            dispatch(cli.command, &mut console)
        }
        Err(error) => return answer_of_clap(&error, &mut console),
    };
    match outcome.and_then(|()| Ok(console.flush()?)) {
        Ok(()) => failure::DONE,
        Err(failure) => console.report(&failure),
    }
}

fn dispatch(command: Command, console: &mut Console<'_>) -> Result<(), Failure> {
    match command {
        Command::Demo(args) => commands::demo::run(&args, console),
        Command::Render(args) => commands::render::run(&args, console),
        Command::Explain(args) => commands::explain::run(&args, console),
        Command::Verify(args) => commands::verify::run(&args, console),
        Command::Track(args) => commands::track::run(&args, console),
        Command::Lens(args) => commands::lens::run(&args, console),
        Command::Camera(args) => commands::camera::run(&args, console),
        Command::Apply(args) => commands::apply::run(&args, console),
        Command::Board(args) => commands::board::run(&args, console),
        Command::Compare(args) => commands::compare::run(&args, console),
        Command::Bench(args) => commands::bench::run(&args, console),
        Command::Reproduce(args) => commands::reproduce::run(&args, console),
        Command::Info(args) => commands::info::run(&args, console),
        Command::Viewer(args) => commands::viewer::run(&args),
        Command::Completions(args) => commands::completions::run::<Cli>(&args, console),
    }
}

/// Help and version are answers; everything else that clap says is wrong usage.
fn answer_of_clap(error: &clap::Error, console: &mut Console<'_>) -> u8 {
    let text = error.render();
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => match console.print(&text.to_string()) {
            Ok(()) => failure::DONE,
            Err(error) => console.report(&error.into()),
        },
        _ => {
            console.complain(&text.to_string());
            failure::BAD_INPUT
        }
    }
}
