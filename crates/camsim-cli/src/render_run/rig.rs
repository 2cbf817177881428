//! The folder of a rig, which has a folder for each camera.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::anyhow;
use camsim_core::{scenario::Rig, sequence::Sequence};
use camsim_io::{
    inputs::Inputs,
    load::Loaded,
    manifest::{RigManifest, is_finished},
    scenario_file::VariationRecord,
    write::{RIG_TOML, rig_names, unlisted_frame_files, write_rig, write_sensors},
};

use super::{Job, Lock, OnFrame, Outcome, Pictures, Shard, run, tables};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_source::FrameSource,
};

/// A run of cameras of a scenario: of the only one, or of some of a rig.
#[derive(Debug)]
pub struct Selected<'a> {
    /// The cameras of the scenario.
    pub rig: &'a Rig,
    /// Each of them, loaded.
    pub loaded: &'a [Loaded],
    /// Output folder.
    pub folder: &'a Path,
    /// Numbers of the cameras that are rendered; at least one.
    pub cameras: Vec<usize>,
    /// Frames of each of these, in ascending order.
    pub frames: Vec<Vec<u64>>,
    /// Frames of this run's shard.
    pub shard: Option<Shard>,
    /// Whether existing frames are kept.
    pub resume: bool,
    /// Command that resumes the run.
    pub resume_command: String,
    /// Which variation of a random scenario it is.
    pub variation: Option<VariationRecord>,
}

impl Selected<'_> {
    /// The sequence of the first camera that is rendered.
    #[must_use]
    pub fn first(&self) -> &Arc<Sequence> {
        &self.loaded[self.cameras[0]].sequence
    }

    /// Renders the frames; `source` is that of [`Self::first`]. Otherwise as [`run`].
    pub fn run(
        &self,
        source: &mut dyn FrameSource,
        console: &mut Console<'_>,
        on_frame: &mut OnFrame<'_>,
    ) -> Result<Outcome, Failure> {
        let Self { rig, loaded, folder, shard, .. } = *self;
        let variation = self.variation.as_ref();
        let rig_folder = RigFolder { rig, loaded, folder, shard, variation };
        let name = |camera: usize| rig.is_list().then(|| &*loaded[camera].sequence.scenario.camera.name);
        let folders: Vec<PathBuf> = self
            .cameras
            .iter()
            .map(|&camera| name(camera).map_or_else(|| folder.into(), |name| rig_folder.of_camera(name)))
            .collect();
        let parts = self.cameras.iter().zip(&folders).zip(&self.frames);
        let jobs: Vec<Job<'_>> = parts
            .map(|((&camera, folder), frames)| {
                let Loaded { sequence, log, tracks, sensors, warnings, .. } = &loaded[camera];
                Job {
                    camera: name(camera),
                    sequence,
                    earth: log.frame,
                    tracks,
                    // Those of a rig are in its own folder.
                    sensors: (!rig.is_list()).then_some(sensors),
                    variation,
                    folder,
                    frames,
                    shard,
                    resume: self.resume,
                    warnings,
                    resume_command: &self.resume_command,
                }
            })
            .collect();
        run(&jobs, rig.is_list().then_some(&rig_folder), source, console, on_frame)
    }
}

/// Folder of a run with `[[cameras]]`.
#[derive(Debug)]
pub struct RigFolder<'a> {
    /// The cameras.
    pub rig: &'a Rig,
    /// Each of them, loaded.
    pub loaded: &'a [Loaded],
    /// The folder.
    pub folder: &'a Path,
    /// Frames of this run's shard.
    pub shard: Option<Shard>,
    /// Which variation of a random scenario it is.
    pub variation: Option<&'a VariationRecord>,
}

impl RigFolder<'_> {
    /// Folder of a camera's frames.
    pub fn of_camera(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Refuses a folder with frames that belong to no camera of the rig.
    pub fn check(&self) -> Result<(), Failure> {
        let folder = self.folder.display();
        if !unlisted_frame_files(self.folder, &[]).is_empty() {
            return Err(Failure::bad_input(anyhow!(
                "{folder} has frames of a scenario with one camera: choose another folder with -o, or remove that one"
            )));
        }
        let is_gone = |name: &String| {
            self.rig.position(name).is_none() && !unlisted_frame_files(&self.of_camera(name), &[]).is_empty()
        };
        match rig_names(self.folder).into_iter().find(is_gone) {
            Some(name) => Err(Failure::bad_input(anyhow!(
                "{folder} has frames of a camera {name}, which the scenario lacks: choose another folder with -o, or \
                 remove that of {name}"
            ))),
            None => Ok(()),
        }
    }

    /// Writes the files before the first frame.
    pub fn write_begin(
        &self,
        jobs: &[Job<'_>],
        inputs: &Inputs,
        adapter: &str,
        console: &mut Console<'_>,
    ) -> Result<(), Failure> {
        let _lock = Lock::take(self.folder)?;
        write_rig(self.folder, self.rig).or_failed()?;
        self.write_platform(jobs)?;
        if let Some(loaded) = self.loaded.first() {
            write_sensors(self.folder, &loaded.sensors).or_failed()?;
        }
        tables::tell_size(self.folder, console);
        self.write_run(jobs, inputs, adapter, false)
    }

    /// Writes the files after the last frame.
    pub fn write_end(&self, jobs: &[Job<'_>], inputs: &Inputs, adapter: &str) -> Result<(), Failure> {
        let _lock = Lock::take(self.folder)?;
        if jobs.iter().any(tables::has_others) {
            self.write_platform(jobs)?;
        }
        let finished = self.rig.names().all(|name| is_finished(&self.of_camera(name)));
        self.write_run(jobs, inputs, adapter, finished)
    }

    /// Writes the trajectory for the frames of these and of earlier runs.
    fn write_platform(&self, jobs: &[Job<'_>]) -> Result<(), Failure> {
        let of_camera = |loaded: &'_ Loaded| {
            let name = &loaded.sequence.scenario.camera.name;
            let job = jobs.iter().find(|job| job.camera == Some(name));
            let frames = job.map_or(&[][..], |job| job.frames);
            let has_sensors = !loaded.sensors.is_empty();
            tables::covered_frames(&loaded.sequence, frames, &self.of_camera(name), has_sensors)
        };
        let covered: Vec<_> =
            self.loaded.iter().map(|loaded| (&*loaded.sequence, of_camera(loaded))).collect();
        tables::write_platform(self.folder, &covered)
    }

    fn write_run(
        &self,
        jobs: &[Job<'_>],
        inputs: &Inputs,
        adapter: &str,
        finished: bool,
    ) -> Result<(), Failure> {
        let frames = jobs.iter().filter_map(|job| Some((job.camera?.to_owned(), job.frame_range())));
        let manifest = RigManifest {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            adapter: adapter.to_owned(),
            variation: self.variation.cloned(),
            rig: self.rig,
            inputs: inputs.clone(),
            frames: frames.collect(),
            shard: self.shard.map(|shard| shard.0),
            finished,
        };
        manifest.write(self.folder).or_failed()
    }
}

/// Refuses the folder of a rig for the frames of one camera.
pub fn refuse_rig(job: &Job<'_>) -> Result<(), Failure> {
    if rig_names(job.folder).is_empty() {
        return Ok(());
    }
    Err(Failure::bad_input(anyhow!(
        "{} has the cameras of a rig ({RIG_TOML}): choose another folder with -o, or remove that one",
        job.folder.display()
    )))
}

/// Fingerprints of the inputs of several runs.
pub fn all_inputs<'p>(pictures: impl Iterator<Item = &'p Pictures>) -> Inputs {
    pictures.flat_map(|pictures| pictures.inputs.clone()).collect()
}

/// Command that renders the missing frames of a folder's scenario.
#[cfg(feature = "viewer")]
pub fn resume_command(folder: &Path) -> String {
    use camsim_io::shell::quoted;

    format!("camsim render {} -o {} --resume", quoted(folder.join("run.json")), quoted(folder))
}
