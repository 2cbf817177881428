//! The open scenario: its values, changes, undo and redo.
//!
//! Values are edited in a TOML tree, which needs no code per key. After each edit the tree is validated as a
//! file would be; while it is not legal, the last legal scenario is rendered.

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::scenario::{CameraSpec, Problem, Rig, Scenario};
use camsim_io::{
    scenario_file::{CAMERAS, ValueKind, kinds, read_random_scenario, rig_of_table, rig_table},
    shell::quoted,
    write::write_atomic,
};
use toml::{Table, Value};

mod changes;

use camsim_core::validate::checked_rig;
use changes::{collect_changes, collect_removed};

/// Undo steps, at most.
const MAX_UNDO_STEPS: usize = 500;

/// A scenario being edited.
#[derive(Clone, Debug)]
pub struct Document {
    /// The file that the scenario was read from or last saved to.
    pub path: PathBuf,
    /// The last legal scenario of the shown camera, with resolved paths.
    pub scenario: Arc<Scenario>,
    /// Why the edited values are not a legal scenario; empty if they are.
    pub problems: Vec<Problem>,
    /// Incremented when files are to be read again.
    pub reload_count: u64,
    /// Whether the file has `[randomize]`, which is not edited here.
    is_random: bool,
    /// The last legal scenario with all cameras.
    rig: Rig,
    /// Number of the shown camera. Keys of `camera` are its own.
    camera: usize,
    /// The edited values.
    tree: Table,
    /// Values when the file was opened.
    opened: Table,
    /// Values in the file.
    saved: Table,
    /// Trees before each undo step, the latest last.
    undo_stack: Vec<Table>,
    /// Trees to redo, the next last.
    redo_stack: Vec<Table>,
    /// The key being dragged: its edits are one undo step.
    dragged_key: Option<String>,
}

impl Document {
    /// Reads a scenario file.
    ///
    /// # Errors
    /// Message with file, line and remedy.
    pub fn open(path: &Path) -> Result<Self, String> {
        let scenario = read_random_scenario(path, &[], None).map_err(|error| error.to_string())?;
        let (is_random, rig) = (scenario.is_random(), scenario.into_base());
        let tree = tree_of(&rig).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self {
            path: path.into(),
            scenario: Arc::new(rig.first().clone()),
            rig,
            camera: 0,
            problems: Vec::new(),
            reload_count: 0,
            is_random,
            opened: tree.clone(),
            saved: tree.clone(),
            tree,
            undo_stack: Vec::new(),
            redo_stack: Vec::new(),
            dragged_key: None,
        })
    }

    /// The value of a dotted key, with elements of lists by index; `None` if the key is absent.
    pub fn value(&self, key: &str) -> Option<&Value> {
        get_key(&self.tree, &self.full_key(key))
    }

    /// The key in the tree: in that of a rig, keys of `camera` are those of the shown camera.
    fn full_key<'k>(&self, key: &'k str) -> Cow<'k, str> {
        let below = key.strip_prefix("camera").filter(|rest| rest.is_empty() || rest.starts_with('.'));
        match below.filter(|_| self.rig.is_list()) {
            Some(rest) => format!("{CAMERAS}.{}{rest}", self.camera).into(),
            None => key.into(),
        }
    }

    /// The last legal scenario with all cameras.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Number of the shown camera.
    pub fn camera(&self) -> usize {
        self.camera
    }

    /// Shows another camera; a number beyond the last has no effect.
    pub fn show_camera(&mut self, camera: usize) {
        if let Some(scenario) = self.rig.scenarios().get(camera) {
            (self.camera, self.scenario) = (camera, Arc::new(scenario.clone()));
            self.end_gesture();
        }
    }

    /// The value of a key when the file was opened.
    pub fn opened_value(&self, key: &str) -> Option<&Value> {
        get_key(&self.opened, &self.full_key(key))
    }

    /// Whether a key has changed since the file was opened.
    pub fn is_changed(&self, key: &str) -> bool {
        self.value(key) != self.opened_value(key)
    }

    /// Whether there are unsaved changes.
    pub fn is_unsaved(&self) -> bool {
        self.tree != self.saved
    }

    /// The problem of a key, or of a key below it.
    pub fn problem(&self, key: &str) -> Option<&Problem> {
        let key = self.full_key(key);
        self.problems.iter().find(|problem| {
            problem.key.strip_prefix(&*key).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    }

    /// A path relative to the folder of the scenario's file, if it lies in it.
    pub fn relative_path(&self, path: &str) -> String {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let name = folder.and_then(|folder| Path::new(path).strip_prefix(folder).ok());
        name.map_or_else(|| path.to_owned(), |name| name.display().to_string())
    }

    /// A path relative to the folder of the scenario's file, resolved.
    pub fn resolved_path(&self, path: &str) -> String {
        self.path.parent().map_or_else(|| path.to_owned(), |folder| folder.join(path).display().to_string())
    }

    /// Sets a key, or removes it. Edits of one key with `is_dragged` are one undo step.
    pub fn set(&mut self, key: &str, value: Option<Value>, is_dragged: bool) {
        let key = self.full_key(key).into_owned();
        let mut tree = self.tree.clone();
        set_key(&mut tree, &key, value);
        let continues_drag = self.dragged_key.as_ref() == Some(&key);
        self.dragged_key = is_dragged.then_some(key);
        self.replace_tree(tree, !continues_drag);
    }

    /// Ends a drag.
    pub fn end_gesture(&mut self) {
        self.dragged_key = None;
    }

    /// Resets a key to its value when the file was opened.
    pub fn reset(&mut self, key: &str) {
        let value = self.opened_value(key).cloned();
        self.set(key, value, false);
    }

    /// Replaces the camera but for mount, frame rate and clock, which calibrations do not have, and for the name
    /// in a rig.
    ///
    /// # Errors
    /// Values that TOML cannot store.
    pub fn set_camera(&mut self, camera: &CameraSpec) -> Result<(), String> {
        let current = &self.scenario.camera;
        let camera = CameraSpec {
            mount: current.mount.clone(),
            fps: current.fps,
            phase: current.phase,
            clock_offset_ms: current.clock_offset_ms,
            name: if self.rig.is_list() { &current.name } else { &camera.name }.clone(),
            ..camera.clone()
        };
        let value = Value::try_from(camera).map_err(|error| error.to_string())?;
        self.set("camera", Some(value), false);
        Ok(())
    }

    /// Undoes one step; returns whether there was one.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.undo_stack.pop() else { return false };
        self.redo_stack.push(std::mem::replace(&mut self.tree, before));
        self.dragged_key = None;
        self.validate_tree();
        true
    }

    /// Redoes one step; returns whether there was one.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.redo_stack.pop() else { return false };
        self.undo_stack.push(std::mem::replace(&mut self.tree, after));
        self.dragged_key = None;
        self.validate_tree();
        true
    }

    /// Whether there is a step to undo, and one to redo.
    pub fn can_undo_redo(&self) -> [bool; 2] {
        [!self.undo_stack.is_empty(), !self.redo_stack.is_empty()]
    }

    /// The scenario as TOML, with paths in `folder` relative to it and other paths absolute.
    ///
    /// # Errors
    /// Values that TOML cannot store.
    pub fn to_toml(&self, folder: Option<&Path>) -> Result<String, String> {
        let mut tree = self.tree.clone();
        for key in path_keys(&tree) {
            let Some(Value::String(path)) = get_key(&tree, &key) else { continue };
            let relative = folder
                .and_then(|folder| Path::new(path).strip_prefix(folder).ok())
                .map(|path| path.display().to_string());
            let text = relative.unwrap_or_else(|| {
                std::path::absolute(path).map_or_else(|_| path.clone(), |path| path.display().to_string())
            });
            set_key(&mut tree, &key, Some(Value::String(text)));
        }
        toml::to_string(&tree).map_err(|error| error.to_string())
    }

    /// Saves the scenario to `path`, which becomes the document's file.
    ///
    /// # Errors
    /// Values that are not legal; a file that cannot be written.
    pub fn save(&mut self, path: &Path) -> Result<(), String> {
        if let Some(problem) = self.problems.first() {
            return Err(format!("not saved: {problem}"));
        }
        if self.is_random && path == self.path {
            return Err(format!(
                "not saved: {} has [randomize], which would be lost; save under another name, or edit it as text",
                path.display()
            ));
        }
        let text = self.to_toml(path.parent())?;
        write_atomic(path, text.as_bytes()).map_err(|error| error.to_string())?;
        self.path = path.into();
        self.is_random = false;
        self.saved = self.tree.clone();
        Ok(())
    }

    /// Keys of the file that were removed, which [`Document::command_line`] cannot express.
    pub fn removed_keys(&self) -> Vec<String> {
        let mut removed = Vec::new();
        collect_removed(&self.saved, &self.tree, "", &mut removed);
        removed
    }

    /// The `camsim render` command that renders the document: its file with each change as `--set`.
    pub fn command_line(&self) -> String {
        self.render_command(Path::new("frames"), None)
    }

    /// The `camsim render` command for an output folder and frames, given as the first and the one after the
    /// last.
    pub fn render_command(&self, folder: &Path, frames: Option<[u64; 2]>) -> String {
        let mut words = vec!["camsim".to_owned(), "render".to_owned(), quoted(&self.path)];
        for (key, value) in self.changes() {
            words.push("--set".to_owned());
            words.push(quoted(format!("{key}={value}")));
        }
        if let Some([first, end]) = frames {
            if self.rig.is_list() {
                words.extend(["--camera".to_owned(), self.scenario.camera.name.clone()]);
            }
            words.extend(["--frames".to_owned(), format!("{first}..{end}")]);
        }
        words.extend(["-o".to_owned(), quoted(folder)]);
        words.join(" ")
    }

    /// Keys that differ from the saved file, with their values; without removed keys.
    fn changes(&self) -> Vec<(String, Value)> {
        let mut changes = Vec::new();
        collect_changes(&self.tree, &self.saved, "", &mut changes);
        changes
    }

    fn replace_tree(&mut self, tree: Table, is_undo_step: bool) {
        if tree == self.tree {
            return;
        }
        let before = std::mem::replace(&mut self.tree, tree);
        if is_undo_step {
            self.undo_stack.push(before);
            if self.undo_stack.len() > MAX_UNDO_STEPS {
                self.undo_stack.remove(0);
            }
        }
        self.redo_stack.clear();
        self.validate_tree();
    }

    /// Validates the tree, and takes it as the scenario if it is legal.
    fn validate_tree(&mut self) {
        let of_key = |error: toml::de::Error| {
            vec![Problem { key: String::new(), message: error.message().to_owned() }]
        };
        match rig_of_table(self.tree.clone()).map_err(of_key).and_then(checked_rig) {
            Ok(rig) => {
                self.problems.clear();
                self.rig = rig;
                self.camera = self.camera.min(self.rig.scenarios().len() - 1);
                self.scenario = Arc::new(self.rig.scenarios()[self.camera].clone());
            }
            Err(problems) => self.problems = problems,
        }
    }
}

fn tree_of(rig: &Rig) -> Result<Table, String> {
    rig_table(rig).map_err(|error| format!("{error}; TOML integers are below 2^63"))
}

/// Keys of all paths in a tree, with elements of lists by index.
fn path_keys(tree: &Table) -> Vec<String> {
    let split_list_key = |key: &str| {
        let lists = kinds().filter(|&(_, kind)| kind == ValueKind::Tables).map(|(list, _)| list);
        lists
            .filter_map(|list| Some((list, key.strip_prefix(list)?.strip_prefix('.')?)))
            .map(|(list, leaf)| (list.to_owned(), leaf.to_owned()))
            .next()
    };
    let paths = kinds().filter(|&(_, kind)| kind == ValueKind::Path);
    let cameras = tree.get(CAMERAS).and_then(Value::as_array).map_or(0, Vec::len);
    let expanded = paths.flat_map(|(key, _)| match split_list_key(key) {
        None => match key.strip_prefix("camera.").filter(|_| cameras > 0) {
            Some(rest) => (0..cameras).map(|index| format!("{CAMERAS}.{index}.{rest}")).collect(),
            None => vec![key.to_owned()],
        },
        Some((list, leaf)) => {
            let count = get_key(tree, &list).and_then(Value::as_array).map_or(0, Vec::len);
            (0..count).map(|index| format!("{list}.{index}.{leaf}")).collect()
        }
    });
    let mixed = kinds().filter(|(_, kind)| matches!(kind, ValueKind::WordsOrTables(_) | ValueKind::Paths));
    let tables = mixed.flat_map(|(key, kind)| match get_key(tree, key) {
        Some(Value::String(text)) if kind.is_path(text) => vec![key.to_owned()],
        Some(Value::Array(list)) => {
            let is_path = |element: &Value| element.as_str().is_some_and(|text| kind.is_path(text));
            let paths = list.iter().enumerate().filter(|(_, element)| is_path(element));
            paths.map(|(index, _)| format!("{key}.{index}")).collect()
        }
        _ => Vec::new(),
    });
    expanded.chain(tables).collect()
}

/// The value of a dotted key.
fn get_key<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
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

/// Sets or removes a dotted key. Missing tables are made, and empty ones removed; an index beyond the end of
/// a list has no effect.
fn set_key(table: &mut Table, key: &str, value: Option<Value>) {
    match key.split_once('.') {
        None => {
            match value {
                Some(value) => table.insert(key.into(), value),
                None => table.remove(key),
            };
        }
        Some((first, rest)) => match table.entry(first).or_insert_with(|| Value::Table(Table::new())) {
            Value::Table(inner) => {
                set_key(inner, rest, value);
                if inner.is_empty() {
                    table.remove(first);
                }
            }
            Value::Array(array) => set_in_array(array, rest, value),
            _ => {}
        },
    }
}

fn set_in_array(array: &mut Vec<Value>, key: &str, value: Option<Value>) {
    let (index, rest) = key.split_once('.').map_or((key, None), |(index, rest)| (index, Some(rest)));
    let Some(index) = index.parse::<usize>().ok().filter(|index| *index < array.len()) else { return };
    match (rest, value) {
        (Some(rest), value) => {
            if let Value::Table(inner) = &mut array[index] {
                set_key(inner, rest, value);
            }
        }
        (None, Some(value)) => array[index] = value,
        (None, None) => {
            array.remove(index);
        }
    }
}

#[cfg(test)]
mod tests;
