//! Texture of terrain without an ortho-image: hypsometric tints, hillshaded from the north-west if the scene
//! has no light.

use camsim_core::scene::{Encoding, Texture};
use glam::DVec3;
use rayon::prelude::*;

/// Hypsometric tints from the lowest to the highest point, sRGB.
const TINTS: [[f64; 3]; 5] = [
    [88.0, 125.0, 78.0],
    [140.0, 155.0, 95.0],
    [170.0, 150.0, 115.0],
    [150.0, 138.0, 128.0],
    [235.0, 235.0, 238.0],
];

/// Relative light on faces turned away from the sun.
const AMBIENT: f64 = 0.35;

/// Number of rows that are processed together.
const BAND_ROWS: usize = 32;

/// A texture with one pixel per height, hillshaded if `is_shaded`; voids are transparent. `height_m` and
/// `point_ned_m` take column and row.
pub(super) fn shaded_relief(
    size: [u32; 2],
    [low, high]: [f64; 2],
    height_m: &(dyn Fn([u32; 2]) -> f64 + Sync),
    point_ned_m: &(dyn Fn([u32; 2]) -> DVec3 + Sync),
    is_shaded: bool,
) -> Texture {
    let [cols, rows] = size.map(|n| n as usize);
    // The direction of a sun in the north-west, 45 degrees up.
    let to_sun = DVec3::new(0.5, -0.5, -std::f64::consts::FRAC_1_SQRT_2);
    let mut rgba8 = vec![0; 4 * cols * rows];
    rgba8.par_chunks_mut(4 * cols * BAND_ROWS).enumerate().for_each(|(band, pixels)| {
        // One more row on each side, for the slopes.
        let first = (band * BAND_ROWS).saturating_sub(1);
        let past = (band * BAND_ROWS + BAND_ROWS + 1).min(rows);
        let points: Vec<DVec3> =
            (first..past).flat_map(|j| (0..cols).map(move |i| point_ned_m([i as u32, j as u32]))).collect();
        let point = |i: usize, j: usize| points[(j - first) * cols + i];
        for (index, pixel) in pixels.chunks_exact_mut(4).enumerate() {
            let (i, j) = (index % cols, band * BAND_ROWS + index / cols);
            let height = height_m([i as u32, j as u32]);
            if height.is_nan() {
                continue;
            }
            let eastwards = point((i + 1).min(cols - 1), j) - point(i.saturating_sub(1), j);
            let southwards = point(i, (j + 1).min(rows - 1)) - point(i, j.saturating_sub(1));
            // Beside a void the slope is unknown and taken as level.
            let normal = southwards.cross(eastwards).try_normalize().unwrap_or(DVec3::NEG_Z);
            let upwards = if normal.z > 0.0 { -normal } else { normal };
            let relief =
                AMBIENT + (1.0 - AMBIENT) * upwards.dot(to_sun).max(0.0) / std::f64::consts::FRAC_1_SQRT_2;
            let light = if is_shaded { relief } else { 1.0 };
            let t = if high > low { (height - low) / (high - low) } else { 0.0 };
            for (byte, tint) in pixel.iter_mut().zip(tint(t)) {
                *byte = (tint * light).clamp(0.0, 255.0) as u8;
            }
            pixel[3] = 255;
        }
    });
    let mut texture = Texture { size_px: size, rgba8, encoding: Encoding::Srgb };
    texture.bleed_into_transparent();
    texture
}

/// The tint at a relative height of 0 to 1, sRGB.
fn tint(t: f64) -> [f64; 3] {
    let position = t.clamp(0.0, 1.0) * (TINTS.len() - 1) as f64;
    let below = (position as usize).min(TINTS.len() - 2);
    let fraction = position - below as f64;
    [0, 1, 2].map(|k: usize| TINTS[below][k] + fraction * (TINTS[below + 1][k] - TINTS[below][k]))
}
