//! The plan of a frame and its parts: results, which compute nothing.

pub(crate) mod budget;
pub(crate) mod error_map;
pub(crate) mod frame_plan;
pub(crate) mod key_frame;
pub(crate) mod limits;
pub(crate) mod linear_fog;
pub(crate) mod margins;
pub(crate) mod motion;
pub(crate) mod placement;
pub(crate) mod plan_error;
pub(crate) mod predicted;
pub(crate) mod row_tables;
pub(crate) mod sampling_plan;
pub(crate) mod seen_plane;
pub(crate) mod skip;
pub(crate) mod stages;
