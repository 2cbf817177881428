//! The camera rig of aslam (YAML), which maplab, rpg_svo_pro and ESIM read: `cameras: [{camera: ..., T_B_C:
//! ...}]`.

use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, number, numbers_n, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "cameras.camera.type",
        Use::Applied,
        "pinhole; omni (OCamCalib) and unified-projection are refused",
    ),
    Key::new("cameras.camera.image_width", Use::Applied, "width"),
    Key::new("cameras.camera.image_height", Use::Applied, "height"),
    Key::new("cameras.camera.intrinsics", Use::Applied, "fx fy cx cy"),
    Key::new(
        "cameras.camera.distortion.type",
        Use::Applied,
        "radial-tangential, equidistant, none; others (fisheye: the field-of-view model) are refused",
    ),
    Key::new(
        "cameras.camera.distortion.parameters",
        Use::Applied,
        "k1 k2 p1 p2, or k1 k2 k3 k4 (equidistant)",
    ),
    Key::new(
        "cameras.camera.line-delay-nanoseconds",
        Use::LineDelay(1e-6),
        "ns a row; times the rows it is the readout",
    ),
    Key::new(
        "cameras.camera.line_delay_nanoseconds",
        Use::LineDelay(1e-6),
        "ns a row; times the rows it is the readout",
    ),
    Key::new(
        "cameras.camera.mask",
        Use::Named(Neutral::Never),
        "pixels that are not to be used: set photometric.vignette if they are dark",
    ),
    Key::new(
        "cameras.camera.label",
        Use::Silent,
        "the name by which `--camera` finds it; also `cam0`, `cam1`, ...",
    ),
    Key::new("cameras.camera.id", Use::Silent, "a name"),
    Key::new("cameras.camera.topic", Use::Silent, "a name"),
    Key::new("cameras.camera.compressed", Use::Silent, "how pictures are stored"),
    Key::new(
        "cameras.T_B_C",
        Use::Named(Neutral::Identity),
        "pose of the camera to the body: set mount by hand",
    ),
    Key::new("cameras.serial_no", Use::Silent, "a name"),
    Key::new("cameras.calib_date", Use::Silent, "when it was made"),
    Key::new("cameras.description", Use::Silent, "free text"),
    Key::new("label", Use::Silent, "a name"),
    Key::new("id", Use::Silent, "a name"),
    Key::new(
        "imu_params.delay_imu_cam",
        Use::Named(Neutral::Zero),
        "clock of the camera against that of the IMU, s: it shifts all stamps alike",
    ),
    Key::new("imu_params.**", Use::Silent, "the IMU"),
    Key::new("imu_initialization.**", Use::Silent, "the IMU"),
    Key::new("imu_bias/*", Use::Silent, "the IMU"),
];

fn list(document: &Document) -> &[Value] {
    find(&document.value, "cameras").and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty() && list(document).iter().any(|value| find(value, "camera.intrinsics").is_some())
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let name = |value: &Value| {
        ["camera.label", "camera.intrinsics.label"].iter().find_map(|key| word(value, key).map(str::to_owned))
    };
    let entry = |(index, value): (usize, _)| {
        let (number, roots) = (format!("cam{index}"), vec![format!("cameras[{index}]")]);
        let label = name(value).unwrap_or_else(|| number.clone());
        let also = if label == number { vec![index.to_string()] } else { vec![number, index.to_string()] };
        Entry { name: label, also, value, roots }
    };
    list(document).iter().enumerate().map(entry).collect()
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    let kind = word(value, "camera.type").unwrap_or("pinhole");
    if kind != "pinhole" {
        let which = if kind == "omni" { "OCamCalib's polynomial" } else { "another projection" };
        return Err(Problem::new(
            "camera.type",
            format!(
                "is `{kind}` ({which}), which no lens here is: calibrate as pinhole, with equidistant distortion if it is a fisheye"
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
    let coefficients = models::stated(value, "camera.distortion.type", kind, Some(key))?;
    if kind == "fisheye" {
        let text =
            "is `fisheye` (there the field-of-view model), which no lens here is: calibrate with equidistant";
        return Err(Problem::new("camera.distortion.type", text));
    }
    let (model, coefficients) = models::by_name("camera.distortion.type", kind, key, coefficients)?;
    Ok(camera(CameraFormat::NCamera, size_px, [fx, fy], [cx, cy], model, coefficients))
}
