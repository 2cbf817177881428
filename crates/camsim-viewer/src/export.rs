//! Export of a range of frames to files, on a thread of its own.
//!
//! The command line passes an [`Exporter`] that renders and writes as `camsim render` does.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use camsim_core::scenario::Rig;

/// An export: what to render, and its progress.
#[derive(Debug)]
pub struct ExportJob {
    /// The cameras of the scenario, legal and with resolved paths.
    pub rig: Rig,
    /// Number of the camera whose frames are rendered.
    pub camera: usize,
    /// Output folder.
    pub folder: PathBuf,
    /// First frame, and the frame after the last.
    pub frames: [u64; 2],
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
    began: Instant,
    repaint: Option<eframe::egui::Context>,
}

/// Progress of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Number of finished pictures.
    pub done: u64,
    /// How it ended: a summary, or an error; `None` while it runs.
    pub ended: Option<Result<String, String>>,
}

/// Renders a job, calls [`ExportJob::tick`] after each frame, and stops soon after that returns `false`.
/// Returns a summary or an error.
pub type Exporter = Arc<dyn Fn(&ExportJob) -> Result<String, String> + Send + Sync>;

impl ExportJob {
    /// A job that is not started.
    pub fn new(rig: Rig, camera: usize, folder: PathBuf, frames: [u64; 2]) -> Self {
        let (cancelled, progress) = (AtomicBool::new(false), Mutex::default());
        Self { rig, camera, folder, frames, cancelled, progress, began: Instant::now(), repaint: None }
    }

    /// Starts `exporter` for a job, on its own thread.
    pub(crate) fn start(exporter: &Exporter, new: Self, context: &eframe::egui::Context) -> Arc<Self> {
        let job = Arc::new(Self { repaint: Some(context.clone()), ..new });
        let (exporter, thread_job) = (exporter.clone(), job.clone());
        let spawned = std::thread::Builder::new().name("camsim export".into()).spawn(move || {
            let run = std::panic::AssertUnwindSafe(|| exporter(&thread_job));
            let ended =
                std::panic::catch_unwind(run).unwrap_or_else(|_| Err("internal error in the export".into()));
            thread_job.end(ended);
        });
        if let Err(error) = spawned {
            job.end(Err(format!(
                "cannot start a thread for the export: {error}; close other programs and try again"
            )));
        }
        job
    }

    /// Number of pictures: the frames, and those of their twins.
    pub fn pictures(&self) -> u64 {
        let frames = self.frames[1].saturating_sub(self.frames[0]);
        let twins = self.rig.first().output.twin.iter();
        frames * (1 + twins.map(|twin| u64::from(twin.instants.unwrap_or(1))).sum::<u64>())
    }

    /// Counts a finished picture; returns whether to continue.
    pub fn tick(&self) -> bool {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).done += 1;
        self.request_repaint();
        !self.cancelled.load(Ordering::Relaxed)
    }

    /// Requests cancellation.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether cancellation was requested.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// The progress.
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Estimated remaining time, seconds, from the mean so far; `None` before the second frame, because the
    /// first includes setup.
    pub fn remaining_s(&self) -> Option<f64> {
        let done = self.progress().done;
        let left = self.pictures().checked_sub(done)?;
        (done >= 2).then(|| left as f64 * self.began.elapsed().as_secs_f64() / done as f64)
    }

    fn end(&self, ended: Result<String, String>) {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).ended = Some(ended);
        self.request_repaint();
    }

    fn request_repaint(&self) {
        if let Some(context) = &self.repaint {
            context.request_repaint();
        }
    }
}
