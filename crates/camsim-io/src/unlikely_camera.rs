//! Values of a camera that are legal and probably mistakes: the judge of calibrations of all formats, of rigs and
//! of scenarios.

use std::{
    f64::consts::{FRAC_PI_4, TAU},
    fmt,
};

use camsim_core::{
    camera::CameraModel,
    scenario::{CameraSpec, LensModel},
};

use crate::text::wording::rounded;

mod lens;
mod principal_point;

/// Degrees across within which the field of view of a flat lens is usual.
const USUAL_FIELD_DEG: std::ops::RangeInclusive<f64> = 0.1..=150.0;
/// A turn and some pixels of rounding.
const MOST_TURNS: f64 = 1.05;
/// Shortest focal length of a lens, in longer sides of the picture.
const SHORTEST_FOCAL: f64 = 0.02;
/// Ratios of the focal lengths for pixels that are nearly square. Those of television and of anamorphic lenses lie
/// outside.
const USUAL_RATIO: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Longest usual lever arm, metres. In millimetres those of small devices exceed it.
const LONGEST_ARM_M: f64 = 10.0;
/// Angles of at most a quarter turn in radians, which are tiny in degrees.
const MOST_RADIANS: f64 = 1.6;
/// Rounding of round angles in radians.
const ROUNDED_RAD: f64 = 1e-3;
/// Fastest usual frame rate.
const FASTEST_FPS: f64 = 1e4;
/// Shortest readout of a rolling shutter, milliseconds; sensors need 1 ms or more.
const SHORTEST_READOUT_MS: f64 = 0.1;
/// Longest readout of a rolling shutter, milliseconds.
pub(crate) const LONGEST_READOUT_MS: f64 = 250.0;
/// Longest time between the clocks of sensors of one device, milliseconds.
const LONGEST_SHIFT_MS: f64 = 1e3;

/// A value that is probably a mistake.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Doubt {
    /// Key below `camera`.
    key: &'static str,
    /// Value, where it is short.
    value: Option<String>,
    /// What is odd about it, and what to check.
    problem: String,
    /// Whether no real camera has the value.
    is_impossible: bool,
}

impl Doubt {
    fn new(key: &'static str, problem: impl Into<String>) -> Self {
        Self { key, value: None, problem: problem.into(), is_impossible: false }
    }

    fn of(key: &'static str, value: impl fmt::Debug, problem: impl Into<String>) -> Self {
        Self { value: Some(format!("{value:?}")), ..Self::new(key, problem) }
    }

    /// Key below `camera`.
    pub(crate) fn key(&self) -> &str {
        self.key
    }

    /// What to say if a calibration has the value and is refused for it; `None` if it is only told.
    pub(crate) fn refusal(&self) -> Option<String> {
        let value = self.value.as_ref().filter(|_| self.is_impossible)?;
        Some(format!("is {value}, which {}", self.problem))
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.value {
            Some(value) => write!(f, "{} = {value} {}", self.key, self.problem),
            None => write!(f, "{}: {}", self.key, self.problem),
        }
    }
}

/// What is odd about a camera of a scenario.
pub(crate) fn doubts(camera: &CameraSpec) -> Vec<Doubt> {
    let mut all = Vec::new();
    let mut is_of_other_picture = false;
    if camera.zoom.is_empty() {
        // A part of a picture may have its axis anywhere.
        let is_whole = !camera.made_of.is_part;
        let other = field_doubt(camera)
            .into_iter()
            .chain(is_whole.then(|| principal_point::doubt_of_other_picture(camera)).flatten());
        all.extend(other);
        is_of_other_picture = !all.is_empty();
        all.extend(ratio_doubt(camera));
        all.extend((is_whole && !is_of_other_picture).then(|| principal_point::far_doubt(camera)).flatten());
    }
    // With the focal length or the size of another picture the lens is seen where it is not of this camera.
    if !is_of_other_picture {
        all.extend(lens::doubts_of_rays(camera));
    }
    all.extend(lens::tangential_doubt(camera));
    all.extend(arm_doubt(camera));
    all.extend(angles_doubt(camera));
    all.extend(short_readout_doubt(camera));
    all
}

/// What is odd about a camera of a calibration. A scenario may shift a clock on purpose, or film in slow motion.
pub(crate) fn doubts_of_calibration(camera: &CameraSpec) -> Vec<Doubt> {
    let mut all = doubts(camera);
    all.extend(clock_doubt(camera));
    all.extend(long_readout_doubt(camera));
    all.extend(rate_doubt(camera));
    all
}

fn is_flat(model: LensModel) -> bool {
    matches!(model, LensModel::Pinhole | LensModel::BrownConrady | LensModel::BrownConradyPrism)
}

/// Whether coefficients or points carry the scale of the lens, so that the focal length alone says nothing.
fn has_own_scale(model: LensModel) -> bool {
    matches!(model, LensModel::FTheta | LensModel::FThetaInverse | LensModel::Table)
}

/// A focal length that was given in millimetres, as a fraction, or in pixels where fractions belong.
fn field_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let ([width, height], [fx, fy]) = (camera.size_px.map(f64::from), camera.focal_px);
    let longer = width.max(height);
    let across_rad = if is_flat(camera.lens.model) { 2.0 * (0.5 * width / fx).atan() } else { width / fx };
    let across_deg = across_rad.to_degrees();
    let is_too_short = !has_own_scale(camera.lens.model) && fx.min(fy) < SHORTEST_FOCAL * longer;
    let is_too_long = across_deg < *USUAL_FIELD_DEG.start();
    let is_too_wide = match camera.lens.model {
        LensModel::Equirectangular => across_rad > MOST_TURNS * TAU,
        model => is_flat(model) && across_deg > *USUAL_FIELD_DEG.end(),
    };
    let remedy = match camera.lens.model {
        LensModel::Equirectangular => "the width of a whole turn is 2 pi focal_px".to_owned(),
        _ if is_too_long => format!(
            "it is {:.0} times the longer side; focal_px is in pixels, f_mm / pixel_um * 1000: were pixels taken for \
             fractions of a side?",
            fx.max(fy) / longer
        ),
        _ => "focal_px is in pixels, f_mm / pixel_um * 1000: is it a fraction of a side, or in millimetres?"
            .to_owned(),
    };
    // Three digits.
    let degrees = if across_deg < 1.0 { format!("{across_deg:.2e}") } else { format!("{across_deg:.0}") };
    (is_too_short || is_too_long || is_too_wide).then(|| Doubt {
        is_impossible: is_too_short || is_too_long,
        ..Doubt::of(
            "focal_px",
            camera.focal_px,
            format!("makes a field of view of {degrees} degrees across {width} pixels: {remedy}"),
        )
    })
}

fn ratio_doubt(camera: &CameraSpec) -> Option<Doubt> {
    // Pixels that `resized` has made of unequal numbers are not square.
    let [fx, fy] = [camera.focal_px[0] / camera.made_of.squeeze, camera.focal_px[1]];
    (!USUAL_RATIO.contains(&(fx / fy))).then(|| {
        let percent = 100.0 * (fx.max(fy) / fx.min(fy) - 1.0);
        let problem = format!(
            "differs by {percent:.0} % between x and y, and nearly all cameras have square pixels: check both"
        );
        Doubt::of("focal_px", camera.focal_px, problem)
    })
}

/// A lever arm in millimetres.
fn arm_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let offset_m = camera.mount.offset_m;
    let length_m = offset_m.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length_m > LONGEST_ARM_M).then(|| {
        let problem =
            format!("puts the camera {length_m:.0} m from the body's origin: is it in millimetres?");
        Doubt::of("mount.offset_m", offset_m, problem)
    })
}

/// Angles in radians: all are small, and one is an eighth of a turn or a multiple of it.
fn angles_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let angles = camera.mount.angles_deg;
    let is_round = |angle: f64| {
        let eighths = angle.abs() / FRAC_PI_4;
        eighths.round() >= 1.0 && (eighths - eighths.round()).abs() * FRAC_PI_4 < ROUNDED_RAD
    };
    let is_small = angles.iter().all(|angle| angle.abs() < MOST_RADIANS);
    (is_small && angles.iter().any(|angle| is_round(*angle))).then(|| {
        let degrees: Vec<String> = angles.iter().map(|angle| rounded(angle.to_degrees())).collect();
        let problem = format!(
            "is in degrees, and these are round angles in radians: were [{}] meant?",
            degrees.join(", ")
        );
        Doubt::of("mount.angles_deg", angles, problem)
    })
}

/// A period in nanoseconds, or a rate in another unit.
fn rate_doubt(camera: &CameraSpec) -> Option<Doubt> {
    (camera.fps > FASTEST_FPS).then(|| {
        let problem =
            format!("is more than any usual camera takes in a second, up to {FASTEST_FPS}: check its unit");
        Doubt::of("fps", camera.fps, problem)
    })
}

/// A readout that was given in seconds.
fn short_readout_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let readout_ms = camera.readout_ms();
    (readout_ms > 0.0 && readout_ms < SHORTEST_READOUT_MS).then(|| {
        let problem = "ms is shorter than the readout of any sensor, 1 ms or more: check its unit, or write 0 for a \
                       global shutter";
        Doubt::of("shutter.readout_ms", readout_ms, problem)
    })
}

fn long_readout_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let readout_ms = camera.readout_ms();
    (readout_ms > LONGEST_READOUT_MS).then(|| {
        let problem = "ms is longer than the readout of usual sensors, 1 to 190 ms: check its unit";
        Doubt::of("shutter.readout_ms", readout_ms, problem)
    })
}

fn clock_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let shifts = [("clock_offset_ms", camera.clock_offset_ms), ("shutter.delay_ms", camera.shutter.delay_ms)];
    let (key, shift_ms) = shifts.into_iter().find(|(_, ms)| ms.abs() > LONGEST_SHIFT_MS)?;
    let problem = format!(
        "shifts the camera's clock by {} s, and more than about 1 s is implausible: were milliseconds written as seconds?",
        shift_ms / 1e3
    );
    Some(Doubt::of(key, shift_ms, problem))
}

/// The camera, or `None` of one that cannot be used and is refused elsewhere.
fn model(camera: &CameraSpec) -> Option<CameraModel> {
    CameraModel::from_spec(camera).ok()
}

#[cfg(test)]
mod tests;
