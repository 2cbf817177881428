//! What the paper does with an ideal frame, for comparison: eq. 18 with the depth of one texel, a straight path over the exposure, stored
//! values, and fog at the end.
//!
//! | step | here | camsim's own |
//! |---|---|---|
//! | depth | nearest texel where the ray would look if nothing moved | bilinear where the ray does look |
//! | displacement | Heun's steps of at most 2.5 deg, constant twist and depth (`solver = "linear"` gives eq. 16) | exact relative pose |
//! | exposure | `blur_samples` samples, both ends included, on the straight segment between the two ends (eq. 20) | midpoints on the curved path |
//! | averages | of stored (sRGB-encoded) values | of light |
//! | pixel area | one bilinear sample | footprint taps |
//! | vignette, light, noise | on stored values | on light |
//! | fog | linear in slant range, after the blur, by the depth above | a part of the ideal frame |
//!
//! Row times, lens inverse, principal points and the vignette's rule are camsim's own: the paper means the same.

use glam::{DVec2, DVec3};

use super::Pipeline;

/// Samples over the exposure, as in the paper's section 8.9.
pub const BLUR_SAMPLES: u32 = 100;

/// `mix(colour, fog, clamp(d / end_m, 0, 1))`, d = slant range; in stored values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFog {
    /// Distance from which on nothing but fog is seen, metres.
    pub end_m: f64,
    /// Its colour, stored values 0..=1.
    pub color: DVec3,
}

impl LinearFog {
    /// Fog over a colour at a slant range (infinite for the sky).
    #[must_use]
    pub fn over(&self, color: DVec3, range_m: f64) -> DVec3 {
        color.lerp(self.color, (range_m / self.end_m).clamp(0.0, 1.0))
    }
}

impl Pipeline<'_> {
    /// Mean of stored values over the exposure, with fog. `None` if either end of the path is outside of the ideal frame.
    pub(super) fn gather_paper(&self, uv: DVec2, dt_s: f64) -> Option<DVec3> {
        let half_s = 0.5 * self.shutter.exposure_s();
        let begin = self.source_of_ray(uv, dt_s - half_s)?.at_px;
        let end = self.source_of_ray(uv, dt_s + half_s)?.at_px;
        let samples = if half_s > 0.0 { self.settings.blur_samples.unwrap_or(BLUR_SAMPLES).max(2) } else { 1 };
        let color = self.stored();
        let sum: DVec3 = match samples {
            1 => color.sample(begin),
            // A rectangle holds the segment between any two of its points, so no sample is outside.
            _ => (0..samples).map(|i| color.sample(begin.lerp(end, f64::from(i) / f64::from(samples - 1)))).sum(),
        };
        let mean = sum / f64::from(samples);
        let Some(fog) = &self.settings.fog else { return Some(mean) };
        let range_m = uv.extend(1.0).length() / self.inverse_depth_of_ray(uv);
        Some(fog.over(mean, range_m))
    }
}
