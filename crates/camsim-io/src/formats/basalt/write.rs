//! Basalt's calibration JSON, which its cereal reader wants complete.

use serde_json::{Map, Value, json};

use super::{LENSES, RADTAN8};
use crate::formats::named_lens::NamedLens;
use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::{Calibration, CalibrationError, ImuReference};
use crate::text::numbers::xyzw;

pub(crate) const WRITER: Writer =
    Writer::new("basalt", "calibration.json", Content::Rig(json), &[Field::Pose, Field::TimeShift]);

/// The file of all cameras.
///
/// # Errors
/// Basalt does not have a lens, or cameras have different clocks.
pub(crate) fn json(cameras: &[Calibration], imu: &ImuReference) -> Result<String, CalibrationError> {
    let shifts_ns: Vec<i64> = cameras.iter().map(|camera| shift_ns(camera, imu)).collect();
    if shifts_ns.iter().any(|shift| *shift != shifts_ns[0]) {
        return Err(CalibrationError::Refused(format!(
            "basalt has one cam_time_offset_ns for all cameras, and theirs are {shifts_ns:?}: choose one with \
             `--camera`"
        )));
    }
    let intrinsics = cameras.iter().map(camera_value).collect::<Result<Vec<Value>, _>>()?;
    let value = json!({"value0": {
        "T_imu_cam": cameras.iter().map(|camera| pose_value(camera, imu)).collect::<Vec<Value>>(),
        "intrinsics": intrinsics,
        "resolution": cameras.iter().map(|camera| camera.intrinsics.size_px).collect::<Vec<_>>(),
        "vignette": [],
        "calib_accel_bias": (vec![0.0; 9]),
        "calib_gyro_bias": (vec![0.0; 12]),
        "imu_update_rate": 200.0,
        "accel_noise_std": (vec![0.016; 3]),
        "gyro_noise_std": (vec![0.000_282; 3]),
        "accel_bias_std": (vec![0.001; 3]),
        "gyro_bias_std": (vec![0.0001; 3]),
        "cam_time_offset_ns": shifts_ns.first().copied().unwrap_or(0),
    }});
    let text = serde_json::to_string_pretty(&value)
        .map_err(|error| CalibrationError::Refused(format!("basalt: {error}")))?;
    Ok(text + "\n")
}

fn shift_ns(camera: &Calibration, imu: &ImuReference) -> i64 {
    (1e9 * (camera.stamp_to_centre_s() + imu.clock_offset_s)).round() as i64
}

fn pose_value(camera: &Calibration, imu: &ImuReference) -> Value {
    let pose = imu.body_from_imu.inverse().of(&camera.body_from_camera());
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation_m.to_array(), xyzw(pose.rotation));
    json!({"px": x, "py": y, "pz": z, "qx": qx, "qy": qy, "qz": qz, "qw": qw})
}

fn camera_value(camera: &Calibration) -> Result<Value, CalibrationError> {
    let (lens, coefficients) = NamedLens::that_holds(LENSES, camera, "Basalt")?;
    let ([fx, fy], [cx, cy]) = (camera.intrinsics.focal_px, camera.intrinsics.principal_px);
    // rpmax is the largest normalised radius; 0 is none.
    let limit = (lens.name == RADTAN8).then_some(("rpmax", 0.0));
    let all = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)].into_iter().chain(coefficients).chain(limit);
    let parameters: Map<String, Value> = all.map(|(name, value)| (name.to_owned(), json!(value))).collect();
    Ok(json!({"camera_type": lens.name, "intrinsics": parameters}))
}
