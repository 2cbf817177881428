//! What ways of sampling cost: milliseconds that a frame of 640x480 takes, by the clock, on two processor
//! cores without a GPU. Other machines have other times; plans are compared by their ratios.
//!
//! From the times that the host takes for ideal frames and what is made from them in
//! `benches/all_effects.toml` and `benches/houses.toml`, with an exposure and without, and in two cases of
//! `camsim bench`, each with ideal frames of 1 to 2.5 times the camera's scale, all ways of reading surfaces
//! and the ideal frame, and 3 or 16 samples of the exposure; and from the device's for rays at silhouettes
//! (docs/PERFORMANCE.md, "What the plan takes things to cost").

use camsim_core::scene::SurfaceFilter;
use glam::DMat2;

use super::{
    BlurStage, SurfaceReads,
    levels::{Sampling, sample_count},
    prospect::{Prospect, Sight},
};
use camsim_core::{
    scene::Scene,
    temporal::{Footprint, Kernel, TapStage},
};

/// Of an ideal pixel for each of the camera's: what any takes, each read of a surface's picture, what it
/// takes more to read two of its smaller versions, and to find out how many reads there are.
const IDEAL_MS: f64 = 1.6;
const SURFACE_READ_MS: f64 = 0.4;
const TWO_VERSIONS_MS: f64 = 0.2;
const ANY_READS_MS: f64 = 0.7;
/// Of choosing and drawing a thousand triangles; and at most, for any ideal frame and for each time that it
/// is as fine as the camera: their level of detail and what is in view leave no more. Of the terrain, and of
/// models.
const TRIANGLES_MS: f64 = 0.04;
const TERRAIN_MS: [f64; 2] = [0.8, 3.7];
const MODELS_MS: [f64; 2] = [2.5, 2.0];
/// What several samples a pixel take more at most, in the same way.
const TERRAIN_SAMPLES_MS: [f64; 2] = [2.0, 2.5];
const MODELS_SAMPLES_MS: [f64; 2] = [7.0, 4.0];
/// Of reading the ideal frame once: bilinear, by a spline, by a grid of reads and for each more of them, by
/// either.
const READ_MS: f64 = 0.24;
const SPLINE_MS: f64 = 1.0;
const GRID_MS: [f64; 2] = [1.2, 0.4];
const EITHER_MS: [f64; 2] = [1.3, 0.8];
/// Of reading an area of it, and of each two by two pixels that this may touch.
const AREA_MS: [f64; 2] = [0.7, 0.22];
/// Of reading it over an exposure, and for each sample.
const SPLINE_SAMPLES_MS: [f64; 2] = [1.0, 0.75];
const GRID_SAMPLES_MS: [f64; 2] = [1.5, 0.38];
const EITHER_SAMPLES_MS: [f64; 2] = [2.0, 0.77];
/// Of a pixel whatever it reads, and for each time that the ideal frame is finer, since fewer reads then find
/// a pixel that is at hand already; and both where a lens bends rows.
const ANY_MS: [f64; 2] = [1.5, 0.8];
const BENT_MS: [f64; 2] = [3.7, 2.3];
/// Frames with rays at silhouettes are the device's, which takes one to five times what the host does, by
/// scene.
const ON_DEVICE: f64 = 3.0;
/// Of the rays: of an ideal pixel for each of the camera's its samples and marks, and of a picture that is
/// all silhouettes each of a pixel's rays, and more where their samples are coarse.
const MARKS_MS: f64 = 6.0;
const RAYS_MS: [f64; 2] = [4.7, 7.0];

/// What the triangles of a scene take to draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    terrain_ms: f64,
    models_ms: f64,
}

impl Drawn {
    /// Of all triangles that there are.
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

    /// Of several samples a pixel, more.
    fn samples_ms(self, scale: f64) -> f64 {
        let at_most = |[least, times]: [f64; 2]| least + times * scale;
        self.terrain_ms.min(at_most(TERRAIN_SAMPLES_MS)) + self.models_ms.min(at_most(MODELS_SAMPLES_MS))
    }
}

/// The whole price of a way, and the part of it that the ideal frame takes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Price {
    pub ms: f64,
    pub ideal_ms: f64,
}

impl Price {
    /// The same with rays at silhouettes that take so long.
    pub fn with_rays(self, rays_ms: f64) -> Self {
        Self { ms: ON_DEVICE * self.ms + rays_ms, ideal_ms: ON_DEVICE * self.ideal_ms }
    }
}

impl Prospect<'_> {
    /// Of a way, with so many pixels drawn of the ideal frame at scale 1 for each of the camera's.
    pub fn price(&self, sampling: &Sampling, blur: Option<BlurStage>, ideal_share: f64) -> Price {
        let ideal_ms = self.ideal_ms(sampling, ideal_share);
        Price { ms: ideal_ms + self.read_ms(sampling.scale, sampling.taps, blur), ideal_ms }
    }

    /// Of the ideal frame.
    pub fn ideal_ms(
        &self,
        &Sampling { scale, surface_reads, samples_a_pixel, .. }: &Sampling,
        ideal_share: f64,
    ) -> f64 {
        let a_px = self.mean(|sight| surface_ms(sight.texel_from_key * scale.recip(), surface_reads));
        let samples_ms = if samples_a_pixel > 1 { self.drawn.samples_ms(scale) } else { 0.0 };
        ideal_share * (self.drawn.ms(scale) + scale * scale * a_px + samples_ms)
    }

    /// Of reading it.
    pub fn read_ms(&self, scale: f64, taps: TapStage, blur: Option<BlurStage>) -> f64 {
        let [any_ms, finer_ms] = if self.is_bent { BENT_MS } else { ANY_MS };
        let of = |sight: &Sight<'_>| {
            let sides = scale * sight.camera_from_px;
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let samples = blur.map(|blur| sample_count(&blur, scale * sight.path_px, &area));
            footprint_ms(taps, &area, samples)
        };
        any_ms + finer_ms * (scale - 1.0) + self.mean(of)
    }

    /// Of giving pixels at silhouettes, which have a share of the picture, rays of their own: with so many
    /// fine pixels along a side of each ideal one, all triangles drawn once more.
    pub fn rays_ms(&self, share: f64, scale: f64, fine: u32, rays: u32, ideal_share: f64) -> f64 {
        let finer = scale * f64::from(fine);
        let [least_ms, coarse_ms] = RAYS_MS;
        ideal_share * (ON_DEVICE * self.drawn.ms(finer) + finer * finer * MARKS_MS)
            + share * f64::from(rays) * (least_ms + coarse_ms / finer)
    }

    /// Over the places.
    fn mean(&self, of: impl Fn(&Sight<'_>) -> f64) -> f64 {
        self.sights.iter().map(|sight| sight.weight * of(sight)).sum::<f64>() / self.weight()
    }
}

/// Of an ideal pixel that shows a surface.
fn surface_ms(texel_from_ideal: DMat2, reads: SurfaceReads) -> f64 {
    let filter = SurfaceFilter::new(texel_from_ideal, reads);
    let (count, is_of_two) = (f64::from(filter.taps()), filter.is_of_two());
    let (times, two_ms) = if is_of_two { (2.0, TWO_VERSIONS_MS) } else { (1.0, 0.0) };
    let any_ms = if reads == SurfaceReads::Grid { ANY_READS_MS } else { 0.0 };
    IDEAL_MS + SURFACE_READ_MS * count * times + two_ms + any_ms
}

/// Of a pixel that reads the ideal frame, with so many samples of an exposure.
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
    let of = |[whole, each]: [f64; 2]| whole + each * samples;
    match stage {
        TapStage::Bilinear => READ_MS * samples,
        TapStage::Spline => of(SPLINE_SAMPLES_MS),
        TapStage::Area => area_ms(area).map_or(of(EITHER_SAMPLES_MS), |ms| AREA_MS[0] + ms * samples),
        TapStage::Grid { .. } => of(GRID_SAMPLES_MS),
        TapStage::SplineOrGrid { .. } => of(EITHER_SAMPLES_MS),
    }
}

/// Of one read of an area, whatever others take; `None` of a spline.
fn area_ms(area: &Footprint) -> Option<f64> {
    let pairs = |side_px: f64| (0.5 * (side_px + 1.0)).ceil();
    let Kernel::Area(sides_px) = area.kernel else { return None };
    Some(AREA_MS[1] * pairs(sides_px.x) * pairs(sides_px.y))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::{DVec2, DVec3};

    use super::*;
    use camsim_core::scene::{Encoding, Mesh, Terrain, Texture};

    #[test]
    fn the_kernel_that_knows_splines_and_grids_takes_longer_than_those_that_know_one() {
        for width_px in [1.0, 2.0, 3.0, 4.0] {
            let ms = |stage: TapStage, samples: Option<u32>| {
                footprint_ms(stage, &Footprint::new(width_px * DVec2::X, width_px * DVec2::Y, stage), samples)
            };
            for samples in [None, Some(16), Some(40)] {
                let either = ms(TapStage::SplineOrGrid { most: 4 }, samples);
                for other in [TapStage::Bilinear, TapStage::Spline, TapStage::Grid { most: 4 }] {
                    assert!(ms(other, samples) < either, "{width_px} {other:?} {samples:?}");
                }
                assert!(ms(TapStage::Bilinear, samples) < ms(TapStage::Spline, samples));
            }
        }
    }

    #[test]
    fn reads_of_two_versions_take_longer_and_grids_end_where_one_read_does() {
        let ms =
            |texels: f64, reads: SurfaceReads| surface_ms(DMat2::from_diagonal(DVec2::splat(texels)), reads);
        for reads in SurfaceReads::ALL {
            assert!(ms(0.3, reads) < ms(4.0, reads), "{reads:?}");
        }
        assert!(ms(0.3, SurfaceReads::Grid) < ms(0.3, SurfaceReads::Four), "one of up to 64");
        assert!(ms(4.0, SurfaceReads::Grid) > ms(0.3, SurfaceReads::Grid) + SURFACE_READ_MS);
    }

    #[test]
    fn few_triangles_take_their_time_and_many_what_a_level_of_detail_leaves() {
        let picture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let heights = |side: u32| {
            Terrain::from_heights(side, side, 10.0, &vec![0.0; (side * side) as usize], None).unwrap()
        };
        let of = |terrain: Option<Terrain>, meshes: Vec<Mesh>| {
            Drawn::new(&Scene { terrain, meshes, ..Scene::default() })
        };
        assert_eq!(Drawn::new(&Scene::default()).ms(1.0), 0.0);
        let of_64_cells = 1e-3 * TRIANGLES_MS * 2.0 * 64.0 * 64.0;
        assert!((of(Some(heights(65)), vec![]).ms(2.0) - of_64_cells).abs() < 1e-9);
        assert_eq!(of(Some(heights(513)), vec![]).ms(2.0), TERRAIN_MS[0] + 2.0 * TERRAIN_MS[1]);
        let square = Mesh::level_picture(picture, DVec3::ZERO, 5.0);
        assert!((of(None, vec![square; 500]).ms(1.0) - TRIANGLES_MS).abs() < 1e-9, "a thousand triangles");
    }
}
