//! ROS camera_info YAML, as written by `camera_calibration`.

use camsim_core::scenario::LensModel;

use super::document::{Document, Problem, at_most, camera_matrix, find, number, numbers, optional_number, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty() && ["image_width", "camera_matrix", "distortion_model"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
    let (focal_px, principal_point_px) = camera_matrix(value, "camera_matrix")?;
    let size_px = size("image_width", [number(value, "image_width")?, number(value, "image_height")?])?;
    for key in ["binning_x", "binning_y"] {
        if optional_number(value, key)?.is_some_and(|binning| binning > 1.0) {
            return Err(Problem::new(key, "binned images are not supported: give the calibration of the binned size"));
        }
    }
    let coefficients = numbers(value, "distortion_coefficients")?;
    let (model, coefficients) = match word(value, "distortion_model").unwrap_or_default() {
        "plumb_bob" => (LensModel::BrownConrady, at_most("distortion_coefficients", coefficients, 5, "plumb_bob has five")?),
        "rational_polynomial" => {
            (LensModel::BrownConrady, at_most("distortion_coefficients", coefficients, 8, "rational_polynomial has eight")?)
        }
        "equidistant" | "fisheye" => {
            (LensModel::KannalaBrandt, at_most("distortion_coefficients", coefficients, 4, "equidistant has four")?)
        }
        other => {
            return Err(Problem::new(
                "distortion_model",
                format!("is `{other}`: plumb_bob, rational_polynomial and equidistant can be imported"),
            ));
        }
    };
    let mut imported = camera(CameraFormat::RosCameraInfo, size_px, focal_px, principal_point_px, model, coefficients);
    imported.notes.push("the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned());
    Ok(imported)
}
