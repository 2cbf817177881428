//! What the paper does with an ideal frame, for comparison: eq. 18 with the depth of one texel, a straight
//! path over the exposure, stored values, and fog at the end.
//!
//! | step | here | camsim's own |
//! |---|---|---|
//! | depth | nearest texel where the ray would look if nothing moved | bilinear where the ray does look |
//! | displacement | Heun's steps of at most 2.5 deg, constant twist and depth (another solver can be set beside it here, to tell causes apart) | exact relative pose |
//! | exposure | `blur_samples` samples, both ends included, on the straight segment between the two ends (eq. 20) | midpoints on the curved path |
//! | averages | of stored (sRGB-encoded) values | of light |
//! | pixel area | one bilinear sample | footprint taps |
//! | vignette, light, noise | on stored values | on light |
//! | fog | linear in slant range, after the blur, by the depth above | a part of the ideal frame |
//!
//! Row times, lens inverse, principal points and the vignette's rule are camsim's own: the paper means the
//! same. (The scenario's preset of this name also solves the lens as the paper does, in every frame, because
//! its time and its errors are of interest there.)

use glam::{DVec2, DVec3};

use super::{Pipeline, Unseen};
use crate::temporal::paper::{gather_straight, linear_fog};

/// Samples over the exposure, as in the paper's section 8.9.
pub const BLUR_SAMPLES: u32 = 100;

/// `mix(colour, fog, clamp(d / end_m, 0, 1))`, d = slant range; on stored values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFog {
    /// Distance from which on nothing but fog is seen, metres.
    pub end_m: f64,
    /// Its colour, stored values 0..=1.
    pub color: DVec3,
}

impl LinearFog {
    /// Fog over a stored colour that a ray meets at an inverse planar depth (0: the sky).
    #[must_use]
    pub fn over(&self, color: DVec3, uv: DVec2, inverse_depth: f64) -> DVec3 {
        linear_fog(color, self.color, uv, inverse_depth, self.end_m)
    }
}

impl Pipeline<'_> {
    /// Mean of stored values over the exposure, with fog. An error if either end of the path is outside of
    /// the ideal frame; between them nothing can be, because a rectangle holds the segment between any two of
    /// its points.
    pub(super) fn gather_paper(&self, uv: DVec2, dt_s: f64) -> Result<DVec3, Unseen> {
        let half_s = 0.5 * self.shutter.exposure_s();
        let ends_px =
            [self.source_of_ray(uv, dt_s - half_s)?.at_px, self.source_of_ray(uv, dt_s + half_s)?.at_px];
        let samples = if half_s > 0.0 { self.settings.blur_samples.unwrap_or(BLUR_SAMPLES) } else { 1 };
        let mean = gather_straight(ends_px, samples, &self.stored());
        Ok(self.settings.fog.map_or(mean, |fog| fog.over(mean, uv, self.inverse_depth_of_ray(uv))))
    }
}
