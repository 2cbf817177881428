//! Everything that the window knows, and what a wish of a pane does to it.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use eframe::egui;

use crate::{
    browse::{Answer, Browse},
    document::Document,
    drop,
    engine::{ExactWanted, Picture, Reply, Size, Stage, Wanted},
    export::{ExportJob, Exporter},
    heard::Heard,
    message::{Message, Question, Refusal},
    settings::Settings,
    timeline::Timeline,
    view::{Compare, Tab, View},
};

/// A hand rests when it has done nothing for so long, seconds.
pub const REST_S: f64 = 0.2;
/// In play, frames that take longer than this in full size are shown as previews, ms.
const QUICK_MS: f64 = 60.0;
/// News are told for so long, seconds.
const NEWS_S: f64 = 6.0;
/// Recent files that are remembered.
const MOST_RECENT: usize = 8;

/// What would lose changes that are not saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Leaving {
    /// Another scenario.
    For(PathBuf),
    /// The end.
    Closing,
}

/// That something was done as it was wished.
#[derive(Clone, Debug, PartialEq)]
pub struct News {
    /// In words.
    pub text: String,
    /// egui's time from which on it is not told any more.
    pub until_s: f64,
}

/// The window's state.
pub struct State {
    /// The scenario, if one is open.
    pub document: Option<Document>,
    /// Which frame.
    pub timeline: Timeline,
    /// How it is shown.
    pub view: View,
    /// What the engine said.
    pub heard: Heard,
    /// Faults that nobody has dismissed, and what else must not go unread.
    pub notices: Vec<String>,
    /// What was done, for a moment.
    pub news: Option<News>,
    /// What was last asked for and not taken as it was; gone with the next edit.
    pub refused: Option<Refusal>,
    /// Pixel under the cursor.
    pub hovered: Option<[u32; 2]>,
    /// Pixel that is kept in the inspector.
    pub pinned: Option<[u32; 2]>,
    /// Whether the shortcuts are listed.
    pub help: bool,
    /// A path being asked for.
    pub question: Option<Question>,
    /// A dropped picture whose use is not yet known.
    pub dropped_picture: Option<PathBuf>,
    /// What is wanted but would lose changes.
    pub leaving: Option<Leaving>,
    /// The last export.
    pub export: Option<Arc<ExportJob>>,
    /// Files opened lately, the last one first.
    pub recent: Vec<PathBuf>,
    /// The desktop's own dialog, while it is open.
    browse: Option<Browse>,
    exporter: Option<Exporter>,
    /// egui's time now, and when a hand was at work last.
    now_s: f64,
    touched_s: f64,
}

impl State {
    /// Nothing open yet.
    pub fn new(settings: Settings, exporter: Option<Exporter>) -> Self {
        Self {
            document: None,
            timeline: Timeline::default(),
            view: settings.view,
            heard: Heard::default(),
            notices: Vec::new(),
            news: None,
            refused: None,
            hovered: None,
            pinned: None,
            help: false,
            question: None,
            dropped_picture: None,
            leaving: None,
            export: None,
            recent: settings.recent,
            browse: None,
            exporter,
            now_s: 0.0,
            touched_s: 0.0,
        }
    }

    /// What is remembered for the next run.
    pub fn settings(&self) -> Settings {
        Settings { view: self.view.clone(), recent: self.recent.clone() }
    }

    /// Whether frames can be rendered to files.
    pub fn can_export(&self) -> bool {
        self.exporter.is_some()
    }

    /// Time goes on.
    pub fn tick(&mut self, now_s: f64) {
        let seconds = now_s - self.now_s;
        self.now_s = now_s;
        self.news.take_if(|news| news.until_s <= now_s);
        self.timeline.advance(seconds);
    }

    /// A hand is at work now.
    pub fn touch(&mut self) {
        self.touched_s = self.now_s;
    }

    /// Seconds until the hand counts as resting; `None` if it rests.
    pub fn rests_in_s(&self) -> Option<f64> {
        let left_s = self.touched_s + REST_S - self.now_s;
        (left_s > 0.0).then_some(left_s)
    }

    /// Takes in what the engine said.
    pub fn hear(&mut self, reply: Reply, context: &egui::Context) {
        if self.is_out_of_date(&reply) {
            return;
        }
        match reply {
            Reply::Told(text) => self.notice(text),
            reply => self.heard.take(reply, context),
        }
        if let Some(sequence) = self.heard.sequence() {
            self.timeline.fit(sequence.frames, sequence.scenario.camera.fps);
        }
    }

    /// Previews and full frames come from two threads: what the hand has left behind must not take the place
    /// of what it is at.
    fn is_out_of_date(&self, reply: &Reply) -> bool {
        match reply {
            Reply::Loaded(loaded) => {
                self.document.as_ref().is_none_or(|document| *document.scenario != loaded.sequence.scenario)
            }
            Reply::Frame(reply) => {
                let (Some(wanted), Some(shown)) = (self.wanted(), &self.heard.shown) else { return false };
                match reply.wanted.size {
                    Size::Full => {
                        let at_rest =
                            Wanted { size: Size::Full, errors: reply.wanted.errors, ..wanted.clone() };
                        wanted.size == Size::Preview && at_rest != reply.wanted
                    }
                    Size::Preview => shown.reply.wanted == wanted,
                }
            }
            _ => false,
        }
    }

    /// What is to be rendered now.
    pub fn wanted(&self) -> Option<Wanted> {
        let document = self.document.as_ref()?;
        let stages = self.view.rendered_stages();
        let compares = self.view.compare == Compare::Difference && stages.len() == 2;
        let moving = self.timeline.dragged || self.rests_in_s().is_some();
        let playing = self.timeline.playing && self.heard.full_ms.is_none_or(|ms| ms > QUICK_MS);
        let size = if moving || playing { Size::Preview } else { Size::Full };
        Some(Wanted {
            scenario: document.scenario.clone(),
            reading: document.reading,
            frame: self.timeline.frame,
            gain: compares.then_some(self.view.gain),
            stages,
            size,
            truth: self.view.overlays.depth,
            errors: size == Size::Full && self.shows_errors(),
        })
    }

    /// Whether something on show is about the predicted error from place to place.
    pub fn shows_errors(&self) -> bool {
        self.view.overlays.error || self.pinned.is_some() && self.view.tab == Tab::Pixel
    }

    /// What the oracle is to do now: once a frame in full size is on show, looks into it; and its own picture
    /// if that is on show.
    pub fn wanted_exact(&self) -> Option<ExactWanted> {
        let (shown, sequence) = (self.heard.shown.as_ref()?, self.heard.sequence()?);
        let rests =
            shown.reply.wanted.size == Size::Full && Some(&shown.reply.wanted) == self.wanted().as_ref();
        rests.then(|| {
            let other = self.view.stages().into_iter().find(|stage| *stage != Stage::Oracle);
            let picture = other.and_then(|stage| {
                shown.reply.pictures.iter().find(|picture: &&Arc<Picture>| picture.stage == stage)
            });
            let compares = self.view.compare == Compare::Difference && self.view.wants_oracle();
            let against = picture.filter(|_| compares).map(|picture| (picture.clone(), self.view.gain));
            ExactWanted {
                sequence: sequence.clone(),
                frame: self.view.wants_oracle().then_some(shown.reply.frame),
                against,
            }
        })
    }

    /// Does what a pane wishes. What only the window can do is left to it.
    pub fn apply(&mut self, message: Message, context: &egui::Context) {
        let of_scenario = |refusal: &Refusal| {
            self.document.as_ref().is_some_and(|document| document.value(refusal.key()).is_some())
        };
        if message.edits_scenario()
            || message.edits_window() && !self.refused.as_ref().is_some_and(of_scenario)
        {
            self.refused = None;
        }
        if self.apply_to_document(&message, context) {
            self.touch();
            return;
        }
        match message {
            Message::Seek(frame) => {
                self.timeline.seek(frame);
                self.touch();
            }
            Message::Step(by) => {
                self.timeline.step(by);
                self.touch();
            }
            Message::TogglePlay => self.timeline.toggle(),
            Message::Timeline(timeline) => self.timeline = timeline,
            Message::View(view) => self.view = view,
            Message::Tab(tab) => self.view.tab = tab,
            Message::Refused(refusal) => self.refused = Some(refusal),
            Message::Hover(pixel) => self.hovered = pixel,
            Message::Pin(pixel) => self.pinned = pixel,
            Message::Dismiss(at) if at < self.notices.len() => {
                self.notices.remove(at);
            }
            Message::Help(open) => self.help = open,
            Message::Ask(question) => self.question = question,
            Message::Browse => {
                let question = self.question.as_ref();
                self.browse =
                    question.map(|question| Browse::ask(question.saves, Path::new(&question.path), context));
            }
            Message::Export(wish) => {
                if let (Some(document), Some(exporter)) = (&self.document, &self.exporter) {
                    let scenario = (*document.scenario).clone();
                    self.export =
                        Some(ExportJob::start(exporter, scenario, wish.folder, wish.frames, context));
                }
            }
            Message::CancelExport => {
                if let Some(job) = &self.export {
                    job.cancel();
                }
            }
            Message::Open(path) if self.is_unsaved() => {
                (self.question, self.leaving) = (None, Some(Leaving::For(path)))
            }
            Message::Open(path) | Message::OpenAnyway(path) => self.open(path),
            Message::Close => self.leaving = Some(Leaving::Closing),
            Message::Stay => self.leaving = None,
            Message::Drop(path) => drop::take(self, &path),
            Message::UsePicture(key) => drop::use_picture(self, key),
            _ => {}
        }
    }

    /// Messages that change the document; whether this was one.
    fn apply_to_document(&mut self, message: &Message, context: &egui::Context) -> bool {
        let Some(document) = &mut self.document else { return false };
        let told: Result<Option<String>, String> = match message {
            Message::Set(key, value, ongoing) => {
                document.set(key, value.clone(), *ongoing);
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
                document.reading += 1;
                Ok(None)
            }
            Message::Save(path) => {
                self.question = None;
                document.save(path).map(|()| Some(format!("saved {}", path.display())))
            }
            Message::CopyToml => document.to_toml(None).map(|text| {
                context.copy_text(text);
                Some("the scenario is on the clipboard".into())
            }),
            Message::CopyCommand => {
                context.copy_text(document.command_line());
                match document.left_out().as_slice() {
                    [] => Ok(Some("the command line is on the clipboard".into())),
                    keys => {
                        let keys = keys.join(", ");
                        Err(format!(
                            "the command line is on the clipboard; it cannot leave out {keys}: save the scenario for that"
                        ))
                    }
                }
            }
            _ => return false,
        };
        match told {
            Ok(None) => {}
            Ok(Some(text)) => self.news = Some(News { text, until_s: self.now_s + NEWS_S }),
            Err(text) => self.notice(text),
        }
        true
    }

    /// Opens a scenario; what is open stays if it cannot be.
    pub fn open(&mut self, path: PathBuf) {
        (self.question, self.leaving) = (None, None);
        match Document::open(&path) {
            Ok(mut document) => {
                document.reading = self.document.as_ref().map_or(0, |before| before.reading + 1);
                self.document = Some(document);
                self.timeline = Timeline { speed: self.timeline.speed, ..Timeline::default() };
                (self.pinned, self.hovered) = (None, None);
                self.recent.retain(|known| *known != path);
                self.recent.insert(0, path);
                self.recent.truncate(MOST_RECENT);
                self.touch();
            }
            Err(error) => self.notice(error),
        }
    }

    /// What the desktop's dialog has answered, if it has: the wish that follows.
    pub fn browsed(&mut self) -> Option<Message> {
        let answer = self.browse.as_ref().and_then(Browse::answer)?;
        self.browse = None;
        match answer {
            Answer::Chosen(path, true) => Some(Message::Save(path)),
            Answer::Chosen(path, false) => Some(Message::Open(path)),
            Answer::Dismissed => None,
            Answer::NoDialog => {
                self.notice(
                    "this desktop has no file dialog (on Linux: xdg-desktop-portal or zenity); type the path, or choose from the list"
                        .into(),
                );
                None
            }
        }
    }

    /// Whether there are changes that are in no file.
    pub fn is_unsaved(&self) -> bool {
        self.document.as_ref().is_some_and(Document::is_unsaved)
    }

    /// Tells something until it is dismissed.
    pub fn notice(&mut self, text: String) {
        if self.notices.last() != Some(&text) {
            self.notices.push(text);
        }
    }
}
