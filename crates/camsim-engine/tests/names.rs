//! Noise depends on the name of the camera, equally on every renderer.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::Channel,
    scene::Scene,
    sequence::Sequence,
};
use camsim_plan::Backend;
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

/// Of one grey sky, so that what differs between two pixels is noise.
fn grey(name: &str) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.name = name.into();
    scenario.camera.size_px = [40, 30];
    scenario.camera.focal_px = [40.0, 40.0];
    scenario.camera.photometric.noise_sigma = 0.02;
    let scene = Scene { sky_linear: [0.5, 0.5, 0.5], ..Scene::default() };
    sequence(scenario, steady(100.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn cameras_of_one_seed_have_independent_noise() {
    let of = |name: &str, backend: Option<Backend>| {
        let sequence = grey(name);
        let Some(backend) = backend else {
            return ReferenceRenderer::new(sequence)
                .expect("a reference")
                .render(0, &RenderOptions::default())
                .into_color();
        };
        let mut engine = engine();
        engine.set_backend(backend);
        render(&engine, &sequence, &[Channel::Color], 0).frame.into_color()
    };
    let rms = |a: &[f32], b: &[f32]| {
        (a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / (0.75 * a.len() as f64)).sqrt()
    };
    let (unnamed, left, right) = (of("", None), of("left", None), of("right", None));
    for (a, b) in [(&unnamed, &left), (&unnamed, &right), (&left, &right)] {
        // Two independent values of sigma 0.02; 3600 of them, so within 1.2 % (one standard error).
        assert!((rms(a, b) / (2.0_f64.sqrt() * 0.02) - 1.0).abs() < 0.06, "{}", rms(a, b));
    }
    for backend in [Backend::GpuThenCpu, Backend::Gpu] {
        for (name, exact) in [("", &unnamed), ("left", &left)] {
            // 0.5 is stored with the 11 bits of a half at worst: 1/4096; the noise itself agrees to rounding.
            assert!(rms(&of(name, Some(backend)), exact) < 3e-4, "{backend:?} {name}");
        }
    }
}
