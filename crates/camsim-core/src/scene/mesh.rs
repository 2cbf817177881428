//! Textured triangle meshes: a shape, its material, and its placement. Several meshes may share one shape.

use std::{collections::HashMap, sync::Arc};

use glam::{DMat3, DVec3};

use super::{
    Aabb, Light, RigidMotion, RigidState, Texture,
    light::transformed_normal,
    ray_bvh::RayBvh,
    ray_packet::{Faces, PacketSurface, RayPacket},
    terrain::intersect_triangle,
    texture::Wrap,
};

/// A vertex of a [`Shape`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct MeshVertex {
    /// Position in the shape's own axes, metres from [`Mesh::origin_ned_m`].
    pub position_m: [f32; 3],
    /// Texture coordinates: (0, 0) is the outer corner of the top-left pixel, (1, 1) that of the bottom-right
    /// one.
    pub uv: [f32; 2],
    /// Factor on the texture's linear colour and on its alpha; 0..=1.
    pub tint: [f32; 4],
}

impl MeshVertex {
    /// A vertex with tint 1.
    pub const fn new(position_m: [f32; 3], uv: [f32; 2]) -> Self {
        Self { position_m, uv, tint: [1.0; 4] }
    }
}

impl Default for MeshVertex {
    fn default() -> Self {
        Self::new([0.0; 3], [0.0; 2])
    }
}

/// Triangles in their own axes.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// The vertices.
    pub vertices: Vec<MeshVertex>,
    /// Three indices per triangle, each below `vertices.len()`.
    pub indices: Vec<u32>,
    /// Outward unit normals of the vertices in the shape's own axes; empty for unlit shapes.
    pub normals: Vec<[f32; 3]>,
}

impl Shape {
    /// Whether the shape is lit: each vertex has a normal.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        !self.normals.is_empty() && self.normals.len() == self.vertices.len()
    }

    /// Vertices of a triangle.
    #[must_use]
    #[inline]
    pub fn triangle(&self, triangle: u32) -> [u32; 3] {
        [0, 1, 2].map(|k| self.indices[3 * triangle as usize + k])
    }

    /// For each vertex the first one that equals it in all attributes. Files repeat vertices per side for
    /// normals and textures that may be absent.
    #[must_use]
    pub fn canonical_vertices(&self) -> Vec<u32> {
        // 0 and -0 are equal.
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

    /// Box around each triangle in the shape's own axes, wide enough for rays that are rounded there.
    #[must_use]
    pub fn triangle_boxes(&self) -> Vec<Aabb> {
        let of_triangle = |corners: &[u32]| {
            let mut bounds = Aabb::EMPTY;
            let corners = corners.iter().filter_map(|&corner| self.vertices.get(corner as usize));
            corners.for_each(|vertex| bounds.include(DVec3::from_array(vertex.position_m.map(f64::from))));
            let hair = 1e-9 * bounds.min.abs().max(bounds.max.abs()).max_element();
            Aabb { min: bounds.min - hair, max: bounds.max + hair }
        };
        self.indices.chunks_exact(3).map(of_triangle).collect()
    }

    /// Bounding box of the vertices in the shape's own axes.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        self.vertices
            .iter()
            .for_each(|vertex| bounds.include(DVec3::from_array(vertex.position_m.map(f64::from))));
        bounds
    }
}

/// Appearance of a surface.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its texture.
    pub texture: Arc<Texture>,
    /// Wrap mode across and down.
    pub wrap: [Wrap; 2],
    /// Whether magnified texels have sharp borders (nearest filter).
    pub nearest: bool,
    /// Emitted light added to the texture's, linear.
    pub emissive: [f32; 3],
    /// Alpha cut-off: there is no surface where the alpha of texture times tint is below it, by the
    /// full-resolution texture, bilinear.
    pub cutoff: Option<f32>,
    /// Whether the colour is blended with what is behind by alpha. The cut-off then decides where the surface
    /// has depth.
    pub blends: bool,
    /// Whether only the front face is visible, whose corners are anticlockwise.
    pub one_sided: bool,
}

impl Material {
    /// An opaque, two-sided texture.
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

    /// Whether it emits light above white.
    #[must_use]
    pub fn is_above_white(&self) -> bool {
        self.emissive.iter().any(|&light| light > 1.0)
    }

    /// Whether two materials share their texture and are otherwise equal.
    pub fn is_same_as(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.texture, &other.texture)
            && (self.wrap, self.nearest, self.cutoff, self.one_sided)
                == (other.wrap, other.nearest, other.cutoff, other.one_sided)
            && (self.emissive, self.blends) == (other.emissive, other.blends)
    }

    /// Alpha at texture coordinates in f64, which the cut-off is compared with after multiplication by the
    /// tint.
    pub fn alpha_at(&self, uv: [f64; 2]) -> f64 {
        self.texture.alpha_at(uv, self.wrap, self.nearest)
    }
}

/// How far a repeated image reaches from its centre, metres: from a height of 1 km to a third of a degree below the
/// horizon.
const REPEATED_REACH_M: f64 = 2e5;

/// Growth of the cells of a repeated image: each is this fraction of its distance from the centre.
const REPEATED_GROWTH: f64 = 0.5;

/// Largest number of copies of a repeated image from its centre: 32-bit numbers hold whole ones.
const MOST_COPIES: f64 = 8e6;

/// Borders of the cells of a repeated image of a given side, in whole copies, from the middle one's, 0 and 1, to both
/// sides.
fn cell_borders(side_m: f64) -> Vec<f64> {
    let reach = (REPEATED_REACH_M / side_m).ceil().clamp(1.0, MOST_COPIES);
    let mut outwards = vec![0.0];
    let mut at = 0.0;
    while at < reach {
        at = (at + (at * REPEATED_GROWTH).floor().max(1.0)).min(reach);
        outwards.push(at);
    }
    let before = outwards.iter().rev().map(|copies| -copies);
    before.chain(outwards.iter().map(|copies| 1.0 + copies)).collect()
}

/// A placed shape with a material.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// The triangles.
    pub shape: Arc<Shape>,
    /// The appearance.
    pub material: Material,
    /// NED position of the shape's origin, metres.
    pub origin_ned_m: DVec3,
    /// Matrix from the shape's axes to north-east-down; it may rotate, scale and mirror. Front faces are
    /// anticlockwise in the world, so those of a mirrored shape are clockwise in its own axes.
    pub ned_from_shape: DMat3,
    /// Number of the object that it belongs to ([`super::Scene::objects`]), counted from 1; 0 = none.
    pub object: u32,
    /// How it moves; `None` if it stands still. The placement above is that of path time 0.
    pub motion: Option<Arc<RigidMotion>>,
}

impl Mesh {
    /// A mesh whose vertices are in north-east-down from `origin_ned_m`, with three `indices` per triangle.
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
            object: 0,
            motion: None,
        }
    }

    /// Its motion at path time `t_s`.
    #[must_use]
    pub fn motion_at(&self, t_s: f64) -> RigidState {
        self.motion.as_ref().map_or(RigidState::STILL, |motion| motion.state(t_s))
    }

    /// The mesh as it stands at path time `t_s`, without its motion.
    #[must_use]
    pub fn at(&self, t_s: f64) -> Self {
        let Some(motion) = &self.motion else { return self.clone() };
        let state = motion.state(t_s);
        Self {
            origin_ned_m: state.point(self.origin_ned_m),
            ned_from_shape: DMat3::from_quat(state.rotation) * self.ned_from_shape,
            motion: None,
            ..self.clone()
        }
    }

    /// Whether it moves together with another mesh, or both stand still.
    #[must_use]
    pub fn moves_with(&self, other: &Self) -> bool {
        match (&self.motion, &other.motion) {
            (None, None) => true,
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// A box that holds it from path time `from_s` to `to_s`, NED.
    #[must_use]
    pub fn bounds_between(&self, from_s: f64, to_s: f64) -> Aabb {
        let bounds = self.bounds();
        self.motion.as_ref().map_or(bounds, |motion| motion.bounds(&bounds, from_s, to_s))
    }

    /// A level image on the ground, with its top to the north and its left to the west. `width_m` is its
    /// width; the height follows from square pixels. `centre_ned_m` is its centre.
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

    /// As [`Mesh::level_picture`], but the image repeats in both directions, 200 km far. Its cells
    /// grow with their distance from the centre; each has texture coordinates of its own near 0, so that 32-bit
    /// numbers place the image as well in the distance as nearby.
    pub fn repeated_picture(texture: Arc<Texture>, centre_ned_m: DVec3, width_m: f64) -> Self {
        let [width_px, height_px] = texture.size_px.map(f64::from);
        let height_m = width_m * height_px / width_px;
        // Borders of cells in copies of the image, of which the middle one has 0 and 1.
        let [across, down] = [width_m, height_m].map(cell_borders);
        let mut vertices = Vec::new();
        let mut indices = Vec::new();
        for rows in down.windows(2) {
            for columns in across.windows(2) {
                let first = vertices.len() as u32;
                for (v, u) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let (row, column) = (rows[v], columns[u]);
                    let north = (height_m * (0.5 - row)) as f32;
                    let east = (width_m * (column - 0.5)) as f32;
                    let uv = [(column - columns[0]) as f32, (row - rows[0]) as f32];
                    vertices.push(MeshVertex::new([north, east, 0.0], uv));
                }
                indices.extend([0, 3, 1, 0, 2, 3].map(|corner| first + corner));
            }
        }
        Self::new(vertices, indices, texture, centre_ned_m, Wrap::Repeat)
    }

    /// First intersection with `origin + t direction`, 0 <= t <= `t_max`, from either side: t and the texture
    /// coordinates. Tests every triangle, and ignores facing and holes.
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

    /// Meets a packet of rays: what each meets first, if that is nearer than what it has met before. The mesh
    /// stands where it is at path time 0; `triangles` is the tree of its shape's, `surface` its number.
    pub fn meet_packet(&self, packet: &mut RayPacket, triangles: &RayBvh, surface: u32) {
        let faces = match (self.material.cutoff, self.material.one_sided) {
            (Some(_), _) => Faces::Holed,
            (None, true) => Faces::Front,
            (None, false) => Faces::Both,
        };
        let of = PacketSurface { surface, triangle: None, faces };
        triangles.meet_packet(packet, (self.ned_from_shape, self.origin_ned_m), &mut |triangle, packet| {
            crate::simd::with_widest(
                #[inline(always)]
                || self.meet_triangle(packet, triangle, of),
            );
        });
    }

    #[inline(always)]
    fn meet_triangle(&self, packet: &mut RayPacket, triangle: u32, of: PacketSurface) {
        let corners = self.shape.triangle(triangle);
        let points = corners.map(|corner| self.position_ned_m(corner));
        let (packet_from_ned, origin_ned_m) = packet.axes();
        packet.meet(points.map(|point| packet_from_ned * (point - origin_ned_m)), of, |ray, limit| {
            let (t, weights) = intersect_triangle(points, ray.origin_ned_m, ray.direction_ned, limit)?;
            self.is_visible(corners, weights, ray.direction_ned).then_some(t)
        });
        packet.find_farthest();
    }

    /// Bounding box in NED (at path time 0); for a rotated shape, that of the rotated box.
    pub fn bounds(&self) -> Aabb {
        self.shape.bounds().turned(self.ned_from_shape, self.origin_ned_m)
    }

    /// NED position of a vertex, metres.
    pub fn position_ned_m(&self, vertex: u32) -> DVec3 {
        self.origin_ned_m
            + self.ned_from_shape
                * glam::Vec3::from(self.shape.vertices[vertex as usize].position_m).as_dvec3()
    }

    /// Whether a ray along `direction_ned` that hits a triangle of the shape is stopped there: by the visible
    /// side and outside of holes.
    pub fn is_visible(&self, corners: [u32; 3], weights: [f64; 3], direction_ned: DVec3) -> bool {
        self.is_facing(corners, direction_ned)
            && self.material.cutoff.is_none_or(|cutoff| self.alpha_at(corners, weights) >= f64::from(cutoff))
    }

    /// Whether a triangle is visible from a direction.
    pub fn is_facing(&self, corners: [u32; 3], direction_ned: DVec3) -> bool {
        let [a, b, c] = corners.map(|v| self.position_ned_m(v));
        !self.material.one_sided || (b - a).cross(c - a).dot(direction_ned) < 0.0
    }

    /// Interpolated alpha in a triangle.
    pub fn alpha_at(&self, corners: [u32; 3], weights: [f64; 3]) -> f64 {
        self.material.alpha_at(self.uv_at(corners, weights)) * self.tint_at(corners, weights)[3]
    }

    /// Interpolated texture coordinates in a triangle.
    pub fn uv_at(&self, corners: [u32; 3], weights: [f64; 3]) -> [f64; 2] {
        let uv = corners.map(|v| self.shape.vertices[v as usize].uv);
        [0, 1].map(|axis: usize| (0..3).map(|k| weights[k] * f64::from(uv[k][axis])).sum())
    }

    /// Interpolated tint in a triangle.
    pub fn tint_at(&self, corners: [u32; 3], weights: [f64; 3]) -> [f64; 4] {
        let tint = corners.map(|v| self.shape.vertices[v as usize].tint);
        [0, 1, 2, 3].map(|channel: usize| (0..3).map(|k| weights[k] * f64::from(tint[k][channel])).sum())
    }

    /// Interpolated light factor in a triangle on the side seen along a direction; 1 without normals.
    pub fn light_at(&self, light: &Light, corners: [u32; 3], weights: [f64; 3], direction_ned: DVec3) -> f64 {
        let [of_sun, of_sky] = self.light_parts_at(light, corners, weights, direction_ned);
        (of_sun + of_sky).clamp(0.0, 1.0)
    }

    /// The parts of [`Mesh::light_at`] that are the sun's and the sky's; 0 and 1 without normals.
    pub fn light_parts_at(
        &self,
        light: &Light,
        corners: [u32; 3],
        weights: [f64; 3],
        direction_ned: DVec3,
    ) -> [f64; 2] {
        if !self.shape.has_normals() {
            return [0.0, 1.0];
        }
        let outward: DVec3 = (0..3).map(|k| weights[k] * self.normal_ned(corners[k])).sum();
        let [a, b, c] = corners.map(|v| self.position_ned_m(v));
        let is_front = (b - a).cross(c - a).dot(direction_ned) < 0.0;
        light.parts(if is_front { outward } else { -outward })
    }

    /// World normal of a vertex.
    fn normal_ned(&self, vertex: u32) -> DVec3 {
        transformed_normal(
            &self.ned_from_shape,
            glam::Vec3::from(self.shape.normals[vertex as usize]).as_dvec3(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Encoding;

    #[test]
    fn level_picture_has_top_to_the_north_and_left_to_the_west() {
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
        // Both triangles have the same orientation and cover the rectangle.
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
    fn repeated_picture_has_the_same_image_everywhere() {
        let texture = Arc::new(Texture { size_px: [4, 2], rgba8: vec![255; 32], encoding: Encoding::Srgb });
        let centre = DVec3::new(100.0, -50.0, 3.0);
        let one = Mesh::level_picture(texture.clone(), centre, 40.0);
        let many = Mesh::repeated_picture(texture, centre, 40.0);
        let uv = |mesh: &Mesh, north: f64, east: f64| {
            let from = centre + DVec3::new(north, east, -10.0);
            mesh.intersect(from, DVec3::Z, 20.0).expect("hit").1
        };
        // Copies are 20 m high and 40 m wide; 32-bit numbers hold 200 km to 8 mm.
        for [rows, columns] in [[0.0, 0.0], [1.0, -1.0], [-7.0, 3.0], [1000.0, -77.0], [9999.0, 4999.0]] {
            for [north, east] in [[3.0, -11.0], [-9.0, 19.0]] {
                let [u, v] = uv(&one, north, east);
                let [far_u, far_v] = uv(&many, north + 20.0 * rows, east + 40.0 * columns);
                let off = [far_u - u, far_v - v].map(|by| (by - by.round()).abs());
                assert!(off.iter().all(|by| *by < 1e-3), "{rows} {columns}: {off:?}");
            }
        }
        let reach = many.bounds().max - centre;
        assert!(reach.x >= REPEATED_REACH_M && reach.y >= REPEATED_REACH_M, "{reach}");
    }

    #[test]
    fn rotated_shape_is_within_its_bounds_and_one_sided() {
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
            [DVec3::Z, -DVec3::Z].map(|direction| mesh.is_visible(triangle, weights, direction))
        };
        assert_eq!(sees(&mesh, [0.2, 0.3, 0.5]), [true, true]);
        mesh.material.one_sided = true;
        let one = sees(&mesh, [0.2, 0.3, 0.5]);
        assert!(one[0] != one[1], "{one:?}");
        // Corners 0, 3, 1: uv (0, 0), (1, 1), (1, 0). The left half is transparent.
        mesh.material = Material { one_sided: false, cutoff: Some(0.5), ..mesh.material };
        assert_eq!(
            [sees(&mesh, [0.9, 0.05, 0.05]), sees(&mesh, [0.1, 0.5, 0.4])],
            [[false, false], [true, true]]
        );
    }
}
