//! The scenario: one plain struct that TOML, `--set`, the command line and the viewer all edit.
//!
//! Every key has a default except `flight.log` and the scene. Angles are degrees only where the key says
//! `_deg`, lengths are metres, times seconds or `_ms`. Paths are as written in the file until the loader
//! resolves them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

mod auto;
mod camera;
mod scene;
mod validate;

pub use auto::{Auto, FieldOr};
pub use camera::{
    Axis, CameraSpec, LensModel, LensSpec, MountSpec, OutputEncoding, Parity, PhotometricSpec, Readout,
    ShutterSpec, VibrationSpec, ZoomSpec,
};
pub use scene::{
    Beyond, BoardKind, BoardSpec, Dictionary, GltfSpec, HeightReference, HeightUnit, LightSpec,
    PatternCentre, PatternSpec, SceneSpec, TerrainSpec,
};
pub use validate::{
    MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_FRAMES_PER_IDEAL, MAX_ITERATIONS, MAX_SIDE_PX, Problem,
    validate, validate_camera,
};

/// Everything that one run depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Seed of every random number of the run.
    #[serde(default)]
    pub seed: u64,
    /// The flight log and how to read it.
    pub flight: FlightSpec,
    /// How the camera platform follows the log.
    #[serde(default)]
    pub tracker: TrackerSpec,
    /// The camera and all its imperfections.
    #[serde(default)]
    pub camera: CameraSpec,
    /// What there is to see.
    pub scene: SceneSpec,
    /// Tolerances and the methods that keep them.
    #[serde(default)]
    pub quality: QualitySpec,
    /// What is written.
    #[serde(default)]
    pub output: OutputSpec,
}

impl Scenario {
    /// Seed of the camera's noise: the scenario's, and the camera's name.
    #[must_use]
    pub fn noise_seed(&self) -> u64 {
        crate::noise::camera_seed(self.seed, &self.camera.name)
    }
}

/// `[flight]`: the log and how its columns are meant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightSpec {
    /// The log file.
    pub log: PathBuf,
    /// Column layout; `auto` detects it or refuses.
    #[serde(default)]
    pub format: LogFormat,
    /// Unit of times whose column names none.
    #[serde(default)]
    pub time_unit: TimeUnit,
    /// Unit of roll, pitch and yaw whose columns name none.
    #[serde(default)]
    pub angle_unit: AngleUnit,
    /// Whether angles wrap or count turns.
    #[serde(default)]
    pub angles: AngleKind,
    /// Where attitude comes from.
    #[serde(default)]
    pub attitude: AttitudeSource,
    /// Origin of the local NED frame.
    #[serde(default)]
    pub origin: Origin,
    /// Vertical reference of the log's heights.
    #[serde(default)]
    pub height: HeightReference,
    /// Part of the log that is flown, in seconds from its first good row; `None` is all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window_s: Option<[f64; 2]>,
    /// Time scale: 2 flies the log twice as fast.
    #[serde(default = "one")]
    pub speed: f64,
}

/// Column layouts of flight logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Detect from header and values; refuse when two layouts fit.
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
}

/// Units of time in a flight log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds, or what the values tell beyond doubt; refuse where they leave a doubt.
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
    /// Degrees, or what the values tell beyond doubt; refuse where they leave a doubt.
    #[default]
    Auto,
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
}

/// How Euler angles in a log are to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleKind {
    /// `Wrapped`, unless a column leaves both [-180, 180] and [0, 360).
    #[default]
    Auto,
    /// The short way between two rows.
    Wrapped,
    /// As written: 0 to 360 is a full turn.
    Continuous,
}

/// Where the attitude of the platform comes from.
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
    /// Method.
    pub kind: TrackerKind,
    /// Control rate of `sqrt`, knot rate of `spline`, in hertz.
    pub rate_hz: f64,
    /// Speed limit; `auto` is 1.2 times the 99.9th percentile of the log's own speed.
    pub max_speed_m_s: Auto<f64>,
    /// Acceleration limit; `auto` is 1.5 times the 99.9th percentile of the smoothed log's own, and at least
    /// the paper's 19.6; with the paper's preset it is that.
    pub max_acceleration_m_s2: Auto<f64>,
    /// Angular rate limit; `auto` as for speed.
    pub max_angular_rate_deg_s: Auto<f64>,
    /// Angular acceleration limit; `auto` as for acceleration, with the paper's 60.
    pub max_angular_acceleration_deg_s2: Auto<f64>,
}

/// Acceleration limit of the paper's experiments: 2 g.
pub const PAPER_ACCELERATION_M_S2: f64 = 19.6;
/// Their angular acceleration limit.
pub const PAPER_ANGULAR_ACCELERATION_DEG_S2: f64 = 60.0;

impl Scenario {
    /// `[tracker]` as it counts: with the paper's preset `auto` accelerations are the paper's.
    #[must_use]
    pub fn tracker_in_force(&self) -> TrackerSpec {
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

/// Methods of following the log.
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
    /// Limit-constrained quadratic B-spline over the whole log.
    Spline,
}

/// `[quality]`: tolerances, and the methods that keep them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct QualitySpec {
    /// Whose methods: camsim's own, or the paper's.
    pub preset: Preset,
    /// Bound on the 99th percentile of the source coordinate's error over valid pixels.
    pub max_error_px: f64,
    /// RMS bound in 1/255 of linear range, from resampling, blur sampling, sources beside their place, the
    /// terrain's level of detail and at silhouettes.
    pub max_error_dn: f64,
    /// Bound on what the terrain's level of detail moves, pixels of the picture; what that costs counts in
    /// `max_error_dn`.
    pub max_terrain_error_px: f64,
    /// Temporal solver.
    pub solver: Auto<Solver>,
    /// Depth look-ups of `reproject`, at most [`MAX_ITERATIONS`].
    pub iterations: Auto<u32>,
    /// Exposure samples per pixel of path; with the paper preset, samples of the exposure. At most
    /// [`MAX_BLUR_SAMPLES`].
    pub blur_samples: Auto<u32>,
    /// Footprint taps per axis of an output pixel, at most [`MAX_FOOTPRINT_TAPS`].
    pub footprint_taps: Auto<u32>,
    /// Pixels of the ideal frame for each of the camera's, along a side.
    pub ideal_scale: Auto<f64>,
    /// Samples of each pixel of the ideal frame, 1 or 4: with several, borders are known to a part of a
    /// pixel.
    pub ideal_samples: Auto<u32>,
    /// Ideal frames per output frame.
    pub key_frames: Auto<u32>,
    /// Output frames that may be made from one ideal frame, at most [`MAX_FRAMES_PER_IDEAL`].
    #[serde(default = "frames_per_ideal")]
    pub frames_per_ideal: u32,
    /// Colours of pixels at silhouettes.
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
    /// The paper's own methods and approximations, as a base to measure against; [`crate::plan::paper`] lists
    /// them. It fixes the solver (eq. 18), one ideal frame and one sample a pixel; `blur_samples` counts the
    /// samples of an exposure (100), and the tolerances choose nothing but the terrain's level of detail.
    Paper,
}

/// How pixels at silhouettes get their colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Silhouettes {
    /// As `plain` where that is expected to keep `max_error_dn`, otherwise as `rays`.
    #[default]
    Auto,
    /// As everywhere: from pixels of the ideal frame, each of which shows one surface.
    Plain,
    /// By rays of their own, over the pixel's area and exposure, through ideal frames that keep several
    /// samples a pixel.
    Rays,
}

/// Temporal inverse methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// One straight step at constant velocity and depth (paper eq. 16).
    Linear,
    /// Heun's steps of at most 2.5 deg at constant velocity and depth (paper eq. 18).
    Rk2,
    /// Exact relative pose per row and sample, depth by fixed-point iteration.
    Reproject,
    /// Every sample of every pixel by a ray of its own, in f64 on the CPU: the reference, slow.
    Oracle,
}

/// `[output]`: channels and file formats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSpec {
    /// What to write for each frame.
    pub channels: Vec<Channel>,
    /// File formats; empty renders and reads back without encoding.
    pub format: Vec<ImageFormat>,
    /// Which clock every written stamp is on.
    pub stamps: Stamps,
    /// With `stamps = "zero"`: what that clock shows at the beginning of the window, nanoseconds.
    pub epoch_ns: u64,
    /// Pixel type of EXR colour.
    pub exr_pixel: ExrPixel,
    /// EXR compression.
    pub exr_compression: ExrCompression,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            channels: vec![Channel::Color],
            format: vec![ImageFormat::Exr],
            stamps: Stamps::Log,
            epoch_ns: 0,
            exr_pixel: ExrPixel::Half,
            exr_compression: ExrCompression::Zip1,
        }
    }
}

/// Clocks of stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stamps {
    /// The log's own.
    #[default]
    Log,
    /// One that shows [`OutputSpec::epoch_ns`] at the beginning of `flight.window_s`.
    Zero,
}

impl OutputSpec {
    /// What written stamps show at path time 0, nanoseconds: there the log's clock shows `log_epoch_ns`, and
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

/// Things a frame can give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// The picture.
    Color,
    /// Planar depth at the row's mid-exposure, metres, 0 where nothing is.
    Depth,
    /// 1 where a ray exists.
    Valid,
    /// `rows.csv`: time, pose and velocity of each row.
    Rows,
    /// Ideal ray, source coordinate, time and world point of each pixel.
    Coords,
}

/// Image file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImageFormat {
    /// OpenEXR, linear, unquantised.
    Exr,
    /// PNG in the encoding of `camera.photometric.output`.
    Png,
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
    /// Stored.
    None,
    /// Run lengths.
    Rle,
    /// Deflate, one row a block.
    #[default]
    Zip1,
    /// Deflate, 16 rows a block.
    Zip16,
    /// Wavelet.
    Piz,
}

fn one() -> f64 {
    1.0
}
