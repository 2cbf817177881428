//! nerfstudio's `transforms.json`. The centre of the first pixel is (0.5, 0.5) there.

use camsim_core::scenario::LensModel;

use super::LENSES;
use crate::formats::named_lens::NamedLens;
use crate::formats::writing::exported::{Content, Writer};
use crate::formats::writing::lens_names::no_such_lens;
use crate::formats::writing::{Calibration, CalibrationError, Intrinsics};
use crate::text::numbers::real;

pub(crate) const WRITER: Writer =
    Writer::new("nerfstudio", "transforms.json", Content::One(|camera, _| transforms_json(camera)), &[]);

/// Name of the model, and its keys.
///
/// # Errors
/// nerfstudio does not have the lens.
pub(crate) fn model(camera: &Calibration) -> Result<(&'static str, String), CalibrationError> {
    let (lens, coefficients) = NamedLens::that_holds(LENSES, camera, "nerfstudio")?;
    if lens.model == LensModel::Equirectangular {
        return Err(no_such_lens(camera, "nerfstudio"));
    }
    let Intrinsics { focal_px: [fx, fy], principal_px: [cx, cy], size_px: [w, h], .. } = camera.intrinsics;
    let shift = 0.5;
    let mut text = format!(
        "\"w\": {w}, \"h\": {h}, \"fl_x\": {}, \"fl_y\": {}, \"cx\": {}, \"cy\": {}",
        real(fx),
        real(fy),
        real(cx + shift),
        real(cy + shift)
    );
    for (name, value) in coefficients {
        text += &format!(", \"{name}\": {}", real(value));
    }
    Ok((lens.name, text))
}

/// A `transforms.json` without pictures.
///
/// # Errors
/// As [`model`].
pub(crate) fn transforms_json(camera: &Calibration) -> Result<String, CalibrationError> {
    let (model, keys) = model(camera)?;
    Ok(format!("{{\n  \"camera_model\": \"{model}\",\n  {keys},\n  \"frames\": []\n}}\n"))
}
