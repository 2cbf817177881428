//! Prices of sampling plans: milliseconds that a frame of 640x480 takes, by the clock, on two processor
//! cores without a GPU. Other machines have other times; plans are compared by their ratios.
//!
//! From the times that the CPU renderer takes for ideal frames and what is made from them in
//! `benches/all_effects.toml` and `benches/houses.toml`, with an exposure and without, and in two cases of
//! `camsim bench`, each with ideal frames of 1 to 2.5 times the camera's scale, all stages of reading surfaces
//! and the ideal frame, and 3 or 16 samples of the exposure; and from the GPU renderer's times for rays at
//! silhouettes (docs/theory/PERFORMANCE.md, "What a frame costs").

#[cfg(test)]
mod tests;

use camsim_core::{
    scene::{Prefilter, Scene},
    temporal::{Footprint, Kernel, TapStage},
};
use glam::DMat2;

use crate::{
    ir::{
        sampling_plan::SamplingPlan,
        stages::{BlurStage, NodeDepths, PrefilterTaps, TemporalStage, sample_count},
    },
    picture_error::texture_probes::{TextureProbe, TextureProbes},
    source_error::temporal_method::TemporalMethod,
};

/// Time of an ideal pixel for each of the camera's: what any takes, each read of a texture, what it takes
/// more to read two mip levels, and to find out how many reads there are.
const IDEAL_MS: f64 = 1.6;
const SURFACE_READ_MS: f64 = 0.4;
const TWO_VERSIONS_MS: f64 = 0.2;
const ANY_READS_MS: f64 = 0.7;
/// Time of choosing and drawing a thousand triangles; and at most, for any ideal frame and for each time that
/// it is as fine as the camera: their level of detail and what is in view leave no more. Of the terrain, and
/// of models.
const TRIANGLES_MS: f64 = 0.04;
const TERRAIN_MS: [f64; 2] = [0.8, 3.7];
const MODELS_MS: [f64; 2] = [2.5, 2.0];
/// What several samples a pixel take more at most, in the same way.
const TERRAIN_SAMPLES_MS: [f64; 2] = [2.0, 2.5];
const MODELS_SAMPLES_MS: [f64; 2] = [7.0, 4.0];
/// Time of reading the ideal frame once: bilinear, by a spline, by a grid of reads and for each more of them,
/// by either.
const READ_MS: f64 = 0.24;
const SPLINE_MS: f64 = 1.0;
const GRID_MS: [f64; 2] = [1.2, 0.4];
const EITHER_MS: [f64; 2] = [1.3, 0.8];
/// Time of reading an area of the ideal frame, and of each two by two pixels that this may touch.
const AREA_MS: [f64; 2] = [0.7, 0.22];
/// Time of reading the ideal frame over an exposure, and for each sample.
const SPLINE_SAMPLES_MS: [f64; 2] = [1.0, 0.75];
const GRID_SAMPLES_MS: [f64; 2] = [1.5, 0.38];
const EITHER_SAMPLES_MS: [f64; 2] = [2.0, 0.77];
/// Time of a pixel whatever it reads, and for each time that the ideal frame is finer, since fewer reads then
/// find a pixel that is at hand already; and both where a lens bends rows.
const ANY_MS: [f64; 2] = [1.5, 0.8];
const BENT_MS: [f64; 2] = [3.7, 2.3];
/// Frames with rays at silhouettes are the GPU renderer's, which takes one to five times what the CPU renderer
/// does, by scene.
const ON_GPU: f64 = 3.0;
/// Time of the rays at silhouettes: of an ideal pixel for each of the camera's its samples and marks, and of
/// a picture that is all silhouettes each of a pixel's rays, and more where their samples are coarse.
const MARKS_MS: f64 = 6.0;
const RAYS_MS: [f64; 2] = [4.7, 7.0];
/// Time of a camera of its own for each row, and of a look-up of depth, from its reverse passes, less their
/// reads.
const POSE_MS: f64 = 0.05;
const LOOK_UP_MS: f64 = 0.25;

/// What the triangles of a scene take to draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrianglePrices {
    terrain_ms: f64,
    models_ms: f64,
}

impl TrianglePrices {
    /// Prices of all triangles that there are.
    pub fn new(scene: &Scene) -> Self {
        let ms = |triangles: usize| 1e-3 * TRIANGLES_MS * triangles as f64;
        let of_terrain = scene.terrain.as_ref().map_or(0, |terrain| {
            terrain.chunks.iter().map(|chunk| 2 * chunk.cells[0] as usize * chunk.cells[1] as usize).sum()
        });
        Self {
            terrain_ms: ms(of_terrain),
            models_ms: ms(scene.meshes.iter().map(|mesh| mesh.shape.indices.len() / 3).sum()),
        }
    }

    fn ms(self, scale: f64) -> f64 {
        let at_most = |[least, times]: [f64; 2]| least + times * scale;
        self.terrain_ms.min(at_most(TERRAIN_MS)) + self.models_ms.min(at_most(MODELS_MS))
    }

    /// What several samples a pixel take more.
    fn samples_ms(self, scale: f64) -> f64 {
        let at_most = |[least, times]: [f64; 2]| least + times * scale;
        self.terrain_ms.min(at_most(TERRAIN_SAMPLES_MS)) + self.models_ms.min(at_most(MODELS_SAMPLES_MS))
    }
}

/// The whole price of a plan, and the part of it that the ideal frame takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Price {
    pub ms: f64,
    pub ideal_ms: f64,
}

impl Price {
    /// With rays at silhouettes that take so long.
    pub fn with_rays(self, rays_ms: f64) -> Self {
        Self { ms: ON_GPU * self.ms + rays_ms, ideal_ms: ON_GPU * self.ideal_ms }
    }
}

/// Prices of the sampling plans of a frame.
#[derive(Clone, Copy)]
pub(crate) struct Prices<'a> {
    pub probes: &'a TextureProbes<'a>,
    pub triangles: TrianglePrices,
    /// Whether the lens bends rows.
    pub is_bent: bool,
}

impl Prices<'_> {
    /// Price of a plan, with so many pixels drawn of the ideal frame at scale 1 for each of the camera's.
    pub fn price(&self, sampling: &SamplingPlan, blur: Option<BlurStage>, ideal_fraction: f64) -> Price {
        let ideal_ms = self.ideal_ms(sampling, ideal_fraction);
        Price { ms: ideal_ms + self.read_ms(sampling.scale, sampling.taps, blur), ideal_ms }
    }

    /// Time of the ideal frame.
    pub fn ideal_ms(
        &self,
        &SamplingPlan { scale, surface_reads, samples_a_pixel, .. }: &SamplingPlan,
        ideal_fraction: f64,
    ) -> f64 {
        let a_px = self.mean(|probe| surface_ms(probe.texel_from_key * scale.recip(), surface_reads));
        let samples_ms = if samples_a_pixel > 1 { self.triangles.samples_ms(scale) } else { 0.0 };
        ideal_fraction * (self.triangles.ms(scale) + scale * scale * a_px + samples_ms)
    }

    /// Time of reading the ideal frame.
    pub fn read_ms(&self, scale: f64, taps: TapStage, blur: Option<BlurStage>) -> f64 {
        let [any_ms, finer_ms] = if self.is_bent { BENT_MS } else { ANY_MS };
        let probe_ms = |probe: &TextureProbe<'_>| {
            let sides = scale * probe.camera_from_px;
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let samples = blur.map(|blur| sample_count(&blur, scale * probe.path_px, &area));
            footprint_ms(taps, &area, samples)
        };
        any_ms + finer_ms * (scale - 1.0) + self.mean(probe_ms)
    }

    /// Time of giving pixels at silhouettes, which have a fraction of the picture, rays of their own: with so
    /// many fine pixels along a side of each ideal one, all triangles drawn once more.
    pub fn rays_ms(&self, fraction: f64, scale: f64, fine: u32, rays: u32, ideal_fraction: f64) -> f64 {
        let finer = scale * f64::from(fine);
        let [least_ms, coarse_ms] = RAYS_MS;
        ideal_fraction * (ON_GPU * self.triangles.ms(finer) + finer * finer * MARKS_MS)
            + fraction * f64::from(rays) * (least_ms + coarse_ms / finer)
    }

    /// Mean over the texture probes.
    fn mean(&self, figure: impl Fn(&TextureProbe<'_>) -> f64) -> f64 {
        self.probes.probes.iter().map(|probe| probe.weight * figure(probe)).sum::<f64>()
            / self.probes.weight()
    }
}

/// Time of an ideal pixel that shows a surface.
fn surface_ms(texel_from_ideal: DMat2, reads: PrefilterTaps) -> f64 {
    let filter = Prefilter::new(texel_from_ideal, reads);
    let (count, is_trilinear) = (f64::from(filter.taps()), filter.is_trilinear());
    let (times, two_ms) = if is_trilinear { (2.0, TWO_VERSIONS_MS) } else { (1.0, 0.0) };
    let any_ms = if reads == PrefilterTaps::Grid { ANY_READS_MS } else { 0.0 };
    IDEAL_MS + SURFACE_READ_MS * count * times + two_ms + any_ms
}

/// Time of a pixel that reads the ideal frame, with so many samples of an exposure.
fn footprint_ms(stage: TapStage, area: &Footprint, samples: Option<u32>) -> f64 {
    let reads = f64::from(area.taps[0] * area.taps[1]);
    let Some(samples) = samples.map(f64::from) else {
        return match stage {
            TapStage::Bilinear => READ_MS,
            TapStage::Spline => SPLINE_MS,
            TapStage::Area => area_ms(area).map_or(EITHER_MS[0], |ms| AREA_MS[0] + ms),
            TapStage::Grid { .. } => GRID_MS[0] + GRID_MS[1] * (reads - 1.0),
            TapStage::SplineOrGrid { .. } => {
                EITHER_MS[0]
                    + EITHER_MS[1] * if matches!(area.kernel, Kernel::Spline(_)) { 0.0 } else { reads }
            }
        };
    };
    let sampled_ms = |[whole, each]: [f64; 2]| whole + each * samples;
    match stage {
        TapStage::Bilinear => READ_MS * samples,
        TapStage::Spline => sampled_ms(SPLINE_SAMPLES_MS),
        TapStage::Area => area_ms(area).map_or(sampled_ms(EITHER_SAMPLES_MS), |ms| AREA_MS[0] + ms * samples),
        TapStage::Grid { .. } => sampled_ms(GRID_SAMPLES_MS),
        TapStage::SplineOrGrid { .. } => sampled_ms(EITHER_SAMPLES_MS),
    }
}

/// Time of one read of an area; `None` for a spline.
fn area_ms(area: &Footprint) -> Option<f64> {
    let pairs = |side_px: f64| (0.5 * (side_px + 1.0)).ceil();
    let Kernel::Area(sides_px) = area.kernel else { return None };
    Some(AREA_MS[1] * pairs(sides_px.x) * pairs(sides_px.y))
}

/// Time of a temporal inverse beside what the reads themselves take, milliseconds.
pub(crate) fn temporal_ms(method: TemporalMethod) -> f64 {
    let nodes = method.blur.map_or(1, |blur| blur.solved());
    let others = match method.blur.map(|blur| blur.depths) {
        None | Some(NodeDepths::Mid) => 0,
        Some(NodeDepths::Ends) => 1,
        Some(NodeDepths::Three) => 2,
        Some(NodeDepths::Each) => nodes - 1,
    };
    let poses = f64::from(nodes) * POSE_MS;
    match method.temporal {
        TemporalStage::Identity => 0.0,
        TemporalStage::Rotation | TemporalStage::Linear | TemporalStage::Rk2 => poses,
        // What begins with what another has found needs one less.
        TemporalStage::Reproject { iterations } => {
            poses + f64::from(iterations + others * (iterations.max(2) - 1)) * LOOK_UP_MS
        }
    }
}
