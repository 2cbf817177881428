//! Widgets that several panes use.

use std::{f32::consts::TAU, time::Duration};

use eframe::egui::{self, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};

use super::tooltips::WithTooltip;

/// Time between two steps of [`waiting`].
const STEP: Duration = Duration::from_millis(250);
/// Width of the labels of [`fact`], points: that of "predicted error".
const LABEL_WIDTH: f32 = 108.0;
/// Steps of a turn.
const STEPS: u64 = 8;

/// One choice of several. `name` is its name for assistive technology and tests, where `text` is ambiguous.
pub fn choice(ui: &mut Ui, selected: bool, text: &str, name: &str, tooltip: &str) -> Response {
    let response = ui.selectable_label(selected, text).with_tooltip(tooltip);
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, ui.is_enabled(), selected, name));
    response
}

/// Spinner with four steps a second. egui's spinner repaints at full rate, which on a software adapter takes
/// the processor time that is waited for.
pub fn waiting(ui: &mut Ui) -> Response {
    let side = ui.spacing().interact_size.y;
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, ui.is_enabled(), "working"));
    let turn_step = (ui.input(|input| input.time) / STEP.as_secs_f64()) as u64 % STEPS;
    let point = |step: u16| {
        let angle = TAU * (turn_step as f32 / STEPS as f32 + 0.7 * f32::from(step) / 20.0);
        rect.center() + 0.35 * side * vec2(angle.cos(), angle.sin())
    };
    ui.painter().add(Shape::line(
        (0..=20).map(point).collect(),
        Stroke::new(0.1 * side, ui.visuals().strong_text_color()),
    ));
    ui.ctx().request_repaint_after(STEP);
    response
}

/// Gives a widget a name for assistive technology.
pub fn named(response: &Response, kind: Role, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(kind, response.enabled(), name));
}

/// A button; `name` is for assistive technology. Returns whether it was clicked.
pub fn button(ui: &mut Ui, text: &str, name: &str, tooltip: &str) -> bool {
    clicked(ui.button(text), name, tooltip)
}

/// As [`button`], a small one.
pub fn small_button(ui: &mut Ui, text: &str, name: &str, tooltip: &str) -> bool {
    clicked(ui.small_button(text), name, tooltip)
}

fn clicked(button: Response, name: &str, tooltip: &str) -> bool {
    let button = button.with_tooltip(tooltip);
    named(&button, Role::Button, name);
    button.clicked()
}

/// A row of a table: label and value, which wraps, and can be selected and copied.
pub fn fact(ui: &mut Ui, label: &str, value: impl Into<String>, tooltip: &str) {
    ui.horizontal_top(|ui| {
        let column = vec2(LABEL_WIDTH, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(column, egui::Layout::left_to_right(egui::Align::TOP), |ui| {
            ui.set_min_width(LABEL_WIDTH);
            ui.label(egui::RichText::new(label).weak()).with_tooltip(tooltip);
        });
        ui.add(egui::Label::new(value.into()).wrap());
    });
}

/// Draws contents in the rest of a panel. What they need beyond its width is cut off: a long text must not widen
/// the panel, which would stay wide.
pub fn within_panel(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let rest = ui.available_rect_before_wrap();
    let mut inner = ui.new_child(egui::UiBuilder::new().max_rect(rest));
    inner.set_clip_rect(rest.intersect(ui.clip_rect()));
    contents(&mut inner);
    ui.advance_cursor_after_rect(rest);
}

/// A number with `decimals` decimals, without "-0".
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if is_zero(rest) => rest.to_owned(),
        _ => text,
    }
}

/// As [`fixed`], always with a sign.
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
    fn zero_has_no_minus_sign() {
        assert_eq!([fixed(-0.0, 3), fixed(-0.0004, 3), fixed(-0.0006, 3)], ["0.000", "0.000", "-0.001"]);
        assert_eq!([signed(-0.0, 1), signed(0.26, 1), signed(-0.06, 1)], ["+0.0", "+0.3", "-0.1"]);
        assert_eq!(fixed(f64::NAN, 2), "NaN");
    }
}
