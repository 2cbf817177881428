//! OpenSfM and OpenDroneMap: `camera_models.json`, `cameras.json`, `reconstruction.json`. Lengths are
//! fractions of the longer side, counted from the middle of the picture.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, number, one_of, optional_number, size, word};
use super::keys::{Key, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

const FRACTION: &str = "fraction of the longer side";

/// Paths below the camera's name.
pub(super) const KEYS: &[Key] = &[
    Key::new(
        "projection_type",
        Use::Applied,
        "perspective (also where it is missing), simple_radial, radial, brown, fisheye, fisheye_opencv; others are refused",
    ),
    Key::new(
        "width",
        Use::Applied,
        "must be there; the data base of cameras that ships with OpenSfM has none",
    ),
    Key::new("height", Use::Applied, "must be there"),
    Key::new("focal", Use::Applied, FRACTION),
    Key::new("focal_x", Use::Applied, FRACTION),
    Key::new("focal_y", Use::Applied, "fraction of the longer side, of fx and fy alike"),
    Key::new("c_x", Use::Applied, "fraction of the longer side, from the middle"),
    Key::new("c_y", Use::Applied, "fraction of the longer side, from the middle"),
    Key::new(
        "k1",
        Use::Applied,
        "coefficient; refused unless zero where the projection has it not, like the following",
    ),
    Key::new("k2", Use::Applied, "coefficient"),
    Key::new("k3", Use::Applied, "coefficient"),
    Key::new("k4", Use::Applied, "coefficient"),
    Key::new("p1", Use::Applied, "coefficient"),
    Key::new("p2", Use::Applied, "coefficient"),
    Key::new("*_prior", Use::Silent, "starting values"),
];

fn is_camera(value: &Value) -> bool {
    ["focal", "focal_x"].iter().any(|key| value.get(key).is_some_and(Value::is_number))
}

/// The part of the tree in which cameras stand by name, and where it is.
fn cameras(document: &Document) -> Option<(&serde_json::Map<String, Value>, &'static str)> {
    let value = &document.value;
    let list = value.as_array().and_then(|list| list.first());
    if let Some(map) = list.and_then(|first| first.get("cameras")).and_then(Value::as_object) {
        return Some((map, "[0].cameras."));
    }
    match value.get("cameras").and_then(Value::as_object) {
        Some(map) => Some((map, "cameras.")),
        None => value.as_object().map(|map| (map, "")),
    }
}

/// OpenSfM's data base of cameras, by maker and model, without sizes.
fn is_data_base(document: &Document) -> bool {
    let first = if let Value::Array(list) = &document.value { list.first() } else { Some(&document.value) };
    let makers = first.and_then(Value::as_object).into_iter().flatten();
    makers.into_iter().any(|(_, maker)| ["MODEL", "FOCAL", "ALL"].iter().any(|key| maker.get(key).is_some()))
}

pub(super) fn fits(document: &Document) -> bool {
    let named = cameras(document).is_some_and(|(map, _)| map.values().any(is_camera));
    document.root.is_empty()
        && (named
            || is_camera(&document.value) && find(&document.value, "projection_type").is_some()
            || is_data_base(document))
}

pub(super) fn entries(document: &Document) -> Result<Vec<Entry<'_>>, Problem> {
    if is_data_base(document) {
        let text = "are OpenSfM's by maker and model, without the size of a picture, and all lengths are fractions of its longer side: copy the one that is \
                    meant into a file of its own, as {\"my camera\": {\"projection_type\": ..., \"width\": ..., \"height\": ..., ...}}";
        return Err(Problem::new("cameras", text));
    }
    if is_camera(&document.value) {
        return Ok(Entry::only(&document.value));
    }
    let (map, prefix) =
        cameras(document).ok_or_else(|| Problem::new("cameras", "there is none in the file"))?;
    let cameras = map.iter().filter(|(_, value)| is_camera(value));
    Ok(cameras.map(|(name, value)| Entry::new(name.clone(), value, format!("{prefix}{name}"))).collect())
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
    for key in ["width", "height"] {
        if find(value, key).is_none() {
            return Err(Problem::new(
                key,
                "is missing: all lengths are fractions of the longer side; add width and height of the pictures",
            ));
        }
    }
    let [width, height] = [number(value, "width")?, number(value, "height")?];
    let size_px = size("width", [width, height])?;
    let longer = width.max(height);
    let kind = word(value, "projection_type").unwrap_or("perspective");
    let (model, coefficients, names): (LensModel, &[&str], &str) = match kind {
        "perspective" | "radial" => (LensModel::BrownConrady, &["k1", "k2"], "k1, k2"),
        "simple_radial" => (LensModel::BrownConrady, &["k1"], "k1"),
        "brown" => (LensModel::BrownConrady, &["k1", "k2", "p1", "p2", "k3"], "k1, k2, p1, p2, k3"),
        "fisheye" => (LensModel::KannalaBrandt, &["k1", "k2"], "k1, k2"),
        "fisheye_opencv" => (LensModel::KannalaBrandt, &["k1", "k2", "k3", "k4"], "k1 to k4"),
        other => {
            let which = models::unknown(other).map_or(String::new(), |name| format!(" ({name})"));
            let text = format!(
                "is `{other}`{which}, which no lens here is: reconstruct with perspective, brown or fisheye_opencv"
            );
            return Err(Problem::new("projection_type", text));
        }
    };
    for key in ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "s0", "s1", "s2", "s3"] {
        if !coefficients.contains(&key) && or_zero(key)? != 0.0 {
            return Err(Problem::new(
                key,
                format!(
                    "is not zero, but `{kind}` has {names} alone: delete it, or name the projection that is meant"
                ),
            ));
        }
    }
    let focal = match one_of(value, &["focal_x", "focal"])? {
        Some(key) => {
            [number(value, key)?, optional_number(value, "focal_y")?.map_or_else(|| number(value, key), Ok)?]
        }
        None => return Err(Problem::new("focal", "is missing")),
    };
    let order: &[&str] = if model == LensModel::KannalaBrandt {
        &["k1", "k2", "k3", "k4"]
    } else {
        &["k1", "k2", "p1", "p2", "k3"]
    };
    let list = order.iter().map(|key| or_zero(key)).collect::<Result<Vec<f64>, _>>()?;
    let middle = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    let point = [middle[0] + longer * or_zero("c_x")?, middle[1] + longer * or_zero("c_y")?];
    Ok(camera(CameraFormat::OpenSfm, size_px, focal.map(|f| f * longer), point, model, list))
}
