//! The raw picture of an image sensor, and histograms.

use camsim_core::{
    frame::RawPicture,
    imaging::{SensorLevels, color_at, sensor_levels, with_facts},
    scenario::{CameraSpec, Companding, Mosaic},
    scene::srgb_from_linear_f64,
};
use eframe::egui::{Color32, ColorImage};

use super::picture::Picture;

/// Bars of a histogram.
pub const BARS: usize = 256;

/// Counts of values by colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Counts of red, green, blue and white (luminance); white is of sensors that have such pixels.
    pub counts: [Vec<u64>; 4],
    /// The value after the last bar.
    pub end: u32,
    /// Fraction of the counted values that are the largest one.
    pub full: f64,
    /// Whether the values are numbers of the raw picture, and not sRGB codes.
    pub is_raw: bool,
}

/// How a raw picture is to be read: mosaic and range.
#[derive(Clone, Copy, Debug)]
pub struct RawScale {
    mosaic: Mosaic,
    levels: SensorLevels,
    /// Numbers of the converter in one of the raw picture; `None` if these are companded.
    step_dn: Option<f64>,
}

impl RawScale {
    /// `None` for a camera without sensor.
    pub fn new(camera: &CameraSpec) -> Option<Self> {
        let levels = sensor_levels(camera)?;
        let sensor = with_facts(camera.sensor.as_ref()?);
        let step_dn = f64::from(1_u32 << levels.adc_bits.saturating_sub(levels.bits));
        let step_dn = (sensor.companding == Companding::None).then_some(step_dn);
        Some(Self { mosaic: sensor.mosaic, levels, step_dn })
    }

    /// Colours of the numbers of a pixel: 0, 1, 2 are red, green, blue, 3 is white.
    pub fn colors(&self, pixel: [u32; 2]) -> &'static [usize] {
        const ALL: &[usize] = &[0, 1, 2, 3];
        match self.mosaic {
            Mosaic::None => &ALL[..3],
            mosaic => {
                let color = usize::from(color_at(mosaic, pixel));
                &ALL[color..=color]
            }
        }
    }

    /// As of a frame whose signal is amplified by this gain beside the sensor's own.
    pub fn amplified(self, gain: f64) -> Self {
        let gain_e_per_dn = self.levels.gain_e_per_dn / gain;
        Self { levels: SensorLevels { gain_e_per_dn, ..self.levels }, ..self }
    }

    /// Whether all pixels measure the same, luminance.
    pub fn is_mono(&self) -> bool {
        self.mosaic == Mosaic::Mono
    }

    /// Electrons that a number stands for, readout noise included; `None` for companded numbers.
    pub fn electrons(&self, code: u16) -> Option<f64> {
        let SensorLevels { black_dn, gain_e_per_dn, .. } = self.levels;
        self.step_dn.map(|step_dn| (f64::from(code) * step_dn - black_dn) * gain_e_per_dn)
    }

    /// Brightness of a number on the screen, 0 to 1 from black to the end of the range.
    fn brightness(&self, code: u16) -> f64 {
        let end = f64::from((1_u32 << self.levels.bits) - 1);
        let black = self.step_dn.map_or(0.0, |step_dn| self.levels.black_dn / step_dn);
        let fraction = ((f64::from(code) - black) / (end - black)).clamp(0.0, 1.0);
        if self.step_dn.is_some() { srgb_from_linear_f64(fraction) } else { fraction }
    }
}

/// The raw picture as numbers lie on the sensor: each pixel in the colour of its filter.
pub fn raw_image(picture: &Picture) -> Option<ColorImage> {
    let (raw, scale, size_px) = (picture.frame.raw()?, picture.raw_scale?, picture.frame.size_px);
    let codes: Vec<u8> = (0..=u32::from(u16::MAX) >> (16 - raw.bits))
        .map(|code| (255.0 * scale.brightness(code as u16)).round() as u8)
        .collect();
    let shown = |code: u16| codes.get(usize::from(code)).copied().unwrap_or(u8::MAX);
    let pixels = pixels(raw, size_px).map(|(pixel, numbers)| {
        let mut rgb = [0; 3];
        for (color, number) in scale.colors(pixel).iter().zip(numbers) {
            match rgb.get_mut(*color) {
                Some(value) => *value = shown(*number),
                None => rgb = [shown(*number); 3],
            }
        }
        Color32::from_rgb(rgb[0], rgb[1], rgb[2])
    });
    Some(ColorImage::new(size_px.map(|side| side as usize), pixels.collect()))
}

/// Histogram of the raw picture if that is asked for and there is one, else of the picture's sRGB codes.
pub fn histogram(picture: &Picture, of_raw: bool) -> Histogram {
    match picture.frame.raw().zip(picture.raw_scale).filter(|_| of_raw) {
        Some((raw, scale)) => raw_histogram(raw, picture.frame.size_px, &scale),
        None => code_histogram(&picture.image),
    }
}

fn raw_histogram(raw: &RawPicture, size_px: [u32; 2], scale: &RawScale) -> Histogram {
    let end = 1 << raw.bits;
    let mut histogram = Histogram::empty(end, true);
    for (pixel, numbers) in pixels(raw, size_px) {
        let numbers = scale.colors(pixel).iter().zip(numbers);
        numbers.for_each(|(color, number)| histogram.count(*color, u32::from(*number)));
    }
    histogram.finished()
}

fn code_histogram(image: &ColorImage) -> Histogram {
    let mut histogram = Histogram::empty(256, false);
    for pixel in image.pixels.iter().filter(|pixel| pixel.a() > 0) {
        let codes = [pixel.r(), pixel.g(), pixel.b()];
        codes.into_iter().enumerate().for_each(|(color, code)| histogram.count(color, code.into()));
    }
    histogram.finished()
}

impl Histogram {
    fn empty(end: u32, is_raw: bool) -> Self {
        Self { counts: std::array::from_fn(|_| vec![0; BARS]), end, full: 0.0, is_raw }
    }

    fn count(&mut self, color: usize, value: u32) {
        let bar = (u64::from(value) * BARS as u64 / u64::from(self.end)) as usize;
        if let Some(count) = self.counts.get_mut(color).and_then(|counts| counts.get_mut(bar)) {
            *count += 1;
        }
        self.full += f64::from(u8::from(value + 1 == self.end));
    }

    fn finished(mut self) -> Self {
        let all: u64 = self.counts.iter().flatten().sum();
        self.full /= all.max(1) as f64;
        self
    }
}

/// Pixels with their numbers.
fn pixels(raw: &RawPicture, [width, _]: [u32; 2]) -> impl Iterator<Item = ([u32; 2], &[u16])> {
    let numbers = raw.values.chunks(raw.channels.max(1) as usize);
    numbers.enumerate().map(move |(i, numbers)| ([i as u32 % width, i as u32 / width], numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(mosaic: Mosaic) -> RawScale {
        let levels = SensorLevels {
            exposure_ms: 1.0,
            white_e: 1000.0,
            saturation_e: 2000.0,
            gain_e_per_dn: 2.0,
            black_dn: 64.0,
            white_dn: 564.0,
            adc_bits: 10,
            bits: 10,
        };
        RawScale { mosaic, levels, step_dn: Some(1.0) }
    }

    #[test]
    fn numbers_count_for_the_colour_of_their_filter() {
        let raw = RawPicture { channels: 1, bits: 10, values: vec![64, 1023, 512, 0] };
        let histogram = raw_histogram(&raw, [2, 2], &scale(Mosaic::Rggb));
        let counted: Vec<_> = histogram
            .counts
            .iter()
            .map(|bars| (0..BARS).filter(|bar| bars[*bar] > 0).collect::<Vec<_>>())
            .collect();
        assert_eq!(counted, [vec![16], vec![128, 255], vec![0], vec![]]);
        assert_eq!((histogram.end, histogram.full), (1024, 0.25));
    }

    #[test]
    fn electrons_are_above_black() {
        assert_eq!(scale(Mosaic::Mono).electrons(64), Some(0.0));
        assert_eq!(scale(Mosaic::Mono).electrons(164), Some(200.0));
        let companded = RawScale { step_dn: None, ..scale(Mosaic::Mono) };
        assert_eq!(companded.electrons(164), None);
        let of_eight_bits = RawScale { step_dn: Some(4.0), ..scale(Mosaic::Mono) };
        assert_eq!(of_eight_bits.electrons(41), Some(200.0));
        assert_eq!(of_eight_bits.amplified(2.0).electrons(41), Some(100.0));
        assert_eq!(scale(Mosaic::Mono).brightness(10), 0.0);
        assert!((scale(Mosaic::Mono).brightness(1023) - 1.0).abs() < 1e-12);
    }
}
