//! nerfstudio's `transforms.json`. Its code has the centre of the first pixel at (0.5, 0.5).

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::{CameraFormat, ImportedCamera, camera};

const COEFFICIENT: &str = "coefficient; refused unless zero if camera_model does not have it";
const POSES: &str = "pictures and poses";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "camera_model",
        Treatment::Applied,
        "OPENCV (also if missing), OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE; others are refused",
    ),
    KeyRow::new("w", Treatment::Applied, "width"),
    KeyRow::new("h", Treatment::Applied, "height"),
    KeyRow::new("fl_x", Treatment::Applied, "px"),
    KeyRow::new("fl_y", Treatment::Applied, "px; fl_x if missing"),
    KeyRow::new(
        "cx",
        Treatment::Applied,
        "px; half a pixel is subtracted, as its code counts from the corner",
    ),
    KeyRow::new("cy", Treatment::Applied, "px; half a pixel is subtracted"),
    KeyRow::new("k1", Treatment::Applied, COEFFICIENT),
    KeyRow::new("k2", Treatment::Applied, COEFFICIENT),
    KeyRow::new("k3", Treatment::Applied, COEFFICIENT),
    KeyRow::new("k4", Treatment::Applied, COEFFICIENT),
    KeyRow::new("p1", Treatment::Applied, COEFFICIENT),
    KeyRow::new("p2", Treatment::Applied, COEFFICIENT),
    KeyRow::new(
        "frames.fl_x",
        Treatment::Refused(Neutral::Never),
        "each picture has a camera of its own: write one of them to the root of a file",
    ),
    KeyRow::new("frames.**", Treatment::Ignored, POSES),
    KeyRow::new("frames", Treatment::Ignored, POSES),
    KeyRow::new("camera_angle_*", Treatment::Ignored, "angle of view, which fl_x and w give too"),
    KeyRow::new("aabb_scale", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("applied_*", Treatment::Ignored, POSES),
    KeyRow::new("orientation_override", Treatment::Ignored, POSES),
    KeyRow::new("ply_file_path", Treatment::Ignored, "a file of points"),
    KeyRow::new("*_filenames", Treatment::Ignored, POSES),
];

pub(super) fn matches(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    document.root.is_empty() && has("fl_x") && has("w")
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    let kind = word(value, "camera_model").unwrap_or("OPENCV");
    let (model, names): (LensModel, &[&str]) = match kind {
        "OPENCV" | "PERSPECTIVE" => (LensModel::BrownConrady, &["k1", "k2", "p1", "p2", "k3"]),
        "OPENCV_FISHEYE" => (LensModel::KannalaBrandt, &["k1", "k2", "k3", "k4"]),
        "PINHOLE" | "SIMPLE_PINHOLE" => (LensModel::BrownConrady, &[]),
        other => {
            let text = format!("is `{other}`: OPENCV, OPENCV_FISHEYE and PINHOLE can be imported");
            return Err(KeyProblem::new("camera_model", text));
        }
    };
    for key in ["k1", "k2", "k3", "k4", "p1", "p2"] {
        if !names.contains(&key) && or_zero(key)? != 0.0 {
            return Err(KeyProblem::new(
                key,
                format!("is not zero, but {kind} has {names:?} only: delete it, or correct camera_model"),
            ));
        }
    }
    let fx = number(value, "fl_x")?;
    let coefficients = names.iter().map(|key| or_zero(key)).collect::<Result<Vec<f64>, _>>()?;
    let mut imported = camera(
        CameraFormat::Nerfstudio,
        size("w", [number(value, "w")?, number(value, "h")?])?,
        [fx, optional_number(value, "fl_y")?.unwrap_or(fx)],
        [number(value, "cx")? - 0.5, number(value, "cy")? - 0.5],
        model,
        coefficients,
    );
    imported.notes.push(
        "the principal point was shifted by half a pixel: nerfstudio's code has image corners at integers, whatever \
         its documentation says"
            .to_owned(),
    );
    Ok(imported)
}
