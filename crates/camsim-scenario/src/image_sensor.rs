//! `[camera.sensor]`: the image sensor, from light to digital numbers (EMVA 1288 release 4.0).

use serde::{Deserialize, Serialize};

use super::keys::{Table, Words};

/// No colours mixed.
const UNIT_MATRIX: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Image sensor in terms of EMVA 1288, instead of `light` and `noise_sigma` (docs/reference/IMAGING.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ImageSensorSpec {
    /// Sensor whose facts from public sources fill keys that are omitted.
    #[key(example = "\"imx250\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<SensorModel>,
    /// Electrons that the scene's white makes in the exposure, in a green or the only channel. White is 1 on
    /// the linear scale. Omitted: `white_lux` or `white_w_m2` is the scale.
    #[key(unit = "e-", step = 10.0, above = 0.0, hint = "it is what white stands for", example = "8000.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_e: Option<f64>,
    /// Illuminance on the scene, instead of `white_e`; all light counts as 555 nm. It needs `f_number`,
    /// `pixel_um` and `quantum_efficiency`.
    #[key(unit = "lx", step = 10.0, above = 0.0, hint = "it is what white stands for", example = "20000.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_lux: Option<f64>,
    /// Irradiance on the sensor where it sees white, instead of `white_e`. The light is that of
    /// `wavelength_nm`; it needs `pixel_um` and `quantum_efficiency`.
    #[key(unit = "W/m2", step = 0.001, above = 0.0, hint = "it is what white stands for", example = "0.01")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_w_m2: Option<f64>,
    /// Time for which light and dark current are collected. Omitted: `camera.shutter.exposure_ms`.
    #[key(
        unit = "ms",
        step = 0.1,
        min = 0.0,
        hint = "leave it out for camera.shutter.exposure_ms",
        example = "8.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_ms: Option<f64>,
    /// Focal length over aperture, for `white_lux`.
    #[key(step = 0.05, above = 0.0, hint = "leave it out if it is unknown", example = "4.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Fraction of the light that passes the lens, for `white_lux`.
    #[key(default = 1.0, step = 0.005, above = 0.0, max = 1.0, hint = "1 is all of it")]
    pub lens_transmission: f64,
    /// Wavelength of the light of `white_w_m2`.
    #[key(default = 550.0, unit = "nm", above = 0.0, hint = "550 is green")]
    pub wavelength_nm: f64,
    /// Side of a pixel, for `white_lux` and `white_w_m2`. Omitted: that of `model`.
    #[key(unit = "um", step = 0.01, above = 0.0, hint = "leave it out if it is unknown", example = "3.45")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_um: Option<f64>,
    /// Electrons per photon: one number, or those of red, green and blue. With mosaic "rgbw" also of white,
    /// which else has their luminance. Omitted: that of `model`, else 1.
    #[key(step = 0.005, above = 0.0, max = 1.0, hint = "it is electrons per photon", example = "0.6")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantum_efficiency: Option<PerChannel>,
    /// What red, green and blue pixels see of the scene's linear R, G, B, row by row.
    #[key(default = UNIT_MATRIX, step = 0.01, names = "rR rG rB gR gG gB bR bG bB")]
    pub spectral_matrix: [f64; 9],
    /// Whether electrons come at random (Poisson). Dark current is random, too.
    #[key(default = true)]
    pub shot_noise: bool,
    /// Dark current at `dark_reference_c`. That at `temperature_c` is twice as large for each
    /// `dark_doubling_c` above it. Omitted: 0.
    #[key(unit = "e-/s", step = 0.1, min = 0.0, hint = "0 is none", example = "0.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dark_current_e_s: Option<f64>,
    /// Temperature of the stated dark current.
    #[key(default = 25.0, unit = "deg C", step = 0.1)]
    pub dark_reference_c: f64,
    /// Rise of the temperature that doubles the dark current.
    #[key(default = 8.0, unit = "deg C", step = 0.1, above = 0.0, hint = "8 is common")]
    pub dark_doubling_c: f64,
    /// Temperature of the sensor.
    #[key(default = 25.0, unit = "deg C", step = 0.1)]
    pub temperature_c: f64,
    /// Standard deviation of the dark noise without dark current. Omitted: that of `model`, else 0.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none", example = "2.5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_noise_e: Option<f64>,
    /// Dark signal nonuniformity: standard deviation over the pixels. Omitted: 0.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none", example = "0.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dsnu_e: Option<f64>,
    /// Photo response nonuniformity: relative standard deviation of gains over the pixels. Omitted: 0.
    #[key(step = 0.001, min = 0.0, hint = "0 is none", example = "0.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prnu: Option<f64>,
    /// Noise that the pixels of a row share, new in every frame.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none")]
    pub row_noise_e: f64,
    /// Noise that the pixels of a column share, new in every frame.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none")]
    pub column_noise_e: f64,
    /// Constant offsets of rows: standard deviation.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none")]
    pub row_offset_e: f64,
    /// Constant offsets of columns: standard deviation.
    #[key(unit = "e-", step = 0.05, min = 0.0, hint = "0 is none")]
    pub column_offset_e: f64,
    /// Fraction of the pixels whose dark current is much larger.
    #[key(step = 0.0001, min = 0.0, max = 1.0, hint = "it is a fraction of the pixels")]
    pub hot_pixels: f64,
    /// Mean dark current of hot pixels at `dark_reference_c`. Their dark currents are exponentially
    /// distributed about it.
    #[key(unit = "e-/s", step = 10.0, min = 0.0, hint = "0 is none")]
    pub hot_e_s: f64,
    /// Fraction of the pixels that always show the black level.
    #[key(step = 0.0001, min = 0.0, max = 1.0, hint = "it is a fraction of the pixels")]
    pub dead_pixels: f64,
    /// Largest number of electrons. Omitted: that of `model`, else white's, or no limit where
    /// `gain_e_per_dn` is given.
    #[key(
        unit = "e-",
        step = 10.0,
        above = 0.0,
        hint = "leave it out if it is unknown",
        example = "10700.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_well_e: Option<f64>,
    /// Electrons per digital number (1/K of EMVA 1288), before companding. Omitted: the full well gives the
    /// largest number.
    #[key(unit = "e-/DN", step = 0.01, above = 0.0, hint = "leave it out if it is unknown", example = "2.6")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_e_per_dn: Option<f64>,
    /// Digital number without electrons, before companding.
    #[key(unit = "DN", min = 0.0, hint = "0 is no offset")]
    pub black_dn: f64,
    /// Bits of the converter, before companding. Omitted: those of `bits`.
    #[key(
        step = 0.1,
        min = 8,
        max = 16,
        hint = "leave it out for those of camera.sensor.bits",
        example = "12"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adc_bits: Option<u32>,
    /// Bits of the digital numbers of the output. Omitted: those of `model`, else 12.
    #[key(step = 0.1, min = 8, max = 16, hint = "12 is common", example = "12")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<u32>,
    /// Curve from the converter's numbers to those of the output.
    pub companding: Companding,
    /// Corners of the piecewise linear curve of `companding`, as fractions of both ranges.
    #[key(step = 0.01, example = "[[0, 0], [0.2, 0.5], [1, 1]]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub companding_points: Vec<[f64; 2]>,
    /// Colours of the pixels.
    pub mosaic: Mosaic,
    /// Interpolation of the colours of the mosaic.
    pub demosaic: Demosaic,
    /// Gains of red, green and blue. Omitted: such that the scene's white is grey.
    #[key(
        unit = "x",
        step = 0.01,
        above = 0.0,
        hint = "1 leaves a colour as it is",
        example = "[1.5, 1.0, 1.8]",
        names = "R G B"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_balance: Option<[f64; 3]>,
    /// Matrix from balanced colours to those of the picture, row by row. Omitted: the inverse of
    /// `spectral_matrix`, balanced.
    #[key(step = 0.01, example = "[1, 0, 0, 0, 1, 0, 0, 0, 1]", names = "rR rG rB gR gG gB bR bG bB")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color_matrix: Option<[f64; 9]>,
    /// Curve of the picture's values.
    pub response: ResponseCurve,
    /// Exponent 1/gamma of the response "gamma".
    #[key(default = 2.2, step = 0.01, above = 0.0, hint = "2.2 is common")]
    pub gamma: f64,
    /// Corners of the response "table", from [0, 0] to [1, 1].
    #[key(step = 0.01, example = "[[0, 0], [0.2, 0.5], [1, 1]]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_points: Vec<[f64; 2]>,
    /// Lamps instead of steady light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flicker: Option<FlickerSpec>,
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

/// Sensors whose facts are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum Demosaic {
    /// Each channel by itself.
    Bilinear,
    /// Bilinear, corrected by the gradient of the pixel's own channel (Malvar, He and Cutler 2004).
    #[default]
    Malvar,
}

/// Curves from the converter's numbers to those of the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum Companding {
    /// The upper `bits` of the converter's `adc_bits`.
    #[default]
    None,
    /// Square root: shot noise has the same size everywhere.
    Sqrt,
    /// Straight lines between the corners of `companding_points`.
    Piecewise,
}

/// Light that rises and falls, with the mean of steady light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct FlickerSpec {
    /// Periods of the lamps a second: twice the frequency of the mains.
    #[key(default = 100.0, unit = "Hz", above = 0.0, hint = "100 is that of 50 Hz mains")]
    pub hz: f64,
    /// Fraction of the light that flickers.
    #[key(
        default = 1.0,
        step = 0.01,
        min = 0.0,
        max = 1.0,
        hint = "it is the fraction of the light that flickers"
    )]
    pub depth: f64,
    /// Course of the flickering light.
    pub wave: FlickerWave,
    /// Fraction of the period in which "pulse" is alight.
    #[key(default = 0.5, step = 0.01, above = 0.0, max = 1.0, hint = "it is a fraction of the period")]
    pub duty: f64,
    /// Phase at the log's first good row: of the brightest instant, or of the begin of the pulse.
    #[key(unit = "deg")]
    pub phase_deg: f64,
}

/// Courses of flickering light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum FlickerWave {
    /// Of lamps at the mains.
    #[default]
    Sine,
    /// On and off, as of LEDs with pulse width modulation.
    Pulse,
}

/// Curves of the picture's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum ResponseCurve {
    /// As they are.
    #[default]
    Linear,
    /// The transfer function of sRGB.
    Srgb,
    /// A power, with the exponent 1 over `gamma`.
    Gamma,
    /// Straight lines between the corners of `response_points`.
    Table,
}
