//! Textured triangle meshes: a shape, what it is covered with, and where it stands. Many meshes may share one
//! shape.

use std::{collections::HashMap, sync::Arc};

use glam::{DMat3, DVec3};

use super::{Aabb, Light, Texture, light::turned_normal, terrain::intersect_triangle, texture::Wrap};

/// A corner of a [`Shape`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct MeshVertex {
    /// Metres in the shape's own axes, from [`Mesh::origin_ned_m`].
    pub position_m: [f32; 3],
    /// Texture coordinates: (0, 0) is the outer corner of the top-left pixel, (1, 1) that of the bottom-right
    /// one.
    pub uv: [f32; 2],
    /// Factor of the texture's colour, linear light, and of its alpha; 0..=1.
    pub tint: [f32; 4],
}

impl MeshVertex {
    /// A corner that leaves the texture as it is.
    pub const fn new(position_m: [f32; 3], uv: [f32; 2]) -> Self {
        Self { position_m, uv, tint: [1.0; 4] }
    }
}

impl Default for MeshVertex {
    fn default() -> Self {
        Self::new([0.0; 3], [0.0; 2])
    }
}

/// Triangles in axes of their own.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Corners.
    pub vertices: Vec<MeshVertex>,
    /// Three a triangle, each below `vertices.len()`.
    pub indices: Vec<u32>,
    /// Outward unit normals of the corners, in the shape's own axes; none for what no light falls on.
    pub normals: Vec<[f32; 3]>,
}

impl Shape {
    /// Whether light falls on it: each corner has a normal.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        !self.normals.is_empty() && self.normals.len() == self.vertices.len()
    }

    /// For each corner the first that is equal to it in all: files give each side corners of its own, for
    /// normals and pictures that may not be there.
    #[must_use]
    pub fn first_equals(&self) -> Vec<u32> {
        // 0 and -0 are one number.
        let bits = |values: &[f32]| values.iter().map(|value| (value + 0.0).to_bits()).collect::<Vec<u32>>();
        let normal = |i: u32| self.normals.get(i as usize).map_or_else(Vec::new, |normal| bits(normal));
        let mut known = HashMap::new();
        let corners = (0..).zip(&self.vertices);
        corners
            .map(|(i, MeshVertex { position_m, uv, tint })| {
                *known.entry((bits(position_m), bits(uv), bits(tint), normal(i))).or_insert(i)
            })
            .collect()
    }

    /// Smallest box around the corners, in the shape's own axes.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        self.vertices
            .iter()
            .for_each(|vertex| bounds.include(DVec3::from_array(vertex.position_m.map(f64::from))));
        bounds
    }
}

/// What a surface looks like.
#[derive(Clone, Debug)]
pub struct Material {
    /// The picture on it.
    pub texture: Arc<Texture>,
    /// Behaviour outside of the picture, across and down.
    pub wrap: [Wrap; 2],
    /// Whether a magnified texel has sharp borders.
    pub nearest: bool,
    /// Light that is added to the picture's, linear.
    pub emissive: [f32; 3],
    /// Where the picture's alpha, times the tint's, is below this there is no surface. The picture at full
    /// size counts, bilinear.
    pub cutoff: Option<f32>,
    /// Whether its colour is mixed with what is behind it, by alpha, wherever there is any: the cut-off then
    /// says where it has depth.
    pub blends: bool,
    /// Whether only the side is there from which the triangles turn anticlockwise.
    pub one_sided: bool,
}

impl Material {
    /// A picture, seen from both sides, without holes.
    pub fn picture(texture: Arc<Texture>, wrap: Wrap) -> Self {
        Self {
            texture,
            wrap: [wrap; 2],
            nearest: false,
            emissive: [0.0; 3],
            cutoff: None,
            blends: false,
            one_sided: false,
        }
    }

    /// Whether two materials share their texture and are otherwise equal.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.texture, &other.texture)
            && (self.wrap, self.nearest, self.cutoff, self.one_sided)
                == (other.wrap, other.nearest, other.cutoff, other.one_sided)
            && (self.emissive, self.blends) == (other.emissive, other.blends)
    }

    /// Alpha at a place of the picture, in f64: what the cut-off is compared with, but for the tint.
    pub fn alpha_at(&self, uv: [f64; 2]) -> f64 {
        self.texture.alpha_at(uv, self.wrap, self.nearest)
    }
}

/// A shape that stands somewhere.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Its triangles.
    pub shape: Arc<Shape>,
    /// What is on them.
    pub material: Material,
    /// NED position of the shape's origin, metres.
    pub origin_ned_m: DVec3,
    /// From the shape's axes to north-east-down; may turn, scale and mirror. Triangles have their fronts
    /// where they turn anticlockwise as the mesh stands: those of a shape that is mirrored turn the other way
    /// in its own axes.
    pub ned_from_shape: DMat3,
}

impl Mesh {
    /// A mesh whose corners are in north-east-down from `origin_ned_m`, three `indices` a triangle.
    pub fn new(
        vertices: Vec<MeshVertex>,
        indices: Vec<u32>,
        texture: Arc<Texture>,
        origin_ned_m: DVec3,
        wrap: Wrap,
    ) -> Self {
        let shape = Arc::new(Shape { vertices, indices, normals: Vec::new() });
        Self {
            shape,
            material: Material::picture(texture, wrap),
            origin_ned_m,
            ned_from_shape: DMat3::IDENTITY,
        }
    }

    /// A level picture on the ground: image top to the north, image left to the west, `width_m` from the
    /// picture's left edge to its right edge; the height follows from square pixels. `centre_ned_m` is the
    /// middle of the picture.
    pub fn level_picture(texture: Arc<Texture>, centre_ned_m: DVec3, width_m: f64) -> Self {
        let [width_px, height_px] = texture.size_px.map(f64::from);
        let half_east = (0.5 * width_m) as f32;
        let half_north = (0.5 * width_m * height_px / width_px) as f32;
        let corner = |u: f32, v: f32| {
            MeshVertex::new([half_north * (1.0 - 2.0 * v), half_east * (2.0 * u - 1.0), 0.0], [u, v])
        };
        let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        // The diagonal runs from north-west to south-east, as in the terrain.
        Self::new(vertices, vec![0, 3, 1, 0, 2, 3], texture, centre_ned_m, Wrap::Clamp)
    }

    /// First point along `origin + t direction`, 0 <= t <= `t_max`, from either side: t and the texture
    /// coordinates there. Looks at every triangle, and neither at its side nor at holes.
    pub fn intersect(
        &self,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        t_max: f64,
    ) -> Option<(f64, [f64; 2])> {
        let mut best = None;
        let mut limit = t_max;
        for corners in self.shape.indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]];
            if let Some((t, weights)) = intersect_triangle(
                corners.map(|v| self.position_ned_m(v)),
                origin_ned_m,
                direction_ned,
                limit,
            ) {
                let uvs = corners.map(|v| self.shape.vertices[v as usize].uv);
                limit = t;
                best =
                    Some((t, [0, 1].map(|k: usize| (0..3).map(|c| weights[c] * f64::from(uvs[c][k])).sum())));
            }
        }
        best
    }

    /// Lower bound of the distance from a point to the mesh, metres: that of its bounding box.
    pub fn min_distance_m(&self, position_ned_m: DVec3) -> f64 {
        let bounds = self.bounds();
        if bounds.is_empty() { f64::INFINITY } else { bounds.distance_m(position_ned_m) }
    }

    /// Box around the mesh, NED: of a turned shape the box around its own.
    pub fn bounds(&self) -> Aabb {
        self.shape.bounds().turned(self.ned_from_shape, self.origin_ned_m)
    }

    /// NED position of a vertex, metres.
    pub fn position_ned_m(&self, vertex: u32) -> DVec3 {
        self.origin_ned_m
            + self.ned_from_shape
                * glam::Vec3::from(self.shape.vertices[vertex as usize].position_m).as_dvec3()
    }

    /// Whether a ray along `direction_ned` that meets a triangle of the shape sees something there: the right
    /// side, and no hole.
    pub fn shows(&self, corners: [u32; 3], weights: [f64; 3], direction_ned: DVec3) -> bool {
        self.faces(corners, direction_ned)
            && self.material.cutoff.is_none_or(|cutoff| self.alpha_at(corners, weights) >= f64::from(cutoff))
    }

    /// Whether a triangle is there for what looks along a direction.
    pub fn faces(&self, corners: [u32; 3], direction_ned: DVec3) -> bool {
        let [a, b, c] = corners.map(|v| self.position_ned_m(v));
        !self.material.one_sided || (b - a).cross(c - a).dot(direction_ned) < 0.0
    }

    /// Alpha between three corners.
    pub fn alpha_at(&self, corners: [u32; 3], weights: [f64; 3]) -> f64 {
        self.material.alpha_at(self.uv_at(corners, weights)) * self.tint_at(corners, weights)[3]
    }

    /// Texture coordinates between three corners.
    pub fn uv_at(&self, corners: [u32; 3], weights: [f64; 3]) -> [f64; 2] {
        let of = corners.map(|v| self.shape.vertices[v as usize].uv);
        [0, 1].map(|axis: usize| (0..3).map(|k| weights[k] * f64::from(of[k][axis])).sum())
    }

    /// Tint between three corners.
    pub fn tint_at(&self, corners: [u32; 3], weights: [f64; 3]) -> [f64; 4] {
        let of = corners.map(|v| self.shape.vertices[v as usize].tint);
        [0, 1, 2, 3].map(|channel: usize| (0..3).map(|k| weights[k] * f64::from(of[k][channel])).sum())
    }

    /// Factor of the picture's colour between three corners, seen along a direction: light on the side that
    /// is seen, or 1 without normals.
    pub fn light_at(&self, light: &Light, corners: [u32; 3], weights: [f64; 3], direction_ned: DVec3) -> f64 {
        if !self.shape.has_normals() {
            return 1.0;
        }
        let outward: DVec3 = (0..3).map(|k| weights[k] * self.normal_ned(corners[k])).sum();
        let [a, b, c] = corners.map(|v| self.position_ned_m(v));
        let is_front = (b - a).cross(c - a).dot(direction_ned) < 0.0;
        light.on(if is_front { outward } else { -outward })
    }

    /// A corner's normal as the mesh stands.
    fn normal_ned(&self, vertex: u32) -> DVec3 {
        turned_normal(&self.ned_from_shape, glam::Vec3::from(self.shape.normals[vertex as usize]).as_dvec3())
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
        let top_left = mesh.shape.vertices.iter().position(|v| v.uv == [0.0, 0.0]).expect("corner");
        assert_eq!(mesh.position_ned_m(top_left as u32), DVec3::new(110.0, -70.0, 3.0));
        let bottom_right = mesh.shape.vertices.iter().position(|v| v.uv == [1.0, 1.0]).expect("corner");
        assert_eq!(mesh.position_ned_m(bottom_right as u32), DVec3::new(90.0, -30.0, 3.0));
        let (t, uv) = mesh.intersect(DVec3::new(105.0, -40.0, -7.0), DVec3::Z, 100.0).expect("hit");
        assert!(
            (t - 10.0).abs() < 1e-9 && (uv[0] - 0.75).abs() < 1e-9 && (uv[1] - 0.25).abs() < 1e-9,
            "{t} {uv:?}"
        );
        assert_eq!(mesh.intersect(DVec3::new(111.0, -40.0, -7.0), DVec3::Z, 100.0), None);
        // Both triangles turn the same way and cover the rectangle.
        let area: f64 = mesh
            .shape
            .indices
            .chunks_exact(3)
            .map(|t| {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.position_ned_m(i));
                0.5 * (b - a).cross(c - a).z
            })
            .sum();
        assert!((area.abs() - 800.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn a_turned_shape_is_within_its_box_and_shows_one_side() {
        let texture = Arc::new(Texture {
            size_px: [2, 1],
            rgba8: vec![9, 9, 9, 0, 9, 9, 9, 255],
            encoding: Encoding::Linear,
        });
        let mut mesh = Mesh::level_picture(texture, DVec3::new(5.0, 6.0, 7.0), 4.0);
        mesh.ned_from_shape = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.4) * 2.0;
        let bounds = mesh.bounds();
        for vertex in 0..4 {
            assert!(bounds.distance_m(mesh.position_ned_m(vertex)) < 1e-12);
        }
        let triangle = [mesh.shape.indices[0], mesh.shape.indices[1], mesh.shape.indices[2]];
        let sees = |mesh: &Mesh, weights: [f64; 3]| {
            [DVec3::Z, -DVec3::Z].map(|direction| mesh.shows(triangle, weights, direction))
        };
        assert_eq!(sees(&mesh, [0.2, 0.3, 0.5]), [true, true]);
        mesh.material.one_sided = true;
        let one = sees(&mesh, [0.2, 0.3, 0.5]);
        assert!(one[0] != one[1], "{one:?}");
        // Corners 0, 3, 1: uv (0, 0), (1, 1), (1, 0). The left half has no content.
        mesh.material = Material { one_sided: false, cutoff: Some(0.5), ..mesh.material };
        assert_eq!(
            [sees(&mesh, [0.9, 0.05, 0.05]), sees(&mesh, [0.1, 0.5, 0.4])],
            [[false, false], [true, true]]
        );
    }
}
