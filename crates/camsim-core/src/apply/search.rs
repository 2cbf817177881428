//! Temporal inverse with depth: fixed point where one surface is in question, a search along the ray's path
//! where several are.

use glam::{DMat3, DVec2, DVec3};

use super::Unseen;
use crate::temporal::{
    IdealGeometry, InverseDepthImage, Source,
    marks::{EDGE_STEP, steps},
};

/// Side of a tile, texels.
const TILE: u32 = 8;
/// Distance of two looks along the path, ideal pixels.
const LOOK_PX: f64 = 0.5;
/// Most looks.
const MAX_LOOKS: f64 = 1024.0;
/// A surface gives its own depth again to within this, ideal pixels of parallax; across a jump of depth
/// nothing does.
const MEETS_PX: f64 = 0.05;
/// Parallax between the surfaces along a path below which they need not be told apart, ideal pixels.
const ONE_SURFACE_PX: f64 = 0.02;
/// Movement of the source at which the fixed point has been reached, ideal pixels.
const SETTLED_PX: f64 = 1e-8;
const MAX_STEPS: u32 = 32;
/// How often a path's near end is looked for again, by what its own tiles hold.
const SHORTENINGS: u32 = 4;
/// Share of the inverse depth above which another look would shorten it by little.
const SHORTER: f64 = 0.9;

/// What a tile of the depth image holds.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    low: f32,
    high: f32,
    /// A jump of depth in it or at its border.
    broken: bool,
}

/// Where surfaces meet in a depth image.
#[derive(Clone, Debug)]
pub(super) struct DepthEdges {
    tiles: Vec<Tile>,
    columns: u32,
    rows: u32,
    /// Largest inverse depth of all.
    high: f64,
}

impl DepthEdges {
    pub(super) fn new(depth: &InverseDepthImage<'_>) -> Self {
        let [width, height] = depth.size_px;
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut tiles =
            vec![Tile { low: f32::INFINITY, high: 0.0, broken: false }; (columns * rows) as usize];
        let at = |x: u32, y: u32| f64::from(depth.values[(y * width + x) as usize]);
        for y in 0..height {
            for x in 0..width {
                let value = depth.values[(y * width + x) as usize];
                let across = steps(
                    at(x.saturating_sub(1), y),
                    f64::from(value),
                    at((x + 1).min(width - 1), y),
                    EDGE_STEP,
                );
                let down = steps(
                    at(x, y.saturating_sub(1)),
                    f64::from(value),
                    at(x, (y + 1).min(height - 1)),
                    EDGE_STEP,
                );
                let tile = &mut tiles[(y / TILE * columns + x / TILE) as usize];
                tile.low = tile.low.min(value);
                tile.high = tile.high.max(value);
                tile.broken |= across || down;
            }
        }
        let high = tiles.iter().fold(0.0_f64, |high, tile| high.max(f64::from(tile.high)));
        Self { tiles, columns, rows, high }
    }

    /// Where the ray `uv` of a line's camera looks in the ideal frame. `holes` says which texels' depth is
    /// unknown; empty is none.
    pub(super) fn source(
        &self,
        uv: DVec2,
        key_from_line: (DMat3, DVec3),
        depth: &InverseDepthImage<'_>,
        holes: &[bool],
        ideal: &IdealGeometry,
    ) -> Result<Source, Unseen> {
        let (rotation, shift) = key_from_line;
        let path = Path { direction: rotation * uv.extend(1.0), shift, depth, holes, ideal };
        if path.direction.z <= 0.0 {
            return Err(Unseen::Outside);
        }
        let inverse_depth = match self.several(&path) {
            Some(nearest) => path.first_surface(nearest)?,
            // One surface: the fixed point finds it, but for one that is as steep as the path.
            None => match path.fixed_point() {
                Some(w) => w,
                None => path.first_surface(path.nearest(self.high))?,
            },
        };
        let in_key = path.direction + inverse_depth * shift;
        let at_px = ideal.px_from_point(in_key);
        if !(in_key.z > 0.0 && ideal.contains(at_px)) {
            return Err(Unseen::Outside);
        }
        if path.is_hole(at_px) { Err(Unseen::Hole) } else { Ok(Source { at_px, inverse_depth }) }
    }

    /// If surfaces that parallax tells apart lie along a path: the inverse depth in the line's camera that
    /// none of them exceeds.
    fn several(&self, path: &Path<'_>) -> Option<f64> {
        let far_px = path.place(0.0);
        let mut nearest = path.nearest(self.high);
        let mut box_high = self.high;
        // What is nearest of all the picture is seldom near this path: its near end comes nearer, and so do
        // the tiles that it meets.
        for _ in 0..SHORTENINGS {
            let near_px = path.place(nearest);
            let length_px = far_px.distance(near_px);
            if length_px <= ONE_SURFACE_PX {
                return None;
            }
            let tile = self.around(far_px, near_px);
            if !(tile.broken && f64::from(tile.high - tile.low) * length_px > ONE_SURFACE_PX * nearest) {
                return None;
            }
            let high = f64::from(tile.high);
            let enough = high > SHORTER * box_high;
            box_high = high;
            nearest = nearest.min(path.nearest(high));
            if enough {
                break;
            }
        }
        Some(nearest)
    }

    /// The tiles around a path in one.
    fn around(&self, a_px: DVec2, b_px: DVec2) -> Tile {
        let last = [f64::from(self.columns - 1), f64::from(self.rows - 1)];
        // A texel more on each side, which bilinear reading reaches.
        let tile = |at: f64, last: f64| (at / f64::from(TILE)).floor().clamp(0.0, last) as u32;
        let (low, high) = (a_px.min(b_px) - 1.0, a_px.max(b_px) + 1.0);
        let mut all = Tile { low: f32::INFINITY, high: 0.0, broken: false };
        for row in tile(low.y, last[1])..=tile(high.y, last[1]) {
            for column in tile(low.x, last[0])..=tile(high.x, last[0]) {
                let tile = &self.tiles[(row * self.columns + column) as usize];
                all = Tile {
                    low: all.low.min(tile.low),
                    high: all.high.max(tile.high),
                    broken: all.broken || tile.broken,
                };
            }
        }
        all
    }
}

/// A ray's points in the ideal frame: `direction + w shift`, w = inverse planar depth in the line's camera.
struct Path<'a> {
    direction: DVec3,
    shift: DVec3,
    depth: &'a InverseDepthImage<'a>,
    holes: &'a [bool],
    ideal: &'a IdealGeometry,
}

impl Path<'_> {
    fn place(&self, w: f64) -> DVec2 {
        self.ideal.px_from_point(self.direction + w * self.shift)
    }

    /// Whether the texel at a place has no depth.
    fn is_hole(&self, at_px: DVec2) -> bool {
        !self.holes.is_empty() && self.holes[self.depth.nearest_index(at_px)]
    }

    /// The line camera's inverse depth of a surface that the ideal frame shows at `in_key`; 0 for what lies
    /// behind the line's camera.
    fn of_line(&self, in_key: f64) -> f64 {
        let scale = 1.0 - self.shift.z * in_key;
        if scale > 1e-3 { in_key * self.direction.z / scale } else { 0.0 }
    }

    fn found(&self, w: f64) -> f64 {
        self.of_line(self.depth.inverse_depth(self.place(w)))
    }

    /// Upper end of the path: no surface is nearer, and the point stays before the ideal camera.
    fn nearest(&self, high: f64) -> f64 {
        let by_surface = high * self.direction.z / (1.0 - self.shift.z * high).max(0.02);
        let by_camera =
            if self.shift.z < 0.0 { 0.95 * self.direction.z / -self.shift.z } else { f64::INFINITY };
        by_surface.min(by_camera)
    }

    /// `w <- found(w)` until the source rests; `None` if it does not.
    fn fixed_point(&self) -> Option<f64> {
        let mut w = self.found(0.0);
        let mut at_px = self.place(w);
        for _ in 0..MAX_STEPS {
            let next = self.found(w);
            let next_px = self.place(next);
            let moved_px = next_px.distance(at_px);
            (w, at_px) = (next, next_px);
            if moved_px < SETTLED_PX {
                return Some(w);
            }
            if !moved_px.is_finite() {
                return None;
            }
        }
        None
    }

    /// Inverse depth of the nearest surface that the ray meets. From the near end on, the ray's point is in
    /// front of what the ideal frame shows there until it first is not: between two such looks it goes
    /// through a surface, or behind the edge of one. What the ideal camera did not see cannot be known: then
    /// the farthest surface seen beside it stands in, which a hole is not.
    fn first_surface(&self, nearest: f64) -> Result<f64, Unseen> {
        let length_px = self.place(0.0).distance(self.place(nearest));
        let looks = (length_px / LOOK_PX).ceil().clamp(2.0, MAX_LOOKS);
        let px_per_w = length_px / nearest.max(1e-300);
        let mut before = (nearest, self.found(nearest) - nearest);
        let seen = |w: f64, found: f64| if self.is_hole(self.place(w)) { f64::INFINITY } else { found };
        let mut farthest = seen(nearest, before.1 + nearest);
        if before.1.abs() * px_per_w < SETTLED_PX {
            return Ok(nearest);
        }
        for i in 1..=looks as u32 {
            let w = nearest * (1.0 - f64::from(i) / looks);
            let found = self.found(w);
            let here = (w, found - w);
            farthest = farthest.min(seen(w, found));
            if before.1 < 0.0
                && here.1 >= 0.0
                && let Some(met) = self.between(before, here, px_per_w)
            {
                return Ok(met);
            }
            before = here;
        }
        if farthest.is_finite() { Ok(farthest) } else { Err(Unseen::Hole) }
    }

    /// Bisection for `found(w) = w`; `None` if it ends at a jump.
    fn between(&self, mut in_front: (f64, f64), mut behind: (f64, f64), px_per_w: f64) -> Option<f64> {
        for _ in 0..60 {
            if (in_front.0 - behind.0) * px_per_w < SETTLED_PX {
                break;
            }
            let w = 0.5 * (in_front.0 + behind.0);
            let miss = self.found(w) - w;
            *(if miss < 0.0 { &mut in_front } else { &mut behind }) = (w, miss);
        }
        ((behind.1 - in_front.1) * px_per_w < MEETS_PX).then_some(behind.0)
    }
}
