//! Agisoft XML: Metashape and PhotoScan since 1.2 (`f`, principal point from the image centre, P1 and P2
//! swapped against OpenCV), and Agisoft Lens (`fx`, `fy`, absolute principal point, P1 and P2 as in OpenCV).
//! Image corners are at integers in both. A file is a single calibration, or the cameras of a project
//! (`cameras.xml`), with one calibration per sensor.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models};

/// A panorama.
const SPHERICAL: &str = "spherical";

const SKEW: &str = "skew, which is not supported: recalibrate without it";
const TANGENTIAL: &str = "a tangential term of higher order, which is not supported: recalibrate without it";

/// Keys of a single calibration.
pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "projection",
        Treatment::Applied,
        "frame, fisheye or spherical (a whole turn); others are refused. Also `type`",
    ),
    KeyRow::new("type", Treatment::Applied, "as projection"),
    KeyRow::new("width", Treatment::Applied, "width"),
    KeyRow::new("height", Treatment::Applied, "height"),
    KeyRow::new("resolution.*", Treatment::Applied, "width and height"),
    KeyRow::new("f", Treatment::Applied, "fy; fx is f + b1"),
    KeyRow::new("fx", Treatment::Applied, "Agisoft Lens; used only without `f`"),
    KeyRow::new("fy", Treatment::Applied, "Agisoft Lens; used only without `f`"),
    KeyRow::new(
        "cx",
        Treatment::Applied,
        "from the centre of the picture; with fx and fy from its corner. Half a pixel is subtracted",
    ),
    KeyRow::new("cy", Treatment::Applied, "as cx"),
    KeyRow::new("b1", Treatment::Applied, "fx - fy"),
    KeyRow::new("b2", Treatment::Refused(Neutral::Zero), SKEW),
    KeyRow::new("skew", Treatment::Refused(Neutral::Zero), SKEW),
    KeyRow::new("k1", Treatment::Applied, "coefficient"),
    KeyRow::new("k2", Treatment::Applied, "coefficient"),
    KeyRow::new("k3", Treatment::Applied, "coefficient"),
    KeyRow::new("k4", Treatment::Applied, "coefficient of a fisheye; refused in a frame camera unless zero"),
    KeyRow::new("p1", Treatment::Applied, "OpenCV's p2; with fx and fy OpenCV's p1"),
    KeyRow::new("p2", Treatment::Applied, "OpenCV's p1; with fx and fy OpenCV's p2"),
    KeyRow::new("p3", Treatment::Refused(Neutral::Zero), TANGENTIAL),
    KeyRow::new("p4", Treatment::Refused(Neutral::Zero), TANGENTIAL),
    KeyRow::new("date", Treatment::Ignored, "date or version"),
    KeyRow::new("class", Treatment::Ignored, "initial or adjusted"),
    KeyRow::new("covariance.**", Treatment::Ignored, "calibration residual"),
    KeyRow::new("*.covariance*.**", Treatment::Ignored, "calibration residual"),
];

/// Keys of a sensor, relative to it.
pub(super) const SENSOR_KEYS: &[KeyRow] = &[
    KeyRow::new(
        "calibration.**",
        Treatment::Applied,
        "as a single calibration; of several, the one of class `adjusted`",
    ),
    KeyRow::new("type", Treatment::Applied, "used if the calibration has none"),
    KeyRow::new(
        "rolling_shutter",
        Treatment::Reported(Neutral::Zero),
        "Metashape solved for a rolling shutter, but its file has no readout time: set shutter.readout_ms",
    ),
    KeyRow::new("resolution.*", Treatment::Applied, "used if the calibration has none"),
    KeyRow::new("label", Treatment::Ignored, "the name for `--camera`"),
    KeyRow::new("id", Treatment::Ignored, "works for `--camera` too"),
    KeyRow::new("property", Treatment::Ignored, "pixel size and focal length in mm"),
    KeyRow::new("property.**", Treatment::Ignored, "pixel size and focal length in mm"),
    KeyRow::new("*_width", Treatment::Ignored, "pixel size, mm"),
    KeyRow::new("*_height", Treatment::Ignored, "pixel size, mm"),
    KeyRow::new("focal_length", Treatment::Ignored, "mm"),
    KeyRow::new("bands.**", Treatment::Ignored, "colour bands"),
    KeyRow::new("data_type", Treatment::Ignored, "uint8"),
    KeyRow::new("layer_index", Treatment::Ignored, "position in a rig"),
    KeyRow::new("master_id", Treatment::Reported(Neutral::Never), "position in a rig: set mount instead"),
    KeyRow::new("rotation.**", Treatment::Reported(Neutral::Never), "position in a rig: set mount instead"),
    KeyRow::new("location.**", Treatment::Reported(Neutral::Never), "position in a rig: set mount instead"),
    KeyRow::new("black_level", Treatment::Ignored, "radiometry"),
    KeyRow::new("sensitivity", Treatment::Ignored, "radiometry"),
    KeyRow::new(
        "vignetting.**",
        Treatment::Reported(Neutral::Never),
        "convert it to a picture and set photometric.vignette",
    ),
    KeyRow::new("covariance.**", Treatment::Ignored, "calibration residual"),
    KeyRow::new("meta.**", Treatment::Ignored, "free text"),
];

pub(super) fn matches(document: &Document) -> bool {
    let is_single = document.root == "calibration"
        && (["f", "fx"].iter().any(|key| find(&document.value, key).is_some())
            || word(&document.value, "projection") == Some(SPHERICAL));
    is_single || document.root == "document" && find(&document.value, "chunk").is_some()
}

/// Elements of a name with their paths.
fn elements<'a>(value: &'a Value, key: &str) -> Vec<(String, &'a Value)> {
    match value.get(key) {
        Some(Value::Array(list)) => {
            list.iter().enumerate().map(|(index, item)| (format!("{key}[{index}]"), item)).collect()
        }
        Some(single) => vec![(key.to_owned(), single)],
        None => Vec::new(),
    }
}

pub(super) fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    if document.root == "calibration" {
        return Ok(CameraEntry::single(&document.value));
    }
    let mut entries = Vec::new();
    for (chunk_path, chunk) in elements(&document.value, "chunk") {
        for (sensors_path, sensors) in elements(chunk, "sensors") {
            for (sensor_path, sensor) in elements(sensors, "sensor") {
                let id = sensor.get("id").map(Value::to_string).unwrap_or_default();
                let id = id.trim_end_matches(".0").to_owned();
                let name = word(sensor, "label").map_or_else(|| format!("sensor {id}"), str::to_owned);
                entries.push(CameraEntry {
                    name,
                    aliases: vec![id],
                    value: sensor,
                    roots: vec![format!("{chunk_path}.{sensors_path}.{sensor_path}")],
                });
            }
        }
    }
    if entries.is_empty() {
        return Err(KeyProblem::new(
            "chunk.sensors",
            "is empty: align the cameras before exporting, or export a single calibration",
        ));
    }
    Ok(entries)
}

pub(super) fn import(document: &Document, value: &Value) -> Result<ImportedCamera, KeyProblem> {
    if document.root == "calibration" {
        return calibration(value, None);
    }
    let sensor_calibration = match calibration_of(value) {
        Some(found) => found,
        // It has nothing to calibrate.
        None if word(value, "type") == Some(SPHERICAL) => return calibration(value, None),
        None => return Err(KeyProblem::new("calibration", "is missing: align the cameras before exporting")),
    };
    calibration(sensor_calibration, Some(value))
        .map_err(|problem| KeyProblem { key: format!("calibration.{}", problem.key), ..problem })
}

/// The adjusted calibration of a sensor, else its last.
pub(super) fn calibration_of(sensor: &Value) -> Option<&Value> {
    let all = elements(sensor, "calibration");
    let adjusted =
        all.iter().rfind(|(_, calibration)| word(calibration, "class") == Some("adjusted")).or(all.last());
    adjusted.map(|(_, calibration)| *calibration)
}

/// Width and height of a calibration or a sensor.
fn resolution(value: &Value) -> Option<Result<[f64; 2], KeyProblem>> {
    let pair = |prefix: &str| {
        Ok([number(value, &format!("{prefix}width"))?, number(value, &format!("{prefix}height"))?])
    };
    if find(value, "resolution").is_some() {
        return Some(pair("resolution."));
    }
    (find(value, "width").is_some() || find(value, "height").is_some()).then(|| pair(""))
}

fn calibration(value: &Value, sensor: Option<&Value>) -> Result<ImportedCamera, KeyProblem> {
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    for (key, why) in [("b2", SKEW), ("skew", SKEW), ("p3", TANGENTIAL), ("p4", TANGENTIAL)] {
        if or_zero(key)? != 0.0 {
            return Err(KeyProblem::new(key, format!("is not zero: {why}")));
        }
    }
    let dimensions = resolution(value).or_else(|| sensor.and_then(resolution));
    let [width, height] = dimensions.unwrap_or_else(|| Err(KeyProblem::new("width", "is missing")))?;
    let size_px = size("width", [width, height])?;
    let projection = word(value, "projection")
        .or_else(|| word(value, "type"))
        .or_else(|| sensor.and_then(|sensor| word(sensor, "type")))
        .unwrap_or("frame");
    if projection == SPHERICAL {
        let others = ["f", "fx", "fy", "cx", "cy", "b1", "k1", "k2", "k3", "k4", "p1", "p2"];
        return lens_models::panorama(
            CameraFormat::Agisoft,
            value,
            ("projection", SPHERICAL),
            size_px,
            &others,
        );
    }
    let [k1, k2, k3, k4] = [or_zero("k1")?, or_zero("k2")?, or_zero("k3")?, or_zero("k4")?];
    let (p1, p2) = (or_zero("p1")?, or_zero("p2")?);
    // Files for both programs have both sets of keys; the newer program's are used.
    let (focal_px, corner_based, [p1, p2]) = if find(value, "f").is_some() {
        let f = number(value, "f")?;
        ([f + or_zero("b1")?, f], [0.5 * width + or_zero("cx")?, 0.5 * height + or_zero("cy")?], [p2, p1])
    } else {
        ([number(value, "fx")?, number(value, "fy")?], [number(value, "cx")?, number(value, "cy")?], [p1, p2])
    };
    let principal_point_px = [corner_based[0] - 0.5, corner_based[1] - 0.5];
    let (model, coefficients) = match projection {
        "frame" if k4 != 0.0 => {
            return Err(KeyProblem::new(
                "k4",
                "is not zero: a radial term of r^8 is not supported; recalibrate without K4",
            ));
        }
        "frame" => (LensModel::BrownConrady, vec![k1, k2, p1, p2, k3]),
        "fisheye" | "equidistant_fisheye" if p1 != 0.0 || p2 != 0.0 => {
            return Err(KeyProblem::new(
                "p1",
                "is not zero: tangential terms of a fisheye are not supported; recalibrate without P1 and P2",
            ));
        }
        "fisheye" | "equidistant_fisheye" => (LensModel::KannalaBrandt, vec![k1, k2, k3, k4]),
        other => {
            return Err(KeyProblem::new(
                "projection",
                format!("is `{other}`: frame, fisheye (equidistant) and spherical can be imported"),
            ));
        }
    };
    Ok(camera(CameraFormat::Agisoft, size_px, focal_px, principal_point_px, model, coefficients))
}
