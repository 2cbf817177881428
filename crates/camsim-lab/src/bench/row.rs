//! A row of the table.

use camsim_core::reference::CoordErrors;
use camsim_plan::FramePlan;
use serde::Serialize;

use super::{methods::MethodFamily, rounds::Times, truth::PictureErrors};

/// One row of the table: a case with a method. The first twelve fields are stable.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// `default` or `paper`.
    pub preset: &'static str,
    /// Output width.
    pub width: u32,
    /// Output height.
    pub height: u32,
    /// Milliseconds a frame, median of the rounds.
    pub ms_per_frame_p50: f64,
    /// Milliseconds a frame, 99th percentile of the rounds.
    pub ms_per_frame_p99: f64,
    /// Processor milliseconds a frame over all threads, median; null where it is not known.
    pub cpu_ms_per_frame: Option<f64>,
    /// RMS source error, px; null if not measured.
    pub coord_rms_px: Option<f64>,
    /// 99th percentile of the source error, px.
    pub coord_p99_px: Option<f64>,
    /// Largest source error, px.
    pub coord_max_px: Option<f64>,
    /// PSNR of linear values with peak 1 against the reference picture.
    pub psnr_db: Option<f64>,
    /// Predicted source error, px.
    pub predicted_px: Option<f64>,
    /// Name of the method: what is forced, or `auto` and the tolerance.
    pub knob: String,
    /// Name of a row above with the same plans in every frame, whose times and errors are repeated here; null
    /// without one.
    pub same_as: Option<String>,
    /// Kind of method.
    #[serde(skip)]
    pub family: MethodFamily,
    /// Group of the case.
    pub group: &'static str,
    /// Time over that of the case's default row in the same round: quartiles.
    pub time_to_default: Option<[f64; 3]>,
    /// PSNR within 3 px of silhouettes; null without silhouettes.
    pub edge_psnr_db: Option<f64>,
    /// RMS source error away from silhouettes, px.
    pub smooth_rms_px: Option<f64>,
    /// 99th percentile of the source error away from silhouettes, px, which `predicted_px` bounds.
    pub smooth_p99_px: Option<f64>,
    /// Fraction of the compared pixels within 3 px of a silhouette.
    pub edge_fraction: Option<f64>,
    /// Numbers of pixels compared: coordinates, picture.
    pub compared: [u64; 2],
    /// Number of valid pixels that have no source in the reference.
    pub falsely_valid: u64,
    /// Number of invalid pixels that have a source in the reference.
    pub missing: u64,
    /// Whether the row is on the Pareto front of time and RMS source error.
    pub coord_front: bool,
    /// Whether the row is on the Pareto front of time and PSNR.
    pub image_front: bool,
    /// Time to open the session and render its first frame, seconds.
    pub start_s: f64,
    /// Number of rounds.
    pub rounds: usize,
    /// Passes of the plan, in words.
    pub passes: Vec<String>,
    /// Times of every round.
    #[serde(skip)]
    pub times: Times,
    /// Median milliseconds a frame on the renderers of [`super::Options::compared`]; `None` without an
    /// adapter.
    #[serde(skip)]
    pub compared_ms: Vec<Option<f64>>,
}

impl Row {
    /// A row without measurements.
    pub(super) fn empty(case: &str, [width, height]: [u32; 2]) -> Self {
        let [ms_per_frame_p50, ms_per_frame_p99] = [f64::NAN; 2];
        let case = case.to_owned();
        Self { case, preset: "default", width, height, ms_per_frame_p50, ms_per_frame_p99, ..Self::default() }
    }

    pub(super) fn set_times(&mut self, times: &Times, default: Option<&Times>) {
        [self.ms_per_frame_p50, self.ms_per_frame_p99] = times.p50_p99_ms();
        self.cpu_ms_per_frame = times.processor_p50_ms();
        self.time_to_default = default.map(|default| times.ratio_quartiles(default));
        self.start_s = times.start_s;
        self.rounds = times.wall_ms.len();
        self.times = times.clone();
    }

    pub(super) fn set_plan(&mut self, plan: &FramePlan) {
        self.predicted_px = Some(plan.predicted.total_px);
        self.passes = plan.passes();
    }

    pub(super) fn set_coord_errors(&mut self, coords: &CoordErrors) {
        self.coord_rms_px = Some(coords.all.rms_px);
        self.coord_p99_px = Some(coords.all.p99_px);
        self.coord_max_px = Some(coords.all.max_px);
        // Without a pixel away from silhouettes there is no such error.
        let smooth = Some(coords.smooth).filter(|smooth| smooth.count > 0);
        self.smooth_rms_px = smooth.map(|smooth| smooth.rms_px);
        self.smooth_p99_px = smooth.map(|smooth| smooth.p99_px);
        self.edge_fraction = Some(coords.silhouettes.count as f64 / coords.all.count.max(1) as f64);
        (self.falsely_valid, self.missing) = (coords.falsely_valid, coords.missing);
        self.compared[0] = coords.all.count;
    }

    pub(super) fn set_picture_errors(&mut self, errors: &PictureErrors) {
        self.psnr_db = errors.psnr_db;
        self.edge_psnr_db = errors.edge_psnr_db;
        self.compared[1] = errors.pixels;
    }
}

/// A method that this version cannot render.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// Name of the case.
    pub case: String,
    /// Name of the method.
    pub knob: String,
    /// Reason.
    pub reason: String,
}
