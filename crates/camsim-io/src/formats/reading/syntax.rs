//! Parses YAML (also OpenCV's dialect), JSON and XML into a tree of values. ROS `.ini` and COLMAP's
//! `cameras.txt` have their own modules.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::other_text;
use crate::formats::colmap::read as colmap;
use crate::formats::ros::ini as ros_ini;
use crate::text::document::{Document, SyntaxProblem};

impl Document {
    /// Detects the syntax by the first characters: `<` is XML, `{` JSON, `[image]` ROS's `.ini`, a camera
    /// line COLMAP; files of other programs in `other_text`; else it is YAML.
    pub(crate) fn parse(text: &str) -> Result<Self, SyntaxProblem> {
        if ros_ini::matches_text(text) {
            return ros_ini::parse(text);
        }
        if colmap::matches_text(text) {
            return colmap::parse(text);
        }
        if let Some(document) = other_text::parse(text) {
            return Ok(document);
        }
        match text.trim_start().chars().next() {
            Some('<') => Self::parse_xml(text),
            Some('{') => Self::parse_json(text),
            // OpenSfM's reconstruction is JSON; YAML can begin like this too.
            Some('[') => Self::parse_json(text).or_else(|_| Self::parse_yaml(text)),
            Some(_) => Self::parse_yaml(text),
            None => Err(SyntaxProblem { line: None, message: "the file is empty".to_owned() }),
        }
    }

    fn parse_json(text: &str) -> Result<Self, SyntaxProblem> {
        serde_json::from_str(text)
            .map(|UniqueKeys(value)| Self { root: String::new(), value })
            .map_err(|error| SyntaxProblem { line: Some(error.line()), message: format!("JSON: {error}") })
    }

    /// Several documents, as `rostopic echo` prints them, must be equal except for their headers.
    fn parse_yaml(text: &str) -> Result<Self, SyntaxProblem> {
        let mut parsed: Option<Value> = None;
        for (first_line, part) in documents(text) {
            let value: Value = serde_saphyr::from_str(&part).map_err(|error| {
                let line = error.location().map(|location| first_line + location.line() as usize);
                // The first line of the error is the message; the others show the location.
                let text = error.without_snippet().to_string();
                let first = text.lines().next().unwrap_or_default();
                // The message counts lines within the document; `line` counts from the start of the file.
                SyntaxProblem {
                    line,
                    message: format!("YAML: {}", first.split(" at line ").next().unwrap_or(first)),
                }
            })?;
            match &parsed {
                None => parsed = Some(value),
                Some(first) if without_header(first) == without_header(&value) => {}
                Some(_) => {
                    let message =
                        "the file has several different YAML documents (separated by `---`): keep one";
                    return Err(SyntaxProblem { line: Some(first_line), message: message.to_owned() });
                }
            }
        }
        Ok(Self { root: String::new(), value: parsed.unwrap_or(Value::Null) })
    }

    fn parse_xml(text: &str) -> Result<Self, SyntaxProblem> {
        let options = roxmltree::ParsingOptions { allow_dtd: false, ..roxmltree::ParsingOptions::default() };
        let tree = roxmltree::Document::parse_with_options(text.trim_start(), options).map_err(|error| {
            let skipped = text[..text.len() - text.trim_start().len()].lines().count();
            let message = match text.contains("<lensdatabase") {
                true => LENS_DATABASE.to_owned(),
                false => format!("XML: {error}"),
            };
            SyntaxProblem { line: Some(error.pos().row as usize + skipped), message }
        })?;
        let root = tree.root_element();
        Ok(Self { root: root.tag_name().name().to_owned(), value: xml_value(root, 0) })
    }
}

/// Documents of a YAML text as standard YAML, with the number of lines before each. OpenCV's dialect is
/// converted: the first line `%YAML:1.0` and the matrix tag are removed, and a blank is inserted after
/// colons.
fn documents(text: &str) -> Vec<(usize, String)> {
    let is_opencv =
        text.lines().next().is_some_and(|line| line.trim_start_matches('\u{feff}').starts_with("%YAML"));
    let mut parts = vec![(0, String::new())];
    for (index, line) in text.lines().enumerate() {
        if line.trim_end() == "---" {
            parts.push((index + 1, String::new()));
            continue;
        }
        let plain = if line.starts_with("%YAML") { "" } else { line };
        let plain = plain.replace("!!opencv-matrix", "");
        if let Some((_, part)) = parts.last_mut() {
            part.push_str(&if is_opencv { blank_after_colon(plain) } else { plain });
            part.push('\n');
        }
    }
    parts.retain(|(_, part)| {
        part.lines().any(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
    });
    parts
}

/// `Viewer.PointSize:2` as `Viewer.PointSize: 2`.
fn blank_after_colon(line: String) -> String {
    match line.split_once(':') {
        Some((key, value))
            if value.starts_with(|c: char| c.is_ascii_alphanumeric() || "-.\"[".contains(c))
                && key.trim().chars().all(|c| c.is_ascii_alphanumeric() || c == '.' || c == '_')
                && key.trim().starts_with(|c: char| c.is_ascii_alphabetic()) =>
        {
            format!("{key}: {value}")
        }
        _ => line,
    }
}

fn without_header(value: &Value) -> Value {
    let mut value = value.clone();
    if let Value::Object(map) = &mut value {
        map.remove("header");
    }
    value
}

/// A JSON value without duplicate keys: serde_json would silently keep the last.
struct UniqueKeys(Value);

impl<'de> Deserialize<'de> for UniqueKeys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UniqueKeysVisitor).map(Self)
    }
}

struct UniqueKeysVisitor;

impl<'de> Visitor<'de> for UniqueKeysVisitor {
    type Value = Value;

    fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("a JSON value")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(UniqueKeys(item)) = items.next_element()? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some((key, UniqueKeys(value))) = entries.next_entry::<String, UniqueKeys>()? {
            if map.insert(key.clone(), value).is_some() {
                return Err(A::Error::custom(format!("duplicate key `{key}`: delete one")));
            }
        }
        Ok(Value::Object(map))
    }
}

/// What to do with lensfun's files.
pub(crate) const LENS_DATABASE: &str =
    "this is lensfun's database of lenses: name one of them, as in --lens NAME --focal 35 --size 6000x4000";

/// Depth below which XML elements are ignored, so that a malicious file cannot exhaust the stack.
const MAX_DEPTH: usize = 64;

/// Value of an element: without attributes and children its text or number, else a map in which repeated
/// names become a list.
fn xml_value(element: roxmltree::Node<'_, '_>, depth: usize) -> Value {
    let children = || element.children().filter(roxmltree::Node::is_element);
    if element.attributes().len() == 0 && children().next().is_none() {
        return scalar(element.text().unwrap_or_default());
    }
    let mut map = Map::new();
    for attribute in element.attributes() {
        map.insert(attribute.name().to_owned(), scalar(attribute.value()));
    }
    for child in children().filter(|_| depth < MAX_DEPTH) {
        let value = xml_value(child, depth + 1);
        match map.get_mut(child.tag_name().name()) {
            Some(Value::Array(list)) => list.push(value),
            Some(first) => *first = Value::Array(vec![first.take(), value]),
            None => {
                map.insert(child.tag_name().name().to_owned(), value);
            }
        }
    }
    Value::Object(map)
}

/// A number if the text is one, else the text.
fn scalar(text: &str) -> Value {
    let text = text.trim();
    match text.parse::<f64>().ok().and_then(serde_json::Number::from_f64) {
        Some(number) => Value::Number(number),
        None => Value::String(text.to_owned()),
    }
}
