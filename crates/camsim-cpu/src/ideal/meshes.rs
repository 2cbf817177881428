//! Meshes as the CPU draws them: each level of detail in pieces of a few thousand triangles, with the
//! vertices that these use.

use camsim_core::{
    pose::CameraPose,
    scene::{Light, MeshVertex, Shape, transformed_normal},
};
use glam::{DMat3, DVec3, Vec3};

use super::{
    triangles::{Chunk, EXTRA_ATTRIBUTES, TriangleKind},
    vertices::{CLIP_PX, Camera, SUBPIXELS, Vertex},
};
use crate::simd::vectors::Vectors;
use camsim_core::scene::PlacedShape;

/// Triangles per chunk.
pub(super) const TRIANGLES_PER_CHUNK: usize = 4096;

/// Relative rounding error of the back-face test, and more.
const ROUNDING: f32 = 1e-5;
/// Factor of the bound by which rounding of vertices may change the height of a triangle: its area changes by
/// up to three halves of its longest side times the displacement of the vertices, and a little more where all
/// of them move.
const HEIGHT_LOST: f32 = 4.0;

/// A part of the triangles of a level of detail.
#[derive(Debug)]
pub(super) struct Piece {
    vertices: Vec<MeshVertex>,
    /// Vertex normals, if the mesh is illuminated.
    normals: Vec<[f32; 3]>,
    /// Three indices per triangle.
    indices: Vec<u32>,
    face_planes: FacePlanes,
}

/// Planes of the triangles, for back-face culling: unit normals on the side from which the triangle is
/// anticlockwise, and offsets along them, metres in the axes of the shape.
#[derive(Debug, Default)]
struct FacePlanes {
    normal: [Vec<f32>; 3],
    offset_m: Vec<f32>,
    /// 1 / (height over the longest side), 1/m.
    per_height: Vec<f32>,
    /// Largest distance of a vertex from the origin of the shape, metres.
    radius_m: f32,
}

/// Scratch buffers of a piece, reused for each placement.
#[derive(Debug)]
pub(super) struct Scratch<const N: usize> {
    /// Per triangle: whether its front may be visible.
    may_be_visible: Vec<bool>,
    /// Per vertex: whether a visible triangle uses it.
    is_used: Vec<bool>,
    vertices: Vec<Vertex<N>>,
}

impl Piece {
    /// Pieces of a level of detail of a shape.
    pub fn of_level(shape: &Shape, indices: &[u32]) -> Vec<Self> {
        let canonical = shape.canonical_vertices();
        indices.chunks(3 * TRIANGLES_PER_CHUNK).map(|some| Self::new(shape, &canonical, some)).collect()
    }

    /// `canonical` is [`Shape::canonical_vertices`] of the shape.
    fn new(shape: &Shape, canonical: &[u32], indices: &[u32]) -> Self {
        let mut used: Vec<u32> = indices.iter().map(|&vertex| canonical[vertex as usize]).collect();
        used.sort_unstable();
        used.dedup();
        let renumbered =
            |&vertex: &u32| used.partition_point(|&used| used < canonical[vertex as usize]) as u32;
        let normals = if shape.has_normals() {
            used.iter().map(|&vertex| shape.normals[vertex as usize]).collect()
        } else {
            Vec::new()
        };
        let vertices: Vec<MeshVertex> = used.iter().map(|&vertex| shape.vertices[vertex as usize]).collect();
        let indices: Vec<u32> = indices.iter().map(renumbered).collect();
        let face_planes = FacePlanes::new(&vertices, &indices);
        Self { vertices, normals, indices, face_planes }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.indices.len() / 3
    }

    /// Adds the triangles of a placement to a chunk.
    #[inline(always)]
    pub fn draw(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        pose: &CameraPose,
        placement: &PlacedShape,
        kind: TriangleKind,
        scratch: &mut Scratch<2>,
        chunk: &mut Chunk,
    ) {
        let camera_map = CameraMap::new(pose, placement);
        self.cull(camera, &camera_map, kind, scratch);
        // Loops here and below: closures of iterators may be compiled without the enabled vector
        // instructions.
        for (k, vertex) in self.vertices.iter().enumerate() {
            if scratch.is_used[k] {
                scratch.vertices[k] = camera.project(camera_map.in_camera_m(vertex.position_m), vertex.uv);
            }
        }
        self.add(vectors, camera, scratch, kind, chunk);
    }

    /// Adds the triangles of a placement with per-vertex tint and illumination.
    #[inline(always)]
    pub fn draw_with_extra(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        pose: &CameraPose,
        placement: &PlacedShape,
        light: Option<Light>,
        kind: TriangleKind,
        scratch: &mut Scratch<{ 2 + EXTRA_ATTRIBUTES }>,
        chunk: &mut Chunk,
    ) {
        let camera_map = CameraMap::new(pose, placement);
        self.cull(camera, &camera_map, kind, scratch);
        let extra = |k: usize| -> [f32; 2] {
            let Some((light, normal)) = light.zip(self.normals.get(k)) else { return [0.0; 2] };
            let normal = transformed_normal(&placement.ned_from_shape, Vec3::from(*normal).as_dvec3());
            [(light.sun * normal.dot(light.to_sun_ned)) as f32, normal.z as f32]
        };
        for (k, vertex) in self.vertices.iter().enumerate() {
            if scratch.is_used[k] {
                let ([u, v], [r, g, b, a], [sun, down]) = (vertex.uv, vertex.tint, extra(k));
                scratch.vertices[k] =
                    camera.project(camera_map.in_camera_m(vertex.position_m), [u, v, r, g, b, a, sun, down]);
            }
        }
        self.add(vectors, camera, scratch, kind, chunk);
    }

    /// Culls back faces, and determines the vertices that are needed.
    #[inline(always)]
    fn cull<const N: usize>(
        &self,
        camera: &Camera,
        camera_map: &CameraMap,
        kind: TriangleKind,
        scratch: &mut Scratch<N>,
    ) {
        scratch.may_be_visible.resize(self.len(), true);
        scratch.is_used.resize(self.vertices.len(), true);
        scratch.vertices.resize(self.vertices.len(), Vertex::UNPROJECTED);
        scratch.may_be_visible.fill(true);
        scratch.is_used.fill(!kind.one_sided);
        if kind.one_sided {
            self.face_planes.cull_back_faces(camera, camera_map, &mut scratch.may_be_visible);
            for (triangle, may_be_visible) in
                self.indices.as_chunks::<3>().0.iter().zip(&scratch.may_be_visible)
            {
                if *may_be_visible {
                    triangle.iter().for_each(|&vertex| scratch.is_used[vertex as usize] = true);
                }
            }
        }
    }

    #[inline(always)]
    fn add<const N: usize>(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        scratch: &Scratch<N>,
        kind: TriangleKind,
        chunk: &mut Chunk,
    ) {
        for (triangle, may_be_visible) in self.indices.as_chunks::<3>().0.iter().zip(&scratch.may_be_visible)
        {
            if *may_be_visible {
                let vertex = |k: usize| &scratch.vertices[triangle[k] as usize];
                chunk.add(vectors, camera, [vertex(0), vertex(1), vertex(2)], kind);
            }
        }
    }
}

impl<const N: usize> Scratch<N> {
    pub const fn new() -> Self {
        Self { may_be_visible: Vec::new(), is_used: Vec::new(), vertices: Vec::new() }
    }
}

impl FacePlanes {
    fn new(vertices: &[MeshVertex], indices: &[u32]) -> Self {
        let mut face_planes = Self::default();
        for triangle in indices.as_chunks::<3>().0 {
            let [a, b, c] =
                triangle.map(|vertex| Vec3::from(vertices[vertex as usize].position_m).as_dvec3());
            // A triangle without area has no height and stays; one with NaN draws nothing.
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for (all, components) in face_planes.normal.iter_mut().zip(normal.as_vec3().to_array()) {
                all.push(components);
            }
            face_planes.offset_m.push(normal.dot(a) as f32);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            face_planes.per_height.push((longest / (b - a).cross(c - a).length()) as f32);
        }
        face_planes.radius_m =
            vertices.iter().map(|vertex| Vec3::from(vertex.position_m).length()).fold(0.0, f32::max);
        face_planes
    }

    /// Culls triangles that surely show their back. Elsewhere the sign of the area of the snapped vertices
    /// decides; the triangles culled here would be back faces whatever the snapping does.
    ///
    /// A triangle of area `A` whose plane is `d` in front of the eye, in the axes of the shape, has at least
    /// the area `f^2 det A d / z_far^3` in the image, where `det` is that of the map to the camera's axes,
    /// and sides of up to `f max_scale L s / z_near`: lengths grow by up to `max_scale`, and off-axis the
    /// image stretches by up to `s`. Vertices that move by `e` change that area by up to half the sum of the
    /// sides times `e`. So the visible side is certain from `d = 3 e s max_scale z_far^3 / (f det h z_near)`
    /// ([`HEIGHT_LOST`] for 3), with the height `h`.
    #[inline(always)]
    fn cull_back_faces(&self, camera: &Camera, camera_map: &CameraMap, may_be_visible: &mut [bool]) {
        let [x, y, z] = camera_map.eye_m;
        let rounding_m = ROUNDING * ((x * x + y * y + z * z).sqrt() + self.radius_m);
        let certain_side_m2 = camera_map.certain_side_m2(camera, self.radius_m);
        if !certain_side_m2.is_finite() || !rounding_m.is_finite() {
            return;
        }
        // In a mirrored shape the front is on the other side in its own axes.
        let front = camera_map.determinant.signum();
        let [normal_x, normal_y, normal_z] = &self.normal;
        let face_planes =
            normal_x.iter().zip(normal_y).zip(normal_z).zip(&self.offset_m).zip(&self.per_height);
        for (((((nx, ny), nz), along), per_height), may_be_visible) in face_planes.zip(may_be_visible) {
            let before_m = front * nx.mul_add(x, ny.mul_add(y, nz.mul_add(z, -along)));
            let nearly_m = certain_side_m2.mul_add(*per_height, rounding_m);
            *may_be_visible = before_m >= -nearly_m;
        }
    }
}

/// Map from the axes of a shape to those of the camera.
struct CameraMap {
    turn: [[f32; 3]; 3],
    from_camera_m: [f32; 3],
    /// Position of the camera in the axes of the shape, metres.
    eye_m: [f32; 3],
    /// Largest growth of lengths by the map.
    max_scale: f32,
    determinant: f32,
}

impl CameraMap {
    fn new(pose: &CameraPose, placement: &PlacedShape) -> Self {
        let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
        let turn = camera_from_ned * placement.ned_from_shape;
        let from_eye_ned_m = placement.origin_ned_m - pose.position_ned_m;
        let from_camera_m: DVec3 = camera_from_ned * from_eye_ned_m;
        let eye_m = -(placement.ned_from_shape.inverse() * from_eye_ned_m);
        let gram = placement.ned_from_shape.transpose() * placement.ned_from_shape;
        let max_scale2 = (0..3).map(|axis| gram.row(axis).abs().element_sum()).fold(0.0, f64::max);
        Self {
            max_scale: max_scale2.sqrt() as f32,
            determinant: placement.ned_from_shape.determinant() as f32,
            turn: [0, 1, 2].map(|axis| turn.row(axis).as_vec3().to_array()),
            from_camera_m: from_camera_m.as_vec3().to_array(),
            eye_m: eye_m.as_vec3().to_array(),
        }
    }

    /// Distance of a triangle's plane from the eye, times its height, from which its visible side is certain,
    /// in the axes of the shape, m². `radius_m` is the largest distance of a vertex from the origin. Infinite
    /// if part of the shape may be behind the camera or clipped, or if the map is singular.
    fn certain_side_m2(&self, camera: &Camera, radius_m: f32) -> f32 {
        let [x, y, z] = self.from_camera_m;
        let radius_m = self.max_scale * radius_m;
        let (near_m, far_m) = (z - radius_m, z + radius_m);
        let off_axis = ((x * x + y * y).sqrt() + radius_m) / near_m;
        let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
        // Vertices are displaced by up to half a step of the subpixel grid, plus the single-precision
        // rounding of metres and pixels.
        let most_px = fx.max(fy) * (off_axis + far_m / near_m) + cx.abs().max(cy.abs());
        // Vertices farther out are clipped, which changes the heights.
        let is_whole = near_m >= camera.uniforms.near_m && most_px < CLIP_PX && self.determinant != 0.0;
        if !is_whole {
            return f32::INFINITY;
        }
        let displacement_px =
            std::f32::consts::SQRT_2 * (0.5 / SUBPIXELS as f32 + 2.0 * f32::EPSILON * most_px);
        let stretch = (1.0 + off_axis * off_axis).sqrt();
        HEIGHT_LOST * displacement_px * stretch * self.max_scale * far_m * far_m * (far_m / near_m)
            / (fx.min(fy) * self.determinant.abs())
    }

    #[inline(always)]
    fn in_camera_m(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let along = |row: &[f32; 3], from: f32| row[0].mul_add(x, row[1].mul_add(y, row[2].mul_add(z, from)));
        let ([right, down, ahead], from) = (&self.turn, &self.from_camera_m);
        [along(right, from[0]), along(down, from[1]), along(ahead, from[2])]
    }
}

#[cfg(test)]
mod tests {
    use camsim_core::noise::pcg4d;
    use glam::DQuat;

    use super::*;
    use crate::simd::vectors::Baseline;
    use camsim_plan::uniforms::IdealCamera;

    fn random(seed: u32, k: u32) -> [f64; 4] {
        pcg4d([seed, k, 5, 9]).map(|bits| f64::from(bits) / 2_f64.powi(32) - 0.5)
    }

    /// A camera that looks down, and its pose.
    fn camera(height_m: f64, focal_px: f32) -> (Camera, CameraPose) {
        let uniforms = IdealCamera { near_m: 0.05, ..IdealCamera::default() };
        let camera = Camera {
            uniforms,
            focal_px: [focal_px; 2],
            principal_px: [500.0, 400.0],
            size_px: [1000, 800],
            sample_offset: 0,
        };
        (
            camera,
            CameraPose { position_ned_m: DVec3::new(0.0, 0.0, -height_m), ned_from_camera: DQuat::IDENTITY },
        )
    }

    /// Triangles drawn of a random shape with triangles of about this size, and the number culled by their
    /// planes. With `all` culling is off.
    fn drawn(
        seed: u32,
        camera: &Camera,
        pose: &CameraPose,
        size_m: f64,
        all: bool,
    ) -> (Vec<[[i32; 2]; 3]>, usize) {
        let mut shape = Shape::default();
        for k in 0..600 {
            let [x, y, z, turn] = random(seed, 10 * k);
            // Many are seen nearly edge-on: they are nearly upright.
            let flat = if turn > 0.0 { 1.0 } else { 0.02 };
            for vertex in 1..4 {
                let [dx, dy, dz, _] = random(seed, 10 * k + vertex);
                let position =
                    [20.0 * x + size_m * flat * dx, 20.0 * y + size_m * flat * dy, 20.0 * z + size_m * dz];
                shape.indices.push(shape.vertices.len() as u32);
                shape.vertices.push(MeshVertex::new(position.map(|position| position as f32), [0.0; 2]));
            }
        }
        let indices = shape.indices.clone();
        let piece = Piece::new(&shape, &shape.canonical_vertices(), &indices);
        // Scaled uniformly, slightly and strongly non-uniformly, and flattened.
        let sides = [
            DVec3::splat(2.0),
            DVec3::new(1.0, 1.3, 0.8),
            DVec3::new(1.0, 5.0, 0.3),
            DVec3::new(1.0, 1.0, 0.0),
        ][seed as usize / 3 % 4];
        let ned_from_shape =
            DMat3::from_rotation_x(0.2) * DMat3::from_diagonal(sides) * DMat3::from_rotation_z(0.3);
        let placement =
            PlacedShape { origin_ned_m: DVec3::new(3.0, -2.0, 1.0), ned_from_shape, stretch: 1.3 };
        let (mut scratch, mut chunk) = (Scratch::new(), Chunk::default());
        let kind = TriangleKind { material: 0, one_sided: true, sky: None };
        piece.draw(Baseline, camera, pose, &placement, kind, &mut scratch, &mut chunk);
        let culled = scratch.may_be_visible.iter().filter(|seen| !**seen).count();
        if all {
            chunk.clear();
            let camera_map = CameraMap::new(pose, &placement);
            for (k, vertex) in piece.vertices.iter().enumerate() {
                scratch.vertices[k] = camera.project(camera_map.in_camera_m(vertex.position_m), vertex.uv);
            }
            scratch.may_be_visible.fill(true);
            piece.add(Baseline, camera, &scratch, kind, &mut chunk);
        }
        (chunk.raster.iter().map(|triangle| triangle.snapped).collect(), culled)
    }

    #[test]
    fn culling_never_drops_a_front_face() {
        let mut culled_total = 0;
        for seed in 0..120 {
            let height_m = [15.0, 60.0, 400.0, 3000.0][seed as usize % 4];
            let size_m = [0.02, 0.3, 5.0][seed as usize % 3];
            let (camera, pose) = camera(height_m, [300.0, 2500.0][seed as usize % 2]);
            let (found, culled) = drawn(seed, &camera, &pose, size_m, false);
            assert_eq!(found, drawn(seed, &camera, &pose, size_m, true).0, "{seed}");
            culled_total += culled;
        }
        // Half show their back, but many are near edge-on, too small to be certain, behind the camera or
        // flattened.
        assert!(culled_total > 120 * 600 / 16, "{culled_total}");
    }
}
