//! What moving things and their shadows sweep within the window of a frame.

use camsim_core::scene::{Aabb, Scene};
use glam::DVec3;

use super::{outline::Swept, thing::Thing};

/// Most segments of the path of a shadow.
const MOST_PARTS: f64 = 64.0;

/// All that moves, part by part, with the paths of the shadows between two path times.
pub(super) fn all_that_moves(scene: &Scene, things: &[Thing], window_s: [f64; 2]) -> Vec<Swept> {
    let swept_of = |thing: &Thing| {
        let Thing { motion, bounds, parts } = thing;
        let swept = |bounds: &Aabb, segments_ned_m| Swept::new(motion.clone(), *bounds, segments_ned_m, 0.0);
        let shadow = shadow_segments(scene, &motion.bounds(bounds, window_s[0], window_s[1]));
        let shadow = (!shadow.is_empty()).then(|| swept(bounds, shadow));
        let parts = parts.iter().map(|part| swept(part, vec![[DVec3::ZERO; 2]]));
        parts.chain(shadow).map(|swept| swept.shaken_as(bounds)).collect::<Vec<_>>()
    };
    things.iter().flat_map(swept_of).collect()
}

/// Segments of the path of a box along the sun's rays on which it may meet something that stands still and has
/// sunlight.
fn shadow_segments(scene: &Scene, caster: &Aabb) -> Vec<[DVec3; 2]> {
    let Some(light) = scene.light.filter(|light| light.shadows) else { return Vec::new() };
    let is_lit = |mesh: &&camsim_core::scene::Mesh| mesh.motion.is_none() && mesh.shape.has_normals();
    let models: Vec<Aabb> = scene.meshes.iter().filter(is_lit).map(|mesh| mesh.bounds()).collect();
    let ground = scene.terrain.as_ref().map_or(Aabb::EMPTY, |terrain| terrain.bounds);
    let catchers = models.iter().fold(ground, |all, each| all.union(each));
    if catchers.is_empty() || caster.is_empty() {
        return Vec::new();
    }
    let away = -light.to_sun_ned;
    let length_m = distance_to_leave_m(caster, &catchers, away);
    let size_m = (caster.max - caster.min).length();
    let part_m = (length_m / MOST_PARTS).max(size_m).max(f64::MIN_POSITIVE);
    let parts = (length_m / part_m).ceil() as u32;
    let segments = (0..parts).map(|k| [k, k + 1].map(|end| (f64::from(end) * part_m).min(length_m) * away));
    let may_meet = |[from, to]: &[DVec3; 2]| {
        let part = Aabb { min: caster.min + from.min(*to), max: caster.max + from.max(*to) };
        let terrain = scene.terrain.as_ref();
        terrain.is_some_and(|terrain| terrain.may_meet(&part))
            || models.iter().any(|model| model.meets(&part))
    };
    segments.filter(may_meet).collect()
}

/// How far a box goes along a direction until it has left another one, or will never meet it.
fn distance_to_leave_m(moving: &Aabb, other: &Aabb, direction: DVec3) -> f64 {
    let leave = |axis: usize| {
        let room_m = if direction[axis] > 0.0 {
            other.max[axis] - moving.min[axis]
        } else {
            moving.max[axis] - other.min[axis]
        };
        let speed = direction[axis].abs();
        if speed > 1e-9 { room_m / speed } else { f64::INFINITY }
    };
    leave(0).min(leave(1)).min(leave(2)).max(0.0)
}
