//! `sensor.yaml` of EuRoC/ASL.

use super::{
    Calibration, CalibrationError,
    axes::Rigid,
    lens_names::{self, Family},
    text::{list, matrix_list, real},
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
