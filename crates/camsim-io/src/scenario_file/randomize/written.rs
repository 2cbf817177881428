//! `[randomize]` as it is written: keys with their distributions, in quotes or as tables.

use std::collections::BTreeMap;

use serde_json::Value as Json;
use toml::{Table, Value};

use super::{
    super::{
        ScenarioError, for_each_path,
        schema::{CAMERAS, SCENARIO, ValueKind, like_camera},
        similar::nearest_word,
        tree::{KeyLocation, Tree, UNSET, join, value},
    },
    RANDOMIZE, RandomizeSpec, SEED,
    draw::Draw,
    law::KINDS,
    problems,
};

/// Keys of `[randomize]` that are not keys of the scenario.
const SETTINGS: [&str; 3] = [SEED, "variations", "own_seed"];

/// Values of `[randomize]` by dotted keys.
#[derive(Clone, Debug, Default)]
pub(super) struct Written {
    values: BTreeMap<String, Value>,
}

impl Written {
    /// Takes the table out of a tree; `None` if there is none.
    pub(super) fn take(tree: &mut Tree) -> Result<Option<Self>, ScenarioError> {
        let mut written = Self::default();
        match tree.root.remove(RANDOMIZE) {
            None => return Ok(None),
            Some(Value::Table(table)) => {
                let mut twice = Vec::new();
                written.add(table, "", &mut twice);
                if !twice.is_empty() {
                    return Err(problems(tree, &twice));
                }
            }
            Some(_) => {
                let what = "expected a table, such as \"camera.shutter.exposure_ms\" = { uniform = [2, 10] }";
                let location = tree.location(RANDOMIZE);
                return Err(ScenarioError::Problems(vec![format!("{location}: {RANDOMIZE}: {what}")]));
            }
        }
        Ok(Some(written))
    }

    /// Adds the keys of a table, whose own tables are distributions or parts of keys.
    fn add(&mut self, table: Table, prefix: &str, twice: &mut Vec<(String, String)>) {
        for (name, value) in table {
            let key = join(prefix, &name);
            match value {
                Value::Table(below) if !is_distribution(&key, &below) => self.add(below, &key, twice),
                value => {
                    if self.values.insert(key.clone(), value).is_some() {
                        twice.push((key, "is there twice; leave one out".into()));
                    }
                }
            }
        }
    }

    /// Applies `--set randomize.key=text`.
    pub(super) fn set(written: &mut Option<Self>, tree: &mut Tree, key: &str, text: &str) {
        if text == UNSET {
            written.get_or_insert_default().values.remove(key);
            return;
        }
        let location = KeyLocation::Set(format!("{RANDOMIZE}.{key}={text}"));
        tree.locations.insert(join(RANDOMIZE, key), location);
        written.get_or_insert_default().values.insert(key.to_owned(), value(text));
    }

    /// Checks all of it. Keys that `--set` has fixed are not drawn.
    pub(super) fn spec(
        &self,
        tree: &Tree,
        defaults: &Table,
        scenario_seed: u64,
        fixed: &[String],
    ) -> Result<RandomizeSpec, ScenarioError> {
        let mut found = Vec::new();
        let mut spec =
            RandomizeSpec { seed: scenario_seed, variations: None, own_seed: true, draws: Vec::new() };
        for (key, value) in &self.values {
            let read = match key.as_str() {
                SEED => whole(value, 0).map(|seed| spec.seed = seed),
                "variations" => whole(value, 1).map(|count| spec.variations = Some(count)),
                "own_seed" => match value.as_bool() {
                    Some(own_seed) => {
                        spec.own_seed = own_seed;
                        Ok(())
                    }
                    None => Err(format!("expected true or false, found {value}")),
                },
                _ => known(key).and_then(|kind| {
                    let draw = Draw::new(key, kind, value, tree, defaults)?;
                    spec.draws.extend(draw.without(fixed));
                    Ok(())
                }),
            };
            found.extend(read.err().map(|message| (key.clone(), message)));
        }
        if found.is_empty() { Ok(spec) } else { Err(problems(tree, &found)) }
    }
}

impl Written {
    /// The distribution of a key as it is written, with absolute paths.
    pub(super) fn portable(&self, draw: &Draw, tree: &Tree) -> Result<Json, ScenarioError> {
        let key = draw.name();
        let json = |value: &Value| serde_json::to_value(value).unwrap_or_default();
        let mut law = self.values.get(key).map(json).unwrap_or_default();
        if draw.is_part() {
            let message =
                "some of its elements are fixed by --set, which no table can say; name each element";
            return Err(problems(tree, &[(key.to_owned(), message.into())]));
        }
        for choice in law.get_mut("choice").and_then(Json::as_array_mut).into_iter().flatten() {
            make_paths_absolute(key, choice, tree);
        }
        Ok(law)
    }
}

/// Makes the paths of a value at a key absolute.
fn make_paths_absolute(key: &str, value: &mut Json, tree: &Tree) {
    let location = join(RANDOMIZE, key);
    let absolute = |path: &mut String| {
        let resolved = tree.resolve(&location, path);
        *path = std::path::absolute(&resolved).unwrap_or(resolved).to_string_lossy().into_owned();
    };
    let plain = like_camera(&schema_key(key)).into_owned();
    let is_camera = plain == "camera" || plain == CAMERAS;
    match value {
        // A camera file.
        Json::String(path) if is_camera => absolute(path),
        value => {
            // At its key within a scenario, where paths are known.
            let mut nested = std::mem::take(value);
            for step in plain.rsplit('.') {
                nested = Json::Object([(step.to_owned(), nested)].into_iter().collect());
            }
            for_each_path(&mut nested, &mut |_, path| absolute(path));
            for step in plain.split('.') {
                nested = nested.get_mut(step).map(std::mem::take).unwrap_or_default();
            }
            *value = nested;
        }
    }
}

/// Whether a table at a key is a distribution, not further parts of keys.
fn is_distribution(key: &str, table: &Table) -> bool {
    let is_leaf = |kind: ValueKind| kind != ValueKind::Tables;
    table.is_empty()
        || table.keys().any(|name| KINDS.contains(&name.as_str()))
        || SCENARIO.kind(&schema_key(key)).is_some_and(is_leaf)
}

/// A key without names of cameras and numbers of elements of lists.
pub(super) fn schema_key(key: &str) -> String {
    let mut steps = key.split('.').peekable();
    let mut plain: Vec<&str> = Vec::new();
    if steps.peek() == Some(&CAMERAS) {
        plain.extend(steps.next());
        // The name or number of a camera.
        steps.next();
    }
    let is_number = |step: &&str| step.parse::<usize>().is_ok() || *step == "*";
    plain.extend(steps.filter(|step| !is_number(step)));
    plain.join(".")
}

/// The values that a key takes; `None` for a table.
fn known(key: &str) -> Result<Option<ValueKind>, String> {
    let plain = schema_key(key);
    match SCENARIO.kind(&plain) {
        Some(kind) => Ok(Some(kind)),
        None if SCENARIO.is_table(&plain) => Ok(None),
        None => {
            Err(match nearest_word(key, &SETTINGS).map(str::to_owned).or_else(|| SCENARIO.nearest(&plain)) {
                Some(near) => format!("unknown key; did you mean `{near}`?"),
                None => format!("unknown key; {}", SCENARIO.listing),
            })
        }
    }
}

/// A whole number from `least`.
fn whole(value: &Value, least: u64) -> Result<u64, String> {
    let number = value.as_integer().and_then(|number| u64::try_from(number).ok());
    number
        .filter(|number| *number >= least)
        .ok_or_else(|| format!("expected a whole number, {least} or more, found {value}"))
}
