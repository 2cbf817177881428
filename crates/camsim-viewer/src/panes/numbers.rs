//! Numbers to drag or to type, each within its range. What is asked for beyond the range, or cannot be read,
//! is told: nothing is changed without a word.

use std::cell::{Cell, RefCell};

use eframe::egui::{self, Response, Role, SliderClamping, Ui};

use super::{tips::Explained, widgets::named};
use crate::message::{Message, Outbox, Refusal};

/// What a field is called, and what it takes.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    /// For assistive technology and in what is told.
    pub name: &'a str,
    /// In front of the number.
    pub label: &'a str,
    /// Of the number.
    pub unit: &'a str,
    /// From the least to the largest.
    pub range: [f64; 2],
    /// Change a point of drag.
    pub speed: f64,
    /// Digits behind the point that are shown, at most.
    pub decimals: usize,
    /// Whether the number is whole.
    pub whole: bool,
    /// What it means.
    pub tip: &'a str,
}

/// A number to drag or to type: the new one, and whether a hand still drags it.
pub fn number(ui: &mut Ui, field: &Field<'_>, value: f64, out: &mut Outbox) -> Option<(f64, bool)> {
    // What came from a file may lie beyond the range; it stays until a hand gives another.
    let [low, high] = [field.range[0].min(value), field.range[1].max(value)];
    let typed = Typed::default();
    let formatter = ui.style().number_formatter.clone();
    let mut changed = value;
    let mut editor = egui::DragValue::new(&mut changed)
        .speed(field.speed)
        .range(low..=high)
        .clamp_existing_to_range(false)
        .max_decimals(if field.whole { 0 } else { field.decimals })
        .custom_formatter(|number, decimals| typed.show(formatter.format(number, decimals)))
        .custom_parser(|text| typed.read(text, value));
    if !field.label.is_empty() {
        editor = editor.prefix(format!("{} ", field.label));
    }
    let unit = if field.unit.is_empty() { String::new() } else { format!(" ({})", field.unit) };
    let response = ui.add(editor).explained(format!("{}{unit}", field.tip));
    named(&response, Role::SpinButton, field.name);
    if response.drag_stopped() {
        out.push(Message::EndGesture);
    }
    // Keys and assistive technology are not held back by the editor.
    let mut kept = if changed.is_finite() { changed.clamp(low, high) } else { value };
    if field.whole && kept != value {
        kept = kept.round();
    }
    if let Some(text) = refusal(field, [low, high], &response, &typed, [value, changed, kept]) {
        out.push(Message::Refused(Refusal { name: field.name.to_owned(), text }));
    }
    (response.changed() && kept != value).then(|| (kept, response.dragged()))
}

/// What is to be told of an edit, if anything is.
fn refusal(
    field: &Field<'_>,
    [low, high]: [f64; 2],
    response: &Response,
    typed: &Typed,
    [value, changed, kept]: [f64; 3],
) -> Option<String> {
    let unit = if field.unit.is_empty() { String::new() } else { format!(" {}", field.unit) };
    let range = format!("{low} to {high}{unit}");
    let asked = typed.number.get().unwrap_or(changed);
    if !(low..=high).contains(&asked) {
        return Some(format!("{asked} is not within {range}: {kept} was taken"));
    }
    if field.whole && !response.dragged() && asked.fract() != 0.0 && asked != value {
        return Some(format!("{asked} is not a whole number ({range}): {kept} was taken"));
    }
    let push = response.drag_delta().x - response.drag_delta().y;
    if response.dragged() && ((push > 0.0 && kept >= high) || (push < 0.0 && kept <= low)) {
        return Some(format!("goes from {range}, no further"));
    }
    let text = typed.unread.borrow();
    // Half a number is none either: only what is left there counts.
    text.as_ref()
        .filter(|_| response.lost_focus())
        .map(|text| format!("\"{text}\" is not a number: {value} stays ({range})"))
}

/// What a hand has typed in a pass.
#[derive(Default)]
struct Typed {
    number: Cell<Option<f64>>,
    unread: RefCell<Option<String>>,
    shown: RefCell<String>,
}

impl Typed {
    fn show(&self, text: String) -> String {
        self.shown.replace(text.clone());
        text
    }

    /// Text that is still what was shown is the number itself: not all of its digits need be there.
    fn read(&self, text: &str, value: f64) -> Option<f64> {
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
            self.unread.replace(Some(text.to_owned()));
        }
        number
    }
}

/// A logarithmic slider with its number.
pub fn slider(ui: &mut Ui, field: &Field<'_>, value: f64, out: &mut Outbox) -> f64 {
    let [low, high] = field.range;
    let mut changed = value;
    let editor =
        egui::Slider::new(&mut changed, low..=high).logarithmic(true).clamping(SliderClamping::Never);
    let response = ui
        .add(editor.prefix(field.label).suffix(field.unit).max_decimals(field.decimals))
        .explained(field.tip);
    named(&response, Role::Slider, field.name);
    let kept = if changed.is_finite() { changed.clamp(low, high) } else { value };
    if kept != changed {
        let text = format!("{changed} is not within {low} to {high}: {kept} was taken");
        out.push(Message::Refused(Refusal { name: field.name.to_owned(), text }));
    }
    kept
}
