//! Length of the borders of thin surfaces: what is narrower than the distance of the nine points around a
//! probe, as trees and window frames are, has two borders where those find one, or none.
//!
//! Lines across the picture count without bias: of borders of length L in an area A, whichever direction they
//! run in, a line crosses `2 L / (pi A)` for each of its pixels (Crofton). Houses have borders along rows and
//! columns, which lines along those cross less often: 0.79 times. Every other probe has diagonals, and so the
//! four directions of line cross whatever runs in one direction 0.95 to 1.03 times as often as that. Points on
//! them are a third of a pixel apart. Two borders within that are still missed; how many there are is estimated
//! by those that points a pixel apart would have missed.

use std::{
    cell::OnceCell,
    f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2},
};

use camsim_core::{
    silhouette::{bends, may_step, steps},
    temporal::edge_mask::FINE_EDGE_STEP,
};
use glam::DVec2;

use super::{nine_points::NinePoints, search::NeighbourhoodSearch};
use crate::view::{light::RayLight, surfaces::SurfaceHit};

/// Points along each of the two lines, and how far they are apart: far houses have borders nearer to each
/// other than a pixel.
const POINTS: usize = 13;
const APART_PX: f64 = 1.0 / 3.0;
/// Points from one whole pixel to the next.
const A_PIXEL: usize = 3;

/// What two lines through a probe cross.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LineCrossings {
    /// Steps of depth that the lines cross.
    pub count: u32,
    /// Squared contrast, of the linear range, times the length of silhouettes, pixels, in each pixel of the
    /// area that the lines stand for.
    pub steps: f64,
    /// Squared contrast times length of borders without a step of depth: between meshes that touch, as a
    /// window and its wall do, and between colours within one, which rays leave as they are; and of blended
    /// surfaces, which have no depth of their own.
    pub touching: f64,
    /// Squared contrast times length of borders at creases, as at a wall's foot: samples finer than a pixel
    /// find them, the middles of pixels do not.
    pub creases: f64,
    /// Squared contrast times length of borders where models stand on the terrain.
    pub on_terrain: f64,
    /// Steps, touching borders and creases as points a pixel apart find them: what is narrower is missing.
    pub at_pixel_spacing: f64,
}

/// From point to point a mesh has another colour, whatever is painted on it, if that changes by more than
/// this, linear: its corners have no colours in common, or light falls on it from another side. Colours that
/// change gradually do so by less over a third of a pixel.
const OTHER_TINT: f64 = 0.02;

/// Whether two points that see no step of depth between them are of the terrain and of what stands on it.
fn is_on_terrain(a: Option<&SurfaceHit>, b: Option<&SurfaceHit>) -> bool {
    a.zip(b).is_some_and(|(a, b)| (a.surface == 0) != (b.surface == 0))
}

/// Whether two points that see no step of depth between them are of different meshes, or of parts of one that
/// have different colours.
fn is_another(a: Option<&SurfaceHit>, b: Option<&SurfaceHit>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    match (a.surface, b.surface) {
        (0, _) | (_, 0) => false,
        (one, other) if one != other => true,
        _ => (a.tint - b.tint).abs().max_element() > OTHER_TINT,
    }
}

/// The directions that lines run in: along the row and the column of a probe, and along its diagonals.
const UPRIGHT: [DVec2; 2] = [DVec2::X, DVec2::Y];
const DIAGONAL: [DVec2; 2] = [DVec2::splat(FRAC_1_SQRT_2), DVec2::new(FRAC_1_SQRT_2, -FRAC_1_SQRT_2)];

impl NeighbourhoodSearch<'_> {
    /// What two lines through a probe cross, at its own instant; probes take turns in the directions of line by
    /// their number.
    pub fn line_crossings(&self, number: usize, points: &NinePoints<'_>) -> LineCrossings {
        let mut sums = CrossingSums::default();
        for axis in if number.is_multiple_of(2) { UPRIGHT } else { DIAGONAL } {
            PointLine::new(self, points, axis).add_to(&mut sums);
        }
        let CrossingSums { count, contrast2, touching2, creases2, on_terrain2, at_pixel_spacing2 } = sums;
        if count == 0 && touching2 + creases2 + on_terrain2 == 0.0 {
            return LineCrossings::default();
        }
        let length_px = 2.0 * APART_PX * (POINTS - 1) as f64;
        let gain2 = (self.gain)(points.probe.pixel).powi(2);
        let of_area = |contrast2: f64| FRAC_PI_2 * contrast2 / length_px * gain2;
        LineCrossings {
            count,
            steps: of_area(contrast2),
            touching: of_area(touching2),
            creases: of_area(creases2),
            on_terrain: of_area(on_terrain2),
            at_pixel_spacing: of_area(at_pixel_spacing2),
        }
    }
}

/// Squared contrasts of what lines cross, by kind.
#[derive(Default)]
struct CrossingSums {
    count: u32,
    contrast2: f64,
    touching2: f64,
    creases2: f64,
    on_terrain2: f64,
    at_pixel_spacing2: f64,
}

/// Points along a line through a probe.
struct PointLine<'a> {
    search: &'a NeighbourhoodSearch<'a>,
    points: &'a NinePoints<'a>,
    axis: DVec2,
    hits: [Option<SurfaceHit>; POINTS],
    inverse_depths: [f64; POINTS],
    /// Both neighbours of a point need its light.
    lights: [OnceCell<RayLight>; POINTS],
}

impl<'a> PointLine<'a> {
    fn new(search: &'a NeighbourhoodSearch<'a>, points: &'a NinePoints<'a>, axis: DVec2) -> Self {
        let lights = std::array::from_fn(|_| OnceCell::new());
        let (hits, inverse_depths) = ([None; POINTS], [0.0; POINTS]);
        let mut line = Self { search, points, axis, hits, inverse_depths, lights };
        line.hits = std::array::from_fn(|k| line.cast(k as f64));
        line.inverse_depths = line.hits.map(|hit| hit.map_or(0.0, |hit| hit.depth_m.recip()));
        line
    }

    fn uv(&self, along: f64) -> DVec2 {
        let Self { points: NinePoints { probe, .. }, axis, .. } = self;
        probe.uv + probe.uv_from_px * (APART_PX * (along - 0.5 * (POINTS - 1) as f64) * *axis)
    }

    fn cast(&self, along: f64) -> Option<SurfaceHit> {
        self.points.beam.first_hit(self.points.pose.ned_from_camera * self.uv(along).extend(1.0))
    }

    fn light(&self, k: usize) -> &RayLight {
        self.lights[k].get_or_init(|| {
            let ray = self.uv(k as f64).extend(1.0);
            let ray_ned = self.points.pose.ned_from_camera * ray;
            let origin = self.points.pose.position_ned_m;
            self.search.surfaces.light(origin, ray_ned, self.hits[k].as_ref(), ray.length())
        })
    }

    /// Squared contrast between two points, mean over the channels.
    fn contrast2(&self, from: usize, to: usize) -> f64 {
        (self.light(from).color - self.light(to).color).length_squared() / 3.0
    }

    /// Whether it holds of the three points that begin before a pair or with it.
    fn either(&self, k: usize, holds: impl Fn([f64; 3]) -> bool) -> bool {
        let three = |k: usize| [0, 1, 2].map(|n: usize| self.inverse_depths[k + n]);
        (k > 0 && holds(three(k - 1))) || (k + 2 < POINTS && holds(three(k)))
    }

    fn add_to(&self, sums: &mut CrossingSums) {
        let mut of_pixel = 0.0;
        for k in 0..POINTS - 1 {
            let before = sums.contrast2 + sums.touching2 + sums.creases2;
            self.add_pair_to(k, sums);
            of_pixel += sums.contrast2 + sums.touching2 + sums.creases2 - before;
            if (k + 1) % A_PIXEL == 0 {
                sums.at_pixel_spacing2 +=
                    if of_pixel > 0.0 { self.contrast2(k + 1 - A_PIXEL, k + 1) } else { 0.0 };
                of_pixel = 0.0;
            }
        }
    }

    /// What lies between a point and the next.
    fn add_pair_to(&self, k: usize, sums: &mut CrossingSums) {
        let [from, to] = [k, k + 1].map(|k| self.hits[k].as_ref());
        let between = |fraction: f64| self.cast(k as f64 + fraction).map_or(0.0, |hit| hit.depth_m.recip());
        let may = self.either(k, may_step);
        if may && steps(self.inverse_depths[k], self.inverse_depths[k + 1], between) {
            sums.count += 1;
            sums.contrast2 += self.contrast2(k, k + 1);
        } else if is_another(from, to) {
            let is_crease = self.either(k, |depths| bends(depths, APART_PX * FINE_EDGE_STEP));
            let side = if is_crease { &mut sums.creases2 } else { &mut sums.touching2 };
            *side += self.contrast2(k, k + 1);
        } else if self.search.surfaces.blends && self.light(k).panes != self.light(k + 1).panes {
            // The border of a blended surface, which has no depth of its own.
            sums.touching2 += self.contrast2(k, k + 1);
        } else if is_on_terrain(from, to) {
            sums.on_terrain2 += self.contrast2(k, k + 1);
        }
    }
}
