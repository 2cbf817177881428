//! Twins that layouts need: found among those of the run, or added to a scenario.

use camsim_core::scenario::{Channel, FlowInstant, TwinShutter, TwinSpec};

use super::DatasetError;
use super::run_folder::RunCamera;

/// What a twin has to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TwinNeed {
    /// The frame without distortion.
    Pinhole,
    /// The frame without motion blur.
    Sharp,
    /// All pixels at the time of the first row.
    GlobalFirst,
    /// All pixels at the time of the image's centre.
    GlobalMiddle,
}

impl TwinNeed {
    /// Whether a twin is that; it may lack other properties of the frame, too.
    pub(crate) fn fits(self, twin: &TwinSpec) -> bool {
        let is_single = twin.instants.is_none();
        let instant = twin.instant.unwrap_or_default();
        is_single
            && match self {
                Self::Pinhole => twin.lens == Some(false) && !twin.is_global() && !twin.is_sharp(),
                Self::Sharp => twin.is_sharp() && !twin.is_global() && twin.lens != Some(false),
                Self::GlobalFirst => twin.is_global() && !twin.ideal && instant == FlowInstant::FirstRow,
                Self::GlobalMiddle => twin.is_global() && !twin.ideal && instant == FlowInstant::Centre,
            }
    }

    /// The twin that is added to a scenario.
    pub(crate) fn spec(self, channels: &[Channel]) -> TwinSpec {
        let base = TwinSpec {
            name: self.name().to_owned(),
            channels: Some(channels.to_vec()),
            ..TwinSpec::default()
        };
        let global = Some(TwinShutter::Global);
        match self {
            Self::Pinhole => TwinSpec { lens: Some(false), ..base },
            Self::Sharp => TwinSpec { exposure: Some(false), ..base },
            Self::GlobalFirst => TwinSpec { shutter: global, instant: Some(FlowInstant::FirstRow), ..base },
            Self::GlobalMiddle => TwinSpec { shutter: global, ..base },
        }
    }

    /// Its name, if it is added.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Sharp => "sharp",
            Self::GlobalFirst => "global_first",
            Self::GlobalMiddle => "global_middle",
        }
    }

    /// Its lines in a scenario.
    fn keys(self) -> &'static str {
        match self {
            Self::Pinhole => "lens = false",
            Self::Sharp => "exposure = false",
            Self::GlobalFirst => "shutter = \"global\", instant = \"first-row\"",
            Self::GlobalMiddle => "shutter = \"global\"",
        }
    }

    /// The pictures of this twin.
    pub(crate) fn open(self, format: &str, camera: &RunCamera) -> Result<RunCamera, DatasetError> {
        match camera.twins().iter().find(|twin| self.fits(twin)) {
            Some(twin) => camera.twin(twin),
            None => Err(DatasetError::Missing(format!(
                "{format} needs a twin of the frames that {} lacks: add [[output.twin]] with name = \"{}\", {} and \
                 render again, or export the scenario itself, which renders what is needed",
                camera.folder.display(),
                self.name(),
                self.keys()
            ))),
        }
    }
}

/// Pairs of frames and pictures of a twin with the same number.
pub(crate) fn partners<'a>(
    frames: &'a RunCamera,
    twin: &'a RunCamera,
) -> impl Iterator<Item = (&'a super::RunFrame, &'a super::RunFrame)> {
    let mut rest = twin.frames.iter().peekable();
    frames.frames.iter().filter_map(move |frame| {
        while rest.next_if(|partner| partner.number < frame.number).is_some() {}
        rest.peek().filter(|partner| partner.number == frame.number).map(|partner| (frame, *partner))
    })
}
