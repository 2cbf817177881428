//! Textured triangle meshes.

use std::sync::Arc;

use glam::DVec3;

use super::{Texture, terrain::intersect_triangle};

/// What a texture shows outside of 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The nearest border pixel.
    #[default]
    Clamp,
    /// The picture again.
    Repeat,
}

/// A corner of a [`Mesh`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct MeshVertex {
    /// North, east, down in metres from [`Mesh::origin_ned_m`].
    pub position_m: [f32; 3],
    /// Texture coordinates: (0, 0) is the outer corner of the top-left pixel, (1, 1) that of the bottom-right one.
    pub uv: [f32; 2],
}

/// A textured surface; visible from both sides.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<MeshVertex>,
    /// Three a triangle, each below `vertices.len()`.
    pub indices: Vec<u32>,
    /// The picture on it.
    pub texture: Arc<Texture>,
    /// NED position of the vertices' origin, metres.
    pub origin_ned_m: DVec3,
    /// Behaviour outside of the picture.
    pub wrap: Wrap,
}

impl Mesh {
    /// A level picture on the ground: image top to the north, image left to the west, `width_m` from the picture's left edge to its
    /// right edge; the height follows from square pixels. `centre_ned_m` is the middle of the picture.
    pub fn level_picture(texture: Arc<Texture>, centre_ned_m: DVec3, width_m: f64) -> Self {
        let [width_px, height_px] = texture.size_px.map(f64::from);
        let half_east = (0.5 * width_m) as f32;
        let half_north = (0.5 * width_m * height_px / width_px) as f32;
        let corner =
            |u: f32, v: f32| MeshVertex { position_m: [half_north * (1.0 - 2.0 * v), half_east * (2.0 * u - 1.0), 0.0], uv: [u, v] };
        Self {
            vertices: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)],
            // The diagonal runs from north-west to south-east, as in the terrain.
            indices: vec![0, 3, 1, 0, 2, 3],
            texture,
            origin_ned_m: centre_ned_m,
            wrap: Wrap::Clamp,
        }
    }

    /// First point along `origin + t direction`, 0 <= t <= `t_max`, from either side: t and the texture coordinates there. Looks at
    /// every triangle.
    pub fn intersect(&self, origin_ned_m: DVec3, direction_ned: DVec3, t_max: f64) -> Option<(f64, [f64; 2])> {
        let mut best = None;
        let mut limit = t_max;
        for corners in self.indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]];
            if let Some((t, weights)) = intersect_triangle(corners.map(|v| self.position_ned_m(v)), origin_ned_m, direction_ned, limit) {
                let uvs = corners.map(|v| self.vertices[v as usize].uv);
                limit = t;
                best = Some((t, [0, 1].map(|k: usize| (0..3).map(|c| weights[c] * f64::from(uvs[c][k])).sum())));
            }
        }
        best
    }

    /// Lower bound of the distance from a point to the mesh, metres: that of its bounding box.
    pub fn min_distance_m(&self, position_ned_m: DVec3) -> f64 {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for vertex in 0..self.vertices.len() as u32 {
            let at = self.position_ned_m(vertex);
            low = low.min(at);
            high = high.max(at);
        }
        if self.vertices.is_empty() { f64::INFINITY } else { position_ned_m.distance(position_ned_m.clamp(low, high)) }
    }

    /// NED position of a vertex, metres.
    pub fn position_ned_m(&self, vertex: u32) -> DVec3 {
        self.origin_ned_m + glam::Vec3::from(self.vertices[vertex as usize].position_m).as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Encoding;

    #[test]
    fn a_level_picture_has_its_top_in_the_north_and_its_left_in_the_west() {
        let texture = Texture { size_px: [4, 2], rgba8: vec![255; 32], encoding: Encoding::Srgb };
        let mesh = Mesh::level_picture(Arc::new(texture), DVec3::new(100.0, -50.0, 3.0), 40.0);
        let top_left = mesh.vertices.iter().position(|v| v.uv == [0.0, 0.0]).expect("corner");
        assert_eq!(mesh.position_ned_m(top_left as u32), DVec3::new(110.0, -70.0, 3.0));
        let bottom_right = mesh.vertices.iter().position(|v| v.uv == [1.0, 1.0]).expect("corner");
        assert_eq!(mesh.position_ned_m(bottom_right as u32), DVec3::new(90.0, -30.0, 3.0));
        let (t, uv) = mesh.intersect(DVec3::new(105.0, -40.0, -7.0), DVec3::Z, 100.0).expect("hit");
        assert!((t - 10.0).abs() < 1e-9 && (uv[0] - 0.75).abs() < 1e-9 && (uv[1] - 0.25).abs() < 1e-9, "{t} {uv:?}");
        assert_eq!(mesh.intersect(DVec3::new(111.0, -40.0, -7.0), DVec3::Z, 100.0), None);
        // Both triangles turn the same way and cover the rectangle.
        let area: f64 = mesh
            .indices
            .chunks_exact(3)
            .map(|t| {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.position_ned_m(i));
                0.5 * (b - a).cross(c - a).z
            })
            .sum();
        assert!((area.abs() - 800.0).abs() < 1e-9, "{area}");
    }
}
