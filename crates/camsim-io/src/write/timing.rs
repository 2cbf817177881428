//! `timing.csv`: when each frame was triggered, what its stamp says, and whether it arrived.

use std::fmt::Write as _;

use camsim_core::{sequence::Sequence, timing_faults::Delivery};

/// Name of the table.
pub const TIMING_CSV: &str = "timing.csv";
/// Columns. `nominal_ns` and `trigger_ns` are on the clock of trajectories, `stamp_ns` is the camera's.
const COLUMNS: &str = "frame,delivery,picture,nominal_ns,trigger_ns,stamp_ns";

/// Text of `timing.csv` for all frames of a sequence, whichever are rendered; `None` for a camera without faults.
#[must_use]
pub fn timing_csv(sequence: &Sequence) -> Option<String> {
    let faults = sequence.timing_faults()?;
    let epoch_ns = sequence.platform_epoch_ns();
    let ns =
        |from_start_s: f64| epoch_ns.saturating_add(((sequence.start_s + from_start_s) * 1e9).round() as i64);
    let mut text = format!("{COLUMNS}\n");
    for frame in 0..sequence.frames {
        let (delivery, picture) = match faults.delivery(frame) {
            Delivery::Own => ("own", frame),
            Delivery::Dropped => ("dropped", frame),
            Delivery::Doubled(picture) => ("doubled", picture),
            Delivery::Missed => ("missed", frame),
        };
        let nominal_ns = ns(faults.nominal_s(frame as i64));
        let trigger_ns = ns(faults.trigger_s(frame as i64));
        let stamp_ns = sequence.stamp_ns(frame);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{frame},{delivery},{picture},{nominal_ns},{trigger_ns},{stamp_ns}");
    }
    Some(text)
}
