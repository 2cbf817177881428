//! `camsim apply` on several frames, into a folder.

use std::{collections::BTreeMap, path::Path};

use anyhow::anyhow;
use camsim_core::{
    apply::{NoSourceCounts, Pipeline},
    photometric::GrayImage,
    scenario::{CameraSpec, Channel, ImageFormat, OutputSpec},
    shutter::Shutter,
};
use camsim_io::{
    frame_file::{FrameSet, list::FrameEntry},
    inputs,
    manifest::{check_resume_key, portable_inputs},
    portable::{relative_to, write_camera},
    scenario_file::RELATIVE_PATHS,
    write::{FrameFiles, FrameWriter, frames_path, write_atomic},
};
use serde::Serialize;

use super::{ApplyArgs, in_file, read, settings, warn_no_source};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameListError,
    interrupt::{self, Watch},
    output,
    progress::frames_bar,
    render_run::{Lock, refuse_others, refuse_unknown},
};

/// Distance of trajectory rows above which there is a gap, as in flight logs.
const GAP_S: f64 = 1.0;

/// `--format`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ImageFormatArg {
    /// OpenEXR, linear
    Exr,
    /// PNG in the encoding of photometric.output
    Png,
}

/// Inputs of the frames of a folder, which must be equal for `--resume`. Paths are relative to the
/// folder.
#[derive(Debug, Serialize)]
struct ApplyInputs {
    camera: CameraSpec,
    /// Text of FRAME.toml.
    frame_toml: String,
    preset: String,
    solver: Option<String>,
    blur_samples: Option<u32>,
    seed: u64,
    frame_number: u64,
    /// Contents of the files shared by all frames.
    files: inputs::Inputs,
    /// Images and stamp of each frame, with the modification times of the images.
    pictures: BTreeMap<String, String>,
}

/// `run.json`.
#[derive(Debug, Serialize)]
struct ApplyManifest<'a> {
    version: &'static str,
    paths: &'static str,
    apply: &'a ApplyInputs,
    /// First frame, and one past the last.
    frames: [u64; 2],
    written: u64,
    skipped: u64,
    finished: bool,
}

/// Renders the selected frames; nothing is written before the motion of all of them is checked.
pub(super) fn run(
    args: &ApplyArgs,
    spec: &CameraSpec,
    set: &FrameSet,
    vignette: Option<&GrayImage>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let folder = &args.output;
    if super::is_picture_path(args) {
        let (frame, count) = (args.frame.display(), set.entries().len());
        return Err(Failure::bad_input(anyhow!(
            "-o {}: {frame} names {count} frames, so it must be a folder",
            folder.display()
        )));
    }
    let frames = chosen(args, set)?;
    check_motion(args, spec, set, &frames)?;
    warn_of_gaps(args, spec, set, &frames, console)?;
    let inputs = inputs(args, spec, set)?;
    let files = FrameFiles::new(folder, &output_spec(args, set), spec.photometric.output);
    let number = |index: u64| args.frame_number.saturating_add(index);
    let numbers: Vec<u64> = frames.iter().map(|&index| number(index)).collect();
    let made = check_resume_key(folder, "apply", "from other inputs", &inputs);
    let is_ours = matches!(made, Ok(true));
    match made {
        Ok(true) => {}
        Ok(false) => refuse_unknown(folder, &numbers, &files, args.resume)?,
        Err(error) if args.resume => return Err(Failure::bad_input(error)),
        Err(error) => {
            refuse_others(folder, &numbers, &files, &error.reason())?;
            console
                .warn(format_args!("{} belongs to other inputs: its frames are replaced", folder.display()));
        }
    }
    output::check_folder(folder)?;
    if !is_ours {
        files.remove(&numbers).or_failed()?;
    }
    let todo: Vec<u64> =
        frames.iter().copied().filter(|&index| !(args.resume && files.exist(number(index)))).collect();
    let mut manifest = ApplyManifest {
        version: env!("CARGO_PKG_VERSION"),
        paths: RELATIVE_PATHS,
        apply: &inputs,
        frames: [frames.first().copied().unwrap_or(0), frames.last().map_or(0, |last| last + 1)],
        written: 0,
        skipped: (frames.len() - todo.len()) as u64,
        finished: false,
    };
    write_manifest(args, &manifest)?;
    files.remove_temporaries(&todo.iter().map(|&index| number(index)).collect::<Vec<_>>());
    write_camera(folder, spec).or_failed()?;
    write_table(args, set, &files)?;

    let begin = std::time::Instant::now();
    let watch = interrupt::watch();
    let rendered = render(args, spec, set, vignette, &todo, files.clone(), &watch, console);
    // Rows list the existing frames, from any run.
    let table_written = write_table(args, set, &files);
    manifest.written = todo.iter().filter(|&&index| files.exist(number(index))).count() as u64;
    manifest.finished = rendered.is_ok() && !(watch.is_asked() && manifest.written < todo.len() as u64);
    write_manifest(args, &manifest)?;
    let no_source = rendered?;
    table_written?;
    if !manifest.finished {
        let done = manifest.written + manifest.skipped;
        let resume_command = console.command_with("--resume");
        return Err(Failure::interrupted(anyhow!(
            "{done} of {} frames are in {}; to resume: {resume_command}",
            frames.len(),
            folder.display()
        )));
    }
    let (elapsed_s, skipped) = (begin.elapsed().as_secs_f64(), manifest.skipped);
    let skipped = if skipped > 0 { format!(" ({skipped} existed)") } else { String::new() };
    console.note(format_args!("{} frames{skipped} in {elapsed_s:.2} s in {}", todo.len(), folder.display()));
    if set.left_out() > 0 {
        console.warn(format_args!(
            "{} colour images have no depth image near their time and are skipped",
            set.left_out()
        ));
    }
    let pixels = f64::from(spec.size_px[0]) * f64::from(spec.size_px[1]) * todo.len() as f64;
    warn_no_source(&no_source, pixels, console);
    Ok(())
}

fn chosen(args: &ApplyArgs, set: &FrameSet) -> Result<Vec<u64>, Failure> {
    let count = set.entries().len() as u64;
    let Some(list) = &args.frames else { return Ok((0..count).collect()) };
    list.resolve(count).map_err(|error| match error {
        FrameListError::Outside { frame, .. } => Failure::bad_input(anyhow!(
            "--frames: frame {frame} does not exist, {} names frames 0 to {}",
            args.frame.display(),
            count - 1
        )),
        error => Failure::bad_input(error),
    })
}

/// First and last instant of a frame relative to its stamp.
fn window_s(args: &ApplyArgs, spec: &CameraSpec, set: &FrameSet) -> Result<[f64; 2], Failure> {
    let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px)
        .map_err(|error| in_file(args, &error.into()))
        .or_bad_input()?;
    let (first_s, last_s) = shutter.window_s();
    Ok([first_s.min(set.instant_s()), last_s.max(set.instant_s())])
}

/// Warns of frames within gaps of the trajectory.
pub(super) fn warn_of_gaps(
    args: &ApplyArgs,
    spec: &CameraSpec,
    set: &FrameSet,
    frames: &[u64],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let [first_s, last_s] = window_s(args, spec, set)?;
    let mut steps = Vec::new();
    for &frame in frames {
        let step_s = set.motion(frame as usize).or_bad_input()?.longest_step_s(first_s, last_s);
        steps.extend((step_s > GAP_S).then_some((frame, step_s)));
    }
    if let Some((frame, _)) = steps.first() {
        let longest_s = steps.iter().fold(0.0_f64, |longest, (_, step_s)| longest.max(*step_s));
        console.warn(format_args!(
            "{}: {} of {} frames, first frame {frame}, are in gaps of the trajectory of up to {longest_s:.1} \
             s, which are interpolated by a straight line and a constant rotation",
            args.frame.display(),
            steps.len(),
            frames.len()
        ));
    }
    Ok(())
}

/// Checks that the window of every frame is within the trajectory.
fn check_motion(args: &ApplyArgs, spec: &CameraSpec, set: &FrameSet, frames: &[u64]) -> Result<(), Failure> {
    let [first_s, last_s] = window_s(args, spec, set)?;
    let mut covered = Vec::new();
    let mut missing = None;
    for &frame in frames {
        match set.motion(frame as usize).or_bad_input()?.covers(first_s, last_s) {
            Ok(()) => covered.push(frame),
            Err(error) => missing = missing.or(Some((frame, error))),
        }
    }
    let Some((frame, error)) = missing else { return Ok(()) };
    let covers = match (covered.first(), covered.last()) {
        (Some(first), Some(last)) => format!("it covers --frames {first}..={last}"),
        _ => "it covers none of the frames; both must be on one clock".to_owned(),
    };
    let bad = frames.len() - covered.len();
    let frames = frames.len();
    Err(Failure::bad_input(anyhow!(
        "{}: {bad} of {frames} frames, first frame {frame}: {error}; {covers}",
        args.frame.display()
    )))
}

fn inputs(args: &ApplyArgs, spec: &CameraSpec, set: &FrameSet) -> Result<ApplyInputs, Failure> {
    let folder = &args.output;
    // There are too many images to read their contents.
    let text =
        |path: &Path| format!("{} ({})", relative_to(path, folder).display(), inputs::size_and_mtime(path));
    let mut camera = spec.clone();
    let lens_table = camera.lens_table.as_mut().map(|table| &mut table.path);
    let kernel = camera.point_spread.as_mut().and_then(|spread| spread.kernel.as_mut());
    let kernel = kernel.map(|file| &mut file.path);
    let paths = [camera.photometric.vignette.as_mut(), camera.zoom_track.as_mut(), lens_table, kernel];
    for path in paths.into_iter().flatten() {
        *path = relative_to(path, folder);
    }
    let files = inputs::file_fingerprints(
        set.motion_file()
            .into_iter()
            .chain(spec.photometric.vignette.as_deref())
            .chain(spec.point_spread.iter().filter_map(|spread| Some(spread.kernel.as_ref()?.path.as_path())))
            .map(Path::to_owned)
            .collect(),
    );
    let picture = |entry: &FrameEntry| {
        let stamp = entry.stamp_ns.map_or("no stamp".to_owned(), |stamp_ns| format!("{stamp_ns} ns"));
        format!(
            "{}, {}, {stamp}",
            text(&entry.color),
            entry.depth.as_deref().map_or("no depth".to_owned(), text)
        )
    };
    Ok(ApplyInputs {
        camera,
        frame_toml: std::fs::read_to_string(&args.frame).or_bad_input()?,
        preset: format!("{:?}", args.preset).to_lowercase(),
        solver: args.solver.map(|solver| format!("{solver:?}").to_lowercase()),
        blur_samples: args.blur_samples,
        seed: args.seed,
        frame_number: args.frame_number,
        files: portable_inputs(&files, folder),
        pictures: set
            .entries()
            .iter()
            .enumerate()
            .map(|(index, entry)| (format!("{index:06}"), picture(entry)))
            .collect(),
    })
}

fn output_spec(args: &ApplyArgs, set: &FrameSet) -> OutputSpec {
    let mut format = Vec::new();
    for wanted in &args.format {
        let image = match wanted {
            ImageFormatArg::Exr => ImageFormat::Exr,
            ImageFormatArg::Png => ImageFormat::Png,
        };
        if !format.contains(&image) {
            format.push(image);
        }
    }
    if format.is_empty() {
        format.push(ImageFormat::Exr);
    }
    let has_depth = set.entries().iter().any(|entry| entry.depth.is_some());
    let depth = has_depth.then_some(Channel::Depth);
    OutputSpec {
        channels: [Channel::Color, Channel::Valid].into_iter().chain(depth).collect(),
        format,
        ..OutputSpec::default()
    }
}

fn write_manifest(args: &ApplyArgs, manifest: &ApplyManifest<'_>) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(manifest).or_failed()? + "\n";
    write_atomic(&args.output.join("run.json"), text.as_bytes()).or_failed()
}

/// Writes `frames.csv` for all existing frames.
fn write_table(args: &ApplyArgs, set: &FrameSet, files: &FrameFiles) -> Result<(), Failure> {
    let _lock = Lock::take(&args.output)?;
    let there: Vec<u64> = (0..set.entries().len() as u64)
        .filter(|&index| files.exist(args.frame_number.saturating_add(index)))
        .collect();
    write_atomic(&frames_path(&args.output), &frames_csv(args, set, files, &there)?).or_failed()
}

/// Columns `frame,stamp_ns,from_color,from_depth`, then the files of each frame; empty if there is none.
fn frames_csv(
    args: &ApplyArgs,
    set: &FrameSet,
    files: &FrameFiles,
    frames: &[u64],
) -> Result<Vec<u8>, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let (columns, names) = (["frame", "stamp_ns", "from_color", "from_depth"], files.names(0));
    writer
        .write_record(columns.into_iter().chain(names.iter().map(|(column, _)| column.as_str())))
        .or_failed()?;
    let relative = |path: &Path| relative_to(path, &args.output).display().to_string();
    for &index in frames {
        let Some(entry) = set.entries().get(index as usize) else { continue };
        let number = args.frame_number.saturating_add(index);
        let names = files.names(number);
        let own = [
            number.to_string(),
            entry.stamp_ns.map(|stamp_ns| stamp_ns.to_string()).unwrap_or_default(),
            relative(&entry.color),
            entry.depth.as_deref().map(relative).unwrap_or_default(),
        ];
        writer.write_record(own.into_iter().chain(names.into_iter().map(|(_, name)| name))).or_failed()?;
    }
    writer.into_inner().map_err(|error| anyhow!("frames.csv: {error}")).or_failed()
}

fn render(
    args: &ApplyArgs,
    spec: &CameraSpec,
    set: &FrameSet,
    vignette: Option<&GrayImage>,
    todo: &[u64],
    files: FrameFiles,
    watch: &Watch,
    console: &mut Console<'_>,
) -> Result<NoSourceCounts, Failure> {
    // A frame is rendered on all cores, while another thread writes.
    let mut writer = FrameWriter::new(files, 1);
    let bar = frames_bar(todo.len() as u64, console.is_quiet());
    let mut no_source = NoSourceCounts::default();
    let mut printed_kinds = Vec::new();
    for &index in todo {
        if watch.is_asked() {
            break;
        }
        let file = read(args, set, index as usize, console)?;
        for note in &file.notes {
            // One note of each kind is enough; others differ by file and number only.
            let (file, what) = note.split_once(": ").unwrap_or(("", note));
            let kind =
                what.split(|letter: char| letter.is_ascii_digit()).next().unwrap_or_default().to_owned();
            if !printed_kinds.contains(&kind) {
                console.warn(format_args!("{file}: {what} (similar notes are not shown)"));
                printed_kinds.push(kind);
            }
        }
        let settings = settings(args, &file, index);
        let pipeline = Pipeline::new(spec, &file.frame, &file.motion, &settings)
            .map_err(|error| in_file(args, &error))
            .or_bad_input()?;
        let (picture, counts) = pipeline.render_and_count(vignette);
        no_source += counts;
        writer.write(picture).or_failed()?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    writer.finish().or_failed()?;
    Ok(no_source)
}
