//! The scenario: one plain struct, edited by TOML files, `--set`, the command line and the viewer.
//!
//! Every key has a default except `flight.log` and the scene. Angles are in degrees only where the key ends
//! in `_deg`; lengths are in metres, times in seconds or `_ms`. Paths are as written in the file until the
//! loader resolves them.
//!
//! Each field carries the facts of its key: description, unit, interval, default, example ([`keys`]). The schema,
//! the checks of values, the viewer's fields and the reference pages are made from them.

#![warn(missing_docs)]

// The macros name this crate by its path, here too.
extern crate self as camsim_scenario;

use serde::{Deserialize, Serialize};

mod auto;
mod auto_exposure;
mod camera;
mod channel;
mod dataset;
mod face;
mod file_list;
mod flight;
mod image_sensor;
mod key_values;
pub mod keys;
mod limits;
mod loaded_file;
mod motion;
mod optics;
mod output;
mod point_spread;
mod problem;
mod quality;
mod resized;
mod rig;
mod scene;
mod sensors;
mod timing;
mod tracker;
mod tracks;
mod twin;
mod video;

pub use auto::{Auto, FieldOr};
pub use auto_exposure::{AutoExposureSpec, ExposureOrder, ExposureStart, MeterWeights};
pub use camera::{
    Axis, CameraSpec, LensModel, LensSpec, MountSpec, OutputEncoding, Parity, PhotometricSpec, Readout,
    Reset, ShutterSpec, VibrationSpec, ZoomSpec,
};
pub use channel::{
    CHANNELS, Channel, ChannelFacts, ChannelSource, Check, Colors, FlowInstant, FlowState, PlaneKind,
};
pub use dataset::DatasetFormat;
pub use face::Face;
pub use file_list::FileList;
pub use flight::{
    AngleKind, AngleUnit, AttitudeSource, FlightHeight, FlightSpec, HeightSource, LogFormat, Origin, TimeUnit,
};
pub use image_sensor::{
    Companding, Demosaic, FlickerSpec, FlickerWave, ImageSensorSpec, Mosaic, PerChannel, ResponseCurve,
    SensorModel,
};
pub use limits::{
    IDEAL_SAMPLES, MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_FRAMES_PER_IDEAL, MAX_ITERATIONS,
    MAX_KEY_FRAMES, MAX_SIDE_PX,
};
pub use loaded_file::LoadedFile;
pub use motion::{LoopKind, MotionSpec, SpinSpec};
pub use optics::{ChromaticSpec, ImageCircleSpec, Primary, PrimaryLensSpec, VignettingSpec};
pub use output::{ExrCompression, ExrPixel, OutputSpec, Stamps, TrajectorySpan};
pub use point_spread::PointSpreadSpec;
pub use problem::Problem;
pub use quality::{Preset, QualitySpec, Silhouettes, Solver};
pub use resized::{Binning, FilesOfSpec, MadeOf, ResizedSpec};
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
pub use tracker::{PAPER_ACCELERATION_M_S2, PAPER_ANGULAR_ACCELERATION_DEG_S2, TrackerKind, TrackerSpec};
pub use tracks::{PointSource, TracksSpec};
pub use twin::{BurstOver, MAX_INSTANTS, TwinShutter, TwinSpec};
pub use video::{ImageFormat, RawFormat, VideoCodec, VideoSpec};

use keys::Table;

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
}

/// Whether a value is that of its type, so that files leave it out.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
