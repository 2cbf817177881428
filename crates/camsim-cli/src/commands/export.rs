//! `camsim export`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_core::scenario::{DatasetFormat, Scenario};
use camsim_io::{
    formats::exporting::{DatasetError, ExportOptions, RunFolder, Watch, export, judge_lens, require},
    shell::quoted,
};
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::render::{RenderArgs, RenderBackend, render};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::{FrameList, whole_number},
    inputs::{self, Changes},
    interrupt,
    progress::frames_bar,
    render_run::Lock,
};
use camsim_core::validate::validate;

/// Write frames in the layout of another program
///
/// Takes an output folder of `camsim render`, or a scenario, which is rendered first, with the channels, formats
/// and twins that the layout needs, into DIR/camsim. Pictures are linked or copied where the layout's readers take
/// them as they are, and else written as grey or RGB without alpha. Pixel origins, axes, quaternion orders, clocks and units are turned to what the layout's readers expect; DIR/README.md
/// says how. The same command again completes an export that was stopped. `output.datasets = ["euroc"]` in a
/// scenario does this at the end of `camsim render`. docs/reference/DATASETS.md describes the layouts.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim export flight.toml --as euroc -o euroc        for ORB-SLAM3, OpenVINS, VINS-Fusion, Basalt
  camsim export out --as mcap -o bag                   frames that are rendered: for ROS 2, Foxglove, rerun
  camsim export flight.toml --as colmap -o model --set output.tracks.points=terrain
  camsim export out --as tum -o tum --depth-per-metre 100
  camsim export out --as kalibr -o left --camera left  one camera of several")]
pub struct ExportArgs {
    /// Output folder of camsim render, or a scenario (TOML)
    source: PathBuf,
    /// Layout
    #[arg(long = "as", value_name = "LAYOUT", value_parser = format_parser())]
    format: DatasetFormat,
    /// Folder of the export
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Frames of a scenario to render: 7, 10..20 (without 20) ... [default: all]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    frames: Option<FrameList>,
    /// Cameras of a rig, by their names [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    camera: Vec<String>,
    /// Pictures in colour where the layout has them in grey (euroc, kalibr)
    #[arg(long)]
    color: bool,
    #[command(flatten)]
    changes: Changes,
    /// Variation of a scenario with [randomize] [default: without what is drawn]
    #[arg(long, value_name = "K", value_parser = whole_number, allow_hyphen_values = true)]
    variation: Option<u64>,
    /// Renderer of a scenario
    #[arg(long, value_enum)]
    backend: Option<RenderBackend>,
    /// Steps per metre of 16 bit depth pictures [default: the layout's own, or the finest by which all depths fit]
    #[arg(long, value_name = "N")]
    depth_per_metre: Option<f64>,
}

#[cfg(feature = "lab")]
impl ExportArgs {
    /// A scenario's frames in a layout.
    pub fn of_scenario(
        source: PathBuf,
        format: DatasetFormat,
        output: PathBuf,
        frames: Option<FrameList>,
        changes: Changes,
        backend: Option<RenderBackend>,
    ) -> Self {
        Self {
            source,
            format,
            output,
            frames,
            changes,
            backend,
            camera: Vec::new(),
            color: false,
            variation: None,
            depth_per_metre: None,
        }
    }
}

fn format_parser() -> impl TypedValueParser<Value = DatasetFormat> {
    PossibleValuesParser::new(DatasetFormat::NAMES)
        .try_map(|name| DatasetFormat::named(&name).ok_or_else(|| format!("`{name}` is not a layout")))
}

/// Exports a folder or a scenario.
pub fn run(args: &ExportArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(scale) = args.depth_per_metre.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(Failure::bad_input(anyhow!("--depth-per-metre is {scale}: give a positive number")));
    }
    let folder = if args.source.is_dir() {
        refuse_scenario_options(args)?;
        args.source.clone()
    } else {
        render_source(args, console)?
    };
    let options = ExportOptions { depth_per_metre: args.depth_per_metre, color: args.color, replace: false };
    let mut run = RunFolder::open(&folder).or_bad_input()?;
    if !args.camera.is_empty() {
        run = run.of_cameras(&args.camera).or_bad_input()?;
    }
    let summary = export_run(&run, args.format, &args.output, &options, console)?;
    if console.is_quiet() { Ok(()) } else { Ok(console.line(summary)?) }
}

/// Options that change a scenario have no use with frames that are rendered.
fn refuse_scenario_options(args: &ExportArgs) -> Result<(), Failure> {
    let has_changes = !args.changes.sets.is_empty() || args.changes.preset.is_some();
    if has_changes || args.frames.is_some() || args.backend.is_some() || args.variation.is_some() {
        return Err(Failure::bad_input(anyhow!(
            "{} is a folder of frames that are rendered: --set, --preset, --variation, --frames and --backend go with a \
             scenario",
            args.source.display()
        )));
    }
    Ok(())
}

/// Renders what the layout needs; returns the folder.
fn render_source(args: &ExportArgs, console: &mut Console<'_>) -> Result<PathBuf, Failure> {
    let folder = args.output.join("camsim");
    let rendered =
        RenderArgs::for_export(args.frames.clone(), args.camera.clone(), args.changes.clone(), args.backend);
    let rig = inputs::read_changed_rig(&args.source, &args.changes, args.variation, console)?;
    render(&rendered, rig, &folder, Some(args.format), console)?;
    Ok(folder)
}

/// A scenario with what its datasets need, or instead of them `export`; says what was added.
pub fn with_needs(
    mut scenario: Scenario,
    export: Option<DatasetFormat>,
    console: &mut Console<'_>,
) -> Result<Scenario, Failure> {
    if export.is_some() {
        scenario.output.datasets.clear();
    }
    let formats = export.map_or_else(|| scenario.output.datasets.clone(), |format| vec![format]);
    for &format in &formats {
        let added = require(&mut scenario, format).or_bad_input()?;
        if !added.is_empty() {
            console.detail(format_args!("{} needs, and gets: {}", format.name(), added.join(", ")));
        }
    }
    match validate(&scenario).first() {
        Some(problem) if !formats.is_empty() => {
            Err(Failure::bad_input(anyhow!("{problem} (with what output.datasets or --as adds)")))
        }
        _ => Ok(scenario),
    }
}

/// Refuses lenses that a dataset, or instead of them `export`, cannot hold.
pub fn judge_lenses<'a>(
    mut scenarios: impl Iterator<Item = &'a Scenario>,
    export: Option<DatasetFormat>,
) -> Result<(), Failure> {
    scenarios.try_for_each(|scenario| {
        let mut formats = scenario.output.datasets.iter().copied().chain(export);
        formats.try_for_each(|format| judge_lens(&scenario.camera, format)).or_bad_input()
    })
}

/// Writes the datasets of a run into its folder.
pub fn export_datasets(
    folder: &Path,
    formats: &[DatasetFormat],
    has_pipe: bool,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let options = ExportOptions { replace: true, ..ExportOptions::default() };
    for &format in formats {
        let target = folder.join("datasets").join(format.name());
        let run = RunFolder::open(folder).or_bad_input()?;
        let summary = export_run(&run, format, &target, &options, console)?;
        // Standard output may have the frames.
        if has_pipe {
            console.note(summary);
        } else if !console.is_quiet() {
            console.line(summary)?;
        }
    }
    Ok(())
}

/// Exports a run, with a progress bar; returns a summary.
fn export_run(
    run: &RunFolder,
    format: DatasetFormat,
    folder: &Path,
    options: &ExportOptions,
    console: &mut Console<'_>,
) -> Result<String, Failure> {
    if !run.is_finished {
        let path = run.path.display();
        console.warn(format_args!("{path} is not finished: the frames that it has are exported"));
    }
    if !run.empty.is_empty() {
        console.warn(format_args!(
            "no frames of {}: the export is of the other cameras alone",
            run.empty.join(", ")
        ));
    }
    let _lock = Lock::take(folder)?;
    let bar = frames_bar(run.frames(), console.is_quiet());
    bar.set_message(format!("{} ", format.name()));
    let stop = interrupt::watch();
    let watch = Watch { advance: &|| bar.inc(1), is_stopped: &|| stop.is_asked() };
    let exported = export(run, format, folder, options, &watch);
    bar.finish_and_clear();
    let report = match exported {
        Ok(report) => report,
        Err(DatasetError::Stopped) => {
            return Err(Failure::interrupted(anyhow!("to complete it: {}", console.command())));
        }
        Err(error @ DatasetError::Write(_)) => return Err(Failure::failed(error)),
        Err(error) => return Err(Failure::bad_input(error)),
    };
    report.notes.iter().for_each(|note| console.note(note));
    let state = if report.was_complete { "was complete" } else { "written" };
    let (frames, path) = (report.pictures, quoted(folder));
    Ok(format!("{} of {frames} pictures {state}: {path}", format.name()))
}
