//! Tables of keys: each importer lists the keys of its format with their treatment.
//!
//! A key that changes the picture is applied, refused, or reported in a note. A number under an unknown key
//! is reported too.

use std::borrow::Cow;

use serde_json::Value;

use crate::text::document::{KeyProblem, as_number};

/// Keys of a format that are treated alike.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyRow {
    /// How the importer treats them.
    pub(crate) treatment: Treatment,
    /// Paths without list indices, separated by blanks: `*` matches any part of one name, a final `**` everything
    /// below.
    pub(crate) paths: &'static str,
    /// Meaning of the keys, and the remedy if they are reported or refused.
    pub(crate) about: &'static str,
}

impl KeyRow {
    pub(crate) const fn new(treatment: Treatment, paths: &'static str, about: &'static str) -> Self {
        Self { treatment, paths, about }
    }

    /// Each of the paths.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.paths.split_whitespace()
    }

    /// The pattern that a path without list indices matches.
    fn pattern_of(&self, path: &str) -> Option<&'static str> {
        self.paths().find(|pattern| path_matches(pattern, path))
    }
}

/// Keys that the importer reads.
pub(crate) const fn applied(paths: &'static str, about: &'static str) -> KeyRow {
    KeyRow::new(Treatment::Applied, paths, about)
}

/// Keys that change the picture and cannot be applied.
pub(crate) const fn refused(neutral: Neutral, paths: &'static str, about: &'static str) -> KeyRow {
    KeyRow::new(Treatment::Refused(neutral), paths, about)
}

/// Keys that are not applied, and named in a note.
pub(crate) const fn reported(neutral: Neutral, paths: &'static str, about: &'static str) -> KeyRow {
    KeyRow::new(Treatment::Reported(neutral), paths, about)
}

/// Keys that are irrelevant to the picture.
pub(crate) const fn ignored(paths: &'static str, about: &'static str) -> KeyRow {
    KeyRow::new(Treatment::Ignored, paths, about)
}

/// How the importer treats a key.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Treatment {
    /// Read by the importer.
    Applied,
    /// Readout time from the first row to the last; the unit in milliseconds.
    Readout(f64),
    /// Line delay from one row to the next; the unit in milliseconds.
    LineDelay(f64),
    /// Frames per second.
    FrameRate,
    /// Whether the shutter is rolling.
    RollingShutter,
    /// Changes the picture and cannot be applied: refused, unless neutral.
    Refused(Neutral),
    /// Not applied and reported in a note, unless neutral.
    Reported(Neutral),
    /// Irrelevant to the picture.
    Ignored,
}

/// Value at which a key has no effect. Null and empty values have none either.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Neutral {
    /// No value.
    Never,
    /// Zeros or false.
    Zero,
    /// Ones.
    One,
    /// Zeros, ones, or false.
    ZeroOrOne,
    /// An identity matrix.
    Identity,
}

impl Neutral {
    /// Whether a value has no effect.
    pub(crate) fn matches(self, value: &Value) -> bool {
        let numbers = flat_numbers(value);
        let all = |test: fn(f64) -> bool| {
            value != &Value::Bool(true) && numbers.as_ref().is_some_and(|list| list.iter().all(|x| test(*x)))
        };
        match (self, value) {
            (_, Value::Null) => true,
            (_, Value::String(text)) if text.trim().is_empty() => true,
            (_, Value::Array(list)) if list.is_empty() => true,
            (_, Value::Object(map)) if map.is_empty() => true,
            (Self::Never, _) => false,
            (Self::Zero | Self::ZeroOrOne, Value::Bool(yes)) => !yes,
            (Self::Zero, _) => all(|x| x == 0.0),
            (Self::One, _) => all(|x| x == 1.0),
            (Self::ZeroOrOne, _) => all(|x| x == 0.0 || x == 1.0),
            (Self::Identity, _) => numbers.is_some_and(|list| is_identity(&list)),
        }
    }

    /// The exception as text, for the documentation.
    #[cfg(test)]
    pub(crate) fn exception(self) -> &'static str {
        match self {
            Self::Never => "",
            Self::Zero => ", unless zero",
            Self::One => ", unless 1",
            Self::ZeroOrOne => ", unless 0 or 1",
            Self::Identity => ", unless the identity",
        }
    }
}

fn is_identity(list: &[f64]) -> bool {
    let size = (list.len() as f64).sqrt() as usize;
    size * size == list.len()
        && list.iter().enumerate().all(|(index, x)| *x == if index % (size + 1) == 0 { 1.0 } else { 0.0 })
}

/// Keys of all formats, by name; a format's own table takes precedence.
pub(crate) const COMMON_KEYS: &[KeyRow] = &[
    refused(
        Neutral::Zero,
        "xi",
        "the mirror parameter of the MEI (omnidirectional) or double-sphere model, which is not supported: \
         calibrate with a Brown-Conrady or an equidistant fisheye (Kannala-Brandt) model",
    ),
    refused(Neutral::Zero, "skew", "skew between the axes, which is not supported: recalibrate without it"),
    refused(
        Neutral::ZeroOrOne,
        "binning_x binning_y binning",
        "binned pixels: give the calibration of the binned picture, and remove the key",
    ),
];

/// A number, text or list of the document.
#[derive(Debug)]
pub(crate) struct Leaf<'a> {
    /// Path, for example `cameras[1].camera.label`.
    pub(crate) path: String,
    pub(crate) value: &'a Value,
}

impl Leaf<'_> {
    /// Path without list indices.
    fn path_without_indices(&self) -> Cow<'_, str> {
        if !self.path.contains('[') {
            return Cow::Borrowed(&self.path);
        }
        let mut bare = String::new();
        for part in self.path.split('[') {
            bare.push_str(part.split_once(']').map_or(part, |(_, rest)| rest));
        }
        Cow::Owned(bare)
    }

    /// Last name of the path.
    pub(crate) fn name(&self) -> &str {
        let name = self.path.rsplit('.').next().unwrap_or_default();
        name.split('[').next().unwrap_or_default()
    }
}

/// Leaves with the table of their keys.
#[derive(Debug)]
pub(crate) struct TableLeaves<'a> {
    pub(crate) keys: &'static [KeyRow],
    pub(crate) leaves: Vec<Leaf<'a>>,
}

/// All leaves of a value. A list of numbers or an OpenCV matrix is one leaf.
pub(crate) fn leaves(value: &Value) -> Vec<Leaf<'_>> {
    let mut leaves = Vec::new();
    let mut open = vec![(String::new(), value)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Object(map) if !is_matrix(value) && !map.is_empty() => {
                let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
                open.extend(map.iter().rev().map(|(key, value)| (join(key), value)));
            }
            Value::Array(list) if list.iter().any(Value::is_object) => {
                open.extend(
                    list.iter().enumerate().rev().map(|(index, value)| (format!("{path}[{index}]"), value)),
                );
            }
            _ => leaves.push(Leaf { path, value }),
        }
    }
    leaves
}

/// Whether a value is an OpenCV matrix.
fn is_matrix(value: &Value) -> bool {
    value.get("data").is_some()
        && ["rows", "cols", "dt", "type_id"].iter().any(|key| value.get(key).is_some())
}

/// Numbers of a value; `None` if it has other values or no numbers. Booleans count as 0 and 1.
fn flat_numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(list) => {
            let parts: Option<Vec<Vec<f64>>> = list.iter().map(flat_numbers).collect();
            parts.map(|parts| parts.concat()).filter(|list| !list.is_empty())
        }
        Value::Object(map) => flat_numbers(map.get("data")?),
        Value::Bool(yes) => Some(vec![f64::from(u8::from(*yes))]),
        Value::String(text) => {
            let list: Option<Vec<f64>> =
                text.split_whitespace().map(|word| as_number(&Value::String(word.to_owned()))).collect();
            list.filter(|list| !list.is_empty())
        }
        single => as_number(single).map(|number| vec![number]),
    }
}

/// The row of a leaf; `None` for an unknown key.
pub(crate) fn row_of(keys: &'static [KeyRow], leaf: &Leaf<'_>) -> Option<&'static KeyRow> {
    let path = leaf.path_without_indices();
    let own = keys.iter().find(|row| row.pattern_of(&path).is_some());
    let is_common = |row: &&KeyRow| row.paths().any(|name| name.eq_ignore_ascii_case(leaf.name()));
    own.or_else(|| COMMON_KEYS.iter().find(is_common))
}

/// Whether a path matches the pattern of a [`KeyRow`].
fn path_matches(pattern: &str, path: &str) -> bool {
    let (mut patterns, mut names) = (pattern.split('.'), path.split('.'));
    loop {
        match (patterns.next(), names.next()) {
            (Some("**"), Some(_)) | (None, None) => return true,
            (Some(pattern), Some(name)) if name_matches(pattern, name) => {}
            _ => return false,
        }
    }
}

/// Whether a name matches a pattern with at most one `*`.
fn name_matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((start, end)) => {
            name.len() >= start.len() + end.len() && name.starts_with(start) && name.ends_with(end)
        }
    }
}

/// Refuses keys that change the picture and cannot be applied.
pub(crate) fn refuse(keys: &'static [KeyRow], leaves: &[Leaf<'_>]) -> Result<(), KeyProblem> {
    for leaf in leaves {
        let key = row_of(keys, leaf);
        if let Some(KeyRow { treatment: Treatment::Refused(neutral), about, .. }) = key
            && !neutral.matches(leaf.value)
        {
            return Err(KeyProblem::new(&leaf.path, format!("is {}: {about}", display_value(leaf.value))));
        }
        if key.is_none() && is_coefficient(leaf.name()) && !Neutral::Zero.matches(leaf.value) {
            let text = format!(
                "is {}: the name is that of a coefficient, but this format has no such coefficient; delete \
                 it if it is none",
                display_value(leaf.value)
            );
            return Err(KeyProblem::new(&leaf.path, text));
        }
    }
    Ok(())
}

/// Whether a name is that of a coefficient: `k4`, `p3`, `s1`, `tauX`.
fn is_coefficient(name: &str) -> bool {
    let digits = name.trim_start_matches(['k', 'p', 's', 'b']);
    let is_numbered = name.len() - digits.len() == 1
        && !digits.is_empty()
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_numbered || ["taux", "tauy", "tau_x", "tau_y"].contains(&name.to_ascii_lowercase().as_str())
}

/// Notes about keys that are not applied. `applied` are paths that were applied although no table has them.
pub(crate) fn unapplied_notes(
    keys: &'static [KeyRow],
    leaves: &[Leaf<'_>],
    applied: &[String],
) -> Vec<String> {
    let mut notes: Vec<(&'static str, String)> = Vec::new();
    let mut unknown: Vec<String> = Vec::new();
    for leaf in leaves.iter().filter(|leaf| !applied.contains(&leaf.path)) {
        match row_of(keys, leaf) {
            Some(row @ KeyRow { treatment: Treatment::Reported(neutral), about, .. })
                if !neutral.matches(leaf.value) =>
            {
                let pattern = row.pattern_of(&leaf.path_without_indices());
                let item = match pattern.and_then(|pattern| pattern.strip_suffix(".**")) {
                    Some(stem) => stem.to_owned(),
                    None => format!("{}{}", leaf.path, equals(leaf.value)),
                };
                match notes.iter_mut().find(|(other, _)| other == about) {
                    Some((_, names)) if names.split(", ").any(|name| name == item) => {}
                    // A long list of similar keys would hide the other notes.
                    Some((_, names)) if names.matches(',').count() < 3 => {
                        names.push_str(&format!(", {item}"))
                    }
                    Some((_, names)) if !names.ends_with(" ...") => names.push_str(" ..."),
                    Some(_) => {}
                    None => notes.push((about, item)),
                }
            }
            None if may_affect_picture(leaf) => unknown.push(format!("{}{}", leaf.path, equals(leaf.value))),
            _ => {}
        }
    }
    let mut notes: Vec<String> =
        notes.into_iter().map(|(about, names)| format!("not applied: {names} ({about})")).collect();
    if !unknown.is_empty() {
        let rest =
            if unknown.len() > 12 { format!(" and {} more", unknown.len() - 12) } else { String::new() };
        unknown.truncate(12);
        notes.push(format!(
            "not applied, because the key is unknown in this format: {}{rest}",
            unknown.join(", ")
        ));
    }
    notes
}

/// Names of text values that change the meaning of other values.
const CONVENTION_KEYS: &[&str] = &[
    "orientation",
    "pixel_origin",
    "origin",
    "convention",
    "color_encoding",
    "coordinate_system",
    "axes",
    "rotation",
];

/// Whether an unknown leaf may affect the picture: numbers, and texts that may name a model or a convention.
fn may_affect_picture(leaf: &Leaf<'_>) -> bool {
    let name = leaf.name().to_ascii_lowercase();
    match leaf.value {
        Value::Bool(yes) => *yes,
        Value::String(text) if flat_numbers(leaf.value).is_none() => {
            !text.trim().is_empty()
                && ([
                    "model", "distort", "project", "lens", "shutter", "crop", "type", "mask", "vignet",
                    "unit",
                ]
                .iter()
                .any(|part| name.contains(part))
                    || CONVENTION_KEYS.contains(&name.as_str()))
        }
        other => flat_numbers(other).is_some(),
    }
}

/// ` = value` for messages; empty for lists.
fn equals(value: &Value) -> String {
    match value {
        Value::Array(_) | Value::Object(_) => String::new(),
        single => format!(" = {}", display_value(single)),
    }
}

/// A value for messages.
fn display_value(value: &Value) -> String {
    match value {
        Value::Array(list) if list.len() <= 6 && !list.iter().any(Value::is_array) => value.to_string(),
        Value::Array(_) | Value::Object(_) => "not neutral".to_owned(),
        Value::String(text) => format!("`{text}`"),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests;
