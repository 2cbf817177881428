//! Rendering a range of frames to files, beside the window.
//!
//! How frames are written is the command line's business: it hands the viewer an [`Exporter`] that does what
//! `camsim render` does.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use camsim_core::scenario::Scenario;

/// What to render, and how far it is.
#[derive(Debug)]
pub struct ExportJob {
    /// The scenario, legal and with its paths resolved.
    pub scenario: Scenario,
    /// Output folder.
    pub folder: PathBuf,
    /// First frame, and the one after the last.
    pub frames: [u64; 2],
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
    begun: Instant,
    repaint: Option<eframe::egui::Context>,
}

/// How far an export is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Frames that are done.
    pub done: u64,
    /// How it ended: what there is to say, or what went wrong.
    pub ended: Option<Result<String, String>>,
}

/// Renders a job, tells each finished frame by [`ExportJob::tick`], and stops soon after that says so. The
/// text says what was done.
pub type Exporter = Arc<dyn Fn(&ExportJob) -> Result<String, String> + Send + Sync>;

impl ExportJob {
    /// A job that nobody has started.
    pub fn new(scenario: Scenario, folder: PathBuf, frames: [u64; 2]) -> Self {
        let (cancelled, progress) = (AtomicBool::new(false), Mutex::default());
        Self { scenario, folder, frames, cancelled, progress, begun: Instant::now(), repaint: None }
    }

    /// Starts `exporter` on its own thread.
    pub(crate) fn start(
        exporter: &Exporter,
        scenario: Scenario,
        folder: PathBuf,
        frames: [u64; 2],
        context: &eframe::egui::Context,
    ) -> Arc<Self> {
        let job = Arc::new(Self { repaint: Some(context.clone()), ..Self::new(scenario, folder, frames) });
        let (exporter, of_thread) = (exporter.clone(), job.clone());
        let spawned = std::thread::Builder::new().name("camsim export".into()).spawn(move || {
            let run = std::panic::AssertUnwindSafe(|| exporter(&of_thread));
            let ended = std::panic::catch_unwind(run)
                .unwrap_or_else(|_| Err("the export stopped at a fault of its own".into()));
            of_thread.end(ended);
        });
        if let Err(error) = spawned {
            job.end(Err(format!("no thread for the export: {error}; close other programs and try again")));
        }
        job
    }

    /// One more frame is done. Whether to go on.
    pub fn tick(&self) -> bool {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).done += 1;
        self.tell();
        !self.cancelled.load(Ordering::Relaxed)
    }

    /// Asks it to stop.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Seconds that the rest will take if it goes on as it went so far; `None` before the second frame: the
    /// first takes what is done once, too.
    pub fn left_s(&self) -> Option<f64> {
        let done = self.progress().done;
        let left = (self.frames[1] - self.frames[0]).checked_sub(done)?;
        (done >= 2).then(|| left as f64 * self.begun.elapsed().as_secs_f64() / done as f64)
    }

    fn end(&self, ended: Result<String, String>) {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).ended = Some(ended);
        self.tell();
    }

    fn tell(&self) {
        if let Some(context) = &self.repaint {
            context.request_repaint();
        }
    }
}
