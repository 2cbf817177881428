//! A point of the table.

use camsim_core::reference::CoordErrors;
use camsim_plan::FramePlan;
use serde::Serialize;

use super::{knobs::Family, rounds::Times, truth::PictureErrors};

/// One point of the table. The first twelve are the stable ones.
#[derive(Clone, Debug, Serialize)]
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
    /// The same, 99th percentile.
    pub ms_per_frame_p99: f64,
    /// Processor milliseconds a frame over all threads, median; null where it is not known.
    pub cpu_ms_per_frame: Option<f64>,
    /// RMS error of the source coordinates, px; null where it was not measured.
    pub coord_rms_px: Option<f64>,
    /// 99th percentile.
    pub coord_p99_px: Option<f64>,
    /// Largest.
    pub coord_max_px: Option<f64>,
    /// Of linear values with peak 1 against the oracle's picture.
    pub psnr_db: Option<f64>,
    /// The plan's own bound on `coord_p99_px`, px.
    pub predicted_px: Option<f64>,
    /// What is forced, or `auto` and the tolerance.
    pub knob: String,
    /// The row of this case whose plans are the same in every frame, so that its times and errors are this
    /// row's too; null if none is above it.
    pub same_as: Option<String>,
    /// What the row varies.
    #[serde(skip)]
    pub family: Family,
    /// Kind of the case.
    pub group: &'static str,
    /// Time over that of the case's default row in the same round: quartiles.
    pub time_to_default: Option<[f64; 3]>,
    /// PSNR of pixels within 3 px of a silhouette; null without silhouettes.
    pub edge_psnr_db: Option<f64>,
    /// RMS of pixels farther than that from any silhouette, px.
    pub smooth_rms_px: Option<f64>,
    /// 99th percentile of the same: what `predicted_px` bounds.
    pub smooth_p99_px: Option<f64>,
    /// Share of the compared pixels within 3 px of a silhouette.
    pub edge_share: Option<f64>,
    /// Pixels compared: coordinates, picture.
    pub compared: [u64; 2],
    /// Pixels with a source that the oracle has none for, and the other way round.
    pub falsely_valid: u64,
    /// See above.
    pub missing: u64,
    /// No row of this case and size has both less time and less coordinate error.
    pub coord_front: bool,
    /// The same with PSNR.
    pub image_front: bool,
    /// Opening the session and its first two frames, seconds.
    pub start_s: f64,
    /// Rounds that the times are of.
    pub rounds: usize,
    /// What the plan does.
    pub passes: Vec<String>,
    /// Each round's times.
    #[serde(skip)]
    pub times: Times,
}

impl Row {
    /// One that nothing is known of.
    pub(super) fn empty(case: &str, [width, height]: [u32; 2]) -> Self {
        Self {
            case: case.to_owned(),
            preset: "default",
            width,
            height,
            ms_per_frame_p50: f64::NAN,
            ms_per_frame_p99: f64::NAN,
            cpu_ms_per_frame: None,
            coord_rms_px: None,
            coord_p99_px: None,
            coord_max_px: None,
            psnr_db: None,
            predicted_px: None,
            knob: String::new(),
            same_as: None,
            family: Family::Tolerance,
            group: "",
            time_to_default: None,
            edge_psnr_db: None,
            smooth_rms_px: None,
            smooth_p99_px: None,
            edge_share: None,
            compared: [0, 0],
            falsely_valid: 0,
            missing: 0,
            coord_front: false,
            image_front: false,
            start_s: 0.0,
            rounds: 0,
            passes: Vec::new(),
            times: Times::default(),
        }
    }

    pub(super) fn set_times(&mut self, times: &Times, default: Option<&Times>) {
        [self.ms_per_frame_p50, self.ms_per_frame_p99] = times.p50_p99_ms();
        self.cpu_ms_per_frame = times.processor_p50_ms();
        self.time_to_default = default.map(|default| times.ratio_to(default));
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
        // No pixel away from silhouettes says nothing of them.
        let smooth = Some(coords.smooth).filter(|smooth| smooth.count > 0);
        self.smooth_rms_px = smooth.map(|smooth| smooth.rms_px);
        self.smooth_p99_px = smooth.map(|smooth| smooth.p99_px);
        self.edge_share = Some(coords.silhouettes.count as f64 / coords.all.count.max(1) as f64);
        (self.falsely_valid, self.missing) = (coords.falsely_valid, coords.missing);
        self.compared[0] = coords.all.count;
    }

    pub(super) fn set_picture_errors(&mut self, errors: &PictureErrors) {
        self.psnr_db = errors.psnr_db;
        self.edge_psnr_db = errors.edge_psnr_db;
        self.compared[1] = errors.pixels;
    }
}

/// A row that this version cannot render.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// The case.
    pub case: String,
    /// The row.
    pub knob: String,
    /// Why.
    pub reason: String,
}
