//! The outermost rays of a camera, and its probes.

use std::{borrow::Cow, sync::Arc};

use camsim_core::camera::CameraModel;
use glam::DVec2;

use super::probes::{Probe, probes, same_probe, spacing_px};

/// Grid step of the search for the lens's reach, pixels.
const STEP_PX: u32 = 4;
/// Directions in which the outermost ray of each band of lines is kept.
const DIRECTIONS: u32 = 32;
/// Bands of the image in each axis.
const BANDS: u32 = 8;

/// The outermost ideal rays of a camera, each with the pixel it belongs to.
#[derive(Debug)]
pub struct LensReach {
    /// The camera.
    pub camera: Arc<CameraModel>,
    /// Ideal rays and their pixels.
    pub rays: Vec<(DVec2, [u32; 2])>,
    /// d(ideal px)/d(output px) in its lesser direction, tenth percentile over the image: below 1 the lens
    /// magnifies.
    pub least_stretch: f64,
    /// Pixels at which errors are predicted.
    pub(crate) probes: Vec<Probe>,
    /// Side of the part of the image that each of them stands for, pixels.
    pub(crate) probe_px: f64,
    /// The cameras of red and blue, where these are others: their rays are among the outermost.
    pub others: Option<[Arc<CameraModel>; 2]>,
}

impl LensReach {
    /// Scans the image; `None` when no pixel has an ideal ray.
    #[must_use]
    pub fn new(camera: Arc<CameraModel>) -> Option<Self> {
        Self::with_others(camera, None)
    }

    /// As [`LensReach::new`], with the cameras of red and blue.
    #[must_use]
    pub fn with_others(camera: Arc<CameraModel>, others: Option<[Arc<CameraModel>; 2]>) -> Option<Self> {
        let own = candidates(&camera);
        let of_others = others.iter().flatten().flat_map(|other| self::candidates(other));
        let candidates: Vec<_> = own.iter().copied().chain(of_others).collect();
        let mut rays = Vec::new();
        for band in 0..BANDS * BANDS {
            let of_band: Vec<_> =
                candidates.iter().filter(|(_, pixel)| band_of(*pixel, camera.size_px) == band).collect();
            for k in 0..DIRECTIONS {
                let direction =
                    DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS));
                if let Some(&&outermost) =
                    of_band.iter().max_by(|a, b| a.0.dot(direction).total_cmp(&b.0.dot(direction)))
                    && !rays.contains(&outermost)
                {
                    rays.push(outermost);
                }
            }
        }
        // A tenth of the pixels may be magnified more: finer ideal pixels for a few corners would cost time
        // in all of the image.
        let mut stretches: Vec<f64> =
            own.iter().step_by(7).map(|(uv, _)| least_stretch(&camera, *uv)).collect();
        stretches.sort_by(f64::total_cmp);
        let least_stretch = stretches.get(stretches.len() / 10).copied().unwrap_or(1.0);
        let probes = probes(&camera);
        let probe_px = spacing_px(&camera);
        (!own.is_empty()).then_some(Self { camera, rays, least_stretch, probes, probe_px, others })
    }

    /// The probes with the rays of green, red and blue in turn, where these differ.
    pub(crate) fn probes_of_colors(&self) -> Cow<'_, [Probe]> {
        let Some([red, blue]) = &self.others else { return Cow::Borrowed(&self.probes) };
        let cameras = [&self.camera, red, blue];
        let turn = |(i, probe): (usize, &Probe)| same_probe(cameras[i % 3], probe);
        Cow::Owned(self.probes.iter().enumerate().filter_map(turn).collect())
    }

    /// The lens with a quarter of its probes: four frames, of which two are `odd` and two `low`, have all of them.
    pub(crate) fn with_a_quarter_of_the_probes(&self, [odd, low]: [bool; 2]) -> Self {
        let Self { camera, rays, least_stretch, others, .. } = self;
        let is_one = |probe: &&Probe| (probe.is_odd, probe.is_low) == (odd, low);
        Self {
            camera: camera.clone(),
            rays: rays.clone(),
            least_stretch: *least_stretch,
            probes: self.probes.iter().filter(is_one).copied().collect(),
            probe_px: 2.0 * self.probe_px,
            others: others.clone(),
        }
    }

    /// Ideal pixels for each of the camera's, at least: a lens that magnifies somewhere needs a finer ideal
    /// frame there; beyond 2 the memory is not worth it.
    #[must_use]
    pub fn least_scale(&self) -> f64 {
        (1.0 / self.least_stretch).clamp(1.0, 2.0)
    }

    /// Largest `sqrt(1 + u^2 + v^2)`: slant range over planar depth.
    #[must_use]
    pub fn slant(&self) -> f64 {
        self.rays.iter().map(|(uv, _)| (1.0 + uv.length_squared()).sqrt()).fold(1.0, f64::max)
    }
}

/// Smallest singular value of d(ideal px)/d(output px) at an ideal ray.
fn least_stretch(camera: &CameraModel, uv: DVec2) -> f64 {
    let forward = camera.lens.jacobian(uv);
    // sigma_max of the forward map, from the trace and determinant of J^T J.
    let t = forward.x_axis.length_squared() + forward.y_axis.length_squared();
    let d = forward.determinant();
    let sigma2 = 0.5 * (t + (t * t - 4.0 * d * d).max(0.0).sqrt());
    if sigma2 > 0.0 { camera.lens.axial_magnification() / sigma2.sqrt() } else { 1.0 }
}

fn band_of(pixel: [u32; 2], size_px: [u32; 2]) -> u32 {
    let band = |pixel: u32, size: u32| (u64::from(pixel) * u64::from(BANDS) / u64::from(size)) as u32;
    band(pixel[1], size_px[1]) * BANDS + band(pixel[0], size_px[0])
}

/// Valid pixels on a coarse grid that includes the borders, and every pixel of cells that the edge of
/// validity crosses.
fn candidates(camera: &CameraModel) -> Vec<(DVec2, [u32; 2])> {
    let [width, height] = camera.size_px;
    let ticks = |size: u32| {
        (0..size)
            .step_by(STEP_PX as usize)
            .chain((!(size - 1).is_multiple_of(STEP_PX)).then_some(size - 1))
            .collect::<Vec<u32>>()
    };
    let ray = |x: u32, y: u32| camera.unproject_pixel([x, y]);
    let (xs, ys) = (ticks(width), ticks(height));
    use rayon::prelude::*;
    let grid: Vec<Vec<Option<DVec2>>> =
        ys.par_iter().map(|&y| xs.iter().map(|&x| ray(x, y)).collect()).collect();
    let mut candidates = Vec::new();
    for (j, &y) in ys.iter().enumerate() {
        for (i, &x) in xs.iter().enumerate() {
            candidates.extend(grid[j][i].map(|uv| (uv, [x, y])));
            let (Some(&x1), Some(&y1)) = (xs.get(i + 1), ys.get(j + 1)) else { continue };
            let valid =
                [grid[j][i], grid[j][i + 1], grid[j + 1][i], grid[j + 1][i + 1]].iter().flatten().count();
            if (1..4).contains(&valid) {
                candidates.extend(
                    (y..=y1)
                        .flat_map(|y| (x..=x1).map(move |x| (x, y)))
                        .filter_map(|(x, y)| ray(x, y).map(|uv| (uv, [x, y]))),
                );
            }
        }
    }
    candidates
}
