//! The scenario: one plain struct, edited by TOML files, `--set`, the command line and the viewer.
//!
//! Every key has a default except `flight.log` and the scene. Angles are in degrees only where the key ends
//! in `_deg`; lengths are in metres, times in seconds or `_ms`. Paths are as written in the file until the
//! loader resolves them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::{
    temporal::{MAX_KEYS, SAMPLES},
    timing_faults::picture_of,
};

mod auto;
mod auto_exposure;
mod camera;
mod channel;
mod dataset;
mod face;
mod file_list;
mod image_sensor;
pub mod keys;
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

use keys::{Table, Words};

#[cfg(test)]
pub(crate) use validate::tests::good as good_scenario;

/// All inputs of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Seed of all random numbers. The same seed gives the same noise, hence the same pictures.
    pub seed: u64,
    /// The flight log and how it is read.
    pub flight: FlightSpec,
    /// How the camera platform follows the log.
    pub tracker: TrackerSpec,
    /// The camera and all its imperfections.
    pub camera: CameraSpec,
    /// The scene: terrain, a pattern, a board, models, or several of them.
    #[key(required)]
    pub scene: SceneSpec,
    /// Tolerances and methods.
    pub quality: QualitySpec,
    /// Output channels and formats.
    pub output: OutputSpec,
    /// Inertial measurement units beside the camera.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub imu: Vec<ImuSpec>,
    /// Satellite receivers beside the camera.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gnss: Vec<GnssSpec>,
    /// Barometers beside the camera.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub barometer: Vec<BarometerSpec>,
    /// Magnetometers beside the camera.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub magnetometer: Vec<MagnetometerSpec>,
}

impl Scenario {
    /// This flight over this scene; all other keys have their defaults.
    #[must_use]
    pub fn new(flight: FlightSpec, scene: SceneSpec) -> Self {
        Self { flight, scene, ..Self::default() }
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

/// The flight log and the meaning of its columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct FlightSpec {
    /// The flight log: time, position and attitude (paper section 3).
    #[key(required, example = "\"flight.csv\"")]
    pub log: PathBuf,
    /// Format of the log. `auto` detects it by content, and refuses a log that two formats fit.
    pub format: LogFormat,
    /// Unit of times whose column names none. `auto` refuses ambiguous values.
    pub time_unit: TimeUnit,
    /// Unit of roll, pitch and yaw whose columns name none. `auto` refuses ambiguous values.
    pub angle_unit: AngleUnit,
    /// Whether roll, pitch and yaw wrap or count turns.
    pub angles: AngleKind,
    /// Source of the attitude: the log, or the flown path.
    pub attitude: AttitudeSource,
    /// Origin of the local north-east-down frame. `"first"` is the first good row of the log; a list is
    /// latitude, longitude and height on WGS-84.
    #[key(unit = "deg, deg, m", step = 0.0001, names = "lat lon h")]
    pub origin: Origin,
    /// Vertical reference of the log's heights.
    pub height: HeightReference,
    /// Instrument of the heights, where a log has several.
    pub height_from: HeightSource,
    /// Stream of a log that has several. It is that of the positions and, behind a comma, that of the
    /// attitudes: `"GPS, ATT"`.
    #[key(example = "\"/odom\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Part of the log that is flown: begin and end, counted from its first good row. Left out: all of it.
    #[key(unit = "s", step = 0.05, example = "[0.0, 20.0]", names = "from to")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_s: Option<[f64; 2]>,
    /// Speed-up of the log. 2 flies it twice as fast.
    #[key(
        default = 1.0,
        unit = "x",
        step = 0.01,
        above = 0.0,
        hint = "1 flies the log in its own time, 2 twice as fast"
    )]
    pub speed: f64,
}

impl FlightSpec {
    /// A log in a layout of its own marks; all other keys have their defaults.
    #[must_use]
    pub fn new(log: impl Into<PathBuf>) -> Self {
        Self { log: log.into(), ..Self::default() }
    }
}

/// Formats of flight logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Detected from header and values; an error if two formats fit.
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum AngleKind {
    /// `wrapped`, unless a column leaves both [-180, 180] and [0, 360).
    #[default]
    Auto,
    /// Rotation by the shorter way between two rows.
    Wrapped,
    /// As written, turns count: from 0 to 360 is a full turn.
    Continuous,
}

/// Source of the platform's attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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

/// Method and limits of the platform's motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSpec {
    /// Method by which the platform follows the log.
    pub kind: TrackerKind,
    /// Control rate of `sqrt`, or knot rate of `spline`.
    #[key(default = 400.0, unit = "Hz", min = 1.0, max = 100_000.0, hint = "400 is the default")]
    pub rate_hz: f64,
    /// Limit of the speed (the paper's v_max). `auto`: 1.2 times the 99.9th percentile of the log's own.
    #[key(unit = "m/s", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_speed_m_s: Auto<f64>,
    /// Limit of the acceleration (the paper's a_max). `auto`: 1.5 times the 99.9th percentile of the smoothed
    /// log's own, and at least 19.6 (2 g, the paper's). With `quality.preset = "paper"`, `auto` is 19.6.
    #[key(unit = "m/s2", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_acceleration_m_s2: Auto<f64>,
    /// Limit of the angular rate about the body's axes. `auto`: as of `max_speed_m_s`.
    #[key(unit = "deg/s", step = 0.1, above = 0.0, hint = "or write \"auto\"")]
    pub max_angular_rate_deg_s: Auto<f64>,
    /// Limit of the angular acceleration. `auto`: as of `max_acceleration_m_s2`, with 60 (the paper's) in
    /// place of 19.6.
    #[key(unit = "deg/s2", step = 0.5, above = 0.0, hint = "or write \"auto\"")]
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

/// Methods by which the platform follows the log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum TrackerKind {
    /// The pose of the latest row.
    Hold,
    /// Straight lines and constant rotation (slerp) between rows.
    Linear,
    /// The paper's pair of nested SQRT loops per channel (section 3).
    #[default]
    Sqrt,
    /// Cubic B-spline fitted to the whole log under the limits.
    Spline,
}

/// Tolerances and methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct QualitySpec {
    /// Set of methods: camsim's own, or the paper's for comparison. With `paper`, `max_error_px` and
    /// `max_error_dn` are ignored.
    pub preset: Preset,
    /// Tolerance of the error of source coordinates: its 99th percentile over valid pixels.
    #[key(default = 0.05, unit = "px", step = 0.001, above = 0.0, hint = "0.05 is the default")]
    pub max_error_px: f64,
    /// Tolerance of the RMS picture error in DN (1/255 of the linear range). It covers resampling, exposure
    /// sampling, misregistration, the terrain's level of detail, and silhouettes.
    #[key(default = 1.0, unit = "1/255", step = 0.01, above = 0.0, hint = "1 is the default")]
    pub max_error_dn: f64,
    /// Tolerance of the displacement by the terrain's level of detail, in output pixels. Its picture error
    /// counts in `max_error_dn`.
    #[key(default = 0.25, unit = "px", step = 0.01, above = 0.0, hint = "0.25 is the default")]
    pub max_terrain_error_px: f64,
    /// Method of the temporal inverse.
    pub solver: Auto<Solver>,
    /// Depth look-ups of `solver = "reproject"`.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_ITERATIONS,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub iterations: Auto<u32>,
    /// Largest number of exposure samples, per pixel of the motion's path and per pixel of the picture. With
    /// `preset = "paper"`, each pixel has exactly so many.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_BLUR_SAMPLES,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub blur_samples: Auto<u32>,
    /// Footprint taps along each side of an output pixel, at most.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_FOOTPRINT_TAPS,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub footprint_taps: Auto<u32>,
    /// Pixels of the ideal frame per camera pixel, along a side.
    #[key(step = 0.01, min = 1.0, max = 5.0, hint = "or write \"auto\"")]
    pub ideal_scale: Auto<f64>,
    /// Samples per pixel of the ideal frame, 1 or 4. With 4, borders are located within a pixel and smoother.
    #[key(min = 1, max = SAMPLES, hint = "write 1, 4 or \"auto\"")]
    pub ideal_samples: Auto<u32>,
    /// Ideal frames per output frame.
    #[key(step = 0.05, min = 1, max = MAX_KEYS, hint = "or write \"auto\"")]
    pub key_frames: Auto<u32>,
    /// Most output frames that are made from one ideal frame. That happens where it keeps the tolerances in
    /// less time.
    #[key(
        default = 8,
        step = 0.1,
        min = 1,
        max = MAX_FRAMES_PER_IDEAL,
        hint = "1 gives each frame its own; 8 is the default"
    )]
    pub frames_per_ideal: u32,
    /// Method for pixels at silhouettes, the borders of surfaces.
    pub silhouettes: Silhouettes,
}

/// Sets of methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// One straight step at constant velocity and depth (eq. 16 of the paper).
    Linear,
    /// Heun's steps of at most 2.5 deg at constant velocity and depth (eq. 18 of the paper).
    Rk2,
    /// Exact relative pose per row and sample, depth by fixed-point iteration.
    Reproject,
    /// An exact ray on the CPU for every sample of every pixel: the reference, slow.
    Oracle,
}

/// Channels and file formats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSpec {
    /// Channels written for each frame.
    #[key(default = vec![Channel::Color])]
    pub channels: Vec<Channel>,
    /// File formats of colour. With none, frames are rendered and read back, but not encoded.
    #[key(default = vec![ImageFormat::Exr])]
    pub format: Vec<ImageFormat>,
    /// Clock of all written stamps.
    pub stamps: Stamps,
    /// Time of the written clock at the begin of the window, with `stamps = "zero"`.
    #[key(unit = "ns")]
    pub epoch_ns: u64,
    /// Time that `trajectory.csv` and `camera_trajectory.csv` cover.
    #[serde(skip_serializing_if = "TrajectorySpan::is_frames")]
    pub trajectory: TrajectorySpan,
    /// Pixel type of EXR colour.
    pub exr_pixel: ExrPixel,
    /// Compression of EXR files.
    pub exr_compression: ExrCompression,
    /// File format of the channel `raw`.
    #[serde(skip_serializing_if = "RawFormat::is_default")]
    pub raw_format: RawFormat,
    /// Encoding of `mp4` and `mkv`, by ffmpeg.
    #[serde(skip_serializing_if = "VideoSpec::is_default")]
    pub video: VideoSpec,
    /// Frames from one to the other of `flow` and `flow_back`.
    #[key(
        default = 1,
        unit = "frames",
        step = 0.1,
        min = 1,
        hint = "flow leads from frame i to frame i + flow_step"
    )]
    pub flow_step: u32,
    /// Instant of the picture that `flow_global` leads to.
    pub flow_instant: FlowInstant,
    /// Pictures of `object` and `class` in colour, in `object_palette` and `class_palette`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub palette: bool,
    /// Points whose pixel `tracks.csv` has for every frame that sees them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracks: Option<TracksSpec>,
    /// The same frames by a better camera, each twin in a folder of its own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub twin: Vec<TwinSpec>,
    /// Layouts of other programs, made of the frames at the end of a run. Each has a folder of its own in
    /// `datasets`.
    #[key(example = "[\"euroc\", \"mcap\"]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub datasets: Vec<DatasetFormat>,
}

/// Clocks of stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Stamps {
    /// The clock of the log.
    #[default]
    Log,
    /// A clock that shows `output.epoch_ns` at the begin of `flight.window_s`.
    Zero,
}

/// Time that `trajectory.csv` and `camera_trajectory.csv` cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ExrPixel {
    /// 16 bit floating point.
    #[default]
    Half,
    /// 32 bit floating point.
    Float,
}

/// EXR compression methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
