//! `[scene.gltf.motion]`: how a model moves.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::keys::{Table, Words};

/// How a model moves: as a whole, by `poses` or along a `path`, and its parts, by `spin` and `animate`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSpec {
    /// CSV table of poses of the model's origin by time, instead of `path`. Its columns are the time on the
    /// log's clock (`t_s`, `t_ms`, `t_us` or `t_ns`), `n_m,e_m,d_m` or `lat_deg,lon_deg,height_m`, and
    /// optionally `heading_deg`, or `roll_deg,pitch_deg,yaw_deg`, or `qw,qx,qy,qz`.
    #[key(example = "\"poses.csv\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<PathBuf>,
    /// Points that the model's origin passes in straight lines: north, east, down.
    #[key(unit = "m", example = "[[0, 0, 0], [90, 0, 0]]", names = "N E D")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<[f64; 3]>,
    /// Speed along the path.
    #[key(
        unit = "m/s",
        step = 0.1,
        above = 0.0,
        hint = "give the path the other way round",
        example = "10.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// Path time at which the model leaves the first point of `path`. It stands there before. Omitted: 0.
    #[key(unit = "s", step = 0.1, example = "0.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_s: Option<f64>,
    /// What happens at the end of `path`. Omitted: `once`.
    #[key(example = "\"once\"")]
    #[serde(rename = "loop", skip_serializing_if = "Option::is_none")]
    pub repeat: Option<LoopKind>,
    /// Whether the model's front looks where it goes. Omitted: it does, unless `poses` has attitudes.
    #[key(example = "true")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orient: Option<bool>,
    /// Parts that spin: wheels, rotors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spin: Vec<SpinSpec>,
    /// Whether the model's own animations play, again and again.
    pub animate: bool,
}

/// A part that spins about an axis through its origin: a wheel, a rotor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct SpinSpec {
    /// Axis in the node's own axes, of any length. Those of the model are x left, y up, z forward.
    #[key(required, step = 0.1, example = "[0.0, 0.0, 1.0]", names = "x y z")]
    pub axis: [f64; 3],
    /// Turns a second, anticlockwise as seen by one whom the axis points at.
    #[key(required, unit = "Hz", step = 0.1, example = "12.0")]
    pub hz: f64,
    /// Angle at path time 0.
    #[key(unit = "deg")]
    pub phase_deg: f64,
    /// Name of the node that spins with all its children. Omitted: the whole model.
    #[key(example = "\"rotor\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
}

/// What happens at the end of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
