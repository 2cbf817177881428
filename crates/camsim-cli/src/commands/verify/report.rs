//! What `verify` reports of a frame: as JSON, and the lines about its truth.

use camsim_core::{
    reference::{DEPTH_TOLERANCE, ErrorStats, NORMAL_TOLERANCE_RAD, PlaneErrors, TruthErrors},
    scenario::Channel,
};
use camsim_plan::Predicted;
use serde::Serialize;

use super::planes::Planes;
use crate::commands::explain::LevelOfDetail;

#[derive(Serialize)]
pub struct VerifyReport {
    pub adapter: String,
    pub tolerance_px: f64,
    pub tolerance_dn: f64,
    /// Whether every frame keeps the tolerances: `quality.max_error_px`, and with pictures
    /// `quality.max_error_dn`.
    pub kept: bool,
    pub frames: Vec<Verified>,
}

#[derive(Serialize)]
pub struct Verified {
    pub frame: u64,
    /// The face that was measured, where a wide field is divided among several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face: Option<&'static str>,
    pub predicted: Predicted,
    pub measured: Measured,
    /// Errors of depths and points; `None` for solvers that compute sources without exact depths.
    pub truth: Option<Truth>,
    /// Errors of the channels that the scenario asks for.
    #[serde(flatten)]
    pub planes: Planes,
    /// Level of detail of the terrain.
    pub level_of_detail: Option<LevelOfDetail>,
    /// Whether the frame's 99th percentile is within the tolerance.
    pub kept: bool,
    /// Whether the frame's 99th percentile is within the prediction.
    pub as_predicted: bool,
    pub picture: Option<Picture>,
    /// Causes of picture error that are not predicted.
    pub not_in_the_picture: Vec<String>,
}

#[derive(Serialize)]
pub struct Measured {
    /// Pixels away from silhouettes.
    pub smooth: Figures,
    pub silhouettes: Figures,
    pub all: Figures,
    /// Pixels whose 99th percentile is compared with the tolerance: "smooth", "all" if hardly any pixel is
    /// smooth, or "nothing" if too many are falsely valid or missing.
    pub judged_by: &'static str,
    pub falsely_valid: u64,
    pub missing: u64,
    /// Disoccluded share of the picture.
    pub disocclusion_share: f64,
}

/// Errors are shares of the depth; `null` if sky and surface are confused.
#[derive(Serialize)]
pub struct Truth {
    /// Whether every depth and point belongs to a surface near the pixel's ray.
    pub kept: bool,
    pub pixels: u64,
    /// Number of depths that are off by more than 0.1 %.
    pub depth_beyond: u64,
    /// Number of those that belong to no surface near the pixel's ray.
    pub depth_faults: u64,
    pub depth_max: Option<f64>,
    pub points_beyond: u64,
    pub point_faults: u64,
    pub point_max: Option<f64>,
}

/// Errors of a truth channel. `null` if sky and surface are confused.
#[derive(Serialize)]
pub struct PlaneTruth {
    pub channel: &'static str,
    /// Whether every value belongs to a surface near the pixel's ray.
    pub kept: bool,
    pub pixels: u64,
    /// Number of those that are not beside a border between objects.
    pub pixels_away: u64,
    /// Number of wrong values: of a range by 0.1 %, of a normal by 0.1 degrees.
    pub beyond: u64,
    /// Number of those that are not beside a border between objects.
    pub beyond_away: u64,
    /// Number of those that belong to no surface near the pixel's ray.
    pub faults: u64,
    /// Of ranges relative, of normals in degrees; absent for numbers.
    pub p99: Option<f64>,
    pub max: Option<f64>,
}

impl From<PlaneErrors> for PlaneTruth {
    fn from(errors: PlaneErrors) -> Self {
        let is_normal = matches!(errors.channel, Channel::Normal | Channel::NormalWorld);
        let has_size = is_normal || errors.channel == Channel::Range;
        let size = |error: f64| {
            (has_size && error.is_finite()).then_some(if is_normal { error.to_degrees() } else { error })
        };
        Self {
            channel: errors.channel.name(),
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

impl From<TruthErrors> for Truth {
    fn from(errors: TruthErrors) -> Self {
        let finite = |error: f64| error.is_finite().then_some(error);
        Self {
            kept: errors.is_consistent(),
            pixels: errors.pixels,
            depth_beyond: errors.depth_beyond,
            depth_faults: errors.depth_faults,
            depth_max: finite(errors.depth_max),
            points_beyond: errors.points_beyond,
            point_faults: errors.point_faults,
            point_max: finite(errors.point_max),
        }
    }
}

#[derive(Serialize)]
pub struct Figures {
    pub pixels: u64,
    pub rms_px: f64,
    pub p99_px: f64,
    pub max_px: f64,
}

/// PSNR in dB on linear values, peak 1; `null` without pixels or without a difference.
#[derive(Serialize)]
pub struct Picture {
    /// RMS error of the picture in DN, which `quality.max_error_dn` bounds.
    pub rms_dn: f64,
    pub predicted_dn: f64,
    /// Whether `rms_dn` is within the tolerance.
    pub kept: bool,
    pub psnr_db: Option<f64>,
    pub smooth_psnr_db: Option<f64>,
    pub silhouettes_psnr_db: Option<f64>,
    pub max: f64,
}

impl From<ErrorStats> for Figures {
    fn from(stats: ErrorStats) -> Self {
        Self { pixels: stats.count, rms_px: stats.rms_px, p99_px: stats.p99_px, max_px: stats.max_px }
    }
}

pub fn describe_truth(truth: &Truth) -> String {
    let Truth { kept, pixels, depth_beyond, depth_faults, depth_max, points_beyond, point_faults, point_max } =
        truth;
    let largest = |error: &Option<f64>| {
        error.map_or_else(|| "sky instead of surface".to_owned(), |error| format!("{:.3} %", 100.0 * error))
    };
    let percent = 100.0 * DEPTH_TOLERANCE;
    format!(
        "off by more than {percent} % of the depth, of {pixels} pixels: {depth_beyond} depths (largest error \
         {}), {points_beyond} points (largest {}); faults, which lie on no surface near the pixel's ray: \
         {depth_faults} depths, {point_faults} points: {}",
        largest(depth_max),
        largest(point_max),
        if *kept { "passed" } else { "FAILED" }
    )
}

/// Percent.
fn share(part: u64, of: u64) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

pub fn describe_plane(plane: &PlaneTruth) -> String {
    let PlaneTruth { channel, kept, pixels, pixels_away, beyond, beyond_away, faults, max, .. } = plane;
    let largest = match (*channel, max) {
        ("object" | "class", _) => String::new(),
        (_, None) => " (largest error: sky instead of surface)".to_owned(),
        ("range", Some(max)) => format!(" (largest error {:.3} %)", 100.0 * max),
        (_, Some(max)) => format!(" (largest error {max:.3} deg)"),
    };
    let allowed = match *channel {
        "object" | "class" => "wrong".to_owned(),
        "range" => format!("off by more than {} %", 100.0 * DEPTH_TOLERANCE),
        _ => format!("off by more than {:.1} deg", NORMAL_TOLERANCE_RAD.to_degrees()),
    };
    format!(
        "{channel} {allowed}: {beyond} of {pixels} pixels{largest}; {beyond_away} of {pixels_away} away from \
         borders of objects ({:.4} %), {} of {} within 1 px of them ({:.2} %); {faults} faults, \
         which no surface near the pixel's ray has: {}",
        share(*beyond_away, *pixels_away),
        beyond - beyond_away,
        pixels - pixels_away,
        share(beyond - beyond_away, pixels - pixels_away),
        if *kept { "passed" } else { "FAILED" }
    )
}
