//! `camsim bench`: run time against error.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_gpu::{AdapterChoice, Engine};
use camsim_lab::bench::{BenchError, Options, Report, Step, run as measure};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    output::{check_folder, check_output, write_output},
};

/// Measure run time against error on this machine: every case with every method
///
/// Times are of frames rendered and read back, methods in turn within the same rounds; errors are against the
/// exact reference: of source coordinates in pixels, and of pictures in dB. On two processor cores that do
/// nothing else, without a GPU, the whole takes about a quarter of an hour and --quick about half a minute;
/// beside other work it takes as much longer, and its times are worth as much less. Files are written after
/// each case, so that an interrupted run leaves what it has measured; there is no resuming. Rows: case,
/// preset, width, height, ms_per_frame_p50, ms_per_frame_p99, cpu_ms_per_frame, coord_rms_px, coord_p99_px,
/// coord_max_px, psnr_db, predicted_px, and more behind them; null is what was not measured.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim bench --quick                        four cases, small pictures
  camsim bench -o bench                       everything: bench.md, bench.json, bench.csv, bench.svg in ./bench
  camsim bench --cases buildings,lens-s3      some cases or groups by name; groups are smooth, vibration, buildings,
                                              \"1 s windows\", exposure, lenses, \"all effects\"
  camsim bench --quick --check                exit code 1 if a row chosen by the plan is beaten in time and error")]
pub struct Args {
    /// Cases or groups of them, with commas (in quotes where they have blanks: "1 s windows"); a name that
    /// does not exist lists them all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    cases: Vec<String>,
    /// Few cases, pictures of 320x240, few rounds
    #[arg(long)]
    quick: bool,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    /// Write the rows as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write error against time as a plot
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write all of it to a folder: bench.md, bench.json, bench.csv, bench.svg
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Fail if a row that the plan chose is beaten by another row of its case in both time and error
    #[arg(long)]
    check: bool,
}

/// Measures and prints.
pub fn run(args: &Args, console: &mut Console<'_>) -> Result<(), Failure> {
    let options = Options { cases: args.cases.clone(), quick: args.quick };
    check_files(args)?;
    let engine = Engine::new(AdapterChoice::Best)?;
    console.note(format_args!("adapter: {}", engine.gpu().describe()));
    let report = measure(&engine, &options, &mut |step| match step {
        Step::Begins(what) => {
            console.note(what);
            Ok(())
        }
        // What is done is kept if a later case is interrupted.
        Step::Done(report) => files(args, report, console),
    })?;
    if args.json {
        console.print(&json(&report)?)?;
    } else {
        console.print(&report.markdown())?;
    }
    console.note(report.summary());
    match report.violations.len() {
        beaten if args.check && beaten > 0 => Err(Failure::failed(anyhow!(
            "{beaten} rows that the plan chose are beaten in both time and error; the table lists them"
        ))),
        _ => Ok(()),
    }
}

/// Ten minutes of work are not for a file that cannot be written.
fn check_files(args: &Args) -> Result<(), Failure> {
    if let Some(plot) = args
        .plot
        .as_ref()
        .filter(|plot| !plot.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("svg")))
    {
        return Err(Failure::bad_input(anyhow!(
            "--plot {}: the plot is SVG: the name must end in .svg",
            plot.display()
        )));
    }
    args.output.iter().try_for_each(|folder| check_folder(folder))?;
    [&args.csv, &args.plot].into_iter().flatten().try_for_each(|path| check_output(path))
}

/// Every file that was asked for, each whole.
fn files(args: &Args, report: &Report, console: &mut Console<'_>) -> Result<(), Failure> {
    let beside = |name: &str| args.output.as_ref().map(|folder| folder.join(name));
    if let Some(path) = beside("bench.md") {
        write(&path, &report.markdown(), console)?;
    }
    if let Some(path) = beside("bench.json") {
        write(&path, &json(report)?, console)?;
    }
    for path in [args.csv.clone(), beside("bench.csv")].into_iter().flatten() {
        write(&path, &report.csv(), console)?;
    }
    for path in [args.plot.clone(), beside("bench.svg")].into_iter().flatten() {
        write(&path, &report.plot()?, console)?;
    }
    Ok(())
}

fn json(report: &Report) -> Result<String, Failure> {
    let mut text = serde_json::to_string_pretty(report).or_failed()?;
    text.push('\n');
    Ok(text)
}

fn write(path: &Path, text: &str, console: &mut Console<'_>) -> Result<(), Failure> {
    write_output(Some(path), console, |out| out.write_all(text.as_bytes()))
}

impl From<BenchError> for Failure {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::NoSuchCase { .. } => Self::bad_input(error),
            BenchError::Render(error) => error.into(),
            BenchError::Gpu(error) => error.into(),
            error => Self::failed(error),
        }
    }
}
