//! What is left of silhouettes by rays of their own, and how many of these a pixel takes.

use super::SilhouetteModel;
use crate::ir::{margins, predicted::SilhouetteError, sampling_plan::SamplingPlan, stages::BlurStage};

/// Part of the aliasing along whole pixels, squared, that rays leave.
pub(crate) const RAYS_LEAVE: f64 = 0.42;
/// Rays for each fine pixel along a side with which that was found.
const STILL_RAYS: u32 = 16;
/// How many rays there may be, as powers of two: only then are their positions even. Over an exposure twice as
/// many at least.
const LEAST_RAYS: u32 = 4;
const MOST_RAYS: u32 = 8;

impl SilhouetteModel {
    /// Rays a pixel: the fewest that add no more than a part of the error, squared, that the samples leave
    /// which they go through.
    pub fn rays(&self, scale: f64, fine: u32, most_part: f64) -> u32 {
        let enough =
            |rays: &u32| self.missed_by_rays(*rays, fine) <= most_part * self.left_by_samples(scale, fine);
        let least = LEAST_RAYS + u32::from(self.has_motion());
        (least..MOST_RAYS).map(|log2| 1 << log2).find(enough).unwrap_or(1 << MOST_RAYS)
    }

    /// Whether more rays than the fewest could bring anything.
    pub fn has_motion(&self) -> bool {
        self.border_pixels.move_over_exposure()
    }

    /// What is known of samples was found with so many rays through borders that stood still.
    fn missed_by_rays(&self, rays: u32, fine: u32) -> f64 {
        self.border_pixels.missed_by_rays(rays, STILL_RAYS * fine)
    }

    fn left_by_samples(&self, scale: f64, fine: u32) -> f64 {
        RAYS_LEAVE * self.border_pixels.along_whole_pixels(scale) / f64::from(fine * fine)
    }

    /// With so many rays of their own: a border is known to a part of a fine pixel.
    pub fn with_rays(
        &self,
        plan: &SamplingPlan,
        blur: Option<BlurStage>,
        fine: u32,
        rays: u32,
    ) -> SilhouetteError {
        let as_they_are = self.border_pixels.aliasing2(plan, blur);
        let through_samples = self.left_by_samples(plan.scale, fine) + self.missed_by_rays(rays, fine);
        let of_feet = if fine > 1 { through_samples } else { as_they_are };
        let touching = self.at_pixel_spacing * (as_they_are * self.touching + of_feet * self.creases);
        self.error(
            (margins::SILHOUETTES_WITH_RAYS / margins::SILHOUETTES).powi(2)
                * (through_samples * self.steps_at_pixel_spacing + touching),
        )
    }
}
