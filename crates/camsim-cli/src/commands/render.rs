//! `camsim render`.

use std::{
    cell::OnceCell,
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use camsim_core::scenario::{Channel, DatasetFormat, ImageFormat, Rig, Scenario};
use camsim_io::scenario_file::print_default;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::export::export_datasets;
use crate::{
    backend,
    console::Console,
    failure::Failure,
    frame_list::{FrameList, Shard},
    frame_source::{is_reference, with_reference},
    inputs::{self, Changes},
    render_run::Outcome,
};

mod cameras;
mod stage;
mod variations;

use stage::{Part, Stage};

/// Render the frames of a scenario
///
/// The output folder holds a folder for each channel, tables of frames and poses, the camera, and run.json, which
/// `camsim render DIR/run.json` renders again. The cameras of a rig have a folder each, and so have twins
/// ([[output.twin]]). docs/reference/RUNS.md lists all files. A folder can be moved together with its input files.
///
/// Ctrl-C stops after the current frames and prints the command that resumes the run.
#[derive(Debug, Default, clap::Args)]
#[command(after_help = "\
Examples:
  camsim render flight.toml
  camsim render flight.toml -o out --frames 0..100 --outputs color,depth,rows --format exr,png
  camsim render flight.toml --set camera.lens.model=pinhole --set 'camera.lens.coefficients=[]'
  camsim render flight.toml -o out --shard 2/4        the second of four machines
  camsim render flight.toml -o out --resume           only what is missing
  camsim render rig.toml -o out --camera left         one camera of several
  camsim render random.toml -o out --variations 0..100
                                                      scenarios that [randomize] draws
  camsim render flight.toml --backend cpu             without a graphics adapter
  camsim render flight.toml --backend reference --frames 7
                                                      exactly and slowly
  camsim render flight.toml --format none --frames 0..50 --times
                                                      how fast, and where the time goes
  camsim render flight.toml --format mp4              a video, by ffmpeg
  camsim render flight.toml --format none --pipe | mpv -
                                                      look at it while it is made
  camsim render --print-default > flight.toml         a scenario to start from")]
pub struct RenderArgs {
    /// Scenario (TOML), or the run.json of an earlier run
    #[arg(required_unless_present = "print_default")]
    scenario: Option<PathBuf>,
    /// Output folder [default: the scenario's name + "-frames"]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Frames of each camera: 7, 10..20 (without 20), 10..=20, 10.. or several with commas [default: all]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    frames: Option<FrameList>,
    /// Cameras of a scenario with [[cameras]], by their names [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    camera: Vec<String>,
    #[command(flatten)]
    changes: Changes,
    /// Renderer [default: gpu on a graphics card, cpu elsewhere, reference if quality.solver is "reference"]
    #[arg(long, value_enum)]
    backend: Option<RenderBackend>,
    /// Channels, instead of output.channels
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = channel_parser())]
    outputs: Option<Vec<Channel>>,
    /// File formats, instead of output.format; none renders and reads back without writing frames (for
    /// timing)
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    format: Option<Vec<FormatArg>>,
    /// Keep frames whose files exist already (files are written completely, so they are not read again);
    /// refused if the folder belongs to another scenario, or one of its input files has changed
    #[arg(long)]
    resume: bool,
    /// Print the time of each stage at the end: on the cpu, and by pass on the gpu
    #[arg(long, conflicts_with = "pipe")]
    times: bool,
    /// Also write channels.png: the channels of the first frame as pictures in colour, four in a row
    #[arg(long, conflicts_with = "pipe")]
    sheet: bool,
    /// Render only the I-th of N parts, with I from 1: every N-th frame, or every N-th variation
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Write checksums.csv at the end: size and CRC-32 of each file, which `camsim merge` checks
    #[arg(long)]
    checksums: bool,
    /// Pass the frames to standard output as an uncompressed video (y4m), too, for ffmpeg, mpv or GStreamer
    #[arg(long)]
    pipe: bool,
    /// Variations of a scenario with [randomize], each into a folder DIR/variation_000017: 17, 0..100 (without 100)
    /// ... [default: all, if randomize.variations says how many]
    #[arg(long, visible_alias = "variation", value_name = "LIST", allow_hyphen_values = true)]
    variations: Option<FrameList>,
    /// Print a scenario with every key, its default and its meaning, and exit
    #[arg(long, exclusive = true)]
    print_default: bool,
}

/// `--backend`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum RenderBackend {
    /// This machine's processor alone; needs no Vulkan driver
    Cpu,
    /// The graphics adapter alone, a software adapter where there is no card
    Gpu,
    /// The slow exact renderer: one ray per sample, in f64 on the CPU. It is equivalent to quality.solver =
    /// "reference", and excludes other solvers and the paper's preset
    Reference,
}

impl RenderBackend {
    /// The renderer of the engine, if it is one.
    fn renderer(self) -> Option<backend::EngineBackend> {
        match self {
            Self::Cpu => Some(backend::EngineBackend::Cpu),
            Self::Gpu => Some(backend::EngineBackend::Gpu),
            Self::Reference => None,
        }
    }
}

impl RenderArgs {
    /// What is missing of a scenario's frames in a folder.
    #[cfg(feature = "lab")]
    pub fn of_scenario(
        scenario: PathBuf,
        output: PathBuf,
        frames: Option<FrameList>,
        changes: Changes,
        backend: Option<RenderBackend>,
    ) -> Self {
        Self {
            scenario: Some(scenario),
            output: Some(output),
            ..Self::for_export(frames, Vec::new(), changes, backend)
        }
    }

    /// What `camsim export` renders: what is missing in its folder.
    pub fn for_export(
        frames: Option<FrameList>,
        camera: Vec<String>,
        changes: Changes,
        backend: Option<RenderBackend>,
    ) -> Self {
        Self { frames, camera, changes, backend, resume: true, ..Self::default() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum FormatArg {
    /// OpenEXR, linear
    Exr,
    /// PNG in the encoding of camera.photometric.output
    Png,
    /// A video of all frames, by ffmpeg: color.mp4
    Mp4,
    /// As mp4, in a Matroska file
    Mkv,
    /// An uncompressed video: color.y4m
    Y4m,
    /// No frame files
    None,
}

fn channel_parser() -> impl TypedValueParser<Value = Channel> {
    PossibleValuesParser::new(Channel::NAMES)
        .try_map(|name| Channel::named(&name).ok_or_else(|| format!("`{name}` is not a channel")))
}

/// Renders a scenario, and writes its datasets.
pub fn run(args: &RenderArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(path) = args.scenario.clone() else {
        return Ok(console.print(&print_default())?);
    };
    let folder = args.output.clone().unwrap_or_else(|| default_folder(&path));
    let scenario = inputs::read_changed(&path, &args.changes, console)?;
    if scenario.is_random() || args.variations.is_some() {
        return variations::run(args, &scenario, &folder, console);
    }
    let datasets = render(args, scenario.into_base(), &folder, None, console)?;
    if args.shard.is_some() && !datasets.is_empty() {
        console.note("a shard writes no datasets: when all are there, `camsim export DIR --as ...` does");
        return Ok(());
    }
    export_datasets(&folder, &datasets, args.pipe, console)
}

/// Renders a scenario with all that its datasets need, which are returned, or that `export` needs.
pub fn render(
    args: &RenderArgs,
    rig: Rig,
    folder: &Path,
    export: Option<DatasetFormat>,
    console: &mut Console<'_>,
) -> Result<Vec<DatasetFormat>, Failure> {
    let datasets = rig.first().output.datasets.clone();
    let engine = OnceCell::new();
    let mut stage = Stage::new(&engine);
    let part = Part { rig, folder, variation: None, export, shard: args.shard };
    let outcome = stage.render(args, part, console)?;
    stage.report(args, &outcome, &summary(&outcome, folder), console)?;
    Ok(datasets)
}

/// What was rendered, for users.
fn summary(outcome: &Outcome, folder: &Path) -> String {
    let (seconds, size_mb) = (outcome.time.as_secs_f64(), outcome.bytes as f64 * 1e-6);
    format!(
        "{} in {seconds:.2} s, {}, {size_mb:.1} MB in {}",
        outcome.pictures(),
        outcome.rate(),
        folder.display()
    )
}

/// A shard has a part of the frames, and its video would have the name of all others.
fn refuse_parts_of_videos(rig: &Rig, shard: Option<Shard>) -> Result<(), Failure> {
    let scenario = rig.first();
    match scenario.output.format.iter().find(|format| format.is_video()) {
        Some(video) if shard.is_some() => Err(Failure::bad_input(anyhow!(
            "--shard makes a part of the frames, and an {} holds all of them: render the shards as png, then make \
             the video by ffmpeg -framerate {} -i DIR/color/frame_%06d.png",
            video.ending(),
            scenario.camera.fps
        ))),
        _ => Ok(()),
    }
}

fn default_folder(scenario: &Path) -> PathBuf {
    let mut name = scenario.file_stem().unwrap_or("camsim".as_ref()).to_owned();
    name.push("-frames");
    PathBuf::from(name)
}

/// `--backend reference` becomes part of the scenario, so that frames of the two renderers never mix in one
/// folder.
fn with_backend(scenario: Scenario, backend: Option<RenderBackend>) -> Result<Scenario, Failure> {
    match backend {
        Some(RenderBackend::Reference) => with_reference(scenario),
        Some(RenderBackend::Cpu | RenderBackend::Gpu) if is_reference(&scenario) => {
            Err(Failure::bad_input(anyhow!(
                "quality.solver is \"reference\", which only --backend reference has: leave --backend out, or \
                 change the solver (--set quality.solver=auto)"
            )))
        }
        _ => Ok(scenario),
    }
}

/// `--outputs` and `--format` instead of `[output]`.
fn with_outputs(mut scenario: Scenario, args: &RenderArgs) -> Result<Scenario, Failure> {
    if let Some(channels) = &args.outputs {
        scenario.output.channels = without_repeats(channels);
    }
    if let Some(formats) = &args.format {
        let images = formats.iter().filter_map(|format| match format {
            FormatArg::Exr => Some(ImageFormat::Exr),
            FormatArg::Png => Some(ImageFormat::Png),
            FormatArg::Mp4 => Some(ImageFormat::Mp4),
            FormatArg::Mkv => Some(ImageFormat::Mkv),
            FormatArg::Y4m => Some(ImageFormat::Y4m),
            FormatArg::None => None,
        });
        scenario.output.format = without_repeats(&images.collect::<Vec<_>>());
        if formats.contains(&FormatArg::None) && !scenario.output.format.is_empty() {
            return Err(Failure::bad_input(anyhow!(
                "--format none cannot be combined with other formats: leave it out, or the others"
            )));
        }
    }
    Ok(scenario)
}

fn without_repeats<T: Copy + PartialEq>(items: &[T]) -> Vec<T> {
    let mut kept = Vec::new();
    for &item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}
