//! The schema of FRAME.toml: every key and the values it takes.

use std::sync::LazyLock;

use camsim_core::scenario::keys::ValueKind::*;

use crate::scenario_file::schema::Schema;

/// Schema of FRAME.toml.
pub(super) static FRAME: LazyLock<Schema> =
    LazyLock::new(|| Schema::new(KEYS, REQUIRED, "`camsim apply --help` lists all keys"));

const KEYS: &[(&str, camsim_core::scenario::keys::ValueKind)] = &[
    ("frames", Path),
    ("name_unit", Word(&["s", "ms", "us", "ns"])),
    ("fps", Number),
    ("max_gap_ms", Number),
    ("color", Path),
    ("color_channels", Texts),
    ("color_layer", Text),
    ("color_space", Word(&["srgb", "linear"])),
    ("depth", Path),
    ("depth_channel", Text),
    ("depth_layer", Text),
    ("depth_encoding", Word(&["plain", "packed24", "carla"])),
    ("depth_per_metre", Number),
    ("depth_rows", Word(&["top-down", "bottom-up"])),
    ("depth_max_m", Number),
    ("depth_kind", Word(&["planar", "range", "inverse"])),
    ("holes", Word(&["far", "nearest", "mark"])),
    ("focal_px", Numbers(2)),
    ("principal_point_px", Numbers(2)),
    ("instant_ms", Number),
    ("motion.velocity_m_s", Numbers(3)),
    ("motion.angular_rate_rad_s", Numbers(3)),
    ("motion.trajectory", Path),
    ("motion.trajectory_format", Word(&["csv", "tum"])),
    ("motion.stamp_s", Number),
    ("motion.flow", Path),
    ("motion.flow_channels", Texts),
    ("motion.flow_scale", Numbers(2)),
    ("motion.flow_interval_ms", Number),
    ("fog.end_m", Number),
    ("fog.color", Numbers(3)),
];

const REQUIRED: &[(&str, &str)] = &[("focal_px", ""), ("fog.end_m", "fog"), ("fog.color", "fog")];
