//! Ray casting against meshes: a bounding volume hierarchy (BVH) over all triangles.

use std::sync::Arc;

use glam::DVec3;

use super::{
    Hit,
    ray::{Bounds, Ray, intersect_triangle},
    shading::SurfaceTexture,
};
use crate::scene::{Light, Mesh, Shape};

/// Most triangles of a leaf.
const LEAF: usize = 4;
/// Size of the traversal stack: the depth of the tree is at most log2 of the number of triangles.
const STACK: usize = 64;
/// Relative distance within which two hits at a shared edge count as one: rounding.
const SAME_DEPTH: f64 = 1e-12;

#[derive(Clone, Copy, Debug)]
struct MeshTriangle {
    corners: [DVec3; 3],
    /// 1 + index of the mesh.
    surface: u32,
    /// Index of the first corner in the mesh's index list.
    first: u32,
}

/// Properties of a mesh that its triangles share.
#[derive(Debug)]
struct MeshSurface {
    shape: Arc<Shape>,
    one_sided: bool,
    /// Texture and alpha cut-off of a mesh with holes.
    holes: Option<(SurfaceTexture, f64)>,
    /// Whether the mesh is blended with what is behind it.
    blends: bool,
    /// World normals of the shape's vertices; empty if the mesh is not lit.
    normals: Vec<DVec3>,
}

/// Intersection of a ray with a blended surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlendLayer {
    pub hit: Hit,
    pub alpha: f64,
    /// The ray passes exactly between two triangles.
    on_edge: bool,
}

#[derive(Clone, Copy, Debug)]
struct MeshBvhNode {
    bounds: Bounds,
    /// Of a leaf the first triangle, else the second child. The first child follows its parent.
    next: u32,
    /// Number of triangles of a leaf, else 0.
    count: u32,
}

/// Meshes of a scene that stand still relative to each other.
#[derive(Debug, Default)]
pub(super) struct MeshBvh {
    triangles: Vec<MeshTriangle>,
    nodes: Vec<MeshBvhNode>,
    /// Properties by mesh.
    mesh_surfaces: Vec<MeshSurface>,
    light: Option<Light>,
}

impl MeshBvh {
    /// The meshes of a scene that `belongs` chooses.
    pub(super) fn new(meshes: &[Mesh], light: Option<Light>, belongs: impl Fn(&Mesh) -> bool) -> Self {
        let mut triangles = Vec::new();
        for (surface, mesh) in (1..).zip(meshes).filter(|(_, mesh)| belongs(mesh)) {
            let Shape { vertices, indices, .. } = &*mesh.shape;
            for (first, indices) in (0..).step_by(3).zip(indices.chunks_exact(3)) {
                let indices = [indices[0], indices[1], indices[2]];
                if indices.iter().any(|&corner| corner as usize >= vertices.len()) {
                    continue;
                }
                let corners = indices.map(|corner| {
                    let [x, y, z] = vertices[corner as usize].position_m.map(f64::from);
                    mesh.origin_ned_m + mesh.ned_from_shape * DVec3::new(x, y, z)
                });
                if corners.iter().all(|corner| corner.is_finite()) {
                    triangles.push(MeshTriangle { corners, surface, first });
                }
            }
        }
        // Of the others too, as surfaces are counted over all.
        let cover = |mesh: &Mesh| MeshSurface {
            shape: mesh.shape.clone(),
            one_sided: mesh.material.one_sided,
            holes: (belongs(mesh) && has_alpha(mesh)).then(|| {
                (SurfaceTexture::new(&mesh.material), f64::from(mesh.material.cutoff.unwrap_or(0.0)))
            }),
            blends: mesh.material.blends,
            normals: if light.is_some() && belongs(mesh) { standing_normals(mesh) } else { Vec::new() },
        };
        let mesh_surfaces = meshes.iter().map(cover).collect();
        let mut nodes = Vec::new();
        if !triangles.is_empty() {
            build(&mut triangles, 0, &mut nodes);
        }
        Self { triangles, nodes, mesh_surfaces, light }
    }

    /// First intersection before `limit`.
    pub(super) fn first(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        self.first_of(ray, limit, |_| true)
    }

    /// First intersection with an opaque surface before `limit`.
    pub(super) fn first_solid(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        self.first_of(ray, limit, |cover| !cover.blends)
    }

    fn first_of(&self, ray: &Ray, limit: f64, counts: impl Fn(&MeshSurface) -> bool) -> Option<Hit> {
        let mut best = None;
        self.walk(ray, limit, |triangle, limit| {
            let cover = self.cover(triangle);
            let (t, weights) = intersect_triangle(triangle.corners.map(|corner| ray.shear(corner)), limit)
                .filter(|_| counts(cover))?;
            let (hit, alpha) = self.hit(ray, triangle, t, weights)?;
            if cover.holes.as_ref().is_some_and(|(_, cutoff)| alpha < *cutoff) {
                return None;
            }
            best = Some(hit);
            Some(t)
        });
        best
    }

    /// All intersections with blended surfaces before `limit`, in no particular order.
    pub(super) fn layers(&self, ray: &Ray, limit: f64) -> Vec<BlendLayer> {
        let mut layers: Vec<BlendLayer> = Vec::new();
        self.walk(ray, limit, |triangle, limit| {
            if self.cover(triangle).blends {
                let (t, weights) =
                    intersect_triangle(triangle.corners.map(|corner| ray.shear(corner)), limit)?;
                let (hit, alpha) = self.hit(ray, triangle, t, weights)?;
                // Two triangles with a common edge are one surface there.
                let on_edge = weights.contains(&0.0);
                let again = |layer: &BlendLayer| {
                    on_edge
                        && layer.on_edge
                        && layer.hit.surface == hit.surface
                        && (layer.hit.depth_m - t).abs() <= SAME_DEPTH * t
                };
                if !layers.iter().any(again) {
                    layers.push(BlendLayer { hit, alpha, on_edge });
                }
            }
            None
        });
        layers
    }

    fn cover(&self, triangle: &MeshTriangle) -> &MeshSurface {
        &self.mesh_surfaces[triangle.surface as usize - 1]
    }

    /// Visits all triangles that the ray may hit before a limit. `meet` may return a nearer limit.
    fn walk(&self, ray: &Ray, mut limit: f64, mut meet: impl FnMut(&MeshTriangle, f64) -> Option<f64>) {
        let mut stack = [(0.0_f64, 0_u32); STACK];
        let mut waiting = 0;
        let Some(root) = self.nodes.first() else { return };
        let mut current = ray.enter_box(root.bounds.low, root.bounds.high, limit).map(|_| 0_u32);
        loop {
            let Some(index) = current.take() else {
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                let (enter, index) = stack[waiting];
                current = (enter < limit).then_some(index);
                continue;
            };
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for triangle in &self.triangles[node.next as usize..(node.next + node.count) as usize] {
                    limit = meet(triangle, limit).unwrap_or(limit);
                }
                continue;
            }
            let enter = |child: u32| {
                let bounds = &self.nodes[child as usize].bounds;
                ray.enter_box(bounds.low, bounds.high, limit).map(|t| (t, child))
            };
            current = match (enter(index + 1), enter(node.next)) {
                (Some(a), Some(b)) => {
                    let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
                    if waiting < STACK {
                        stack[waiting] = far;
                        waiting += 1;
                    }
                    Some(near.1)
                }
                (a, b) => a.or(b).map(|(_, child)| child),
            };
        }
    }
}

impl MeshBvh {
    /// The hit and its alpha; `None` for a ray from behind a one-sided surface.
    fn hit(&self, ray: &Ray, triangle: &MeshTriangle, t: f64, weights: [f64; 3]) -> Option<(Hit, f64)> {
        let cover = self.cover(triangle);
        let [a, b, c] = triangle.corners;
        if cover.one_sided && (b - a).cross(c - a).dot(ray.direction) >= 0.0 {
            return None;
        }
        let (uv, [red, green, blue, alpha]) = values_at(cover, triangle, weights);
        let hit = hit_at(ray, t, uv, triangle.corners, triangle.surface);
        let alpha = cover.holes.as_ref().map_or(1.0, |(coat, _)| coat.alpha_at(hit.texture_uv) * alpha);
        let [of_sun, of_sky] =
            self.light.map_or([0.0, 1.0], |light| lit(&light, cover, triangle, weights, ray));
        let lit = of_sun + of_sky;
        let sky_fraction = if of_sun > 0.0 { of_sky / lit } else { 1.0 };
        Some((Hit { tint: [red, green, blue].map(|part| part * lit), sky_fraction, ..hit }, alpha))
    }

    /// Whether a ray meets a surface that has depth, of either side.
    pub(super) fn blocks(&self, ray: &Ray) -> bool {
        let mut is_met = false;
        self.walk(ray, f64::INFINITY, |triangle, limit| {
            let (t, weights) = intersect_triangle(triangle.corners.map(|corner| ray.shear(corner)), limit)?;
            let cover = self.cover(triangle);
            let stops = |(coat, cutoff): &(SurfaceTexture, f64)| {
                let (uv, tint) = values_at(cover, triangle, weights);
                coat.alpha_at(uv) * tint[3] >= *cutoff
            };
            is_met |= t > 0.0 && cover.holes.as_ref().is_none_or(stops);
            // Nothing is nearer than this.
            is_met.then_some(f64::NEG_INFINITY)
        });
        is_met
    }
}

/// Texture coordinates and tint at a point of a triangle.
fn values_at(cover: &MeshSurface, triangle: &MeshTriangle, weights: [f64; 3]) -> ([f64; 2], [f64; 4]) {
    let vertices =
        [0, 1, 2].map(|k| &cover.shape.vertices[cover.shape.indices[triangle.first as usize + k] as usize]);
    let tint = [0, 1, 2, 3]
        .map(|k: usize| (0..3).map(|corner| weights[corner] * f64::from(vertices[corner].tint[k])).sum());
    let uv =
        [0, 1].map(|k: usize| (0..3).map(|corner| weights[corner] * f64::from(vertices[corner].uv[k])).sum());
    (uv, tint)
}

fn has_alpha(mesh: &Mesh) -> bool {
    mesh.material.blends || mesh.material.cutoff.is_some()
}

/// Factors of the light of sun and sky reflected at a point of a triangle towards the ray's origin (Lambert):
/// the sun by the cosine of its angle, the sky by the fraction of it that the surface faces.
fn lit(
    light: &Light,
    cover: &MeshSurface,
    triangle: &MeshTriangle,
    weights: [f64; 3],
    ray: &Ray,
) -> [f64; 2] {
    if cover.normals.is_empty() {
        return [0.0, 1.0];
    }
    let [a, b, c] = triangle.corners;
    let from_behind = (b - a).cross(c - a).dot(ray.direction) >= 0.0;
    let corner =
        |k: usize| weights[k] * cover.normals[cover.shape.indices[triangle.first as usize + k] as usize];
    let normal = (corner(0) + corner(1) + corner(2)) * if from_behind { -1.0 } else { 1.0 };
    let normal = ray.ned_from_ray.map_or(normal, |turn| turn * normal);
    let of_sun = light.to_sun_ned.dot(normal).max(0.0);
    let of_sky = 0.5 + 0.5 * -normal.z;
    [light.sun * of_sun, light.sky * of_sky]
}

/// World normals of a shape's vertices: the cross product of two transformed tangents. (The other renderers
/// use cofactors.)
fn standing_normals(mesh: &Mesh) -> Vec<DVec3> {
    if mesh.shape.normals.len() != mesh.shape.vertices.len() {
        return Vec::new();
    }
    let mirrored = mesh.ned_from_shape.determinant() < 0.0;
    let standing = |normal: &[f32; 3]| {
        let normal = DVec3::from_array(normal.map(f64::from));
        let (along, across) = normal.normalize_or(DVec3::X).any_orthonormal_pair();
        let (along, across) = (mesh.ned_from_shape * along, mesh.ned_from_shape * across);
        let normal = if mirrored { across.cross(along) } else { along.cross(across) };
        if normal == DVec3::ZERO { normal } else { normal.normalize_or_zero() }
    };
    mesh.shape.normals.iter().map(standing).collect()
}

/// The hit of a ray on a triangle with these corners.
pub(super) fn hit_at(ray: &Ray, t: f64, texture_uv: [f64; 2], [a, b, c]: [DVec3; 3], surface: u32) -> Hit {
    let normal = (b - a).cross(c - b).normalize_or_zero();
    let normal_ned = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    Hit {
        point_ned_m: ray.origin + t * ray.direction,
        depth_m: t,
        texture_uv,
        tint: [1.0; 3],
        sky_fraction: 1.0,
        normal_ned,
        surface,
    }
}

/// Splits at the median triangle along the longest side of the box around the triangles' centres.
fn build(triangles: &mut [MeshTriangle], first: u32, nodes: &mut Vec<MeshBvhNode>) {
    let mut bounds = Bounds::NONE;
    let mut centres = Bounds::NONE;
    for triangle in triangles.iter() {
        triangle.corners.iter().for_each(|corner| bounds.include(*corner));
        centres.include(centre(triangle));
    }
    let here = nodes.len();
    nodes.push(MeshBvhNode { bounds: bounds.grown(), next: first, count: triangles.len() as u32 });
    if triangles.len() <= LEAF {
        return;
    }
    let size = centres.high - centres.low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    let (left, right) = triangles.split_at_mut(middle);
    build(left, first, nodes);
    nodes[here].next = nodes.len() as u32;
    nodes[here].count = 0;
    build(right, first + middle as u32, nodes);
}

fn centre(triangle: &MeshTriangle) -> DVec3 {
    (triangle.corners[0] + triangle.corners[1] + triangle.corners[2]) / 3.0
}
