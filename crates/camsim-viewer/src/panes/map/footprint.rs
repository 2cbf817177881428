//! Footprint of a camera: the outline of the ground that it sees.

use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    scene::{Mesh, Scene},
};
use glam::{DVec2, DVec3};

/// Directions from the middle of the picture in which the outline is searched.
const DIRECTIONS: u32 = 48;
/// Steps of the search along each direction, from the border inwards.
const STEPS: u32 = 12;
/// Bisections of a step, to less than a pixel.
const BISECTIONS: u32 = 9;
/// Triangles of a flat mesh (pattern or board), at most.
const FLAT_TRIANGLES: usize = 2;

/// Outline of the visible ground in directions all around the picture, NED; one run if all directions see
/// ground. Where outer pixels have no ray (beyond the fold of a lens) or hit nothing (beyond the horizon),
/// the outline is at the last ground towards the border.
pub fn footprint(scene: &Scene, camera: &CameraModel, pose: &CameraPose) -> Vec<Vec<DVec3>> {
    let ground_point = |ray: DVec3| ground(scene, pose, pose.ned_from_camera * ray);
    let mut runs: Vec<Vec<DVec3>> = vec![Vec::new()];
    for k in 0..=DIRECTIONS {
        let angle = std::f64::consts::TAU * f64::from(k % DIRECTIONS) / f64::from(DIRECTIONS);
        match (outermost(camera, DVec2::from_angle(angle), ground_point), runs.last_mut()) {
            (Some(point), Some(run)) => run.push(point),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// The value of `evaluate` at the unit ray of the outermost pixel, in a direction from the middle of the picture,
/// for which it has one.
pub fn outermost<T>(
    camera: &CameraModel,
    direction: DVec2,
    evaluate: impl Fn(DVec3) -> Option<T>,
) -> Option<T> {
    let size_px = DVec2::new(f64::from(camera.size_px[0]), f64::from(camera.size_px[1]));
    let half_px = 0.5 * (size_px - 1.0);
    let to_border = (half_px / direction.abs().max(DVec2::splat(1e-12))).min_element();
    let value_at = |fraction: f64| camera.ray(half_px + fraction * to_border * direction).and_then(&evaluate);
    let fraction = |step: u32| f64::from(step) / f64::from(STEPS);
    let (step, mut best) = (0..=STEPS).rev().find_map(|step| Some((step, value_at(fraction(step))?)))?;
    if step == STEPS {
        return Some(best);
    }
    let (mut low, mut high) = (fraction(step), fraction(step + 1));
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        match value_at(middle) {
            Some(value) => (low, best) = (middle, value),
            None => high = middle,
        }
    }
    Some(best)
}

/// The first point of terrain, pattern or board along a ray, NED.
pub fn ground(scene: &Scene, pose: &CameraPose, direction_ned: DVec3) -> Option<DVec3> {
    let origin = pose.position_ned_m;
    let terrain = scene
        .terrain
        .as_ref()
        .and_then(|terrain| terrain.intersect(origin, direction_ned, f64::INFINITY))
        .map(|hit| hit.t);
    let flat = scene.meshes.iter().filter(|mesh| is_flat(mesh));
    let nearest =
        flat.filter_map(|mesh| mesh.intersect(origin, direction_ned, f64::INFINITY)).map(|(t, _)| t);
    let t = nearest.chain(terrain).min_by(f64::total_cmp)?;
    Some(origin + t * direction_ned)
}

/// Whether a mesh is a pattern or board: two triangles.
pub fn is_flat(mesh: &Mesh) -> bool {
    mesh.shape.indices.len() <= 3 * FLAT_TRIANGLES
}

#[cfg(test)]
mod tests {
    use camsim_core::scenario::{CameraSpec, LensModel, LensSpec};
    use glam::DQuat;

    use super::*;

    /// A wide level picture, and a camera that looks straight down from 100 m above.
    fn nadir_view() -> (Scene, CameraPose) {
        let texture = camsim_core::scene::Texture::uniform([255; 4], camsim_core::scene::Encoding::Srgb);
        let level = Mesh::level_picture(std::sync::Arc::new(texture), DVec3::ZERO, 1e4);
        let down =
            CameraPose { position_ned_m: DVec3::new(10.0, 20.0, -100.0), ned_from_camera: DQuat::IDENTITY };
        (Scene { meshes: vec![level], ..Scene::default() }, down)
    }

    fn camera(coefficients: &[f64]) -> CameraModel {
        let spec = CameraSpec {
            size_px: [201, 101],
            focal_px: [100.0, 100.0],
            lens: LensSpec { model: LensModel::BrownConrady, coefficients: coefficients.to_vec() },
            ..CameraSpec::default()
        };
        CameraModel::from_spec(&spec).expect("a camera")
    }

    #[test]
    fn nadir_footprint_is_the_scaled_picture() {
        let (scene, pose) = nadir_view();
        let runs = footprint(&scene, &camera(&[]), &pose);
        let [run] = runs.as_slice() else { panic!("one run: {runs:?}") };
        assert_eq!(run.first(), run.last(), "closed");
        // From 100 m a pixel covers 1 m: half the picture is 100 x 50 m.
        for point in run {
            let away = (point.truncate() - DVec2::new(10.0, 20.0)).abs() / DVec2::new(100.0, 50.0);
            assert!((away.max_element() - 1.0).abs() < 1e-9, "{point} on the border of the picture");
        }
    }

    #[test]
    fn footprint_ends_at_the_fold_of_the_lens() {
        let (scene, pose) = nadir_view();
        // r (1 - r^2 / 4) grows up to r = sqrt(4/3), where it is 0.7698: 77 px of the 100 to the left border.
        let runs = footprint(&scene, &camera(&[-0.25, 0.0, 0.0, 0.0]), &pose);
        let widest = runs.iter().flatten().map(|point| (point.x - 10.0).abs()).fold(0.0, f64::max);
        let fold_m = 100.0 * (4.0_f64 / 3.0).sqrt();
        assert!(widest > 0.9 * fold_m && widest <= fold_m + 1e-6, "{widest} of {fold_m} m");
    }

    #[test]
    fn footprint_ends_at_the_border_of_the_ground() {
        let (mut scene, pose) = nadir_view();
        // 60 x 60 m about the origin, the camera above (10, 20): all of it is in the picture, which shows 200
        // x 100 m.
        let texture = camsim_core::scene::Texture::uniform([255; 4], camsim_core::scene::Encoding::Srgb);
        scene.meshes = vec![Mesh::level_picture(std::sync::Arc::new(texture), DVec3::ZERO, 60.0)];
        let runs = footprint(&scene, &camera(&[]), &pose);
        let [run] = runs.as_slice() else { panic!("one run: {runs:?}") };
        for point in run {
            let away = (point.truncate().abs() / 30.0).max_element();
            assert!((away - 1.0).abs() < 0.01, "{point} on the border of the ground");
        }
    }

    #[test]
    fn a_camera_that_sees_only_sky_has_no_footprint() {
        let (scene, mut pose) = nadir_view();
        pose.ned_from_camera = DQuat::from_rotation_y(std::f64::consts::PI);
        assert!(footprint(&scene, &camera(&[]), &pose).is_empty());
    }
}
