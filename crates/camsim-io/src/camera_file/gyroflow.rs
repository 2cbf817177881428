//! Gyroflow lens profiles (JSON): OpenCV fisheye calibrations with the readout time.

use camsim_core::scenario::{LensModel, Readout};

use super::document::{Document, Problem, at_most, camera_matrix, find, number, numbers, optional_number, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty() && ["calib_dimension", "fisheye_params"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
    if let Some(model) = word(value, "distortion_model")
        && model != "opencv_fisheye"
    {
        return Err(Problem::new("distortion_model", format!("is `{model}`: only opencv_fisheye can be imported")));
    }
    if let Some(lens) = word(value, "digital_lens") {
        return Err(Problem::new("digital_lens", format!("is `{lens}`: what the camera's own software bends is not modelled")));
    }
    for key in ["input_horizontal_stretch", "input_vertical_stretch"] {
        if optional_number(value, key)?.is_some_and(|stretch| stretch != 1.0 && stretch != 0.0) {
            return Err(Problem::new(key, "stretched (anamorphic) recordings are not supported"));
        }
    }
    let flag = |key: &str| find(value, key).and_then(serde_json::Value::as_bool).unwrap_or(false);
    if flag("is_superview") {
        return Err(Problem::new("is_superview", "what the camera's own software bends is not modelled"));
    }
    let size_px = size("calib_dimension", [number(value, "calib_dimension.w")?, number(value, "calib_dimension.h")?])?;
    let standard = flag("use_opencv_standard");
    let (section, model, max) =
        if standard { ("calib_params", LensModel::BrownConrady, 8) } else { ("fisheye_params", LensModel::KannalaBrandt, 4) };
    let (focal_px, principal_point_px) = camera_matrix(value, &format!("{section}.camera_matrix"))?;
    let key = format!("{section}.distortion_coeffs");
    let coefficients = at_most(&key, numbers(value, &key)?, max, "more coefficients than its model has")?;
    let mut imported = camera(CameraFormat::Gyroflow, size_px, focal_px, principal_point_px, model, coefficients);

    match optional_number(value, "fps")?.filter(|fps| *fps > 0.0) {
        Some(fps) => imported.spec.fps = fps,
        None => imported.notes.push("the profile has no frame rate: fps is 30".to_owned()),
    }
    let shutter = &mut imported.spec.shutter;
    match optional_number(value, "frame_readout_time")? {
        _ if flag("global_shutter") => {}
        Some(readout_ms) => {
            shutter.readout_ms = readout_ms.abs();
            // A negative time means bottom to top.
            shutter.readout = match (word(value, "frame_readout_direction").unwrap_or("TopToBottom"), readout_ms < 0.0) {
                ("TopToBottom", false) | ("BottomToTop", true) => Readout::TopToBottom,
                ("TopToBottom", true) | ("BottomToTop", false) => Readout::BottomToTop,
                ("LeftToRight", false) | ("RightToLeft", true) => Readout::LeftToRight,
                ("RightToLeft", false) | ("LeftToRight", true) => Readout::RightToLeft,
                (other, _) => return Err(Problem::new("frame_readout_direction", format!("is `{other}`, which is no direction"))),
            };
        }
        None => imported.notes.push("the profile has no frame_readout_time: the shutter is global".to_owned()),
    }
    if find(value, &format!("{section}.radial_distortion_limit")).is_some() {
        imported.notes.push("radial_distortion_limit was left out: where the lens folds is found by itself".to_owned());
    }
    Ok(imported)
}
