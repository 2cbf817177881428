//! ROS `camera_info`: the YAML file of `camera_calibration`.

use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::lens_names::Family;
use crate::formats::writing::{Calibration, CalibrationError, Intrinsics, lens_names};
use crate::text::numbers::list;

pub(crate) const WRITER: Writer =
    Writer::new("ros", "camera_info.yaml", Content::One(|camera, _| file(camera)), &[Field::Name]);

/// The file of one camera.
fn file(camera: &Calibration) -> Result<String, CalibrationError> {
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
        matrix("projection_matrix", 3, &projection_matrix(lens, [0.0; 2])),
    ))
}

/// R of a camera that is not part of a rectified pair.
pub(crate) const NO_ROTATION: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// K.
pub(crate) fn camera_matrix(lens: &Intrinsics) -> [f64; 9] {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

/// P of pictures that are rectified with the same camera matrix, of a camera that is so many metres to the right of
/// and below the first one of its pair.
pub(crate) fn projection_matrix(lens: &Intrinsics, [right_m, down_m]: [f64; 2]) -> [f64; 12] {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    // Without the sign of a zero.
    let [right_px, down_px] = [0.0 - fx * right_m, 0.0 - fy * down_m];
    [fx, 0.0, cx, right_px, 0.0, fy, cy, down_px, 0.0, 0.0, 1.0, 0.0]
}
