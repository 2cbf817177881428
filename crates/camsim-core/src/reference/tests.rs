#![allow(clippy::unwrap_used)]

use std::{sync::Arc, time::Instant};

use glam::{DQuat, DVec2, DVec3, EulerRot};

use super::*;
use crate::{
    mount::CameraPath,
    pose::BodyState,
    scenario::{FlightSpec, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec},
    scene::{Encoding, Mesh, Scene, Terrain, Texture},
    trajectory::Trajectory,
};

fn scenario() -> Scenario {
    let flight = FlightSpec {
        log: "in-memory".into(),
        format: Default::default(),
        angles: Default::default(),
        attitude: Default::default(),
        origin: Default::default(),
        height: Default::default(),
        window_s: None,
        speed: 1.0,
    };
    let mut scenario = Scenario {
        seed: 12,
        flight,
        tracker: Default::default(),
        camera: Default::default(),
        scene: Default::default(),
        quality: Default::default(),
        output: Default::default(),
    };
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario
}

/// Constant velocity and body rate from t = -5 s on.
fn steady(position_ned_m: DVec3, velocity_ned_m_s: DVec3, rate_body_rad_s: DVec3) -> Trajectory {
    let state = BodyState {
        position_ned_m,
        velocity_ned_m_s,
        acceleration_ned_m_s2: DVec3::ZERO,
        ned_from_body: DQuat::from_euler(EulerRot::ZYX, 0.4, 0.05, -0.03),
        rate_body_rad_s,
        angular_acceleration_body_rad_s2: DVec3::ZERO,
    };
    Trajectory::uniform(-5.0, 10.0, 5.0, vec![state]).unwrap()
}

fn sequence(scenario: Scenario, trajectory: Trajectory, scene: Scene) -> Arc<Sequence> {
    let path = CameraPath::new(trajectory, &scenario.camera.mount).unwrap();
    Arc::new(Sequence {
        scenario,
        path: Arc::new(path),
        epoch_ns: 0,
        start_s: 0.0,
        frames: 100,
        scene: Arc::new(scene),
        vignette: None,
        zoom_track: Vec::new(),
    })
}

fn checker() -> Arc<Texture> {
    let rgba8 = (0..64 * 64).flat_map(|i| if (i % 64 / 8 + i / 64 / 8) % 2 == 0 { [255, 255, 255, 255] } else { [0, 0, 0, 255] });
    Arc::new(Texture { size_px: [64, 64], rgba8: rgba8.collect(), encoding: Encoding::Linear })
}

fn hills(side: u32, cell_m: f64) -> Terrain {
    let height = |i: u32| {
        let (x, y) = (f64::from(i % side), f64::from(i / side));
        40.0 * (0.07 * x).sin() * (0.05 * y).cos() + 12.0 * (0.31 * x + 0.23 * y).sin()
    };
    let heights: Vec<f64> = (0..side * side).map(height).collect();
    Terrain::from_heights(side, side, cell_m, &heights, Some(checker())).unwrap()
}

/// Boxes on a plane.
fn town(count: usize) -> Scene {
    let mut scene = Scene { sky_linear: [0.2, 0.4, 0.8], ..Scene::default() };
    scene.meshes.push(Mesh::level_picture(checker(), DVec3::ZERO, 4000.0));
    let mut random = (0..).map(|i| shift(i));
    for _ in 0..count {
        let [n, e, w, h] = [0; 4].map(|_: i32| random.next().unwrap());
        let at = DVec3::new(800.0 * (n - 0.5), 800.0 * (e - 0.5), 0.0);
        scene.meshes.push(block(at, 5.0 + 15.0 * w, 5.0 + 35.0 * h));
    }
    scene
}

fn shift(i: u64) -> f64 {
    (i as f64 * 0.618_033_988_749_894_9 + 0.1).fract()
}

fn block(at: DVec3, half_m: f64, height_m: f64) -> Mesh {
    let mut mesh = Mesh::level_picture(checker(), at, 1.0);
    let corner = |k: u32| {
        let side = |bit: u32| if k >> bit & 1 == 1 { half_m as f32 } else { -half_m as f32 };
        let down = if k >> 2 & 1 == 1 { -height_m as f32 } else { 0.0 };
        crate::scene::MeshVertex { position_m: [side(0), side(1), down], uv: [(k & 1) as f32, (k >> 1 & 1) as f32] }
    };
    mesh.vertices = (0..8).map(corner).collect();
    let faces = [[4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    mesh.indices = faces.iter().flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect();
    mesh
}

fn rolling(exposure_ms: f64) -> ShutterSpec {
    ShutterSpec { readout_ms: 33.0, exposure_ms, ..ShutterSpec::default() }
}

fn s3() -> LensSpec {
    LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.428129, 0.158059, 0.000245, -0.002286, -0.029194] }
}

/// Fast enough to measure every pixel of a frame; printed, and bounded loosely because machines differ.
#[test]
fn a_look_takes_microseconds() {
    let mut with_lens = scenario();
    with_lens.camera.shutter = rolling(8.0);
    with_lens.camera.focal_px = [307.96; 2];
    with_lens.camera.lens = s3();
    let mut plain = with_lens.clone();
    plain.camera.lens = LensSpec::default();
    let trajectory = steady(DVec3::new(0.0, 0.0, -200.0), DVec3::new(30.0, 5.0, 0.0), DVec3::new(0.1, 0.2, 0.3));
    let ground = Scene { terrain: Some(hills(1024, 10.0)), ..Scene::default() };
    for (name, scenario, scene) in [
        ("town, pinhole", &plain, town(300)),
        ("town, folding lens", &with_lens, town(300)),
        ("terrain, pinhole", &plain, ground.clone()),
        ("terrain, folding lens", &with_lens, ground),
    ] {
        let begin = Instant::now();
        let oracle = Oracle::new(sequence(scenario.clone(), trajectory.clone(), scene)).unwrap();
        let prepared = begin.elapsed();
        let begin = Instant::now();
        let mut hits = 0;
        for y in (0..480).step_by(4) {
            for x in (0..640).step_by(4) {
                hits += u32::from(oracle.look(0, [x, y], DVec2::ZERO, 0.1).is_some_and(|look| look.hit.is_some()));
            }
        }
        let each_us = begin.elapsed().as_secs_f64() * 1e6 / (120.0 * 160.0);
        eprintln!("{name}: {each_us:.2} us a look ({hits} hits), prepared in {prepared:.2?}");
        assert!(hits > 8_000 && each_us < 50.0);
    }
}

#[test]
fn rays_agree_with_a_look_at_every_triangle() {
    let scene = Scene { terrain: Some(hills(150, 10.0)), ..town(40) };
    let oracle = Oracle::new(sequence(scenario(), steady(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO), scene.clone())).unwrap();
    let terrain = scene.terrain.as_ref().unwrap();
    let (mut hits, mut misses) = (0, 0);
    for i in 0..4000 {
        let r = |k: u64| {
            2.0 * (f64::from(i) * [0.754_877_666, 0.569_840_291, 0.819_172_513, 0.671_043_607, 0.549_700_478][k as usize]).fract() - 1.0
        };
        let origin = DVec3::new(600.0 * r(0), 600.0 * r(1), -60.0 + 80.0 * r(2));
        let direction = DVec3::new(r(3), r(4), 0.3 * r(1) + 0.1);
        let found = oracle.cast(origin, direction);
        // The renderer's own queries, written by others, serve as the check here.
        let ground = terrain.intersect(origin, direction, f64::INFINITY).map(|hit| (hit.t, hit.uv));
        let all = scene.meshes.iter().filter_map(|mesh| mesh.intersect(origin, direction, f64::INFINITY)).chain(ground);
        let expected = all.min_by(|a, b| a.0.total_cmp(&b.0));
        match (found, expected) {
            (Some(found), Some(expected)) => {
                assert!((found.depth_m - expected.0).abs() < 1e-8 * (1.0 + expected.0), "{i}: {found:?} {expected:?}");
                hits += 1;
            }
            (None, None) => misses += 1,
            other => panic!("{i}: {other:?}"),
        }
    }
    assert!(hits > 1000 && misses > 100, "{hits} {misses}");
}
