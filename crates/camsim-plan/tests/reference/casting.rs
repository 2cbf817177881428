//! Rays against every triangle, and how long a look takes.

use std::time::Instant;

use camsim_core::{reference::ReferenceRenderer, scenario::LensSpec, scene::Scene};
use glam::{DVec2, DVec3};

use crate::fixtures::{Steady, folding, hills, rolling, scenario, sequence, town};

/// Fast enough to measure every pixel of a frame; printed, and bounded loosely because machines differ.
#[test]
fn a_look_takes_microseconds() {
    let mut with_lens = scenario();
    with_lens.camera.shutter = rolling(8.0);
    with_lens.camera.focal_px = [307.96; 2];
    with_lens.camera.lens = folding();
    let mut plain = with_lens.clone();
    plain.camera.lens = LensSpec::default();
    let ground = Scene { terrain: Some(hills(1024, 10.0)), ..Scene::default() };
    for (name, scenario, scene) in [
        ("town, pinhole", &plain, town(300)),
        ("town, folding lens", &with_lens, town(300)),
        ("terrain, pinhole", &plain, ground.clone()),
        ("terrain, folding lens", &with_lens, ground),
    ] {
        let begin = Instant::now();
        let reference =
            ReferenceRenderer::new(sequence(scenario.clone(), Steady::moving(200.0), scene)).unwrap();
        let prepared = begin.elapsed();
        let begin = Instant::now();
        let mut hits = 0;
        for y in (0..480).step_by(4) {
            for x in (0..640).step_by(4) {
                hits += u32::from(
                    reference.sample(0, [x, y], DVec2::ZERO, 0.1).is_some_and(|look| look.hit.is_some()),
                );
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
    let reference =
        ReferenceRenderer::new(sequence(scenario(), Steady::standing(DVec3::ZERO), scene.clone())).unwrap();
    let terrain = scene.terrain.as_ref().unwrap();
    let (mut hits, mut misses) = (0, 0);
    for i in 0..4000 {
        let even = [0.754_877_666, 0.569_840_291, 0.819_172_513, 0.671_043_607, 0.549_700_478];
        let r = |k: usize| 2.0 * (f64::from(i) * even[k]).fract() - 1.0;
        let origin = DVec3::new(600.0 * r(0), 600.0 * r(1), -60.0 + 80.0 * r(2));
        let direction = DVec3::new(r(3), r(4), 0.3 * r(1) + 0.1);
        let found = reference.cast(origin, direction);
        // The scene's own queries share no line with the reference's.
        let ground = terrain.intersect(origin, direction, f64::INFINITY).map(|hit| (hit.t, hit.uv));
        let all = scene
            .meshes
            .iter()
            .filter_map(|mesh| mesh.intersect(origin, direction, f64::INFINITY))
            .chain(ground);
        let expected = all.min_by(|a, b| a.0.total_cmp(&b.0));
        match (found, expected) {
            (Some(found), Some((t, uv))) => {
                assert!((found.depth_m - t).abs() < 1e-8 * (1.0 + t), "{i}: {found:?} {t}");
                // Where two surfaces meet, either's coordinates will do.
                let differ = (0..2).any(|k| (found.texture_uv[k] - uv[k]).abs() > 1e-7);
                hits += u32::from(!differ);
            }
            (None, None) => misses += 1,
            other => panic!("{i}: {other:?}"),
        }
    }
    assert!(hits > 2500 && misses > 1000, "{hits} {misses}");
}

/// Steep views through every vertex and along every edge of a grid: rays do not slip through where triangles
/// meet.
#[test]
fn no_ray_slips_through_at_vertices_and_edges() {
    let scene = Scene { terrain: Some(hills(20, 10.0)), ..Scene::default() };
    let reference =
        ReferenceRenderer::new(sequence(scenario(), Steady::standing(DVec3::ZERO), scene)).unwrap();
    for (tilt_n, tilt_e) in [(0.0, 0.0), (0.3, -0.2), (1.0, 1.0)] {
        // Quarters of a cell: vertices, middles of edges and of diagonals.
        for i in -16..=16 {
            for j in -16..=16 {
                let above = DVec3::new(
                    2.5 * f64::from(i) - 1000.0 * tilt_n,
                    2.5 * f64::from(j) - 1000.0 * tilt_e,
                    -1000.0,
                );
                assert!(
                    reference.cast(above, DVec3::new(tilt_n, tilt_e, 1.0)).is_some(),
                    "{i} {j} {tilt_n} {tilt_e}"
                );
            }
        }
    }
}
