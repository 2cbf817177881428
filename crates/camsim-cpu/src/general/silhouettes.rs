//! Silhouette rays: detection of the pixels that may see several surfaces, and the mean colour of rays over
//! their area and exposure. Twin of `shaders/reverse/edges`.

use camsim_core::temporal::{
    ColorImage, IdealGeometry,
    edge_lines::{EdgeLine, edge_line},
    edge_mask::is_edge,
    silhouette_rays::{SurfaceHit, first_visible, march, mean_of_rays},
    supersampled::{PixelCentre, Supersampled},
};
use camsim_plan::{EdgeStage, FramePlan};
use glam::{DVec2, DVec3};
use half::f16;
use rayon::prelude::*;

use super::{IdealImage, Pixel, ReversePass, keys::Key, rows::Pose, solver::Solver};

/// Side of the tiles of [`Reach`], ideal pixels.
const TILE_PX: u32 = 8;
/// The march along a ray starts at this multiple of the inverse depth of the nearest surface.
const NEARER: f64 = 1.02;
/// Largest ratio of that surface's inverse depth in the row's camera to that in the key camera. Without a
/// bound the march would not end for cameras that almost touch the surface.
const MAX_STRETCH: f64 = 4.0;
/// Maximum number of look-ups along the parallax of a ray.
const MAX_LOOK_UPS: f64 = 128.0;
/// Least weight of edge pixels with which a mean counts as having touched an edge.
const MIN_EDGE_WEIGHT: f64 = 1e-4;
/// Largest distance between the hit of a ray and the source of the plain gather on the same surface, ideal
/// pixels.
const PLAIN_PX: f64 = 0.25;
/// Largest difference of two depths of one surface, as parallax in ideal pixels.
const SAME_PX: f64 = 0.25;

/// The samples of a supersampled ideal frame, its edge mask and the borders within edge pixels. Samples are
/// ordered as in [`camsim_core::temporal::supersampled::SupersampledImage::samples`].
#[derive(Clone, Debug)]
pub struct FineSamples {
    scale: u32,
    /// Inverse planar depths of the samples of each fine pixel, 1/m.
    depths: Vec<[f32; 4]>,
    /// Linear colours of the samples of each fine pixel. Empty if the frame has colours at pixel centres
    /// only.
    colors: Vec<[[f16; 3]; 4]>,
    /// Number of each pixel among the edge pixels, or [`NO_EDGE`].
    edge_numbers: Vec<u32>,
    /// Borders within the fine pixels of each edge pixel.
    edge_lines: Vec<Option<EdgeLine>>,
}

/// Number of the pixels that are not edge pixels.
const NO_EDGE: u32 = u32::MAX;

impl FineSamples {
    /// Computes edge mask and borders. `inverse_depth` are the depths at the pixel centres; `scale` and
    /// `thin` are those of [`EdgeStage::Supersampled`]; `colors` are empty for a scale of 1.
    ///
    /// # Panics
    /// If the number of samples does not match the size.
    #[must_use]
    pub fn new(
        size_px: [u32; 2],
        inverse_depth: &[f32],
        (scale, thin): (u32, bool),
        depths: Vec<[f32; 4]>,
        colors: Vec<[[f16; 3]; 4]>,
    ) -> Self {
        let [width, height] = size_px.map(i64::from);
        let fine_px = size_px.map(|side| i64::from(side * scale));
        let count = (fine_px[0] * fine_px[1]) as usize;
        assert!(depths.len() == count && (colors.is_empty() || colors.len() == count), "{count} fine pixels");
        let side = i64::from(scale);
        let fine_pixels =
            |[x, y]: [i64; 2]| (0..side * side).map(move |k| [x * side + k % side, y * side + k / side]);
        let samples_of = |[x, y]: [i64; 2]| &depths[(y * fine_px[0] + x) as usize];
        let is_edge_pixel = |i: i64| {
            let pixel = [i % width, i / width];
            let centre = |[x, y]: [i64; 2]| f64::from(inverse_depth[(y * width + x) as usize]);
            let range = || {
                let samples = fine_pixels(pixel).flat_map(samples_of).map(|&w| f64::from(w));
                samples.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], w| [low.min(w), high.max(w)])
            };
            is_edge(pixel, size_px, scale, centre, thin.then(range))
        };
        let edge_mask: Vec<bool> = (0..width * height).into_par_iter().map(is_edge_pixel).collect();
        let mut count = 0;
        let number = |&is_edge: &bool| {
            count += u32::from(is_edge);
            if is_edge { count - 1 } else { NO_EDGE }
        };
        let edge_numbers = edge_mask.iter().map(number).collect();
        let depth = |fine_pixel: [i64; 2], sample: usize| f64::from(samples_of(fine_pixel)[sample]);
        let line = |fine_pixel: [i64; 2]| edge_line(fine_pixel, fine_px, &depth);
        let edge_pixels = (0..width * height).into_par_iter().filter(|&i| edge_mask[i as usize]);
        let edge_lines =
            edge_pixels.flat_map_iter(|i| fine_pixels([i % width, i / width]).map(line)).collect();
        Self { scale, depths, colors, edge_numbers, edge_lines }
    }

    fn is_edge(&self, pixel: usize) -> bool {
        self.edge_numbers[pixel] != NO_EDGE
    }
}

/// Bounds for the rays whose points at infinity project into one tile of the ideal frame.
#[derive(Clone, Copy, Debug, Default)]
struct Reach {
    /// Largest inverse depth within their parallax, 1/m.
    nearest: f32,
    /// Whether an edge pixel lies within their parallax.
    has_edge: bool,
}

impl Reach {
    fn joined(self, other: Self) -> Self {
        Self { nearest: self.nearest.max(other.nearest), has_edge: self.has_edge || other.has_edge }
    }
}

/// A supersampled key frame.
#[derive(Debug)]
pub(super) struct SilhouetteImage<'a> {
    image: &'a IdealImage,
    samples: &'a FineSamples,
    /// Edge mask as an image: R G B A are 1 at edge pixels.
    edge_rgba: Vec<f32>,
    reaches: Vec<Reach>,
    tiles_across: usize,
}

impl Supersampled for SilhouetteImage<'_> {
    fn size_px(&self) -> [u32; 2] {
        self.image.geometry.size_px
    }

    fn scale(&self) -> u32 {
        self.samples.scale
    }

    fn centre(&self, pixel: usize) -> PixelCentre {
        let rgb = [0, 1, 2].map(|channel| f64::from(self.image.color_rgba[4 * pixel + channel]));
        PixelCentre { inverse_depth: self.image.inverse_depth[pixel].into(), color: DVec3::from_array(rgb) }
    }

    fn is_edge(&self, pixel: usize) -> bool {
        self.samples.is_edge(pixel)
    }

    fn edge_line(&self, fine_pixel: usize) -> Option<EdgeLine> {
        let [width, scale] = [self.size_px()[0] as usize, self.scale() as usize];
        let [x, y] = [fine_pixel % (width * scale), fine_pixel / (width * scale)];
        match self.samples.edge_numbers[y / scale * width + x / scale] {
            NO_EDGE => None,
            number => {
                self.samples.edge_lines[number as usize * scale * scale + y % scale * scale + x % scale]
            }
        }
    }

    fn sample_depth(&self, sample: usize) -> f64 {
        self.samples.depths[sample / 4][sample % 4].into()
    }

    fn sample_color(&self, sample: usize) -> Option<DVec3> {
        let color = self.samples.colors.get(sample / 4)?[sample % 4];
        Some(DVec3::from_array(color.map(f64::from)))
    }
}

impl<'a> SilhouetteImage<'a> {
    pub fn new(plan: &FramePlan, image: &'a IdealImage, samples: &'a FineSamples) -> Self {
        let size_px = image.geometry.size_px;
        assert_eq!(samples.edge_numbers.len(), image.inverse_depth.len(), "samples of the ideal frame");
        let edge = |&number: &u32| [if number == NO_EDGE { 0.0 } else { 1.0 }; 4];
        let reach_tiles = plan.mark_reach_px().div_ceil(TILE_PX) as usize;
        let (tiles_across, reaches) = reaches(size_px, &image.inverse_depth, samples, reach_tiles);
        let edge_rgba = samples.edge_numbers.iter().flat_map(edge).collect();
        Self { image, samples, edge_rgba, reaches, tiles_across }
    }

    fn ideal(&self) -> &'a IdealGeometry {
        &self.image.geometry
    }

    /// Edge mask as an image: 1 at edge pixels, 0 elsewhere.
    pub fn edge_image(&self) -> ColorImage<'_> {
        ColorImage { size_px: self.size_px(), rgba: &self.edge_rgba }
    }

    /// Bounds for a ray whose point at infinity projects here.
    fn reach(&self, far_px: DVec2) -> Reach {
        let last = DVec2::new(self.size_px()[0].into(), self.size_px()[1].into()) - 1.0;
        let [x, y] =
            (far_px + 0.5).clamp(DVec2::ZERO, last).to_array().map(|px| px as usize / TILE_PX as usize);
        self.reaches[y * self.tiles_across + x]
    }

    /// Weight of edge pixels in a bilinear read.
    fn edge_weight(&self, position_px: DVec2) -> f64 {
        self.edge_image().sample(position_px).x
    }

    /// Whether a line of the ideal frame passes an edge pixel.
    fn passes_silhouette(&self, a_px: DVec2, b_px: DVec2) -> bool {
        let look_ups = a_px.distance(b_px).ceil().clamp(1.0, MAX_LOOK_UPS) as u32;
        (0..=look_ups).any(|i| self.edge_weight(a_px.lerp(b_px, f64::from(i) / f64::from(look_ups))) > 0.0)
    }
}

/// Number of tiles across, and the bounds of every tile.
fn reaches(
    size_px: [u32; 2],
    inverse_depth: &[f32],
    samples: &FineSamples,
    reach_tiles: usize,
) -> (usize, Vec<Reach>) {
    let [across, down] = size_px.map(|side| side.div_ceil(TILE_PX) as usize);
    let mut tiles = vec![Reach::default(); across * down];
    for (i, &nearest) in inverse_depth.iter().enumerate() {
        let has_edge = samples.is_edge(i);
        let [x, y] = [i % size_px[0] as usize, i / size_px[0] as usize].map(|px| px / TILE_PX as usize);
        let tile = &mut tiles[y * across + x];
        *tile = tile.joined(Reach { nearest, has_edge });
    }
    // The maximum filter is separable: rows of tiles, then columns.
    for (length, step) in [(across, 1), (down, across)] {
        let joined = |tile: usize| {
            let position = tile / step % length;
            let first = position.saturating_sub(reach_tiles);
            let last = position.saturating_add(reach_tiles).min(length - 1);
            let tile_at = |at: usize| tiles[tile + at * step - position * step];
            (first..=last).map(tile_at).fold(Reach::default(), Reach::joined)
        };
        tiles = (0..across * down).map(joined).collect();
    }
    (across, tiles)
}

impl Solver {
    /// Inverse depth of the nearest surface within reach of a ray, in the row's camera, 1/m.
    fn nearest_inverse_depth(&self, uv: DVec2, pose: &Pose, reach: Reach) -> f64 {
        let in_key = NEARER * f64::from(reach.nearest);
        self.inverse_depth_in_row(uv, pose, in_key).min(MAX_STRETCH * in_key)
    }

    /// Whether the parallax of a ray passes a silhouette.
    fn is_near_silhouette(&self, uv: DVec2, pose: &Pose, image: &SilhouetteImage<'_>) -> bool {
        let far = self.point(uv, pose, 0.0);
        let far_px = image.ideal().px_from_point(far);
        let reach = image.reach(far_px);
        if far.z <= 0.0 || !reach.has_edge {
            return false;
        }
        let near = self.point(uv, pose, self.nearest_inverse_depth(uv, pose, reach));
        near.z > 0.0 && image.passes_silhouette(image.ideal().px_from_point(near), far_px)
    }

    /// First intersection of a ray with the surfaces of an ideal frame.
    fn first_surface(&self, uv: DVec2, pose: &Pose, image: &SilhouetteImage<'_>) -> SurfaceHit {
        let position = |w: f64| image.ideal().px_from_point(self.point(uv, pose, w));
        let in_row = |in_key: f64| self.inverse_depth_in_row(uv, pose, in_key);
        let nearest = image.reach(position(0.0)).nearest.into();
        let inverse_depth = |position_px: DVec2| image.inverse_depth(position_px);
        march(position, in_row, nearest, inverse_depth, image.ideal())
    }
}

impl ReversePass<'_> {
    /// Whether a pixel may see several surfaces. `far_px` are those of its path; `marked` says whether the
    /// plain gather touched an edge pixel.
    pub(super) fn silhouette(
        &self,
        pixel: &Pixel<'_>,
        far_px: [DVec2; 2],
        marked: bool,
    ) -> Option<Silhouette> {
        let image = self.keys[pixel.key].silhouettes.as_ref()?;
        let uv = pixel.ray.uv;
        let is_near = |pose: &Pose| self.gather.solver.is_near_silhouette(uv, pose, image);
        let near_mid = || is_near(&pixel.exposure.mid);
        // The bounds of the tile come first: they are cheap, and most pixels are far from all silhouettes.
        let within_reach = || {
            self.gather.solver.has_parallax() && far_px.iter().any(|&far_px| image.reach(far_px).has_edge)
                || self.plan.truth && near_mid()
        };
        // Ends and middle of the exposure: the corner of a surface may pass in between.
        let nodes = pixel.exposure.nodes;
        let may_hit_others = || {
            [nodes.first(), nodes.last()].into_iter().flatten().any(is_near)
                || (self.plan.truth || nodes.len() > 1) && near_mid()
        };
        (marked || within_reach() && may_hit_others()).then_some(Silhouette { marked })
    }

    /// Mean linear colour of the silhouette rays of a pixel. `None` if its rays see one surface.
    pub(super) fn color_of_rays(&self, pixel: &Pixel<'_>, silhouette: Silhouette) -> Option<DVec3> {
        let EdgeStage::Supersampled { samples: count @ 1.., .. } = self.plan.edges else { return None };
        let sees_several =
            silhouette.marked || self.gather.solver.has_parallax() && !self.sees_one_surface(pixel);
        sees_several.then(|| {
            mean_of_rays(pixel.ray.uv, pixel.ray.d_uv, count, |uv, fraction| {
                let (image, hit) = self.first_surface_of_keys(pixel, uv, fraction)?;
                Some(image.color(hit.position_px))
            })
        })
    }

    /// Whether a pixel whose sources pass no edge sees one surface all over its area. If its parallax passes
    /// a silhouette, rays at its four corners must hit what the plain gather reads there. One surface is
    /// better read by the plain gather, which interpolates more smoothly.
    fn sees_one_surface(&self, pixel: &Pixel<'_>) -> bool {
        let key = &self.keys[pixel.key];
        let Some(image) = &key.silhouettes else { return true };
        let solver = &self.gather.solver;
        let [d_dx, d_dy] = pixel.ray.d_uv;
        let corners = || {
            [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
                .map(|[x, y]| pixel.ray.uv + x * d_dx + y * d_dy)
        };
        let fractions: &[f64] = if pixel.exposure.nodes.len() > 1 { &[0.0, 0.5, 1.0] } else { &[0.5] };
        fractions.iter().map(|&fraction| pixel.exposure.pose(fraction)).all(|pose| {
            !solver.is_near_silhouette(pixel.ray.uv, &pose, image)
                || corners().into_iter().all(|uv| {
                    let hit = solver.first_surface(uv, &pose, image);
                    let plain_px = solver.source(uv, &pose, &key.depth).position_px;
                    hit.is_visible && hit.position_px.distance(plain_px) <= PLAIN_PX
                })
        })
    }

    /// First intersection of a ray at a fraction of the exposure: in the key frame that is nearest in time, or
    /// in the next nearest where the point is visible.
    pub(super) fn first_surface_of_keys(
        &self,
        pixel: &Pixel<'_>,
        uv: DVec2,
        fraction: f64,
    ) -> Option<(&SilhouetteImage<'_>, SurfaceHit)> {
        let [row_fraction, exposure_fraction] = self.rows.fractions(pixel.position);
        let window_fraction = row_fraction + (fraction - 0.5) * exposure_fraction;
        let (number, hit) = first_visible(window_fraction, self.keys.len(), |number| {
            let pose = self.rows.exposure(number, pixel.position).pose(fraction);
            let image = self.keys[number].silhouettes.as_ref()?;
            Some(self.gather.solver.first_surface(uv, &pose, image))
        })?;
        Some((self.keys[number].silhouettes.as_ref()?, hit))
    }

    /// Whether the parallax of a pixel's centre ray passes a silhouette at a fraction of the exposure.
    pub(super) fn is_near_silhouette(&self, pixel: &Pixel<'_>, fraction: f64) -> bool {
        let pose = pixel.exposure.pose(fraction);
        self.keys[pixel.key]
            .silhouettes
            .as_ref()
            .is_some_and(|image| self.gather.solver.is_near_silhouette(pixel.ray.uv, &pose, image))
    }

    /// First intersection of a pixel's centre ray at a fraction of the exposure: position in the key frame, and
    /// inverse depth in the row's camera, 1/m.
    pub(super) fn centre_hit(&self, pixel: &Pixel<'_>, fraction: f64) -> Option<(DVec2, f64)> {
        let (image, hit) = self.first_surface_of_keys(pixel, pixel.ray.uv, fraction)?;
        let pose = pixel.exposure.pose(fraction);
        let w = self.smooth_depth(&self.keys[pixel.key], image, pixel.ray.uv, &pose, hit.row_inverse_depth);
        Some((image.ideal().px_from_point(self.gather.solver.point(pixel.ray.uv, &pose, w)), w))
    }

    /// Refines the inverse depth of a hit (1/m) by interpolation between pixel centres, which is smoother
    /// than samples. Edge pixels keep the sample's depth.
    fn smooth_depth(
        &self,
        key: &Key<'_>,
        image: &SilhouetteImage<'_>,
        uv: DVec2,
        pose: &Pose,
        hit: f64,
    ) -> f64 {
        let solver = &self.gather.solver;
        let position = |w: f64| image.ideal().px_from_point(solver.point(uv, pose, w));
        let hit_px = position(hit);
        if image.edge_weight(hit_px) > MIN_EDGE_WEIGHT {
            return hit;
        }
        let px_per_w = hit_px.distance(position(0.0)) / hit.max(1e-12);
        let step = |w: f64| solver.inverse_depth_in_row(uv, pose, key.depth.image.inverse_depth(position(w)));
        let w = step(step(step(hit)));
        if (w - hit).abs() * px_per_w < SAME_PX { w } else { hit }
    }
}

/// A pixel that may see several surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silhouette {
    /// Whether the plain gather touched an edge pixel.
    marked: bool,
}

/// Whether a mean of the edge image touched an edge pixel. The mean is negative if the pixel has a negative
/// weight of the spline.
pub(super) fn touches_edge(mean: f64) -> bool {
    mean.abs() > MIN_EDGE_WEIGHT
}
