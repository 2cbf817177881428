//! What a camera sees of the ground, from above.

use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    scene::{Mesh, Scene},
};
use glam::{DVec2, DVec3};

/// Directions from the middle of the picture.
const DIRECTIONS: u32 = 48;
/// Places along each, from the border inwards, where something is looked for.
const PLACES: u32 = 12;
/// Halvings of the way between two of them: to less than a pixel.
const HALVINGS: u32 = 9;
/// Surfaces of more triangles are no ground.
const FLAT_TRIANGLES: usize = 2;

/// The outermost ground that is seen in directions all around the picture, closed; `None` where there is none
/// in a direction. Where a lens folds, the picture's corners have no rays, and beyond the horizon or beside
/// the terrain rays meet nothing: then it is what is seen last.
pub fn footprint(scene: &Scene, camera: &CameraModel, pose: &CameraPose) -> Vec<Vec<DVec3>> {
    let meets = |uv: DVec2| ground(scene, pose, pose.ned_from_camera * uv.extend(1.0));
    let mut runs: Vec<Vec<DVec3>> = vec![Vec::new()];
    for k in 0..=DIRECTIONS {
        let angle = std::f64::consts::TAU * f64::from(k % DIRECTIONS) / f64::from(DIRECTIONS);
        match (outermost(camera, DVec2::from_angle(angle), meets), runs.last_mut()) {
            (Some(point), Some(run)) => run.push(point),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// What `of` says of the ray of the outermost pixel for which it says anything, from the middle of the
/// picture in a direction of it.
pub fn outermost<T>(camera: &CameraModel, direction: DVec2, of: impl Fn(DVec2) -> Option<T>) -> Option<T> {
    let size_px = DVec2::new(f64::from(camera.size_px[0]), f64::from(camera.size_px[1]));
    let half_px = 0.5 * (size_px - 1.0);
    let to_border = (half_px / direction.abs().max(DVec2::splat(1e-12))).min_element();
    let at = |share: f64| camera.unproject(half_px + share * to_border * direction).and_then(&of);
    let share = |place: u32| f64::from(place) / f64::from(PLACES);
    let (place, mut best) = (0..=PLACES).rev().find_map(|place| Some((place, at(share(place))?)))?;
    if place == PLACES {
        return Some(best);
    }
    let (mut low, mut high) = (share(place), share(place + 1));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match at(middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Some(best)
}

/// The nearest of terrain, pattern and board along a ray.
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

/// Patterns and boards are two triangles.
pub fn is_flat(mesh: &Mesh) -> bool {
    mesh.shape.indices.len() <= 3 * FLAT_TRIANGLES
}

#[cfg(test)]
mod tests {
    use camsim_core::scenario::{CameraSpec, LensModel, LensSpec};
    use glam::DQuat;

    use super::*;

    /// Straight down from 100 m above a wide level picture.
    fn above() -> (Scene, CameraPose) {
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
    fn straight_down_it_is_the_picture_enlarged() {
        let (scene, pose) = above();
        let runs = footprint(&scene, &camera(&[]), &pose);
        let [run] = runs.as_slice() else { panic!("one run: {runs:?}") };
        assert_eq!(run.first(), run.last(), "closed");
        // 100 m below, a pixel is a metre: half of the picture is 100 x 50 m.
        for point in run {
            let away = (point.truncate() - DVec2::new(10.0, 20.0)).abs() / DVec2::new(100.0, 50.0);
            assert!((away.max_element() - 1.0).abs() < 1e-9, "{point} on the border of the picture");
        }
    }

    #[test]
    fn where_a_lens_folds_it_is_what_the_lens_shows() {
        let (scene, pose) = above();
        // r (1 - r^2 / 4) grows up to r = sqrt(4/3), where it is 0.7698: 77 px of the 100 to the left border.
        let runs = footprint(&scene, &camera(&[-0.25, 0.0, 0.0, 0.0]), &pose);
        let widest = runs.iter().flatten().map(|point| (point.x - 10.0).abs()).fold(0.0, f64::max);
        let fold_m = 100.0 * (4.0_f64 / 3.0).sqrt();
        assert!(widest > 0.9 * fold_m && widest <= fold_m + 1e-6, "{widest} of {fold_m} m");
    }

    #[test]
    fn beside_the_ground_it_is_what_is_seen_last() {
        let (mut scene, pose) = above();
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
    fn what_looks_at_the_sky_has_none() {
        let (scene, mut pose) = above();
        pose.ned_from_camera = DQuat::from_rotation_y(std::f64::consts::PI);
        assert!(footprint(&scene, &camera(&[]), &pose).is_empty());
    }
}
