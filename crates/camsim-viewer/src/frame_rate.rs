//! Frame rate of the window, for measurements: `CAMSIM_VIEWER_PULSE=1` draws the window all the time and prints its
//! rate to standard error; `CAMSIM_VIEWER_PULSE=0` prints how long each picture took to settle.

use std::time::{Duration, Instant};

use eframe::egui::Context;

use crate::state::State;

/// Time between two printed lines.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// Counts passes of egui and requests the next one at once, so that the window is drawn as often as it can
/// be.
#[derive(Debug)]
pub struct FrameRateMonitor {
    report_began: Instant,
    last_pass: Instant,
    passes: u32,
    longest: Duration,
    /// Whether the window is drawn all the time.
    pulses: bool,
    settled_in_s: Option<f64>,
}

impl FrameRateMonitor {
    /// A monitor if `CAMSIM_VIEWER_PULSE` is set.
    pub fn from_env() -> Option<Self> {
        let now = Instant::now();
        std::env::var_os("CAMSIM_VIEWER_PULSE").map(|value| Self {
            report_began: now,
            last_pass: now,
            passes: 0,
            longest: Duration::ZERO,
            pulses: value != "0",
            settled_in_s: None,
        })
    }

    /// Counts one pass, and prints a line if the last one is [`REPORT_INTERVAL`] ago.
    pub fn count_pass(&mut self, state: &State, context: &Context) {
        if !self.pulses {
            return self.print_settled(state);
        }
        context.request_repaint();
        let now = Instant::now();
        self.passes += 1;
        self.longest = self.longest.max(now - self.last_pass);
        self.last_pass = now;
        let elapsed = now - self.report_began;
        if elapsed >= REPORT_INTERVAL {
            let rate = f64::from(self.passes) / elapsed.as_secs_f64();
            let preview_ms = state.engine.preview_ms.unwrap_or_default();
            let full_ms = state.engine.full_ms.unwrap_or_default();
            let longest_ms = 1e3 * self.longest.as_secs_f64();
            eprintln!(
                "{rate:.1} passes/s, longest {longest_ms:.0} ms; last preview {preview_ms:.0} ms, \
                 last full frame {full_ms:.0} ms"
            );
            (self.report_began, self.passes, self.longest) = (now, 0, Duration::ZERO);
        }
    }

    fn print_settled(&mut self, state: &State) {
        if state.settled_in_s != self.settled_in_s {
            self.settled_in_s = state.settled_in_s;
            let shown =
                state.engine.shown.as_ref().map(|shown| (shown.reply.frame, shown.reply.request.size));
            eprintln!("{shown:?} after {:.3} s", self.settled_in_s.unwrap_or_default());
        }
    }
}
