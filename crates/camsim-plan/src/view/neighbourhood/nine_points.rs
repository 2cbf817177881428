//! Three by three points around a probe, as far apart as pixels at silhouettes are from these.

use camsim_core::{
    pose::CameraPose,
    silhouette::{NEAR_PX, may_step, steps},
};
use glam::DVec2;

use super::search::{LINES, NeighbourhoodSearch};
use crate::ir::margins;
use crate::view::{beam::Beam, probes::Probe, surfaces::SurfaceHit};

/// Two of the points.
pub(crate) type Pair = [usize; 2];

/// What the points see at the probe's own instant.
pub(crate) struct NinePoints<'a> {
    search: &'a NeighbourhoodSearch<'a>,
    pub probe: &'a Probe,
    pub mid_s: f64,
    pub pose: CameraPose,
    positions: [DVec2; 9],
    hits: [Option<SurfaceHit>; 9],
    inverse_depth: [f64; 9],
    /// Rays among the points.
    pub beam: Beam<'a>,
}

impl<'a> NinePoints<'a> {
    pub fn new(search: &'a NeighbourhoodSearch<'a>, probe: &'a Probe) -> Self {
        let [x, y] = probe.pixel;
        let mid_s = search.stamp_s + search.shutter.dt_pixel_s(x, y);
        let pose = search.path.pose(mid_s);
        let positions: [DVec2; 9] =
            std::array::from_fn(|i| DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0));
        let uv = |position: DVec2| probe.uv + probe.uv_from_px * (f64::from(NEAR_PX) * position);
        let ray_ned = |position: DVec2| pose.ned_from_camera * uv(position).extend(1.0);
        let cast = |i: usize| search.surfaces.first_hit(pose.position_ned_m, ray_ned(positions[i]));
        // The middle and the corners say how far away is what all others mostly meet.
        let cornered: [Option<SurfaceHit>; 5] = std::array::from_fn(|k| cast(2 * k));
        let depth_m = |hit: &Option<SurfaceHit>| hit.map_or(f64::INFINITY, |hit| hit.depth_m);
        let farthest_m = cornered.iter().map(depth_m).fold(0.0, f64::max);
        let uvs = positions.map(uv);
        let (low, high) = uvs.iter().fold((uvs[0], uvs[0]), |(low, high), uv| (low.min(*uv), high.max(*uv)));
        let beam = search.surfaces.beam(&pose, [low.x, high.x, low.y, high.y], margins::BEHIND * farthest_m);
        let hits = std::array::from_fn(|i| match i % 2 {
            0 => cornered[i / 2],
            _ => beam.first_hit(ray_ned(positions[i])),
        });
        let inverse_depth = hits.map(|hit: Option<SurfaceHit>| hit.map_or(0.0, |hit| hit.depth_m.recip()));
        Self { search, probe, mid_s, pose, positions, hits, inverse_depth, beam }
    }

    fn uv(&self, position: DVec2) -> DVec2 {
        self.probe.uv + self.probe.uv_from_px * (f64::from(NEAR_PX) * position)
    }

    fn cast(&self, position: DVec2) -> Option<SurfaceHit> {
        let ray_ned = self.pose.ned_from_camera * self.uv(position).extend(1.0);
        self.beam.first_hit(ray_ned)
    }

    /// Neighbours along rows, columns and diagonals with a step of depth between them.
    pub fn steps(&self) -> Vec<Pair> {
        let step = |a: usize, b: usize| {
            let between = |fraction: f64| {
                let position = self.positions[a].lerp(self.positions[b], fraction);
                self.cast(position).map_or(0.0, |hit| hit.depth_m.recip())
            };
            steps(self.inverse_depth[a], self.inverse_depth[b], between).then_some([a, b])
        };
        LINES
            .iter()
            .filter(|line| may_step(self.along(line)))
            .flat_map(|&[a, b, c]| [step(a, b), step(b, c)])
            .flatten()
            .collect()
    }

    /// Inverse depths along a line.
    pub fn along(&self, line: &[usize; 3]) -> [f64; 3] {
        line.map(|i| self.inverse_depth[i])
    }

    pub fn inverse_depths(&self, pair: &Pair) -> [f64; 2] {
        pair.map(|i| self.inverse_depth[i])
    }

    /// Inverse depth at the probe itself.
    pub fn middle(&self) -> f64 {
        self.inverse_depth[4]
    }

    pub fn is_sky(&self) -> bool {
        self.hits[4].is_none()
    }

    pub fn is_between_surfaces(&self, pair: &Pair) -> bool {
        pair.iter().all(|&i| self.inverse_depth[i] > 0.0)
    }

    /// Whether a step is the terrain's. What is before the sky is the skyline's.
    pub fn is_terrain(&self, &[a, b]: &Pair) -> bool {
        let nearer = if self.inverse_depth[a] > self.inverse_depth[b] { a } else { b };
        self.hits[nearer].is_some_and(|hit| hit.terrain.is_some())
            && self.inverse_depth[a].min(self.inverse_depth[b]) > 0.0
    }

    /// Squared contrast between two points, mean over the channels.
    pub fn contrast2(&self, &[a, b]: &Pair) -> f64 {
        let color = |i: usize| {
            let ray = self.uv(self.positions[i]).extend(1.0);
            let ray_ned = self.pose.ned_from_camera * ray;
            let origin = self.pose.position_ned_m;
            self.search.surfaces.light(origin, ray_ned, self.hits[i].as_ref(), ray.length()).color
        };
        (color(a) - color(b)).length_squared() / 3.0
    }

    /// Across the silhouette, towards what is nearer: along it parallax shows the same again.
    pub fn normal(&self) -> DVec2 {
        let towards = self
            .positions
            .iter()
            .zip(self.inverse_depth)
            .fold(DVec2::ZERO, |sum, (position, nearness)| sum + nearness * *position);
        (self.search.reach.camera.central_focal_px() * (self.probe.uv_from_px * towards)).normalize_or_zero()
    }
}
