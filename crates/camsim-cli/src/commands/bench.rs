//! `camsim bench`: run time and error.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_lab::bench::{BenchError, BenchReport, Options, Step, run as measure};

use crate::{
    backend::BackendArgs,
    console::Console,
    failure::{Failure, OrFail},
    output::{check_folder, check_output, write_output},
};

/// Measure run time and error on this machine, for every case with every method
///
/// Times are for frames rendered and read back; methods alternate within the same rounds. Errors are against
/// the reference renderer: source errors in pixels, picture errors in dB. On two otherwise idle CPU cores
/// without a GPU, all cases take about 15 minutes, and --quick about half a minute. Other load makes the run
/// longer and the times less reliable. Files are written after each case, so an interrupted run keeps its
/// results; it cannot be resumed. Columns: case, preset, width, height, ms_per_frame_p50, ms_per_frame_p99,
/// cpu_ms_per_frame, coord_rms_px, coord_p99_px, coord_max_px, psnr_db, predicted_px and further ones; null
/// is not measured.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim bench --quick                        four cases with small frames
  camsim bench -o bench                       all cases: bench.md, bench.json, bench.csv, bench.svg in ./bench
  camsim bench --cases buildings,lens-s3      cases or groups by name; groups are smooth, vibration, buildings,
                                              \"1 s windows\", exposure, lenses, \"all effects\"
  camsim bench --quick --check                exit code 1 if another method is faster and more accurate than the planner's choice")]
pub struct BenchArgs {
    /// Cases or groups, separated by commas (quote names with blanks: "1 s windows"); an unknown name lists
    /// all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    cases: Vec<String>,
    /// Few cases, frames of 320x240, few rounds
    #[arg(long)]
    quick: bool,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    /// Write the rows as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a plot of error over time
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write bench.md, bench.json, bench.csv and bench.svg to a folder
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Fail if another method of the same case has both a lower time and a lower error than the planner's
    /// choice
    #[arg(long)]
    check: bool,
    #[command(flatten)]
    backend: BackendArgs,
}

/// Measures and prints.
pub fn run(args: &BenchArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let options = Options { cases: args.cases.clone(), quick: args.quick, ..Options::default() };
    check_files(args)?;
    let engine = args.backend.open()?;
    console.note(format_args!("rendering on {engine}"));
    let report = measure(&engine, &options, &mut |step| match step {
        Step::Begins(what) => {
            console.note(what);
            Ok(())
        }
        // Written after each case, so that results survive an interruption.
        Step::Done(report) => files(args, report, console),
    })?;
    if args.json {
        console.print(&json(&report)?)?;
    } else {
        console.print(&report.markdown())?;
    }
    console.note(report.summary());
    match report.violations.len() {
        dominated if args.check && dominated > 0 => Err(Failure::failed(anyhow!(
            "{dominated} choices of the planner have a higher time and a higher error than another method; \
             the table lists them"
        ))),
        _ => Ok(()),
    }
}

/// Checks that all files can be written, before ten minutes of measurements.
fn check_files(args: &BenchArgs) -> Result<(), Failure> {
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

/// Writes the requested files.
fn files(args: &BenchArgs, report: &BenchReport, console: &mut Console<'_>) -> Result<(), Failure> {
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

fn json(report: &BenchReport) -> Result<String, Failure> {
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
