//! The paper's methods on an ideal frame, for comparison: eq. 18 with the depth of one texel, a straight
//! exposure path, averages of stored values, and fog at the end.
//!
//! | step | here | default preset |
//! |---|---|---|
//! | depth | nearest texel at the position without motion | bilinear at the source |
//! | displacement | Heun's steps of at most 2.5 deg, constant twist and depth (another solver may be combined with it, to separate causes of error) | exact relative pose |
//! | exposure | `blur_samples` samples, both ends included, on the straight segment between the two ends (eq. 20) | midpoints on the curved path |
//! | averages | of stored (sRGB-encoded) values | of light |
//! | pixel area | one bilinear sample | footprint taps |
//! | vignette, light, noise | on stored values | on light |
//! | fog | linear in slant range, after the blur, by the depth above | part of the ideal frame |
//!
//! Row times, lens inverse, principal points and the vignette's rule are the same as in the default preset;
//! the paper means the same. (The scenario's preset of this name also solves the lens by the paper's method
//! in every frame, because its cost and its errors are of interest there.)

use glam::{DVec2, DVec3};

use super::{NoSource, Pipeline};
use crate::temporal::paper::{gather_straight, linear_fog};

/// Number of exposure samples in section 8.9 of the paper.
pub const BLUR_SAMPLES: u32 = 100;

/// The paper's fog, `mix(colour, fog, clamp(d / end_m, 0, 1))` on stored values, with the slant range d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFog {
    /// Distance from which only fog is visible, metres.
    pub end_m: f64,
    /// Colour of the fog, stored values 0..=1.
    pub color: DVec3,
}

impl LinearFog {
    /// Blends a stored colour with fog at an inverse planar depth (0: the sky).
    #[must_use]
    pub fn over(&self, color: DVec3, uv: DVec2, inverse_depth: f64) -> DVec3 {
        linear_fog(color, self.color, uv, inverse_depth, self.end_m)
    }
}

impl Pipeline<'_> {
    /// Mean of stored values over the exposure, with fog. An error if either end of the path is outside of
    /// the ideal frame. Points between them cannot be, because a rectangle is convex.
    pub(super) fn gather_paper(&self, uv: DVec2, dt_s: f64) -> Result<DVec3, NoSource> {
        let half_s = 0.5 * self.shutter.exposure_s();
        let ends_px = [
            self.source_of_ray(uv, dt_s - half_s)?.position_px,
            self.source_of_ray(uv, dt_s + half_s)?.position_px,
        ];
        let samples = if half_s > 0.0 { self.settings.blur_samples.unwrap_or(BLUR_SAMPLES) } else { 1 };
        let mean = gather_straight(ends_px, samples, &self.stored());
        Ok(self.settings.fog.map_or(mean, |fog| fog.over(mean, uv, self.inverse_depth_of_ray(uv))))
    }
}
