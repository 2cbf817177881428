//! `[camera]`, which is also the content of a CAMERA.toml.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{
    AutoExposureSpec, ChromaticSpec, Face, FieldOr, FilesOfSpec, ImageCircleSpec, ImageSensorSpec, MadeOf,
    PointSpreadSpec, Primary, ResizedSpec, TimingSpec, VignettingSpec,
};
use crate::{
    lens::LensTable,
    shutter::{Shutter, ShutterError},
};

/// Camera geometry, lens, shutter and photometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSpec {
    /// Name of the camera. It is part of the seed of its noise (`crate::noise::camera_seed`), so that the
    /// cameras of one platform have different noise.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Width and height of the output.
    pub size_px: [u32; 2],
    /// Focal lengths (fx, fy).
    pub focal_px: [f64; 2],
    /// Principal point; (0, 0) is the centre of the top-left pixel. `None` is the image centre ((W-1)/2,
    /// (H-1)/2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Frames per second.
    pub fps: f64,
    /// Fraction of a frame period added to every stamp.
    pub phase: f64,
    /// How much the camera's clock is ahead of the platform's: added to the stamps that the camera writes.
    /// Poses stay those of the true instants.
    #[serde(skip_serializing_if = "is_zero")]
    pub clock_offset_ms: f64,
    /// Position and orientation on the platform.
    pub mount: MountSpec,
    /// Distortion.
    pub lens: LensSpec,
    /// File of a lens of model "table": a CSV of rays and points, or an STmap (EXR).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_table: Option<LensTable>,
    /// Calibrations by zoom, with ascending `at`; empty for a fixed lens.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zoom: Vec<ZoomSpec>,
    /// CSV `t_s,zoom`: zoom over log time, linear between rows, constant beyond the ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zoom_track: Option<PathBuf>,
    /// The part of a wide field that this camera is for, where it is one of several ([`Face`]); files have
    /// whole cameras.
    #[serde(skip)]
    pub face: Option<Face>,
    /// Exposure times of the rows.
    pub shutter: ShutterSpec,
    /// Vignette, light, noise, output encoding.
    pub photometric: PhotometricSpec,
    /// The image sensor, in place of `photometric`'s light and noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<ImageSensorSpec>,
    /// Exposure that follows the pictures, in place of that of `shutter`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto_exposure: Option<AutoExposureSpec>,
    /// Faults of trigger, stamps and delivery.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingSpec>,
    /// What the lens makes of a point of light; without it, a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<PointSpreadSpec>,
    /// Lenses of red and blue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chromatic: Option<ChromaticSpec>,
    /// What of the picture the lens shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_circle: Option<ImageCircleSpec>,
    /// Part and scale of the picture that the other keys describe, which the camera delivers. It is applied when a
    /// file is read ([`Self::resized`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resized: Option<ResizedSpec>,
    /// The picture that the files of `lens_table` and of the vignette are of, where it is not this camera's.
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

impl Default for CameraSpec {
    fn default() -> Self {
        Self {
            name: String::new(),
            size_px: [640, 480],
            focal_px: [500.0, 500.0],
            principal_point_px: None,
            fps: 30.0,
            phase: 0.0,
            clock_offset_ms: 0.0,
            mount: MountSpec::default(),
            lens: LensSpec::default(),
            lens_table: None,
            zoom: Vec::new(),
            zoom_track: None,
            face: None,
            shutter: ShutterSpec::default(),
            photometric: PhotometricSpec::default(),
            sensor: None,
            auto_exposure: None,
            timing: None,
            point_spread: None,
            chromatic: None,
            image_circle: None,
            resized: None,
            files_of: None,
            primary: None,
            made_of: MadeOf::default(),
        }
    }
}

impl CameraSpec {
    /// [`Self::clock_offset_ms`] in whole nanoseconds.
    #[must_use]
    pub fn clock_offset_ns(&self) -> i64 {
        (self.clock_offset_ms * 1e6).round() as i64
    }

    /// Exposure time that makes the scene's white white: the shutter's, unless automatic exposure has another.
    #[must_use]
    pub fn nominal_exposure_ms(&self) -> f64 {
        let own = self.auto_exposure.as_ref().and_then(|auto| auto.nominal_ms);
        own.unwrap_or(self.shutter.exposure_ms)
    }

    /// The shutter with the longest exposure that a frame may have.
    ///
    /// # Errors
    /// A shutter that cannot be used.
    pub fn longest_shutter(&self) -> Result<Shutter, ShutterError> {
        let shutter = Shutter::from_spec(&self.shutter, self.fps, self.size_px)?;
        let auto = self.auto_exposure.as_ref().filter(|_| shutter.exposure_s() > 0.0);
        Ok(auto.map_or(shutter, |auto| shutter.with_exposure_s(1e-3 * auto.exposure_ms[1])))
    }

    /// Readout time, milliseconds: [`ShutterSpec::readout_ms_of`] this camera's picture.
    #[must_use]
    pub fn readout_ms(&self) -> f64 {
        self.shutter.readout_ms_of(self.size_px)
    }
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// `[camera.mount]`: the camera in the body frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MountSpec {
    /// Roll, pitch, yaw (ZYX). (0, 0, 0) looks along the nose, pitch -90 straight down.
    pub angles_deg: [f64; 3],
    /// Lever arm in body axes (forward, right, down).
    pub offset_m: [f64; 3],
    /// Vibration: sinusoids added to the mount.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vibration: Vec<VibrationSpec>,
}

/// A sinusoid `amplitude * sin(2 pi hz t + phase)` about or along one body axis, before the mount. The time t
/// is in seconds of flight since the log's first good row, for any window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VibrationSpec {
    /// Degree of freedom.
    pub axis: Axis,
    /// Amplitude of a rotation axis.
    #[serde(default)]
    pub amplitude_deg: f64,
    /// Amplitude of a translation axis.
    #[serde(default)]
    pub amplitude_m: f64,
    /// Frequency.
    pub hz: f64,
    /// Phase at t = 0.
    #[serde(default)]
    pub phase_deg: f64,
}

/// Degrees of freedom of the mount.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// `[camera.lens]`: model and coefficients. `docs/reference/LENSES.md` lists the models.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LensSpec {
    /// Model.
    pub model: LensModel,
    /// In the model's order, which [`crate::lens::ModelFacts`] names; trailing ones may be left out.
    pub coefficients: Vec<f64>,
}

/// Lens models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LensModel {
    /// No distortion.
    #[default]
    Pinhole,
    /// Radial (polynomial or rational) and tangential, as in OpenCV.
    BrownConrady,
    /// Equidistant fisheye polynomial, as in OpenCV's fisheye module.
    KannalaBrandt,
    /// Brown-Conrady with thin prism and tilted sensor, OpenCV's 12 and 14 coefficients.
    BrownConradyPrism,
    /// Fisheye with six radial, two tangential and four thin-prism terms, COLMAP's
    /// RAD_TAN_THIN_PRISM_FISHEYE.
    Fisheye624,
    /// Distorted radius as a polynomial of the angle off axis.
    FTheta,
    /// Angle off axis as a polynomial of the distorted radius.
    FThetaInverse,
    /// Two spheres and a plane.
    DoubleSphere,
    /// Extended unified camera model: an ellipsoid and a plane.
    Eucm,
    /// Unified camera model: a sphere and a plane.
    Ucm,
    /// A sphere with Brown-Conrady distortion: OpenCV's omnidir, CamOdoCal's MEI, Kalibr's omni-radtan.
    Mei,
    /// Undistorted over distorted radius is `1 / (1 + k r^2)`.
    Division,
    /// Distorted radius proportional to the angle, by a field of view.
    Fov,
    /// Longitude and latitude: a panorama.
    Equirectangular,
    /// A table of points, `camera.lens_table`.
    Table,
}

/// One row of the zoom table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZoomSpec {
    /// Zoom value of this calibration.
    pub at: f64,
    /// Focal lengths.
    pub focal_px: [f64; 2],
    /// Principal point; `None` is the image centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Distortion coefficients, in the lens model's order.
    #[serde(default)]
    pub coefficients: Vec<f64>,
}

/// `[camera.shutter]`: paper section 6.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShutterSpec {
    /// Age of the image centre at its stamp (-t_d).
    pub delay_ms: f64,
    /// Time from the first row to the last (t_r).
    pub readout_ms: f64,
    /// Direction of the readout.
    pub readout: Readout,
    /// Exposure time (t_e).
    pub exposure_ms: f64,
    /// Lag between the two fields.
    pub interlace_ms: FieldOr,
    /// Parity (0-based) of the rows of the earlier field.
    pub first_field: Parity,
    /// Time from a row to the next, in place of `readout_ms`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_time_us: Option<f64>,
    /// When the exposures of the rows begin.
    #[serde(skip_serializing_if = "Reset::is_rolling")]
    pub reset: Reset,
    /// Whether the readout may be longer than the period of a frame.
    #[serde(skip_serializing_if = "is_false")]
    pub allow_overlap: bool,
}

/// Beginnings of the rows' exposures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reset {
    /// Each row as long before its readout as all others.
    #[default]
    Rolling,
    /// All rows at once: the exposure of the row that is read first is `exposure_ms`, and that of each next
    /// one is longer by the time from row to row.
    Global,
}

impl Reset {
    fn is_rolling(&self) -> bool {
        *self == Self::Rolling
    }
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

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

impl Default for ShutterSpec {
    fn default() -> Self {
        Self {
            delay_ms: 0.0,
            readout_ms: 0.0,
            readout: Readout::default(),
            exposure_ms: 0.0,
            interlace_ms: FieldOr::Ms(0.0),
            first_field: Parity::Even,
            line_time_us: None,
            reset: Reset::Rolling,
            allow_overlap: false,
        }
    }
}

/// Rows by parity, counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parity {
    /// Rows 0, 2, 4, ...
    #[default]
    Even,
    /// Rows 1, 3, 5, ...
    Odd,
}

/// Readout directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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

/// `[camera.photometric]`: paper section 7.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhotometricSpec {
    /// Vignette map, an image resampled bilinearly to the output.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignette: Option<PathBuf>,
    /// `[t1, t2]`: the weight is 0 if v < t1, else min(v / t2, 1).
    pub vignette_thresholds: [f64; 2],
    /// Gain on linear values.
    pub light: f64,
    /// Standard deviation of Gaussian noise on linear values.
    pub noise_sigma: f64,
    /// Encoding of PNG files.
    pub output: OutputEncoding,
    /// Vignetting by a model, beside the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignetting: Option<VignettingSpec>,
}

impl Default for PhotometricSpec {
    fn default() -> Self {
        Self {
            vignette: None,
            vignette_thresholds: [0.05, 0.5],
            light: 1.0,
            noise_sigma: 0.0,
            output: OutputEncoding::default(),
            vignetting: None,
        }
    }
}

/// Encodings of the encoded formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
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
