//! ROS: `camera_info`, and MCAP with messages of ROS 2.

pub(crate) mod export;
pub(crate) mod ini;
pub(crate) mod read;
pub(crate) mod write;
