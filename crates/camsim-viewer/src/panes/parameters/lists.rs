//! Editors of lists of tables: vibration, zoom calibrations, models, twins, sensors.

use camsim_io::scenario_file::{ValueKind, find_key, keys};
use eframe::egui::Ui;
use toml::{Table, Value};

use super::super::{tooltips::WithTooltip, widgets::small_button};
use super::{is_below, row};
use crate::{
    document::Document,
    message::{Message, Outbox},
    state::State,
};

/// Draws a list with its entries, and a button to add one.
pub fn show(ui: &mut Ui, state: &State, document: &Document, key: &str, out: &mut Outbox) {
    let entries = document.value(key).and_then(Value::as_array).map_or(0, Vec::len);
    let leaf = key.rsplit('.').next().unwrap_or(key);
    for index in 0..entries {
        ui.horizontal(|ui| {
            ui.label(format!("{leaf} {}", index + 1));
            let name = format!("remove {key} {}", index + 1);
            if small_button(ui, "x", &name, &name) {
                out.push(Message::Set(format!("{key}.{index}"), None, false));
            }
        });
        ui.indent((key, index), |ui| {
            for element in keys() {
                let below = element.name.strip_prefix(key).and_then(|rest| rest.strip_prefix('.'));
                if let Some(field) = below.filter(|_| !is_in_inner_list(key, &element.name)) {
                    row(ui, state, document, &format!("{key}.{index}.{field}"), element, out);
                }
            }
        });
    }
    let tip = find_key(key).map_or("", |key| key.field.about);
    let add = ui.button(format!("add {leaf}")).with_tooltip(tip);
    if add.clicked() {
        let mut list = document.value(key).and_then(Value::as_array).cloned().unwrap_or_default();
        list.push(Value::Table(new_entry(document, key)));
        out.push(Message::Set(key.to_owned(), Some(Value::Array(list)), false));
    }
}

/// Whether an element of a list belongs to a list within it, which has no editor.
fn is_in_inner_list(list: &str, element: &str) -> bool {
    keys()
        .iter()
        .filter(|inner| inner.field.kind == ValueKind::Tables)
        .any(|inner| is_below(&inner.name, list) && is_below(element, &inner.name))
}

/// A new entry: the present camera at the next zoom value, a twin without motion blur, a sensor without errors,
/// or slight vibration in pitch.
fn new_entry(document: &Document, key: &str) -> Table {
    let mut table = Table::new();
    let mut put = |name: &str, value: Value| table.insert(name.to_owned(), value);
    if key == "camera.zoom" {
        let camera = &document.scenario.camera;
        let floats = |values: &[f64]| Value::Array(values.iter().map(|value| Value::Float(*value)).collect());
        put("at", Value::Float(camera.zoom.last().map_or(1.0, |entry| entry.at + 1.0)));
        put("focal_px", floats(&camera.focal_px));
        put("coefficients", floats(&camera.lens.coefficients));
    } else if key == "output.twin" {
        let twins = &document.scenario.output.twin;
        let names =
            (1..).map(|number: usize| if number == 1 { "sharp".into() } else { format!("sharp{number}") });
        let is_free = |name: &String| twins.iter().all(|twin| !twin.name.eq_ignore_ascii_case(name));
        put("name", Value::String(names.into_iter().find(is_free).unwrap_or_default()));
        put("exposure", Value::Boolean(false));
    } else if matches!(key, "imu" | "gnss" | "barometer" | "magnetometer") {
        let taken: Vec<String> =
            document.scenario.sensor_names().map(|(_, name)| name.to_ascii_lowercase()).collect();
        let mut names = (0..).map(|number: usize| format!("{key}{number}"));
        put("name", Value::String(names.find(|name| !taken.contains(name)).unwrap_or_default()));
        if key == "magnetometer" {
            put("field_ned_ut", Value::Array([20.0, 1.0, 43.0].map(Value::Float).into()));
        }
    } else {
        put("axis", Value::String("pitch".into()));
        put("amplitude_deg", Value::Float(0.05));
        put("amplitude_m", Value::Float(0.0));
        put("hz", Value::Float(30.0));
        put("phase_deg", Value::Float(0.0));
    }
    table
}
