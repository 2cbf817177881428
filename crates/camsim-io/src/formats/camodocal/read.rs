//! camodocal's camera YAML, which VINS-Mono and VINS-Fusion read: a model name and its parameters.

use serde_json::Value;

use super::{LENSES, PINHOLE, intrinsic_keys};
use crate::formats::named_lens::NamedLens;
use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::poses::{Extrinsics, rigid};
use crate::text::document::{Document, KeyProblem, find, number, numbers, optional_number, size_of, word};

const ESTIMATOR: &str = "a setting of the estimator";

pub(crate) const READER: Reader = Reader {
    poses: |found, camera| poses(found, &camera.document.value),
    ..Reader::new("camodocal", "camodocal (VINS) YAML", matches, &[("", KEYS)], |camera| {
        import(camera.value())
    })
};

const KEYS: &[KeyRow] = &[
    applied("model_type", "PINHOLE, PINHOLE_FULL, KANNALA_BRANDT, MEI; SCARAMUZZA is refused"),
    applied("image_width", "width"),
    applied("image_height", "height"),
    applied(
        "distortion_parameters.k1 distortion_parameters.k2 distortion_parameters.p1 \
         distortion_parameters.p2",
        "as in OpenCV",
    ),
    applied(
        "distortion_parameters.k3 distortion_parameters.k4 distortion_parameters.k5 \
         distortion_parameters.k6",
        "PINHOLE_FULL only; refused in PINHOLE unless zero",
    ),
    applied(
        "projection_parameters.fx projection_parameters.fy projection_parameters.cx \
         projection_parameters.cy",
        "px",
    ),
    applied(
        "projection_parameters.k2",
        "KANNALA_BRANDT: k1 in camsim, because camodocal's first coefficient is 1",
    ),
    applied("projection_parameters.k3", "k2 in camsim"),
    applied("projection_parameters.k4", "k3 in camsim"),
    applied("projection_parameters.k5", "k4 in camsim"),
    applied("mirror_parameters.xi", "of MEI"),
    applied("projection_parameters.gamma1", "fx of a MEI"),
    applied("projection_parameters.gamma2", "fy of a MEI"),
    applied("projection_parameters.mu", "fx of a KANNALA_BRANDT"),
    applied("projection_parameters.mv", "fy of a KANNALA_BRANDT"),
    applied("projection_parameters.u0", "cx of a KANNALA_BRANDT or MEI"),
    applied("projection_parameters.v0", "cy of a KANNALA_BRANDT or MEI"),
    KeyRow::new(Treatment::RollingShutter, "rolling_shutter", "1: rolling shutter"),
    KeyRow::new(
        Treatment::Readout(1e3),
        "rolling_shutter_tr",
        "s a frame; named and ignored where rolling_shutter is 0",
    ),
    reported(
        Neutral::Zero,
        "td",
        "clock offset between camera and IMU, s, which shifts all stamps: `--body` or `--rig` applies it",
    ),
    reported(
        Neutral::Identity,
        "extrinsicRotation",
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    reported(
        Neutral::Zero,
        "extrinsicTranslation",
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    reported(
        Neutral::Identity,
        "body_T_cam*",
        "pose of the camera to the IMU: `--body` or `--rig` applies it",
    ),
    reported(
        Neutral::Zero,
        "fisheye",
        "a round mask over the picture: set photometric.vignette if the border is dark",
    ),
    reported(
        Neutral::Never,
        "fisheye_mask",
        "a mask over the picture: set photometric.vignette if the border is dark",
    ),
    ignored("camera_name", "a name"),
    ignored("imu*", "the IMU"),
    ignored("image*_topic", "a name"),
    ignored("acc_* gyr_*", "the IMU"),
    ignored("g_norm", "gravity"),
    ignored("freq", "how often the estimator publishes"),
    ignored(
        "max_* min_dist F_threshold show_* equalize flow_back keyframe_parallax estimate_* \
         loop_closure fast_relocalization load_previous_pose_graph save_image visualize_* num_of_cam \
         multiple_thread use_gpu*",
        ESTIMATOR,
    ),
];

fn matches(document: &Document) -> bool {
    let parameters = ["projection_parameters", "mirror_parameters", "affine_parameters", "poly_parameters"];
    find(&document.value, "model_type").is_some()
        && parameters.iter().any(|key| find(&document.value, key).is_some())
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let size_px = size_of(value, ["image_width", "image_height"])?;
    let name = word(value, "model_type").unwrap_or_default();
    let lens = NamedLens::named(LENSES, name).ok_or_else(|| {
        let advice = "PINHOLE, PINHOLE_FULL, KANNALA_BRANDT and MEI can be imported; a lens of another model is \
                      a table of points (docs/reference/LENSES.md)";
        KeyProblem::new("model_type", lens_models::unsupported_model(name, advice))
    })?;
    if name == PINHOLE {
        for key in ["k3", "k4", "k5", "k6"].map(|key| format!("distortion_parameters.{key}")) {
            if optional_number(value, &key)?.is_some_and(|number| number != 0.0) {
                let text = "is not zero: PINHOLE has k1, k2, p1 and p2 alone and would not read it; name PINHOLE_FULL \
                            if that is meant";
                return Err(KeyProblem::new(key, text));
            }
        }
    }
    let get = |table: &str, key: &str| number(value, &format!("{table}_parameters.{key}"));
    let coefficient = |key: &str| key.split_once('.').map_or(Ok(0.0), |(table, key)| get(table, key));
    let coefficients = lens.coefficients().into_iter().map(coefficient).collect::<Result<Vec<f64>, _>>()?;
    let [fx, fy, cx, cy] = intrinsic_keys(name).map(|key| get("projection", key));
    let (focal_px, principal_point_px) = ([fx?, fy?], [cx?, cy?]);
    Ok(camera(size_px, focal_px, principal_point_px, lens.model, coefficients))
}

/// VINS-Mono's pair of matrices, or VINS-Fusion's `body_T_cam0`.
fn poses(found: &mut Extrinsics, root: &Value) -> Result<(), KeyProblem> {
    found.shift(root, "", "td")?;
    found.in_body(root, "", "body_T_cam0", false)?;
    let (turn, shift) = ("extrinsicRotation", "extrinsicTranslation");
    if find(root, turn).is_some() && find(root, shift).is_some() {
        let (r, t) = (numbers(root, turn)?, numbers(root, shift)?);
        if r.len() != 9 || t.len() != 3 {
            return Err(KeyProblem::new(turn, format!("has {} numbers, and {shift} {}", r.len(), t.len())));
        }
        let rows: Vec<f64> = (0..3).flat_map(|k| [r[3 * k], r[3 * k + 1], r[3 * k + 2], t[k]]).collect();
        let (pose, _) = rigid(&rows).map_err(|message| KeyProblem::new(turn, message))?;
        found.applied.extend([turn.to_owned(), shift.to_owned()]);
        found.place(turn.to_owned(), pose)?;
    }
    Ok(())
}
