//! The schema of scenario files: every key and the values it takes, from the fields of [`Scenario`].
//! `frame_file` has the schema of FRAME.toml.

use std::{borrow::Cow, sync::LazyLock};

use camsim_core::scenario::{
    Scenario,
    keys::{Field, Key, Value, join, keys_of},
};

pub use camsim_core::scenario::keys::ValueKind;

use super::randomize::RANDOMIZE;
use super::similar::{MIN_KEY_SIMILARITY, similarity};

/// Keys of a file format, with what error messages say about them.
#[derive(Clone, Debug)]
pub(crate) struct Schema {
    /// Dotted keys, without indices of array elements.
    pub(crate) keys: Vec<(&'static str, ValueKind)>,
    /// Required keys, each with the table within which it is required (`""` for the root).
    pub(crate) required: Vec<(String, String)>,
    /// Hint in messages: where a user finds all keys.
    pub(crate) listing: &'static str,
    /// Whether it is that of scenarios.
    is_scenario: bool,
}

/// Schema of scenarios, and of camera files below `camera`.
pub(crate) static SCENARIO: LazyLock<Schema> = LazyLock::new(|| {
    let mut required = Vec::new();
    add_required(Scenario::FIELDS, "", "", &mut required);
    required.push((format!("{CAMERAS}.name"), CAMERAS.to_owned()));
    Schema {
        keys: kinds().collect(),
        required,
        listing: "`camsim render --print-default` lists all keys",
        is_scenario: true,
    }
});

/// Every key of a scenario with its facts, in the order of the format, without indices of array elements.
#[must_use]
pub fn keys() -> &'static [Key] {
    static KEYS: LazyLock<Vec<Key>> = LazyLock::new(keys_of::<Scenario>);
    &KEYS
}

/// Every key with the values that it takes, in the order of the format.
pub fn kinds() -> impl Iterator<Item = (&'static str, ValueKind)> {
    keys().iter().map(|key| (key.name.as_str(), key.field.kind))
}

/// The key of a name without indices of array elements; those of `cameras` are those of `camera`.
#[must_use]
pub fn find_key(name: &str) -> Option<&'static Key> {
    let name = like_camera(name);
    keys().iter().find(|key| key.name == name)
}

/// Adds the required keys of a table that stands within another one, or is it: a table that is not optional is
/// missing where the outer one lacks it.
fn add_required(fields: &[Field], table: &str, within: &str, required: &mut Vec<(String, String)>) {
    for field in fields {
        let key = join(table, field.name);
        if field.is_required {
            required.push((key.clone(), within.to_owned()));
        }
        let is_part = field.kind == ValueKind::Table && !field.is_optional;
        add_required(field.fields, &key, if is_part { within } else { &key }, required);
    }
}

/// Names that other programs have for keys.
const OTHER_NAMES: [(&str, &str); 6] = [
    ("resolution", "camera.size_px"),
    ("image_size", "camera.size_px"),
    ("focal_length", "camera.focal_px"),
    ("principal_point", "camera.principal_point_px"),
    ("exposure_time", "camera.shutter.exposure_ms"),
    ("line_delay", "camera.shutter.line_time_us"),
];

/// The list of cameras of a rig. Its elements have the keys of `camera`.
pub const CAMERAS: &str = "cameras";
/// A camera file below an element's own keys.
const CAMERA_FILE: &str = "cameras.file";

/// The key of `camera` that a key of `cameras`, without index, is like; other keys as they are.
pub(super) fn like_camera(key: &str) -> Cow<'_, str> {
    match key.strip_prefix(CAMERAS).and_then(|rest| rest.strip_prefix('.')) {
        Some(rest) => format!("camera.{rest}").into(),
        None => key.into(),
    }
}

impl Schema {
    /// A schema of a list of keys.
    pub(crate) fn new(
        keys: &[(&'static str, ValueKind)],
        required: &[(&str, &str)],
        listing: &'static str,
    ) -> Self {
        let owned = |(key, table): &(&str, &str)| ((*key).to_owned(), (*table).to_owned());
        let required = required.iter().map(owned).collect();
        Self { keys: keys.to_vec(), required, listing, is_scenario: false }
    }

    /// The values that `key` takes; `None` if it is unknown.
    pub(crate) fn kind(&self, key: &str) -> Option<ValueKind> {
        match key {
            CAMERAS if self.is_scenario => return Some(ValueKind::Tables),
            CAMERA_FILE if self.is_scenario => return Some(ValueKind::Path),
            _ => {}
        }
        let key = like_camera(key);
        self.keys.iter().find(|(name, _)| *name == key).map(|(_, kind)| *kind)
    }

    /// Whether `key` is a table of the schema (`camera.lens`).
    pub(crate) fn is_table(&self, key: &str) -> bool {
        let key = like_camera(key);
        key.is_empty()
            || self
                .keys
                .iter()
                .any(|(name, _)| name.strip_prefix(&*key).is_some_and(|rest| rest.starts_with('.')))
    }

    /// Whether the last part of an unknown key is the name of a value that stands outside of all tables.
    pub(crate) fn is_outside_tables(&self, key: &str) -> bool {
        let Some((_, leaf)) = key.rsplit_once('.') else { return false };
        let is_value = |&(name, kind): &(&str, ValueKind)| name == leaf && kind != ValueKind::Tables;
        self.is_scenario && (["camera", "cameras"].contains(&leaf) || self.keys.iter().any(is_value))
    }

    /// The known key most similar to `key`, for "did you mean". Siblings are preferred, but a key of another
    /// table may win.
    pub(crate) fn nearest(&self, key: &str) -> Option<String> {
        let near = self.nearest_like(&like_camera(key))?;
        match near.strip_prefix("camera.").filter(|_| key.starts_with("cameras.")) {
            Some(rest) => Some(format!("cameras.{rest}")),
            None => Some(near),
        }
    }

    /// [`Self::nearest`] for keys of one camera.
    fn nearest_like(&self, key: &str) -> Option<String> {
        let (parent, leaf) = key.rsplit_once('.').unwrap_or(("", key));
        if let Some((_, own)) = OTHER_NAMES.iter().find(|(other, _)| *other == leaf) {
            return self.kind(own).map(|_| (*own).to_owned());
        }
        let mut names: Vec<&str> = Vec::new();
        if self.is_scenario {
            names.push(RANDOMIZE);
        }
        for (name, _) in &self.keys {
            names.extend(name.match_indices('.').map(|(end, _)| &name[..end]));
            names.push(name);
        }
        let score = |name: &&str| {
            let (its_parent, its_leaf) = name.rsplit_once('.').unwrap_or(("", name));
            let similarity = similarity(leaf, its_leaf);
            if its_parent == parent { similarity + 0.15 } else { similarity }
        };
        // Several tables have names such as exposure_ms. Of a parent that is no table the more similar table decides;
        // else a key below the parent is meant, and the first of them is the usual one.
        let is_known_parent = self.is_table(parent);
        let of_table = |name: &str| match is_known_parent {
            true => f64::from(u8::from(name.strip_prefix(parent).is_some_and(|rest| rest.starts_with('.')))),
            false => similarity(parent, name.rsplit_once('.').map_or("", |(table, _)| table)),
        };
        let order = |(i, a): &(usize, &str), (k, b): &(usize, &str)| {
            score(a).total_cmp(&score(b)).then_with(|| of_table(a).total_cmp(&of_table(b))).then(k.cmp(i))
        };
        let (_, best) = names.into_iter().enumerate().max_by(order)?;
        (score(&best) > MIN_KEY_SIMILARITY).then(|| best.to_owned())
    }
}
