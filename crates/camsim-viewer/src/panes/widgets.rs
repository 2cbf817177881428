//! Small things that several panes draw.

use std::{f32::consts::TAU, time::Duration};

use eframe::egui::{self, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};

use super::tips::Explained;

/// Time between two looks at [`waiting`].
const BEAT: Duration = Duration::from_millis(250);
/// Steps of it in a turn.
const BEATS: u64 = 8;

/// One choice of several. `name` is what assistive technology and tests call it, where the text alone would
/// not tell.
pub fn choice(ui: &mut Ui, selected: bool, text: &str, name: &str, explanation: &str) -> Response {
    let response = ui.selectable_label(selected, text).explained(explanation);
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, ui.is_enabled(), selected, name));
    response
}

/// Says that something takes a while. egui's own spinner has the window drawn as often as it can be, which on
/// a software adapter takes the very processors that are waited for: this one moves four times a second.
pub fn waiting(ui: &mut Ui) -> Response {
    let side = ui.spacing().interact_size.y;
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, ui.is_enabled(), "working"));
    let beat = (ui.input(|input| input.time) / BEAT.as_secs_f64()) as u64 % BEATS;
    let point = |step: u16| {
        let angle = TAU * (beat as f32 / BEATS as f32 + 0.7 * f32::from(step) / 20.0);
        rect.center() + 0.35 * side * vec2(angle.cos(), angle.sin())
    };
    ui.painter().add(Shape::line(
        (0..=20).map(point).collect(),
        Stroke::new(0.1 * side, ui.visuals().strong_text_color()),
    ));
    ui.ctx().request_repaint_after(BEAT);
    response
}

/// Gives a widget a name for assistive technology.
pub fn named(response: &Response, kind: Role, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(kind, response.enabled(), name));
}

/// A row of a table: what, and how much. The value can be selected and copied.
pub fn fact(ui: &mut Ui, what: &str, value: impl Into<String>, explanation: &str) {
    ui.label(egui::RichText::new(what).weak()).explained(explanation);
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
