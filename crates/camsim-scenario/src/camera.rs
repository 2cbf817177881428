//! `[camera]`, which is also the content of a CAMERA.toml.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{
    AutoExposureSpec, ChromaticSpec, Face, FieldOr, FilesOfSpec, ImageCircleSpec, ImageSensorSpec,
    LoadedFile, MAX_SIDE_PX, MadeOf, PointSpreadSpec, Primary, ResizedSpec, TimingSpec, VignettingSpec,
    keys::{Table, Words},
};

/// Largest offset of a camera's or sensor's clock, 127 years: stamps of this century stay within 64 bits.
pub(crate) const MAX_CLOCK_OFFSET_MS: f64 = 4e12;
pub(crate) const CLOCK_HINT: &str = "it is how much this clock is ahead";

/// The camera: geometry, lens, shutter and photometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSpec {
    /// Name of the camera. It is part of the seed of the noise, so that several cameras have different noise.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Width and height of the picture.
    #[key(
        default = [640, 480],
        unit = "px",
        min = 1,
        max = MAX_SIDE_PX,
        hint = "give [width, height]",
        names = "W H"
    )]
    pub size_px: [u32; 2],
    /// Focal lengths f_x, f_y.
    #[key(
        default = [500.0, 500.0],
        unit = "px",
        step = 0.5,
        above = 0.0,
        hint = "a 60 degree lens on 640 px has about 554",
        names = "fx fy"
    )]
    pub focal_px: [f64; 2],
    /// Principal point c_x, c_y; (0, 0) is the centre of the top-left pixel. Omitted: the image centre,
    /// ((W-1)/2, (H-1)/2).
    #[key(unit = "px", step = 0.1, example = "[319.5, 239.5]", names = "cx cy")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Frames per second.
    #[key(
        default = 30.0,
        unit = "1/s",
        step = 0.1,
        above = 0.0,
        hint = "give frames per second, for example 30"
    )]
    pub fps: f64,
    /// Shift of every frame, its exposure and its stamp, as a fraction of the frame period.
    #[key(unit = "frames", step = 0.01)]
    pub phase: f64,
    /// Lead of the camera's clock over the platform's. It is added to every stamp that the camera writes;
    /// poses stay those of the true instants.
    #[key(unit = "ms", step = 0.1, within = MAX_CLOCK_OFFSET_MS, hint = CLOCK_HINT)]
    #[serde(skip_serializing_if = "crate::is_default")]
    pub clock_offset_ms: f64,
    /// Position and orientation on the platform.
    pub mount: MountSpec,
    /// Distortion of the lens.
    pub lens: LensSpec,
    /// File of the points of a lens of model "table": CSV of rays and points, or STmap (EXR).
    #[key(example = "\"lens.csv\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_table: Option<LoadedFile>,
    /// Calibrations by zoom value, sorted by ascending `at`. They need `camera.zoom_track`. Omitted: a fixed
    /// lens.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zoom: Vec<ZoomSpec>,
    /// CSV file with columns t_s,zoom: zoom value over log time. It is linear between rows and constant
    /// beyond the ends, and goes with tables of `camera.zoom`.
    #[key(example = "\"zoom.csv\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zoom_track: Option<PathBuf>,
    /// The part of a wide field that this camera is for, where it is one of several ([`Face`]); files have
    /// whole cameras.
    #[serde(skip)]
    pub face: Option<Face>,
    /// Exposure times of the rows.
    pub shutter: ShutterSpec,
    /// Vignette, light, noise and output encoding.
    pub photometric: PhotometricSpec,
    /// Image sensor, instead of `light` and `noise_sigma` of `camera.photometric`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<ImageSensorSpec>,
    /// Exposure that follows the pictures, instead of that of `camera.shutter`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto_exposure: Option<AutoExposureSpec>,
    /// Faults of trigger, stamps and delivery.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingSpec>,
    /// Picture that the lens makes of a point of light. Omitted: a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<PointSpreadSpec>,
    /// Lenses of red and blue light. Omitted: all light has the lens of `camera.lens`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chromatic: Option<ChromaticSpec>,
    /// Circle of the picture that the lens shows. Omitted: all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_circle: Option<ImageCircleSpec>,
    /// Part and scale of the picture that the camera delivers. The other keys describe the whole picture, and
    /// are adapted when the file is read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resized: Option<ResizedSpec>,
    /// Picture that the files of `lens_table` and `vignette` are of. Omitted: the camera's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub files_of: Option<FilesOfSpec>,
    /// The primary that this camera is for, where it is one of three ([`CameraSpec::of_primary`]); files have
    /// whole cameras.
    #[serde(skip)]
    pub primary: Option<Primary>,
    /// What `resized` has made it of, for those who judge its values.
    #[serde(skip)]
    pub made_of: MadeOf,
}

impl CameraSpec {
    /// [`Self::clock_offset_ms`] in whole nanoseconds.
    #[must_use]
    pub fn clock_offset_ns(&self) -> i64 {
        (self.clock_offset_ms * 1e6).round() as i64
    }

    /// Exposure time that makes the scene's white white: the shutter's, unless automatic exposure has
    /// another.
    #[must_use]
    pub fn nominal_exposure_ms(&self) -> f64 {
        let own = self.auto_exposure.as_ref().and_then(|auto| auto.nominal_ms);
        own.unwrap_or(self.shutter.exposure_ms)
    }

    /// Readout time, milliseconds: [`ShutterSpec::readout_ms_of`] this camera's picture.
    #[must_use]
    pub fn readout_ms(&self) -> f64 {
        self.shutter.readout_ms_of(self.size_px)
    }
}

/// Position and orientation of the camera on the platform.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct MountSpec {
    /// Roll, pitch, yaw of the camera on the platform (ZYX). At 0 it looks along the nose, at pitch -90
    /// straight down (eqs. 3-5).
    #[key(unit = "deg", step = 0.1, names = "roll pitch yaw")]
    pub angles_deg: [f64; 3],
    /// Lever arm in body axes: forward, right, down. See eqs. 3-5.
    #[key(unit = "m", step = 0.01, names = "fwd right down")]
    pub offset_m: [f64; 3],
    /// Vibrations: sinusoids added to the mount, as many as you like.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vibration: Vec<VibrationSpec>,
}

/// Sinusoid `amplitude * sin(2 pi hz t + phase)` about or along one body axis, before the mount.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct VibrationSpec {
    /// Axis of rotation (with `amplitude_deg`) or translation (with `amplitude_m`).
    #[key(required, default = Axis::Roll, example = "\"pitch\"")]
    pub axis: Axis,
    /// Amplitude of a rotation.
    #[key(unit = "deg", step = 0.005, example = "0.05")]
    pub amplitude_deg: f64,
    /// Amplitude of a translation.
    #[key(unit = "m", step = 0.001)]
    pub amplitude_m: f64,
    /// Frequency.
    #[key(
        required,
        unit = "Hz",
        step = 0.2,
        min = 0.0,
        hint = "give the frequency in hertz",
        example = "80.0"
    )]
    pub hz: f64,
    /// Phase at the log's first good row, for any `flight.window_s`.
    #[key(unit = "deg")]
    pub phase_deg: f64,
}

/// Degrees of freedom of the mount.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Rotation about body x (forward).
    Roll,
    /// Rotation about body y (right).
    Pitch,
    /// Rotation about body z (down).
    Yaw,
    /// Translation forward.
    X,
    /// Translation right.
    Y,
    /// Translation down.
    Z,
}

/// Model and coefficients of the lens: docs/reference/LENSES.md.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct LensSpec {
    /// Lens model. "brown-conrady" is the paper's (eqs. 8 and 9).
    pub model: LensModel,
    /// Coefficients in the order of the model. Trailing ones may be omitted.
    #[key(step = 0.001, example = "[-0.28, 0.07]")]
    pub coefficients: Vec<f64>,
}

/// Lens models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum LensModel {
    /// No distortion.
    #[default]
    Pinhole,
    /// Radial (polynomial or rational) and tangential, as in OpenCV: k1 k2 p1 p2 k3 k4 k5 k6.
    BrownConrady,
    /// Equidistant fisheye polynomial, as in OpenCV's fisheye module: k1 k2 k3 k4.
    KannalaBrandt,
    /// Brown-Conrady with thin prism and tilted sensor, OpenCV's 12 and 14 coefficients. In order: k1 k2 p1
    /// p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y.
    BrownConradyPrism,
    /// Fisheye with six radial, two tangential, four thin-prism terms: k0 to k5, p0 p1, s0 to s3. COLMAP's
    /// RAD_TAN_THIN_PRISM_FISHEYE.
    Fisheye624,
    /// Distorted radius as a polynomial of the angle off axis: k1 to k5, c d e max_angle.
    FTheta,
    /// Angle off axis as a polynomial of the distorted radius: k1 to k5, c d e max_angle.
    FThetaInverse,
    /// Two spheres and a plane: xi alpha.
    DoubleSphere,
    /// Extended unified camera model, an ellipsoid and a plane: alpha beta.
    Eucm,
    /// Unified camera model, a sphere and a plane: alpha.
    Ucm,
    /// A sphere with Brown-Conrady distortion: xi k1 k2 p1 p2. OpenCV's omnidir, CamOdoCal's MEI, Kalibr's
    /// omni-radtan.
    Mei,
    /// Undistorted over distorted radius is `1 / (1 + k r^2)`: k.
    Division,
    /// Distorted radius proportional to the angle, by a field of view: omega.
    Fov,
    /// Longitude and latitude: a panorama.
    Equirectangular,
    /// A table of points, the file of `camera.lens_table`.
    Table,
}

/// Calibration at one zoom value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ZoomSpec {
    /// Zoom value of this calibration.
    #[key(required, step = 0.01, example = "1.0")]
    pub at: f64,
    /// Focal lengths at this zoom value.
    #[key(
        required,
        unit = "px",
        step = 0.5,
        above = 0.0,
        hint = "a 60 degree lens on 640 px has about 554",
        example = "[500.0, 500.0]",
        names = "fx fy"
    )]
    pub focal_px: [f64; 2],
    /// Principal point at this zoom value. Omitted: the image centre.
    #[key(unit = "px", step = 0.1, example = "[319.5, 239.5]", names = "cx cy")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Distortion coefficients at this zoom value, in the order of the lens model.
    #[key(step = 0.001, example = "[-0.28, 0.07]")]
    pub coefficients: Vec<f64>,
}

/// Exposure times of the rows (paper section 6).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ShutterSpec {
    /// Time from the mid-exposure of the image's centre to the stamp: the paper's -t_d.
    #[key(unit = "ms", step = 0.2, min = 0.0, hint = "it is the age of the image centre at its stamp")]
    pub delay_ms: f64,
    /// Rolling shutter: time from the first row to the last, t_r.
    #[key(unit = "ms", step = 0.2, min = 0.0, hint = "reverse the direction with camera.shutter.readout")]
    pub readout_ms: f64,
    /// Direction of the readout.
    pub readout: Readout,
    /// Exposure time t_e, centred at each row's time: motion blur. See eq. 20.
    #[key(unit = "ms", step = 0.1, min = 0.0, hint = "0 is an instant")]
    pub exposure_ms: f64,
    /// Lag t_i between the two fields. "field" is half a frame period, 500/fps (eq. 21).
    #[key(
        default = FieldOr::Ms(0.0),
        unit = "ms",
        step = 0.2,
        min = 0.0,
        hint = "choose the earlier rows with camera.shutter.first_field"
    )]
    pub interlace_ms: FieldOr,
    /// Rows of the earlier field, counted from 0.
    pub first_field: Parity,
    /// Time from a row to the next, instead of `readout_ms`. It need not be a part of the frame's period.
    #[key(
        unit = "us",
        step = 0.1,
        min = 0.0,
        hint = "reverse the direction with camera.shutter.readout",
        example = "22.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_time_us: Option<f64>,
    /// Begin of the rows' exposures: one by one or at once.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub reset: Reset,
    /// Whether the readout may be longer than the period of a frame.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub allow_overlap: bool,
}

/// Begin of the rows' exposures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Reset {
    /// Each row begins as long before its readout as all others.
    #[default]
    Rolling,
    /// All rows begin at once and end at their readout. `exposure_ms` is the exposure of the row that is read
    /// first; that of each next one is longer by the time from row to row.
    Global,
}

impl ShutterSpec {
    /// Time from the first row that is read to the last, milliseconds, of a picture of this size, by
    /// `readout_ms` or `line_time_us`.
    #[must_use]
    pub fn readout_ms_of(&self, [width, height]: [u32; 2]) -> f64 {
        let lines = match self.readout {
            Readout::LeftToRight | Readout::RightToLeft => f64::from(width),
            Readout::TopToBottom | Readout::BottomToTop => f64::from(height),
            Readout::MiddleOutward | Readout::EdgesInward => 0.5 * f64::from(height),
        };
        self.line_time_us.map_or(self.readout_ms, |us| 1e-3 * us * lines)
    }
}

/// Rows of a field, counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Parity {
    /// The even rows: 0, 2, 4.
    #[default]
    Even,
    /// The odd rows: 1, 3, 5.
    Odd,
}

/// Readout directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Readout {
    /// First row first.
    #[default]
    TopToBottom,
    /// Last row first.
    BottomToTop,
    /// First column first.
    LeftToRight,
    /// Last column first.
    RightToLeft,
    /// Both halves at once, the middle rows first.
    MiddleOutward,
    /// Both halves at once, the outer rows first.
    EdgesInward,
}

/// Vignette, light, noise and output encoding (paper section 7).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct PhotometricSpec {
    /// Vignette map v: an image, stretched bilinearly over the picture.
    #[key(example = "\"vignette.png\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignette: Option<PathBuf>,
    /// Thresholds t1, t2 of the map. The weight of a pixel is 0 where v < t1, else min(v / t2, 1).
    #[key(
        default = [0.05, 0.5],
        step = 0.005,
        min = 0.0,
        hint = "[0.05, 0.5] is the default",
        names = "t1 t2"
    )]
    pub vignette_thresholds: [f64; 2],
    /// Gain on linear values.
    #[key(default = 1.0, unit = "x", step = 0.01, min = 0.0, hint = "1 leaves the light as it is")]
    pub light: f64,
    /// Standard deviation of Gaussian noise on linear values.
    #[key(step = 0.001, min = 0.0, hint = "0 is no noise")]
    pub noise_sigma: f64,
    /// Encoding of PNG files. The viewer always shows sRGB.
    pub output: OutputEncoding,
    /// Vignetting by a model, which multiplies the map. Omitted: the map alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignetting: Option<VignettingSpec>,
}

/// Encodings of PNG files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum OutputEncoding {
    /// 32 bit linear; PNG falls back to 16 bit linear.
    LinearF32,
    /// 16 bit float linear; PNG falls back to 16 bit linear.
    LinearF16,
    /// sRGB, 8 bit.
    #[default]
    Srgb8,
    /// Linear, 8 bit.
    Linear8,
    /// Linear luminance, 8 bit.
    Luma8,
    /// Linear luminance, 16 bit.
    Luma16,
}
