//! Ideal rays of pixels and how they change from pixel to pixel: twin of shaders/reverse/ray.

use camsim_core::camera::INVALID_UV;

use super::footprint::scaled;
use crate::host::lanes::{LANES, Lanes, Lanes2, ZERO, each};
use crate::layout::FrameUniforms;

/// Above this a lens map says "no pre-image".
const INVALID_ABOVE: f32 = 0.1 * INVALID_UV;

/// A lens map in the host's memory: ideal (u, v) of pixels, row by row.
#[derive(Clone, Debug)]
pub(crate) struct LensMapOnHost {
    /// Ideal rays, or [`INVALID_UV`] twice.
    pub uv: Vec<[f32; 2]>,
}

/// Rays of some pixels.
pub(super) struct Rays {
    pub uv: Lanes2,
    /// Whether there are any: 1, else 0.
    pub valid: Lanes,
}

/// Of a row from `x` on; places beyond its end have none.
#[inline(always)]
pub(super) fn rays(frame: &FrameUniforms, map: Option<&LensMapOnHost>, x: u32, y: u32) -> Rays {
    let width = frame.size_px[0];
    let (mut uv, mut valid) = (Lanes2::ZERO, ZERO);
    match map {
        Some(map) => {
            let row = &map.uv[(y * width + x) as usize..((y + 1) * width) as usize];
            for (i, &[u, v]) in row.iter().take(LANES).enumerate() {
                let is_valid = u < INVALID_ABOVE;
                uv.x[i] = if is_valid { u } else { 0.0 };
                uv.y[i] = if is_valid { v } else { 0.0 };
                valid[i] = if is_valid { 1.0 } else { 0.0 };
            }
        }
        None => {
            let ([cx, cy], [fx, fy]) = (frame.principal_px, frame.focal_px);
            uv = Lanes2 { x: each(|i| ((x + i as u32) as f32 - cx) / fx), y: each(|_| (y as f32 - cy) / fy) };
            valid = each(|i| if x + (i as u32) < width { 1.0 } else { 0.0 });
        }
    }
    Rays { uv, valid }
}

/// Sides of the pixels in the ideal frame.
#[inline(always)]
pub(super) fn sides(frame: &FrameUniforms, map: Option<&LensMapOnHost>, x: u32, y: u32) -> [Lanes2; 2] {
    let Some(map) = map else {
        let [fx, fy] = [0, 1].map(|axis| frame.ideal_focal_px[axis] / frame.focal_px[axis]);
        return [Lanes2 { x: [fx; LANES], y: ZERO }, Lanes2 { x: ZERO, y: [fy; LANES] }];
    };
    let mut sides = [Lanes2::ZERO; 2];
    for i in 0..LANES.min((frame.size_px[0] - x) as usize) {
        let pixel = [x + i as u32, y];
        for (axis, side) in sides.iter_mut().enumerate() {
            [side.x[i], side.y[i]] = difference(frame.size_px, map, pixel, axis);
        }
    }
    [scaled(&sides[0], frame.ideal_focal_px), scaled(&sides[1], frame.ideal_focal_px)]
}

/// One-sided or central difference of the map along an axis, over valid texels only.
fn difference(size_px: [u32; 2], map: &LensMapOnHost, pixel: [u32; 2], axis: usize) -> [f32; 2] {
    let at = |place: u32| {
        let mut pixel = pixel;
        pixel[axis] = place;
        Some(map.uv[(pixel[1] * size_px[0] + pixel[0]) as usize]).filter(|uv| uv[0] < INVALID_ABOVE)
    };
    let place = pixel[axis];
    let after = (place + 1 < size_px[axis]).then(|| at(place + 1)).flatten();
    let before = place.checked_sub(1).and_then(at);
    let minus = |a: [f32; 2], b: [f32; 2], factor: f32| [factor * (a[0] - b[0]), factor * (a[1] - b[1])];
    match (before, at(place), after) {
        (Some(before), Some(_), Some(after)) => minus(after, before, 0.5),
        (None, Some(here), Some(after)) => minus(after, here, 1.0),
        (Some(before), Some(here), None) => minus(here, before, 1.0),
        _ => [0.0; 2],
    }
}
