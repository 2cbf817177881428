//! XML of the paper's reference program (`<simParams>`). As there, of repeated elements the last is used, and
//! elements whose name ends in 0 are commented out.

use std::path::PathBuf;

use camsim_core::scenario::{FieldOr, LensModel};
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::{CameraFormat, ImportedCamera, camera};

const RUN: &str = "a setting of the run, not of the camera";
const FIXED: &str =
    "fixed-pattern noise of that program: set sensor.dsnu_e, row_offset_e or column_offset_e instead";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new("idealParams.width", Treatment::Applied, "times resolutionScale"),
    KeyRow::new("idealParams.height", Treatment::Applied, "times resolutionScale"),
    KeyRow::new(
        "idealParams.resolutionScale",
        Treatment::Applied,
        "scales size, focal lengths and principal point",
    ),
    KeyRow::new("idealParams.f", Treatment::Applied, "px"),
    KeyRow::new("idealParams.fx", Treatment::Applied, "px"),
    KeyRow::new("idealParams.fy", Treatment::Applied, "px"),
    KeyRow::new("idealParams.fovX", Treatment::Applied, "degrees, where no focal length is given"),
    KeyRow::new("idealParams.fovY", Treatment::Applied, "degrees, where no focal length is given"),
    KeyRow::new("idealParams.ox", Treatment::Applied, "from the corner; half a pixel is subtracted"),
    KeyRow::new("idealParams.oy", Treatment::Applied, "from the corner; half a pixel is subtracted"),
    KeyRow::new("idealParams.oxOffset", Treatment::Applied, "from the centre"),
    KeyRow::new("idealParams.oyOffset", Treatment::Applied, "from the centre"),
    KeyRow::new("staticParams.k1", Treatment::Applied, "OpenCV's k1"),
    KeyRow::new("staticParams.k2", Treatment::Applied, "OpenCV's k2"),
    KeyRow::new("staticParams.k3", Treatment::Applied, "OpenCV's k3"),
    KeyRow::new("staticParams.k4", Treatment::Applied, "OpenCV's k4"),
    KeyRow::new("staticParams.k5", Treatment::Applied, "OpenCV's k5"),
    KeyRow::new("staticParams.k6", Treatment::Applied, "OpenCV's k6"),
    KeyRow::new("staticParams.t1", Treatment::Applied, "OpenCV's p1"),
    KeyRow::new("staticParams.t2", Treatment::Applied, "OpenCV's p2"),
    KeyRow::new("staticParams.max*", Treatment::Ignored, "stopping criterion of its solver"),
    KeyRow::new("vignetParams.vignetFile", Treatment::Applied, "photometric.vignette"),
    KeyRow::new("vignetParams.vignetThresh1", Treatment::Applied, "photometric.vignette_thresholds"),
    KeyRow::new("vignetParams.vignetThresh2", Treatment::Applied, "photometric.vignette_thresholds"),
    KeyRow::new("camInAcEu.roll", Treatment::Applied, "mount.angles_deg"),
    KeyRow::new("camInAcEu.pitch", Treatment::Applied, "mount.angles_deg"),
    KeyRow::new("camInAcEu.yaw", Treatment::Applied, "mount.angles_deg"),
    KeyRow::new(
        "camInAcEu.*Err",
        Treatment::Reported(Neutral::Zero),
        "error that the program adds to its estimator's input",
    ),
    KeyRow::new("sensorParams.cameraFps", Treatment::Applied, "fps"),
    KeyRow::new("sensorParams.phasePercent", Treatment::Applied, "phase; a fraction, despite its name"),
    KeyRow::new("dynamicParams.td", Treatment::Applied, "s: shutter.delay_ms"),
    KeyRow::new("dynamicParams.tr", Treatment::Applied, "s: shutter.readout_ms"),
    KeyRow::new("dynamicParams.te", Treatment::Applied, "s: shutter.exposure_ms"),
    KeyRow::new("dynamicParams.ti", Treatment::Applied, "s: shutter.interlace_ms"),
    KeyRow::new(
        "dynamicParams.tdErr",
        Treatment::Reported(Neutral::Zero),
        "error that the program adds to its estimator's input",
    ),
    KeyRow::new("dynamicParams.motionBlurExtraSamples", Treatment::Ignored, "sampling of motion blur"),
    KeyRow::new("signalParams.dayLight", Treatment::Applied, "photometric.light"),
    KeyRow::new("signalParams.noiseAmp", Treatment::Applied, "photometric.noise_sigma"),
    KeyRow::new("signalParams.noiseAmpDynamic", Treatment::Applied, "photometric.noise_sigma"),
    KeyRow::new("signalParams.noiseAmpStatic*", Treatment::Reported(Neutral::Zero), FIXED),
    KeyRow::new(
        "signalParams.fogVisibilityDistance",
        Treatment::Reported(Neutral::Zero),
        "fog, which is not modelled",
    ),
    KeyRow::new("signalParams.seed", Treatment::Ignored, "noise seed: the scenario has its own"),
    KeyRow::new("*.desc", Treatment::Ignored, "free text"),
    KeyRow::new("marginParams.**", Treatment::Ignored, "size of the ideal picture"),
    KeyRow::new("mainParams.**", Treatment::Ignored, RUN),
    KeyRow::new("demParams.**", Treatment::Ignored, RUN),
    KeyRow::new("mapParams.**", Treatment::Ignored, RUN),
    KeyRow::new("pathParams.**", Treatment::Ignored, RUN),
    KeyRow::new("pathParamsExtra.**", Treatment::Ignored, RUN),
    KeyRow::new("vehicle.**", Treatment::Ignored, RUN),
    KeyRow::new(
        "includeParams.**",
        Treatment::Reported(Neutral::Never),
        "further file of the reference program: import it too if it has parts of the camera",
    ),
];

pub(super) fn matches(document: &Document) -> bool {
    document.root == "simParams"
}

/// The document without commented-out elements and with the last of repeated elements.
pub(super) fn effective_document(document: &Document) -> Document {
    let mut value = document.value.clone();
    if let Value::Object(map) = &mut value {
        map.retain(|name, _| !name.ends_with('0'));
        for element in map.values_mut() {
            if let Value::Array(list) = element {
                *element = list.pop().unwrap_or(Value::Null);
            }
        }
    }
    Document { root: document.root.clone(), value }
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    if find(value, "idealParams").is_none() {
        return Err(KeyProblem::new(
            "idealParams",
            "is missing: a file of run parameters refers to its camera file in includeParams; import that \
             one",
        ));
    }
    let (size_px, focal_px, principal_point_px) = intrinsics(value)?;
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    let mut coefficients = Vec::new();
    for name in ["k1", "k2", "t1", "t2", "k3", "k4", "k5", "k6"] {
        coefficients.push(or_zero(&format!("staticParams.{name}"))?);
    }
    let mut imported = camera(
        CameraFormat::Reference,
        size_px,
        focal_px,
        principal_point_px,
        LensModel::BrownConrady,
        coefficients,
    );
    let spec = &mut imported.spec;

    match optional_number(value, "sensorParams.cameraFps")? {
        Some(fps) => spec.fps = fps,
        None => imported.notes.push("the file has no sensorParams.cameraFps: fps is 30".to_owned()),
    }
    // The program uses it as a fraction of the frame period, despite its name.
    spec.phase = or_zero("sensorParams.phasePercent")?;
    spec.mount.angles_deg =
        [or_zero("camInAcEu.roll")?, or_zero("camInAcEu.pitch")?, or_zero("camInAcEu.yaw")?];
    // In seconds; td has the same sign as delay_ms.
    spec.shutter.delay_ms = 1e3 * or_zero("dynamicParams.td")?;
    spec.shutter.readout_ms = 1e3 * or_zero("dynamicParams.tr")?;
    spec.shutter.exposure_ms = 1e3 * or_zero("dynamicParams.te")?;
    spec.shutter.interlace_ms = FieldOr::Ms(1e3 * or_zero("dynamicParams.ti")?);
    if let Some(file) = word(value, "vignetParams.vignetFile").filter(|file| !file.is_empty()) {
        spec.photometric.vignette = Some(PathBuf::from(file));
        spec.photometric.vignette_thresholds =
            [number(value, "vignetParams.vignetThresh1")?, number(value, "vignetParams.vignetThresh2")?];
    }
    spec.photometric.light = optional_number(value, "signalParams.dayLight")?.unwrap_or(1.0);
    spec.photometric.noise_sigma = optional_number(value, "signalParams.noiseAmpDynamic")?
        .or(optional_number(value, "signalParams.noiseAmp")?)
        .unwrap_or(0.0);
    if find(value, "camInAcEu").is_none() {
        imported.notes.push(
            "the file has no camInAcEu: the camera looks along the nose, while the reference program's \
             default is straight down (pitch -90)"
                .to_owned(),
        );
    }
    imported.notes.push(
        "the principal point was shifted by half a pixel: the reference program has image corners at integers"
            .to_owned(),
    );
    Ok(imported)
}

/// Size, focal lengths, principal point, pixels.
type Intrinsics = ([u32; 2], [f64; 2], [f64; 2]);

/// Intrinsics after `resolutionScale`.
fn intrinsics(value: &Value) -> Result<Intrinsics, KeyProblem> {
    let key = |name: &str| format!("idealParams.{name}");
    let get = |name: &str| optional_number(value, &key(name));
    let (width, height) = (number(value, &key("width"))?, number(value, &key("height"))?);
    let (width, height) = (width.trunc(), height.trunc());
    // Focal length from a field of view about the image centre.
    let focal = |field_deg: Option<f64>, size: f64| {
        field_deg.map(|field_deg| 0.5 * size / (0.5 * field_deg).to_radians().tan())
    };
    let (by_x, by_y) = (focal(get("fovX")?, width), focal(get("fovY")?, height));
    let f = get("f")?;
    let missing =
        || KeyProblem::new(key("f"), "is missing: f, fx and fy, fovX or fovY gives the focal length");
    let fx = get("fx")?.or(f).or(by_x).or(by_y).ok_or_else(missing)?;
    let fy = get("fy")?.or(f).or(by_y).or(by_x).ok_or_else(missing)?;
    let ox = get("ox")?.unwrap_or(0.5 * width + get("oxOffset")?.unwrap_or(0.0));
    let oy = get("oy")?.unwrap_or(0.5 * height + get("oyOffset")?.unwrap_or(0.0));
    let scale = get("resolutionScale")?.unwrap_or(1.0);
    // The program truncates; a scale that does not give an integer size is refused.
    let size_px = size("idealParams.width x resolutionScale", [width * scale, height * scale])?;
    Ok((size_px, [fx * scale, fy * scale], [ox * scale - 0.5, oy * scale - 0.5]))
}
