//! Faults, problems of the scenario, notices and progress, above the picture.

use eframe::egui;

use super::widgets::{small_button, waiting};
use crate::{
    message::{Message, Outbox},
    state::State,
};

/// Draws the lines above the picture.
pub fn show(ui: &mut egui::Ui, state: &State, out: &mut Outbox) {
    if let Some(fault) = &state.engine.fault {
        line(ui, fault, true);
    }
    for problem in state.document.iter().flat_map(|document| &document.problems).take(3) {
        line(ui, &problem.to_string(), true);
    }
    for (index, notice) in state.notices.iter().enumerate() {
        ui.horizontal(|ui| {
            let name = format!("dismiss: {notice}");
            if small_button(ui, "x", &name, &name) {
                out.push(Message::Dismiss(index));
            }
            line(ui, notice, false);
        });
    }
    if !state.engine.busy.is_empty() {
        ui.horizontal(|ui| {
            waiting(ui);
            let seconds = state.engine.busy_since.map_or(0, |since| since.elapsed().as_secs());
            let elapsed = if seconds > 0 { format!(" ({seconds} s)") } else { String::new() };
            ui.label(format!("{}{elapsed}", state.engine.busy));
        });
    }
}

fn line(ui: &mut egui::Ui, text: &str, is_fault: bool) {
    let color = if is_fault { ui.visuals().error_fg_color } else { ui.visuals().warn_fg_color };
    ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
}
