//! Rendering a range of frames to files, as `camsim render` does.

use camsim_core::scenario::Channel;
use eframe::egui::{self, RichText, Role, Ui};

use super::{
    number_field::{self, NumberField},
    parameters,
    tooltips::WithTooltip,
    widgets::named,
};
use crate::{
    message::{ExportRequest, Message, Outbox},
    state::State,
};

/// Settings of the page, stored per scenario from pass to pass.
#[derive(Clone)]
struct ExportSettings {
    /// Output folder.
    folder: String,
    /// First and last frame; `None` for the loop, or for all.
    frames: Option<[u64; 2]>,
}

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(document) = &state.document else {
        ui.label("nothing open");
        return;
    };
    if !state.can_export() {
        ui.label("this window has no exporter; use `camsim render`");
        return;
    }
    ui.label("Renders frames to files as `camsim render` does, by these keys of [output].");
    // The default folder is beside the scenario's file.
    let id = egui::Id::unique(("export", &document.path));
    let default_folder =
        || document.path.parent().unwrap_or(std::path::Path::new("")).join("frames").display().to_string();
    let mut settings = ui
        .data(|data| data.get_temp::<ExportSettings>(id))
        .unwrap_or_else(|| ExportSettings { folder: default_folder(), frames: None });
    let edit = ui.add(
        egui::TextEdit::singleline(&mut settings.folder).desired_width(f32::INFINITY).hint_text("folder"),
    );
    named(&edit, Role::TextInput, "folder");
    let [first, last] = frames(ui, state, &mut settings.frames, out);
    ui.data_mut(|data| data.insert_temp(id, settings.clone()));
    let request = ExportRequest { folder: settings.folder.into(), frames: [first, last + 1] };
    parameters::rows(ui, state, "output", out);
    let output = &document.scenario.output;
    if output.format.is_empty() {
        let text = "no file format: no pictures are written";
        ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
    } else if !output.channels.contains(&Channel::Color) {
        ui.weak("without the channel color no pictures are written");
    }
    let running = state.export.as_ref().is_some_and(|job| job.progress().ended.is_none());
    let may_start = !running
        && !request.folder.as_os_str().is_empty()
        && state.timeline.frames > 0
        && document.problems.is_empty();
    if ui.add_enabled(may_start, egui::Button::new("Render")).with_tooltip("render to this folder").clicked()
    {
        out.push(Message::Export(request.clone()));
    }
    progress(ui, state, out);
    egui::CollapsingHeader::new("as a command line").show(ui, |ui| {
        let removed_keys = document.removed_keys();
        if !removed_keys.is_empty() {
            ui.label(format!(
                "a command line cannot remove {}: save the scenario first",
                removed_keys.join(", ")
            ));
        }
        ui.add(
            egui::Label::new(
                RichText::new(document.render_command(&request.folder, Some(request.frames))).monospace(),
            )
            .wrap(),
        );
    });
}

/// Draws the choice of frames; returns the first and the last.
fn frames(ui: &mut Ui, state: &State, chosen: &mut Option<[u64; 2]>, out: &mut Outbox) -> [u64; 2] {
    let timeline = &state.timeline;
    let all_last = timeline.last();
    let [mut first, mut last] =
        chosen.map_or(timeline.bounds(), |frames| frames.map(|frame| frame.min(all_last)));
    ui.horizontal_wrapped(|ui| {
        ui.label("frames");
        let field = |name, tip| NumberField {
            name,
            label: "",
            unit: "",
            range: [0.0, all_last as f64],
            speed: 0.2,
            decimals: 0,
            whole: true,
            tip,
        };
        if let Some((frame, _)) =
            number_field::drag_value(ui, &field("first frame to render", "first frame"), first as f64, out)
        {
            first = frame as u64;
            last = last.max(first);
            *chosen = Some([first, last]);
        }
        ui.label("to");
        if let Some((frame, _)) = number_field::drag_value(
            ui,
            &field("last frame to render", "last frame, inclusive"),
            last as f64,
            out,
        ) {
            last = frame as u64;
            first = first.min(last);
            *chosen = Some([first, last]);
        }
        if chosen.is_some()
            && ui.small_button("as the timeline").with_tooltip("the loop's frames, or all").clicked()
        {
            *chosen = None;
        }
    });
    let count = last + 1 - first;
    ui.weak(match (chosen, timeline.range) {
        (Some(_), _) => format!("{count} of {} frames", timeline.frames),
        (None, Some(_)) => format!("{count} frames, the loop's"),
        (None, None) => {
            format!("all {} frames; set a loop in the timeline, or type, for fewer", timeline.frames)
        }
    });
    [first, last]
}

/// Progress and result of the last export.
fn progress(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(job) = &state.export else { return };
    let progress = job.progress();
    let all = job.pictures().max(1);
    let what = if job.rig.first().output.twin.is_empty() { "frames" } else { "pictures" };
    match progress.ended {
        None => {
            let fraction = progress.done as f32 / all as f32;
            let left = job
                .remaining_s()
                .map_or_else(String::new, |remaining_s| format!(", about {} left", duration(remaining_s)));
            ui.add(egui::ProgressBar::new(fraction).text(format!("{} of {all} {what}{left}", progress.done)));
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
            ui.label(RichText::new(text).color(ui.visuals().error_fg_color));
        }
    }
}

/// A duration with one or two digits.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn durations_have_suitable_units() {
        assert_eq!(
            [0.2, 89.0, 91.0, 3600.0, 9000.0].map(duration),
            ["0 s", "89 s", "2 min", "60 min", "2.5 h"]
        );
    }
}
