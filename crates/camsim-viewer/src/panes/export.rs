//! Rendering a range of frames to files, as `camsim render` does.

use eframe::egui::{self, Role, Ui};

use super::widgets::named;
use crate::{
    message::{ExportWish, Message, Outbox},
    state::State,
};

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(document) = &state.document else {
        ui.label("nothing open");
        return;
    };
    if !state.can_export() {
        ui.label("this window was opened without a renderer to files; use `camsim render`");
        return;
    }
    ui.label("Renders frames to files with every channel and format that [output] names, as `camsim render` does.");
    // Another scenario's frames go beside that one.
    let id = egui::Id::unique(("export folder", &document.path));
    let start = || document.path.parent().unwrap_or(std::path::Path::new("")).join("frames").display().to_string();
    let mut folder = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_else(start);
    let edit = ui.add(egui::TextEdit::singleline(&mut folder).desired_width(f32::INFINITY).hint_text("folder"));
    named(&edit, Role::TextInput, "folder");
    ui.data_mut(|data| data.insert_temp(id, folder.clone()));
    let [first, last] = state.timeline.bounds();
    let frames = [first, last + 1];
    ui.label(match state.timeline.range {
        Some(_) => format!("frames {first} to {last}, the loop's"),
        None => format!("all {} frames; set a loop in the timeline for fewer", last + 1),
    });
    let running = state.export.as_ref().is_some_and(|job| job.progress().ended.is_none());
    let may_start = !running && !folder.is_empty() && state.timeline.frames > 0 && document.problems.is_empty();
    if ui.add_enabled(may_start, egui::Button::new("Render")).on_hover_text("to this folder").clicked() {
        out.push(Message::Export(ExportWish { folder: folder.into(), frames }));
    }
    progress(ui, state, out);
}

fn progress(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(job) = &state.export else { return };
    let progress = job.progress();
    let all = job.frames[1].saturating_sub(job.frames[0]).max(1);
    match progress.ended {
        None => {
            let share = progress.done as f32 / all as f32;
            let left = job.left_s().map_or_else(String::new, |left_s| format!(", about {} left", span(left_s)));
            ui.add(egui::ProgressBar::new(share).text(format!("{} of {all} frames{left}", progress.done)));
            let text = if job.is_cancelled() { "stopping" } else { "Cancel" };
            if ui.add_enabled(!job.is_cancelled(), egui::Button::new(text)).clicked() {
                out.push(Message::CancelExport);
            }
        }
        Some(Ok(text)) => {
            ui.label(text);
        }
        Some(Err(text)) if job.is_cancelled() => {
            ui.label(text);
        }
        Some(Err(text)) => {
            ui.label(egui::RichText::new(text).color(ui.visuals().error_fg_color));
        }
    }
}

/// A time that nobody needs to the second.
fn span(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::span;

    #[test]
    fn times_are_told_as_people_do() {
        assert_eq!([0.2, 89.0, 91.0, 3600.0, 9000.0].map(span), ["0 s", "89 s", "2 min", "60 min", "2.5 h"]);
    }
}
