//! Models as the host draws them: each level of detail in pieces of a few thousand triangles, with the
//! corners that these have.

use camsim_core::{
    pose::CameraPose,
    scene::{Light, MeshVertex, Shape, ShapeLods, transformed_normal},
};
use glam::{DMat3, DVec3, Vec3};

use super::{
    corners::{CUT_PX, Camera, Corner, SUBPIXELS},
    triangles::{Chunk, Kind, MORE},
};
use crate::simd::vectors::Vectors;
use camsim_core::scene::PlacedShape;

/// Triangles that are worked out together.
pub(super) const TRIANGLES_A_CHUNK: usize = 4096;

/// Part of the numbers that tell from which side a triangle is seen that rounding may be, and more.
const ROUNDING: f32 = 1e-5;
/// A triangle's area may change by three halves of its longest side times what its corners move by, and a
/// little more where all of them do: the height that it loses is up to this many times that.
const HEIGHT_LOST: f32 = 4.0;

/// Some of a level's triangles.
#[derive(Debug)]
pub(super) struct Piece {
    corners: Vec<MeshVertex>,
    /// Where light falls on them.
    normals: Vec<[f32; 3]>,
    /// Three a triangle.
    indices: Vec<u32>,
    planes: Planes,
}

/// Planes of triangles: unit normals to the side from which they turn anticlockwise, and how far along these
/// they are, metres in the shape's axes.
#[derive(Debug, Default)]
struct Planes {
    normal: [Vec<f32>; 3],
    along_m: Vec<f32>,
    /// 1 over the height over their longest sides.
    per_height: Vec<f32>,
    /// The farthest that a corner is from the shape's origin, metres.
    reach_m: f32,
}

/// What a piece is drawn with, again for each place.
#[derive(Debug)]
pub(super) struct Bench<const N: usize> {
    /// By triangle, whether its front may be seen.
    is_seen: Vec<bool>,
    /// By corner, whether it is one of these; and where it is, if so.
    is_asked: Vec<bool>,
    corners: Vec<Corner<N>>,
}

impl Piece {
    /// Those of a shape, by level of detail.
    pub fn of_levels(shape: &Shape, levels: &ShapeLods) -> Vec<Vec<Self>> {
        let first = shape.canonical_vertices();
        let pieces = |indices: &[u32]| {
            indices.chunks(3 * TRIANGLES_A_CHUNK).map(|some| Self::new(shape, &first, some)).collect()
        };
        levels.levels().iter().map(|level| pieces(&level.indices)).collect()
    }

    /// `first` are a shape's [`Shape::canonical_vertices`].
    fn new(shape: &Shape, first: &[u32], indices: &[u32]) -> Self {
        let mut used: Vec<u32> = indices.iter().map(|&corner| first[corner as usize]).collect();
        used.sort_unstable();
        used.dedup();
        let place = |&corner: &u32| used.partition_point(|&used| used < first[corner as usize]) as u32;
        let normals = if shape.has_normals() {
            used.iter().map(|&corner| shape.normals[corner as usize]).collect()
        } else {
            Vec::new()
        };
        let corners: Vec<MeshVertex> = used.iter().map(|&corner| shape.vertices[corner as usize]).collect();
        let indices: Vec<u32> = indices.iter().map(place).collect();
        let planes = Planes::new(&corners, &indices);
        Self { corners, normals, indices, planes }
    }

    /// How many triangles it has.
    pub fn len(&self) -> usize {
        self.indices.len() / 3
    }

    /// Adds it where it stands.
    #[inline(always)]
    pub fn draw(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        pose: &CameraPose,
        stands: &PlacedShape,
        kind: Kind,
        bench: &mut Bench<2>,
        chunk: &mut Chunk,
    ) {
        let place = Place::new(pose, stands);
        self.look(camera, &place, kind, bench);
        // Loops, here and below: what iterators call may be compiled without the vectors that this is.
        for (k, corner) in self.corners.iter().enumerate() {
            if bench.is_asked[k] {
                bench.corners[k] = camera.corner(place.in_camera_m(corner.position_m), corner.uv);
            }
        }
        self.add(vectors, camera, bench, kind, chunk);
    }

    /// The same with tints of its corners, in a light that falls on it.
    #[inline(always)]
    pub fn draw_more(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        pose: &CameraPose,
        stands: &PlacedShape,
        light: Option<Light>,
        kind: Kind,
        bench: &mut Bench<{ 2 + MORE }>,
        chunk: &mut Chunk,
    ) {
        let place = Place::new(pose, stands);
        self.look(camera, &place, kind, bench);
        let more = |k: usize| -> [f32; 2] {
            let Some((light, normal)) = light.zip(self.normals.get(k)) else { return [0.0; 2] };
            let normal = transformed_normal(&stands.ned_from_shape, Vec3::from(*normal).as_dvec3());
            [(light.sun * normal.dot(light.to_sun_ned)) as f32, normal.z as f32]
        };
        for (k, corner) in self.corners.iter().enumerate() {
            if bench.is_asked[k] {
                let ([u, v], [r, g, b, _], [sun, down]) = (corner.uv, corner.tint, more(k));
                bench.corners[k] =
                    camera.corner(place.in_camera_m(corner.position_m), [u, v, r, g, b, sun, down]);
            }
        }
        self.add(vectors, camera, bench, kind, chunk);
    }

    /// Which triangles may be seen, and which corners are asked for by them.
    #[inline(always)]
    fn look<const N: usize>(&self, camera: &Camera, place: &Place, kind: Kind, bench: &mut Bench<N>) {
        bench.is_seen.resize(self.len(), true);
        bench.is_asked.resize(self.corners.len(), true);
        bench.corners.resize(self.corners.len(), Corner::NOWHERE);
        bench.is_seen.fill(true);
        bench.is_asked.fill(!kind.one_sided);
        if kind.one_sided {
            self.planes.seen_from(camera, place, &mut bench.is_seen);
            for (triangle, is_seen) in self.indices.as_chunks::<3>().0.iter().zip(&bench.is_seen) {
                if *is_seen {
                    triangle.iter().for_each(|&corner| bench.is_asked[corner as usize] = true);
                }
            }
        }
    }

    #[inline(always)]
    fn add<const N: usize>(
        &self,
        vectors: impl Vectors,
        camera: &Camera,
        bench: &Bench<N>,
        kind: Kind,
        chunk: &mut Chunk,
    ) {
        for (triangle, is_seen) in self.indices.as_chunks::<3>().0.iter().zip(&bench.is_seen) {
            if *is_seen {
                let corner = |k: usize| &bench.corners[triangle[k] as usize];
                chunk.add(vectors, camera, [corner(0), corner(1), corner(2)], kind);
            }
        }
    }
}

impl<const N: usize> Bench<N> {
    pub const fn new() -> Self {
        Self { is_seen: Vec::new(), is_asked: Vec::new(), corners: Vec::new() }
    }
}

impl Planes {
    fn new(corners: &[MeshVertex], indices: &[u32]) -> Self {
        let mut planes = Self::default();
        for triangle in indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|corner| Vec3::from(corners[corner as usize].position_m).as_dvec3());
            // One without an area has no height and stays; one with a number that is none draws nothing.
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for (all, of) in planes.normal.iter_mut().zip(normal.as_vec3().to_array()) {
                all.push(of);
            }
            planes.along_m.push(normal.dot(a) as f32);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            planes.per_height.push((longest / (b - a).cross(c - a).length()) as f32);
        }
        planes.reach_m =
            corners.iter().map(|corner| Vec3::from(corner.position_m).length()).fold(0.0, f32::max);
        planes
    }

    /// Leaves those of the triangles that may be seen from in front. The picture tells which side of one is
    /// seen where its corners are on the grid; those that are left out here would turn there whatever their
    /// corners are moved by.
    ///
    /// A triangle of area `A` whose plane is `d` in front of the eye, in the shape's axes, has the area `f^2
    /// det A d / z_far^3` in the picture or more, where `det` is of the way to the camera's axes, and sides
    /// of up to `f most L s / z_near`: lengths grow `most` times, and beside the axis a picture stretches by
    /// up to `s`. Corners that move by `e` change that area by up to half of the sides' sum times `e`. So the
    /// side that is seen is sure from `d = 3 e s most z_far^3 / (f det h z_near)` on ([`HEIGHT_LOST`] for 3),
    /// `h` the height.
    #[inline(always)]
    fn seen_from(&self, camera: &Camera, place: &Place, is_seen: &mut [bool]) {
        let [x, y, z] = place.eye_m;
        let rounding_m = ROUNDING * ((x * x + y * y + z * z).sqrt() + self.reach_m);
        let turned_m2 = place.turned_m2(camera, self.reach_m);
        if !turned_m2.is_finite() || !rounding_m.is_finite() {
            return;
        }
        // Where a shape is mirrored, fronts are on the other side in its own axes.
        let front = place.volume.signum();
        let [normal_x, normal_y, normal_z] = &self.normal;
        let planes = normal_x.iter().zip(normal_y).zip(normal_z).zip(&self.along_m).zip(&self.per_height);
        for (((((nx, ny), nz), along), per_height), is_seen) in planes.zip(is_seen) {
            let before_m = front * nx.mul_add(x, ny.mul_add(y, nz.mul_add(z, -along)));
            let nearly_m = turned_m2.mul_add(*per_height, rounding_m);
            *is_seen = before_m >= -nearly_m;
        }
    }
}

/// From a shape's axes to the camera's.
struct Place {
    turn: [[f32; 3]; 3],
    from_camera_m: [f32; 3],
    /// The camera in the shape's axes.
    eye_m: [f32; 3],
    /// How much longer lengths are at most, of those in the shape's axes, and how many times larger volumes;
    /// less than 0 where it is mirrored.
    most: f32,
    volume: f32,
}

impl Place {
    fn new(pose: &CameraPose, stands: &PlacedShape) -> Self {
        let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
        let turn = camera_from_ned * stands.ned_from_shape;
        let from_eye_ned_m = stands.origin_ned_m - pose.position_ned_m;
        let from_camera_m: DVec3 = camera_from_ned * from_eye_ned_m;
        let eye_m = -(stands.ned_from_shape.inverse() * from_eye_ned_m);
        let squared = stands.ned_from_shape.transpose() * stands.ned_from_shape;
        let most2 = (0..3).map(|axis| squared.row(axis).abs().element_sum()).fold(0.0, f64::max);
        Self {
            most: most2.sqrt() as f32,
            volume: stands.ned_from_shape.determinant() as f32,
            turn: [0, 1, 2].map(|axis| turn.row(axis).as_vec3().to_array()),
            from_camera_m: from_camera_m.as_vec3().to_array(),
            eye_m: eye_m.as_vec3().to_array(),
        }
    }

    /// Of a shape of which nothing is farther than `reach_m` from its origin: what a triangle's plane must be
    /// before or behind the eye at least to be sure of its side, times its height; in the shape's axes.
    /// Infinite where some of it may be behind the camera or cut off, and of what is pressed flat.
    fn turned_m2(&self, camera: &Camera, reach_m: f32) -> f32 {
        let [x, y, z] = self.from_camera_m;
        let reach_m = self.most * reach_m;
        let (near_m, far_m) = (z - reach_m, z + reach_m);
        let beside = ((x * x + y * y).sqrt() + reach_m) / near_m;
        let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
        // Corners stand half a step of the grid beside where they are at most, and what single precision
        // leaves of metres and of pixels.
        let most_px = fx.max(fy) * (beside + far_m / near_m) + cx.abs().max(cy.abs());
        // Corners farther out are cut off, and what is left has heights of its own.
        let is_whole = near_m >= camera.uniforms.near_m && most_px < CUT_PX && self.volume != 0.0;
        if !is_whole {
            return f32::INFINITY;
        }
        let moved_px = std::f32::consts::SQRT_2 * (0.5 / SUBPIXELS as f32 + 2.0 * f32::EPSILON * most_px);
        let stretch = (1.0 + beside * beside).sqrt();
        HEIGHT_LOST * moved_px * stretch * self.most * far_m * far_m * (far_m / near_m)
            / (fx.min(fy) * self.volume.abs())
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
    use crate::simd::vectors::Any;
    use camsim_plan::uniforms::IdealCamera;

    fn random(seed: u32, k: u32) -> [f64; 4] {
        pcg4d([seed, k, 5, 9]).map(|bits| f64::from(bits) / 2_f64.powi(32) - 0.5)
    }

    /// A camera that looks down, and where it is.
    fn camera(height_m: f64, focal_px: f32) -> (Camera, CameraPose) {
        let uniforms = IdealCamera { near_m: 0.05, ..IdealCamera::default() };
        let camera = Camera {
            uniforms,
            focal_px: [focal_px; 2],
            principal_px: [500.0, 400.0],
            size_px: [1000, 800],
            beside: 0,
        };
        (
            camera,
            CameraPose { position_ned_m: DVec3::new(0.0, 0.0, -height_m), ned_from_camera: DQuat::IDENTITY },
        )
    }

    /// What is drawn of triangles of about a size, and how many of them are left out by their planes; all of
    /// them where `all` is asked for.
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
            // Many of them are seen nearly edge-on: all are nearly upright.
            let flat = if turn > 0.0 { 1.0 } else { 0.02 };
            for corner in 1..4 {
                let [dx, dy, dz, _] = random(seed, 10 * k + corner);
                let at =
                    [20.0 * x + size_m * flat * dx, 20.0 * y + size_m * flat * dy, 20.0 * z + size_m * dz];
                shape.indices.push(shape.vertices.len() as u32);
                shape.vertices.push(MeshVertex::new(at.map(|at| at as f32), [0.0; 2]));
            }
        }
        let indices = shape.indices.clone();
        let piece = Piece::new(&shape, &shape.canonical_vertices(), &indices);
        // Stretched all over, hardly, much, and pressed flat.
        let sides = [
            DVec3::splat(2.0),
            DVec3::new(1.0, 1.3, 0.8),
            DVec3::new(1.0, 5.0, 0.3),
            DVec3::new(1.0, 1.0, 0.0),
        ][seed as usize / 3 % 4];
        let ned_from_shape =
            DMat3::from_rotation_x(0.2) * DMat3::from_diagonal(sides) * DMat3::from_rotation_z(0.3);
        let stands = PlacedShape { origin_ned_m: DVec3::new(3.0, -2.0, 1.0), ned_from_shape, stretch: 1.3 };
        let (mut bench, mut chunk) = (Bench::new(), Chunk::default());
        let kind = Kind { paint: 0, one_sided: true, sky: None };
        piece.draw(Any, camera, pose, &stands, kind, &mut bench, &mut chunk);
        let left_out = bench.is_seen.iter().filter(|seen| !**seen).count();
        if all {
            chunk.clear();
            let place = Place::new(pose, &stands);
            for (k, corner) in piece.corners.iter().enumerate() {
                bench.corners[k] = camera.corner(place.in_camera_m(corner.position_m), corner.uv);
            }
            bench.is_seen.fill(true);
            piece.add(Any, camera, &bench, kind, &mut chunk);
        }
        (chunk.covers.iter().map(|cover| cover.at).collect(), left_out)
    }

    #[test]
    fn triangles_are_left_out_only_where_the_picture_shows_their_backs_whatever_rounding_does() {
        let mut left_out_of_all = 0;
        for seed in 0..120 {
            let height_m = [15.0, 60.0, 400.0, 3000.0][seed as usize % 4];
            let size_m = [0.02, 0.3, 5.0][seed as usize % 3];
            let (camera, pose) = camera(height_m, [300.0, 2500.0][seed as usize % 2]);
            let (found, left_out) = drawn(seed, &camera, &pose, size_m, false);
            assert_eq!(found, drawn(seed, &camera, &pose, size_m, true).0, "{seed}");
            left_out_of_all += left_out;
        }
        // Half of them show their backs, but many are near edge-on, too small to be sure of, behind the
        // camera or pressed flat.
        assert!(left_out_of_all > 120 * 600 / 16, "{left_out_of_all}");
    }
}
