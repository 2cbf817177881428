//! Basalt's calibration JSON (cereal, hence `value0`).

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models};

const IMU: &str = "the IMU";
const CLOCK: &str = "clock offset between sensors, ns, which shifts all stamps";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "value0.intrinsics.camera_type",
        Treatment::Applied,
        "pinhole, kb4, pinhole-radtan8, ds, eucm, ucm; others are refused",
    ),
    KeyRow::new("value0.intrinsics.intrinsics.fx", Treatment::Applied, "px"),
    KeyRow::new("value0.intrinsics.intrinsics.fy", Treatment::Applied, "px"),
    KeyRow::new("value0.intrinsics.intrinsics.cx", Treatment::Applied, "px"),
    KeyRow::new("value0.intrinsics.intrinsics.cy", Treatment::Applied, "px"),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k1",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k2",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k3",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k4",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k5",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.k6",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.p1",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.p2",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.rpmax",
        Treatment::Reported(Neutral::Zero),
        "radius limit of the model; camsim computes the limit itself",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.xi",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.alpha",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.beta",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new(
        "value0.intrinsics.intrinsics.w",
        Treatment::Applied,
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    KeyRow::new("value0.resolution", Treatment::Applied, "width and height of each camera"),
    KeyRow::new(
        "value0.vignette.**",
        Treatment::Reported(Neutral::Never),
        "radial vignette spline: convert it to a picture and set photometric.vignette",
    ),
    KeyRow::new(
        "value0.vignette",
        Treatment::Reported(Neutral::Never),
        "radial vignette spline: convert it to a picture and set photometric.vignette",
    ),
    KeyRow::new(
        "value0.T_imu_cam.**",
        Treatment::Reported(Neutral::Never),
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    KeyRow::new(
        "value0.cam_time_offset_ns",
        Treatment::Reported(Neutral::Zero),
        "clock offset between cameras and IMU, ns: `--body` or `--rig` applies it",
    ),
    KeyRow::new("value0.mocap_*", Treatment::Reported(Neutral::Zero), CLOCK),
    KeyRow::new("value0.T_mocap_world.**", Treatment::Ignored, "motion capture"),
    KeyRow::new("value0.T_imu_marker.**", Treatment::Ignored, "motion capture"),
    KeyRow::new("value0.calib_*", Treatment::Ignored, IMU),
    KeyRow::new("value0.imu_update_rate", Treatment::Ignored, IMU),
    KeyRow::new("value0.accel_*", Treatment::Ignored, IMU),
    KeyRow::new("value0.gyro_*", Treatment::Ignored, IMU),
    KeyRow::new("value0.view_offset", Treatment::Ignored, "a setting of that program"),
];

pub(super) fn matches(document: &Document) -> bool {
    document.root.is_empty() && find(&document.value, "value0.intrinsics").is_some_and(Value::is_array)
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let list =
        find(&document.value, "value0.intrinsics").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let roots = |index: usize| {
        ["intrinsics", "T_imu_cam", "vignette"].map(|key| format!("value0.{key}[{index}]")).to_vec()
    };
    let entry = |(index, value): (usize, _)| CameraEntry {
        name: format!("cam{index}"),
        aliases: vec![index.to_string()],
        value,
        roots: roots(index),
    };
    list.iter().enumerate().map(entry).collect()
}

pub(super) fn import(document: &Document, entry: &CameraEntry<'_>) -> Result<ImportedCamera, KeyProblem> {
    let value = entry.value;
    let index: usize = entry.name.trim_start_matches("cam").parse().unwrap_or(0);
    let get = |key: &str| number(value, &format!("intrinsics.{key}"));
    let all = |keys: &[&str]| keys.iter().map(|key| get(key)).collect::<Result<Vec<f64>, _>>();
    let kind = word(value, "camera_type").unwrap_or_default();
    let (model, names): (LensModel, &[&str]) = match kind {
        "pinhole" => (LensModel::BrownConrady, &[]),
        "kb4" => (LensModel::KannalaBrandt, &["k1", "k2", "k3", "k4"]),
        "ds" => (LensModel::DoubleSphere, &["xi", "alpha"]),
        "eucm" => (LensModel::Eucm, &["alpha", "beta"]),
        "ucm" => (LensModel::Ucm, &["alpha"]),
        "pinhole-radtan8" => (LensModel::BrownConrady, &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]),
        other => {
            let advice = "calibrate with kb4, ds, eucm, ucm or pinhole-radtan8";
            return Err(KeyProblem::new("camera_type", lens_models::unsupported_model(other, advice)));
        }
    };
    let coefficients = all(names)?;
    for key in ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "xi", "alpha", "beta", "w"]
        .iter()
        .filter(|key| !names.contains(key))
    {
        let key = format!("intrinsics.{key}");
        if optional_number(value, &key)?.is_some_and(|number| number != 0.0) {
            return Err(KeyProblem::new(
                key,
                format!("is not zero, but camera_type `{kind}` has no such parameter: correct camera_type"),
            ));
        }
    }
    let sizes = find(&document.value, "value0.resolution").and_then(Value::as_array);
    let camera_size = sizes.and_then(|list| list.get(index)).ok_or_else(|| {
        KeyProblem::new("value0.resolution", format!("has no entry {index}, counted from 0"))
    })?;
    let pair = as_pair(camera_size)?;
    let [width, height] = pair[..] else {
        return Err(KeyProblem::new(
            "value0.resolution",
            format!("has {} numbers for camera {index} instead of width and height", pair.len()),
        ));
    };
    let size_px = size("value0.resolution", [width, height])?;
    Ok(camera(
        CameraFormat::Basalt,
        size_px,
        [get("fx")?, get("fy")?],
        [get("cx")?, get("cy")?],
        model,
        coefficients,
    ))
}

fn as_pair(value: &Value) -> Result<Vec<f64>, KeyProblem> {
    let list: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
    list.ok_or_else(|| KeyProblem::new("value0.resolution", "is not a list of width and height"))
}
