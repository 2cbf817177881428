#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::{DQuat, EulerRot};

use super::*;
use camsim_core::scene::{Encoding, Terrain, Texture};

const VIEW: [f64; 4] = [-0.6, 0.6, -0.5, 0.5];

fn hills(height_m: f64) -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| height_m * (f64::from(i % 129) * 0.3).sin() * (f64::from(i / 129) * 0.2).cos())
        .collect();
    Scene {
        terrain: Some(Terrain::from_heights(129, 129, 20.0, &heights, None).unwrap()),
        ..Scene::default()
    }
}

/// Camera at a height, its axis `pitch_deg` above the horizon (-90 = straight down), towards north.
fn pose(height_m: f64, pitch_deg: f64) -> CameraPose {
    let body = DQuat::from_euler(EulerRot::ZYX, 0.0, pitch_deg.to_radians(), 0.0);
    let body_from_camera = DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X));
    CameraPose { position_ned_m: DVec3::new(0.0, 0.0, -height_m), ned_from_camera: body * body_from_camera }
}

fn none(scene: &Scene, pose: &CameraPose) -> bool {
    SceneOutline::new(scene).reason_for_none(scene, pose, VIEW, 1.0).is_some()
}

#[test]
fn terrain_has_silhouettes_only_where_it_may_turn_away_or_end() {
    // Slopes up to 0.3 (of 20 m) under a view that goes down by 1 in 0.8 at least.
    assert!(none(&hills(20.0), &pose(400.0, -90.0)));
    // Slopes above 1.
    assert!(!none(&hills(150.0), &pose(600.0, -90.0)));
    // The horizon.
    assert!(!none(&hills(20.0), &pose(400.0, -20.0)));
    // So high that the border is in view.
    assert!(!none(&hills(20.0), &pose(4000.0, -90.0)));
    // Up.
    assert!(none(&hills(20.0), &pose(400.0, 80.0)));
    // Below the surface's top: nothing is known.
    assert!(!none(&hills(20.0), &pose(5.0, -90.0)));
}

#[test]
fn the_patch_tree_agrees_with_its_blocks() {
    let heights: Vec<f64> = (0..300 * 200)
        .map(|i| 60.0 * (f64::from(i % 300) * 0.09).sin() * (f64::from(i / 300) * 0.05).cos())
        .collect();
    let scene = Scene {
        terrain: Some(Terrain::from_heights(300, 200, 20.0, &heights, None).unwrap()),
        ..Scene::default()
    };
    let outline = SceneOutline::new(&scene);
    let blocks = &outline.terrain.levels[0];
    assert_eq!((blocks.size, outline.terrain.levels.len()), ([38, 25], 7));
    let (mut edges, mut none) = (0, 0);
    for i in 0..400_u32 {
        let [x, y, height, pitch] =
            camsim_core::noise::pcg4d([i, 7, 0, 0]).map(|bits| f64::from(bits >> 8) / f64::from(1 << 24));
        let mut pose = pose(100.0 + 1500.0 * height, -90.0 + 60.0 * pitch);
        pose.position_ned_m += DVec3::new(3000.0 * (x - 0.5), 4000.0 * (y - 0.5), 0.0);
        let frustum = Frustum::new(&pose, VIEW);
        let expected = blocks.patches.iter().any(|block| may_end_or_turn(&frustum, block, &pose, 1.0));
        assert_eq!(outline.terrain.any(0, &|patch| may_end_or_turn(&frustum, patch, &pose, 1.0)), expected);
        (edges, none) = if expected { (edges + 1, none) } else { (edges, none + 1) };
    }
    assert!(edges > 50 && none > 50, "{edges} {none}");
}

#[test]
fn voids_end_a_surface() {
    let mut heights = vec![0.0; 65 * 65];
    heights[32 * 65 + 32] = f64::NAN;
    let scene = Scene {
        terrain: Some(Terrain::from_heights(65, 65, 20.0, &heights, None).unwrap()),
        ..Scene::default()
    };
    assert!(!none(&scene, &pose(200.0, -90.0)));
}

#[test]
fn a_flat_mesh_has_silhouettes_only_with_its_border_in_view() {
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let picture = Mesh::level_picture(texture, DVec3::ZERO, 1000.0);
    let scene = Scene { meshes: vec![picture.clone()], ..Scene::default() };
    assert!(none(&scene, &pose(200.0, -90.0)));
    assert!(!none(&scene, &pose(2000.0, -90.0)));
    assert!(!none(&scene, &pose(200.0, -10.0)));
    let mut two = scene.clone();
    two.meshes.push(Mesh { origin_ned_m: DVec3::new(0.0, 0.0, -50.0), ..picture.clone() });
    assert!(!none(&two, &pose(200.0, -90.0)));
    // An arrow-shaped piece is flat, but may leave a gap between the corners.
    let mut arrow = picture;
    Arc::make_mut(&mut arrow.shape).vertices[0].position_m = [-100.0, 100.0, 0.0];
    assert!(!is_flat_convex(&arrow));
}

#[test]
fn poses_that_are_not_numbers_do_not_panic() {
    let mut wrong = pose(400.0, -90.0);
    wrong.position_ned_m.z = f64::NAN;
    // Out of sight or not facing: both are answers, a panic is none.
    let _ = none(&hills(20.0), &wrong);
}
