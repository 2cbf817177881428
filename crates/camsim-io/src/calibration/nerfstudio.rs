//! nerfstudio's `transforms.json`. The centre of the first pixel is (0.5, 0.5) there.

use super::{Calibration, CalibrationError, lens_names::no_such_lens, text::real};

/// Name of the model, and its keys.
///
/// # Errors
/// nerfstudio does not have the lens.
pub(crate) fn model(camera: &Calibration) -> Result<(&'static str, String), CalibrationError> {
    let lens = &camera.intrinsics;
    let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let (model, names, values): (_, &[&str], Vec<f64>) = match (lens.equidistant(), lens.brown::<5>()) {
        (Some(k), _) => ("OPENCV_FISHEYE", &["k1", "k2", "k3", "k4"], k.to_vec()),
        (None, Some(k)) => ("OPENCV", &["k1", "k2", "p1", "p2", "k3"], k.to_vec()),
        (None, None) => return Err(no_such_lens(camera, "nerfstudio")),
    };
    let shift = 0.5;
    let mut text = format!(
        "\"w\": {w}, \"h\": {h}, \"fl_x\": {}, \"fl_y\": {}, \"cx\": {}, \"cy\": {}",
        real(fx),
        real(fy),
        real(cx + shift),
        real(cy + shift)
    );
    for (name, value) in names.iter().zip(values) {
        text += &format!(", \"{name}\": {}", real(value));
    }
    Ok((model, text))
}

/// A `transforms.json` without pictures.
///
/// # Errors
/// As [`model`].
pub(crate) fn transforms_json(camera: &Calibration) -> Result<String, CalibrationError> {
    let (model, keys) = model(camera)?;
    Ok(format!("{{\n  \"camera_model\": \"{model}\",\n  {keys},\n  \"frames\": []\n}}\n"))
}
