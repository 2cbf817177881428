//! Picture error at silhouettes where nothing is done for them: a pixel of the ideal frame then shows one of
//! the two surfaces, and an output pixel reads from there as it does elsewhere.
//!
//! Two things go wrong. The silhouette runs along whole pixels, so that pixels on it have too much of one
//! surface: aliasing. And within the parallax between the two surfaces a pixel looks where the other one is.
//! Both are a fraction of the contrast across the silhouette. The neighbourhoods of the probes show how wide the
//! strip within parallax is; a few silhouettes have most of it, at which hardly any probe stands, so that the
//! fraction of the picture that is disoccluded (`disocclusion.rs`) counts too.
//!
//! With rays of their own pixels at silhouettes have neither; but the ideal frame's samples know to a part of
//! its pixels where the silhouette is. Where meshes of other colours touch, rays change nothing: only a finer
//! ideal frame does.

pub(crate) mod rays;
#[cfg(test)]
mod tests;

use camsim_core::{camera::CameraModel, pose::CameraPose, scene::TerrainDetail};

use super::aliasing::BorderPixels;
use crate::{
    ir::{
        margins,
        predicted::{Disocclusion, SilhouetteError},
        sampling_plan::SamplingPlan,
        seen_plane::SeenPlane,
        stages::BlurStage,
    },
    view::neighbourhood::{LineCrossings, Neighbourhood, Neighbourhoods, SilhouetteProbe, skyline::Skyline},
};

/// Strips for each that is disoccluded: where one border of a surface uncovers what is behind it the other
/// covers it up, and a pixel there may take either.
const STRIPS: f64 = 2.0;
/// Part of what borders along whole pixels cost, squared, that is left of it at least, whatever reads the
/// ideal frame.
const LEAST_LEFT: f64 = 0.1;
const LEAST_LEFT_BY_SAMPLES: f64 = 0.02;

/// What silhouettes cost in ideal frames of any scale, however these are read. Lengths are for each pixel of
/// the picture, in pixels, contrasts of the linear range.
#[derive(Clone, Debug)]
pub(crate) struct SilhouetteModel {
    /// Fraction of the pixels at silhouettes.
    pub fraction: f64,
    contrast_dn: f64,
    disoccluded_fraction: f64,
    /// Mean squared error over the picture by strips within parallax.
    strips: f64,
    /// Squared contrast of silhouettes times their length.
    steps: f64,
    /// Squared contrast of silhouettes times their length, as points a pixel apart find them.
    steps_at_pixel_spacing: f64,
    /// Squared contrast times length of borders between meshes that touch.
    touching: f64,
    /// Squared contrast times length of creases.
    creases: f64,
    /// Part of creases and touching borders that points a pixel apart find.
    at_pixel_spacing: f64,
    /// [`Neighbourhood::terrain_steps`], mean over the pixels of the picture.
    terrain_steps: f64,
    skyline: Skyline,
    border_pixels: BorderPixels,
}

impl SilhouetteModel {
    /// From the neighbourhoods of all probes, the ideal frame's pose, the plane that is nearest to what is
    /// seen from there, the disocclusion, and the least fraction that pixels at silhouettes have.
    pub fn new(
        Neighbourhoods { of_probes, skyline }: &Neighbourhoods,
        camera: &CameraModel,
        key_pose: &CameraPose,
        plane: &SeenPlane,
        disocclusion: Disocclusion,
        least_fraction: f64,
    ) -> Self {
        let near = NearProbes::new(of_probes);
        let contrast2 = near.mean(|silhouette| silhouette.contrast2);
        let count = of_probes.len().max(1) as f64;
        // Few lines cross a border: where borders stand apart, what the nine points find is surer.
        let over_all = |of_lines: &dyn Fn(&LineCrossings) -> f64| {
            margins::SILHOUETTES
                * margins::SILHOUETTES
                * of_probes.iter().fold(0.0, |sum, near| sum + of_lines(&near.crossings))
                / count
        };
        // Few probes are near the skyline, which lines between them find.
        let skyline_steps = skyline.steps();
        let at_probes = |silhouette: &SilhouetteProbe| {
            if skyline_steps.is_some() { silhouette.steps_between_surfaces } else { silhouette.steps() }
        };
        let skyline_steps = margins::SILHOUETTES * margins::SILHOUETTES * skyline_steps.unwrap_or(0.0);
        let of_points = margins::SILHOUETTES * margins::SILHOUETTES * near.fraction * near.mean(at_probes)
            + skyline_steps;
        let of_lines = over_all(&|crossings| crossings.steps);
        let (density, uncertainty) = (density(of_probes), uncertainty(of_probes));
        Self {
            fraction: near.fraction.max(least_fraction),
            contrast_dn: 255.0 * contrast2.sqrt(),
            disoccluded_fraction: disocclusion.fraction,
            strips: STRIPS * near.contrast2_between_surfaces() * disocclusion.weighted_fraction
                + near.fraction
                    * near.mean(|silhouette| silhouette.strip(key_pose, camera.central_focal_px()))
                + skyline.strips(key_pose, plane),
            steps: uncertainty * (of_points.max(density * of_lines) - skyline_steps) + skyline_steps,
            steps_at_pixel_spacing: of_points.max(of_lines / density),
            touching: uncertainty * density * over_all(&|crossings| crossings.touching),
            creases: uncertainty * density * over_all(&|crossings| crossings.creases),
            at_pixel_spacing: (uncertainty * density * density).recip(),
            terrain_steps: margins::SILHOUETTES
                * margins::SILHOUETTES
                * of_probes.iter().map(|near| near.terrain_steps).sum::<f64>()
                / count,
            skyline: skyline.clone(),
            border_pixels: BorderPixels::new(of_probes.iter().filter_map(Neighbourhood::borders)),
        }
    }

    /// RMS error over the picture by silhouettes of a terrain that is displaced by so much, RMS, pixels of
    /// the camera's focal length; 1/255 of the linear range. A silhouette passes over as much of a pixel as
    /// it is displaced, as often across it as along it; at the skyline its displacement is known.
    pub fn terrain_dn(&self, displacement_px: f64, detail: &TerrainDetail<'_>) -> f64 {
        let before_ground = (margins::RIDGES * displacement_px).powi(2) * 0.5 * self.terrain_steps;
        255.0 * (before_ground + self.skyline.lowered(detail)).sqrt()
    }

    /// Silhouettes left as they are.
    pub fn plain(&self, plan: &SamplingPlan, blur: Option<BlurStage>) -> SilhouetteError {
        let borders = self.steps + self.touching + self.creases;
        self.error(borders * self.border_pixels.aliasing2(plan, blur) + self.strips)
    }

    /// About the least that silhouettes cost left as they are, whatever reads an ideal frame with so many
    /// pixels for each of the camera's; whether those may have several samples.
    pub fn plain_at_best(&self, scale: f64, may_have_samples: bool) -> SilhouetteError {
        let least_left = if may_have_samples { LEAST_LEFT_BY_SAMPLES } else { LEAST_LEFT };
        let borders = self.steps + self.touching + self.creases;
        self.error(least_left * borders * self.border_pixels.along_whole_pixels(scale) + self.strips)
    }

    /// Of a mean squared error over the picture.
    fn error(&self, square: f64) -> SilhouetteError {
        let Self { fraction, contrast_dn, disoccluded_fraction, .. } = *self;
        // Of no silhouettes at all the sum is -0.
        let error_dn = 255.0 * square.abs().sqrt();
        let at_silhouettes_dn = if fraction > 0.0 { error_dn / fraction.sqrt() } else { 0.0 };
        SilhouetteError { fraction, contrast_dn, disoccluded_fraction, at_silhouettes_dn, error_dn }
    }
}

/// The probes near silhouettes.
struct NearProbes<'a> {
    probes: Vec<&'a SilhouetteProbe>,
    /// Of all probes.
    fraction: f64,
}

impl<'a> NearProbes<'a> {
    fn new(of_probes: &'a [Neighbourhood]) -> Self {
        let probes: Vec<_> = of_probes.iter().filter_map(|near| near.silhouette.as_ref()).collect();
        let fraction = probes.len() as f64 / of_probes.len().max(1) as f64;
        Self { probes, fraction }
    }

    fn mean(&self, of_probe: impl Fn(&SilhouetteProbe) -> f64) -> f64 {
        self.probes.iter().fold(0.0, |sum, probe| sum + of_probe(probe)) / self.probes.len().max(1) as f64
    }

    /// Squared contrast between two surfaces, or where none are before others, of all silhouettes.
    fn contrast2_between_surfaces(&self) -> f64 {
        let known: Vec<f64> =
            self.probes.iter().filter_map(|probe| probe.contrast2_between_surfaces).collect();
        if known.is_empty() {
            self.mean(|probe| probe.contrast2)
        } else {
            known.iter().sum::<f64>() / known.len() as f64
        }
    }
}

/// Times what is found at borders that there may well be, squared: where a few probes found most of it they
/// are less certain than as many alike.
fn uncertainty(of_probes: &[Neighbourhood]) -> f64 {
    let borders = || of_probes.iter().filter_map(Neighbourhood::borders).map(|(borders, _)| borders);
    let [sum, squares] =
        borders().fold([0.0; 2], |[sum, squares], borders| [sum + borders, squares + borders * borders]);
    if sum > 0.0 { 1.0 + margins::STANDARD_ERRORS * squares.sqrt() / sum } else { 1.0 }
}

/// Times the borders that are found there are more, nearer to each other than the points on lines: as many
/// times as what is found thrice a pixel is more than what is found once.
fn density(of_probes: &[Neighbourhood]) -> f64 {
    let of_lines = |crossings: &LineCrossings| {
        let LineCrossings { steps, touching, creases, at_pixel_spacing, .. } = crossings;
        [steps + touching + creases, *at_pixel_spacing]
    };
    let [all, once] = of_probes
        .iter()
        .map(|near| of_lines(&near.crossings))
        .fold([0.0; 2], |sum, of_lines| [sum[0] + of_lines[0], sum[1] + of_lines[1]]);
    if once > 0.0 { (all / once).clamp(1.0, margins::MOST_BETWEEN_BORDERS) } else { 1.0 }
}
