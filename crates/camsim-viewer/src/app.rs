//! The window: draws panes, applies their messages to the state, sends requests to the engine.

use std::{
    path::PathBuf,
    sync::{Arc, Weak},
    time::Duration,
};

use camsim_core::sequence::Sequence;
use eframe::egui;

use crate::{
    display_image,
    engine::{EngineHandle, FrameRequest, Picture, ReferenceRequest, Size},
    export::Exporter,
    fonts,
    frame_rate::FrameRateMonitor,
    message::{Message, Outbox},
    panes,
    settings::Settings,
    state::{State, UnsavedPrompt, dropped_files},
};

/// Key that settings are stored under.
const SETTINGS_KEY: &str = "camsim";
/// Time between repaints during play, at most.
const PLAY_INTERVAL: Duration = Duration::from_millis(16);

/// The viewer.
pub struct Viewer {
    /// What panes draw from.
    pub state: State,
    engine: EngineHandle,
    last_request: Option<FrameRequest>,
    /// The last request to the reference; equal ones are not sent again.
    last_reference_request: Option<ReferenceRequestKey>,
    frame_rate: Option<FrameRateMonitor>,
    title: String,
}

/// Identity of a request to the reference.
#[derive(Debug)]
struct ReferenceRequestKey {
    sequence: Weak<Sequence>,
    frame: Option<u64>,
    against: Option<(Weak<Picture>, f32)>,
}

impl ReferenceRequestKey {
    fn new(request: &ReferenceRequest) -> Self {
        let against = request.against.as_ref().map(|(picture, gain)| (Arc::downgrade(picture), *gain));
        Self { sequence: Arc::downgrade(&request.sequence), frame: request.frame, against }
    }

    fn equals(&self, other: &Self) -> bool {
        let same_against = match (&self.against, &other.against) {
            (Some((a, gain)), Some((b, other))) => a.ptr_eq(b) && gain.to_bits() == other.to_bits(),
            (None, None) => true,
            _ => false,
        };
        same_against && self.sequence.ptr_eq(&other.sequence) && self.frame == other.frame
    }
}

impl Viewer {
    /// Starts the engine, and opens `scenario` if there is one.
    pub fn new(
        context: &egui::Context,
        scenario: Option<PathBuf>,
        settings: Settings,
        exporter: Option<Exporter>,
    ) -> Self {
        panes::tooltips::configure(context);
        panes::colors::install(context);
        fonts::install(context);
        let repaint = context.clone();
        let engine = EngineHandle::start(move || repaint.request_repaint());
        let mut state = State::new(settings, exporter);
        if let Some(path) = scenario {
            state.open(path);
        }
        Self {
            state,
            engine,
            last_request: None,
            last_reference_request: None,
            frame_rate: FrameRateMonitor::from_env(),
            title: String::new(),
        }
    }

    /// A viewer in an eframe window, with stored settings.
    pub fn from_eframe(
        creation: &eframe::CreationContext<'_>,
        scenario: Option<PathBuf>,
        exporter: Option<Exporter>,
    ) -> Self {
        if let Some(render) = &creation.wgpu_render_state {
            display_image::register(&creation.egui_ctx, render);
        }
        let settings = creation
            .storage
            .and_then(|storage| eframe::get_value::<Settings>(storage, SETTINGS_KEY))
            .unwrap_or_default();
        Self::new(&creation.egui_ctx, scenario, settings, exporter)
    }

    /// One pass of egui: takes replies, draws panes, applies their messages, sends requests.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        self.receive_replies(&context);
        panes::shortcuts::listen(&context, &mut self.state);
        let mut out = Outbox::new();
        push_dropped_files(&context, &mut out);
        self.guard_close(&context, &mut out);
        out.extend(self.state.poll_file_dialog());
        self.state.note_pending();
        panes::show(ui, &self.state, &mut out);
        // After the edits, which clear the rejected input before.
        out.sort_by_key(|message| matches!(message, Message::InputRejected(_)));
        out.into_iter().for_each(|message| self.state.apply(message, &context));
        self.send_requests();
        self.set_title(&context);
        self.schedule_repaint(&context);
        if let Some(frame_rate) = &mut self.frame_rate {
            frame_rate.count_pass(&self.state, &context);
        }
    }

    /// Advances time and takes the engine's replies.
    fn receive_replies(&mut self, context: &egui::Context) {
        self.state.tick(context.input(|input| input.time));
        let replies: Vec<_> = self.engine.replies().collect();
        replies.into_iter().for_each(|reply| self.state.receive(reply, context));
    }

    fn send_requests(&mut self) {
        let request = self.state.frame_request();
        if let Some(request) = &request
            && self.last_request.as_ref() != Some(request)
        {
            // Play may show full frames as they come.
            let is_shown_late = self.state.timeline.playing && request.size == Size::Full;
            let is_other = self.last_request.as_ref().is_some_and(|last| !last.is_same_frame(request));
            self.engine.request_frame(request.clone(), is_other && !is_shown_late);
        }
        self.last_request = request;
        let Some(request) = self.state.reference_request() else { return };
        let key = ReferenceRequestKey::new(&request);
        if !self.last_reference_request.as_ref().is_some_and(|last| last.equals(&key)) {
            self.engine.request_reference(request);
            self.last_reference_request = Some(key);
        }
    }

    /// Asks before the window closes with unsaved changes; a second close request, while asked, is obeyed.
    fn guard_close(&self, context: &egui::Context, out: &mut Outbox) {
        if context.input(|input| input.viewport().close_requested())
            && self.state.is_unsaved()
            && self.state.unsaved_prompt != Some(UnsavedPrompt::Close)
        {
            context.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            out.push(Message::Close);
        }
    }

    /// Sets the title to the name of the scenario's file.
    fn set_title(&mut self, context: &egui::Context) {
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

    fn schedule_repaint(&self, context: &egui::Context) {
        if self.state.timeline.playing {
            context.request_repaint_after(PLAY_INTERVAL);
        } else if let Some(wake_in_s) = self.state.wake_in_s() {
            context.request_repaint_after_secs(wake_in_s as f32 + 0.001);
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

fn push_dropped_files(context: &egui::Context, out: &mut Outbox) {
    let dropped = context.input(|input| input.raw.dropped_files.clone());
    let mut paths: Vec<PathBuf> = dropped.iter().map(|file| file.path().to_path_buf()).collect();
    paths.sort_by_key(|path| dropped_files::drop_order(path));
    out.extend(paths.into_iter().map(Message::Drop));
}
