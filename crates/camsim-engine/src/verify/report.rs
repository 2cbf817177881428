//! What a verification finds, frame by frame; `camsim verify --json` prints it.

use camsim_core::{
    reference::{CoverageErrors, ErrorStats, ErrorVerdict, FlowErrors, PlaneErrors, TruthErrors},
    scenario::{Channel, Check},
};
use camsim_plan::{LevelOfDetail, Predicted};
use serde::Serialize;

/// Errors of all frames.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyReport {
    /// What rendered them.
    pub adapter: String,
    /// `quality.max_error_px`.
    pub tolerance_px: f64,
    /// `quality.max_error_dn`.
    pub tolerance_dn: f64,
    /// Whether every frame keeps the tolerances: `quality.max_error_px`, and with pictures
    /// `quality.max_error_dn`.
    pub kept: bool,
    /// Frame by frame; of several faces, face by face.
    pub frames: Vec<FrameReport>,
}

/// Errors of a frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    /// Its number.
    pub frame: u64,
    /// The face that was measured, where a wide field is divided among several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face: Option<&'static str>,
    /// What the plan predicts.
    pub predicted: Predicted,
    /// Errors of sources.
    pub measured: Measured,
    /// Errors of depths and points, as fractions of the depth; `None` for solvers that compute sources without exact
    /// depths.
    pub truth: Option<Kept<TruthErrors>>,
    /// Errors of the channels that the scenario asks for, and that have a value in each pixel.
    pub planes: Vec<PlaneReport>,
    /// Of its flows, of motion and of blur paths.
    pub flows: Vec<FlowReport>,
    /// Of its coverage.
    pub coverage: Option<Kept<CoverageErrors>>,
    /// Level of detail of the terrain.
    pub level_of_detail: Option<LevelOfDetail>,
    /// Whether the frame's 99th percentile is within the tolerance.
    pub kept: bool,
    /// Whether the frame's 99th percentile is within the prediction.
    pub as_predicted: bool,
    /// Errors of the picture, if they were asked for.
    pub picture: Option<PictureReport>,
    /// Causes of picture error that are not predicted.
    pub not_in_the_picture: Vec<String>,
}

impl FrameReport {
    /// Whether it keeps every tolerance.
    #[must_use]
    pub fn keeps_all(&self) -> bool {
        self.kept && self.picture.as_ref().is_none_or(|picture| picture.kept) && self.keeps_truth()
    }

    /// Whether depths, points and other channels belong to surfaces near the pixels' rays.
    #[must_use]
    pub fn keeps_truth(&self) -> bool {
        self.truth.as_ref().is_none_or(|truth| truth.kept)
            && self.planes.iter().all(|plane| plane.kept)
            && self.flows.iter().all(|flow| flow.kept)
            && self.coverage.as_ref().is_none_or(|coverage| coverage.kept)
    }

    /// Whether the source error exceeds the prediction; false without a measured error.
    #[must_use]
    pub fn is_more_than_predicted(&self) -> bool {
        !self.as_predicted && self.measured.judged_by != JudgedBy::Nothing
    }
}

/// Errors, and whether no fault is among them: every value is that of a surface near its pixel's ray.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Kept<T> {
    /// Whether no value is faulty.
    pub kept: bool,
    /// The errors; JSON has `null` for those that are not finite.
    #[serde(flatten)]
    pub errors: T,
}

/// Errors of sources, in pixels of the ideal frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Measured {
    /// Pixels away from silhouettes.
    pub smooth: ErrorStats,
    /// Pixels at silhouettes.
    pub silhouettes: ErrorStats,
    /// All pixels.
    pub all: ErrorStats,
    /// Pixels whose 99th percentile is compared with the tolerance.
    pub judged_by: JudgedBy,
    /// Pixels with a source in the frame only.
    pub falsely_valid: u64,
    /// Pixels with a source in the reference only.
    pub missing: u64,
    /// Disoccluded fraction of the picture.
    pub disocclusion_fraction: f64,
}

/// Pixels that a frame is judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum JudgedBy {
    /// Those away from silhouettes.
    Smooth,
    /// All, because hardly any pixel is away from silhouettes.
    All,
    /// None, because too many are falsely valid or missing.
    Nothing,
}

impl From<ErrorVerdict> for JudgedBy {
    fn from(verdict: ErrorVerdict) -> Self {
        match verdict {
            ErrorVerdict::Smooth(_) => Self::Smooth,
            ErrorVerdict::Everywhere(_) => Self::All,
            ErrorVerdict::Void => Self::Nothing,
        }
    }
}

/// Errors of a truth channel. `p99` and `max` are `null` where one side alone is sky.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlaneReport {
    /// The channel.
    pub channel: Channel,
    /// Whether every value belongs to a surface near the pixel's ray.
    pub kept: bool,
    /// Number of pixels that are valid in both.
    pub pixels: u64,
    /// Number of those that are not beside a border between objects.
    pub pixels_away: u64,
    /// Number of wrong values: of a range by 0.1 %, of a normal by 0.1 degrees.
    pub beyond: u64,
    /// Number of those that are not beside a border between objects.
    pub beyond_away: u64,
    /// Number of those that belong to no surface near the pixel's ray.
    pub faults: u64,
    /// 99th percentile; of ranges relative, of normals in degrees, absent for numbers.
    pub p99: Option<f64>,
    /// The largest.
    pub max: Option<f64>,
}

impl From<PlaneErrors> for PlaneReport {
    fn from(errors: PlaneErrors) -> Self {
        let size = |error: f64| match errors.channel.facts().check {
            Check::Exact => None,
            Check::Direction => error.is_finite().then(|| error.to_degrees()),
            _ => error.is_finite().then_some(error),
        };
        Self {
            channel: errors.channel,
            kept: errors.faults == 0,
            pixels: errors.pixels,
            pixels_away: errors.pixels_away,
            beyond: errors.beyond,
            beyond_away: errors.beyond_away,
            faults: errors.faults,
            p99: size(errors.p99),
            max: size(errors.max),
        }
    }
}

/// Errors of a flow, of motion or of a blur path.
#[derive(Clone, Debug, Serialize)]
pub struct FlowReport {
    /// The channel.
    pub channel: Channel,
    /// Whether every value is that of a surface near the pixel's ray.
    pub kept: bool,
    /// Errors in pixels, of motion in pixels a second; JSON has `null` for those that are no numbers.
    #[serde(flatten)]
    pub errors: FlowErrors,
}

/// PSNR in dB on linear values, peak 1; `null` without pixels or without a difference.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PictureReport {
    /// RMS error of the picture in DN, which `quality.max_error_dn` bounds.
    pub rms_dn: f64,
    /// What the plan predicts of it.
    pub predicted_dn: f64,
    /// Whether `rms_dn` is within the tolerance.
    pub kept: bool,
    /// All pixels.
    pub psnr_db: Option<f64>,
    /// Pixels away from silhouettes.
    pub smooth_psnr_db: Option<f64>,
    /// Pixels at silhouettes.
    pub silhouettes_psnr_db: Option<f64>,
    /// Largest difference.
    pub max: f64,
}
