//! Small things that several panes draw.

use eframe::egui::{self, Response, Role, Ui, WidgetInfo};

/// One choice of several. `name` is what assistive technology and tests call it, where the text alone would not tell.
pub fn choice(ui: &mut Ui, selected: bool, text: &str, name: &str, explanation: &str) -> Response {
    let response = ui.selectable_label(selected, text).on_hover_text(explanation);
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, ui.is_enabled(), selected, name));
    response
}

/// Gives a widget a name for assistive technology.
pub fn named(response: &Response, kind: Role, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(kind, response.enabled(), name));
}

/// A row of a table: what, and how much. The value can be selected and copied.
pub fn fact(ui: &mut Ui, what: &str, value: impl Into<String>, explanation: &str) {
    ui.label(egui::RichText::new(what).weak()).on_hover_text(explanation);
    ui.label(value.into());
    ui.end_row();
}

/// Two columns for [`fact`].
pub fn facts(ui: &mut Ui, name: &str, rows: impl FnOnce(&mut Ui)) {
    egui::Grid::new(name).num_columns(2).spacing([10.0, 3.0]).show(ui, rows);
}
