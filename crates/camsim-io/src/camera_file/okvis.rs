//! OKVIS settings (YAML): a list of cameras among the settings of the estimator.

use serde_json::Value;

use super::document::{Document, KeyProblem, find, numbers_n, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models};

const DELAY: &str = "delay of the pictures against the IMU, s: set shutter.delay_ms if the pictures lag";
const ESTIMATOR: &str = "a setting of the estimator";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new("cameras.image_dimension", Treatment::Applied, "width, height"),
    KeyRow::new("cameras.focal_length", Treatment::Applied, "fx, fy"),
    KeyRow::new("cameras.principal_point", Treatment::Applied, "cx, cy"),
    KeyRow::new(
        "cameras.distortion_type",
        Treatment::Applied,
        "radialtangential, radialtangential8, equidistant, none; others are refused",
    ),
    KeyRow::new("cameras.distortion_coefficients", Treatment::Applied, "in OpenCV's order"),
    KeyRow::new(
        "cameras.T_SC",
        Treatment::Reported(Neutral::Identity),
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    KeyRow::new("cameras.cam_model", Treatment::Applied, "pinhole; others are refused"),
    KeyRow::new("cameras.camera_model", Treatment::Applied, "pinhole; others are refused"),
    KeyRow::new("cameras.slam_use", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("camera_params.camera_rate", Treatment::FrameRate, "frames per second"),
    KeyRow::new("camera_params.image_delay", Treatment::Reported(Neutral::Zero), DELAY),
    KeyRow::new("imageDelay", Treatment::Reported(Neutral::Zero), DELAY),
    KeyRow::new("camera_parameters.image_delay", Treatment::Reported(Neutral::Zero), DELAY),
    KeyRow::new("camera_parameters.camera_rate", Treatment::FrameRate, "frames per second"),
    KeyRow::new("camera_params.sigma_*", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("camera_params.timestamp_tolerance", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("camera_params.sync_cameras", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("camera_params.online_calibration.**", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("imu_params.**", Treatment::Ignored, "the IMU"),
    KeyRow::new("numKeyframes", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("numImuFrames", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("ceres_options.**", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("*_options.**", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("*_parameters.**", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("displayImages", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("useDriver", Treatment::Ignored, ESTIMATOR),
];

fn list(document: &Document) -> &[Value] {
    find(&document.value, "cameras").and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

pub(super) fn matches(document: &Document) -> bool {
    let is_camera =
        |value: &Value| find(value, "focal_length").is_some() || find(value, "image_dimension").is_some();
    document.root.is_empty() && list(document).iter().any(is_camera)
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let entry = |(index, value): (usize, _)| CameraEntry {
        name: format!("cam{index}"),
        aliases: vec![index.to_string()],
        value,
        roots: vec![format!("cameras[{index}]")],
    };
    list(document).iter().enumerate().map(entry).collect()
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    for key in ["cam_model", "camera_model"] {
        if let Some(model) = word(value, key)
            && model != "pinhole"
        {
            return Err(KeyProblem::new(
                key,
                format!("is `{model}`: only `pinhole` can be imported; calibrate with it"),
            ));
        }
    }
    let size_px = size("image_dimension", numbers_n(value, "image_dimension")?)?;
    let kind = word(value, "distortion_type").unwrap_or_default();
    let list = lens_models::coefficients(value, "distortion_type", kind, Some("distortion_coefficients"))?;
    let (model, list) = lens_models::lens_by_name("distortion_type", kind, "distortion_coefficients", list)?;
    Ok(camera(
        CameraFormat::Okvis,
        size_px,
        numbers_n(value, "focal_length")?,
        numbers_n(value, "principal_point")?,
        model,
        list,
    ))
}
