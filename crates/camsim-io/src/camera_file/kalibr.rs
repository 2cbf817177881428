//! Kalibr camchain, and EuRoC's sensor.yaml, which describes one camera in the same words.

use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, numbers_n, one_of, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

const POSE: &str = "pose of the camera to an IMU or to another camera, whose axes are not the body's here: set mount by hand";
const OFFSET: &str = "clock of the camera against that of an IMU, s: it shifts all stamps alike; set shutter.delay_ms if the pictures are to lag";

pub(super) const KEYS: &[Key] = &[
    Key::new("cam*.camera_model", Use::Applied, "pinhole; omni, ds, eucm and ucm are refused"),
    Key::new("cam*.intrinsics", Use::Applied, "fx fy cx cy"),
    Key::new("cam*.distortion_model", Use::Applied, "radtan, equidistant, none; others are refused"),
    Key::new("cam*.distortion_coeffs", Use::Applied, "k1 k2 p1 p2 (radtan) or k1 k2 k3 k4 (equidistant)"),
    Key::new("cam*.distortion_coefficients", Use::Applied, "the same"),
    Key::new("cam*.resolution", Use::Applied, "width, height"),
    Key::new("cam*.line_delay", Use::LineDelay(1e3), "s a row; times the rows it is the readout"),
    Key::new(
        "cam*.line_delay_nanoseconds",
        Use::LineDelay(1e-6),
        "ns a row; times the rows it is the readout",
    ),
    Key::new("cam*.rate_hz", Use::Rate, "frames a second"),
    Key::new("cam*.timeshift_cam_imu", Use::Named(Neutral::Zero), OFFSET),
    Key::new("cam*.T_*", Use::Named(Neutral::Identity), POSE),
    Key::new(
        "cam*.mask*",
        Use::Named(Neutral::Never),
        "pixels that are not to be used; set photometric.vignette if they are dark",
    ),
    Key::new("cam*.cam_overlaps", Use::Silent, "which cameras see the same"),
    Key::new("cam*.rostopic", Use::Silent, "a name"),
    Key::new("imu*.**", Use::Silent, "an IMU"),
];

pub(super) const EUROC_KEYS: &[Key] = &[
    Key::new("camera_model", Use::Applied, "pinhole; others are refused"),
    Key::new("intrinsics", Use::Applied, "fx fy cx cy"),
    Key::new("distortion_model", Use::Applied, "radial-tangential, equidistant, none; others are refused"),
    Key::new(
        "distortion_coefficients",
        Use::Applied,
        "k1 k2 p1 p2 (radial-tangential) or k1 k2 k3 k4 (equidistant)",
    ),
    Key::new("distortion_coeffs", Use::Applied, "the same"),
    Key::new("resolution", Use::Applied, "width, height"),
    Key::new("rate_hz", Use::Rate, "frames a second"),
    Key::new("line_delay", Use::LineDelay(1e3), "s a row; times the rows it is the readout"),
    Key::new("timeshift_cam_imu", Use::Named(Neutral::Zero), OFFSET),
    Key::new("T_*", Use::Named(Neutral::Identity), POSE),
    Key::new("sensor_type", Use::Silent, "camera"),
    Key::new("comment", Use::Silent, "free text"),
];

/// `cam0`, `cam1`, ...
fn is_camera(key: &str) -> bool {
    key.strip_prefix("cam")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let cameras = document
        .value
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(key, value)| is_camera(key) && find(value, "intrinsics").is_some());
    cameras.map(|(key, value)| Entry::new(key.clone(), value, key.clone())).collect()
}

pub(super) fn fits_camchain(document: &Document) -> bool {
    document.root.is_empty() && !entries(document).is_empty()
}

pub(super) fn fits_euroc(document: &Document) -> bool {
    document.root.is_empty()
        && ["intrinsics", "resolution", "distortion_model"]
            .iter()
            .all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value, format: CameraFormat) -> Result<ImportedCamera, Problem> {
    if let Some(model) = word(value, "camera_model")
        && model != "pinhole"
    {
        let which = models::unknown(model).map_or(String::new(), |name| format!(" ({name})"));
        let text = format!(
            "is `{model}`{which}: only `pinhole` can be imported, with radial-tangential or equidistant distortion; calibrate with one of these"
        );
        return Err(Problem::new("camera_model", text));
    }
    let [fx, fy, cx, cy] = numbers_n(value, "intrinsics")?;
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let key = one_of(value, &["distortion_coeffs", "distortion_coefficients"])?;
    let model = word(value, "distortion_model").unwrap_or_default();
    let list = models::stated(value, "distortion_model", model, key)?;
    let (model, list) = models::by_name("distortion_model", model, key.unwrap_or("distortion_coeffs"), list)?;
    Ok(camera(format, size_px, [fx, fy], [cx, cy], model, list))
}
