//! Lamps of half a pixel to ten have their light, at rest and in motion, on every renderer: radiance times area.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{CameraSpec, Channel, FieldOr, LensModel, LensSpec, Readout, ShutterSpec},
    scene::{Encoding, Mesh, Scene, Texture, Wrap},
    sequence::Sequence,
};
use camsim_plan::Backend;
use common::{engine, render, scenario, sequence, steady};
use glam::{DMat3, DVec2, DVec3};

const HEIGHT_M: f64 = 100.0;
const FOCAL_PX: f64 = 300.0;
const M_A_PX: f64 = HEIGHT_M / FOCAL_PX;
const SIZE_PX: [u32; 2] = [128, 128];
const LIGHT: f32 = 20.0;
const EXPOSURE_S: f64 = 0.1;
/// Sides of squares, pixels.
const SIDES_PX: [f64; 6] = [0.5, 1.0, 2.0, 3.6, 6.0, 10.0];

/// Four turned lamps, one in each quarter of the picture, as far above the ground as stated.
fn lamps(side_px: f64, streak_px: f64, above_m: f64, change: impl FnOnce(&mut CameraSpec)) -> Arc<Sequence> {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    (camera.size_px, camera.focal_px) = (SIZE_PX, [FOCAL_PX; 2]);
    camera.mount.angles_deg = [0.0, -90.0, 0.0];
    camera.shutter = ShutterSpec { exposure_ms: 1e3 * EXPOSURE_S, ..ShutterSpec::default() };
    // Nothing ends at white.
    camera.photometric.light = 1.0 / f64::from(LIGHT);
    change(camera);
    let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    let ground = Mesh::level_picture(black.clone(), DVec3::ZERO, 400.0);
    // Nearer to the camera, so smaller for the same picture.
    let nearer = 1.0 - above_m / HEIGHT_M;
    let lamp = |k: u32| {
        let quarter = DVec2::new(f64::from(k % 2), f64::from(k / 2)) - 0.5;
        let shift = DVec2::new(f64::from(k) * 0.754_878, f64::from(k) * 0.569_84).fract();
        let at_m = nearer * M_A_PX * (64.0 * quarter + shift);
        let middle = DVec3::new(at_m.x, at_m.y, -above_m - 0.01);
        let flat = Mesh::level_picture(black.clone(), DVec3::ZERO, nearer * M_A_PX * side_px);
        let turn = DMat3::from_rotation_z(0.4 * f64::from(k));
        let mut lamp = Mesh { origin_ned_m: middle, ned_from_shape: turn, ..flat };
        lamp.material.emissive = [LIGHT; 3];
        lamp.material.wrap = [Wrap::Clamp; 2];
        lamp
    };
    let meshes = std::iter::once(ground).chain((0..4).map(lamp)).collect();
    let speed_m_s = DVec3::new(streak_px * nearer * M_A_PX / EXPOSURE_S, 0.0, 0.0);
    let scene = Scene { meshes, ..Scene::default() };
    sequence(scenario, steady(HEIGHT_M, 0.0, speed_m_s, DVec3::ZERO), scene)
}

/// Light of each quarter of a picture over that of a lamp.
fn fractions(color_rgba: &[f32], side_px: f64) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (i, pixel) in color_rgba.chunks_exact(4).enumerate() {
        let (x, y) = (i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]);
        sums[(2 * (y / 64) + x / 64) as usize] += f64::from(pixel[1]);
    }
    sums.map(|sum| sum / (side_px * side_px))
}

fn worst(found: &[f64; 4]) -> f64 {
    found.iter().map(|fraction| (fraction - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn small_lamps_have_their_light() {
    for (streak_px, above_m) in [(0.0, 0.0), (3.0, 5.0), (30.0, 5.0)] {
        for side_px in SIDES_PX {
            let sequence = lamps(side_px, streak_px, above_m, |_| {});
            let exact = ReferenceRenderer::new(sequence.clone()).expect("a reference");
            let exact = fractions(exact.render(0, &RenderOptions::default()).color_rgba(), side_px);
            eprintln!("{side_px} px, streak {streak_px} px, {above_m} m, reference: {exact:.3?}");
            // Its samples are 1024 a pixel: 256 in all meet a lamp of half a pixel, with 6 % for random ones.
            assert!(worst(&exact) < 0.08, "{side_px} {streak_px} {above_m}: {exact:?}");
            for backend in [Backend::Cpu, Backend::Gpu] {
                let mut engine = engine();
                engine.set_backend(backend);
                let found = render(&engine, &sequence, &[Channel::Color], 0).frame.into_color();
                let found = fractions(&found, side_px);
                eprintln!("{side_px} px, streak {streak_px} px, {above_m} m, {backend:?}: {found:.3?}");
                assert!(worst(&found) < 0.04, "{side_px} {streak_px} {above_m}, {backend:?}: {found:?}");
            }
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn small_lamps_have_their_light_through_a_lens_and_a_readout() {
    let lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.8, 0.3, 0.002, -0.001] };
    let rolling = ShutterSpec { exposure_ms: 60.0, readout_ms: 80.0, ..ShutterSpec::default() };
    let columns = ShutterSpec { readout: Readout::RightToLeft, ..rolling.clone() };
    let fields =
        ShutterSpec { interlace_ms: FieldOr::Ms(15.0), exposure_ms: 0.0, readout_ms: 5.0, ..rolling.clone() };
    for (name, shutter) in [("rows", rolling), ("columns", columns), ("fields", fields)] {
        for side_px in [0.5, 2.0] {
            let sequence = lamps(side_px, 12.0, 5.0, |camera| {
                (camera.shutter, camera.lens) = (shutter.clone(), lens.clone());
            });
            let options = RenderOptions { max_samples: 4096, ..RenderOptions::default() };
            let exact = ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options);
            let exact = fractions(exact.color_rgba(), side_px);
            for backend in [Backend::Cpu, Backend::Gpu] {
                let mut engine = engine();
                engine.set_backend(backend);
                let found = render(&engine, &sequence, &[Channel::Color], 0).frame.into_color();
                let found = fractions(&found, side_px);
                let fraction: [f64; 4] = std::array::from_fn(|i| found[i] / exact[i]);
                eprintln!("{name}, {side_px} px, {backend:?}: {fraction:.3?}");
                // Both have 1000 rays or more through a lamp of half a pixel.
                assert!(worst(&fraction) < 0.05, "{name} {side_px} {backend:?}: {fraction:?}");
            }
        }
    }
}
