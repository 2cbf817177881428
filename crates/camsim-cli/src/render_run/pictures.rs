//! What a run renders into which folder: the frames, and each twin of them.

use std::{path::PathBuf, sync::Arc};

use camsim_core::{geodesy::LocalFrame, scenario::TwinSpec, sequence::Sequence};
use camsim_io::{
    inputs::{self, Inputs},
    manifest::TwinRecord,
    write::{FrameFiles, unlisted_frame_files},
};

use super::{Job, folder::files_of};
use crate::failure::{Failure, OrFail};

/// Pictures that belong into one folder.
#[derive(Debug)]
pub struct Pictures {
    /// Name of the camera, if it is one of several.
    pub camera: Option<String>,
    /// The folder.
    pub folder: PathBuf,
    /// The twin that they are; `None` for the frames.
    pub twin: Option<TwinRecord>,
    /// The sequence of `run.json`.
    pub sequence: Arc<Sequence>,
    /// Where on Earth its local frame lies, if that is known.
    pub earth: Option<LocalFrame>,
    /// Fingerprints of the files that its scenario names.
    pub inputs: Inputs,
    /// Series of pictures: one, or one for each instant of a burst.
    pub series: Vec<Series>,
}

/// What a job renders: the frames, then their twins one after the other.
#[derive(Debug)]
pub struct JobPictures {
    /// The frames.
    pub frames: Pictures,
    /// Each twin of them.
    pub twins: Vec<Pictures>,
}

impl JobPictures {
    /// Those of a job.
    pub fn new(job: &Job<'_>) -> Result<Self, Failure> {
        let twins = job.sequence.scenario.output.twin.iter();
        let twins = twins.map(|twin| Pictures::of_twin(job, twin)).collect::<Result<_, _>>()?;
        Ok(Self { frames: Pictures::of_frames(job), twins })
    }

    /// The frames and their twins.
    pub fn all(&self) -> impl Iterator<Item = &Pictures> {
        std::iter::once(&self.frames).chain(&self.twins)
    }
}

/// One picture of each frame.
#[derive(Debug)]
pub struct Series {
    /// The sequence whose frames they are.
    pub sequence: Arc<Sequence>,
    /// Their files.
    pub files: FrameFiles,
}

impl Pictures {
    /// The frames of a job.
    pub fn of_frames(job: &Job<'_>) -> Self {
        let sequence = job.sequence.clone();
        let files = files_of(&sequence.scenario, job.folder);
        Self {
            camera: job.camera.map(str::to_owned),
            folder: job.folder.into(),
            twin: None,
            earth: job.earth,
            inputs: inputs::scenario_fingerprints(&sequence.scenario),
            series: vec![Series { sequence: sequence.clone(), files }],
            sequence,
        }
    }

    /// A twin of the frames.
    pub fn of_twin(job: &Job<'_>, twin: &TwinSpec) -> Result<Self, Failure> {
        let folder = job.folder.join(&twin.name);
        let derived = |instant| job.sequence.twin(twin, instant).map(Arc::new).or_bad_input();
        let sequence = derived(None)?;
        let mut series = Vec::new();
        for instant in twin.instants() {
            let sequence = derived(instant)?;
            let files = files_of(&sequence.scenario, &folder).of_instant(instant);
            series.push(Series { sequence, files });
        }
        let inputs = inputs::scenario_fingerprints(&sequence.scenario);
        let camera = job.camera.map(str::to_owned);
        let twin = Some(TwinRecord::new(twin));
        Ok(Self { camera, folder, twin, sequence, earth: job.earth, inputs, series })
    }

    /// Name of the twin.
    pub fn name(&self) -> Option<&str> {
        self.twin.as_ref().map(|twin| twin.name.as_str())
    }

    /// Names of camera and twin, `left/sharp`; `None` for the frames of the only camera.
    pub fn label(&self) -> Option<String> {
        let parts: Vec<&str> = self.camera.as_deref().into_iter().chain(self.name()).collect();
        (!parts.is_empty()).then(|| parts.join("/"))
    }

    /// Whether they are bursts.
    pub fn has_instants(&self) -> bool {
        self.twin.as_ref().is_some_and(|twin| twin.instants.is_some())
    }

    /// Whether any file of these frames exists completely.
    pub fn any_exists(&self, frames: &[u64]) -> bool {
        self.series.iter().any(|series| frames.iter().any(|&frame| series.files.exist(frame)))
    }

    /// Files in the folder of other frames, or of other pictures of their bursts.
    pub fn files_of_others(&self, frames: &[u64]) -> Vec<String> {
        let listed: Vec<String> = self.series.iter().flat_map(|series| series.files.paths(frames)).collect();
        unlisted_frame_files(&self.folder, &listed)
    }
}
