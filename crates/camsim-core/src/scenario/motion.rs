//! `[scene.gltf.motion]`: how a model moves.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// How a model moves: as a whole, by `poses` or along a `path`, and its parts, by `spin` and `animate`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Table of poses of the model's origin, in place of `path`: time (`t_s`, `t_ms`, `t_us`, `t_ns`) on the
    /// log's clock; `n_m,e_m,d_m` or `lat_deg,lon_deg,height_m`; and optionally `heading_deg`, or
    /// `roll_deg,pitch_deg,yaw_deg`, or `qw,qx,qy,qz`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<PathBuf>,
    /// Points that the model's origin passes in straight lines: north, east, down, metres.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<[f64; 3]>,
    /// Speed along the path, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// Path time at which the model leaves the first point of `path`, seconds; 0 by default. It stands there
    /// before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_s: Option<f64>,
    /// What happens at the end of `path`; once by default.
    #[serde(default, rename = "loop", skip_serializing_if = "Option::is_none")]
    pub repeat: Option<LoopKind>,
    /// Whether the model's front looks where it goes; true by default, unless `poses` has attitudes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orient: Option<bool>,
    /// Parts that spin.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spin: Vec<SpinSpec>,
    /// Whether the model's own animations play, again and again.
    #[serde(default)]
    pub animate: bool,
}

/// A part that spins about an axis through its origin: a wheel, a rotor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpinSpec {
    /// Axis in the node's own axes (those of the model: x left, y up, z forward); any length.
    pub axis: [f64; 3],
    /// Turns a second, anticlockwise as seen by one whom the axis points at.
    pub hz: f64,
    /// Angle at path time 0.
    #[serde(default)]
    pub phase_deg: f64,
    /// Name of the node that spins with all its children; the whole model by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
}

/// What happens at the end of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoopKind {
    /// The model stays at the last point.
    #[default]
    Once,
    /// It begins again at the first point, at once.
    Repeat,
    /// It turns and goes back, and so on.
    BackAndForth,
}
