//! `camsim reproduce`: the experiments of the paper.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_lab::reproduce::{Experiment, ReproduceError, Setup};

use crate::{
    backend::BackendArgs,
    console::Console,
    failure::{BAD_INPUT, Failure},
    output::check_folder,
};

/// Environment variable with the folder of the paper's inputs, used without `--data`.
const DATA_VARIABLE: &str = "CAMSIM_DATA";
/// Frame widths in which circles can be detected, and that an adapter supports.
const WIDTHS_PX: std::ops::RangeInclusive<u32> = 96..=4096;

/// Reproduce the experiments of section 8 of the paper
///
/// Each experiment prints its tables and writes its own folder with tables (CSV), plots (SVG), images (PNG)
/// and a report.md. Results beside those of the paper: docs/theory/REPRODUCTION.md.
///
/// The paper's flight log, camera poses and target are not part of camsim. Name their folder with --data (or
/// the environment variable CAMSIM_DATA). Without it, tracking, lens and map run on built-in substitutes,
/// with a note. The other experiments need no files.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Experiments:
  tracking   8.1  how close the tracker stays to the flight log
  lens       8.3  circles through the paper's fisheye, from 60 poses (figs. 11, 12)
  time       8.4  the displacement models over one second (figs. 13, 14, 15)
  blur       8.5  motion blur by samples (figs. 16, 17)
  shutter    8.6  rolling shutter (figs. 18, 19)
  interlace  8.7  interlacing (fig. 20)
  map        8.8  time constants of one second over terrain (fig. 21)
  speed      8.9  frames a second

Examples:
  camsim reproduce                                  all of them, in ./camsim-reproduce
  camsim reproduce time blur -o out                 two of them
  camsim reproduce tracking --data ~/camsim-data    on the paper's own log: ~/camsim-data/camsim/path_lawnmower.csv
  camsim reproduce time --width 160                 small frames, fast")]
pub struct ReproduceArgs {
    /// Experiments [default: all]
    #[arg(value_name = "EXPERIMENT", value_enum)]
    experiments: Vec<ExperimentArg>,
    /// Output folder, with a folder for each experiment
    #[arg(short, long, value_name = "DIR", default_value = "camsim-reproduce")]
    output: PathBuf,
    /// Folder of the paper's inputs: camsim/path_lawnmower.csv, camsim/path-chessboard-*.csv, flights/,
    /// terrain/
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Width of the frames (4:3), 96 to 4096 px; those of the paper are 640 px wide. At 128 px and less, lens
    /// finds no circle
    #[arg(long, value_name = "PX", default_value_t = 640)]
    width: u32,
    #[command(flatten)]
    backend: BackendArgs,
}

/// An experiment, on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ExperimentArg {
    Tracking,
    Lens,
    Time,
    Blur,
    Shutter,
    Interlace,
    Map,
    Speed,
}

impl ExperimentArg {
    fn experiment(self) -> Experiment {
        match self {
            Self::Tracking => Experiment::Tracking,
            Self::Lens => Experiment::Lens,
            Self::Time => Experiment::Time,
            Self::Blur => Experiment::Blur,
            Self::Shutter => Experiment::Shutter,
            Self::Interlace => Experiment::Interlace,
            Self::Map => Experiment::Map,
            Self::Speed => Experiment::Speed,
        }
    }
}

/// Runs the experiments, prints their tables, writes their folders.
pub fn run(args: &ReproduceArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    if !WIDTHS_PX.contains(&args.width) {
        let (least, most) = (WIDTHS_PX.start(), WIDTHS_PX.end());
        return Err(Failure::bad_input(anyhow!("--width {}: must be {least} to {most} pixels", args.width)));
    }
    let data = data_folder(args)?;
    check_folder(&args.output)?;
    // In the order of the paper.
    let asked: Vec<Experiment> = args.experiments.iter().map(|which| which.experiment()).collect();
    let chosen: Vec<Experiment> = Experiment::ALL
        .into_iter()
        .filter(|experiment| asked.is_empty() || asked.contains(experiment))
        .collect();
    let engine = args.backend.open()?;
    console.note(format_args!("rendering on {engine}"));
    if data.is_none() {
        console.note(format_args!(
            "no folder of the paper's inputs (--data, {DATA_VARIABLE}): tracking, lens and map run on \
             built-in substitutes"
        ));
    }
    let scratch = args.output.join("inputs");
    let setup = Setup { engine: &engine, data: data.as_deref(), scratch: &scratch, width_px: args.width };
    // A failed experiment does not stop the others.
    let mut failures = Vec::new();
    for experiment in &chosen {
        console.note(format_args!("{} ...", experiment.name()));
        match one(*experiment, &setup, &args.output, console) {
            Err(failure) if failure.is_broken_pipe() => return Err(failure),
            Err(failure) => {
                console.complain(&format!("{}: {failure}\n", experiment.name()));
                failures.push((experiment.name(), failure.code()));
            }
            Ok(()) => {}
        }
    }
    if failures.is_empty() {
        return Ok(());
    }
    let names = failures.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let error = anyhow!(
        "{} of {} experiments failed: {names}; for the reasons see above",
        failures.len(),
        chosen.len()
    );
    Err(if failures.iter().all(|(_, code)| *code == BAD_INPUT) {
        Failure::bad_input(error)
    } else {
        Failure::failed(error)
    })
}

/// Runs one experiment, writes its folder and prints its tables.
fn one(
    experiment: Experiment,
    setup: &Setup<'_>,
    output: &Path,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let report = experiment.run(setup).map_err(of_reproduction)?;
    let folder = output.join(experiment.name());
    report.write(&folder, experiment.title()).map_err(of_reproduction)?;
    console.line(experiment.title())?;
    for note in &report.notes {
        console.line(format_args!("  {note}"))?;
    }
    for (_, table) in &report.tables {
        console.line(format_args!("\n{}", table.text().trim_end()))?;
    }
    console.line(format_args!("\n  report: {}\n", folder.join("report.md").display()))?;
    Ok(console.flush()?)
}

/// The folder named by the command line or the environment; it must be there.
fn data_folder(args: &ReproduceArgs) -> Result<Option<PathBuf>, Failure> {
    let (folder, named_by) =
        match (&args.data, std::env::var_os(DATA_VARIABLE).filter(|value| !value.is_empty())) {
            (Some(folder), _) => (folder.clone(), "--data"),
            (None, Some(value)) => (PathBuf::from(value), DATA_VARIABLE),
            (None, None) => return Ok(None),
        };
    if folder.join("camsim").is_dir() {
        return Ok(Some(folder));
    }
    Err(Failure::bad_input(anyhow!(
        "{named_by}: {} has no folder camsim/ with the paper's inputs (path_lawnmower.csv and others); name \
         the folder above it, or leave {named_by} out to run on built-in substitutes",
        folder.display()
    )))
}

/// Files that cannot be read are invalid input; other errors are failures of the run.
fn of_reproduction(error: ReproduceError) -> Failure {
    match error {
        ReproduceError::Gpu(error) => error.into(),
        ReproduceError::Render(error) => error.into(),
        ReproduceError::Write(_) | ReproduceError::Plot(_) | ReproduceError::NoCircle { .. } => {
            Failure::failed(error)
        }
        _ => Failure::bad_input(error),
    }
}
