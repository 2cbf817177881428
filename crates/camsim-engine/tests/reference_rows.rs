//! Two independent methods for a rolling-shutter frame over terrain: rays of the reference renderer, and one gpu
//! frame per row with a global shutter at the instant of that row.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Channel, MountSpec, Scenario, ShutterSpec},
    scene::{Encoding, Scene, Terrain, Texture},
    sequence::Sequence,
    trajectory::Trajectory,
};
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

const CHANNELS: [Channel; 3] = [Channel::Color, Channel::Depth, Channel::Coords];

/// Hills with a smooth picture on them, nowhere seen along the slope: what is compared are rays, not texture
/// filters.
fn hills() -> Scene {
    const SIDE: u32 = 201;
    let height = |i: u32| {
        let (x, y) = (f64::from(i % SIDE), f64::from(i / SIDE));
        15.0 * (0.11 * x).sin() * (0.07 * y).cos() + 2.0 * (0.41 * x + 0.33 * y).sin()
    };
    let level = |i: u32, k: f64| {
        let turn = std::f64::consts::TAU * k / f64::from(SIDE);
        (127.5 + 100.0 * (turn * f64::from(i % SIDE)).sin() * (turn * f64::from(i / SIDE)).cos()).round()
            as u8
    };
    let rgba8 = (0..SIDE * SIDE).flat_map(|i| [level(i, 6.0), level(i, 9.0), level(i, 4.0), 255]).collect();
    let texture = Texture { size_px: [SIDE, SIDE], rgba8, encoding: Encoding::Linear };
    let heights: Vec<f64> = (0..SIDE * SIDE).map(height).collect();
    let terrain =
        Terrain::from_heights(SIDE, SIDE, 10.0, &heights, Some(Arc::new(texture))).expect("a terrain");
    Scene { terrain: Some(terrain), sky_linear: [0.2, 0.4, 0.8], ..Scene::default() }
}

fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [200, 150];
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    // An ideal frame of its own with a pixel for each of the camera's, so that nothing lies between pixels;
    // and the full surface, as the reference has it.
    scenario.quality.frames_per_ideal = 1;
    scenario.quality.ideal_scale = Auto::Value(1.0);
    scenario.quality.max_terrain_error_px = 1e-6;
    scenario
}

fn flight() -> Trajectory {
    steady(220.0, 30.0, DVec3::new(60.0, 25.0, -8.0), DVec3::new(0.3, -0.2, 0.5))
}

/// The same flight through a camera without a shutter, whose frame 0 has its stamp at an instant.
fn at_instant(t_s: f64) -> Arc<Sequence> {
    let mut still = Sequence::clone(&sequence(camera(), flight(), hills()));
    still.start_s = t_s;
    Arc::new(still)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn reference_agrees_with_global_shutter_frames_per_row() {
    let mut rolling = camera();
    rolling.camera.shutter = ShutterSpec { delay_ms: 20.0, readout_ms: 60.0, ..ShutterSpec::default() };
    let reference = ReferenceRenderer::new(sequence(rolling, flight(), hills())).expect("a reference");
    let options =
        RenderOptions { channels: CHANNELS.to_vec(), tolerance_dn: 0.1, ..RenderOptions::default() };
    let truth = reference.render(0, &options);
    let (depths, coords) = (truth.depth_m().expect("depth"), truth.coords().expect("coords"));
    let engine = engine();
    let (mut worst_point_px, mut worst_depth, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    // At the top, in the middle and at the bottom, which are 60 ms and 4 m apart.
    for row in [0_u32, 31, 75, 112, 149] {
        let t_s = 0.060 * ((f64::from(row) + 0.5) / 150.0 - 0.5) - 0.020;
        let done = render(&engine, &at_instant(t_s), &CHANNELS, 0).frame;
        let (their_depths, their_coords) = (done.depth_m().expect("depth"), done.coords().expect("coords"));
        for i in (row * 200) as usize..(row * 200 + 200) as usize {
            let point = |coords: &[f32; 8]| {
                DVec3::new(f64::from(coords[5]), f64::from(coords[6]), f64::from(coords[7]))
            };
            let depth = f64::from(depths[i]);
            assert!(depth > 100.0 && truth.color_rgba()[4 * i + 3] == 1.0, "row {row}: {depth}");
            worst_point_px =
                worst_point_px.max(point(&coords[i]).distance(point(&their_coords[i])) / depth * 160.0);
            worst_depth = worst_depth.max((f64::from(their_depths[i]) / depth - 1.0).abs());
            for channel in 0..3 {
                squares +=
                    f64::from(truth.color_rgba()[4 * i + channel] - done.color_rgba()[4 * i + channel])
                        .powi(2);
                count += 1.0;
            }
        }
    }
    let psnr_db = -10.0 * (squares / count).log10();
    eprintln!("points within {worst_point_px:.1e} px, depth within {worst_depth:.1e}, light {psnr_db:.1} dB");
    // f32 on the device: 1.2e-4 px at most is what a reprojection costs (a sum of rounding errors in pose,
    // direction and depth). What depth is off lies along the ray, and points are with it.
    const MOST_DEPTH: f64 = 2e-6;
    assert!(
        worst_point_px < 1.2e-4 + 160.0 * worst_depth && worst_depth < MOST_DEPTH,
        "{worst_point_px} {worst_depth}"
    );
    // With the anisotropic filter off this is 56.7 dB. Mesa's software filter reads steps instead of a ramp
    // where a picture is magnified.
    assert!(psnr_db > 37.0, "{psnr_db}");
}
