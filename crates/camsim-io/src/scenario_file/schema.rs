//! The schema of scenario files: every key and the values it takes. A test compares it with the structs.
//! `frame_file` has the schema of FRAME.toml.

use std::borrow::Cow;

use camsim_core::{
    scenario::{
        LensModel, MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_FRAMES_PER_IDEAL, MAX_INSTANTS, MAX_ITERATIONS,
        MAX_SIDE_PX, PointSource, TracksSpec, VideoSpec,
    },
    temporal::SAMPLES,
};
use camsim_plan::MAX_KEYS;

use super::randomize::RANDOMIZE;
use super::similar::{MIN_KEY_SIMILARITY, similarity};

/// Keys of a file format, with what error messages say about them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Schema {
    /// Dotted keys, without indices of array elements.
    pub(crate) keys: &'static [(&'static str, ValueKind)],
    /// Required keys, each with the table within which it is required (`""` for the root).
    pub(crate) required: &'static [(&'static str, &'static str)],
    /// Hint in messages: where a user finds all keys.
    pub(crate) listing: &'static str,
}

/// Schema of scenarios, and of camera files below `camera`.
pub(crate) const SCENARIO: Schema =
    Schema { keys: KEYS, required: REQUIRED, listing: "`camsim render --print-default` lists all keys" };

/// The values that a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// A number.
    Number,
    /// A number, or one of these words.
    NumberOr(&'static [&'static str]),
    /// A whole number from 0, beyond 32 bits too.
    Whole,
    /// A whole number from the first to the last.
    Within(u32, u32),
    /// A whole number of at most 32 bits, or one of these words. The number here is the largest useful value,
    /// for the message; ranges are checked later.
    CountOr(u32, &'static [&'static str]),
    /// A list of this many numbers.
    Numbers(usize),
    /// `true` or `false`.
    Flag,
    /// A list of this many numbers, or this word.
    NumbersOr(usize, &'static str),
    /// A list of this many whole numbers of at most 32 bits. The second number is the largest useful value,
    /// for the message; ranges are checked later.
    Counts(usize, u32),
    /// A number, or a list of this many numbers.
    NumberOrNumbers(usize),
    /// A number, or a list of any number of numbers.
    NumberOrList,
    /// A list of any number of numbers.
    NumberList,
    /// A list of any number of lists of this many numbers.
    Points(usize),
    /// A path, resolved against the folder of the file that names it.
    Path,
    /// A path, or a list of paths.
    Paths,
    /// One of these words.
    Word(&'static [&'static str]),
    /// Any text.
    Text,
    /// A list of texts.
    Texts,
    /// A list of these words.
    Words(&'static [&'static str]),
    /// A table of names of the user's, each with a whole number from the first to the last.
    Numbered(u32, u32),
    /// One of these words or the path of a CSV table, or a list of them.
    WordsOrTables(&'static [&'static str]),
    /// An array of tables, whose keys are listed below the same dotted name.
    Tables,
}

use ValueKind::*;

/// Class of an object.
const CLASS: ValueKind = Within(1, u16::MAX as u32);
const AUTO: &[&str] = &["auto"];
/// Layouts of other programs.
const DATASETS: &[&str] = &[
    "euroc",
    "tum",
    "kitti",
    "colmap",
    "nerfstudio",
    "kalibr",
    "mcap",
    "carla-rs",
    "gopro",
    "webdataset",
    "flo",
];
/// Channels of frames and of their twins.
const CHANNELS: &[&str] = &[
    "color",
    "depth",
    "valid",
    "rows",
    "raw",
    "coords",
    "range",
    "normal",
    "normal_world",
    "object",
    "class",
    "coverage",
    "flow",
    "flow_back",
    "flow_global",
    "motion",
    "blur_path",
];
const SENSOR_AXES: &[&str] = &["frd", "flu", "rdf"];
const SENSOR_CARRIER: &[&str] = &["body", "camera"];
/// One value of all axes, or one of each.
const PER_AXIS: ValueKind = NumberOrNumbers(3);
const HEIGHT: &[&str] = &["ellipsoid", "msl"];

/// Keys of a scenario.
pub(super) const KEYS: &[(&str, ValueKind)] = &[
    ("seed", Whole),
    ("flight.log", Path),
    (
        "flight.format",
        Word(&[
            "auto",
            "csv-lla",
            "csv-xya",
            "csv-ned",
            "tum",
            "euroc",
            "gpx",
            "kml",
            "igc",
            "ulog",
            "dataflash",
            "mcap",
        ]),
    ),
    ("flight.time_unit", Word(&["auto", "s", "ms", "us", "ns", "min", "h"])),
    ("flight.angle_unit", Word(&["auto", "deg", "rad"])),
    ("flight.angles", Word(&["auto", "wrapped", "continuous"])),
    ("flight.attitude", Word(&["log", "track"])),
    ("flight.origin", NumbersOr(3, "first")),
    ("flight.height", Word(HEIGHT)),
    ("flight.height_from", Word(&["auto", "gnss", "pressure"])),
    ("flight.topic", Text),
    ("flight.window_s", Numbers(2)),
    ("flight.speed", Number),
    ("tracker.kind", Word(&["hold", "linear", "sqrt", "spline"])),
    ("tracker.rate_hz", Number),
    ("tracker.max_speed_m_s", NumberOr(AUTO)),
    ("tracker.max_acceleration_m_s2", NumberOr(AUTO)),
    ("tracker.max_angular_rate_deg_s", NumberOr(AUTO)),
    ("tracker.max_angular_acceleration_deg_s2", NumberOr(AUTO)),
    ("camera.name", Text),
    ("camera.size_px", Counts(2, MAX_SIDE_PX)),
    ("camera.focal_px", Numbers(2)),
    ("camera.principal_point_px", Numbers(2)),
    ("camera.fps", Number),
    ("camera.phase", Number),
    ("camera.clock_offset_ms", Number),
    ("camera.mount.angles_deg", Numbers(3)),
    ("camera.mount.offset_m", Numbers(3)),
    ("camera.mount.vibration", Tables),
    ("camera.mount.vibration.axis", Word(&["roll", "pitch", "yaw", "x", "y", "z"])),
    ("camera.mount.vibration.amplitude_deg", Number),
    ("camera.mount.vibration.amplitude_m", Number),
    ("camera.mount.vibration.hz", Number),
    ("camera.mount.vibration.phase_deg", Number),
    ("camera.lens.model", Word(&LensModel::NAMES)),
    ("camera.lens.coefficients", NumberList),
    ("camera.lens_table", Path),
    ("camera.zoom", Tables),
    ("camera.zoom.at", Number),
    ("camera.zoom.focal_px", Numbers(2)),
    ("camera.zoom.principal_point_px", Numbers(2)),
    ("camera.zoom.coefficients", NumberList),
    ("camera.zoom_track", Path),
    ("camera.shutter.delay_ms", Number),
    ("camera.shutter.readout_ms", Number),
    (
        "camera.shutter.readout",
        Word(&[
            "top-to-bottom",
            "bottom-to-top",
            "left-to-right",
            "right-to-left",
            "middle-outward",
            "edges-inward",
        ]),
    ),
    ("camera.shutter.exposure_ms", Number),
    ("camera.shutter.interlace_ms", NumberOr(&["field"])),
    ("camera.shutter.first_field", Word(&["even", "odd"])),
    ("camera.shutter.line_time_us", Number),
    ("camera.shutter.reset", Word(&["rolling", "global"])),
    ("camera.shutter.allow_overlap", Flag),
    ("camera.timing.jitter_ms", Number),
    ("camera.timing.drift_ppm", Number),
    ("camera.timing.late_ms", Number),
    ("camera.timing.late_stamp", Word(&["nominal", "actual"])),
    ("camera.timing.drop", NumberList),
    ("camera.timing.drop_probability", Number),
    ("camera.timing.double", NumberList),
    ("camera.timing.double_probability", Number),
    ("camera.timing.trigger", Text),
    ("camera.timing.miss", NumberList),
    ("camera.timing.miss_probability", Number),
    ("camera.timing.stamped_by", Word(&["camera", "trigger"])),
    ("camera.photometric.vignette", Path),
    ("camera.photometric.vignette_thresholds", Numbers(2)),
    ("camera.photometric.light", Number),
    ("camera.photometric.noise_sigma", Number),
    ("camera.photometric.output", Word(&["linear-f32", "linear-f16", "srgb8", "linear8", "luma8", "luma16"])),
    ("camera.sensor.model", Word(&["icx625", "imx174", "imx249", "imx250", "imx255", "imx273"])),
    ("camera.sensor.white_e", Number),
    ("camera.sensor.white_lux", Number),
    ("camera.sensor.white_w_m2", Number),
    ("camera.sensor.exposure_ms", Number),
    ("camera.sensor.f_number", Number),
    ("camera.sensor.lens_transmission", Number),
    ("camera.sensor.wavelength_nm", Number),
    ("camera.sensor.pixel_um", Number),
    ("camera.sensor.quantum_efficiency", NumberOrList),
    ("camera.sensor.spectral_matrix", Numbers(9)),
    ("camera.sensor.shot_noise", Flag),
    ("camera.sensor.dark_current_e_s", Number),
    ("camera.sensor.dark_reference_c", Number),
    ("camera.sensor.dark_doubling_c", Number),
    ("camera.sensor.temperature_c", Number),
    ("camera.sensor.read_noise_e", Number),
    ("camera.sensor.dsnu_e", Number),
    ("camera.sensor.prnu", Number),
    ("camera.sensor.row_noise_e", Number),
    ("camera.sensor.column_noise_e", Number),
    ("camera.sensor.row_offset_e", Number),
    ("camera.sensor.column_offset_e", Number),
    ("camera.sensor.hot_pixels", Number),
    ("camera.sensor.hot_e_s", Number),
    ("camera.sensor.dead_pixels", Number),
    ("camera.sensor.full_well_e", Number),
    ("camera.sensor.gain_e_per_dn", Number),
    ("camera.sensor.black_dn", Number),
    ("camera.sensor.adc_bits", Within(8, 16)),
    ("camera.sensor.bits", Within(8, 16)),
    ("camera.sensor.companding", Word(&["none", "sqrt", "piecewise"])),
    ("camera.sensor.companding_points", Points(2)),
    ("camera.sensor.mosaic", Word(&["none", "mono", "rggb", "bggr", "grbg", "gbrg", "rgbw"])),
    ("camera.sensor.demosaic", Word(&["bilinear", "malvar"])),
    ("camera.sensor.white_balance", Numbers(3)),
    ("camera.sensor.color_matrix", Numbers(9)),
    ("camera.sensor.response", Word(&["linear", "srgb", "gamma", "table"])),
    ("camera.sensor.gamma", Number),
    ("camera.sensor.response_points", Points(2)),
    ("camera.sensor.flicker.hz", Number),
    ("camera.sensor.flicker.depth", Number),
    ("camera.sensor.flicker.wave", Word(&["sine", "pulse"])),
    ("camera.sensor.flicker.duty", Number),
    ("camera.sensor.flicker.phase_deg", Number),
    ("camera.auto_exposure.window", Numbers(4)),
    ("camera.auto_exposure.weights", Word(&["even", "centre"])),
    ("camera.auto_exposure.target", Number),
    ("camera.auto_exposure.exposure_ms", Numbers(2)),
    ("camera.auto_exposure.gain", Numbers(2)),
    ("camera.auto_exposure.speed", Number),
    ("camera.auto_exposure.delay", Within(1, 1000)),
    ("camera.auto_exposure.first", Word(&["exposure", "gain"])),
    ("camera.auto_exposure.start", Word(&["settled", "nominal"])),
    ("camera.auto_exposure.nominal_ms", Number),
    ("camera.point_spread.sigma_px", Number),
    ("camera.point_spread.f_number", Number),
    ("camera.point_spread.pixel_um", Number),
    ("camera.point_spread.wavelength_nm", NumberOrList),
    ("camera.point_spread.defocus_px", Number),
    ("camera.point_spread.kernel", Path),
    ("camera.point_spread.kernel_oversampling", Within(1, 64)),
    ("camera.point_spread.glare", Number),
    ("camera.chromatic.red_scale", NumberList),
    ("camera.chromatic.blue_scale", NumberList),
    ("camera.chromatic.red.focal_px", Numbers(2)),
    ("camera.chromatic.red.principal_point_px", Numbers(2)),
    ("camera.chromatic.red.model", Word(&LensModel::NAMES)),
    ("camera.chromatic.red.coefficients", NumberList),
    ("camera.chromatic.blue.focal_px", Numbers(2)),
    ("camera.chromatic.blue.principal_point_px", Numbers(2)),
    ("camera.chromatic.blue.model", Word(&LensModel::NAMES)),
    ("camera.chromatic.blue.coefficients", NumberList),
    ("camera.image_circle.radius_px", Number),
    ("camera.image_circle.centre_px", Numbers(2)),
    ("camera.image_circle.half_angle_deg", Number),
    ("camera.resized.crop_px", Counts(4, MAX_SIDE_PX)),
    ("camera.resized.binning", NumberOrNumbers(2)),
    ("camera.resized.scale", Number),
    ("camera.resized.size_px", Counts(2, MAX_SIDE_PX)),
    ("camera.files_of.size_px", Counts(2, MAX_SIDE_PX)),
    ("camera.files_of.focal_px", Numbers(2)),
    ("camera.files_of.principal_point_px", Numbers(2)),
    ("camera.files_of.part_px", Numbers(4)),
    ("camera.photometric.vignetting.cos_power", Number),
    ("camera.photometric.vignetting.polynomial", NumberList),
    ("camera.photometric.vignetting.polynomial_red", NumberList),
    ("camera.photometric.vignetting.polynomial_blue", NumberList),
    ("scene.terrain.dem", Paths),
    ("scene.terrain.ortho", Paths),
    ("scene.terrain.height", Word(HEIGHT)),
    ("scene.terrain.epsg", Within(0, u16::MAX as u32)),
    ("scene.terrain.height_unit", Word(&["m", "ft", "us-ft", "dm", "cm", "mm"])),
    ("scene.terrain.ortho_white", Number),
    ("scene.terrain.beyond", Word(&["grey", "edge", "void"])),
    ("scene.terrain.name", Text),
    ("scene.terrain.class", CLASS),
    ("scene.pattern.image", Path),
    ("scene.pattern.width_m", Number),
    ("scene.pattern.at", NumbersOr(3, "origin")),
    ("scene.pattern.name", Text),
    ("scene.pattern.class", CLASS),
    ("scene.pattern.repeat", Flag),
    ("scene.board.target", Path),
    ("scene.board.kind", Word(&["chessboard", "circles", "asymmetric-circles", "aprilgrid", "charuco"])),
    ("scene.board.columns", Within(1, 80)),
    ("scene.board.rows", Within(1, 80)),
    ("scene.board.size_m", Number),
    ("scene.board.row_size_m", Number),
    ("scene.board.diameter_m", Number),
    ("scene.board.spacing", Number),
    ("scene.board.marker_m", Number),
    ("scene.board.dictionary", Word(&["4x4", "5x5", "6x6"])),
    ("scene.board.first_id", Within(0, 586)),
    ("scene.board.margin_m", Number),
    ("scene.board.at", NumbersOr(3, "origin")),
    ("scene.board.geodetic", Numbers(3)),
    ("scene.board.angles_deg", Numbers(3)),
    ("scene.board.name", Text),
    ("scene.board.class", CLASS),
    ("scene.gltf", Tables),
    ("scene.gltf.file", Path),
    ("scene.gltf.at", NumbersOr(3, "origin")),
    ("scene.gltf.geodetic", Numbers(3)),
    ("scene.gltf.placements", Path),
    ("scene.gltf.heading_deg", Number),
    ("scene.gltf.scale", Number),
    ("scene.gltf.on_ground", Flag),
    ("scene.gltf.scene", Within(0, u32::MAX)),
    ("scene.gltf.time_s", Number),
    ("scene.gltf.animation", Within(0, u32::MAX)),
    ("scene.gltf.name", Text),
    ("scene.gltf.class", CLASS),
    ("scene.gltf.objects", Word(&["placement", "node", "material"])),
    ("scene.gltf.classes", Numbered(1, u16::MAX as u32)),
    ("scene.gltf.motion.poses", Path),
    ("scene.gltf.motion.path", Points(3)),
    ("scene.gltf.motion.speed_m_s", Number),
    ("scene.gltf.motion.start_s", Number),
    ("scene.gltf.motion.loop", Word(&["once", "repeat", "back-and-forth"])),
    ("scene.gltf.motion.orient", Flag),
    ("scene.gltf.motion.spin", Tables),
    ("scene.gltf.motion.spin.axis", Numbers(3)),
    ("scene.gltf.motion.spin.hz", Number),
    ("scene.gltf.motion.spin.phase_deg", Number),
    ("scene.gltf.motion.spin.node", Text),
    ("scene.gltf.motion.animate", Flag),
    ("scene.sky", Numbers(3)),
    ("scene.sky_brightness", Number),
    ("scene.fog_visibility_m", Number),
    ("scene.light.sun_azimuth_deg", Number),
    ("scene.light.sun_elevation_deg", Number),
    ("scene.light.sun", Number),
    ("scene.light.sky", Number),
    ("scene.light.shadows", Flag),
    ("quality.preset", Word(&["default", "paper"])),
    ("quality.max_error_px", Number),
    ("quality.max_error_dn", Number),
    ("quality.max_terrain_error_px", Number),
    ("quality.solver", Word(&["auto", "linear", "rk2", "reproject", "oracle"])),
    ("quality.iterations", CountOr(MAX_ITERATIONS, AUTO)),
    ("quality.blur_samples", CountOr(MAX_BLUR_SAMPLES, AUTO)),
    ("quality.footprint_taps", CountOr(MAX_FOOTPRINT_TAPS, AUTO)),
    ("quality.ideal_scale", NumberOr(AUTO)),
    ("quality.ideal_samples", CountOr(SAMPLES, AUTO)),
    ("quality.key_frames", CountOr(MAX_KEYS, AUTO)),
    ("quality.frames_per_ideal", Within(1, MAX_FRAMES_PER_IDEAL)),
    ("quality.silhouettes", Word(&["auto", "plain", "rays"])),
    ("output.channels", Words(CHANNELS)),
    ("output.format", Words(&["exr", "png", "mp4", "mkv", "y4m"])),
    ("output.stamps", Word(&["log", "zero"])),
    ("output.epoch_ns", Whole),
    ("output.trajectory", Word(&["frames", "flight"])),
    ("output.datasets", Words(DATASETS)),
    ("output.exr_pixel", Word(&["half", "float"])),
    ("output.exr_compression", Word(&["none", "rle", "zip1", "zip16", "piz"])),
    ("output.raw_format", Word(&["png", "tiff", "exr"])),
    ("output.video.codec", Word(&["h264", "h265", "ffv1"])),
    ("output.video.bits", Within(8, 10)),
    ("output.video.crf", Within(0, VideoSpec::WORST_CRF)),
    ("output.flow_step", Within(1, u32::MAX)),
    ("output.flow_instant", Word(&["first-row", "centre", "last-row"])),
    ("output.palette", Flag),
    ("output.tracks.points", WordsOrTables(&PointSource::WORDS)),
    ("output.tracks.count", Within(1, TracksSpec::MOST_POINTS)),
    ("output.twin", Tables),
    ("output.twin.name", Text),
    ("output.twin.exposure", Flag),
    ("output.twin.shutter", Word(&["global"])),
    ("output.twin.instant", Word(&["first-row", "centre", "last-row"])),
    ("output.twin.lens", Flag),
    ("output.twin.noise", Flag),
    ("output.twin.vignette", Flag),
    ("output.twin.ideal", Flag),
    ("output.twin.instants", Within(1, MAX_INSTANTS)),
    ("output.twin.over", Word(&["exposure", "readout"])),
    ("output.twin.channels", Words(CHANNELS)),
    ("output.twin.point_spread", Flag),
    ("imu", Tables),
    ("imu.name", Text),
    ("imu.rate_hz", Number),
    ("imu.mount.angles_deg", Numbers(3)),
    ("imu.mount.offset_m", Numbers(3)),
    ("imu.attached_to", Word(SENSOR_CARRIER)),
    ("imu.axes", Word(SENSOR_AXES)),
    ("imu.earth_rate", Flag),
    ("imu.gyro.noise_density", PER_AXIS),
    ("imu.gyro.random_walk", PER_AXIS),
    ("imu.gyro.bias", PER_AXIS),
    ("imu.gyro.bias_sigma", PER_AXIS),
    ("imu.gyro.drift_sigma", PER_AXIS),
    ("imu.gyro.drift_tau_s", Number),
    ("imu.gyro.scale", PER_AXIS),
    ("imu.gyro.misalignment_deg", Numbers(6)),
    ("imu.gyro.quantisation", PER_AXIS),
    ("imu.gyro.range", PER_AXIS),
    ("imu.accel.noise_density", PER_AXIS),
    ("imu.accel.random_walk", PER_AXIS),
    ("imu.accel.bias", PER_AXIS),
    ("imu.accel.bias_sigma", PER_AXIS),
    ("imu.accel.drift_sigma", PER_AXIS),
    ("imu.accel.drift_tau_s", Number),
    ("imu.accel.scale", PER_AXIS),
    ("imu.accel.misalignment_deg", Numbers(6)),
    ("imu.accel.quantisation", PER_AXIS),
    ("imu.accel.range", PER_AXIS),
    ("imu.g_sensitivity", PER_AXIS),
    ("imu.clock_offset_ms", Number),
    ("imu.jitter_ms", Number),
    ("gnss", Tables),
    ("gnss.name", Text),
    ("gnss.rate_hz", Number),
    ("gnss.offset_m", Numbers(3)),
    ("gnss.sigma_m", Numbers(2)),
    ("gnss.drift_m", Numbers(2)),
    ("gnss.drift_tau_s", Number),
    ("gnss.velocity_sigma_m_s", Numbers(2)),
    ("gnss.dropouts_s", Points(2)),
    ("gnss.dropout_every_s", Number),
    ("gnss.dropout_mean_s", Number),
    ("gnss.delay_ms", Number),
    ("gnss.clock_offset_ms", Number),
    ("gnss.jitter_ms", Number),
    ("barometer", Tables),
    ("barometer.name", Text),
    ("barometer.rate_hz", Number),
    ("barometer.offset_m", Numbers(3)),
    ("barometer.sea_level_pa", Number),
    ("barometer.bias_pa", Number),
    ("barometer.sigma_pa", Number),
    ("barometer.drift_pa", Number),
    ("barometer.drift_tau_s", Number),
    ("barometer.quantisation_pa", Number),
    ("barometer.clock_offset_ms", Number),
    ("barometer.jitter_ms", Number),
    ("magnetometer", Tables),
    ("magnetometer.name", Text),
    ("magnetometer.rate_hz", Number),
    ("magnetometer.mount.angles_deg", Numbers(3)),
    ("magnetometer.mount.offset_m", Numbers(3)),
    ("magnetometer.axes", Word(SENSOR_AXES)),
    ("magnetometer.field_ned_ut", Numbers(3)),
    ("magnetometer.date", Text),
    ("magnetometer.hard_iron_ut", Numbers(3)),
    ("magnetometer.soft_iron", Numbers(9)),
    ("magnetometer.sigma_ut", PER_AXIS),
    ("magnetometer.quantisation_ut", Number),
    ("magnetometer.range_ut", Number),
    ("magnetometer.clock_offset_ms", Number),
    ("magnetometer.jitter_ms", Number),
];

/// Names that other programs have for keys.
const OTHER_NAMES: [(&str, &str); 6] = [
    ("resolution", "camera.size_px"),
    ("image_size", "camera.size_px"),
    ("focal_length", "camera.focal_px"),
    ("principal_point", "camera.principal_point_px"),
    ("exposure_time", "camera.shutter.exposure_ms"),
    ("line_delay", "camera.shutter.line_time_us"),
];

/// Required keys, each with the table within which it is required.
pub(super) const REQUIRED: &[(&str, &str)] = &[
    ("flight.log", ""),
    ("scene", ""),
    ("scene.terrain.dem", "scene.terrain"),
    ("scene.pattern.image", "scene.pattern"),
    ("scene.pattern.width_m", "scene.pattern"),
    ("scene.gltf.file", "scene.gltf"),
    ("scene.gltf.motion.spin.axis", "scene.gltf.motion.spin"),
    ("scene.gltf.motion.spin.hz", "scene.gltf.motion.spin"),
    ("camera.mount.vibration.axis", "camera.mount.vibration"),
    ("camera.mount.vibration.hz", "camera.mount.vibration"),
    ("camera.zoom.at", "camera.zoom"),
    ("output.tracks.points", "output.tracks"),
    ("camera.zoom.focal_px", "camera.zoom"),
    ("camera.files_of.size_px", "camera.files_of"),
    ("camera.files_of.focal_px", "camera.files_of"),
    ("camera.files_of.principal_point_px", "camera.files_of"),
    ("camera.files_of.part_px", "camera.files_of"),
    ("output.twin.name", "output.twin"),
    ("imu.name", "imu"),
    ("gnss.name", "gnss"),
    ("barometer.name", "barometer"),
    ("magnetometer.name", "magnetometer"),
    ("cameras.name", CAMERAS),
];

/// The list of cameras of a rig. Its elements have the keys of `camera`.
pub const CAMERAS: &str = "cameras";
/// A camera file below an element's own keys.
const CAMERA_FILE: &str = "cameras.file";

/// The key of `camera` that a key of `cameras`, without index, is like; other keys as they are.
pub(super) fn like_camera(key: &str) -> Cow<'_, str> {
    match key.strip_prefix(CAMERAS).and_then(|rest| rest.strip_prefix('.')) {
        Some(rest) => format!("camera.{rest}").into(),
        None => key.into(),
    }
}

impl ValueKind {
    /// Whether a text at a key of this kind is a path.
    #[must_use]
    pub fn is_path(self, text: &str) -> bool {
        match self {
            Path | Paths => true,
            WordsOrTables(words) => !words.contains(&text),
            _ => false,
        }
    }
}

impl Schema {
    /// The values that `key` takes; `None` if it is unknown.
    pub(crate) fn kind(&self, key: &str) -> Option<ValueKind> {
        match key {
            CAMERAS if self.keys == KEYS => return Some(Tables),
            CAMERA_FILE if self.keys == KEYS => return Some(Path),
            _ => {}
        }
        let key = like_camera(key);
        self.keys.iter().find(|(name, _)| *name == key).map(|(_, kind)| *kind)
    }

    /// Whether `key` is a table of the schema (`camera.lens`).
    pub(crate) fn is_table(&self, key: &str) -> bool {
        let key = like_camera(key);
        key.is_empty()
            || self
                .keys
                .iter()
                .any(|(name, _)| name.strip_prefix(&*key).is_some_and(|rest| rest.starts_with('.')))
    }

    /// Whether the last part of an unknown key is the name of a value that stands outside of all tables.
    pub(crate) fn is_outside_tables(&self, key: &str) -> bool {
        let Some((_, leaf)) = key.rsplit_once('.') else { return false };
        let is_value = |&(name, kind): &(&str, ValueKind)| name == leaf && kind != Tables;
        self.keys == KEYS && (["camera", "cameras"].contains(&leaf) || self.keys.iter().any(is_value))
    }

    /// The known key most similar to `key`, for "did you mean". Siblings are preferred, but a key of another
    /// table may win.
    pub(crate) fn nearest(&self, key: &str) -> Option<String> {
        let near = self.nearest_like(&like_camera(key))?;
        match near.strip_prefix("camera.").filter(|_| key.starts_with("cameras.")) {
            Some(rest) => Some(format!("cameras.{rest}")),
            None => Some(near),
        }
    }

    /// [`Self::nearest`] for keys of one camera.
    fn nearest_like(&self, key: &str) -> Option<String> {
        let (parent, leaf) = key.rsplit_once('.').unwrap_or(("", key));
        if let Some((_, own)) = OTHER_NAMES.iter().find(|(other, _)| *other == leaf) {
            return self.kind(own).map(|_| (*own).to_owned());
        }
        let mut names: Vec<&str> = Vec::new();
        if self.keys == KEYS {
            names.push(RANDOMIZE);
        }
        for (name, _) in self.keys {
            names.extend(name.match_indices('.').map(|(end, _)| &name[..end]));
            names.push(name);
        }
        let score = |name: &&str| {
            let (its_parent, its_leaf) = name.rsplit_once('.').unwrap_or(("", name));
            let similarity = similarity(leaf, its_leaf);
            if its_parent == parent { similarity + 0.15 } else { similarity }
        };
        // Several tables have names such as exposure_ms. Of a parent that is no table the more similar table decides;
        // else a key below the parent is meant, and the first of them is the usual one.
        let is_known_parent = self.is_table(parent);
        let of_table = |name: &str| match is_known_parent {
            true => f64::from(u8::from(name.strip_prefix(parent).is_some_and(|rest| rest.starts_with('.')))),
            false => similarity(parent, name.rsplit_once('.').map_or("", |(table, _)| table)),
        };
        let order = |(i, a): &(usize, &str), (k, b): &(usize, &str)| {
            score(a).total_cmp(&score(b)).then_with(|| of_table(a).total_cmp(&of_table(b))).then(k.cmp(i))
        };
        let (_, best) = names.into_iter().enumerate().max_by(order)?;
        (score(&best) > MIN_KEY_SIMILARITY).then(|| best.to_owned())
    }
}
