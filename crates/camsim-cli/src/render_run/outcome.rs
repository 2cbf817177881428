//! What a run has rendered.

use std::time::Duration;

/// Result of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// Cameras with a folder each; 0 of a scenario with one camera.
    pub cameras: u64,
    /// Frames rendered.
    pub frames: u64,
    /// Pictures of twins rendered.
    pub twins: u64,
    /// Frames that existed already.
    pub skipped: u64,
    /// Bytes of the files of frames, trajectories and sensors.
    pub bytes: u64,
    /// From the first submission until the last file was written, without the tables of twins.
    pub time: Duration,
    /// Time of planning the first frames, before that.
    pub first_plan: Duration,
}

impl Outcome {
    /// Adds another run.
    pub fn add(&mut self, other: &Self) {
        self.cameras = self.cameras.max(other.cameras);
        self.frames += other.frames;
        self.twins += other.twins;
        self.skipped += other.skipped;
        self.bytes += other.bytes;
        self.time += other.time;
        self.first_plan += other.first_plan;
    }

    /// Frames and pictures of twins per second; 0 if there was nothing to do.
    #[must_use]
    pub fn pictures_per_s(&self) -> f64 {
        let pictures = self.frames + self.twins;
        if pictures == 0 { 0.0 } else { pictures as f64 / self.time.as_secs_f64().max(1e-9) }
    }

    /// What was rendered, for users: `10 frames and 20 pictures of twins`.
    #[must_use]
    pub fn pictures(&self) -> String {
        let cameras = match self.cameras {
            0 => String::new(),
            1 => " of 1 camera".to_owned(),
            cameras => format!(" of {cameras} cameras"),
        };
        let kept = if self.skipped > 0 { format!(" ({} existed)", self.skipped) } else { String::new() };
        let twins =
            if self.twins > 0 { format!(" and {} pictures of twins", self.twins) } else { String::new() };
        format!("{} frames{cameras}{kept}{twins}", self.frames)
    }

    /// Pictures per second, for users.
    #[must_use]
    pub fn rate(&self) -> String {
        let unit = if self.twins > 0 { "pictures/s" } else { "frames/s" };
        format!("{:.1} {unit}", self.pictures_per_s())
    }
}
