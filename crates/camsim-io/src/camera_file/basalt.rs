//! Basalt's calibration JSON (cereal, hence `value0`).

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

const IMU: &str = "the IMU";
const CLOCK: &str = "clock of one sensor against another's, ns: it shifts all stamps alike";

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "value0.intrinsics.camera_type",
        Use::Applied,
        "pinhole, kb4, pinhole-radtan8; ds, eucm, ucm, fov are refused",
    ),
    Key::new("value0.intrinsics.intrinsics.fx", Use::Applied, "px"),
    Key::new("value0.intrinsics.intrinsics.fy", Use::Applied, "px"),
    Key::new("value0.intrinsics.intrinsics.cx", Use::Applied, "px"),
    Key::new("value0.intrinsics.intrinsics.cy", Use::Applied, "px"),
    Key::new(
        "value0.intrinsics.intrinsics.k1",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.k2",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.k3",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.k4",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.k5",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.k6",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.p1",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.p2",
        Use::Applied,
        "coefficient; refused unless zero where camera_type has it not",
    ),
    Key::new(
        "value0.intrinsics.intrinsics.rpmax",
        Use::Named(Neutral::Zero),
        "radius up to which that program believes the model; where the lens folds is found by itself",
    ),
    Key::new("value0.intrinsics.intrinsics.xi", Use::Applied, "of models that are refused"),
    Key::new("value0.intrinsics.intrinsics.alpha", Use::Applied, "of models that are refused"),
    Key::new("value0.intrinsics.intrinsics.beta", Use::Applied, "of models that are refused"),
    Key::new("value0.intrinsics.intrinsics.w", Use::Applied, "of models that are refused"),
    Key::new("value0.resolution", Use::Applied, "width and height of each camera"),
    Key::new(
        "value0.vignette.**",
        Use::Named(Neutral::Never),
        "a spline of the vignette over the radius: draw it as a picture and set photometric.vignette",
    ),
    Key::new(
        "value0.vignette",
        Use::Named(Neutral::Never),
        "a spline of the vignette over the radius: draw it as a picture and set photometric.vignette",
    ),
    Key::new(
        "value0.T_imu_cam.**",
        Use::Named(Neutral::Never),
        "pose of the camera to the IMU: set mount by hand",
    ),
    Key::new("value0.cam_time_offset_ns", Use::Named(Neutral::Zero), CLOCK),
    Key::new("value0.mocap_*", Use::Named(Neutral::Zero), CLOCK),
    Key::new("value0.T_mocap_world.**", Use::Silent, "motion capture"),
    Key::new("value0.T_imu_marker.**", Use::Silent, "motion capture"),
    Key::new("value0.calib_*", Use::Silent, IMU),
    Key::new("value0.imu_update_rate", Use::Silent, IMU),
    Key::new("value0.accel_*", Use::Silent, IMU),
    Key::new("value0.gyro_*", Use::Silent, IMU),
    Key::new("value0.view_offset", Use::Silent, "a setting of that program"),
];

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty() && find(&document.value, "value0.intrinsics").is_some_and(Value::is_array)
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let list =
        find(&document.value, "value0.intrinsics").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let roots = |index: usize| {
        ["intrinsics", "T_imu_cam", "vignette"].map(|key| format!("value0.{key}[{index}]")).to_vec()
    };
    let entry = |(index, value): (usize, _)| Entry {
        name: format!("cam{index}"),
        also: vec![index.to_string()],
        value,
        roots: roots(index),
    };
    list.iter().enumerate().map(entry).collect()
}

pub(super) fn import(document: &Document, entry: &Entry<'_>) -> Result<ImportedCamera, Problem> {
    let value = entry.value;
    let index: usize = entry.name.trim_start_matches("cam").parse().unwrap_or(0);
    let get = |key: &str| number(value, &format!("intrinsics.{key}"));
    let all = |keys: &[&str]| keys.iter().map(|key| get(key)).collect::<Result<Vec<f64>, _>>();
    let kind = word(value, "camera_type").unwrap_or_default();
    let (model, names): (LensModel, &[&str]) = match kind {
        "pinhole" => (LensModel::BrownConrady, &[]),
        "kb4" => (LensModel::KannalaBrandt, &["k1", "k2", "k3", "k4"]),
        "pinhole-radtan8" => (LensModel::BrownConrady, &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]),
        other => {
            let which = models::unknown(other).map_or(String::new(), |name| format!(" ({name})"));
            return Err(Problem::new(
                "camera_type",
                format!("is `{other}`{which}, which no lens here is: calibrate with kb4 or pinhole-radtan8"),
            ));
        }
    };
    let coefficients = all(names)?;
    for key in ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "xi", "alpha", "beta", "w"]
        .iter()
        .filter(|key| !names.contains(key))
    {
        let key = format!("intrinsics.{key}");
        if optional_number(value, &key)?.is_some_and(|number| number != 0.0) {
            return Err(Problem::new(
                key,
                format!(
                    "is not zero, but camera_type `{kind}` has no such parameter: name the model that is meant"
                ),
            ));
        }
    }
    let sizes = find(&document.value, "value0.resolution").and_then(Value::as_array);
    let of_camera = sizes
        .and_then(|list| list.get(index))
        .ok_or_else(|| Problem::new("value0.resolution", format!("has no entry {index}, counted from 0")))?;
    let pair = as_pair(of_camera)?;
    let [width, height] = pair[..] else {
        return Err(Problem::new(
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

fn as_pair(value: &Value) -> Result<Vec<f64>, Problem> {
    let list: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
    list.ok_or_else(|| Problem::new("value0.resolution", "is not a list of width and height"))
}
