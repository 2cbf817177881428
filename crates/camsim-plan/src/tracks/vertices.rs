//! Corners of the models.

use std::{
    collections::{BTreeSet, HashMap, HashSet},
    sync::Arc,
};

use camsim_core::{
    row_time::WorldPoint,
    scene::{Aabb, Mesh, Scene, Shape},
    tracks::{TrackPoint, thinned},
};
use glam::DVec3;

use super::views::Views;
use crate::planner::Planner;

/// Corners that the first try looks at, at most, for each point that is wanted.
const CORNERS_A_POINT: usize = 16;
/// How many times more the next try looks at.
const MORE: usize = 8;
/// Looks of one try through all cameras, at most, unless the first try needs more.
const MOST_LOOKS: usize = 100_000_000;
/// Bits of each coordinate of a position on the Z-order curve.
const BITS: u32 = 20;

/// A corner of a mesh.
struct Corner {
    mesh: usize,
    vertex: u32,
    /// Of what moves, at path time 0.
    position_ned_m: DVec3,
}

/// Corners of the models that the frames see, at most `count`, evenly thinned along a Z-order curve: many where
/// the models have many.
pub(super) fn corners(planner: &Planner, views: &Views, count: usize, seed: u64) -> Vec<TrackPoint> {
    let (scene, surfaces) = (&planner.sequence().scene, planner.surfaces());
    let spec = &planner.sequence().scenario.scene;
    // The loader puts pattern and board before the models.
    let first = usize::from(spec.pattern.is_some()) + usize::from(spec.board.is_some());
    let used = used_vertices(scene, first);
    let all: usize = used.iter().map(|used| used.len()).sum();
    let mut looked_at = CORNERS_A_POINT * count;
    let most = looked_at.max(MOST_LOOKS / views.cameras.len().max(1));
    let seen = loop {
        let step = all.div_ceil(looked_at.min(most)).max(1);
        let corners = distinct(scene, first, &used, step);
        let seen = views.seen(surfaces, corners, |corner| {
            let motion = scene.meshes[corner.mesh].motion.as_deref();
            WorldPoint::on(motion, corner.position_ned_m, 0.0)
        });
        if seen.len() >= count || step == 1 || looked_at >= most {
            break seen;
        }
        looked_at *= MORE;
    };
    let point = |Corner { mesh, vertex, position_ned_m }| TrackPoint {
        source: "vertices".into(),
        name: format!("{}/{vertex}", mesh_name(scene, mesh, first)),
        position_ned_m,
        moves_with: scene.meshes[mesh].motion.as_ref().map(|_| mesh),
    };
    thinned(along_curve(seen), count, seed).into_iter().map(point).collect()
}

/// Vertices that triangles use, by mesh from `first` on; meshes of one shape share the list.
fn used_vertices(scene: &Scene, first: usize) -> Vec<Arc<Vec<u32>>> {
    let mut known: HashMap<*const Shape, Arc<Vec<u32>>> = HashMap::new();
    let used = |shape: &Shape| shape.indices.iter().copied().collect::<BTreeSet<u32>>().into_iter().collect();
    let of_mesh = |mesh: &Mesh| {
        known.entry(Arc::as_ptr(&mesh.shape)).or_insert_with(|| Arc::new(used(&mesh.shape))).clone()
    };
    scene.meshes.iter().skip(first).map(of_mesh).collect()
}

/// Every `step`-th corner, without those at a position that another has which moves, or stands, with it.
fn distinct(scene: &Scene, first: usize, used: &[Arc<Vec<u32>>], step: usize) -> Vec<Corner> {
    let all = (first..).zip(used).flat_map(|(mesh, used)| used.iter().map(move |&vertex| (mesh, vertex)));
    let mut known = HashSet::new();
    let corner = |(mesh, vertex): (usize, u32)| {
        let position_ned_m = scene.meshes[mesh].position_ned_m(vertex);
        // 0 and -0 are equal.
        let bits = position_ned_m.to_array().map(|value| (value + 0.0).to_bits());
        let motion = scene.meshes[mesh].motion.as_ref().map(Arc::as_ptr);
        known.insert((bits, motion)).then_some(Corner { mesh, vertex, position_ned_m })
    };
    all.step_by(step).filter_map(corner).collect()
}

/// Corners in the order of a Z-order curve through the box around them.
fn along_curve(mut corners: Vec<Corner>) -> Vec<Corner> {
    let mut bounds = Aabb::EMPTY;
    corners.iter().for_each(|corner| bounds.include(corner.position_ned_m));
    let size_m = (bounds.max - bounds.min).max_element().max(f64::MIN_POSITIVE);
    let scale = f64::from((1_u32 << BITS) - 1) / size_m;
    let order = |corner: &Corner| {
        let whole = ((corner.position_ned_m - bounds.min) * scale).to_array().map(|value| value as u64);
        let bit = |b: u32, k: u32| ((whole[k as usize] >> b) & 1) << (3 * b + k);
        (0..BITS).flat_map(|b| (0..3).map(move |k| (b, k))).map(|(b, k)| bit(b, k)).sum::<u64>()
    };
    corners.sort_by_cached_key(|corner| (order(corner), corner.mesh, corner.vertex));
    corners
}

/// Name of the object that a mesh belongs to, or the mesh's number among the models.
fn mesh_name(scene: &Scene, mesh: usize, first: usize) -> String {
    let object = scene.meshes[mesh].object.checked_sub(1).and_then(|i| scene.objects.get(i as usize));
    let name = object.map(|object| object.name.clone()).filter(|name| !name.is_empty());
    name.unwrap_or_else(|| format!("mesh{}", mesh - first))
}
