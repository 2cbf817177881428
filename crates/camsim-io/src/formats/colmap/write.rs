//! COLMAP's `cameras.txt`. The centre of the first pixel is (0.5, 0.5) there.

use std::fmt::Write as _;

use super::{MODELS, Model};
use crate::formats::writing::exported::{Content, Writer};
use crate::formats::writing::lens_names::no_such_lens;
use crate::formats::writing::{Calibration, CalibrationError, Intrinsics};
use crate::write::Number;

pub(crate) const WRITER: Writer =
    Writer::new("colmap", "cameras.txt", Content::Rig(|cameras, _| cameras_txt(cameras)), &[]);

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
    let Intrinsics { focal_px: [fx, fy], principal_px, .. } = camera.intrinsics;
    let held = |model: &Model| {
        let coefficients = camera.intrinsics.of_model(model.lens, model.coefficients.len())?;
        let focal: &[f64] = if model.focal_lengths.len() == 2 { &[fx, fy] } else { &[fx] };
        let is_held = focal.len() == 2 || fx == fy;
        is_held.then(|| [focal, &principal_px.map(|px| px + 0.5), coefficients].concat())
    };
    let found = MODELS.iter().find_map(|model| Some((model.name, model.number, held(model)?)));
    found.ok_or_else(|| no_such_lens(camera, "COLMAP"))
}
