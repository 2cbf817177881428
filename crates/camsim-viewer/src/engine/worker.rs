//! The threads that render pictures.

use std::{
    convert::Infallible,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

use camsim_core::{mount::CameraPath, scenario::Channel, sequence::Sequence};
use camsim_engine::{Backend, Engine, Finished, GpuError, RenderError, Session};
use camsim_plan::PlanError;

use super::{
    ReplySender,
    error_overlay::ErrorOverlay,
    mailbox::Mailbox,
    messages::{DepthPicture, ErrorsReply, FrameReply, FrameRequest, Reply, Size, Stage},
    picture::{Picture, depth_image, depth_range_m, difference, srgb_image},
    raw::{RawScale, histogram, raw_image},
    scenario_cache::{ScenarioCache, ScenarioCacheError},
    variants::{preview_scenario, stage_scenario},
};

/// Cached pictures: two stages in two sizes, of this frame and the one before.
const CACHE_SIZE: usize = 8;

/// Why a request could not be answered.
#[derive(Debug, thiserror::Error)]
enum Fault {
    #[error(transparent)]
    Load(#[from] ScenarioCacheError),
    #[error(transparent)]
    Mount(#[from] camsim_core::mount::MountError),
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error("internal error in the renderer; the next change opens the device anew")]
    Stopped,
    #[error("frame {0} was not rendered; move the timeline to try again")]
    Missing(u64),
}

impl Fault {
    /// Whether the device must be opened anew.
    fn is_device_lost(&self) -> bool {
        matches!(self, Self::Stopped | Self::Render(RenderError::Gpu(GpuError::Device(_))))
    }
}

/// Serves requests until the mailbox is closed.
pub fn run(mailbox: &Mailbox<FrameRequest>, scenarios: &ScenarioCache, reply_sender: &ReplySender) {
    run_on(|| Engine::open(Backend::Auto), mailbox, scenarios, reply_sender);
}

/// Serves requests on the engine that `open` gives. Opens it anew after the loss of a device, and tries the
/// failed request once more; if it cannot be opened, tries again with each request.
fn run_on(
    open: impl Fn() -> Result<Engine, GpuError>,
    mailbox: &Mailbox<FrameRequest>,
    scenarios: &ScenarioCache,
    reply_sender: &ReplySender,
) {
    let mut retry = None;
    // A request is tried on two devices at most.
    let mut lost_request: Option<FrameRequest> = None;
    loop {
        let engine = match open() {
            Ok(engine) => engine,
            Err(error) => {
                reply_sender.send(Reply::Failed(error.to_string()));
                retry = mailbox.take();
                if retry.is_none() {
                    return;
                }
                continue;
            }
        };
        reply_sender.send(Reply::Adapter(engine.to_string()));
        let mut worker = Worker {
            engine: &engine,
            reply_sender,
            scenarios,
            cancel: mailbox.cancelled(),
            session: None,
            cache: Vec::new(),
            rendered: 0,
        };
        loop {
            let Some(request) = retry.take().or_else(|| mailbox.take()) else { return };
            // wgpu panics if the device is lost while a resource is created.
            let served = catch_unwind(AssertUnwindSafe(|| worker.serve(&request, mailbox)))
                .unwrap_or(Err(Fault::Stopped));
            // A newer request waits, or the preview of one is being rendered.
            if matches!(served, Err(Fault::Render(RenderError::Cancelled))) {
                lost_request = None;
                continue;
            }
            let Err(fault) = served else {
                if lost_request.take().is_some_and(|lost| lost == request) {
                    reply_sender.send(Reply::Notice(
                        "the graphics device was lost and opened anew; the frame was rendered again".into(),
                    ));
                }
                continue;
            };
            reply_sender.send(Reply::Busy(String::new()));
            reply_sender.send(Reply::Failed(fault.to_string()));
            if fault.is_device_lost() {
                if lost_request.as_ref() != Some(&request) {
                    retry = Some(request.clone());
                    lost_request = Some(request);
                }
                break;
            }
        }
    }
}

/// A rendered picture, by its sequence, stage and size.
struct CachedPicture {
    sequence: Arc<Sequence>,
    stage: Stage,
    size: Size,
    picture: Arc<Picture>,
    errors: Option<Arc<ErrorOverlay>>,
}

struct Worker<'a> {
    engine: &'a Engine,
    reply_sender: &'a ReplySender,
    scenarios: &'a ScenarioCache,
    /// Whether the frame in progress is not wanted any more.
    cancel: Arc<AtomicBool>,
    session: Option<Session<'a>>,
    cache: Vec<CachedPicture>,
    /// Frames rendered so far.
    rendered: u64,
}

impl<'a> Worker<'a> {
    fn serve(&mut self, request: &FrameRequest, mailbox: &Mailbox<FrameRequest>) -> Result<(), Fault> {
        let (began, before) = (Instant::now(), self.rendered);
        let loaded = match self.scenarios.load(request, self.reply_sender) {
            Err(ScenarioCacheError::Superseded) => return Ok(()),
            loaded => loaded?,
        };
        let sequence = &loaded.sequence;
        let frame = request.frame.min(sequence.frames.saturating_sub(1));
        let mut pictures = Vec::new();
        for &stage in &request.stages {
            // Previews are always finished: during a long drag there is always a newer request.
            if request.size == Size::Full && !pictures.is_empty() && mailbox.has_newer() {
                return Ok(());
            }
            pictures.push(self.picture(sequence, stage, request.size, frame)?);
        }
        let mut depths = Vec::new();
        if request.depth {
            for &stage in &request.stages {
                depths.push(Arc::new(self.depth_picture(sequence, stage, request.size, frame)?));
            }
        }
        let raw = |picture: &Arc<Picture>| raw_image(picture).map(Arc::new);
        let raws = pictures.iter().filter(|_| request.raw).map(raw).collect();
        let histograms = pictures.iter().filter(|_| request.histogram);
        let histograms = histograms.map(|picture| histogram(picture, request.raw)).collect();
        let errors = if request.errors { self.cached_errors(&pictures) } else { Vec::new() };
        let errors_missing = request.errors && errors.is_empty();
        let difference = match (request.gain, pictures.as_slice()) {
            (Some(gain), [a, b]) => {
                let size_px = a.frame.size_px;
                difference(size_px, a.frame.color_rgba(), b.frame.color_rgba(), gain, size_px[1])
                    .map(Arc::new)
            }
            _ => None,
        };
        let took = (self.rendered > before).then(|| began.elapsed());
        let reply = FrameReply {
            request: request.clone(),
            frame,
            pictures: pictures.clone(),
            depths,
            raws,
            histograms,
            errors,
            difference,
            took,
        };
        self.reply_sender.send(Reply::Frame(Box::new(reply)));
        if errors_missing {
            self.send_error_overlays(request, sequence, &pictures, mailbox)?;
        }
        Ok(())
    }

    /// Computes and sends the predicted errors of pictures that were sent, unless a newer request arrives.
    fn send_error_overlays(
        &mut self,
        request: &FrameRequest,
        sequence: &Arc<Sequence>,
        pictures: &[Arc<Picture>],
        mailbox: &Mailbox<FrameRequest>,
    ) -> Result<(), Fault> {
        let mut errors = Vec::new();
        for picture in pictures {
            if mailbox.has_newer() {
                return Ok(());
            }
            errors.push(self.errors(sequence, request.size, picture)?);
        }
        self.reply_sender.send(Reply::Errors(Box::new(ErrorsReply { request: request.clone(), errors })));
        Ok(())
    }

    fn picture(
        &mut self,
        sequence: &Arc<Sequence>,
        stage: Stage,
        size: Size,
        frame: u64,
    ) -> Result<Arc<Picture>, Fault> {
        let is_same = |cached: &CachedPicture| {
            Arc::ptr_eq(&cached.sequence, sequence)
                && (cached.stage, cached.size) == (stage, size)
                && cached.picture.frame.index == frame
        };
        if let Some(cached) = self.cache.iter().find(|cached| is_same(cached)) {
            return Ok(cached.picture.clone());
        }
        let began = Instant::now();
        let rendered = variant(sequence, stage, size)?;
        let finished = self.render(&rendered, &[Channel::Color], frame)?;
        let Finished { frame, plan, faces, times, .. } = finished;
        let gain = plan.exposure.map_or(1.0, |exposure| exposure.gain);
        let raw_scale = RawScale::new(&rendered.scenario.camera).map(|scale| scale.amplified(gain));
        let image = Arc::new(srgb_image(frame.size_px, frame.color_rgba()));
        let took_ms = 1e3 * began.elapsed().as_secs_f64();
        let picture = Arc::new(Picture { stage, frame, plan, faces, times, took_ms, raw_scale, image });
        if self.cache.len() >= CACHE_SIZE {
            self.cache.remove(0);
        }
        self.cache.push(CachedPicture {
            sequence: sequence.clone(),
            stage,
            size,
            picture: picture.clone(),
            errors: None,
        });
        Ok(picture)
    }

    fn depth_picture(
        &mut self,
        sequence: &Arc<Sequence>,
        stage: Stage,
        size: Size,
        frame: u64,
    ) -> Result<DepthPicture, Fault> {
        let finished =
            self.render(&variant(sequence, stage, size)?, &[Channel::Color, Channel::Depth], frame)?;
        let size_px = finished.frame.size_px;
        let depth_m = finished.frame.into_floats(Channel::Depth).unwrap_or_default();
        let range_m = depth_range_m(&depth_m);
        let image = Arc::new(depth_image(size_px, &depth_m, range_m));
        Ok(DepthPicture { depth_m, range_m, image })
    }

    /// The predicted errors of all pictures, if all are cached; else empty.
    fn cached_errors(&self, pictures: &[Arc<Picture>]) -> Vec<Arc<ErrorOverlay>> {
        let errors_of = |picture| {
            self.cache
                .iter()
                .find(|cached| Arc::ptr_eq(&cached.picture, picture))
                .and_then(|cached| cached.errors.clone())
        };
        pictures.iter().map(errors_of).collect::<Option<Vec<_>>>().unwrap_or_default()
    }

    /// The predicted errors of a picture, cached or computed.
    fn errors(
        &mut self,
        sequence: &Arc<Sequence>,
        size: Size,
        picture: &Arc<Picture>,
    ) -> Result<Arc<ErrorOverlay>, Fault> {
        if let Some(errors) = self.cached_errors(std::slice::from_ref(picture)).pop() {
            return Ok(errors);
        }
        let planned = variant(sequence, picture.stage, size)?;
        let planner = self.session(&planned, &[Channel::Color])?.planner();
        let maps = picture.plans().map(|plan| planner.error_map(plan));
        let errors = Arc::new(ErrorOverlay::new(picture, maps.collect::<Result<_, _>>()?));
        if let Some(cached) = self.cache.iter_mut().find(|cached| Arc::ptr_eq(&cached.picture, picture)) {
            cached.errors = Some(errors.clone());
        }
        Ok(errors)
    }

    /// Renders one frame.
    fn render(
        &mut self,
        sequence: &Arc<Sequence>,
        channels: &[Channel],
        frame: u64,
    ) -> Result<Finished, Fault> {
        let session = self.session(sequence, channels)?;
        let mut result = None;
        let mut keep = |finished| {
            result = Some(finished);
            Ok(())
        };
        session.render::<Infallible>([frame], &mut keep)?;
        self.rendered += 1;
        result.ok_or(Fault::Missing(frame))
    }

    /// The session, made or renewed for a sequence and channels.
    fn session(&mut self, sequence: &Arc<Sequence>, channels: &[Channel]) -> Result<&mut Session<'a>, Fault> {
        Ok(match &mut self.session {
            Some(session) => {
                let planner = session.planner();
                let wants_depth = channels.contains(&Channel::Depth);
                if !same_frames(planner.sequence(), sequence) || planner.wants_truth() != wants_depth {
                    session.renew::<Infallible>(sequence.clone(), channels)?;
                }
                session
            }
            none => {
                self.reply_sender.send(Reply::Busy("preparing the renderer".into()));
                let mut session = self.engine.session::<Infallible>(sequence.clone(), channels)?;
                session.set_cancel(self.cancel.clone());
                self.reply_sender.send(Reply::Busy(String::new()));
                none.insert(session)
            }
        })
    }
}

/// The sequence of a stage and size. It shares the loaded files; only the camera differs.
fn variant(sequence: &Arc<Sequence>, stage: Stage, size: Size) -> Result<Arc<Sequence>, Fault> {
    let mut scenario = stage_scenario(&sequence.scenario, stage);
    if size == Size::Preview {
        scenario = preview_scenario(&scenario);
    }
    if scenario == sequence.scenario {
        return Ok(sequence.clone());
    }
    let mut variant = Sequence::clone(sequence);
    if scenario.camera.mount != sequence.scenario.camera.mount {
        variant.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), &scenario.camera.mount)?);
    }
    if scenario.camera.photometric.vignette.is_none() {
        variant.vignette = None;
    }
    variant.scenario = scenario;
    Ok(Arc::new(variant))
}

/// Whether two sequences have the same frames: equal scenarios and the same loaded files.
fn same_frames(a: &Sequence, b: &Sequence) -> bool {
    let same_vignette = match (&a.vignette, &b.vignette) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (None, None) => true,
        _ => false,
    };
    same_vignette
        && Arc::ptr_eq(&a.scene, &b.scene)
        && Arc::ptr_eq(&a.path.trajectory, &b.path.trajectory)
        && a.zoom_track == b.zoom_track
        && a.scenario == b.scenario
}

#[cfg(test)]
mod tests;
