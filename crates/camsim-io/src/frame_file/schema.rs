//! Every key of a FRAME.toml, with what it takes.

use crate::scenario_file::schema::{Kind::*, Schema};

pub(super) const FRAME: Schema = Schema {
    keys: &[
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
        ("depth_encoding", Word(&["plain", "packed24"])),
        ("depth_per_metre", Number),
        ("depth_kind", Word(&["planar", "range"])),
        ("holes", Word(&["far", "nearest", "mark"])),
        ("focal_px", Numbers(2)),
        ("principal_point_px", Numbers(2)),
        ("instant_ms", Number),
        ("motion.velocity_m_s", Numbers(3)),
        ("motion.angular_rate_rad_s", Numbers(3)),
        ("motion.trajectory", Path),
        ("motion.trajectory_format", Word(&["csv", "tum"])),
        ("motion.stamp_s", Number),
        ("fog.end_m", Number),
        ("fog.color", Numbers(3)),
    ],
    later_words: &[],
    required: &[("focal_px", ""), ("fog.end_m", "fog"), ("fog.color", "fog")],
    listing: "`camsim apply --help` lists all keys",
};
