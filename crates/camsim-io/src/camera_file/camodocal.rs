//! camodocal's camera YAML, as VINS-Mono and VINS-Fusion read it: a model's name, and its parameters under
//! names of their own.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, Problem, find, number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

const ESTIMATOR: &str = "a setting of the estimator";

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "model_type",
        Use::Applied,
        "PINHOLE, PINHOLE_FULL, KANNALA_BRANDT; MEI (omnidirectional) and SCARAMUZZA are refused",
    ),
    Key::new("image_width", Use::Applied, "width"),
    Key::new("image_height", Use::Applied, "height"),
    Key::new("distortion_parameters.k1", Use::Applied, "in OpenCV's meaning"),
    Key::new("distortion_parameters.k2", Use::Applied, "in OpenCV's meaning"),
    Key::new("distortion_parameters.p1", Use::Applied, "in OpenCV's meaning"),
    Key::new("distortion_parameters.p2", Use::Applied, "in OpenCV's meaning"),
    Key::new(
        "distortion_parameters.k3",
        Use::Applied,
        "PINHOLE_FULL alone; refused in PINHOLE, which does not read it, unless zero",
    ),
    Key::new(
        "distortion_parameters.k4",
        Use::Applied,
        "PINHOLE_FULL alone; refused in PINHOLE, which does not read it, unless zero",
    ),
    Key::new(
        "distortion_parameters.k5",
        Use::Applied,
        "PINHOLE_FULL alone; refused in PINHOLE, which does not read it, unless zero",
    ),
    Key::new(
        "distortion_parameters.k6",
        Use::Applied,
        "PINHOLE_FULL alone; refused in PINHOLE, which does not read it, unless zero",
    ),
    Key::new("projection_parameters.fx", Use::Applied, "px"),
    Key::new("projection_parameters.fy", Use::Applied, "px"),
    Key::new("projection_parameters.cx", Use::Applied, "px"),
    Key::new("projection_parameters.cy", Use::Applied, "px"),
    Key::new(
        "projection_parameters.k2",
        Use::Applied,
        "KANNALA_BRANDT: Kannala-Brandt's k1 here, whose first is 1 there",
    ),
    Key::new("projection_parameters.k3", Use::Applied, "k2 here"),
    Key::new("projection_parameters.k4", Use::Applied, "k3 here"),
    Key::new("projection_parameters.k5", Use::Applied, "k4 here"),
    Key::new("projection_parameters.mu", Use::Applied, "fx of a KANNALA_BRANDT"),
    Key::new("projection_parameters.mv", Use::Applied, "fy of a KANNALA_BRANDT"),
    Key::new("projection_parameters.u0", Use::Applied, "cx of a KANNALA_BRANDT"),
    Key::new("projection_parameters.v0", Use::Applied, "cy of a KANNALA_BRANDT"),
    Key::new("rolling_shutter", Use::Rolling, "1: rows are read one after another"),
    Key::new(
        "rolling_shutter_tr",
        Use::Readout(1e3),
        "s a frame; named and left out where rolling_shutter is 0",
    ),
    Key::new(
        "td",
        Use::Named(Neutral::Zero),
        "clock of the camera against that of the IMU, s: it shifts all stamps alike; set shutter.delay_ms (-1000 td) if the pictures are to lag",
    ),
    Key::new(
        "extrinsicRotation",
        Use::Named(Neutral::Identity),
        "pose of the camera to the IMU: set mount by hand",
    ),
    Key::new(
        "extrinsicTranslation",
        Use::Named(Neutral::Zero),
        "pose of the camera to the IMU: set mount by hand",
    ),
    Key::new(
        "body_T_cam*",
        Use::Named(Neutral::Identity),
        "pose of the camera to the IMU: set mount by hand",
    ),
    Key::new(
        "fisheye",
        Use::Named(Neutral::Zero),
        "a round mask over the picture: set photometric.vignette if the border is dark",
    ),
    Key::new(
        "fisheye_mask",
        Use::Named(Neutral::Never),
        "a mask over the picture: set photometric.vignette if the border is dark",
    ),
    Key::new("camera_name", Use::Silent, "a name"),
    Key::new("imu*", Use::Silent, "the IMU"),
    Key::new("image*_topic", Use::Silent, "a name"),
    Key::new("acc_*", Use::Silent, "the IMU"),
    Key::new("gyr_*", Use::Silent, "the IMU"),
    Key::new("g_norm", Use::Silent, "gravity"),
    Key::new("freq", Use::Silent, "how often the estimator publishes"),
    Key::new("max_*", Use::Silent, ESTIMATOR),
    Key::new("min_dist", Use::Silent, ESTIMATOR),
    Key::new("F_threshold", Use::Silent, ESTIMATOR),
    Key::new("show_*", Use::Silent, ESTIMATOR),
    Key::new("equalize", Use::Silent, ESTIMATOR),
    Key::new("flow_back", Use::Silent, ESTIMATOR),
    Key::new("keyframe_parallax", Use::Silent, ESTIMATOR),
    Key::new("estimate_*", Use::Silent, ESTIMATOR),
    Key::new("loop_closure", Use::Silent, ESTIMATOR),
    Key::new("fast_relocalization", Use::Silent, ESTIMATOR),
    Key::new("load_previous_pose_graph", Use::Silent, ESTIMATOR),
    Key::new("save_image", Use::Silent, ESTIMATOR),
    Key::new("visualize_*", Use::Silent, ESTIMATOR),
    Key::new("num_of_cam", Use::Silent, ESTIMATOR),
    Key::new("multiple_thread", Use::Silent, ESTIMATOR),
    Key::new("use_gpu*", Use::Silent, ESTIMATOR),
];

pub(super) fn fits(document: &Document) -> bool {
    let parameters = ["projection_parameters", "mirror_parameters", "affine_parameters", "poly_parameters"];
    document.root.is_empty()
        && find(&document.value, "model_type").is_some()
        && parameters.iter().any(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    let size_px = size("image_width", [number(value, "image_width")?, number(value, "image_height")?])?;
    let all = |table: &str, keys: &[&str]| {
        keys.iter().map(|key| number(value, &format!("{table}.{key}"))).collect::<Result<Vec<f64>, _>>()
    };
    let projection = |keys: [&str; 4]| all("projection_parameters", &keys);
    let (model, numbers, coefficients) = match word(value, "model_type").unwrap_or_default() {
        "PINHOLE" => {
            for key in ["k3", "k4", "k5", "k6"].map(|key| format!("distortion_parameters.{key}")) {
                if find(value, &key).is_some() && number(value, &key)? != 0.0 {
                    return Err(Problem::new(
                        key,
                        "is not zero: PINHOLE has k1, k2, p1 and p2 alone and would not read it; name PINHOLE_FULL if that is meant",
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
        // Its k1 is 1 and not written: r = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9.
        "KANNALA_BRANDT" => {
            let coefficients = all("projection_parameters", &["k2", "k3", "k4", "k5"])?;
            (LensModel::KannalaBrandt, projection(["mu", "mv", "u0", "v0"])?, coefficients)
        }
        other => {
            let which = super::models::unknown(&other.to_ascii_lowercase())
                .map_or(String::new(), |name| format!(" ({name})"));
            let text = format!(
                "is `{other}`{which}, which no lens here is: PINHOLE, PINHOLE_FULL and KANNALA_BRANDT can be imported; calibrate with one of them"
            );
            return Err(Problem::new("model_type", text));
        }
    };
    let (focal_px, principal_point_px) = ([numbers[0], numbers[1]], [numbers[2], numbers[3]]);
    Ok(camera(CameraFormat::Camodocal, size_px, focal_px, principal_point_px, model, coefficients))
}
