//! Calibrations in other texts. A line of numbers whose comment says their order, as camsim writes it beside TUM's
//! layout, is read as OpenCV's. INI files and Pix4D's `.cam` are not imported, but parsed, so that an error can say
//! what to write instead.

use serde_json::{Map, Value, json};

use crate::formats::opencv::read as opencv;
use crate::text::document::{Document, number, numbers, numbers_n};

/// First words of Pix4D's `.cam`.
const PIX4D: &str = "Pix4D camera calibration";

const OF_PICTURES: &str = "image_width and image_height of its pictures";

/// Lines with content.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', ';']))
}

fn section(line: &str) -> Option<&str> {
    line.strip_prefix('[')?.strip_suffix(']').filter(|name| !name.contains([',', '[', '{', ':']))
}

/// `key=value`.
fn assignment(line: &str) -> Option<(&str, &str)> {
    let (key, value) = line.split_once('=')?;
    let is_key = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
    key.chars().all(is_key).then_some((key.trim(), value.trim()))
}

/// Parses INI and Pix4D files to the root `ini-file` or `pix4d`, and lines of numbers; `None` of other texts.
pub(crate) fn parse(text: &str) -> Option<Document> {
    if let Some(value) = line_of_numbers(text) {
        return Some(Document { root: String::new(), value });
    }
    if text.trim_start().starts_with(PIX4D) {
        return Some(Document { root: "pix4d".to_owned(), value: pix4d(text) });
    }
    let first = lines(text).next()?;
    let is_ini = (section(first).is_some() || assignment(first).is_some())
        && lines(text).any(|line| assignment(line).is_some());
    is_ini.then(|| Document { root: "ini-file".to_owned(), value: ini(text) })
}

/// A line of numbers below the comment `fx fy cx cy` and the order of the coefficients.
fn line_of_numbers(text: &str) -> Option<Value> {
    let comment = text.lines().find(|line| line.starts_with('#') && line.contains("fx fy cx cy"))?;
    let mut content = lines(text);
    let (line, None) = (content.next()?, content.next()) else { return None };
    let numbers = line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?;
    let (&[fx, fy, cx, cy], rest) = numbers.split_first_chunk::<4>()?;
    let model = if comment.contains("equidistant") { "equidistant" } else { "plumb_bob" };
    let is_ordered = model == "equidistant" || comment.contains("k1 k2 p1 p2");
    let rest = if rest.is_empty() { &[0.0; 5] } else { rest };
    (is_ordered || numbers.len() == 4).then(|| {
        json!({"camera_matrix": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0], "distortion_coefficients": rest,
            "model_type": model})
    })
}

/// Keys by section; those before the first are at the root.
fn ini(text: &str) -> Value {
    let mut sections = vec![(String::new(), Map::new())];
    for line in lines(text) {
        if let Some(name) = section(line) {
            sections.push((name.to_owned(), Map::new()));
        } else if let (Some((key, value)), Some((_, map))) = (assignment(line), sections.last_mut()) {
            let value = value.trim_matches(['[', ']', '"']).replace(',', " ");
            map.insert(key.to_owned(), json!(value));
        }
    }
    let (_, mut root) = sections.remove(0);
    root.extend(sections.into_iter().map(|(name, map)| (name, Value::Object(map))));
    Value::Object(root)
}

/// `F 8.8`, with the width of the sensor in a comment: `sensor width of 13.2x8.8mm`.
fn pix4d(text: &str) -> Value {
    let mut map = Map::new();
    for (key, value) in lines(text).filter_map(|line| line.split_once(char::is_whitespace)) {
        map.insert(key.to_owned(), json!(value.trim()));
    }
    let width = text.split_once("sensor width of").and_then(|(_, rest)| rest.trim().split_once(['x', 'm']));
    if let Some((width, _)) = width {
        map.insert("sensor_mm".to_owned(), json!(width.trim()));
    }
    Value::Object(map)
}

/// What to write instead of a file with the numbers of a camera under names that no format has.
pub(crate) fn hint(document: &Document) -> Option<String> {
    if document.root == "pix4d" {
        return pix4d_hint(&document.value);
    }
    if let Some(hint) = kitti_hint(&document.value) {
        return Some(hint);
    }
    let parts = document.value.as_object()?;
    let all = std::iter::once(("the file", &document.value))
        .chain(parts.iter().map(|(key, value)| (key.as_str(), value)));
    let cameras: Vec<(&str, Value)> = all.filter_map(|(name, value)| Some((name, lower(value)?))).collect();
    let (first, camera) = cameras.first()?;
    let get = |key| number(camera, key).ok();
    let (fx, fy, cx, cy) = (get("fx")?, get("fy")?, get("cx")?, get("cy")?);
    let coefficients = opencv::coefficient_keys().find_map(|key| numbers(camera, key).ok());
    let coefficients =
        coefficients.or_else(|| Some(opencv::elsewhere(camera)?.1)).unwrap_or_else(|| vec![0.0; 5]);
    let names: Vec<&str> = cameras.iter().map(|(name, _)| *name).collect();
    let size = match opencv::image_size(camera) {
        Ok([width, height]) => format!("`image_width: {width}`, `image_height: {height}`"),
        Err(_) => OF_PICTURES.to_owned(),
    };
    Some(format!(
        "this is not a known camera file, but {} {} the numbers of a camera: for {first} {} (k1 k2 p1 p2 k3)",
        names.join(", "),
        if names.len() == 1 { "has" } else { "have" },
        yaml_to_write(&size, [fx, fy, cx, cy], &coefficients)
    ))
}

fn yaml_to_write(size: &str, [fx, fy, cx, cy]: [f64; 4], coefficients: &[f64]) -> String {
    format!(
        "write a YAML file of {size}, `camera_matrix: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]` and \
         `distortion_coefficients: {coefficients:?}`"
    )
}

/// KITTI's `calib.txt`.
fn kitti_hint(value: &Value) -> Option<String> {
    let [fx, _, cx, _, _, fy, cy, ..] = numbers_n::<12>(value, "P0").ok()?;
    let yaml = yaml_to_write(OF_PICTURES, [fx, fy, cx, cy], &[0.0; 5]);
    Some(format!("these are KITTI's matrices of rectified pictures: for P0 {yaml}"))
}

/// An object with keys in lower case, if it has those of a camera.
fn lower(value: &Value) -> Option<Value> {
    let map: Map<String, Value> =
        value.as_object()?.iter().map(|(key, value)| (key.to_ascii_lowercase(), value.clone())).collect();
    ["fx", "fy", "cx", "cy"].iter().all(|key| map.contains_key(*key)).then_some(Value::Object(map))
}

/// Pix4D's lengths are in millimetres on the sensor, from its corner; its T1 and T2 are OpenCV's p1 and p2.
fn pix4d_hint(value: &Value) -> Option<String> {
    let get = |key| number(value, key).ok();
    let or_zero = |key| get(key).unwrap_or(0.0);
    let lengths = [get("F")?, get("Px")?, get("Py")?];
    let (unit, [f, cx, cy]) = match get("sensor_mm") {
        Some(width) => (String::new(), lengths.map(|mm| format!("{:.6} W", mm / width))),
        None => (", S the width of the sensor in mm".to_owned(), lengths.map(|mm| format!("{mm} W / S"))),
    };
    let list = ["K1", "K2", "T1", "T2", "K3"].map(or_zero);
    Some(format!(
        "this is a camera of Pix4D, in millimetres: with W x H the size of the pictures{unit}, write a YAML file of \
         image_width: W, image_height: H, camera_matrix: [f, 0, cx, 0, f, cy, 0, 0, 1] of f = {f}, cx = {cx} - 0.5, \
         cy = {cy} - 0.5, and `distortion_coefficients: {list:?}`"
    ))
}
