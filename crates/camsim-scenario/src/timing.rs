//! `[camera.timing]`: faults of the trigger, of the stamps and of the delivery of frames.

use serde::{Deserialize, Serialize};

use super::keys::{Table, Words};

/// Fastest and slowest clock, millionths off.
const MOST_DRIFT_PPM: f64 = 1e5;

/// Faults of trigger, stamps and delivery, drawn by seed, camera and frame (docs/reference/TIMING.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TimingSpec {
    /// Standard deviation of a random error of every stamp.
    #[key(unit = "ms", step = 0.01, min = 0.0, hint = "it is a standard deviation")]
    pub jitter_ms: f64,
    /// How much faster the camera's clock runs than the platform's, from the start of the window on. Its
    /// offset is `camera.clock_offset_ms`.
    #[key(unit = "ppm", above = -MOST_DRIFT_PPM, below = MOST_DRIFT_PPM, hint = "20 is usual")]
    pub drift_ppm: f64,
    /// Largest delay of a trigger. Delays are random, evenly distributed from 0 to this.
    #[key(unit = "ms", step = 0.1, min = 0.0, hint = "0 is punctual")]
    pub late_ms: f64,
    /// What stamps of late triggers show.
    pub late_stamp: LateStamp,
    /// Numbers of frames that do not arrive.
    #[key(example = "[12, 13]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drop: Vec<u64>,
    /// Fraction of the other frames that do not arrive.
    #[key(step = 0.005, min = 0.0, below = 1.0, hint = "it is a fraction of the frames")]
    pub drop_probability: f64,
    /// Numbers of frames that show the picture of the frame that arrived before them once more.
    #[key(example = "[20]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub double: Vec<u64>,
    /// Fraction of the other frames that show the picture before them once more.
    #[key(step = 0.005, min = 0.0, below = 1.0, hint = "it is a fraction of the frames")]
    pub double_probability: f64,
    /// Name of the trigger that the camera shares with others. Cameras of a rig with the same one are late
    /// together, and miss triggers together. Omitted: a trigger of its own.
    #[key(example = "\"wire\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<String>,
    /// Numbers of frames whose trigger does not come.
    #[key(example = "[30]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub miss: Vec<u64>,
    /// Fraction of the other triggers that do not come.
    #[key(step = 0.005, min = 0.0, below = 1.0, hint = "it is a fraction of the triggers")]
    #[serde(skip_serializing_if = "crate::is_default")]
    pub miss_probability: f64,
    /// Whose errors stamps have: the camera's or the trigger's.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub stamped_by: StampedBy,
}

/// Who writes the stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum StampedBy {
    /// The camera: errors of its own.
    #[default]
    Camera,
    /// The device that triggers the cameras: the same errors for all of them.
    Trigger,
}

/// What the stamp of a late trigger shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum LateStamp {
    /// When the trigger was meant to come.
    #[default]
    Nominal,
    /// When it came.
    Actual,
}
