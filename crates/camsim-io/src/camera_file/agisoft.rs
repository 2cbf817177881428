//! Agisoft XML: Metashape and PhotoScan since 1.2 (`f`, principal point from the image centre, P1 and P2 the
//! other way round than in OpenCV), and Agisoft Lens (`fx`, `fy`, absolute principal point, P1 and P2 as in
//! OpenCV). Image corners are at whole pixels in both. Either a calibration alone, or the cameras of a
//! project (`cameras.xml`), whose sensors hold one each.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

const SKEW: &str = "skew, which a camera here cannot have: recalibrate without";
const TANGENTIAL: &str = "a tangential term of higher order, which no lens here has: recalibrate without";

/// Of a calibration alone.
pub(super) const KEYS: &[Key] = &[
    Key::new("projection", Use::Applied, "frame or fisheye; others are refused. Also `type`"),
    Key::new("type", Use::Applied, "as projection"),
    Key::new("width", Use::Applied, "width"),
    Key::new("height", Use::Applied, "height"),
    Key::new("resolution.*", Use::Applied, "width and height"),
    Key::new("f", Use::Applied, "fy; fx is f + b1"),
    Key::new("fx", Use::Applied, "Agisoft Lens; without `f` alone"),
    Key::new("fy", Use::Applied, "Agisoft Lens; without `f` alone"),
    Key::new(
        "cx",
        Use::Applied,
        "from the middle of the picture; with fx and fy from its corner. Half a pixel is taken off",
    ),
    Key::new("cy", Use::Applied, "as cx"),
    Key::new("b1", Use::Applied, "fx - fy"),
    Key::new("b2", Use::Refused(Neutral::Zero), SKEW),
    Key::new("skew", Use::Refused(Neutral::Zero), SKEW),
    Key::new("k1", Use::Applied, "coefficient"),
    Key::new("k2", Use::Applied, "coefficient"),
    Key::new("k3", Use::Applied, "coefficient"),
    Key::new("k4", Use::Applied, "coefficient of a fisheye; refused in a frame camera unless zero"),
    Key::new("p1", Use::Applied, "OpenCV's p2; with fx and fy OpenCV's p1"),
    Key::new("p2", Use::Applied, "OpenCV's p1; with fx and fy OpenCV's p2"),
    Key::new("p3", Use::Refused(Neutral::Zero), TANGENTIAL),
    Key::new("p4", Use::Refused(Neutral::Zero), TANGENTIAL),
    Key::new("date", Use::Silent, "when it was made"),
    Key::new("class", Use::Silent, "initial or adjusted"),
    Key::new("covariance.**", Use::Silent, "how well it fitted"),
    Key::new("*.covariance*.**", Use::Silent, "how well it fitted"),
];

/// Of a sensor, below its place.
pub(super) const SENSOR_KEYS: &[Key] = &[
    Key::new(
        "calibration.**",
        Use::Applied,
        "as a calibration alone; of several the one of class `adjusted`",
    ),
    Key::new("type", Use::Applied, "where the calibration names none"),
    Key::new(
        "rolling_shutter",
        Use::Named(Neutral::Zero),
        "Metashape solved for a rolling shutter, but its file has no readout time: set shutter.readout_ms",
    ),
    Key::new("resolution.*", Use::Applied, "where the calibration has none"),
    Key::new("label", Use::Silent, "the name by which `--camera` finds it"),
    Key::new("id", Use::Silent, "also finds it"),
    Key::new("property", Use::Silent, "size of a pixel and focal length in mm, fixed or not"),
    Key::new("property.**", Use::Silent, "size of a pixel and focal length in mm, fixed or not"),
    Key::new("*_width", Use::Silent, "size of a pixel, mm"),
    Key::new("*_height", Use::Silent, "size of a pixel, mm"),
    Key::new("focal_length", Use::Silent, "mm"),
    Key::new("bands.**", Use::Silent, "colour bands"),
    Key::new("data_type", Use::Silent, "uint8"),
    Key::new("layer_index", Use::Silent, "place in a rig"),
    Key::new("master_id", Use::Named(Neutral::Never), "place in a rig: set mount by hand"),
    Key::new("rotation.**", Use::Named(Neutral::Never), "place in a rig: set mount by hand"),
    Key::new("location.**", Use::Named(Neutral::Never), "place in a rig: set mount by hand"),
    Key::new("black_level", Use::Silent, "radiometry"),
    Key::new("sensitivity", Use::Silent, "radiometry"),
    Key::new(
        "vignetting.**",
        Use::Named(Neutral::Never),
        "draw it as a picture and set photometric.vignette",
    ),
    Key::new("covariance.**", Use::Silent, "how well it fitted"),
    Key::new("meta.**", Use::Silent, "free text"),
];

pub(super) fn fits(document: &Document) -> bool {
    let alone =
        document.root == "calibration" && ["f", "fx"].iter().any(|key| find(&document.value, key).is_some());
    alone || document.root == "document" && find(&document.value, "chunk").is_some()
}

/// An element that may be there once or several times.
fn each<'a>(value: &'a Value, key: &str) -> Vec<(String, &'a Value)> {
    match value.get(key) {
        Some(Value::Array(list)) => {
            list.iter().enumerate().map(|(index, item)| (format!("{key}[{index}]"), item)).collect()
        }
        Some(single) => vec![(key.to_owned(), single)],
        None => Vec::new(),
    }
}

pub(super) fn entries(document: &Document) -> Result<Vec<Entry<'_>>, Problem> {
    if document.root == "calibration" {
        return Ok(Entry::only(&document.value));
    }
    let mut entries = Vec::new();
    for (chunk_at, chunk) in each(&document.value, "chunk") {
        for (sensors_at, sensors) in each(chunk, "sensors") {
            for (at, sensor) in each(sensors, "sensor") {
                let id = sensor.get("id").map(Value::to_string).unwrap_or_default();
                let id = id.trim_end_matches(".0").to_owned();
                let name = word(sensor, "label").map_or_else(|| format!("sensor {id}"), str::to_owned);
                entries.push(Entry {
                    name,
                    also: vec![id],
                    value: sensor,
                    roots: vec![format!("{chunk_at}.{sensors_at}.{at}")],
                });
            }
        }
    }
    if entries.is_empty() {
        return Err(Problem::new(
            "chunk.sensors",
            "there is none: export the cameras after they are aligned, or the calibration alone",
        ));
    }
    Ok(entries)
}

pub(super) fn import(document: &Document, value: &Value) -> Result<ImportedCamera, Problem> {
    if document.root == "calibration" {
        return calibration(value, None);
    }
    let found = calibration_of(value)
        .ok_or_else(|| Problem::new("calibration", "is missing: align the cameras before you export them"))?;
    calibration(found, Some(value))
        .map_err(|problem| Problem { key: format!("calibration.{}", problem.key), ..problem })
}

/// Of several the adjusted one.
pub(super) fn calibration_of(sensor: &Value) -> Option<&Value> {
    let all = each(sensor, "calibration");
    let adjusted =
        all.iter().rfind(|(_, calibration)| word(calibration, "class") == Some("adjusted")).or(all.last());
    adjusted.map(|(_, found)| *found)
}

/// Width and height of a calibration or a sensor.
fn resolution(value: &Value) -> Option<Result<[f64; 2], Problem>> {
    let of = |prefix: &str| {
        Ok([number(value, &format!("{prefix}width"))?, number(value, &format!("{prefix}height"))?])
    };
    if find(value, "resolution").is_some() {
        return Some(of("resolution."));
    }
    (find(value, "width").is_some() || find(value, "height").is_some()).then(|| of(""))
}

fn calibration(value: &Value, sensor: Option<&Value>) -> Result<ImportedCamera, Problem> {
    let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
    for (key, why) in [("b2", SKEW), ("skew", SKEW), ("p3", TANGENTIAL), ("p4", TANGENTIAL)] {
        if or_zero(key)? != 0.0 {
            return Err(Problem::new(key, format!("is not zero: {why}")));
        }
    }
    let dimensions = resolution(value).or_else(|| sensor.and_then(resolution));
    let [width, height] = dimensions.unwrap_or_else(|| Err(Problem::new("width", "is missing")))?;
    let size_px = size("width", [width, height])?;
    let [k1, k2, k3, k4] = [or_zero("k1")?, or_zero("k2")?, or_zero("k3")?, or_zero("k4")?];
    let (p1, p2) = (or_zero("p1")?, or_zero("p2")?);
    // Where both are given (files that serve both programs), the newer one's keys count.
    let (focal_px, corner_based, [p1, p2]) = if find(value, "f").is_some() {
        let f = number(value, "f")?;
        ([f + or_zero("b1")?, f], [0.5 * width + or_zero("cx")?, 0.5 * height + or_zero("cy")?], [p2, p1])
    } else {
        ([number(value, "fx")?, number(value, "fy")?], [number(value, "cx")?, number(value, "cy")?], [p1, p2])
    };
    let principal_point_px = [corner_based[0] - 0.5, corner_based[1] - 0.5];
    let named = word(value, "projection")
        .or_else(|| word(value, "type"))
        .or_else(|| sensor.and_then(|sensor| word(sensor, "type")));
    let (model, coefficients) = match named.unwrap_or("frame") {
        "frame" if k4 != 0.0 => {
            return Err(Problem::new(
                "k4",
                "is not zero: a radial term in r^8 is not modelled; recalibrate with K4 off",
            ));
        }
        "frame" => (LensModel::BrownConrady, vec![k1, k2, p1, p2, k3]),
        "fisheye" | "equidistant_fisheye" if p1 != 0.0 || p2 != 0.0 => {
            return Err(Problem::new(
                "p1",
                "is not zero: a fisheye here has no tangential terms; recalibrate with P1 and P2 off",
            ));
        }
        "fisheye" | "equidistant_fisheye" => (LensModel::KannalaBrandt, vec![k1, k2, k3, k4]),
        other => {
            return Err(Problem::new(
                "projection",
                format!("is `{other}`: frame and fisheye (equidistant) can be imported"),
            ));
        }
    };
    Ok(camera(CameraFormat::Agisoft, size_px, focal_px, principal_point_px, model, coefficients))
}
