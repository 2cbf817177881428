//! Number fields to drag or type in, each with a range. Input that is out of range or not a number is
//! reported.

use std::cell::{Cell, RefCell};

use eframe::egui::{self, Response, Role, SliderClamping, Ui};

use super::{tooltips::WithTooltip, widgets::named};
use crate::message::{Message, Outbox, RejectedInput};

/// Description of a number field.
#[derive(Clone, Copy, Debug)]
pub struct NumberField<'a> {
    /// Name for assistive technology and in messages.
    pub name: &'a str,
    /// Label in front of the number.
    pub label: &'a str,
    /// Unit of the number.
    pub unit: &'a str,
    /// Least and largest value; infinite without a limit.
    pub range: [f64; 2],
    /// Change per point of drag.
    pub speed: f64,
    /// Decimals shown, at most.
    pub decimals: usize,
    /// Whether the number is an integer.
    pub whole: bool,
    /// Tooltip.
    pub tip: &'a str,
}

/// Draws a number to drag or type; returns the new value after a change, and whether it is being dragged.
pub fn drag_value(ui: &mut Ui, field: &NumberField<'_>, value: f64, out: &mut Outbox) -> Option<(f64, bool)> {
    // A value from a file may be out of range; it stays until it is edited.
    let [low, high] = [field.range[0].min(value), field.range[1].max(value)];
    let typed = TypedText::default();
    let formatter = ui.style().number_formatter.clone();
    let mut changed = value;
    let mut editor = egui::DragValue::new(&mut changed)
        .speed(field.speed)
        .range(low..=high)
        .clamp_existing_to_range(false)
        .max_decimals(if field.whole { 0 } else { field.decimals })
        .custom_formatter(|number, decimals| typed.record_shown(formatter.format(number, decimals)))
        .custom_parser(|text| typed.parse(text, value));
    if !field.label.is_empty() {
        editor = editor.prefix(format!("{} ", field.label));
    }
    let unit = if field.unit.is_empty() { String::new() } else { format!(" ({})", field.unit) };
    let response = ui.add(editor).with_tooltip(format!("{}{unit}", field.tip));
    named(&response, Role::SpinButton, field.name);
    if response.drag_stopped() {
        out.push(Message::EndGesture);
    }
    // The editor does not clamp input by keys or assistive technology.
    let mut accepted = if changed.is_finite() { changed.clamp(low, high) } else { value };
    if field.whole && accepted != value {
        accepted = accepted.round();
    }
    if let Some(text) = rejection(field, [low, high], &response, &typed, [value, changed, accepted]) {
        out.push(Message::InputRejected(RejectedInput { name: field.name.to_owned(), text }));
    }
    (response.changed() && accepted != value).then(|| (accepted, response.dragged()))
}

/// Why an edit was not accepted as given, if so.
fn rejection(
    field: &NumberField<'_>,
    [low, high]: [f64; 2],
    response: &Response,
    typed: &TypedText,
    [value, changed, accepted]: [f64; 3],
) -> Option<String> {
    let unit = if field.unit.is_empty() { String::new() } else { format!(" {}", field.unit) };
    let range = match [low, high].map(f64::is_finite) {
        [true, true] => format!("{low} to {high}{unit}"),
        [true, false] => format!("{low}{unit} or more"),
        [false, true] => format!("{high}{unit} or less"),
        [false, false] => "any finite number".to_owned(),
    };
    let entered = typed.number.get().unwrap_or(changed);
    if !(low..=high).contains(&entered) {
        return Some(format!("{entered} is not within its range, {range}: {accepted} is used"));
    }
    if field.whole && !response.dragged() && entered.fract() != 0.0 && entered != value {
        return Some(format!("{entered} is not an integer ({range}): {accepted} is used"));
    }
    let drag = response.drag_delta().x - response.drag_delta().y;
    if response.dragged() && ((drag > 0.0 && accepted >= high) || (drag < 0.0 && accepted <= low)) {
        return Some(format!("at the end of its range, {range}"));
    }
    let text = typed.invalid.borrow();
    // Only when the field loses focus: while typing, half a number is not one either.
    text.as_ref()
        .filter(|_| response.lost_focus())
        .map(|text| format!("\"{text}\" is not a number: {value} is kept ({range})"))
}

/// Text typed into a field during one pass.
#[derive(Default)]
struct TypedText {
    /// The typed number.
    number: Cell<Option<f64>>,
    /// Typed text that is not a number.
    invalid: RefCell<Option<String>>,
    /// The formatted value.
    shown: RefCell<String>,
}

impl TypedText {
    fn record_shown(&self, text: String) -> String {
        self.shown.replace(text.clone());
        text
    }

    /// Parses typed text. Unchanged text gives the value itself, which may have more digits than shown.
    fn parse(&self, text: &str, value: f64) -> Option<f64> {
        if text == *self.shown.borrow() {
            return Some(value);
        }
        let plain: String = text
            .chars()
            .filter(|c| !c.is_whitespace())
            .map(|c| if c == '\u{2212}' { '-' } else { c })
            .collect();
        let number = plain.parse().ok().filter(|number: &f64| !number.is_nan());
        self.number.set(number);
        if number.is_none() {
            self.invalid.replace(Some(text.to_owned()));
        }
        number
    }
}

/// Draws a logarithmic slider with its number; returns the value, clamped to the range.
pub fn slider(ui: &mut Ui, field: &NumberField<'_>, value: f64, out: &mut Outbox) -> f64 {
    let [low, high] = field.range;
    let mut changed = value;
    let editor =
        egui::Slider::new(&mut changed, low..=high).logarithmic(true).clamping(SliderClamping::Never);
    let response = ui
        .add(editor.prefix(field.label).suffix(field.unit).max_decimals(field.decimals))
        .with_tooltip(field.tip);
    named(&response, Role::Slider, field.name);
    let accepted = if changed.is_finite() { changed.clamp(low, high) } else { value };
    if accepted != changed {
        let text = format!("{changed} is not within {low} to {high}: {accepted} is used");
        out.push(Message::InputRejected(RejectedInput { name: field.name.to_owned(), text }));
    }
    accepted
}
