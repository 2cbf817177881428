//! `[camera.timing]`: faults of the trigger, of the stamps and of the delivery of frames.

use serde::{Deserialize, Serialize};

/// What goes wrong between the clock of the flight and the frames that arrive. All draws are functions of
/// the seed, the camera's name and the frame's number ([`crate::timing_faults`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimingSpec {
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
    /// How much faster than the platform's clock the camera's runs, from the start of the window on, millionths.
    pub drift_ppm: f64,
    /// Triggers come late by a random time, evenly distributed from 0 to this.
    pub late_ms: f64,
    /// Whether stamps show the trigger as it was meant or as it came.
    pub late_stamp: LateStamp,
    /// Numbers of frames that do not arrive.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drop: Vec<u64>,
    /// Share of the other frames that do not arrive.
    pub drop_probability: f64,
    /// Numbers of frames that show the picture of the frame that arrived before them once more.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub double: Vec<u64>,
    /// Share of the other frames that do.
    pub double_probability: f64,
    /// Name of the trigger that the camera shares with others: late and missed triggers are those of the name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<String>,
    /// Numbers of frames whose trigger does not come.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub miss: Vec<u64>,
    /// Share of the other triggers that do not come.
    #[serde(skip_serializing_if = "is_zero")]
    pub miss_probability: f64,
    /// Whether stamps have errors of the camera's own or those of the shared trigger.
    #[serde(skip_serializing_if = "is_default")]
    pub stamped_by: StampedBy,
}

fn is_zero(probability: &f64) -> bool {
    *probability == 0.0
}

fn is_default(stamped_by: &StampedBy) -> bool {
    *stamped_by == StampedBy::Camera
}

/// Who writes the stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StampedBy {
    /// The camera.
    #[default]
    Camera,
    /// The device that triggers the cameras.
    Trigger,
}

/// What the stamp of a late trigger shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LateStamp {
    /// When the trigger was meant to come.
    #[default]
    Nominal,
    /// When it came.
    Actual,
}
