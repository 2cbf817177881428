//! Ideal rays of output pixels and their derivatives: twin of camsim-gpu/shaders/reverse/ray.

use camsim_core::camera::{CameraModel, INVALID_UV};

use super::{footprint::scaled, sideways::is_sideways};
use crate::large_pages::LargeArray;
use crate::simd::lanes::{LANES, Lanes, Lanes2, ZERO, per_lane};
use camsim_plan::uniforms::FrameUniforms;

/// Larger values in a lens map mean that the pixel has no ideal ray.
const INVALID_ABOVE: f32 = 0.1 * INVALID_UV;

/// A lens map: ideal (u, v) of pixels, row by row.
#[derive(Debug)]
pub struct LensMap {
    /// Ideal (u, v) of each pixel, or [`INVALID_UV`] twice.
    pub(crate) uv: LargeArray<[f32; 2]>,
}

impl LensMap {
    /// Lens map of a camera, by its f64 lens inverse.
    #[must_use]
    pub fn new(camera: &CameraModel) -> Self {
        let rays = camera.lens_inverse();
        let mut uv = LargeArray::zeros(rays.len());
        uv.copy_from_slice(&rays);
        Self { uv }
    }

    /// Ideal (u, v) of every pixel's centre, row-major.
    pub fn rays(&self) -> &[[f32; 2]] {
        &self.uv
    }
}

/// Rays of a block of pixels.
pub(super) struct BlockRays {
    pub uv: Lanes2,
    /// 1 for pixels with a ray, else 0.
    pub valid: Lanes,
}

/// Rays of a line from its pixel `x` on; lanes beyond the end have none.
#[inline(always)]
pub(super) fn rays(frame: &FrameUniforms, map: Option<&LensMap>, x: u32, y: u32) -> BlockRays {
    let width = frame.size_px[0];
    let (mut uv, mut valid) = (Lanes2::ZERO, ZERO);
    match map {
        Some(map) => {
            let row = &map.uv[(y * width + x) as usize..((y + 1) * width) as usize];
            let mut set = |i: usize, [u, v]: [f32; 2]| {
                let is_valid = u < INVALID_ABOVE;
                uv.x[i] = if is_valid { u } else { 0.0 };
                uv.y[i] = if is_valid { v } else { 0.0 };
                valid[i] = if is_valid { 1.0 } else { 0.0 };
            };
            // Most blocks are whole: a loop of known length is vectorised.
            match row.first_chunk::<LANES>() {
                Some(row) => {
                    for i in 0..LANES {
                        set(i, row[i]);
                    }
                }
                None => row.iter().enumerate().for_each(|(i, &uv)| set(i, uv)),
            }
        }
        None => {
            let at = |axis: usize, px: u32| (px as f32 - frame.principal_px[axis]) / frame.focal_px[axis];
            uv = match is_sideways(frame) {
                false => Lanes2 { x: per_lane(|i| at(0, x + i as u32)), y: [at(1, y); LANES] },
                true => Lanes2 { x: [at(0, y); LANES], y: per_lane(|i| at(1, x + i as u32)) },
            };
            valid = per_lane(|i| if x + (i as u32) < width { 1.0 } else { 0.0 });
        }
    }
    BlockRays { uv, valid }
}

/// Sides of the output pixels in the ideal frame, ideal pixels.
#[inline(always)]
pub(super) fn sides(frame: &FrameUniforms, map: Option<&LensMap>, x: u32, y: u32) -> [Lanes2; 2] {
    let Some(map) = map else {
        let [fx, fy] = [0, 1].map(|axis| frame.ideal_focal_px[axis] / frame.focal_px[axis]);
        return [Lanes2 { x: [fx; LANES], y: ZERO }, Lanes2 { x: ZERO, y: [fy; LANES] }];
    };
    let mut sides = [Lanes2::ZERO; 2];
    if !central_differences(frame.size_px, map, [x, y], &mut sides) {
        for i in 0..LANES.min((frame.size_px[0] - x) as usize) {
            let pixel = [x + i as u32, y];
            for (axis, side) in sides.iter_mut().enumerate() {
                [side.x[i], side.y[i]] = difference(frame.size_px, map, pixel, axis);
            }
        }
    }
    if is_sideways(frame) {
        sides.swap(0, 1);
    }
    sides.map(|side| scaled(&side, frame.ideal_focal_px))
}

/// Central differences of a whole block. Returns false if one of its pixels or of their neighbours has no ray
/// or is outside of the map.
#[inline(always)]
fn central_differences(size_px: [u32; 2], map: &LensMap, [x, y]: [u32; 2], sides: &mut [Lanes2; 2]) -> bool {
    let [width, height] = size_px.map(|side| side as usize);
    let (x, y) = (x as usize, y as usize);
    if x == 0 || x + LANES >= width || y == 0 || y + 1 >= height {
        return false;
    }
    let row = |y: usize, x: usize| map.uv[y * width + x..].first_chunk::<LANES>();
    let rows = [row(y - 1, x), row(y + 1, x), row(y, x - 1), row(y, x), row(y, x + 1)];
    let [Some(above), Some(below), Some(before), Some(here), Some(after)] = rows else { return false };
    let mut have_rays = true;
    for i in 0..LANES {
        for uv in [above, below, before, here, after] {
            have_rays &= uv[i][0] < INVALID_ABOVE;
        }
    }
    for i in 0..LANES {
        for k in 0..2 {
            let [across, down] = &mut *sides;
            let (across, down) =
                if k == 0 { (&mut across.x, &mut down.x) } else { (&mut across.y, &mut down.y) };
            across[i] = 0.5 * (after[i][k] - before[i][k]);
            down[i] = 0.5 * (below[i][k] - above[i][k]);
        }
    }
    have_rays
}

/// One-sided or central difference of the map along an axis, over valid texels only.
fn difference(size_px: [u32; 2], map: &LensMap, pixel: [u32; 2], axis: usize) -> [f32; 2] {
    let at = |index: u32| {
        let mut pixel = pixel;
        pixel[axis] = index;
        Some(map.uv[(pixel[1] * size_px[0] + pixel[0]) as usize]).filter(|uv| uv[0] < INVALID_ABOVE)
    };
    let index = pixel[axis];
    let after = (index + 1 < size_px[axis]).then(|| at(index + 1)).flatten();
    let before = index.checked_sub(1).and_then(at);
    let minus = |a: [f32; 2], b: [f32; 2], factor: f32| [factor * (a[0] - b[0]), factor * (a[1] - b[1])];
    match (before, at(index), after) {
        (Some(before), Some(_), Some(after)) => minus(after, before, 0.5),
        (None, Some(here), Some(after)) => minus(after, here, 1.0),
        (Some(before), Some(here), None) => minus(here, before, 1.0),
        _ => [0.0; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_differences_equal_pixel_differences() {
        let size_px: [u32; 2] = [4 * LANES as u32 + 5, 40];
        let mut map = LensMap { uv: LargeArray::zeros((size_px[0] * size_px[1]) as usize) };
        for (uv, i) in map.uv.iter_mut().zip(0..) {
            let [x, y] = [i % size_px[0], i / size_px[0]].map(|n| n as f32);
            *uv = [0.01 * x + 1e-4 * x * y, 0.01 * y - 2e-5 * x * x];
        }
        // Pixels without a ray: within a block, beside one, and in corners of the image.
        for [x, y] in [[40, 20], [95, 30], [31, 10], [0, 0], [132, 39]] {
            map.uv[(y * size_px[0] + x) as usize] = [INVALID_UV; 2];
        }
        let mut whole_blocks = 0;
        for y in 0..size_px[1] {
            for x in (0..size_px[0]).step_by(LANES) {
                let mut sides = [Lanes2::ZERO; 2];
                if !central_differences(size_px, &map, [x, y], &mut sides) {
                    continue;
                }
                whole_blocks += 1;
                for i in 0..LANES {
                    for (axis, side) in sides.iter().enumerate() {
                        let exact = difference(size_px, &map, [x + i as u32, y], axis);
                        assert_eq!([side.x[i], side.y[i]], exact, "{x}+{i}, {y}, {axis}");
                    }
                }
            }
        }
        // Of three blocks within the image in each of 38 rows, all but those with a ray missing above, below,
        // within, or beside.
        assert_eq!(whole_blocks, 3 * 38 - 3 - (3 + 1) - 1);
    }
}
