//! Kalibr camchain, and EuRoC's sensor.yaml, which describes one camera with the same keys.

use serde_json::Value;

use super::document::{Document, KeyProblem, find, numbers, numbers_n, one_of, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models};

const POSE: &str = "pose relative to an IMU, whose axes are not the body's: `--body` or `--rig` applies it";
const BETWEEN: &str = "pose relative to the camera before it: `--body` or `--rig` applies it";
const OTHER_POSE: &str = "a pose under another name: as T_cam_imu, camera from IMU, or its inverse T_imu_cam, `--body` or \
                          `--rig` applies it";
const OFFSET: &str = "clock offset between camera and IMU, s, which shifts all stamps: `--body` or `--rig` \
                      applies it";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "cam*.camera_model",
        Treatment::Applied,
        "pinhole, omni (with radtan or none), ds, eucm, ucm",
    ),
    KeyRow::new(
        "cam*.intrinsics",
        Treatment::Applied,
        "fx fy cx cy; before them xi (omni), xi alpha (ds), alpha beta (eucm), alpha (ucm)",
    ),
    KeyRow::new("cam*.distortion_model", Treatment::Applied, "radtan, equidistant, none; others are refused"),
    KeyRow::new(
        "cam*.distortion_coeffs",
        Treatment::Applied,
        "k1 k2 p1 p2 (radtan) or k1 k2 k3 k4 (equidistant)",
    ),
    KeyRow::new("cam*.distortion_coefficients", Treatment::Applied, "as above"),
    KeyRow::new("cam*.resolution", Treatment::Applied, "width, height"),
    KeyRow::new(
        "cam*.line_delay",
        Treatment::LineDelay(1e3),
        "s per row; the readout is this times the rows",
    ),
    KeyRow::new(
        "cam*.line_delay_nanoseconds",
        Treatment::LineDelay(1e-6),
        "ns per row; the readout is this times the rows",
    ),
    KeyRow::new("cam*.rate_hz", Treatment::FrameRate, "frames per second"),
    KeyRow::new("cam*.timeshift_cam_imu", Treatment::Reported(Neutral::Zero), OFFSET),
    KeyRow::new("cam*.T_cam_imu", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new("cam*.T_imu_cam", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new("cam*.T_cn_cnm1", Treatment::Reported(Neutral::Identity), BETWEEN),
    KeyRow::new("cam*.T_*", Treatment::Reported(Neutral::Identity), OTHER_POSE),
    KeyRow::new(
        "cam*.mask*",
        Treatment::Reported(Neutral::Never),
        "mask of unused pixels: set photometric.vignette if they are dark",
    ),
    KeyRow::new("cam*.cam_overlaps", Treatment::Ignored, "pairs of overlapping cameras"),
    KeyRow::new("cam*.rostopic", Treatment::Ignored, "a name"),
    KeyRow::new("imu*.**", Treatment::Ignored, "an IMU"),
];

pub(super) const EUROC_KEYS: &[KeyRow] = &[
    KeyRow::new("camera_model", Treatment::Applied, "as in a Kalibr camchain"),
    KeyRow::new("intrinsics", Treatment::Applied, "fx fy cx cy"),
    KeyRow::new(
        "distortion_model",
        Treatment::Applied,
        "radial-tangential, equidistant, none; others are refused",
    ),
    KeyRow::new(
        "distortion_coefficients",
        Treatment::Applied,
        "k1 k2 p1 p2 (radial-tangential) or k1 k2 k3 k4 (equidistant)",
    ),
    KeyRow::new("distortion_coeffs", Treatment::Applied, "as above"),
    KeyRow::new("resolution", Treatment::Applied, "width, height"),
    KeyRow::new("rate_hz", Treatment::FrameRate, "frames per second"),
    KeyRow::new("line_delay", Treatment::LineDelay(1e3), "s per row; the readout is this times the rows"),
    KeyRow::new("timeshift_cam_imu", Treatment::Reported(Neutral::Zero), OFFSET),
    KeyRow::new("T_BS", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new(
        "T_*",
        Treatment::Reported(Neutral::Identity),
        "a pose under another name: as T_BS, body from camera, `--body` or `--rig` applies it",
    ),
    KeyRow::new("sensor_type", Treatment::Ignored, "camera"),
    KeyRow::new("comment", Treatment::Ignored, "free text"),
];

/// `cam0`, `cam1`, ...
fn is_camera(key: &str) -> bool {
    key.strip_prefix("cam")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let cameras = document
        .value
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(key, value)| is_camera(key) && find(value, "intrinsics").is_some());
    cameras.map(|(key, value)| CameraEntry::new(key.clone(), value, key.clone())).collect()
}

pub(super) fn matches_camchain(document: &Document) -> bool {
    document.root.is_empty() && !entries(document).is_empty()
}

pub(super) fn matches_euroc(document: &Document) -> bool {
    document.root.is_empty()
        && ["intrinsics", "resolution", "distortion_model"]
            .iter()
            .all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value, format: CameraFormat) -> Result<ImportedCamera, KeyProblem> {
    let projection = word(value, "camera_model").unwrap_or("pinhole");
    if projection != "pinhole" {
        return import_wide(value, format, projection);
    }
    let [fx, fy, cx, cy] = numbers_n(value, "intrinsics")?;
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let key = one_of(value, &["distortion_coeffs", "distortion_coefficients"])?;
    let model = word(value, "distortion_model").unwrap_or_default();
    let list = lens_models::coefficients(value, "distortion_model", model, key)?;
    let (model, list) =
        lens_models::lens_by_name("distortion_model", model, key.unwrap_or("distortion_coeffs"), list)?;
    Ok(camera(format, size_px, [fx, fy], [cx, cy], model, list))
}

/// A projection with parameters of its own before the focal lengths.
fn import_wide(value: &Value, format: CameraFormat, projection: &str) -> Result<ImportedCamera, KeyProblem> {
    let intrinsics = numbers(value, "intrinsics")?;
    let Some((parameters, [fx, fy, cx, cy])) = intrinsics.split_last_chunk::<4>() else {
        return Err(KeyProblem::new("intrinsics", format!("has {} numbers", intrinsics.len())));
    };
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let key = one_of(value, &["distortion_coeffs", "distortion_coefficients"])?;
    let model = word(value, "distortion_model").unwrap_or("none");
    let distortion = lens_models::coefficients(value, "distortion_model", model, key)?;
    let is_distorted = distortion.iter().any(|k| *k != 0.0);
    let is_radtan = projection == "omni" && ["radtan", "radial-tangential", "none"].contains(&model);
    if is_distorted && !(is_radtan && distortion.len() == 4) {
        let text = format!(
            "is `{model}` with `{projection}`: of these projections only omni is supported with distortion, radtan's \
             four coefficients"
        );
        return Err(KeyProblem::new("distortion_model", text));
    }
    let all = if is_distorted { [parameters, &distortion].concat() } else { parameters.to_vec() };
    let (model, coefficients) = lens_models::lens_by_name("camera_model", projection, "intrinsics", all)?;
    Ok(camera(format, size_px, [*fx, *fy], [*cx, *cy], model, coefficients))
}
