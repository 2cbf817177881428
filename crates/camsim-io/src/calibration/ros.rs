//! ROS `camera_info`: the YAML file of `camera_calibration`.

use super::{
    Calibration, CalibrationError, Intrinsics,
    lens_names::{self, Family},
    text::list,
};

/// The file of one camera.
pub(crate) fn file(camera: &Calibration) -> Result<String, CalibrationError> {
    let (model, d) = lens_names::lens(Family::Ros, camera)?;
    let lens = &camera.intrinsics;
    let [width, height] = lens.size_px;
    let name = if camera.spec.name.is_empty() { "camera" } else { &camera.spec.name };
    let matrix = |key: &str, rows: usize, data: &[f64]| {
        format!("{key}:\n  rows: {rows}\n  cols: {}\n  data: {}\n", data.len() / rows, list(data))
    };
    Ok(format!(
        "# (0, 0) is the centre of the first pixel.\nimage_width: {width}\nimage_height: {height}\n\
         camera_name: {name}\n{}distortion_model: {model}\n{}{}{}",
        matrix("camera_matrix", 3, &camera_matrix(lens)),
        matrix("distortion_coefficients", 1, &d),
        matrix("rectification_matrix", 3, &NO_ROTATION),
        matrix("projection_matrix", 3, &projection_matrix(lens)),
    ))
}

/// R of a camera that is not part of a rectified pair.
pub(crate) const NO_ROTATION: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// K.
pub(crate) fn camera_matrix(lens: &Intrinsics) -> [f64; 9] {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

/// P of pictures that are rectified with the same camera matrix.
pub(crate) fn projection_matrix(lens: &Intrinsics) -> [f64; 12] {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
}
