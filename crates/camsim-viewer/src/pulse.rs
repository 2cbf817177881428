//! How often the window is drawn: for measuring, with `CAMSIM_VIEWER_PULSE=1`, on standard error.

use std::time::{Duration, Instant};

use eframe::egui::Context;

use crate::state::State;

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(1);

/// Counts passes, and has the window drawn all the time.
#[derive(Debug)]
pub struct Pulse {
    since: Instant,
    last: Instant,
    passes: u32,
    longest: Duration,
}

impl Pulse {
    /// If it was asked for.
    pub fn from_env() -> Option<Self> {
        let now = Instant::now();
        std::env::var_os("CAMSIM_VIEWER_PULSE").map(|_| Self {
            since: now,
            last: now,
            passes: 0,
            longest: Duration::ZERO,
        })
    }

    /// One pass.
    pub fn beat(&mut self, state: &State, context: &Context) {
        context.request_repaint();
        let now = Instant::now();
        self.passes += 1;
        self.longest = self.longest.max(now - self.last);
        self.last = now;
        let elapsed = now - self.since;
        if elapsed >= EVERY {
            let rate = f64::from(self.passes) / elapsed.as_secs_f64();
            let (preview_ms, full_ms) =
                (state.heard.preview_ms.unwrap_or_default(), state.heard.full_ms.unwrap_or_default());
            let longest_ms = 1e3 * self.longest.as_secs_f64();
            eprintln!(
                "{rate:.1} passes/s, longest {longest_ms:.0} ms; last preview {preview_ms:.0} ms, last full frame {full_ms:.0} ms"
            );
            (self.since, self.passes, self.longest) = (now, 0, Duration::ZERO);
        }
    }
}
