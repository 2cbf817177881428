//! The formats, and what each has no place for.

use camsim_core::{
    pose::FLU_FROM_FRD,
    scenario::{CameraSpec, Readout, Reset},
};
use toml::{Table, Value};

use super::{
    Calibration, CalibrationError, ImuReference,
    axes::Rigid,
    basalt, camodocal, colmap, euroc,
    kalibr::{PoseKey, chain_yaml},
    lens_names, nerfstudio, opencv, orb_slam, ros, stmap,
};

/// Formats of calibrations that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CalibrationFormat {
    /// OpenCV FileStorage YAML.
    OpenCv,
    /// ROS `camera_info` YAML.
    Ros,
    /// Kalibr camchain.
    Kalibr,
    /// OpenVINS' `kalibr_imucam_chain.yaml`.
    OpenVins,
    /// EuRoC `sensor.yaml`.
    Euroc,
    /// COLMAP `cameras.txt`.
    Colmap,
    /// Basalt JSON.
    Basalt,
    /// Settings of ORB-SLAM3.
    OrbSlam3,
    /// Camera file and settings of VINS-Mono.
    Vins,
    /// nerfstudio `transforms.json`.
    Nerfstudio,
    /// Two STmaps.
    Stmap,
}

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CalibrationFile {
    /// Its usual name.
    pub name: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// A calibration in a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Its files; one, but for STmaps.
    pub files: Vec<CalibrationFile>,
    /// What the format has no place for, and what it has in another form.
    pub notes: Vec<String>,
}

impl CalibrationFormat {
    /// Every format.
    pub const ALL: [Self; 11] = [
        Self::OpenCv,
        Self::Ros,
        Self::Kalibr,
        Self::OpenVins,
        Self::Euroc,
        Self::Colmap,
        Self::Basalt,
        Self::OrbSlam3,
        Self::Vins,
        Self::Nerfstudio,
        Self::Stmap,
    ];

    /// Name, as in `--as`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenCv => "opencv",
            Self::Ros => "ros",
            Self::Kalibr => "kalibr",
            Self::OpenVins => "openvins",
            Self::Euroc => "euroc",
            Self::Colmap => "colmap",
            Self::Basalt => "basalt",
            Self::OrbSlam3 => "orbslam3",
            Self::Vins => "vins",
            Self::Nerfstudio => "nerfstudio",
            Self::Stmap => "stmap",
        }
    }

    /// The usual name of its file.
    fn file_name(self) -> &'static str {
        match self {
            Self::OpenCv => "calibration.yaml",
            Self::Ros => "camera_info.yaml",
            Self::Kalibr => "camchain.yaml",
            Self::OpenVins => "kalibr_imucam_chain.yaml",
            Self::Euroc => "sensor.yaml",
            Self::Colmap => "cameras.txt",
            Self::Basalt => "calibration.json",
            Self::OrbSlam3 => "orb_slam3.yaml",
            Self::Vins => "camera.yaml",
            Self::Nerfstudio => "transforms.json",
            Self::Stmap => "undistort.exr",
        }
    }

    /// Whether a file holds several cameras.
    #[must_use]
    pub fn is_rig(self) -> bool {
        matches!(self, Self::Kalibr | Self::OpenVins | Self::Colmap | Self::Basalt | Self::OrbSlam3)
    }

    /// Whether it has poses of cameras.
    fn has_poses(self) -> bool {
        matches!(
            self,
            Self::Kalibr | Self::OpenVins | Self::Euroc | Self::Basalt | Self::OrbSlam3 | Self::Vins
        )
    }

    /// Whether it has the time between stamps of the camera and those of an inertial sensor.
    fn has_time_shift(self) -> bool {
        matches!(self, Self::Kalibr | Self::OpenVins | Self::Basalt | Self::Vins)
    }

    /// Whether the file calls the camera at a place so by itself.
    fn numbers_as(self, name: &str, i: usize) -> bool {
        matches!(self, Self::Kalibr | Self::OpenVins) && name == format!("cam{i}")
    }

    /// Whether it has the readout of a camera.
    fn has_readout(self, spec: &CameraSpec) -> bool {
        let is_down = spec.shutter.readout == Readout::TopToBottom;
        // Rows that begin at once are exposed half as far apart as they are read, which no format says.
        if spec.shutter.reset == Reset::Global {
            return false;
        }
        match self {
            Self::Kalibr | Self::OpenVins => is_down || spec.shutter.readout == Readout::BottomToTop,
            Self::Vins => is_down,
            _ => false,
        }
    }

    /// Whether it has the frame rate of a camera.
    fn has_rate(self, spec: &CameraSpec) -> bool {
        self == Self::Euroc || self == Self::OrbSlam3 && spec.fps.fract() == 0.0
    }

    /// Keys of the camera that the file holds.
    fn holds(self, spec: &CameraSpec, key: &str) -> bool {
        match key {
            "size_px" | "focal_px" | "principal_point_px" => true,
            "name" => matches!(self, Self::Ros | Self::Vins),
            "fps" => self.has_rate(spec),
            "clock_offset_ms" | "shutter.delay_ms" => self.has_time_shift(),
            "shutter.readout_ms" | "shutter.readout" | "shutter.line_time_us" => self.has_readout(spec),
            "mount.angles_deg" | "mount.offset_m" => self.has_poses(),
            // A lens that a format does not have is an error.
            key => key.starts_with("lens"),
        }
    }
}

/// The cameras in a format. Poses and clocks refer to the platform: x forward, y left, z up.
///
/// # Errors
/// The format holds one camera, or does not have the lens of one of them.
pub fn export(cameras: &[CameraSpec], format: CalibrationFormat) -> Result<Exported, CalibrationError> {
    let all = cameras.iter().map(Calibration::new).collect::<Result<Vec<_>, _>>()?;
    let platform = ImuReference { body_from_imu: Rigid::turn(FLU_FROM_FRD), clock_offset_s: 0.0 };
    let one = match &all[..] {
        [one] => Ok(one),
        _ => Err(CalibrationError::Refused(format!(
            "{} holds one camera, and there are {} ({}): choose one with `--camera`",
            format.name(),
            all.len(),
            cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ")
        ))),
    };
    let text = match format {
        CalibrationFormat::OpenCv => opencv::file(one?)?,
        CalibrationFormat::Ros => ros::file(one?)?,
        CalibrationFormat::Kalibr => chain_yaml(&all, Some(&platform), PoseKey::CamImu)?,
        CalibrationFormat::OpenVins => {
            format!("%YAML:1.0\n\n{}", chain_yaml(&all, Some(&platform), PoseKey::ImuCam)?)
        }
        CalibrationFormat::Euroc => {
            let one = one?;
            euroc::sensor_yaml(one, &platform.body_from_imu.inverse().of(&one.body_from_camera()))?
        }
        CalibrationFormat::Colmap => colmap::cameras_txt(&all)?,
        CalibrationFormat::Basalt => basalt::json(&all, &platform)?,
        CalibrationFormat::OrbSlam3 => orb_slam::cameras(&all, Some(&platform))?,
        CalibrationFormat::Vins => camodocal::settings(one?, &platform)?,
        CalibrationFormat::Nerfstudio => nerfstudio::transforms_json(one?)?,
        CalibrationFormat::Stmap => {
            let one = one?;
            let files = stmap::files(one)?.map(|(name, bytes)| CalibrationFile { name, bytes });
            return Ok(Exported { files: files.into(), notes: notes(&all, format)? });
        }
    };
    let file = CalibrationFile { name: format.file_name(), bytes: text.into_bytes() };
    Ok(Exported { files: vec![file], notes: notes(&all, format)? })
}

/// What the file lacks, and what it has in another form.
fn notes(cameras: &[Calibration], format: CalibrationFormat) -> Result<Vec<String>, CalibrationError> {
    let mut notes = Vec::new();
    for (i, camera) in cameras.iter().enumerate() {
        let spec = &camera.spec;
        let lost = lost(spec, i, format)?;
        if !lost.is_empty() {
            notes.push(format!(
                "left out of {}, which has no place for it: {} of {}",
                format.name(),
                lost.join(", "),
                camera.label()
            ));
        }
        if format.has_time_shift() && spec.shutter.delay_ms != 0.0 {
            notes.push(format!(
                "shutter.delay_ms and clock_offset_ms of {} are written as one shift of its stamps: read back, it is a \
                 clock_offset_ms of {}",
                camera.label(),
                -1e3 * camera.stamp_to_centre_s()
            ));
        }
    }
    if format == CalibrationFormat::Euroc {
        notes.extend(cameras.iter().filter_map(|camera| lens_names::euroc_note(camera, camera.label())));
    }
    if format.has_poses() {
        notes.push("poses refer to the platform as x forward, y left, z up".to_owned());
    }
    Ok(notes)
}

/// Keys of a camera, by its place in the file, that differ from the default and that a format does not hold, with
/// their values.
fn lost(spec: &CameraSpec, i: usize, format: CalibrationFormat) -> Result<Vec<String>, CalibrationError> {
    let table = |spec: &CameraSpec| {
        Table::try_from(spec).map_err(|error| CalibrationError::Refused(format!("{}: {error}", spec.name)))
    };
    let default = leaves(&table(&CameraSpec::default())?);
    let own = leaves(&table(spec)?);
    let differs = own.iter().filter(|leaf| !default.contains(leaf));
    Ok(differs
        .filter(|(key, _)| !format.holds(spec, key))
        .filter(|(key, _)| key != "name" || !format.numbers_as(&spec.name, i))
        .map(|(key, value)| format!("{key} = {value}"))
        .collect())
}

/// Keys with their values, by dotted paths.
fn leaves(table: &Table) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(below) => {
                found.extend(leaves(below).into_iter().map(|(name, value)| (format!("{key}.{name}"), value)));
            }
            value => found.push((key.clone(), value.clone())),
        }
    }
    found
}
