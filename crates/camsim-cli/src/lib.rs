//! The camsim command line: arguments -> scenario -> engine -> writers.
//!
//! Each command is one file in `commands/` with its arguments and a `run`. Everything else is shared:
//! [`console`] (output streams), [`failure`] (exit codes), `inputs` (scenario and loading), `frame_list`
//! (`--frames`), `frame_source` (renderers), `render_run` (rendering into an output folder).

use std::{
    ffi::OsString,
    io::{self, Write},
    process::ExitCode,
};

use clap::{
    Parser, Subcommand,
    error::{ContextKind, ContextValue, ErrorKind},
};

mod backend;
mod channel_sheet;
mod commands;
pub mod console;
pub mod failure;
mod frame_list;
pub mod frame_source;
mod inputs;
mod interrupt;
mod output;
mod progress;
mod render_run;
mod times_table;
mod tolerances;

pub use commands::explain::explain;
use console::Console;
use failure::Failure;

const AFTER_HELP: &str = "\
Examples:
  camsim demo                                     renders the built-in flight to ./camsim-demo
  camsim new --log flight.csv --terrain dem.tif   writes a commented scenario
  camsim render flight.toml -o frames             renders every frame of a scenario
  camsim render flight.toml --frames 0..10 --set camera.shutter.readout_ms=0
  camsim explain flight.toml --frame 7            shows the plan of a frame, and what it skips
  camsim export flight.toml --as euroc -o euroc   writes frames as another program reads them
  camsim verify flight.toml                       compares measured with predicted errors
  camsim camera import calib.yaml -o CAMERA.toml  converts calibrations of other programs
  camsim apply CAMERA.toml FRAME.toml -o out.png  applies the camera to an ideal RGB-D image of any origin

Exit codes:
  0  success
  1  failure during the run (disk, GPU, a check that did not pass)
  2  wrong usage or invalid input; the message names the location and a remedy
  3  no usable graphics adapter where one is demanded
  130  stopped by Ctrl-C or SIGTERM after the current frames: all files are complete, and the message tells how
     to resume; a second one ends at once. Where a shell has it ignored, in the background of a script,
     Ctrl-C does nothing, and SIGTERM stops

--backend cpu renders without a graphics adapter; CAMSIM_ADAPTER=part-of-a-name picks one (`camsim info` lists them).";

/// Simulator of imperfect airborne cameras: frames with ground truth.
#[derive(Debug, Parser)]
#[command(name = "camsim", version = version(), after_help = AFTER_HELP)]
#[command(arg_required_else_help = true, max_term_width = 110)]
struct Cli {
    /// Print results only: no progress, notes or warnings
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Print more details
    #[arg(short, long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

/// Version, revision where it is known, and features.
pub(crate) fn version() -> String {
    let features = [
        ("gpu", cfg!(feature = "gpu")),
        ("lab", cfg!(feature = "lab")),
        ("viewer", cfg!(feature = "viewer")),
    ];
    let features: Vec<&str> = features.iter().filter(|(_, is_on)| *is_on).map(|(name, _)| *name).collect();
    let features = if features.is_empty() { "no features".to_owned() } else { features.join(", ") };
    let revision = match env!("CAMSIM_REVISION") {
        "" => String::new(),
        revision => format!("{revision}; "),
    };
    format!("{} ({revision}{features})", env!("CARGO_PKG_VERSION"))
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(commands::demo::DemoArgs),
    New(commands::new::NewArgs),
    Render(commands::render::RenderArgs),
    Explain(commands::explain::ExplainArgs),
    Verify(commands::verify::VerifyArgs),
    Export(commands::export::ExportArgs),
    Track(commands::track::TrackArgs),
    Lens(commands::lens::LensArgs),
    Camera(commands::camera::CameraArgs),
    Apply(commands::apply::ApplyArgs),
    Board(commands::board::BoardArgs),
    Compare(commands::compare::CompareArgs),
    Cluster(commands::cluster::ClusterArgs),
    Merge(commands::merge::MergeArgs),
    #[cfg(feature = "lab")]
    Bench(commands::bench::BenchArgs),
    #[cfg(feature = "lab")]
    Reproduce(commands::reproduce::ReproduceArgs),
    #[cfg(feature = "lab")]
    Study(commands::study::StudyArgs),
    Info(commands::info::InfoArgs),
    #[cfg(feature = "viewer")]
    Viewer(commands::viewer::ViewerArgs),
    Schema(commands::schema::SchemaArgs),
    Completions(commands::completions::CompletionsArgs),
    #[command(hide = true)]
    Man(commands::man::ManArgs),
}

/// Runs the program with the process's arguments.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os(), &mut io::stdout().lock(), &mut io::stderr()))
}

/// Runs the program with `args` (the first is the program's name) and returns the exit code.
pub fn run(args: impl IntoIterator<Item = OsString>, stdout: &mut dyn Write, stderr: &mut dyn Write) -> u8 {
    let mut console = Console::new(stdout, stderr);
    let args: Vec<OsString> = args.into_iter().collect();
    console.set_typed(args.clone());
    let outcome = match Cli::try_parse_from(args) {
        Ok(cli) => {
            console.set_volume(cli.quiet, cli.verbose);
            dispatch(cli.command, &mut console)
        }
        Err(error) => return report_clap(&error, &mut console),
    };
    match outcome.and_then(|()| Ok(console.flush()?)) {
        Ok(()) => failure::DONE,
        Err(failure) => console.report(&failure),
    }
}

fn dispatch(command: Command, console: &mut Console<'_>) -> Result<(), Failure> {
    match command {
        Command::Demo(args) => commands::demo::run(&args, console),
        Command::New(args) => commands::new::run(args, console),
        Command::Render(args) => commands::render::run(&args, console),
        Command::Explain(args) => commands::explain::run(&args, console),
        Command::Verify(args) => commands::verify::run(&args, console),
        Command::Export(args) => commands::export::run(&args, console),
        Command::Track(args) => commands::track::run(&args, console),
        Command::Lens(args) => commands::lens::run(&args, console),
        Command::Camera(args) => commands::camera::run(&args, console),
        Command::Apply(args) => commands::apply::run(&args, console),
        Command::Board(args) => commands::board::run(&args, console),
        Command::Compare(args) => commands::compare::run(&args, console),
        Command::Cluster(args) => commands::cluster::run(&args, console),
        Command::Merge(args) => commands::merge::run(&args, console),
        #[cfg(feature = "lab")]
        Command::Bench(args) => commands::bench::run(&args, console),
        #[cfg(feature = "lab")]
        Command::Reproduce(args) => commands::reproduce::run(&args, console),
        #[cfg(feature = "lab")]
        Command::Study(args) => commands::study::run(&args, console),
        Command::Info(args) => commands::info::run(&args, console),
        #[cfg(feature = "viewer")]
        Command::Viewer(args) => commands::viewer::run(&args),
        Command::Schema(args) => commands::schema::run(&args, console),
        Command::Completions(args) => commands::completions::run::<Cli>(&args, console),
        Command::Man(args) => commands::man::run::<Cli>(&args, console),
    }
}

/// Help and version go to standard output; every other message of clap is wrong usage.
fn report_clap(error: &clap::Error, console: &mut Console<'_>) -> u8 {
    let text = error.render();
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => match console.print(&text.to_string()) {
            Ok(()) => failure::DONE,
            Err(error) => console.report(&error.into()),
        },
        _ => {
            console.complain(&text.to_string());
            if let Some(feature) = left_out(error) {
                console.complain(&format!(
                    "This build leaves that command out. `cargo build --release --features {feature}` in camsim's \
                     sources has it.\n"
                ));
            }
            failure::BAD_INPUT
        }
    }
}

/// The feature with the command that an error does not know.
fn left_out(error: &clap::Error) -> Option<&'static str> {
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    match name.as_str() {
        "bench" | "reproduce" | "study" => Some("lab"),
        "viewer" => Some("viewer"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::left_out;

    #[test]
    fn commands_of_other_builds_are_named() {
        let other = clap::Command::new("camsim").subcommand(clap::Command::new("render"));
        let unknown = |name| other.clone().try_get_matches_from(["camsim", name]).expect_err("unknown");
        assert_eq!(left_out(&unknown("viewer")), Some("viewer"));
        assert_eq!(left_out(&unknown("reproduce")), Some("lab"));
        assert_eq!(left_out(&unknown("rendr")), None);
    }
}
