//! The lens as a blur: point spread and veiling glare, on the linear light of a finished exposure
//! (`[camera.point_spread]`; docs/theory/IMAGING.md).
//!
//! There is one implementation for all renderers. It follows the vignette, which dims the light of a point
//! before it is spread, and precedes the image sensor or the simple model's light and noise.

mod bessel;
mod beyond;
mod fourier;
mod kernel;
mod separable;
mod transfer;

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use crate::{
    exposure::FrameExposure,
    frame::RenderedFrame,
    imaging::with_facts,
    noise::{camera_seed, tail_table},
    photometric::{Photometry, photometric},
    scenario::{CameraSpec, LoadedFile, PointSpreadSpec},
    timing_faults::picture_of,
};

pub use kernel::{KernelError, SpreadKernel};
pub use transfer::LensTransfer;

use beyond::Nearest;
use fourier::Fourier;
use separable::Separable;

/// Components of a pixel in a picture: R, G, B, A.
const RGBA: usize = 4;

/// The blur of a camera's lens, ready for pictures of its size.
#[derive(Debug)]
pub struct Optics {
    key: OpticsKey,
    blur: Option<Blur>,
    /// `None` with an image sensor.
    simple: Option<SimpleModel>,
    /// Of the last pictures with pixels without a ray.
    nearest: Mutex<Option<Arc<Nearest>>>,
}

/// What an [`Optics`] is made of.
#[derive(Clone, Debug, PartialEq)]
struct OpticsKey {
    spec: PointSpreadSpec,
    /// Files are compared by content.
    kernel: Option<Arc<SpreadKernel>>,
    size_px: [u32; 2],
    sensor_pixel_um: Option<f64>,
    /// The camera, as far as its [`simple_model`] depends on it, and the scenario's seed; `None` with an image sensor.
    simple: Option<(CameraSpec, u64)>,
}

#[derive(Debug)]
enum Blur {
    Separable(Separable),
    Fourier(Fourier),
}

/// Light, noise, grey and saturation of `[camera.photometric]`, which follow the spread.
#[derive(Debug)]
struct SimpleModel {
    camera: CameraSpec,
    /// The scenario's seed.
    seed: u64,
    noise_table: Vec<f32>,
}

impl OpticsKey {
    /// `None` also for a face: light spreads over the whole picture, once its faces are joined.
    fn new(camera: &CameraSpec, seed: u64) -> Option<Self> {
        let spec =
            camera.point_spread.as_ref().filter(|_| camera.face.is_none() && camera.primary.is_none())?;
        Some(Self {
            spec: spec.clone(),
            kernel: spec.kernel.as_ref().and_then(LoadedFile::content),
            size_px: camera.size_px,
            sensor_pixel_um: camera.sensor.as_ref().and_then(|sensor| with_facts(sensor).pixel_um),
            simple: camera.sensor.is_none().then(|| (simple_model(camera), seed)),
        })
    }
}

/// What the simple model depends on.
fn simple_model(camera: &CameraSpec) -> CameraSpec {
    CameraSpec {
        name: camera.name.clone(),
        size_px: camera.size_px,
        fps: camera.fps,
        phase: camera.phase,
        photometric: camera.photometric.clone(),
        timing: camera.timing.clone(),
        ..CameraSpec::default()
    }
}

impl Optics {
    /// The optics of a camera with `[camera.point_spread]`. `seed` is the scenario's. A kernel whose file has
    /// not been read is ignored; [`crate::camera::CameraModel::from_spec`] refuses it.
    #[must_use]
    pub fn new(camera: &CameraSpec, seed: u64) -> Option<Self> {
        OpticsKey::new(camera, seed).map(Self::of_key)
    }

    /// As [`Self::new`]; `before` is kept if it is those optics.
    #[must_use]
    pub fn renewed(before: Option<Self>, camera: &CameraSpec, seed: u64) -> Option<Self> {
        let key = OpticsKey::new(camera, seed)?;
        Some(match before {
            Some(before) if before.key == key => before,
            _ => Self::of_key(key),
        })
    }

    fn of_key(key: OpticsKey) -> Self {
        let transfer = LensTransfer::of_spec(&key.spec, key.sensor_pixel_um);
        let separable = transfer.gaussian_alone_px().and_then(Separable::new);
        let blur = match separable {
            Some(separable) => Some(Blur::Separable(separable)),
            None if transfer.is_sharp() => None,
            None => Some(Blur::Fourier(Fourier::new(key.size_px, &transfer))),
        };
        let simple =
            key.simple.clone().map(|(camera, seed)| SimpleModel { camera, seed, noise_table: tail_table() });
        Self { key, blur, simple, nearest: Mutex::default() }
    }

    /// Spreads the light of a frame, and applies the simple model's light and noise unless the camera has a
    /// sensor. `exposure` is the frame's own, where automatic exposure sets it.
    pub fn expose(&self, frame: &mut RenderedFrame, exposure: Option<&FrameExposure>) {
        self.spread(frame.color_rgba_mut());
        if let Some(simple) = &self.simple {
            simple.expose(frame, exposure);
        }
    }

    /// Spreads light, linear R G B A. Pixels with A = 0 stay as they are and give no light; in their place,
    /// and beyond the picture, is the light of the nearest pixel.
    pub fn spread(&self, color_rgba: &mut [f32]) {
        if let Some(blur) = &self.blur {
            let filled = self.filled(color_rgba);
            match blur {
                Blur::Separable(blur) => blur.spread(self.key.size_px, &filled, color_rgba),
                Blur::Fourier(blur) => blur.spread(&filled, color_rgba),
            }
        }
        if self.key.spec.glare > 0.0 {
            add_glare(self.key.spec.glare, self.key.size_px[0] as usize, color_rgba);
        }
    }

    /// A copy of a picture in which pixels without a ray have the light of the nearest one.
    fn filled(&self, color_rgba: &[f32]) -> Vec<f32> {
        let mut filled = color_rgba.to_vec();
        if color_rgba.par_chunks_exact(RGBA).all(|rgba| rgba[3] > 0.0) {
            return filled;
        }
        let valid: Vec<bool> = color_rgba.par_chunks_exact(RGBA).map(|rgba| rgba[3] > 0.0).collect();
        let mut kept = self.nearest.lock().unwrap_or_else(PoisonError::into_inner);
        let nearest = match &*kept {
            Some(nearest) if *nearest.valid() == valid => nearest.clone(),
            _ => Arc::new(Nearest::new(valid, self.key.size_px[0] as usize)),
        };
        *kept = Some(nearest.clone());
        drop(kept);
        nearest.fill(&mut filled);
        filled
    }
}

impl SimpleModel {
    fn expose(&self, frame: &mut RenderedFrame, exposure: Option<&FrameExposure>) {
        let Self { camera, seed, noise_table } = self;
        let stage = Photometry::whole(camera, exposure);
        let picture = picture_of(camera, *seed, frame.index) as u32;
        let seed = camera_seed(*seed, &camera.name);
        let rows = frame.color_rgba_mut().par_chunks_mut(RGBA * camera.size_px[0] as usize).enumerate();
        rows.for_each(|(y, row)| {
            for (x, rgba) in row.chunks_exact_mut(RGBA).enumerate().filter(|(_, rgba)| rgba[3] > 0.0) {
                let (pixel, color) = ([x as u32, y as u32], [rgba[0], rgba[1], rgba[2]]);
                let value = photometric(&stage, color, 1.0, pixel, picture, seed, noise_table);
                rgba[..3].copy_from_slice(&value);
            }
        });
    }
}

/// `(1 - fraction) L + fraction mean(L)`, with the mean over the pixels that have a ray, of each channel.
fn add_glare(fraction: f64, width: usize, color_rgba: &mut [f32]) {
    // Sums of rows, so that the result does not depend on the number of threads.
    let sums: Vec<[f64; RGBA]> = color_rgba
        .par_chunks(RGBA * width)
        .map(|row| {
            row.chunks_exact(RGBA).filter(|rgba| rgba[3] > 0.0).fold([0.0; RGBA], |sum, rgba| {
                [0, 1, 2, 3].map(|k: usize| sum[k] + if k == 3 { 1.0 } else { f64::from(rgba[k]) })
            })
        })
        .collect();
    let sum = sums.iter().fold([0.0; RGBA], |sum, row| [0, 1, 2, 3].map(|k: usize| sum[k] + row[k]));
    if sum[3] == 0.0 {
        return;
    }
    let veil = [0, 1, 2].map(|k: usize| (fraction * sum[k] / sum[3]) as f32);
    let left = (1.0 - fraction) as f32;
    color_rgba.par_chunks_exact_mut(RGBA).filter(|rgba| rgba[3] > 0.0).for_each(|rgba| {
        rgba.iter_mut().zip(veil).for_each(|(value, veil)| *value = left * *value + veil);
    });
}

/// Copies the colours of a row that light has been spread over, where the picture has a ray. Transfer
/// functions that end at the Nyquist frequency let sharp borders swing, by some 1 % of their step; light is
/// not negative.
fn put_row(light: impl Iterator<Item = [f32; 3]>, row_rgba: &mut [f32]) {
    for (rgba, light) in row_rgba.chunks_exact_mut(RGBA).zip(light) {
        if rgba[3] > 0.0 {
            rgba[..3].copy_from_slice(&light.map(|value| value.max(0.0)));
        }
    }
}

#[cfg(test)]
mod tests;
