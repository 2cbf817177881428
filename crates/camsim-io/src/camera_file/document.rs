//! YAML, JSON and XML as one tree of values.

use serde_json::{Map, Value};

/// A parsed file.
#[derive(Debug)]
pub(crate) struct Document {
    /// Name of the root element of an XML file; empty otherwise.
    pub(crate) root: String,
    /// Its content. XML attributes are keys like elements.
    pub(crate) value: Value,
}

/// What is wrong with a key.
#[derive(Debug)]
pub(crate) struct Problem {
    /// The key, with its path.
    pub(crate) key: String,
    /// What is wrong and what to do.
    pub(crate) message: String,
}

impl Problem {
    pub(crate) fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { key: key.into(), message: message.into() }
    }
}

/// What is wrong with a text.
#[derive(Debug)]
pub(crate) struct SyntaxProblem {
    pub(crate) line: Option<usize>,
    pub(crate) message: String,
}

impl Document {
    /// Parses by the first character: `<` is XML, `{` JSON, anything else YAML.
    pub(crate) fn parse(text: &str) -> Result<Self, SyntaxProblem> {
        match text.trim_start().chars().next() {
            Some('<') => Self::parse_xml(text),
            Some('{') => serde_json::from_str(text)
                .map(|value| Self { root: String::new(), value })
                .map_err(|error| SyntaxProblem { line: Some(error.line()), message: format!("JSON: {error}") }),
            Some(_) => Self::parse_yaml(text),
            None => Err(SyntaxProblem { line: None, message: "the file is empty".to_owned() }),
        }
    }

    /// OpenCV's first line `%YAML:1.0` is no YAML directive (those have a space), and its matrix tag is no type that matters here.
    fn parse_yaml(text: &str) -> Result<Self, SyntaxProblem> {
        let plain: Vec<&str> = text.lines().map(|line| if line.starts_with("%YAML") { "" } else { line }).collect();
        let plain = plain.join("\n").replace("!!opencv-matrix", "");
        serde_saphyr::from_str(&plain).map(|value| Self { root: String::new(), value }).map_err(|error| {
            let line = error.location().map(|location| location.line() as usize);
            // Its own text draws the place over several lines; the first says what is wrong.
            let text = error.without_snippet().to_string();
            SyntaxProblem { line, message: format!("YAML: {}", text.lines().next().unwrap_or_default()) }
        })
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

/// Deeper elements are ignored: no calibration file nests that far, and a hostile one must not exhaust the stack.
const MAX_DEPTH: usize = 64;

/// An element without attributes and children is its text, as a number where it is one; else a map, repeated names being a list.
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

/// The value at a path of keys `a.b`; null counts as absent. A repeated XML element counts by its last appearance.
pub(crate) fn find<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    let found = path.split('.').try_fold(value, |value, key| {
        let value = if let Value::Array(list) = value { list.last()? } else { value };
        value.get(key)
    })?;
    (!found.is_null()).then_some(found)
}

/// A finite number.
pub(crate) fn number(value: &Value, path: &str) -> Result<f64, Problem> {
    optional_number(value, path)?.ok_or_else(|| Problem::new(path, "is missing"))
}

/// A finite number, or nothing.
pub(crate) fn optional_number(value: &Value, path: &str) -> Result<Option<f64>, Problem> {
    match find(value, path) {
        None => Ok(None),
        Some(found) => as_number(found).map(Some).ok_or_else(|| Problem::new(path, format!("is {found}, not a finite number"))),
    }
}

/// Also `"308."` and the like, which some writers leave as text.
fn as_number(value: &Value) -> Option<f64> {
    let number = match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => text.trim().parse().ok(),
        _ => None,
    };
    number.filter(|number| number.is_finite())
}

/// A list of finite numbers: a list, a matrix as list of rows, `{rows, cols, data}`, or (XML) text with blanks between.
pub(crate) fn numbers(value: &Value, path: &str) -> Result<Vec<f64>, Problem> {
    let found = find(value, path).ok_or_else(|| Problem::new(path, "is missing"))?;
    let wrong = || Problem::new(path, "is not a list of finite numbers");
    let list = match found {
        Value::Object(matrix) => matrix.get("data").ok_or_else(|| Problem::new(path, "has no `data`"))?,
        other => other,
    };
    let list: Vec<f64> = match list {
        Value::Array(items) => items
            .iter()
            .flat_map(|item| match item {
                Value::Array(row) => row.iter().map(as_number).collect::<Vec<_>>(),
                other => vec![as_number(other)],
            })
            .collect::<Option<_>>(),
        Value::String(text) => text.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect(),
        single => as_number(single).map(|number| vec![number]),
    }
    .ok_or_else(wrong)?;
    let count = |key: &str| found.get(key).and_then(as_number);
    match (count("rows"), count("cols")) {
        (Some(rows), Some(cols)) if rows * cols != list.len() as f64 => {
            Err(Problem::new(path, format!("has {} numbers where rows x cols = {rows} x {cols}", list.len())))
        }
        _ => Ok(list),
    }
}

/// Exactly N finite numbers.
pub(crate) fn numbers_n<const N: usize>(value: &Value, path: &str) -> Result<[f64; N], Problem> {
    let list = numbers(value, path)?;
    let count = list.len();
    list.try_into().map_err(|_| Problem::new(path, format!("has {count} numbers instead of {N}")))
}

/// fx, fy and cx, cy of a 3x3 camera matrix.
pub(crate) fn camera_matrix(value: &Value, path: &str) -> Result<([f64; 2], [f64; 2]), Problem> {
    let [fx, skew, cx, zero, fy, cy, ..] = numbers_n::<9>(value, path)?;
    if skew != 0.0 || zero != 0.0 {
        return Err(Problem::new(path, format!("has a skew of {skew}, which a camera here cannot have: recalibrate without skew")));
    }
    Ok(([fx, fy], [cx, cy]))
}

/// Width and height out of two numbers.
pub(crate) fn size(key: &str, [width, height]: [f64; 2]) -> Result<[u32; 2], Problem> {
    let whole = |x: f64| (x.fract() == 0.0 && (1.0..=65_535.0).contains(&x)).then_some(x as u32);
    match (whole(width), whole(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err(Problem::new(key, format!("is {width} x {height}: an image size is two whole numbers of pixels"))),
    }
}

/// A word.
pub(crate) fn word<'a>(value: &'a Value, path: &str) -> Option<&'a str> {
    find(value, path).and_then(Value::as_str).map(str::trim)
}

/// Refuses coefficients beyond what the Brown-Conrady model has, unless they are zero.
pub(crate) fn at_most(key: &str, mut coefficients: Vec<f64>, max: usize, what: &str) -> Result<Vec<f64>, Problem> {
    if coefficients.iter().skip(max).any(|k| *k != 0.0) {
        return Err(Problem::new(
            key,
            format!("has {} numbers: {what}, which a lens here has not; recalibrate without", coefficients.len()),
        ));
    }
    coefficients.truncate(max);
    Ok(coefficients)
}
