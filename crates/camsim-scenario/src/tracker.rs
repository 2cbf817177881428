//! `[tracker]`: how the platform follows the log.

use serde::{Deserialize, Serialize};

use super::{
    Auto, Preset, Scenario,
    keys::{Table, Words},
};

/// Method and limits of the platform's motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSpec {
    /// Method by which the platform follows the log.
    pub kind: TrackerKind,
    /// Control rate of `sqrt`, or knot rate of `spline`.
    #[key(default = 400.0, unit = "Hz", min = 1.0, max = 100_000.0, hint = "400 is the default")]
    pub rate_hz: f64,
    /// Limit of the speed (the paper's v_max). `auto`: 1.2 times the 99.9th percentile of the log's own.
    #[key(unit = "m/s", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_speed_m_s: Auto<f64>,
    /// Limit of the acceleration (the paper's a_max). `auto`: 1.5 times the 99.9th percentile of the smoothed
    /// log's own, and at least 19.6 (2 g, the paper's). With `quality.preset = "paper"`, `auto` is 19.6.
    #[key(unit = "m/s2", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_acceleration_m_s2: Auto<f64>,
    /// Limit of the angular rate about the body's axes. `auto`: as of `max_speed_m_s`.
    #[key(unit = "deg/s", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_angular_rate_deg_s: Auto<f64>,
    /// Limit of the angular acceleration. `auto`: as of `max_acceleration_m_s2`, with 60 (the paper's) instead
    /// of 19.6.
    #[key(unit = "deg/s2", step = 0.5, above = 0.0, hint = "or write \"auto\"")]
    pub max_angular_acceleration_deg_s2: Auto<f64>,
}

/// Acceleration limit of the paper's experiments: 2 g.
pub const PAPER_ACCELERATION_M_S2: f64 = 19.6;
/// Angular acceleration limit of the paper's experiments.
pub const PAPER_ANGULAR_ACCELERATION_DEG_S2: f64 = 60.0;

impl Scenario {
    /// `[tracker]` with the preset applied: with the paper's preset, `auto` accelerations are the paper's.
    #[must_use]
    pub fn effective_tracker(&self) -> TrackerSpec {
        let mut tracker = self.tracker.clone();
        if self.quality.preset == Preset::Paper {
            let or_paper = |limit: Auto<f64>, paper: f64| Auto::Value(limit.value().unwrap_or(paper));
            tracker.max_acceleration_m_s2 = or_paper(tracker.max_acceleration_m_s2, PAPER_ACCELERATION_M_S2);
            tracker.max_angular_acceleration_deg_s2 =
                or_paper(tracker.max_angular_acceleration_deg_s2, PAPER_ANGULAR_ACCELERATION_DEG_S2);
        }
        tracker
    }
}

/// Methods by which the platform follows the log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum TrackerKind {
    /// The pose of the latest row.
    Hold,
    /// Straight lines and constant rotation (slerp) between rows.
    Linear,
    /// The paper's pair of nested SQRT loops per channel (section 3).
    #[default]
    Sqrt,
    /// Cubic B-spline fitted to the whole log under the limits.
    Spline,
}
