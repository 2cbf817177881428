//! Which chunks to draw at which level: a pure function of camera and terrain.

use glam::DVec3;

use super::{Aabb, LEVELS, LevelError, Terrain, TerrainChunk, query::Frustum};
use crate::pose::CameraPose;

/// One chunk to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkDraw {
    /// Index in [`Terrain::chunks`].
    pub chunk: u32,
    /// Level of detail. A chunk with voids has level 0 and is drawn by its own indices.
    pub level: u8,
    /// Levels of the neighbours in the north, east, south and west, where they are coarser; else `level`.
    pub edge_levels: [u8; 4],
}

/// What to draw, and what that costs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LodSelection {
    /// Chunks in sight, by index.
    pub draws: Vec<ChunkDraw>,
    /// Triangles of all of them, degenerate ones included.
    pub triangles: u64,
    /// Bound on the displacement of any visible surface point in the ideal frame, pixels.
    pub max_error_px: f64,
}

/// How a camera sees the errors of one chunk.
#[derive(Clone, Copy, Debug)]
struct View {
    /// Pixels per metre of displacement across the line of sight, at most.
    px_per_m: f64,
    /// Sine of the angle between line of sight and vertical, at most.
    sine: f64,
}

impl View {
    /// A deviation of `total_m`, of which `horizontal_m` is horizontal, moves a point across the line of sight by its vertical part times
    /// the sine, plus its horizontal part.
    fn error_px(&self, error: LevelError) -> f64 {
        let (total, horizontal) = (f64::from(error.total_m), f64::from(error.horizontal_m));
        let across = (total * self.sine + horizontal).min(total);
        // 0 * infinity: an exact surface is exact from anywhere.
        if across == 0.0 { 0.0 } else { across * self.px_per_m }
    }
}

/// Chooses for each chunk in sight the coarsest level whose error stays within `max_error_px`.
///
/// `tangents` = [u_min, u_max, v_min, v_max] of the ideal frame (u = x/z, v = y/z in the optical frame), `focal_px` its larger focal
/// length. The bound is conservative: smallest distance of the chunk's box, largest distance from the principal axis within the frame,
/// vertical errors seen from the side. Neighbours in sight differ by one level at most, and chunks with voids (always complete) are
/// surrounded by complete ones. Level 0 is exact, so any tolerance can be kept.
pub fn select_lod(terrain: &Terrain, camera: &CameraPose, tangents: [f64; 4], focal_px: f64, max_error_px: f64) -> LodSelection {
    let frustum = Frustum::new(camera, tangents);
    let radius2_max = tangents[0].abs().max(tangents[1].abs()).powi(2) + tangents[2].abs().max(tangents[3].abs()).powi(2);
    let views: Vec<Option<View>> = terrain
        .chunks
        .iter()
        .map(|chunk| (chunk.has_surface() && frustum.may_see(&chunk.bounds)).then(|| view(&chunk.bounds, camera, focal_px, radius2_max)))
        .collect();
    let mut levels: Vec<u8> = terrain.chunks.iter().zip(&views).map(|(chunk, view)| wanted_level(chunk, *view, max_error_px)).collect();
    settle(terrain, &views, &mut levels, max_error_px);

    let mut selection = LodSelection::default();
    for (index, chunk) in terrain.chunks.iter().enumerate() {
        let Some(view) = views[index] else { continue };
        let level = levels[index];
        let edge_levels = neighbours(terrain, index).map(|n| match n {
            Some(n) if views[n].is_some() => levels[n].max(level),
            _ => level,
        });
        let is_stitched = edge_levels.iter().any(|&edge| edge > level);
        let error = if is_stitched { chunk.stitched_error[level as usize] } else { chunk.error[level as usize] };
        selection.max_error_px = selection.max_error_px.max(view.error_px(error));
        selection.triangles += match &chunk.void_indices {
            Some(range) => (range.len() / 3) as u64,
            None => chunk.cells_at(level).iter().map(|&n| u64::from(n)).product::<u64>() * 2,
        };
        selection.draws.push(ChunkDraw { chunk: index as u32, level, edge_levels });
    }
    selection
}

fn view(bounds: &Aabb, camera: &CameraPose, focal_px: f64, radius2_max: f64) -> View {
    let from_camera = Aabb { min: bounds.min - camera.position_ned_m, max: bounds.max - camera.position_ned_m };
    let distance_m = bounds.distance_m(camera.position_ned_m);
    // Farthest from the principal axis: the box lies within a cone about its middle.
    let centre = from_camera.centre();
    let half_angle = (0.5 * (bounds.max - bounds.min).length() / centre.length()).min(1.0).asin();
    let axis = camera.ned_from_camera * DVec3::Z;
    let off_axis = axis.angle_between(centre) + half_angle;
    let radius2 = if off_axis < std::f64::consts::FRAC_PI_2 { off_axis.tan().powi(2).min(radius2_max) } else { radius2_max };
    // d(tan a) = (1 + tan^2 a) da.
    let px_per_m = focal_px * (1.0 + radius2) / distance_m;
    let aside = from_camera.min.abs().max(from_camera.max.abs());
    let below = from_camera.min.z.max(-from_camera.max.z).max(0.0);
    let sine = aside.x.hypot(aside.y) / aside.x.hypot(aside.y).hypot(below);
    View { px_per_m, sine: if sine.is_finite() { sine } else { 1.0 } }
}

fn wanted_level(chunk: &TerrainChunk, view: Option<View>, max_error_px: f64) -> u8 {
    let Some(view) = view else { return LEVELS as u8 - 1 };
    if chunk.void_indices.is_some() {
        return 0;
    }
    (1..LEVELS).rev().find(|&level| view.error_px(chunk.error[level]) <= max_error_px).unwrap_or(0) as u8
}

/// Lowers levels until neighbours fit and stitched borders keep the tolerance. Levels only fall, so this ends.
fn settle(terrain: &Terrain, views: &[Option<View>], levels: &mut [u8], max_error_px: f64) {
    let mut queue: Vec<usize> = (0..levels.len()).filter(|&index| views[index].is_some()).collect();
    while let Some(index) = queue.pop() {
        let (chunk, Some(view)) = (&terrain.chunks[index], views[index]) else { continue };
        let level = levels[index];
        // A border of voids cannot move, and a stitched border has an error of its own.
        let may_stitch = chunk.void_indices.is_none() && view.error_px(chunk.stitched_error[level as usize]) <= max_error_px;
        let cap = level + u8::from(may_stitch);
        for neighbour in neighbours(terrain, index).into_iter().flatten() {
            if views[neighbour].is_some() && levels[neighbour] > cap {
                levels[neighbour] = cap;
                queue.push(neighbour);
            }
        }
    }
}

/// Chunks in the north, east, south and west.
fn neighbours(terrain: &Terrain, index: usize) -> [Option<usize>; 4] {
    let [cols, rows] = terrain.chunk_grid.map(|n| n as usize);
    let (x, y) = (index % cols, index / cols);
    [(y > 0).then(|| index - cols), (x + 1 < cols).then_some(index + 1), (y + 1 < rows).then_some(index + cols), (x > 0).then(|| index - 1)]
}
