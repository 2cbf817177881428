//! Files of other programs, by program: calibrations in (`read`), calibrations out (`write`), and output folders of
//! `camsim render` in their layouts (`export`). Each has a row that says what it is: a `READER`, a `WRITER`, a `LAYOUT`;
//! the lists are here. What is exported reads back as the same camera.
//!
//! | module | has what they share |
//! |---|---|
//! | [`reading`] | detection, tables of keys, selection of a camera, poses, timing |
//! | [`writing`] | the camera as others describe it, and what a format cannot hold |
//! | [`exporting`] | folders, their pictures, depth, sensors, stamps and pages |

use camsim_core::scenario::DatasetFormat;

pub mod exporting;
pub mod reading;
pub mod writing;

pub(crate) mod axes;
mod named_lens;

mod agisoft;
mod basalt;
mod camodocal;
pub(crate) mod colmap;
mod euroc;
mod flow;
mod gyroflow;
mod kalibr;
mod kitti;
mod lensfun;
mod ncamera;
mod nerfstudio;
mod okvis;
mod opencv;
mod opensfm;
mod openvins;
mod orb_slam;
mod pairs;
pub(crate) mod ros;
mod sim_params;
mod stmap;
mod tum;
mod vikit;
mod webdataset;

use exporting::Layout;
use reading::format::Reader;
use writing::exported::Writer;

/// An enumeration of formats, each with the row in which its module says what it is.
macro_rules! formats {
    ($(#[$about:meta])* $name:ident, $row:ty: $($(#[$doc:meta])* $format:ident => $item:path,)+) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$doc])* $format,)+
        }

        impl $name {
            /// Every format.
            pub const ALL: [Self; [$(stringify!($format)),+].len()] = [$(Self::$format),+];

            fn row(self) -> &'static $row {
                match self {
                    $(Self::$format => &$item,)+
                }
            }

            /// Name on the command line.
            #[must_use]
            pub fn name(self) -> &'static str {
                self.row().name
            }
        }
    };
}

formats! {
    /// Formats of calibrations that can be read, in the order of detection.
    CameraFormat, Reader:
    /// XML of the paper's reference program.
    Reference => sim_params::READER,
    /// Agisoft Metashape, PhotoScan or Lens XML.
    Agisoft => agisoft::READER,
    /// Gyroflow lens profile JSON.
    Gyroflow => gyroflow::READER,
    /// Kalibr camchain YAML, also OpenVINS'.
    Kalibr => kalibr::read::READER,
    /// EuRoC `sensor.yaml`.
    Euroc => euroc::read::READER,
    /// ROS `camera_info` YAML, file or message.
    RosCameraInfo => ros::read::READER,
    /// ROS `.ini` of `camera_calibration_parsers`.
    RosIni => ros::read::INI_READER,
    /// camodocal YAML, which VINS-Mono and VINS-Fusion read.
    Camodocal => camodocal::read::READER,
    /// OpenCV FileStorage, YAML, XML or JSON; four coefficients are `k1 k2 p1 p2`.
    OpenCv => opencv::read::READER,
    /// OpenCV FileStorage with coefficients of the fisheye module; never detected automatically.
    OpenCvFisheye => opencv::read::FISHEYE_READER,
    /// COLMAP `cameras.txt`.
    Colmap => colmap::read::READER,
    /// ORB-SLAM2 and 3 settings YAML.
    OrbSlam => orb_slam::read::READER,
    /// Basalt calibration JSON.
    Basalt => basalt::read::READER,
    /// OKVIS settings YAML.
    Okvis => okvis::READER,
    /// The aslam camera rig YAML of maplab, rpg_svo_pro and ESIM.
    NCamera => ncamera::READER,
    /// The flat camera YAML of rpg_svo and FAST-LIVO.
    Vikit => vikit::READER,
    /// OpenSfM and OpenDroneMap JSON.
    OpenSfm => opensfm::READER,
    /// nerfstudio `transforms.json`.
    Nerfstudio => nerfstudio::read::READER,
}

formats! {
    /// Formats of calibrations that can be written.
    CalibrationFormat, Writer:
    /// OpenCV FileStorage YAML.
    OpenCv => opencv::write::WRITER,
    /// ROS `camera_info` YAML.
    Ros => ros::write::WRITER,
    /// Kalibr camchain.
    Kalibr => kalibr::write::WRITER,
    /// OpenVINS' `kalibr_imucam_chain.yaml`.
    OpenVins => kalibr::write::OPENVINS_WRITER,
    /// EuRoC `sensor.yaml`.
    Euroc => euroc::write::WRITER,
    /// COLMAP `cameras.txt`.
    Colmap => colmap::write::WRITER,
    /// Basalt JSON.
    Basalt => basalt::write::WRITER,
    /// Settings of ORB-SLAM3.
    OrbSlam3 => orb_slam::write::WRITER,
    /// Camera file and settings of VINS-Mono.
    Vins => camodocal::write::WRITER,
    /// nerfstudio `transforms.json`.
    Nerfstudio => nerfstudio::write::WRITER,
    /// Two STmaps.
    Stmap => stmap::WRITER,
}

/// The layout of a dataset.
fn layout(format: DatasetFormat) -> &'static Layout {
    match format {
        DatasetFormat::Euroc => &euroc::export::LAYOUT,
        DatasetFormat::Tum => &tum::LAYOUT,
        DatasetFormat::Kitti => &kitti::LAYOUT,
        DatasetFormat::Colmap => &colmap::export::LAYOUT,
        DatasetFormat::Nerfstudio => &nerfstudio::export::LAYOUT,
        DatasetFormat::Kalibr => &kalibr::export::LAYOUT,
        DatasetFormat::Mcap => &ros::export::LAYOUT,
        DatasetFormat::CarlaRs => &pairs::CARLA_LAYOUT,
        DatasetFormat::Gopro => &pairs::GOPRO_LAYOUT,
        DatasetFormat::Webdataset => &webdataset::LAYOUT,
        DatasetFormat::Flo => &flow::LAYOUT,
    }
}
