//! What the engine has said: the last pictures, what is loaded, what went wrong.

use std::{sync::Arc, time::Instant};

use camsim_core::{flight_log::FlightLog, reference::Oracle, sequence::Sequence};
use camsim_io::load::Loaded;
use camsim_plan::FramePlan;
use eframe::egui;

use crate::{
    engine::{Difference, Errors, ExactPicture, FrameReply, Picture, Reply, Size, Stage, Truth},
    sheet::Sheet,
};

/// Steps between two rows of the log that are marked, seconds of the log: more than one, and than what
/// rounding makes of one.
const GAP_S: f64 = 1.0 + 1e-6;

/// All that panes know of the engine.
#[derive(Default)]
pub struct Heard {
    /// What is rendered on.
    pub adapter: String,
    /// What takes long; empty for nothing.
    pub busy: String,
    /// Since when.
    pub busy_since: Option<Instant>,
    /// The last scenario whose files were read.
    pub loaded: Option<Arc<Loaded>>,
    /// Spans without rows of its log, path time.
    pub gaps_s: Vec<[f64; 2]>,
    /// The last pictures.
    pub shown: Option<Shown>,
    /// For looks into single pixels.
    pub looks: Option<Arc<Oracle>>,
    /// The oracle's picture.
    pub exact: Option<Exact>,
    /// What went wrong last; gone with the next picture.
    pub fault: Option<String>,
    /// Time of the last frame in full size, ms.
    pub full_ms: Option<f64>,
    /// Time of the last preview, ms.
    pub preview_ms: Option<f64>,
    /// Counts up with each reply that panes may have kept something of.
    pub replies: u64,
}

/// The engine's last pictures.
pub struct Shown {
    /// As they came.
    pub reply: FrameReply,
    /// The same on the screen.
    pub sheets: Vec<Sheet>,
    /// The difference there.
    pub difference: Option<Sheet>,
    /// The depth there, one for each picture, if it was wanted.
    pub depths: Vec<Sheet>,
    /// The predicted errors there, one for each picture, if they were wanted and have come.
    pub errors: Vec<Sheet>,
}

/// The oracle's picture, as far as it has come.
pub struct Exact {
    /// As it came.
    pub picture: ExactPicture,
    /// On the screen.
    pub sheet: Sheet,
    /// The difference there.
    pub difference: Option<Sheet>,
}

/// One picture to look at.
#[derive(Clone, Copy)]
pub struct PixelTruth<'a> {
    /// On the screen.
    pub sheet: &'a Sheet,
    /// Its pixels.
    pub size_px: [u32; 2],
    /// Linear R G B A.
    pub color_rgba: &'a [f32],
    /// What is in it.
    pub stage: Stage,
    /// How it was made; the oracle has no plan.
    pub plan: Option<&'a FramePlan>,
    /// Its predicted error from place to place, if that was wanted, and on the screen.
    pub errors: Option<(&'a Errors, &'a Sheet)>,
    /// Its depth, if that was wanted, and on the screen; the oracle's picture has none.
    pub depth: Option<(&'a Truth, &'a Sheet)>,
}

impl Heard {
    /// Takes a reply in.
    pub fn take(&mut self, reply: Reply, context: &egui::Context) {
        self.replies += 1;
        match reply {
            Reply::Adapter(adapter) => self.adapter = adapter,
            Reply::Busy(what) => {
                self.busy_since = (!what.is_empty()).then(Instant::now);
                self.busy = what;
            }
            Reply::Loaded(loaded) => {
                // Hours of rows are looked through once, not with each pass.
                if !self.loaded.as_ref().is_some_and(|before| Arc::ptr_eq(&before.log, &loaded.log)) {
                    self.gaps_s = gaps_s(&loaded.log, loaded.sequence.scenario.flight.speed);
                }
                self.loaded = Some(loaded);
            }
            Reply::Looks(looks) => self.looks = Some(looks),
            Reply::Failed(fault) => self.fault = Some(fault),
            // The state keeps it.
            Reply::Told(_) => {}
            Reply::Frame(reply) => {
                if let Some(took) = reply.took {
                    let of_size = match reply.wanted.size {
                        Size::Full => &mut self.full_ms,
                        Size::Preview => &mut self.preview_ms,
                    };
                    *of_size = Some(1e3 * took.as_secs_f64());
                }
                self.fault = None;
                self.shown = Some(Shown::new(*reply, self.shown.take(), context));
            }
            Reply::Errors(reply) => {
                if let Some(shown) = self.shown.as_mut().filter(|shown| shown.reply.wanted == reply.wanted) {
                    shown.take_errors(reply.errors, context);
                }
            }
            Reply::Exact(picture) => {
                let (old, old_difference) =
                    self.exact.take().map_or((None, None), |exact| (Some(exact.sheet), exact.difference));
                let sheet = Sheet::new(context, "oracle", picture.image.clone(), old);
                let difference = picture
                    .difference
                    .as_ref()
                    .map(|d| Sheet::new(context, "oracle difference", d.image.clone(), old_difference));
                self.exact = Some(Exact { picture: *picture, sheet, difference });
            }
        }
    }

    /// The sequence that is loaded.
    pub fn sequence(&self) -> Option<&Arc<Sequence>> {
        self.loaded.as_ref().map(|loaded| &loaded.sequence)
    }

    /// The picture of a stage, of the frame that is shown.
    pub fn sight(&self, stage: Stage) -> Option<PixelTruth<'_>> {
        let shown = self.shown.as_ref()?;
        if stage == Stage::Oracle {
            let Exact { picture, sheet, .. } = self.current_exact()?;
            let size_px = picture.sequence.scenario.camera.size_px;
            return Some(PixelTruth {
                sheet,
                size_px,
                color_rgba: &picture.color_rgba,
                stage,
                plan: None,
                errors: None,
                depth: None,
            });
        }
        let at = shown.reply.pictures.iter().position(|picture| picture.stage == stage)?;
        let (picture, sheet) = (shown.reply.pictures.get(at)?, shown.sheets.get(at)?);
        let (size_px, color_rgba) = (picture.frame.size_px, &picture.frame.color_rgba);
        let errors = shown.reply.errors.get(at).map(|errors| &**errors).zip(shown.errors.get(at));
        let depth = shown.reply.truths.get(at).map(|truth| &**truth).zip(shown.depths.get(at));
        Some(PixelTruth { sheet, size_px, color_rgba, stage, plan: Some(&picture.plan), errors, depth })
    }

    /// Path time of a frame's stamp, seconds.
    pub fn stamp_s(&self, frame: u64) -> Option<f64> {
        let sequence = self.sequence()?;
        let camera = &sequence.scenario.camera;
        Some(sequence.start_s + (frame as f64 + camera.phase) / camera.fps)
    }

    /// What a pixel of the frame shown sees, if that is a surface; `None` as long as there are no looks into
    /// it.
    pub fn point_ned_m(&self, pixel: [u32; 2]) -> Option<glam::DVec3> {
        let (looks, shown) = (self.current_looks()?, self.shown.as_ref()?);
        looks.sample(shown.reply.frame, pixel, glam::DVec2::ZERO, 0.0)?.hit.map(|hit| hit.point_ned_m)
    }

    /// The first picture of the last reply.
    pub fn picture(&self) -> Option<&Arc<Picture>> {
        self.shown.as_ref().and_then(|shown| shown.reply.pictures.first())
    }

    /// The oracle's picture, if it is of the frame shown.
    pub fn current_exact(&self) -> Option<&Exact> {
        let (exact, shown) = (self.exact.as_ref()?, self.shown.as_ref()?);
        (self.is_current(&exact.picture.sequence) && exact.picture.frame == shown.reply.frame)
            .then_some(exact)
    }

    /// Looks into the frame shown.
    pub fn current_looks(&self) -> Option<&Arc<Oracle>> {
        self.looks.as_ref().filter(|looks| self.is_current(looks.sequence()))
    }

    /// The difference on show: with the oracle or between two rendered pictures.
    pub fn difference(&self, with_oracle: bool) -> Option<(&Arc<Difference>, &Sheet)> {
        if with_oracle {
            let exact = self.current_exact()?;
            return exact.picture.difference.as_ref().zip(exact.difference.as_ref());
        }
        let shown = self.shown.as_ref()?;
        shown.reply.difference.as_ref().zip(shown.difference.as_ref())
    }

    fn is_current(&self, sequence: &Arc<Sequence>) -> bool {
        self.sequence().is_some_and(|current| Arc::ptr_eq(current, sequence))
    }
}

impl Shown {
    fn new(reply: FrameReply, before: Option<Self>, context: &egui::Context) -> Self {
        let (old, old_difference, old_depths, old_errors) = before.map_or_else(Default::default, |before| {
            (before.sheets, before.difference, before.depths, before.errors)
        });
        let pictures = reply.pictures.iter().map(|picture| &picture.image);
        let difference = reply
            .difference
            .as_ref()
            .map(|difference| Sheet::new(context, "difference", difference.image.clone(), old_difference));
        Self {
            sheets: sheets("picture", pictures, old, context),
            depths: sheets("depth", reply.truths.iter().map(|truth| &truth.image), old_depths, context),
            errors: sheets(
                "predicted error",
                reply.errors.iter().map(|errors| &errors.image),
                old_errors,
                context,
            ),
            difference,
            reply,
        }
    }

    fn take_errors(&mut self, errors: Vec<Arc<Errors>>, context: &egui::Context) {
        let old = std::mem::take(&mut self.errors);
        self.errors = sheets("predicted error", errors.iter().map(|errors| &errors.image), old, context);
        self.reply.errors = errors;
    }
}

/// Steps of the log's clock that count as gaps, as the log's report counts them; on the timeline they are
/// shorter by its `speed`.
fn gaps_s(log: &FlightLog, speed: f64) -> Vec<[f64; 2]> {
    if log.report.gaps.count == 0 {
        return Vec::new();
    }
    let steps = log.rows.windows(2).map(|pair| [pair[0].t_s, pair[1].t_s]);
    steps.filter(|[from_s, to_s]| (to_s - from_s) * speed > GAP_S).collect()
}

/// Pictures on the screen, in place of older ones.
fn sheets<'a>(
    name: &str,
    images: impl Iterator<Item = &'a Arc<egui::ColorImage>>,
    old: Vec<Sheet>,
    context: &egui::Context,
) -> Vec<Sheet> {
    let mut old = old.into_iter();
    images.map(|image| Sheet::new(context, name, image.clone(), old.next())).collect()
}
