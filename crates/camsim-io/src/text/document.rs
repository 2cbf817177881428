//! A parsed file as a tree of values, and functions that read values by path.

use serde_json::Value;

/// A parsed file; see [`Document::parse`] in `syntax`.
#[derive(Debug)]
pub(crate) struct Document {
    /// Name of an XML file's root element; that of the format of texts with a parser of their own; else empty.
    pub(crate) root: String,
    /// Content; XML attributes and elements are keys.
    pub(crate) value: Value,
}

/// A problem with a key.
#[derive(Debug)]
pub(crate) struct KeyProblem {
    /// Path of the key.
    pub(crate) key: String,
    /// The problem and the remedy.
    pub(crate) message: String,
}

impl KeyProblem {
    pub(crate) fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { key: key.into(), message: message.into() }
    }
}

/// A syntax error.
#[derive(Debug)]
pub(crate) struct SyntaxProblem {
    /// Line from 1, where known.
    pub(crate) line: Option<usize>,
    pub(crate) message: String,
}

/// The value at a path `a.b`; null is absent. Of repeated XML elements the last is taken. A key may be named
/// `a.b` itself, as in ORB-SLAM's settings.
pub(crate) fn find<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    if let Some(direct) = value.get(path) {
        return (!direct.is_null()).then_some(direct);
    }
    let nested = path.split('.').try_fold(value, |value, key| {
        let value = if let Value::Array(list) = value { list.last()? } else { value };
        value.get(key)
    })?;
    (!nested.is_null()).then_some(nested)
}

/// The items of a list; none if there is no list.
pub(crate) fn list<'a>(value: &'a Value, path: &str) -> &'a [Value] {
    find(value, path).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A finite number.
pub(crate) fn number(value: &Value, path: &str) -> Result<f64, KeyProblem> {
    optional_number(value, path)?.ok_or_else(|| KeyProblem::new(path, "is missing"))
}

/// A finite number; `None` if absent.
pub(crate) fn optional_number(value: &Value, path: &str) -> Result<Option<f64>, KeyProblem> {
    match find(value, path) {
        None => Ok(None),
        Some(item) => as_number(item)
            .map(Some)
            .ok_or_else(|| KeyProblem::new(path, format!("is {item}, not a finite number"))),
    }
}

/// A finite number, also as text such as `"308."`.
pub(crate) fn as_number(value: &Value) -> Option<f64> {
    let number = match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => finite(text),
        _ => None,
    };
    number.filter(|number| number.is_finite())
}

fn finite(word: &str) -> Option<f64> {
    word.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// The first of several synonymous keys that the file has; different values under two of them are refused.
pub(crate) fn one_of<'n>(value: &Value, names: &[&'n str]) -> Result<Option<&'n str>, KeyProblem> {
    let mut used = names.iter().filter(|name| find(value, name).is_some());
    let Some(first) = used.next() else { return Ok(None) };
    match used.find(|other| find(value, other) != find(value, first)) {
        None => Ok(Some(first)),
        Some(other) => Err(KeyProblem::new(
            *other,
            format!("differs from {first}, which has the same meaning: delete one of the two"),
        )),
    }
}

/// A flag as a boolean, a number or a word; `None` if absent.
pub(crate) fn flag(value: &Value, path: &str) -> Result<Option<bool>, KeyProblem> {
    let Some(item) = find(value, path) else { return Ok(None) };
    as_flag(item)
        .map(Some)
        .ok_or_else(|| KeyProblem::new(path, format!("is {item}, neither yes (1, true) nor no (0, false)")))
}

pub(crate) fn as_flag(value: &Value) -> Option<bool> {
    let word = value.as_str().map(|word| word.trim().to_ascii_lowercase());
    match (value.as_bool(), as_number(value), word.as_deref()) {
        (Some(yes), ..) => Some(yes),
        (_, Some(0.0), _) | (.., Some("false" | "no" | "off" | "n")) => Some(false),
        (_, Some(1.0), _) | (.., Some("true" | "yes" | "on" | "y")) => Some(true),
        _ => None,
    }
}

/// Finite numbers of a list, a list of rows, `{rows, cols, data}`, or text with blanks (XML).
pub(crate) fn numbers(value: &Value, path: &str) -> Result<Vec<f64>, KeyProblem> {
    let item = find(value, path).ok_or_else(|| KeyProblem::new(path, "is missing"))?;
    let error = || KeyProblem::new(path, "is not a list of finite numbers");
    let list = match item {
        Value::Object(matrix) => matrix.get("data").ok_or_else(|| KeyProblem::new(path, "has no `data`"))?,
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
        Value::String(text) => text.split_whitespace().map(finite).collect(),
        single => as_number(single).map(|number| vec![number]),
    }
    .ok_or_else(error)?;
    let count = |key: &str| item.get(key).and_then(as_number);
    match (count("rows"), count("cols")) {
        (Some(rows), Some(cols)) if rows * cols != list.len() as f64 => Err(KeyProblem::new(
            path,
            format!("has {} numbers where rows x cols = {rows} x {cols}", list.len()),
        )),
        _ => Ok(list),
    }
}

/// Exactly N finite numbers.
pub(crate) fn numbers_n<const N: usize>(value: &Value, path: &str) -> Result<[f64; N], KeyProblem> {
    let list = numbers(value, path)?;
    let count = list.len();
    list.try_into().map_err(|_| KeyProblem::new(path, format!("has {count} numbers instead of {N}")))
}

/// `[fx, fy]` and `[cx, cy]` of a 3x3 camera matrix.
pub(crate) fn camera_matrix(value: &Value, path: &str) -> Result<([f64; 2], [f64; 2]), KeyProblem> {
    let [fx, skew, cx, zero, fy, cy, last @ ..] = numbers_n::<9>(value, path)?;
    // Column-major order, as in MATLAB.
    if cx == 0.0 && cy == 0.0 && last[0] != 0.0 && last[1] != 0.0 {
        return Err(KeyProblem::new(
            path,
            "is transposed (its last row holds the principal point): write it row by row, fx s cx, 0 fy cy, \
             0 0 1",
        ));
    }
    if skew != 0.0 || zero != 0.0 {
        let skew = if skew == 0.0 { zero } else { skew };
        return Err(KeyProblem::new(
            path,
            format!("has a skew of {skew}, which is not supported: recalibrate without skew"),
        ));
    }
    if last != [0.0, 0.0, 1.0] {
        return Err(KeyProblem::new(
            path,
            format!("has the last row {last:?} instead of [0, 0, 1], so it is not a camera matrix"),
        ));
    }
    Ok(([fx, fy], [cx, cy]))
}

/// Width and height, pixels, from two numbers.
pub(crate) fn size(key: &str, [width, height]: [f64; 2]) -> Result<[u32; 2], KeyProblem> {
    let integer = |x: f64| (x.fract() == 0.0 && (1.0..=65_535.0).contains(&x)).then_some(x as u32);
    match (integer(width), integer(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err(KeyProblem::new(
            key,
            format!("is {width} x {height}: an image size is two positive integers"),
        )),
    }
}

/// Width and height, pixels, of two keys.
pub(crate) fn size_of(value: &Value, [width, height]: [&str; 2]) -> Result<[u32; 2], KeyProblem> {
    size(width, [number(value, width)?, number(value, height)?])
}

/// A trimmed text.
pub(crate) fn word<'a>(value: &'a Value, path: &str) -> Option<&'a str> {
    find(value, path).and_then(Value::as_str).map(str::trim)
}

/// The first `max` coefficients; nonzero ones after them are refused. `excess` describes those.
pub(crate) fn at_most_coefficients(
    key: &str,
    mut coefficients: Vec<f64>,
    max: usize,
    excess: &str,
) -> Result<Vec<f64>, KeyProblem> {
    if coefficients.iter().skip(max).any(|k| *k != 0.0) {
        return Err(KeyProblem::new(
            key,
            format!(
                "has {} numbers: {excess}, which are not supported; recalibrate without them",
                coefficients.len()
            ),
        ));
    }
    coefficients.truncate(max);
    Ok(coefficients)
}
