//! Numbers of a sensor, from its keys.

use crate::{
    scenario::{Companding, ImageSensorSpec, Mosaic},
    scene::LUMINANCE_F64,
};

/// Planck's constant times the speed of light, J m (both exact in the SI).
const PLANCK_TIMES_LIGHT: f64 = 6.626_070_15e-34 * 299_792_458.0;
/// Luminous efficacy of light of 555 nm, lm/W.
const LUMENS_A_WATT: f64 = 683.0;
/// Wavelength of the light that `white_lux` means, metres.
const LUX_WAVELENGTH_M: f64 = 555e-9;
/// Bits of a sensor that says nothing of them.
pub(crate) const BITS: u32 = 12;

/// Numbers of a sensor.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub mosaic: Mosaic,
    /// Electrons of the channels red, green, blue and white per linear R, G, B of the scene.
    pub weights: [[f32; 3]; 4],
    /// Electrons of the scene's white in each channel.
    pub white_e: [f64; 4],
    pub shot_noise: bool,
    /// Mean electrons by dark current during the exposure.
    pub dark_e: f32,
    pub read_noise_e: f32,
    pub row_noise_e: f32,
    pub column_noise_e: f32,
    pub full_well_e: f32,
    pub bits: u32,
    pub black_code: u16,
    /// Fraction of the converter's range above black that each code stands for.
    pub fraction_of_code: Vec<f32>,
    /// Largest fraction above black; where the full well or the largest number ends the range.
    pub largest_fraction: f64,
    /// Fixed pattern, electrons and fractions.
    pub prnu: f32,
    pub dsnu_e: f32,
    pub row_offset_e: f32,
    pub column_offset_e: f32,
    pub hot_pixels: f64,
    pub hot_e: f32,
    pub dead_pixels: f64,
    dn_per_e: f32,
    black_dn: f32,
    adc_max: f32,
    /// Code of each number of the converter, if they differ.
    code_of_dn: Option<Vec<u16>>,
    /// Full well and electrons per number of the converter, before rounding.
    exact_e: [f64; 2],
    range_dn: f64,
}

impl Settings {
    /// Numbers of a sensor whose facts are in `spec`, which is valid.
    pub fn new(spec: &ImageSensorSpec, exposure_s: f64) -> Self {
        let white_e = white_electrons(spec, exposure_s);
        let bits = spec.bits.unwrap_or(BITS);
        let adc_max = f64::from((1_u32 << spec.adc_bits.unwrap_or(bits)) - 1);
        let most_white_e = white_e.iter().copied().fold(0.0, f64::max);
        let full_well_e = match (spec.full_well_e, spec.gain_e_per_dn) {
            (Some(full_e), _) => full_e,
            (None, Some(_)) => f64::INFINITY,
            (None, None) => most_white_e,
        };
        let range_dn = adc_max - spec.black_dn;
        let e_per_dn = spec.gain_e_per_dn.unwrap_or(full_well_e / range_dn);
        let dark_s =
            exposure_s * ((spec.temperature_c - spec.dark_reference_c) / spec.dark_doubling_c).exp2();
        let mut settings = Self {
            mosaic: spec.mosaic,
            weights: weights(spec, white_e),
            white_e,
            shot_noise: spec.shot_noise,
            dark_e: (spec.dark_current_e_s.unwrap_or(0.0) * dark_s) as f32,
            read_noise_e: spec.read_noise_e.unwrap_or(0.0) as f32,
            row_noise_e: spec.row_noise_e as f32,
            column_noise_e: spec.column_noise_e as f32,
            full_well_e: full_well_e as f32,
            bits,
            black_code: 0,
            fraction_of_code: Vec::new(),
            largest_fraction: (full_well_e / e_per_dn / (adc_max - spec.black_dn)).min(1.0),
            prnu: spec.prnu.unwrap_or(0.0) as f32,
            dsnu_e: spec.dsnu_e.unwrap_or(0.0) as f32,
            row_offset_e: spec.row_offset_e as f32,
            column_offset_e: spec.column_offset_e as f32,
            hot_pixels: spec.hot_pixels,
            hot_e: (spec.hot_e_s * dark_s) as f32,
            dead_pixels: spec.dead_pixels,
            dn_per_e: (1.0 / e_per_dn) as f32,
            black_dn: spec.black_dn as f32,
            adc_max: adc_max as f32,
            code_of_dn: None,
            exact_e: [full_well_e, e_per_dn],
            range_dn,
        };
        settings.set_codes(spec);
        settings
    }

    /// Full well and electrons per number of the converter.
    pub fn full_well_and_step_e(&self) -> [f64; 2] {
        self.exact_e
    }

    /// Numbers of the converter above black.
    pub fn range_dn(&self) -> f64 {
        self.range_dn
    }

    /// Electrons of the scene's white in the green or only channel, or the white one.
    pub fn main_white_e(&self) -> f64 {
        match self.mosaic {
            Mosaic::Mono | Mosaic::Rgbw => self.white_e[3],
            _ => self.white_e[1],
        }
    }

    /// Channels of a raw picture.
    pub fn channels(&self) -> usize {
        if self.mosaic == Mosaic::None { 3 } else { 1 }
    }

    /// Code of electrons: the nearest number, companded.
    #[inline(always)]
    pub fn code(&self, electrons: f32) -> u16 {
        let dn = (self.black_dn + self.dn_per_e * electrons + 0.5).clamp(0.0, self.adc_max + 0.5) as u16;
        match &self.code_of_dn {
            None => dn,
            Some(codes) => codes[dn as usize],
        }
    }

    /// Tables between numbers of the converter and codes.
    fn set_codes(&mut self, spec: &ImageSensorSpec) {
        let (code_max, adc_max) = (f64::from((1_u32 << self.bits) - 1), f64::from(self.adc_max));
        let curve = Curve::new(spec);
        let fraction = |dn: f64| ((dn - spec.black_dn) / (adc_max - spec.black_dn)) as f32;
        if curve.points == Curve::straight() && code_max == adc_max {
            self.fraction_of_code = (0..=code_max as u32).map(|dn| fraction(f64::from(dn))).collect();
        } else {
            let code = |dn: u32| (curve.at(f64::from(dn) / adc_max) * code_max).round() as u16;
            self.code_of_dn = Some((0..=adc_max as u32).map(code).collect());
            let dn = |code: u32| fraction(curve.inverse(f64::from(code) / code_max) * adc_max);
            self.fraction_of_code = (0..=code_max as u32).map(dn).collect();
        }
        self.black_code = self.code(0.0);
    }
}

/// A companding curve over fractions of both ranges.
struct Curve {
    is_root: bool,
    points: Vec<[f64; 2]>,
}

impl Curve {
    fn new(spec: &ImageSensorSpec) -> Self {
        let points = match spec.companding {
            Companding::Piecewise => spec.companding_points.clone(),
            Companding::None | Companding::Sqrt => Self::straight(),
        };
        Self { is_root: spec.companding == Companding::Sqrt, points }
    }

    fn straight() -> Vec<[f64; 2]> {
        vec![[0.0, 0.0], [1.0, 1.0]]
    }

    fn at(&self, fraction: f64) -> f64 {
        if self.is_root { fraction.sqrt() } else { between(&self.points, 0, fraction) }
    }

    fn inverse(&self, fraction: f64) -> f64 {
        if self.is_root { fraction * fraction } else { between(&self.points, 1, fraction) }
    }
}

/// The other coordinate of a line through points, where coordinate `from` is `value`; constant beyond the ends.
pub(super) fn between(points: &[[f64; 2]], from: usize, value: f64) -> f64 {
    let [Some(first), Some(last)] = [points.first(), points.last()] else { return value };
    let to = 1 - from;
    let pair = points.windows(2).find(|pair| value <= pair[1][from]);
    match pair {
        _ if value <= first[from] => first[to],
        Some([a, b]) => a[to] + (b[to] - a[to]) * (value - a[from]) / (b[from] - a[from]),
        _ => last[to],
    }
}

/// Quantum efficiencies of red, green, blue and white. Of three, white has their luminance, as it sees luminance.
fn efficiencies(spec: &ImageSensorSpec) -> [f64; 4] {
    let Some(stated) = &spec.quantum_efficiency else { return [1.0; 4] };
    let rgb = stated.rgb();
    let luminance = (0..3).map(|channel| LUMINANCE_F64[channel] * rgb[channel]).sum();
    [rgb[0], rgb[1], rgb[2], stated.white().unwrap_or(luminance)]
}

/// Electrons that the scene's white makes in the channels red, green, blue and white.
fn white_electrons(spec: &ImageSensorSpec, exposure_s: f64) -> [f64; 4] {
    let efficiency = efficiencies(spec);
    let area_m2 = spec.pixel_um.map_or(0.0, |side_um| (side_um * 1e-6).powi(2));
    let photons =
        |w_m2: f64, wavelength_m: f64| w_m2 * area_m2 * exposure_s * wavelength_m / PLANCK_TIMES_LIGHT;
    let photons = match (spec.white_e, spec.white_lux, spec.white_w_m2) {
        (Some(electrons), _, _) => {
            return efficiency.map(|of_channel| electrons * of_channel / efficiency[1]);
        }
        (None, Some(lux), _) => {
            // A white surface that scatters evenly has the luminance lux / pi; the lens makes pi T L / (4 N^2).
            let f_number = spec.f_number.unwrap_or(f64::INFINITY);
            let on_sensor_lux = lux * spec.lens_transmission / (4.0 * f_number * f_number);
            photons(on_sensor_lux / LUMENS_A_WATT, LUX_WAVELENGTH_M)
        }
        (None, None, w_m2) => photons(w_m2.unwrap_or(0.0), spec.wavelength_nm * 1e-9),
    };
    efficiency.map(|of_channel| photons * of_channel)
}

/// Electrons of each channel per linear R, G, B.
fn weights(spec: &ImageSensorSpec, white_e: [f64; 4]) -> [[f32; 3]; 4] {
    let m = &spec.spectral_matrix;
    let rows = [[m[0], m[1], m[2]], [m[3], m[4], m[5]], [m[6], m[7], m[8]], LUMINANCE_F64];
    let mut scaled = [[0.0; 3]; 4];
    for (scaled, (row, electrons)) in scaled.iter_mut().zip(rows.iter().zip(white_e)) {
        *scaled = row.map(|fraction| (fraction * electrons) as f32);
    }
    scaled
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::PerChannel;

    fn spec() -> ImageSensorSpec {
        ImageSensorSpec { white_e: Some(8000.0), ..ImageSensorSpec::default() }
    }

    #[test]
    fn photons_follow_the_standard() {
        // Equation 3 of EMVA 1288 4.0: 50.34 photons per um2, ms, um and uW/cm2.
        let spec = ImageSensorSpec {
            white_e: None,
            white_w_m2: Some(0.01),
            wavelength_nm: 530.0,
            pixel_um: Some(3.45),
            quantum_efficiency: Some(PerChannel::One(0.5)),
            ..spec()
        };
        let expected = 0.5 * 50.34 * 3.45 * 3.45 * 8.0 * 0.53 * 1.0;
        let found = white_electrons(&spec, 8e-3)[1];
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn lux_are_those_of_555_nm_behind_the_lens() {
        // 1 lx of 555 nm is 4.091e15 photons a second and square metre.
        let spec = ImageSensorSpec {
            white_e: None,
            white_lux: Some(1000.0),
            f_number: Some(4.0),
            lens_transmission: 0.9,
            pixel_um: Some(5.0),
            ..spec()
        };
        let expected = 1000.0 * 0.9 / 64.0 * 4.0907e15 * 25e-12 * 2e-3;
        let found = white_electrons(&spec, 2e-3)[0];
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }

    #[test]
    fn white_pixels_have_an_efficiency_of_their_own() {
        let white_e = |values: &[f64]| {
            let quantum_efficiency = Some(PerChannel::Each(values.to_vec()));
            white_electrons(&ImageSensorSpec { quantum_efficiency, mosaic: Mosaic::Rgbw, ..spec() }, 1e-3)
        };
        assert_eq!(white_e(&[0.4, 0.5, 0.2, 0.75]), [6400.0, 8000.0, 3200.0, 12000.0]);
        let luminance = 0.2126 * 0.4 + 0.7152 * 0.5 + 0.0722 * 0.2;
        assert!((white_e(&[0.4, 0.5, 0.2])[3] - 16000.0 * luminance).abs() < 1e-9);
    }

    #[test]
    fn dark_current_doubles() {
        let spec = ImageSensorSpec {
            dark_current_e_s: Some(10.0),
            temperature_c: 41.0,
            dark_doubling_c: 8.0,
            ..spec()
        };
        assert_eq!(Settings::new(&spec, 0.5).dark_e, 20.0);
    }

    #[test]
    fn codes_round_trip_through_companding() {
        for (companding, points) in [
            (Companding::None, vec![]),
            (Companding::Sqrt, vec![]),
            (Companding::Piecewise, vec![[0.0, 0.0], [0.1, 0.5], [1.0, 1.0]]),
        ] {
            let spec = ImageSensorSpec {
                companding,
                companding_points: points,
                adc_bits: Some(12),
                bits: Some(8),
                black_dn: 64.0,
                ..spec()
            };
            let settings = Settings::new(&spec, 0.0);
            for fraction in [0.0_f32, 0.01, 0.05, 0.3, 0.7, 1.0] {
                let code = settings.code(fraction * 8000.0);
                let back = settings.fraction_of_code[code as usize];
                // The code's step there: 1/255 of the output, by the slope of the curve.
                let next = settings.fraction_of_code.get(code as usize + 1).copied().unwrap_or(1.0);
                let last =
                    settings.fraction_of_code.get((code as usize).wrapping_sub(1)).copied().unwrap_or(0.0);
                assert!(
                    (back - fraction).abs() <= 0.51 * (next - last) + 2e-4,
                    "{companding:?} {fraction}: {back}"
                );
            }
            assert_eq!(settings.code(1e9), 255);
        }
    }
}
