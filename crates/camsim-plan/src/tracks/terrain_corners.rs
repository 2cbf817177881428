//! Corners of a regular grid on the terrain, where the frames see it.

use camsim_core::{
    row_time::WorldPoint,
    scene::{CHUNK_CELLS, Terrain},
    tracks::{TrackPoint, seeded_offset},
};
use glam::{DVec2, DVec3};

use super::views::Views;
use crate::{planner::Planner, view::surfaces::Surfaces};

/// Pixels across and down whose rays find the part of the terrain that a frame sees.
const RAYS: [u32; 2] = [13, 9];
/// Tries for the finest grid that is not too fine.
const TRIES: usize = 8;
/// Corners that one try looks at, at most, for each point that is wanted.
const CORNERS_A_POINT: u64 = 16;

/// Corners from west to east and from north to south: the first and the last.
#[derive(Clone, Copy)]
struct Part {
    low: [u32; 2],
    high: [u32; 2],
}

impl Part {
    /// Corners of a grid with this step in cells, at most.
    fn corners(self, step: u32) -> u64 {
        (0..2).map(|k| u64::from((self.high[k] - self.low[k]) / step + 1)).product()
    }

    fn with(self, low: [u32; 2], high: [u32; 2]) -> Self {
        Self { low: [0, 1].map(|k| self.low[k].min(low[k])), high: [0, 1].map(|k| self.high[k].max(high[k])) }
    }
}

/// Corners of the terrain with the least step, the same across and down, of which the frames see at most
/// `count`. The seed shifts the grid.
pub(super) fn corners(planner: &Planner, views: &Views, count: usize, seed: u64) -> Vec<TrackPoint> {
    let surfaces = planner.surfaces();
    let Some(terrain) = surfaces.terrain() else { return Vec::new() };
    let Some(part) = seen_part(surfaces, terrain, views) else { return Vec::new() };
    let at_step = |step: u32| seen_corners(surfaces, terrain, views, part, (step, seed));
    let finest_with = |most: u64| (1..).find(|&step| part.corners(step) <= most).unwrap_or(u32::MAX);
    // With this step there are not too many corners, seen or not.
    let mut step = finest_with(count as u64);
    let mut found = at_step(step);
    let mut too_fine = finest_with(CORNERS_A_POINT * count as u64) - 1;
    for _ in 0..TRIES {
        if too_fine + 1 >= step {
            break;
        }
        let ratio = (found.len().max(1) as f64 / count as f64).sqrt();
        let finer = ((f64::from(step) * ratio).ceil() as u32).clamp(too_fine + 1, step - 1);
        let corners = at_step(finer);
        if corners.len() > count {
            too_fine = finer;
        } else {
            (step, found) = (finer, corners);
        }
    }
    let point = |([i, j], position_ned_m): ([u32; 2], DVec3)| TrackPoint {
        source: "terrain".into(),
        name: format!("{i}/{j}"),
        position_ned_m,
        moves_with: None,
    };
    found.into_iter().map(point).collect()
}

/// Bounds of the cells that rays of the frames meet, an eighth larger on each side.
fn seen_part(surfaces: &Surfaces, terrain: &Terrain, views: &Views) -> Option<Part> {
    let mut part: Option<Part> = None;
    for (camera, _, pose) in &views.cameras {
        let last_px = DVec2::from_array(camera.size_px.map(|size| f64::from(size) - 1.0));
        for ray in 0..RAYS[0] * RAYS[1] {
            let fraction = DVec2::new(
                f64::from(ray % RAYS[0]) / f64::from(RAYS[0] - 1),
                f64::from(ray / RAYS[0]) / f64::from(RAYS[1] - 1),
            );
            let Some(uv) = camera.unproject(fraction * last_px) else { continue };
            let ray_ned = pose.ned_from_camera * uv.extend(1.0);
            let hit = surfaces.first_hit(pose.position_ned_m, ray_ned).and_then(|hit| hit.terrain);
            let Some(hit) = hit else { continue };
            let chunk = [hit.chunk % terrain.chunk_grid[0], hit.chunk / terrain.chunk_grid[0]];
            let cell = [0, 1].map(|k| CHUNK_CELLS * chunk[k] + hit.cell[k]);
            let end = cell.map(|n| n + 1);
            part = Some(part.unwrap_or(Part { low: cell, high: end }).with(cell, end));
        }
    }
    let Part { low, high } = part?;
    let margin = [0, 1].map(|k| (high[k] - low[k]).div_ceil(8));
    Some(Part {
        low: [0, 1].map(|k| low[k].saturating_sub(margin[k])),
        high: [0, 1].map(|k| (high[k] + margin[k]).min(terrain.cells[k])),
    })
}

/// Corners with this step that the frames see, and where they are.
fn seen_corners(
    surfaces: &Surfaces,
    terrain: &Terrain,
    views: &Views,
    part: Part,
    (step, seed): (u32, u64),
) -> Vec<([u32; 2], DVec3)> {
    // The shift is that of the grid over all of the terrain.
    let first = [0, 1].map(|k: usize| {
        let shift = seeded_offset(seed.wrapping_add(k as u64), step);
        part.low[k] + (shift + step - part.low[k] % step) % step
    });
    let rows = (first[1]..=part.high[1]).step_by(step as usize);
    let corners = rows.flat_map(|j| (first[0]..=part.high[0]).step_by(step as usize).map(move |i| [i, j]));
    let with_position = corners.filter_map(|corner| Some((corner, position(terrain, corner)?)));
    views.seen(surfaces, with_position.collect(), |(_, at_ned_m)| WorldPoint::At(*at_ned_m))
}

/// Position of a corner of the terrain's grid; `None` for one without a height.
fn position(terrain: &Terrain, corner: [u32; 2]) -> Option<DVec3> {
    let cell = [0, 1].map(|k| corner[k].min(terrain.cells[k] - 1));
    let (chunk, inside) = terrain.chunk_of_cell(cell);
    let [i, j] = [0, 1].map(|k| inside[k] + corner[k] - cell[k]);
    let position_ned_m = terrain.position_ned_m(chunk, i, j);
    position_ned_m.is_finite().then_some(position_ned_m)
}
