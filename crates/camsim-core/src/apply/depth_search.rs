//! Temporal inverse with depth: fixed-point iteration where there is one surface, a search along the epipolar
//! line of the ray where there are several.

use glam::{DMat3, DVec2, DVec3};

use super::NoSource;
use crate::temporal::{
    IdealGeometry, InverseDepthImage, Source,
    edge_mask::{EDGE_STEP, steps},
};

/// Side of a tile, texels.
const TILE_TEXELS: u32 = 8;
/// Step of the search along the epipolar line, ideal pixels.
const STEP_PX: f64 = 0.5;
/// Largest number of steps of the search.
const MAX_SEARCH_STEPS: f64 = 1024.0;
/// Largest parallax error of an accepted intersection, ideal pixels. Across a jump of depth no point
/// satisfies it.
const HIT_TOLERANCE_PX: f64 = 0.05;
/// Parallax between the surfaces along a path below which they count as one, ideal pixels.
const ONE_SURFACE_PX: f64 = 0.02;
/// Change of the source at which the iteration has converged, ideal pixels.
const CONVERGED_PX: f64 = 1e-8;
const MAX_ITERATIONS: u32 = 32;
/// How often the near end of a path is refined from the tiles along it.
const RANGE_REFINEMENTS: u32 = 4;
/// Ratio of successive bounds of inverse depth above which another refinement gains little.
const RANGE_SHRINK: f64 = 0.9;

/// Depth range of a tile of the depth image.
#[derive(Clone, Copy, Debug, Default)]
struct DepthTile {
    low: f32,
    high: f32,
    /// Whether there is a jump of depth in the tile or at its border.
    has_jump: bool,
}

/// Solves for sources in a depth image, with its depth range and jumps by tile.
#[derive(Clone, Debug)]
pub(super) struct DepthSearch {
    tiles: Vec<DepthTile>,
    columns: u32,
    rows: u32,
    /// Largest inverse depth of the image.
    high: f64,
}

impl DepthSearch {
    pub(super) fn new(depth: &InverseDepthImage<'_>) -> Self {
        let [width, height] = depth.size_px;
        let (columns, rows) = (width.div_ceil(TILE_TEXELS), height.div_ceil(TILE_TEXELS));
        let mut tiles =
            vec![DepthTile { low: f32::INFINITY, high: 0.0, has_jump: false }; (columns * rows) as usize];
        let texel = |x: u32, y: u32| f64::from(depth.values[(y * width + x) as usize]);
        for y in 0..height {
            for x in 0..width {
                let value = depth.values[(y * width + x) as usize];
                let across = steps(
                    texel(x.saturating_sub(1), y),
                    f64::from(value),
                    texel((x + 1).min(width - 1), y),
                    EDGE_STEP,
                );
                let down = steps(
                    texel(x, y.saturating_sub(1)),
                    f64::from(value),
                    texel(x, (y + 1).min(height - 1)),
                    EDGE_STEP,
                );
                let tile = &mut tiles[(y / TILE_TEXELS * columns + x / TILE_TEXELS) as usize];
                tile.low = tile.low.min(value);
                tile.high = tile.high.max(value);
                tile.has_jump |= across || down;
            }
        }
        let high = tiles.iter().fold(0.0_f64, |high, tile| high.max(f64::from(tile.high)));
        Self { tiles, columns, rows, high }
    }

    /// Source of the ray `uv` of a row's camera in the ideal frame. `holes` marks texels with unknown depth;
    /// empty means none.
    pub(super) fn source(
        &self,
        uv: DVec2,
        key_from_row: (DMat3, DVec3),
        depth: &InverseDepthImage<'_>,
        holes: &[bool],
        ideal: &IdealGeometry,
    ) -> Result<Source, NoSource> {
        let (rotation, shift) = key_from_row;
        let path = EpipolarPath { direction: rotation * uv.extend(1.0), shift, depth, holes, ideal };
        if path.direction.z <= 0.0 {
            return Err(NoSource::Outside);
        }
        let inverse_depth = match self.depth_bound(&path) {
            Some(nearest) => path.first_surface(nearest)?,
            // One surface: the fixed-point iteration finds it, unless the surface is as steep as the path.
            None => match path.fixed_point() {
                Some(w) => w,
                None => path.first_surface(path.nearest(self.high))?,
            },
        };
        let in_key = path.direction + inverse_depth * shift;
        let position_px = ideal.px_from_point(in_key);
        if !(in_key.z > 0.0 && ideal.contains(position_px)) {
            return Err(NoSource::Outside);
        }
        if path.is_hole(position_px) {
            Err(NoSource::Hole)
        } else {
            Ok(Source { position_px, inverse_depth })
        }
    }

    /// Bound on the inverse depth, in the row's camera, of all surfaces along a path. `None` if parallax does
    /// not separate several surfaces there.
    fn depth_bound(&self, path: &EpipolarPath<'_>) -> Option<f64> {
        let far_px = path.position_px(0.0);
        let mut nearest = path.nearest(self.high);
        let mut box_high = self.high;
        // The nearest surface of the image is seldom near this path. Each pass tightens the near end of the
        // path, and with it the set of tiles that it crosses.
        for _ in 0..RANGE_REFINEMENTS {
            let near_px = path.position_px(nearest);
            let length_px = far_px.distance(near_px);
            if length_px <= ONE_SURFACE_PX {
                return None;
            }
            let tile = self.merged_tile(far_px, near_px);
            if !(tile.has_jump && f64::from(tile.high - tile.low) * length_px > ONE_SURFACE_PX * nearest) {
                return None;
            }
            let high = f64::from(tile.high);
            let enough = high > RANGE_SHRINK * box_high;
            box_high = high;
            nearest = nearest.min(path.nearest(high));
            if enough {
                break;
            }
        }
        Some(nearest)
    }

    /// Union of the tiles that a path crosses.
    fn merged_tile(&self, a_px: DVec2, b_px: DVec2) -> DepthTile {
        let last = [f64::from(self.columns - 1), f64::from(self.rows - 1)];
        // One more texel on each side, for bilinear reads.
        let tile = |at: f64, last: f64| (at / f64::from(TILE_TEXELS)).floor().clamp(0.0, last) as u32;
        let (low, high) = (a_px.min(b_px) - 1.0, a_px.max(b_px) + 1.0);
        let mut all = DepthTile { low: f32::INFINITY, high: 0.0, has_jump: false };
        for row in tile(low.y, last[1])..=tile(high.y, last[1]) {
            for column in tile(low.x, last[0])..=tile(high.x, last[0]) {
                let tile = &self.tiles[(row * self.columns + column) as usize];
                all = DepthTile {
                    low: all.low.min(tile.low),
                    high: all.high.max(tile.high),
                    has_jump: all.has_jump || tile.has_jump,
                };
            }
        }
        all
    }
}

/// The points of a ray projected into the ideal frame: `direction + w shift`, where w is the inverse planar
/// depth in the row's camera.
struct EpipolarPath<'a> {
    direction: DVec3,
    shift: DVec3,
    depth: &'a InverseDepthImage<'a>,
    holes: &'a [bool],
    ideal: &'a IdealGeometry,
}

impl EpipolarPath<'_> {
    fn position_px(&self, w: f64) -> DVec2 {
        self.ideal.px_from_point(self.direction + w * self.shift)
    }

    /// Whether the texel at a position has unknown depth.
    fn is_hole(&self, position_px: DVec2) -> bool {
        !self.holes.is_empty() && self.holes[self.depth.nearest_index(position_px)]
    }

    /// Inverse depth in the row's camera of a surface with inverse depth `in_key` in the ideal frame; 0 if it
    /// is behind the row's camera.
    fn row_w(&self, in_key: f64) -> f64 {
        let scale = 1.0 - self.shift.z * in_key;
        if scale > 1e-3 { in_key * self.direction.z / scale } else { 0.0 }
    }

    fn surface_w(&self, w: f64) -> f64 {
        self.row_w(self.depth.inverse_depth(self.position_px(w)))
    }

    /// Near end of the path: no surface is nearer, and the point stays in front of the ideal camera.
    fn nearest(&self, high: f64) -> f64 {
        let by_surface = high * self.direction.z / (1.0 - self.shift.z * high).max(0.02);
        let by_camera =
            if self.shift.z < 0.0 { 0.95 * self.direction.z / -self.shift.z } else { f64::INFINITY };
        by_surface.min(by_camera)
    }

    /// Iterates `w <- surface_w(w)` until the source converges; `None` if it does not.
    fn fixed_point(&self) -> Option<f64> {
        let mut w = self.surface_w(0.0);
        let mut position_px = self.position_px(w);
        for _ in 0..MAX_ITERATIONS {
            let next = self.surface_w(w);
            let next_px = self.position_px(next);
            let moved_px = next_px.distance(position_px);
            (w, position_px) = (next, next_px);
            if moved_px < CONVERGED_PX {
                return Some(w);
            }
            if !moved_px.is_finite() {
                return None;
            }
        }
        None
    }

    /// Inverse depth of the first intersection of the ray. Starting at the near end, the point of the ray is
    /// in front of the surface shown at its projection. At the first step where it no longer is, the ray
    /// crosses that surface or passes behind its edge. If the intersection is disoccluded, the farthest
    /// surface seen along the path replaces it; a hole does not.
    fn first_surface(&self, nearest: f64) -> Result<f64, NoSource> {
        let length_px = self.position_px(0.0).distance(self.position_px(nearest));
        let steps = (length_px / STEP_PX).ceil().clamp(2.0, MAX_SEARCH_STEPS);
        let px_per_w = length_px / nearest.max(1e-300);
        let mut before = (nearest, self.surface_w(nearest) - nearest);
        let visible_w =
            |w: f64, found: f64| if self.is_hole(self.position_px(w)) { f64::INFINITY } else { found };
        let mut farthest = visible_w(nearest, before.1 + nearest);
        if before.1.abs() * px_per_w < CONVERGED_PX {
            return Ok(nearest);
        }
        for i in 1..=steps as u32 {
            let w = nearest * (1.0 - f64::from(i) / steps);
            let image_w = self.surface_w(w);
            let here = (w, image_w - w);
            farthest = farthest.min(visible_w(w, image_w));
            if before.1 < 0.0
                && here.1 >= 0.0
                && let Some(hit) = self.bisect(before, here, px_per_w)
            {
                return Ok(hit);
            }
            before = here;
        }
        if farthest.is_finite() { Ok(farthest) } else { Err(NoSource::Hole) }
    }

    /// Bisection for `surface_w(w) = w`; `None` if it ends at a jump of depth.
    fn bisect(&self, mut in_front: (f64, f64), mut behind: (f64, f64), px_per_w: f64) -> Option<f64> {
        for _ in 0..60 {
            if (in_front.0 - behind.0) * px_per_w < CONVERGED_PX {
                break;
            }
            let w = 0.5 * (in_front.0 + behind.0);
            let miss = self.surface_w(w) - w;
            *(if miss < 0.0 { &mut in_front } else { &mut behind }) = (w, miss);
        }
        ((behind.1 - in_front.1) * px_per_w < HIT_TOLERANCE_PX).then_some(behind.0)
    }
}
