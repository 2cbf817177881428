//! Ray and distance queries on the full surface, in f64.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::{
    Terrain, TerrainTriangle, cell_triangles,
    tree::{BLOCK_CELLS, BlockNode},
};
use crate::pose::CameraPose;

/// Intersection of a ray with the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerrainHit {
    /// Ray parameter: the point is origin + t direction.
    pub t: f64,
    /// Texture coordinates at the point.
    pub uv: [f64; 2],
    /// Unit normal of the triangle, NED, upwards.
    pub normal_ned: DVec3,
    /// Index of the chunk in [`Terrain::chunks`].
    pub chunk: u32,
    /// Cell in the chunk, from the west and from the north.
    pub cell: [u32; 2],
    /// Triangle of the cell: 0 = north-east, 1 = south-west.
    pub half: u32,
}

impl Terrain {
    /// First intersection of `origin + t direction`, 0 <= t <= `t_max`, with the full surface, from either
    /// side. The direction need not have unit length. No ray passes between adjacent triangles.
    pub fn intersect(&self, origin_ned_m: DVec3, direction_ned: DVec3, t_max: f64) -> Option<TerrainHit> {
        let mut best: Option<TerrainHit> = None;
        let beside = direction_ned.normalize().any_orthonormal_pair();
        self.tree.walk(origin_ned_m, direction_ned, t_max, &mut |block, limit| {
            let hit = self.intersect_block(block, origin_ned_m, direction_ned, beside, limit);
            best = hit.or(best);
            hit.map_or(limit, |hit| hit.t)
        });
        best
    }

    /// Whether `origin + t direction`, t >= 0, meets the full surface, from either side.
    pub fn blocks(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> bool {
        /// Before all boxes, which ends the walk.
        const NO_MORE: f64 = -1.0;
        let mut is_met = false;
        let beside = direction_ned.normalize().any_orthonormal_pair();
        self.tree.walk(origin_ned_m, direction_ned, f64::INFINITY, &mut |block, limit| {
            let hit = self.intersect_block(block, origin_ned_m, direction_ned, beside, limit);
            is_met |= hit.is_some();
            if is_met { NO_MORE } else { limit }
        });
        is_met
    }

    /// Fraction of the light at a point of a triangle that is left in the shadow, by the triangle's vertices and
    /// their weights; 1 in a scene without shadows.
    #[must_use]
    pub fn sky_fraction(&self, corners: [u32; 3], weights: [f64; 3]) -> f64 {
        let part = |k: usize| -> f64 {
            let of_corner =
                |c: usize| self.light_parts.get(corners[c] as usize).map_or(0.0, |of| of[k].into());
            (0..3).map(|c| weights[c] * of_corner(c)).sum()
        };
        let (of_sun, of_sky) = (part(0), part(1));
        if of_sun > 0.0 { of_sky / (of_sun + of_sky) } else { 1.0 }
    }

    /// Down coordinate of the topmost point of the full surface at a horizontal position; `None` off the
    /// terrain.
    pub fn down_at(&self, north_m: f64, east_m: f64) -> Option<f64> {
        let top = self.bounds.min.z - 1.0;
        let hit =
            self.intersect(DVec3::new(north_m, east_m, top), DVec3::Z, self.bounds.max.z - top + 1.0)?;
        Some(top + hit.t)
    }

    /// False only if no box around 4x4 cells meets a box.
    #[must_use]
    pub fn may_meet(&self, bounds: &super::Aabb) -> bool {
        let mut stack = vec![self.tree.root()];
        while let Some(node) = stack.pop() {
            if !self.tree.bounds(node).meets(bounds) {
                continue;
            }
            if node.level == 0 {
                return true;
            }
            stack.extend(self.tree.children(node));
        }
        false
    }

    /// Lower bound of the distance from a point to the surface, from boxes around 4x4 cells; 0 inside such a
    /// box.
    #[cfg(test)]
    pub(super) fn min_distance_m(&self, position_ned_m: DVec3) -> f64 {
        self.nearest_box_m(position_ned_m, &|_| true)
    }

    /// Lower bound of the distance from the camera to the part of the surface that it sees within `tangents`
    /// = [u_min, u_max, v_min, v_max] (u = x/z, v = y/z in camera axes), from boxes around 4x4 cells; 0
    /// inside such a box, infinite if the terrain is out of sight.
    pub fn min_distance_in_view_m(&self, camera: &CameraPose, tangents: [f64; 4]) -> f64 {
        let frustum = Frustum::new(camera, tangents);
        self.nearest_box_m(camera.position_ned_m, &|bounds| frustum.may_see(bounds))
    }

    fn nearest_box_m(&self, position_ned_m: DVec3, accept: &dyn Fn(&super::Aabb) -> bool) -> f64 {
        let mut nearest = f64::INFINITY;
        let mut stack = vec![self.tree.root()];
        while let Some(node) = stack.pop() {
            let bounds = self.tree.bounds(node);
            let distance = bounds.distance_m(position_ned_m);
            // False for a NaN distance.
            if distance < nearest && accept(&bounds) {
                if node.level == 0 {
                    nearest = distance;
                } else {
                    let below = stack.len();
                    stack.extend(self.tree.children(node));
                    let far = |node: &BlockNode| self.tree.bounds(*node).distance_m(position_ned_m);
                    stack[below..].sort_by(|a, b| far(b).total_cmp(&far(a)));
                }
            }
        }
        nearest
    }

    /// Intersects a ray with a block. Candidate cells are found first: the vertices are projected along the
    /// ray onto a plane with axes `right` and `up`, and a cell whose vertices all lie on one side of the ray
    /// is skipped.
    fn intersect_block(
        &self,
        block: [u32; 2],
        origin: DVec3,
        direction: DVec3,
        (right, up): (DVec3, DVec3),
        t_max: f64,
    ) -> Option<TerrainHit> {
        let (chunk_index, [i0, j0]) = self.chunk_of_cell(block.map(|n| n * BLOCK_CELLS));
        let chunk = &self.chunks[chunk_index as usize];
        let [columns, rows] = [(i0, chunk.cells[0]), (j0, chunk.cells[1])]
            .map(|(first, cells)| BLOCK_CELLS.min(cells - first) as usize);
        let centre_m = chunk.centre_ned_m - origin;
        let mut beside = [[DVec2::NAN; SIDE]; SIDE];
        for (j, row) in (j0..).zip(beside.iter_mut().take(rows + 1)) {
            let first = (chunk.first_vertex + j * (chunk.cells[0] + 1) + i0) as usize;
            for (sheared, vertex) in row.iter_mut().zip(&self.vertices[first..=first + columns]) {
                let offset_m = centre_m + Vec3::from(vertex.offset_m).as_dvec3();
                *sheared = DVec2::new(offset_m.dot(right), offset_m.dot(up));
            }
        }
        let mut best: Option<TerrainHit> = None;
        for j in 0..rows {
            for i in 0..columns {
                if passes([beside[j][i], beside[j][i + 1], beside[j + 1][i], beside[j + 1][i + 1]]) {
                    let limit = best.map_or(t_max, |hit| hit.t);
                    best = self
                        .intersect_cell(chunk_index, [i0 + i as u32, j0 + j as u32], origin, direction, limit)
                        .or(best);
                }
            }
        }
        best
    }

    fn intersect_cell(
        &self,
        chunk_index: u32,
        cell: [u32; 2],
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
    ) -> Option<TerrainHit> {
        let mut best: Option<TerrainHit> = None;
        for half in 0..2 {
            let points = self.cell_corners_ned_m(chunk_index, cell, half);
            let limit = best.map_or(t_max, |hit| hit.t);
            let hit = intersect_triangle(points, origin, direction, limit);
            best = hit.map(|(t, weights)| self.hit([chunk_index, half], cell, points, t, weights)).or(best);
        }
        best
    }

    /// Corners of a triangle of a cell, NED, metres; not finite where one is a void.
    fn cell_corners_ned_m(&self, chunk: u32, cell: [u32; 2], half: u32) -> [DVec3; 3] {
        cell_triangles(cell)[half as usize].map(|[i, j]| self.position_ned_m(chunk, i, j))
    }

    /// Corners of a triangle, NED, metres; not finite where one is a void.
    pub(super) fn corners_ned_m(&self, triangle: TerrainTriangle) -> [DVec3; 3] {
        let (chunk, cell) = self.chunk_of_cell(triangle.cell);
        self.cell_corners_ned_m(chunk, cell, triangle.half)
    }

    /// The hit of a ray on a triangle with these corners.
    fn hit(
        &self,
        [chunk_index, half]: [u32; 2],
        cell: [u32; 2],
        corners_ned_m: [DVec3; 3],
        t: f64,
        weights: [f64; 3],
    ) -> TerrainHit {
        let (chunk, [a, b, c]) = (&self.chunks[chunk_index as usize], corners_ned_m);
        let uvs = cell_triangles(cell)[half as usize]
            .map(|[i, j]| self.vertices[(chunk.first_vertex + j * (chunk.cells[0] + 1) + i) as usize].uv);
        let uv = [0, 1].map(|k: usize| (0..3).map(|c| weights[c] * f64::from(uvs[c][k])).sum());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal_ned = if normal.z > 0.0 { -normal } else { normal };
        TerrainHit { t, uv, normal_ned, chunk: chunk_index, cell, half }
    }

    /// The hit of a ray on a triangle of [`Self::triangles_in`].
    #[must_use]
    pub fn hit_on(&self, triangle: TerrainTriangle, t: f64, weights: [f64; 3]) -> TerrainHit {
        let (chunk, cell) = self.chunk_of_cell(triangle.cell);
        let points = self.cell_corners_ned_m(chunk, cell, triangle.half);
        self.hit([chunk, triangle.half], cell, points, t, weights)
    }

    /// Triangles of the full surface that may be within a frustum, with their corners, from blocks in no
    /// particular order; `None` of more than `most_blocks` blocks of 4x4 cells.
    pub fn triangles_in(
        &self,
        frustum: &Frustum,
        most_blocks: usize,
    ) -> Option<Vec<(TerrainTriangle, [DVec3; 3])>> {
        let blocks = self.blocks_within(|bounds| frustum.may_see(bounds), most_blocks)?;
        let triangles = blocks.into_iter().flat_map(|block| self.triangles_of(block));
        Some(triangles.filter(|(_, corners)| frustum.may_see_triangle(*corners)).collect())
    }

    /// Triangles of the full surface, with their corners, from blocks whose boxes are accepted, as are those
    /// around them.
    pub(super) fn triangles_within(
        &self,
        accept: impl Fn(&super::Aabb) -> bool,
    ) -> impl Iterator<Item = (TerrainTriangle, [DVec3; 3])> {
        let blocks = self.blocks_within(accept, usize::MAX).unwrap_or_default();
        let triangles = blocks.into_iter().flat_map(|block| self.triangles_of(block));
        triangles.filter(|(_, corners)| corners.iter().all(|corner| corner.is_finite()))
    }

    /// Blocks of 4x4 cells whose boxes are accepted, as are those around them; `None` of more than `most`.
    fn blocks_within(&self, accept: impl Fn(&super::Aabb) -> bool, most: usize) -> Option<Vec<[u32; 2]>> {
        let mut blocks = Vec::new();
        let mut stack = vec![self.tree.root()];
        while let Some(node) = stack.pop().filter(|_| blocks.len() <= most) {
            let bounds = self.tree.bounds(node);
            if !bounds.is_empty() && accept(&bounds) {
                if node.level == 0 {
                    blocks.push(node.at);
                }
                stack.extend(self.tree.children(node));
            }
        }
        (blocks.len() <= most).then_some(blocks)
    }

    fn triangles_of(&self, block: [u32; 2]) -> impl Iterator<Item = (TerrainTriangle, [DVec3; 3])> {
        let [columns, rows] = [0, 1].map(|k| {
            let first = block[k] * BLOCK_CELLS;
            first..self.cells[k].min(first + BLOCK_CELLS)
        });
        let cells = rows.flat_map(move |row| columns.clone().map(move |column| [column, row]));
        let triangles = cells.flat_map(|cell| [0, 1].map(|half| TerrainTriangle { cell, half }));
        triangles.map(|triangle| (triangle, self.corners_ned_m(triangle)))
    }
}

/// Vertices along a side of a block.
const SIDE: usize = BLOCK_CELLS as usize + 1;

/// Whether a ray may hit a cell with these projected corners. The margin is far above rounding. NaN counts as
/// a hit and is left to the triangles.
fn passes(corners: [DVec2; 4]) -> bool {
    const MARGIN: f64 = 0.01;
    let [a, b, c, d] = corners;
    let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    let margin = MARGIN * (high - low).element_sum();
    let missed = low.max_element() > margin || high.min_element() < -margin;
    !(missed && (a + b + c + d).is_finite())
}

/// Ray parameter in 0..=`t_max` and barycentric weights of the intersection of a ray with a triangle, from
/// either side. Triangles with corners that are not finite are never hit.
pub fn intersect_triangle(
    points: [DVec3; 3],
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
) -> Option<(f64, [f64; 3])> {
    SeenTriangle::new(points, origin).intersect(direction, t_max)
}

/// A triangle as rays from one point see it.
///
/// The test uses signed volumes over the edges, seen from the rays' origin. Swapping the ends of an edge
/// exactly negates its volume in floating point, so two triangles agree on which side of their common edge a
/// ray passes. Where several edges meet, rounding could still open a gap, so triangles are enlarged by the
/// rounding error of the volumes (1e-8 m for a cell of 10 m seen from 5 km).
#[derive(Clone, Copy, Debug)]
pub struct SeenTriangle {
    /// Products of the ends of the edges opposite to each corner.
    edges: [DVec3; 3],
    normal: DVec3,
    /// Distance of its plane from the origin, times the length of the normal.
    distance: f64,
    /// Largest rounding error of the volumes, for a direction whose largest coordinate is 1.
    rounding: f64,
}

impl SeenTriangle {
    /// The triangle with these corners, from the rays' origin.
    #[inline]
    #[must_use]
    pub fn new(points: [DVec3; 3], origin: DVec3) -> Self {
        /// At most 18 products and sums with eps / 2 each, plus a reserve.
        const ROUNDING: f64 = 4e-15;
        let [a, b, c] = points.map(|point| point - origin);
        let normal = (b - a).cross(c - a);
        let reach = a.abs().max(b.abs()).max(c.abs()).max_element();
        Self {
            edges: [c.cross(b), a.cross(c), b.cross(a)],
            normal,
            distance: a.dot(normal),
            rounding: ROUNDING * reach * reach,
        }
    }

    /// Ray parameter in 0..=`t_max` and barycentric weights of the intersection with a ray.
    #[inline]
    #[must_use]
    pub fn intersect(&self, direction: DVec3, t_max: f64) -> Option<(f64, [f64; 3])> {
        let [wa, wb, wc] = self.edges.map(|edge| direction.dot(edge));
        let sum = wa + wb + wc;
        let slack = self.rounding * direction.abs().max_element();
        let lowest = if sum > 0.0 { wa.min(wb).min(wc) } else { -wa.max(wb).max(wc) };
        // NaN is a miss.
        if !(lowest >= -slack && sum.abs() > 3.0 * slack) {
            return None;
        }
        let t = self.distance / direction.dot(self.normal);
        (t >= 0.0 && t <= t_max).then(|| (t, [wa / sum, wb / sum, wc / sum]))
    }
}

/// The half-spaces of a camera's view frustum.
#[derive(Clone, Debug)]
pub struct Frustum {
    /// Inward normals, and the least product of each with a position inside.
    planes: [(DVec3, f64); 6],
}

impl Frustum {
    /// `tangents` are u_min, u_max, v_min, v_max.
    pub fn new(camera: &CameraPose, tangents: [f64; 4]) -> Self {
        Self::up_to(camera, tangents, f64::INFINITY)
    }

    /// The frustum as far as a planar depth.
    pub fn up_to(camera: &CameraPose, tangents: [f64; 4], depth_m: f64) -> Self {
        let [u_min, u_max, v_min, v_max] = tangents;
        let in_camera = [
            DVec3::new(1.0, 0.0, -u_min),
            DVec3::new(-1.0, 0.0, u_max),
            DVec3::new(0.0, 1.0, -v_min),
            DVec3::new(0.0, -1.0, v_max),
            DVec3::Z,
            DVec3::NEG_Z,
        ];
        let mut planes = in_camera.map(|normal| {
            let normal = camera.ned_from_camera * normal;
            (normal, normal.dot(camera.position_ned_m))
        });
        planes[5].1 -= depth_m;
        Self { planes }
    }

    /// The frustum in the axes of a shape, which `turn` and `shift` place.
    #[must_use]
    pub fn in_shape(&self, turn: DMat3, shift: DVec3) -> Self {
        Self {
            planes: self.planes.map(|(normal, least)| (turn.transpose() * normal, least - normal.dot(shift))),
        }
    }

    /// False only if the whole box is out of sight.
    pub fn may_see(&self, bounds: &super::Aabb) -> bool {
        !bounds.is_empty() && self.planes.iter().all(|&(normal, least)| bounds.support(normal) >= least)
    }

    /// False only if the whole triangle is out of sight.
    #[must_use]
    pub fn may_see_triangle(&self, corners: [DVec3; 3]) -> bool {
        let is_within =
            |&(normal, least): &(DVec3, f64)| corners.iter().any(|corner| normal.dot(*corner) >= least);
        self.planes.iter().all(is_within)
    }
}
