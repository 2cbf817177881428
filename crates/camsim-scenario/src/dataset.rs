//! Datasets of other programs that a run can be exported as (`output.datasets`).

use serde::{Deserialize, Serialize};

use super::keys::Words;

/// A layout of files that other programs read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum DatasetFormat {
    /// EuRoC/ASL: `mav0`, with settings for ORB-SLAM3, OpenVINS and VINS-Fusion.
    Euroc,
    /// TUM RGB-D.
    Tum,
    /// KITTI: odometry, depth and flow.
    Kitti,
    /// COLMAP models, as text and binary.
    Colmap,
    /// nerfstudio `transforms.json`.
    Nerfstudio,
    /// Kalibr's bag creator, with `camchain.yaml`.
    Kalibr,
    /// MCAP with messages of ROS 2.
    Mcap,
    /// Carla-RS and Fastec-RS: rolling and global pictures.
    CarlaRs,
    /// GoPro and REDS: blurred and sharp pictures.
    Gopro,
    /// Tar shards with an index.
    Webdataset,
    /// Middlebury `.flo`.
    Flo,
}
