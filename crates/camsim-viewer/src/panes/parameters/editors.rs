//! Editors of values, by kind.

use camsim_core::{lens::ModelFacts, scenario::keys::Key};
use camsim_io::scenario_file::ValueKind;
use eframe::egui::{self, Response, Role, Ui};
use toml::Value;

use super::super::{
    number_field::{NumberField, drag_value},
    tooltips::WithTooltip,
    widgets::{button, named, small_button},
};
use crate::{
    document::Document,
    message::{Message, Outbox},
};

/// Keys of twins, all of which but the name may be omitted.
const TWINS: &str = "output.twin.";

/// Whether a key is one of a sensor beside the camera, all of which but the name may be omitted.
fn is_of_sensor(key: &str) -> bool {
    ["imu.", "gnss.", "barometer.", "magnetometer.", "camera.sensor.", "camera.point_spread."]
        .iter()
        .any(|table| key.starts_with(table))
}

/// The edit that a pass over an editor made.
struct Edit {
    /// The new value; `None` removes the key.
    value: Option<Value>,
    /// Whether a drag is in progress.
    is_dragged: bool,
}

/// An edit without drag.
fn single_edit(value: Value) -> Option<Edit> {
    Some(Edit { value: Some(value), is_dragged: false })
}

const REMOVED: Option<Edit> = Some(Edit { value: None, is_dragged: false });

/// Draws the editor of a key.
pub fn show(ui: &mut Ui, document: &Document, key: &str, facts: &Key, out: &mut Outbox) {
    let whole = matches!(
        facts.field.kind,
        ValueKind::Whole | ValueKind::Within(..) | ValueKind::CountOr(..) | ValueKind::Counts(..)
    );
    let value = document.value(key);
    let edit = Editor { ui, document, key, value, facts, whole, out }.show();
    if let Some(Edit { value, is_dragged }) = edit {
        out.push(Message::Set(key.to_owned(), value, is_dragged));
    }
}

/// The editor of a key.
struct Editor<'a> {
    ui: &'a mut Ui,
    document: &'a Document,
    key: &'a str,
    value: Option<&'a Value>,
    facts: &'a Key,
    /// Whether its numbers are integers.
    whole: bool,
    out: &'a mut Outbox,
}

impl Editor<'_> {
    fn show(&mut self) -> Option<Edit> {
        let kind = self.facts.field.kind;
        match kind {
            ValueKind::Number | ValueKind::Whole | ValueKind::Within(..) => self.number(),
            ValueKind::NumberOr(words) | ValueKind::CountOr(_, words) => self.number_or(words),
            ValueKind::Numbers(count) | ValueKind::Counts(count, _) => self.optional_numbers(count),
            ValueKind::NumbersOr(count, word) => self.numbers_or(count, word),
            ValueKind::NumberList => self.number_list(),
            ValueKind::Paths if self.value.is_some_and(Value::is_array) => self.as_written(),
            ValueKind::Path | ValueKind::Paths => self.path(),
            ValueKind::Flag => self.flag(),
            ValueKind::Word(words) => self.word(words).or_else(|| self.removal()),
            ValueKind::Words(words) => self.word_list(words).or_else(|| self.removal()),
            ValueKind::WordsOrTables(_) => self.words_or_tables(kind),
            ValueKind::Text => self.text(self.value.and_then(Value::as_str).unwrap_or_default()),
            ValueKind::Numbered(..) => self.numbered(),
            ValueKind::WholeList | ValueKind::NumberOrNumbers(_) | ValueKind::NumberOrList => {
                self.as_written()
            }
            ValueKind::Points(_) if is_of_sensor(self.key) => self.as_written(),
            // Lists of texts occur in FRAME.toml only.
            ValueKind::Table | ValueKind::Tables | ValueKind::Texts | ValueKind::Points(_) => None,
        }
    }

    /// Draws a number field.
    fn field(&mut self, name: &str, label: &str, value: &Value) -> Option<Edit> {
        let (field, whole) = (self.facts.field, self.whole);
        let value = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
        let range =
            [field.low.value().unwrap_or(f64::NEG_INFINITY), field.high.value().unwrap_or(f64::INFINITY)];
        let (unit, speed, tip) = (&*self.facts.unit, field.step, field.about);
        let field = NumberField { name, label, unit, range, speed, decimals: 7, whole, tip };
        let (number, is_dragged) = drag_value(self.ui, &field, value.unwrap_or_default(), self.out)?;
        Some(Edit { value: Some(self.toml(number)), is_dragged })
    }

    fn toml(&self, number: f64) -> Value {
        if self.whole { Value::Integer(number.round() as i64) } else { Value::Float(number) }
    }

    fn tip(&self) -> &'static str {
        self.facts.field.about
    }

    /// The button that gives a key a value.
    fn add(&mut self, value: impl FnOnce(&Self) -> Value) -> Option<Edit> {
        let is_asked = button(self.ui, "set", &format!("set {}", self.key), self.tip());
        is_asked.then(|| value(self)).and_then(single_edit)
    }

    /// Draws the button that removes a key; returns whether it was clicked.
    fn remove(&mut self) -> bool {
        let name = format!("remove {}", self.key);
        small_button(self.ui, "x", &name, &name)
    }

    fn number(&mut self) -> Option<Edit> {
        let Some(value) = self.value else { return self.add(|editor| editor.toml(editor.first_value())) };
        let edit = self.field(self.key, "", value);
        let may_be_left_out =
            self.facts.field.is_optional || self.key.starts_with("scene.light.") || is_of_sensor(self.key);
        if may_be_left_out && self.remove() { REMOVED } else { edit }
    }

    /// The value of a key that is newly set: its default or example, else the number nearest to 0.
    fn first_value(&self) -> f64 {
        let field = self.facts.field;
        let known = (field.default)().parse().or_else(|_| field.example.parse());
        known.unwrap_or_else(|_| field.low.value().unwrap_or(0.0).max(0.0))
    }

    /// The removal of a key of a twin or sensor that is set.
    fn removal(&mut self) -> Option<Edit> {
        let may_be_left_out = self.key.starts_with(TWINS) || is_of_sensor(self.key);
        if may_be_left_out && self.value.is_some() && self.remove() { REMOVED } else { None }
    }

    /// Draws a word that stands instead of a value; returns whether it was clicked.
    fn word_button(&mut self, is_word: bool, word: &str) -> bool {
        let response = self.ui.selectable_label(is_word, word).with_tooltip(self.tip());
        named(&response, Role::Button, &format!("{}: {word}", self.key));
        response.clicked()
    }

    /// A number, or one of the given words.
    fn number_or(&mut self, words: &[&str]) -> Option<Edit> {
        let value = self.value?;
        for word in words {
            let is_word = value.as_str() == Some(word);
            if self.word_button(is_word, word) {
                let number = || self.toml(self.first_value().max(1.0));
                return single_edit(if is_word { number() } else { Value::String((*word).into()) });
            }
        }
        if value.is_str() { None } else { self.number() }
    }

    /// A list of numbers with labels.
    fn numbers(&mut self, count: usize) -> Option<Edit> {
        let labels = match self.key.rsplit('.').next() {
            Some("coefficients") => ModelFacts::of(self.document.scenario.camera.lens.model).coefficients,
            _ => self.facts.field.names,
        };
        let array = self.value?.as_array()?;
        let mut edit = None;
        for (index, element) in array.iter().take(count).enumerate() {
            let name = format!("{}[{index}]", self.key);
            let changed = self.field(&name, labels.get(index).unwrap_or(&""), element);
            if let Some(Edit { value: Some(number), is_dragged }) = changed {
                let mut changed = array.clone();
                changed[index] = number;
                edit = Some(Edit { value: Some(Value::Array(changed)), is_dragged });
            }
        }
        edit
    }

    /// Numbers that may be absent.
    fn optional_numbers(&mut self, count: usize) -> Option<Edit> {
        if self.value.is_some() {
            let edit = self.numbers(count);
            return if self.facts.field.is_optional && self.remove() { REMOVED } else { edit };
        }
        self.add(|editor| {
            let size_px = editor.document.scenario.camera.size_px;
            let start = match editor.key.rsplit('.').next() {
                Some("principal_point_px") => size_px.map(|side| 0.5 * (f64::from(side) - 1.0)).to_vec(),
                Some("window_s") => vec![0.0, 10.0],
                Some("size_px") => size_px.map(f64::from).to_vec(),
                Some("crop_px") => [[0, 0], size_px].as_flattened().iter().map(|&px| f64::from(px)).collect(),
                _ => vec![0.0; count],
            };
            Value::Array(start.iter().map(|&number| editor.toml(number)).collect())
        })
    }

    /// Numbers, or the given word.
    fn numbers_or(&mut self, count: usize, word: &str) -> Option<Edit> {
        let is_word = self.value.is_some_and(Value::is_str);
        if self.word_button(is_word, word) {
            let zeros = || Value::Array(vec![Value::Float(0.0); count]);
            return single_edit(if is_word { zeros() } else { Value::String(word.into()) });
        }
        if is_word { None } else { self.numbers(count) }
    }

    /// A list of any number of numbers.
    fn number_list(&mut self) -> Option<Edit> {
        let Some(array) = self.value.and_then(Value::as_array) else {
            let start = if self.key.ends_with("_scale") { 1.0 } else { 0.0 };
            return self.add(|_| Value::Array(vec![Value::Float(start)]));
        };
        let edit = self.numbers(array.len());
        let is_more = small_button(self.ui, "+", &format!("one more of {}", self.key), "one more");
        let is_less = small_button(self.ui, "-", &format!("one less of {}", self.key), "one less");
        let mut changed = array.clone();
        if is_more {
            changed.push(Value::Float(0.0));
        } else if !is_less || changed.pop().is_none() {
            return edit;
        }
        single_edit(Value::Array(changed))
    }

    /// A field of text.
    fn text_field(&mut self, text: &mut String, tip: &str) -> Response {
        let field = egui::TextEdit::singleline(text).desired_width(170.0).hint_text("none");
        let response = self.ui.add(field).with_tooltip(tip);
        named(&response, Role::TextInput, self.key);
        response
    }

    /// A path, taken when its field loses focus. Paths in the scenario's folder are shown relative to it.
    fn path(&mut self) -> Option<Edit> {
        let present = self.value.and_then(Value::as_str).unwrap_or_default();
        let id = egui::Id::unique(("path", self.key));
        let (relative_path, elsewhere) = (self.document.relative_path(present), shortened(present));
        let resting = if relative_path.len() < present.len() { relative_path.clone() } else { elsewhere };
        let mut text = self.ui.data(|data| data.get_temp::<String>(id)).unwrap_or(resting);
        let response = self.text_field(&mut text, present);
        if response.gained_focus() {
            self.ui.data_mut(|data| data.insert_temp(id, relative_path));
            return None;
        }
        if response.has_focus() {
            self.ui.data_mut(|data| data.insert_temp(id, text));
            return None;
        }
        self.ui.data_mut(|data| data.remove_temp::<String>(id))?;
        // A field that is scrolled out of view is not finished.
        if !response.lost_focus() || text == relative_path {
            return None;
        }
        let value = (!text.is_empty()).then(|| Value::String(self.document.resolved_path(&text)));
        Some(Edit { value, is_dragged: false })
    }

    /// A text, taken when its field loses focus; an empty one removes the key.
    fn text(&mut self, present: &str) -> Option<Edit> {
        let text = self.finished_text(present)?;
        Some(Edit { value: (!text.is_empty()).then_some(Value::String(text)), is_dragged: false })
    }

    /// Words and paths of tables, separated by commas.
    fn words_or_tables(&mut self, kind: ValueKind) -> Option<Edit> {
        let (value, document) = (self.value, self.document);
        let list = value
            .and_then(Value::as_array)
            .map_or_else(|| value.into_iter().collect(), |list| list.iter().collect::<Vec<_>>());
        let present: Vec<String> =
            list.into_iter().filter_map(Value::as_str).map(|text| document.relative_path(text)).collect();
        let text = self.finished_text(&present.join(", "))?;
        let element = |text: &str| {
            Value::String(if kind.is_path(text) { document.resolved_path(text) } else { text.to_owned() })
        };
        let elements: Vec<Value> =
            text.split(',').map(str::trim).filter(|text| !text.is_empty()).map(element).collect();
        Some(Edit { value: (!elements.is_empty()).then_some(Value::Array(elements)), is_dragged: false })
    }

    /// A field of text; its text when it loses focus and differs from `present`.
    fn finished_text(&mut self, present: &str) -> Option<String> {
        let id = egui::Id::unique(("text", self.key));
        let mut text = self.ui.data(|data| data.get_temp::<String>(id)).unwrap_or_else(|| present.to_owned());
        let response = self.text_field(&mut text, self.tip());
        if response.has_focus() {
            self.ui.data_mut(|data| data.insert_temp(id, text));
            return None;
        }
        self.ui.data_mut(|data| data.remove_temp::<String>(id))?;
        (response.lost_focus() && text != present).then_some(text)
    }

    /// A table of names with numbers, written `roof = 3, wall = 4`.
    fn numbered(&mut self) -> Option<Edit> {
        let pairs = self.value.and_then(Value::as_table).into_iter().flatten();
        let quoted = |name: &str| Value::String(name.to_owned()).to_string();
        let written: Vec<String> = pairs.map(|(name, value)| format!("{} = {value}", quoted(name))).collect();
        self.toml_text(&written.join(", "), |text| format!("v = {{ {text} }}"))
    }

    /// A value as it stands in the file, such as `0.1` or `[0.1, 0.2, 0.3]`. An empty text removes the key.
    fn as_written(&mut self) -> Option<Edit> {
        let written = self.value.map(ToString::to_string).unwrap_or_default();
        self.toml_text(&written, |text| format!("v = {text}"))
    }

    /// A text that is the value `v` of a line of TOML.
    fn toml_text(&mut self, present: &str, line: impl Fn(&str) -> String) -> Option<Edit> {
        let edit = self.text(present)?;
        let Some(Value::String(text)) = edit.value else { return Some(edit) };
        let parsed = toml::from_str::<toml::Table>(&line(&text)).ok();
        // A text that is no value stays a text, which the schema refuses with a message.
        let value = parsed.and_then(|mut table| table.remove("v")).unwrap_or(Value::String(text));
        Some(Edit { value: Some(value), ..edit })
    }

    /// A truth value.
    fn flag(&mut self) -> Option<Edit> {
        // What a twin does not leave out is as in the frame.
        let is_on_by_default = self.key.starts_with(TWINS) && !self.key.ends_with(".ideal");
        let mut on = self.value.and_then(Value::as_bool).unwrap_or(is_on_by_default);
        let response = self.ui.checkbox(&mut on, "");
        named(&response, Role::CheckBox, self.key);
        response.changed().then_some(Value::Boolean(on)).and_then(single_edit)
    }

    /// One of the given words.
    fn word(&mut self, words: &[&str]) -> Option<Edit> {
        let default = (self.facts.field.default)();
        let before = self.value.and_then(Value::as_str).unwrap_or(default.trim_matches('"'));
        let mut chosen = before.to_owned();
        let shown = if before.is_empty() { "not set" } else { before };
        let combo = egui::ComboBox::from_id_salt(self.key).selected_text(shown).show_ui(self.ui, |ui| {
            for word in words {
                ui.selectable_value(&mut chosen, (*word).to_owned(), *word);
            }
        });
        named(&combo.response, Role::ComboBox, self.key);
        (chosen != before).then_some(Value::String(chosen)).and_then(single_edit)
    }

    /// Several of the given words.
    fn word_list(&mut self, words: &[&str]) -> Option<Edit> {
        let array = self.value.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let holds = |word: &str| array.iter().any(|element| element.as_str() == Some(word));
        let mut edit = None;
        for word in words {
            let mut on = holds(word);
            let response = self.ui.toggle_value(&mut on, *word);
            named(&response, Role::Button, &format!("{}: {word}", self.key));
            if response.clicked() {
                let selected = words.iter().filter(|other| if *other == word { on } else { holds(other) });
                edit =
                    single_edit(Value::Array(selected.map(|word| Value::String((*word).into())).collect()));
            }
        }
        edit
    }
}

/// A path shortened to its file name.
fn shortened(path: &str) -> String {
    let name = std::path::Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned());
    name.filter(|name| name.len() < path.len()).map_or_else(|| path.to_owned(), |name| format!(".../{name}"))
}
