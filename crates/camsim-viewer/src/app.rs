//! The window: panes around a picture, wishes to the state, requests to the engine.

use std::{
    path::PathBuf,
    sync::{Arc, Weak},
    time::Duration,
};

use camsim_core::sequence::Sequence;
use eframe::egui;

use crate::{
    drop,
    engine::{ExactWanted, Handle, Picture, Wanted},
    export::Exporter,
    fonts,
    message::{Message, Outbox},
    panes,
    pulse::Pulse,
    settings::Settings,
    sheet,
    state::{Leaving, State},
};

/// Under which settings are stored.
const SETTINGS_KEY: &str = "camsim";
/// Wait between two looks at the clock while frames play, at most.
const FRAME: Duration = Duration::from_millis(16);

/// The viewer.
pub struct Viewer {
    /// All that panes see.
    pub state: State,
    engine: Handle,
    asked: Option<Wanted>,
    /// What the oracle was asked for, to ask once.
    asked_exact: Option<ExactKey>,
    pulse: Option<Pulse>,
    title: String,
}

/// A request to the oracle by what tells it from others.
#[derive(Debug)]
struct ExactKey {
    sequence: Weak<Sequence>,
    frame: Option<u64>,
    against: Option<(Weak<Picture>, f32)>,
}

impl ExactKey {
    fn of(wanted: &ExactWanted) -> Self {
        let against = wanted.against.as_ref().map(|(picture, gain)| (Arc::downgrade(picture), *gain));
        Self { sequence: Arc::downgrade(&wanted.sequence), frame: wanted.frame, against }
    }

    fn is(&self, other: &Self) -> bool {
        let same_against = match (&self.against, &other.against) {
            (Some((a, gain)), Some((b, other))) => a.ptr_eq(b) && gain.to_bits() == other.to_bits(),
            (None, None) => true,
            _ => false,
        };
        same_against && self.sequence.ptr_eq(&other.sequence) && self.frame == other.frame
    }
}

impl Viewer {
    /// Starts the engine; `scenario` is opened at once.
    pub fn new(
        context: &egui::Context,
        scenario: Option<PathBuf>,
        settings: Settings,
        exporter: Option<Exporter>,
    ) -> Self {
        panes::tips::unhurried(context);
        fonts::install(context);
        let repaint = context.clone();
        let engine = Handle::start(move || repaint.request_repaint());
        let mut state = State::new(settings, exporter);
        if let Some(path) = scenario {
            state.open(path);
        }
        Self { state, engine, asked: None, asked_exact: None, pulse: Pulse::from_env(), title: String::new() }
    }

    /// As eframe starts it, with what was remembered.
    pub fn restored(
        creation: &eframe::CreationContext<'_>,
        scenario: Option<PathBuf>,
        exporter: Option<Exporter>,
    ) -> Self {
        if let Some(render) = &creation.wgpu_render_state {
            sheet::register(&creation.egui_ctx, render);
        }
        let settings = creation
            .storage
            .and_then(|storage| eframe::get_value::<Settings>(storage, SETTINGS_KEY))
            .unwrap_or_default();
        Self::new(&creation.egui_ctx, scenario, settings, exporter)
    }

    /// One pass: hears, draws, does what panes wish, asks.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        self.listen(&context);
        panes::shortcuts::listen(&context, &mut self.state);
        let mut out = Outbox::new();
        take_drops(&context, &mut out);
        self.guard_close(&context, &mut out);
        out.extend(self.state.browsed());
        panes::show(ui, &self.state, &mut out);
        // What is told of an edit stands after it, since edits take away what was told before.
        out.sort_by_key(|message| matches!(message, Message::Refused(_)));
        out.into_iter().for_each(|message| self.state.apply(message, &context));
        self.ask();
        self.name_window(&context);
        self.plan_repaint(&context);
        if let Some(pulse) = &mut self.pulse {
            pulse.beat(&self.state, &context);
        }
    }

    /// What goes on also while the window is hidden.
    fn listen(&mut self, context: &egui::Context) {
        self.state.tick(context.input(|input| input.time));
        let replies: Vec<_> = self.engine.replies().collect();
        replies.into_iter().for_each(|reply| self.state.hear(reply, context));
    }

    fn ask(&mut self) {
        let wanted = self.state.wanted();
        if let Some(wanted) = &wanted
            && self.asked.as_ref() != Some(wanted)
        {
            self.engine.want(wanted.clone());
        }
        self.asked = wanted;
        let Some(exact) = self.state.wanted_exact() else { return };
        let key = ExactKey::of(&exact);
        if !self.asked_exact.as_ref().is_some_and(|asked| asked.is(&key)) {
            self.engine.want_exact(exact);
            self.asked_exact = Some(key);
        }
    }

    /// Changes are not lost by a wrong click: a second wish to close, out of the question about them, is
    /// obeyed.
    fn guard_close(&self, context: &egui::Context, out: &mut Outbox) {
        if context.input(|input| input.viewport().close_requested())
            && self.state.is_unsaved()
            && self.state.leaving != Some(Leaving::Closing)
        {
            context.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            out.push(Message::Close);
        }
    }

    /// The file's name stands in the title, for whoever has several windows.
    fn name_window(&mut self, context: &egui::Context) {
        let name = self
            .state
            .document
            .as_ref()
            .and_then(|document| document.path.file_name())
            .map(|name| name.to_string_lossy().into_owned());
        let mark = if self.state.is_unsaved() { "*" } else { "" };
        let title = name.map_or_else(|| "camsim".to_owned(), |name| format!("{name}{mark} - camsim"));
        if title != self.title {
            context.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn plan_repaint(&self, context: &egui::Context) {
        if self.state.timeline.playing {
            context.request_repaint_after(FRAME);
        } else if let Some(rest_s) = self.state.rests_in_s() {
            context.request_repaint_after_secs(rest_s as f32 + 0.001);
        }
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, SETTINGS_KEY, &self.state.settings());
    }
}

fn take_drops(context: &egui::Context, out: &mut Outbox) {
    let dropped = context.input(|input| input.raw.dropped_files.clone());
    let mut paths: Vec<PathBuf> = dropped.iter().map(|file| file.path().to_path_buf()).collect();
    paths.sort_by_key(|path| drop::rank(path));
    out.extend(paths.into_iter().map(Message::Drop));
}
