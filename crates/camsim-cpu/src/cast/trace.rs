//! Rays against the surfaces of a scene at full detail.

use std::{cell::RefCell, collections::HashMap, sync::Arc};

use camsim_core::scene::{
    Aabb, Mesh, Scene, Shape, Terrain, TerrainHit, ray_bvh::RayBvh, terrain::intersect_triangle,
};
use glam::{DMat3, DVec3};

use super::moving::PosedMesh;

/// Two hits of blended triangles of one mesh are one where they share an edge: difference of their ray
/// parameters, relative, and barycentric weight of the corner beside that edge.
const SAME_EDGE: f64 = 1e-9;

/// A ray parameter before everything, which ends a search.
const NO_MORE: f64 = -1.0;

/// Trees of boxes over a scene's meshes and over the triangles of their shapes.
#[derive(Debug)]
pub(super) struct SceneTrees {
    meshes: RayBvh,
    /// By mesh; meshes of one shape share its tree.
    shapes: Vec<Arc<RayBvh>>,
    /// By mesh.
    shape_from_ned: Vec<DMat3>,
}

/// A ray; its parameter has the unit of the direction's length.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneRay {
    pub origin_ned_m: DVec3,
    pub direction_ned: DVec3,
}

/// A triangle of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Triangle {
    /// 0 = terrain, 1 + i = mesh i.
    pub surface: u32,
    /// Chunk of the terrain.
    pub chunk: u32,
    /// Vertices of the terrain or of the mesh's shape.
    pub corners: [u32; 3],
}

/// Where a ray meets a triangle of a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshHit {
    pub t: f64,
    pub mesh: u32,
    pub corners: [u32; 3],
    pub weights: [f64; 3],
}

/// Where a ray meets the first surface that hides everything behind it.
#[derive(Clone, Copy, Debug)]
pub(super) enum OpaqueHit {
    Terrain(TerrainHit),
    Mesh(MeshHit),
}

/// What a ray meets.
#[derive(Clone, Debug, Default)]
pub(super) struct Hits {
    /// Blended surfaces, the nearest first, all of them before the opaque one.
    pub blended: Vec<MeshHit>,
    /// `None` is sky.
    pub opaque: Option<OpaqueHit>,
}

impl OpaqueHit {
    pub fn t(&self) -> f64 {
        match self {
            Self::Terrain(hit) => hit.t,
            Self::Mesh(hit) => hit.t,
        }
    }
}

impl MeshHit {
    pub fn triangle(&self) -> Triangle {
        Triangle { surface: 1 + self.mesh, chunk: 0, corners: self.corners }
    }
}

impl SceneTrees {
    pub fn new(scene: &Scene) -> Self {
        let mut known: HashMap<*const Shape, Arc<RayBvh>> = HashMap::new();
        // What moves is met where it is at the instant of the ray.
        let still = |(bounds, mesh): (Aabb, &Mesh)| if mesh.motion.is_some() { Aabb::EMPTY } else { bounds };
        let bounds: Vec<Aabb> = scene.mesh_bounds().into_iter().zip(&scene.meshes).map(still).collect();
        let mut tree = |mesh: &Mesh| {
            let shape = &mesh.shape;
            known
                .entry(Arc::as_ptr(shape))
                .or_insert_with(|| Arc::new(RayBvh::new(&shape.triangle_boxes())))
                .clone()
        };
        Self {
            meshes: RayBvh::new(&bounds),
            shapes: scene.meshes.iter().map(&mut tree).collect(),
            shape_from_ned: scene.meshes.iter().map(|mesh| mesh.ned_from_shape.inverse()).collect(),
        }
    }

    /// Everything that a ray meets from `t_min` on up to the first opaque surface. Meshes of `posed` are where
    /// they are there, and not in the scene.
    pub fn trace(&self, scene: &Scene, posed: &[PosedMesh], ray: &SceneRay, t_min: f64, hits: &mut Hits) {
        let origin_ned_m = ray.origin_ned_m + t_min * ray.direction_ned;
        let ray = SceneRay { origin_ned_m, direction_ned: ray.direction_ned };
        let terrain = scene.terrain.as_ref();
        let ground =
            terrain.and_then(|terrain| terrain.intersect(origin_ned_m, ray.direction_ned, f64::INFINITY));
        let mut limit = ground.map_or(f64::INFINITY, |hit| hit.t);
        hits.blended.clear();
        let blended = RefCell::new(&mut hits.blended);
        let mut first = self.meshes.first(origin_ned_m, ray.direction_ned, limit, |number, limit| {
            let (mesh, shape_from_ned) =
                (&scene.meshes[number as usize], &self.shape_from_ned[number as usize]);
            self.meet(number, mesh, shape_from_ned, &ray, limit, &blended)
        });
        for PosedMesh { number, mesh, shape_from_ned } in posed {
            limit = first.map_or(limit, |(t, _)| t);
            first = self.meet(*number, mesh, shape_from_ned, &ray, limit, &blended).or(first);
        }
        let ground = ground.map(|hit| OpaqueHit::Terrain(TerrainHit { t: hit.t + t_min, ..hit }));
        let mesh = first.map(|(_, hit)| OpaqueHit::Mesh(MeshHit { t: hit.t + t_min, ..hit }));
        hits.opaque = mesh.or(ground);
        hits.blended.iter_mut().for_each(|hit| hit.t += t_min);
        hits.sort();
    }

    /// First opaque triangle of a model from `t_min` on, before `limit`, in a scene without blended surfaces.
    pub fn first_model(
        &self,
        scene: &Scene,
        ray: &SceneRay,
        t_min: f64,
        limit: f64,
    ) -> Option<(f64, Triangle)> {
        let origin_ned_m = ray.origin_ned_m + t_min * ray.direction_ned;
        let ray = SceneRay { origin_ned_m, direction_ned: ray.direction_ned };
        let mut no_layers = Vec::new();
        let blended = RefCell::new(&mut no_layers);
        let meet = |number: u32, limit: f64| {
            let (mesh, shape_from_ned) =
                (&scene.meshes[number as usize], &self.shape_from_ned[number as usize]);
            self.meet(number, mesh, shape_from_ned, &ray, limit, &blended)
        };
        let hit = self.meshes.first(origin_ned_m, ray.direction_ned, limit - t_min, meet);
        hit.map(|(t, hit)| (t + t_min, hit.triangle()))
    }

    /// Ray parameter where a ray meets a triangle of a model.
    pub fn meet_triangle(&self, scene: &Scene, triangle: &Triangle, ray: &SceneRay) -> Option<f64> {
        let mesh = &scene.meshes[triangle.surface.checked_sub(1)? as usize];
        let points = triangle.corners.map(|corner| mesh.position_ned_m(corner));
        intersect_triangle(points, ray.origin_ned_m, ray.direction_ned, f64::INFINITY).map(|(t, _)| t)
    }

    /// Whether the box of a model that stands still is accepted, as are those around it.
    pub fn any_model(&self, accept: impl Fn(&Aabb) -> bool) -> bool {
        !self.meshes.items_in(accept).is_empty()
    }

    /// Whether a ray meets a model that has depth, whichever side of it. Meshes of `posed` are where they are
    /// there, and not in the scene.
    pub fn is_blocked(&self, scene: &Scene, posed: &[PosedMesh], ray: &SceneRay) -> bool {
        let stands = |number: u32, _| {
            let mesh = &scene.meshes[number as usize];
            let is_met = self.is_blocked_by(number, mesh, &self.shape_from_ned[number as usize], ray);
            is_met.then_some((NO_MORE, ()))
        };
        self.meshes.first(ray.origin_ned_m, ray.direction_ned, f64::INFINITY, stands).is_some()
            || posed
                .iter()
                .any(|posed| self.is_blocked_by(posed.number, &posed.mesh, &posed.shape_from_ned, ray))
    }

    fn is_blocked_by(&self, number: u32, mesh: &Mesh, shape_from_ned: &DMat3, ray: &SceneRay) -> bool {
        let SceneRay { origin_ned_m, direction_ned } = *ray;
        let origin = *shape_from_ned * (origin_ned_m - mesh.origin_ned_m);
        let direction = *shape_from_ned * direction_ned;
        let meet = |triangle: u32, limit: f64| {
            let corners = mesh.shape.triangle(triangle);
            let points = corners.map(|corner| mesh.position_ned_m(corner));
            let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
            has_depth(mesh, &MeshHit { t, mesh: number, corners, weights }).then_some((NO_MORE, ()))
        };
        self.shapes[number as usize].first(origin, direction, f64::INFINITY, meet).is_some()
    }

    /// First opaque hit of a mesh before `limit`. Boxes are met in the shape's own axes, triangles where they
    /// stand; blended ones are added to `blended`.
    fn meet(
        &self,
        number: u32,
        mesh: &Mesh,
        shape_from_ned: &DMat3,
        ray: &SceneRay,
        limit: f64,
        blended: &RefCell<&mut Vec<MeshHit>>,
    ) -> Option<(f64, MeshHit)> {
        let SceneRay { origin_ned_m, direction_ned } = *ray;
        let origin = *shape_from_ned * (origin_ned_m - mesh.origin_ned_m);
        let direction = *shape_from_ned * direction_ned;
        self.shapes[number as usize].first(origin, direction, limit, |triangle, limit| {
            let first = 3 * triangle as usize;
            let corners = [0, 1, 2].map(|k| mesh.shape.indices[first + k]);
            let points = corners.map(|corner| mesh.position_ned_m(corner));
            let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
            let [a, b, c] = points;
            if mesh.material.one_sided && (b - a).cross(c - a).dot(direction_ned) >= 0.0 {
                return None;
            }
            let hit = MeshHit { t, mesh: number, corners, weights };
            if mesh.material.blends {
                blended.borrow_mut().push(hit);
                return None;
            }
            has_depth(mesh, &hit).then_some((t, hit))
        })
    }
}

impl Hits {
    /// Blended hits in order, without those behind the opaque one, each edge between two triangles once.
    fn sort(&mut self) {
        let limit = self.opaque.map_or(f64::INFINITY, |hit| hit.t());
        self.blended.retain(|hit| hit.t < limit);
        self.blended.sort_unstable_by(|a, b| {
            a.t.total_cmp(&b.t).then(a.mesh.cmp(&b.mesh)).then(a.corners.cmp(&b.corners))
        });
        let is_on_edge = |hit: &MeshHit| hit.weights.iter().any(|weight| weight.abs() < SAME_EDGE);
        self.blended.dedup_by(|next, kept| {
            next.mesh == kept.mesh
                && next.t - kept.t <= SAME_EDGE * kept.t
                && is_on_edge(next)
                && is_on_edge(kept)
        });
    }

    /// Ray parameter of the surface that the depth image shows: the first that is opaque, or blended with an
    /// alpha that reaches its cutoff.
    pub fn depth(&self, scene: &Scene) -> Option<f64> {
        let blended = self.blended.iter().find(|hit| has_depth(&scene.meshes[hit.mesh as usize], hit));
        blended.map(|hit| hit.t).or(self.opaque.map(|hit| hit.t()))
    }
}

/// Whether alpha of the full-size picture reaches a mesh's cutoff.
fn has_depth(mesh: &Mesh, hit: &MeshHit) -> bool {
    let reaches = |cutoff: f32| mesh.alpha_at(hit.corners, hit.weights) >= f64::from(cutoff);
    mesh.material.cutoff.is_none_or(reaches)
}

/// The triangle of the terrain that a ray has met.
pub(super) fn terrain_triangle(terrain: &Terrain, hit: &TerrainHit, ray: &SceneRay) -> Triangle {
    let chunk = &terrain.chunks[hit.chunk as usize];
    let vertex = |[right, down]: [u32; 2]| {
        chunk.first_vertex + (hit.cell[1] + down) * (chunk.cells[0] + 1) + hit.cell[0] + right
    };
    let triangles = [[[0, 0], [1, 1], [1, 0]], [[0, 0], [0, 1], [1, 1]]];
    let triangles =
        triangles.map(|corners| Triangle { surface: 0, chunk: hit.chunk, corners: corners.map(vertex) });
    let distance = |triangle: &Triangle| {
        let points = triangle.corners.map(|corner| terrain_position(terrain, hit.chunk, corner));
        let met = intersect_triangle(points, ray.origin_ned_m, ray.direction_ned, f64::INFINITY);
        met.map_or(f64::INFINITY, |(t, _)| (t - hit.t).abs())
    };
    if distance(&triangles[1]) < distance(&triangles[0]) { triangles[1] } else { triangles[0] }
}

/// NED position of a vertex of a chunk, metres.
pub(super) fn terrain_position(terrain: &Terrain, chunk: u32, vertex: u32) -> DVec3 {
    let offset_m = terrain.vertices[vertex as usize].offset_m;
    terrain.chunks[chunk as usize].centre_ned_m + DVec3::from_array(offset_m.map(f64::from))
}
