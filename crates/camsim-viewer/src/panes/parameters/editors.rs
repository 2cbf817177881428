//! Editors of values, by kind.

use camsim_core::{lens::ModelFacts, scenario::keys::Key};
use camsim_io::scenario_file::ValueKind;
use eframe::egui::{self, Role, Ui};
use toml::Value;

use super::super::{
    number_field::{NumberField, drag_value},
    tooltips::WithTooltip,
    widgets::named,
};
use crate::{
    document::Document,
    message::{Message, Outbox},
};

/// Keys of twins, all of which but the name may be left out.
const TWINS: &str = "output.twin.";

/// Whether a key is one of a sensor beside the camera, all of which but the name may be left out.
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

/// Draws the editor of a key.
pub fn show(ui: &mut Ui, document: &Document, key: &str, facts: &Key, out: &mut Outbox) {
    let (value, kind) = (document.value(key), facts.field.kind);
    let edit = match kind {
        ValueKind::Number => number(ui, key, value, facts, false, out),
        ValueKind::Whole | ValueKind::Within(..) => number(ui, key, value, facts, true, out),
        ValueKind::NumberOr(words) => number_or(ui, key, value, facts, words, false, out),
        ValueKind::CountOr(_, words) => number_or(ui, key, value, facts, words, true, out),
        ValueKind::Numbers(count) => optional_numbers(ui, document, key, value, facts, count, false, out),
        ValueKind::Counts(count, _) => optional_numbers(ui, document, key, value, facts, count, true, out),
        ValueKind::NumbersOr(count, word) => numbers_or(ui, document, key, value, facts, count, word, out),
        ValueKind::WholeList => as_written(ui, key, value, facts),
        ValueKind::NumberList => number_list(ui, document, key, value, facts, out),
        ValueKind::Paths if value.is_some_and(Value::is_array) => as_written(ui, key, value, facts),
        ValueKind::Path | ValueKind::Paths => path(ui, document, key, value),
        ValueKind::Flag => flag(ui, key, value),
        ValueKind::Word(words) => word(ui, key, value, words, facts).or_else(|| removal(ui, key, value)),
        ValueKind::Words(words) => word_list(ui, key, value, words).or_else(|| removal(ui, key, value)),
        ValueKind::WordsOrTables(_) => words_or_tables(ui, document, key, value, kind, facts),
        ValueKind::Text => text(ui, key, value, facts),
        ValueKind::Numbered(..) => numbered(ui, key, value, facts),
        ValueKind::NumberOrNumbers(_) | ValueKind::NumberOrList => as_written(ui, key, value, facts),
        ValueKind::Points(_) if is_of_sensor(key) => as_written(ui, key, value, facts),
        // Lists of texts occur in FRAME.toml only.
        ValueKind::Table | ValueKind::Tables | ValueKind::Texts | ValueKind::Points(_) => None,
    };
    if let Some(Edit { value, is_dragged }) = edit {
        out.push(Message::Set(key.to_owned(), value, is_dragged));
    }
}

/// An edit without drag.
fn single_edit(value: Value) -> Option<Edit> {
    Some(Edit { value: Some(value), is_dragged: false })
}

fn as_f64(value: &Value) -> f64 {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)).unwrap_or_default()
}

/// Draws a number field of a parameter.
fn param_field(
    ui: &mut Ui,
    name: &str,
    label: &str,
    value: f64,
    facts: &Key,
    whole: bool,
    out: &mut Outbox,
) -> Option<(f64, bool)> {
    let field = facts.field;
    let range = [field.low.value().unwrap_or(f64::NEG_INFINITY), field.high.value().unwrap_or(f64::INFINITY)];
    let (unit, speed, tip) = (&*facts.unit, field.step, field.about);
    drag_value(ui, &NumberField { name, label, unit, range, speed, decimals: 7, whole, tip }, value, out)
}

fn to_value(number: f64, whole: bool) -> Value {
    if whole { Value::Integer(number.round() as i64) } else { Value::Float(number) }
}

fn number(
    ui: &mut Ui,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    whole: bool,
    out: &mut Outbox,
) -> Option<Edit> {
    let Some(value) = value else {
        let add = ui.button("set").with_tooltip(facts.field.about);
        named(&add, Role::Button, &format!("set {key}"));
        return add.clicked().then(|| to_value(first_value(facts), whole)).and_then(single_edit);
    };
    let edit = param_field(ui, key, "", as_f64(value), facts, whole, out)
        .map(|(number, is_dragged)| Edit { value: Some(to_value(number, whole)), is_dragged });
    let may_be_left_out = facts.field.is_optional || key.starts_with("scene.light.") || is_of_sensor(key);
    if may_be_left_out && remove(ui, key) {
        return Some(Edit { value: None, is_dragged: false });
    }
    edit
}

/// The value of a key that is newly set: its default or example, else the number nearest to 0.
fn first_value(facts: &Key) -> f64 {
    let field = facts.field;
    let known = (field.default)().parse().or_else(|_| field.example.parse());
    known.unwrap_or_else(|_| field.low.value().unwrap_or(0.0).max(0.0))
}

/// Draws the button that removes a key; returns whether it was clicked.
fn remove(ui: &mut Ui, key: &str) -> bool {
    let name = format!("remove {key}");
    let button = ui.small_button("x").with_tooltip(&name);
    named(&button, Role::Button, &name);
    button.clicked()
}

/// The removal of a key of a twin or sensor that is set.
fn removal(ui: &mut Ui, key: &str, value: Option<&Value>) -> Option<Edit> {
    let is_asked = (key.starts_with(TWINS) || is_of_sensor(key)) && value.is_some() && remove(ui, key);
    is_asked.then_some(Edit { value: None, is_dragged: false })
}

/// A number, or one of the given words.
fn number_or(
    ui: &mut Ui,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    words: &[&str],
    whole: bool,
    out: &mut Outbox,
) -> Option<Edit> {
    let value = value?;
    for word in words {
        let is_word = value.as_str() == Some(word);
        let response = ui.selectable_label(is_word, *word).with_tooltip(facts.field.about);
        named(&response, Role::Button, &format!("{key}: {word}"));
        if response.clicked() {
            return if is_word {
                single_edit(to_value(first_value(facts).max(1.0), whole))
            } else {
                single_edit(Value::String((*word).into()))
            };
        }
    }
    if value.is_str() { None } else { number(ui, key, Some(value), facts, whole, out) }
}

/// A list of numbers with labels.
fn numbers(
    ui: &mut Ui,
    document: &Document,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    count: usize,
    whole: bool,
    out: &mut Outbox,
) -> Option<Edit> {
    let labels = match key.rsplit('.').next() {
        Some("coefficients") => ModelFacts::of(document.scenario.camera.lens.model).coefficients,
        _ => facts.field.names,
    };
    let array = value?.as_array()?;
    let mut edit = None;
    for (index, element) in array.iter().take(count).enumerate() {
        if let Some((number, is_dragged)) = param_field(
            ui,
            &format!("{key}[{index}]"),
            labels.get(index).unwrap_or(&""),
            as_f64(element),
            facts,
            whole,
            out,
        ) {
            let mut changed = array.clone();
            changed[index] = to_value(number, whole);
            edit = Some(Edit { value: Some(Value::Array(changed)), is_dragged });
        }
    }
    edit
}

/// Numbers that may be absent.
fn optional_numbers(
    ui: &mut Ui,
    document: &Document,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    count: usize,
    whole: bool,
    out: &mut Outbox,
) -> Option<Edit> {
    if value.is_some() {
        let edit = numbers(ui, document, key, value, facts, count, whole, out);
        return if facts.field.is_optional && remove(ui, key) {
            Some(Edit { value: None, is_dragged: false })
        } else {
            edit
        };
    }
    let add = ui.button("set").with_tooltip(facts.field.about);
    named(&add, Role::Button, &format!("set {key}"));
    let camera = &document.scenario.camera;
    let start = match key.rsplit('.').next() {
        Some("principal_point_px") => camera.size_px.map(|side| 0.5 * (f64::from(side) - 1.0)).to_vec(),
        Some("window_s") => vec![0.0, 10.0],
        Some("size_px") => camera.size_px.map(f64::from).to_vec(),
        Some("crop_px") => [[0, 0], camera.size_px].as_flattened().iter().map(|&px| f64::from(px)).collect(),
        _ => vec![0.0; count],
    };
    let start = || start.iter().map(|&number| to_value(number, whole)).collect();
    add.clicked().then(|| Value::Array(start())).and_then(single_edit)
}

/// Numbers, or the given word.
fn numbers_or(
    ui: &mut Ui,
    document: &Document,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    count: usize,
    word: &str,
    out: &mut Outbox,
) -> Option<Edit> {
    let is_word = value.is_some_and(Value::is_str);
    let response = ui.selectable_label(is_word, word).with_tooltip(facts.field.about);
    named(&response, Role::Button, &format!("{key}: {word}"));
    if response.clicked() {
        return single_edit(if is_word {
            Value::Array(vec![Value::Float(0.0); count])
        } else {
            Value::String(word.into())
        });
    }
    if is_word { None } else { numbers(ui, document, key, value, facts, count, false, out) }
}

/// A list of any number of numbers.
fn number_list(
    ui: &mut Ui,
    document: &Document,
    key: &str,
    value: Option<&Value>,
    facts: &Key,
    out: &mut Outbox,
) -> Option<Edit> {
    let Some(array) = value.and_then(Value::as_array) else {
        let add = ui.button("set").with_tooltip(facts.field.about);
        named(&add, Role::Button, &format!("set {key}"));
        let start = if key.ends_with("_scale") { 1.0 } else { 0.0 };
        return add.clicked().then(|| Value::Array(vec![Value::Float(start)])).and_then(single_edit);
    };
    let mut edit = numbers(ui, document, key, value, facts, array.len(), false, out);
    let (more, less) =
        (ui.small_button("+").with_tooltip("one more"), ui.small_button("-").with_tooltip("one less"));
    named(&more, Role::Button, &format!("one more of {key}"));
    named(&less, Role::Button, &format!("one less of {key}"));
    let mut changed = array.clone();
    if more.clicked() {
        changed.push(Value::Float(0.0));
        edit = single_edit(Value::Array(changed));
    } else if less.clicked() && changed.pop().is_some() {
        edit = single_edit(Value::Array(changed));
    }
    edit
}

/// A path, taken when its field loses focus. Paths in the scenario's folder are shown relative to it.
fn path(ui: &mut Ui, document: &Document, key: &str, value: Option<&Value>) -> Option<Edit> {
    let present = value.and_then(Value::as_str).unwrap_or_default();
    let id = egui::Id::unique(("path", key));
    let (relative_path, elsewhere) = (document.relative_path(present), shortened(present));
    let resting = if relative_path.len() < present.len() { relative_path.clone() } else { elsewhere };
    let mut text = ui.data(|data| data.get_temp::<String>(id)).unwrap_or(resting);
    let response = ui
        .add(egui::TextEdit::singleline(&mut text).desired_width(170.0).hint_text("none"))
        .with_tooltip(present);
    named(&response, Role::TextInput, key);
    if response.gained_focus() {
        ui.data_mut(|data| data.insert_temp(id, relative_path));
        return None;
    }
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        return None;
    }
    ui.data_mut(|data| data.remove_temp::<String>(id))?;
    // A field that is scrolled out of view is not finished.
    if !response.lost_focus() || text == relative_path {
        return None;
    }
    Some(Edit {
        value: (!text.is_empty()).then(|| Value::String(document.resolved_path(&text))),
        is_dragged: false,
    })
}

/// A text, taken when its field loses focus; an empty one removes the key.
fn text(ui: &mut Ui, key: &str, value: Option<&Value>, facts: &Key) -> Option<Edit> {
    let text = finished_text(ui, key, value.and_then(Value::as_str).unwrap_or_default(), facts)?;
    Some(Edit { value: (!text.is_empty()).then_some(Value::String(text)), is_dragged: false })
}

/// Words and paths of tables, separated by commas.
fn words_or_tables(
    ui: &mut Ui,
    document: &Document,
    key: &str,
    value: Option<&Value>,
    kind: ValueKind,
    facts: &Key,
) -> Option<Edit> {
    let list = value
        .and_then(Value::as_array)
        .map_or_else(|| value.into_iter().collect(), |list| list.iter().collect::<Vec<_>>());
    let present: Vec<String> =
        list.into_iter().filter_map(Value::as_str).map(|text| document.relative_path(text)).collect();
    let text = finished_text(ui, key, &present.join(", "), facts)?;
    let element = |text: &str| {
        Value::String(if kind.is_path(text) { document.resolved_path(text) } else { text.to_owned() })
    };
    let elements: Vec<Value> =
        text.split(',').map(str::trim).filter(|text| !text.is_empty()).map(element).collect();
    Some(Edit { value: (!elements.is_empty()).then_some(Value::Array(elements)), is_dragged: false })
}

/// A field of text; its text when it loses focus and differs from `present`.
fn finished_text(ui: &mut Ui, key: &str, present: &str, facts: &Key) -> Option<String> {
    let id = egui::Id::unique(("text", key));
    let mut text = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_else(|| present.to_owned());
    let response = ui
        .add(egui::TextEdit::singleline(&mut text).desired_width(170.0).hint_text("none"))
        .with_tooltip(facts.field.about);
    named(&response, Role::TextInput, key);
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        return None;
    }
    ui.data_mut(|data| data.remove_temp::<String>(id))?;
    (response.lost_focus() && text != present).then_some(text)
}

/// A table of names with numbers, written `roof = 3, wall = 4`.
fn numbered(ui: &mut Ui, key: &str, value: Option<&Value>, facts: &Key) -> Option<Edit> {
    let pairs = value.and_then(Value::as_table).into_iter().flatten();
    let quoted = |name: &str| Value::String(name.to_owned()).to_string();
    let written: Vec<String> = pairs.map(|(name, value)| format!("{} = {value}", quoted(name))).collect();
    let edit = text(ui, key, Some(&Value::String(written.join(", "))), facts)?;
    let Some(Value::String(text)) = edit.value else { return Some(edit) };
    let parsed = toml::from_str::<toml::Table>(&format!("v = {{ {text} }}")).ok();
    // A text that is no table stays a text, which the schema refuses with a message.
    let value = parsed.and_then(|mut table| table.remove("v")).unwrap_or(Value::String(text));
    Some(Edit { value: Some(value), ..edit })
}

/// A value as it stands in the file, such as `0.1` or `[0.1, 0.2, 0.3]`. An empty text removes the key.
fn as_written(ui: &mut Ui, key: &str, value: Option<&Value>, facts: &Key) -> Option<Edit> {
    let written = value.map(|value| Value::String(value.to_string()));
    let edit = text(ui, key, written.as_ref(), facts)?;
    let Some(Value::String(text)) = edit.value else { return Some(edit) };
    let parsed = toml::from_str::<toml::Table>(&format!("v = {text}")).ok();
    // A text that is no value stays a text, which the schema refuses with a message.
    let value = parsed.and_then(|mut table| table.remove("v")).unwrap_or(Value::String(text));
    Some(Edit { value: Some(value), ..edit })
}

/// A path shortened to its file name.
fn shortened(path: &str) -> String {
    let name = std::path::Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned());
    name.filter(|name| name.len() < path.len()).map_or_else(|| path.to_owned(), |name| format!(".../{name}"))
}

/// A truth value.
fn flag(ui: &mut Ui, key: &str, value: Option<&Value>) -> Option<Edit> {
    // What a twin does not leave out is as in the frame.
    let is_on_by_default = key.starts_with(TWINS) && !key.ends_with(".ideal");
    let mut on = value.and_then(Value::as_bool).unwrap_or(is_on_by_default);
    let response = ui.checkbox(&mut on, "");
    named(&response, Role::CheckBox, key);
    response.changed().then_some(Value::Boolean(on)).and_then(single_edit)
}

/// One of the given words.
fn word(ui: &mut Ui, key: &str, value: Option<&Value>, words: &[&str], facts: &Key) -> Option<Edit> {
    let default = (facts.field.default)();
    let mut chosen = value.and_then(Value::as_str).unwrap_or(default.trim_matches('"')).to_owned();
    let before = chosen.clone();
    let combo = egui::ComboBox::from_id_salt(key).selected_text(&chosen).show_ui(ui, |ui| {
        for word in words {
            ui.selectable_value(&mut chosen, (*word).to_owned(), *word);
        }
    });
    named(&combo.response, Role::ComboBox, key);
    (chosen != before).then_some(Value::String(chosen)).and_then(single_edit)
}

/// Several of the given words.
fn word_list(ui: &mut Ui, key: &str, value: Option<&Value>, words: &[&str]) -> Option<Edit> {
    let none = Vec::new();
    let array = value.and_then(Value::as_array).unwrap_or(&none);
    let mut edit = None;
    for word in words {
        let mut on = array.iter().any(|element| element.as_str() == Some(word));
        let response = ui.toggle_value(&mut on, *word);
        named(&response, Role::Button, &format!("{key}: {word}"));
        if response.clicked() {
            let selected = words.iter().filter(|other| {
                if *other == word { on } else { array.iter().any(|e| e.as_str() == Some(other)) }
            });
            edit = single_edit(Value::Array(selected.map(|word| Value::String((*word).into())).collect()));
        }
    }
    edit
}
