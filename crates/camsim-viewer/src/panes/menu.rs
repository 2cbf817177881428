//! The line at the top: files, steps, what is rendered on.

use std::path::PathBuf;

use eframe::egui::{self, Context, Role, Ui};

use super::{
    tips::{Aside, Explained},
    widgets::named,
};
use crate::{
    document::Document,
    drop::PICTURE_USES,
    message::{Message, Outbox, Question},
    state::{Leaving, State},
};

/// Points of a line that something is still told in.
const SHORTEST: f32 = 160.0;

/// The line.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    Aside::Below(ui.max_rect().y_range()).set(ui.ctx());
    ui.horizontal_wrapped(|ui| {
        if ui.button("Open").explained("a scenario (Ctrl O), or drop one on the window").clicked() {
            out.push(Message::Ask(Some(open_question(state))));
        }
        ui.add_enabled_ui(state.document.is_some(), |ui| file_buttons(ui, state, out));
        ui.separator();
        let [can_undo, can_redo] = state.document.as_ref().map_or([false; 2], Document::steps);
        if ui.add_enabled(can_undo, egui::Button::new("Undo")).explained("Ctrl Z").clicked() {
            out.push(Message::Undo);
        }
        if ui.add_enabled(can_redo, egui::Button::new("Redo")).explained("Ctrl Shift Z").clicked() {
            out.push(Message::Redo);
        }
        ui.separator();
        let dark = ui.visuals().dark_mode;
        if ui.button(if dark { "Light" } else { "Dark" }).explained("colours of the window").clicked() {
            ui.ctx().set_theme(if dark { egui::Theme::Light } else { egui::Theme::Dark });
        }
        if ui.button("?").explained("keyboard shortcuts").clicked() {
            out.push(Message::Help(!state.help));
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
    if ui.button("Save").explained("under a name of your choice (Ctrl S)").clicked() {
        out.push(Message::Ask(Some(save_question(document))));
    }
    if ui.button("Reload").explained("read log, terrain and pictures again").clicked() {
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

fn status(ui: &mut Ui, state: &State) {
    if let Some(document) = &state.document {
        let name = document
            .path
            .file_name()
            .map_or_else(|| document.path.display().to_string(), |name| name.to_string_lossy().into_owned());
        let mark = if document.is_unsaved() { " (changed)" } else { "" };
        ui.label(format!("{name}{mark}")).explained(document.path.display().to_string());
    }
    warnings(ui, state);
    let time = |what: &str, ms: Option<f64>| ms.map(|ms| format!("{what} {ms:.0} ms"));
    let times: Vec<String> = [time("frame", state.heard.full_ms), time("preview", state.heard.preview_ms)]
        .into_iter()
        .flatten()
        .collect();
    ui.weak(times.join(", ")).explained(format!("rendered on {}", state.heard.adapter));
    if let Some(refusal) = &state.refused {
        ui.separator();
        let text = egui::RichText::new(format!("{}: {}", refusal.name, refusal.text))
            .color(ui.visuals().warn_fg_color);
        // In what is left of the line: panes do not jump for it.
        let room = ui.available_size_before_wrap().x.max(SHORTEST);
        ui.allocate_ui(egui::vec2(room, ui.spacing().interact_size.y), |ui| {
            ui.add(egui::Label::new(text).truncate())
        });
    }
    if let Some(news) = &state.news {
        ui.separator();
        ui.label(&news.text);
        let left_s = news.until_s - ui.input(|input| input.time);
        ui.ctx().request_repaint_after_secs(left_s.max(0.0) as f32 + 0.01);
    }
}

/// What `camsim render` would say of the scenario before it renders: how many, and which for whoever asks.
fn warnings(ui: &mut Ui, state: &State) {
    let warnings = state.heard.loaded.as_ref().map_or(&[][..], |loaded| &loaded.warnings);
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

/// Asks for what to open; begins in the folder of what is open.
pub fn open_question(state: &State) -> Question {
    let folder = state
        .document
        .as_ref()
        .and_then(|document| document.path.parent())
        .map_or(String::new(), |folder| folder.display().to_string());
    Question { saves: false, path: folder }
}

/// Asks where to save.
pub fn save_question(document: &Document) -> Question {
    Question { saves: true, path: document.path.display().to_string() }
}

/// Windows of this pane.
pub fn windows(context: &Context, state: &State, out: &mut Outbox) {
    if let Some(question) = &state.question {
        ask(context, question, &state.recent, out);
    }
    if let (Some(leaving), Some(document)) = (&state.leaving, &state.document) {
        unsaved(context, leaving, document, out);
    }
    if let Some(path) = &state.dropped_picture {
        egui::Modal::new(egui::Id::unique("dropped picture")).show(context, |ui| {
            ui.label(format!("Use {} as", path.display()));
            for (what, key) in PICTURE_USES {
                if ui.button(what).explained(key).clicked() {
                    out.push(Message::UsePicture(Some(key)));
                }
            }
            if ui.button("nothing").clicked() {
                out.push(Message::UsePicture(None));
            }
        });
    }
}

fn unsaved(context: &Context, leaving: &Leaving, document: &Document, out: &mut Outbox) {
    let modal = egui::Modal::new(egui::Id::unique("unsaved")).show(context, |ui| {
        ui.heading("Changes that are not saved");
        ui.label(format!("{} has changes that are in no file.", document.path.display()));
        ui.horizontal(|ui| {
            if ui.button("Save as").explained("asks for a name; what you wanted is then asked anew").clicked()
            {
                out.extend([Message::Stay, Message::Ask(Some(save_question(document)))]);
            }
            let (text, wish) = match leaving {
                Leaving::For(path) => ("Open without saving", Some(Message::OpenAnyway(path.clone()))),
                Leaving::Closing => ("Close without saving", None),
            };
            if ui.button(text).clicked() {
                match wish {
                    Some(wish) => out.push(wish),
                    None => context.send_viewport_cmd(egui::ViewportCommand::Close),
                }
            }
            if ui.button("Cancel").clicked() {
                out.push(Message::Stay);
            }
        });
    });
    if modal.should_close() {
        out.push(Message::Stay);
    }
}

fn ask(context: &Context, question: &Question, recent: &[PathBuf], out: &mut Outbox) {
    let mut path = question.path.clone();
    let (mut done, mut open) = (false, true);
    let title = if question.saves { "Save scenario" } else { "Open scenario" };
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
        if !question.saves {
            entries(ui, &mut path, &mut done);
            if !recent.is_empty() {
                ui.weak("opened lately");
            }
            for file in recent {
                if ui.link(file.display().to_string()).clicked() {
                    path = file.display().to_string();
                    done = true;
                }
            }
        }
        if question.saves && std::path::Path::new(&path).is_file() {
            ui.label(
                egui::RichText::new("this file is there already and will be replaced")
                    .color(ui.visuals().warn_fg_color),
            );
        }
        ui.horizontal(|ui| {
            done |= ui.button(if question.saves { "Save here" } else { "Open this" }).clicked();
            if ui.button("Browse...").explained("the desktop's own file dialog").clicked() {
                out.push(Message::Browse);
            }
            open = !ui.button("Cancel").clicked();
        });
    });
    if done && !path.is_empty() {
        out.push(if question.saves { Message::Save(path.into()) } else { Message::Open(path.into()) });
    } else if !open || modal.should_close() {
        out.push(Message::Ask(None));
    } else if path != question.path {
        out.push(Message::Ask(Some(Question { path, ..question.clone() })));
    }
}

/// Folders and scenarios in the folder that is typed.
fn entries(ui: &mut Ui, path: &mut String, done: &mut bool) {
    let typed = PathBuf::from(&*path);
    let folder = if typed.is_dir() { Some(typed.clone()) } else { typed.parent().map(PathBuf::from) };
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else { return };
    let mut found: Vec<(bool, PathBuf)> = std::fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| (entry.path().is_dir(), entry.path()))
        .filter(|(is_folder, path)| *is_folder || path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    found.sort();
    found.reverse();
    egui::ScrollArea::vertical().max_height(200.0).show(ui, |ui| {
        if let Some(parent) = folder
            .parent()
            .filter(|_| ui.selectable_label(false, "..").explained("the folder above").clicked())
        {
            *path = parent.display().to_string();
        }
        found.sort_by(|a, b| (b.0, &a.1).cmp(&(a.0, &b.1)));
        for (is_folder, entry) in found {
            let name = entry.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let shown = if is_folder { format!("{name}/") } else { name };
            if ui.selectable_label(entry == typed, shown).clicked() {
                *path = entry.display().to_string();
                *done = !is_folder;
            }
        }
    });
}
