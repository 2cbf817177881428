//! The window.

use std::{path::PathBuf, sync::mpsc::Receiver};

use eframe::egui;

use crate::engine_thread::{self, Message};

/// State of the window: what the engine last said.
pub struct Viewer {
    messages: Receiver<Message>,
    status: String,
    failed: bool,
    picture: Option<egui::TextureHandle>,
}

impl Viewer {
    /// Starts the engine on a scenario.
    pub fn new(context: &egui::Context, path: PathBuf) -> Self {
        Self { messages: engine_thread::start(context.clone(), path), status: String::new(), failed: false, picture: None }
    }

    fn listen(&mut self, context: &egui::Context) {
        while let Ok(message) = self.messages.try_recv() {
            match message {
                Message::Progress(text) => self.status = text,
                Message::Failed(text) => {
                    self.status = text;
                    self.failed = true;
                }
                Message::Frame(image, caption) => {
                    self.picture = Some(context.load_texture("frame", *image, egui::TextureOptions::LINEAR));
                    self.status = caption;
                }
            }
        }
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.listen(&ui.ctx().clone());
        if self.failed {
            ui.colored_label(ui.visuals().error_fg_color, format!("error: {}", self.status));
        } else {
            ui.label(&self.status);
        }
        match &self.picture {
            Some(picture) => {
                ui.centered_and_justified(|ui| ui.add(egui::Image::new(picture).shrink_to_fit()));
            }
            None if !self.failed => {
                ui.spinner();
            }
            None => {}
        }
    }
}
