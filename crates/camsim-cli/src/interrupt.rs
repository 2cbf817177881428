//! Ctrl-C, and SIGTERM as batch systems and `kill` send it: the first one ends a run after the current frames, the
//! second one at once.

use std::sync::{
    Once,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use crate::failure::INTERRUPTED;

static RUNS: AtomicUsize = AtomicUsize::new(0);
static ASKED: AtomicBool = AtomicBool::new(false);
static INSTALL: Once = Once::new();

/// While it exists, Ctrl-C and SIGTERM request a stop instead of ending the process.
#[derive(Debug)]
pub struct Watch(());

/// Starts to handle Ctrl-C and SIGTERM. If no handler can be installed, they end the process.
#[must_use]
pub fn watch() -> Watch {
    INSTALL.call_once(|| {
        // Ctrl-C is for the program in front, where a shell has started this one behind it.
        if !is_interrupt_ignored() {
            let _ = ctrlc::set_handler(asked);
        }
        #[cfg(unix)]
        watch_termination();
    });
    if RUNS.fetch_add(1, Ordering::SeqCst) == 0 {
        ASKED.store(false, Ordering::SeqCst);
    }
    Watch(())
}

/// What a signal does.
fn asked() {
    if RUNS.load(Ordering::SeqCst) == 0 || ASKED.swap(true, Ordering::SeqCst) {
        #[allow(
            clippy::disallowed_methods,
            reason = "asked twice: what is half written has a temporary name, which the next run removes"
        )]
        std::process::exit(i32::from(INTERRUPTED));
    }
    // Nobody is left to tell if this stream is closed.
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        b"\nstopping after the frames that are under way; once more (Ctrl-C or SIGTERM) ends at once\n",
    );
}

#[cfg(unix)]
fn watch_termination() {
    use signal_hook::{consts::SIGTERM, iterator::Signals};

    let Ok(mut signals) = Signals::new([SIGTERM]) else { return };
    // Without a thread the signals are lost, and SIGKILL is left.
    let _ = std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || signals.forever().for_each(|_| asked()));
}

/// Whether this program was started with SIGINT ignored, as shells start what a script puts into the background.
fn is_interrupt_ignored() -> bool {
    // Where there is no such file, no program without `unsafe` can ask.
    std::fs::read_to_string("/proc/self/status").is_ok_and(|status| ignores_interrupt(&status))
}

/// Whether the bit of signal 2 is set in the mask `SigIgn` of a process's status.
fn ignores_interrupt(status: &str) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 0b10 != 0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mask_of_ignored_signals_is_read() {
        let status =
            |mask: &str| format!("Name:\tcamsim\nSigBlk:\t0000000000000002\nSigIgn:\t{mask}\nSigCgt:\t2\n");
        assert!(ignores_interrupt(&status("0000000000001006")));
        assert!(!ignores_interrupt(&status("0000000000001000")));
        assert!(!ignores_interrupt("Name:\tcamsim\n"));
    }
}
