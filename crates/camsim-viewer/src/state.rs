//! The state of the window, and how messages of panes change it.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::{scenario::Scenario, sequence::Sequence};
use eframe::egui;

use crate::{
    document::Document,
    engine::{FrameRequest, Picture, ReferenceRequest, Reply, Size, Stage},
    engine_state::EngineState,
    export::{ExportJob, Exporter},
    file_dialog::{DialogResult, FileDialog},
    message::{Message, PathPrompt, RejectedInput},
    settings::Settings,
    timeline::Timeline,
    view::{Compare, Tab, View},
};

pub(crate) mod dropped_files;

/// Time without input after which full frames are rendered instead of previews, seconds.
pub const IDLE_S: f64 = 0.2;
/// Render time of a full frame above which play shows previews, ms.
const PREVIEW_ABOVE_MS: f64 = 60.0;
/// Time after which a missing picture is marked, seconds.
const MARK_AFTER_S: f64 = 0.3;
/// How long a status message is shown, seconds.
const STATUS_S: f64 = 6.0;
/// Length of the list of recent files.
const MAX_RECENT: usize = 8;

/// The action that would lose unsaved changes, while the user is asked about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UnsavedPrompt {
    /// Opening another scenario.
    Open(PathBuf),
    /// Closing the window.
    Close,
}

/// A confirmation that disappears after [`STATUS_S`].
#[derive(Clone, Debug, PartialEq)]
pub struct StatusMessage {
    /// Text of the message.
    pub text: String,
    /// egui's time at which it disappears, seconds.
    pub until_s: f64,
}

/// The window's state.
#[derive(Default)]
pub struct State {
    /// The scenario, if one is open.
    pub document: Option<Document>,
    /// Frame, play and loop.
    pub timeline: Timeline,
    /// Settings of the picture pane.
    pub view: View,
    /// What the engine has reported.
    pub engine: EngineState,
    /// Faults and warnings that stay until dismissed.
    pub notices: Vec<String>,
    /// Confirmation of the last action.
    pub status: Option<StatusMessage>,
    /// The last input that was not accepted as given; cleared by the next edit.
    pub rejected_input: Option<RejectedInput>,
    /// Camera pixel under the cursor.
    pub hovered: Option<[u32; 2]>,
    /// Camera pixel pinned in the inspector.
    pub pinned: Option<[u32; 2]>,
    /// Whether the shortcuts are listed.
    pub shows_shortcuts: bool,
    /// The prompt for a path, while it is shown.
    pub path_prompt: Option<PathPrompt>,
    /// A dropped picture, while the user is asked for its use.
    pub dropped_picture: Option<PathBuf>,
    /// The action that would lose unsaved changes, while the user is asked.
    pub unsaved_prompt: Option<UnsavedPrompt>,
    /// The last export.
    pub export: Option<Arc<ExportJob>>,
    /// Recently opened files, the latest first.
    pub recent: Vec<PathBuf>,
    /// The desktop's file dialog, while it is open.
    file_dialog: Option<FileDialog>,
    exporter: Option<Exporter>,
    /// egui's time, seconds.
    now_s: f64,
    /// egui's time of the last input, seconds.
    last_input_s: f64,
    /// The frame that is wanted and not shown, and egui's time since when, seconds.
    pending_since: Option<(u64, f64)>,
    /// Time for which the last wanted picture was missing, seconds.
    pub settled_in_s: Option<f64>,
}

impl State {
    /// A state without open scenario.
    pub fn new(settings: Settings, exporter: Option<Exporter>) -> Self {
        Self { view: settings.view, recent: settings.recent, exporter, ..Self::default() }
    }

    /// The settings to store for the next run.
    pub fn settings(&self) -> Settings {
        Settings { view: self.view.clone(), recent: self.recent.clone() }
    }

    /// Whether the viewer has an exporter.
    pub fn can_export(&self) -> bool {
        self.exporter.is_some()
    }

    /// Advances to egui's time `now_s`.
    pub fn tick(&mut self, now_s: f64) {
        let seconds = now_s - self.now_s;
        self.now_s = now_s;
        self.status.take_if(|status| status.until_s <= now_s);
        self.timeline.advance(seconds);
    }

    /// Notes whether the wanted picture is shown; play wants another one all the time.
    pub fn note_pending(&mut self) {
        let pending = self.pending().filter(|_| !self.timeline.playing);
        self.pending_since = match (pending, self.pending_since) {
            (None, Some((_, since_s))) => {
                self.settled_in_s = Some(self.now_s - since_s);
                None
            }
            (Some(frame), Some((before, since_s))) if frame == before => Some((frame, since_s)),
            (pending, _) => pending.map(|frame| (frame, self.now_s)),
        };
    }

    /// Records an input at the present time.
    pub fn note_input(&mut self) {
        self.last_input_s = self.now_s;
    }

    /// Seconds until input counts as idle; `None` if it is.
    pub fn idle_in_s(&self) -> Option<f64> {
        let remaining_s = self.last_input_s + IDLE_S - self.now_s;
        (remaining_s > 0.0).then_some(remaining_s)
    }

    /// Takes a reply of the engine.
    pub fn receive(&mut self, reply: Reply, context: &egui::Context) {
        if self.is_outdated(&reply) {
            return;
        }
        match reply {
            Reply::Notice(text) => self.notice(text),
            reply => self.engine.receive(reply, context),
        }
        // While a scenario with another frame rate is loaded, the timeline is that of the new one already.
        let is_shown = |sequence: &Sequence| {
            self.document.as_ref().is_some_and(|document| *document.scenario == sequence.scenario)
        };
        if let Some(sequence) = self.engine.sequence().filter(|sequence| is_shown(sequence)) {
            self.timeline.set_sequence(sequence.frames, sequence.scenario.camera.fps);
        }
    }

    /// Whether a reply must be ignored. Previews and full frames come from two threads: an outdated full
    /// frame must not replace a newer preview, nor a preview the full frame of the same request.
    fn is_outdated(&self, reply: &Reply) -> bool {
        match reply {
            Reply::Loaded(loaded) => {
                self.document.as_ref().is_none_or(|document| *document.scenario != loaded.sequence.scenario)
            }
            Reply::Frame(reply) => {
                let (Some(wanted), Some(shown)) = (self.frame_request(), &self.engine.shown) else {
                    return false;
                };
                let shown = &shown.reply.request;
                match (reply.request.is_same_frame(&wanted), shown.is_same_frame(&wanted)) {
                    (true, true) => reply.request.size == Size::Preview && *shown == wanted,
                    (true, false) => false,
                    (false, true) => true,
                    // Play may show full frames as they come; else a full frame that is not wanted any more took
                    // so long that previews of later ones are shown.
                    (false, false) => {
                        reply.request.size == Size::Full
                            && !(self.timeline.playing && wanted.size == Size::Full)
                    }
                }
            }
            _ => false,
        }
    }

    /// The frame that is wanted and not shown: another one or another scenario is, or a preview of it.
    pub fn pending(&self) -> Option<u64> {
        let wanted = self.frame_request().filter(|_| self.engine.fault.is_none())?;
        let shown = self.engine.shown.as_ref().map(|shown| &shown.reply.request);
        let is_shown = shown.is_some_and(|shown| {
            shown.is_same_frame(&wanted) && (shown.size == Size::Full || wanted.size == Size::Preview)
        });
        (!is_shown).then_some(wanted.frame)
    }

    /// Seconds for which the wanted picture has been missing; `None` if it is shown, or has not been missing long
    /// enough to say so.
    pub fn pending_s(&self) -> Option<f64> {
        let (_, since_s) = self.pending_since?;
        Some(self.now_s - since_s).filter(|pending_s| *pending_s >= MARK_AFTER_S)
    }

    /// What the renderer should render now.
    pub fn frame_request(&self) -> Option<FrameRequest> {
        let document = self.document.as_ref()?;
        let stages = self.view.rendered_stages();
        let compares = self.view.compare == Compare::Difference && stages.len() == 2;
        let has_input = self.timeline.dragged || self.idle_in_s().is_some();
        let plays_previews =
            self.timeline.playing && self.engine.full_ms.is_none_or(|ms| ms > PREVIEW_ABOVE_MS);
        let size = if has_input || plays_previews { Size::Preview } else { Size::Full };
        Some(FrameRequest {
            scenario: document.scenario.clone(),
            reload_count: document.reload_count,
            frame: self.timeline.frame,
            gain: compares.then_some(self.view.gain),
            stages,
            size,
            depth: self.view.overlays.depth,
            raw: self.view.overlays.raw,
            histogram: self.view.overlays.histogram,
            errors: size == Size::Full && self.shows_errors(),
        })
    }

    /// Whether predicted errors over the image are shown.
    pub fn shows_errors(&self) -> bool {
        self.view.overlays.error || self.pinned.is_some() && self.view.tab == Tab::Pixel
    }

    /// What the reference should do once a full frame is shown: rays for single pixels, and its picture if that
    /// is shown.
    pub fn reference_request(&self) -> Option<ReferenceRequest> {
        let (shown, sequence) = (self.engine.shown.as_ref()?, self.engine.sequence()?);
        let is_full = shown.reply.request.size == Size::Full
            && Some(&shown.reply.request) == self.frame_request().as_ref();
        is_full.then(|| {
            let other = self.view.stages().into_iter().find(|stage| *stage != Stage::Reference);
            let picture = other.and_then(|stage| {
                shown.reply.pictures.iter().find(|picture: &&Arc<Picture>| picture.stage == stage)
            });
            let compares = self.view.compare == Compare::Difference && self.view.wants_reference();
            let against = picture.filter(|_| compares).map(|picture| (picture.clone(), self.view.gain));
            ReferenceRequest {
                sequence: sequence.clone(),
                frame: self.view.wants_reference().then_some(shown.reply.frame),
                against,
            }
        })
    }

    /// Seconds until input counts as idle or a missing picture is marked, whichever comes first; `None` if neither
    /// is to come.
    pub fn wake_in_s(&self) -> Option<f64> {
        let mark_s = self.pending_since.map(|(_, since_s)| since_s + MARK_AFTER_S - self.now_s);
        [self.idle_in_s(), mark_s].into_iter().flatten().filter(|in_s| *in_s > 0.0).reduce(f64::min)
    }

    /// Applies a message of a pane.
    pub fn apply(&mut self, message: Message, context: &egui::Context) {
        // Long because: one arm per message.
        let is_of_scenario = |rejected: &RejectedInput| {
            self.document.as_ref().is_some_and(|document| document.value(rejected.key()).is_some())
        };
        if message.edits_scenario()
            || message.edits_window() && !self.rejected_input.as_ref().is_some_and(is_of_scenario)
        {
            self.rejected_input = None;
        }
        if self.apply_to_document(&message, context) {
            self.note_input();
            return;
        }
        match message {
            Message::Seek(frame) => {
                self.timeline.seek(frame);
                self.note_input();
            }
            Message::Step(frames) => {
                self.timeline.step(frames);
                self.note_input();
            }
            Message::TogglePlay => self.timeline.toggle(),
            Message::Timeline(timeline) => self.timeline = timeline,
            Message::View(view) => self.view = view,
            Message::Tab(tab) => self.view.tab = tab,
            Message::InputRejected(rejected) => self.rejected_input = Some(rejected),
            Message::Hover(pixel) => self.hovered = pixel,
            Message::Pin(pixel) => self.pinned = pixel,
            Message::Dismiss(index) if index < self.notices.len() => {
                self.notices.remove(index);
            }
            Message::ShowShortcuts(open) => self.shows_shortcuts = open,
            Message::Prompt(path_prompt) => self.path_prompt = path_prompt,
            Message::Browse => {
                let path_prompt = self.path_prompt.as_ref();
                self.file_dialog = path_prompt.map(|path_prompt| {
                    FileDialog::open(path_prompt.saves, Path::new(&path_prompt.path), context)
                });
            }
            Message::Export(request) => {
                if let (Some(document), Some(exporter)) = (&self.document, &self.exporter) {
                    let (rig, camera) = (document.rig().clone(), document.camera());
                    let job = ExportJob::new(rig, camera, request.folder, request.frames);
                    self.export = Some(ExportJob::start(exporter, job, context));
                }
            }
            Message::CancelExport => {
                if let Some(job) = &self.export {
                    job.cancel();
                }
            }
            Message::Open(path) if self.is_unsaved() => {
                (self.path_prompt, self.unsaved_prompt) = (None, Some(UnsavedPrompt::Open(path)))
            }
            Message::Open(path) | Message::OpenDiscarding(path) => self.open(path),
            Message::Close => self.unsaved_prompt = Some(UnsavedPrompt::Close),
            Message::CancelLeaving => self.unsaved_prompt = None,
            Message::Drop(path) => dropped_files::apply_dropped(self, &path),
            Message::UsePicture(key) => dropped_files::use_picture(self, key),
            _ => {}
        }
    }

    /// Applies a message that concerns the document; returns whether it was one.
    fn apply_to_document(&mut self, message: &Message, context: &egui::Context) -> bool {
        let Some(document) = &mut self.document else { return false };
        // The confirmation to show, or the error.
        let outcome: Result<Option<String>, String> = match message {
            Message::Set(key, value, is_dragged) => {
                document.set(key, value.clone(), *is_dragged);
                Ok(None)
            }
            Message::EndGesture => {
                document.end_gesture();
                Ok(None)
            }
            Message::Reset(key) => {
                document.reset(key);
                Ok(None)
            }
            Message::ShowCamera(camera) => {
                let before = document.scenario.clone();
                document.show_camera(*camera);
                let clock = |scenario: &Scenario| [scenario.camera.fps, scenario.camera.phase];
                self.timeline.keep_time(clock(&before), clock(&document.scenario));
                (self.pinned, self.hovered) = (None, None);
                Ok(None)
            }
            Message::Camera(camera) => document.set_camera(camera).map(|()| None),
            Message::Undo => {
                document.undo();
                Ok(None)
            }
            Message::Redo => {
                document.redo();
                Ok(None)
            }
            Message::Reload => {
                document.reload_count += 1;
                Ok(None)
            }
            Message::Save(path) => {
                self.path_prompt = None;
                document.save(path).map(|()| Some(format!("saved {}", path.display())))
            }
            Message::CopyToml => document.to_toml(None).map(|text| {
                context.copy_text(text);
                Some("copied the scenario".into())
            }),
            Message::CopyCommand => {
                context.copy_text(document.command_line());
                match document.removed_keys().as_slice() {
                    [] => Ok(Some("copied the command line".into())),
                    keys => {
                        let keys = keys.join(", ");
                        Err(format!(
                            "the command line is on the clipboard, without the removal of {keys}: \
                             save the scenario to keep that"
                        ))
                    }
                }
            }
            _ => return false,
        };
        match outcome {
            Ok(None) => {}
            Ok(Some(text)) => self.status = Some(StatusMessage { text, until_s: self.now_s + STATUS_S }),
            Err(text) => self.notice(text),
        }
        true
    }

    /// Opens a scenario; if that fails, the open one stays.
    pub fn open(&mut self, path: PathBuf) {
        (self.path_prompt, self.unsaved_prompt) = (None, None);
        match Document::open(&path) {
            Ok(mut document) => {
                document.reload_count = self.document.as_ref().map_or(0, |before| before.reload_count + 1);
                self.document = Some(document);
                self.timeline = Timeline { speed: self.timeline.speed, ..Timeline::default() };
                (self.pinned, self.hovered) = (None, None);
                self.recent.retain(|known| *known != path);
                self.recent.insert(0, path);
                self.recent.truncate(MAX_RECENT);
                self.note_input();
            }
            Err(error) => self.notice(error),
        }
    }

    /// The message that follows from the answer of the desktop's file dialog, if it has answered.
    pub fn poll_file_dialog(&mut self) -> Option<Message> {
        let result = self.file_dialog.as_ref().and_then(FileDialog::result)?;
        self.file_dialog = None;
        match result {
            DialogResult::Chosen(path, true) => Some(Message::Save(path)),
            DialogResult::Chosen(path, false) => Some(Message::Open(path)),
            DialogResult::Dismissed => None,
            DialogResult::NoDialog => {
                self.notice(
                    "this desktop has no file dialog (on Linux: xdg-desktop-portal or zenity); \
                     type the path, or choose from the list"
                        .into(),
                );
                None
            }
        }
    }

    /// Whether the document has unsaved changes.
    pub fn is_unsaved(&self) -> bool {
        self.document.as_ref().is_some_and(Document::is_unsaved)
    }

    /// Shows a notice until it is dismissed.
    pub fn notice(&mut self, text: String) {
        if self.notices.last() != Some(&text) {
            self.notices.push(text);
        }
    }
}
