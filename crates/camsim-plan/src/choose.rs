//! The choices that a plan is made of, each the cheapest that keeps the tolerances.

pub(crate) mod demanded;
pub(crate) mod edges;
pub(crate) mod exposure_samples;
pub(crate) mod frame_context;
pub(crate) mod key_frames;
pub(crate) mod obstacle;
pub mod paper;
pub(crate) mod picture;
pub mod placement;
pub(crate) mod plan_inputs;
pub(crate) mod prices;
pub(crate) mod recent_cache;
pub(crate) mod sampling;
pub(crate) mod shared_ideal;
pub(crate) mod sharing;
pub(crate) mod temporal_inverse;
pub(crate) mod temporal_task;
pub(crate) mod terrain_detail;
