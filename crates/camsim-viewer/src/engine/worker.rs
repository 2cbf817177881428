//! A thread that renders pictures.

use std::{
    convert::Infallible,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    time::Instant,
};

use camsim_core::{mount::CameraPath, scenario::Channel, sequence::Sequence};
use camsim_engine::{Backend, Engine, Finished, GpuError, RenderError, Session};
use camsim_plan::PlanError;

use super::{
    Speaker,
    errors::Errors,
    library::{Library, LibraryError},
    mailbox::Mailbox,
    messages::{ErrorsReply, FrameReply, Reply, Size, Stage, Truth, Wanted},
    picture::{Picture, depth_image, depth_range_m, difference, screen},
    variants::{preview, staged},
};

/// Pictures that are kept: two stages in two sizes, and those of the frame before.
const KEPT: usize = 8;

/// Why a request could not be answered.
#[derive(Debug, thiserror::Error)]
enum Fault {
    #[error(transparent)]
    Load(#[from] LibraryError),
    #[error(transparent)]
    Mount(#[from] camsim_core::mount::MountError),
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error("the renderer stopped at a fault of its own; the next change is tried on a device opened anew")]
    Stopped,
    #[error("frame {0} was not rendered; move the timeline to try again")]
    Missing(u64),
}

impl Fault {
    /// After which nothing works on this device.
    fn is_of_device(&self) -> bool {
        matches!(self, Self::Stopped | Self::Render(RenderError::Gpu(GpuError::Device(_))))
    }
}

/// Serves requests until the box is closed.
pub fn run(mailbox: &Mailbox<Wanted>, library: &Library, speaker: &Speaker) {
    run_on(|| Engine::open(Backend::Auto), mailbox, library, speaker);
}

/// The same on what `open` gives: anew after a loss, with the request that met it once more, and with each
/// request where there is nothing to run on.
fn run_on(
    open: impl Fn() -> Result<Engine, GpuError>,
    mailbox: &Mailbox<Wanted>,
    library: &Library,
    speaker: &Speaker,
) {
    let mut waiting = None;
    // A request that loses one device after the other is told, not tried for ever.
    let mut lost_with: Option<Wanted> = None;
    loop {
        let engine = match open() {
            Ok(engine) => engine,
            Err(error) => {
                speaker.say(Reply::Failed(error.to_string()));
                waiting = mailbox.take();
                if waiting.is_none() {
                    return;
                }
                continue;
            }
        };
        speaker.say(Reply::Adapter(engine.to_string()));
        let mut worker =
            Worker { engine: &engine, speaker, library, session: None, kept: Vec::new(), rendered: 0 };
        loop {
            let Some(wanted) = waiting.take().or_else(|| mailbox.take()) else { return };
            // wgpu panics where a device goes while something is made on it.
            let served = catch_unwind(AssertUnwindSafe(|| worker.serve(&wanted, mailbox)))
                .unwrap_or(Err(Fault::Stopped));
            let Err(fault) = served else {
                if lost_with.take().is_some_and(|lost| lost == wanted) {
                    speaker.say(Reply::Told(
                        "the graphics device was lost; the frame is of another one, opened anew".into(),
                    ));
                }
                continue;
            };
            speaker.say(Reply::Busy(String::new()));
            speaker.say(Reply::Failed(fault.to_string()));
            if fault.is_of_device() {
                if lost_with.as_ref() != Some(&wanted) {
                    waiting = Some(wanted.clone());
                    lost_with = Some(wanted);
                }
                break;
            }
        }
    }
}

/// A picture that was made.
struct Kept {
    sequence: Arc<Sequence>,
    stage: Stage,
    size: Size,
    picture: Arc<Picture>,
    errors: Option<Arc<Errors>>,
}

struct Worker<'a> {
    engine: &'a Engine,
    speaker: &'a Speaker,
    library: &'a Library,
    session: Option<Session<'a>>,
    kept: Vec<Kept>,
    /// Frames rendered so far.
    rendered: u64,
}

impl<'a> Worker<'a> {
    fn serve(&mut self, wanted: &Wanted, mailbox: &Mailbox<Wanted>) -> Result<(), Fault> {
        let (begun, before) = (Instant::now(), self.rendered);
        let loaded = match self.library.load(wanted, self.speaker) {
            Err(LibraryError::Superseded) => return Ok(()),
            loaded => loaded?,
        };
        let sequence = &loaded.sequence;
        let frame = wanted.frame.min(sequence.frames.saturating_sub(1));
        let mut pictures = Vec::new();
        for &stage in &wanted.stages {
            // A preview is finished in any case: in a long drag somebody always wants something newer.
            if wanted.size == Size::Full && !pictures.is_empty() && mailbox.is_newer() {
                return Ok(());
            }
            pictures.push(self.picture(sequence, stage, wanted.size, frame)?);
        }
        let mut truths = Vec::new();
        if wanted.truth {
            for &stage in &wanted.stages {
                truths.push(Arc::new(self.truth(sequence, stage, wanted.size, frame)?));
            }
        }
        let errors = if wanted.errors { self.known_errors(&pictures) } else { Vec::new() };
        let missing = wanted.errors && errors.is_empty();
        let difference = match (wanted.gain, pictures.as_slice()) {
            (Some(gain), [a, b]) => {
                let size_px = a.frame.size_px;
                difference(size_px, &a.frame.color_rgba, &b.frame.color_rgba, gain, size_px[1]).map(Arc::new)
            }
            _ => None,
        };
        let took = (self.rendered > before).then(|| begun.elapsed());
        let reply = FrameReply {
            wanted: wanted.clone(),
            frame,
            pictures: pictures.clone(),
            truths,
            errors,
            difference,
            took,
        };
        self.speaker.say(Reply::Frame(Box::new(reply)));
        if missing {
            self.tell_errors(wanted, sequence, &pictures, mailbox)?;
        }
        Ok(())
    }

    /// What is predicted of pictures that are on show already, unless somebody wants something newer.
    fn tell_errors(
        &mut self,
        wanted: &Wanted,
        sequence: &Arc<Sequence>,
        pictures: &[Arc<Picture>],
        mailbox: &Mailbox<Wanted>,
    ) -> Result<(), Fault> {
        let mut errors = Vec::new();
        for picture in pictures {
            if mailbox.is_newer() {
                return Ok(());
            }
            errors.push(self.errors(sequence, wanted.size, picture)?);
        }
        self.speaker.say(Reply::Errors(Box::new(ErrorsReply { wanted: wanted.clone(), errors })));
        Ok(())
    }

    fn picture(
        &mut self,
        sequence: &Arc<Sequence>,
        stage: Stage,
        size: Size,
        frame: u64,
    ) -> Result<Arc<Picture>, Fault> {
        let same = |kept: &Kept| {
            Arc::ptr_eq(&kept.sequence, sequence)
                && (kept.stage, kept.size) == (stage, size)
                && kept.picture.frame.index == frame
        };
        if let Some(kept) = self.kept.iter().find(|kept| same(kept)) {
            return Ok(kept.picture.clone());
        }
        let done = self.render(&variant(sequence, stage, size)?, &[Channel::Color], frame)?;
        let Finished { frame, plan, times, .. } = done;
        let image = Arc::new(screen(frame.size_px, &frame.color_rgba));
        let picture = Arc::new(Picture { stage, frame, plan, times, image });
        if self.kept.len() >= KEPT {
            self.kept.remove(0);
        }
        self.kept.push(Kept {
            sequence: sequence.clone(),
            stage,
            size,
            picture: picture.clone(),
            errors: None,
        });
        Ok(picture)
    }

    fn truth(
        &mut self,
        sequence: &Arc<Sequence>,
        stage: Stage,
        size: Size,
        frame: u64,
    ) -> Result<Truth, Fault> {
        let done = self.render(&variant(sequence, stage, size)?, &[Channel::Color, Channel::Depth], frame)?;
        let depth_m = done.frame.depth_m.unwrap_or_default();
        let range_m = depth_range_m(&depth_m);
        let image = Arc::new(depth_image(done.frame.size_px, &depth_m, range_m));
        Ok(Truth { depth_m, range_m, image })
    }

    /// What is predicted of all of the pictures, if all of it was worked out before.
    fn known_errors(&self, pictures: &[Arc<Picture>]) -> Vec<Arc<Errors>> {
        let of = |picture| {
            self.kept
                .iter()
                .find(|kept| Arc::ptr_eq(&kept.picture, picture))
                .and_then(|kept| kept.errors.clone())
        };
        pictures.iter().map(of).collect::<Option<Vec<_>>>().unwrap_or_default()
    }

    /// What is predicted of a picture, from place to place.
    fn errors(
        &mut self,
        sequence: &Arc<Sequence>,
        size: Size,
        picture: &Arc<Picture>,
    ) -> Result<Arc<Errors>, Fault> {
        if let Some(errors) = self.known_errors(std::slice::from_ref(picture)).pop() {
            return Ok(errors);
        }
        let planned = variant(sequence, picture.stage, size)?;
        let map = self.session(&planned, &[Channel::Color])?.planner().error_map(&picture.plan)?;
        let errors = Arc::new(Errors::new(picture, map));
        if let Some(kept) = self.kept.iter_mut().find(|kept| Arc::ptr_eq(&kept.picture, picture)) {
            kept.errors = Some(errors.clone());
        }
        Ok(errors)
    }

    /// One frame, by the session that there is.
    fn render(
        &mut self,
        sequence: &Arc<Sequence>,
        channels: &[Channel],
        frame: u64,
    ) -> Result<Finished, Fault> {
        let session = self.session(sequence, channels)?;
        let mut done = None;
        let mut keep = |finished| {
            done = Some(finished);
            Ok(())
        };
        session.render::<Infallible>([frame], &mut keep)?;
        self.rendered += 1;
        done.ok_or(Fault::Missing(frame))
    }

    /// The session, for the frames of a sequence.
    fn session(&mut self, sequence: &Arc<Sequence>, channels: &[Channel]) -> Result<&mut Session<'a>, Fault> {
        Ok(match &mut self.session {
            Some(session) => {
                let planner = session.planner();
                let truth = channels.contains(&Channel::Depth);
                if !same_frames(planner.sequence(), sequence) || planner.wants_truth() != truth {
                    session.renew::<Infallible>(sequence.clone(), channels)?;
                }
                session
            }
            none => {
                self.speaker.say(Reply::Busy("preparing the device".into()));
                let session = self.engine.session::<Infallible>(sequence.clone(), channels)?;
                self.speaker.say(Reply::Busy(String::new()));
                none.insert(session)
            }
        })
    }
}

/// The sequence of a stage: what is loaded is shared, only the camera differs.
fn variant(sequence: &Arc<Sequence>, stage: Stage, size: Size) -> Result<Arc<Sequence>, Fault> {
    let mut scenario = staged(&sequence.scenario, stage);
    if size == Size::Preview {
        scenario = preview(&scenario);
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

/// Whether two sequences have the same frames: the same scenario, made of the same files as they were read.
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
