//! The image sensor counts the same electrons whichever renderer brings the light.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, ImageSensorSpec, Mosaic, TwinSpec},
    scene::Scene,
    sequence::Sequence,
};
use camsim_plan::Backend;
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

/// A coloured sky on a Bayer sensor of one electron a number.
fn sky() -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [80, 60];
    scenario.camera.focal_px = [80.0, 80.0];
    scenario.camera.photometric.noise_sigma = 0.0;
    scenario.camera.shutter.exposure_ms = 4.0;
    scenario.camera.sensor = Some(ImageSensorSpec {
        white_e: Some(3000.0),
        gain_e_per_dn: Some(1.0),
        black_dn: 50.0,
        read_noise_e: Some(3.0),
        dsnu_e: Some(2.0),
        prnu: Some(0.01),
        dark_current_e_s: Some(500.0),
        mosaic: Mosaic::Grbg,
        ..ImageSensorSpec::default()
    });
    let scene = Scene { sky_linear: [0.25, 0.5, 0.75], ..Scene::default() };
    sequence(scenario, steady(100.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene)
}

fn by_reference(sequence: &Arc<Sequence>) -> RenderedFrame {
    ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &RenderOptions::default())
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_renderer_gives_the_same_numbers() {
    let sequence = sky();
    let exact = by_reference(&sequence);
    let expected = exact.raw().expect("a raw picture");
    assert_eq!((expected.channels, expected.values.len()), (1, 80 * 60));
    for backend in [Backend::Cpu, Backend::GpuThenCpu, Backend::Gpu] {
        let mut engine = engine();
        engine.set_backend(backend);
        let frame = render(&engine, &sequence, &[Channel::Color], 0).frame;
        let raw = frame.raw().expect("a raw picture");
        let different = raw.values.iter().zip(&expected.values).filter(|(a, b)| a != b).count();
        let largest = raw.values.iter().zip(&expected.values).map(|(a, b)| a.abs_diff(*b)).max();
        // Halves hold these colours; sums of their taps may round by 1e-7 of 3000 electrons.
        assert!(different <= 5 && largest <= Some(1), "{backend:?}: {different}");
    }
}

#[test]
fn a_twin_without_noise_keeps_its_exposure() {
    let sequence = sky();
    let twin = sequence
        .twin(&TwinSpec { name: "ideal".into(), ideal: true, ..TwinSpec::default() }, None)
        .expect("a twin");
    let frame = by_reference(&Arc::new(twin));
    let levels = [0.25_f32, 0.5, 0.75];
    let raw = frame.raw().expect("a raw picture");
    // Green, red; blue, green.
    for (i, &value) in raw.values.iter().enumerate() {
        let (x, y) = (i % 80, i / 80);
        let level = levels[match (x % 2, y % 2) {
            (1, 0) => 0,
            (0, 1) => 2,
            _ => 1,
        }];
        assert_eq!(f32::from(value), 50.0 + 3000.0 * level, "{x} {y}");
    }
}
