//! Gyroflow lens profiles (JSON): OpenCV fisheye calibrations with the readout time.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, refused, reported};
use crate::formats::reading::lens_models::radial_tangential;
use crate::text::document::{
    Document, KeyProblem, at_most_coefficients, camera_matrix, find, flag, number, numbers, optional_number,
    size, word,
};

const IN_CAMERA_CORRECTION: &str =
    "lens correction by the camera's software is not supported: record without it";
const STRETCHED: &str = "stretched (anamorphic) recordings are not supported";

pub(crate) const READER: Reader =
    Reader::new("gyroflow", "Gyroflow lens profiles", matches, &[("", KEYS)], |camera| {
        import(camera.value())
    });

const KEYS: &[KeyRow] = &[
    applied("calib_dimension.w", "width of the calibration pictures"),
    applied("calib_dimension.h", "height"),
    applied("orig_dimension.*", "reported where it differs from calib_dimension"),
    applied(
        "fisheye_params.camera_matrix",
        "focal lengths; the principal point is used if `asymmetrical` is true, as in Gyroflow",
    ),
    applied("fisheye_params.distortion_coeffs", "k1 k2 k3 k4"),
    reported(Neutral::Never, "fisheye_params.radial_distortion_limit", "camsim computes the limit itself"),
    applied("calib_params.camera_matrix", "used instead of fisheye_params if use_opencv_standard is true"),
    applied("calib_params.distortion_coeffs", "k1 k2 p1 p2 k3 k4 k5 k6"),
    reported(Neutral::Never, "calib_params.radial_distortion_limit", "camsim computes the limit itself"),
    applied("use_opencv_standard", "selects calib_params"),
    applied("use_opencv_fisheye", "false, without use_opencv_standard, is refused"),
    applied(
        "asymmetrical",
        "false or missing: the principal point is the centre (w/2, h/2), not the matrix's",
    ),
    applied("crop", "divides the focal lengths"),
    applied("distortion_model", "opencv_fisheye; others are refused"),
    refused(
        Neutral::Zero,
        "distortion_model_id",
        "not OpenCV's fisheye, the only model of Gyroflow that can be imported",
    ),
    refused(Neutral::Never, "digital_lens", IN_CAMERA_CORRECTION),
    reported(Neutral::Never, "digital_lens_params", IN_CAMERA_CORRECTION),
    refused(Neutral::Zero, "is_superview", IN_CAMERA_CORRECTION),
    refused(Neutral::ZeroOrOne, "input_horizontal_stretch input_vertical_stretch", STRETCHED),
    KeyRow::new(Treatment::FrameRate, "fps", "frames per second"),
    KeyRow::new(
        Treatment::Readout(1.0),
        "frame_readout_time",
        "ms per frame; negative: from the last row to the first",
    ),
    reported(
        Neutral::Never,
        "interpolations interpolations.**",
        "calibrations at other focal lengths; the profile's own is used",
    ),
    reported(
        Neutral::Never,
        "compatible_settings.**",
        "other sizes and frame rates with their readout times: set fps and shutter.readout_ms for one of \
         them",
    ),
    ignored("compatible_settings", "none"),
    ignored("output_dimension.*", "size of the stabilised video"),
    ignored("focal_length", "mm, informative"),
    ignored("crop_factor", "informative"),
    ignored("num_images", "number of pictures"),
    ignored("fisheye_params.RMS_error calib_params.RMS_error", "calibration residual"),
    ignored("sync_settings sync_settings.** gyro_lpf", "a setting of that program"),
    ignored("official", "origin"),
    ignored("date calibrator_version", "date or version"),
    ignored("name identifier", "a name"),
    ignored("note", "free text"),
    ignored("calibrated_by", "origin"),
    ignored("camera_brand camera_model camera_setting lens_model", "a name"),
];

fn matches(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    has("calib_dimension") && (has("fisheye_params") || has("calib_params"))
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
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
        coefficients = radial_tangential(&key, coefficients, 8)?;
    }
    let is_asymmetrical = flag(value, "asymmetrical")?.unwrap_or(false);
    let point = if is_asymmetrical { matrix_point } else { [0.5 * width, 0.5 * height] };
    let crop = optional_number(value, "crop")?.unwrap_or(1.0);
    if crop <= 0.0 {
        return Err(KeyProblem::new("crop", format!("is {crop}, not a positive factor")));
    }
    let mut imported = camera(size_px, focal_px.map(|f| f / crop), point, model, coefficients);
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
