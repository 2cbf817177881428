//! The menu line: files, undo and redo, status; and the prompts.

use std::path::PathBuf;

use eframe::egui::{self, Context, Role, Ui};

use super::{
    tooltips::{TooltipPlacement, WithTooltip},
    widgets::named,
};
use crate::{
    document::Document,
    message::{Message, Outbox, PathPrompt},
    state::{State, UnsavedPrompt, dropped_files::PICTURE_USES},
};

/// Least width of a message in the line, points.
const MIN_MESSAGE_WIDTH: f32 = 160.0;

/// Draws the menu line.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    TooltipPlacement::Below(ui.max_rect().y_range()).set(ui.ctx());
    ui.horizontal_wrapped(|ui| {
        if ui.button("Open").with_tooltip("open a scenario (Ctrl O), or drop one on the window").clicked() {
            out.push(Message::Prompt(Some(open_prompt(state))));
        }
        ui.add_enabled_ui(state.document.is_some(), |ui| file_buttons(ui, state, out));
        ui.separator();
        let [can_undo, can_redo] = state.document.as_ref().map_or([false; 2], Document::can_undo_redo);
        if ui.add_enabled(can_undo, egui::Button::new("Undo")).with_tooltip("Ctrl Z").clicked() {
            out.push(Message::Undo);
        }
        if ui.add_enabled(can_redo, egui::Button::new("Redo")).with_tooltip("Ctrl Shift Z").clicked() {
            out.push(Message::Redo);
        }
        ui.separator();
        let dark = ui.visuals().dark_mode;
        if ui.button(if dark { "Light" } else { "Dark" }).with_tooltip("theme of the window").clicked() {
            ui.ctx().set_theme(if dark { egui::Theme::Light } else { egui::Theme::Dark });
        }
        if ui.button("?").with_tooltip("keyboard shortcuts").clicked() {
            out.push(Message::ShowShortcuts(!state.shows_shortcuts));
        }
        ui.separator();
        status(ui, state);
    });
}

fn file_buttons(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(document) = &state.document else {
        ui.label("nothing open");
        return;
    };
    if ui.button("Save").with_tooltip("save under a name of your choice (Ctrl S)").clicked() {
        out.push(Message::Prompt(Some(save_prompt(document))));
    }
    if ui.button("Reload").with_tooltip("read log, terrain and pictures again").clicked() {
        out.push(Message::Reload);
    }
    ui.menu_button("Copy", |ui| {
        if ui.button("as TOML").clicked() {
            out.push(Message::CopyToml);
        }
        if ui.button("as command line").clicked() {
            out.push(Message::CopyCommand);
        }
    });
}

/// File name, warnings, render times, rejected input, confirmation.
fn status(ui: &mut Ui, state: &State) {
    if let Some(document) = &state.document {
        let name = document
            .path
            .file_name()
            .map_or_else(|| document.path.display().to_string(), |name| name.to_string_lossy().into_owned());
        let mark = if document.is_unsaved() { " (changed)" } else { "" };
        ui.label(format!("{name}{mark}")).with_tooltip(document.path.display().to_string());
    }
    warnings(ui, state);
    let time = |label: &str, ms: Option<f64>| ms.map(|ms| format!("{label} {ms:.0} ms"));
    let times: Vec<String> = [time("frame", state.engine.full_ms), time("preview", state.engine.preview_ms)]
        .into_iter()
        .flatten()
        .collect();
    ui.weak(times.join(", ")).with_tooltip(format!("rendered on {}", state.engine.adapter));
    if let Some(rejected) = &state.rejected_input {
        ui.separator();
        let text = egui::RichText::new(format!("{}: {}", rejected.name, rejected.text))
            .color(ui.visuals().warn_fg_color);
        // Truncated to the rest of the line, so that panes do not move.
        let width = ui.available_size_before_wrap().x.max(MIN_MESSAGE_WIDTH);
        ui.allocate_ui(egui::vec2(width, ui.spacing().interact_size.y), |ui| {
            ui.add(egui::Label::new(text).truncate())
        });
    }
    if let Some(status) = &state.status {
        ui.separator();
        ui.label(&status.text);
        let remaining_s = status.until_s - ui.input(|input| input.time);
        ui.ctx().request_repaint_after_secs(remaining_s.max(0.0) as f32 + 0.01);
    }
}

/// The warnings that `camsim render` prints for the scenario: their number, and a menu that lists them.
fn warnings(ui: &mut Ui, state: &State) {
    let warnings = state.engine.loaded.as_ref().map_or(&[][..], |loaded| &loaded.warnings);
    if warnings.is_empty() {
        return;
    }
    let text =
        if let [_] = warnings { "1 warning".to_owned() } else { format!("{} warnings", warnings.len()) };
    let color = ui.visuals().warn_fg_color;
    ui.menu_button(egui::RichText::new(text).color(color), |ui| {
        ui.set_max_width(420.0);
        for warning in warnings {
            ui.add(egui::Label::new(egui::RichText::new(warning).color(color)).wrap());
        }
    });
}

/// Prompt for a scenario to open, beginning in the folder of the open one.
pub fn open_prompt(state: &State) -> PathPrompt {
    let folder = state
        .document
        .as_ref()
        .and_then(|document| document.path.parent())
        .map_or(String::new(), |folder| folder.display().to_string());
    PathPrompt { saves: false, path: folder }
}

/// Prompt for the file to save to.
pub fn save_prompt(document: &Document) -> PathPrompt {
    PathPrompt { saves: true, path: document.path.display().to_string() }
}

/// Draws the prompts that are open.
pub fn windows(context: &Context, state: &State, out: &mut Outbox) {
    if let Some(path_prompt) = &state.path_prompt {
        path_modal(context, path_prompt, &state.recent, out);
    }
    if let (Some(unsaved_prompt), Some(document)) = (&state.unsaved_prompt, &state.document) {
        unsaved_modal(context, unsaved_prompt, document, out);
    }
    if let Some(path) = &state.dropped_picture {
        egui::Modal::new(egui::Id::unique("dropped picture")).show(context, |ui| {
            ui.label(format!("Use {} as", path.display()));
            for (label, key) in PICTURE_USES {
                if ui.button(label).with_tooltip(key).clicked() {
                    out.push(Message::UsePicture(Some(key)));
                }
            }
            if ui.button("nothing").clicked() {
                out.push(Message::UsePicture(None));
            }
        });
    }
}

/// Asks whether to discard unsaved changes.
fn unsaved_modal(context: &Context, unsaved_prompt: &UnsavedPrompt, document: &Document, out: &mut Outbox) {
    let modal = egui::Modal::new(egui::Id::unique("unsaved")).show(context, |ui| {
        ui.heading("Unsaved changes");
        ui.label(format!("{} has unsaved changes.", document.path.display()));
        ui.horizontal(|ui| {
            if ui.button("Save as").with_tooltip("asks for a file name").clicked() {
                out.extend([Message::CancelLeaving, Message::Prompt(Some(save_prompt(document)))]);
            }
            let (text, message) = match unsaved_prompt {
                UnsavedPrompt::Open(path) => {
                    ("Open without saving", Some(Message::OpenDiscarding(path.clone())))
                }
                UnsavedPrompt::Close => ("Close without saving", None),
            };
            if ui.button(text).clicked() {
                match message {
                    Some(message) => out.push(message),
                    None => context.send_viewport_cmd(egui::ViewportCommand::Close),
                }
            }
            if ui.button("Cancel").clicked() {
                out.push(Message::CancelLeaving);
            }
        });
    });
    if modal.should_close() {
        out.push(Message::CancelLeaving);
    }
}

/// Asks for a path.
fn path_modal(context: &Context, path_prompt: &PathPrompt, recent: &[PathBuf], out: &mut Outbox) {
    let mut path = path_prompt.path.clone();
    let (mut done, mut open) = (false, true);
    let title = if path_prompt.saves { "Save scenario" } else { "Open scenario" };
    let modal = egui::Modal::new(egui::Id::unique("path")).show(context, |ui| {
        ui.heading(title);
        let edit = ui.add(
            egui::TextEdit::singleline(&mut path).desired_width(460.0).hint_text("path of a .toml file"),
        );
        named(&edit, Role::TextInput, "path");
        if !edit.has_focus() && !edit.lost_focus() {
            edit.request_focus();
        }
        done = edit.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if !path_prompt.saves {
            entries(ui, &mut path, &mut done);
            if !recent.is_empty() {
                ui.weak("recent files");
            }
            for file in recent {
                if ui.link(file.display().to_string()).clicked() {
                    path = file.display().to_string();
                    done = true;
                }
            }
        }
        if path_prompt.saves && std::path::Path::new(&path).is_file() {
            ui.label(
                egui::RichText::new("this file exists and will be replaced")
                    .color(ui.visuals().warn_fg_color),
            );
        }
        ui.horizontal(|ui| {
            done |= ui.button(if path_prompt.saves { "Save here" } else { "Open this" }).clicked();
            if ui.button("Browse...").with_tooltip("the desktop's own file dialog").clicked() {
                out.push(Message::Browse);
            }
            open = !ui.button("Cancel").clicked();
        });
    });
    if done && !path.is_empty() {
        out.push(if path_prompt.saves { Message::Save(path.into()) } else { Message::Open(path.into()) });
    } else if !open || modal.should_close() {
        out.push(Message::Prompt(None));
    } else if path != path_prompt.path {
        out.push(Message::Prompt(Some(PathPrompt { path, ..path_prompt.clone() })));
    }
}

/// Lists folders and scenarios in the typed folder.
fn entries(ui: &mut Ui, path: &mut String, done: &mut bool) {
    let typed = PathBuf::from(&*path);
    let folder = if typed.is_dir() { Some(typed.clone()) } else { typed.parent().map(PathBuf::from) };
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else { return };
    let mut listed: Vec<(bool, PathBuf)> = std::fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| (entry.path().is_dir(), entry.path()))
        .filter(|(is_folder, path)| *is_folder || path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    listed.sort();
    listed.reverse();
    egui::ScrollArea::vertical().max_height(200.0).show(ui, |ui| {
        if let Some(parent) = folder
            .parent()
            .filter(|_| ui.selectable_label(false, "..").with_tooltip("the folder above").clicked())
        {
            *path = parent.display().to_string();
        }
        listed.sort_by(|a, b| (b.0, &a.1).cmp(&(a.0, &b.1)));
        for (is_folder, entry) in listed {
            let name = entry.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let shown = if is_folder { format!("{name}/") } else { name };
            if ui.selectable_label(entry == typed, shown).clicked() {
                *path = entry.display().to_string();
                *done = !is_folder;
            }
        }
    });
}
