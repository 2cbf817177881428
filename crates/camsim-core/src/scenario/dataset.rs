//! Datasets of other programs that a run can be exported as (`output.datasets`).

use serde::{Deserialize, Serialize};

/// A layout of files that other programs read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
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

impl DatasetFormat {
    /// All formats.
    pub const ALL: [Self; 11] = [
        Self::Euroc,
        Self::Tum,
        Self::Kitti,
        Self::Colmap,
        Self::Nerfstudio,
        Self::Kalibr,
        Self::Mcap,
        Self::CarlaRs,
        Self::Gopro,
        Self::Webdataset,
        Self::Flo,
    ];

    /// Name in a scenario, on the command line, and of its folder.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Euroc => "euroc",
            Self::Tum => "tum",
            Self::Kitti => "kitti",
            Self::Colmap => "colmap",
            Self::Nerfstudio => "nerfstudio",
            Self::Kalibr => "kalibr",
            Self::Mcap => "mcap",
            Self::CarlaRs => "carla-rs",
            Self::Gopro => "gopro",
            Self::Webdataset => "webdataset",
            Self::Flo => "flo",
        }
    }
}
