//! Settings of ORB-SLAM3 of version 1.0.

use std::fmt::Write as _;

use super::LENSES;
use crate::formats::axes::Rigid;
use crate::formats::named_lens::NamedLens;
use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::{Calibration, CalibrationError, ImuReference, Intrinsics};
use crate::text::numbers::{Element, opencv_matrix, real};

pub(crate) const WRITER: Writer = Writer::new(
    "orbslam3",
    "orb_slam3.yaml",
    Content::Rig(|all, imu| cameras(all, Some(imu))),
    &[Field::Pose, Field::WholeRate],
);

/// The cameras, one or two, with the pose of the first in the inertial sensor.
///
/// # Errors
/// ORB-SLAM3 does not have a lens, or the cameras are more than two or differ in what it has once.
pub(crate) fn cameras(
    cameras: &[Calibration],
    imu: Option<&ImuReference>,
) -> Result<String, CalibrationError> {
    check_pair(cameras)?;
    let mut text =
        "%YAML:1.0\n\n# (0, 0) is the centre of the first pixel.\nFile.version: \"1.0\"\n".to_owned();
    for (i, camera) in cameras.iter().enumerate() {
        if i == 0 {
            let _ = writeln!(text, "Camera.type: \"{}\"", kind(camera));
        }
        text += &camera_keys(i + 1, camera)?;
        if cameras.len() == 2 && camera.intrinsics.equidistant().is_some() {
            // Columns in which points of the other camera are looked for: all of them.
            let last = camera.intrinsics.size_px[0].saturating_sub(1);
            let number = i + 1;
            let _ =
                writeln!(text, "Camera{number}.overlappingBegin: 0\nCamera{number}.overlappingEnd: {last}");
        }
    }
    let Some(first) = cameras.first() else { return Ok(text) };
    let [width, height] = first.intrinsics.size_px;
    let _ = write!(
        text,
        "\nCamera.width: {width}\nCamera.height: {height}\nCamera.fps: {}\nCamera.RGB: 1\n",
        first.spec.fps.round()
    );
    if let [left, right] = cameras {
        let left_from_right = left.body_from_camera().inverse().of(&right.body_from_camera());
        text += "\nStereo.ThDepth: 60.0\n";
        text += &pose("Stereo.T_c1_c2", &left_from_right);
    }
    if let Some(imu) = imu {
        let b_from_camera = imu.body_from_imu.inverse().of(&first.body_from_camera());
        let _ = write!(text, "\n{}", pose("IMU.T_b_c1", &b_from_camera));
    }
    Ok(text)
}

/// A pose, whose elements its reader takes for floats.
fn pose(name: &str, pose: &Rigid) -> String {
    opencv_matrix(name, [4, 4], Element::Float, pose.matrix().as_flattened())
}

/// What it has once has to be the same for both.
fn check_pair(cameras: &[Calibration]) -> Result<(), CalibrationError> {
    let refuse = |message: String| Err(CalibrationError::Refused(message));
    match cameras {
        [_] => Ok(()),
        [left, right] => {
            let facts =
                |camera: &Calibration| (kind(camera), camera.intrinsics.size_px, camera.spec.fps.round());
            match facts(left) == facts(right) {
                true => Ok(()),
                false => refuse(format!(
                    "ORB-SLAM3 has one camera type, size and fps for both cameras, and {} has {:?}, {} {:?}: choose \
                     one with `--camera`",
                    left.label(),
                    facts(left),
                    right.label(),
                    facts(right)
                )),
            }
        }
        more => refuse(format!(
            "ORB-SLAM3 has one or two cameras, not {}: choose one with `--camera`",
            more.len()
        )),
    }
}

fn kind(camera: &Calibration) -> &'static str {
    if camera.intrinsics.equidistant().is_some() { "KannalaBrandt8" } else { "PinHole" }
}

fn camera_keys(number: usize, camera: &Calibration) -> Result<String, CalibrationError> {
    let (_, coefficients) = NamedLens::that_holds(LENSES, camera, "ORB-SLAM3")?;
    let Intrinsics { focal_px: [fx, fy], principal_px: [cx, cy], .. } = camera.intrinsics;
    let mut text = "\n".to_owned();
    let matrix = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    // A fifth coefficient is read if it is there.
    let is_written = |(name, value): &(&str, f64)| {
        camera.intrinsics.equidistant().is_some() || *name != "k3" || *value != 0.0
    };
    for (name, value) in matrix.into_iter().chain(coefficients.into_iter().filter(is_written)) {
        let _ = writeln!(text, "Camera{number}.{name}: {}", real(value));
    }
    Ok(text)
}
