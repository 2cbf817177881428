//! Renders a sequence into an output folder.

use std::{
    collections::BTreeMap,
    ops::ControlFlow,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use anyhow::anyhow;
use camsim_core::{geodesy::LocalFrame, sensors::Sensors, sequence::Sequence};
use camsim_engine::Finished;
use camsim_io::{
    load::TrackInputs,
    manifest::{RunManifest, in_shard},
    portable::write_camera,
    scenario_file::VariationRecord,
    write::{FrameWriter, SourceFrame, WriteError},
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::Shard,
    frame_source::FrameSource,
    interrupt,
    progress::frames_bar,
};

mod findings;
mod folder;
mod outcome;
mod pictures;
mod planning;
mod rig;
mod tables;
mod tracks;

use findings::Findings;
use folder::FolderState;
pub use folder::{Lock, refuse_others, refuse_unknown};
pub use outcome::Outcome;
use pictures::{JobPictures, Pictures, Series};
use planning::plan_first;
#[cfg(feature = "viewer")]
pub use rig::resume_command;
pub use rig::{RigFolder, Selected};
pub use tables::{body_at, camera_at, source_frame};
use tracks::JobTracks;

/// A rendering job.
#[derive(Debug)]
pub struct Job<'a> {
    /// Name of the camera, if it is one of several.
    pub camera: Option<&'a str>,
    /// The loaded sequence.
    pub sequence: &'a Arc<Sequence>,
    /// Where on Earth its local frame lies, if that is known.
    pub earth: Option<LocalFrame>,
    /// Which variation of a random scenario it is.
    pub variation: Option<&'a VariationRecord>,
    /// Output folder.
    pub folder: &'a Path,
    /// Frames of all shards, in ascending order.
    pub frames: &'a [u64],
    /// Frames of this run's shard.
    pub shard: Option<Shard>,
    /// Points of `[output.tracks]` that files and keys give, whose pixels in the frames are written. Twins have
    /// no tracks.
    pub tracks: &'a TrackInputs,
    /// Sensors beside the camera.
    pub sensors: Option<&'a Sensors>,
    /// Whether existing frames are kept.
    pub resume: bool,
    /// Warnings of loading, stored in `run.json`.
    pub warnings: &'a [String],
    /// Command that resumes the run, for the message after an interruption.
    pub resume_command: &'a str,
}

impl Job<'_> {
    /// The first frame of all shards, and one past the last.
    fn frame_range(&self) -> [u64; 2] {
        [self.frames.first().copied().unwrap_or(0), self.frames.last().map_or(0, |last| last + 1)]
    }
}

/// What a finished picture is passed to before it is written, with the names of its camera and its twin
/// ([`Pictures::label`]); it can stop the run.
pub type OnFrame<'f> = dyn FnMut(Option<&str>, &Finished) -> ControlFlow<()> + 'f;

/// Renders a job, or one for each camera of a rig. `source` is that of the first. `on_frame` receives each
/// finished frame before it is written and can stop the run, as Ctrl-C can. Written frames are kept then, the
/// tables list them, and `run.json` marks the run as unfinished.
pub fn run(
    jobs: &[Job<'_>],
    rig: Option<&RigFolder<'_>>,
    source: &mut dyn FrameSource,
    console: &mut Console<'_>,
    on_frame: &mut OnFrame<'_>,
) -> Result<Outcome, Failure> {
    let pictures: Vec<JobPictures> = jobs.iter().map(JobPictures::new).collect::<Result<_, _>>()?;
    let adapter = source.adapter();
    match rig {
        Some(rig) => rig.check()?,
        None => jobs.iter().try_for_each(rig::refuse_rig)?,
    }
    for (job, pictures) in jobs.iter().zip(&pictures) {
        pictures.all().try_for_each(|pictures| folder::check(job, pictures, &adapter, console))?;
    }
    for (job, pictures) in jobs.iter().zip(&pictures) {
        pictures.all().try_for_each(|pictures| check_videos(job, pictures))?;
    }
    let mut outcome = Outcome { cameras: rig.map_or(0, |_| jobs.len() as u64), ..Outcome::default() };
    // Planning errors are reported before anything is written.
    for (i, (job, pictures)) in jobs.iter().zip(&pictures).enumerate() {
        for pictures in pictures.all() {
            let is_planned = i == 0 && pictures.twin.is_none();
            let time = plan_first(job, pictures, is_planned, source, console)?;
            outcome.first_plan += if pictures.twin.is_none() { time } else { Duration::ZERO };
        }
    }
    let inputs = rig::all_inputs(pictures.iter().map(|pictures| &pictures.frames));
    for (i, (job, pictures)) in jobs.iter().zip(&pictures).enumerate() {
        if i > 0 {
            source.renew(job.sequence)?;
        }
        console.set_camera(job.camera);
        let tracks = JobTracks::new(job, source.scene_planner(), console)?;
        if i == 0 {
            rig.map_or(Ok(()), |rig| rig.write_begin(jobs, &inputs, &adapter, console))?;
        }
        let mut run = Run { job, tracks, console, on_frame, outcome: &mut outcome };
        run.render_all(pictures, source)?;
    }
    console.set_camera(None);
    if let Some(rig) = rig {
        rig.write_end(jobs, &inputs, &adapter)?;
        outcome.bytes += tables::motion_bytes(rig.folder);
    }
    Ok(outcome)
}

/// Frames of this run's shard that arrive.
fn shard_frames(job: &Job<'_>) -> Vec<u64> {
    let is_ours = |frame: &u64| job.shard.is_none_or(|shard| in_shard(*frame, shard.0));
    let arrives = |frame: &u64| job.sequence.arrives(*frame);
    job.frames.iter().copied().filter(is_ours).filter(arrives).collect()
}

/// Frames of which a run renders the picture of a series.
fn todo(job: &Job<'_>, series: &Series) -> Vec<u64> {
    let ours = shard_frames(job);
    let is_missing = |frame: &u64| !(job.resume && series.files.exist(*frame));
    // A video is made of all frames.
    if series.files.has_video() && ours.iter().any(is_missing) {
        return ours;
    }
    ours.into_iter().filter(is_missing).collect()
}

/// Refuses videos that cannot be made, before anything is written.
fn check_videos(job: &Job<'_>, pictures: &Pictures) -> Result<(), Failure> {
    pictures.series.iter().try_for_each(|series| {
        let fps = series.sequence.scenario.camera.fps;
        series.files.check_videos(fps, &todo(job, series)).or_bad_input()
    })
}

/// A run at work.
struct Run<'r, 'j, 'c, 'f> {
    job: &'r Job<'j>,
    /// Tracks in the frames.
    tracks: Option<JobTracks<'r>>,
    console: &'r mut Console<'c>,
    on_frame: &'r mut OnFrame<'f>,
    outcome: &'r mut Outcome,
}

/// What is collected over the pictures of a folder.
struct Collected {
    made: BTreeMap<(u64, Option<u32>), SourceFrame>,
    findings: Findings,
    manifest: RunManifest,
}

impl Run<'_, '_, '_, '_> {
    /// Renders the frames of a job and their twins.
    fn render_all(&mut self, pictures: &JobPictures, source: &mut dyn FrameSource) -> Result<(), Failure> {
        let JobPictures { frames, twins } = pictures;
        let mut manifest = self.render(frames, twins.is_empty(), source)?;
        for twin in twins {
            self.render(twin, true, source)?;
        }
        if !twins.is_empty() {
            manifest.finished = true;
            manifest.write(self.job.folder).or_failed()?;
        }
        Ok(())
    }

    /// Renders the pictures of a folder; they complete the run if `is_all`.
    fn render(
        &mut self,
        pictures: &Pictures,
        is_all: bool,
        source: &mut dyn FrameSource,
    ) -> Result<RunManifest, Failure> {
        let job = self.job;
        let frames = shard_frames(job).len() * pictures.series.len();
        let todo: Vec<Vec<u64>> = pictures.series.iter().map(|series| todo(job, series)).collect();
        let mut manifest = manifest(job, pictures, source.adapter());
        manifest.skipped = (frames - todo.iter().map(Vec::len).sum::<usize>()) as u64;
        let tracks = tracks_of(&self.tracks, pictures);
        manifest.tracked_points = tracks.map(JobTracks::points);
        manifest.warnings.extend(tracks.into_iter().flat_map(JobTracks::notes).cloned());
        prepare(job, pictures, &todo, &manifest, tracks, self.console)?;
        self.outcome.bytes += if pictures.twin.is_none() { tables::motion_bytes(job.folder) } else { 0 };
        let findings = Findings::new(&pictures.sequence.scenario.quality);
        let mut collected = Collected { made: BTreeMap::new(), findings, manifest };
        let last = pictures.series.len() - 1;
        for (i, (series, todo)) in pictures.series.iter().zip(&todo).enumerate() {
            if pictures.twin.is_some() {
                source.renew(&series.sequence)?;
            }
            let completes = (i == last).then_some(is_all);
            self.render_series(pictures, series, todo, completes, source, &mut collected)?;
        }
        let manifest = collected.manifest;
        match pictures.twin {
            None => {
                self.outcome.frames += manifest.written;
                self.outcome.skipped += manifest.skipped;
            }
            Some(_) => self.outcome.twins += manifest.written,
        }
        Ok(manifest)
    }

    /// Renders one picture of each frame. `completes` is given for the last ones in the folder: whether the run
    /// is finished by them.
    // Long because: what was rendered has to be on disk and in the tables however the run ends.
    fn render_series(
        &mut self,
        pictures: &Pictures,
        series: &Series,
        todo: &[u64],
        completes: Option<bool>,
        source: &mut dyn FrameSource,
        collected: &mut Collected,
    ) -> Result<(), Failure> {
        let writes_frames = !series.sequence.scenario.output.format.is_empty();
        let start = || {
            FrameWriter::new(series.files.clone(), threads())
                .with_videos(series.sequence.scenario.camera.fps, todo)
        };
        let mut writer = writes_frames.then(start).transpose().or_bad_input()?;
        let bar = frames_bar(todo.len() as u64, self.console.is_quiet());
        bar.set_message(label(pictures, series));
        let name = pictures.label();
        let begin = Instant::now();
        let watch = interrupt::watch();
        let Collected { made, findings, manifest } = collected;
        let tracks = tracks_of(&self.tracks, pictures);
        let rendered = source.render(todo, &mut |finished| {
            if (self.on_frame)(name.as_deref(), &finished).is_break() {
                return Err(WriteError::Stopped);
            }
            findings.add(&finished);
            let key = (finished.plan.frame, series.files.instant());
            made.insert(key, source_frame(&series.sequence, &finished.plan));
            bar.inc(1);
            tracks.map_or(Ok(()), |tracks| tracks.write(finished.plan.frame))?;
            writer.as_mut().map_or(Ok(()), |writer| writer.write(finished.frame))?;
            if watch.is_asked() { Err(WriteError::Stopped) } else { Ok(()) }
        });
        bar.finish_and_clear();
        // All rendered frames are on disk before messages about them.
        let written = writer.map(FrameWriter::finish).transpose().or_failed();
        let is_stopped = rendered.is_err() && watch.is_asked();
        drop(watch);
        self.outcome.time += begin.elapsed();
        let is_ok = rendered.is_ok() && written.is_ok();
        if completes.is_some() && rendered.is_ok() {
            manifest.warnings.extend(warn(self.console, pictures, findings));
        }
        manifest.written = pictures
            .series
            .iter()
            .map(|series| {
                let files = &series.files;
                let here = made.keys().filter(|(_, instant)| *instant == files.instant());
                here.filter(|(frame, _)| !writes_frames || files.exist(*frame)).count() as u64
            })
            .sum();
        manifest.finished = is_ok && completes == Some(true);
        let tables_written = finish(self.job, pictures, series, made, manifest, tracks, source);
        if is_stopped && written.is_ok() {
            tables_written?;
            return Err(self.interrupted(pictures, manifest.written));
        }
        rendered?;
        self.outcome.bytes += written?.map_or(0, |summary| summary.bytes);
        tables_written
    }

    /// The message after an interruption.
    fn interrupted(&self, pictures: &Pictures, written: u64) -> Failure {
        let frames = shard_frames(self.job);
        let done = if pictures.sequence.scenario.output.format.is_empty() {
            written
        } else {
            let done = |series: &Series| frames.iter().filter(|&&frame| series.files.exist(frame)).count();
            pictures.series.iter().map(done).sum::<usize>() as u64
        };
        let (all, folder) = (frames.len() * pictures.series.len(), pictures.folder.display());
        let what = if pictures.has_instants() { "pictures" } else { "frames" };
        Failure::interrupted(anyhow!(
            "{done} of {all} {what} are in {folder}; to resume: {}",
            self.job.resume_command
        ))
    }
}

/// The tracks that are written beside these pictures.
fn tracks_of<'t, 'r>(tracks: &'t Option<JobTracks<'r>>, pictures: &Pictures) -> Option<&'t JobTracks<'r>> {
    tracks.as_ref().filter(|_| pictures.twin.is_none())
}

/// Prints what was found, and returns it for `run.json`.
fn warn(console: &mut Console<'_>, pictures: &Pictures, findings: &Findings) -> Vec<String> {
    let of_camera = pictures.camera.as_ref().map_or_else(String::new, |name| format!("camera {name}: "));
    let of_twin = pictures.name().map_or_else(String::new, |name| format!("twin {name}: "));
    let of = of_camera + &of_twin;
    let warnings: Vec<String> =
        findings.warnings().map(|warning| console.whole(&format!("{of}{warning}"))).collect();
    warnings.iter().for_each(|warning| console.warn(warning));
    warnings
}

/// What is in front of a progress bar.
fn label(pictures: &Pictures, series: &Series) -> String {
    match (pictures.label(), series.files.instant()) {
        (None, _) => String::new(),
        (Some(name), None) => format!("{name} "),
        (Some(name), Some(k)) => format!("{name} {} of {} ", k + 1, pictures.series.len()),
    }
}

/// `run.json` before the first picture.
fn manifest(job: &Job<'_>, pictures: &Pictures, adapter: String) -> RunManifest {
    let scenario = &pictures.sequence.scenario;
    RunManifest {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        adapter,
        seed: scenario.seed,
        paths: String::new(),
        variation: job.variation.cloned(),
        twin: pictures.twin.clone(),
        scenario: scenario.clone(),
        inputs: pictures.inputs.clone(),
        frames: job.frame_range(),
        shard: job.shard.map(|shard| shard.0),
        written: 0,
        skipped: 0,
        finished: false,
        tracked_points: None,
        warnings: job.warnings.to_vec(),
    }
}

/// Writes the files before the first frame. Frames of another scenario are removed from the folder.
fn prepare(
    job: &Job<'_>,
    pictures: &Pictures,
    todo: &[Vec<u64>],
    manifest: &RunManifest,
    tracks: Option<&JobTracks<'_>>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let _lock = Lock::take(&pictures.folder)?;
    // Checked again under the lock.
    let folder_state = folder::folder_state(job, pictures)?;
    tracks::check_folder(&pictures.folder, tracks.is_some())?;
    for (series, todo) in pictures.series.iter().zip(todo) {
        if folder_state == FolderState::Replaced {
            series.files.remove(job.frames).or_failed()?;
        }
        series.files.remove_temporaries(todo);
    }
    if folder_state == FolderState::Replaced {
        tables::remove_objects(&pictures.folder)?;
        tables::remove_timing(&pictures.folder)?;
        tracks::remove(&pictures.folder)?;
    }
    manifest.write(&pictures.folder).or_failed()?;
    match pictures.twin {
        None => tables::write_fixed(job, console)?,
        Some(_) => write_camera(&pictures.folder, &pictures.sequence.scenario.camera).or_failed()?,
    }
    tables::write_objects(pictures)?;
    tracks.map_or(Ok(()), JobTracks::begin)?;
    tables::begin_frames(pictures, folder_state == FolderState::Ours)
}

/// Writes the files after the last frame.
fn finish(
    job: &Job<'_>,
    pictures: &Pictures,
    series: &Series,
    made: &BTreeMap<(u64, Option<u32>), SourceFrame>,
    manifest: &RunManifest,
    tracks: Option<&JobTracks<'_>>,
    source: &dyn FrameSource,
) -> Result<(), Failure> {
    let _lock = Lock::take(&pictures.folder)?;
    let frames = tables::end_frames(pictures, series, source.planner(), made)?;
    tracks.map_or(Ok(()), |tracks| tracks.finish(&frames))?;
    if pictures.twin.is_none() {
        tables::complete_trajectories(job)?;
    }
    manifest.write(&pictures.folder).or_failed()
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
