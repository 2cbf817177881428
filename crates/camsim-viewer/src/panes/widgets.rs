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

/// A number with so many decimals; what rounds to nothing has no sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if is_zero(rest) => rest.to_owned(),
        _ => text,
    }
}

/// The same, always with a sign.
pub fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if text.starts_with('-') { text } else { format!("+{text}") }
}

fn is_zero(text: &str) -> bool {
    text.chars().all(|c| matches!(c, '0' | '.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_has_no_sign_and_something_keeps_it() {
        assert_eq!([fixed(-0.0, 3), fixed(-0.0004, 3), fixed(-0.0006, 3)], ["0.000", "0.000", "-0.001"]);
        assert_eq!([signed(-0.0, 1), signed(0.26, 1), signed(-0.06, 1)], ["+0.0", "+0.3", "-0.1"]);
        assert_eq!(fixed(f64::NAN, 2), "NaN");
    }
}
