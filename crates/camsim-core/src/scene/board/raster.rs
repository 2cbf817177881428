//! Rasterisation of a board: coverage of each texel by black.

use glam::DVec2;

use super::{
    AIM_TEXELS, MIN_TEXELS,
    layout::{BoardShape, Layout},
};
use crate::scene::{Encoding, Texture};

/// Scan lines per texel along which the coverage by a circle is integrated.
const LINES: u32 = 32;
/// Distance from a texel border within which an edge counts as aligned with it, texels.
const ALIGNED: f64 = 1e-6;

/// Texel size and texture size of a board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub texel_m: DVec2,
    /// Columns and rows of the texture; whole numbers.
    pub texels: DVec2,
    /// Texels between the border of the texture and the area within the margin; whole numbers.
    pub margin_texels: DVec2,
}

impl Scale {
    /// The smallest number of texels per unit, from the least to twice that, at which all edges lie between
    /// texels; the least if there is none.
    pub fn new(layout: &Layout, margin_m: f64) -> Self {
        let across = ((layout.high_m - layout.low_m) / layout.unit_m).max_element();
        let least = (MIN_TEXELS / layout.units).max(AIM_TEXELS / across).ceil() as u32;
        let aligned = |&n: &u32| {
            let texel_m = layout.unit_m / f64::from(n);
            let between = |position_m: DVec2| {
                let texel = (position_m - layout.low_m) / texel_m;
                (texel - texel.round()).abs().max_element() < ALIGNED
            };
            layout.shapes.iter().all(|shape| match *shape {
                BoardShape::Rect { low_m, high_m } => between(low_m) && between(high_m),
                BoardShape::Disc { .. } => true,
            })
        };
        let n = (least..=2 * least).find(aligned).unwrap_or(least);
        let texel_m = layout.unit_m / f64::from(n);
        let margin_texels = (margin_m / texel_m - ALIGNED).ceil();
        let inside = ((layout.high_m - layout.low_m) / texel_m - ALIGNED).ceil();
        Self { texel_m, texels: (inside + 2.0 * margin_texels).max(DVec2::ONE), margin_texels }
    }

    fn texel_of(&self, layout: &Layout, position_m: DVec2) -> DVec2 {
        (position_m - layout.low_m) / self.texel_m + self.margin_texels
    }
}

pub(super) fn draw(layout: &Layout, scale: &Scale) -> Texture {
    let size = [scale.texels.x as u32, scale.texels.y as u32];
    let mut black = vec![0.0_f32; size[0] as usize * size[1] as usize];
    for shape in &layout.shapes {
        match *shape {
            BoardShape::Rect { low_m, high_m } => {
                let (low, high) = (scale.texel_of(layout, low_m), scale.texel_of(layout, high_m));
                add(&mut black, size, low, high, |x, y| {
                    overlap(x, low.x, high.x) * overlap(y, low.y, high.y)
                });
            }
            BoardShape::Disc { centre_m, radius_m } => {
                let (centre, radii) = (scale.texel_of(layout, centre_m), radius_m / scale.texel_m);
                add(&mut black, size, centre - radii, centre + radii, |x, y| disc(x, y, centre, radii));
            }
        }
    }
    let gray = black.iter().map(|black| (255.0 * (1.0 - black.clamp(0.0, 1.0)) + 0.5) as u8);
    Texture {
        size_px: size,
        rgba8: gray.flat_map(|gray| [gray, gray, gray, 255]).collect(),
        encoding: Encoding::Linear,
    }
}

/// Adds a coverage to each texel between two corners.
fn add(black: &mut [f32], size: [u32; 2], low: DVec2, high: DVec2, fraction: impl Fn(f64, f64) -> f64) {
    let range = |low: f64, high: f64, side: u32| {
        (low.floor().max(0.0) as u32)..(high.ceil().clamp(0.0, f64::from(side)) as u32)
    };
    for y in range(low.y, high.y, size[1]) {
        for x in range(low.x, high.x, size[0]) {
            if let Some(texel) = black.get_mut((y * size[0] + x) as usize) {
                *texel += fraction(f64::from(x), f64::from(y)) as f32;
            }
        }
    }
}

/// Overlap of the texel that begins at `at` with an interval.
fn overlap(at: f64, low: f64, high: f64) -> f64 {
    (high.min(at + 1.0) - low.max(at)).max(0.0)
}

/// Coverage of a texel by an axis-aligned ellipse: the mean over scan lines, each of them exact.
fn disc(x: f64, y: f64, centre: DVec2, radii: DVec2) -> f64 {
    let line = |k: u32| {
        let across = (y + (f64::from(k) + 0.5) / f64::from(LINES) - centre.y) / radii.y;
        let half = radii.x * (1.0 - across * across).max(0.0).sqrt();
        overlap(x, centre.x - half, centre.x + half)
    };
    (0..LINES).map(line).sum::<f64>() / f64::from(LINES)
}
