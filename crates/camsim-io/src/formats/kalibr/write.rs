//! Kalibr's camchain, and OpenVINS', which has the inverse poses.

use std::fmt::Write as _;

use camsim_core::scenario::{LensModel, Readout};

use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::lens_names::Family;
use crate::formats::writing::{Calibration, CalibrationError, ImuReference, lens_names};
use crate::text::numbers::{list, matrix_rows, real};

const FIELDS: &[Field] = &[
    Field::Number,
    Field::Pose,
    Field::TimeShift,
    Field::Readout(&[Readout::TopToBottom, Readout::BottomToTop]),
];

pub(crate) const WRITER: Writer = Writer::new(
    "kalibr",
    "camchain.yaml",
    Content::Rig(|cameras, imu| chain_yaml(cameras, Some(imu), PoseKey::CamImu)),
    FIELDS,
);

/// OpenVINS'.
pub(crate) const OPENVINS_WRITER: Writer = Writer::new(
    "openvins",
    "kalibr_imucam_chain.yaml",
    Content::Rig(|cameras, imu| {
        Ok(format!("%YAML:1.0\n\n{}", chain_yaml(cameras, Some(imu), PoseKey::ImuCam)?))
    }),
    FIELDS,
);

/// The key of the pose of a camera and its inertial sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PoseKey {
    /// Kalibr's `T_cam_imu`.
    CamImu,
    /// OpenVINS' `T_imu_cam`.
    ImuCam,
}

/// The chain of cameras, from an inertial sensor if there is one.
///
/// # Errors
/// Kalibr does not have the lens; or OpenVINS, which knows a part of Kalibr's.
pub(crate) fn chain_yaml(
    cameras: &[Calibration],
    imu: Option<&ImuReference>,
    key: PoseKey,
) -> Result<String, CalibrationError> {
    let mut text = "# (0, 0) is the centre of the first pixel. T_a_b takes coordinates in b to those in a.\n\
                    # t_imu = t_cam + timeshift_cam_imu, for the image's centre; line_delay (s) counts rows from there.\n"
        .to_owned();
    for (i, camera) in cameras.iter().enumerate() {
        let (projection, mut intrinsics, model, coefficients) = lens_of(camera)?;
        if key == PoseKey::ImuCam && projection != "pinhole" {
            return Err(lens_names::no_such_lens(camera, "OpenVINS"));
        }
        let lens = &camera.intrinsics;
        let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
        intrinsics.extend([fx, fy, cx, cy]);
        let camera_from_body = camera.body_from_camera().inverse();
        let _ = writeln!(text, "cam{i}:");
        if let Some(imu) = imu {
            let camera_from_imu = camera_from_body.of(&imu.body_from_imu);
            let (name, pose) = match key {
                PoseKey::CamImu => ("T_cam_imu", camera_from_imu),
                PoseKey::ImuCam => ("T_imu_cam", camera_from_imu.inverse()),
            };
            let rows = matrix_rows(&pose.matrix());
            let shift_s = camera.stamp_to_centre_s() + imu.clock_offset_s;
            let _ = writeln!(text, "  {name}:\n{rows}  timeshift_cam_imu: {}", real(shift_s));
        }
        if let Some(before) = i.checked_sub(1).map(|before| &cameras[before]) {
            let pose = camera_from_body.of(&before.body_from_camera());
            let _ = write!(text, "  T_cn_cnm1:\n{}", matrix_rows(&pose.matrix()));
        }
        let others: Vec<String> = (0..cameras.len()).filter(|k| *k != i).map(|k| k.to_string()).collect();
        let _ = write!(
            text,
            "  cam_overlaps: [{}]\n  camera_model: {projection}\n  distortion_coeffs: {}\n  distortion_model: {model}\n  \
             intrinsics: {}\n  resolution: [{w}, {h}]\n  rostopic: /cam{i}/image_raw\n",
            others.join(", "),
            list(&coefficients),
            list(&intrinsics)
        );
        if let Some(delay_s) = camera.line_delay_s() {
            let _ = writeln!(text, "  line_delay: {}", real(delay_s));
        }
    }
    Ok(text)
}

/// Projection, its parameters before the focal lengths, distortion and its coefficients.
type Lens = (&'static str, Vec<f64>, &'static str, Vec<f64>);

fn lens_of(camera: &Calibration) -> Result<Lens, CalibrationError> {
    let lens = &camera.intrinsics;
    for (projection, model, count) in [("ds", LensModel::DoubleSphere, 2), ("eucm", LensModel::Eucm, 2)] {
        if let Some(k) = lens.of_model(model, count) {
            return Ok((projection, k.to_vec(), "none", Vec::new()));
        }
    }
    if let Some([xi, k @ ..]) = lens.of_model(LensModel::Mei, 5) {
        return Ok(("omni", vec![*xi], "radtan", k.to_vec()));
    }
    let (model, coefficients) = lens_names::lens(Family::Kalibr, camera)?;
    Ok(("pinhole", Vec::new(), model, coefficients))
}
