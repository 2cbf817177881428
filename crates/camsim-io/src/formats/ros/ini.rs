//! ROS `.ini` (`camera_calibration_parsers`): a section for the image, then one for each camera; names are
//! followed by lines of numbers.
//!
//! The parsed document has the keys of ROS's YAML file, so that `ros` imports both.

use serde_json::{Map, Value, json};

use crate::text::document::{Document, SyntaxProblem};

/// Names in the file and in the YAML file. Others are equal.
const NAMES: [(&str, &str); 6] = [
    ("width", "image_width"),
    ("height", "image_height"),
    ("camera matrix", "camera_matrix"),
    ("distortion", "distortion_coefficients"),
    ("rectification", "rectification_matrix"),
    ("projection", "projection_matrix"),
];

/// Lines with content, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', ';']))
}

/// Name of a section header.
fn section(line: &str) -> Option<&str> {
    line.strip_prefix('[')?
        .strip_suffix(']')
        .filter(|name| !name.contains([',', '[', '{', ':']))
        .map(str::trim)
}

pub(crate) fn matches_text(text: &str) -> bool {
    lines(text).next().is_some_and(|(_, line)| section(line).is_some())
        && lines(text).any(|(_, line)| line == "camera matrix")
}

/// Parses to `{cameras: [{camera_name, image_width, camera_matrix, ...}]}`; sections without camera keep
/// their names.
pub(crate) fn parse(text: &str) -> Result<Document, SyntaxProblem> {
    let mut sections: Vec<(String, Map<String, Value>)> = Vec::new();
    let mut key: Option<(usize, String)> = None;
    let mut numbers: Vec<f64> = Vec::new();
    let error = |line: usize, text: &str| SyntaxProblem {
        line: Some(line),
        message: format!(
            "`{text}`: numbers must follow a name (`width`, `camera matrix`, `distortion`, ...) in a section \
             `[name]`"
        ),
    };
    for (number, line) in lines(text).chain([(0, "[]")]) {
        let parsed: Option<Vec<f64>> =
            line.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        if let Some(parsed) = parsed {
            key.as_ref().ok_or_else(|| error(number, line))?;
            numbers.extend(parsed);
            continue;
        }
        if let Some((name_line, name)) = key.take() {
            let (_, map) = sections.last_mut().ok_or_else(|| error(name_line, &name))?;
            let value = if let [single] = numbers[..] { json!(single) } else { json!(numbers) };
            numbers.clear();
            let known = NAMES
                .iter()
                .find(|(ini_name, _)| *ini_name == name)
                .map_or(name.as_str(), |(_, yaml_name)| yaml_name);
            if map.insert(known.to_owned(), value).is_some() {
                return Err(SyntaxProblem {
                    line: Some(name_line),
                    message: format!("duplicate `{name}` in its section: delete one"),
                });
            }
        }
        match section(line) {
            Some(name) => sections.push((name.to_owned(), Map::new())),
            None => key = Some((number, line.to_owned())),
        }
    }
    Ok(Document { root: "ini".to_owned(), value: cameras(sections) })
}

/// The document of parsed sections.
fn cameras(sections: Vec<(String, Map<String, Value>)>) -> Value {
    let (mut image, mut cameras, mut rest) = (Map::new(), Vec::new(), Map::new());
    for (name, map) in sections {
        if map.contains_key("camera_matrix") {
            let mut camera = image.clone();
            camera.insert("camera_name".to_owned(), json!(name));
            camera.extend(map);
            cameras.push(Value::Object(camera));
        } else if name == "image" {
            image = map;
        } else if !map.is_empty() {
            rest.insert(name, Value::Object(map));
        }
    }
    rest.insert("cameras".to_owned(), Value::Array(cameras));
    Value::Object(rest)
}
