//! The camera rig of aslam (YAML), which maplab, rpg_svo_pro and ESIM read: `cameras: [{camera: ..., T_B_C:
//! ...}]`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{Document, KeyProblem, find, list, numbers_n, size_of, word};

pub(crate) const READER: Reader = Reader {
    entries,
    poses: |found, camera| found.in_body(camera.value(), &camera.prefix(), "T_B_C", false),
    ..Reader::new(
        "ncamera",
        "camera rigs of maplab, rpg_svo_pro and ESIM",
        matches,
        &[("", KEYS)],
        |camera| import(camera.value()),
    )
};

const KEYS: &[KeyRow] = &[
    applied("cameras.camera.type", "pinhole, unified-projection; omni (OCamCalib) is refused"),
    applied("cameras.camera.image_width", "width"),
    applied("cameras.camera.image_height", "height"),
    applied("cameras.camera.intrinsics", "fx fy cx cy; xi before them in unified-projection"),
    applied(
        "cameras.camera.distortion.type",
        "radial-tangential, equidistant, fisheye (there the field-of-view model), none; others are refused",
    ),
    applied("cameras.camera.distortion.parameters", "k1 k2 p1 p2, or k1 k2 k3 k4 (equidistant)"),
    KeyRow::new(
        Treatment::LineDelay(1e-6),
        "cameras.camera.line-delay-nanoseconds cameras.camera.line_delay_nanoseconds",
        "ns per row; the readout is this times the rows",
    ),
    reported(
        Neutral::Never,
        "cameras.camera.mask",
        "mask of unused pixels: set photometric.vignette if they are dark",
    ),
    ignored("cameras.camera.label", "the name by which `--camera` finds it; aliases `cam0`, `cam1`, ..."),
    ignored("cameras.camera.id cameras.camera.topic", "a name"),
    ignored("cameras.camera.compressed", "how pictures are stored"),
    reported(
        Neutral::Identity,
        "cameras.T_B_C",
        "pose of the camera to the body: `--body` or `--rig` applies it",
    ),
    ignored("cameras.serial_no", "a name"),
    ignored("cameras.calib_date", "date or version"),
    ignored("cameras.description", "free text"),
    ignored("label id", "a name"),
    reported(
        Neutral::Zero,
        "imu_params.delay_imu_cam",
        "clock offset between camera and IMU, s, which shifts all stamps",
    ),
    ignored("imu_params.** imu_initialization.** imu_bias/*", "the IMU"),
];

fn matches(document: &Document) -> bool {
    list(&document.value, "cameras").iter().any(|value| find(value, "camera.intrinsics").is_some())
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let name = |value: &Value| {
        ["camera.label", "camera.intrinsics.label"].iter().find_map(|key| word(value, key).map(str::to_owned))
    };
    let entry = |(index, value): (usize, _)| {
        let (number, roots) = (format!("cam{index}"), vec![format!("cameras[{index}]")]);
        let label = name(value).unwrap_or_else(|| number.clone());
        let aliases = if label == number { vec![index.to_string()] } else { vec![number, index.to_string()] };
        CameraEntry { name: label, aliases, value, roots }
    };
    Ok(list(&document.value, "cameras").iter().enumerate().map(entry).collect())
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
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
    let size_px = size_of(value, ["camera.image_width", "camera.image_height"])?;
    let key = "camera.distortion.parameters";
    let kind = word(value, "camera.distortion.type").unwrap_or_default();
    let coefficients = lens_models::coefficients(value, "camera.distortion.type", kind, Some(key))?;
    // There `fisheye` is the field-of-view model.
    let kind = if kind == "fisheye" { "fov" } else { kind };
    let (model, coefficients) = lens_models::lens_by_name("camera.distortion.type", kind, key, coefficients)?;
    Ok(camera(size_px, [fx, fy], [cx, cy], model, coefficients))
}

/// xi before the focal lengths, and radial-tangential distortion on the sphere's image: MEI.
fn import_unified(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let [xi, fx, fy, cx, cy] = numbers_n(value, "camera.intrinsics")?;
    let size_px = size_of(value, ["camera.image_width", "camera.image_height"])?;
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
    Ok(camera(size_px, [fx, fy], [cx, cy], LensModel::Mei, coefficients))
}
