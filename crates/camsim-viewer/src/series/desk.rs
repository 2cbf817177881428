//! Works series out beside the window: of hours of flight they take a good fraction of a second, and while a parameter is dragged each preview wants others.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use camsim_io::load::Loaded;
use eframe::egui::Context;

use super::Series;

/// The last series, and those that are being worked out.
#[derive(Debug, Default)]
pub struct Desk {
    done: Option<Arc<Series>>,
    coming: Option<Receiver<Series>>,
}

impl Desk {
    /// The series of what is loaded. Until they are there: those of the same log before the last change, `None` without any. Asks for a repaint when there are others.
    pub fn series(&mut self, loaded: &Arc<Loaded>, context: &Context) -> Option<Arc<Series>> {
        match self.coming.as_ref().map(Receiver::try_recv) {
            Some(Ok(series)) => (self.done, self.coming) = (Some(Arc::new(series)), None),
            Some(Err(TryRecvError::Disconnected)) => self.coming = None,
            Some(Err(TryRecvError::Empty)) | None => {}
        }
        let is_current = self.done.as_ref().is_some_and(|series| series.is_of(loaded));
        if !is_current && self.coming.is_none() {
            self.coming = Some(begin(loaded.clone(), context.clone()));
        }
        self.done.clone().filter(|series| series.is_of_log(loaded))
    }
}

fn begin(loaded: Arc<Loaded>, context: Context) -> Receiver<Series> {
    let (sender, coming) = channel();
    let work = move || {
        // The window may be gone by then.
        let _ = sender.send(Series::new(&loaded));
        context.request_repaint();
    };
    // Without a thread the sender is gone: the next pass tries again.
    let _ = std::thread::Builder::new().name("camsim series".into()).spawn(work);
    coming
}
