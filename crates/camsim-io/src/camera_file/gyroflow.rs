//! Gyroflow lens profiles (JSON): OpenCV fisheye calibrations with the readout time.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{
    Document, KeyProblem, at_most_coefficients, camera_matrix, find, flag, number, numbers, optional_number,
    size, word,
};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::{CameraFormat, ImportedCamera, camera};

const IN_CAMERA_CORRECTION: &str =
    "lens correction by the camera's software is not supported: record without it";
const STRETCHED: &str = "stretched (anamorphic) recordings are not supported";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new("calib_dimension.w", Treatment::Applied, "width of the calibration pictures"),
    KeyRow::new("calib_dimension.h", Treatment::Applied, "height"),
    KeyRow::new("orig_dimension.*", Treatment::Applied, "reported where it differs from calib_dimension"),
    KeyRow::new(
        "fisheye_params.camera_matrix",
        Treatment::Applied,
        "focal lengths; the principal point is used if `asymmetrical` is true, as in Gyroflow",
    ),
    KeyRow::new("fisheye_params.distortion_coeffs", Treatment::Applied, "k1 k2 k3 k4"),
    KeyRow::new(
        "fisheye_params.radial_distortion_limit",
        Treatment::Reported(Neutral::Never),
        "camsim computes the limit itself",
    ),
    KeyRow::new(
        "calib_params.camera_matrix",
        Treatment::Applied,
        "used instead of fisheye_params if use_opencv_standard is true",
    ),
    KeyRow::new("calib_params.distortion_coeffs", Treatment::Applied, "k1 k2 p1 p2 k3 k4 k5 k6"),
    KeyRow::new(
        "calib_params.radial_distortion_limit",
        Treatment::Reported(Neutral::Never),
        "camsim computes the limit itself",
    ),
    KeyRow::new("use_opencv_standard", Treatment::Applied, "selects calib_params"),
    KeyRow::new("use_opencv_fisheye", Treatment::Applied, "false, without use_opencv_standard, is refused"),
    KeyRow::new(
        "asymmetrical",
        Treatment::Applied,
        "false or missing: the principal point is the centre (w/2, h/2), not the matrix's",
    ),
    KeyRow::new("crop", Treatment::Applied, "divides the focal lengths"),
    KeyRow::new("distortion_model", Treatment::Applied, "opencv_fisheye; others are refused"),
    KeyRow::new(
        "distortion_model_id",
        Treatment::Refused(Neutral::Zero),
        "not OpenCV's fisheye, the only model of Gyroflow that can be imported",
    ),
    KeyRow::new("digital_lens", Treatment::Refused(Neutral::Never), IN_CAMERA_CORRECTION),
    KeyRow::new("digital_lens_params", Treatment::Reported(Neutral::Never), IN_CAMERA_CORRECTION),
    KeyRow::new("is_superview", Treatment::Refused(Neutral::Zero), IN_CAMERA_CORRECTION),
    KeyRow::new("input_horizontal_stretch", Treatment::Refused(Neutral::ZeroOrOne), STRETCHED),
    KeyRow::new("input_vertical_stretch", Treatment::Refused(Neutral::ZeroOrOne), STRETCHED),
    KeyRow::new("fps", Treatment::FrameRate, "frames per second"),
    KeyRow::new(
        "frame_readout_time",
        Treatment::Readout(1.0),
        "ms per frame; negative: from the last row to the first",
    ),
    KeyRow::new(
        "interpolations",
        Treatment::Reported(Neutral::Never),
        "calibrations at other focal lengths; the profile's own is used",
    ),
    KeyRow::new(
        "interpolations.**",
        Treatment::Reported(Neutral::Never),
        "calibrations at other focal lengths; the profile's own is used",
    ),
    KeyRow::new(
        "compatible_settings.**",
        Treatment::Reported(Neutral::Never),
        "other sizes and frame rates with their readout times: set fps and shutter.readout_ms for one of \
         them",
    ),
    KeyRow::new("compatible_settings", Treatment::Ignored, "none"),
    KeyRow::new("output_dimension.*", Treatment::Ignored, "size of the stabilised video"),
    KeyRow::new("focal_length", Treatment::Ignored, "mm, informative"),
    KeyRow::new("crop_factor", Treatment::Ignored, "informative"),
    KeyRow::new("num_images", Treatment::Ignored, "number of pictures"),
    KeyRow::new("fisheye_params.RMS_error", Treatment::Ignored, "calibration residual"),
    KeyRow::new("calib_params.RMS_error", Treatment::Ignored, "calibration residual"),
    KeyRow::new("sync_settings", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("sync_settings.**", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("gyro_lpf", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("official", Treatment::Ignored, "origin"),
    KeyRow::new("date", Treatment::Ignored, "date or version"),
    KeyRow::new("calibrator_version", Treatment::Ignored, "date or version"),
    KeyRow::new("name", Treatment::Ignored, "a name"),
    KeyRow::new("identifier", Treatment::Ignored, "a name"),
    KeyRow::new("note", Treatment::Ignored, "free text"),
    KeyRow::new("calibrated_by", Treatment::Ignored, "origin"),
    KeyRow::new("camera_brand", Treatment::Ignored, "a name"),
    KeyRow::new("camera_model", Treatment::Ignored, "a name"),
    KeyRow::new("camera_setting", Treatment::Ignored, "a name"),
    KeyRow::new("lens_model", Treatment::Ignored, "a name"),
];

pub(super) fn matches(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    document.root.is_empty() && has("calib_dimension") && (has("fisheye_params") || has("calib_params"))
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    if let Some(model) = word(value, "distortion_model")
        && model != "opencv_fisheye"
    {
        return Err(KeyProblem::new(
            "distortion_model",
            format!("is `{model}`: only opencv_fisheye can be imported"),
        ));
    }
    let [width, height] = [number(value, "calib_dimension.w")?, number(value, "calib_dimension.h")?];
    let size_px = size("calib_dimension", [width, height])?;
    let (is_standard, is_fisheye) =
        (flag(value, "use_opencv_standard")?.unwrap_or(false), flag(value, "use_opencv_fisheye")?);
    let (section, model, max) = match (is_standard, is_fisheye) {
        (true, Some(true)) => {
            return Err(KeyProblem::new(
                "use_opencv_standard",
                "is true, and so is use_opencv_fisheye: set one of them to false",
            ));
        }
        (true, _) => ("calib_params", LensModel::BrownConrady, 8),
        (false, Some(false)) => {
            return Err(KeyProblem::new(
                "use_opencv_fisheye",
                "is false, and so is use_opencv_standard: set one of them to true",
            ));
        }
        (false, _) => ("fisheye_params", LensModel::KannalaBrandt, 4),
    };
    let (focal_px, matrix_point) = camera_matrix(value, &format!("{section}.camera_matrix"))?;
    let key = format!("{section}.distortion_coeffs");
    let mut coefficients =
        at_most_coefficients(&key, numbers(value, &key)?, max, "more coefficients than its model has")?;
    if model == LensModel::KannalaBrandt && coefficients.len() < 4 {
        let text = format!("has {} numbers instead of k1 k2 k3 k4; write zeros too", coefficients.len());
        return Err(KeyProblem::new(key, text));
    }
    if model == LensModel::BrownConrady {
        coefficients = super::lens_models::radial_tangential(&key, coefficients, 8)?;
    }
    let is_asymmetrical = flag(value, "asymmetrical")?.unwrap_or(false);
    let point = if is_asymmetrical { matrix_point } else { [0.5 * width, 0.5 * height] };
    let crop = optional_number(value, "crop")?.unwrap_or(1.0);
    if crop <= 0.0 {
        return Err(KeyProblem::new("crop", format!("is {crop}, not a positive factor")));
    }
    let mut imported =
        camera(CameraFormat::Gyroflow, size_px, focal_px.map(|f| f / crop), point, model, coefficients);
    if !is_asymmetrical && matrix_point != point {
        let text = format!(
            "the principal point is the centre {point:?}, because `asymmetrical` is not true: like Gyroflow, \
             camsim ignores the matrix's {matrix_point:?}"
        );
        imported.notes.push(text);
    }
    if crop != 1.0 {
        imported.notes.push(format!("the focal lengths were divided by crop = {crop}"));
    }
    if find(value, "orig_dimension").is_some() {
        let original = [number(value, "orig_dimension.w")?, number(value, "orig_dimension.h")?];
        if original != [width, height] {
            let text = format!(
                "orig_dimension is {original:?}, but the size is that of the calibration, {:?}",
                [width, height]
            );
            imported.notes.push(text);
        }
    }
    Ok(imported)
}
