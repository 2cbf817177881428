//! Which pixels of a frame another camera may not see, by what the frame itself shows.
//!
//! What a pixel sees is hidden from another position only if a border between two surfaces passes over it on the
//! path of the camera there. In the frame's own picture that border is no farther from the pixel than the
//! nearer surface's parallax. So a ray has to decide only within that reach of
//!
//! - two neighbours whose inverse depths differ by more than [`GAP_PX`] of parallax, and neither lie on one plane
//!   nor meet between the two, nor are on one unfolded patch of the terrain;
//! - a surface that is seen from behind from the other position;
//! - the border of the picture, beyond which something nearer may be.
//!
//! A surface between the rays of four neighbours, thinner than a pixel, is not known to the frame. Models are
//! therefore tested by a ray for every pixel; what is left are peaks of the terrain.

use camsim_core::{
    pose::CameraPose,
    row_time::{FrameCamera, ImageGain},
};
use camsim_plan::PixelHit;
use glam::DVec3;
use rayon::prelude::*;

use crate::truth::planes::FramePixels;

/// Largest parallax between two neighbours that is taken for none, pixels.
const GAP_PX: f64 = 0.02;
/// What the reach has beyond the parallax, pixels: both ends are between pixels.
const MARGIN_PX: f64 = 2.0;
/// Allowance of the path of a camera for what lies between the positions that are compared.
const BETWEEN: f64 = 1.1;

/// Pixels that a ray has to decide about.
pub(super) enum Doubt {
    /// Every pixel.
    All,
    /// Those marked, row-major.
    Marked(Vec<bool>),
}

impl Doubt {
    pub fn of(pixels: &FramePixels<'_>, target: &FrameCamera) -> Self {
        let has_fields = pixels.plan.shutter.interlace_s() > 0.0;
        if pixels.rays.moves() || has_fields {
            return Self::All;
        }
        let Some(parallax) = Parallax::new(pixels, target) else { return Self::All };
        let [width, height] = pixels.plan.camera.size_px.map(|side| side as usize);
        let rows = (0..height).into_par_iter().map(|y| parallax.marks_of_row(y));
        let marks: Vec<Vec<Mark>> = rows.collect();
        let mut marked = vec![false; width * height];
        for Mark { x, y, reach } in marks.into_iter().flatten() {
            for row in y.saturating_sub(reach)..(y + reach + 1).min(height) {
                marked[row * width..][x.saturating_sub(reach)..(x + reach + 1).min(width)].fill(true);
            }
        }
        Self::Marked(marked)
    }

    pub fn is_at(&self, i: usize) -> bool {
        match self {
            Self::All => true,
            Self::Marked(marked) => marked[i],
        }
    }
}

/// A pixel around which all within `reach` pixels are in doubt.
struct Mark {
    x: usize,
    y: usize,
    reach: usize,
}

struct Parallax<'a> {
    pixels: &'a FramePixels<'a>,
    /// Pixels at an inverse depth of 1/m, at most.
    px_m: f64,
    /// First and last position of the other camera.
    ends_ned_m: [DVec3; 2],
    border_reach: usize,
}

impl<'a> Parallax<'a> {
    /// `None` where nothing is sure.
    fn new(pixels: &'a FramePixels<'a>, target: &FrameCamera) -> Option<Self> {
        let [width, height] = pixels.plan.camera.size_px;
        let corners = [[0, 0], [width / 2, height / 2], [width - 1, height - 1]];
        let from: Vec<DVec3> = corners.map(|pixel| pixels.rays.pose(pixel).position_ned_m).into();
        let to: Vec<DVec3> = target.poses().map(|pose| pose.position_ned_m).collect();
        let distances = from.iter().flat_map(|from| to.iter().map(move |to| from.distance(*to)));
        let travel_m = BETWEEN * distances.fold(0.0, f64::max);
        let px_m = ImageGain::new(&pixels.plan.camera).shift_px * travel_m;
        let mut parallax = Self { pixels, px_m, ends_ned_m: [*to.first()?, *to.last()?], border_reach: 0 };
        let nearest_m = pixels.rays.nearest_m(travel_m);
        parallax.border_reach = parallax.reach(if nearest_m.is_finite() { 1.0 / nearest_m } else { 0.0 });
        px_m.is_finite().then_some(parallax)
    }

    /// Pixels that something at this inverse depth is seen to move by, and the margin.
    fn reach(&self, inverse_depth: f64) -> usize {
        (self.px_m * inverse_depth + MARGIN_PX).min(1e6) as usize
    }

    fn marks_of_row(&self, y: usize) -> Vec<Mark> {
        let [width, height] = self.pixels.plan.camera.size_px.map(|side| side as usize);
        let mut marks = Vec::new();
        for x in 0..width {
            let i = y * width + x;
            if !self.pixels.is_valid(i) {
                continue;
            }
            let right = (x + 1 < width).then_some(i + 1);
            let below = (y + 1 < height).then_some(i + width);
            let left_and_above = [(x > 0).then(|| i - 1), (y > 0).then(|| i - width)];
            let is_known = |beside: Option<usize>| beside.is_some_and(|i| self.pixels.is_valid(i));
            let mut reach = 0;
            if ![right, below].into_iter().chain(left_and_above).all(is_known) {
                reach = self.border_reach;
            }
            let here = self.pixels.hits[i].as_ref();
            if here.is_some_and(|hit| self.may_face_away(hit)) {
                reach = reach.max(self.reach(inverse_depth(here)));
            }
            for beside in [right, below].into_iter().flatten().filter(|&i| self.pixels.is_valid(i)) {
                if self.is_parted(i, beside) {
                    let there = self.pixels.hits[beside].as_ref();
                    reach = reach.max(self.reach(inverse_depth(here).max(inverse_depth(there))) + 1);
                }
            }
            if reach > 0 {
                marks.push(Mark { x, y, reach });
            }
        }
        marks
    }

    /// Whether the other camera may see a surface from behind.
    fn may_face_away(&self, hit: &PixelHit) -> bool {
        self.ends_ned_m.iter().any(|end| hit.normal_ned.dot(*end - hit.point_ned_m) <= 0.0)
    }

    /// Whether a border between surfaces that matters may lie between two neighbours.
    fn is_parted(&self, a: usize, b: usize) -> bool {
        let [hit_a, hit_b] = [a, b].map(|i| self.pixels.hits[i].as_ref());
        let [w_a, w_b] = [hit_a, hit_b].map(inverse_depth);
        if self.px_m * (w_a - w_b).abs() <= GAP_PX {
            return false;
        }
        let (Some(hit_a), Some(hit_b)) = (hit_a, hit_b) else { return true };
        // Gap of either surface at the other's ray.
        let gaps = [self.on_plane(hit_b, a) - w_a, w_b - self.on_plane(hit_a, b)];
        let is_joined = gaps.iter().any(|gap| self.px_m * gap.abs() <= GAP_PX) || gaps[0] * gaps[1] <= 0.0;
        if is_joined {
            return false;
        }
        match (hit_a.triangle, hit_b.triangle) {
            (Some(from), Some(to)) => {
                let (pixel, uv) = self.pixels.ray_of(b);
                !self.pixels.rays.connects(from, pixel, uv, to)
            }
            _ => true,
        }
    }

    /// Inverse depth of the plane of what a pixel sees, along the ray of another.
    fn on_plane(&self, hit: &PixelHit, at: usize) -> f64 {
        let (pixel, uv) = self.pixels.ray_of(at);
        let CameraPose { position_ned_m, ned_from_camera } = self.pixels.rays.pose(pixel);
        let ray_ned = *ned_from_camera * uv.extend(1.0);
        hit.normal_ned.dot(ray_ned) / hit.normal_ned.dot(hit.point_ned_m - *position_ned_m)
    }
}

fn inverse_depth(hit: Option<&PixelHit>) -> f64 {
    hit.map_or(0.0, |hit| 1.0 / hit.depth_m)
}
