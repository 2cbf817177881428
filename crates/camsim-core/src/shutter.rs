//! Exposure times of the rows of an image: delay, rolling shutter, exposure, interlacing (section 6 of the
//! paper).
//!
//! A row is exposed at once. Its time is relative to the stamp of the frame and is that of its
//! **mid-exposure**:
//!
//! `dt = -delay + ((row + 0.5)/N - 0.5) t_r - (t_i if the row belongs to the earlier field)`
//!
//! so the middle of the image has exactly `-delay`. Rows of the readout count from the top or, as columns,
//! from the left; the two reverse readout directions count from the other end. Interlaced fields always
//! consist of image rows, for any readout direction.
//!
//! **Split readout**: both halves of the rows are read at once, `dt = -delay + s (|2 row + 1 - N| - 1)/N t_r`
//! with s = 1 from the middle outward and -1 from the edges inward; both middle rows have `-delay`.
//!
//! **Global reset**: all exposures begin at once and end at the readout of their rows. Their lengths are
//! `t_e + (fraction - first fraction) t_r`, where the fraction of a row is the factor of `t_r` above, and mid-exposures
//! are half as far apart: `dt = -delay + fraction t_r/2`.

use crate::scenario::{CameraSpec, FieldOr, FlowInstant, Parity, Readout, Reset, ShutterSpec};

/// Invalid values in `[camera.shutter]`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShutterError {
    /// Negative, NaN or infinite time.
    #[error("camera.shutter.{key} is {value}: it must be a finite number of milliseconds, 0 or more{hint}")]
    Time {
        /// Key in `[camera.shutter]`.
        key: &'static str,
        /// The value.
        value: f64,
        /// Possible intention behind a negative value.
        hint: &'static str,
    },
    /// Invalid frame rate.
    #[error("camera.fps is {0}: it must be a positive finite number of frames per second")]
    Fps(f64),
    /// An image without pixels.
    #[error("camera.size_px is [{0}, {1}]: both must be at least 1")]
    Size(u32, u32),
}

/// Axis of the rows of the readout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RowAxis {
    /// Rows of the readout are image rows: the time of a pixel depends on its y only.
    Rows,
    /// Rows of the readout are image columns: the time of a pixel depends on its x, and, for interlaced
    /// fields, on the parity of its y.
    Columns,
}

/// Checked timing of the pixels of a frame relative to its stamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    size_px: [u32; 2],
    delay_s: f64,
    readout_s: f64,
    direction: Readout,
    exposure_s: f64,
    interlace_s: f64,
    first_field: Parity,
    reset: Reset,
}

impl Shutter {
    /// The shutter of a camera with the longest exposure that a frame may have.
    ///
    /// # Errors
    /// A shutter that cannot be used.
    pub fn longest_of(camera: &CameraSpec) -> Result<Self, ShutterError> {
        let shutter = Self::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        let auto = camera.auto_exposure.as_ref().filter(|_| shutter.exposure_s() > 0.0);
        Ok(auto.map_or(shutter, |auto| shutter.with_exposure_s(1e-3 * auto.exposure_ms[1])))
    }

    /// Timing from `[camera.shutter]`. N is the height or the width of the image, by the readout direction.
    pub fn from_spec(spec: &ShutterSpec, fps: f64, size_px: [u32; 2]) -> Result<Self, ShutterError> {
        if !(fps.is_normal() && fps > 0.0) {
            return Err(ShutterError::Fps(fps));
        }
        if size_px.contains(&0) {
            return Err(ShutterError::Size(size_px[0], size_px[1]));
        }
        let interlace_ms = match spec.interlace_ms {
            FieldOr::Field => 500.0 / fps,
            FieldOr::Ms(ms) => ms,
        };
        Ok(Self {
            size_px,
            delay_s: seconds("delay_ms", spec.delay_ms, "; it is the age of the image at its stamp")?,
            readout_s: seconds(
                if spec.line_time_us.is_some() { "line_time_us" } else { "readout_ms" },
                spec.readout_ms_of(size_px),
                "; for a reverse readout set camera.shutter.readout",
            )?,
            direction: spec.readout,
            exposure_s: seconds("exposure_ms", spec.exposure_ms, "")?,
            interlace_s: seconds(
                "interlace_ms",
                interlace_ms,
                "; to exchange the fields set camera.shutter.first_field",
            )?,
            first_field: spec.first_field,
            reset: spec.reset,
        })
    }

    /// Whether the rows of the readout are image rows or columns.
    #[inline]
    pub fn row_axis(&self) -> RowAxis {
        match self.direction {
            Readout::TopToBottom | Readout::BottomToTop | Readout::MiddleOutward | Readout::EdgesInward => {
                RowAxis::Rows
            }
            Readout::LeftToRight | Readout::RightToLeft => RowAxis::Columns,
        }
    }

    /// N: the number of rows of the readout.
    pub fn lines(&self) -> u32 {
        match self.row_axis() {
            RowAxis::Rows => self.size_px[1],
            RowAxis::Columns => self.size_px[0],
        }
    }

    /// Mid-exposure of a row of the readout relative to the stamp, seconds. Image rows include the lag of
    /// their field; columns have the time of the later field (see [`Shutter::dt_pixel_s`]).
    pub fn dt_row_s(&self, line: u32) -> f64 {
        let dt_s = self.dt_readout_s(line);
        match self.row_axis() {
            RowAxis::Rows => dt_s - self.field_lag_s(line),
            RowAxis::Columns => dt_s,
        }
    }

    /// Mid-exposure of a pixel relative to the stamp, seconds.
    pub fn dt_pixel_s(&self, x: u32, y: u32) -> f64 {
        let line = match self.row_axis() {
            RowAxis::Rows => y,
            RowAxis::Columns => x,
        };
        self.dt_readout_s(line) - self.field_lag_s(y)
    }

    /// Instant of a frame, relative to the stamp, seconds: that of the image's centre, which is `-delay` in any
    /// readout (the earlier one of two fields has a lag), or the mid-exposure of the row or column of either field
    /// that is exposed first or last.
    pub fn dt_instant_s(&self, instant: FlowInstant) -> f64 {
        let mids = self.outer_exposures().map(|(mid_s, _)| mid_s);
        match instant {
            FlowInstant::FirstRow => mids.fold(f64::INFINITY, f64::min),
            FlowInstant::Centre => -self.delay_s,
            FlowInstant::LastRow => mids.fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Lag of an image row by interlacing: that of the fields for rows of the first field, else 0.
    pub(crate) fn field_lag_s(&self, row: u32) -> f64 {
        let parity = if row.is_multiple_of(2) { Parity::Even } else { Parity::Odd };
        if parity == self.first_field { self.interlace_s } else { 0.0 }
    }

    /// Earliest begin and latest end of the exposure of any pixel, relative to the stamp.
    pub fn window_s(&self) -> (f64, f64) {
        self.outer_exposures()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(begin_s, end_s), (mid_s, half_s)| {
                (begin_s.min(mid_s - half_s), end_s.max(mid_s + half_s))
            })
    }

    /// Mid-exposure, relative to the stamp, and half of the exposure of pixels among which are those that are
    /// exposed first and last, seconds.
    fn outer_exposures(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let last = self.lines() - 1;
        // An image of one row has only one field; others have both. Among image rows, the earliest and latest
        // of each field are among the outer two.
        let second_row = 1.min(self.size_px[1] - 1);
        let shutter = *self;
        let lines = self.outer_lines().chain([1.min(last), last.saturating_sub(1)]);
        lines.flat_map(move |line| {
            let ys = match shutter.row_axis() {
                RowAxis::Rows => [line, line],
                RowAxis::Columns => [0, second_row],
            };
            let half_s = 0.5 * shutter.exposure_row_s(line);
            ys.map(|y| (shutter.dt_readout_s(line) - shutter.field_lag_s(y), half_s))
        })
    }

    /// Rows of the readout among which are the first and the last that are read, but for interlacing.
    fn outer_lines(&self) -> impl Iterator<Item = u32> + use<> {
        let last = self.lines() - 1;
        let middle = self.is_split().then_some([last / 2, last.div_ceil(2)]);
        [0, last].into_iter().chain(middle.into_iter().flatten())
    }

    /// Exposure time of a row of the readout, seconds.
    pub fn exposure_row_s(&self, line: u32) -> f64 {
        match self.reset {
            Reset::Rolling => self.exposure_s,
            Reset::Global => self.exposure_s + (self.fraction(line) - self.first_fraction()) * self.readout_s,
        }
    }

    /// Exposure time of a pixel, seconds.
    #[inline]
    pub fn exposure_pixel_s(&self, x: u32, y: u32) -> f64 {
        match (self.reset, self.row_axis()) {
            (Reset::Rolling, _) => self.exposure_s,
            (Reset::Global, RowAxis::Rows) => self.exposure_row_s(y),
            (Reset::Global, RowAxis::Columns) => self.exposure_row_s(x),
        }
    }

    /// Longest exposure time of any row, seconds.
    pub fn longest_exposure_s(&self) -> f64 {
        self.outer_lines().map(|line| self.exposure_row_s(line)).fold(self.exposure_s, f64::max)
    }

    /// Exposure time of the image's centre, seconds.
    pub fn centre_exposure_s(&self) -> f64 {
        match self.reset {
            Reset::Rolling => self.exposure_s,
            Reset::Global => self.exposure_s - self.first_fraction() * self.readout_s,
        }
    }

    /// Light that a pixel collects, as a multiple of that of `exposure_ms`; 1 but for a global reset.
    pub fn light_gain(&self, x: u32, y: u32) -> f64 {
        match self.reset {
            Reset::Global if self.exposure_s > 0.0 => self.exposure_pixel_s(x, y) / self.exposure_s,
            _ => 1.0,
        }
    }

    /// When the exposures of the rows begin.
    pub fn reset(&self) -> Reset {
        self.reset
    }

    /// Whether both halves of the rows are read at once.
    pub fn is_split(&self) -> bool {
        matches!(self.direction, Readout::MiddleOutward | Readout::EdgesInward)
    }

    /// Rows or columns of the readout between which the image's centre is, or, of an interlaced image, rows of the
    /// later field, with the fraction of the distance from the first to the second.
    pub fn centre_lines(&self) -> (u32, u32, f64) {
        let last = self.lines() - 1;
        let has_fields = self.row_axis() == RowAxis::Rows && self.interlace_s > 0.0 && last > 0;
        let (start, step) = match (has_fields, self.first_field) {
            (true, Parity::Even) => (1, 2),
            (true, Parity::Odd) => (0, 2),
            (false, _) => (0, 1),
        };
        let along = ((0.5 * f64::from(last) - f64::from(start)) / f64::from(step)).max(0.0);
        let first = start + step * along as u32;
        let second = if first + step > last { first } else { first + step };
        (first, second, along.fract())
    }

    /// Age of the image centre at its stamp (-t_d), seconds.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Readout time t_r, seconds.
    pub fn readout_s(&self) -> f64 {
        self.readout_s
    }

    /// Exposure time t_e, seconds, centred on the mid-exposure of a row. With a global reset it is that of the
    /// row that is read first, the shortest.
    pub fn exposure_s(&self) -> f64 {
        self.exposure_s
    }

    /// The same shutter with another exposure time, seconds.
    #[must_use]
    pub fn with_exposure_s(self, exposure_s: f64) -> Self {
        Self { exposure_s, ..self }
    }

    /// Lag between the fields t_i, seconds.
    pub fn interlace_s(&self) -> f64 {
        self.interlace_s
    }

    /// Parity (0-based) of the rows of the earlier field.
    pub fn first_field(&self) -> Parity {
        self.first_field
    }

    /// Direction of the readout.
    pub fn direction(&self) -> Readout {
        self.direction
    }

    fn dt_readout_s(&self, line: u32) -> f64 {
        let readout_s = match self.reset {
            Reset::Rolling => self.readout_s,
            Reset::Global => 0.5 * self.readout_s,
        };
        self.fraction(line) * readout_s - self.delay_s
    }

    /// Fraction of the readout time at which a row is read after the image's centre.
    fn fraction(&self, line: u32) -> f64 {
        let lines = self.lines();
        let position = || (f64::from(line) + 0.5) / f64::from(lines) - 0.5;
        // Rows as far above the middle as others below it have the same time to the last bit.
        let from_middle = || f64::from((2 * line + 1).abs_diff(lines).saturating_sub(1)) / f64::from(lines);
        match self.direction {
            Readout::TopToBottom | Readout::LeftToRight => position(),
            Readout::BottomToTop | Readout::RightToLeft => -position(),
            Readout::MiddleOutward => from_middle(),
            Readout::EdgesInward => -from_middle(),
        }
    }

    /// Fraction of the row that is read first.
    fn first_fraction(&self) -> f64 {
        self.outer_lines().map(|line| self.fraction(line)).fold(f64::INFINITY, f64::min)
    }
}

fn seconds(key: &'static str, ms: f64, hint: &'static str) -> Result<f64, ShutterError> {
    if ms.is_finite() && ms >= 0.0 { Ok(1e-3 * ms) } else { Err(ShutterError::Time { key, value: ms, hint }) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const READOUTS: [Readout; 6] = [
        Readout::TopToBottom,
        Readout::BottomToTop,
        Readout::LeftToRight,
        Readout::RightToLeft,
        Readout::MiddleOutward,
        Readout::EdgesInward,
    ];

    fn spec() -> ShutterSpec {
        ShutterSpec { delay_ms: 5.0, readout_ms: 33.0, exposure_ms: 8.0, ..ShutterSpec::default() }
    }

    /// The window computed from every pixel.
    fn window_by_pixels(shutter: &Shutter, [width, height]: [u32; 2]) -> (f64, f64) {
        let mut window = (f64::INFINITY, f64::NEG_INFINITY);
        for y in 0..height {
            for x in 0..width {
                let dt_s = shutter.dt_pixel_s(x, y);
                window = (
                    window.0.min(dt_s - 0.5 * shutter.exposure_s()),
                    window.1.max(dt_s + 0.5 * shutter.exposure_s()),
                );
            }
        }
        window
    }

    #[test]
    fn the_image_centre_has_exactly_the_delay() {
        // 5 rows: row 2 is the centre.
        let shutter = Shutter::from_spec(&spec(), 30.0, [7, 5]).unwrap();
        assert_eq!(shutter.dt_row_s(2), -0.005);
        assert_eq!(shutter.dt_row_s(0), -0.005 + 0.033 * (0.1 - 0.5));
        assert_eq!(shutter.dt_row_s(4), -0.005 + 0.033 * (0.9 - 0.5));
        // Both halves of an even image are symmetric about the centre.
        let even = Shutter::from_spec(&spec(), 30.0, [640, 480]).unwrap();
        assert!((0.5 * (even.dt_row_s(0) + even.dt_row_s(479)) + 0.005).abs() < 1e-15);
        assert!((even.dt_row_s(479) - even.dt_row_s(0) - 0.033 * 479.0 / 480.0).abs() < 1e-15);
    }

    #[test]
    fn reverse_readout_mirrors_row_times() {
        let with = |readout| Shutter::from_spec(&ShutterSpec { readout, ..spec() }, 30.0, [6, 4]).unwrap();
        let (down, up) = (with(Readout::TopToBottom), with(Readout::BottomToTop));
        let (right, left) = (with(Readout::LeftToRight), with(Readout::RightToLeft));
        for i in 0..4 {
            assert!((down.dt_row_s(i) - up.dt_row_s(3 - i)).abs() < 1e-15);
        }
        for i in 0..6 {
            assert!((right.dt_row_s(i) - left.dt_row_s(5 - i)).abs() < 1e-15);
            assert_eq!(right.dt_pixel_s(i, 3), right.dt_row_s(i));
        }
        assert!(right.dt_row_s(0) < right.dt_row_s(5));
        assert_eq!((down.lines(), right.lines()), (4, 6));
        assert_eq!((down.row_axis(), left.row_axis()), (RowAxis::Rows, RowAxis::Columns));
    }

    #[test]
    fn even_rows_are_earlier_by_the_interlacing_lag() {
        let interlaced = ShutterSpec { interlace_ms: FieldOr::Field, ..spec() };
        let plain = Shutter::from_spec(&spec(), 25.0, [4, 6]).unwrap();
        let shutter = Shutter::from_spec(&interlaced, 25.0, [4, 6]).unwrap();
        assert_eq!(shutter.interlace_s(), 0.02);
        for row in 0..6 {
            let lag_s = plain.dt_row_s(row) - shutter.dt_row_s(row);
            assert!((lag_s - if row % 2 == 0 { 0.02 } else { 0.0 }).abs() < 1e-15);
        }
        let odd =
            Shutter::from_spec(&ShutterSpec { first_field: Parity::Odd, ..interlaced.clone() }, 25.0, [4, 6])
                .unwrap();
        assert_eq!(odd.dt_row_s(0), plain.dt_row_s(0));
        assert!((odd.dt_row_s(1) - plain.dt_row_s(1) + 0.02).abs() < 1e-15);
        // Sideways readout: fields are still image rows.
        let sideways =
            Shutter::from_spec(&ShutterSpec { readout: Readout::LeftToRight, ..interlaced }, 25.0, [4, 6])
                .unwrap();
        assert!((sideways.dt_pixel_s(1, 1) - sideways.dt_pixel_s(1, 2) - 0.02).abs() < 1e-15);
        assert_eq!(sideways.dt_pixel_s(1, 1), sideways.dt_row_s(1));
    }

    #[test]
    fn instants_are_those_of_the_first_and_last_exposed_pixel_and_of_the_image_centre() {
        for readout in READOUTS {
            let is_split = matches!(readout, Readout::MiddleOutward | Readout::EdgesInward);
            for interlace_ms in [0.0, 2.0, 20.0] {
                if is_split && interlace_ms > 0.0 {
                    continue;
                }
                let spec = ShutterSpec { readout, interlace_ms: FieldOr::Ms(interlace_ms), ..spec() };
                let shutter = Shutter::from_spec(&spec, 30.0, [6, 4]).unwrap();
                let [first_s, centre_s, last_s] =
                    [FlowInstant::FirstRow, FlowInstant::Centre, FlowInstant::LastRow]
                        .map(|instant| shutter.dt_instant_s(instant));
                let pixels = (0..4).flat_map(|y| (0..6).map(move |x| [x, y]));
                let times: Vec<f64> = pixels.map(|[x, y]| shutter.dt_pixel_s(x, y)).collect();
                assert_eq!(first_s, times.iter().copied().fold(1.0, f64::min), "{readout:?} {interlace_ms}");
                assert_eq!(last_s, times.iter().copied().fold(-1.0, f64::max), "{readout:?} {interlace_ms}");
                assert_eq!(centre_s, -0.005);
            }
        }
    }

    #[test]
    fn window_covers_all_pixels() {
        for readout in
            [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft]
        {
            for first_field in [Parity::Even, Parity::Odd] {
                for interlace_ms in [0.0, 1.0, 20.0, 100.0] {
                    for size in [[1, 1], [1, 2], [2, 1], [5, 3], [4, 6]] {
                        let spec = ShutterSpec {
                            readout,
                            first_field,
                            interlace_ms: FieldOr::Ms(interlace_ms),
                            ..spec()
                        };
                        let shutter = Shutter::from_spec(&spec, 30.0, size).unwrap();
                        assert_eq!(shutter.window_s(), window_by_pixels(&shutter, size), "{spec:?} {size:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_centre_is_between_rows_that_have_the_delay_on_average() {
        for readout in READOUTS {
            for (interlace_ms, first_field) in [(0.0, Parity::Even), (7.0, Parity::Even), (7.0, Parity::Odd)]
            {
                for size_px in [[6, 8], [5, 9], [7, 6]] {
                    let interlace_ms = FieldOr::Ms(interlace_ms);
                    let spec = ShutterSpec { readout, interlace_ms, first_field, ..spec() };
                    let shutter = Shutter::from_spec(&spec, 30.0, size_px).unwrap();
                    let (first, second, fraction) = shutter.centre_lines();
                    let centre_s =
                        shutter.dt_row_s(first) * (1.0 - fraction) + shutter.dt_row_s(second) * fraction;
                    let is_halved = matches!(readout, Readout::MiddleOutward | Readout::EdgesInward);
                    let is_refused = is_halved && (size_px[1] % 2 == 1 || shutter.interlace_s() > 0.0);
                    assert!(
                        is_refused || (centre_s + 0.005).abs() < 1e-15,
                        "{spec:?} {size_px:?}: {centre_s}"
                    );
                }
            }
        }
    }

    #[test]
    fn halves_are_read_at_once() {
        let with = |readout| Shutter::from_spec(&ShutterSpec { readout, ..spec() }, 30.0, [6, 8]).unwrap();
        let (outward, inward) = (with(Readout::MiddleOutward), with(Readout::EdgesInward));
        // Four pairs of rows, as a sensor of four rows would be read, from or to the middle.
        for pair in 0..4 {
            let apart_s = 0.033 * f64::from(pair) / 4.0;
            for row in [3 - pair, 4 + pair] {
                assert!((outward.dt_row_s(row) - (-0.005 + apart_s)).abs() < 1e-15);
                assert!((inward.dt_row_s(row) - (-0.005 - apart_s)).abs() < 1e-15);
            }
            assert_eq!(outward.dt_row_s(pair).to_bits(), outward.dt_row_s(7 - pair).to_bits());
        }
        for shutter in [outward, inward] {
            assert_eq!(shutter.window_s(), window_by_pixels(&shutter, [6, 8]));
            assert_eq!(shutter.row_axis(), RowAxis::Rows);
        }
    }

    #[test]
    fn a_global_reset_begins_all_exposures_at_once() {
        for readout in READOUTS {
            let spec = ShutterSpec { readout, reset: Reset::Global, ..spec() };
            let shutter = Shutter::from_spec(&spec, 30.0, [6, 8]).unwrap();
            let rolling = ShutterSpec { reset: Reset::Rolling, ..spec };
            let rolling = Shutter::from_spec(&rolling, 30.0, [6, 8]).unwrap();
            let begins = |line: u32| shutter.dt_row_s(line) - 0.5 * shutter.exposure_row_s(line);
            let ends = |line: u32| shutter.dt_row_s(line) + 0.5 * shutter.exposure_row_s(line);
            let lines = 0..shutter.lines();
            for line in lines.clone() {
                assert!((begins(line) - begins(0)).abs() < 1e-15, "{readout:?} {line}");
                // Rows are read as far apart as those of a rolling reset.
                let apart_s = rolling.dt_row_s(line) - rolling.dt_row_s(0);
                assert!((ends(line) - ends(0) - apart_s).abs() < 1e-15, "{readout:?} {line}");
                let [x, y] = if shutter.row_axis() == RowAxis::Rows { [0, line] } else { [line, 0] };
                assert_eq!(shutter.exposure_pixel_s(x, y), shutter.exposure_row_s(line));
                assert!((shutter.light_gain(x, y) - shutter.exposure_row_s(line) / 0.008).abs() < 1e-12);
            }
            let shortest = lines.clone().map(|line| shutter.exposure_row_s(line)).fold(1.0, f64::min);
            let longest = lines.map(|line| shutter.exposure_row_s(line)).fold(0.0, f64::max);
            assert!((shortest - 0.008).abs() < 1e-15 && longest == shutter.longest_exposure_s());
            let (begin_s, end_s) = shutter.window_s();
            assert!((begin_s - begins(0)).abs() < 1e-15 && (end_s - begin_s - longest).abs() < 1e-15);
            assert_eq!(shutter.dt_instant_s(FlowInstant::Centre), -0.005);
        }
    }

    #[test]
    fn a_line_time_states_the_readout() {
        let lines = |readout| {
            let spec = ShutterSpec { readout, readout_ms: 0.0, line_time_us: Some(7.3), ..spec() };
            Shutter::from_spec(&spec, 30.0, [600, 400]).unwrap()
        };
        for (readout, step) in
            [(Readout::TopToBottom, 7.3e-6), (Readout::RightToLeft, -7.3e-6), (Readout::EdgesInward, 7.3e-6)]
        {
            let shutter = lines(readout);
            let found = shutter.dt_row_s(31) - shutter.dt_row_s(30);
            assert!((found - step).abs() < 1e-15, "{readout:?}: {found}");
        }
    }

    #[test]
    fn without_exposure_and_readout_the_window_is_an_instant() {
        let shutter = Shutter::from_spec(&ShutterSpec::default(), 30.0, [640, 480]).unwrap();
        assert_eq!(shutter.window_s(), (0.0, 0.0));
    }

    #[test]
    fn invalid_times_are_refused() {
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            let error = |spec: ShutterSpec| Shutter::from_spec(&spec, 30.0, [4, 4]).unwrap_err().to_string();
            assert!(error(ShutterSpec { delay_ms: bad, ..spec() }).contains("delay_ms"));
            assert!(error(ShutterSpec { readout_ms: bad, ..spec() }).contains("readout_ms"));
            assert!(error(ShutterSpec { exposure_ms: bad, ..spec() }).contains("exposure_ms"));
            assert!(error(ShutterSpec { interlace_ms: FieldOr::Ms(bad), ..spec() }).contains("interlace_ms"));
            assert!(Shutter::from_spec(&spec(), bad, [4, 4]).is_err());
        }
        assert!(Shutter::from_spec(&spec(), 0.0, [4, 4]).is_err());
        assert!(Shutter::from_spec(&spec(), 30.0, [0, 4]).is_err());
    }
}
