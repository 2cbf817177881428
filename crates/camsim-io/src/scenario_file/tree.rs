//! The TOML tree of a scenario with the place of every key, and `--set` on it.

use std::{
    collections::HashMap,
    fmt,
    path::{Path, PathBuf},
};

use toml::{
    Spanned, Table, Value,
    de::{DeTable, DeValue},
};

use super::{ScenarioError, mistaken::mistaken, schema::KEYS};

/// Where a key was written.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    /// File and line from 1.
    File(PathBuf, usize),
    /// `--set key=value`.
    Set(String),
    /// A run.json; whether its paths are relative to it, or to the working directory as those of early
    /// versions.
    Run(PathBuf, bool),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(file, line) => write!(f, "{}:{line}", file.display()),
            Self::Set(text) => write!(f, "--set {text}"),
            Self::Run(file, _) => write!(f, "{}", file.display()),
        }
    }
}

/// Values by nesting, places by dotted key with indices.
pub(crate) struct Tree {
    pub(crate) file: PathBuf,
    pub(crate) root: Table,
    pub(crate) places: HashMap<String, Place>,
}

impl Tree {
    /// Reads `path`; keys are placed under `prefix`.
    pub(crate) fn read(path: &Path, prefix: &str) -> Result<Self, ScenarioError> {
        let bytes =
            std::fs::read(path).map_err(|source| ScenarioError::Read { path: path.into(), source })?;
        let not_text = |error: std::str::Utf8Error| ScenarioError::NotText {
            path: path.into(),
            offset: error.valid_up_to(),
        };
        let text = std::str::from_utf8(&bytes).map_err(not_text)?;
        Self::parse(text.strip_prefix('\u{feff}').unwrap_or(text), path, prefix)
    }

    /// Reads a scenario, or the one that a `run.json` holds.
    pub(crate) fn read_scenario(path: &Path) -> Result<Self, ScenarioError> {
        let bytes = std::fs::read(path).unwrap_or_default();
        if let Some(what) = mistaken(path, &bytes) {
            return Err(ScenarioError::Problems(vec![what]));
        }
        // No TOML file begins so.
        if bytes.trim_ascii_start().first() == Some(&b'{') {
            Self::read_run(path)
        } else {
            Self::read(path, "")
        }
    }

    fn read_run(path: &Path) -> Result<Self, ScenarioError> {
        let wrong = |message: String| ScenarioError::Problems(vec![format!("{}: {message}", path.display())]);
        let bytes =
            std::fs::read(path).map_err(|source| ScenarioError::Read { path: path.into(), source })?;
        let run: serde_json::Value = serde_json::from_slice(&bytes)
            .map_err(|error| wrong(format!("neither TOML nor JSON: {error}")))?;
        let Some(Value::Table(root)) = run.get("scenario").and_then(from_json) else {
            return Err(wrong(
                "JSON without `scenario`: of JSON files only the run.json that `camsim render` writes holds a scenario".into(),
            ));
        };
        let is_portable =
            run.get("paths").and_then(serde_json::Value::as_str) == Some(crate::manifest::PATHS);
        let places = root.keys().map(|key| (key.clone(), Place::Run(path.into(), is_portable))).collect();
        Ok(Self { file: path.into(), root, places })
    }

    /// Reads a camera file, whose keys are placed under `camera`. A scenario, or `[camera]` copied with its
    /// header, is refused as a whole.
    pub(crate) fn read_camera(path: &Path) -> Result<Self, ScenarioError> {
        let tree = Self::read(path, "camera")?;
        let mut of_scenario = KEYS.iter().filter_map(|(key, _)| key.split('.').next());
        match of_scenario.find(|name| tree.root.contains_key(*name)) {
            None => Ok(tree),
            Some(name) => {
                let fix = if name == "camera" {
                    "write fps = 30 and [lens], not [camera] and [camera.lens]"
                } else {
                    "the rest belongs into a scenario"
                };
                let place = tree.place(&join("camera", name));
                Err(ScenarioError::Problems(vec![format!(
                    "{place}: {name}: a CAMERA.toml has the keys of [camera] at its root: {fix}"
                )]))
            }
        }
    }

    pub(crate) fn parse(text: &str, path: &Path, prefix: &str) -> Result<Self, ScenarioError> {
        let line_of =
            |at: usize| text.as_bytes()[..at.min(text.len())].iter().filter(|&&b| b == b'\n').count() + 1;
        let syntax = |error: toml::de::Error| ScenarioError::Syntax {
            path: path.into(),
            line: error.span().map_or(1, |span| line_of(span.start)),
            message: error.message().to_owned(),
        };
        let spanned = DeTable::parse(text).map_err(syntax)?;
        let root: Table = toml::from_str(text).map_err(syntax)?;
        let mut places = HashMap::new();
        let mut place = |key: &str, at: usize| {
            places.insert(key.to_owned(), Place::File(path.into(), line_of(at)));
        };
        place_table(spanned.get_ref(), prefix, &mut place);
        Ok(Self { file: path.into(), root, places })
    }

    /// The place of `key`, or of the nearest table around it.
    pub(crate) fn place(&self, key: &str) -> Place {
        let mut key = key;
        loop {
            if let Some(place) = self.places.get(key) {
                return place.clone();
            }
            match key.rsplit_once('.') {
                Some((parent, _)) => key = parent,
                None => return Place::File(self.file.clone(), 1),
            }
        }
    }

    /// Replaces `camera = "file.toml"` by the contents of that file.
    pub(super) fn resolve_camera(&mut self) -> Result<(), ScenarioError> {
        let Some(Value::String(name)) = self.root.get("camera") else { return Ok(()) };
        let path = self.resolve("camera", name);
        let camera = Self::read_camera(&path).map_err(|error| match error {
            ScenarioError::Read { path, source } => {
                ScenarioError::ReadCamera { path, scenario: self.file.clone(), source }
            }
            other => other,
        })?;
        self.root.insert("camera".into(), Value::Table(camera.root));
        self.places.insert("camera".into(), Place::File(path, 1));
        self.places.extend(camera.places);
        Ok(())
    }

    /// A path written at `key`, against the folder of its file; a path of `--set` stays relative to the
    /// working directory.
    pub(super) fn resolve(&self, key: &str, path: &str) -> PathBuf {
        match self.place(key) {
            Place::File(file, _) | Place::Run(file, true) => {
                file.parent().unwrap_or(Path::new("")).join(path)
            }
            Place::Set(_) | Place::Run(_, false) => path.into(),
        }
    }

    /// Applies `--set key=text`.
    pub(super) fn set(&mut self, key: &str, text: &str) -> Result<(), ScenarioError> {
        let shown = format!("{key}={text}");
        let fail = |message: String| ScenarioError::Set { set: shown.clone(), message };
        if key.is_empty() || key.split('.').any(str::is_empty) {
            return Err(fail("the key is empty; write --set camera.fps=25".into()));
        }
        let mut steps: Vec<&str> = key.split('.').collect();
        let leaf = steps.pop().unwrap_or_default();
        let mut table = &mut self.root;
        let mut steps = steps.into_iter().peekable();
        while let Some(step) = steps.next() {
            let mut next = table.entry(step).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Array(array) = next {
                let (length, index) =
                    (array.len(), steps.next().and_then(|index| index.parse::<usize>().ok()));
                next = index.and_then(|index| array.get_mut(index)).ok_or_else(|| {
                    fail(format!(
                        "`{step}` is a list of {length}; name one by its number from 0, as in {step}.0.{leaf}"
                    ))
                })?;
            }
            table = next
                .as_table_mut()
                .ok_or_else(|| fail(format!("`{step}` is not a table, so it has no key under it")))?;
        }
        table.insert(leaf.into(), value(text));
        let below = format!("{key}.");
        self.places.retain(|place, _| !place.starts_with(&below));
        for (end, _) in key.match_indices('.') {
            self.places.entry(key[..end].into()).or_insert_with(|| Place::Set(shown.clone()));
        }
        self.places.insert(key.into(), Place::Set(shown));
        if key == "camera" { self.resolve_camera() } else { Ok(()) }
    }
}

/// JSON as TOML, in which null is nothing.
fn from_json(json: &serde_json::Value) -> Option<Value> {
    use serde_json::Value as Json;
    Some(match json {
        Json::Null => return None,
        Json::Bool(value) => Value::Boolean(*value),
        Json::Number(number) => {
            number.as_i64().map(Value::Integer).or_else(|| number.as_f64().map(Value::Float))?
        }
        Json::String(text) => Value::String(text.clone()),
        Json::Array(list) => Value::Array(list.iter().filter_map(from_json).collect()),
        Json::Object(map) => Value::Table(
            map.iter().filter_map(|(key, value)| Some((key.clone(), from_json(value)?))).collect(),
        ),
    })
}

/// A TOML value; what is none is a string, so that words need no quotes.
fn value(text: &str) -> Value {
    let parsed = toml::from_str::<Table>(&format!("v = {text}")).ok().filter(|table| table.len() == 1);
    parsed.and_then(|mut table| table.remove("v")).unwrap_or_else(|| Value::String(text.into()))
}

pub(super) fn join(prefix: &str, key: &str) -> String {
    if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") }
}

fn place_table(table: &DeTable<'_>, prefix: &str, place: &mut dyn FnMut(&str, usize)) {
    for (key, value) in table {
        let name = join(prefix, key.get_ref());
        place(&name, key.span().start);
        place_value(value, &name, place);
    }
}

fn place_value(value: &Spanned<DeValue<'_>>, name: &str, place: &mut dyn FnMut(&str, usize)) {
    match value.get_ref() {
        DeValue::Table(table) => place_table(table, name, place),
        DeValue::Array(array) => {
            for (index, element) in array.iter().enumerate() {
                let name = join(name, &index.to_string());
                place(&name, element.span().start);
                place_value(element, &name, place);
            }
        }
        _ => {}
    }
}
