//! OKVIS settings (YAML): a list of cameras among the settings of the estimator.

use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, numbers_n, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

const DELAY: &str = "how much older the picture is than its stamp against the IMU's clock, s: set shutter.delay_ms if the pictures are to lag";
const ESTIMATOR: &str = "a setting of the estimator";

pub(super) const KEYS: &[Key] = &[
    Key::new("cameras.image_dimension", Use::Applied, "width, height"),
    Key::new("cameras.focal_length", Use::Applied, "fx, fy"),
    Key::new("cameras.principal_point", Use::Applied, "cx, cy"),
    Key::new(
        "cameras.distortion_type",
        Use::Applied,
        "radialtangential, radialtangential8, equidistant, none; others are refused",
    ),
    Key::new("cameras.distortion_coefficients", Use::Applied, "in OpenCV's order"),
    Key::new(
        "cameras.T_SC",
        Use::Named(Neutral::Identity),
        "pose of the camera to the IMU: set mount by hand",
    ),
    Key::new("cameras.cam_model", Use::Applied, "pinhole; others are refused"),
    Key::new("cameras.camera_model", Use::Applied, "pinhole; others are refused"),
    Key::new("cameras.slam_use", Use::Silent, ESTIMATOR),
    Key::new("camera_params.camera_rate", Use::Rate, "frames a second"),
    Key::new("camera_params.image_delay", Use::Named(Neutral::Zero), DELAY),
    Key::new("imageDelay", Use::Named(Neutral::Zero), DELAY),
    Key::new("camera_parameters.image_delay", Use::Named(Neutral::Zero), DELAY),
    Key::new("camera_parameters.camera_rate", Use::Rate, "frames a second"),
    Key::new("camera_params.sigma_*", Use::Silent, ESTIMATOR),
    Key::new("camera_params.timestamp_tolerance", Use::Silent, ESTIMATOR),
    Key::new("camera_params.sync_cameras", Use::Silent, ESTIMATOR),
    Key::new("camera_params.online_calibration.**", Use::Silent, ESTIMATOR),
    Key::new("imu_params.**", Use::Silent, "the IMU"),
    Key::new("numKeyframes", Use::Silent, ESTIMATOR),
    Key::new("numImuFrames", Use::Silent, ESTIMATOR),
    Key::new("ceres_options.**", Use::Silent, ESTIMATOR),
    Key::new("*_options.**", Use::Silent, ESTIMATOR),
    Key::new("*_parameters.**", Use::Silent, ESTIMATOR),
    Key::new("displayImages", Use::Silent, ESTIMATOR),
    Key::new("useDriver", Use::Silent, ESTIMATOR),
];

fn list(document: &Document) -> &[Value] {
    find(&document.value, "cameras").and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

pub(super) fn fits(document: &Document) -> bool {
    let is_camera =
        |value: &Value| find(value, "focal_length").is_some() || find(value, "image_dimension").is_some();
    document.root.is_empty() && list(document).iter().any(is_camera)
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let entry = |(index, value): (usize, _)| Entry {
        name: format!("cam{index}"),
        also: vec![index.to_string()],
        value,
        roots: vec![format!("cameras[{index}]")],
    };
    list(document).iter().enumerate().map(entry).collect()
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    for key in ["cam_model", "camera_model"] {
        if let Some(model) = word(value, key)
            && model != "pinhole"
        {
            return Err(Problem::new(
                key,
                format!("is `{model}`: only `pinhole` can be imported; calibrate with it"),
            ));
        }
    }
    let size_px = size("image_dimension", numbers_n(value, "image_dimension")?)?;
    let kind = word(value, "distortion_type").unwrap_or_default();
    let list = models::stated(value, "distortion_type", kind, Some("distortion_coefficients"))?;
    let (model, list) = models::by_name("distortion_type", kind, "distortion_coefficients", list)?;
    Ok(camera(
        CameraFormat::Okvis,
        size_px,
        numbers_n(value, "focal_length")?,
        numbers_n(value, "principal_point")?,
        model,
        list,
    ))
}
