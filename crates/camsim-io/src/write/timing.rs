//! `timing.csv`: when each frame was triggered, what its stamp says, and whether it arrived.

use camsim_core::{sequence::Sequence, timing_faults::Delivery};

use crate::columns::Columns;

/// Name of the table.
pub const TIMING_CSV: &str = "timing.csv";

/// A line of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimingRecord {
    pub(crate) frame: u64,
    pub(crate) delivery: &'static str,
    pub(crate) picture: u64,
    pub(crate) nominal_ns: i64,
    pub(crate) trigger_ns: i64,
    pub(crate) stamp_ns: i64,
}

/// Text of `timing.csv` for all frames of a sequence, whichever are rendered; `None` for a camera without faults.
#[must_use]
pub fn timing_csv(sequence: &Sequence) -> Option<String> {
    let faults = sequence.timing_faults()?;
    let epoch_ns = sequence.platform_epoch_ns();
    let ns =
        |from_start_s: f64| epoch_ns.saturating_add(((sequence.start_s + from_start_s) * 1e9).round() as i64);
    let record = |frame: u64| {
        let (delivery, picture) = match faults.delivery(frame) {
            Delivery::Own => ("own", frame),
            Delivery::Dropped => ("dropped", frame),
            Delivery::Doubled(picture) => ("doubled", picture),
            Delivery::Missed => ("missed", frame),
        };
        TimingRecord {
            frame,
            delivery,
            picture,
            nominal_ns: ns(faults.nominal_s(frame as i64)),
            trigger_ns: ns(faults.trigger_s(frame as i64)),
            stamp_ns: sequence.stamp_ns(frame),
        }
    };
    Some(Columns::all().csv((0..sequence.frames).map(record)))
}
