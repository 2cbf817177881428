//! `camera` and `[[cameras]]` of a tree: camera files, names in keys.

use toml::{Table, Value};

use super::{super::schema::CAMERAS, KeyLocation, ScenarioError, Tree};

/// Key of an entry of `[[cameras]]` that names a camera file. The entry's other keys replace those of the file.
const FILE: &str = "file";

impl Tree {
    /// Replaces camera files by their content: `camera = "file.toml"`, `cameras = "rig.toml"`, `file` of entries
    /// of `[[cameras]]`, and entries that are only the name of a file.
    pub(in super::super) fn resolve_cameras(&mut self) -> Result<(), ScenarioError> {
        if let Some(Value::String(name)) = self.root.get(CAMERAS) {
            let name = name.clone();
            self.rig_file(&name)?;
        }
        if let Some(Value::String(name)) = self.root.get("camera") {
            let name = name.clone();
            let camera = self.camera_file(&name, "camera", "camera")?;
            self.root.insert("camera".into(), Value::Table(camera));
        }
        for index in 0..self.entries().len() {
            let key = format!("{CAMERAS}.{index}");
            let (name, named_by, own) = match &self.entries()[index] {
                Value::String(name) => (name.clone(), key.clone(), Table::new()),
                Value::Table(entry) => {
                    let mut own = entry.clone();
                    let Some(Value::String(name)) = own.remove(FILE) else { continue };
                    (name, format!("{key}.{FILE}"), own)
                }
                _ => continue,
            };
            let mut camera = self.camera_file(&name, &named_by, &key)?;
            overlay(&mut camera, own);
            if let Some(Value::Array(entries)) = self.root.get_mut(CAMERAS) {
                entries[index] = Value::Table(camera);
            }
        }
        Ok(())
    }

    /// Replaces `cameras = "NAME"` by the `[[cameras]]` of that file.
    fn rig_file(&mut self, name: &str) -> Result<(), ScenarioError> {
        let path = self.resolve(CAMERAS, name);
        let mut rig = Self::read(&path, "").map_err(|error| self.named_by(CAMERAS, error))?;
        let cameras = rig.root.remove(CAMERAS).filter(|cameras| cameras.is_array());
        let (Some(cameras), None) = (cameras, rig.root.keys().next()) else {
            return Err(ScenarioError::Problems(vec![format!(
                "{}: {CAMERAS} = \"{name}\" names a file with [[cameras]] and nothing else, such as `camsim camera \
                 import --rig` writes",
                path.display()
            )]));
        };
        self.root.insert(CAMERAS.into(), cameras);
        for (key, location) in rig.locations {
            self.locations.insert(key, location);
        }
        Ok(())
    }

    /// An error of reading the file that a key names.
    fn named_by(&self, key: &str, error: ScenarioError) -> ScenarioError {
        match error {
            ScenarioError::Read { path, source } => {
                ScenarioError::ReadCamera { key: key.to_owned(), path, scenario: self.file.clone(), source }
            }
            other => other,
        }
    }

    /// The entries of `[[cameras]]`.
    pub(in super::super) fn entries(&self) -> &[Value] {
        self.root.get(CAMERAS).and_then(Value::as_array).map_or(&[], Vec::as_slice)
    }

    /// Reads the camera file that `named_by` names, for the camera at `key`. Locations of the camera's own keys
    /// stay.
    fn camera_file(&mut self, name: &str, named_by: &str, key: &str) -> Result<Table, ScenarioError> {
        let path = self.resolve(named_by, name);
        let camera = Self::read_camera(&path, key).map_err(|error| self.named_by(named_by, error))?;
        if named_by == key {
            self.locations.insert(key.into(), KeyLocation::File(path, 1));
        }
        for (key, location) in camera.locations {
            self.locations.entry(key).or_insert(location);
        }
        Ok(camera.root)
    }

    /// Refuses `camera` beside `cameras`, and a list without cameras.
    pub(in super::super) fn check_cameras(&self) -> Result<(), ScenarioError> {
        let problem = match (self.root.contains_key("camera"), self.root.get(CAMERAS)) {
            (true, Some(_)) => {
                "cannot stand beside [camera]; write [camera] for one camera, or all of them as [[cameras]]"
            }
            (_, Some(Value::Array(entries))) if entries.is_empty() => {
                "is empty; add [[cameras]], or leave it out for one [camera]"
            }
            _ => return Ok(()),
        };
        Err(ScenarioError::Problems(vec![format!("{}: {CAMERAS}: {problem}", self.location(CAMERAS))]))
    }

    /// A key of `--set` once for each camera where it has `*` for one.
    pub(super) fn of_each_camera(&self, key: &str) -> Vec<String> {
        match key.strip_prefix(CAMERAS).and_then(|rest| rest.strip_prefix(".*.")) {
            Some(rest) if !self.entries().is_empty() => {
                (0..self.entries().len()).map(|index| format!("{CAMERAS}.{index}.{rest}")).collect()
            }
            _ => vec![key.to_owned()],
        }
    }

    /// A key of `--set` with the number of a camera instead of its name.
    pub(super) fn with_camera_number(&self, key: &str) -> Result<String, String> {
        let mut steps = key.splitn(3, '.');
        let (first, camera, rest) = (steps.next(), steps.next(), steps.next());
        let has_list = self.root.contains_key(CAMERAS);
        match (first, camera) {
            (Some("camera"), _) if has_list => Err(format!(
                "the scenario has [[cameras]]: name one of them ({}), as in {CAMERAS}.{}.{}",
                self.listed_names(),
                self.names().first().map_or("NAME", |name| name),
                key.strip_prefix("camera.").unwrap_or("fps")
            )),
            (Some(CAMERAS), Some(_)) if !has_list => {
                Err(format!("the scenario has one camera, [camera]: write camera.{}", rest.unwrap_or("fps")))
            }
            (Some(CAMERAS), Some(camera)) if rest == Some(FILE) => {
                Err(format!("a camera file replaces a camera: write {CAMERAS}.{camera}=FILE.toml"))
            }
            (Some(CAMERAS), Some(camera)) => {
                let by_number = || camera.parse().ok().filter(|index: &usize| *index < self.entries().len());
                let index = self.names().iter().position(|name| *name == camera).or_else(by_number);
                let index = index.ok_or_else(|| {
                    format!("there is no camera `{camera}`; the cameras are {}", self.listed_names())
                })?;
                Ok(rest
                    .map_or_else(|| format!("{CAMERAS}.{index}"), |rest| format!("{CAMERAS}.{index}.{rest}")))
            }
            _ => Ok(key.to_owned()),
        }
    }

    /// Names of the cameras, empty for entries without one.
    pub(in super::super) fn names(&self) -> Vec<&str> {
        self.entries()
            .iter()
            .map(|entry| entry.get("name").and_then(Value::as_str).unwrap_or_default())
            .collect()
    }

    fn listed_names(&self) -> String {
        self.names().join(", ")
    }

    /// Another camera, or camera file, instead of one, with its name unless it has its own.
    pub(super) fn put_camera(
        &mut self,
        index: usize,
        new: Value,
        location: &KeyLocation,
    ) -> Result<(), ScenarioError> {
        let key = format!("{CAMERAS}.{index}");
        self.forget_below(&key);
        self.locations.insert(key, location.clone());
        let Some(Value::Array(entries)) = self.root.get_mut(CAMERAS) else { return Ok(()) };
        let Some(entry) = entries.get_mut(index) else { return Ok(()) };
        let name = entry.get("name").cloned();
        *entry = new;
        self.resolve_cameras()?;
        if let (Some(Value::Array(entries)), Some(name)) = (self.root.get_mut(CAMERAS), name)
            && let Some(Value::Table(entry)) = entries.get_mut(index)
        {
            entry.entry("name").or_insert(name);
        }
        Ok(())
    }
}

/// Puts the keys of one table over those of another.
fn overlay(below: &mut Table, above: Table) {
    for (key, value) in above {
        match (below.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => overlay(below, above),
            (_, value) => {
                below.insert(key, value);
            }
        }
    }
}
