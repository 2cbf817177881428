//! Supported formats and their importers.

use serde_json::Value;

use super::document::{Document, KeyProblem, find};
use super::key_table::{KeyRow, TableLeaves, leaves};
use super::selection::CameraEntry;
use super::syntax::LENS_DATABASE;
use super::{
    ImportedCamera, agisoft, basalt, camodocal, colmap, gyroflow, kalibr, ncamera, nerfstudio, okvis, opencv,
    opensfm, orb_slam, other_text, reference, ros, vikit,
};

/// Formats that can be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraFormat {
    /// OpenCV FileStorage, YAML, XML or JSON; four coefficients are `k1 k2 p1 p2`.
    OpenCv,
    /// OpenCV FileStorage with coefficients of the fisheye module; never detected automatically.
    OpenCvFisheye,
    /// Kalibr camchain YAML, also OpenVINS'.
    Kalibr,
    /// EuRoC `sensor.yaml`.
    Euroc,
    /// ROS `camera_info` YAML, file or message.
    RosCameraInfo,
    /// ROS `.ini` of `camera_calibration_parsers`.
    RosIni,
    /// camodocal YAML, which VINS-Mono and VINS-Fusion read.
    Camodocal,
    /// XML of the paper's reference program.
    Reference,
    /// Agisoft Metashape, PhotoScan or Lens XML.
    Agisoft,
    /// Gyroflow lens profile JSON.
    Gyroflow,
    /// COLMAP `cameras.txt`.
    Colmap,
    /// ORB-SLAM2 and 3 settings YAML.
    OrbSlam,
    /// Basalt calibration JSON.
    Basalt,
    /// OKVIS settings YAML.
    Okvis,
    /// The aslam camera rig YAML of maplab, rpg_svo_pro and ESIM.
    NCamera,
    /// The flat camera YAML of rpg_svo and FAST-LIVO.
    Vikit,
    /// OpenSfM and OpenDroneMap JSON.
    OpenSfm,
    /// nerfstudio `transforms.json`.
    Nerfstudio,
}

impl CameraFormat {
    /// Every format, in the order of detection.
    pub const ALL: [Self; 18] = [
        Self::Reference,
        Self::Agisoft,
        Self::Gyroflow,
        Self::Kalibr,
        Self::Euroc,
        Self::RosCameraInfo,
        Self::RosIni,
        Self::Camodocal,
        Self::OpenCv,
        Self::OpenCvFisheye,
        Self::Colmap,
        Self::OrbSlam,
        Self::Basalt,
        Self::Okvis,
        Self::NCamera,
        Self::Vikit,
        Self::OpenSfm,
        Self::Nerfstudio,
    ];

    /// Name, as in `--format`.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenCv => "opencv",
            Self::OpenCvFisheye => "opencv-fisheye",
            Self::Kalibr => "kalibr",
            Self::Euroc => "euroc",
            Self::RosCameraInfo => "ros-camera-info",
            Self::RosIni => "ros-ini",
            Self::Camodocal => "camodocal",
            Self::Reference => "reference",
            Self::Agisoft => "agisoft",
            Self::Gyroflow => "gyroflow",
            Self::Colmap => "colmap",
            Self::OrbSlam => "orb-slam",
            Self::Basalt => "basalt",
            Self::Okvis => "okvis",
            Self::NCamera => "ncamera",
            Self::Vikit => "vikit",
            Self::OpenSfm => "opensfm",
            Self::Nerfstudio => "nerfstudio",
        }
    }

    /// Title in lists of formats.
    pub fn title(self) -> &'static str {
        match self {
            Self::OpenCv => "OpenCV YAML/XML",
            Self::OpenCvFisheye => "OpenCV YAML/XML of a fisheye",
            Self::Kalibr => "Kalibr camchain",
            Self::Euroc => "EuRoC sensor.yaml",
            Self::RosCameraInfo => "ROS camera_info (file or message)",
            Self::RosIni => "ROS .ini",
            Self::Camodocal => "camodocal (VINS) YAML",
            Self::Reference => "the reference program's XML",
            Self::Agisoft => "Agisoft Metashape and Lens XML",
            Self::Gyroflow => "Gyroflow lens profiles",
            Self::Colmap => "COLMAP cameras.txt",
            Self::OrbSlam => "ORB-SLAM2/3 YAML",
            Self::Basalt => "Basalt JSON",
            Self::Okvis => "OKVIS YAML",
            Self::NCamera => "camera rigs of maplab, rpg_svo_pro and ESIM",
            Self::Vikit => "rpg_svo and FAST-LIVO YAML",
            Self::OpenSfm => "OpenSfM and OpenDroneMap JSON",
            Self::Nerfstudio => "nerfstudio transforms.json",
        }
    }

    /// Whether a document has this format.
    pub(super) fn matches(self, document: &Document) -> bool {
        match self {
            Self::OpenCv => opencv::matches(document),
            Self::OpenCvFisheye => false,
            Self::Kalibr => kalibr::matches_camchain(document),
            Self::Euroc => kalibr::matches_euroc(document),
            Self::RosCameraInfo => document.root.is_empty() && ros::matches(document),
            Self::RosIni => document.root == "ini",
            Self::Camodocal => camodocal::matches(document),
            Self::Reference => reference::matches(document),
            Self::Agisoft => agisoft::matches(document),
            Self::Gyroflow => gyroflow::matches(document),
            Self::Colmap => colmap::matches(document),
            Self::OrbSlam => orb_slam::matches(document),
            Self::Basalt => basalt::matches(document),
            Self::Okvis => okvis::matches(document),
            Self::NCamera => ncamera::matches(document),
            Self::Vikit => vikit::matches(document),
            Self::OpenSfm => opensfm::matches(document),
            Self::Nerfstudio => nerfstudio::matches(document),
        }
    }

    /// The cameras of a file.
    pub(super) fn entries(self, document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
        Ok(match self {
            Self::OpenCv | Self::OpenCvFisheye => {
                let entries = opencv::entries(document);
                if entries.is_empty() {
                    return Err(KeyProblem::new("camera_matrix", "is missing, or is not 3 x 3"));
                }
                opencv::check_coefficients(&entries)?;
                entries
            }
            Self::Kalibr => kalibr::entries(document),
            Self::RosIni => ros::entries(document),
            Self::Colmap => colmap::entries(document),
            Self::OrbSlam => orb_slam::entries(document),
            Self::Basalt => basalt::entries(document),
            Self::Okvis => okvis::entries(document),
            Self::NCamera => ncamera::entries(document),
            Self::Agisoft => return agisoft::entries(document),
            Self::OpenSfm => return opensfm::entries(document),
            Self::Nerfstudio => return nerfstudio::entries(document),
            Self::Euroc
            | Self::RosCameraInfo
            | Self::Camodocal
            | Self::Reference
            | Self::Gyroflow
            | Self::Vikit => CameraEntry::single(&document.value),
        })
    }

    /// Tables of keys, each with its scope.
    pub(super) fn tables(self) -> &'static [(&'static str, &'static [KeyRow])] {
        match self {
            Self::OpenCv | Self::OpenCvFisheye => &[("", opencv::KEYS)],
            Self::Kalibr => &[("", kalibr::KEYS)],
            Self::Euroc => &[("", kalibr::EUROC_KEYS)],
            Self::RosCameraInfo => &[("", ros::KEYS)],
            Self::RosIni => &[("", ros::INI_KEYS)],
            Self::Camodocal => &[("", camodocal::KEYS)],
            Self::Reference => &[("", reference::KEYS)],
            Self::Agisoft => &[
                ("a calibration", agisoft::KEYS),
                ("a sensor of a project, relative to the sensor", agisoft::SENSOR_KEYS),
            ],
            Self::Gyroflow => &[("", gyroflow::KEYS)],
            Self::Colmap => &[("", colmap::KEYS)],
            Self::OrbSlam => &[("", orb_slam::KEYS)],
            Self::Basalt => &[("", basalt::KEYS)],
            Self::Okvis => &[("", okvis::KEYS)],
            Self::NCamera => &[("", ncamera::KEYS)],
            Self::Vikit => &[("", vikit::KEYS)],
            Self::OpenSfm => &[("a camera, relative to its name", opensfm::KEYS)],
            Self::Nerfstudio => &[("", nerfstudio::KEYS)],
        }
    }

    /// Leaves of the selected camera and common leaves, with their tables.
    pub(super) fn table_leaves<'a>(
        self,
        document: &'a Document,
        entries: &[CameraEntry<'a>],
        chosen: &CameraEntry<'a>,
    ) -> Vec<TableLeaves<'a>> {
        let keys = self.tables()[0].1;
        match self {
            // The rest of the file is poses and points.
            Self::OpenSfm => vec![TableLeaves { keys, leaves: leaves(chosen.value) }],
            Self::Agisoft if document.root == "document" => {
                let calibration = agisoft::calibration_of(chosen.value)
                    .map(|value| TableLeaves { keys, leaves: leaves(value) });
                calibration
                    .into_iter()
                    .chain([TableLeaves { keys: agisoft::SENSOR_KEYS, leaves: leaves(chosen.value) }])
                    .collect()
            }
            _ => {
                let mut leaves = leaves(&document.value);
                leaves.retain(|leaf| {
                    chosen.contains(&leaf.path) || !entries.iter().any(|other| other.contains(&leaf.path))
                });
                vec![TableLeaves { keys, leaves }]
            }
        }
    }

    /// Imports a camera. `is_explicit` is whether the user named the format.
    pub(super) fn import(
        self,
        document: &Document,
        entry: &CameraEntry<'_>,
        is_explicit: bool,
    ) -> Result<ImportedCamera, KeyProblem> {
        let value = entry.value;
        match self {
            Self::OpenCv | Self::OpenCvFisheye => opencv::import(entry, self, is_explicit),
            Self::Kalibr | Self::Euroc => kalibr::import(value, self),
            Self::RosCameraInfo => ros::import(value, false),
            Self::RosIni => ros::import(value, true),
            Self::Camodocal => camodocal::import(value),
            Self::Reference => reference::import(value),
            Self::Agisoft => agisoft::import(document, value),
            Self::Gyroflow => gyroflow::import(value),
            Self::Colmap => colmap::import(value),
            Self::OrbSlam => orb_slam::import(value, &entry.name),
            Self::Basalt => basalt::import(document, entry),
            Self::Okvis => okvis::import(value),
            Self::NCamera => ncamera::import(value),
            Self::Vikit => vikit::import(value),
            Self::OpenSfm => opensfm::import(value),
            Self::Nerfstudio => nerfstudio::import(document, entry),
        }
    }
}

/// Titles of all formats, separated by commas.
pub(super) fn all_titles() -> String {
    CameraFormat::ALL.map(CameraFormat::title).join(", ")
}

/// A message for known files that are not supported.
pub(super) fn unsupported_hint(document: &Document) -> Option<String> {
    let value = &document.value;
    let calibrations: Vec<&str> = (0..8)
        .filter_map(|index| find(value, &format!("cam{index}_calib")).and_then(Value::as_str))
        .collect();
    if !calibrations.is_empty() {
        return Some(format!(
            "this refers to a file for each camera: import one of those ({})",
            calibrations.join(", ")
        ));
    }
    if document.root == "lensdatabase" {
        return Some(LENS_DATABASE.to_owned());
    }
    if find(value, "ppx").is_some() {
        let text = "these are RealSense intrinsics: write camera_matrix ([fx, 0, ppx, 0, fy, ppy, 0, 0, 1]), \
                    distortion_coefficients, image_width and image_height to a YAML file";
        return Some(text.to_owned());
    }
    if find(value, "IntrinsicMatrix").is_some() {
        let text = "this is MATLAB's transposed matrix, whose pixels count from 1: write camera_matrix ([fx, 0, cx - 1, \
                    0, fy, cy - 1, 0, 0, 1]), distortion_coefficients ([k1, k2, p1, p2, k3]), image_width and \
                    image_height to a YAML file";
        return Some(text.to_owned());
    }
    if let Some(hint) = other_text::hint(document) {
        return Some(hint);
    }
    if find(value, "distortion_model").is_some() || find(value, "distortion_coefficients").is_some() {
        return Some(
            "there are distortion coefficients, but no 3 x 3 camera matrix under a known name \
             (camera_matrix, K, k)"
                .to_owned(),
        );
    }
    None
}
