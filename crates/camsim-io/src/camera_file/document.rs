//! Text as one tree of values, and what is read out of it by path.

use serde_json::Value;

/// A parsed file; see [`Document::parse`] in `syntax`.
#[derive(Debug)]
pub(crate) struct Document {
    /// Name of the root element of an XML file; `ini` and `colmap` for those; empty otherwise.
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

/// The value at a path of keys `a.b`; null counts as absent. A repeated XML element counts by its last
/// appearance. A key may itself be called `a.b`, as in ORB-SLAM's settings.
pub(crate) fn find<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    if let Some(found) = value.get(path) {
        return (!found.is_null()).then_some(found);
    }
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
        Some(found) => as_number(found)
            .map(Some)
            .ok_or_else(|| Problem::new(path, format!("is {found}, not a finite number"))),
    }
}

/// Also `"308."` and the like, which some writers leave as text.
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

/// The one of several names of a thing that the file uses; two of them that say different things are refused.
pub(crate) fn one_of<'n>(value: &Value, names: &[&'n str]) -> Result<Option<&'n str>, Problem> {
    let mut used = names.iter().filter(|name| find(value, name).is_some());
    let Some(first) = used.next() else { return Ok(None) };
    match used.find(|other| find(value, other) != find(value, first)) {
        None => Ok(Some(first)),
        Some(other) => Err(Problem::new(
            *other,
            format!("says another thing than {first}, which means the same: delete one of the two"),
        )),
    }
}

/// Yes or no, as a truth value, a number or a word.
pub(crate) fn flag(value: &Value, path: &str) -> Result<Option<bool>, Problem> {
    let Some(found) = find(value, path) else { return Ok(None) };
    as_flag(found)
        .map(Some)
        .ok_or_else(|| Problem::new(path, format!("is {found}, neither yes (1, true) nor no (0, false)")))
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

/// A list of finite numbers: a list, a matrix as list of rows, `{rows, cols, data}`, or (XML) text with
/// blanks between.
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
        Value::String(text) => text.split_whitespace().map(finite).collect(),
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
    let [fx, skew, cx, zero, fy, cy, last @ ..] = numbers_n::<9>(value, path)?;
    // Column by column, as MATLAB writes it.
    if cx == 0.0 && cy == 0.0 && last[0] != 0.0 && last[1] != 0.0 {
        return Err(Problem::new(
            path,
            "is transposed (its last row holds the principal point): write it row by row, fx s cx, 0 fy cy, 0 0 1",
        ));
    }
    if skew != 0.0 || zero != 0.0 {
        let skew = if skew == 0.0 { zero } else { skew };
        return Err(Problem::new(
            path,
            format!("has a skew of {skew}, which a camera here cannot have: recalibrate without skew"),
        ));
    }
    if last != [0.0, 0.0, 1.0] {
        return Err(Problem::new(
            path,
            format!("has the last row {last:?} instead of [0, 0, 1]: this is no camera matrix"),
        ));
    }
    Ok(([fx, fy], [cx, cy]))
}

/// Width and height out of two numbers.
pub(crate) fn size(key: &str, [width, height]: [f64; 2]) -> Result<[u32; 2], Problem> {
    let whole = |x: f64| (x.fract() == 0.0 && (1.0..=65_535.0).contains(&x)).then_some(x as u32);
    match (whole(width), whole(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err(Problem::new(
            key,
            format!("is {width} x {height}: an image size is two whole numbers of pixels"),
        )),
    }
}

/// A word.
pub(crate) fn word<'a>(value: &'a Value, path: &str) -> Option<&'a str> {
    find(value, path).and_then(Value::as_str).map(str::trim)
}

/// Refuses coefficients beyond what the Brown-Conrady model has, unless they are zero.
pub(crate) fn at_most(
    key: &str,
    mut coefficients: Vec<f64>,
    max: usize,
    what: &str,
) -> Result<Vec<f64>, Problem> {
    if coefficients.iter().skip(max).any(|k| *k != 0.0) {
        return Err(Problem::new(
            key,
            format!(
                "has {} numbers: {what}, which a lens here has not; recalibrate without",
                coefficients.len()
            ),
        ));
    }
    coefficients.truncate(max);
    Ok(coefficients)
}
