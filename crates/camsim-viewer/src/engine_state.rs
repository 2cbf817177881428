//! What the engine has reported: the last pictures, the loaded scenario, faults.

use std::{sync::Arc, time::Instant};

use camsim_core::{flight_log::FlightLog, frame::RawPicture, reference::RaySample, sequence::Sequence};
use camsim_engine::CameraReference;
use camsim_io::load::Loaded;
use eframe::egui;

use crate::{
    display_image::DisplayImage,
    engine::{
        DepthPicture, Difference, ErrorOverlay, FrameReply, Histogram, Picture, RawScale, ReferencePicture,
        Reply, Size, Stage,
    },
};

/// Time between two rows of the log, in seconds of its clock, above which it is a gap: 1 s and rounding.
const GAP_S: f64 = 1.0 + 1e-6;

/// All that panes know of the engine.
#[derive(Default)]
pub struct EngineState {
    /// Name of the renderer or graphics adapter in use.
    pub adapter: String,
    /// The slow task in progress; empty for none.
    pub busy: String,
    /// When that task began.
    pub busy_since: Option<Instant>,
    /// The last scenario whose files were read.
    pub loaded: Option<Arc<Loaded>>,
    /// Begin and end of each gap in the loaded log, path time.
    pub gaps_s: Vec<[f64; 2]>,
    /// The last rendered frame.
    pub shown: Option<ShownFrame>,
    /// Exact rays for single pixels.
    pub reference: Option<Arc<CameraReference>>,
    /// The reference's picture of a whole frame.
    pub reference_picture: Option<ShownReferencePicture>,
    /// The last fault; cleared by the next frame.
    pub fault: Option<String>,
    /// Render time of the last frame in full size, ms.
    pub full_ms: Option<f64>,
    /// Render time of the last preview, ms.
    pub preview_ms: Option<f64>,
}

/// The last rendered frame with its images for the screen.
pub struct ShownFrame {
    /// The engine's reply.
    pub reply: FrameReply,
    /// One image for each picture of the reply.
    pub images: Vec<DisplayImage>,
    /// Image of the difference of the two pictures, if requested.
    pub difference: Option<DisplayImage>,
    /// One depth image for each picture, if requested.
    pub depths: Vec<DisplayImage>,
    /// One raw image for each picture, if requested; `None` for a stage without sensor.
    pub raws: Vec<Option<DisplayImage>>,
    /// One image of predicted errors for each picture, if requested and already computed.
    pub errors: Vec<DisplayImage>,
}

/// The reference's picture with its images for the screen; rows may still be missing.
pub struct ShownReferencePicture {
    /// The engine's reply.
    pub picture: ReferencePicture,
    /// Image of the picture.
    pub image: DisplayImage,
    /// Image of the difference from a rendered picture, if requested.
    pub difference: Option<DisplayImage>,
}

/// The picture of one stage of the shown frame.
#[derive(Clone, Copy)]
pub struct StagePicture<'a> {
    /// Image for the screen.
    pub image: &'a DisplayImage,
    /// Width and height of the picture, which is smaller than the camera's for a preview.
    pub size_px: [u32; 2],
    /// Linear R G B A, row-major.
    pub color_rgba: &'a [f32],
    /// The stage that it shows.
    pub stage: Stage,
    /// The rendered picture; the reference's has no plan.
    pub rendered: Option<&'a Arc<Picture>>,
    /// The raw picture of the sensor, if requested.
    pub raw: Option<&'a DisplayImage>,
    /// Histogram, if requested.
    pub histogram: Option<&'a Histogram>,
    /// Predicted error per image cell and its image, if requested.
    pub errors: Option<(&'a ErrorOverlay, &'a DisplayImage)>,
    /// Depth and its image, if requested; the reference's picture has none.
    pub depth: Option<(&'a DepthPicture, &'a DisplayImage)>,
}

impl StagePicture<'_> {
    /// The numbers of the image sensor, and how to read them; `None` for a stage without sensor.
    pub fn raw_numbers(&self) -> Option<(RawScale, &RawPicture)> {
        let picture = self.rendered?;
        Some((picture.raw_scale?, picture.frame.raw()?))
    }
}

impl EngineState {
    /// Stores a reply.
    pub fn receive(&mut self, reply: Reply, context: &egui::Context) {
        match reply {
            Reply::Adapter(adapter) => self.adapter = adapter,
            Reply::Busy(task) => {
                self.busy_since = (!task.is_empty()).then(Instant::now);
                self.busy = task;
            }
            Reply::Loaded(loaded) => {
                // Once per log: a long one has many rows.
                if !self.loaded.as_ref().is_some_and(|before| Arc::ptr_eq(&before.log, &loaded.log)) {
                    self.gaps_s = gaps_s(&loaded.log, loaded.sequence.scenario.flight.speed);
                }
                self.loaded = Some(loaded);
            }
            Reply::Reference(reference) => self.reference = Some(reference),
            Reply::Failed(fault) => self.fault = Some(fault),
            // `State` keeps notices.
            Reply::Notice(_) => {}
            Reply::Frame(reply) => {
                if let Some(took) = reply.took {
                    let render_ms = match reply.request.size {
                        Size::Full => &mut self.full_ms,
                        Size::Preview => &mut self.preview_ms,
                    };
                    *render_ms = Some(1e3 * took.as_secs_f64());
                }
                self.fault = None;
                self.shown = Some(ShownFrame::new(*reply, self.shown.take(), context));
            }
            Reply::Errors(reply) => {
                if let Some(shown) = self.shown.as_mut().filter(|shown| shown.reply.request == reply.request)
                {
                    shown.set_errors(reply.errors, context);
                }
            }
            Reply::ReferencePicture(picture) => {
                let (old, old_difference) = self
                    .reference_picture
                    .take()
                    .map_or((None, None), |before| (Some(before.image), before.difference));
                let image = DisplayImage::new(context, "reference", picture.image.clone(), old);
                let difference = picture.difference.as_ref().map(|difference| {
                    DisplayImage::new(
                        context,
                        "reference difference",
                        difference.image.clone(),
                        old_difference,
                    )
                });
                self.reference_picture = Some(ShownReferencePicture { picture: *picture, image, difference });
            }
        }
    }

    /// The loaded sequence.
    pub fn sequence(&self) -> Option<&Arc<Sequence>> {
        self.loaded.as_ref().map(|loaded| &loaded.sequence)
    }

    /// The picture of a stage of the shown frame.
    pub fn stage_picture(&self, stage: Stage) -> Option<StagePicture<'_>> {
        let shown = self.shown.as_ref()?;
        if stage == Stage::Reference {
            let ShownReferencePicture { picture, image, .. } = self.current_reference_picture()?;
            let size_px = picture.sequence.scenario.camera.size_px;
            return Some(StagePicture {
                image,
                size_px,
                color_rgba: &picture.color_rgba,
                stage,
                rendered: None,
                raw: None,
                histogram: None,
                errors: None,
                depth: None,
            });
        }
        let index = shown.reply.pictures.iter().position(|picture| picture.stage == stage)?;
        let (picture, image) = (shown.reply.pictures.get(index)?, shown.images.get(index)?);
        let (size_px, color_rgba) = (picture.frame.size_px, picture.frame.color_rgba());
        let errors = shown.reply.errors.get(index).map(|errors| &**errors).zip(shown.errors.get(index));
        let depth = shown.reply.depths.get(index).map(|depth| &**depth).zip(shown.depths.get(index));
        Some(StagePicture {
            image,
            size_px,
            color_rgba,
            stage,
            rendered: Some(picture),
            raw: shown.raws.get(index).and_then(Option::as_ref),
            histogram: shown.reply.histograms.get(index),
            errors,
            depth,
        })
    }

    /// Path time of a frame's stamp, seconds.
    pub fn stamp_s(&self, frame: u64) -> Option<f64> {
        Some(self.sequence()?.stamp_s(frame as f64))
    }

    /// What a pixel of the shown frame sees; `None` without ray, and until the reference is ready.
    pub fn sample(&self, pixel: [u32; 2]) -> Option<RaySample> {
        let (reference, shown) = (self.current_reference()?, self.shown.as_ref()?);
        reference.sample(shown.reply.frame, pixel, glam::DVec2::ZERO, 0.0)
    }

    /// The first picture of the shown frame.
    pub fn picture(&self) -> Option<&Arc<Picture>> {
        self.shown.as_ref().and_then(|shown| shown.reply.pictures.first())
    }

    /// The reference's picture, if it is of the shown frame.
    pub fn current_reference_picture(&self) -> Option<&ShownReferencePicture> {
        let (reference, shown) = (self.reference_picture.as_ref()?, self.shown.as_ref()?);
        (self.is_current(&reference.picture.sequence) && reference.picture.frame == shown.reply.frame)
            .then_some(reference)
    }

    /// The reference, if it is of the loaded sequence.
    pub fn current_reference(&self) -> Option<&Arc<CameraReference>> {
        self.reference.as_ref().filter(|reference| self.is_current(reference.sequence()))
    }

    /// The difference to show: from the reference, or between two rendered pictures.
    pub fn difference(&self, with_reference: bool) -> Option<(&Arc<Difference>, &DisplayImage)> {
        if with_reference {
            let reference = self.current_reference_picture()?;
            return reference.picture.difference.as_ref().zip(reference.difference.as_ref());
        }
        let shown = self.shown.as_ref()?;
        shown.reply.difference.as_ref().zip(shown.difference.as_ref())
    }

    fn is_current(&self, sequence: &Arc<Sequence>) -> bool {
        self.sequence().is_some_and(|current| Arc::ptr_eq(current, sequence))
    }
}

impl ShownFrame {
    /// Reuses the textures of the frame before.
    fn new(reply: FrameReply, before: Option<Self>, context: &egui::Context) -> Self {
        let (old, old_difference, old_depths, old_errors) = before.map_or_else(Default::default, |before| {
            (before.images, before.difference, before.depths, before.errors)
        });
        let raw = |image: &Arc<egui::ColorImage>| DisplayImage::new(context, "raw", image.clone(), None);
        let pictures = reply.pictures.iter().map(|picture| &picture.image);
        let difference = reply.difference.as_ref().map(|difference| {
            DisplayImage::new(context, "difference", difference.image.clone(), old_difference)
        });
        Self {
            images: display_images("picture", pictures, old, context),
            depths: display_images(
                "depth",
                reply.depths.iter().map(|depth| &depth.image),
                old_depths,
                context,
            ),
            raws: reply.raws.iter().map(|image| image.as_ref().map(raw)).collect(),
            errors: display_images(
                "predicted error",
                reply.errors.iter().map(|errors| &errors.image),
                old_errors,
                context,
            ),
            difference,
            reply,
        }
    }

    fn set_errors(&mut self, errors: Vec<Arc<ErrorOverlay>>, context: &egui::Context) {
        let old = std::mem::take(&mut self.errors);
        let images = errors.iter().map(|errors| &errors.image);
        self.errors = display_images("predicted error", images, old, context);
        self.reply.errors = errors;
    }
}

/// Gaps as the log's report counts them, by its own clock: `speed` makes them shorter in path time.
fn gaps_s(log: &FlightLog, speed: f64) -> Vec<[f64; 2]> {
    if log.report.gaps.count == 0 {
        return Vec::new();
    }
    let steps = log.rows.windows(2).map(|pair| [pair[0].t_s, pair[1].t_s]);
    steps.filter(|[from_s, to_s]| (to_s - from_s) * speed > GAP_S).collect()
}

/// One [`DisplayImage`] for each image, in the textures of `old` as far as there are any.
fn display_images<'a>(
    name: &str,
    images: impl Iterator<Item = &'a Arc<egui::ColorImage>>,
    old: Vec<DisplayImage>,
    context: &egui::Context,
) -> Vec<DisplayImage> {
    let mut old = old.into_iter();
    images.map(|image| DisplayImage::new(context, name, image.clone(), old.next())).collect()
}
