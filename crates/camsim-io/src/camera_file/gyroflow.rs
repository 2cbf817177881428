//! Gyroflow lens profiles (JSON): OpenCV fisheye calibrations with the readout time.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{
    Document, Problem, at_most, camera_matrix, find, flag, number, numbers, optional_number, size, word,
};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

const BENT: &str = "what the camera's own software bends is not modelled: film without it";
const STRETCHED: &str = "stretched (anamorphic) recordings are not supported";

pub(super) const KEYS: &[Key] = &[
    Key::new("calib_dimension.w", Use::Applied, "width: the matrix belongs to this size"),
    Key::new("calib_dimension.h", Use::Applied, "height"),
    Key::new("orig_dimension.*", Use::Applied, "named where it differs from calib_dimension"),
    Key::new(
        "fisheye_params.camera_matrix",
        Use::Applied,
        "focal lengths; the principal point counts where `asymmetrical` is true, as in Gyroflow",
    ),
    Key::new("fisheye_params.distortion_coeffs", Use::Applied, "k1 k2 k3 k4"),
    Key::new(
        "fisheye_params.radial_distortion_limit",
        Use::Named(Neutral::Never),
        "where the lens folds is found by itself",
    ),
    Key::new(
        "calib_params.camera_matrix",
        Use::Applied,
        "used in place of fisheye_params where use_opencv_standard is true",
    ),
    Key::new("calib_params.distortion_coeffs", Use::Applied, "k1 k2 p1 p2 k3 k4 k5 k6"),
    Key::new(
        "calib_params.radial_distortion_limit",
        Use::Named(Neutral::Never),
        "where the lens folds is found by itself",
    ),
    Key::new("use_opencv_standard", Use::Applied, "which of the two counts"),
    Key::new("use_opencv_fisheye", Use::Applied, "false, without use_opencv_standard, is refused"),
    Key::new(
        "asymmetrical",
        Use::Applied,
        "false or missing: the principal point is the middle (w/2, h/2), whatever the matrix says",
    ),
    Key::new("crop", Use::Applied, "divides the focal lengths"),
    Key::new("distortion_model", Use::Applied, "opencv_fisheye; others are refused"),
    Key::new(
        "distortion_model_id",
        Use::Refused(Neutral::Zero),
        "not OpenCV's fisheye, the only model of Gyroflow that can be imported",
    ),
    Key::new("digital_lens", Use::Refused(Neutral::Never), BENT),
    Key::new("digital_lens_params", Use::Named(Neutral::Never), BENT),
    Key::new("is_superview", Use::Refused(Neutral::Zero), BENT),
    Key::new("input_horizontal_stretch", Use::Refused(Neutral::UpToOne), STRETCHED),
    Key::new("input_vertical_stretch", Use::Refused(Neutral::UpToOne), STRETCHED),
    Key::new("fps", Use::Rate, "frames a second"),
    Key::new("frame_readout_time", Use::Readout(1.0), "ms a frame; negative: from the last row to the first"),
    Key::new(
        "interpolations",
        Use::Named(Neutral::Never),
        "calibrations at other focal lengths; the profile's own is taken",
    ),
    Key::new(
        "interpolations.**",
        Use::Named(Neutral::Never),
        "calibrations at other focal lengths; the profile's own is taken",
    ),
    Key::new(
        "compatible_settings.**",
        Use::Named(Neutral::Never),
        "other sizes and rates with readout times of their own: set fps and shutter.readout_ms if one of them is meant",
    ),
    Key::new("compatible_settings", Use::Silent, "none"),
    Key::new("output_dimension.*", Use::Silent, "size of the stabilised video"),
    Key::new("focal_length", Use::Silent, "mm, for people"),
    Key::new("crop_factor", Use::Silent, "for people"),
    Key::new("num_images", Use::Silent, "how many pictures were used"),
    Key::new("fisheye_params.RMS_error", Use::Silent, "how well it fitted"),
    Key::new("calib_params.RMS_error", Use::Silent, "how well it fitted"),
    Key::new("sync_settings", Use::Silent, "a setting of that program"),
    Key::new("sync_settings.**", Use::Silent, "a setting of that program"),
    Key::new("gyro_lpf", Use::Silent, "a setting of that program"),
    Key::new("official", Use::Silent, "where it comes from"),
    Key::new("date", Use::Silent, "when it was made"),
    Key::new("calibrator_version", Use::Silent, "when it was made"),
    Key::new("name", Use::Silent, "a name"),
    Key::new("identifier", Use::Silent, "a name"),
    Key::new("note", Use::Silent, "free text"),
    Key::new("calibrated_by", Use::Silent, "where it comes from"),
    Key::new("camera_brand", Use::Silent, "a name"),
    Key::new("camera_model", Use::Silent, "a name"),
    Key::new("camera_setting", Use::Silent, "a name"),
    Key::new("lens_model", Use::Silent, "a name"),
];

pub(super) fn fits(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    document.root.is_empty() && has("calib_dimension") && (has("fisheye_params") || has("calib_params"))
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    if let Some(model) = word(value, "distortion_model")
        && model != "opencv_fisheye"
    {
        return Err(Problem::new(
            "distortion_model",
            format!("is `{model}`: only opencv_fisheye can be imported"),
        ));
    }
    let [width, height] = [number(value, "calib_dimension.w")?, number(value, "calib_dimension.h")?];
    let size_px = size("calib_dimension", [width, height])?;
    let (standard, fisheye) =
        (flag(value, "use_opencv_standard")?.unwrap_or(false), flag(value, "use_opencv_fisheye")?);
    let (section, model, max) = match (standard, fisheye) {
        (true, Some(true)) => {
            return Err(Problem::new(
                "use_opencv_standard",
                "is true, and so is use_opencv_fisheye: which of the two is meant?",
            ));
        }
        (true, _) => ("calib_params", LensModel::BrownConrady, 8),
        (false, Some(false)) => {
            return Err(Problem::new(
                "use_opencv_fisheye",
                "is false, and so is use_opencv_standard: no model is left",
            ));
        }
        (false, _) => ("fisheye_params", LensModel::KannalaBrandt, 4),
    };
    let (focal_px, in_matrix) = camera_matrix(value, &format!("{section}.camera_matrix"))?;
    let key = format!("{section}.distortion_coeffs");
    let mut coefficients = at_most(&key, numbers(value, &key)?, max, "more coefficients than its model has")?;
    if model == LensModel::KannalaBrandt && coefficients.len() < 4 {
        let text = format!(
            "has {} numbers: k1 k2 k3 k4 are meant; write the ones that are zero too",
            coefficients.len()
        );
        return Err(Problem::new(key, text));
    }
    if model == LensModel::BrownConrady {
        coefficients = super::models::radial_tangential(&key, coefficients, 8)?;
    }
    let asymmetrical = flag(value, "asymmetrical")?.unwrap_or(false);
    let point = if asymmetrical { in_matrix } else { [0.5 * width, 0.5 * height] };
    let crop = optional_number(value, "crop")?.unwrap_or(1.0);
    if crop <= 0.0 {
        return Err(Problem::new("crop", format!("is {crop}: a factor above 0 is meant")));
    }
    let mut imported =
        camera(CameraFormat::Gyroflow, size_px, focal_px.map(|f| f / crop), point, model, coefficients);
    if !asymmetrical && in_matrix != point {
        let text = format!(
            "the principal point is the middle, {point:?}, as `asymmetrical` is not true: Gyroflow does not use the matrix's {in_matrix:?} then"
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
                "orig_dimension is {original:?}, but the calibration is of {:?}, which is the size here",
                [width, height]
            );
            imported.notes.push(text);
        }
    }
    Ok(imported)
}
