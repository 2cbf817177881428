//! Agisoft XML: Metashape and PhotoScan since 1.2 (`f`, principal point from the image centre, P1 and P2
//! swapped against OpenCV), and Agisoft Lens (`fx`, `fy`, absolute principal point, P1 and P2 as in OpenCV).
//! Image corners are at integers in both. A file is a single calibration, or the cameras of a project
//! (`cameras.xml`), with one calibration per sensor.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{
    KeyRow, Neutral, TableLeaves, applied, ignored, leaves, refused, reported,
};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::{CameraEntry, single};
use crate::text::document::{Document, KeyProblem, find, number, optional_number, size, word};

/// A panorama.
const SPHERICAL: &str = "spherical";

const SKEW: &str = "skew, which is not supported: recalibrate without it";
const TANGENTIAL: &str = "a tangential term of higher order, which is not supported: recalibrate without it";

pub(crate) const READER: Reader = Reader {
    roots: &["calibration", "document"],
    entries,
    leaves: own_leaves,
    ..Reader::new(
        "agisoft",
        "Agisoft Metashape and Lens XML",
        matches,
        &[("a calibration", KEYS), ("a sensor of a project, relative to the sensor", SENSOR_KEYS)],
        |camera| import(camera.document, camera.value()),
    )
};

/// Keys of a single calibration.
const KEYS: &[KeyRow] = &[
    applied("projection", "frame, fisheye or spherical (a whole turn); others are refused. Also `type`"),
    applied("type", "as projection"),
    applied("width", "width"),
    applied("height", "height"),
    applied("resolution.*", "width and height"),
    applied("f", "fy; fx is f + b1"),
    applied("fx fy", "Agisoft Lens; used only without `f`"),
    applied(
        "cx",
        "from the centre of the picture; with fx and fy from its corner. Half a pixel is subtracted",
    ),
    applied("cy", "as cx"),
    applied("b1", "fx - fy"),
    refused(Neutral::Zero, "b2 skew", SKEW),
    applied("k1 k2 k3", "coefficient"),
    applied("k4", "coefficient of a fisheye; refused in a frame camera unless zero"),
    applied("p1", "OpenCV's p2; with fx and fy OpenCV's p1"),
    applied("p2", "OpenCV's p1; with fx and fy OpenCV's p2"),
    refused(Neutral::Zero, "p3 p4", TANGENTIAL),
    ignored("date", "date or version"),
    ignored("class", "initial or adjusted"),
    ignored("covariance.** *.covariance*.**", "calibration residual"),
];

/// Keys of a sensor, relative to it.
const SENSOR_KEYS: &[KeyRow] = &[
    applied("calibration.**", "as a single calibration; of several, the one of class `adjusted`"),
    applied("type", "used if the calibration has none"),
    reported(
        Neutral::Zero,
        "rolling_shutter",
        "Metashape solved for a rolling shutter, but its file has no readout time: set shutter.readout_ms",
    ),
    applied("resolution.*", "used if the calibration has none"),
    ignored("label", "the name for `--camera`"),
    ignored("id", "works for `--camera` too"),
    ignored("property property.**", "pixel size and focal length in mm"),
    ignored("*_width *_height", "pixel size, mm"),
    ignored("focal_length", "mm"),
    ignored("bands.**", "colour bands"),
    ignored("data_type", "uint8"),
    ignored("layer_index", "position in a rig"),
    reported(Neutral::Never, "master_id rotation.** location.**", "position in a rig: set mount instead"),
    ignored("black_level sensitivity", "radiometry"),
    reported(Neutral::Never, "vignetting.**", "convert it to a picture and set photometric.vignette"),
    ignored("covariance.**", "calibration residual"),
    ignored("meta.**", "free text"),
];

fn matches(document: &Document) -> bool {
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

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    if document.root == "calibration" {
        return single(document);
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

/// Those of a sensor and of its calibration; the rest of a project is poses and points.
fn own_leaves<'a>(selected: &Selected<'a>) -> Vec<TableLeaves<'a>> {
    if selected.document.root != "document" {
        return vec![TableLeaves { keys: KEYS, leaves: leaves(&selected.document.value) }];
    }
    let calibration =
        calibration_of(selected.value()).map(|value| TableLeaves { keys: KEYS, leaves: leaves(value) });
    let sensor = TableLeaves { keys: SENSOR_KEYS, leaves: leaves(selected.value()) };
    calibration.into_iter().chain([sensor]).collect()
}

fn import(document: &Document, value: &Value) -> Result<ReadCamera, KeyProblem> {
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
fn calibration_of(sensor: &Value) -> Option<&Value> {
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

fn calibration(value: &Value, sensor: Option<&Value>) -> Result<ReadCamera, KeyProblem> {
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
        return lens_models::panorama(value, ("projection", SPHERICAL), size_px, &others);
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
    Ok(camera(size_px, focal_px, principal_point_px, model, coefficients))
}
