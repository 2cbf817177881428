//! The engine's side of the viewer: threads that load and render, and the messages by which the window speaks
//! with them.
//!
//! The window never waits, but when it closes: then for the frame that is at work. What it wants stands in a
//! [`Mailbox`] that holds one request, the latest; what comes back are [`Reply`]s in a channel, and a repaint
//! is asked for with each. Previews and full frames have a thread and a device each, and egui has its own: a
//! device has one queue, in order, and a hand that moves on must not wait for a full frame, nor the window
//! for either. Finished pictures cross by way of the host, as `camsim render` reads them. What is loaded is
//! shared.

mod errors;
mod exact;
mod library;
mod mailbox;
mod messages;
mod picture;
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

pub use errors::{DECADES, Errors};
use library::Library;
pub use mailbox::Mailbox;
pub use messages::{ExactPicture, ExactWanted, FrameReply, Reply, Size, Stage, Truth, Wanted};
pub use picture::{Difference, Picture, ramp};
pub use variants::{preview_factor, staged};

/// The engine's threads as the window sees them. Dropping it ends them and waits until they have: whoever
/// ends the program while one of them still gives its device back may do so in a driver that is just being
/// unloaded, which is a fault of memory now and then.
#[derive(Debug)]
pub struct Handle {
    previews: Arc<Mailbox<Wanted>>,
    frames: Arc<Mailbox<Wanted>>,
    exact: Arc<Mailbox<ExactWanted>>,
    library: Arc<Library>,
    replies: Receiver<Reply>,
    threads: Vec<JoinHandle<()>>,
}

/// Where replies go; each asks for a repaint.
#[derive(Clone)]
pub struct Speaker {
    replies: Sender<Reply>,
    repaint: Arc<dyn Fn() + Send + Sync>,
}

impl std::fmt::Debug for Speaker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Speaker")
    }
}

impl Speaker {
    /// A closed window ends the conversation: nothing to do about a failed send.
    pub(crate) fn say(&self, reply: Reply) {
        let _ = self.replies.send(reply);
        (self.repaint)();
    }
}

impl Handle {
    /// Starts the threads; `repaint` is called with each reply, from theirs.
    pub fn start(repaint: impl Fn() + Send + Sync + 'static) -> Self {
        let (sender, replies) = channel();
        let speaker = Speaker { replies: sender, repaint: Arc::new(repaint) };
        let (previews, frames, exact) =
            (Arc::new(Mailbox::default()), Arc::new(Mailbox::default()), Arc::new(Mailbox::default()));
        let library = Arc::new(Library::default());
        let mut threads = Vec::new();
        for (name, mailbox) in [("camsim previews", &previews), ("camsim frames", &frames)] {
            let (mailbox, library, voice) = (mailbox.clone(), library.clone(), speaker.clone());
            threads.extend(spawn(name, speaker.clone(), move || worker::run(&mailbox, &library, &voice)));
        }
        let (mailbox, voice) = (exact.clone(), speaker.clone());
        threads.extend(spawn("camsim oracle", speaker, move || exact::run(&mailbox, &voice)));
        Self { previews, frames, exact, library, replies, threads }
    }

    /// Replaces what is wanted of the renderer.
    pub fn want(&self, wanted: Wanted) {
        self.library.announce(wanted.reading);
        match wanted.size {
            Size::Preview => {
                self.frames.clear();
                self.previews.put(wanted);
            }
            Size::Full => self.frames.put(wanted),
        }
    }

    /// Replaces what is wanted of the oracle.
    pub fn want_exact(&self, wanted: ExactWanted) {
        self.exact.put(wanted);
    }

    /// What has been said since the last time.
    pub fn replies(&self) -> impl Iterator<Item = Reply> + '_ {
        self.replies.try_iter()
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        self.previews.close();
        self.frames.close();
        self.exact.close();
        for thread in self.threads.drain(..) {
            // Its panics are caught and told where they happen.
            let _ = thread.join();
        }
    }
}

/// A thread that comes back after a panic, with a word about it: a fault in one frame must not leave the
/// window with nothing behind it.
fn spawn(name: &str, speaker: Speaker, body: impl Fn() + Send + 'static) -> Option<JoinHandle<()>> {
    let voice = speaker.clone();
    let body = move || {
        while catch_unwind(AssertUnwindSafe(&body)).is_err() {
            voice.say(Reply::Failed(
                "the renderer stopped at a fault of its own; it goes on with the next change".into(),
            ));
        }
    };
    let no_thread = |error: &std::io::Error| {
        speaker.say(Reply::Failed(format!(
            "no thread for the renderer: {error}; close other programs and open the viewer again"
        )));
    };
    std::thread::Builder::new().name(name.into()).spawn(body).inspect_err(no_thread).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_thread_outlives_the_handle() {
        let held = Arc::new(());
        for _ in 0..20 {
            let by_threads = held.clone();
            drop(Handle::start(move || drop(by_threads.clone())));
            assert_eq!(Arc::strong_count(&held), 1, "threads still speak");
        }
    }
}
