//! What each importer knows of its format: a table of keys, which decides what becomes of each number of a
//! file.
//!
//! A key that changes the picture is applied, or the file is refused, or the key is named in a note. A number
//! whose key is in no table is named too: nothing goes unsaid.

use std::borrow::Cow;

use serde_json::Value;

use super::document::{Problem, as_number};

/// A key of a format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    /// Its path: `*` stands for any part of one name, a last `**` for everything below. Indices of lists are
    /// left out.
    pub(super) path: &'static str,
    /// What becomes of it.
    pub(super) use_: Use,
    /// What it is, and what to do about it if it is left out or refused.
    pub(super) about: &'static str,
}

impl Key {
    pub(super) const fn new(path: &'static str, use_: Use, about: &'static str) -> Self {
        Self { path, use_, about }
    }
}

/// What becomes of a key.
#[derive(Clone, Copy, Debug)]
pub(super) enum Use {
    /// Read by the importer.
    Applied,
    /// Time from the first row to the last, in units of so many milliseconds.
    Readout(f64),
    /// Time from a row to the next, in units of so many milliseconds.
    LineDelay(f64),
    /// Frames a second.
    Rate,
    /// Whether rows are read one after another.
    Rolling,
    /// Changes the picture and cannot be applied: refused, unless it has the value that changes nothing.
    Refused(Neutral),
    /// Left out and named, unless it has the value that changes nothing.
    Named(Neutral),
    /// Says nothing about the picture.
    Silent,
}

/// The value by which a key changes nothing. Absent, null and empty always are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Neutral {
    /// None.
    Never,
    /// Zeros, false.
    Zero,
    /// Ones.
    One,
    /// Zeros or ones, false.
    UpToOne,
    /// An identity matrix.
    Identity,
}

impl Neutral {
    pub(super) fn is(self, value: &Value) -> bool {
        let numbers = flat(value);
        let all = |test: fn(f64) -> bool| {
            value != &Value::Bool(true) && numbers.as_ref().is_some_and(|list| list.iter().all(|x| test(*x)))
        };
        match (self, value) {
            (_, Value::Null) => true,
            (_, Value::String(text)) if text.trim().is_empty() => true,
            (_, Value::Array(list)) if list.is_empty() => true,
            (_, Value::Object(map)) if map.is_empty() => true,
            (Self::Never, _) => false,
            (Self::Zero | Self::UpToOne, Value::Bool(yes)) => !yes,
            (Self::Zero, _) => all(|x| x == 0.0),
            (Self::One, _) => all(|x| x == 1.0),
            (Self::UpToOne, _) => all(|x| x == 0.0 || x == 1.0),
            (Self::Identity, _) => numbers.is_some_and(|list| is_identity(&list)),
        }
    }

    /// For the tables: the exception, in words.
    #[cfg(test)]
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Never => "",
            Self::Zero => ", unless zero",
            Self::One => ", unless 1",
            Self::UpToOne => ", unless 0 or 1",
            Self::Identity => ", unless the identity",
        }
    }
}

fn is_identity(list: &[f64]) -> bool {
    let size = (list.len() as f64).sqrt() as usize;
    size * size == list.len()
        && list.iter().enumerate().all(|(at, x)| *x == if at % (size + 1) == 0 { 1.0 } else { 0.0 })
}

/// Every key in every format, by its bare name. What a format's own table says comes first.
pub(super) const EVERYWHERE: &[Key] = &[
    Key::new(
        "xi",
        Use::Refused(Neutral::Zero),
        "the mirror parameter of the MEI (omnidirectional) or double-sphere model, which no lens here is: calibrate with a Brown-Conrady or an equidistant fisheye (Kannala-Brandt) model",
    ),
    Key::new(
        "skew",
        Use::Refused(Neutral::Zero),
        "skew between the axes, which a camera here cannot have: recalibrate without",
    ),
    Key::new(
        "binning_x",
        Use::Refused(Neutral::UpToOne),
        "pixels read together: give the calibration of the binned picture, and take the key out",
    ),
    Key::new(
        "binning_y",
        Use::Refused(Neutral::UpToOne),
        "pixels read together: give the calibration of the binned picture, and take the key out",
    ),
    Key::new(
        "binning",
        Use::Refused(Neutral::UpToOne),
        "pixels read together: give the calibration of the binned picture, and take the key out",
    ),
];

/// A number, word or list in a file.
#[derive(Debug)]
pub(super) struct Leaf<'a> {
    /// Where: `cameras[1].camera.label`.
    pub(super) path: String,
    /// What is there.
    pub(super) value: &'a Value,
}

impl Leaf<'_> {
    /// Its path without indices.
    fn bare(&self) -> Cow<'_, str> {
        if !self.path.contains('[') {
            return Cow::Borrowed(&self.path);
        }
        let mut bare = String::new();
        for part in self.path.split('[') {
            bare.push_str(part.split_once(']').map_or(part, |(_, rest)| rest));
        }
        Cow::Owned(bare)
    }

    /// Its last name.
    pub(super) fn name(&self) -> &str {
        let name = self.path.rsplit('.').next().unwrap_or_default();
        name.split('[').next().unwrap_or_default()
    }
}

/// Leaves of a file, with the table that they are judged by.
#[derive(Debug)]
pub(super) struct Part<'a> {
    pub(super) keys: &'static [Key],
    pub(super) leaves: Vec<Leaf<'a>>,
}

/// All leaves of a tree. Lists of numbers, and matrices as OpenCV writes them, are one leaf.
pub(super) fn leaves(value: &Value) -> Vec<Leaf<'_>> {
    let mut found = Vec::new();
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
            _ => found.push(Leaf { path, value }),
        }
    }
    found
}

fn is_matrix(value: &Value) -> bool {
    value.get("data").is_some()
        && ["rows", "cols", "dt", "type_id"].iter().any(|key| value.get(key).is_some())
}

/// Its numbers, if there are any and nothing else. Truth values count as 0 and 1.
fn flat(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(list) => {
            let parts: Option<Vec<Vec<f64>>> = list.iter().map(flat).collect();
            parts.map(|parts| parts.concat()).filter(|list| !list.is_empty())
        }
        Value::Object(map) => flat(map.get("data")?),
        Value::Bool(yes) => Some(vec![f64::from(u8::from(*yes))]),
        Value::String(text) => {
            let list: Option<Vec<f64>> =
                text.split_whitespace().map(|word| as_number(&Value::String(word.to_owned()))).collect();
            list.filter(|list| !list.is_empty())
        }
        single => as_number(single).map(|number| vec![number]),
    }
}

/// The entry of a table for a leaf.
pub(super) fn known(keys: &'static [Key], leaf: &Leaf<'_>) -> Option<&'static Key> {
    let bare = leaf.bare();
    let own = keys.iter().find(|key| matches(key.path, &bare));
    own.or_else(|| EVERYWHERE.iter().find(|key| key.path.eq_ignore_ascii_case(leaf.name())))
}

fn matches(pattern: &str, path: &str) -> bool {
    let (mut patterns, mut names) = (pattern.split('.'), path.split('.'));
    loop {
        match (patterns.next(), names.next()) {
            (Some("**"), Some(_)) | (None, None) => return true,
            (Some(pattern), Some(name)) if fits(pattern, name) => {}
            _ => return false,
        }
    }
}

/// One `*` in a name.
fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((start, end)) => {
            name.len() >= start.len() + end.len() && name.starts_with(start) && name.ends_with(end)
        }
    }
}

/// Refuses what changes the picture and cannot be applied.
pub(super) fn refuse(keys: &'static [Key], leaves: &[Leaf<'_>]) -> Result<(), Problem> {
    for leaf in leaves {
        let key = known(keys, leaf);
        if let Some(Key { use_: Use::Refused(neutral), about, .. }) = key
            && !neutral.is(leaf.value)
        {
            return Err(Problem::new(&leaf.path, format!("is {}: {about}", shown(leaf.value))));
        }
        if key.is_none() && is_coefficient(leaf.name()) && !Neutral::Zero.is(leaf.value) {
            let text = format!(
                "is {}: by its name a coefficient, but this format has none of that name; delete it if it is not one",
                shown(leaf.value)
            );
            return Err(Problem::new(&leaf.path, text));
        }
    }
    Ok(())
}

/// `k4`, `p3`, `s1`, `tauX`: what calibrations call their coefficients.
fn is_coefficient(name: &str) -> bool {
    let digits = name.trim_start_matches(['k', 'p', 's', 'b']);
    let numbered = name.len() - digits.len() == 1
        && !digits.is_empty()
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    numbered || ["taux", "tauy", "tau_x", "tau_y"].contains(&name.to_ascii_lowercase().as_str())
}

/// Notes on what was left out. `done` are the paths of what was applied under a name that no table has.
pub(super) fn left_out(keys: &'static [Key], leaves: &[Leaf<'_>], done: &[String]) -> Vec<String> {
    let mut notes: Vec<(&'static str, String)> = Vec::new();
    let mut unknown: Vec<String> = Vec::new();
    for leaf in leaves.iter().filter(|leaf| !done.contains(&leaf.path)) {
        match known(keys, leaf) {
            Some(Key { path, use_: Use::Named(neutral), about }) if !neutral.is(leaf.value) => {
                let one = match path.strip_suffix(".**") {
                    Some(stem) => stem.to_owned(),
                    None => format!("{}{}", leaf.path, equals(leaf.value)),
                };
                match notes.iter_mut().find(|(known, _)| known == about) {
                    Some((_, names)) if names.split(", ").any(|name| name == one) => {}
                    // A list of the same again and again would hide the rest.
                    Some((_, names)) if names.matches(',').count() < 3 => names.push_str(&format!(", {one}")),
                    Some((_, names)) if !names.ends_with(" ...") => names.push_str(" ..."),
                    Some(_) => {}
                    None => notes.push((about, one)),
                }
            }
            None if is_telling(leaf) => unknown.push(format!("{}{}", leaf.path, equals(leaf.value))),
            _ => {}
        }
    }
    let mut notes: Vec<String> =
        notes.into_iter().map(|(about, names)| format!("left out: {names} ({about})")).collect();
    if !unknown.is_empty() {
        let more =
            if unknown.len() > 12 { format!(" and {} more", unknown.len() - 12) } else { String::new() };
        unknown.truncate(12);
        notes.push(format!(
            "left out, as camsim does not know what it is in this format: {}{more}",
            unknown.join(", ")
        ));
    }
    notes
}

/// Names whose words change what the numbers beside them mean.
const MEANING_WORDS: &[&str] = &[
    "orientation",
    "pixel_origin",
    "origin",
    "convention",
    "color_encoding",
    "coordinate_system",
    "axes",
    "rotation",
];

/// Anything that may be a number of the camera; of words, those that may be a model.
fn is_telling(leaf: &Leaf<'_>) -> bool {
    let name = leaf.name().to_ascii_lowercase();
    match leaf.value {
        Value::Bool(yes) => *yes,
        Value::String(text) if flat(leaf.value).is_none() => {
            !text.trim().is_empty()
                && ([
                    "model", "distort", "project", "lens", "shutter", "crop", "type", "mask", "vignet",
                    "unit",
                ]
                .iter()
                .any(|part| name.contains(part))
                    || MEANING_WORDS.contains(&name.as_str()))
        }
        other => flat(other).is_some(),
    }
}

fn equals(value: &Value) -> String {
    match value {
        Value::Array(_) | Value::Object(_) => String::new(),
        single => format!(" = {}", shown(single)),
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Array(list) if list.len() <= 6 && !list.iter().any(Value::is_array) => value.to_string(),
        Value::Array(_) | Value::Object(_) => "not neutral".to_owned(),
        Value::String(text) => format!("`{text}`"),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests;
