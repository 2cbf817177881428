//! Times of the reference: frame stamps, and the mid-exposure of each pixel.

use crate::{
    scenario::{CameraSpec, FieldOr, FlowInstant, Parity, Readout, Reset},
    sequence::Sequence,
    timing_faults::TimingFaults,
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
    reset: Reset,
    /// Camera and seed, where triggers are late or pictures doubled.
    faults: Option<(CameraSpec, u64)>,
}

impl FrameTiming {
    pub(super) fn new(sequence: &Sequence) -> Self {
        let camera = &sequence.scenario.camera;
        let CameraSpec { size_px, fps, phase, shutter, .. } = camera;
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
            readout_s: camera.readout_ms() / 1000.0,
            delay_s: shutter.delay_ms / 1000.0,
            interlace_s,
            first_field: shutter.first_field,
            reset: shutter.reset,
            faults: camera.timing.is_some().then(|| (camera.clone(), sequence.scenario.seed)),
        }
    }

    /// Instant of a frame to which its rows refer: `start + (i + phase) / fps`, and with faults of the timing
    /// the late trigger of the picture that it shows.
    pub(super) fn stamp_s(&self, frame: u64) -> f64 {
        self.stamp_of(frame as i64)
    }

    /// As [`Self::stamp_s`], for a frame of any number.
    pub(super) fn stamp_of(&self, frame: i64) -> f64 {
        let faults = self.faults.as_ref().and_then(|(camera, seed)| TimingFaults::new(camera, *seed));
        let (picture, late_s) = faults.map_or((frame, 0.0), |faults| {
            let picture = faults.picture(frame);
            (picture, faults.late_s(picture))
        });
        self.start_s + (picture as f64 + self.phase) / self.fps + late_s
    }

    /// Mid-exposure of a pixel relative to the stamp of its frame. The rows, counted along the readout, share
    /// the readout time evenly, with `-delay` in the image's centre; rows of the first field are earlier by the
    /// interlacing lag.
    pub(super) fn dt_s(&self, [x, y]: [u32; 2]) -> f64 {
        self.dt_along_s(f64::from(if self.reads_rows() { y } else { x }), y)
    }

    /// Mid-exposure of a position along the readout, pixels, in the field of an image row: linear from row to row.
    pub(super) fn dt_along_s(&self, along_px: f64, row: u32) -> f64 {
        let (nth, count) = self.position_in_readout(along_px);
        let lag_s =
            if row.is_multiple_of(2) == (self.first_field == Parity::Even) { self.interlace_s } else { 0.0 };
        // Rows whose exposures begin at once have their middles half as far apart as their ends.
        let spread_s = match self.reset {
            Reset::Rolling => self.readout_s,
            Reset::Global => self.readout_s / 2.0,
        };
        let nth_of_centre = match self.readout {
            Readout::MiddleOutward => 0.0,
            Readout::EdgesInward => count - 1.0,
            _ => (count - 1.0) / 2.0,
        };
        spread_s * (nth - nth_of_centre) / count - self.delay_s - lag_s
    }

    /// An instant of the frame relative to its stamp: that of the image's centre, or of the first or last of all
    /// mid-exposures.
    pub(super) fn instant_s(&self, instant: FlowInstant) -> f64 {
        let rows = 0..2.min(self.size_px[1]);
        let of_line = |line| {
            if self.reads_rows() { vec![[0, line]] } else { rows.clone().map(|y| [line, y]).collect() }
        };
        let times = (0..self.lines()).flat_map(of_line).map(|pixel| self.dt_s(pixel));
        match instant {
            FlowInstant::FirstRow => times.fold(f64::INFINITY, f64::min),
            FlowInstant::Centre => -self.delay_s,
            FlowInstant::LastRow => times.fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// How many rows are read before a position along the readout, and how many are read one after the other.
    fn position_in_readout(&self, along_px: f64) -> (f64, f64) {
        let count = f64::from(self.lines());
        // What is between the two middle rows has their time.
        let from_edge = along_px.min(count - 1.0 - along_px).min(count / 2.0 - 1.0);
        match self.readout {
            Readout::TopToBottom | Readout::LeftToRight => (along_px, count),
            Readout::BottomToTop | Readout::RightToLeft => (count - 1.0 - along_px, count),
            Readout::EdgesInward => (from_edge, count / 2.0),
            Readout::MiddleOutward => (count / 2.0 - 1.0 - from_edge, count / 2.0),
        }
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
        !matches!(self.readout, Readout::LeftToRight | Readout::RightToLeft)
    }

    /// Distance between rows of the same field: 2 if the fields have different times, else 1.
    pub(super) fn field_rows(&self) -> u32 {
        if self.interlace_s > 0.0 { 2 } else { 1 }
    }

    /// How much longer than `exposure_ms` a pixel is exposed, seconds: with a global reset by the time for which
    /// it waits until it is read.
    pub(super) fn longer_s(&self, [x, y]: [u32; 2]) -> f64 {
        let (nth, count) = self.position_in_readout(f64::from(if self.reads_rows() { y } else { x }));
        match self.reset {
            Reset::Rolling => 0.0,
            Reset::Global => self.readout_s * nth / count,
        }
    }
}
