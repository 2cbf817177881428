//! All keys of the scenario, grouped by the tables of its file.

mod editors;
mod lists;
mod presets;

use std::sync::LazyLock;

use camsim_core::scenario::keys::Key;
use camsim_io::scenario_file::{ValueKind, keys};
use eframe::egui::{self, RichText, Role, Ui};

use super::{
    tooltips::{TooltipPlacement, WithTooltip},
    widgets::{named, small_button},
};
use crate::{
    document::Document,
    message::{Message, Outbox},
    state::State,
};

/// Draws the pane.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(document) = &state.document else {
        ui.label("nothing open");
        return;
    };
    TooltipPlacement::Right(ui.max_rect().x_range()).set(ui.ctx());
    presets::show(ui, out);
    let sought = search(ui);
    egui::ScrollArea::vertical().id_salt("parameters").auto_shrink(false).show(ui, |ui| {
        let found = groups().iter().filter_map(|group| group.with(&sought)).map(|group| {
            section(ui, state, document, &group, !sought.is_empty(), out);
        });
        if found.count() == 0 {
            ui.label(format!("no key has \"{sought}\" in its name or description"));
        }
    });
}

/// Draws the field that keys are sought by; returns its text in lower case.
fn search(ui: &mut Ui) -> String {
    let id = egui::Id::unique("sought key");
    let mut text = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 30.0).max(60.0);
        let field = egui::TextEdit::singleline(&mut text).desired_width(width).hint_text("search keys");
        let field = ui.add(field).with_tooltip("keys whose name or description has this text");
        named(&field, Role::TextInput, "search keys");
        if !text.is_empty() && small_button(ui, "x", "clear the search", "all keys") {
            text.clear();
        }
    });
    ui.data_mut(|data| data.insert_temp(id, text.clone()));
    text.trim().to_lowercase()
}

/// Keys of each table in the order of the format, without those of list elements.
fn groups() -> &'static [Group] {
    static GROUPS: LazyLock<Vec<Group>> = LazyLock::new(|| {
        let mut groups: Vec<Group> = Vec::new();
        for key in keys().iter().filter(|key| !is_element(&key.name)) {
            // Lists of sensors have no table above them.
            let name = match key.name.rsplit_once('.') {
                Some((group, _)) => group,
                None if key.field.kind == ValueKind::Tables => &key.name,
                None => "",
            };
            match groups.iter_mut().find(|group| group.name == name) {
                Some(group) => group.keys.push(key),
                None => groups.push(Group { name, keys: vec![key] }),
            }
        }
        groups
    });
    &GROUPS
}

/// Titles of the sections in order.
#[cfg(test)]
pub fn section_names() -> Vec<&'static str> {
    groups().iter().map(Group::title).collect()
}

/// Whether a key belongs to elements of a list of tables.
fn is_element(key: &str) -> bool {
    keys().iter().any(|list| list.field.kind == ValueKind::Tables && is_below(key, &list.name))
}

fn is_below(key: &str, table: &str) -> bool {
    key.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'))
}

/// A table of the format with its keys.
struct Group {
    name: &'static str,
    keys: Vec<&'static Key>,
}

impl Group {
    /// The group with the keys that have a text in their name or description, or in those of their elements;
    /// `None` without any.
    fn with(&self, sought: &str) -> Option<Self> {
        let has = |key: &Key| {
            key.name.to_lowercase().contains(sought) || key.field.about.to_lowercase().contains(sought)
        };
        let is_found = |key: &&&'static Key| {
            let elements = || keys().iter().filter(|element| is_below(&element.name, &key.name));
            has(key) || key.field.kind == ValueKind::Tables && elements().any(has)
        };
        let keys: Vec<_> = self.keys.iter().filter(is_found).copied().collect();
        (!keys.is_empty()).then_some(Self { name: self.name, keys })
    }

    fn title(&self) -> &'static str {
        if self.name.is_empty() { "general" } else { self.name }
    }
}

/// Draws the section of a table; while keys are sought it is open.
fn section(
    ui: &mut Ui,
    state: &State,
    document: &Document,
    group: &Group,
    is_sought: bool,
    out: &mut Outbox,
) {
    let changed = group.keys.iter().any(|key| document.is_changed(&key.name));
    let wrong = group.keys.iter().any(|key| document.problem(&key.name).is_some());
    let mut title = RichText::new(group.title()).strong();
    if wrong {
        title = title.color(ui.visuals().error_fg_color);
    } else if changed {
        title = title.color(ui.visuals().hyperlink_color);
    }
    let open = matches!(group.name, "camera.lens" | "camera.shutter" | "camera.photometric");
    let header =
        egui::CollapsingHeader::new(title).id_salt((group.name, is_sought)).default_open(open || is_sought);
    header.show(ui, |ui| {
        for key in &group.keys {
            show_key(ui, state, document, key, out);
        }
    });
}

/// Draws the keys of a table on another page.
pub fn rows(ui: &mut Ui, state: &State, name: &str, out: &mut Outbox) {
    let Some(document) = &state.document else { return };
    for key in groups().iter().filter(|group| group.name == name).flat_map(|group| &group.keys) {
        show_key(ui, state, document, key, out);
    }
}

fn show_key(ui: &mut Ui, state: &State, document: &Document, key: &'static Key, out: &mut Outbox) {
    match key.field.kind {
        ValueKind::Tables => lists::show(ui, state, document, &key.name, out),
        _ => row(ui, state, document, &key.name, key, out),
    }
}

/// Draws a key with its editor and unit, and a reset button if it was changed. The facts of an element of a list
/// are those of its key without index.
fn row(ui: &mut Ui, state: &State, document: &Document, key: &str, facts: &Key, out: &mut Outbox) {
    let leaf = key.rsplit('.').next().unwrap_or(key);
    let changed = document.is_changed(key);
    let problem = document.problem(key);
    let mut text = RichText::new(leaf);
    if problem.is_some() {
        text = text.color(ui.visuals().error_fg_color);
    } else if changed {
        text = text.color(ui.visuals().hyperlink_color).strong();
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(text).with_tooltip(format!("{key}: {}", facts.field.about));
        editors::show(ui, document, key, facts, out);
        if !facts.unit.is_empty() {
            ui.weak(&*facts.unit);
        }
        if changed {
            let name = format!("reset {key}");
            let tip = format!("{name} to {}", opened_text(document, key));
            if small_button(ui, "reset", &name, &tip) {
                out.push(Message::Reset(key.to_owned()));
            }
        }
    });
    if let Some(problem) = problem {
        ui.label(RichText::new(&problem.message).color(ui.visuals().error_fg_color).small());
    }
    if let Some(rejected) = state.rejected_input.as_ref().filter(|rejected| rejected.key() == key) {
        ui.label(RichText::new(&rejected.text).color(ui.visuals().warn_fg_color).small());
    }
}

/// Text of the value when the file was opened.
fn opened_text(document: &Document, key: &str) -> String {
    document.opened_value(key).map_or_else(|| "nothing".to_owned(), ToString::to_string)
}
