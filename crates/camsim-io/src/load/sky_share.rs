//! Warns if the pictures of a flight over terrain are mostly sky.

use camsim_core::{camera::CameraModel, scene::Aabb, sequence::Sequence};
use glam::{DVec2, DVec3};

/// Number of frames that are sampled.
const FRAMES: u64 = 25;
/// Number of sampled pixels along each side of a frame.
const SAMPLES_PER_SIDE: u32 = 12;
/// Share of sky from which it is reported; a level camera sees half of it.
const MOST_SKY: f64 = 0.75;

/// Warns how much of the frames is sky, from samples of frames and pixels of a fixed lens. Models and patterns count
/// as the boxes around them.
pub(super) fn sky_warning(sequence: &Sequence) -> Option<String> {
    let scene = &sequence.scene;
    let terrain = scene.terrain.as_ref()?;
    let camera = CameraModel::from_spec(&sequence.scenario.camera).ok()?;
    let [width_px, height_px] = camera.size_px.map(f64::from);
    let boxes: Vec<Aabb> = scene.meshes.iter().map(|mesh| mesh.bounds()).collect();
    let (mut all, mut sky) = (0_u32, 0_u32);
    for frame in (0..sequence.frames).step_by(sequence.frames.div_ceil(FRAMES).max(1) as usize) {
        let pose = sequence.path.pose(sequence.start_s + frame as f64 / sequence.scenario.camera.fps);
        for (x, y) in (0..SAMPLES_PER_SIDE).flat_map(|y| (0..SAMPLES_PER_SIDE).map(move |x| (x, y))) {
            let [u, v] = [x, y].map(|n| (f64::from(n) + 0.5) / f64::from(SAMPLES_PER_SIDE));
            let pixel = DVec2::new(u * width_px - 0.5, v * height_px - 0.5);
            let Some(ray) = camera.ray(pixel) else { continue };
            let direction = pose.ned_from_camera * ray;
            all += 1;
            let sees = terrain.intersect(pose.position_ned_m, direction, f64::INFINITY).is_some()
                || boxes.iter().any(|bounds| is_hit(bounds, pose.position_ned_m, direction));
            sky += u32::from(!sees);
        }
    }
    let share = f64::from(sky) / f64::from(all.max(1));
    (share > MOST_SKY).then(|| {
        format!(
            "about {:.0} % of the pictures is sky, or places where the terrain has no heights: check camera.mount, \
             flight.height and the place of the terrain",
            100.0 * share
        )
    })
}

/// Whether a ray meets a box.
fn is_hit(bounds: &Aabb, from: DVec3, direction: DVec3) -> bool {
    let [a, b] = [bounds.min, bounds.max].map(|corner| (corner - from) / direction);
    // NaN, of a ray within a side, counts as a hit of it.
    let (enters, leaves) = (a.min(b), a.max(b));
    enters.max_element().max(0.0) <= leaves.min_element() || enters.is_nan() || leaves.is_nan()
}
