//! Ground beyond its texture has the configured colour, from every view and with every renderer.

mod common;

use std::sync::Arc;

use camsim_core::{
    scenario::{Channel, MountSpec},
    scene::{Encoding, Scene, Terrain, Texture, linear_from_srgb},
};
use camsim_plan::Backend;
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

const GREY: u8 = 118;
/// Half of the picture's side on the ground, metres; its texels are 1 m wide.
const HALF_M: f64 = 250.0;
const MARGIN: u32 = 64;

/// Level ground of 8 km, a picture of red and yellow in the middle.
fn ground() -> Scene {
    let side = 2 * HALF_M as u32;
    let picture = Texture {
        size_px: [side; 2],
        rgba8: (0..side * side)
            .flat_map(|i| {
                [250, if (i % side / 3 + i / side / 3).is_multiple_of(2) { 20 } else { 60 }, 10, 255]
            })
            .collect(),
        encoding: Encoding::Srgb,
    };
    let grey = [GREY, GREY, GREY, 255];
    let texture = picture.padded(MARGIN, grey);
    let across = f64::from(side + 2 * MARGIN);
    let positions = || {
        (0..201_u32 * 201).map(|i| [f64::from(i % 201) * 40.0 - 4000.0, 4000.0 - f64::from(i / 201) * 40.0])
    };
    let points: Vec<DVec3> = positions().map(|[east, north]| DVec3::new(north, east, 0.0)).collect();
    let uvs: Vec<[f32; 2]> = positions()
        .map(|[east, north]| [(east / across + 0.5) as f32, (0.5 - north / across) as f32])
        .collect();
    let mut terrain = Terrain::new(201, 201, &points, &uvs, Arc::new(texture)).expect("a terrain");
    terrain.beyond = Some(grey);
    Scene { terrain: Some(terrain), sky_linear: [0.0, 0.0, 1.0], ..Scene::default() }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ground_beyond_the_texture_has_one_colour() {
    let scene = ground();
    let light = linear_from_srgb(f32::from(GREY) / 255.0);
    for (pitch_deg, height_m) in [(-90.0, 700.0), (-90.0, 3500.0), (-35.0, 400.0), (-8.0, 60.0)] {
        for (name, backend, limit_px) in
            [("cpu", Backend::Cpu, None), ("gpu", Backend::Gpu, None), ("tiles", Backend::Gpu, Some(512))]
        {
            let mut engine = engine();
            engine.set_backend(backend);
            if let Some(limit_px) = limit_px {
                engine.limit_pictures(limit_px);
            }
            let mut scenario = scenario();
            scenario.camera.size_px = [160, 120];
            scenario.camera.focal_px = [120.0, 120.0];
            scenario.camera.mount = MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() };
            let sequence =
                sequence(scenario, steady(height_m, 20.0, DVec3::ZERO, DVec3::ZERO), scene.clone());
            let frame =
                render(&engine, &sequence, &[Channel::Color, Channel::Coords, Channel::Depth], 0).frame;
            let (coords, depth) = (frame.coords().expect("coords"), frame.depth_m().expect("depth"));
            let (mut beyond, mut inside, mut worst) = (0, 0, 0.0_f32);
            for (i, color) in frame.color_rgba().chunks_exact(4).enumerate() {
                let at = [5, 6].map(|k| f64::from(coords[i][k]).abs());
                if depth[i] <= 0.0 {
                    continue;
                }
                // A pixel of 1/120 reaches farther the flatter it is looked at; the filter reads as far
                // again, and colours end within a texel.
                let range_m = f64::from(depth[i]) * (1.0 + 0.7_f64.powi(2)).sqrt();
                let reach_m = 2.0 + 2.0 * range_m / 120.0 * (range_m / height_m);
                if at[0].max(at[1]) > HALF_M + reach_m {
                    beyond += 1;
                    worst = (0..3).map(|k| (color[k] - light).abs()).fold(worst, f32::max);
                } else if at[0].max(at[1]) < HALF_M - reach_m {
                    inside += 1;
                    assert!(
                        color[0] > 0.8 && color[1] < 0.08 && color[2] < 0.02,
                        "{name} {pitch_deg} {at:?}: {color:?}"
                    );
                }
            }
            eprintln!(
                "{name}, {pitch_deg} deg, {height_m} m: {beyond} pixels beyond, {inside} inside, off by \
                 {:.4}/255",
                255.0 * worst
            );
            assert!(beyond > 1000 && inside > 10, "{beyond} {inside}");
            assert!(worst < 1e-3, "{name} {pitch_deg}: {worst}");
        }
    }
}
