//! `[camera.timing]`: faults of the trigger, of the stamps and of the delivery of frames.

use serde::{Deserialize, Serialize};

/// What goes wrong between the clock of the flight and the frames that arrive. All draws are functions of
/// the seed, the camera's name and the frame's number ([`crate::timing_faults`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimingSpec {
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
    /// How much faster than the platform's clock the camera's runs, from the begin of the window on, millionths.
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
