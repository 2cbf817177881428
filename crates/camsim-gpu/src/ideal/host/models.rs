//! Models as the host draws them: each level of detail in pieces of a few thousand triangles, with the corners that these have.

use camsim_core::{
    pose::CameraPose,
    scene::{Light, MeshVertex, Shape, ShapeLevels, turned_normal},
};
use glam::{DMat3, DVec3, Vec3};

use super::{
    corners::{Camera, Corner},
    triangles::{Chunk, Kind, MORE},
};
use crate::upload::PlacedShape;

/// Triangles that are worked out together.
pub(super) const TRIANGLES_A_CHUNK: usize = 4096;

/// Some of a level's triangles.
#[derive(Debug)]
pub(super) struct Piece {
    corners: Vec<MeshVertex>,
    /// Where light falls on them.
    normals: Vec<[f32; 3]>,
    /// Three a triangle.
    indices: Vec<u32>,
}

impl Piece {
    /// Those of a shape, by level of detail.
    pub fn of_levels(shape: &Shape, levels: &ShapeLevels) -> Vec<Vec<Self>> {
        let pieces = |indices: &[u32]| indices.chunks(3 * TRIANGLES_A_CHUNK).map(|some| Self::new(shape, some)).collect();
        levels.levels().iter().map(|level| pieces(&level.indices)).collect()
    }

    fn new(shape: &Shape, indices: &[u32]) -> Self {
        let mut used = indices.to_vec();
        used.sort_unstable();
        used.dedup();
        let place = |corner: &u32| used.partition_point(|used| used < corner) as u32;
        let normals = if shape.has_normals() { used.iter().map(|&corner| shape.normals[corner as usize]).collect() } else { Vec::new() };
        Self {
            corners: used.iter().map(|&corner| shape.vertices[corner as usize]).collect(),
            normals,
            indices: indices.iter().map(place).collect(),
        }
    }

    /// How many triangles it has.
    pub fn len(&self) -> usize {
        self.indices.len() / 3
    }

    /// Adds it where it stands.
    #[inline(always)]
    pub fn draw(&self, camera: &Camera, pose: &CameraPose, stands: &PlacedShape, kind: Kind, chunk: &mut Chunk) {
        let place = Place::new(pose, stands);
        let mut corners = Vec::with_capacity(self.corners.len());
        // A loop: what iterators call may be compiled without the vectors that this is.
        for corner in &self.corners {
            corners.push(camera.corner(place.in_camera_m(corner.position_m), corner.uv));
        }
        self.add(camera, &corners, kind, chunk);
    }

    /// The same with tints of its corners, in a light that falls on it.
    #[inline(always)]
    pub fn draw_more(&self, camera: &Camera, pose: &CameraPose, stands: &PlacedShape, light: Option<Light>, kind: Kind, chunk: &mut Chunk) {
        let place = Place::new(pose, stands);
        let more = |k: usize| -> [f32; 2] {
            let Some((light, normal)) = light.zip(self.normals.get(k)) else { return [0.0; 2] };
            let normal = turned_normal(&stands.ned_from_shape, Vec3::from(*normal).as_dvec3());
            [(light.sun * normal.dot(light.to_sun_ned)) as f32, normal.z as f32]
        };
        let mut corners: Vec<Corner<{ 2 + MORE }>> = Vec::with_capacity(self.corners.len());
        for (k, corner) in self.corners.iter().enumerate() {
            let ([u, v], [r, g, b, _], [sun, down]) = (corner.uv, corner.tint, more(k));
            corners.push(camera.corner(place.in_camera_m(corner.position_m), [u, v, r, g, b, sun, down]));
        }
        self.add(camera, &corners, kind, chunk);
    }

    #[inline(always)]
    fn add<const N: usize>(&self, camera: &Camera, corners: &[Corner<N>], kind: Kind, chunk: &mut Chunk) {
        for triangle in self.indices.chunks_exact(3) {
            let corner = |k: usize| &corners[triangle[k] as usize];
            chunk.add(camera, [corner(0), corner(1), corner(2)], kind);
        }
    }
}

/// From a shape's axes to the camera's.
struct Place {
    turn: [[f32; 3]; 3],
    from_camera_m: [f32; 3],
}

impl Place {
    fn new(pose: &CameraPose, stands: &PlacedShape) -> Self {
        let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
        let turn = camera_from_ned * stands.ned_from_shape;
        let from_camera_m: DVec3 = camera_from_ned * (stands.origin_ned_m - pose.position_ned_m);
        Self { turn: [0, 1, 2].map(|axis| turn.row(axis).as_vec3().to_array()), from_camera_m: from_camera_m.as_vec3().to_array() }
    }

    #[inline(always)]
    fn in_camera_m(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let along = |row: &[f32; 3], from: f32| row[0].mul_add(x, row[1].mul_add(y, row[2].mul_add(z, from)));
        let ([right, down, ahead], from) = (&self.turn, &self.from_camera_m);
        [along(right, from[0]), along(down, from[1]), along(ahead, from[2])]
    }
}
