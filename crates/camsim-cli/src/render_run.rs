//! Renders a sequence into an output folder.

use std::{
    collections::BTreeMap,
    ops::ControlFlow,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use anyhow::anyhow;
use camsim_core::{frame::RenderedFrame, sequence::Sequence};
use camsim_engine::Finished;
use camsim_io::{
    inputs,
    load::TrackInputs,
    manifest::{RunManifest, in_shard},
    write::{FrameFiles, FrameWriter, WriteError},
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::Shard,
    frame_source::FrameSource,
    interrupt,
    progress::{frames_bar, waiting},
    tolerances::{OverlapCycles, Tolerances},
};

mod folder;
mod tables;
mod tracks;

use folder::FolderState;
pub use folder::{Lock, refuse_others, refuse_unknown};
pub use tables::{body_at, camera_at, source_frame};
use tracks::JobTracks;

/// A rendering job.
#[derive(Debug)]
pub struct Job<'a> {
    /// The loaded sequence.
    pub sequence: &'a Arc<Sequence>,
    /// Output folder.
    pub folder: &'a Path,
    /// Frames of all shards, in ascending order.
    pub frames: &'a [u64],
    /// Frames of this run's shard.
    pub shard: Option<Shard>,
    /// Points of `[output.tracks]` that files and keys give.
    pub tracks: &'a TrackInputs,
    /// Whether existing frames are kept.
    pub resume: bool,
    /// Warnings of loading, stored in `run.json`.
    pub warnings: &'a [String],
    /// Command that resumes the run, for the message after an interruption.
    pub resume_command: &'a str,
}

/// Result of a run.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Frames rendered.
    pub frames: u64,
    /// Frames that existed already.
    pub skipped: u64,
    /// Bytes of frame files.
    pub bytes: u64,
    /// From the first submission until the last file was written.
    pub time: Duration,
    /// Time of planning the first frame, before that.
    pub first_plan: Duration,
}

impl Outcome {
    /// Frames per second; 0 if there was nothing to do.
    #[must_use]
    pub fn frames_per_s(&self) -> f64 {
        if self.frames == 0 { 0.0 } else { self.frames as f64 / self.time.as_secs_f64().max(1e-9) }
    }
}

/// Renders a job. `on_frame` receives each finished frame before it is written and can stop the run, as
/// Ctrl-C can. Written frames are kept then, the tables list them, and `run.json` marks the run as
/// unfinished.
pub fn run(
    job: &Job<'_>,
    source: &mut dyn FrameSource,
    console: &mut Console<'_>,
    on_frame: &mut dyn FnMut(&Finished) -> ControlFlow<()>,
) -> Result<Outcome, Failure> {
    let scenario = &job.sequence.scenario;
    let files = folder::files_of(scenario, job.folder);
    let inputs = inputs::scenario_fingerprints(scenario);
    let adapter = source.adapter();
    folder::check(job, &files, &inputs, &adapter, console)?;
    let shard_frames: Vec<u64> = job
        .frames
        .iter()
        .copied()
        .filter(|&frame| job.shard.is_none_or(|shard| in_shard(frame, shard.0)))
        .collect();
    let todo: Vec<u64> =
        shard_frames.iter().copied().filter(|&frame| !(job.resume && files.exist(frame))).collect();
    // Planning errors are reported before anything is written.
    let begin = Instant::now();
    if let Some(&first) = todo.first() {
        let waiting = waiting("planning the first frame", console.is_quiet());
        let planned = source.planner().plan(first);
        waiting.finish_and_clear();
        planned.or_bad_input()?;
    }
    let first_plan = begin.elapsed();
    let tracks = JobTracks::new(job, source.planner(), console)?;
    let mut manifest = RunManifest {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        adapter,
        seed: scenario.seed,
        paths: String::new(),
        scenario: scenario.clone(),
        inputs,
        frames: [job.frames.first().copied().unwrap_or(0), job.frames.last().map_or(0, |last| last + 1)],
        shard: job.shard.map(|shard| shard.0),
        written: 0,
        skipped: (shard_frames.len() - todo.len()) as u64,
        finished: false,
        tracked_points: tracks.as_ref().map(JobTracks::points),
        warnings: job.warnings.to_vec(),
    };
    manifest.warnings.extend(tracks.iter().flat_map(|tracks| tracks.notes().iter().cloned()));
    prepare(job, &files, &todo, &manifest, tracks.as_ref(), source, console)?;

    let writes_frames = !scenario.output.format.is_empty();
    let writer = writes_frames.then(|| FrameWriter::new(files.clone(), threads()));
    let (mut sky_only, mut empty, mut cycles) = (0_u64, 0_u64, OverlapCycles::default());
    let mut tolerances = Tolerances::new(&scenario.quality);
    let mut made = BTreeMap::new();
    let bar = frames_bar(todo.len() as u64, console.is_quiet());
    let begin = Instant::now();
    let watch = interrupt::watch();
    let rendered = source.render(&todo, &mut |finished| {
        if on_frame(&finished).is_break() {
            return Err(WriteError::Stopped);
        }
        sky_only += u64::from(finished.plan.motion.nearest_m.is_infinite());
        empty += u64::from(is_empty(&finished.frame));
        cycles.add(finished.plan.frame, finished.out_of_order);
        tolerances.iter_mut().for_each(|tolerances| tolerances.add(&finished.plan));
        made.insert(finished.plan.frame, source_frame(job.sequence, &finished.plan));
        bar.inc(1);
        tracks.as_ref().map_or(Ok(()), |tracks| tracks.write(finished.plan.frame))?;
        writer.as_ref().map_or(Ok(()), |writer| writer.write(finished.frame))?;
        if watch.is_asked() { Err(WriteError::Stopped) } else { Ok(()) }
    });
    bar.finish_and_clear();
    // All rendered frames are on disk before messages about them.
    let written = writer.map(FrameWriter::finish).transpose().or_failed();
    let is_stopped = rendered.is_err() && watch.is_asked();
    drop(watch);
    let time = begin.elapsed();
    let run_warnings: Vec<String> = if rendered.is_ok() {
        let warnings = validity_warnings(sky_only, empty, todo.len()).chain(cycles.warning(todo.len()));
        warnings
            .chain(tolerances.iter().flat_map(Tolerances::warnings))
            .map(|warning| console.whole(&warning))
            .collect()
    } else {
        Vec::new()
    };
    run_warnings.iter().for_each(|warning| console.warn(warning));
    manifest.warnings.extend(run_warnings);
    manifest.written = made.keys().filter(|&&frame| !writes_frames || files.exist(frame)).count() as u64;
    manifest.finished = rendered.is_ok() && written.is_ok();
    let tables_written = finish(job, &files, &made, &manifest, tracks.as_ref(), source);
    if is_stopped && written.is_ok() {
        tables_written?;
        let done = if writes_frames {
            shard_frames.iter().filter(|&&frame| files.exist(frame)).count() as u64
        } else {
            manifest.written
        };
        let folder = job.folder.display();
        return Err(Failure::interrupted(anyhow!(
            "{done} of {} frames are in {folder}; to resume: {}",
            shard_frames.len(),
            job.resume_command
        )));
    }
    rendered?;
    let bytes = written?.map_or(0, |summary| summary.bytes);
    tables_written?;
    Ok(Outcome { frames: manifest.written, skipped: manifest.skipped, bytes, time, first_plan })
}

/// Writes the files before the first frame. Frames of another scenario are removed from the folder.
fn prepare(
    job: &Job<'_>,
    files: &FrameFiles,
    todo: &[u64],
    manifest: &RunManifest,
    tracks: Option<&JobTracks<'_>>,
    source: &mut dyn FrameSource,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let _lock = Lock::take(job.folder)?;
    // Checked again under the lock.
    let folder_state = folder::folder_state(job, files, &manifest.inputs)?;
    tracks::check_folder(job, tracks.is_some())?;
    if folder_state == FolderState::Replaced {
        files.remove(job.frames).or_failed()?;
        tables::remove_objects(job.folder)?;
        tracks::remove(job)?;
    }
    manifest.write(job.folder).or_failed()?;
    files.remove_temporaries(todo);
    tables::write_fixed(job, source.planner(), console)?;
    tracks.map_or(Ok(()), JobTracks::begin)?;
    tables::begin_frames(job, folder_state == FolderState::Ours)
}

/// Writes the files after the last frame.
fn finish(
    job: &Job<'_>,
    files: &FrameFiles,
    made: &BTreeMap<u64, camsim_io::write::SourceFrame>,
    manifest: &RunManifest,
    tracks: Option<&JobTracks<'_>>,
    source: &mut dyn FrameSource,
) -> Result<(), Failure> {
    let _lock = Lock::take(job.folder)?;
    let frames = tables::end_frames(job, files, source.planner(), made)?;
    tracks.map_or(Ok(()), |tracks| tracks.finish(&frames))?;
    manifest.write(job.folder).or_failed()
}

/// Warns of frames that see only sky, and of frames without a valid pixel.
fn validity_warnings(sky_only: u64, empty: u64, frames: usize) -> impl Iterator<Item = String> {
    let sky_only = (sky_only > 0).then(|| {
        format!(
            "{sky_only} of {frames} frames see only sky: check camera.mount, flight.height and the position \
                 of the scene"
        )
    });
    let empty = (empty > 0).then(|| {
        format!(
            "{empty} of {frames} frames have no valid pixel: no ray of the camera is within the ideal frame, \
             or the lens has none; check camera.principal_point_px and camera.focal_px against \
             camera.size_px, and see `camsim explain SCENARIO.toml`"
        )
    });
    sky_only.into_iter().chain(empty)
}

/// Whether no pixel of a frame's colour is valid; false for a frame without colour.
fn is_empty(frame: &RenderedFrame) -> bool {
    !frame.color_rgba.is_empty() && frame.color_rgba.chunks_exact(4).all(|pixel| pixel[3] <= 0.0)
}

/// Command that renders the missing frames of a folder's scenario.
#[cfg(feature = "viewer")]
pub fn resume_command(folder: &Path) -> String {
    use crate::console::quoted;

    format!(
        "camsim render {} -o {} --resume",
        quoted(folder.join("run.json").as_os_str()),
        quoted(folder.as_os_str())
    )
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
