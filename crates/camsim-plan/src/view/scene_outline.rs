//! Whether silhouettes can be in view: only then is the ideal frame supersampled and are pixels at
//! silhouettes solved sample by sample.
//!
//! A surface has a silhouette where it turns edge-on to the view, or where it ends. Both are bounded from
//! boxes and slopes that are found once a scene; the bounds err on the side of work.

mod patches;
#[cfg(test)]
mod tests;

use camsim_core::{
    pose::CameraPose,
    scene::{Aabb, Mesh, Scene, Shape, terrain::Frustum},
};
use glam::{DVec2, DVec3};

use crate::ir::margins;
use patches::{CHUNK_LEVEL, Patch, PatchTree};

/// A flat mesh with more corners than this is not examined any closer.
const MAX_FLAT_VERTICES: usize = 64;

/// Slopes and borders of a scene, found once.
#[derive(Debug, Default)]
pub(crate) struct SceneOutline {
    terrain: PatchTree,
    meshes: Vec<MeshOutline>,
}

#[derive(Clone, Copy, Debug)]
struct MeshOutline {
    bounds: Aabb,
    /// In one plane, and convex: it covers the view if it covers the view's corners.
    flat_convex: bool,
}

impl SceneOutline {
    pub(crate) fn new(scene: &Scene) -> Self {
        let terrain = scene.terrain.as_ref().map_or_else(PatchTree::default, PatchTree::new);
        let meshes = scene
            .meshes
            .iter()
            .map(|mesh| MeshOutline { bounds: mesh.bounds(), flat_convex: is_flat_convex(mesh) })
            .collect();
        Self { terrain, meshes }
    }

    /// Whether any mesh can be seen from within `travel_m` of `pose`.
    pub fn meshes_in_view(&self, pose: &CameraPose, tangents: [f64; 4], travel_m: f64) -> bool {
        let frustum = Frustum::new(pose, tangents);
        let grown = |bounds: &Aabb| Aabb { min: bounds.min - travel_m, max: bounds.max + travel_m };
        self.meshes.iter().any(|mesh| frustum.may_see(&grown(&mesh.bounds)))
    }

    /// `None` and the reason if no silhouette can be seen from within `travel_m` of `pose` through `tangents`
    /// (u_min, u_max, v_min, v_max).
    pub(crate) fn reason_for_none(
        &self,
        scene: &Scene,
        pose: &CameraPose,
        tangents: [f64; 4],
        travel_m: f64,
    ) -> Option<String> {
        let frustum = Frustum::new(pose, tangents);
        let terrain = self.terrain.any(CHUNK_LEVEL, &|patch| frustum.may_see(&patch.bounds));
        let mut meshes =
            self.meshes.iter().zip(&scene.meshes).filter(|(outline, _)| frustum.may_see(&outline.bounds));
        match (terrain, meshes.next(), meshes.next()) {
            (false, None, _) => Some("nothing but sky is in view".into()),
            (true, None, _) => {
                let edge = self.terrain.any(0, &|patch| may_end_or_turn(&frustum, patch, pose, travel_m));
                (!edge).then(|| "the terrain fills the view and no slope in it can be seen edge-on".into())
            }
            (false, Some((outline, mesh)), None) => (outline.flat_convex && covers(mesh, pose, tangents))
                .then(|| "one flat surface fills the view".into()),
            _ => None,
        }
    }
}

/// All triangles in one plane and turned the same way, and no corner outside of a border edge (one that a
/// single triangle has).
fn is_flat_convex(mesh: &Mesh) -> bool {
    let Shape { vertices, indices, .. } = &*mesh.shape;
    // What has holes, or is not there from behind, covers nothing for certain.
    let whole = mesh.material.cutoff.is_none() && !mesh.material.one_sided;
    if vertices.len() > MAX_FLAT_VERTICES || indices.len() < 3 || !whole {
        return false;
    }
    let position = |vertex: u32| mesh.position_ned_m(vertex);
    let mut normals = indices.chunks_exact(3).map(|t| {
        (position(t[1]) - position(t[0])).cross(position(t[2]) - position(t[0])).normalize_or_zero()
    });
    let Some(normal) = normals.next() else { return false };
    let reach = indices.iter().map(|&v| position(v).distance(position(indices[0]))).fold(0.0, f64::max);
    let flat = indices.iter().all(|&v| normal.dot(position(v) - position(indices[0])).abs() <= 1e-6 * reach);
    let turned_alike = normal != DVec3::ZERO && normals.all(|n| n.dot(normal) > 0.999);
    let edges: Vec<[u32; 2]> =
        indices.chunks_exact(3).flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
    let border = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
    let convex = |&[a, b]: &[u32; 2]| {
        let inward = normal.cross(position(b) - position(a)).normalize_or_zero();
        indices.iter().all(|&v| inward.dot(position(v) - position(a)) >= -1e-6 * reach)
    };
    flat && turned_alike && border.clone().count() >= 3 && { border }.all(convex)
}

/// Whether the rays of the view's four corners all meet the mesh.
fn covers(mesh: &Mesh, pose: &CameraPose, [u_min, u_max, v_min, v_max]: [f64; 4]) -> bool {
    [DVec2::new(u_min, v_min), DVec2::new(u_max, v_min), DVec2::new(u_min, v_max), DVec2::new(u_max, v_max)]
        .into_iter()
        .all(|uv| {
            mesh.intersect(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0), f64::INFINITY)
                .is_some()
        })
}

/// False only if the patch is out of sight, or continues beyond its borders and faces the camera everywhere:
/// a surface of slope s faces a ray that goes down by more than s for each metre ahead.
fn may_end_or_turn(frustum: &Frustum, patch: &Patch, pose: &CameraPose, travel_m: f64) -> bool {
    if !frustum.may_see(&patch.bounds) {
        return false;
    }
    let camera = pose.position_ned_m;
    let down_m = patch.bounds.min.z - camera.z - travel_m;
    let ahead = (patch.bounds.max - camera).abs().max((patch.bounds.min - camera).abs());
    let ahead_m = ahead.truncate().length() + travel_m;
    // False for a NaN, which so counts as a silhouette.
    let faces_camera = patch.slope * ahead_m < margins::FACING * down_m;
    patch.rim || !faces_camera
}
