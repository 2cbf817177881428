//! A sequence through a renderer into an output folder.

use std::{
    ops::ControlFlow,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use anyhow::anyhow;
use camsim_core::{frame::RenderedFrame, plan::Planner, scenario::Scenario, sequence::Sequence, shutter::Shutter, trajectory::Trajectory};
use camsim_gpu::engine::Finished;
use camsim_io::{
    inputs,
    manifest::{ResumeError, RunManifest, check_resume, check_resume_of, in_shard},
    write::{FrameFiles, FrameRecord, FrameWriter, TrajectoryRecord, WriteError, camera_toml, frames_csv, trajectory_csv, write_atomic},
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::Shard,
    frame_source::FrameSource,
    progress::{frames_bar, waiting},
    tolerances::{Rings, Tolerances},
};

/// What to render and where to.
#[derive(Debug)]
pub struct Job<'a> {
    /// The loaded sequence.
    pub sequence: &'a Arc<Sequence>,
    /// Output folder.
    pub folder: &'a Path,
    /// Frames of all shards, ascending.
    pub frames: &'a [u64],
    /// Which of them are this run's.
    pub shard: Option<Shard>,
    /// Whether frames that are there already stay.
    pub resume: bool,
    /// Said while loading; kept in `run.json`.
    pub warnings: &'a [String],
}

/// What a run did.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Frames rendered.
    pub frames: u64,
    /// Frames that were there already.
    pub skipped: u64,
    /// Bytes of frame files.
    pub bytes: u64,
    /// From the first submission until the last file was written.
    pub time: Duration,
    /// Before that: what it took to plan the first of them.
    pub first_plan: Duration,
}

impl Outcome {
    /// Frames a second; 0 if there was nothing to do.
    #[must_use]
    pub fn frames_per_s(&self) -> f64 {
        if self.frames == 0 { 0.0 } else { self.frames as f64 / self.time.as_secs_f64().max(1e-9) }
    }
}

/// Renders; `look` sees each finished frame before it is written, and can stop the run: frames that are written then stay, and `run.json` says
/// that it is not finished.
pub fn run(
    job: &Job<'_>,
    source: &mut dyn FrameSource,
    console: &mut Console<'_>,
    look: &mut dyn FnMut(&Finished) -> ControlFlow<()>,
) -> Result<Outcome, Failure> {
    let scenario = &job.sequence.scenario;
    let files = FrameFiles::new(job.folder, &scenario.output, scenario.camera.photometric.output);
    let inputs = inputs::of_scenario(scenario);
    let adapter = source.adapter();
    check_folder(job, &inputs, &adapter, console)?;
    let mine: Vec<u64> = job.frames.iter().copied().filter(|&frame| job.shard.is_none_or(|shard| in_shard(frame, shard.0))).collect();
    let todo: Vec<u64> = mine.iter().copied().filter(|&frame| !(job.resume && files.exist(frame))).collect();
    // What cannot be planned is refused before anything is written.
    let begin = Instant::now();
    if let Some(&first) = todo.first() {
        let waiting = waiting("planning the first frame", console.is_quiet());
        let planned = source.planner().plan(first);
        waiting.finish_and_clear();
        planned.or_bad_input()?;
    }
    let first_plan = begin.elapsed();
    let mut manifest = RunManifest {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        adapter,
        seed: scenario.seed,
        scenario: scenario.clone(),
        inputs,
        frames: [job.frames.first().copied().unwrap_or(0), job.frames.last().map_or(0, |last| last + 1)],
        shard: job.shard.map(|shard| shard.0),
        written: 0,
        skipped: (mine.len() - todo.len()) as u64,
        finished: false,
        warnings: job.warnings.to_vec(),
    };
    manifest.write(job.folder).or_failed()?;
    files.sweep(&todo);
    write_tables(job, &files, source.planner())?;

    let writes_frames = !scenario.output.format.is_empty();
    let writer = writes_frames.then(|| FrameWriter::new(files, threads()));
    let (mut blind, mut empty, mut rings) = (0_u64, 0_u64, Rings::default());
    let mut tolerances = Tolerances::new(&scenario.quality);
    let bar = frames_bar(todo.len() as u64, console.is_quiet());
    let begin = Instant::now();
    let rendered = source.render(&todo, &mut |finished| {
        if look(&finished).is_break() {
            return Err(WriteError::Stopped);
        }
        blind += u64::from(finished.plan.motion.nearest_m.is_infinite());
        empty += u64::from(is_empty(&finished.frame));
        rings.add(finished.plan.frame, finished.out_of_order);
        tolerances.iter_mut().for_each(|tolerances| tolerances.add(&finished.plan));
        bar.inc(1);
        writer.as_ref().map_or(Ok(()), |writer| writer.write(finished.frame))
    });
    bar.finish_and_clear();
    rendered?;
    let unseen = unseen_warnings(blind, empty, todo.len()).chain(rings.warning(todo.len()));
    let said: Vec<String> = unseen.chain(tolerances.iter().flat_map(Tolerances::warnings)).collect();
    said.iter().for_each(|warning| console.warn(warning));
    manifest.warnings.extend(said);
    let bytes = writer.map(FrameWriter::finish).transpose().or_failed()?.map_or(0, |summary| summary.bytes);
    let time = begin.elapsed();

    manifest.written = todo.len() as u64;
    manifest.finished = true;
    manifest.write(job.folder).or_failed()?;
    Ok(Outcome { frames: manifest.written, skipped: manifest.skipped, bytes, time, first_plan })
}

/// Of frames that see only sky, and of those without a valid pixel.
fn unseen_warnings(blind: u64, empty: u64, frames: usize) -> impl Iterator<Item = String> {
    let blind = (blind > 0).then(|| {
        format!("{blind} of {frames} frames see no surface, only sky: check camera.mount, flight.height and where the scene lies")
    });
    let empty = (empty > 0).then(|| {
        format!(
            "{empty} of {frames} frames have no valid pixel: no ray of the camera's is in the ideal frame, or the lens has none; check \
             camera.principal_point_px and camera.focal_px against camera.size_px, and see `camsim explain`"
        )
    });
    blind.into_iter().chain(empty)
}

/// Whether nothing of a frame's colour is valid; a frame without colour is not known to be empty.
fn is_empty(frame: &RenderedFrame) -> bool {
    !frame.color_rgba.is_empty() && frame.color_rgba.chunks_exact(4).all(|pixel| pixel[3] <= 0.0)
}

/// Frames of another scenario are never taken for this one's; without `--resume` they are only worth a warning.
fn check_folder(job: &Job<'_>, inputs: &inputs::Inputs, adapter: &str, console: &mut Console<'_>) -> Result<(), Failure> {
    match check_resume(job.folder, &job.sequence.scenario, inputs) {
        Err(error) if job.resume => Err(Failure::bad_input(error)),
        Err(ResumeError::Differs { path, made, .. }) => {
            console.warn(format_args!("{} was made {made}: files of the same name are replaced, others stay", path.display()));
            Ok(())
        }
        Ok(true) if job.resume => {
            if let Err(ResumeError::Differs { path, .. }) = check_resume_of(job.folder, "adapter", "by another adapter", &adapter) {
                console.warn(format_args!(
                    "{} was made by another adapter than {adapter}: frames that are there stay, and differ from what this one would make by what rounding does",
                    path.display()
                ));
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Rows of `trajectory.csv`: seven hours at 400 Hz, 3 GB.
const MOST_TRAJECTORY_ROWS: f64 = 10e6;

/// `camera.toml`, `trajectory.csv` and `frames.csv`.
fn write_tables(job: &Job<'_>, files: &FrameFiles, planner: &Planner) -> Result<(), Failure> {
    let sequence = job.sequence;
    let camera = camera_toml(&sequence.scenario.camera).or_failed()?;
    write_atomic(&job.folder.join("camera.toml"), camera.as_bytes()).or_failed()?;
    let seen_s = planner.stamp_s(sequence.frames - 1) - planner.stamp_s(0);
    let rows = seen_s * sequence.scenario.tracker.rate_hz;
    if rows > MOST_TRAJECTORY_ROWS {
        return Err(Failure::bad_input(anyhow!(
            "trajectory.csv would have {rows:.0} rows, more than {MOST_TRAJECTORY_ROWS:.0}: make flight.window_s shorter or tracker.rate_hz lower"
        )));
    }
    let trajectory = trajectory_csv(trajectory_records(sequence, planner).or_bad_input()?);
    write_atomic(&job.folder.join("trajectory.csv"), trajectory.as_bytes()).or_failed()?;
    // A resumed folder may hold frames beyond those asked for now.
    let kept = (0..sequence.frames).filter(|&frame| job.frames.binary_search(&frame).is_ok() || (job.resume && files.exist(frame)));
    let records: Vec<FrameRecord> = kept.map(|frame| frame_record(sequence, files, planner, frame)).collect();
    write_atomic(&job.folder.join("frames.csv"), frames_csv(&records).as_bytes()).or_failed()
}

fn frame_record(sequence: &Sequence, files: &FrameFiles, planner: &Planner, frame: u64) -> FrameRecord {
    let stamp_s = planner.stamp_s(frame);
    let pose = sequence.path.pose(stamp_s);
    FrameRecord {
        frame,
        stamp_ns: log_ns(sequence.epoch_ns, stamp_s),
        position_ned_m: pose.position_ned_m,
        ned_from_camera: pose.ned_from_camera,
        files: files.names(frame),
    }
}

/// The motion at control ticks, from the first to the last instant that any frame sees.
fn trajectory_records(
    sequence: &Sequence,
    planner: &Planner,
) -> Result<impl Iterator<Item = TrajectoryRecord>, camsim_core::shutter::ShutterError> {
    let Scenario { camera, tracker, .. } = &sequence.scenario;
    let (first_s, last_s) = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?.window_s();
    let seen_s = [planner.stamp_s(0) + first_s, planner.stamp_s(sequence.frames - 1) + last_s];
    Ok(motion(&sequence.path.trajectory, sequence.epoch_ns, tracker.rate_hz, seen_s))
}

/// States at `start + k / rate_hz` that enclose `seen_s`; outside of the log the platform coasts.
pub fn motion(trajectory: &Trajectory, epoch_ns: i64, rate_hz: f64, seen_s: [f64; 2]) -> impl Iterator<Item = TrajectoryRecord> + use<'_> {
    let start_s = trajectory.span_s().0;
    let tick = |t_s: f64| (t_s - start_s) * rate_hz;
    let (first, last) = ((tick(seen_s[0]) + 1e-6).floor() as i64, (tick(seen_s[1]) - 1e-6).ceil() as i64);
    (first..=last).map(move |k| {
        let t_s = start_s + k as f64 / rate_hz;
        TrajectoryRecord { t_ns: log_ns(epoch_ns, t_s), state: trajectory.state(t_s) }
    })
}

/// Path time to the log's clock, nanoseconds.
fn log_ns(epoch_ns: i64, t_s: f64) -> i64 {
    epoch_ns.saturating_add((t_s * 1e9).round() as i64)
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
