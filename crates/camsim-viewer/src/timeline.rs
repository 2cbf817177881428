//! The shown frame, play and loop.

/// Range of play speed, times real time.
pub const SPEEDS: [f64; 2] = [0.1, 10.0];

/// Position and play of the timeline. Frames are counted from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    /// Number of frames; 0 before anything is loaded.
    pub frames: u64,
    /// Frame rate of the camera, 1/s.
    pub fps: f64,
    /// The frame shown.
    pub frame: u64,
    /// Whether play is on.
    pub playing: bool,
    /// Play speed, times real time, within [`SPEEDS`].
    pub speed: f64,
    /// First and last frame of the loop; `None` plays all frames once.
    pub range: Option<[u64; 2]>,
    /// Whether the timeline is being dragged.
    pub dragged: bool,
    /// Fraction of a frame that play has advanced beyond `frame`.
    pub carry: f64,
}

impl Default for Timeline {
    fn default() -> Self {
        Self {
            frames: 0,
            fps: 30.0,
            frame: 0,
            playing: false,
            speed: 1.0,
            range: None,
            dragged: false,
            carry: 0.0,
        }
    }
}

impl Timeline {
    /// The last frame; 0 without frames.
    pub fn last(&self) -> u64 {
        self.frames.saturating_sub(1)
    }

    /// Sets the length and rate of another sequence, and clamps frame and loop to it.
    pub fn set_sequence(&mut self, frames: u64, fps: f64) {
        (self.frames, self.fps) = (frames, fps);
        self.frame = self.frame.min(self.last());
        let last = self.last();
        self.range =
            self.range.map(|range| range.map(|frame| frame.min(last))).filter(|[first, end]| first < end);
    }

    /// Goes from the frames of one camera to those of another that are nearest in time, given the frames per
    /// second and the phase of both. The length is estimated until [`Self::set_sequence`].
    pub fn keep_time(&mut self, [fps, phase]: [f64; 2], [new_fps, new_phase]: [f64; 2]) {
        let same_time = |frame: u64| {
            let frame = (frame as f64 + phase) / fps * new_fps - new_phase;
            frame.round().max(0.0) as u64
        };
        self.frame = same_time(self.frame);
        self.frames = same_time(self.frames).max(self.frame + 1);
        self.range = self.range.map(|range| range.map(same_time)).filter(|[first, end]| first < end);
        (self.fps, self.carry) = (new_fps, 0.0);
    }

    /// Goes to a frame, clamped to the last one.
    pub fn seek(&mut self, frame: u64) {
        self.frame = frame.min(self.last());
        self.carry = 0.0;
    }

    /// Steps forwards or backwards, and stops play.
    pub fn step(&mut self, frames: i64) {
        self.playing = false;
        self.seek(self.frame.saturating_add_signed(frames));
    }

    /// First and last frame that play visits.
    pub fn bounds(&self) -> [u64; 2] {
        self.range.unwrap_or([0, self.last()])
    }

    /// Advances play by `seconds` of real time, skipping frames as necessary. Without a loop, play stops at
    /// the end.
    pub fn advance(&mut self, seconds: f64) {
        if !self.playing || self.dragged {
            return;
        }
        // At most one second: a window that was hidden for long continues from its frame.
        self.carry += seconds.clamp(0.0, 1.0) * self.speed.clamp(SPEEDS[0], SPEEDS[1]) * self.fps;
        let whole = self.carry.floor();
        self.carry -= whole;
        let [first, last] = self.bounds();
        let next = self.frame.max(first).saturating_add(whole as u64);
        if next <= last {
            self.frame = next;
        } else if self.range.is_some() {
            self.frame = first + (next - first) % (last - first + 1);
        } else {
            (self.frame, self.playing) = (last, false);
        }
    }

    /// Starts or stops play; at the end it starts over.
    pub fn toggle(&mut self) {
        self.playing = !self.playing && self.frames > 1;
        if self.playing && self.frame >= self.bounds()[1] {
            self.seek(self.bounds()[0]);
        }
    }

    /// Stamp of a frame, seconds after frame 0's.
    pub fn seconds(&self, frame: u64) -> f64 {
        frame as f64 / self.fps
    }

    /// The frame whose stamp is nearest to `seconds` after frame 0's.
    pub fn frame_at(&self, seconds: f64) -> u64 {
        ((seconds * self.fps).round().max(0.0) as u64).min(self.last())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_frames(frames: u64) -> Timeline {
        Timeline { frames, ..Timeline::default() }
    }

    #[test]
    fn play_advances_by_time_for_any_number_of_passes() {
        for steps in [1, 7, 60] {
            let mut timeline = Timeline { playing: true, speed: 0.5, ..with_frames(100) };
            for _ in 0..steps {
                timeline.advance(1.0 / f64::from(steps));
            }
            assert!(
                timeline.frame.abs_diff(15) <= 1,
                "half a second of 30 frames a second at 0.5x in {steps}: {}",
                timeline.frame
            );
        }
    }

    #[test]
    fn play_stops_at_the_end_or_loops() {
        let mut timeline = Timeline { playing: true, frame: 95, ..with_frames(100) };
        timeline.advance(1.0);
        assert_eq!((timeline.frame, timeline.playing), (99, false));
        timeline.toggle();
        assert_eq!((timeline.frame, timeline.playing), (0, true), "starts over");
        let mut timeline = Timeline { playing: true, frame: 18, range: Some([10, 19]), ..with_frames(100) };
        timeline.advance(0.1);
        assert_eq!((timeline.frame, timeline.playing), (11, true), "18, 19, 10, 11");
    }

    #[test]
    fn steps_stay_within_the_sequence_and_stop_play() {
        let mut timeline = Timeline { playing: true, ..with_frames(3) };
        timeline.step(-1);
        assert_eq!((timeline.frame, timeline.playing), (0, false));
        timeline.step(7);
        assert_eq!(timeline.frame, 2);
    }

    #[test]
    fn another_camera_shows_the_same_time() {
        let mut timeline = Timeline { fps: 20.0, frame: 60, range: Some([20, 80]), ..with_frames(100) };
        timeline.keep_time([20.0, 0.0], [10.0, 0.5]);
        // 3 s are 29.5 periods of 0.1 s after the first stamp.
        assert_eq!((timeline.frame, timeline.fps, timeline.range), (30, 10.0, Some([10, 40])));
        assert_eq!(timeline.frames, 50);
        timeline.set_sequence(25, 10.0);
        assert_eq!((timeline.frame, timeline.range), (24, Some([10, 24])));
    }

    #[test]
    fn an_empty_sequence_stays_at_frame_0() {
        let mut timeline = Timeline::default();
        timeline.toggle();
        timeline.step(1);
        timeline.advance(1.0);
        assert_eq!((timeline.frame, timeline.playing, timeline.frame_at(9.0)), (0, false, 0));
    }

    #[test]
    fn a_shorter_sequence_clamps_frame_and_loop() {
        let mut timeline = Timeline { frame: 50, range: Some([40, 80]), ..with_frames(100) };
        timeline.set_sequence(60, 30.0);
        assert_eq!((timeline.frame, timeline.range), (50, Some([40, 59])));
        timeline.set_sequence(20, 30.0);
        assert_eq!((timeline.frame, timeline.range), (19, None));
    }
}
