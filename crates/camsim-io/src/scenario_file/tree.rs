//! The TOML tree of a scenario with the location of every key, changed by `--set`.

use std::{
    collections::HashMap,
    fmt,
    path::{Path, PathBuf},
};

use toml::{
    Spanned, Table, Value,
    de::{DeTable, DeValue},
};

use super::{
    ScenarioError,
    escapes::{backslash_advice, with_slashes},
    schema::{CAMERAS, SCENARIO, ValueKind, find_key, keys},
    wrong_file_kind::wrong_kind_message,
};

mod cameras;

/// Text instead of a value that takes the key out, so that its default holds. No shell can pass it.
pub const UNSET: &str = "\0";

/// What the parser says of whole numbers beyond those of TOML, by how far they are.
const TOO_LARGE: [&str; 4] = ["u64 value was too large", "as i128", "as u128", "number overflowed"];

/// Characters of a value that messages show.
const SHOWN: usize = 120;

/// Where a key is written.
#[derive(Clone, Debug)]
pub(crate) enum KeyLocation {
    /// File, and line from 1.
    File(PathBuf, usize),
    /// `--set key=value`.
    Set(String),
    /// A run.json, and whether its paths are relative to its folder. Those of early versions are relative to
    /// the working directory.
    Run(PathBuf, bool),
}

impl fmt::Display for KeyLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(file, line) => write!(f, "{}:{line}", file.display()),
            Self::Set(text) => write!(f, "--set {text}"),
            Self::Run(file, _) => write!(f, "{}", file.display()),
        }
    }
}

/// A parsed file: nested values, and the location of each key.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// The file that was read.
    pub(crate) file: PathBuf,
    /// Values.
    pub(crate) root: Table,
    /// Locations by dotted key, with indices of array elements.
    pub(crate) locations: HashMap<String, KeyLocation>,
}

impl Tree {
    /// Reads `path`. Locations are stored with `prefix` before their key.
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
        if let Some(message) = wrong_kind_message(path, &bytes) {
            return Err(ScenarioError::Problems(vec![message]));
        }
        // No TOML file begins with a brace.
        if bytes.trim_ascii_start().first() == Some(&b'{') {
            Self::read_run(path)
        } else {
            Self::read(path, "")
        }
    }

    fn read_run(path: &Path) -> Result<Self, ScenarioError> {
        let problem =
            |message: String| ScenarioError::Problems(vec![format!("{}: {message}", path.display())]);
        let bytes =
            std::fs::read(path).map_err(|source| ScenarioError::Read { path: path.into(), source })?;
        let run: serde_json::Value = serde_json::from_slice(&bytes)
            .map_err(|error| problem(format!("neither TOML nor JSON: {error}")))?;
        let Some(Value::Table(root)) = run.get("scenario").and_then(from_json) else {
            return Err(problem(
                "JSON without `scenario`: of JSON files only the run.json that `camsim render` writes holds a \
                 scenario"
                    .into(),
            ));
        };
        let is_portable = run.get("paths").and_then(serde_json::Value::as_str) == Some(super::RELATIVE_PATHS);
        let locations =
            root.keys().map(|key| (key.clone(), KeyLocation::Run(path.into(), is_portable))).collect();
        Ok(Self { file: path.into(), root, locations })
    }

    /// Reads a camera file. Locations are stored with `prefix`, `camera` or that of a camera of a rig, before
    /// their key. A scenario, or `[camera]` copied with its header, is refused.
    pub(crate) fn read_camera(path: &Path, prefix: &str) -> Result<Self, ScenarioError> {
        let tree = Self::read(path, prefix)?;
        let mut scenario_keys = keys().iter().filter_map(|key| key.name.split('.').next()).chain([CAMERAS]);
        match scenario_keys.find(|name| tree.root.contains_key(*name)) {
            None => Ok(tree),
            Some(name) => {
                let fix = if name == "camera" {
                    "write fps = 30 and [lens], not [camera] and [camera.lens]"
                } else {
                    "the rest belongs into a scenario"
                };
                let location = tree.location(&join(prefix, name));
                Err(ScenarioError::Problems(vec![format!(
                    "{location}: {name}: a CAMERA.toml has the keys of [camera] at its root: {fix}"
                )]))
            }
        }
    }

    /// Parses the text of the file `path`. Locations are stored with `prefix` before their key.
    pub(crate) fn parse(text: &str, path: &Path, prefix: &str) -> Result<Self, ScenarioError> {
        let line_of = |offset: usize| {
            text.as_bytes()[..offset.min(text.len())].iter().filter(|&&b| b == b'\n').count() + 1
        };
        let syntax = |error: toml::de::Error| {
            let line = error.span().map_or(1, |span| line_of(span.start));
            let hint = syntax_hint(path, text.lines().nth(line - 1).unwrap_or_default());
            let message = match error.message() {
                message if TOO_LARGE.iter().any(|part| message.contains(part)) => {
                    format!("whole numbers end at {}", i64::MAX)
                }
                message => format!("{message}{hint}"),
            };
            ScenarioError::Syntax { path: path.into(), line, message }
        };
        let spanned = DeTable::parse(text).map_err(syntax)?;
        let root: Table = toml::from_str(text).map_err(syntax)?;
        let mut locations = HashMap::new();
        let mut record = |key: &str, offset: usize| {
            locations.insert(key.to_owned(), KeyLocation::File(path.into(), line_of(offset)));
        };
        locate_table(spanned.get_ref(), prefix, &mut record);
        Ok(Self { file: path.into(), root, locations })
    }

    /// The location of `key`, or of the nearest table that contains it.
    pub(crate) fn location(&self, key: &str) -> KeyLocation {
        let mut key = key;
        loop {
            if let Some(location) = self.locations.get(key) {
                return location.clone();
            }
            match key.rsplit_once('.') {
                Some((parent, _)) => key = parent,
                None => return KeyLocation::File(self.file.clone(), 1),
            }
        }
    }

    /// Resolves a path written at `key` against the folder of its file. Paths of `--set` stay relative to the
    /// working directory.
    pub(super) fn resolve(&self, key: &str, path: &str) -> PathBuf {
        match self.location(key) {
            KeyLocation::File(file, _) | KeyLocation::Run(file, true) => {
                with_slashes(file.parent().unwrap_or(Path::new("")).join(path))
            }
            KeyLocation::Set(_) | KeyLocation::Run(_, false) => with_slashes(path.into()),
        }
    }

    /// Applies `--set key=text`.
    pub(super) fn set(&mut self, key: &str, text: &str) -> Result<(), ScenarioError> {
        let shown = format!("{key}={}", shortened(text));
        let fail = |message: String| ScenarioError::Set { set: shown.clone(), message };
        if key.is_empty() || key.split('.').any(str::is_empty) {
            return Err(fail("the key is empty; write --set camera.fps=25".into()));
        }
        if let Some(advice) = unparsed_backslashes(text).filter(|_| text != UNSET) {
            return Err(fail(advice));
        }
        for key in self.of_each_camera(key) {
            let key = self.numbered(&key).map_err(fail)?;
            match text {
                UNSET => self.unset(&key, fail)?,
                _ => self.put(&key, value(text), &KeyLocation::Set(shown.clone()), fail)?,
            }
        }
        Ok(())
    }

    /// Takes a key out, if it is there.
    fn unset(&mut self, key: &str, fail: impl Fn(String) -> ScenarioError) -> Result<(), ScenarioError> {
        if !self.has(key) {
            return Ok(());
        }
        match key.rsplit_once('.') {
            None => drop(self.root.remove(key)),
            Some((parent, leaf)) => match slot(&mut self.root, parent, &fail)? {
                Value::Table(table) => drop(table.remove(leaf)),
                _ => return Err(fail("is an element of a list; give the whole list".into())),
            },
        }
        self.forget_below(key);
        self.locations.remove(key);
        Ok(())
    }

    /// Puts a value, which stands at `location`, at a key with the numbers of cameras.
    pub(super) fn put(
        &mut self,
        key: &str,
        value: Value,
        location: &KeyLocation,
        fail: impl Fn(String) -> ScenarioError,
    ) -> Result<(), ScenarioError> {
        if let Some(camera) = key.strip_prefix("cameras.").and_then(|index| index.parse().ok()) {
            return self.put_camera(camera, value, location);
        }
        if let Some(advice) = self.missing_list(key, &value) {
            return Err(fail(advice));
        }
        let parents = key.match_indices('.').map(|(end, _)| &key[..end]);
        let new_tables: Vec<&str> = parents.filter(|parent| !self.has(parent)).collect();
        *slot(&mut self.root, key, fail)? = value;
        self.forget_below(key);
        // Tables that were there keep the location of what contains them.
        for table in new_tables {
            self.locations.entry(table.into()).or_insert_with(|| location.clone());
        }
        self.locations.insert(key.into(), location.clone());
        if ["camera", CAMERAS].contains(&key) { self.resolve_cameras() } else { Ok(()) }
    }

    /// What to write instead of a key within a list of tables that is not there; `None` if no list is missing.
    fn missing_list(&self, key: &str, value: &Value) -> Option<String> {
        let known = |key: &str| {
            let steps: Vec<&str> = key.split('.').filter(|step| step.parse::<usize>().is_err()).collect();
            find_key(&steps.join("."))
        };
        let mut parents = key.match_indices('.').map(|(end, _)| &key[..end]);
        let list = parents.find(|parent| {
            !self.has(parent) && known(parent).is_some_and(|key| key.field.kind == ValueKind::Tables)
        })?;
        let below = &key[list.len() + 1..];
        let (name, own) = match below.split_once('.') {
            Some((name, own)) if known(&join(list, below)).is_none() => (name.to_owned(), own),
            _ => (format!("{}0", list.rsplit('.').next().unwrap_or(list)), below),
        };
        let own = own.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches('.');
        let needs_name = SCENARIO.required.iter().any(|(required, _)| *required == join(list, "name"));
        let name = if needs_name { format!("name = \"{name}\", ") } else { String::new() };
        Some(format!(
            "there is no [[{list}]]: add one to the file, or write the whole list, {list}=[{{ {name}{own} = {value} }}]"
        ))
    }

    /// A key of `--set` with numbers instead of the names of cameras and of other elements of lists.
    pub(super) fn numbered(&self, key: &str) -> Result<String, String> {
        let key = self.with_camera_number(key)?;
        key.split('.').try_fold(String::new(), |above, step| match get(&self.root, &above) {
            Some(Value::Array(list)) => Ok(join(&above, &number_of(list, step, &above)?)),
            _ => Ok(join(&above, step)),
        })
    }

    /// The value at a dotted key.
    pub(super) fn get(&self, key: &str) -> Option<&Value> {
        get(&self.root, key)
    }

    /// Whether there is a value at a dotted key.
    fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Removes the locations below a key whose value is replaced.
    fn forget_below(&mut self, key: &str) {
        let below = format!("{key}.");
        self.locations.retain(|key, _| !key.starts_with(&below));
    }
}

/// The number of an element of a list of tables, which may be its name.
fn number_of(list: &[Value], step: &str, key: &str) -> Result<String, String> {
    let names = || list.iter().filter_map(|element| element.get("name")?.as_str());
    let position = list.iter().position(|element| element.get("name").and_then(Value::as_str) == Some(step));
    match position {
        Some(position) => Ok(position.to_string()),
        None if step.parse::<usize>().is_ok() || names().next().is_none() => Ok(step.to_owned()),
        None => {
            let names = names().collect::<Vec<_>>().join(", ");
            Err(format!(
                "there is no `{step}` in [[{key}]], which has {names}; name one, or its number from 0"
            ))
        }
    }
}

/// The slot of the value at a dotted key. Tables on the path to it are added, and elements of lists are named by
/// their numbers.
fn slot<'t>(
    root: &'t mut Table,
    key: &str,
    fail: impl Fn(String) -> ScenarioError,
) -> Result<&'t mut Value, ScenarioError> {
    let mut steps: Vec<&str> = key.split('.').collect();
    let leaf = steps.pop().unwrap_or_default();
    let mut table = root;
    let mut steps = steps.into_iter();
    while let Some(step) = steps.next() {
        let mut next = table.entry(step).or_insert_with(|| Value::Table(Table::new()));
        if let Value::Array(array) = next {
            let (length, index) = (array.len(), steps.next());
            let number = index.unwrap_or(leaf).parse::<usize>().ok();
            next = number.and_then(|number| array.get_mut(number)).ok_or_else(|| {
                let rest = index.map_or_else(String::new, |_| format!(".{leaf}"));
                fail(format!(
                    "`{step}` is a list of {length}; name one by its number from 0, as in {step}.0{rest}"
                ))
            })?;
            if index.is_none() {
                return Ok(next);
            }
        }
        table = next
            .as_table_mut()
            .ok_or_else(|| fail(format!("`{step}` is not a table, so it has no key under it")))?;
    }
    Ok(table.entry(leaf).or_insert_with(|| Value::Boolean(false)))
}

/// The value at a dotted key, with elements of lists by their numbers.
pub(super) fn get<'t>(root: &'t Table, key: &str) -> Option<&'t Value> {
    let mut steps = key.split('.');
    let first = root.get(steps.next()?)?;
    steps.try_fold(first, |value, step| match value {
        Value::Array(list) => list.get(step.parse::<usize>().ok()?),
        value => value.get(step),
    })
}

/// Converts JSON to TOML; `None` for null, which TOML lacks.
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

/// Parses a TOML value; any other text becomes a string, so that words need no quotes.
pub(super) fn value(text: &str) -> Value {
    parsed_value(text).unwrap_or_else(|| Value::String(text.into()))
}

/// The TOML value of a text, if it is one.
fn parsed_value(text: &str) -> Option<Value> {
    let parsed = toml::from_str::<Table>(&format!("v = {text}")).ok().filter(|table| table.len() == 1);
    parsed.and_then(|mut table| table.remove("v"))
}

/// Advice for a text in quotes, or a list of these, that is no TOML because of its backslashes.
fn unparsed_backslashes(text: &str) -> Option<String> {
    let is_quoted = text.trim_start().starts_with(['"', '[']);
    backslash_advice(text).filter(|_| is_quoted && parsed_value(text).is_none())
}

/// A value as messages show it.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.replace(UNSET, "(omitted)"),
    }
}

/// The dotted key of `key` within the table `prefix`.
pub(super) fn join(prefix: &str, key: &str) -> String {
    if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") }
}

/// Records the byte offset of every key of a table.
fn locate_table(table: &DeTable<'_>, prefix: &str, record: &mut dyn FnMut(&str, usize)) {
    for (key, value) in table {
        let name = join(prefix, key.get_ref());
        record(&name, key.span().start);
        locate_value(value, &name, record);
    }
}

/// Records the byte offset of every key within a value, and of array elements.
fn locate_value(value: &Spanned<DeValue<'_>>, name: &str, record: &mut dyn FnMut(&str, usize)) {
    match value.get_ref() {
        DeValue::Table(table) => locate_table(table, name, record),
        DeValue::Array(array) => {
            for (index, element) in array.iter().enumerate() {
                let name = join(name, &index.to_string());
                record(&name, element.span().start);
                locate_value(element, &name, record);
            }
        }
        _ => {}
    }
}

/// What a file or a line that is not TOML probably is.
fn syntax_hint(path: &Path, line: &str) -> String {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    if matches!(extension.as_deref(), Some("yaml" | "yml" | "json" | "xml")) {
        let path = path.display();
        return format!(
            "; if it is another program's calibration, convert it: `camsim camera import {path} -o CAMERA.toml`, of \
             several cameras with --rig"
        );
    }
    if let Some(advice) = backslash_advice(line) {
        return format!("; {advice}");
    }
    let parts: Vec<&str> = line.split('#').next().unwrap_or_default().split(',').collect();
    let is_decimal = |pair: &[&str]| {
        pair[0].ends_with(|c: char| c.is_ascii_digit()) && pair[1].starts_with(|c: char| c.is_ascii_digit())
    };
    let in_list = line.contains('[') || line.contains('{');
    if !in_list && parts.windows(2).any(is_decimal) {
        return "; decimals have a point".into();
    }
    String::new()
}
