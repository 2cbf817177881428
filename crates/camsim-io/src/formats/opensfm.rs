//! OpenSfM and OpenDroneMap: `camera_models.json`, `cameras.json`, `reconstruction.json`. Lengths are
//! fractions of the longer side, from the centre of the picture.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{KeyRow, TableLeaves, applied, ignored, leaves};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::{CameraEntry, single};
use crate::formats::reading::stated_size::add_size;
use crate::text::document::{Document, KeyProblem, find, number, one_of, optional_number, size, word};

const FRACTION: &str = "fraction of the longer side";
/// Names of all coefficients.
const LENS_KEYS: [&str; 12] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "s0", "s1", "s2", "s3"];

pub(crate) const READER: Reader = Reader {
    prepare: effective_document,
    complete,
    entries,
    leaves: own_leaves,
    ..Reader::new(
        "opensfm",
        "OpenSfM and OpenDroneMap JSON",
        matches,
        &[("a camera, relative to its name", KEYS)],
        |camera| import(camera.value()),
    )
};

/// Keys of a camera, relative to its name.
const KEYS: &[KeyRow] = &[
    applied(
        "projection_type",
        "perspective (also if missing), simple_radial, radial, brown, fisheye, fisheye_opencv, spherical and \
         equirectangular (a whole turn); others are refused",
    ),
    applied("width", "required; OpenSfM's camera database has none: give --size"),
    applied("height", "required"),
    applied("focal focal_x", FRACTION),
    applied("focal_y", "fraction of the longer side, for fx and fy"),
    applied("c_x c_y", "fraction of the longer side, from the centre"),
    applied("k1", "coefficient; refused unless zero if the projection does not have it, like the following"),
    applied("k2 k3 k4 p1 p2", "coefficient"),
    ignored("*_prior", "starting values"),
];

fn is_camera(value: &Value) -> bool {
    ["focal", "focal_x"].iter().any(|key| value.get(key).is_some_and(Value::is_number))
        || word(value, "projection_type").is_some()
}

/// The map of cameras by name, and its path.
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

/// Whether the document is OpenSfM's camera database, by maker and model, without image sizes.
fn is_camera_database(document: &Document) -> bool {
    let first = if let Value::Array(list) = &document.value { list.first() } else { Some(&document.value) };
    let makers = first.and_then(Value::as_object).into_iter().flatten();
    makers.into_iter().any(|(_, maker)| ["MODEL", "FOCAL", "ALL"].iter().any(|key| maker.get(key).is_some()))
}

fn matches(document: &Document) -> bool {
    let has_cameras = cameras(document).is_some_and(|(map, _)| map.values().any(is_camera));
    has_cameras
        || is_camera(&document.value) && find(&document.value, "projection_type").is_some()
        || is_camera_database(document)
}

/// The cameras of the database by maker and model, in a map like that of a reconstruction.
fn effective_document(document: Document) -> Document {
    if !is_camera_database(&document) {
        return document;
    }
    let first = if let Value::Array(list) = &document.value { list.first() } else { Some(&document.value) };
    let mut found = serde_json::Map::new();
    for (maker, kinds) in first.and_then(Value::as_object).into_iter().flatten() {
        for (kind, cameras) in kinds.as_object().into_iter().flatten() {
            match kind.as_str() {
                "ALL" => {
                    found.insert(maker.clone(), cameras.clone());
                }
                _ => {
                    let unit = if kind == "FOCAL" { " mm" } else { "" };
                    for (model, camera) in cameras.as_object().into_iter().flatten() {
                        found.insert(format!("{maker} {model}{unit}"), camera.clone());
                    }
                }
            }
        }
    }
    Document { root: document.root, value: serde_json::json!({ "cameras": found }) }
}

/// The cameras, to be completed.
fn cameras_mut(document: &mut Document) -> Vec<&mut Value> {
    if is_camera(&document.value) {
        return vec![&mut document.value];
    }
    let value = match &mut document.value {
        Value::Array(list) => list.first_mut(),
        value => Some(value),
    };
    let Some(Value::Object(map)) = value else { return Vec::new() };
    let map = match map.get("cameras") {
        Some(Value::Object(_)) => match map.get_mut("cameras") {
            Some(Value::Object(cameras)) => cameras,
            _ => return Vec::new(),
        },
        _ => map,
    };
    map.values_mut().filter(|value| is_camera(value)).collect()
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    if is_camera(&document.value) {
        return single(document);
    }
    let (map, prefix) = cameras(document).ok_or_else(|| KeyProblem::new("cameras", "the file has none"))?;
    let cameras = map.iter().filter(|(_, value)| is_camera(value));
    Ok(cameras
        .map(|(name, value)| CameraEntry::new(name.clone(), value, format!("{prefix}{name}")))
        .collect())
}

/// The rest of the file is poses and points.
fn own_leaves<'a>(selected: &Selected<'a>) -> Vec<TableLeaves<'a>> {
    vec![TableLeaves { keys: KEYS, leaves: leaves(selected.value()) }]
}

/// Adds a size to the cameras without one.
fn complete(document: &mut Document, size_px: [u32; 2]) {
    for camera in cameras_mut(document).into_iter().filter(|camera| find(camera, "width").is_none()) {
        add_size(camera, ["width", "height"], size_px);
    }
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    for key in ["width", "height"] {
        if find(value, key).is_none() {
            return Err(KeyProblem::new(
                key,
                "is missing: all lengths are fractions of the longer side; add width and height, or give --size",
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
        "spherical" | "equirectangular" => {
            let others = [&LENS_KEYS[..], &["focal", "focal_x", "focal_y", "c_x", "c_y"]].concat();
            return lens_models::panorama(value, ("projection_type", kind), size_px, &others);
        }
        other => {
            let advice = "reconstruct with perspective, brown or fisheye_opencv";
            return Err(KeyProblem::new("projection_type", lens_models::unsupported_model(other, advice)));
        }
    };
    for key in LENS_KEYS {
        if !coefficients.contains(&key) && or_zero(key)? != 0.0 {
            return Err(KeyProblem::new(
                key,
                format!("is not zero, but `{kind}` has only {names}: delete it, or correct projection_type"),
            ));
        }
    }
    let focal = match one_of(value, &["focal_x", "focal"])? {
        Some(key) => {
            [number(value, key)?, optional_number(value, "focal_y")?.map_or_else(|| number(value, key), Ok)?]
        }
        None => return Err(KeyProblem::new("focal", "is missing")),
    };
    let order: &[&str] = if model == LensModel::KannalaBrandt {
        &["k1", "k2", "k3", "k4"]
    } else {
        &["k1", "k2", "p1", "p2", "k3"]
    };
    let list = order.iter().map(|key| or_zero(key)).collect::<Result<Vec<f64>, _>>()?;
    let centre = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    let point = [centre[0] + longer * or_zero("c_x")?, centre[1] + longer * or_zero("c_y")?];
    Ok(camera(size_px, focal.map(|f| f * longer), point, model, list))
}
