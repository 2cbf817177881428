//! Threads that load and render for the window, and the messages between them and it.
//!
//! The window never waits for them, except at its end for the frame in progress. Requests go through a
//! [`Mailbox`], which holds only the latest; [`Reply`]s come back through a channel, each with a repaint
//! request. Previews, full frames and egui have a device each, because a device has one queue, in order: a
//! preview must not wait for a full frame, nor the window for either. Pictures are read back to the CPU, as
//! in `camsim render`. Loaded files are shared.

mod error_overlay;
mod mailbox;
mod messages;
mod picture;
mod raw;
mod reference;
mod scenario_cache;
mod variants;
mod worker;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        mpsc::{Receiver, Sender, channel},
    },
    thread::JoinHandle,
};

pub use error_overlay::{ABOVE_BOUND, DECADES, ErrorOverlay};
pub use mailbox::Mailbox;
pub use messages::{
    DepthPicture, FrameReply, FrameRequest, ReferencePicture, ReferenceRequest, Reply, Size, Stage,
};
pub use picture::{Difference, Picture, ramp};
pub use raw::{BARS, Histogram, RawScale};
use scenario_cache::ScenarioCache;
pub use variants::{preview_factor, stage_scenario};

/// Handle of the engine's threads. Dropping it ends them and waits for them: ending the program while a
/// thread releases its device can crash in a driver that is being unloaded.
#[derive(Debug)]
pub struct EngineHandle {
    previews: Arc<Mailbox<FrameRequest>>,
    full_frames: Arc<Mailbox<FrameRequest>>,
    reference: Arc<Mailbox<ReferenceRequest>>,
    scenarios: Arc<ScenarioCache>,
    replies: Receiver<Reply>,
    threads: Vec<JoinHandle<()>>,
}

/// Sends replies to the window, each with a repaint request.
#[derive(Clone)]
pub struct ReplySender {
    sender: Sender<Reply>,
    repaint: Arc<dyn Fn() + Send + Sync>,
}

impl std::fmt::Debug for ReplySender {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ReplySender")
    }
}

impl ReplySender {
    /// Sends a reply. A send that fails because the window is closed is ignored.
    pub(crate) fn send(&self, reply: Reply) {
        let _ = self.sender.send(reply);
        (self.repaint)();
    }
}

impl EngineHandle {
    /// Starts the threads. They call `repaint` after each reply.
    pub fn start(repaint: impl Fn() + Send + Sync + 'static) -> Self {
        let (sender, replies) = channel();
        let reply_sender = ReplySender { sender, repaint: Arc::new(repaint) };
        let (previews, full_frames, reference) =
            (Arc::new(Mailbox::default()), Arc::new(Mailbox::default()), Arc::new(Mailbox::default()));
        let scenarios = Arc::new(ScenarioCache::default());
        let mut threads = Vec::new();
        for (name, mailbox) in [("camsim previews", &previews), ("camsim frames", &full_frames)] {
            let (mailbox, scenarios, replies) = (mailbox.clone(), scenarios.clone(), reply_sender.clone());
            threads.extend(spawn(name, reply_sender.clone(), move || {
                worker::run(&mailbox, &scenarios, &replies)
            }));
        }
        let (mailbox, replies_of_reference) = (reference.clone(), reply_sender.clone());
        threads.extend(spawn("camsim reference", reply_sender, move || {
            reference::run(&mailbox, &replies_of_reference);
        }));
        Self { previews, full_frames, reference, scenarios, replies, threads }
    }

    /// Replaces the request to the renderer. A preview also withdraws a full frame that has not begun. `cancels`
    /// says whether a full frame in progress is not wanted any more.
    pub fn request_frame(&self, request: FrameRequest, cancels: bool) {
        self.scenarios.announce(request.reload_count);
        if cancels {
            self.full_frames.cancel();
        }
        match request.size {
            Size::Preview => {
                self.full_frames.clear();
                self.previews.put(request);
            }
            Size::Full => self.full_frames.put(request),
        }
    }

    /// Replaces the request to the reference.
    pub fn request_reference(&self, request: ReferenceRequest) {
        self.reference.put(request);
    }

    /// Takes the replies that have arrived.
    pub fn replies(&self) -> impl Iterator<Item = Reply> + '_ {
        self.replies.try_iter()
    }
}

impl Drop for EngineHandle {
    fn drop(&mut self) {
        self.previews.close();
        self.full_frames.close();
        self.reference.close();
        for thread in self.threads.drain(..) {
            // `spawn` catches and reports panics.
            let _ = thread.join();
        }
    }
}

/// A thread that reports a panic and goes on: a fault in one frame must not leave the window without
/// renderer.
fn spawn(name: &str, replies: ReplySender, body: impl Fn() + Send + 'static) -> Option<JoinHandle<()>> {
    let thread_replies = replies.clone();
    let body = move || {
        while catch_unwind(AssertUnwindSafe(&body)).is_err() {
            thread_replies.send(Reply::Failed(
                "internal error in the renderer; it continues with the next change".into(),
            ));
        }
    };
    let report = |error: &std::io::Error| {
        replies.send(Reply::Failed(format!(
            "cannot start a thread for the renderer: {error}; close other programs and open the viewer again"
        )));
    };
    std::thread::Builder::new().name(name.into()).spawn(body).inspect_err(report).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropping_the_handle_ends_all_threads() {
        let token = Arc::new(());
        for _ in 0..20 {
            let held_by_threads = token.clone();
            drop(EngineHandle::start(move || drop(held_by_threads.clone())));
            assert_eq!(Arc::strong_count(&token), 1, "a thread still runs");
        }
    }
}
