//! Size and place of the ideal frame: a bound on the sources that the output frame needs.

use std::sync::Arc;

use glam::DVec2;

use super::{
    KeyFrame, TemporalStage,
    probes::{Probe, probes, spacing_px},
    surfaces::Surfaces,
};
use camsim_core::{
    camera::CameraModel,
    mount::CameraPath,
    shutter::Shutter,
    temporal::{IdealGeometry, displacement::Twist},
};

/// Grid step of the search for the lens's reach, pixels.
const STEP_PX: u32 = 4;
/// Directions in which the outermost ray of each band of lines is kept.
const DIRECTIONS: u32 = 32;
/// Bands of the image in each axis.
const BANDS: u32 = 8;
/// Rim for bilinear fetches, footprint taps, and what lies between the kept rays.
const RIM_PX: f64 = 4.0;

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
    pub(super) probes: Vec<Probe>,
    /// Side of the part of the image that each of them stands for, pixels.
    pub(super) probe_px: f64,
}

impl LensReach {
    /// Scans the image; `None` when no pixel has an ideal ray.
    #[must_use]
    pub fn new(camera: Arc<CameraModel>) -> Option<Self> {
        let candidates = candidates(&camera);
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
            candidates.iter().step_by(7).map(|(uv, _)| least_stretch(&camera, *uv)).collect();
        stretches.sort_by(f64::total_cmp);
        let least_stretch = stretches.get(stretches.len() / 10).copied().unwrap_or(1.0);
        let probes = probes(&camera);
        let probe_px = spacing_px(&camera);
        (!rays.is_empty()).then_some(Self { camera, rays, least_stretch, probes, probe_px })
    }

    /// The same with every second of its probes: two neighbours in time, one `odd` and one not, have all of
    /// them.
    pub(super) fn with_half_the_probes(&self, odd: bool) -> Self {
        self.with_every_second(|probe| probe.is_odd == odd)
    }

    /// Of those again every second: four neighbours in time have all.
    pub(super) fn with_half_of_these(&self, low: bool) -> Self {
        self.with_every_second(|probe| probe.is_low == low)
    }

    fn with_every_second(&self, is_one: impl Fn(&Probe) -> bool) -> Self {
        let Self { camera, rays, least_stretch, .. } = self;
        Self {
            camera: camera.clone(),
            rays: rays.clone(),
            least_stretch: *least_stretch,
            probes: self.probes.iter().filter(|probe| is_one(probe)).copied().collect(),
            probe_px: std::f64::consts::SQRT_2 * self.probe_px,
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
    if sigma2 > 0.0 { 1.0 / sigma2.sqrt() } else { 1.0 }
}

fn band_of(pixel: [u32; 2], size_px: [u32; 2]) -> u32 {
    let band = |at: u32, size: u32| (u64::from(at) * u64::from(BANDS) / u64::from(size)) as u32;
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
    let ray = |x: u32, y: u32| camera.unproject(DVec2::new(f64::from(x), f64::from(y)));
    let (xs, ys) = (ticks(width), ticks(height));
    use rayon::prelude::*;
    let grid: Vec<Vec<Option<DVec2>>> =
        ys.par_iter().map(|&y| xs.iter().map(|&x| ray(x, y)).collect()).collect();
    let mut found = Vec::new();
    for (j, &y) in ys.iter().enumerate() {
        for (i, &x) in xs.iter().enumerate() {
            found.extend(grid[j][i].map(|uv| (uv, [x, y])));
            let (Some(&x1), Some(&y1)) = (xs.get(i + 1), ys.get(j + 1)) else { continue };
            let valid =
                [grid[j][i], grid[j][i + 1], grid[j + 1][i], grid[j + 1][i + 1]].iter().flatten().count();
            if (1..4).contains(&valid) {
                found.extend(
                    (y..=y1)
                        .flat_map(|y| (x..=x1).map(move |x| (x, y)))
                        .filter_map(|(x, y)| ray(x, y).map(|uv| (uv, [x, y]))),
                );
            }
        }
    }
    found
}

/// Directions that an ideal frame holds, tangents in its own camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    low: DVec2,
    high: DVec2,
}

impl View {
    /// All of both.
    pub fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Its pixels. `scale` is that of its focal length to the camera's.
    pub fn pixels(self, camera: &CameraModel, scale: f64) -> IdealGeometry {
        let focal_px = camera.focal_px * scale;
        // Whole pixels from the camera's own principal point: without lens and motion the two frames' pixels
        // fall together.
        let principal_px = camera.principal_point_px;
        let first_px = (self.low * focal_px + principal_px).floor() - RIM_PX;
        let last_px = (self.high * focal_px + principal_px).ceil() + RIM_PX;
        let size = last_px - first_px + 1.0;
        let side = |length: f64| {
            if length.is_finite() { length.clamp(2.0, f64::from(u32::MAX / 2)) as u32 } else { u32::MAX / 2 }
        };
        IdealGeometry {
            size_px: [side(size.x), side(size.y)],
            focal_px,
            principal_px: principal_px - first_px,
        }
    }
}

/// What an ideal frame must show to hold every source of the frame: each kept ray at its own line's instants
/// (start, middle and end of the exposure), at infinity and at the nearest depth in view, in the two keys
/// that are nearest in time. A `demanded` constant-twist solver also looks where the point is not: there too,
/// and at the ray's own place, where it reads the depth.
pub(super) fn view(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    key_s: f64,
    keys: &[KeyFrame],
    surfaces: &Surfaces,
    demanded: Option<(TemporalStage, Twist)>,
) -> View {
    let key = path.pose(key_s);
    let (first, last) = shutter.window_s();
    let travel_m = super::travel_m(path, [stamp_s + first, stamp_s + last], key_s);
    let slant = reach.slant();
    let tangents = still_tangents(reach, slant);
    let inverse_near = 1.0 / surfaces.nearest_m(&key, tangents, travel_m);
    let mut view = View { low: DVec2::splat(f64::INFINITY), high: DVec2::splat(f64::NEG_INFINITY) };
    let last_row = reach.camera.size_px[1] - 1;
    // The grid of the reach steps over rows of one parity: a neighbour stands for the other field.
    let in_fields = reach.rays.iter().flat_map(|&(uv, [x, y])| {
        let other = if shutter.interlace_s() > 0.0 { Some((y ^ 1).min(last_row)) } else { None };
        std::iter::once(y).chain(other).map(move |y| (uv, shutter.dt_pixel_s(x, y)))
    });
    for (uv, dt_s) in in_fields {
        let mid_s = stamp_s + dt_s;
        let mut include = |at: DVec2| view = view.and(View { low: at, high: at });
        for phase in [-0.5, 0.0, 0.5] {
            let t_s = mid_s + phase * shutter.exposure_s();
            let pose = path.pose(t_s);
            for w in [0.0, inverse_near] {
                for key in super::keys::nearest_first(keys, mid_s).into_iter().take(2) {
                    let (rotation, shift) = pose.relative_to(&key.pose);
                    let in_key = rotation * uv.extend(1.0) + w * shift;
                    if in_key.z > 0.02 {
                        include(in_key.truncate() / in_key.z);
                    }
                }
                if let Some(at) =
                    demanded.and_then(|(stage, twist)| stage.displaced(uv, w, &twist, t_s - key_s))
                {
                    include(at);
                    include(uv);
                }
            }
        }
    }
    view
}

/// View of the camera were it still, with a tenth to spare.
fn still_tangents(reach: &LensReach, slant: f64) -> [f64; 4] {
    let mut tangents = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    for (uv, _) in &reach.rays {
        tangents =
            [tangents[0].min(uv.x), tangents[1].max(uv.x), tangents[2].min(uv.y), tangents[3].max(uv.y)];
    }
    let spare = 0.1 * slant;
    [tangents[0] - spare, tangents[1] + spare, tangents[2] - spare, tangents[3] + spare]
}
