//! OpenCV's FileStorage (YAML): the keys of its calibration samples.

use std::fmt::Write as _;

use super::{
    Calibration, CalibrationError,
    lens_names::{self, Family},
    text::{Element, opencv_matrix},
};

/// The file of one camera.
pub(crate) fn file(camera: &Calibration) -> Result<String, CalibrationError> {
    let lens = &camera.intrinsics;
    let (model, coefficients) = lens_names::lens(Family::OpenCv, camera)?;
    let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let mut text = format!(
        "%YAML:1.0\n---\n# (0, 0) is the centre of the first pixel.\nimage_width: {w}\nimage_height: {h}\n\
         fisheye_model: {}\n",
        u8::from(model == "fisheye")
    );
    text +=
        &opencv_matrix("camera_matrix", [3, 3], Element::Double, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    text +=
        &opencv_matrix("distortion_coefficients", [1, coefficients.len()], Element::Double, &coefficients);
    let _ = writeln!(text, "# {}", order(model, coefficients.len()));
    Ok(text)
}

fn order(model: &str, count: usize) -> &'static str {
    match (model, count) {
        ("fisheye", _) => "k1 k2 k3 k4 of the module fisheye",
        (_, 5) => "k1 k2 p1 p2 k3",
        (_, 8) => "k1 k2 p1 p2 k3 k4 k5 k6",
        (_, 12) => "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4",
        _ => "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y",
    }
}
