//! Text into a tree of values: YAML (OpenCV's dialect too), JSON, XML; ROS `.ini` and COLMAP's `cameras.txt`
//! in files of their own.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::document::{Document, SyntaxProblem};
use super::{colmap, ros_ini};

impl Document {
    /// Parses by the first characters: `<` is XML, `{` JSON, `[image]` ROS's `.ini`, a COLMAP camera line
    /// COLMAP; anything else YAML.
    pub(crate) fn parse(text: &str) -> Result<Self, SyntaxProblem> {
        if ros_ini::looks_so(text) {
            return ros_ini::parse(text);
        }
        if colmap::looks_so(text) {
            return colmap::parse(text);
        }
        match text.trim_start().chars().next() {
            Some('<') => Self::parse_xml(text),
            Some('{') => Self::parse_json(text),
            // OpenSfM's reconstruction; YAML also begins so.
            Some('[') => Self::parse_json(text).or_else(|_| Self::parse_yaml(text)),
            Some(_) => Self::parse_yaml(text),
            None => Err(SyntaxProblem { line: None, message: "the file is empty".to_owned() }),
        }
    }

    fn parse_json(text: &str) -> Result<Self, SyntaxProblem> {
        serde_json::from_str(text)
            .map(|Unique(value)| Self { root: String::new(), value })
            .map_err(|error| SyntaxProblem { line: Some(error.line()), message: format!("JSON: {error}") })
    }

    /// Several documents, as `rostopic echo` prints them, are one if they say the same beside their header.
    fn parse_yaml(text: &str) -> Result<Self, SyntaxProblem> {
        let mut parsed: Option<Value> = None;
        for (first_line, part) in documents(text) {
            let value: Value = serde_saphyr::from_str(&part).map_err(|error| {
                let line = error.location().map(|location| first_line + location.line() as usize);
                // Its own text draws the place over several lines; the first says what is wrong.
                let text = error.without_snippet().to_string();
                let first = text.lines().next().unwrap_or_default();
                // It counts lines from the document's beginning; `line` does from the file's.
                SyntaxProblem {
                    line,
                    message: format!("YAML: {}", first.split(" at line ").next().unwrap_or(first)),
                }
            })?;
            match &parsed {
                None => parsed = Some(value),
                Some(first) if without_header(first) == without_header(&value) => {}
                Some(_) => {
                    let message = "the file holds several YAML documents (between lines `---`) that differ: keep the one that is meant";
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
            SyntaxProblem { line: Some(error.pos().row as usize + skipped), message: format!("XML: {error}") }
        })?;
        let root = tree.root_element();
        Ok(Self { root: root.tag_name().name().to_owned(), value: xml_value(root, 0) })
    }
}

/// The documents of a YAML text with the lines before each, as plain YAML: OpenCV's first line `%YAML:1.0` is
/// no YAML directive (those have a space), its matrix tag is no type that matters here, and its own reader
/// wants no blank after a colon.
fn documents(text: &str) -> Vec<(usize, String)> {
    let opencv =
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
            part.push_str(&if opencv { blank_after_colon(plain) } else { plain });
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

/// A JSON value in which no key comes twice: of two the last one would count, and nobody would know.
struct Unique(Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UniqueVisitor).map(Self)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
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
        while let Some(Unique(item)) = items.next_element()? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some((key, Unique(value))) = entries.next_entry::<String, Unique>()? {
            if map.insert(key.clone(), value).is_some() {
                return Err(A::Error::custom(format!("`{key}` is there twice: delete one")));
            }
        }
        Ok(Value::Object(map))
    }
}

/// Deeper elements are ignored: no calibration file nests that far, and a hostile one must not exhaust the
/// stack.
const MAX_DEPTH: usize = 64;

/// An element without attributes and children is its text, as a number where it is one; else a map, repeated
/// names being a list.
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

fn scalar(text: &str) -> Value {
    let text = text.trim();
    match text.parse::<f64>().ok().and_then(serde_json::Number::from_f64) {
        Some(number) => Value::Number(number),
        None => Value::String(text.to_owned()),
    }
}
