//! Faults and news, above the picture: what went wrong is told where one looks, and nothing disappears
//! unread.

use eframe::egui;

use super::{
    tips::Explained,
    widgets::{named, waiting},
};
use crate::{
    message::{Message, Outbox},
    state::State,
};

/// Lines above the picture.
pub fn show(ui: &mut egui::Ui, state: &State, out: &mut Outbox) {
    if let Some(fault) = &state.heard.fault {
        line(ui, fault, true);
    }
    for problem in state.document.iter().flat_map(|document| &document.problems).take(3) {
        line(ui, &problem.to_string(), true);
    }
    for (at, notice) in state.notices.iter().enumerate() {
        ui.horizontal(|ui| {
            let name = format!("dismiss: {notice}");
            let dismiss = ui.small_button("x").explained(&name);
            named(&dismiss, egui::Role::Button, &name);
            if dismiss.clicked() {
                out.push(Message::Dismiss(at));
            }
            line(ui, notice, false);
        });
    }
    if !state.heard.busy.is_empty() {
        ui.horizontal(|ui| {
            waiting(ui);
            let seconds = state.heard.busy_since.map_or(0, |since| since.elapsed().as_secs());
            let so_far = if seconds > 0 { format!(" ({seconds} s)") } else { String::new() };
            ui.label(format!("{}{so_far}", state.heard.busy));
        });
    }
}

fn line(ui: &mut egui::Ui, text: &str, is_fault: bool) {
    let color = if is_fault { ui.visuals().error_fg_color } else { ui.visuals().warn_fg_color };
    ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
}
