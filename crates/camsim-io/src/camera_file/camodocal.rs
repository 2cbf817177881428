//! camodocal's camera YAML, which VINS-Mono and VINS-Fusion read: a model name and its parameters.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::{CameraFormat, ImportedCamera, camera, lens_models};

const ESTIMATOR: &str = "a setting of the estimator";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "model_type",
        Treatment::Applied,
        "PINHOLE, PINHOLE_FULL, KANNALA_BRANDT, MEI; SCARAMUZZA is refused",
    ),
    KeyRow::new("image_width", Treatment::Applied, "width"),
    KeyRow::new("image_height", Treatment::Applied, "height"),
    KeyRow::new("distortion_parameters.k1", Treatment::Applied, "as in OpenCV"),
    KeyRow::new("distortion_parameters.k2", Treatment::Applied, "as in OpenCV"),
    KeyRow::new("distortion_parameters.p1", Treatment::Applied, "as in OpenCV"),
    KeyRow::new("distortion_parameters.p2", Treatment::Applied, "as in OpenCV"),
    KeyRow::new(
        "distortion_parameters.k3",
        Treatment::Applied,
        "PINHOLE_FULL only; refused in PINHOLE unless zero",
    ),
    KeyRow::new(
        "distortion_parameters.k4",
        Treatment::Applied,
        "PINHOLE_FULL only; refused in PINHOLE unless zero",
    ),
    KeyRow::new(
        "distortion_parameters.k5",
        Treatment::Applied,
        "PINHOLE_FULL only; refused in PINHOLE unless zero",
    ),
    KeyRow::new(
        "distortion_parameters.k6",
        Treatment::Applied,
        "PINHOLE_FULL only; refused in PINHOLE unless zero",
    ),
    KeyRow::new("projection_parameters.fx", Treatment::Applied, "px"),
    KeyRow::new("projection_parameters.fy", Treatment::Applied, "px"),
    KeyRow::new("projection_parameters.cx", Treatment::Applied, "px"),
    KeyRow::new("projection_parameters.cy", Treatment::Applied, "px"),
    KeyRow::new(
        "projection_parameters.k2",
        Treatment::Applied,
        "KANNALA_BRANDT: k1 in camsim, because camodocal's first coefficient is 1",
    ),
    KeyRow::new("projection_parameters.k3", Treatment::Applied, "k2 in camsim"),
    KeyRow::new("projection_parameters.k4", Treatment::Applied, "k3 in camsim"),
    KeyRow::new("projection_parameters.k5", Treatment::Applied, "k4 in camsim"),
    KeyRow::new("mirror_parameters.xi", Treatment::Applied, "of MEI"),
    KeyRow::new("projection_parameters.gamma1", Treatment::Applied, "fx of a MEI"),
    KeyRow::new("projection_parameters.gamma2", Treatment::Applied, "fy of a MEI"),
    KeyRow::new("projection_parameters.mu", Treatment::Applied, "fx of a KANNALA_BRANDT"),
    KeyRow::new("projection_parameters.mv", Treatment::Applied, "fy of a KANNALA_BRANDT"),
    KeyRow::new("projection_parameters.u0", Treatment::Applied, "cx of a KANNALA_BRANDT or MEI"),
    KeyRow::new("projection_parameters.v0", Treatment::Applied, "cy of a KANNALA_BRANDT or MEI"),
    KeyRow::new("rolling_shutter", Treatment::RollingShutter, "1: rolling shutter"),
    KeyRow::new(
        "rolling_shutter_tr",
        Treatment::Readout(1e3),
        "s a frame; named and left out where rolling_shutter is 0",
    ),
    KeyRow::new(
        "td",
        Treatment::Reported(Neutral::Zero),
        "clock offset between camera and IMU, s, which shifts all stamps: `--body` or `--rig` applies it",
    ),
    KeyRow::new(
        "extrinsicRotation",
        Treatment::Reported(Neutral::Identity),
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    KeyRow::new(
        "extrinsicTranslation",
        Treatment::Reported(Neutral::Zero),
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    KeyRow::new(
        "body_T_cam*",
        Treatment::Reported(Neutral::Identity),
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    KeyRow::new(
        "fisheye",
        Treatment::Reported(Neutral::Zero),
        "a round mask over the picture: set photometric.vignette if the border is dark",
    ),
    KeyRow::new(
        "fisheye_mask",
        Treatment::Reported(Neutral::Never),
        "a mask over the picture: set photometric.vignette if the border is dark",
    ),
    KeyRow::new("camera_name", Treatment::Ignored, "a name"),
    KeyRow::new("imu*", Treatment::Ignored, "the IMU"),
    KeyRow::new("image*_topic", Treatment::Ignored, "a name"),
    KeyRow::new("acc_*", Treatment::Ignored, "the IMU"),
    KeyRow::new("gyr_*", Treatment::Ignored, "the IMU"),
    KeyRow::new("g_norm", Treatment::Ignored, "gravity"),
    KeyRow::new("freq", Treatment::Ignored, "how often the estimator publishes"),
    KeyRow::new("max_*", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("min_dist", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("F_threshold", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("show_*", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("equalize", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("flow_back", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("keyframe_parallax", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("estimate_*", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("loop_closure", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("fast_relocalization", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("load_previous_pose_graph", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("save_image", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("visualize_*", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("num_of_cam", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("multiple_thread", Treatment::Ignored, ESTIMATOR),
    KeyRow::new("use_gpu*", Treatment::Ignored, ESTIMATOR),
];

pub(super) fn matches(document: &Document) -> bool {
    let parameters = ["projection_parameters", "mirror_parameters", "affine_parameters", "poly_parameters"];
    document.root.is_empty()
        && find(&document.value, "model_type").is_some()
        && parameters.iter().any(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let size_px = size("image_width", [number(value, "image_width")?, number(value, "image_height")?])?;
    let all = |table: &str, keys: &[&str]| {
        keys.iter().map(|key| number(value, &format!("{table}.{key}"))).collect::<Result<Vec<f64>, _>>()
    };
    let projection = |keys: [&str; 4]| all("projection_parameters", &keys);
    let (model, numbers, coefficients) = match word(value, "model_type").unwrap_or_default() {
        "PINHOLE" => {
            for key in ["k3", "k4", "k5", "k6"].map(|key| format!("distortion_parameters.{key}")) {
                if find(value, &key).is_some() && number(value, &key)? != 0.0 {
                    return Err(KeyProblem::new(
                        key,
                        "is not zero: PINHOLE has k1, k2, p1 and p2 alone and would not read it; name \
                         PINHOLE_FULL if that is meant",
                    ));
                }
            }
            let coefficients = all("distortion_parameters", &["k1", "k2", "p1", "p2"])?;
            (LensModel::BrownConrady, projection(["fx", "fy", "cx", "cy"])?, coefficients)
        }
        "PINHOLE_FULL" => {
            let coefficients =
                all("distortion_parameters", &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"])?;
            (LensModel::BrownConrady, projection(["fx", "fy", "cx", "cy"])?, coefficients)
        }
        "MEI" => {
            let mut coefficients = all("mirror_parameters", &["xi"])?;
            coefficients.extend(all("distortion_parameters", &["k1", "k2", "p1", "p2"])?);
            (LensModel::Mei, projection(["gamma1", "gamma2", "u0", "v0"])?, coefficients)
        }
        // Its k1 is 1 and not written: r = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9.
        "KANNALA_BRANDT" => {
            let coefficients = all("projection_parameters", &["k2", "k3", "k4", "k5"])?;
            (LensModel::KannalaBrandt, projection(["mu", "mv", "u0", "v0"])?, coefficients)
        }
        other => {
            let advice = "PINHOLE, PINHOLE_FULL, KANNALA_BRANDT and MEI can be imported; a lens of another model is \
                          a table of points (docs/reference/LENSES.md)";
            return Err(KeyProblem::new("model_type", lens_models::unsupported_model(other, advice)));
        }
    };
    let (focal_px, principal_point_px) = ([numbers[0], numbers[1]], [numbers[2], numbers[3]]);
    Ok(camera(CameraFormat::Camodocal, size_px, focal_px, principal_point_px, model, coefficients))
}
