//! XML of the paper's reference program (`<simParams>`). Of repeated elements the last one counts, as there;
//! elements whose name ends in 0 are its way of commenting out.

use std::path::PathBuf;

use camsim_core::scenario::{FieldOr, LensModel};
use serde_json::Value;

use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

const RUN: &str = "a setting of the run, not of the camera";
const FIXED: &str = "a fixed noise pattern of that program: see photometric.sensor for those here";

pub(super) const KEYS: &[Key] = &[
    Key::new("idealParams.width", Use::Applied, "times resolutionScale"),
    Key::new("idealParams.height", Use::Applied, "times resolutionScale"),
    Key::new("idealParams.resolutionScale", Use::Applied, "scales size, focal lengths and principal point"),
    Key::new("idealParams.f", Use::Applied, "px"),
    Key::new("idealParams.fx", Use::Applied, "px"),
    Key::new("idealParams.fy", Use::Applied, "px"),
    Key::new("idealParams.fovX", Use::Applied, "degrees, where no focal length is given"),
    Key::new("idealParams.fovY", Use::Applied, "degrees, where no focal length is given"),
    Key::new("idealParams.ox", Use::Applied, "from the corner; half a pixel is taken off"),
    Key::new("idealParams.oy", Use::Applied, "from the corner; half a pixel is taken off"),
    Key::new("idealParams.oxOffset", Use::Applied, "from the middle"),
    Key::new("idealParams.oyOffset", Use::Applied, "from the middle"),
    Key::new("staticParams.k1", Use::Applied, "OpenCV's k1"),
    Key::new("staticParams.k2", Use::Applied, "OpenCV's k2"),
    Key::new("staticParams.k3", Use::Applied, "OpenCV's k3"),
    Key::new("staticParams.k4", Use::Applied, "OpenCV's k4"),
    Key::new("staticParams.k5", Use::Applied, "OpenCV's k5"),
    Key::new("staticParams.k6", Use::Applied, "OpenCV's k6"),
    Key::new("staticParams.t1", Use::Applied, "OpenCV's p1"),
    Key::new("staticParams.t2", Use::Applied, "OpenCV's p2"),
    Key::new("staticParams.max*", Use::Silent, "when its solver stops"),
    Key::new("vignetParams.vignetFile", Use::Applied, "photometric.vignette"),
    Key::new("vignetParams.vignetThresh1", Use::Applied, "photometric.vignette_thresholds"),
    Key::new("vignetParams.vignetThresh2", Use::Applied, "photometric.vignette_thresholds"),
    Key::new("camInAcEu.roll", Use::Applied, "mount.angles_deg"),
    Key::new("camInAcEu.pitch", Use::Applied, "mount.angles_deg"),
    Key::new("camInAcEu.yaw", Use::Applied, "mount.angles_deg"),
    Key::new(
        "camInAcEu.*Err",
        Use::Named(Neutral::Zero),
        "an error that program adds to what it tells its estimator",
    ),
    Key::new("sensorParams.cameraFps", Use::Applied, "fps"),
    Key::new("sensorParams.phasePercent", Use::Applied, "phase; a fraction, in spite of its name"),
    Key::new("dynamicParams.td", Use::Applied, "s: shutter.delay_ms"),
    Key::new("dynamicParams.tr", Use::Applied, "s: shutter.readout_ms"),
    Key::new("dynamicParams.te", Use::Applied, "s: shutter.exposure_ms"),
    Key::new("dynamicParams.ti", Use::Applied, "s: shutter.interlace_ms"),
    Key::new(
        "dynamicParams.tdErr",
        Use::Named(Neutral::Zero),
        "an error that program adds to what it tells its estimator",
    ),
    Key::new("dynamicParams.motionBlurExtraSamples", Use::Silent, "how finely it draws blur"),
    Key::new("signalParams.dayLight", Use::Applied, "photometric.light"),
    Key::new("signalParams.noiseAmp", Use::Applied, "photometric.noise_sigma"),
    Key::new("signalParams.noiseAmpDynamic", Use::Applied, "photometric.noise_sigma"),
    Key::new("signalParams.noiseAmpStatic*", Use::Named(Neutral::Zero), FIXED),
    Key::new("signalParams.fogVisibilityDistance", Use::Named(Neutral::Zero), "fog, which is not modelled"),
    Key::new("signalParams.seed", Use::Silent, "seed of the noise: the scenario's own counts"),
    Key::new("*.desc", Use::Silent, "free text"),
    Key::new("marginParams.**", Use::Silent, "how large it draws the ideal picture"),
    Key::new("mainParams.**", Use::Silent, RUN),
    Key::new("demParams.**", Use::Silent, RUN),
    Key::new("mapParams.**", Use::Silent, RUN),
    Key::new("pathParams.**", Use::Silent, RUN),
    Key::new("pathParamsExtra.**", Use::Silent, RUN),
    Key::new("vehicle.**", Use::Silent, RUN),
    Key::new(
        "includeParams.**",
        Use::Named(Neutral::Never),
        "a file that is read in place of or after this one there: import it too if it holds parts of the camera",
    ),
];

pub(super) fn fits(document: &Document) -> bool {
    document.root == "simParams"
}

/// The tree as that program sees it: without what is commented out, and of repeated elements the last.
pub(super) fn in_force(document: &Document) -> Document {
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

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    if find(value, "idealParams").is_none() {
        return Err(Problem::new(
            "idealParams",
            "is missing: a file of run parameters names its camera file in includeParams; import that one",
        ));
    }
    let (size_px, focal_px, principal_point_px) = intrinsics(value)?;
    let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
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
    // Called a percentage, used as a fraction of the frame period.
    spec.phase = or_zero("sensorParams.phasePercent")?;
    spec.mount.angles_deg =
        [or_zero("camInAcEu.roll")?, or_zero("camInAcEu.pitch")?, or_zero("camInAcEu.yaw")?];
    // Seconds there, and td counts as here: positive is older.
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
            "the file has no camInAcEu: the camera looks along the nose; the run parameters' own default is straight down (pitch -90)"
                .to_owned(),
        );
    }
    imported.notes.push(
        "the principal point was shifted by half a pixel: there, image corners are at whole numbers"
            .to_owned(),
    );
    Ok(imported)
}

/// Size, focal lengths, principal point.
type Intrinsics = ([u32; 2], [f64; 2], [f64; 2]);

/// After `resolutionScale`.
fn intrinsics(value: &Value) -> Result<Intrinsics, Problem> {
    let key = |name: &str| format!("idealParams.{name}");
    let get = |name: &str| optional_number(value, &key(name));
    let (width, height) = (number(value, &key("width"))?, number(value, &key("height"))?);
    let (width, height) = (width.trunc(), height.trunc());
    // From a field of view about the image centre.
    let focal = |field_deg: Option<f64>, size: f64| {
        field_deg.map(|field_deg| 0.5 * size / (0.5 * field_deg).to_radians().tan())
    };
    let (by_x, by_y) = (focal(get("fovX")?, width), focal(get("fovY")?, height));
    let f = get("f")?;
    let missing = || Problem::new(key("f"), "is missing: f, fx and fy, fovX or fovY gives the focal length");
    let fx = get("fx")?.or(f).or(by_x).or(by_y).ok_or_else(missing)?;
    let fy = get("fy")?.or(f).or(by_y).or(by_x).ok_or_else(missing)?;
    let ox = get("ox")?.unwrap_or(0.5 * width + get("oxOffset")?.unwrap_or(0.0));
    let oy = get("oy")?.unwrap_or(0.5 * height + get("oyOffset")?.unwrap_or(0.0));
    let scale = get("resolutionScale")?.unwrap_or(1.0);
    // That program truncates; a scale that does not divide evenly is refused rather than imitated.
    let size_px = size("idealParams.width x resolutionScale", [width * scale, height * scale])?;
    Ok((size_px, [fx * scale, fy * scale], [ox * scale - 0.5, oy * scale - 0.5]))
}
