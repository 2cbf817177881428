//! XML of the paper's reference program (`<simParams>`). As there, of repeated elements the last is used, and
//! elements whose name ends in 0 are commented out.

use std::path::PathBuf;

use camsim_core::scenario::{FieldOr, LensModel};
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, ignored, reported};
use crate::text::document::{Document, KeyProblem, find, number, optional_number, size, word};

const RUN: &str = "a setting of the run, not of the camera";
const FIXED: &str =
    "fixed-pattern noise of that program: set sensor.dsnu_e, row_offset_e or column_offset_e instead";

pub(crate) const READER: Reader = Reader {
    roots: &["simParams"],
    prepare: effective_document,
    has_common_timing: false,
    ..Reader::new(
        "reference",
        "the reference program's XML",
        |_| true,
        &[("", KEYS)],
        |camera| import(camera.value()),
    )
};

const KEYS: &[KeyRow] = &[
    applied("idealParams.width idealParams.height", "times resolutionScale"),
    applied("idealParams.resolutionScale", "scales size, focal lengths and principal point"),
    applied("idealParams.f idealParams.fx idealParams.fy", "px"),
    applied("idealParams.fovX idealParams.fovY", "degrees, where no focal length is given"),
    applied("idealParams.ox idealParams.oy", "from the corner; half a pixel is subtracted"),
    applied("idealParams.oxOffset idealParams.oyOffset", "from the centre"),
    applied("staticParams.k1", "OpenCV's k1"),
    applied("staticParams.k2", "OpenCV's k2"),
    applied("staticParams.k3", "OpenCV's k3"),
    applied("staticParams.k4", "OpenCV's k4"),
    applied("staticParams.k5", "OpenCV's k5"),
    applied("staticParams.k6", "OpenCV's k6"),
    applied("staticParams.t1", "OpenCV's p1"),
    applied("staticParams.t2", "OpenCV's p2"),
    ignored("staticParams.max*", "stopping criterion of its solver"),
    applied("vignetParams.vignetFile", "photometric.vignette"),
    applied("vignetParams.vignetThresh1 vignetParams.vignetThresh2", "photometric.vignette_thresholds"),
    applied("camInAcEu.roll camInAcEu.pitch camInAcEu.yaw", "mount.angles_deg"),
    reported(Neutral::Zero, "camInAcEu.*Err", "error that the program adds to its estimator's input"),
    applied("sensorParams.cameraFps", "fps"),
    applied("sensorParams.phasePercent", "phase; a fraction, despite its name"),
    applied("dynamicParams.td", "s: shutter.delay_ms"),
    applied("dynamicParams.tr", "s: shutter.readout_ms"),
    applied("dynamicParams.te", "s: shutter.exposure_ms"),
    applied("dynamicParams.ti", "s: shutter.interlace_ms"),
    reported(Neutral::Zero, "dynamicParams.tdErr", "error that the program adds to its estimator's input"),
    ignored("dynamicParams.motionBlurExtraSamples", "sampling of motion blur"),
    applied("signalParams.dayLight", "photometric.light"),
    applied("signalParams.noiseAmp signalParams.noiseAmpDynamic", "photometric.noise_sigma"),
    reported(Neutral::Zero, "signalParams.noiseAmpStatic*", FIXED),
    reported(Neutral::Zero, "signalParams.fogVisibilityDistance", "fog, which is not modelled"),
    ignored("signalParams.seed", "noise seed: the scenario has its own"),
    ignored("*.desc", "free text"),
    ignored("marginParams.**", "size of the ideal picture"),
    ignored("mainParams.** demParams.** mapParams.** pathParams.** pathParamsExtra.** vehicle.**", RUN),
    reported(
        Neutral::Never,
        "includeParams.**",
        "further file of the reference program: import it too if it has parts of the camera",
    ),
];

/// The document without commented-out elements and with the last of repeated elements.
fn effective_document(mut document: Document) -> Document {
    if let Value::Object(map) = &mut document.value {
        map.retain(|name, _| !name.ends_with('0'));
        for element in map.values_mut() {
            if let Value::Array(list) = element {
                *element = list.pop().unwrap_or(Value::Null);
            }
        }
    }
    document
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
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
    let mut imported = camera(size_px, focal_px, principal_point_px, LensModel::BrownConrady, coefficients);
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
