//! Times of the oracle: frame stamps, and the mid-exposure of each pixel.

use crate::{
    scenario::{CameraSpec, FieldOr, Parity, Readout},
    sequence::Sequence,
};

/// Times of all frames of a sequence, in path time.
#[derive(Clone, Debug)]
pub(super) struct FrameTiming {
    start_s: f64,
    fps: f64,
    phase: f64,
    size_px: [u32; 2],
    readout: Readout,
    readout_s: f64,
    delay_s: f64,
    interlace_s: f64,
    first_field: Parity,
}

impl FrameTiming {
    pub(super) fn new(sequence: &Sequence) -> Self {
        let CameraSpec { size_px, fps, phase, shutter, .. } = &sequence.scenario.camera;
        let interlace_s = match shutter.interlace_ms {
            FieldOr::Field => 0.5 / fps,
            FieldOr::Ms(ms) => ms / 1000.0,
        };
        Self {
            start_s: sequence.start_s,
            fps: *fps,
            phase: *phase,
            size_px: *size_px,
            readout: shutter.readout,
            readout_s: shutter.readout_ms / 1000.0,
            delay_s: shutter.delay_ms / 1000.0,
            interlace_s,
            first_field: shutter.first_field,
        }
    }

    /// Stamp of a frame: `start + (i + phase) / fps`.
    pub(super) fn stamp_s(&self, frame: u64) -> f64 {
        self.start_s + (frame as f64 + self.phase) / self.fps
    }

    /// As [`Self::stamp_s`], for a frame of any number.
    pub(super) fn stamp_of(&self, frame: f64) -> f64 {
        self.start_s + (frame + self.phase) / self.fps
    }

    /// Mid-exposure of a pixel relative to the stamp of its frame. The rows, counted along the readout, share
    /// the readout time evenly about `-delay`; rows of the first field are earlier by the interlacing lag.
    pub(super) fn dt_s(&self, [x, y]: [u32; 2]) -> f64 {
        self.dt_along_s(f64::from(if self.reads_rows() { y } else { x }), y)
    }

    /// Mid-exposure of a place along the readout, pixels, in the field of an image row.
    pub(super) fn dt_along_s(&self, along_px: f64, row: u32) -> f64 {
        let count = f64::from(self.lines());
        let nth = match self.readout {
            Readout::TopToBottom | Readout::LeftToRight => along_px,
            Readout::BottomToTop | Readout::RightToLeft => count - 1.0 - along_px,
        };
        let lag_s =
            if row.is_multiple_of(2) == (self.first_field == Parity::Even) { self.interlace_s } else { 0.0 };
        self.readout_s * (2.0 * nth + 1.0 - count) / (2.0 * count) - self.delay_s - lag_s
    }

    /// Mid-exposure of row `line` of the readout relative to the stamp. With sideways readout it is a column,
    /// and its time is that of the field without the lag.
    pub(super) fn dt_row_s(&self, line: u32) -> f64 {
        if self.reads_rows() {
            self.dt_s([0, line])
        } else {
            let later_row = u32::from(self.first_field == Parity::Even);
            self.dt_s([line, later_row])
        }
    }

    /// Number of rows (or columns) of the readout.
    pub(super) fn lines(&self) -> u32 {
        self.size_px[usize::from(self.reads_rows())]
    }

    /// Whether all pixels of an image row share one time.
    pub(super) fn reads_rows(&self) -> bool {
        matches!(self.readout, Readout::TopToBottom | Readout::BottomToTop)
    }

    /// Distance between rows of the same field: 2 if the fields have different times, else 1.
    pub(super) fn field_rows(&self) -> u32 {
        if self.interlace_s > 0.0 { 2 } else { 1 }
    }
}
