//! The lens as a blur (`[camera.point_spread]`), and the image sensor: from the linear light of an output
//! frame to digital numbers, and from these to a picture (`[camera.sensor]`; terms of EMVA 1288 release 4.0).
//!
//! There is one implementation for all renderers: it takes the finished picture of any of them. A sensor's
//! numbers are a function of (light, seed, camera, frame, pixel), the same on every machine. Formulas:
//! docs/theory/IMAGING.md.

mod demosaic;
mod develop;
mod draw;
mod exposed;
mod facts;
mod fixed_pattern;
mod flicker;
mod levels;
mod optics;
mod settings;

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::{
    exposure::FrameExposure,
    frame::{PlaneValues, RawPicture, RenderedFrame},
    noise::camera_seed,
    scenario::{CameraSpec, Channel, ImageSensorSpec, Mosaic, Reset, ShutterSpec},
    shutter::{RowAxis, Shutter},
    timing_faults::picture_of,
};

pub use demosaic::color_at;
pub use draw::{Draws, LARGE_MEAN, two_words};
pub use facts::{Fact, facts, with_facts};
pub use levels::{SensorLevels, sensor_levels};
pub use optics::{KernelError, LensTransfer, Optics, SpreadKernel};

use exposed::Exposed;
pub(crate) use exposed::sensor_range;
use fixed_pattern::FixedPattern;
pub(crate) use settings::BITS;

/// Streams of random bits.
mod stream {
    /// Electrons and read noise of the first channel; the others follow.
    pub const PIXEL: u32 = 16;
    pub const ROW: u32 = 20;
    pub const COLUMN: u32 = 21;
    /// Constant offsets and gains of the first channel; the others follow.
    pub const FIXED: u32 = 24;
    pub const FIXED_ROW: u32 = 28;
    pub const FIXED_COLUMN: u32 = 29;
    pub const DEFECT: u32 = 32;
    pub const HOT: u32 = 36;
}

/// Tables of all sensors.
static DRAWS: LazyLock<Draws> = LazyLock::new(Draws::new);

/// An image sensor, ready to take pictures.
#[derive(Debug)]
pub struct ImageSensor {
    key: SensorKey,
    /// With the scenario's exposure.
    nominal: Exposed,
    draws: &'static Draws,
    fixed: FixedPattern,
    /// Exposure of each row of the readout as a multiple of `exposure_ms`, and their axis, where they differ.
    row_gains: Option<(RowAxis, Vec<f32>)>,
}

/// What a sensor is made of.
#[derive(Clone, Debug, PartialEq)]
struct SensorKey {
    spec: ImageSensorSpec,
    size_px: [u32; 2],
    exposure_ms: f64,
    shutter: ShutterSpec,
    fps: f64,
    seed: u64,
    name: String,
    /// The camera, where it may show a picture twice.
    timing: Option<CameraSpec>,
}

impl SensorKey {
    /// `None` also for a face: the sensor takes the whole picture, once its faces are joined.
    fn new(camera: &CameraSpec, seed: u64) -> Option<Self> {
        let sensor = camera.sensor.as_ref().filter(|_| camera.face.is_none() && camera.primary.is_none())?;
        Some(Self {
            spec: sensor.clone(),
            size_px: camera.size_px,
            exposure_ms: sensor.exposure_ms.unwrap_or(camera.nominal_exposure_ms()),
            shutter: camera.shutter.clone(),
            fps: camera.fps,
            seed,
            name: camera.name.clone(),
            timing: camera.timing.is_some().then(|| camera.clone()),
        })
    }
}

impl ImageSensor {
    /// The sensor of a camera, if it has one. `seed` is the scenario's.
    #[must_use]
    pub fn new(camera: &CameraSpec, seed: u64) -> Option<Self> {
        SensorKey::new(camera, seed).map(Self::of_key)
    }

    /// As [`Self::new`]; `before` is kept if it is that sensor.
    #[must_use]
    pub fn renewed(before: Option<Self>, camera: &CameraSpec, seed: u64) -> Option<Self> {
        let key = SensorKey::new(camera, seed)?;
        Some(match before {
            Some(before) if before.key == key => before,
            _ => Self::of_key(key),
        })
    }

    fn of_key(key: SensorKey) -> Self {
        let nominal = Exposed::new(&key);
        let draws = &*DRAWS;
        // The pictures of a burst have noise of their own each, but are of one sensor.
        let name = key.name.split('/').next().unwrap_or_default();
        let fixed = FixedPattern::new(&nominal.settings, draws, key.size_px, camera_seed(key.seed, name));
        // An invalid shutter has no frames.
        let shutter = Shutter::from_spec(&key.shutter, key.fps, key.size_px).ok();
        let row_gains = shutter.filter(|shutter| shutter.reset() == Reset::Global).map(|shutter| {
            let longer_ms = |line| 1e3 * (shutter.exposure_row_s(line) - shutter.exposure_s());
            let gain = |line| (1.0 + longer_ms(line) / key.exposure_ms) as f32;
            (shutter.row_axis(), (0..shutter.lines()).map(gain).collect())
        });
        Self { key, nominal, draws, fixed, row_gains }
    }

    /// Takes the picture of a frame with this stamp in path time, whose colours are the light: makes its raw
    /// picture, and of that its colours. `exposure` is the frame's own; `None` is the scenario's.
    pub fn expose(&self, frame: &mut RenderedFrame, stamp_s: f64, exposure: Option<&FrameExposure>) {
        let own = exposure.map(|exposure| Exposed::of_frame(&self.key, exposure));
        let exposed = own.as_ref().unwrap_or(&self.nominal);
        let faulty = self.key.timing.as_ref();
        let picture = faulty.map_or(frame.index, |camera| picture_of(camera, self.key.seed, frame.index));
        let raw = self.raw_of(exposed, picture as u32, stamp_s, frame.color_rgba());
        exposed.develop.develop(&raw, self.key.size_px, frame.color_rgba_mut());
        frame.set(Channel::Raw, PlaneValues::Raw(raw));
    }

    /// Digital numbers of the light of a frame, linear R G B A, row-major, with the scenario's exposure.
    #[must_use]
    pub fn raw(&self, frame: u32, stamp_s: f64, color_rgba: &[f32]) -> RawPicture {
        self.raw_of(&self.nominal, frame, stamp_s, color_rgba)
    }

    fn raw_of(&self, exposed: &Exposed, frame: u32, stamp_s: f64, color_rgba: &[f32]) -> RawPicture {
        let settings = &exposed.settings;
        let width = self.key.size_px[0] as usize;
        let channels = settings.channels();
        let mut values = vec![0_u16; self.key.size_px[1] as usize * width * channels];
        let seed = camera_seed(self.key.seed, &self.key.name);
        let columns = self.shared_noise(settings.column_noise_e, width as u32, frame, seed, stream::COLUMN);
        values
            .par_chunks_mut(width * channels)
            .zip(color_rgba.par_chunks(width * 4))
            .enumerate()
            .for_each_init(
                || RowScratch::new(width),
                |scratch, (y, (codes, rgba))| {
                    let (y, columns) = (y as u32, &columns);
                    let row = RowJob { sensor: self, exposed, y, frame, stamp_s, seed, columns };
                    row.expose(rgba, codes, scratch);
                },
            );
        RawPicture { channels: channels as u32, bits: settings.bits, values }
    }

    /// Noise that the pixels of each row or column share, electrons; empty without.
    fn shared_noise(&self, sigma_e: f32, count: u32, frame: u32, seed: u64, stream: u32) -> Vec<f32> {
        if sigma_e == 0.0 {
            return Vec::new();
        }
        let noise = |i| sigma_e * self.draws.normal(two_words(i, frame, seed, stream)[0]);
        (0..count).map(noise).collect()
    }
}

/// Memory of a row.
struct RowScratch {
    electrons: Vec<f32>,
    words: Vec<[u32; 2]>,
}

impl RowScratch {
    fn new(width: usize) -> Self {
        Self { electrons: vec![0.0; width], words: vec![[0; 2]; width] }
    }
}

/// One row of a frame.
struct RowJob<'a> {
    sensor: &'a ImageSensor,
    exposed: &'a Exposed,
    y: u32,
    frame: u32,
    stamp_s: f64,
    seed: u64,
    columns: &'a [f32],
}

impl RowJob<'_> {
    fn expose(&self, rgba: &[f32], codes: &mut [u16], scratch: &mut RowScratch) {
        let settings = &self.exposed.settings;
        let channels = settings.channels();
        for channel in 0..channels {
            self.light(rgba, channel, &mut scratch.electrons);
            if let Some(flicker) = &self.exposed.flicker {
                flicker.light(self.y, self.stamp_s, &mut scratch.electrons);
            }
            self.dark(channel, &mut scratch.electrons);
            self.wait_for_readout(&mut scratch.electrons);
            self.words(channel as u32, &mut scratch.words);
            self.count(scratch);
            self.digits(channel, scratch, codes);
        }
        let first = self.y as usize * codes.len();
        self.sensor
            .fixed
            .dead_in(first..first + codes.len())
            .for_each(|i| codes[i - first] = settings.black_code);
    }

    /// Mean electrons by light: those of a mosaic by the colour of each pixel.
    fn light(&self, rgba: &[f32], channel: usize, electrons: &mut [f32]) {
        let settings = &self.exposed.settings;
        let pixels = rgba.chunks_exact(4);
        match settings.mosaic {
            Mosaic::None => {
                let weights = settings.weights[channel];
                electrons.iter_mut().zip(pixels).for_each(|(e, p)| *e = weighed(weights, p));
            }
            Mosaic::Mono => {
                let weights = settings.weights[3];
                electrons.iter_mut().zip(pixels).for_each(|(e, p)| *e = weighed(weights, p));
            }
            mosaic => {
                let of_column: [[f32; 3]; 4] =
                    [0, 1, 2, 3].map(|x| settings.weights[demosaic::color_at(mosaic, [x, self.y]) as usize]);
                for (electrons, pixels) in electrons.chunks_mut(4).zip(rgba.chunks(16)) {
                    let pixels = pixels.chunks_exact(4).zip(of_column);
                    electrons.iter_mut().zip(pixels).for_each(|(e, (p, weights))| *e = weighed(weights, p));
                }
            }
        }
    }

    /// Gains of the pixels, and dark current.
    fn dark(&self, channel: usize, electrons: &mut [f32]) {
        let (settings, fixed) = (&self.exposed.settings, &self.sensor.fixed);
        let channels = settings.channels();
        let first = self.y as usize * electrons.len() * channels;
        let dark_e = settings.dark_e;
        match fixed.gains_from(first + channel) {
            Some(gains) => {
                let gains = gains.iter().step_by(channels);
                electrons.iter_mut().zip(gains).for_each(|(e, gain)| *e = *e * *gain + dark_e);
            }
            None => electrons.iter_mut().for_each(|e| *e += dark_e),
        }
        for &(i, relative) in fixed.hot_in(first..first + electrons.len() * channels) {
            let i = i as usize - first;
            if i % channels == channel {
                electrons[i / channels] += settings.hot_e * relative;
            }
        }
    }

    /// What rows collect more that are exposed until they are read.
    fn wait_for_readout(&self, electrons: &mut [f32]) {
        match &self.sensor.row_gains {
            None => {}
            Some((RowAxis::Rows, gains)) => {
                let gain = gains[self.y as usize];
                electrons.iter_mut().for_each(|e| *e *= gain);
            }
            Some((RowAxis::Columns, gains)) => {
                electrons.iter_mut().zip(gains).for_each(|(e, gain)| *e *= gain);
            }
        }
    }

    fn words(&self, channel: u32, words: &mut [[u32; 2]]) {
        let (row, stream) = (self.y << 16, stream::PIXEL + channel);
        for (x, words) in (0..).zip(words) {
            *words = two_words(x | row, self.frame, self.seed, stream);
        }
    }

    /// Electrons instead of their means.
    fn count(&self, scratch: &mut RowScratch) {
        let (settings, draws) = (&self.exposed.settings, self.sensor.draws);
        let full_e = settings.full_well_e;
        for (e, words) in scratch.electrons.iter_mut().zip(&scratch.words) {
            let counted = if settings.shot_noise { draws.poisson(*e, words[0]) } else { *e };
            *e = counted.min(full_e);
        }
    }

    /// Digital numbers of electrons, with the noise that is added to them.
    fn digits(&self, channel: usize, scratch: &RowScratch, codes: &mut [u16]) {
        let ImageSensor { draws, fixed, .. } = self.sensor;
        let settings = &self.exposed.settings;
        let channels = settings.channels();
        let first = self.y as usize * codes.len();
        let offsets = fixed.offsets_from(first + channel);
        let row_e = self.row_noise();
        for (x, (e, words)) in scratch.electrons.iter().zip(&scratch.words).enumerate() {
            let mut e = *e + row_e;
            if settings.read_noise_e > 0.0 {
                e += settings.read_noise_e * draws.normal(words[1]);
            }
            if let Some(offsets) = offsets {
                e += offsets[x * channels];
            }
            if let Some(column) = self.columns.get(x) {
                e += *column;
            }
            codes[x * channels + channel] = settings.code(e);
        }
    }

    fn row_noise(&self) -> f32 {
        let (settings, draws) = (&self.exposed.settings, self.sensor.draws);
        match settings.row_noise_e {
            0.0 => 0.0,
            sigma_e => sigma_e * draws.normal(two_words(self.y, self.frame, self.seed, stream::ROW)[0]),
        }
    }
}

/// Electrons of a pixel's light; none if that is not a number.
#[inline(always)]
fn weighed(weights: [f32; 3], pixel: &[f32]) -> f32 {
    (weights[0] * pixel[0] + weights[1] * pixel[1] + weights[2] * pixel[2]).max(0.0)
}

#[cfg(test)]
mod tests;
