//! Depth and coordinates where a look-up in the ideal frame is unreliable
//! ([`camsim_core::temporal::unreliable_depth`]): by rays in f64.
//!
//! Most of these pixels are at creases of the terrain, where neighbours see the same patch. Their rays are
//! walked from the triangle of the pixel beside them, which costs a tenth of a cast ray; a ray is cast where
//! the walk does not arrive, where it contradicts the look-up, and where a silhouette passes between two
//! neighbours.

use camsim_core::{
    scene::TerrainTriangle,
    temporal::unreliable_depth::{DepthGrid, changed},
};
use camsim_plan::{FramePlan, FrameRays, PixelHit, PixelTruth, uniforms::Truth};
use glam::DVec2;
use rayon::prelude::*;

/// Relative difference of inverse depth between a look-up and a walk from which on they are of two surfaces.
/// Look-ups on the same surface differ by the terrain's level of detail and by bilinear reads at creases.
const SAME_SURFACE: f32 = 0.01;

/// How the truth of a pixel is known.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    LookUp,
    /// By a walk that ended at this triangle.
    Walk(TerrainTriangle),
    /// By a walk that began at the pixel on the left.
    WalkFromLeft(TerrainTriangle),
    /// By a ray, which hit this triangle of the terrain or something else.
    Ray(Option<TerrainTriangle>),
}

impl Source {
    fn triangle(self) -> Option<TerrainTriangle> {
        match self {
            Self::LookUp => None,
            Self::Walk(triangle) | Self::WalkFromLeft(triangle) => Some(triangle),
            Self::Ray(triangle) => triangle,
        }
    }

    fn is_walk(self) -> bool {
        matches!(self, Self::Walk(_) | Self::WalkFromLeft(_))
    }

    fn is_ray(self) -> bool {
        matches!(self, Self::Ray(_))
    }
}

/// Casts rays for the pixels whose depth the gpu has left open (below 0), for those whose depth may belong to
/// no surface or to the wrong one, and from each pixel that a ray has corrected on for its neighbours.
/// Pixels are valid where `color_rgba` says so.
pub(crate) fn complete(truth: &mut [Truth], color_rgba: &[f32], plan: &FramePlan, rays: &FrameRays<'_>) {
    complete_pixels(truth, color_rgba, plan, rays, None);
}

/// The surface of every pixel, by a ray of its own, into `hits`; `None` where there is no ray or the ray shows the sky.
/// Depths and coordinates of `truth` become those of the rays.
pub(crate) fn of_all_pixels(
    truth: &mut [Truth],
    color_rgba: &[f32],
    plan: &FramePlan,
    rays: &FrameRays<'_>,
    hits: &mut Vec<Option<PixelHit>>,
) {
    hits.clear();
    hits.resize(truth.len(), None);
    complete_pixels(truth, color_rgba, plan, rays, Some(hits));
}

fn complete_pixels(
    truth: &mut [Truth],
    color_rgba: &[f32],
    plan: &FramePlan,
    rays: &FrameRays<'_>,
    mut hits: Option<&mut [Option<PixelHit>]>,
) {
    let width = plan.camera.size_px[0] as usize;
    let mut source = vec![Source::LookUp; truth.len()];
    let open: Vec<usize> = (0..truth.len()).filter(|&i| truth[i].depth_m < 0.0).collect();
    Frame { width, truth, source: &mut source, rays, hits: hits.as_deref_mut() }.cast(&open);

    let valid: Vec<bool> = color_rgba.chunks_exact(4).map(|rgba| rgba[3] > 0.0).collect();
    let looked_up: Vec<f32> = truth.iter().map(inverse_depth).collect();
    let row_step = if plan.shutter.interlace_s() > 0.0 { 2 } else { 1 };
    let displacement_px = rays.terrain_displacement_px() as f32;
    let grid = DepthGrid { width, row_step, inverse_depth: &looked_up, valid: &valid, displacement_px };
    let unreliable = if hits.is_some() { valid.clone() } else { grid.unreliable_pixels() };
    let mut frame = Frame { width, truth, source: &mut source, rays, hits: hits.as_deref_mut() };
    frame.walk_rows(&unreliable, &looked_up);
    let at_silhouettes = frame.at_silhouettes(&unreliable, row_step * width);
    frame.cast(&at_silhouettes);

    let mut changed_pixels: Vec<usize> = (0..looked_up.len())
        .filter(|&i| unreliable[i] && source[i].is_ray() && changed(looked_up[i], inverse_depth(&truth[i])))
        .collect();
    while !changed_pixels.is_empty() {
        let mut beside: Vec<usize> = changed_pixels
            .iter()
            .flat_map(|&i| grid.neighbours(i))
            .filter(|&i| valid[i] && !source[i].is_ray())
            .collect();
        beside.sort_unstable();
        beside.dedup();
        Frame { width, truth, source: &mut source, rays, hits: hits.as_deref_mut() }.cast(&beside);
        beside.retain(|&i| changed(looked_up[i], inverse_depth(&truth[i])));
        changed_pixels = beside;
    }
}

/// The pixels of a frame, row-major.
struct Frame<'a> {
    width: usize,
    truth: &'a mut [Truth],
    source: &'a mut [Source],
    rays: &'a FrameRays<'a>,
    /// The surface of each pixel, where all are wanted.
    hits: Option<&'a mut [Option<PixelHit>]>,
}

impl Frame<'_> {
    fn pixel(&self, i: usize) -> [u32; 2] {
        [(i % self.width) as u32, (i / self.width) as u32]
    }

    fn cast(&mut self, pixels: &[usize]) {
        let cast = |&i: &usize| self.rays.cast(self.pixel(i), uv(&self.truth[i]));
        let hits: Vec<PixelTruth> = pixels.par_iter().map(cast).collect();
        for (&i, hit) in pixels.iter().zip(&hits) {
            set(&mut self.truth[i], hit);
            self.source[i] = Source::Ray(triangle(hit));
            if let Some(hits) = &mut self.hits {
                hits[i] = hit.hit;
            }
        }
    }

    /// Walks along each row from one unreliable pixel to the next, and casts where that fails.
    fn walk_rows(&mut self, unreliable: &[bool], looked_up: &[f32]) {
        let (width, rays) = (self.width, self.rays);
        let count = self.truth.len() / width;
        let hits: Vec<Option<&mut [Option<PixelHit>]>> = match &mut self.hits {
            Some(hits) => hits.chunks_mut(width).map(Some).collect(),
            None => (0..count).map(|_| None).collect(),
        };
        let rows = self.truth.par_chunks_mut(width).zip(self.source.par_chunks_mut(width)).zip(hits);
        rows.enumerate().for_each(|(y, ((truth, source), mut hits))| {
            let mut last: Option<(usize, TerrainTriangle)> = None;
            let mut pixel_walk = rays.pixel_walk();
            for x in 0..width {
                let i = y * width + x;
                if !unreliable[i] || source[x].is_ray() {
                    continue;
                }
                let (pixel, uv) = ([x as u32, y as u32], uv(&truth[x]));
                let window = 2.0 * f64::from(SAME_SURFACE);
                let walk = last.and_then(|(_, from)| pixel_walk.to(from, pixel, uv, window));
                let walk = walk.filter(|walk| is_near(looked_up[i], walk));
                let hit = walk.unwrap_or_else(|| rays.cast(pixel, uv));
                set(&mut truth[x], &hit);
                if let Some(hits) = &mut hits {
                    hits[x] = hit.hit;
                }
                source[x] = match (triangle(&hit), last) {
                    (Some(triangle), Some((from_x, _))) if walk.is_some() => {
                        if from_x + 1 == x {
                            Source::WalkFromLeft(triangle)
                        } else {
                            Source::Walk(triangle)
                        }
                    }
                    (triangle, _) => Source::Ray(triangle),
                };
                last = triangle(&hit).map(|triangle| (x, triangle)).or(last);
            }
        });
    }

    /// Walked pixels whose walk does not lead on to an unreliable neighbour in the row or the column.
    fn at_silhouettes(&self, unreliable: &[bool], stride: usize) -> Vec<usize> {
        let (width, length) = (self.width, self.source.len());
        let rows = (0..length / width).into_par_iter().flat_map_iter(|y| {
            (y * width..(y + 1) * width).flat_map(move |i| {
                let right = (i % width + 1 < width).then_some(i + 1);
                let below = (i + stride < length).then_some(i + stride);
                let pairs = [right, below].into_iter().flatten();
                pairs
                    .filter(move |&beside| self.is_parted(unreliable, i, beside))
                    .flat_map(move |beside| [i, beside])
            })
        });
        let mut pixels: Vec<usize> = rows.filter(|&i| self.source[i].is_walk()).collect();
        pixels.sort_unstable();
        pixels.dedup();
        pixels
    }

    /// Whether a silhouette may lie between two neighbours, at least one of which was walked.
    fn is_parted(&self, unreliable: &[bool], here: usize, beside: usize) -> bool {
        let sources = [self.source[here], self.source[beside]];
        let is_walked = beside == here + 1 && matches!(sources[1], Source::WalkFromLeft(_));
        if !(unreliable[here] && unreliable[beside])
            || is_walked
            || sources.iter().all(|source| source.is_ray())
        {
            return false;
        }
        match sources.map(Source::triangle) {
            [Some(from), Some(to)] => {
                !self.rays.connects(from, self.pixel(beside), uv(&self.truth[beside]), to)
            }
            _ => true,
        }
    }
}

fn triangle(truth: &PixelTruth) -> Option<TerrainTriangle> {
    truth.hit.and_then(|hit| hit.triangle)
}

fn uv(truth: &Truth) -> DVec2 {
    DVec2::new(f64::from(truth.uv[0]), f64::from(truth.uv[1]))
}

fn is_near(looked_up: f32, walk: &PixelTruth) -> bool {
    walk.hit.is_some_and(|hit| (looked_up * hit.depth_m as f32 - 1.0).abs() <= SAME_SURFACE)
}

/// 1/m; 0 where nothing is.
fn inverse_depth(truth: &Truth) -> f32 {
    if truth.depth_m > 0.0 { 1.0 / truth.depth_m } else { 0.0 }
}

fn set(truth: &mut Truth, hit: &PixelTruth) {
    truth.source_px = hit.source_px.as_vec2().to_array();
    truth.point_ned_m = hit.hit.map_or([0.0; 3], |hit| hit.point_ned_m.as_vec3().to_array());
    truth.depth_m = hit.hit.map_or(0.0, |hit| hit.depth_m as f32);
}
