//! Ctrl-C: the first one ends a run after the current frames, the second one at once.

use std::sync::{
    Once,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use crate::failure::INTERRUPTED;

static RUNS: AtomicUsize = AtomicUsize::new(0);
static ASKED: AtomicBool = AtomicBool::new(false);
static INSTALL: Once = Once::new();

/// While it exists, Ctrl-C requests a stop instead of ending the process.
#[derive(Debug)]
pub struct Watch(());

/// Starts to handle Ctrl-C. If no handler can be installed, Ctrl-C ends the process.
#[must_use]
pub fn watch() -> Watch {
    INSTALL.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            if RUNS.load(Ordering::SeqCst) == 0 || ASKED.swap(true, Ordering::SeqCst) {
                #[allow(
                    clippy::disallowed_methods,
                    reason = "asked twice: what is half written has a temporary name, which the next run \
                              removes"
                )]
                std::process::exit(i32::from(INTERRUPTED));
            }
            // Nobody is left to tell if this stream is closed.
            let _ = std::io::Write::write_all(
                &mut std::io::stderr(),
                b"\nstopping after the frames that are under way; Ctrl-C again ends at once\n",
            );
        });
    });
    if RUNS.fetch_add(1, Ordering::SeqCst) == 0 {
        ASKED.store(false, Ordering::SeqCst);
    }
    Watch(())
}

impl Watch {
    /// Whether the user wants an end.
    #[must_use]
    pub fn is_asked(&self) -> bool {
        ASKED.load(Ordering::SeqCst)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        RUNS.fetch_sub(1, Ordering::SeqCst);
    }
}
