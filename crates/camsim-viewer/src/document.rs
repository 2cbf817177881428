//! The scenario that is open: its values, what was changed, and the way back.
//!
//! Values are edited in a TOML tree, which every key of the format fits without code of its own. Whatever the
//! tree says is checked as a file would be; as long as it is not legal, the last legal scenario stays the one
//! that is rendered.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::scenario::{CameraSpec, Problem, Scenario, validate};
use camsim_io::{
    scenario_file::{ValueKind, keys, read_scenario},
    write::write_atomic,
};
use toml::{Table, Value};

/// Steps that can be undone.
const MOST_STEPS: usize = 500;

/// A scenario being edited.
#[derive(Clone, Debug)]
pub struct Document {
    /// The file that it was read from or saved to last.
    pub path: PathBuf,
    /// The last legal scenario, its paths resolved.
    pub scenario: Arc<Scenario>,
    /// What keeps the tree from being one.
    pub problems: Vec<Problem>,
    /// Counts up when files are to be read again.
    pub reading: u64,
    tree: Table,
    opened: Table,
    saved: Table,
    undone: Vec<Table>,
    done: Vec<Table>,
    /// The key whose value a hand is dragging: its steps count as one.
    gesture: Option<String>,
}

impl Document {
    /// Reads a scenario file.
    ///
    /// # Errors
    /// Text for people, with file, line and fix.
    pub fn open(path: &Path) -> Result<Self, String> {
        let scenario = read_scenario(path, &[], None).map_err(|error| error.to_string())?;
        let tree = tree_of(&scenario).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self {
            path: path.into(),
            scenario: Arc::new(scenario),
            problems: Vec::new(),
            reading: 0,
            opened: tree.clone(),
            saved: tree.clone(),
            tree,
            undone: Vec::new(),
            done: Vec::new(),
            gesture: None,
        })
    }

    /// The value of a dotted key, elements of lists by number; `None` where it is left out.
    pub fn value(&self, key: &str) -> Option<&Value> {
        find(&self.tree, key)
    }

    /// The value that it had when the file was opened.
    pub fn opened(&self, key: &str) -> Option<&Value> {
        find(&self.opened, key)
    }

    /// Whether a key has another value than when the file was opened.
    pub fn is_changed(&self, key: &str) -> bool {
        self.value(key) != self.opened(key)
    }

    /// Whether there is something to save.
    pub fn is_unsaved(&self) -> bool {
        self.tree != self.saved
    }

    /// What is wrong with a key or with something under it.
    pub fn problem(&self, key: &str) -> Option<&Problem> {
        self.problems.iter().find(|problem| {
            problem.key.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    }

    /// A path as the scenario's file has it: without the folder that it is in, if it is in it.
    pub fn beside(&self, path: &str) -> String {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let name = folder.and_then(|folder| Path::new(path).strip_prefix(folder).ok());
        name.map_or_else(|| path.to_owned(), |name| name.display().to_string())
    }

    /// What such a path means: from the folder of the scenario's file.
    pub fn resolved(&self, path: &str) -> String {
        self.path.parent().map_or_else(|| path.to_owned(), |folder| folder.join(path).display().to_string())
    }

    /// Gives a key a value, or takes it away. While `ongoing` (a hand drags it), all values of the same key
    /// are one step.
    pub fn set(&mut self, key: &str, value: Option<Value>, ongoing: bool) {
        let mut tree = self.tree.clone();
        place(&mut tree, key, value);
        let is_one_step = self.gesture.as_deref() == Some(key);
        self.gesture = ongoing.then(|| key.to_owned());
        self.go_to(tree, !is_one_step);
    }

    /// The hand has let go.
    pub fn end_gesture(&mut self) {
        self.gesture = None;
    }

    /// Back to the value at opening.
    pub fn reset(&mut self, key: &str) {
        let value = self.opened(key).cloned();
        self.set(key, value, false);
    }

    /// Puts another camera in place; mount, frame rate and phase stay, since a calibration knows nothing of
    /// them.
    ///
    /// # Errors
    /// Text for people.
    pub fn set_camera(&mut self, camera: &CameraSpec) -> Result<(), String> {
        let kept = &self.scenario.camera;
        let camera =
            CameraSpec { mount: kept.mount.clone(), fps: kept.fps, phase: kept.phase, ..camera.clone() };
        let value = Value::try_from(camera).map_err(|error| error.to_string())?;
        self.set("camera", Some(value), false);
        Ok(())
    }

    /// One step back; whether there was one.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.done.pop() else { return false };
        self.undone.push(std::mem::replace(&mut self.tree, before));
        self.gesture = None;
        self.check();
        true
    }

    /// One step on again; whether there was one.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.undone.pop() else { return false };
        self.done.push(std::mem::replace(&mut self.tree, after));
        self.gesture = None;
        self.check();
        true
    }

    /// Whether there is a step to undo, and one to redo.
    pub fn steps(&self) -> [bool; 2] {
        [!self.done.is_empty(), !self.undone.is_empty()]
    }

    /// The scenario as TOML, with paths relative to `folder` where they are in it.
    ///
    /// # Errors
    /// Text for people.
    pub fn to_toml(&self, folder: Option<&Path>) -> Result<String, String> {
        let mut tree = self.tree.clone();
        for key in path_keys(&tree) {
            let Some(Value::String(path)) = find(&tree, &key) else { continue };
            let relative = folder
                .and_then(|folder| Path::new(path).strip_prefix(folder).ok())
                .map(|path| path.display().to_string());
            // What is elsewhere must be found from anywhere.
            let text = relative.unwrap_or_else(|| {
                std::path::absolute(path).map_or_else(|_| path.clone(), |path| path.display().to_string())
            });
            place(&mut tree, &key, Some(Value::String(text)));
        }
        toml::to_string(&tree).map_err(|error| error.to_string())
    }

    /// Writes the scenario; it is then the document's file.
    ///
    /// # Errors
    /// Text for people: values that are not legal, a file that cannot be written.
    pub fn save(&mut self, path: &Path) -> Result<(), String> {
        if let Some(problem) = self.problems.first() {
            return Err(format!("not saved: {problem}"));
        }
        let text = self.to_toml(path.parent())?;
        write_atomic(path, text.as_bytes()).map_err(|error| error.to_string())?;
        self.path = path.into();
        self.saved = self.tree.clone();
        Ok(())
    }

    /// Keys of the file that were taken away: what [`Document::command_line`] cannot say.
    pub fn left_out(&self) -> Vec<String> {
        let mut only_before = Vec::new();
        missing(&self.saved, &self.tree, "", &mut only_before);
        only_before
    }

    /// The `camsim render` that renders the document: its file with every change as `--set`.
    pub fn command_line(&self) -> String {
        self.render_command(Path::new("frames"), None)
    }

    /// The same for a folder and for the frames from the first to before the last.
    pub fn render_command(&self, folder: &Path, frames: Option<[u64; 2]>) -> String {
        let mut words =
            vec!["camsim".to_owned(), "render".to_owned(), quoted(&self.path.display().to_string())];
        for (key, value) in self.changes() {
            words.push("--set".to_owned());
            words.push(quoted(&format!("{key}={value}")));
        }
        if let Some([first, end]) = frames {
            words.extend(["--frames".to_owned(), format!("{first}..{end}")]);
        }
        words.extend(["-o".to_owned(), quoted(&folder.display().to_string())]);
        words.join(" ")
    }

    /// Keys that differ from the file as it stands on the disk, with their values. A key that was taken away
    /// cannot be said on a command line.
    fn changes(&self) -> Vec<(String, Value)> {
        let mut changes = Vec::new();
        differences(&self.tree, &self.saved, "", &mut changes);
        changes
    }

    fn go_to(&mut self, tree: Table, is_step: bool) {
        if tree == self.tree {
            return;
        }
        let before = std::mem::replace(&mut self.tree, tree);
        if is_step {
            self.done.push(before);
            if self.done.len() > MOST_STEPS {
                self.done.remove(0);
            }
        }
        self.undone.clear();
        self.check();
    }

    /// From tree to scenario, if it is one.
    fn check(&mut self) {
        let read = Value::Table(self.tree.clone()).try_into::<Scenario>();
        self.problems = match &read {
            Ok(scenario) => validate(scenario),
            Err(error) => vec![Problem { key: String::new(), message: error.message().to_owned() }],
        };
        if let (Ok(scenario), true) = (read, self.problems.is_empty()) {
            self.scenario = Arc::new(scenario);
        }
    }
}

fn tree_of(scenario: &Scenario) -> Result<Table, String> {
    Table::try_from(scenario).map_err(|error| format!("{error}; whole numbers in TOML end at 2^63"))
}

/// Keys of all paths, those in the tables of lists by number.
fn path_keys(tree: &Table) -> Vec<String> {
    let of_list = |key: &str| {
        let lists = keys().iter().filter(|(_, kind)| *kind == ValueKind::Tables).map(|(list, _)| *list);
        lists
            .filter_map(|list| Some((list, key.strip_prefix(list)?.strip_prefix('.')?)))
            .map(|(list, leaf)| (list.to_owned(), leaf.to_owned()))
            .next()
    };
    let paths = keys().iter().filter(|(_, kind)| *kind == ValueKind::Path);
    let expanded = paths.flat_map(|(key, _)| match of_list(key) {
        None => vec![(*key).to_owned()],
        Some((list, leaf)) => {
            let count = find(tree, &list).and_then(Value::as_array).map_or(0, Vec::len);
            (0..count).map(|at| format!("{list}.{at}.{leaf}")).collect()
        }
    });
    expanded.collect()
}

fn find<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut steps = key.split('.');
    let mut value = table.get(steps.next()?)?;
    for step in steps {
        value = match value {
            Value::Table(table) => table.get(step)?,
            Value::Array(array) => array.get(step.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(value)
}

/// Tables on the way are made, and go when nothing is left in them; an index beyond the end of a list does
/// nothing.
fn place(table: &mut Table, key: &str, value: Option<Value>) {
    match key.split_once('.') {
        None => {
            match value {
                Some(value) => table.insert(key.into(), value),
                None => table.remove(key),
            };
        }
        Some((first, rest)) => match table.entry(first).or_insert_with(|| Value::Table(Table::new())) {
            Value::Table(inner) => {
                place(inner, rest, value);
                if inner.is_empty() {
                    table.remove(first);
                }
            }
            Value::Array(array) => place_in_array(array, rest, value),
            _ => {}
        },
    }
}

fn place_in_array(array: &mut Vec<Value>, key: &str, value: Option<Value>) {
    let (index, rest) = key.split_once('.').map_or((key, None), |(index, rest)| (index, Some(rest)));
    let Some(index) = index.parse::<usize>().ok().filter(|index| *index < array.len()) else { return };
    match (rest, value) {
        (Some(rest), value) => {
            if let Value::Table(inner) = &mut array[index] {
                place(inner, rest, value);
            }
        }
        (None, Some(value)) => array[index] = value,
        (None, None) => {
            array.remove(index);
        }
    }
}

fn differences(now: &Table, before: &Table, prefix: &str, into: &mut Vec<(String, Value)>) {
    for (name, value) in now {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        match (value, before.get(name)) {
            (Value::Table(now), Some(Value::Table(before))) => differences(now, before, &key, into),
            (value, before) if before != Some(value) => into.push((key, value.clone())),
            _ => {}
        }
    }
}

/// Keys of `before` that `now` has not.
fn missing(before: &Table, now: &Table, prefix: &str, into: &mut Vec<String>) {
    for (name, value) in before {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        match (value, now.get(name)) {
            (Value::Table(before), Some(Value::Table(now))) => missing(before, now, &key, into),
            (_, None) => into.push(key),
            _ => {}
        }
    }
}

/// As a POSIX shell takes it for one word.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests;
