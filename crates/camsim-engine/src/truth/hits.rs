//! Depth and coordinates by rays in f64, those of neighbouring pixels together.

use camsim_core::scene::ray_packet::{PACKET_RAYS, RayPacket};
use camsim_plan::{FramePlan, FrameRays, PixelHit, PixelTruth, uniforms::Truth};
use glam::DVec2;
use rayon::prelude::*;

/// Pixels along a side of a packet.
pub(super) const SIDE: usize = 8;

/// Places of a packet's pixels among `count` pixels of rows of `width`: a square whose first pixel is at `x`, `y`,
/// with every `step`-th row.
pub(super) fn square(
    width: usize,
    count: usize,
    [x, y]: [usize; 2],
    step: usize,
) -> [Option<usize>; PACKET_RAYS] {
    std::array::from_fn(|i| {
        let at = width * (y + step * (i / SIDE)) + x + i % SIDE;
        (x + i % SIDE < width && at < count).then_some(at)
    })
}

/// What the ray of every valid pixel meets. Depths and coordinates of `truth` become those of the rays; surfaces
/// go to `hits`, if given, where the sky and pixels without a ray stay as they are. Pixels are valid where
/// `color_rgba` says so.
pub(crate) fn of_all_pixels(
    truth: &mut [Truth],
    color_rgba: &[f32],
    plan: &FramePlan,
    rays: &FrameRays<'_>,
    hits: Option<&mut [Option<PixelHit>]>,
) {
    let width = plan.camera.size_px[0] as usize;
    // Rows of a field are read one after the other.
    let step = if plan.shutter.interlace_s() > 0.0 { 2 } else { 1 };
    let band = SIDE * step * width;
    let hits: Vec<&mut [Option<PixelHit>]> = match hits {
        Some(hits) => hits.chunks_mut(band).collect(),
        None => (0..truth.len().div_ceil(band)).map(|_| Default::default()).collect(),
    };
    let bands = truth.par_chunks_mut(band).zip(color_rgba.par_chunks(4 * band)).zip(hits).enumerate();
    bands.for_each_init(RayPacket::default, |packet, (number, ((truth, color_rgba), hits))| {
        let mut band = Band { width, first_row: number * SIDE * step, step, truth, color_rgba, hits };
        for first in 0..step {
            for x in (0..width).step_by(SIDE) {
                band.cast(rays, packet, [x, first]);
            }
        }
    });
}

/// Some rows of a frame.
struct Band<'a> {
    width: usize,
    first_row: usize,
    /// Distance of two rows of a field.
    step: usize,
    truth: &'a mut [Truth],
    color_rgba: &'a [f32],
    /// Empty where they are not wanted.
    hits: &'a mut [Option<PixelHit>],
}

impl Band<'_> {
    /// Casts the rays of a square whose first pixel is at `x` and `y` of the band.
    fn cast(&mut self, rays: &FrameRays<'_>, packet: &mut RayPacket, [x, y]: [usize; 2]) {
        let is_valid = |&at: &usize| self.color_rgba[4 * at + 3] > 0.0;
        let places = square(self.width, self.truth.len(), [x, y], self.step).map(|at| at.filter(is_valid));
        let pixel = |at: usize| {
            let position = [(at % self.width) as u32, (self.first_row + at / self.width) as u32];
            let [u, v] = self.truth[at].uv.map(f64::from);
            (position, DVec2::new(u, v))
        };
        let pixels = places.map(|at| at.map(pixel));
        rays.cast_packet(packet, &pixels, |i, seen| {
            let Some(at) = places[i] else { return };
            set(&mut self.truth[at], &seen);
            if let Some(hit) = self.hits.get_mut(at) {
                *hit = seen.hit;
            }
        });
    }
}

fn set(truth: &mut Truth, seen: &PixelTruth) {
    truth.source_px = seen.source_px.as_vec2().to_array();
    truth.point_ned_m = seen.hit.map_or([0.0; 3], |hit| hit.point_ned_m.as_vec3().to_array());
    truth.depth_m = seen.hit.map_or(0.0, |hit| hit.depth_m as f32);
}
