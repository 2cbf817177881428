//! XML of the paper's reference program (`<simParams>`). Of repeated elements the last one counts, as there; elements whose name ends
//! in 0 are its way of commenting out.

use std::path::PathBuf;

use camsim_core::scenario::{FieldOr, LensModel};
use serde_json::Value;

use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits(document: &Document) -> bool {
    document.root == "simParams"
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
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
    let mut imported = camera(CameraFormat::Reference, size_px, focal_px, principal_point_px, LensModel::BrownConrady, coefficients);
    let spec = &mut imported.spec;

    if let Some(fps) = optional_number(value, "sensorParams.cameraFps")? {
        spec.fps = fps;
    }
    // Called a percentage, used as a fraction of the frame period.
    spec.phase = or_zero("sensorParams.phasePercent")?;
    spec.mount.angles_deg = [or_zero("camInAcEu.roll")?, or_zero("camInAcEu.pitch")?, or_zero("camInAcEu.yaw")?];
    // Seconds there, and td counts as here: positive is older.
    spec.shutter.delay_ms = 1e3 * or_zero("dynamicParams.td")?;
    spec.shutter.readout_ms = 1e3 * or_zero("dynamicParams.tr")?;
    spec.shutter.exposure_ms = 1e3 * or_zero("dynamicParams.te")?;
    spec.shutter.interlace_ms = FieldOr::Ms(1e3 * or_zero("dynamicParams.ti")?);
    if let Some(file) = word(value, "vignetParams.vignetFile").filter(|file| !file.is_empty()) {
        spec.photometric.vignette = Some(PathBuf::from(file));
        spec.photometric.vignette_thresholds = [number(value, "vignetParams.vignetThresh1")?, number(value, "vignetParams.vignetThresh2")?];
    }
    spec.photometric.light = optional_number(value, "signalParams.dayLight")?.unwrap_or(1.0);
    spec.photometric.noise_sigma =
        optional_number(value, "signalParams.noiseAmpDynamic")?.or(optional_number(value, "signalParams.noiseAmp")?).unwrap_or(0.0);
    for key in ["signalParams.noiseAmpStatic1", "signalParams.noiseAmpStatic2"] {
        if or_zero(key)? != 0.0 {
            imported.notes.push(format!("{key} (a fixed noise pattern) was left out"));
        }
    }
    if find(value, "camInAcEu").is_none() {
        imported.notes.push(
            "the file has no camInAcEu: the camera looks along the nose; the run parameters' own default is straight down (pitch -90)"
                .to_owned(),
        );
    }
    imported.notes.push("the principal point was shifted by half a pixel: there, image corners are at whole numbers".to_owned());
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
    let focal = |field_deg: Option<f64>, size: f64| field_deg.map(|field_deg| 0.5 * size / (0.5 * field_deg).to_radians().tan());
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
