//! Kalibr camchain, and EuRoC's sensor.yaml, which describes one camera in the same words.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, Problem, at_most, find, number, numbers, numbers_n, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits_camchain(document: &Document) -> bool {
    document.root.is_empty() && find(&document.value, "cam0.intrinsics").is_some()
}

pub(super) fn fits_euroc(document: &Document) -> bool {
    document.root.is_empty() && ["intrinsics", "resolution", "distortion_model"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import_camchain(document: &Document) -> Result<ImportedCamera, Problem> {
    let cam0 = find(&document.value, "cam0").ok_or_else(|| Problem::new("cam0", "is missing: this is no camchain"))?;
    let mut imported =
        import_camera(cam0, CameraFormat::Kalibr).map_err(|problem| Problem { key: format!("cam0.{}", problem.key), ..problem })?;
    if find(&document.value, "cam1").is_some() {
        imported
            .notes
            .push("the camchain has several cameras; cam0 was taken (for another one, leave only that one and call it cam0)".to_owned());
    }
    imported.notes.push("extrinsics and time shift are those to an IMU that is not simulated: left out".to_owned());
    imported.notes.push("the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned());
    Ok(imported)
}

pub(super) fn import_euroc(document: &Document) -> Result<ImportedCamera, Problem> {
    let mut imported = import_camera(&document.value, CameraFormat::Euroc)?;
    if find(&document.value, "rate_hz").is_some() {
        imported.spec.fps = number(&document.value, "rate_hz")?;
    } else {
        imported.notes.push("the file has no rate_hz: fps is 30".to_owned());
    }
    imported.notes.push("T_BS is the pose to an IMU whose axes are not the body's here: set mount by hand".to_owned());
    Ok(imported)
}

fn import_camera(value: &Value, format: CameraFormat) -> Result<ImportedCamera, Problem> {
    if let Some(model) = word(value, "camera_model")
        && model != "pinhole"
    {
        return Err(Problem::new("camera_model", format!("is `{model}`: only `pinhole` (with any distortion) can be imported")));
    }
    let [fx, fy, cx, cy] = numbers_n(value, "intrinsics")?;
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let coefficients = || numbers(value, "distortion_coefficients").or_else(|_| numbers(value, "distortion_coeffs"));
    let (model, coefficients) = match word(value, "distortion_model").unwrap_or("none") {
        "none" => (LensModel::BrownConrady, Vec::new()),
        "radtan" | "radial-tangential" | "plumb_bob" => {
            (LensModel::BrownConrady, at_most("distortion_coeffs", coefficients()?, 8, "radial-tangential has up to eight")?)
        }
        "equidistant" | "equi" => (LensModel::KannalaBrandt, at_most("distortion_coeffs", coefficients()?, 4, "equidistant has four")?),
        other => {
            return Err(Problem::new(
                "distortion_model",
                format!("is `{other}`: `radtan`, `equidistant` and `none` can be imported; recalibrate with one of these"),
            ));
        }
    };
    Ok(camera(format, size_px, [fx, fy], [cx, cy], model, coefficients))
}
