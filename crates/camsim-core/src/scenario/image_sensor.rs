//! `[camera.sensor]`: the image sensor, from light to digital numbers (EMVA 1288 release 4.0).

use serde::{Deserialize, Serialize};

/// The image sensor. Without it pictures have the simple model of `[camera.photometric]`.
///
/// What is `None` is a fact of [`Self::model`], or has the default that is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageSensorSpec {
    /// A sensor of the table of facts, [`crate::imaging::facts`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<SensorModel>,
    /// Electrons that the scene's white (1 on the linear scale) makes in a green or the only channel, in the
    /// scenario's exposure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_e: Option<f64>,
    /// Or: illuminance of the scene, as of light of 555 nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_lux: Option<f64>,
    /// Or: irradiance on the sensor where it sees white, of light of `wavelength_nm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_w_m2: Option<f64>,
    /// Time for which light and dark current are collected; else `camera.shutter.exposure_ms`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_ms: Option<f64>,
    /// Focal length over aperture, for `white_lux`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Share of the light that passes the lens, for `white_lux`.
    pub lens_transmission: f64,
    /// Wavelength of the light of `white_w_m2`.
    pub wavelength_nm: f64,
    /// Side of a pixel, for `white_lux` and `white_w_m2`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_um: Option<f64>,
    /// Electrons per photon: one number, or those of red, green and blue, and of white with `rgbw` (left out: the
    /// luminance of the three); else 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantum_efficiency: Option<PerChannel>,
    /// What the channels red, green and blue see of the scene's linear R, G, B, row by row.
    pub spectral_matrix: [f64; 9],
    /// Whether electrons come at random (Poisson). Dark current is random, too.
    pub shot_noise: bool,
    /// Dark current at `dark_reference_c`, electrons a second; else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dark_current_e_s: Option<f64>,
    /// Temperature of the stated dark current.
    pub dark_reference_c: f64,
    /// Rise of the temperature that doubles the dark current.
    pub dark_doubling_c: f64,
    /// Temperature of the sensor.
    pub temperature_c: f64,
    /// Standard deviation of the dark noise without dark current, electrons; else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_noise_e: Option<f64>,
    /// Dark signal nonuniformity: standard deviation over the pixels, electrons; else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dsnu_e: Option<f64>,
    /// Photo response nonuniformity: relative standard deviation over the pixels; else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prnu: Option<f64>,
    /// Noise that the pixels of a row share, anew in each frame, electrons.
    pub row_noise_e: f64,
    /// Noise that the pixels of a column share, anew in each frame, electrons.
    pub column_noise_e: f64,
    /// Constant offsets of rows, standard deviation, electrons.
    pub row_offset_e: f64,
    /// Constant offsets of columns, standard deviation, electrons.
    pub column_offset_e: f64,
    /// Share of the pixels whose dark current is much larger.
    pub hot_pixels: f64,
    /// Mean dark current of hot pixels at `dark_reference_c`, electrons a second; exponentially distributed.
    pub hot_e_s: f64,
    /// Share of the pixels that give the black level always.
    pub dead_pixels: f64,
    /// Largest number of electrons; else white's, or no limit where the gain is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_well_e: Option<f64>,
    /// Electrons per digital number (1/K of EMVA 1288), before companding; else the full well gives the
    /// largest number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_e_per_dn: Option<f64>,
    /// Digital number without electrons, before companding.
    pub black_dn: f64,
    /// Bits of the converter; else those of the output.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adc_bits: Option<u32>,
    /// Bits of the output, 8 to 16; else 12.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<u32>,
    /// Curve from the converter's numbers to those of the output.
    pub companding: Companding,
    /// Corners of the piecewise linear curve, as shares of both ranges.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub companding_points: Vec<[f64; 2]>,
    /// Colours of the pixels.
    pub mosaic: Mosaic,
    /// How colours of a mosaic are interpolated.
    pub demosaic: Demosaic,
    /// Gains of red, green and blue; else such that the scene's white is grey.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_balance: Option<[f64; 3]>,
    /// Takes balanced colours to those of the picture, row by row; else the inverse of `spectral_matrix`,
    /// balanced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color_matrix: Option<[f64; 9]>,
    /// Curve of the picture's values.
    pub response: ResponseCurve,
    /// Exponent 1/gamma of `gamma`.
    pub gamma: f64,
    /// Corners of the curve `table`, from [0, 0] to [1, 1].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_points: Vec<[f64; 2]>,
    /// Lamps in place of steady light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flicker: Option<FlickerSpec>,
}

/// No colours mixed.
const UNIT_MATRIX: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

impl Default for ImageSensorSpec {
    fn default() -> Self {
        Self {
            model: None,
            white_e: None,
            white_lux: None,
            white_w_m2: None,
            exposure_ms: None,
            f_number: None,
            lens_transmission: 1.0,
            wavelength_nm: 550.0,
            pixel_um: None,
            quantum_efficiency: None,
            spectral_matrix: UNIT_MATRIX,
            shot_noise: true,
            dark_current_e_s: None,
            dark_reference_c: 25.0,
            dark_doubling_c: 8.0,
            temperature_c: 25.0,
            read_noise_e: None,
            dsnu_e: None,
            prnu: None,
            row_noise_e: 0.0,
            column_noise_e: 0.0,
            row_offset_e: 0.0,
            column_offset_e: 0.0,
            hot_pixels: 0.0,
            hot_e_s: 0.0,
            dead_pixels: 0.0,
            full_well_e: None,
            gain_e_per_dn: None,
            black_dn: 0.0,
            adc_bits: None,
            bits: None,
            companding: Companding::None,
            companding_points: Vec::new(),
            mosaic: Mosaic::None,
            demosaic: Demosaic::Malvar,
            white_balance: None,
            color_matrix: None,
            response: ResponseCurve::Linear,
            gamma: 2.2,
            response_points: Vec::new(),
            flicker: None,
        }
    }
}

impl ImageSensorSpec {
    /// The same sensor without noise, fixed patterns and dark current: light, full well and digits are left.
    #[must_use]
    pub fn without_noise(&self) -> Self {
        Self {
            shot_noise: false,
            dark_current_e_s: Some(0.0),
            read_noise_e: Some(0.0),
            dsnu_e: Some(0.0),
            prnu: Some(0.0),
            row_noise_e: 0.0,
            column_noise_e: 0.0,
            row_offset_e: 0.0,
            column_offset_e: 0.0,
            hot_pixels: 0.0,
            dead_pixels: 0.0,
            ..self.clone()
        }
    }
}

/// One number for all channels, or one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PerChannel {
    /// All channels.
    One(f64),
    /// Red, green, blue and, of four, white.
    Each(Vec<f64>),
}

impl PerChannel {
    /// Values of red, green and blue.
    #[must_use]
    pub fn rgb(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| match self {
            Self::One(value) => *value,
            Self::Each(values) => values.get(channel).copied().unwrap_or(1.0),
        })
    }

    /// The value of white, where it is stated.
    #[must_use]
    pub fn white(&self) -> Option<f64> {
        match self {
            Self::One(value) => Some(*value),
            Self::Each(values) => values.get(3).copied(),
        }
    }
}

/// Sensors whose facts are known ([`crate::imaging::facts`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs, reason = "the names of the makers")]
pub enum SensorModel {
    Icx625,
    Imx174,
    Imx249,
    Imx250,
    Imx255,
    Imx273,
}

/// Colours of the pixels of a sensor; the corner at the top left is named first, row by row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mosaic {
    /// Every pixel measures red, green and blue, as with three sensors behind a prism.
    #[default]
    None,
    /// Every pixel measures luminance.
    Mono,
    /// Red, green; green, blue.
    Rggb,
    /// Blue, green; green, red.
    Bggr,
    /// Green, red; blue, green.
    Grbg,
    /// Green, blue; red, green.
    Gbrg,
    /// Half of the pixels white (luminance): W B W G; B W G W; W G W R; G W R W.
    Rgbw,
}

/// Interpolation of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Demosaic {
    /// Each channel by itself.
    Bilinear,
    /// Bilinear, corrected by the gradient of the pixel's own channel (Malvar, He and Cutler 2004).
    #[default]
    Malvar,
}

/// Curves from the converter's numbers to those of the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Companding {
    /// The upper bits.
    #[default]
    None,
    /// Square root: shot noise has the same size everywhere.
    Sqrt,
    /// Straight lines between given corners.
    Piecewise,
}

/// `[camera.sensor.flicker]`: light that rises and falls, with the mean of steady light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlickerSpec {
    /// Periods a second: twice the frequency of the mains.
    pub hz: f64,
    /// Share of the light that flickers.
    pub depth: f64,
    /// Course of that share.
    pub wave: FlickerWave,
    /// Share of the period in which `pulse` is alight.
    pub duty: f64,
    /// Phase at path time 0, the log's first good row: of the brightest instant, or of the begin of the pulse.
    pub phase_deg: f64,
}

impl Default for FlickerSpec {
    fn default() -> Self {
        Self { hz: 100.0, depth: 1.0, wave: FlickerWave::Sine, duty: 0.5, phase_deg: 0.0 }
    }
}

/// Courses of flickering light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FlickerWave {
    /// Of lamps at the mains.
    #[default]
    Sine,
    /// On and off, as of LEDs with pulse width modulation.
    Pulse,
}

/// Curves of the picture's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ResponseCurve {
    /// As they are.
    #[default]
    Linear,
    /// The transfer function of sRGB.
    Srgb,
    /// A power.
    Gamma,
    /// Straight lines between given corners.
    Table,
}
