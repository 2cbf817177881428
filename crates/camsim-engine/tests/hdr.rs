//! Light above white reaches the image sensor: it fills the full well, and spreads over a streak.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, ImageSensorSpec, Mosaic, ShutterSpec},
    scene::{Encoding, Mesh, Scene, Texture},
    sequence::Sequence,
};
use camsim_plan::Backend;
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

const HEIGHT_M: f64 = 100.0;
const FOCAL_PX: f64 = 300.0;
const SIZE_PX: [u32; 2] = [48, 160];
const SPEED_M_S: f64 = 66.0;
/// Four pixels: as many centres are within at any shift of the ideal frame.
const WIDTH_M: f64 = 4.0 * HEIGHT_M / FOCAL_PX;
/// Light of the glint, and electrons of white.
const GLINT: f32 = 20.0;
const WHITE_E: f64 = 1000.0;

/// A glint on black ground, straight below the aircraft.
fn glint(exposure_ms: f64, full_well_e: f64) -> Arc<Sequence> {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    (camera.size_px, camera.focal_px) = (SIZE_PX, [FOCAL_PX; 2]);
    camera.mount.angles_deg = [0.0, -90.0, 0.0];
    camera.shutter = ShutterSpec { exposure_ms, ..ShutterSpec::default() };
    camera.sensor = Some(ImageSensorSpec {
        white_e: Some(WHITE_E),
        full_well_e: Some(full_well_e),
        gain_e_per_dn: Some(1.0),
        bits: Some(16),
        shot_noise: false,
        mosaic: Mosaic::Mono,
        ..ImageSensorSpec::default()
    });
    let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    let mut ground = Mesh::level_picture(black.clone(), DVec3::ZERO, 400.0);
    ground.material.emissive = [0.01; 3];
    let mut lamp = Mesh::level_picture(black, DVec3::new(0.0, 0.0, -0.01), WIDTH_M);
    lamp.material.emissive = [GLINT; 3];
    let scene = Scene { meshes: vec![ground, lamp], ..Scene::default() };
    sequence(scenario, steady(HEIGHT_M, 0.0, DVec3::new(SPEED_M_S, 0.0, 0.0), DVec3::ZERO), scene)
}

/// The frame by every renderer.
fn by_all(sequence: &Arc<Sequence>) -> Vec<(String, RenderedFrame)> {
    // So short a flash is missed by a few samples.
    let options = RenderOptions { min_samples: 1024, max_samples: 1024, ..RenderOptions::default() };
    let exact = ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options);
    let mut all = vec![("reference".to_owned(), exact)];
    for backend in [Backend::Cpu, Backend::GpuThenCpu, Backend::Gpu] {
        let mut engine = engine();
        engine.set_backend(backend);
        all.push((format!("{backend:?}"), render(&engine, sequence, &[Channel::Color], 0).frame));
    }
    all
}

fn numbers(frame: &RenderedFrame) -> &[u16] {
    &frame.raw().expect("a raw picture").values
}

/// Light of the glint's picture, in whites times pixels: without the ground's.
fn light_px(frame: &RenderedFrame) -> f64 {
    let area_px = (WIDTH_M * FOCAL_PX / HEIGHT_M).powi(2);
    let all: f64 = numbers(frame).iter().map(|&dn| f64::from(dn) / WHITE_E).sum();
    all - 0.01 * (f64::from(SIZE_PX[0] * SIZE_PX[1]) - area_px)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_glint_keeps_its_light_however_it_is_blurred() {
    let expected = f64::from(GLINT) * (WIDTH_M * FOCAL_PX / HEIGHT_M).powi(2);
    for exposure_ms in [1.0, 100.0, 500.0] {
        for (name, frame) in by_all(&glint(exposure_ms, 1e6)) {
            let found = light_px(&frame);
            assert!((found / expected - 1.0).abs() < 0.01, "{exposure_ms} ms, {name}: {found} {expected}");
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_sharp_glint_fills_the_well_and_a_streak_has_its_fraction_of_the_light() {
    // Sharp: all of its pixels are full.
    for (name, frame) in by_all(&glint(1.0, WHITE_E)) {
        let full = numbers(&frame).iter().filter(|&&dn| dn == WHITE_E as u16).count();
        assert!((9..=25).contains(&full), "{name}: {full}");
        assert!(numbers(&frame).iter().all(|&dn| f64::from(dn) <= WHITE_E), "{name}");
    }
    // Over 99 pixels each has the light for as long as the glint takes to pass.
    let long_s = 0.5;
    let streak_px = SPEED_M_S * long_s * FOCAL_PX / HEIGHT_M;
    let expected = WHITE_E * f64::from(GLINT) * (WIDTH_M * FOCAL_PX / HEIGHT_M) / streak_px;
    for (name, frame) in by_all(&glint(1e3 * long_s, WHITE_E)) {
        let middle = (SIZE_PX[0] / 2 - 1) as usize;
        let along = (60..100).map(|y| f64::from(numbers(&frame)[y * SIZE_PX[0] as usize + middle]));
        let mean = along.sum::<f64>() / 40.0;
        // The ground is seen for the rest of the time.
        assert!((mean - 10.0 - expected).abs() < 0.015 * expected, "{name}: {mean} {expected}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn without_a_sensor_values_end_at_white() {
    let mut plain = Sequence::clone(&glint(1.0, WHITE_E));
    plain.scenario.camera.sensor = None;
    for (name, frame) in by_all(&Arc::new(plain)) {
        let most = frame.color_rgba().iter().copied().fold(0.0, f32::max);
        assert_eq!(most, 1.0, "{name}");
    }
}
