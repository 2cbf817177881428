//! COLMAP's `cameras.txt`. The centre of the first pixel is (0.5, 0.5) there.

use std::fmt::Write as _;

use camsim_core::scenario::LensModel;

use super::{Calibration, CalibrationError, lens_names::no_such_lens};
use crate::write::Number;

/// The file.
///
/// # Errors
/// COLMAP does not have the lens.
pub(crate) fn cameras_txt(cameras: &[Calibration]) -> Result<String, CalibrationError> {
    let mut text =
        format!("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: {}\n", cameras.len());
    for (i, camera) in cameras.iter().enumerate() {
        let (name, _, parameters) = camera_model(camera)?;
        let _ = writeln!(text, "{}", camera_line(i as u32 + 1, name, camera.intrinsics.size_px, &parameters));
    }
    Ok(text)
}

/// A line of `cameras.txt`.
pub(crate) fn camera_line(id: u32, model: &str, [width, height]: [u32; 2], parameters: &[f64]) -> String {
    let parameters = parameters.iter().map(|value| Number(*value).to_string()).collect::<Vec<_>>().join(" ");
    format!("{id} {model} {width} {height} {parameters}")
}

/// The smallest camera model that holds the lens: name, number, parameters.
///
/// # Errors
/// COLMAP does not have the lens.
pub(crate) fn camera_model(camera: &Calibration) -> Result<(&'static str, i32, Vec<f64>), CalibrationError> {
    let lens = &camera.intrinsics;
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px.map(|px| px + 0.5));
    if let Some([k1, k2, k3, k4]) = lens.equidistant() {
        return Ok(("OPENCV_FISHEYE", 5, vec![fx, fy, cx, cy, k1, k2, k3, k4]));
    }
    let with = |k: &[f64]| [&[fx, fy, cx, cy], k].concat();
    if let Some(k) = lens.of_model::<1>(LensModel::Fov) {
        return Ok(("FOV", 7, with(&k)));
    }
    if let Some(k) = lens.of_model::<12>(LensModel::Fisheye624) {
        return Ok(("RAD_TAN_THIN_PRISM_FISHEYE", 11, with(&k)));
    }
    if let Some(k) = lens.of_model::<1>(LensModel::Division) {
        return Ok(("DIVISION", 13, with(&k)));
    }
    if let Some(k) = lens.of_model::<2>(LensModel::Eucm) {
        return Ok(("EUCM", 16, with(&k)));
    }
    let all = lens.brown::<8>().ok_or_else(|| no_such_lens(camera, "COLMAP"))?;
    let [k1, k2, p1, p2, rest @ ..] = all;
    let is_radial = fx == fy && [p1, p2] == [0.0; 2];
    Ok(match (rest == [0.0; 4], is_radial) {
        (false, _) => ("FULL_OPENCV", 6, with(&all)),
        (true, true) if [k1, k2] == [0.0; 2] => ("SIMPLE_PINHOLE", 0, vec![fx, cx, cy]),
        (true, true) if k2 == 0.0 => ("SIMPLE_RADIAL", 2, vec![fx, cx, cy, k1]),
        (true, true) => ("RADIAL", 3, vec![fx, cx, cy, k1, k2]),
        (true, false) if [k1, k2, p1, p2] == [0.0; 4] => ("PINHOLE", 1, vec![fx, fy, cx, cy]),
        (true, false) => ("OPENCV", 4, vec![fx, fy, cx, cy, k1, k2, p1, p2]),
    })
}
