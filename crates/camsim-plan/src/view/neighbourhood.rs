//! What the probes of a frame see around them: steps of depth, borders between surfaces that touch, and the
//! skyline.

mod nine_points;
pub(crate) mod search;
pub(crate) mod skyline;
#[cfg(test)]
mod tests;
mod thin_surfaces;

use camsim_core::{
    pose::CameraPose,
    silhouette::{CREASE, NEAR_PX, bends},
};
use glam::DVec2;
use rayon::prelude::*;

use super::{probes::Probe, source_path::path_px};
use nine_points::{NinePoints, Pair};
use search::{LINES, NeighbourhoodSearch};
use skyline::Skyline;

pub(crate) use thin_surfaces::LineCrossings;

/// What is seen around a probe, wherever the ideal frame is taken.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    pub silhouette: Option<SilhouetteProbe>,
    /// Side of the pixel and length of the path over the exposure, pixels of the camera's focal length; where
    /// there is a border.
    pub footprint_px: Option<[f64; 2]>,
    /// What lines through the probe cross, where models may be thinner than the distance of the nine points.
    pub crossings: LineCrossings,
    /// Squared contrast at silhouettes of the terrain, times their length in each pixel of the camera's focal
    /// length.
    pub terrain_steps: f64,
    is_sky: bool,
    /// Whether there is a step or a fold of depth.
    pub near_silhouette: bool,
}

/// The neighbourhoods of all probes.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhoods {
    pub of_probes: Vec<Neighbourhood>,
    pub skyline: Skyline,
}

/// A probe near a silhouette.
#[derive(Clone, Debug)]
pub(crate) struct SilhouetteProbe {
    /// Mean squared contrast across the silhouette.
    pub contrast2: f64,
    /// Mean squared contrast between two surfaces, where there are any: disocclusion is beside these alone.
    pub contrast2_between_surfaces: Option<f64>,
    /// [`SilhouetteProbe::steps`] of silhouettes between two surfaces.
    pub steps_between_surfaces: f64,
    path_px: f64,
    /// The probe's camera and ray.
    pose: CameraPose,
    uv: DVec2,
    /// Inverse depths on both sides of each step.
    inverse_depths: Vec<[f64; 2]>,
    /// Direction across the silhouette.
    normal: DVec2,
}

impl Neighbourhood {
    /// The neighbourhood as a camera elsewhere would see it.
    pub fn seen_from(&self, pose: impl FnOnce() -> CameraPose) -> Self {
        let mut there = self.clone();
        if let Some(silhouette) = &mut there.silhouette {
            silhouette.pose = pose();
        }
        there
    }

    /// Squared contrast of borders times their length, and the side of the pixel and its path.
    pub fn borders(&self) -> Option<(f64, [f64; 2])> {
        let LineCrossings { steps, touching, creases, .. } = self.crossings;
        let silhouette_steps = self.silhouette.as_ref().map_or(0.0, SilhouetteProbe::steps);
        Some((silhouette_steps.max(steps) + touching + creases, self.footprint_px?))
    }
}

impl SilhouetteProbe {
    /// Squared contrast times the length of the silhouette in each of the pixels within reach.
    pub fn steps(&self) -> f64 {
        self.contrast2 / f64::from(2 * NEAR_PX + 1)
    }

    /// Parallax between the two surfaces seen from an ideal frame's camera, across the silhouette; what is
    /// before the sky is the [`Skyline`]'s.
    fn strip_px(&self, key_pose: &CameraPose, focal_px: DVec2) -> f64 {
        let (rotation, shift) = self.pose.relative_to(key_pose);
        let of_probe = rotation * self.uv.extend(1.0);
        let key_px = |inverse_depth: f64| {
            let in_key = of_probe + inverse_depth * shift;
            focal_px * in_key.truncate() / in_key.z
        };
        let to_surface = |ends: &&[f64; 2]| ends.iter().all(|inverse_depth| *inverse_depth > 0.0);
        self.inverse_depths
            .iter()
            .filter(to_surface)
            .map(|&[a, b]| (key_px(a) - key_px(b)).dot(self.normal).abs())
            .fold(0.0, f64::max)
    }

    /// Squared contrast times the width of the strip within that parallax: narrower than a pixel it is as
    /// much less of one, and the exposure spreads it over its path.
    pub fn strip(&self, key_pose: &CameraPose, focal_px: DVec2) -> f64 {
        let strip_px = self.strip_px(key_pose, focal_px);
        let width_px = strip_px * strip_px / (strip_px.max(1.0) + self.path_px);
        self.contrast2_between_surfaces.unwrap_or(0.0) * (width_px / f64::from(2 * NEAR_PX + 1)).min(1.0)
    }
}

impl Neighbourhoods {
    /// With what others see.
    pub fn with(&self, others: impl Iterator<Item = Self>) -> Self {
        let mut all = self.clone();
        for others in others {
            all.of_probes.extend(others.of_probes);
            all.skyline = all.skyline.and(others.skyline);
        }
        all
    }

    /// The neighbourhoods as cameras elsewhere would see them: those of the pixels of a picture.
    pub fn seen_from(&self, probes: &[Probe], pose: impl Fn([u32; 2]) -> CameraPose) -> Self {
        let of_probes = self
            .of_probes
            .iter()
            .zip(probes)
            .map(|(neighbourhood, probe)| neighbourhood.seen_from(|| pose(probe.pixel)))
            .collect();
        Self { of_probes, skyline: self.skyline.seen_from(pose) }
    }
}

impl NeighbourhoodSearch<'_> {
    /// The neighbourhood of each of the camera's probes.
    pub fn neighbourhoods(&self) -> Neighbourhoods {
        let of_probes: Vec<Neighbourhood> = self
            .reach
            .probes
            .par_iter()
            .enumerate()
            .with_min_len(16)
            .map(|(number, probe)| self.neighbourhood(number, probe))
            .collect();
        let is_sky: Vec<bool> = of_probes.iter().map(|neighbourhood| neighbourhood.is_sky).collect();
        Neighbourhoods { skyline: self.skyline(&is_sky), of_probes }
    }

    /// At the probe's own instant, along rows, columns and diagonals of three by three points.
    fn neighbourhood(&self, number: usize, probe: &Probe) -> Neighbourhood {
        let points = NinePoints::new(self, probe);
        let steps = points.steps();
        // Lines are for models, which may be narrower than the distance of the points; where the terrain steps,
        // they count how often.
        let has_lines = self.surfaces.has_models() && (!steps.is_empty() || points.beam.may_show_models());
        let crossings =
            if has_lines { self.line_crossings(number, &points) } else { LineCrossings::default() };
        let gain2 = (self.gain)(probe.pixel).powi(2);
        let terrain2 = gain2
            * steps
                .iter()
                .filter(|pair| points.is_terrain(pair))
                .map(|pair| points.contrast2(pair))
                .sum::<f64>()
            / steps.len().max(1) as f64;
        let terrain_steps = terrain2 / f64::from(2 * NEAR_PX + 1) + crossings.on_terrain;
        let has_border = !steps.is_empty() || crossings.steps + crossings.touching + crossings.creases > 0.0;
        let footprint_px = (has_border || terrain_steps > 0.0).then(|| self.footprint_px(&points));
        // The exposure spreads it over its path.
        let terrain_steps =
            footprint_px.map_or(0.0, |[side_px, path_px]| terrain_steps / (side_px * (side_px + path_px)));
        let footprint_px = footprint_px.filter(|_| has_border);
        let silhouette = footprint_px
            .filter(|_| !steps.is_empty())
            .map(|[_, path_px]| silhouette_probe(&points, &steps, gain2, path_px));
        // Between points 3 px apart a crease bends threefold.
        let is_fold = |line: &[usize; 3]| bends(points.along(line), f64::from(NEAR_PX) * CREASE);
        Neighbourhood {
            near_silhouette: silhouette.is_some() || crossings.count > 0 || LINES.iter().any(is_fold),
            silhouette,
            footprint_px,
            crossings,
            terrain_steps,
            is_sky: points.is_sky(),
        }
    }

    /// Side of a probe's pixel, and how far its path over the exposure goes: to and fro spreads a border no
    /// farther than that.
    fn footprint_px(&self, points: &NinePoints<'_>) -> [f64; 2] {
        let (probe, focal_px) = (points.probe, self.reach.camera.central_focal_px());
        let exposure_s = self.shutter.exposure_pixel_s(probe.pixel[0], probe.pixel[1]);
        let path = path_px(self.path, points.mid_s, exposure_s, probe.uv, points.middle(), focal_px);
        [(focal_px.element_product() * probe.uv_from_px.determinant().abs()).sqrt(), path.0.length()]
    }
}

fn silhouette_probe(points: &NinePoints<'_>, steps: &[Pair], gain2: f64, path_px: f64) -> SilhouetteProbe {
    let of_pair = |pair: &Pair| (points.is_between_surfaces(pair), gain2 * points.contrast2(pair));
    let (between_surfaces, before_sky): (Vec<_>, Vec<_>) =
        steps.iter().map(of_pair).partition(|(is_between_surfaces, _)| *is_between_surfaces);
    let [surfaces2, sky2] = [&between_surfaces, &before_sky]
        .map(|pairs| pairs.iter().map(|(_, contrast2)| contrast2).sum::<f64>());
    SilhouetteProbe {
        contrast2: (surfaces2 + sky2) / steps.len() as f64,
        contrast2_between_surfaces: (!between_surfaces.is_empty())
            .then(|| surfaces2 / between_surfaces.len() as f64),
        steps_between_surfaces: surfaces2 / steps.len() as f64 / f64::from(2 * NEAR_PX + 1),
        path_px,
        pose: points.pose,
        uv: points.probe.uv,
        inverse_depths: steps.iter().map(|pair| points.inverse_depths(pair)).collect(),
        normal: points.normal(),
    }
}
