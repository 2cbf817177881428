//! OKVIS settings (YAML): a list of cameras among the settings of the estimator.

use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{Document, KeyProblem, find, list, numbers_n, size, word};

const DELAY: &str = "delay of the pictures against the IMU, s: set shutter.delay_ms if the pictures lag";
const ESTIMATOR: &str = "a setting of the estimator";

pub(crate) const READER: Reader = Reader {
    entries,
    poses: |found, camera| found.in_body(camera.value(), &camera.prefix(), "T_SC", false),
    ..Reader::new("okvis", "OKVIS YAML", matches, &[("", KEYS)], |camera| import(camera.value()))
};

const KEYS: &[KeyRow] = &[
    applied("cameras.image_dimension", "width, height"),
    applied("cameras.focal_length", "fx, fy"),
    applied("cameras.principal_point", "cx, cy"),
    applied(
        "cameras.distortion_type",
        "radialtangential, radialtangential8, equidistant, none; others are refused",
    ),
    applied("cameras.distortion_coefficients", "in OpenCV's order"),
    reported(
        Neutral::Identity,
        "cameras.T_SC",
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    applied("cameras.cam_model cameras.camera_model", "pinhole; others are refused"),
    ignored("cameras.slam_use", ESTIMATOR),
    KeyRow::new(Treatment::FrameRate, "camera_params.camera_rate", "frames per second"),
    reported(Neutral::Zero, "camera_params.image_delay imageDelay camera_parameters.image_delay", DELAY),
    KeyRow::new(Treatment::FrameRate, "camera_parameters.camera_rate", "frames per second"),
    ignored(
        "camera_params.sigma_* camera_params.timestamp_tolerance camera_params.sync_cameras \
         camera_params.online_calibration.**",
        ESTIMATOR,
    ),
    ignored("imu_params.**", "the IMU"),
    ignored(
        "numKeyframes numImuFrames ceres_options.** *_options.** *_parameters.** displayImages \
         useDriver",
        ESTIMATOR,
    ),
];

fn matches(document: &Document) -> bool {
    let is_camera =
        |value: &Value| find(value, "focal_length").is_some() || find(value, "image_dimension").is_some();
    list(&document.value, "cameras").iter().any(is_camera)
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let entry = |(index, value): (usize, _)| CameraEntry {
        name: format!("cam{index}"),
        aliases: vec![index.to_string()],
        value,
        roots: vec![format!("cameras[{index}]")],
    };
    Ok(list(&document.value, "cameras").iter().enumerate().map(entry).collect())
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
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
    Ok(camera(size_px, numbers_n(value, "focal_length")?, numbers_n(value, "principal_point")?, model, list))
}
