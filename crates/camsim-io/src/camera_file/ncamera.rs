//! The camera rig of aslam (YAML), which maplab, rpg_svo_pro and ESIM read: `cameras: [{camera: ..., T_B_C:
//! ...}]`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, numbers_n, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models};

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "cameras.camera.type",
        Treatment::Applied,
        "pinhole, unified-projection; omni (OCamCalib) is refused",
    ),
    KeyRow::new("cameras.camera.image_width", Treatment::Applied, "width"),
    KeyRow::new("cameras.camera.image_height", Treatment::Applied, "height"),
    KeyRow::new(
        "cameras.camera.intrinsics",
        Treatment::Applied,
        "fx fy cx cy; xi before them in unified-projection",
    ),
    KeyRow::new(
        "cameras.camera.distortion.type",
        Treatment::Applied,
        "radial-tangential, equidistant, fisheye (there the field-of-view model), none; others are refused",
    ),
    KeyRow::new(
        "cameras.camera.distortion.parameters",
        Treatment::Applied,
        "k1 k2 p1 p2, or k1 k2 k3 k4 (equidistant)",
    ),
    KeyRow::new(
        "cameras.camera.line-delay-nanoseconds",
        Treatment::LineDelay(1e-6),
        "ns per row; the readout is this times the rows",
    ),
    KeyRow::new(
        "cameras.camera.line_delay_nanoseconds",
        Treatment::LineDelay(1e-6),
        "ns per row; the readout is this times the rows",
    ),
    KeyRow::new(
        "cameras.camera.mask",
        Treatment::Reported(Neutral::Never),
        "mask of unused pixels: set photometric.vignette if they are dark",
    ),
    KeyRow::new(
        "cameras.camera.label",
        Treatment::Ignored,
        "the name by which `--camera` finds it; aliases `cam0`, `cam1`, ...",
    ),
    KeyRow::new("cameras.camera.id", Treatment::Ignored, "a name"),
    KeyRow::new("cameras.camera.topic", Treatment::Ignored, "a name"),
    KeyRow::new("cameras.camera.compressed", Treatment::Ignored, "how pictures are stored"),
    KeyRow::new(
        "cameras.T_B_C",
        Treatment::Reported(Neutral::Identity),
        "pose of the camera to the body: `--body` or `--rig` applies it",
    ),
    KeyRow::new("cameras.serial_no", Treatment::Ignored, "a name"),
    KeyRow::new("cameras.calib_date", Treatment::Ignored, "date or version"),
    KeyRow::new("cameras.description", Treatment::Ignored, "free text"),
    KeyRow::new("label", Treatment::Ignored, "a name"),
    KeyRow::new("id", Treatment::Ignored, "a name"),
    KeyRow::new(
        "imu_params.delay_imu_cam",
        Treatment::Reported(Neutral::Zero),
        "clock offset between camera and IMU, s, which shifts all stamps",
    ),
    KeyRow::new("imu_params.**", Treatment::Ignored, "the IMU"),
    KeyRow::new("imu_initialization.**", Treatment::Ignored, "the IMU"),
    KeyRow::new("imu_bias/*", Treatment::Ignored, "the IMU"),
];

fn list(document: &Document) -> &[Value] {
    find(&document.value, "cameras").and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

pub(super) fn matches(document: &Document) -> bool {
    document.root.is_empty() && list(document).iter().any(|value| find(value, "camera.intrinsics").is_some())
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let name = |value: &Value| {
        ["camera.label", "camera.intrinsics.label"].iter().find_map(|key| word(value, key).map(str::to_owned))
    };
    let entry = |(index, value): (usize, _)| {
        let (number, roots) = (format!("cam{index}"), vec![format!("cameras[{index}]")]);
        let label = name(value).unwrap_or_else(|| number.clone());
        let aliases = if label == number { vec![index.to_string()] } else { vec![number, index.to_string()] };
        CameraEntry { name: label, aliases, value, roots }
    };
    list(document).iter().enumerate().map(entry).collect()
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let kind = word(value, "camera.type").unwrap_or("pinhole");
    if kind == "unified-projection" {
        return import_unified(value);
    }
    if kind != "pinhole" {
        let full_name = if kind == "omni" { "OCamCalib's polynomial" } else { "another projection" };
        return Err(KeyProblem::new(
            "camera.type",
            format!(
                "is `{kind}` ({full_name}), which is not supported: calibrate as pinhole, with equidistant \
                 distortion if it is a fisheye, or make a table of points of it (docs/reference/LENSES.md)"
            ),
        ));
    }
    let [fx, fy, cx, cy] = numbers_n(value, "camera.intrinsics")?;
    let size_px = size(
        "camera.image_width",
        [number(value, "camera.image_width")?, number(value, "camera.image_height")?],
    )?;
    let key = "camera.distortion.parameters";
    let kind = word(value, "camera.distortion.type").unwrap_or_default();
    let coefficients = lens_models::coefficients(value, "camera.distortion.type", kind, Some(key))?;
    // There `fisheye` is the field-of-view model.
    let kind = if kind == "fisheye" { "fov" } else { kind };
    let (model, coefficients) = lens_models::lens_by_name("camera.distortion.type", kind, key, coefficients)?;
    Ok(camera(CameraFormat::NCamera, size_px, [fx, fy], [cx, cy], model, coefficients))
}

/// xi before the focal lengths, and radial-tangential distortion on the sphere's image: MEI.
fn import_unified(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let [xi, fx, fy, cx, cy] = numbers_n(value, "camera.intrinsics")?;
    let size_px = size(
        "camera.image_width",
        [number(value, "camera.image_width")?, number(value, "camera.image_height")?],
    )?;
    let (model_key, key) = ("camera.distortion.type", "camera.distortion.parameters");
    let kind = word(value, model_key).unwrap_or_default();
    let distortion = lens_models::coefficients(value, model_key, kind, Some(key))?;
    let distortion = match lens_models::lens_by_name(model_key, kind, key, distortion)? {
        (LensModel::BrownConrady, list) if list.len() <= 4 => list,
        _ => {
            let text = format!(
                "is `{kind}`: unified-projection can be imported with four radial-tangential \
                                coefficients or none"
            );
            return Err(KeyProblem::new(model_key, text));
        }
    };
    let coefficients = [&[xi], &distortion[..]].concat();
    Ok(camera(CameraFormat::NCamera, size_px, [fx, fy], [cx, cy], LensModel::Mei, coefficients))
}
