//! The scenario: one plain struct, edited by TOML files, `--set`, the command line and the viewer.
//!
//! Every key has a default except `flight.log` and the scene. Angles are in degrees only where the key ends
//! in `_deg`; lengths are in metres, times in seconds or `_ms`. Paths are as written in the file until the
//! loader resolves them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::timing_faults::picture_of;

mod auto;
mod auto_exposure;
mod camera;
mod channel;
mod dataset;
mod face;
mod file_list;
mod image_sensor;
mod motion;
mod optics;
mod point_spread;
mod resized;
mod rig;
mod scene;
mod sensors;
mod timing;
mod tracks;
mod twin;
mod validate;
mod video;

pub use auto::{Auto, FieldOr};
pub use auto_exposure::{AutoExposureSpec, ExposureOrder, ExposureStart, MeterWeights};
pub use camera::{
    Axis, CameraSpec, LensModel, LensSpec, MountSpec, OutputEncoding, Parity, PhotometricSpec, Readout,
    Reset, ShutterSpec, VibrationSpec, ZoomSpec,
};
pub use channel::{Channel, FlowInstant, FlowState, PlaneKind};
pub use dataset::DatasetFormat;
pub use face::Face;
pub use file_list::FileList;
pub use image_sensor::{
    Companding, Demosaic, FlickerSpec, FlickerWave, ImageSensorSpec, Mosaic, PerChannel, ResponseCurve,
    SensorModel,
};
pub use motion::{LoopKind, MotionSpec, SpinSpec};
pub use optics::{ChromaticSpec, ImageCircleSpec, Primary, PrimaryLensSpec, VignettingSpec};
pub use point_spread::PointSpreadSpec;
pub use resized::{Binning, FilesOfSpec, MadeOf, ResizedSpec, Resizing};
pub use rig::Rig;
pub use scene::{
    Beyond, BoardKind, BoardSpec, Dictionary, GltfSpec, HeightReference, HeightUnit, LightSpec, ObjectsOf,
    PatternCentre, PatternSpec, SceneSpec, TerrainSpec,
};
pub use sensors::{
    BarometerSpec, GnssSpec, ImuSpec, MagnetometerSpec, PerAxis, SensorAxes, SensorCarrier, SensorMountSpec,
    TriadSpec,
};
pub use timing::{LateStamp, StampedBy, TimingSpec};
pub use tracks::{PointSource, TracksSpec};
pub use twin::{BurstOver, MAX_INSTANTS, TwinShutter, TwinSpec};
pub use validate::{
    MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_FRAMES_PER_IDEAL, MAX_ITERATIONS, MAX_SIDE_PX, Problem,
    checked_camera, checked_cameras, checked_rig, validate, validate_camera, validate_cameras, validate_rig,
};
pub use video::{ImageFormat, RawFormat, VideoCodec, VideoSpec};

#[cfg(test)]
pub(crate) use validate::tests::good as good_scenario;

/// All inputs of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Seed of all random numbers of the run.
    #[serde(default)]
    pub seed: u64,
    /// The flight log and how it is read.
    pub flight: FlightSpec,
    /// How the camera platform follows the log.
    #[serde(default)]
    pub tracker: TrackerSpec,
    /// The camera and all its imperfections.
    #[serde(default)]
    pub camera: CameraSpec,
    /// The scene.
    pub scene: SceneSpec,
    /// Tolerances and methods.
    #[serde(default)]
    pub quality: QualitySpec,
    /// Output channels and formats.
    #[serde(default)]
    pub output: OutputSpec,
    /// Inertial measurement units.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub imu: Vec<ImuSpec>,
    /// Satellite receivers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gnss: Vec<GnssSpec>,
    /// Barometers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub barometer: Vec<BarometerSpec>,
    /// Magnetometers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub magnetometer: Vec<MagnetometerSpec>,
}

impl Scenario {
    /// This flight over this scene; all other keys have their defaults.
    #[must_use]
    pub fn new(flight: FlightSpec, scene: SceneSpec) -> Self {
        Self {
            seed: 0,
            flight,
            tracker: TrackerSpec::default(),
            camera: CameraSpec::default(),
            scene,
            quality: QualitySpec::default(),
            output: OutputSpec::default(),
            imu: Vec::new(),
            gnss: Vec::new(),
            barometer: Vec::new(),
            magnetometer: Vec::new(),
        }
    }

    /// Seed of the camera's noise, from the scenario's seed and the camera's name.
    #[must_use]
    pub fn noise_seed(&self) -> u64 {
        crate::noise::camera_seed(self.seed, &self.camera.name)
    }

    /// Number of the frame whose picture a frame shows: its own, but for doubled frames
    /// ([`crate::timing_faults::TimingFaults::picture`]).
    #[must_use]
    pub fn picture(&self, frame: u64) -> u64 {
        picture_of(&self.camera, self.seed, frame)
    }
}

/// `[flight]`: the log and the meaning of its columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightSpec {
    /// The log file.
    pub log: PathBuf,
    /// Column layout; `auto` detects it, or fails if it is ambiguous.
    #[serde(default)]
    pub format: LogFormat,
    /// Unit of times whose column does not name one.
    #[serde(default)]
    pub time_unit: TimeUnit,
    /// Unit of roll, pitch and yaw whose columns do not name one.
    #[serde(default)]
    pub angle_unit: AngleUnit,
    /// Whether angles wrap or count turns.
    #[serde(default)]
    pub angles: AngleKind,
    /// Source of the attitude.
    #[serde(default)]
    pub attitude: AttitudeSource,
    /// Origin of the local NED frame.
    #[serde(default)]
    pub origin: Origin,
    /// Vertical reference of the log's heights.
    #[serde(default)]
    pub height: HeightReference,
    /// Instrument of the heights, where a log has several.
    #[serde(default)]
    pub height_from: HeightSource,
    /// Stream of a log that has several: that of the positions and, behind a comma, that of the attitudes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Interval of the log that is flown, in seconds from its first good row; `None` is the whole log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window_s: Option<[f64; 2]>,
    /// Time scale: 2 flies the log twice as fast.
    #[serde(default = "one")]
    pub speed: f64,
}

impl FlightSpec {
    /// A log in a layout of its own marks; all other keys have their defaults.
    #[must_use]
    pub fn new(log: impl Into<PathBuf>) -> Self {
        Self {
            log: log.into(),
            format: LogFormat::default(),
            time_unit: TimeUnit::default(),
            angle_unit: AngleUnit::default(),
            angles: AngleKind::default(),
            attitude: AttitudeSource::default(),
            origin: Origin::default(),
            height: HeightReference::default(),
            height_from: HeightSource::default(),
            topic: None,
            window_s: None,
            speed: one(),
        }
    }
}

/// Column layouts of flight logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Detected from header and values; an error if two layouts fit.
    #[default]
    Auto,
    /// `t, lat, lon, alt, roll, pitch, yaw` (degrees, metres up).
    CsvLla,
    /// `t, north, east, altitude up, roll, pitch, yaw`.
    CsvXya,
    /// `t, north, east, down, roll, pitch, yaw`.
    CsvNed,
    /// `t x y z qx qy qz qw`, world z up.
    Tum,
    /// `t_ns, x, y, z, qw, qx, qy, qz, ...`, world z up.
    Euroc,
    /// Track points of a GPX file: latitude, longitude, height, time; no attitude.
    Gpx,
    /// Tracks of a KML file (`gx:Track`) or its placemarks with times.
    Kml,
    /// Flight record of a glider logger; no attitude.
    Igc,
    /// Log of PX4.
    Ulog,
    /// Binary log of ArduPilot.
    Dataflash,
    /// ROS messages in an MCAP file.
    Mcap,
}

/// Instrument of the heights of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HeightSource {
    /// That of satellite navigation where there is one, else that of air pressure, with a warning.
    #[default]
    Auto,
    /// Satellite navigation, or a filter that uses it.
    Gnss,
    /// Air pressure in the standard atmosphere.
    Pressure,
}

/// Time units of a flight log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds, or a unit that the values imply beyond doubt; an error if in doubt.
    #[default]
    Auto,
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// Minutes.
    Min,
    /// Hours.
    H,
}

/// Units of roll, pitch and yaw in a flight log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AngleUnit {
    /// Degrees, or a unit that the values imply beyond doubt; an error if in doubt.
    #[default]
    Auto,
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
}

/// Interpretation of Euler angles in a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleKind {
    /// `Wrapped`, unless a column leaves both [-180, 180] and [0, 360).
    #[default]
    Auto,
    /// Rotation by the shorter way between two rows.
    Wrapped,
    /// As written: from 0 to 360 is a full turn.
    Continuous,
}

/// Source of the platform's attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AttitudeSource {
    /// The log's own columns.
    #[default]
    Log,
    /// Heading from the track, bank from coordinated turns, pitch from the climb angle.
    Track,
}

/// Origin of the local north-east-down frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// The first good row of the log (written `"first"`).
    #[default]
    #[serde(with = "auto::first")]
    First,
    /// `[latitude_deg, longitude_deg, height_m]` on WGS-84.
    Geodetic([f64; 3]),
}

/// `[tracker]`: limits and method of the platform's motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSpec {
    /// The method.
    pub kind: TrackerKind,
    /// Control rate of `sqrt`, knot rate of `spline`, hertz.
    pub rate_hz: f64,
    /// Speed limit; `auto` is 1.2 times the 99.9th percentile of the log's own speed.
    pub max_speed_m_s: Auto<f64>,
    /// Acceleration limit; `auto` is 1.5 times the 99.9th percentile of the smoothed log's own, and at least
    /// the paper's 19.6. With the paper's preset it is 19.6.
    pub max_acceleration_m_s2: Auto<f64>,
    /// Angular rate limit; `auto` as for speed.
    pub max_angular_rate_deg_s: Auto<f64>,
    /// Angular acceleration limit; `auto` as for acceleration, with the paper's 60.
    pub max_angular_acceleration_deg_s2: Auto<f64>,
}

/// Acceleration limit of the paper's experiments: 2 g.
pub(crate) const PAPER_ACCELERATION_M_S2: f64 = 19.6;
/// Angular acceleration limit of the paper's experiments.
pub(crate) const PAPER_ANGULAR_ACCELERATION_DEG_S2: f64 = 60.0;

impl Scenario {
    /// `[tracker]` with the preset applied: with the paper's preset, `auto` accelerations are the paper's.
    #[must_use]
    pub fn effective_tracker(&self) -> TrackerSpec {
        let mut tracker = self.tracker.clone();
        if self.quality.preset == Preset::Paper {
            let or_paper = |limit: Auto<f64>, paper: f64| Auto::Value(limit.value().unwrap_or(paper));
            tracker.max_acceleration_m_s2 = or_paper(tracker.max_acceleration_m_s2, PAPER_ACCELERATION_M_S2);
            tracker.max_angular_acceleration_deg_s2 =
                or_paper(tracker.max_angular_acceleration_deg_s2, PAPER_ANGULAR_ACCELERATION_DEG_S2);
        }
        tracker
    }
}

impl Default for TrackerSpec {
    fn default() -> Self {
        Self {
            kind: TrackerKind::Sqrt,
            rate_hz: 400.0,
            max_speed_m_s: Auto::Auto,
            max_acceleration_m_s2: Auto::Auto,
            max_angular_rate_deg_s: Auto::Auto,
            max_angular_acceleration_deg_s2: Auto::Auto,
        }
    }
}

/// Methods by which the platform follows the log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrackerKind {
    /// The pose of the latest row.
    Hold,
    /// Straight lines and slerp between rows.
    Linear,
    /// Two nested SQRT loops per channel (paper section 3).
    #[default]
    Sqrt,
    /// Cubic B-spline fitted to the whole log under the limits.
    Spline,
}

/// `[quality]`: tolerances and methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct QualitySpec {
    /// Set of methods: camsim's own, or the paper's.
    pub preset: Preset,
    /// Bound on the 99th percentile of the source error over valid pixels.
    pub max_error_px: f64,
    /// Bound on the RMS picture error in DN (1/255 of the linear range): resampling, exposure sampling,
    /// misregistration, terrain level of detail, and silhouettes.
    pub max_error_dn: f64,
    /// Bound on the displacement by the terrain's level of detail, output pixels. Its picture error counts in
    /// `max_error_dn`.
    pub max_terrain_error_px: f64,
    /// Temporal inverse.
    pub solver: Auto<Solver>,
    /// Depth look-ups of `reproject`, at most [`MAX_ITERATIONS`].
    pub iterations: Auto<u32>,
    /// Exposure samples per pixel of path; with the paper preset, samples per exposure. At most
    /// [`MAX_BLUR_SAMPLES`].
    pub blur_samples: Auto<u32>,
    /// Footprint taps per axis of an output pixel, at most [`MAX_FOOTPRINT_TAPS`].
    pub footprint_taps: Auto<u32>,
    /// Ideal pixels per camera pixel along a side.
    pub ideal_scale: Auto<f64>,
    /// Samples per pixel of the ideal frame, 1 or 4. Several samples locate borders within a pixel.
    pub ideal_samples: Auto<u32>,
    /// Ideal frames per output frame.
    pub key_frames: Auto<u32>,
    /// Largest number of output frames rendered from one ideal frame, at most [`MAX_FRAMES_PER_IDEAL`].
    #[serde(default = "frames_per_ideal")]
    pub frames_per_ideal: u32,
    /// Method for pixels at silhouettes.
    #[serde(default)]
    pub silhouettes: Silhouettes,
}

impl Default for QualitySpec {
    fn default() -> Self {
        Self {
            preset: Preset::Default,
            max_error_px: 0.05,
            max_error_dn: 1.0,
            max_terrain_error_px: 0.25,
            solver: Auto::Auto,
            iterations: Auto::Auto,
            blur_samples: Auto::Auto,
            footprint_taps: Auto::Auto,
            ideal_scale: Auto::Auto,
            ideal_samples: Auto::Auto,
            key_frames: Auto::Auto,
            frames_per_ideal: frames_per_ideal(),
            silhouettes: Silhouettes::Auto,
        }
    }
}

fn frames_per_ideal() -> u32 {
    8
}

/// Sets of methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The cheapest methods that keep the tolerances.
    #[default]
    Default,
    /// The methods and approximations of the paper, for comparison. The preset fixes the solver (eq. 18), one
    /// ideal frame and one sample per pixel; `blur_samples` counts the samples of an exposure (100), and the
    /// tolerances determine only the terrain's level of detail.
    Paper,
}

/// Methods for pixels at silhouettes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Silhouettes {
    /// `plain` if it is expected to keep `max_error_dn`, otherwise `rays`.
    #[default]
    Auto,
    /// As elsewhere: taps in the ideal frame, each of whose pixels shows one surface.
    Plain,
    /// Silhouette rays over the pixel's area and exposure, through ideal frames with several samples per
    /// pixel.
    Rays,
}

/// Methods of the temporal inverse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// One straight step at constant velocity and depth (eq. 16 of the paper).
    Linear,
    /// Heun's steps of at most 2.5 deg at constant velocity and depth (eq. 18 of the paper).
    Rk2,
    /// Exact relative pose per row and sample, depth by fixed-point iteration.
    Reproject,
    /// A ray in f64 on the CPU for every sample of every pixel: the reference, slow.
    Oracle,
}

/// `[output]`: channels and file formats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSpec {
    /// Channels to write for each frame.
    pub channels: Vec<Channel>,
    /// File formats; with none, frames are rendered and read back without being written.
    pub format: Vec<ImageFormat>,
    /// Clock of all written stamps.
    pub stamps: Stamps,
    /// With `stamps = "zero"`: time of that clock at the begin of the window, nanoseconds.
    pub epoch_ns: u64,
    /// Time that the trajectories cover.
    #[serde(skip_serializing_if = "TrajectorySpan::is_frames")]
    pub trajectory: TrajectorySpan,
    /// Pixel type of EXR colour.
    pub exr_pixel: ExrPixel,
    /// EXR compression.
    pub exr_compression: ExrCompression,
    /// File format of `raw`.
    #[serde(skip_serializing_if = "RawFormat::is_default")]
    pub raw_format: RawFormat,
    /// Encoding of `mp4` and `mkv`.
    #[serde(skip_serializing_if = "VideoSpec::is_default")]
    pub video: VideoSpec,
    /// Frames from one to the other of `flow` and `flow_back`.
    pub flow_step: u32,
    /// Instant of the picture that `flow_global` leads to.
    pub flow_instant: FlowInstant,
    /// Whether `object` and `class` get pictures in colour, for people, in `object_palette` and
    /// `class_palette`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub palette: bool,
    /// Points whose pixel is written for every frame that sees them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracks: Option<TracksSpec>,
    /// Twins of every frame, each in a folder of its own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub twin: Vec<TwinSpec>,
    /// Layouts of other programs that are written at the end of a run, each in a folder of its own in `datasets`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub datasets: Vec<DatasetFormat>,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            channels: vec![Channel::Color],
            format: vec![ImageFormat::Exr],
            stamps: Stamps::Log,
            epoch_ns: 0,
            trajectory: TrajectorySpan::Frames,
            exr_pixel: ExrPixel::Half,
            exr_compression: ExrCompression::Zip1,
            raw_format: RawFormat::Png,
            video: VideoSpec::default(),
            flow_step: 1,
            flow_instant: FlowInstant::Centre,
            palette: false,
            tracks: None,
            twin: Vec::new(),
            datasets: Vec::new(),
        }
    }
}

/// Clocks of stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stamps {
    /// The clock of the log.
    #[default]
    Log,
    /// A clock that shows [`OutputSpec::epoch_ns`] at the begin of `flight.window_s`.
    Zero,
}

/// Time that `trajectory.csv` and `camera_trajectory.csv` cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrajectorySpan {
    /// That of the frames in the folder; with sensors beside the camera, that of the flight.
    #[default]
    Frames,
    /// All of `flight.window_s`.
    Flight,
}

impl TrajectorySpan {
    fn is_frames(&self) -> bool {
        *self == Self::Frames
    }
}

impl OutputSpec {
    /// Channels of the frames and of their twins, some of them twice.
    pub fn all_channels(&self) -> impl Iterator<Item = Channel> {
        self.channels
            .iter()
            .chain(self.twin.iter().filter_map(|twin| twin.channels.as_ref()).flatten())
            .copied()
    }

    /// Time of the written clock at path time 0, nanoseconds. The log's clock shows `log_epoch_ns` there, and
    /// the window begins at `start_s` of path time.
    #[must_use]
    pub fn stamp_epoch_ns(&self, log_epoch_ns: i64, start_s: f64) -> i64 {
        match self.stamps {
            Stamps::Log => log_epoch_ns,
            Stamps::Zero => i64::try_from(self.epoch_ns)
                .unwrap_or(i64::MAX)
                .saturating_sub((start_s * 1e9).round() as i64),
        }
    }
}

/// Pixel type of EXR colour channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExrPixel {
    /// 16 bit floating point.
    #[default]
    Half,
    /// 32 bit floating point.
    Float,
}

/// EXR compression methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExrCompression {
    /// Uncompressed.
    None,
    /// Run-length encoding.
    Rle,
    /// Deflate, one row per block.
    #[default]
    Zip1,
    /// Deflate, 16 rows per block.
    Zip16,
    /// Wavelet.
    Piz,
}

fn one() -> f64 {
    1.0
}
