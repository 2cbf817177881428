//! Basalt's calibration JSON (cereal, hence `value0`).

use glam::{DQuat, DVec3};
use serde_json::Value;

use super::LENSES;
use crate::formats::axes::Rigid;
use crate::formats::named_lens::NamedLens;
use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::poses::{Extrinsics, Placement};
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{Document, KeyProblem, find, list, number, optional_number, size, word};

const IMU: &str = "the IMU";
const CLOCK: &str = "clock offset between sensors, ns, which shifts all stamps";

pub(crate) const READER: Reader = Reader {
    entries,
    poses,
    ..Reader::new("basalt", "Basalt JSON", matches, &[("", KEYS)], |camera| {
        import(camera.document, camera.entry())
    })
};

const KEYS: &[KeyRow] = &[
    applied(
        "value0.intrinsics.camera_type",
        "pinhole, kb4, pinhole-radtan8, ds, eucm, ucm; others are refused",
    ),
    applied(
        "value0.intrinsics.intrinsics.fx value0.intrinsics.intrinsics.fy \
         value0.intrinsics.intrinsics.cx value0.intrinsics.intrinsics.cy",
        "px",
    ),
    applied(
        "value0.intrinsics.intrinsics.k1 value0.intrinsics.intrinsics.k2 \
         value0.intrinsics.intrinsics.k3 value0.intrinsics.intrinsics.k4 \
         value0.intrinsics.intrinsics.k5 value0.intrinsics.intrinsics.k6 \
         value0.intrinsics.intrinsics.p1 value0.intrinsics.intrinsics.p2",
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    reported(
        Neutral::Zero,
        "value0.intrinsics.intrinsics.rpmax",
        "radius limit of the model; camsim computes the limit itself",
    ),
    applied(
        "value0.intrinsics.intrinsics.xi value0.intrinsics.intrinsics.alpha \
         value0.intrinsics.intrinsics.beta value0.intrinsics.intrinsics.w",
        "coefficient; refused unless zero if camera_type does not have it",
    ),
    applied("value0.resolution", "width and height of each camera"),
    reported(
        Neutral::Never,
        "value0.vignette.** value0.vignette",
        "radial vignette spline: convert it to a picture and set photometric.vignette",
    ),
    reported(
        Neutral::Never,
        "value0.T_imu_cam.**",
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    reported(
        Neutral::Zero,
        "value0.cam_time_offset_ns",
        "clock offset between cameras and IMU, ns: `--body` or `--rig` applies it",
    ),
    reported(Neutral::Zero, "value0.mocap_*", CLOCK),
    ignored("value0.T_mocap_world.** value0.T_imu_marker.**", "motion capture"),
    ignored("value0.calib_* value0.imu_update_rate value0.accel_* value0.gyro_*", IMU),
    ignored("value0.view_offset", "a setting of that program"),
];

fn matches(document: &Document) -> bool {
    find(&document.value, "value0.intrinsics").is_some_and(Value::is_array)
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let roots = |index: usize| {
        ["intrinsics", "T_imu_cam", "vignette"].map(|key| format!("value0.{key}[{index}]")).to_vec()
    };
    let entry = |(index, value): (usize, _)| CameraEntry {
        name: format!("cam{index}"),
        aliases: vec![index.to_string()],
        value,
        roots: roots(index),
    };
    Ok(list(&document.value, "value0.intrinsics").iter().enumerate().map(entry).collect())
}

fn import(document: &Document, entry: &CameraEntry<'_>) -> Result<ReadCamera, KeyProblem> {
    let value = entry.value;
    let index: usize = entry.name.trim_start_matches("cam").parse().unwrap_or(0);
    let get = |key: &str| number(value, &format!("intrinsics.{key}"));
    let all = |keys: &[&str]| keys.iter().map(|key| get(key)).collect::<Result<Vec<f64>, _>>();
    let kind = word(value, "camera_type").unwrap_or_default();
    let lens = NamedLens::named(LENSES, kind).ok_or_else(|| {
        let advice = "calibrate with kb4, ds, eucm, ucm or pinhole-radtan8";
        KeyProblem::new("camera_type", lens_models::unsupported_model(kind, advice))
    })?;
    let names = lens.coefficients();
    let coefficients = all(&names)?;
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
    Ok(camera(size_px, [get("fx")?, get("fy")?], [get("cx")?, get("cy")?], lens.model, coefficients))
}

fn as_pair(value: &Value) -> Result<Vec<f64>, KeyProblem> {
    let list: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
    list.ok_or_else(|| KeyProblem::new("value0.resolution", "is not a list of width and height"))
}

/// `T_imu_cam` as quaternion and translation, and the clock that all cameras share.
fn poses(found: &mut Extrinsics, camera: &Selected<'_>) -> Result<(), KeyProblem> {
    let (root, index) = (&camera.document.value, camera.index);
    if let Some(shift_ns) = optional_number(root, "value0.cam_time_offset_ns")? {
        found.shift_s = Some(1e-9 * shift_ns);
        found.applied.push("value0.cam_time_offset_ns".to_owned());
    }
    let poses = find(root, "value0.T_imu_cam").and_then(Value::as_array);
    let Some(pose) = poses.and_then(|poses| poses.get(index)) else { return Ok(()) };
    let get = |key: &str| {
        number(pose, key)
            .map_err(|problem| KeyProblem::new(format!("value0.T_imu_cam[{index}].{key}"), problem.message))
    };
    let rotation = DQuat::from_xyzw(get("qx")?, get("qy")?, get("qz")?, get("qw")?);
    if (rotation.length() - 1.0).abs() > 1e-3 {
        let text = format!("is a quaternion of length {}, not 1", rotation.length());
        return Err(KeyProblem::new(format!("value0.T_imu_cam[{index}]"), text));
    }
    let translation_m = DVec3::new(get("px")?, get("py")?, get("pz")?);
    found.placement = Some(Placement::InBody(Rigid { rotation: rotation.normalize(), translation_m }));
    let keys = ["px", "py", "pz", "qx", "qy", "qz", "qw"];
    found.applied.extend(keys.map(|key| format!("value0.T_imu_cam[{index}].{key}")));
    Ok(())
}
