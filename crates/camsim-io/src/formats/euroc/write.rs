//! `sensor.yaml` of EuRoC/ASL.

use crate::formats::axes::Rigid;
use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::lens_names::Family;
use crate::formats::writing::{Calibration, CalibrationError, lens_names};
use crate::text::numbers::{list, matrix_list, real};

pub(crate) const WRITER: Writer = Writer {
    note: |camera| lens_names::euroc_note(camera, camera.label()),
    ..Writer::new(
        "euroc",
        "sensor.yaml",
        Content::One(|camera, body| {
            sensor_yaml(camera, &body.body_from_imu.inverse().of(&camera.body_from_camera()))
        }),
        &[Field::Pose, Field::Rate],
    )
};

/// The file of one camera; `b_from_camera` is its pose in the body B of the file.
///
/// # Errors
/// The format does not have the lens.
pub(crate) fn sensor_yaml(camera: &Calibration, b_from_camera: &Rigid) -> Result<String, CalibrationError> {
    let lens = &camera.intrinsics;
    let [width, height] = lens.size_px;
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    let (model, coefficients) = lens_names::lens(Family::Euroc, camera)?;
    Ok(format!(
        "# (0, 0) is the centre of the first pixel.\nsensor_type: camera\ncomment: camsim {name}\n\n\
         # x_B = T_BS x_S, S the optical axes.\nT_BS:\n  cols: 4\n  rows: 4\n  data: {data}\n\n\
         rate_hz: {rate}\nresolution: [{width}, {height}]\ncamera_model: pinhole\n\
         intrinsics: {intrinsics} #fu, fv, cu, cv\ndistortion_model: {model}\n\
         distortion_coefficients: {coefficients}\n",
        name = camera.spec.name,
        data = matrix_list(&b_from_camera.matrix()),
        rate = real(camera.spec.fps),
        intrinsics = list(&[fx, fy, cx, cy]),
        coefficients = list(&coefficients),
    ))
}
